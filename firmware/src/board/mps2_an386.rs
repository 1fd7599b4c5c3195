//! The emulated board: a Cortex-M4F at 25 MHz, QEMU's machine `mps2-an386`.
//!
//! Addresses are those of ARM's application note 386 and of the CMSDK manual.
//! Of the board, QEMU 7.2 models the UARTs, the timers and the watchdog; the
//! latter counts down, interrupts (NMI) at zero and resets at the second zero.
#![allow(
    unsafe_code,
    reason = "registers, interrupt handlers and their executors"
)]

use core::cell::RefCell;
use core::fmt::Write;
use core::future::poll_fn;
use core::ops::Range;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use core::task::{Poll, Waker};

use cortex_m::interrupt::InterruptNumber;
use cortex_m::peripheral::scb::SystemHandler;
use cortex_m::peripheral::syst::SystClkSource;
use critical_section::Mutex;
use defmt_rtt as _;
use embassy_executor::InterruptExecutor;
use embassy_sync::waitqueue::AtomicWaker;
use embassy_time::Timer;
use embassy_time_queue_utils::Queue;
use embedded_storage_async::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use heapless::Deque;
use planner_core::motion::Setpoint;
use planner_core::pose::{AXES, JointPosition};

use super::{Arm, Board, ByteIn, ByteOut, Outputs, Stopwatch, WATCHDOG_MS, Watchdog};

const CORE_HZ: u32 = 25_000_000;

/// SysTick is the time driver, at this rate, however fine embassy-time counts.
const SYSTICK_HZ: u32 = 1000;

/// Counts of embassy-time from one SysTick to the next.
const TIME_PER_SYSTICK: u64 = embassy_time::TICK_HZ / SYSTICK_HZ as u64;

/// What `$I+` calls it.
pub const NAME: &str = "mps2-an386";

/// The emulated board's parts.
pub type Parts = Board<
    CommandIn,
    CommandOut,
    SetpointOut,
    SampleIn,
    BoardOutputs,
    BoardArm,
    BoardFlash,
    BoardWatchdog,
    Counter,
>;

/// A memory-mapped register.
#[derive(Clone, Copy)]
struct Register(usize);

impl Register {
    fn read(self) -> u32 {
        // SAFETY: the addresses in this file are word-aligned registers of the
        // board, which are readable at any time.
        unsafe { (self.0 as *const u32).read_volatile() }
    }

    fn write(self, value: u32) {
        // SAFETY: as above, and writable; none of them touches Rust's memory.
        unsafe { (self.0 as *mut u32).write_volatile(value) }
    }
}

/// A CMSDK UART.
#[derive(Clone, Copy)]
struct Uart(usize);

impl Uart {
    const COMMANDS: Self = Self(0x4000_4000);
    const SETPOINTS: Self = Self(0x4000_5000);

    const TX_FULL: u32 = 1 << 0;
    const RX_FULL: u32 = 1 << 1;
    const TX_ENABLE: u32 = 1 << 0;
    const RX_ENABLE: u32 = 1 << 1;
    const RX_INTERRUPT: u32 = 1 << 3;
    const INTERRUPT_RX: u32 = 1 << 1;
    /// The least divider the UART takes; QEMU sends at once whatever it is.
    const LEAST_DIVIDER: u32 = 16;

    fn data(self) -> Register {
        Register(self.0)
    }

    fn state(self) -> u32 {
        Register(self.0 + 0x4).read()
    }

    fn enable(self, control: u32) {
        Register(self.0 + 0x10).write(Self::LEAST_DIVIDER);
        Register(self.0 + 0x8).write(control);
    }

    fn clear_rx_interrupt(self) {
        Register(self.0 + 0xC).write(Self::INTERRUPT_RX);
    }

    fn write_now(self, bytes: &[u8]) {
        for &byte in bytes {
            while self.state() & Self::TX_FULL != 0 {}
            self.data().write(byte.into());
        }
    }
}

/// Interrupts of the board that are used here.
#[derive(Clone, Copy)]
#[repr(u16)]
enum Interrupt {
    CommandRx = 0,
    /// UART1's.
    SampleRx = 2,
    /// 29 and 30 are wired to nothing and run the executors.
    Setpoints = 29,
    Control = 30,
}

// SAFETY: the numbers are those of the board, and each stands once.
unsafe impl InterruptNumber for Interrupt {
    fn number(self) -> u16 {
        self as u16
    }
}

/// Lower is more urgent; the time driver has 0. The receivers come last because
/// QEMU holds a byte back until the one before it was read.
mod priority {
    pub const CONTROL: u8 = 0x20;
    pub const SETPOINTS: u8 = 0x40;
    pub const RX: u8 = 0x60;
}

static CONTROL: InterruptExecutor = InterruptExecutor::new();
static SETPOINTS: InterruptExecutor = InterruptExecutor::new();
static STARTED: AtomicBool = AtomicBool::new(false);

/// Sets the board up; once.
pub fn start() -> Parts {
    assert!(
        !STARTED.swap(true, Ordering::Relaxed),
        "start() is for once"
    );
    // SAFETY: the line above sees to it that this is the only instance.
    let mut core = unsafe { cortex_m::Peripherals::steal() };
    defmt::timestamp!("{=u64:ms}", embassy_time::Instant::now().as_millis());

    core.SYST.set_clock_source(SystClkSource::Core);
    core.SYST.set_reload(CORE_HZ / SYSTICK_HZ - 1);
    core.SYST.clear_current();
    core.SYST.enable_counter();
    core.SYST.enable_interrupt();

    Uart::COMMANDS.enable(Uart::TX_ENABLE | Uart::RX_ENABLE | Uart::RX_INTERRUPT);
    Uart::SETPOINTS.enable(Uart::TX_ENABLE | Uart::RX_ENABLE | Uart::RX_INTERRUPT);

    // SAFETY: no critical section relies on a priority, and the executors are
    // started after theirs is set.
    unsafe {
        core.SCB.set_priority(SystemHandler::SysTick, 0);
        core.NVIC
            .set_priority(Interrupt::Control, priority::CONTROL);
        core.NVIC
            .set_priority(Interrupt::Setpoints, priority::SETPOINTS);
        core.NVIC.set_priority(Interrupt::CommandRx, priority::RX);
        core.NVIC.set_priority(Interrupt::SampleRx, priority::RX);
        cortex_m::peripheral::NVIC::unmask(Interrupt::CommandRx);
        cortex_m::peripheral::NVIC::unmask(Interrupt::SampleRx);
    }
    Board {
        command_in: CommandIn(()),
        command_out: UartOut(Uart::COMMANDS),
        setpoint_out: UartOut(Uart::SETPOINTS),
        sample_in: SampleIn(()),
        outputs: BoardOutputs(()),
        arm: BoardArm::at_power_up(),
        flash: BoardFlash::start(),
        watchdog: BoardWatchdog::start(),
        stopwatch: Counter::start(),
        control: CONTROL.start(Interrupt::Control),
        setpoints: SETPOINTS.start(Interrupt::Setpoints),
    }
}

/// Spins, because a core that sleeps has no exact time.
///
/// While an emulated core sleeps (WFI), QEMU moves virtual time on by the real time
/// that went by; when the PC is late, several control periods pass at once, and an
/// overrun is counted that the firmware never had. A core that is awake moves time
/// on by its instructions alone. The executor's own WFE is no operation to QEMU, but
/// one that hands over to its main loop, which is what makes it slow; so it comes
/// only every so often, and the thread notices its work that much later (0.13 ms).
pub async fn idle() -> ! {
    const INSTRUCTIONS: u32 = 2000;
    loop {
        cortex_m::asm::delay(INSTRUCTIONS);
        embassy_futures::yield_now().await;
    }
}

/// Sets up what measuring needs, and no interrupt that would be measured too.
pub fn start_measuring() -> (Counter, Console) {
    Uart::COMMANDS.enable(Uart::TX_ENABLE);
    (Counter::start(), Console(()))
}

/// Text on the command port, without tasks.
pub struct Console(());

impl core::fmt::Write for Console {
    fn write_str(&mut self, text: &str) -> core::fmt::Result {
        Uart::COMMANDS.write_now(text.as_bytes());
        Ok(())
    }
}

/// Without the `device` feature of cortex-m-rt all interrupts arrive here.
///
/// SAFETY: it calls the executors, which only their own interrupts may do.
#[cortex_m_rt::exception]
unsafe fn DefaultHandler(number: i16) {
    const COMMAND_RX: i16 = Interrupt::CommandRx as i16;
    const SAMPLE_RX: i16 = Interrupt::SampleRx as i16;
    const CONTROL_: i16 = Interrupt::Control as i16;
    const SETPOINTS_: i16 = Interrupt::Setpoints as i16;
    match number {
        COMMAND_RX => COMMANDS.receive(),
        SAMPLE_RX => SAMPLES.receive(),
        // SAFETY: this is the executor's interrupt, unmasked by its `start`.
        CONTROL_ => unsafe { CONTROL.on_interrupt() },
        // SAFETY: likewise.
        SETPOINTS_ => unsafe { SETPOINTS.on_interrupt() },
        _ => panic!("an exception that has no handler"),
    }
}

/// Bytes between a receive interrupt and the task that reads them.
const RX_RING: usize = 128;

/// A port's receiving side.
struct Receiver {
    uart: Uart,
    ring: Mutex<RefCell<Deque<u8, RX_RING>>>,
    received_some: AtomicWaker,
}

static COMMANDS: Receiver = Receiver::new(Uart::COMMANDS);
static SAMPLES: Receiver = Receiver::new(Uart::SETPOINTS);

impl Receiver {
    const fn new(uart: Uart) -> Self {
        Self {
            uart,
            ring: Mutex::new(RefCell::new(Deque::new())),
            received_some: AtomicWaker::new(),
        }
    }

    /// Takes a byte, unless the ring is full: then QEMU keeps the next ones back until
    /// [`Receiver::read`] has made room, and nothing is lost.
    fn receive(&self) {
        self.uart.clear_rx_interrupt();
        critical_section::with(|cs| {
            let mut ring = self.ring.borrow_ref_mut(cs);
            if !ring.is_full() && self.uart.state() & Uart::RX_FULL != 0 {
                let _ = ring.push_back(self.uart.data().read() as u8);
            }
        });
        self.received_some.wake();
    }

    async fn read(&self, into: &mut [u8]) -> usize {
        poll_fn(|context| {
            self.received_some.register(context.waker());
            let count = critical_section::with(|cs| {
                let mut ring = self.ring.borrow_ref_mut(cs);
                let mut count = 0;
                for place in into.iter_mut() {
                    let Some(byte) = ring.pop_front() else { break };
                    *place = byte;
                    count += 1;
                }
                count
            });
            if count == 0 {
                return Poll::Pending;
            }
            self.receive();
            Poll::Ready(count)
        })
        .await
    }
}

/// The command port's receiving side; one only, because it is made once.
pub struct CommandIn(());

impl ByteIn for CommandIn {
    async fn read(&mut self, into: &mut [u8]) -> usize {
        COMMANDS.read(into).await
    }
}

/// The setpoint port's receiving side, on which the accelerometer's samples come.
pub struct SampleIn(());

impl ByteIn for SampleIn {
    async fn read(&mut self, into: &mut [u8]) -> usize {
        SAMPLES.read(into).await
    }
}

/// A port's sending side.
pub struct UartOut(Uart);

/// The command port's sending side.
pub type CommandOut = UartOut;

/// The setpoint port.
pub type SetpointOut = UartOut;

impl ByteOut for UartOut {
    async fn write_all(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            // Full only while the other end of QEMU's connection does not read.
            while self.0.state() & Uart::TX_FULL != 0 {
                Timer::after_millis(1).await;
            }
            self.0.data().write(byte.into());
        }
    }
}

/// The board's two LEDs, in its system registers; they stand for the outputs.
pub struct BoardOutputs(());

impl BoardOutputs {
    const LEDS: Register = Register(0x4002_8000);
}

impl Outputs for BoardOutputs {
    fn set(&mut self, bits: u8) {
        Self::LEDS.write(bits.into());
    }
}

/// The bench robot's arm, as far as its drives, encoders and limit inputs go: it follows the
/// setpoints' changes from where it was at power-up, which the controller does not know.
///
/// Who says where it is before it has moved is believed, so that a program that begins with its
/// first point finds the limit inputs where it expects them.
pub struct BoardArm {
    joints: [i32; AXES],
    /// The last setpoint.
    setpoint: Option<[i32; AXES]>,
    has_moved: bool,
}

impl BoardArm {
    /// 2^-26 rad a degree, 2^-19 mm a millimetre.
    const DEG: f64 = (1 << 26) as f64 * core::f64::consts::PI / 180.0;
    const MM: f64 = (1 << 19) as f64;

    /// Where the joints are at power-up: -30°, 60°, 20 mm, 15°.
    const POWER_UP: [i32; AXES] = [
        (-30.0 * Self::DEG) as i32,
        (60.0 * Self::DEG) as i32,
        (20.0 * Self::MM) as i32,
        (15.0 * Self::DEG) as i32,
    ];

    /// Where the limit inputs become active: at -165° and 10°, at 190 mm from below, at -360°.
    const SWITCHES: [(i32, bool); AXES] = [
        ((-165.0 * Self::DEG) as i32, false),
        ((10.0 * Self::DEG) as i32, false),
        ((190.0 * Self::MM) as i32, true),
        ((-360.0 * Self::DEG) as i32, false),
    ];

    const fn at_power_up() -> Self {
        Self {
            joints: Self::POWER_UP,
            setpoint: None,
            has_moved: false,
        }
    }
}

impl Arm for BoardArm {
    fn inputs(&mut self) -> u8 {
        let mut bits = 0;
        let joints = self.joints.into_iter().zip(Self::SWITCHES).enumerate();
        for (joint, (position, (switch, is_upper))) in joints {
            let is_active = if is_upper {
                position >= switch
            } else {
                position <= switch
            };
            bits |= u8::from(is_active) << joint;
        }
        bits
    }

    fn encoders(&self) -> Option<JointPosition> {
        Some(JointPosition::from_bits(self.joints))
    }

    fn follow(&mut self, setpoint: &Setpoint) {
        let position = setpoint.joints.position.to_bits();
        let last = self.setpoint.replace(position).unwrap_or(position);
        if setpoint.placed {
            if !self.has_moved {
                self.joints = position;
            }
            return;
        }
        for ((joint, to), from) in self.joints.iter_mut().zip(position).zip(last) {
            self.has_moved |= to != from;
            *joint = joint.saturating_add(to.wrapping_sub(from));
        }
    }
}

/// Where the store is, in the simulated flash.
pub const STORE: Range<u32> = 0..BoardFlash::BYTES as u32;

/// A flash memory with 8-byte words and 2 KiB pages, as in the real board, simulated in the
/// machine's PSRAM: it outlasts a reset, and the emulator if that keeps the PSRAM in a file.
pub struct BoardFlash(());

impl BoardFlash {
    const BASE: usize = 0x2100_0000;
    const BYTES: usize = 4 * 2048;
    /// Behind the flash: tells one that was ever erased from memory that was just switched on.
    const MARK: Register = Register(Self::BASE + Self::BYTES);
    const MARKED: u32 = 0x5350_4653;
    const ERASED: u32 = u32::MAX;

    fn start() -> Self {
        if Self::MARK.read() != Self::MARKED {
            for at in (0..Self::BYTES).step_by(4) {
                Register(Self::BASE + at).write(Self::ERASED);
            }
            Self::MARK.write(Self::MARKED);
        }
        Self(())
    }

    /// The registers of a range, or an error if it is not within the flash.
    fn registers(from: u32, length: usize) -> Result<Range<usize>, NorFlashErrorKind> {
        let from = from as usize;
        match from.checked_add(length) {
            Some(end) if end <= Self::BYTES => Ok(Self::BASE + from..Self::BASE + end),
            _ => Err(NorFlashErrorKind::OutOfBounds),
        }
    }
}

impl ErrorType for BoardFlash {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for BoardFlash {
    const READ_SIZE: usize = 4;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        let registers = Self::registers(offset, bytes.len())?;
        for (at, word) in registers.step_by(4).zip(bytes.chunks_mut(4)) {
            let value = Register(at).read().to_le_bytes();
            for (byte, value) in word.iter_mut().zip(value) {
                *byte = value;
            }
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        Self::BYTES
    }
}

impl NorFlash for BoardFlash {
    const WRITE_SIZE: usize = 8;
    const ERASE_SIZE: usize = 2048;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        for at in Self::registers(from, to.saturating_sub(from) as usize)?.step_by(4) {
            Register(at).write(Self::ERASED);
        }
        Ok(())
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        let registers = Self::registers(offset, bytes.len())?;
        let (words, _) = bytes.as_chunks::<4>();
        for (at, word) in registers.step_by(4).zip(words) {
            let place = Register(at);
            // writing can only clear bits
            place.write(place.read() & u32::from_le_bytes(*word));
        }
        Ok(())
    }
}

/// The CMSDK watchdog, at the core clock.
pub struct BoardWatchdog(());

impl BoardWatchdog {
    const LOAD: Register = Register(0x4000_8000);
    const CONTROL: Register = Register(0x4000_8008);
    const INTERRUPT_CLEAR: Register = Register(0x4000_800C);
    const LOCK: Register = Register(0x4000_8C00);
    const UNLOCK: u32 = 0x1ACC_E551;
    const INTERRUPT_AND_RESET: u32 = 0b11;

    fn start() -> Self {
        Self::LOCK.write(Self::UNLOCK);
        // Half the time, because the reset comes with the second zero.
        Self::LOAD.write(CORE_HZ / 1000 * WATCHDOG_MS / 2);
        Self::CONTROL.write(Self::INTERRUPT_AND_RESET);
        Self(())
    }
}

impl Watchdog for BoardWatchdog {
    fn feed(&mut self) {
        Self::INTERRUPT_CLEAR.write(1);
    }
}

/// The watchdog's first zero; the second resets.
#[cortex_m_rt::exception]
unsafe fn NonMaskableInt() {}

/// Counts instructions: under `-icount shift=6` each takes 64 ns, which is 1.6
/// counts of CMSDK timer 0. The count is a whole number, so a result may be one
/// instruction off.
#[derive(Clone, Copy)]
pub struct Counter {
    reading_counts: u32,
}

impl Counter {
    const CONTROL: Register = Register(0x4000_0000);
    const VALUE: Register = Register(0x4000_0004);
    const RELOAD: Register = Register(0x4000_0008);

    /// Starts the timer and measures what a reading costs.
    pub fn start() -> Self {
        Self::RELOAD.write(u32::MAX);
        Self::VALUE.write(u32::MAX);
        Self::CONTROL.write(1);
        let start = Self::VALUE.read();
        let end = Self::VALUE.read();
        Self {
            reading_counts: start.wrapping_sub(end),
        }
    }
}

impl Stopwatch for Counter {
    const UNIT: &'static str = "instructions";

    fn now(&self) -> u32 {
        Self::VALUE.read()
    }

    fn since(&self, start: u32) -> u32 {
        let counts = start
            .wrapping_sub(Self::VALUE.read())
            .saturating_sub(self.reading_counts);
        // 64 ns × 25 MHz = 8/5 counts an instruction, to the nearest.
        ((u64::from(counts) * 5 + 4) / 8) as u32
    }
}

/// Time from SysTick interrupts.
struct TimeDriver {
    ticks: AtomicU32,
    wraps: AtomicU32,
    queue: Mutex<RefCell<Queue>>,
}

embassy_time_driver::time_driver_impl!(static TIME: TimeDriver = TimeDriver {
    ticks: AtomicU32::new(0),
    wraps: AtomicU32::new(0),
    queue: Mutex::new(RefCell::new(Queue::new())),
});

impl embassy_time_driver::Driver for TimeDriver {
    fn now(&self) -> u64 {
        loop {
            let wraps = self.wraps.load(Ordering::Acquire);
            let ticks = self.ticks.load(Ordering::Acquire);
            if wraps == self.wraps.load(Ordering::Acquire) {
                return (u64::from(wraps) << 32 | u64::from(ticks)) * TIME_PER_SYSTICK;
            }
        }
    }

    fn schedule_wake(&self, at: u64, waker: &Waker) {
        critical_section::with(|cs| {
            let mut queue = self.queue.borrow_ref_mut(cs);
            if queue.schedule_wake(at, waker) {
                queue.next_expiration(self.now());
            }
        });
    }
}

#[cortex_m_rt::exception]
fn SysTick() {
    let ticks = TIME.ticks.load(Ordering::Relaxed).wrapping_add(1);
    if ticks == 0 {
        let wraps = TIME.wraps.load(Ordering::Relaxed);
        TIME.wraps.store(wraps.wrapping_add(1), Ordering::Release);
    }
    TIME.ticks.store(ticks, Ordering::Release);
    critical_section::with(|cs| {
        let now = embassy_time_driver::Driver::now(&TIME);
        TIME.queue.borrow_ref_mut(cs).next_expiration(now);
    });
}

/// Says where, on the command port, and stops; the watchdog does the rest.
#[panic_handler]
fn panic(info: &core::panic::PanicInfo<'_>) -> ! {
    cortex_m::interrupt::disable();
    let _ = match info.location() {
        Some(at) => write!(
            Console(()),
            "\r\n[MSG:panic in {} line {}]\r\n",
            at.file(),
            at.line()
        ),
        None => write!(Console(()), "\r\n[MSG:panic]\r\n"),
    };
    loop {
        cortex_m::asm::nop();
    }
}
