//! `stillpoint emulate`: the emulated controller, for any sender.

use std::fs;
use std::io::{self, Write};
use std::net::TcpListener;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, anyhow, bail};
use clap::Args;
use planner_core::pose::AXES;
use serde_json::json;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

use crate::bridge::{Bridge, Ends, Ports, listen};
use crate::emulator::{Board, EmulatedBoard, Pace, PlantPort, build_image, check_qemu};
use crate::machine::{servo_settings, settings};
use crate::robot_file::RobotSettings;
use crate::sensed_plant::SensedPlant;

/// A signal from the terminal ends QEMU too; whoever is told first waits so long for the other.
const SIGNAL_SPREADS: Duration = Duration::from_millis(300);

/// Arguments of `emulate`.
#[derive(Args, Debug)]
#[command(
    allow_negative_numbers = true,
    after_help = "\
Any sender that speaks Grbl can connect to the pseudo-terminal, as to a serial port at any \
speed, or to the TCP port; and several at once: all of them hear everything that the controller \
says, and it hears all of them, byte by byte. Let one send lines; others may ask `?`, hold and \
resume. It listens on 127.0.0.1 only, and says nothing before it is asked: byte 0x18 (Ctrl-X) \
brings the banner."
)]
pub struct EmulateArgs {
    /// TCP port for senders; 0 chooses a free one.
    #[arg(long, value_name = "PORT", default_value_t = 0)]
    tcp: u16,
    /// TCP port for the setpoint frames; 0 chooses a free one.
    #[arg(long, value_name = "PORT", default_value_t = 0)]
    telemetry: u16,
    /// Symbolic link to the pseudo-terminal, for senders that need the same name every time.
    #[arg(long, value_name = "PATH")]
    link: Option<PathBuf>,
    /// Robot file (TOML) whose settings the controller gets; its own if there is none.
    #[arg(long, value_name = "FILE")]
    robot: Option<PathBuf>,
    /// Let the simulated robot of the robot file follow the setpoints; its accelerometer and its
    /// drives answer them, so that the controller can identify its mode.
    #[arg(long)]
    plant: bool,
    /// File that the controller's flash is kept in, made if there is none (16 MiB, mostly
    /// empty): settings and offsets outlast the emulator. Without it they outlast a reset.
    #[arg(long, value_name = "FILE")]
    flash: Option<PathBuf>,
    /// A second of the controller takes a second, as on a real board. This is the default.
    #[arg(long, conflicts_with = "fast")]
    real_time: bool,
    /// The controller's time runs as fast as this machine emulates.
    #[arg(long)]
    fast: bool,
    /// Ends after so many seconds; with Ctrl-C if there is none.
    #[arg(long = "for", value_name = "SECONDS", value_parser = seconds)]
    duration: Option<Duration>,
    /// Print the ports as one line of JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the command; yields what it has to say at its end.
///
/// # Errors
/// What is missing, a port that is taken, or the end of QEMU, in one sentence.
pub fn execute(args: &EmulateArgs) -> Result<String> {
    let robot = RobotSettings::load(args.robot.as_deref())?;
    let lines = match &args.robot {
        Some(_) => [settings(&robot.robot), servo_settings(&robot.plant.servos)].concat(),
        None => Vec::new(),
    };
    let command_clients = open_port(args.tcp, "--tcp")?;
    let setpoint_clients = open_port(args.telemetry, "--telemetry")?;
    let end = end_signal()?;
    check_qemu()?;
    let images = build_image(Board::Mps2An386)?;
    let image = images.first().context("the build made no image")?;
    let pace = if args.fast {
        Pace::Free
    } else {
        Pace::RealTime
    };
    let mut board = EmulatedBoard::boot(image, pace, args.flash.as_deref(), &lines)?;
    let mut setpoints = board.setpoints.try_clone()?;
    if args.plant {
        // It stands wherever the first setpoint says.
        let plant = SensedPlant::new(robot.plant.full([0.0; AXES]), 0);
        (_, setpoints) = PlantPort::attach(setpoints, plant)?;
    }
    let mut bridge = Bridge::new(Ends {
        commands: board.commands.try_clone()?,
        setpoints,
        command_clients,
        setpoint_clients,
    })
    .context("no pseudo-terminal can be opened")?;
    let terminal = bridge.terminal().unwrap_or(Path::new("")).to_path_buf();
    let link = args.link.as_deref();
    let _link = link.map(|link| Link::make(link, &terminal)).transpose()?;
    announce(args, pace, &terminal, bridge.ports()?)?;

    let start = Instant::now();
    let is_over = || {
        let late = args.duration.is_some_and(|limit| start.elapsed() >= limit);
        late || end.load(Ordering::Relaxed)
    };
    if bridge.serve(is_over).is_ok() {
        return Ok(goodbye(args));
    }
    // The ports are closed: QEMU has ended, maybe by the signal that is meant for us too.
    let patience = Instant::now() + SIGNAL_SPREADS;
    while Instant::now() < patience {
        if end.load(Ordering::Relaxed) {
            return Ok(goodbye(args));
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    Err(board.epitaph().into())
}

fn announce(args: &EmulateArgs, pace: Pace, terminal: &Path, ports: Ports) -> Result<()> {
    let Ports { tcp, telemetry } = ports;
    let mut out = io::stdout().lock();
    if args.json {
        let ports = json!({ "pty": terminal, "tcp": tcp, "telemetry": telemetry });
        writeln!(out, "{ports}")?;
    } else {
        let pace = match pace {
            Pace::RealTime => "in real time",
            Pace::Free => "as fast as this machine emulates",
        };
        let end = match args.duration {
            Some(duration) => format!("it ends after {} s, or with Ctrl-C", duration.as_secs_f64()),
            None => "Ctrl-C ends it".to_owned(),
        };
        let terminal = match &args.link {
            Some(link) => format!("{} -> {}", link.display(), terminal.display()),
            None => terminal.display().to_string(),
        };
        writeln!(
            out,
            "The firmware runs on an emulated Cortex-M4F, {pace}; {end}.\n  \
             pseudo-terminal  {terminal}\n  \
             TCP              127.0.0.1:{tcp}\n  \
             telemetry        127.0.0.1:{telemetry}\n\
             Try: stillpoint send tcp:127.0.0.1:{tcp} host-tests/programs/corner-path.gcode"
        )?;
    }
    Ok(out.flush()?)
}

/// The last line; scripts that parse get the ports and nothing else.
fn goodbye(args: &EmulateArgs) -> String {
    let text = if args.json {
        ""
    } else {
        "The emulator has ended."
    };
    text.to_owned()
}

fn open_port(port: u16, flag: &str) -> Result<TcpListener> {
    listen(port).map_err(|error| {
        anyhow!("port {port} of 127.0.0.1 cannot be opened ({error}): give {flag} another, or 0")
    })
}

/// Set by whatever asks a program to end.
fn end_signal() -> Result<Arc<AtomicBool>> {
    let end = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM, SIGHUP] {
        signal_hook::flag::register(signal, Arc::clone(&end))?;
    }
    Ok(end)
}

/// A symbolic link that ends with this value.
struct Link(PathBuf);

impl Link {
    fn make(link: &Path, target: &Path) -> Result<Self> {
        // One that an emulator left behind which was killed; never a file.
        if fs::read_link(link).is_ok() {
            fs::remove_file(link).with_context(|| in_the_way(link))?;
        }
        symlink(target, link).with_context(|| in_the_way(link))?;
        Ok(Self(link.to_path_buf()))
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.0);
    }
}

fn in_the_way(link: &Path) -> String {
    format!(
        "{}: the link cannot be made: give --link another place",
        link.display()
    )
}

fn seconds(text: &str) -> Result<Duration> {
    let seconds: f64 = text.parse().context("give a number of seconds")?;
    match Duration::try_from_secs_f64(seconds) {
        Ok(duration) => Ok(duration),
        Err(_) => bail!("give a number of seconds"),
    }
}
