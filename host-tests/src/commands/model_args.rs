//! The arguments that describe a prefilter: its name and the mode that it is made for.

use anyhow::Result;
use clap::Args;
use planner_core::prefilter::{Kind, Prefilter, PrefilterConfig};

use super::{CascadeArgs, prefilter_parser};

/// A prefilter and the mode that it is made for.
#[derive(Args, Clone, Debug)]
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
    #[command(flatten)]
    cascade: CascadeArgs,
}

impl ModelArgs {
    /// The settings described.
    ///
    /// # Errors
    /// Too many impulses.
    pub fn config(&self) -> Result<PrefilterConfig> {
        let mut config = PrefilterConfig {
            kind: self.prefilter,
            frequency_hz: self.frequency,
            damping: self.damping,
            ..PrefilterConfig::default()
        };
        self.cascade.apply(&mut config)?;
        Ok(config)
    }

    /// The prefilter described.
    ///
    /// # Errors
    /// The argument that is out of its range.
    pub fn prefilter(&self) -> Result<Prefilter> {
        Ok(Prefilter::new(&self.config()?)?)
    }
}
