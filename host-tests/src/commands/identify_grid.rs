//! `stillpoint identify --on PORT --grid …`: the map of the mode, node by node.

use std::time::{Duration, Instant};

use anyhow::{Error, anyhow};
use planner_core::posture::ModeMapConfig;
use serde_json::json;

use super::Failure;
use super::identify::{IdentifyArgs, LINK, PATIENCE};
use crate::link::{Address, LinkError, Reply, State};
use crate::sender::{Answer, Session};
use crate::survey::{Desk, Excitation, Finding, Grid, Node, Survey, SurveyError, Visit, lines};

/// How long a way to the next node may take.
const WAY: Duration = Duration::from_secs(120);

impl Desk for Session {
    type Error = LinkError;

    fn ask(&mut self, line: &str) -> Result<Answer, LinkError> {
        self.ask_patiently(line, PATIENCE)
    }

    fn await_rest(&mut self) -> Result<Option<String>, LinkError> {
        let start = Instant::now();
        let mut state = String::new();
        while start.elapsed() < WAY {
            if let Some(Reply::Status(report)) = self.hear()? {
                match report.state {
                    State::Idle => return Ok(None),
                    State::Alarm(_) | State::Hold(_) | State::Door(_) => {
                        return Ok(Some(report.state.to_string()));
                    }
                    other => state = other.to_string(),
                }
            }
        }
        Ok(Some(state))
    }
}

/// Makes the survey; yields what it has to say.
pub fn survey(
    args: &IdentifyArgs,
    grid: &Grid,
    address: &Address,
    session: &mut Session,
) -> Result<String, Failure> {
    let failed = |error: SurveyError<LinkError>| match error {
        SurveyError::Link(error) => Failure::new(LINK, error),
        error => Failure::from(anyhow!("{address}: {error}")),
    };
    let excitation: Excitation = args.excite.parse().map_err(Error::from)?;
    let grid = match grid {
        Grid::Given(map) => **map,
        Grid::OfTheMap => {
            let map = asked_map(session).map_err(|error| Failure::new(LINK, error))?;
            map.filter(ModeMapConfig::is_some).ok_or_else(|| {
                anyhow!(
                    "{address}: the controller has no map: give its grid, COLUMNS,ROWS,X0,X1,Y0,Y1"
                )
            })?
        }
    };
    let survey = Survey {
        grid,
        excitation,
        command: args.by.command(),
    };
    let nodes = survey.run(session, |visit| {
        if !args.json {
            println!("{}", sentence(visit));
        }
    });
    let nodes = nodes.map_err(failed)?;
    if args.store {
        survey.store(session, &nodes).map_err(failed)?;
    }
    let map = survey.map(&nodes);
    if args.json {
        let answer = json!({
            "columns": map.columns,
            "rows": map.rows,
            "nodes": nodes.iter().map(object).collect::<Vec<_>>(),
            "lines": lines(&map),
            "stored": args.store,
        });
        return Ok(answer.to_string());
    }
    let open = nodes.iter().filter(|node| !is_measured(node)).count();
    let mut text = String::from("\n");
    if open > 0 {
        text += &format!(
            "{open} of {} nodes are filled from their neighbours.\n",
            nodes.len()
        );
    }
    text += &lines(&map).join("\n");
    text += if args.store {
        "\nThe controller's map is this from now on."
    } else {
        "\nStore it with --store, or with these lines."
    };
    Ok(text)
}

/// The controller's map; none if it knows of none.
fn asked_map(session: &mut Session) -> Result<Option<ModeMapConfig>, LinkError> {
    let mut map = ModeMapConfig::NONE;
    for (key, value) in session.ask("$map")?.settings {
        if map.set(&key, &value) != Some(true) {
            return Ok(None);
        }
    }
    Ok(Some(map))
}

fn is_measured(node: &Node) -> bool {
    matches!(node.visit.finding, Finding::Measured { .. })
}

/// A node in one line.
fn sentence(visit: &Visit) -> String {
    let [x, y] = visit.place_mm;
    let found = match &visit.finding {
        Finding::Measured {
            frequency_hz,
            damping,
            confidence,
        } => format!("{frequency_hz:.4} Hz, damping {damping:.5}, confidence {confidence:.3}"),
        Finding::Untrusted(reason) => format!("no record can be trusted: {reason}"),
        Finding::Unreachable(reason) => format!("no test move gets there: {reason}"),
    };
    format!("X{x:.3} Y{y:.3}: {found}")
}

/// A node as JSON.
fn object(node: &Node) -> serde_json::Value {
    let [x_mm, y_mm] = node.visit.place_mm;
    let (confidence, reason) = match &node.visit.finding {
        Finding::Measured { confidence, .. } => (Some(confidence), None),
        Finding::Untrusted(reason) | Finding::Unreachable(reason) => (None, Some(reason)),
    };
    json!({
        "x_mm": x_mm,
        "y_mm": y_mm,
        "frequency_hz": node.frequency_hz,
        "damping": node.damping,
        "measured": is_measured(node),
        "confidence": confidence,
        "reason": reason,
    })
}
