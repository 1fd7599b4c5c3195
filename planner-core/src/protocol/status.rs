//! Status reports: `<Run|MPos:…|Bf:…|FS:…>`.

use core::fmt;

use crate::pose::{AXES, JointPosition, JointUnit, Pose};
use crate::units::{AngleRad, LengthMm};

use super::overrides::Rates;
use super::report::Inputs;

/// What a status report calls the controller's state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum State {
    /// At rest, ready.
    #[default]
    Idle,
    /// Executing moves.
    Run,
    /// Held; still slowing down if `stopping`.
    Hold {
        /// The prefilter has not come to rest yet.
        stopping: bool,
    },
    /// Executing a jog.
    Jog,
    /// Locked.
    Alarm,
    /// Held by the safety door.
    Door {
        /// The prefilter has not come to rest yet.
        stopping: bool,
        /// The door's input is active.
        open: bool,
    },
    /// Lines are checked, and nothing moves.
    Check,
    /// Looking for the limit inputs.
    Home,
    /// Asleep until a reset.
    Sleep,
}

impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Idle => "Idle",
            Self::Run => "Run",
            Self::Hold { stopping: true } => "Hold:1",
            Self::Hold { stopping: false } => "Hold:0",
            Self::Jog => "Jog",
            Self::Alarm => "Alarm",
            Self::Door { stopping: true, .. } => "Door:2",
            Self::Door { open: true, .. } => "Door:1",
            Self::Door { .. } => "Door:0",
            Self::Check => "Check",
            Self::Home => "Home",
            Self::Sleep => "Sleep",
        })
    }
}

/// When a report also holds what seldom changes: the work offset, and in another report the
/// overrides. The first reports do, and those after a change, and every so many.
#[derive(Clone, Copy, Debug, Default)]
pub struct Cadence {
    until_offset: u8,
    until_overrides: u8,
}

/// Reports from one work offset to the next.
const OFFSET_EVERY: [u8; 2] = [10, 30];
/// Reports from one set of overrides to the next.
const OVERRIDES_EVERY: [u8; 2] = [10, 20];

/// What seldom changes and belongs into this report.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extra {
    /// Nothing.
    None,
    /// The work offset.
    Offset,
    /// The overrides, and the outputs that are on.
    Overrides,
}

impl Cadence {
    /// The next reports hold everything.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            until_offset: 0,
            until_overrides: 0,
        }
    }

    /// The work offset has changed.
    pub fn offset_changed(&mut self) {
        self.until_offset = 0;
    }

    /// The overrides or the outputs have changed.
    pub fn overrides_changed(&mut self) {
        self.until_overrides = 0;
    }

    /// What the next report holds.
    pub fn next(&mut self, busy: bool) -> Extra {
        let busy = usize::from(busy);
        if self.until_offset == 0 {
            self.until_offset = OFFSET_EVERY[busy] - 1;
            return Extra::Offset;
        }
        self.until_offset -= 1;
        if self.until_overrides == 0 {
            self.until_overrides = OVERRIDES_EVERY[busy] - 1;
            return Extra::Overrides;
        }
        self.until_overrides -= 1;
        Extra::None
    }
}

/// One status report.
#[derive(Clone, Copy, Debug)]
pub struct Status {
    /// The controller's state.
    pub state: State,
    /// Where the tool is, in the robot's frame.
    pub pose: Pose,
    /// Work offset: machine position less work position.
    pub offset: Pose,
    /// Show the machine position, not the work position.
    pub machine_position: bool,
    /// Lengths in inches.
    pub inches: bool,
    /// Free places for moves and for bytes of lines, if they are asked for.
    pub buffers: Option<(usize, usize)>,
    /// The line number of the move under way, if its program has line numbers.
    pub line: Option<u32>,
    /// The tool's speed in mm/s.
    pub speed_mm_s: f32,
    /// Active inputs.
    pub inputs: Inputs,
    /// Outputs that are on.
    pub outputs: u8,
    /// Overrides.
    pub rates: Rates,
    /// Joint positions with their units, if they are asked for.
    pub joints: Option<([JointUnit; AXES], JointPosition)>,
    /// The work offset belongs in.
    pub with_offset: bool,
    /// The overrides belong in.
    pub with_overrides: bool,
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "<{}|", self.state)?;
        let shown = if self.machine_position {
            f.write_str("MPos:")?;
            self.pose
        } else {
            f.write_str("WPos:")?;
            less(self.pose, self.offset)
        };
        Coordinates::new(shown, self.inches).fmt(f)?;
        if let Some((moves, bytes)) = self.buffers {
            write!(f, "|Bf:{moves},{bytes}")?;
        }
        if let Some(line) = self.line {
            write!(f, "|Ln:{line}")?;
        }
        let per_min = if self.inches { 60.0 / 25.4 } else { 60.0 };
        write!(f, "|FS:{},0", (self.speed_mm_s * per_min) as u32)?;
        self.pins(f)?;
        if let Some((units, joints)) = self.joints {
            joints_in(f, units, joints)?;
        }
        if self.with_offset {
            f.write_str("|WCO:")?;
            Coordinates::new(self.offset, self.inches).fmt(f)?;
        }
        if self.with_overrides {
            let Rates {
                feed_percent,
                rapid_percent,
            } = self.rates;
            write!(f, "|Ov:{feed_percent},{rapid_percent},100")?;
            self.accessories(f)?;
        }
        f.write_str(">")
    }
}

impl Status {
    fn pins(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Inputs { limits, door } = self.inputs;
        if limits == 0 && !door {
            return Ok(());
        }
        f.write_str("|Pn:")?;
        for (joint, letter) in ["X", "Y", "Z", "C"].into_iter().enumerate() {
            if limits & (1 << joint) != 0 {
                f.write_str(letter)?;
            }
        }
        f.write_str(if door { "D" } else { "" })
    }

    /// The gripper is Grbl's spindle, the blow-off its flood coolant.
    fn accessories(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.outputs & 0b11 == 0 {
            return Ok(());
        }
        f.write_str("|A:")?;
        for (output, letter) in ["S", "F"].into_iter().enumerate() {
            if self.outputs & (1 << output) != 0 {
                f.write_str(letter)?;
            }
        }
        Ok(())
    }
}

fn less(a: Pose, b: Pose) -> Pose {
    Pose {
        x: a.x.saturating_sub(b.x),
        y: a.y.saturating_sub(b.y),
        z: a.z.saturating_sub(b.z),
        c: a.c.saturating_sub(b.c),
    }
}

/// `x,y,z,c` in mm or inches, and degrees.
#[derive(Clone, Copy, Debug)]
pub struct Coordinates {
    pose: Pose,
    inches: bool,
}

impl Coordinates {
    /// Lengths of the pose in inches, or in mm.
    #[must_use]
    pub const fn new(pose: Pose, inches: bool) -> Self {
        Self { pose, inches }
    }
}

impl fmt::Display for Coordinates {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Pose { x, y, z, c } = self.pose;
        if self.inches {
            let [x, y, z] = [x, y, z].map(inches);
            write!(f, "{x:.4},{y:.4},{z:.4},{c:.3}")
        } else {
            write!(f, "{x:.3},{y:.3},{z:.3},{c:.3}")
        }
    }
}

fn inches(length: LengthMm) -> LengthMm {
    let bits = i64::from(length.to_bits()) * 10 / 254;
    LengthMm::from_bits(bits as i32)
}

const _: () = assert!(AXES == 4, "coordinates are written one by one");

/// Joint positions in rad to 1e-4 and mm to 1e-3.
fn joints_in(
    f: &mut fmt::Formatter<'_>,
    units: [JointUnit; AXES],
    joints: JointPosition,
) -> fmt::Result {
    f.write_str("|J:")?;
    for (i, (unit, bits)) in units.into_iter().zip(joints.to_bits()).enumerate() {
        let comma = if i == 0 { "" } else { "," };
        match unit {
            JointUnit::Angle => write!(f, "{comma}{:.4}", AngleRad::from_bits(bits))?,
            JointUnit::Length => write!(f, "{comma}{:.3}", LengthMm::from_bits(bits))?,
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::format;

    fn status() -> Status {
        let pose = Pose {
            x: LengthMm::from_num(254.0),
            y: LengthMm::from_num(-1.5),
            ..Pose::default()
        };
        let offset = Pose {
            x: LengthMm::from_num(127.0),
            ..Pose::default()
        };
        Status {
            state: State::Run,
            pose,
            offset,
            machine_position: true,
            inches: false,
            buffers: None,
            line: None,
            speed_mm_s: 100.0,
            inputs: Inputs::default(),
            outputs: 0,
            rates: Rates::FULL,
            joints: None,
            with_offset: false,
            with_overrides: false,
        }
    }

    #[test]
    fn fields_come_in_grbls_order() {
        assert_eq!(
            format!("{}", status()),
            "<Run|MPos:254.000,-1.500,0.000,0.000|FS:6000,0>"
        );
        let full = Status {
            state: State::Hold { stopping: false },
            machine_position: false,
            buffers: Some((12, 1024)),
            line: Some(7),
            inputs: Inputs {
                limits: 0b1001,
                door: true,
            },
            outputs: 0b11,
            with_offset: true,
            with_overrides: true,
            ..status()
        };
        assert_eq!(
            format!("{full}"),
            "<Hold:0|WPos:127.000,-1.500,0.000,0.000|Bf:12,1024|Ln:7|FS:6000,0|Pn:XCD\
             |WCO:127.000,0.000,0.000,0.000|Ov:100,100,100|A:SF>"
        );
    }

    #[test]
    fn inches_are_inches() {
        let inches = Status {
            inches: true,
            ..status()
        };
        assert_eq!(
            format!("{inches}"),
            "<Run|MPos:10.0000,-0.0591,0.0000,0.000|FS:236,0>"
        );
    }

    #[test]
    fn the_offset_comes_first_and_the_overrides_next() {
        let mut cadence = Cadence::default();
        let extras: std::vec::Vec<_> = (0..12).map(|_| cadence.next(false)).collect();
        assert_eq!(extras[..3], [Extra::Offset, Extra::Overrides, Extra::None]);
        assert_eq!(extras[10], Extra::Offset);
        assert_eq!(extras[11], Extra::None);
        cadence.overrides_changed();
        assert_eq!(cadence.next(true), Extra::Overrides);
        cadence.offset_changed();
        assert_eq!(cadence.next(true), Extra::Offset);
        let busy = (0..40).map(|_| cadence.next(true));
        assert_eq!(busy.filter(|extra| *extra == Extra::Offset).count(), 1);
    }
}
