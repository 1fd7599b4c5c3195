//! The program goes out, the state comes in, and the operator may intervene.

use std::time::{Duration, Instant};

use crate::link::{Ending, LinkError, Reply, State, Streamer, realtime};

use super::{Interrupts, Keyboard, LiveView, Session, TimeLeft};

/// Reports of rest in a row that end a program: the first may have been under way when the last
/// line was accepted, and a motion begins a moment after it.
const REPORTS_OF_REST: u32 = 2;

/// A report that was under way when a hold ended is there after this.
const OLD_REPORTS: Duration = Duration::from_millis(500);

/// How long a motion may take to stop: a prefilter is at most a second long.
const STOP: Duration = Duration::from_secs(10);

/// What has to be done, and with what.
pub struct Job<'a> {
    /// The controller.
    pub session: &'a mut Session,
    /// The program.
    pub streamer: &'a mut Streamer,
    /// Lines of the program.
    pub lines: usize,
    /// Time of the motion, if it was planned.
    pub planned: Option<Duration>,
    /// What the operator sees.
    pub view: &'a LiveView,
    /// The operator's keys, if there is an operator.
    pub keyboard: Option<&'a mut Keyboard>,
    /// Ctrl-C.
    pub interrupts: &'a Interrupts,
}

/// How it ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Finish {
    /// As the streamer says; if it is done, or if a line was refused, the robot stands.
    Streamed(Ending),
    /// The operator ended it, and the controller was reset; `false` if it did not say so.
    Aborted(bool),
    /// The operator holds it and has left.
    LeftHeld,
}

/// What came of a program.
pub struct Sent {
    /// How it ended.
    pub finish: Finish,
    /// The last sentence that came with an alarm.
    pub message: Option<String>,
}

/// Who has the say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Control {
    /// The program; a hold that is still reported is an old one until this moment.
    Program(Instant),
    /// The operator was asked; `seen` once the controller reports its hold.
    Operator { seen: bool },
}

const QUESTION: &str = "Held: [r] resume  [a] abort  [q] leave it held and quit";

/// Sends a program to its end and waits until the robot stands.
///
/// # Errors
/// The link is lost.
pub fn run(mut job: Job<'_>) -> Result<Sent, LinkError> {
    let mut left = TimeLeft::new(job.planned);
    let mut control = Control::Program(Instant::now());
    let mut message = None;
    let mut at_rest = 0;
    let mut before = Instant::now();
    let finish = loop {
        // A held robot takes no more lines than it has: its buffer fills, and that is all.
        while let Some(bytes) = job.streamer.take() {
            job.session.send(&bytes)?;
        }
        if let Some(reply) = job.session.hear()? {
            job.streamer.hear(&reply);
            match &reply {
                Reply::Message(said) => message = Some(said.clone()),
                Reply::Status(report) if is_rest(&report.state) => at_rest += 1,
                Reply::Status(_) => at_rest = 0,
                // Alarm and reset end a program that has been sent, too.
                Reply::Alarm(code) => break Finish::Streamed(Ending::Alarm(*code)),
                Reply::Banner => break Finish::Streamed(Ending::Reset),
                _ => {}
            }
        }
        match job.streamer.ending() {
            None => at_rest = 0,
            Some(Ending::Done | Ending::Refused(_)) if at_rest < REPORTS_OF_REST => {}
            Some(ending) => break Finish::Streamed(ending.clone()),
        }
        if let Some(finish) = intervene(&mut job, &mut control)? {
            break finish;
        }
        let known = &job.session.known;
        let percent = known.overrides.map_or(100, |[feed, ..]| feed);
        let now = Instant::now();
        left.pass(now - before, known.state.as_ref(), percent);
        before = now;
        let part = job.streamer.accepted() as f64 / job.lines as f64;
        job.view
            .show(job.streamer.accepted(), left.estimate(part), known);
    };
    if let Finish::Streamed(Ending::Alarm(_)) = finish {
        message = last_words(job.session)?;
    }
    Ok(Sent { finish, message })
}

fn is_rest(state: &State) -> bool {
    matches!(state, State::Idle | State::Check)
}

/// What comes behind an alarm within a moment: the sentence that belongs to it.
fn last_words(session: &mut Session) -> Result<Option<String>, LinkError> {
    let (start, mut words) = (Instant::now(), None);
    while start.elapsed() < Duration::from_millis(300) {
        if let Some(Reply::Message(said)) = session.hear()? {
            words = Some(said);
        }
    }
    Ok(words)
}

/// Does what the operator wants; how it ended, if it did.
fn intervene(job: &mut Job<'_>, control: &mut Control) -> Result<Option<Finish>, LinkError> {
    if job.interrupts.must_end() {
        return hold_and_leave(job).map(Some);
    }
    let ctrl_c = job.interrupts.take_ctrl_c();
    let is_held = job.session.known.state.as_ref().is_some_and(State::is_held);
    let Some(keyboard) = job.keyboard.as_deref_mut() else {
        return match ctrl_c {
            true => hold_and_leave(job).map(Some),
            false => Ok(None),
        };
    };
    let key = keyboard.key();
    match (*control, key) {
        (Control::Program(_), _) if ctrl_c => {
            job.session.send(&[realtime::HOLD])?;
            *control = Control::Operator { seen: false };
            job.view.ask(QUESTION);
        }
        // Held by a program's M0, by the door, or by somebody else.
        (Control::Program(since), _) if is_held && Instant::now() > since => {
            *control = Control::Operator { seen: true };
            job.view.ask(QUESTION);
        }
        (Control::Operator { .. }, Some(b'a' | b'A')) => return abort(job).map(Some),
        (Control::Operator { .. }, _) if ctrl_c => return abort(job).map(Some),
        (Control::Operator { .. }, Some(b'q' | b'Q')) => return Ok(Some(Finish::LeftHeld)),
        (Control::Operator { .. }, Some(b'r' | b'R')) => {
            job.session.send(&[realtime::RESUME])?;
            *control = Control::Program(Instant::now() + OLD_REPORTS);
            job.view.ask("");
        }
        // Somebody else has resumed it.
        (Control::Operator { seen: true }, None) if !is_held => {
            *control = Control::Program(Instant::now());
            job.view.ask("");
        }
        (Control::Operator { seen: false }, None) if is_held => {
            *control = Control::Operator { seen: true };
        }
        _ => {}
    }
    Ok(None)
}

/// Nobody can be asked: the robot is held, and stays so.
fn hold_and_leave(job: &mut Job<'_>) -> Result<Finish, LinkError> {
    job.session.send(&[realtime::HOLD])?;
    job.session.known.state = None;
    let start = Instant::now();
    while start.elapsed() < STOP {
        job.session.hear()?;
        let state = job.session.known.state.as_ref();
        if state.is_some_and(|state| state.has_stopped() || is_rest(state)) {
            break;
        }
    }
    Ok(Finish::LeftHeld)
}

/// A reset: the motion stops, and everything that waits is forgotten.
fn abort(job: &mut Job<'_>) -> Result<Finish, LinkError> {
    job.view.ask("");
    job.session.send(&[realtime::SOFT_RESET])?;
    let said_so = job.session.await_banner(STOP)?;
    Ok(Finish::Aborted(said_so))
}
