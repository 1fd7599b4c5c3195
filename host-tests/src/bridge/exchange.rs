//! One port of the controller, and the clients that share it.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::os::fd::{AsFd, BorrowedFd};

use super::pseudo_terminal::PseudoTerminal;

/// Bytes that may wait for the controller before clients have to wait: it takes in some 10 to
/// 20 kilobytes a second, and a realtime command should not queue behind more.
const TO_CONTROLLER: usize = 1024;

/// Bytes that may wait for a client; one that does not read loses what comes after them.
const TO_CLIENT: usize = 64 * 1024;

/// Bytes read at once.
const CHUNK: usize = 16 * 1024;

/// A port and its clients.
pub struct Exchange {
    controller: TcpStream,
    to_controller: Vec<u8>,
    listener: TcpListener,
    terminal: Option<Client<PseudoTerminal>>,
    clients: Vec<Client<TcpStream>>,
}

struct Client<S> {
    stream: S,
    outgoing: Vec<u8>,
}

impl Exchange {
    pub fn new(
        controller: TcpStream,
        listener: TcpListener,
        terminal: Option<PseudoTerminal>,
    ) -> io::Result<Self> {
        controller.set_nonblocking(true)?;
        listener.set_nonblocking(true)?;
        Ok(Self {
            controller,
            to_controller: Vec::new(),
            listener,
            terminal: terminal.map(Client::new),
            clients: Vec::new(),
        })
    }

    pub fn port(&self) -> io::Result<u16> {
        Ok(self.listener.local_addr()?.port())
    }

    pub fn terminal(&self) -> Option<&PseudoTerminal> {
        self.terminal.as_ref().map(|client| &client.stream)
    }

    /// What tells that [`Exchange::carry`] has something to do.
    pub fn waiting_on(&self) -> impl Iterator<Item = BorrowedFd<'_>> {
        let ours = [self.controller.as_fd(), self.listener.as_fd()];
        let terminal = self.terminal().map(PseudoTerminal::as_fd);
        let clients = self.clients.iter().map(|client| client.stream.as_fd());
        // Clients that have to wait would be reported without end.
        let listening = self.has_room();
        let clients = terminal.into_iter().chain(clients);
        ours.into_iter().chain(clients.filter(move |_| listening))
    }

    /// Passes on whatever can be passed on without waiting.
    ///
    /// # Errors
    /// The controller closed its port, or the pseudo-terminal is no longer to be had.
    pub fn carry(&mut self) -> io::Result<()> {
        // New clients first: they hear everything that is said after they connected.
        while let Ok((stream, _)) = self.listener.accept() {
            if stream.set_nonblocking(true).is_ok() && stream.set_nodelay(true).is_ok() {
                self.clients.push(Client::new(stream));
            }
        }
        if let Some(terminal) = &mut self.terminal {
            terminal.stream.notice()?;
        }
        self.hear_clients();
        write_some(&mut self.controller, &mut self.to_controller)?;
        let mut said = [0; CHUNK];
        if let Some(count) = read_some(&mut self.controller, &mut said)? {
            self.tell_clients(&said[..count]);
        } else {
            self.tell_clients(&[]);
        }
        Ok(())
    }

    fn has_room(&self) -> bool {
        self.to_controller.len() < TO_CONTROLLER
    }

    fn hear_clients(&mut self) {
        let mut bytes = [0; TO_CONTROLLER];
        if let Some(terminal) = &mut self.terminal
            && self.to_controller.len() < TO_CONTROLLER
            && let Ok(Some(count)) = read_some(&mut terminal.stream, &mut bytes)
        {
            self.to_controller.extend(&bytes[..count]);
        }
        let to_controller = &mut self.to_controller;
        self.clients.retain_mut(|client| {
            if to_controller.len() >= TO_CONTROLLER {
                return true;
            }
            match read_some(&mut client.stream, &mut bytes) {
                Ok(Some(count)) => {
                    to_controller.extend(&bytes[..count]);
                    true
                }
                Ok(None) => true,
                Err(_) => false,
            }
        });
    }

    /// Offers bytes, and those that still wait, to all clients.
    fn tell_clients(&mut self, bytes: &[u8]) {
        if let Some(terminal) = &mut self.terminal {
            // A pseudo-terminal outlives every error: the next client may do better.
            let _ = terminal.tell(bytes);
        }
        self.clients.retain_mut(|client| client.tell(bytes).is_ok());
    }
}

impl<S: Write> Client<S> {
    fn new(stream: S) -> Self {
        Self {
            stream,
            outgoing: Vec::new(),
        }
    }

    fn tell(&mut self, bytes: &[u8]) -> io::Result<()> {
        if self.outgoing.len() + bytes.len() <= TO_CLIENT {
            self.outgoing.extend(bytes);
        }
        write_some(&mut self.stream, &mut self.outgoing)
    }
}

/// Reads what is there; none if nothing is.
///
/// # Errors
/// The other side closed, or failed.
fn read_some(stream: &mut impl Read, into: &mut [u8]) -> io::Result<Option<usize>> {
    match stream.read(into) {
        Ok(0) => Err(ErrorKind::UnexpectedEof.into()),
        Ok(count) => Ok(Some(count)),
        Err(error) if is_for_later(&error) => Ok(None),
        Err(error) => Err(error),
    }
}

/// Writes as much as fits.
fn write_some(stream: &mut impl Write, bytes: &mut Vec<u8>) -> io::Result<()> {
    while !bytes.is_empty() {
        match stream.write(bytes) {
            Ok(count) => drop(bytes.drain(..count)),
            Err(error) if is_for_later(&error) => break,
            Err(error) => return Err(error),
        }
    }
    Ok(())
}

fn is_for_later(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bridge::listen;
    use rustix::fs::OFlags;
    use rustix::termios::{LocalModes, OptionalActions, ioctl_tiocexcl, tcgetattr, tcsetattr};
    use std::fs::OpenOptions;
    use std::os::unix::fs::OpenOptionsExt;
    use std::time::{Duration, Instant};

    /// An exchange with a pseudo-terminal, and the controller's end of it.
    fn exchange() -> (Exchange, TcpStream) {
        let for_controller = listen(0).unwrap();
        let controller = TcpStream::connect(for_controller.local_addr().unwrap()).unwrap();
        controller.set_nodelay(true).unwrap();
        let (ours, _) = for_controller.accept().unwrap();
        controller
            .set_read_timeout(Some(Duration::from_millis(20)))
            .unwrap();
        let terminal = PseudoTerminal::open().unwrap();
        let exchange = Exchange::new(ours, listen(0).unwrap(), Some(terminal)).unwrap();
        (exchange, controller)
    }

    fn client(exchange: &Exchange) -> TcpStream {
        let stream = TcpStream::connect(("127.0.0.1", exchange.port().unwrap())).unwrap();
        stream
            .set_read_timeout(Some(Duration::from_millis(20)))
            .unwrap();
        stream
    }

    /// What a reader hears while the exchange works, until it is `expected`.
    fn hears(exchange: &mut Exchange, from: &mut impl Read, expected: &[u8]) {
        let (mut heard, start) = (Vec::new(), Instant::now());
        while heard != expected && start.elapsed() < Duration::from_secs(10) {
            exchange.carry().unwrap();
            let mut bytes = [0; 4096];
            if let Ok(count) = from.read(&mut bytes) {
                heard.extend(&bytes[..count]);
            }
        }
        assert_eq!(
            String::from_utf8_lossy(&heard),
            String::from_utf8_lossy(expected)
        );
    }

    fn open(exchange: &Exchange) -> std::fs::File {
        let path = exchange.terminal().unwrap().path().to_path_buf();
        let mut options = OpenOptions::new();
        let options = options.read(true).write(true);
        let never_waits = OFlags::NONBLOCK.bits() as i32;
        options.custom_flags(never_waits).open(path).unwrap()
    }

    #[test]
    fn all_hear_the_controller_and_it_hears_all() {
        let (mut exchange, mut controller) = exchange();
        let (mut one, mut other) = (client(&exchange), client(&exchange));
        let mut terminal = open(&exchange);
        exchange.carry().unwrap();
        controller.write_all(b"hello\r\n\x91\0\n").unwrap();
        hears(&mut exchange, &mut one, b"hello\r\n\x91\0\n");
        hears(&mut exchange, &mut other, b"hello\r\n\x91\0\n");
        hears(&mut exchange, &mut terminal, b"hello\r\n\x91\0\n");
        one.write_all(b"?").unwrap();
        hears(&mut exchange, &mut controller, b"?");
        terminal.write_all(b"\x18\x03\r\n").unwrap();
        hears(&mut exchange, &mut controller, b"\x18\x03\r\n");
        drop(one);
        other.write_all(b"!").unwrap();
        hears(&mut exchange, &mut controller, b"!");
    }

    #[test]
    fn every_client_of_the_terminal_finds_it_fresh() {
        let (mut exchange, mut controller) = exchange();
        for round in 0..3 {
            // Nobody listens, and nothing waits for somebody.
            controller.write_all(b"unheard\r\n").unwrap();
            for _ in 0..5 {
                exchange.carry().unwrap();
                std::thread::sleep(Duration::from_millis(1));
            }
            let mut terminal = open(&exchange);
            let line = format!("line {round}\n");
            terminal.write_all(line.as_bytes()).unwrap();
            hears(&mut exchange, &mut controller, line.as_bytes());
            controller.write_all(b"ok\r\n").unwrap();
            hears(&mut exchange, &mut terminal, b"ok\r\n");
            // This client leaves line editing behind, a lock, and unread bytes.
            let mut settings = tcgetattr(&terminal).unwrap();
            settings.local_modes |= LocalModes::ICANON;
            tcsetattr(&terminal, OptionalActions::Now, &settings).unwrap();
            ioctl_tiocexcl(&terminal).unwrap();
            controller.write_all(b"unread\r\n").unwrap();
            std::thread::sleep(Duration::from_millis(5));
            exchange.carry().unwrap();
            drop(terminal);
            exchange.carry().unwrap();
        }
    }

    #[test]
    fn a_client_that_does_not_read_holds_nobody_up() {
        let (mut exchange, mut controller) = exchange();
        let (_deaf, mut other) = (client(&exchange), client(&exchange));
        exchange.carry().unwrap();
        let chunk = [b'x'; 8192];
        for _ in 0..2000 {
            controller.write_all(&chunk).unwrap();
            hears(&mut exchange, &mut other, &chunk);
        }
    }

    #[test]
    fn the_controllers_end_is_noticed() {
        let (mut exchange, controller) = exchange();
        exchange.carry().unwrap();
        drop(controller);
        std::thread::sleep(Duration::from_millis(5));
        assert!(exchange.carry().is_err());
    }
}
