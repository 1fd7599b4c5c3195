//! `stillpoint profile`: the profile of a move whose mode changes along its way.

use std::path::PathBuf;

use anyhow::{Result, ensure};
use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use comfy_table::presets::UTF8_HORIZONTAL_ONLY;
use comfy_table::{Attribute, Cell, CellAlignment, LineStyle, Table};
use planner_core::posture::{Course, Method, Profile, Zeros};
use planner_core::prefilter::Mode;
use serde::Serialize;

use super::output::write_picture;
use crate::pictures;
use crate::plant::{self, Answer, Base, Travel};

/// Arguments of `profile`.
#[derive(Args, Debug)]
#[command(allow_negative_numbers = true)]
pub struct ProfileArgs {
    /// Length of the move.
    #[arg(long, value_name = "MM")]
    length: f64,
    /// Feedrate asked for; a short move gets less.
    #[arg(long, value_name = "MM_S")]
    feed: f64,
    /// Natural frequency of the mode at the start.
    #[arg(long, value_name = "HZ")]
    start_frequency: f64,
    /// Natural frequency of the mode at the end.
    #[arg(long, value_name = "HZ")]
    end_frequency: f64,
    /// Damping ratio of the mode.
    #[arg(long, value_name = "Z")]
    damping: f64,
    /// How the zeros are placed: at the ends' frequencies (a), for the least amplitude over
    /// the frequencies met (b), b accelerating and a decelerating (hybrid), or one filter for
    /// both phases (fir).
    #[arg(long, value_name = "NAME", value_parser = method_parser(), ignore_case = true)]
    method: Method,
    /// Directory for a picture of the profile.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

fn method_parser() -> impl TypedValueParser<Value = Method> {
    PossibleValuesParser::new(Method::ALL.map(Method::name))
        .try_map(|name| Method::from_name(&name).ok_or("there is no such method"))
}

/// A move with what its mode does.
#[derive(Debug)]
pub struct SimulatedMove {
    /// The mode along the way.
    pub course: Course,
    /// The method that placed the zeros.
    pub method: Method,
    /// The zeros.
    pub zeros: Zeros,
    /// The commanded move.
    pub profile: Profile,
    /// What the mass on the mode does.
    pub answer: Answer,
}

#[derive(Serialize)]
struct Figures {
    f1_hz: f64,
    f2_hz: f64,
    f3_hz: f64,
    f4_hz: f64,
    feed_used_mm_s: f64,
    total_s: f64,
    overshoot_accelerating_percent: f64,
    settling_accelerating_s: Option<f64>,
    overshoot_decelerating_percent: f64,
    settling_decelerating_s: Option<f64>,
}

/// Runs the command; yields what it has to say.
///
/// # Errors
/// An argument out of its range or a picture that cannot be written, in one sentence.
pub fn execute(args: &ProfileArgs) -> Result<String> {
    ensure!(
        (0.0..1.0).contains(&args.damping),
        "the damping ratio of {} is not from 0 to below 1: check --damping",
        args.damping
    );
    let mode = |frequency_hz| Mode {
        frequency_hz,
        damping: args.damping,
    };
    let course = Course {
        start: mode(args.start_frequency),
        end: mode(args.end_frequency),
        length_mm: args.length,
    };
    let simulated = SimulatedMove::new(course, args.feed, args.method)?;
    let written = args
        .out
        .as_deref()
        .map(|directory| {
            let picture = pictures::draw_profile(&simulated)?;
            write_picture(directory, "profile.svg", &picture)
        })
        .transpose()?;
    if args.json {
        return Ok(serde_json::to_string(&simulated.figures())?);
    }
    let mut text = simulated.table();
    let choice = Method::choose(&course, args.feed)?;
    text += &format!("\nBy its length and feedrate this move gets\n{choice}.");
    if let Some(path) = written {
        text += &format!("\n\nLook at:\n  {}", path.display());
    }
    Ok(text)
}

impl SimulatedMove {
    /// Plans a move and simulates what its mode does.
    ///
    /// # Errors
    /// A value out of its range.
    pub fn new(course: Course, feed_mm_s: f64, method: Method) -> Result<Self> {
        let zeros = Profile::zeros(&course, feed_mm_s, method)?;
        let profile = Profile::new(course.length_mm, feed_mm_s, &zeros)?;
        let travel = Travel {
            base: |t_s| {
                let state = profile.at(t_s);
                Base {
                    position_mm: state.position_mm,
                    velocity_mm_s: state.velocity_mm_s,
                    acceleration_mm_s2: state.acceleration_mm_s2,
                }
            },
            mode: |travelled_mm| {
                let mode = course.mode_at(travelled_mm);
                plant::Mode {
                    frequency_hz: mode.frequency_hz,
                    damping: mode.damping,
                }
            },
            feed_mm_s: profile.feed_mm_s(),
            accelerated_s: profile.accelerating_s(),
            decelerates_s: profile.stop_s(),
            end_s: profile.total_s(),
        };
        let answer = travel.answer();
        Ok(Self {
            course,
            method,
            zeros,
            profile,
            answer,
        })
    }

    fn figures(&self) -> Figures {
        let [f1_hz, f2_hz, f3_hz, f4_hz] = self.zeros.all_hz();
        let answer = &self.answer;
        Figures {
            f1_hz,
            f2_hz,
            f3_hz,
            f4_hz,
            feed_used_mm_s: self.profile.feed_mm_s(),
            total_s: self.profile.total_s(),
            overshoot_accelerating_percent: answer.overshoot_accelerating_percent,
            settling_accelerating_s: answer.settling_accelerating_s,
            overshoot_decelerating_percent: answer.overshoot_decelerating_percent,
            settling_decelerating_s: answer.settling_decelerating_s,
        }
    }

    /// What it is, in words.
    #[must_use]
    pub fn headline(&self) -> String {
        let Course {
            start,
            end,
            length_mm,
        } = &self.course;
        format!(
            "{length_mm} mm at {} mm/s, {} to {} Hz, damping {}, method {}",
            (self.profile.feed_mm_s() * 1e3).round() / 1e3,
            start.frequency_hz,
            end.frequency_hz,
            start.damping,
            self.method.name()
        )
    }

    fn table(&self) -> String {
        let mut table = Table::new();
        let header = HEADER.map(|text| Cell::new(text).add_attribute(Attribute::Bold));
        table
            .load_style(UTF8_HORIZONTAL_ONLY.row_separator(LineStyle::none()))
            .set_header(header);
        let (profile, answer) = (&self.profile, &self.answer);
        let [accelerating_mm_s2, decelerating_mm_s2] = profile.acceleration_mm_s2();
        for (name, [one_hz, other_hz], lasts_s, acceleration_mm_s2, overshoot, settling_s) in [
            (
                "accelerating",
                self.zeros.accelerating_hz,
                profile.accelerating_s(),
                accelerating_mm_s2,
                answer.overshoot_accelerating_percent,
                answer.settling_accelerating_s,
            ),
            (
                "decelerating",
                self.zeros.decelerating_hz,
                profile.decelerating_s(),
                decelerating_mm_s2,
                answer.overshoot_decelerating_percent,
                answer.settling_decelerating_s,
            ),
        ] {
            table.add_row([
                name.to_owned(),
                format!("{one_hz:.4}, {other_hz:.4}"),
                format!("{lasts_s:.4}"),
                format!("{acceleration_mm_s2:.1}"),
                format!("{overshoot:.3} %"),
                settling_s.map_or_else(|| "-".into(), |s| format!("{s:.3}")),
            ]);
        }
        for column in table.column_iter_mut().skip(1) {
            column.set_cell_alignment(CellAlignment::Right);
        }
        format!(
            "{}\n{table}\n{:.6} s in all, {:.6} s of it at constant feedrate. Overshoot of the \
             mode's mass over its\nvelocity in % of the feedrate, and settling to ±0.1 % of it \
             after the phase; {:.3} % is\nleft after the end.",
            self.headline(),
            profile.total_s(),
            profile.cruise_s(),
            answer.residual_percent
        )
    }
}

const HEADER: [&str; 6] = [
    "phase",
    "zeros\nHz",
    "lasts\ns",
    "acceleration\nmm/s²",
    "overshoot",
    "settling\ns",
];
