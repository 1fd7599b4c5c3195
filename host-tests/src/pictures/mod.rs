//! Pictures of a run, as SVG.
//!
//! Colours are those of Okabe and Ito, which the colour-blind can tell apart; limits and
//! tolerances are drawn dashed in green.

mod canvas;
mod comparison;
mod feedrate;
mod identified;
mod limits;
mod path;
mod payload;
mod polyline;
mod profile;
mod vibration;

pub use comparison::ShownMotion;

use anyhow::Result;

use crate::commands::identify::Identification;
use crate::commands::profile::SimulatedMove;
use crate::paired_run::PairedRun;

/// Draws all pictures: file names and their text.
///
/// # Errors
/// Never in practice: the drawing goes to memory.
pub fn draw(run: &PairedRun) -> Result<Vec<(&'static str, String)>> {
    let mut pictures = vec![
        ("path.svg", path::draw(run)?),
        ("feedrate.svg", feedrate::draw(run)?),
        ("vibration.svg", vibration::draw(run)?),
    ];
    if let Some(config) = &run.payload {
        pictures.push(("payload.svg", payload::draw(run, config)?));
    }
    if let Some(picture) = limits::draw(run)? {
        pictures.push(("limits.svg", picture));
    }
    Ok(pictures)
}

/// Draws motions side by side.
///
/// # Errors
/// Never in practice: the drawing goes to memory.
pub fn draw_comparison(title: &str, subtitle: &str, motions: &[ShownMotion<'_>]) -> Result<String> {
    comparison::draw(title, subtitle, motions)
}

/// Draws the picture of a profile.
///
/// # Errors
/// Never in practice: the drawing goes to memory.
pub fn draw_profile(simulated: &SimulatedMove) -> Result<String> {
    profile::draw(simulated)
}

/// Draws the picture of a record with what was found in it.
///
/// # Errors
/// Never in practice: the drawing goes to memory.
pub fn draw_identified(identification: &Identification) -> Result<String> {
    identified::draw(identification)
}
