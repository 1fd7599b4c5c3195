//! The mode over the workspace: a grid in X and Y, linear in between.

use core::fmt;

use super::course::{Course, between};
use crate::path::PathSegment;
use crate::pose::Pose;
use crate::prefilter::Mode;

/// Nodes of a map along X and along Y: with 8, frequencies from 8 to 20 Hz over an arm of
/// 350 mm go in steps that a straight line follows within 1 %. 256 bytes altogether.
pub const MAP_NODES: usize = 8;

const NODES: usize = MAP_NODES * MAP_NODES;

/// The mode as measured at a place, as small as its use allows: 4 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MapNode {
    /// Natural frequency (undamped) in 2^-8 Hz: up to 255 Hz, within 0.002 Hz.
    frequency: u16,
    /// Damping ratio in 2^-16: up to 0.5, within 1e-5.
    damping: u16,
}

impl MapNode {
    /// Bytes of a node as it is kept.
    pub const BYTES: usize = 4;

    /// A mode of a natural frequency of 0.01 to 250 Hz and a damping ratio of 0 to 0.5, each
    /// rounded to nearest; what is further off saturates, and is refused with the map.
    #[must_use]
    pub fn new(frequency_hz: f32, damping: f32) -> Self {
        Self {
            frequency: (frequency_hz * 256.0 + 0.5) as u16,
            damping: (damping * 65_536.0 + 0.5) as u16,
        }
    }

    /// Natural frequency (undamped) in Hz.
    #[must_use]
    pub fn frequency_hz(self) -> f32 {
        f32::from(self.frequency) / 256.0
    }

    /// Damping ratio.
    #[must_use]
    pub fn damping(self) -> f32 {
        f32::from(self.damping) / 65_536.0
    }

    /// As kept.
    #[must_use]
    pub fn to_bytes(self) -> [u8; Self::BYTES] {
        let ([f0, f1], [d0, d1]) = (self.frequency.to_le_bytes(), self.damping.to_le_bytes());
        [f0, f1, d0, d1]
    }

    /// The inverse of [`MapNode::to_bytes`].
    #[must_use]
    pub fn from_bytes([f0, f1, d0, d1]: [u8; Self::BYTES]) -> Self {
        Self {
            frequency: u16::from_le_bytes([f0, f1]),
            damping: u16::from_le_bytes([d0, d1]),
        }
    }
}

/// Settings of a map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModeMapConfig {
    /// X of the first and of the last column in mm.
    pub x_mm: [f32; 2],
    /// Y of the first and of the last row in mm.
    pub y_mm: [f32; 2],
    /// Columns, 1 to [`MAP_NODES`]; with one, the mode does not depend on X. 0 is no map.
    pub columns: u8,
    /// Rows, 1 to [`MAP_NODES`]; with one, the mode does not depend on Y.
    pub rows: u8,
    /// The modes at evenly spaced places, row after row from the lowest Y, each from the
    /// lowest X; those behind columns times rows do not count.
    pub nodes: [MapNode; NODES],
}

impl ModeMapConfig {
    /// No map.
    pub const NONE: Self = Self {
        x_mm: [0.0, 1.0],
        y_mm: [0.0, 1.0],
        columns: 0,
        rows: 0,
        nodes: [MapNode {
            frequency: 0,
            damping: 0,
        }; NODES],
    };

    /// The same mode everywhere.
    #[must_use]
    pub fn constant(node: MapNode) -> Self {
        Self {
            columns: 1,
            rows: 1,
            nodes: [node; NODES],
            ..Self::NONE
        }
    }

    /// Whether there is a map.
    #[must_use]
    pub fn is_some(&self) -> bool {
        self.columns > 0
    }

    /// Whether there is a map and all its modes are given; before, it is not in force.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.is_some() && self.used().iter().all(|node| node.frequency > 0)
    }

    /// The nodes that count.
    #[must_use]
    pub fn used(&self) -> &[MapNode] {
        let count = usize::from(self.columns) * usize::from(self.rows);
        self.nodes.get(..count).unwrap_or(&self.nodes)
    }
}

impl Default for ModeMapConfig {
    fn default() -> Self {
        Self::NONE
    }
}

/// Why a map's settings are refused.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MapError {
    /// Columns or rows are not 1 to [`MAP_NODES`].
    Size {
        /// Columns given.
        columns: u8,
        /// Rows given.
        rows: u8,
    },
    /// The last column or row does not lie at least 1 mm behind the first, or beyond ±4 m.
    Place {
        /// The axis.
        axis: char,
    },
    /// A node's frequency is not between 0.01 and 250 Hz.
    Frequency {
        /// Which node, counted from 0.
        node: usize,
        /// What was given.
        frequency_hz: f32,
    },
    /// A node's damping ratio is not between 0 and 0.5.
    Damping {
        /// Which node, counted from 0.
        node: usize,
        /// What was given.
        damping: f32,
    },
}

impl fmt::Display for MapError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Size { columns, rows } => write!(
                f,
                "a map of {columns} by {rows} modes does not fit: give 1 to {MAP_NODES} columns and rows"
            ),
            Self::Place { axis } => write!(
                f,
                "the map's last place along {axis} does not lie 1 mm or more behind its first, within ±4096 mm"
            ),
            Self::Frequency { node, frequency_hz } => write!(
                f,
                "mode {node} of the map has a frequency of {frequency_hz} Hz, outside 0.01 to 250 Hz"
            ),
            Self::Damping { node, damping } => write!(
                f,
                "mode {node} of the map has a damping ratio of {damping}, outside 0 to 0.5"
            ),
        }
    }
}

impl core::error::Error for MapError {}

/// A validated map.
#[derive(Clone, Debug)]
pub struct ModeMap {
    x: Axis,
    y: Axis,
    nodes: [MapNode; NODES],
}

/// Where the nodes lie along an axis.
#[derive(Clone, Copy, Debug)]
struct Axis {
    first_mm: f64,
    per_mm: f64,
    /// Nodes but one.
    steps: usize,
}

impl Axis {
    fn new([first_mm, last_mm]: [f32; 2], nodes: usize) -> Self {
        let (first_mm, last_mm) = (f64::from(first_mm), f64::from(last_mm));
        let steps = nodes - 1;
        Self {
            first_mm,
            per_mm: steps as f64 / (last_mm - first_mm),
            steps,
        }
    }

    /// The node before a place, the node behind it, and how far it is from one to the other
    /// (0 to 1). Beyond the ends it is the end.
    fn locate(&self, place_mm: f64) -> (usize, usize, f64) {
        let along = ((place_mm - self.first_mm) * self.per_mm).clamp(0.0, self.steps as f64);
        let before = along as usize;
        let behind = (before + 1).min(self.steps);
        (before, behind, along - before as f64)
    }
}

impl ModeMap {
    /// Validates the settings.
    ///
    /// # Errors
    /// [`MapError`] names the first one that is out of range.
    pub fn new(config: &ModeMapConfig) -> Result<Self, MapError> {
        let (columns, rows) = (config.columns, config.rows);
        let fits = |count: u8| (1..=MAP_NODES).contains(&usize::from(count));
        if !fits(columns) || !fits(rows) {
            return Err(MapError::Size { columns, rows });
        }
        for (axis, [first, last]) in [('X', config.x_mm), ('Y', config.y_mm)] {
            let within = |place: f32| (-4096.0..=4096.0).contains(&place);
            // a place that is no number lies nowhere
            if !within(first) || !within(last) || last - first < 1.0 {
                return Err(MapError::Place { axis });
            }
        }
        for (node, mode) in config.used().iter().enumerate() {
            let (frequency_hz, damping) = (mode.frequency_hz(), mode.damping());
            if !(0.01..=250.0).contains(&frequency_hz) {
                return Err(MapError::Frequency { node, frequency_hz });
            }
            if !(0.0..=0.5).contains(&damping) {
                return Err(MapError::Damping { node, damping });
            }
        }
        Ok(Self {
            x: Axis::new(config.x_mm, columns.into()),
            y: Axis::new(config.y_mm, rows.into()),
            nodes: config.nodes,
        })
    }

    /// The mode with the tool at a pose: bilinear between the four nodes around it, and beyond
    /// the map that of its edge.
    #[must_use]
    pub fn mode_at(&self, pose: &Pose) -> Mode {
        let (left, right, u) = self.x.locate(pose.x.to_num());
        let (front, back, v) = self.y.locate(pose.y.to_num());
        let node = |column, row| {
            let found = self.nodes.get(row * (self.x.steps + 1) + column);
            // every column and row has its node
            found.map_or(NO_MODE, Mode::from)
        };
        let along_x = |row| between(node(left, row), node(right, row), u);
        between(along_x(front), along_x(back), v)
    }

    /// The lowest frequency with the largest damping ratio: no mode of the map has a longer
    /// damped period.
    #[must_use]
    pub fn slowest(&self) -> Mode {
        let count = (self.x.steps + 1) * (self.y.steps + 1);
        let all = self.nodes.iter().take(count).map(Mode::from);
        all.reduce(|one, other| Mode {
            frequency_hz: one.frequency_hz.min(other.frequency_hz),
            damping: one.damping.max(other.damping),
        })
        .unwrap_or(NO_MODE)
    }

    /// The mode along a segment, from its values at both ends.
    #[must_use]
    pub fn course(&self, path: &PathSegment) -> Course {
        Course {
            start: self.mode_at(&path.start),
            end: self.mode_at(&path.target),
            length_mm: path.length_mm(),
        }
    }
}

/// What a node is that does not exist: there is none such.
const NO_MODE: Mode = Mode {
    frequency_hz: 0.0,
    damping: 0.0,
};

impl From<&MapNode> for Mode {
    fn from(node: &MapNode) -> Self {
        Self {
            frequency_hz: node.frequency_hz().into(),
            damping: node.damping().into(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::Shape;
    use crate::units::LengthMm;
    use proptest::prelude::*;

    fn pose(x_mm: f64, y_mm: f64) -> Pose {
        Pose {
            x: LengthMm::from_num(x_mm),
            y: LengthMm::from_num(y_mm),
            ..Pose::default()
        }
    }

    /// A map from -350 to 350 mm of a mode given by its place.
    fn map(columns: usize, rows: usize, mode: impl Fn(f64, f64) -> f64) -> ModeMap {
        let place = |node: usize, nodes: usize| match nodes {
            1 => 0.0,
            _ => 700.0 * node as f64 / (nodes - 1) as f64 - 350.0,
        };
        let mut config = ModeMapConfig {
            x_mm: [-350.0, 350.0],
            y_mm: [-350.0, 350.0],
            columns: columns as u8,
            rows: rows as u8,
            ..ModeMapConfig::NONE
        };
        for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)))
        {
            let frequency_hz = mode(place(column, columns), place(row, rows)) as f32;
            config.nodes[row * columns + column] = MapNode::new(frequency_hz, 0.02);
        }
        ModeMap::new(&config).unwrap()
    }

    proptest! {
        #[test]
        fn the_mode_lies_within_its_four_nodes(
            columns in 1..=MAP_NODES, rows in 1..=MAP_NODES,
            x_mm in -500.0_f64..500.0, y_mm in -500.0_f64..500.0, seed in 0.1_f64..2.0
        ) {
            let rough = |x: f64, y: f64| 12.0 + 8.0 * libm::sin(seed * x) * libm::cos(seed * y + x);
            let map = map(columns, rows, rough);
            let found = map.mode_at(&pose(x_mm, y_mm));
            let (left, right, _) = map.x.locate(x_mm);
            let (front, back, _) = map.y.locate(y_mm);
            let around = [(left, front), (right, front), (left, back), (right, back)]
                .map(|(column, row)| f64::from(map.nodes[row * columns + column].frequency_hz()));
            let (low, high) = around
                .iter()
                .fold((f64::MAX, 0.0_f64), |(low, high), &f| (low.min(f), high.max(f)));
            prop_assert!(found.frequency_hz >= low - 1e-9 && found.frequency_hz <= high + 1e-9);
            prop_assert!(libm::fabs(found.damping - 0.02) < 1e-5);
        }

        #[test]
        fn a_mode_that_changes_linearly_is_met_everywhere(
            x_mm in -350.0_f64..350.0, y_mm in -350.0_f64..350.0
        ) {
            let even = |x: f64, y: f64| 14.0 + 0.01 * x - 0.005 * y;
            let found = map(5, 3, even).mode_at(&pose(x_mm, y_mm)).frequency_hz;
            prop_assert!(libm::fabs(found - even(x_mm, y_mm)) < 0.002);
        }
    }

    #[test]
    fn eight_nodes_follow_8_to_20_hz_within_a_quarter_percent() {
        let evenly = |x: f64, _| 8.0 * libm::pow(2.5, (x + 350.0) / 700.0);
        let map = map(MAP_NODES, 1, evenly);
        let mut worst = 0.0_f64;
        for step in 0..=700 {
            let x_mm = f64::from(step) - 350.0;
            let found = map.mode_at(&pose(x_mm, 77.0)).frequency_hz;
            worst = worst.max(libm::fabs(found / evenly(x_mm, 0.0) - 1.0));
        }
        assert!((0.001..0.0025).contains(&worst), "{worst}");
    }

    #[test]
    fn a_move_reads_its_ends_and_the_edge_goes_on_beyond_the_map() {
        let map = map(2, 1, |x, _| 14.0 + 6.0 * x / 350.0);
        let path = PathSegment {
            start: pose(-350.0, 0.0),
            target: pose(400.0, 0.0),
            shape: Shape::Line,
        };
        let course = map.course(&path);
        assert_eq!(course.start.frequency_hz, 8.0);
        assert_eq!(course.end.frequency_hz, 20.0);
        assert_eq!(course.length_mm, 750.0);
        assert_eq!(course.mode_at(375.0).frequency_hz, 14.0);
        let everywhere = ModeMapConfig::constant(MapNode::new(6.34, 0.022));
        let mode = ModeMap::new(&everywhere)
            .unwrap()
            .mode_at(&pose(-300.0, 10.0));
        assert!(libm::fabs(mode.frequency_hz - 6.34) < 0.002);
    }

    #[test]
    fn settings_that_make_no_map_are_refused_by_name() {
        let good = ModeMapConfig::constant(MapNode::new(6.34, 0.022));
        let refused = |change: fn(&mut ModeMapConfig)| {
            let mut config = good;
            change(&mut config);
            std::format!("{}", ModeMap::new(&config).unwrap_err())
        };
        assert!(refused(|c| c.columns = 9).contains("a map of 9 by 1"));
        assert!(refused(|c| c.rows = 0).contains("a map of 1 by 0"));
        assert!(refused(|c| c.y_mm = [3.0, 3.0]).contains("along Y"));
        assert!(refused(|c| c.x_mm = [f32::NAN, 3.0]).contains("along X"));
        assert!(refused(|c| c.nodes[0] = MapNode::new(0.0, 0.1)).contains("frequency of 0 Hz"));
        assert!(
            refused(|c| c.nodes[0] = MapNode::new(9.0, 0.75)).contains("damping ratio of 0.75")
        );
    }
}
