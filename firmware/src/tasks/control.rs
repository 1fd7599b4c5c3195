//! The control task: one tick of the motion every millisecond.
//!
//! **Deadline.** The tick of period *n* must have left before period *n + 1*
//! begins. The task runs in the highest interrupt executor, above everything but
//! the time driver, so only its own length and critical sections can delay it.
//!
//! **A miss.** The periods that went by are counted as overruns and are not made
//! up for: the motion is late by so many milliseconds from then on, on its path,
//! and the drives hold their last setpoint meanwhile. Ticks in a burst would ask
//! the drives for a step instead. The watchdog is fed only by a tick that met its
//! deadline, so a controller that keeps missing is reset by the board.
//!
//! The digital outputs follow each tick's setpoint before its frame leaves.

use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_time::{Duration, Instant, TICK_HZ, Timer};
use planner_core::motion::Motion;
use planner_core::protocol::{Inputs, Report};
use planner_core::telemetry::SetpointFrame;
use planner_core::units;

use crate::board::{Arm, Outputs, Stopwatch, Watchdog};
use crate::tasks::link::{Link, Order};

/// Frames between the control task and the setpoint task. The latter runs in the
/// next lower interrupt executor, so a second frame waits only while the port does.
const FRAMES: usize = 4;

/// The way of the frames out.
pub type Frames = Channel<CriticalSectionRawMutex, SetpointFrame, FRAMES>;

const PERIOD: Duration = {
    assert!(
        TICK_HZ.is_multiple_of(units::TICK_HZ as u64),
        "the time driver must divide into whole control periods"
    );
    Duration::from_ticks(TICK_HZ / units::TICK_HZ as u64)
};

/// Ticks for ever.
pub async fn run(
    motion: &'static mut Motion<'static>,
    link: &'static Link,
    frames: &'static Frames,
    mut outputs: impl Outputs,
    mut arm: impl Arm,
    stopwatch: impl Stopwatch,
    mut watchdog: impl Watchdog,
) -> ! {
    let mut report = Report::default();
    let mut was_starved = false;
    let mut due = Instant::now() + PERIOD;
    loop {
        Timer::at(due).await;
        while let Some(order) = link.next_order() {
            match order {
                Order::Motion(order) => {
                    motion.obey(order);
                    report.orders = report.orders.wrapping_add(1);
                }
                Order::Robot(robot) => {
                    motion.set_robot(robot);
                    link.return_robot(robot);
                    // Taking settings over may be longer than a period; nothing
                    // moves then, so it is a pause and no overrun.
                    due = due.max(Instant::now());
                }
            }
        }

        report.inputs = Inputs::from_bits(arm.inputs() ^ link.inputs_inverted());
        motion.see_limits(report.inputs.limits);
        let start = stopwatch.now();
        let setpoint = motion.tick();
        let tick_cost = stopwatch.since(start);
        outputs.set(setpoint.outputs);
        arm.follow(&setpoint);
        report.encoders = arm.encoders();
        report.progress = motion.progress();

        let last = report.setpoint;
        // Not only when everything has stopped: moves that come while the prefilter still
        // settles go on, but later than they should.
        let is_starved = motion.is_out_of_path() && link.program_is_open();
        if is_starved && !was_starved {
            report.health.starved = report.health.starved.saturating_add(1);
        }
        was_starved = is_starved;
        report.health.worst_tick = report.health.worst_tick.max(tick_cost);
        report.previous_pose = last.pose;
        report.setpoint = setpoint;
        let frame = SetpointFrame {
            sequence: report.health.ticks,
            setpoint,
            tick_cost,
            overruns: report.health.overruns,
            wanted: link.wanted(),
        };
        if frames.try_send(frame).is_err() {
            report.health.unsent = report.health.unsent.saturating_add(1);
        }
        report.health.ticks = report.health.ticks.wrapping_add(1);

        let now = Instant::now();
        due += PERIOD;
        if now < due {
            watchdog.feed();
        } else {
            while due <= now {
                due += PERIOD;
                report.health.overruns = report.health.overruns.saturating_add(1);
            }
        }
        link.publish(report);
    }
}
