//! A record of a free decay: what was measured, what was fitted, and the spectra of both.

use std::f64::consts::TAU;

use anyhow::Result;

use super::canvas::{
    COMMAND, CONTRAST, LIMIT, Point, axes, dashed, full, headed, limit, lines, note, picture,
};
use crate::commands::identify::Identification;

const SIZE: (u32, u32) = (1280, 900);

/// Frequencies of the spectrum.
const FREQUENCIES: u32 = 800;

/// Highest frequency that is shown, in Hz.
const SHOWN_HZ: f64 = 60.0;

/// Draws the picture.
pub fn draw(identification: &Identification) -> Result<String> {
    let record = identification.file.used();
    let found = &identification.found;
    let fit: Vec<Point> = record
        .iter()
        .map(|&(time_s, _)| (time_s, f64::from(found.at(time_s as f32))))
        .collect();
    let end = record.last().map_or(1.0, |sample| sample.0);
    let highest = record
        .iter()
        .map(|sample| sample.1)
        .fold(f64::MIN, f64::max);
    let lowest = record
        .iter()
        .map(|sample| sample.1)
        .fold(f64::MAX, f64::min);
    let room = 0.08 * (highest - lowest).max(f64::MIN_POSITIVE);
    let modes_hz: Vec<f64> = (identification.modes())
        .map(|mode| f64::from(mode.frequency_hz))
        .collect();
    let top_hz = modes_hz.iter().fold(SHOWN_HZ, |top, hz| top.max(1.2 * hz));
    let top_hz = top_hz.min(0.5 * identification.file.rate_hz);
    let spectra = [record, &fit].map(|samples| spectrum(samples, top_hz));
    let peak = spectra[0].iter().map(|point| point.1).fold(0.0, f64::max);
    let legend = [
        full(COMMAND, 4, "recorded"),
        full(CONTRAST, 1, "fitted"),
        limit("natural frequency"),
    ];
    picture(SIZE, |root| {
        let body = headed(
            root,
            &identification.file.name,
            &identification.in_words(),
            &legend,
        )?;
        let (_, height) = body.dim_in_pixel();
        let (upper, lower) = body.split_vertically(height / 2);
        let ranges = [(0.0, end), (lowest - room, highest + room)];
        let mut chart = axes(&upper, ranges, ["time, s", "acceleration, mm/s²"], [10, 6])?;
        lines(&mut chart, [record.to_vec()], COMMAND, 4)?;
        lines(&mut chart, [fit.clone()], CONTRAST, 1)?;
        let ranges = [(0.0, top_hz), (0.0, 1.2 * peak)];
        let mut chart = axes(
            &lower,
            ranges,
            ["frequency, Hz", "spectrum, mm/s²"],
            [12, 6],
        )?;
        let marks = modes_hz.iter().map(|&hz| vec![(hz, 0.0), (hz, 1.1 * peak)]);
        dashed(&mut chart, marks, LIMIT)?;
        for &hz in &modes_hz {
            note(
                &chart,
                &format!("{hz:.2} Hz"),
                (hz, 1.16 * peak),
                (0, 0),
                LIMIT,
            )?;
        }
        let [recorded, fitted] = spectra.clone();
        lines(&mut chart, [recorded], COMMAND, 4)?;
        lines(&mut chart, [fitted], CONTRAST, 1)
    })
}

/// Amplitude over frequency, under the window of Hann: a lasting sinusoid shows its amplitude.
fn spectrum(samples: &[Point], top_hz: f64) -> Vec<Point> {
    let count = samples.len() as f64;
    let mean = samples.iter().map(|sample| sample.1).sum::<f64>() / count;
    let windowed: Vec<Point> = (samples.iter().enumerate())
        .map(|(at, &(time_s, value))| {
            let hann = 1.0 - (TAU * (at as f64 + 0.5) / count).cos();
            (time_s, hann * (value - mean))
        })
        .collect();
    (0..=FREQUENCIES)
        .map(|step| top_hz * f64::from(step) / f64::from(FREQUENCIES))
        .map(|hz| {
            let (mut re, mut im) = (0.0, 0.0);
            for (time_s, value) in &windowed {
                let (sin, cos) = (TAU * hz * time_s).sin_cos();
                re += value * cos;
                im += value * sin;
            }
            (hz, 2.0 / count * re.hypot(im))
        })
        .collect()
}
