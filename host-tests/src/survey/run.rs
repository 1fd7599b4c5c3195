//! From node to node.

use planner_core::posture::{MapNode, ModeMapConfig};
use planner_core::protocol::NO_RECORD;

use super::excitation::{Excitation, LENGTHS};
use super::fill::fill;
use super::grid::place;
use crate::link::codes;
use crate::sender::Answer;

/// Least confidence of a mode that counts as known.
const TRUSTED: f64 = 0.5;

/// A frequency that is off the middle one of its neighbours' by more than this factor is that of
/// another mode.
const ANOTHER_MODE: f64 = 2.0;

/// Neighbours that tell so at the least.
const WITNESSES: usize = 3;

/// How far a filled frequency may lie outside those that were measured, as a factor.
const BEYOND: f64 = 1.25;

/// `error:N` of a jog that leaves the robot's travel.
const OUT_OF_TRAVEL: u8 = 15;

/// `error:N` of an identification that found nothing.
const NOT_IDENTIFIED: u8 = 92;

/// A controller to which lines can be said.
pub trait Desk {
    /// Why it cannot be reached.
    type Error;

    /// Sends a line and waits for its answer.
    ///
    /// # Errors
    /// The link is lost.
    fn ask(&mut self, line: &str) -> Result<Answer, Self::Error>;

    /// Waits until the robot stands; tells the state that it is in if it will not.
    ///
    /// # Errors
    /// The link is lost.
    fn await_rest(&mut self) -> Result<Option<String>, Self::Error>;
}

/// A survey to be made.
#[derive(Clone, Debug)]
pub struct Survey<'a> {
    /// Its places, of which the modes do not count.
    pub grid: ModeMapConfig,
    /// The test move.
    pub excitation: Excitation,
    /// The command that identifies, as in `$ID`.
    pub command: &'a str,
}

/// What came of a node.
#[derive(Clone, Debug, PartialEq)]
pub enum Finding {
    /// The mode was identified.
    Measured {
        /// Natural frequency in Hz.
        frequency_hz: f64,
        /// Damping ratio.
        damping: f64,
        /// The probability of being right.
        confidence: f64,
    },
    /// The robot gets there, and no record could be trusted; why not the last one.
    Untrusted(String),
    /// No test move gets there; why not the last one.
    Unreachable(String),
}

/// A node that was visited.
#[derive(Clone, Debug, PartialEq)]
pub struct Visit {
    /// X and Y in mm.
    pub place_mm: [f64; 2],
    /// What was found.
    pub finding: Finding,
}

/// A node of the map that was made.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// How it was visited.
    pub visit: Visit,
    /// Frequency in Hz in the map.
    pub frequency_hz: f64,
    /// Damping ratio in the map.
    pub damping: f64,
}

/// Why there is no map.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SurveyError<E> {
    /// The controller cannot be reached.
    #[error("{0}")]
    Link(E),
    /// It refused a line, and would refuse it everywhere.
    #[error("{line} was refused: {reason}")]
    Refused {
        /// The line.
        line: String,
        /// The controller's sentence.
        reason: String,
    },
    /// The robot does not come to rest.
    #[error(
        "the robot does not come to rest, its state is {0}: see what stopped it, and begin again"
    )]
    Restless(String),
    /// An answer that is none.
    #[error("the controller did not say what it found after {0}")]
    Unforeseen(String),
    /// Too few nodes are known.
    #[error(
        "only {measured} of {nodes} nodes could be measured, and more than half are needed: choose another grid or test move; the last reason was: {reason}"
    )]
    TooFew {
        /// Nodes that were measured.
        measured: usize,
        /// Nodes of the grid.
        nodes: usize,
        /// Why a node was not.
        reason: String,
    },
}

impl Survey<'_> {
    /// Visits all nodes, along a row and back along the next one, and yields the map, node after
    /// node as a map has them. `each` is told of every node as it is done.
    ///
    /// # Errors
    /// [`SurveyError`]; what is kept in the controller is as it was.
    pub fn run<D: Desk>(
        &self,
        desk: &mut D,
        mut each: impl FnMut(&Visit),
    ) -> Result<Vec<Node>, SurveyError<D::Error>> {
        let columns = usize::from(self.grid.columns);
        let rows = usize::from(self.grid.rows);
        let mut visits: Vec<Option<Visit>> = vec![None; columns * rows];
        // The way to come to the last node is the first one tried at the next.
        let mut preferred = 0;
        for row in 0..rows {
            for step in 0..columns {
                let column = if row % 2 == 0 {
                    step
                } else {
                    columns - 1 - step
                };
                let node = row * columns + column;
                let visit = self.visit(desk, place(&self.grid, node), None, &mut preferred)?;
                each(&visit);
                visits[node] = Some(visit);
            }
        }
        let mut visits: Vec<Visit> = visits.into_iter().flatten().collect();
        // Where the mode is not excited, another one may be found.
        for node in 0..visits.len() {
            let expected_hz = neighbours_hz(&visits, node, columns);
            if let Some(expected_hz) = expected_hz
                && is_another_mode(&visits[node].finding, expected_hz)
            {
                let place_mm = visits[node].place_mm;
                let visit = self.visit(desk, place_mm, Some(expected_hz), &mut preferred)?;
                each(&visit);
                visits[node] = visit;
            }
        }
        completed(visits, columns)
    }

    fn visit<D: Desk>(
        &self,
        desk: &mut D,
        place_mm: [f64; 2],
        expected_hz: Option<f64>,
        preferred: &mut usize,
    ) -> Result<Visit, SurveyError<D::Error>> {
        let mut open = None;
        for part in LENGTHS {
            let ways = self.excitation.ways(part);
            for turn in 0..ways.len() {
                let choice = (*preferred + turn) % ways.len();
                let mut finding = self.attempt(desk, place_mm, ways[choice])?;
                if let Some(expected_hz) = expected_hz
                    && is_another_mode(&finding, expected_hz)
                {
                    let reason = "it shows another mode than the records around it";
                    finding = Finding::Untrusted(reason.to_owned());
                }
                match finding {
                    Finding::Measured { .. } => {
                        *preferred = choice;
                        return Ok(Visit { place_mm, finding });
                    }
                    Finding::Untrusted(_) => {
                        open = Some(finding);
                        break;
                    }
                    Finding::Unreachable(_) => {
                        open.get_or_insert(finding);
                    }
                }
            }
        }
        let finding = open.unwrap_or(Finding::Unreachable(String::new()));
        Ok(Visit { place_mm, finding })
    }

    /// Goes to a way before the place, then makes the test move to it.
    fn attempt<D: Desk>(
        &self,
        desk: &mut D,
        place_mm: [f64; 2],
        way_mm: [f64; 2],
    ) -> Result<Finding, SurveyError<D::Error>> {
        let feed = self.excitation.feed_mm_min;
        let [x, y] = [0, 1].map(|axis| place_mm[axis] - way_mm[axis]);
        let line = format!("$J=G53 G90 G21 X{x:.4} Y{y:.4} F{feed}");
        let answer = desk.ask(&line).map_err(SurveyError::Link)?;
        match answer.error {
            None => {}
            Some(OUT_OF_TRAVEL) => return Ok(Finding::Unreachable(sentence(&answer))),
            Some(_) => return Err(refused(line, &answer)),
        }
        if let Some(state) = desk.await_rest().map_err(SurveyError::Link)? {
            return Err(SurveyError::Restless(state));
        }
        let [x, y] = way_mm;
        let line = format!("{}=G21 X{x:.4} Y{y:.4} F{feed}", self.command);
        let answer = desk.ask(&line).map_err(SurveyError::Link)?;
        match answer.error {
            None => {}
            Some(OUT_OF_TRAVEL) => return Ok(Finding::Unreachable(sentence(&answer))),
            Some(NOT_IDENTIFIED) if !is_hopeless(&answer) => {
                return Ok(Finding::Untrusted(sentence(&answer)));
            }
            Some(_) => return Err(refused(line, &answer)),
        }
        let modes = found(&answer.info);
        let Some(&[frequency_hz, damping, confidence]) = modes.first() else {
            return Err(SurveyError::Unforeseen(line));
        };
        if confidence < TRUSTED {
            let reason = format!("its confidence was {confidence} only");
            return Ok(Finding::Untrusted(reason));
        }
        Ok(Finding::Measured {
            frequency_hz,
            damping,
            confidence,
        })
    }
}

/// The middle one of the frequencies that were measured around a node, if there are enough.
fn neighbours_hz(visits: &[Visit], node: usize, columns: usize) -> Option<f64> {
    let (row, column) = (node / columns, node % columns);
    let is_around = |&(other, _): &(usize, &Visit)| {
        let (rows, across) = (
            (other / columns).abs_diff(row),
            (other % columns).abs_diff(column),
        );
        other != node && rows <= 1 && across <= 1
    };
    let around = visits.iter().enumerate().filter(is_around);
    let frequencies = around.filter_map(|(_, visit)| match visit.finding {
        Finding::Measured { frequency_hz, .. } => Some(frequency_hz),
        _ => None,
    });
    let mut frequencies: Vec<f64> = frequencies.collect();
    frequencies.sort_by(f64::total_cmp);
    let is_enough = frequencies.len() >= WITNESSES;
    is_enough.then(|| frequencies[frequencies.len() / 2])
}

fn is_another_mode(finding: &Finding, expected_hz: f64) -> bool {
    let plausible = expected_hz / ANOTHER_MODE..=expected_hz * ANOTHER_MODE;
    matches!(finding, Finding::Measured { frequency_hz, .. } if !plausible.contains(frequency_hz))
}

/// The map of the nodes as they were visited, the open ones filled.
fn completed<E>(visits: Vec<Visit>, columns: usize) -> Result<Vec<Node>, SurveyError<E>> {
    let measured = |of: fn(&Finding) -> Option<f64>| -> Vec<Option<f64>> {
        visits.iter().map(|visit| of(&visit.finding)).collect()
    };
    let mut frequencies = measured(|finding| match finding {
        Finding::Measured { frequency_hz, .. } => Some(*frequency_hz),
        _ => None,
    });
    let mut dampings = measured(|finding| match finding {
        Finding::Measured { damping, .. } => Some(*damping),
        _ => None,
    });
    let known: Vec<f64> = frequencies.iter().copied().flatten().collect();
    if 2 * known.len() <= visits.len() {
        let reasons = visits.iter().rev().find_map(|visit| match &visit.finding {
            Finding::Measured { .. } => None,
            Finding::Untrusted(reason) | Finding::Unreachable(reason) => Some(reason.clone()),
        });
        return Err(SurveyError::TooFew {
            measured: known.len(),
            nodes: visits.len(),
            reason: reasons.unwrap_or_default(),
        });
    }
    let lowest = known.iter().copied().fold(f64::MAX, f64::min);
    let highest = known.iter().copied().fold(0.0, f64::max);
    fill(&mut frequencies, columns);
    fill(&mut dampings, columns);
    let nodes = visits.into_iter().zip(frequencies).zip(dampings);
    let nodes = nodes.map(|((visit, frequency_hz), damping)| Node {
        visit,
        frequency_hz: frequency_hz
            .unwrap_or(lowest)
            .clamp(lowest / BEYOND, highest * BEYOND),
        damping: damping.unwrap_or(0.0).clamp(0.0, 0.5),
    });
    Ok(nodes.collect())
}

impl Survey<'_> {
    /// The map of nodes that [`Survey::run`] found.
    #[must_use]
    pub fn map(&self, nodes: &[Node]) -> ModeMapConfig {
        let mut map = self.grid;
        for (place, node) in map.nodes.iter_mut().zip(nodes) {
            *place = MapNode::new(node.frequency_hz as f32, node.damping as f32);
        }
        map
    }

    /// Makes a map the controller's. If it is refused, what was there before comes back.
    ///
    /// # Errors
    /// [`SurveyError`].
    pub fn store<D: Desk>(
        &self,
        desk: &mut D,
        nodes: &[Node],
    ) -> Result<(), SurveyError<D::Error>> {
        let before = desk.ask("$map").map_err(SurveyError::Link)?;
        let before: Vec<String> = before
            .settings
            .iter()
            .map(|(name, value)| format!("${name}={value}"))
            .collect();
        let map = self.map(nodes);
        for line in lines(&map) {
            let answer = desk.ask(&line).map_err(SurveyError::Link)?;
            if answer.error.is_some() {
                for line in before {
                    desk.ask(&line).map_err(SurveyError::Link)?;
                }
                return Err(refused(line, &answer));
            }
        }
        Ok(())
    }
}

/// The lines that set a map.
#[must_use]
pub fn lines(map: &ModeMapConfig) -> Vec<String> {
    let lines = (0..).map_while(|line| map.line(line));
    lines.map(|line| format!("${line}")).collect()
}

fn refused<E>(line: String, answer: &Answer) -> SurveyError<E> {
    let reason = sentence(answer);
    SurveyError::Refused { line, reason }
}

/// Why a line was refused, in the controller's words.
fn sentence(answer: &Answer) -> String {
    let meaning = || codes::error(answer.error.unwrap_or_default()).to_owned();
    answer.messages.last().cloned().unwrap_or_else(meaning)
}

/// Somebody stopped it, or nobody answers: that is no record to be made again.
fn is_hopeless(answer: &Answer) -> bool {
    let reason = sentence(answer);
    NO_RECORD.iter().any(|no_record| reason == *no_record)
}

/// The modes among what was said with an answer, `[ID:frequency,damping,confidence]` each; the one
/// that is looked for first.
#[must_use]
pub fn found(info: &[String]) -> Vec<[f64; 3]> {
    let lines = info.iter().filter_map(|line| line.strip_prefix("ID:"));
    let modes = lines.filter_map(|said| {
        let values: Result<Vec<f64>, _> = said.split(',').map(str::parse).collect();
        values.ok()?.try_into().ok()
    });
    modes.collect()
}
