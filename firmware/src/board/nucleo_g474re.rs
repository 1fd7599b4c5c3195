//! ST's NUCLEO-G474RE: an STM32G474RE at 170 MHz.
//!
//! | | |
//! |---|---|
//! | commands | LPUART1, PA2 / PA3: the ST-LINK's virtual serial port, 115200 Bd |
//! | setpoints | USART1 TX on PC4 (Arduino D1), 2 MBd |
//! | accelerometer or drives | USART1 RX on PC5 (Arduino D0), 2 MBd: a frame for each setpoint frame that asks for one |
//! | outputs | gripper PA5 (Arduino D13, LED LD2), blow-off PA6 (D12); high is on |
//! | inputs | limits of joints 1 to 4 on PA0, PA1, PA4, PB0 (A0 to A3), door PC1 (A4); pulled up, a switch to ground is active |
//! | clock | HSE 24 MHz, PLL ÷ 6 × 85 ÷ 2 |
#![allow(unsafe_code, reason = "interrupt handlers call their executors")]

use core::ops::Range;

use cortex_m::peripheral::DWT;
use defmt_rtt as _;
use embassy_executor::InterruptExecutor;
use embassy_stm32::flash::{self, Blocking, Flash};
use embassy_stm32::gpio::{Input, Level, Output, Pull, Speed};
use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_stm32::mode::Async;
use embassy_stm32::peripherals::{DMA1_CH1, DMA1_CH2, IWDG, LPUART1, USART1};
use embassy_stm32::time::Hertz;
use embassy_stm32::usart::{
    self, BufferedUart, BufferedUartRx, BufferedUartTx, RingBufferedUartRx, Uart, UartTx,
};
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{bind_interrupts, dma, rcc};
use embedded_io_async::{Read, Write};
use embedded_storage_async::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use panic_probe as _;
use planner_core::motion::Setpoint;
use planner_core::pose::JointPosition;
use static_cell::ConstStaticCell;

use super::{Arm, Board, ByteIn, ByteOut, Outputs, Stopwatch, WATCHDOG_MS, Watchdog};

/// What `$I+` calls it.
pub const NAME: &str = "nucleo-g474re";

/// The real board's parts.
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

const COMMAND_BAUD: u32 = 115_200;

/// A frame is 84 bytes of 10 bits, so 1 kHz takes 840 kBd; 170 MHz / 85 is exact.
const SETPOINT_BAUD: u32 = 2_000_000;

/// The command task may be planning while bytes arrive: 22 ms of them at 115200 Bd.
const RX_RING: usize = 256;

/// Samples of the accelerometer that wait: eleven of them, while the DMA writes on.
const SAMPLE_RING: usize = 256;

/// The longest answer and some more.
const TX_RING: usize = 256;

/// The time driver keeps P0. The command port comes last: its FIFO of eight bytes
/// lasts 0.7 ms.
mod priority {
    use super::Priority;
    pub const CONTROL: Priority = Priority::P2;
    pub const DMA: Priority = Priority::P4;
    pub const SETPOINTS: Priority = Priority::P5;
    pub const COMMANDS: Priority = Priority::P6;
}

bind_interrupts!(struct Irqs {
    LPUART1 => usart::BufferedInterruptHandler<LPUART1>;
    USART1 => usart::InterruptHandler<USART1>;
    DMA1_CHANNEL1 => dma::InterruptHandler<DMA1_CH1>;
    DMA1_CHANNEL2 => dma::InterruptHandler<DMA1_CH2>;
});

/// The executors run in the interrupts of peripherals which this board does not use.
static CONTROL: InterruptExecutor = InterruptExecutor::new();
static SETPOINTS: InterruptExecutor = InterruptExecutor::new();

#[embassy_stm32::interrupt]
unsafe fn SAI1() {
    // SAFETY: this is the executor's interrupt, unmasked by its `start`.
    unsafe { CONTROL.on_interrupt() }
}

#[embassy_stm32::interrupt]
unsafe fn UCPD1() {
    // SAFETY: likewise.
    unsafe { SETPOINTS.on_interrupt() }
}

/// Sets the board up; once.
pub fn start() -> Parts {
    let mut config = embassy_stm32::Config::default();
    config.rcc = clocks();
    // The G4's DMA goes by the name of BDMA in the HAL.
    config.bdma_interrupt_priority = priority::DMA;
    let p = embassy_stm32::init(config);
    defmt::info!("Stillpoint on NUCLEO-G474RE");

    static TX: ConstStaticCell<[u8; TX_RING]> = ConstStaticCell::new([0; TX_RING]);
    static RX: ConstStaticCell<[u8; RX_RING]> = ConstStaticCell::new([0; RX_RING]);
    let mut serial = usart::Config::default();
    serial.baudrate = COMMAND_BAUD;
    serial.eager_reads = Some(1);
    let commands = BufferedUart::new(p.LPUART1, p.PA3, p.PA2, TX.take(), RX.take(), Irqs, serial);
    let commands = defmt::unwrap!(commands, "115200 Bd is within LPUART1's range");
    let (command_out, command_in) = commands.split();

    let mut serial = usart::Config::default();
    serial.baudrate = SETPOINT_BAUD;
    static SAMPLES: ConstStaticCell<[u8; SAMPLE_RING]> = ConstStaticCell::new([0; SAMPLE_RING]);
    let port = Uart::new(p.USART1, p.PC5, p.PC4, p.DMA1_CH1, p.DMA1_CH2, Irqs, serial);
    let port = defmt::unwrap!(port, "2 MBd is within USART1's range");
    let (setpoints, samples) = port.split();
    let samples = samples.into_ring_buffered(SAMPLES.take());

    interrupt::LPUART1.set_priority(priority::COMMANDS);
    interrupt::USART1.set_priority(priority::COMMANDS);
    interrupt::SAI1.set_priority(priority::CONTROL);
    interrupt::UCPD1.set_priority(priority::SETPOINTS);
    let mut watchdog = IndependentWatchdog::new(p.IWDG, WATCHDOG_MS * 1000);
    watchdog.unleash();
    Board {
        command_in: CommandIn(command_in),
        command_out: CommandOut(command_out),
        setpoint_out: SetpointOut(setpoints),
        sample_in: SampleIn(samples),
        outputs: BoardOutputs {
            gripper: Output::new(p.PA5, Level::Low, Speed::Low),
            blow_off: Output::new(p.PA6, Level::Low, Speed::Low),
        },
        arm: BoardArm([
            Input::new(p.PA0, Pull::Up),
            Input::new(p.PA1, Pull::Up),
            Input::new(p.PA4, Pull::Up),
            Input::new(p.PB0, Pull::Up),
            Input::new(p.PC1, Pull::Up),
        ]),
        flash: BoardFlash(Flash::new_blocking(p.FLASH)),
        watchdog: BoardWatchdog(watchdog),
        stopwatch: Counter::start(),
        control: CONTROL.start(interrupt::SAI1),
        setpoints: SETPOINTS.start(interrupt::UCPD1),
    }
}

/// Nothing: the executor's WFE puts this core to sleep.
pub async fn idle() -> ! {
    core::future::pending().await
}

/// 170 MHz from the crystal; above 150 MHz the core needs the boost mode.
fn clocks() -> rcc::Config {
    let mut clocks = rcc::Config::new();
    clocks.hse = Some(rcc::Hse {
        freq: Hertz(24_000_000),
        mode: rcc::HseMode::Oscillator,
    });
    clocks.pll = Some(rcc::Pll {
        source: rcc::PllSource::HSE,
        prediv: rcc::PllPreDiv::DIV6,
        mul: rcc::PllMul::MUL85,
        divp: None,
        divq: None,
        divr: Some(rcc::PllRDiv::DIV2),
    });
    clocks.sys = rcc::Sysclk::PLL1_R;
    clocks.boost = true;
    clocks
}

/// The command port's receiving side.
pub struct CommandIn(BufferedUartRx<'static>);

impl ByteIn for CommandIn {
    async fn read(&mut self, into: &mut [u8]) -> usize {
        loop {
            match self.0.read(into).await {
                Ok(count) if count > 0 => return count,
                Ok(_) => {}
                Err(error) => defmt::warn!("command port: {}", error),
            }
        }
    }
}

/// The command port's sending side.
pub struct CommandOut(BufferedUartTx<'static>);

impl ByteOut for CommandOut {
    async fn write_all(&mut self, bytes: &[u8]) {
        if let Err(error) = Write::write_all(&mut self.0, bytes).await {
            defmt::warn!("command port: {}", error);
        }
    }
}

/// The setpoint port.
pub struct SetpointOut(UartTx<'static, Async>);

impl ByteOut for SetpointOut {
    async fn write_all(&mut self, bytes: &[u8]) {
        if let Err(error) = self.0.write(bytes).await {
            defmt::warn!("setpoint port: {}", error);
        }
    }
}

/// The setpoint port's receiving side, on which the accelerometer's samples come.
pub struct SampleIn(RingBufferedUartRx<'static>);

impl ByteIn for SampleIn {
    async fn read(&mut self, into: &mut [u8]) -> usize {
        loop {
            match self.0.read(into).await {
                Ok(count) if count > 0 => return count,
                Ok(_) => {}
                Err(error) => defmt::warn!("setpoint port: {}", error),
            }
        }
    }
}

/// The pins of the digital outputs.
pub struct BoardOutputs {
    gripper: Output<'static>,
    blow_off: Output<'static>,
}

impl Outputs for BoardOutputs {
    fn set(&mut self, bits: u8) {
        self.gripper.set_level((bits & 1 != 0).into());
        self.blow_off.set_level((bits & 2 != 0).into());
    }
}

/// The pins of the inputs: limits of joints 1 to 4, door.
pub struct BoardArm([Input<'static>; 5]);

impl Arm for BoardArm {
    fn inputs(&mut self) -> u8 {
        let low = self.0.iter().map(Input::is_low).enumerate();
        low.fold(0, |bits, (input, is_low)| bits | u8::from(is_low) << input)
    }

    fn encoders(&self) -> Option<JointPosition> {
        None
    }

    fn follow(&mut self, _: &Setpoint) {}
}

/// Where the store is: the last pages of the flash. They are in its second bank, so that code
/// runs on from the first while they are erased; `memory.x` keeps the program out of them.
pub const STORE: Range<u32> = FLASH_BYTES - 4 * 2048..FLASH_BYTES;

const FLASH_BYTES: u32 = 512 * 1024;

/// The microcontroller's own flash.
pub struct BoardFlash(Flash<'static, Blocking>);

impl ErrorType for BoardFlash {
    type Error = flash::Error;
}

impl ReadNorFlash for BoardFlash {
    const READ_SIZE: usize = flash::READ_SIZE;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), flash::Error> {
        self.0.blocking_read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        FLASH_BYTES as usize
    }
}

impl NorFlash for BoardFlash {
    const WRITE_SIZE: usize = flash::WRITE_SIZE;
    const ERASE_SIZE: usize = 2048;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), flash::Error> {
        self.0.blocking_erase(from, to)
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), flash::Error> {
        self.0.blocking_write(offset, bytes)
    }
}

/// The independent watchdog, on its own oscillator.
pub struct BoardWatchdog(IndependentWatchdog<'static, IWDG>);

impl Watchdog for BoardWatchdog {
    fn feed(&mut self) {
        self.0.pet();
    }
}

/// Counts core cycles.
#[derive(Clone, Copy)]
pub struct Counter {
    reading: u32,
}

impl Counter {
    fn start() -> Self {
        // `embassy_stm32::init` takes only ST's peripherals; the core's are free.
        if let Some(mut core) = cortex_m::Peripherals::take() {
            core.DCB.enable_trace();
            core.DWT.enable_cycle_counter();
        }
        let start = DWT::cycle_count();
        Self {
            reading: DWT::cycle_count().wrapping_sub(start),
        }
    }
}

impl Stopwatch for Counter {
    const UNIT: &'static str = "cycles";

    fn now(&self) -> u32 {
        DWT::cycle_count()
    }

    fn since(&self, start: u32) -> u32 {
        DWT::cycle_count()
            .wrapping_sub(start)
            .saturating_sub(self.reading)
    }
}
