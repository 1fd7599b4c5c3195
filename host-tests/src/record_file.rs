//! Records of an acceleration: CSV with the columns `time_s` and `acceleration_mm_s2`.

use std::fmt;
use std::fs;
use std::path::Path;

use planner_core::identify::{LONGEST_S, Record, Refusal};

/// The columns that a record has to have; others are ignored.
const COLUMNS: [&str; 2] = ["time_s", "acceleration_mm_s2"];

/// How far a step in time may be from the mean step, and a time from its place, in mean steps.
const UNEVEN: f64 = 0.5;

/// A record with its times.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordFile {
    /// Its name.
    pub name: String,
    /// Time in s from the first sample on, and acceleration in mm/s².
    pub samples: Vec<(f64, f64)>,
    /// Samples a second.
    pub rate_hz: f64,
}

/// Why a record file cannot be used: one sentence with the file, the line and what to do.
#[derive(Debug)]
pub struct RecordFileError {
    file: String,
    /// From 1; none if it is about the file as a whole.
    line: Option<u64>,
    reason: String,
}

impl fmt::Display for RecordFileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.file)?;
        if let Some(line) = self.line {
            write!(f, ": line {line}")?;
        }
        write!(f, ": {}", self.reason)
    }
}

impl std::error::Error for RecordFileError {}

impl RecordFile {
    /// Reads a file.
    ///
    /// # Errors
    /// It cannot be read, or is no evenly sampled record.
    pub fn read(path: &Path) -> Result<Self, RecordFileError> {
        let name = path.display().to_string();
        match fs::read(path) {
            Ok(bytes) => Self::parse(&name, &bytes),
            Err(error) => Err(RecordFileError {
                file: name,
                line: None,
                reason: format!("the record cannot be read ({error}): check its name"),
            }),
        }
    }

    /// Reads a file's bytes.
    ///
    /// # Errors
    /// They are no evenly sampled record.
    pub fn parse(name: &str, bytes: &[u8]) -> Result<Self, RecordFileError> {
        let refused = |line: Option<u64>, reason: String| RecordFileError {
            file: name.to_owned(),
            line,
            reason,
        };
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .flexible(true)
            .from_reader(bytes);
        let header = reader.headers().map_err(|_| {
            refused(
                Some(1),
                "the header is not UTF-8: save the record as text".into(),
            )
        })?;
        let mut places = [0; COLUMNS.len()];
        for (place, column) in places.iter_mut().zip(COLUMNS) {
            let found = header.iter().position(|name| name == column);
            *place = found.ok_or_else(|| {
                let columns = COLUMNS.join(",");
                refused(
                    Some(1),
                    format!("there is no column {column}: begin the file with the line {columns}"),
                )
            })?;
        }
        let mut samples = Vec::new();
        let mut lines = Vec::new();
        for row in reader.records() {
            let row = row.map_err(|error| {
                let line = error.position().map(csv::Position::line);
                refused(
                    line,
                    "the line is not UTF-8: save the record as text".into(),
                )
            })?;
            let line = row.position().map(csv::Position::line);
            let mut values = [0.0; COLUMNS.len()];
            for ((value, place), column) in values.iter_mut().zip(places).zip(COLUMNS) {
                let text = row.get(place).unwrap_or_default();
                let number: Option<f64> = text.parse().ok();
                *value = number.filter(|value| value.abs() < 1e12).ok_or_else(|| {
                    refused(
                        line,
                        format!("{column} is {text:?} and no number below 1e12: correct the line"),
                    )
                })?;
            }
            samples.push((values[0], values[1]));
            lines.push(line);
        }
        let [(first_s, _), .., (last_s, _)] = samples[..] else {
            return Err(refused(
                None,
                "the record has less than two samples: record for longer".into(),
            ));
        };
        let step_s = (last_s - first_s) / (samples.len() - 1) as f64;
        // first of all, because the mean step means nothing where the order is wrong
        let standing = samples.windows(2).position(|pair| pair[1].0 <= pair[0].0);
        if let Some(at) = standing {
            return Err(refused(
                lines[at + 1],
                "the time does not go on: put the samples in order".into(),
            ));
        }
        for (at, (pair, line)) in samples.windows(2).zip(&lines[1..]).enumerate() {
            let step = pair[1].0 - pair[0].0;
            let place = first_s + (at + 1) as f64 * step_s;
            let is_even = (step - step_s).abs() <= UNEVEN * step_s
                && (pair[1].0 - place).abs() <= UNEVEN * step_s;
            if !is_even {
                return Err(refused(
                    *line,
                    format!(
                        "the time goes on by {step:.6} s, and by {step_s:.6} s on the average: sample evenly"
                    ),
                ));
            }
        }
        for sample in &mut samples {
            sample.0 -= first_s;
        }
        Ok(Self {
            name: name.to_owned(),
            samples,
            rate_hz: 1.0 / step_s,
        })
    }

    /// The record as the core takes it, of 2 s at the most.
    ///
    /// # Errors
    /// Its sampling rate is out of range.
    pub fn record(&self) -> Result<Record, Refusal> {
        let mut record = Record::at_rate(self.rate_hz as f32)?;
        for (_, acceleration) in &self.samples {
            record.push(*acceleration as f32);
        }
        Ok(record)
    }

    /// Its length in s.
    #[must_use]
    pub fn length_s(&self) -> f64 {
        self.samples.len() as f64 / self.rate_hz
    }

    /// The samples that are used.
    #[must_use]
    pub fn used(&self) -> &[(f64, f64)] {
        let count = (f64::from(LONGEST_S) * self.rate_hz).round() as usize;
        &self.samples[..self.samples.len().min(count)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<RecordFile, String> {
        RecordFile::parse("r.csv", text.as_bytes()).map_err(|error| error.to_string())
    }

    #[test]
    fn a_record_may_begin_at_any_time_and_have_other_columns() {
        let file = parse("x, acceleration_mm_s2, time_s\n1, 5, 7.000\n1, 6, 7.002\n1, 4, 7.004\n")
            .unwrap();
        assert_eq!(file.samples.len(), 3);
        assert!((file.rate_hz - 500.0).abs() < 1e-6);
        assert_eq!(file.samples[0], (0.0, 5.0));
        assert!((file.length_s() - 0.006).abs() < 1e-9);
    }

    #[test]
    fn bad_files_are_refused_with_their_line() {
        const HEADER: &str = "time_s,acceleration_mm_s2\n";
        for (body, words) in [
            (
                "",
                "r.csv: the record has less than two samples: record for longer",
            ),
            (
                "0,1\n0.001,x\n",
                "r.csv: line 3: acceleration_mm_s2 is \"x\" and no number below 1e12: correct the line",
            ),
            (
                "0,1\n0.001,NaN\n",
                "r.csv: line 3: acceleration_mm_s2 is \"NaN\" and no number below 1e12: correct the line",
            ),
            (
                "0,1\n0.001\n",
                "r.csv: line 3: acceleration_mm_s2 is \"\" and no number below 1e12: correct the line",
            ),
            (
                "0,1\n0.001,2\n0.001,3\n",
                "r.csv: line 4: the time does not go on: put the samples in order",
            ),
            (
                "0,1\n0.001,2\n0.003,3\n0.004,2\n",
                "r.csv: line 4: the time goes on by 0.002000 s, and by 0.001333 s on the average: sample evenly",
            ),
        ] {
            assert_eq!(parse(&format!("{HEADER}{body}")), Err(words.to_owned()));
        }
        let words = parse("t,a\n0,1\n").unwrap_err();
        assert_eq!(
            words,
            "r.csv: line 1: there is no column time_s: begin the file with the line time_s,acceleration_mm_s2"
        );
        let error =
            RecordFile::parse("r.csv", b"time_s,acceleration_mm_s2\n0,1\n\xFF,2\n").unwrap_err();
        assert_eq!(
            error.to_string(),
            "r.csv: line 3: the line is not UTF-8: save the record as text"
        );
    }
}
