//! A pseudo-terminal that programs open as if it were a serial port, again and again.

use std::ffi::OsStr;
use std::fs::File;
use std::io::{self, ErrorKind, Read, Write};
use std::mem::MaybeUninit;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::inotify::{self, CreateFlags, ReadFlags, WatchFlags};
use rustix::fs::{Mode, OFlags, fcntl_setfl, open};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{
    OptionalActions, QueueSelector, ioctl_tiocnxcl, tcflush, tcgetattr, tcsetattr,
};

/// A pseudo-terminal. As with a serial port, what is said while nobody has it open is lost;
/// and each client finds it as the first one did, whatever the one before has set.
pub struct PseudoTerminal {
    ours: File,
    /// The clients' side. A client may lock its port, and the lock of a pseudo-terminal
    /// outlasts the client: only who already has it open can take it off.
    theirs: Option<OwnedFd>,
    path: PathBuf,
    watch: Watch,
    is_open: bool,
}

impl PseudoTerminal {
    /// A new one, in raw mode and without echo.
    ///
    /// # Errors
    /// The system has none left.
    pub fn open() -> io::Result<Self> {
        let ours = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)?;
        grantpt(&ours)?;
        unlockpt(&ours)?;
        fcntl_setfl(&ours, OFlags::NONBLOCK)?;
        let name = ptsname(&ours, Vec::new())?;
        let mut terminal = Self {
            ours: ours.into(),
            theirs: None,
            path: OsStr::from_bytes(name.to_bytes()).into(),
            watch: Watch::new()?,
            is_open: false,
        };
        terminal.hold()?;
        terminal.renew()?;
        Ok(terminal)
    }

    /// Where programs find it.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Take note of clients that came or went.
    ///
    /// # Errors
    /// The system refuses what it did not refuse before.
    pub fn notice(&mut self) -> io::Result<()> {
        let Changes { opened, closed } = self.watch.changes()?;
        if opened && !self.is_open {
            // What was still on its way when the client before went.
            self.forget_unread()?;
            self.is_open = true;
        }
        if closed {
            self.is_open = self.is_open_by_others()?;
            if !self.is_open {
                self.renew()?;
            }
        }
        Ok(())
    }

    /// Whether somebody else has the clients' side open: the system tells only while we do not.
    fn is_open_by_others(&mut self) -> io::Result<bool> {
        self.watch.forget();
        if let Some(theirs) = self.theirs.take() {
            ioctl_tiocnxcl(&theirs)?;
        }
        let mut state = [PollFd::new(&self.ours, PollFlags::IN)];
        poll(&mut state, Some(&Timespec::default()))?;
        let is_open = !state[0].revents().contains(PollFlags::HUP);
        self.hold()?;
        Ok(is_open)
    }

    fn hold(&mut self) -> io::Result<()> {
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC;
        self.theirs = Some(open(&self.path, flags, Mode::empty())?);
        self.watch.look_at(&self.path)
    }

    /// Forgets unread bytes, and what a client has set.
    fn renew(&self) -> io::Result<()> {
        if let Some(theirs) = &self.theirs {
            let mut settings = tcgetattr(theirs)?;
            settings.make_raw();
            tcsetattr(theirs, OptionalActions::Now, &settings)?;
        }
        self.forget_unread()
    }

    fn forget_unread(&self) -> io::Result<()> {
        if let Some(theirs) = &self.theirs {
            tcflush(theirs, QueueSelector::IFlush)?;
        }
        Ok(())
    }
}

impl AsFd for PseudoTerminal {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.ours.as_fd()
    }
}

impl Read for PseudoTerminal {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        self.ours.read(into)
    }
}

impl Write for PseudoTerminal {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.is_open {
            self.ours.write(bytes)
        } else {
            Ok(bytes.len())
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Sees a file being opened and closed.
struct Watch {
    events: OwnedFd,
    watched: Option<i32>,
}

#[derive(Default)]
struct Changes {
    opened: bool,
    closed: bool,
}

impl Watch {
    fn new() -> io::Result<Self> {
        Ok(Self {
            events: inotify::init(CreateFlags::NONBLOCK | CreateFlags::CLOEXEC)?,
            watched: None,
        })
    }

    fn look_at(&mut self, path: &Path) -> io::Result<()> {
        let of_interest = WatchFlags::OPEN | WatchFlags::CLOSE;
        self.watched = Some(inotify::add_watch(&self.events, path, of_interest)?);
        Ok(())
    }

    fn forget(&mut self) {
        if let Some(watched) = self.watched.take() {
            // What cannot be removed is not watched any more.
            let _ = inotify::remove_watch(&self.events, watched);
        }
    }

    fn changes(&mut self) -> io::Result<Changes> {
        let mut buffer = [MaybeUninit::uninit(); 1024];
        let mut reader = inotify::Reader::new(&self.events, &mut buffer);
        let mut changes = Changes::default();
        loop {
            match reader.next() {
                Ok(event) => {
                    changes.opened |= event.events().contains(ReadFlags::OPEN);
                    let closed = ReadFlags::CLOSE_WRITE | ReadFlags::CLOSE_NOWRITE;
                    changes.closed |= event.events().intersects(closed);
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => return Ok(changes),
                Err(error) => return Err(error.into()),
            }
        }
    }
}
