//! The trace: setpoints tick by tick, and what the plant's tool did.

use std::io::Write;

use planner_core::motion::Setpoint;
use planner_core::pose::{AXES, JointUnit};
use planner_core::units::{TICK_HZ, TICK_S};

use crate::plant::full::LATENCY_TICKS;
use crate::plant::{FullPlant, IdealPlant, JointSetpoint, PayloadSample, Pendulum};
use crate::plant_config::PlantConfig;
use crate::progress::Progress;
use crate::vector::{distance, xyz};

/// How long the trace goes on after the last setpoint: the plant rings on.
pub const REST_TICKS: usize = 3 * TICK_HZ as usize;

/// Settled is a tool within this of the commanded end, in mm.
pub const SETTLED_MM: f64 = 0.05;

/// The tool is followed until it has been settled for so long, ...
const SETTLED_TICKS: usize = 2 * TICK_HZ as usize;

/// ... and for no longer than this.
const SETTLING_TICKS: usize = 60 * TICK_HZ as usize;

/// A command closer to its end than this (mm, and 1e-4 of it in degrees: the same at the
/// end of a 350 mm arm to a factor of six) has stopped.
const STOPPED: [f64; 2] = [1e-4, 1e-5];

/// Which robot answers the setpoints.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum PlantKind {
    /// Drives, flexible joints, links, and a mode at the end effector.
    #[default]
    Full,
    /// A perfect robot with one mode per Cartesian axis.
    Ideal,
}

impl PlantKind {
    /// The name by which the command line calls it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::Ideal => "ideal",
        }
    }

    /// Ticks between a setpoint and the tool that has carried it out.
    fn latency_ticks(self) -> usize {
        match self {
            Self::Full => LATENCY_TICKS,
            Self::Ideal => 0,
        }
    }
}

/// The tool at the end of a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ToolSample {
    /// Its position in mm.
    pub position_mm: [f64; 3],
    /// Its acceleration in mm/s², as an accelerometer reads it.
    pub acceleration_mm_s2: [f64; 3],
}

/// A recorded motion with the tool's answer, one row a tick.
#[derive(Clone, Debug, PartialEq)]
pub struct Trace {
    /// Setpoints, [`REST_TICKS`] of them at rest after the motion.
    pub setpoints: Vec<Setpoint>,
    /// The tool; it goes on after the setpoints until it has settled.
    pub tool: Vec<ToolSample>,
    /// The payload, a row for each of the tool's; empty where there is none.
    pub payload: Vec<PayloadSample>,
    /// Rows in which the tool is driven; what follows is residual vibration.
    pub driven: usize,
}

impl Trace {
    /// Lets the plant answer recorded setpoints.
    #[must_use]
    pub fn simulate(
        recorded: &[Setpoint],
        kind: PlantKind,
        config: &PlantConfig,
        progress: Progress,
    ) -> Self {
        let mut setpoints = recorded.to_vec();
        let last = recorded.last().copied().unwrap_or_default();
        setpoints.resize(recorded.len() + REST_TICKS, last);
        let bar = progress.bar("simulated robot", setpoints.len());

        let end = xyz(pose(&last));
        let mut step = plant(recorded.first().unwrap_or(&last), kind, config);
        let mut tool = Vec::with_capacity(setpoints.len());
        let mut payload = Vec::new();
        let start = xyz(pose(recorded.first().unwrap_or(&last)));
        let mut pendulum = config
            .payload
            .map(|config| Pendulum::new(config, TICK_S, start));
        let mut settled_from = 0;
        let mut follow = |setpoint: &Setpoint| {
            let sample = step(setpoint);
            if let Some(pendulum) = &mut pendulum {
                payload.push(pendulum.step(sample.position_mm));
            }
            tool.push(sample);
            if distance(sample.position_mm, end) > SETTLED_MM {
                settled_from = tool.len();
            }
            tool.len() - settled_from >= SETTLED_TICKS
        };
        let mut settled = false;
        for setpoint in &setpoints {
            settled = follow(setpoint);
            bar.inc(1);
        }
        let mut extra = 0;
        while !settled && extra < SETTLING_TICKS {
            settled = follow(&last);
            extra += 1;
        }
        bar.finish_and_clear();
        Self {
            driven: (last_change(&setpoints) + kind.latency_ticks()).min(setpoints.len()),
            setpoints,
            tool,
            payload,
        }
    }

    /// Commanded poses, mm and degrees.
    #[must_use]
    pub fn poses(&self) -> Vec<[f64; 4]> {
        self.setpoints.iter().map(pose).collect()
    }

    /// What the joints' positions count.
    #[must_use]
    pub fn joint_units(&self) -> [JointUnit; AXES] {
        let arm = self.setpoints.first().map(|setpoint| setpoint.arm);
        arm.unwrap_or_default().joint_units()
    }

    /// Joint setpoints: rad, a quill's mm.
    #[must_use]
    pub fn joints(&self) -> Vec<[f64; 4]> {
        self.setpoints.iter().map(joints).collect()
    }

    /// The row of the last setpoint at rest before the motion.
    #[must_use]
    pub fn start(&self) -> usize {
        let changes = |pair: &[Setpoint]| pair[0].pose != pair[1].pose;
        self.setpoints.windows(2).position(changes).unwrap_or(0)
    }

    /// The first row from which the command stays at its end, to 0.1 µm: the last
    /// nanometres of a filter do not count.
    #[must_use]
    pub fn stop(&self) -> usize {
        let poses = self.poses();
        let Some(&end) = poses.last() else { return 0 };
        let away = |pose: &[f64; 4]| {
            distance(xyz(*pose), xyz(end)) > STOPPED[0] || (pose[3] - end[3]).abs() > STOPPED[1]
        };
        poses.iter().rposition(away).map_or(0, |row| row + 1)
    }

    /// Time of a row in seconds.
    #[must_use]
    pub fn time_s(row: usize) -> f64 {
        row as f64 / f64::from(TICK_HZ)
    }

    /// Tool accelerations of the rows with setpoints, in mm/s².
    #[must_use]
    pub fn accelerations(&self) -> Vec<[f64; 3]> {
        let rows = self.tool.iter().take(self.setpoints.len());
        rows.map(|sample| sample.acceleration_mm_s2).collect()
    }

    /// Writes one line a row. Fixed-point values are written exactly; the tool to a nanometre.
    ///
    /// # Errors
    /// What the writer says.
    pub fn write_csv(&self, writer: impl Write) -> csv::Result<()> {
        let mut csv = csv::Writer::from_writer(writer);
        csv.write_record(COLUMNS)?;
        for (row, (setpoint, tool)) in self.setpoints.iter().zip(&self.tool).enumerate() {
            let mut fields = vec![format!("{:.3}", Self::time_s(row))];
            let exact = pose(setpoint).into_iter().chain(joints(setpoint));
            fields.extend(exact.map(|value| value.to_string()));
            fields.extend(tool.position_mm.map(|value| format!("{value:.6}")));
            fields.extend(tool.acceleration_mm_s2.map(|value| format!("{value:.4}")));
            csv.write_record(fields)?;
        }
        csv.flush()?;
        Ok(())
    }
}

/// Columns of `trace.csv`: joints in rad, a quill's mm.
const COLUMNS: [&str; 15] = [
    "time_s",
    "x_mm",
    "y_mm",
    "z_mm",
    "c_deg",
    "joint1",
    "joint2",
    "joint3",
    "joint4",
    "tool_x_mm",
    "tool_y_mm",
    "tool_z_mm",
    "tool_ax_mm_s2",
    "tool_ay_mm_s2",
    "tool_az_mm_s2",
];

/// The plant at rest at a setpoint, as a function from setpoint to tool.
fn plant(
    start: &Setpoint,
    kind: PlantKind,
    config: &PlantConfig,
) -> Box<dyn FnMut(&Setpoint) -> ToolSample> {
    match kind {
        PlantKind::Full => {
            let mut plant = FullPlant::new(config.full(joints(start)));
            Box::new(move |setpoint| {
                let out = plant.step(JointSetpoint {
                    position: joints(setpoint),
                    velocity: setpoint.joints.velocity.map(f64::from),
                    acceleration: setpoint.joints.acceleration.map(f64::from),
                });
                ToolSample {
                    position_mm: out.tool_mm,
                    acceleration_mm_s2: out.tool_acceleration_mm_s2,
                }
            })
        }
        PlantKind::Ideal => {
            let mut plant = IdealPlant::new(config.mode, TICK_S, xyz(pose(start)));
            Box::new(move |setpoint| {
                let out = plant.step(xyz(pose(setpoint)));
                ToolSample {
                    position_mm: out.tool_mm,
                    acceleration_mm_s2: out.tool_acceleration_mm_s2,
                }
            })
        }
    }
}

/// Rows up to the one that first has the final pose.
fn last_change(setpoints: &[Setpoint]) -> usize {
    let poses: Vec<_> = setpoints.iter().map(|setpoint| setpoint.pose).collect();
    crate::vibration::moving_samples(&poses)
}

/// A setpoint's pose: mm and degrees.
pub fn pose(setpoint: &Setpoint) -> [f64; 4] {
    let pose = setpoint.pose;
    [
        pose.x.to_num(),
        pose.y.to_num(),
        pose.z.to_num(),
        pose.c.to_num(),
    ]
}

/// A setpoint's joints: rad, a quill's mm.
pub fn joints(setpoint: &Setpoint) -> [f64; 4] {
    let units = setpoint.arm.joint_units();
    setpoint.joints.position.values(units)
}
