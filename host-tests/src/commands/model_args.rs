//! The arguments that describe a prefilter: its name and the mode that it is made for.

use clap::Args;
use planner_core::prefilter::{Kind, Prefilter, PrefilterConfig, PrefilterError};

use super::prefilter_parser;

/// A prefilter and the mode that it is made for.
#[derive(Args, Clone, Copy, Debug)]
pub struct ModelArgs {
    /// Prefilter.
    #[arg(long, value_name = "NAME", value_parser = prefilter_parser(), ignore_case = true)]
    pub prefilter: Kind,
    /// Natural frequency that the prefilter is made for.
    #[arg(long, value_name = "HZ")]
    pub frequency: f32,
    /// Damping ratio that the prefilter is made for.
    #[arg(long, value_name = "Z")]
    pub damping: f32,
}

impl ModelArgs {
    /// The prefilter described.
    ///
    /// # Errors
    /// The argument that is out of its range.
    pub fn prefilter(&self) -> Result<Prefilter, PrefilterError> {
        Prefilter::new(&PrefilterConfig {
            kind: self.prefilter,
            frequency_hz: self.frequency,
            damping: self.damping,
        })
    }
}
