//! The setpoint stream of a running controller, looked at now and then.

use std::io::{ErrorKind, Read};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use planner_core::motion::MotionState;
use planner_core::pose::JointUnit;
use planner_core::telemetry::{FrameDecoder, SetpointFrame};
use serde_json::{Value, json};

use crate::link::{Address, LinkError, open_reader};

/// How long the first frame may take: they come a thousand times a second.
const FIRST_FRAME: Duration = Duration::from_secs(3);

/// What the stream has brought so far.
#[derive(Clone, Copy, Debug, Default)]
pub struct Watched {
    /// The last frame.
    pub frame: Option<SetpointFrame>,
    /// Frames so far.
    pub frames: u64,
    /// Frames missing between them.
    pub lost: u32,
    /// Damaged frames.
    pub bad: u32,
    /// Cost of the dearest tick so far.
    pub worst_tick: u32,
}

/// A stream, read by a thread of its own.
pub struct SetpointWatch {
    address: Address,
    watched: Arc<Mutex<Watched>>,
}

impl SetpointWatch {
    /// Opens the stream. `baud` is for serial devices alone.
    ///
    /// # Errors
    /// It cannot be opened.
    pub fn open(address: &Address, baud: u32) -> Result<Self, LinkError> {
        let mut reader = open_reader(address, baud)?;
        let watched = Arc::new(Mutex::new(Watched::default()));
        let weak = Arc::downgrade(&watched);
        thread::spawn(move || {
            let mut decoder = FrameDecoder::new();
            let mut bytes = [0; 4096];
            let mut is_in_step = false;
            // It ends with the stream, or when nobody looks any more.
            while let Some(watched) = weak.upgrade() {
                let count = match reader.read(&mut bytes) {
                    Ok(0) => return,
                    Ok(count) => count,
                    Err(error) => match error.kind() {
                        ErrorKind::TimedOut | ErrorKind::WouldBlock => continue,
                        ErrorKind::Interrupted => continue,
                        _ => return,
                    },
                };
                // The stream began before us: half a frame comes first.
                let mut bytes = &bytes[..count];
                if !is_in_step {
                    let end = bytes.iter().position(|&byte| byte == 0);
                    let Some(end) = end else { continue };
                    (is_in_step, bytes) = (true, &bytes[end + 1..]);
                }
                let mut now = watched.lock().unwrap_or_else(PoisonError::into_inner);
                for frame in decoder.frames(bytes) {
                    now.frames += 1;
                    now.worst_tick = now.worst_tick.max(frame.tick_cost);
                    now.frame = Some(frame);
                }
                now.lost = decoder.lost();
                now.bad = decoder.bad();
            }
        });
        Ok(Self {
            address: address.clone(),
            watched,
        })
    }

    /// What it has brought so far.
    #[must_use]
    pub fn watched(&self) -> Watched {
        *self.watched.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The same, once there is a frame.
    ///
    /// # Errors
    /// None comes.
    pub fn first(&self) -> Result<Watched, LinkError> {
        let start = Instant::now();
        while start.elapsed() < FIRST_FRAME {
            let watched = self.watched();
            if watched.frame.is_some() {
                return Ok(watched);
            }
            thread::sleep(Duration::from_millis(5));
        }
        let silence_s = FIRST_FRAME.as_secs_f64();
        Err(LinkError::Silent(self.address.clone(), silence_s))
    }
}

impl Watched {
    /// In words, a line each.
    #[must_use]
    pub fn lines(&self) -> Vec<String> {
        let Some(frame) = &self.frame else {
            return vec!["joints   no setpoint yet".to_owned()];
        };
        let [j1, j2, j3, j4] = joints(frame);
        let third = third_unit(frame).sign();
        vec![
            format!("joints   {j1:.3}°  {j2:.3}°  {j3:.3}{third}  {j4:.3}°"),
            format!(
                "ticks    {}, cost {}, at most {}, overruns {}; frames lost {}, bad {}",
                frame.sequence,
                frame.tick_cost,
                self.worst_tick,
                frame.overruns,
                self.lost,
                self.bad
            ),
        ]
    }

    /// For `--json`.
    #[must_use]
    pub fn json(&self) -> Value {
        let Some(frame) = &self.frame else {
            return Value::Null;
        };
        let [j1, j2, j3, j4] = joints(frame);
        let third = match third_unit(frame) {
            JointUnit::Angle => "joint3_deg",
            JointUnit::Length => "joint3_mm",
        };
        let pose = frame.setpoint.pose;
        json!({
            "sequence": frame.sequence,
            "running": frame.setpoint.state != MotionState::Idle,
            "x_mm": pose.x.to_num::<f64>(),
            "y_mm": pose.y.to_num::<f64>(),
            "z_mm": pose.z.to_num::<f64>(),
            "c_deg": pose.c.to_num::<f64>(),
            "joint1_deg": j1,
            "joint2_deg": j2,
            third: j3,
            "joint4_deg": j4,
            "tick_cost": frame.tick_cost,
            "worst_tick": self.worst_tick,
            "overruns": frame.overruns,
            "lost": self.lost,
            "bad": self.bad,
        })
    }
}

/// Degrees, a quill's mm.
fn joints(frame: &SetpointFrame) -> [f64; 4] {
    let units = frame.setpoint.arm.joint_units();
    let values = frame.setpoint.joints.position.values(units);
    let mut units = units.into_iter();
    values.map(|value| match units.next() {
        Some(JointUnit::Angle) => value.to_degrees(),
        _ => value,
    })
}

fn third_unit(frame: &SetpointFrame) -> JointUnit {
    let [_, _, third, _] = frame.setpoint.arm.joint_units();
    third
}
