//! Wires the board to the tasks.
#![no_std]
#![no_main]

use embassy_executor::Executor;
use firmware::board::{
    self, Board, BoardArm, BoardFlash, BoardOutputs, BoardWatchdog, CommandIn, CommandOut, Counter,
    SampleIn, SetpointOut, StackUse, Stopwatch, stack_use,
};
use firmware::tasks::command::Commands;
use firmware::tasks::control::Frames;
use firmware::tasks::link::Link;
use firmware::tasks::{command, control, samples, setpoints};
use planner_core::config::{self, Robot};
use planner_core::motion::{DelayLines, Motion, MotionSettings};
use planner_core::planner::Planner;
use planner_core::protocol::{Controller, Identity, Settings};
use planner_core::queue::{SegmentConsumer, SegmentProducer, SegmentQueue};
use planner_core::store::Store;
use static_cell::{ConstStaticCell, StaticCell};

#[cortex_m_rt::entry]
fn main() -> ! {
    static EXECUTOR: StaticCell<Executor> = StaticCell::new();
    let (commands, sample_in) = start();
    let link = commands.link;
    EXECUTOR.init(Executor::new()).run(|thread| {
        thread.spawn(defmt::unwrap!(idle_task()));
        thread.spawn(defmt::unwrap!(command_task(commands)));
        thread.spawn(defmt::unwrap!(sample_task(link, sample_in)));
    })
}

/// Starts the board, the control task and the setpoint task; returns what the command task and
/// the sample task need. Not inlined, because the frame of `main` stays on the stack for ever.
#[inline(never)]
fn start() -> (Commands<CommandIn, CommandOut, BoardFlash>, SampleIn) {
    static LINK: StaticCell<Link> = StaticCell::new();
    static FRAMES: StaticCell<Frames> = StaticCell::new();
    static SEGMENTS: ConstStaticCell<SegmentQueue> = ConstStaticCell::new(SegmentQueue::new());
    static SETTINGS: StaticCell<MotionSettings> = StaticCell::new();

    let Board {
        command_in,
        command_out,
        setpoint_out,
        sample_in,
        outputs,
        arm,
        flash,
        watchdog,
        stopwatch,
        control,
        setpoints,
    } = board::start();
    let settings = Settings::default();
    let link: &Link = LINK.init(Link::default());
    let frames: &Frames = FRAMES.init(Frames::new());
    let (to_motion, from_planner) = SEGMENTS.take().split();
    let identity = Identity {
        board: board::NAME,
        cost_unit: Counter::UNIT,
        blocks: to_motion.capacity(),
        stack_use: || {
            let StackUse { used, free } = stack_use();
            (used, free)
        },
    };
    let robot = robot(&settings);
    let motion = motion(robot, from_planner);
    let motion_settings = SETTINGS.init_with(|| MotionSettings::from(&*robot));
    let controller = controller(planner(robot, to_motion), settings, identity);

    control.spawn(defmt::unwrap!(control_task(
        motion, link, frames, outputs, arm, stopwatch, watchdog
    )));
    setpoints.spawn(defmt::unwrap!(setpoint_task(frames, setpoint_out)));
    let commands = Commands {
        input: command_in,
        output: command_out,
        controller,
        robot: motion_settings,
        link,
        store: defmt::expect!(Store::new(flash, board::STORE), "the store is whole pages"),
    };
    (commands, sample_in)
}

// Each made in a frame of its own, so that what is on its way to its place is on the stack
// alone.

fn robot(settings: &Settings) -> &'static mut Robot {
    let robot = unfiltered_robot(settings);
    let made = robot.set_config(&settings.robot);
    defmt::expect!(made.ok(), "the default settings are a robot");
    robot
}

#[inline(never)]
fn unfiltered_robot(settings: &Settings) -> &'static mut Robot {
    static ROBOT: StaticCell<Robot> = StaticCell::new();
    let arm = config::arm(&settings.robot);
    let arm = defmt::expect!(arm.ok(), "the default settings have an arm");
    ROBOT.init_with(|| Robot::unfiltered(&settings.robot, arm))
}

#[inline(never)]
fn motion(robot: &Robot, segments: SegmentConsumer<'static>) -> &'static mut Motion<'static> {
    static FILTERS: ConstStaticCell<DelayLines> = ConstStaticCell::new(DelayLines::new());
    static MOTION: StaticCell<Motion<'static>> = StaticCell::new();
    MOTION.init_with(|| Motion::new(robot, segments, FILTERS.take()))
}

#[inline(never)]
fn planner(
    robot: &'static mut Robot,
    segments: SegmentProducer<'static>,
) -> &'static mut Planner<'static> {
    static PLANNER: StaticCell<Planner<'static>> = StaticCell::new();
    PLANNER.init_with(|| Planner::new(robot, segments))
}

#[inline(never)]
fn controller(
    planner: &'static mut Planner<'static>,
    settings: Settings,
    identity: Identity,
) -> &'static mut Controller<'static, 'static> {
    static CONTROLLER: StaticCell<Controller<'static, 'static>> = StaticCell::new();
    CONTROLLER.init_with(|| Controller::new(planner, settings, identity))
}

#[embassy_executor::task]
async fn control_task(
    motion: &'static mut Motion<'static>,
    link: &'static Link,
    frames: &'static Frames,
    outputs: BoardOutputs,
    arm: BoardArm,
    stopwatch: Counter,
    watchdog: BoardWatchdog,
) {
    control::run(motion, link, frames, outputs, arm, stopwatch, watchdog).await
}

#[embassy_executor::task]
async fn setpoint_task(frames: &'static Frames, port: SetpointOut) {
    setpoints::run(frames, port).await
}

#[embassy_executor::task]
async fn sample_task(link: &'static Link, port: SampleIn) {
    samples::run(link, port).await
}

/// The future itself, not one that awaits it: that would hold its arguments twice, and its
/// first poll would move it by way of the stack.
#[embassy_executor::task]
fn command_task(commands: Commands<CommandIn, CommandOut, BoardFlash>) -> impl Future<Output = ()> {
    command::run(commands)
}

#[embassy_executor::task]
async fn idle_task() {
    board::idle().await
}
