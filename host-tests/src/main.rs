//! The program `stillpoint`.

use std::io::{self, Write};
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use host_tests::commands::{
    Failure, compare, corner, demo, emulate, forward, identify, inverse, methods, monitor, overlap,
    prefilter, profile, run, send,
};

/// Motion control that leaves the robot still: plans, runs and measures path programs.
///
/// Without a command it runs the built-in corner path and writes pictures of it to
/// stillpoint-out/.
#[derive(Parser)]
#[command(version, name = "stillpoint")]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Subcommand)]
enum Command {
    /// Runs a program on the simulated robot and measures what it did.
    Run(run::RunArgs),
    /// Starts the emulated controller, for any sender to connect to.
    Emulate(emulate::EmulateArgs),
    /// Sends a program to a controller, real or emulated, and shows what it does.
    Send(send::SendArgs),
    /// Shows what a controller does.
    Monitor(monitor::MonitorArgs),
    /// Runs a program with every prefilter and shows the figures side by side.
    Compare(compare::CompareArgs),
    /// Runs a program by other methods of motion too and shows the figures side by side.
    Methods(methods::MethodsArgs),
    /// Solves one corner: how much two segments may overlap within a tolerance.
    Corner(corner::CornerArgs),
    /// Times a path of a tool that moves and turns, by velocity profile overlap.
    Overlap(overlap::OverlapArgs),
    /// Shows how long a prefilter is and how much vibration it leaves.
    Prefilter(prefilter::PrefilterArgs),
    /// Plans one move whose mode changes along its way, and simulates what the mode does.
    Profile(profile::ProfileArgs),
    /// Finds frequency and damping of a mode in the record of its free decay.
    Identify(identify::IdentifyArgs),
    /// From a pose to the joints, in the microcontroller's arithmetic.
    Inverse(inverse::InverseArgs),
    /// From the joints to a pose, in the microcontroller's arithmetic.
    Forward(forward::ForwardArgs),
}

fn main() -> ExitCode {
    let done = match Cli::parse().command {
        None => demo::execute(),
        Some(Command::Run(args)) => run::execute(&args),
        Some(Command::Emulate(args)) => emulate::execute(&args),
        Some(Command::Send(args)) => return end(send::execute(&args)),
        Some(Command::Monitor(args)) => return end(monitor::execute(&args)),
        Some(Command::Compare(args)) => compare::execute(&args),
        Some(Command::Methods(args)) => methods::execute(&args),
        Some(Command::Corner(args)) => corner::execute(&args),
        Some(Command::Overlap(args)) => overlap::execute(&args),
        Some(Command::Prefilter(args)) => prefilter::execute(&args),
        Some(Command::Profile(args)) => profile::execute(&args),
        Some(Command::Identify(args)) => return end(identify::execute(&args)),
        Some(Command::Inverse(args)) => inverse::execute(&args),
        Some(Command::Forward(args)) => forward::execute(&args),
    };
    end(done.map_err(Failure::from))
}

/// Says what there is to say; yields the exit status.
fn end(done: Result<String, Failure>) -> ExitCode {
    match done {
        Ok(answer) => say(&answer),
        Err(failure) => {
            say(&failure.answer);
            eprintln!("stillpoint: {:#}", failure.error);
            ExitCode::from(failure.status)
        }
    }
}

/// The answer goes to standard output, if there is one.
fn say(answer: &str) -> ExitCode {
    if answer.is_empty() {
        return ExitCode::SUCCESS;
    }
    match writeln!(io::stdout(), "{answer}") {
        // A reader that has seen enough is no error.
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            eprintln!("stillpoint: the answer cannot be written ({error})");
            ExitCode::FAILURE
        }
        _ => ExitCode::SUCCESS,
    }
}
