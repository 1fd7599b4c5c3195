//! The command task: carries out what the core's controller decides.

use core::fmt::Debug;
use core::future::poll_fn;
use core::pin::{Pin, pin};
use core::task::{Context, Poll};

use embassy_time::{Duration, Instant, with_deadline};
use embedded_storage_async::nor_flash::NorFlash;
use planner_core::identify::Listener;
use planner_core::motion::MotionSettings;
use planner_core::protocol::{Controller, RECORD_BYTES, Record, Step};
use planner_core::store::{BUFFER_BYTES, Buffer, Damaged, Store};

use crate::board::{ByteIn, ByteOut};
use crate::tasks::link::Link;

/// Bytes taken from the port at once.
const READ_BYTES: usize = 64;

/// Everything between the command port and the control task.
pub struct Commands<I, O, F: NorFlash> {
    /// Where commands come from.
    pub input: I,
    /// Where answers go.
    pub output: O,
    /// Decides.
    pub controller: &'static mut Controller<'static, 'static>,
    /// The place in which new settings of the robot travel to the control task and back.
    pub robot: &'static mut MotionSettings,
    /// To the control task.
    pub link: &'static Link,
    /// What outlasts power-off.
    pub store: Store<F>,
}

/// Serves the command port for ever.
pub async fn run<F: NorFlash<Error: Debug>>(commands: Commands<impl ByteIn, impl ByteOut, F>) {
    let Commands {
        mut input,
        mut output,
        controller,
        mut robot,
        link,
        mut store,
    } = commands;
    let mut memory = [0; BUFFER_BYTES];
    {
        let mut restoring = pin!(restore(controller, &mut store, &mut memory));
        poll_fn(|context| poll_apart(restoring.as_mut(), context)).await;
    }
    let mut bytes = [0; READ_BYTES];
    loop {
        let now = Instant::now();
        // A deadline that is now still takes what the port already has, so that a realtime
        // byte is heeded between any two steps.
        let mut wake = now;
        let step = {
            let report = link.report().await;
            controller.step(now.as_millis(), &report)
        };
        match &step {
            Step::Say(text) => output.write_all(text.as_bytes()).await,
            Step::Order(order) => link.order(*order).await,
            Step::Robot => {
                hand_over(robot, controller);
                robot = link.exchange_robot(robot).await;
            }
            Step::Keep(record) => {
                let mut value = [0; RECORD_BYTES];
                let value = controller.record(*record, &mut value);
                let mut saving = pin!(store.save(*record, value, &mut memory));
                let saved = poll_fn(|context| poll_apart(saving.as_mut(), context)).await;
                controller.kept(saved.is_ok());
            }
            Step::ForgetRecords => {
                let erased = store.erase().await;
                controller.kept(erased.is_ok());
            }
            Step::Listen(listen) => link.listener().await.listen(*listen),
            Step::Identify => {
                identify(&mut *link.listener().await, controller);
            }
            Step::Wait(until_ms) => {
                wake = until_ms.map_or(Instant::MAX, |ms| Instant::MIN + Duration::from_millis(ms));
            }
        }
        link.set_program_open(controller.program_is_open());
        link.set_inputs_inverted(controller.inputs_inverted());
        if let Ok(count) = with_deadline(wake, input.read(&mut bytes)).await {
            let now_ms = Instant::now().as_millis();
            for &byte in bytes.iter().take(count) {
                controller.receive(byte, now_ms);
            }
        }
    }
}

// What follows is not inlined, so that it is on the stack only while it is at work.

#[inline(never)]
fn poll_apart<F: Future>(future: Pin<&mut F>, context: &mut Context<'_>) -> Poll<F::Output> {
    future.poll(context)
}

#[inline(never)]
fn hand_over(robot: &mut MotionSettings, controller: &Controller<'_, '_>) {
    *robot = MotionSettings::from(controller.robot());
}

#[inline(never)]
fn identify(listener: &mut Listener, controller: &mut Controller<'_, '_>) {
    controller.identified(&listener.identify());
}

/// Gives the controller what has outlasted power-off. What cannot be read is erased.
async fn restore<F: NorFlash<Error: Debug>>(
    controller: &mut Controller<'_, '_>,
    store: &mut Store<F>,
    memory: &mut Buffer,
) {
    for record in Record::ALL {
        match store.load(record, memory).await {
            Ok(Some(value)) => controller.restore(record, value),
            Ok(None) => {}
            Err(Damaged) => {
                // If that fails too, the first setting to be kept will say so.
                let _ = store.erase().await;
                return controller.store_was_damaged();
            }
        }
    }
}
