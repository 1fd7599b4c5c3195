//! The arguments that say more of a prefilter than its name and its mode.

use anyhow::{Context, Result};
use clap::Args;
use planner_core::prefilter::{CustomImpulse, Kind, PrefilterConfig};

use super::prefilter_parser;
use crate::robot_file::custom_impulses;

/// What a prefilter's name and mode leave open; flags that are not given change nothing.
#[derive(Args, Clone, Debug)]
pub struct CascadeArgs {
    /// Residual that shapers with ei in their name allow, as a fraction: 0.05 for 5 %.
    #[arg(long, value_name = "V")]
    v_tol: Option<f32>,
    /// Prefilter of a second mode, in cascade with the first one.
    #[arg(long, value_name = "NAME", value_parser = prefilter_parser(), ignore_case = true)]
    mode2_prefilter: Option<Kind>,
    /// Natural frequency of the second mode; 0 if there is none.
    #[arg(long, value_name = "HZ")]
    mode2_frequency: Option<f32>,
    /// Damping ratio of the second mode.
    #[arg(long, value_name = "Z")]
    mode2_damping: Option<f32>,
    /// Length of the boxes of box and s-curve; 0 for one period of the mode.
    #[arg(long, value_name = "MS")]
    box_ms: Option<f32>,
    /// Feedrate that s-curve reaches with its jerk.
    #[arg(long, value_name = "MM_S")]
    s_curve_feed: Option<f32>,
    /// Jerk of s-curve, whose boxes are then √(feed/jerk) long; 0 for those of --box-ms.
    #[arg(long, value_name = "MM_S3")]
    s_curve_jerk: Option<f32>,
    /// Box of a prefilter that has none; 0 for no smoothing.
    #[arg(long, value_name = "MS")]
    smoothing1_ms: Option<f32>,
    /// Second box of a prefilter that has fewer than two; 0 for no smoothing.
    #[arg(long, value_name = "MS")]
    smoothing2_ms: Option<f32>,
    /// Up to five impulses of custom, the first at time 0.
    #[arg(long, value_name = "MS:WEIGHT,…", value_delimiter = ',', value_parser = impulse)]
    impulses: Option<Vec<CustomImpulse>>,
}

impl CascadeArgs {
    /// Puts what is given into the settings.
    ///
    /// # Errors
    /// Too many impulses.
    pub fn apply(&self, prefilter: &mut PrefilterConfig) -> Result<()> {
        let second = &mut prefilter.second;
        let [smoothing1_ms, smoothing2_ms] = &mut prefilter.smoothing_ms;
        for (setting, flag) in [
            (&mut prefilter.v_tol, self.v_tol),
            (&mut second.frequency_hz, self.mode2_frequency),
            (&mut second.damping, self.mode2_damping),
            (&mut prefilter.box_ms, self.box_ms),
            (&mut prefilter.s_curve_feed_mm_s, self.s_curve_feed),
            (&mut prefilter.s_curve_jerk_mm_s3, self.s_curve_jerk),
            (smoothing1_ms, self.smoothing1_ms),
            (smoothing2_ms, self.smoothing2_ms),
        ] {
            *setting = flag.unwrap_or(*setting);
        }
        second.kind = self.mode2_prefilter.unwrap_or(second.kind);
        if let Some(impulses) = &self.impulses {
            prefilter.impulses = custom_impulses(impulses)
                .context("there are more than five impulses: check --impulses")?;
        }
        Ok(())
    }
}

fn impulse(text: &str) -> Result<CustomImpulse, String> {
    let parse = |text: &str| text.trim().parse::<f32>().ok();
    let (time, weight) = text.split_once(':').unwrap_or((text, ""));
    match (parse(time), parse(weight)) {
        (Some(time_ms), Some(weight)) => Ok(CustomImpulse { time_ms, weight }),
        _ => Err("give each impulse as its time in ms, a colon and its weight".into()),
    }
}
