//! A connection to a controller: bytes out, lines in.

use std::io::{self, BufRead, BufReader, ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use serialport::SerialPort;

use super::{Address, Reply};

/// The reader looks this often whether anybody still listens to it.
const READ_TIMEOUT: Duration = Duration::from_millis(200);

/// A link that takes no byte for so long is broken: what is under way always fits into the
/// controller's buffer.
const WRITE_TIMEOUT: Duration = Duration::from_secs(2);

/// How long a TCP port may take to answer.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(5);

/// A longer line is noise.
const LONGEST_LINE: u64 = 4096;

/// Why there is no link.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    /// It cannot be opened.
    #[error(
        "{0}: the port cannot be opened ({1}): check its name, and that no other program has it"
    )]
    Unopened(Address, String),
    /// It was there, and is not any more.
    #[error("{0}: the link is lost ({1}): check the cable and the controller's power")]
    Lost(Address, String),
    /// It is there, but nobody answers.
    #[error(
        "{0}: the controller has not answered for {1} s: check that it runs, and the speed of the port"
    )]
    Silent(Address, f64),
}

/// What came of waiting.
#[derive(Clone, Debug, PartialEq)]
pub enum Heard {
    /// The controller said something.
    Reply(Reply),
    /// Nothing within the time.
    Nothing,
}

/// An open link, read by a thread of its own.
pub struct Connection {
    address: Address,
    out: Box<dyn Write + Send>,
    replies: Receiver<io::Result<Reply>>,
}

impl Connection {
    /// Opens a link. `baud` is for serial devices alone.
    ///
    /// # Errors
    /// [`LinkError::Unopened`].
    pub fn open(address: &Address, baud: u32) -> Result<Self, LinkError> {
        match address {
            Address::Tcp(name) => {
                let stream = connect(name).map_err(|error| unopened(address, &error))?;
                let reader = stream
                    .try_clone()
                    .map_err(|error| unopened(address, &error))?;
                Ok(Self::new(address, stream, reader))
            }
            Address::Serial(path) => {
                let [port, reader] =
                    serial(path, baud).map_err(|error| unopened(address, &error))?;
                Ok(Self::new(address, port, reader))
            }
        }
    }

    fn new(
        address: &Address,
        out: impl Write + Send + 'static,
        reader: impl Read + Send + 'static,
    ) -> Self {
        let (to_us, replies) = channel();
        thread::spawn(move || {
            let mut lines = Lines::new(reader);
            loop {
                let said = match lines.next() {
                    Ok(Some(line)) if line.is_empty() => continue,
                    Ok(Some(line)) => Ok(Reply::parse(&line)),
                    // Nobody waits for more than this: an empty message asks who listens.
                    Ok(None) => Ok(Reply::Other(String::new())),
                    Err(error) => Err(error),
                };
                let is_end = said.is_err();
                if to_us.send(said).is_err() || is_end {
                    break;
                }
            }
        });
        Self {
            address: address.clone(),
            out: Box::new(out),
            replies,
        }
    }

    /// Where the controller is.
    #[must_use]
    pub fn address(&self) -> &Address {
        &self.address
    }

    /// Sends bytes as they are.
    ///
    /// # Errors
    /// The link is lost, or takes no more.
    pub fn send(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        let sent = self.out.write_all(bytes).and_then(|()| self.out.flush());
        sent.map_err(|error| self.lost(&error.to_string()))
    }

    /// What the controller says next, if it does within `patience`.
    ///
    /// # Errors
    /// The link is lost.
    pub fn hear(&mut self, patience: Duration) -> Result<Heard, LinkError> {
        match self.replies.recv_timeout(patience) {
            Ok(Ok(reply)) if reply == Reply::Other(String::new()) => Ok(Heard::Nothing),
            Ok(Ok(reply)) => Ok(Heard::Reply(reply)),
            Ok(Err(error)) => Err(self.lost(&error.to_string())),
            Err(RecvTimeoutError::Timeout) => Ok(Heard::Nothing),
            Err(RecvTimeoutError::Disconnected) => Err(self.lost("it was closed")),
        }
    }

    fn lost(&self, why: &str) -> LinkError {
        LinkError::Lost(self.address.clone(), why.to_owned())
    }
}

/// Opens a port only to read from it; a read that waits long times out.
///
/// # Errors
/// [`LinkError::Unopened`].
pub fn open_reader(address: &Address, baud: u32) -> Result<Box<dyn Read + Send>, LinkError> {
    match address {
        Address::Tcp(name) => match connect(name) {
            Ok(stream) => Ok(Box::new(stream)),
            Err(error) => Err(unopened(address, &error)),
        },
        Address::Serial(path) => match serial(path, baud) {
            Ok([_, reader]) => Ok(Box::new(reader)),
            Err(error) => Err(unopened(address, &error)),
        },
    }
}

fn unopened(address: &Address, error: &dyn std::fmt::Display) -> LinkError {
    LinkError::Unopened(address.clone(), error.to_string())
}

/// A device's two directions. A pseudo-terminal has no modem lines and takes any speed.
fn serial(path: &str, baud: u32) -> serialport::Result<[Box<dyn SerialPort>; 2]> {
    let port = serialport::new(path, baud).timeout(WRITE_TIMEOUT).open()?;
    let mut reader = port.try_clone()?;
    reader.set_timeout(READ_TIMEOUT)?;
    Ok([port, reader])
}

fn connect(name: &str) -> io::Result<TcpStream> {
    let mut last = io::Error::new(ErrorKind::NotFound, "there is no such host");
    for address in name.to_socket_addrs()? {
        match TcpStream::connect_timeout(&address, CONNECT_TIMEOUT) {
            Ok(stream) => {
                stream.set_nodelay(true)?;
                stream.set_read_timeout(Some(READ_TIMEOUT))?;
                stream.set_write_timeout(Some(WRITE_TIMEOUT))?;
                return Ok(stream);
            }
            Err(error) => last = error,
        }
    }
    Err(last)
}

/// Bytes as lines, without their ends; what is no UTF-8 is noise and is replaced.
struct Lines<R> {
    reader: BufReader<R>,
    line: Vec<u8>,
}

impl<R: Read> Lines<R> {
    fn new(reader: R) -> Self {
        Self {
            reader: BufReader::new(reader),
            line: Vec::new(),
        }
    }

    /// The next line; none if it is not complete within the reader's timeout.
    fn next(&mut self) -> io::Result<Option<String>> {
        let room = LONGEST_LINE.saturating_sub(self.line.len() as u64);
        let mut limited = (&mut self.reader).take(room);
        match limited.read_until(b'\n', &mut self.line) {
            Ok(0) if room > 0 => Err(ErrorKind::UnexpectedEof.into()),
            Ok(_) => {
                let line = String::from_utf8_lossy(&self.line).trim().to_owned();
                self.line.clear();
                Ok(Some(line))
            }
            Err(error) => match error.kind() {
                ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted => Ok(None),
                _ => Err(error),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::TcpListener;

    fn pair() -> (Connection, TcpStream) {
        let listener = TcpListener::bind(("127.0.0.1", 0)).unwrap();
        let address = format!("tcp:{}", listener.local_addr().unwrap());
        let connection = Connection::open(&address.parse().unwrap(), 0).unwrap();
        (connection, listener.accept().unwrap().0)
    }

    const LONG: Duration = Duration::from_secs(10);

    /// What is heard next; the reader's own questions are nothing.
    fn next(connection: &mut Connection) -> Result<Reply, LinkError> {
        loop {
            if let Heard::Reply(reply) = connection.hear(LONG)? {
                return Ok(reply);
            }
        }
    }

    #[test]
    fn bytes_go_out_and_lines_come_in_whole() {
        let (mut connection, mut controller) = pair();
        connection.send(b"G1 X1\n").unwrap();
        let mut received = [0; 6];
        controller.read_exact(&mut received).unwrap();
        assert_eq!(&received, b"G1 X1\n");
        assert_eq!(connection.hear(Duration::ZERO).unwrap(), Heard::Nothing);
        controller.write_all(b"\r\n\xFF\r\no").unwrap();
        assert_eq!(
            next(&mut connection).unwrap(),
            Reply::Other("\u{FFFD}".into())
        );
        // longer than the reader waits at a time
        thread::sleep(2 * READ_TIMEOUT);
        controller.write_all(b"k\r\nerror:9\r\n").unwrap();
        assert_eq!(next(&mut connection).unwrap(), Reply::Ok);
        assert_eq!(next(&mut connection).unwrap(), Reply::Error(9));
    }

    #[test]
    fn an_end_is_noticed_at_once() {
        let (mut connection, controller) = pair();
        drop(controller);
        let lost = next(&mut connection).unwrap_err();
        assert!(matches!(lost, LinkError::Lost(..)), "{lost}");
        let error = Connection::open(&"/dev/no-such-port".parse().unwrap(), 115_200).err();
        let words = error.unwrap().to_string();
        assert!(
            words.starts_with("/dev/no-such-port: the port cannot be opened"),
            "{words}"
        );
    }

    #[test]
    fn noise_without_a_line_end_does_not_fill_the_memory() {
        let noise = vec![b'x'; 10_000];
        let mut lines = Lines::new(&noise[..]);
        assert_eq!(lines.next().unwrap().unwrap().len(), 4096);
    }
}
