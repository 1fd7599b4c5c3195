//! Lets programs that know nothing of emulators talk to the emulated controller: its command
//! port becomes a pseudo-terminal and a TCP port of this machine, its setpoint port another
//! TCP port.
//!
//! Bytes pass as they are. Several clients may be connected at a time: all of them hear
//! everything that the controller says, and it hears all of them, byte by byte as they come.
//! So one of them may send lines while others ask for the status; two that send lines would
//! mix them.

mod exchange;
mod pseudo_terminal;

use std::io;
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::Path;

use rustix::event::{PollFd, PollFlags, Timespec, poll};

use exchange::Exchange;
use pseudo_terminal::PseudoTerminal;

/// How long nothing is looked at but the command port's bytes. It bounds what a client waits
/// for being noticed. Setpoints come byte by byte, 83 000 a second: they are fetched this
/// often, and not each by itself.
const ROUND: Timespec = Timespec {
    tv_sec: 0,
    tv_nsec: 5_000_000,
};

/// A listener that only this machine reaches; 0 chooses a free port.
///
/// # Errors
/// The port is taken, or not allowed.
pub fn listen(port: u16) -> io::Result<TcpListener> {
    TcpListener::bind((Ipv4Addr::LOCALHOST, port))
}

/// The controller's two ports, and everybody who is connected to them.
pub struct Bridge {
    commands: Exchange,
    setpoints: Exchange,
}

/// How a bridge is reached.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ports {
    /// TCP port of the command port.
    pub tcp: u16,
    /// TCP port of the setpoint port.
    pub telemetry: u16,
}

/// What a bridge connects.
pub struct Ends {
    /// The controller's command port.
    pub commands: TcpStream,
    /// The controller's setpoint port.
    pub setpoints: TcpStream,
    /// For the clients of the command port.
    pub command_clients: TcpListener,
    /// For those of the setpoint port.
    pub setpoint_clients: TcpListener,
}

impl Bridge {
    /// Connects the controller's ports with a new pseudo-terminal and with the listeners.
    ///
    /// # Errors
    /// The system has no pseudo-terminal left.
    pub fn new(ends: Ends) -> io::Result<Self> {
        let terminal = PseudoTerminal::open()?;
        Ok(Self {
            commands: Exchange::new(ends.commands, ends.command_clients, Some(terminal))?,
            setpoints: Exchange::new(ends.setpoints, ends.setpoint_clients, None)?,
        })
    }

    /// The TCP ports.
    ///
    /// # Errors
    /// Never in practice: the listeners are open.
    pub fn ports(&self) -> io::Result<Ports> {
        Ok(Ports {
            tcp: self.commands.port()?,
            telemetry: self.setpoints.port()?,
        })
    }

    /// The pseudo-terminal's path.
    #[must_use]
    pub fn terminal(&self) -> Option<&Path> {
        self.commands.terminal().map(PseudoTerminal::path)
    }

    /// Carries bytes until `is_over`, which is asked every few milliseconds.
    ///
    /// # Errors
    /// The controller closed a port.
    pub fn serve(&mut self, mut is_over: impl FnMut() -> bool) -> io::Result<()> {
        while !is_over() {
            let waiting = self.commands.waiting_on();
            let mut polled: Vec<_> = waiting
                .map(|fd| PollFd::from_borrowed_fd(fd, PollFlags::IN))
                .collect();
            match poll(&mut polled, Some(&ROUND)) {
                Ok(_) | Err(rustix::io::Errno::INTR) => {}
                Err(error) => return Err(error.into()),
            }
            self.commands.carry()?;
            self.setpoints.carry()?;
        }
        Ok(())
    }
}
