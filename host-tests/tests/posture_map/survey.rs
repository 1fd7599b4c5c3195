//! The map that a controller makes of its mode: on the unchanged core, with the full plant and its
//! accelerometer at the other end of the second port.

use std::convert::Infallible;

use host_tests::link::Reply;
use host_tests::plant::{FullConfig, Mode, ModeMap};
use host_tests::sender::Answer;
use host_tests::sensed_plant::SensedPlant;
use host_tests::serial_loop::{Records, SerialLoop, with_controller};
use host_tests::survey::{Desk, Finding, Grid, Node, Survey, SurveyError, Visit};
use planner_core::posture::ModeMapConfig;
use planner_core::protocol::Record;

use crate::support::{DAMPING, frequency_hz};

/// A controller with a plant, as a sender sees it.
struct Bench<'a, 'q>(&'a mut SerialLoop<'q>);

impl Desk for Bench<'_, '_> {
    type Error = Infallible;

    fn ask(&mut self, line: &str) -> Result<Answer, Infallible> {
        let mut answer = Answer::default();
        for line in self.0.ask(line).lines() {
            answer.take(Reply::parse(line));
        }
        Ok(answer)
    }

    fn await_rest(&mut self) -> Result<Option<String>, Infallible> {
        let is_at_rest = self.0.run_until("Idle");
        Ok((!is_at_rest).then(|| self.0.state()))
    }
}

/// The mode of these tests, which depends on the place.
fn mode_at([x, y, _]: [f64; 3]) -> Mode {
    Mode {
        frequency_hz: frequency_hz(x, y),
        damping: f64::from(DAMPING),
    }
}

/// A robot at a known place, and a plant with such a mode.
fn with_plant(mode: fn([f64; 3]) -> Mode, body: impl FnOnce(&mut SerialLoop<'_>)) {
    with_controller(Records::new(), |desk| {
        let config = FullConfig {
            mode: ModeMap::from_fn(mode),
            ..FullConfig::default()
        };
        desk.plant = Some(SensedPlant::new(config, 3));
        desk.run_ms(5);
        assert!(desk.ask("G0 X220 Y0").contains("ok"));
        assert!(desk.run_until("Idle"));
        desk.heard();
        body(desk);
    });
}

fn survey(grid: &str) -> Survey<'static> {
    let Ok(Grid::Given(grid)) = grid.parse() else {
        panic!("{grid} is a grid");
    };
    Survey {
        grid: *grid,
        excitation: "X40 F9600".parse().unwrap(),
        command: "$ID",
    }
}

fn run(
    desk: &mut SerialLoop<'_>,
    survey: &Survey<'_>,
) -> Result<Vec<Node>, SurveyError<Infallible>> {
    survey.run(&mut Bench(desk), |visit| println!("{visit:?}"))
}

/// Largest part by which the frequencies of nodes are off.
fn worst_error(nodes: &[Node]) -> f64 {
    let errors = nodes.iter().map(|node| {
        let [x, y] = node.visit.place_mm;
        (node.frequency_hz / frequency_hz(x, y) - 1.0).abs()
    });
    errors.fold(0.0, f64::max)
}

/// What is left of vibration after moves between some places, in mm/s²: from 150 ms after each
/// stop on, when the joints' own modes have died down.
fn left_by_moves(desk: &mut SerialLoop<'_>) -> f64 {
    let places = [(130, -100), (290, 40), (180, 110), (270, -110), (140, 60)];
    let mut squares = 0.0;
    for (x, y) in places {
        desk.send(format!("G1 X{x} Y{y} F9600\n").as_bytes());
        desk.run_ms(20);
        assert!(desk.run_until("Idle"));
        desk.run_ms(500);
        let plant = desk.plant.as_ref().unwrap();
        squares += plant.largest_within_mm_s2(150..450).powi(2) / places.len() as f64;
        desk.run_ms(4000);
    }
    squares.sqrt()
}

#[test]
fn every_node_of_the_map_is_found_and_moves_leave_less_with_it() {
    with_plant(mode_at, |desk| {
        assert!(
            desk.ask("$prefilter=fir-zv feed-limit=400")
                .ends_with("ok\r\n")
        );
        let before = left_by_moves(desk);
        let survey = survey("4,4,120,300,-120,120");
        let nodes = run(desk, &survey).unwrap();
        let measured = |node: &&Node| matches!(node.visit.finding, Finding::Measured { .. });
        assert_eq!(nodes.iter().filter(measured).count(), 16);
        let worst = worst_error(&nodes);
        assert!(worst < 0.02, "{worst}");
        let damping = f64::from(DAMPING);
        assert!(
            nodes
                .iter()
                .all(|node| (node.damping - damping).abs() < 0.003)
        );
        // nothing is in force that was not wanted
        assert_eq!(desk.robot().config.map, ModeMapConfig::NONE);
        survey.store(&mut Bench(desk), &nodes).unwrap();
        assert_eq!(desk.robot().config.map, survey.map(&nodes));
        assert!(desk.records.contains_key(&Record::Map));
        let after = left_by_moves(desk);
        println!("worst node off by {worst:.5}; {before:.2} mm/s² before, {after:.2} after");
        assert!((0.02..0.25).contains(&(after / before)), "{before} {after}");

        // Once more, with the map in force: it is not in the way.
        let again = run(
            desk,
            &Survey {
                grid: desk.robot().config.map,
                ..survey
            },
        )
        .unwrap();
        assert!(worst_error(&again) < 0.02);
    });
}

/// The swing is too damped to be one in a corner of the grid, and the robot cannot reach another.
#[test]
fn nodes_that_stay_open_are_filled_from_their_neighbours_and_named() {
    fn mode([x, y, z]: [f64; 3]) -> Mode {
        let damping = if x < 130.0 && y > 60.0 { 0.45 } else { 0.02 };
        Mode {
            damping,
            ..mode_at([x, y, z])
        }
    }
    with_plant(mode, |desk| {
        let nodes = run(desk, &survey("4,3,120,330,-120,120")).unwrap();
        let finding = |node: usize| &nodes[node].visit.finding;
        let Finding::Untrusted(reason) = finding(8) else {
            panic!("{:?}", finding(8));
        };
        assert!(reason.contains("another mode"), "{reason}");
        for node in [3, 11] {
            let Finding::Unreachable(reason) = finding(node) else {
                panic!("{:?}", finding(node));
            };
            assert!(reason.contains("stretched"), "{reason}");
        }
        let worst = worst_error(&nodes);
        println!("worst node off by {worst:.4}");
        // corners, in which rows and columns can only go straight on
        assert!((0.05..0.2).contains(&worst), "{worst}");
    });
}

#[test]
fn what_cannot_be_surveyed_is_refused_and_changes_nothing() {
    with_plant(mode_at, |desk| {
        // out of reach, but for a row
        let error = run(desk, &survey("2,3,250,340,0,300")).unwrap_err();
        let said = error.to_string();
        assert!(
            said.starts_with("only ") && said.contains("another grid"),
            "{said}"
        );
        let visited: &mut Vec<Visit> = &mut Vec::new();
        desk.plant = None;
        let error = survey("3,3,200,300,-50,50")
            .run(&mut Bench(desk), |visit| visited.push(visit.clone()))
            .unwrap_err();
        let said = error.to_string();
        assert!(said.contains("accelerometer is silent"), "{said}");
        assert!(visited.is_empty(), "{visited:?}");
        assert_eq!(desk.robot().config.map, ModeMapConfig::NONE);
    });
    with_controller(Records::new(), |desk| {
        desk.run_ms(5);
        let said = run(desk, &survey("2,2,200,300,-50,50"))
            .unwrap_err()
            .to_string();
        assert!(said.contains("position is unknown"), "{said}");
    });
}

/// A prefilter for a mode that slow would be too long.
#[test]
fn a_map_that_is_refused_leaves_the_one_before() {
    with_plant(mode_at, |desk| {
        for line in ["$map=2,1,150,290,-50,50", "$map1=12/0.02,9/0.02"] {
            assert!(desk.ask(line).ends_with("ok\r\n"));
        }
        let before = desk.robot().config.map;
        let survey = survey("1,2,150,290,-50,50");
        let node = |frequency_hz| Node {
            visit: Visit {
                place_mm: [220.0, 0.0],
                finding: Finding::Unreachable(String::new()),
            },
            frequency_hz,
            damping: 0.02,
        };
        let error = survey
            .store(&mut Bench(desk), &[node(9.0), node(0.5)])
            .unwrap_err();
        let said = error.to_string();
        assert!(
            said.contains("$map2=0.5") && said.contains("choose a shorter prefilter"),
            "{said}"
        );
        assert_eq!(desk.robot().config.map, before);
    });
}
