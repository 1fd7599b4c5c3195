//! Running a program on the emulated board.

use std::collections::VecDeque;
use std::path::Path;
use std::thread;
use std::time::Duration;

use planner_core::motion::MotionState;
use planner_core::telemetry::SetpointFrame;

use super::EmulatorError;
use super::command_port::{Answer, CommandPort};
use super::qemu::{Pace, Qemu};
use super::setpoint_port::SetpointPort;

/// How often the end of the motion is looked for.
const STATUS_POLL: Duration = Duration::from_millis(20);

/// What the firmware tells about its ticks since the boot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TickStatistics {
    /// Ticks.
    pub count: u32,
    /// Instructions of the dearest one.
    pub worst_instructions: u32,
    /// Control periods missed.
    pub overruns: u32,
    /// Frames that found the setpoint port full.
    pub unsent: u32,
    /// Times the moves ran out before the program's end.
    pub starved: u32,
}

/// How far the firmware's one stack ever came since the boot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StackUse {
    /// Bytes used at the fullest moment.
    pub used_bytes: usize,
    /// Bytes that never were.
    pub free_bytes: usize,
}

/// What `$I` tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct BuildInfo {
    /// Bytes of unanswered lines that the firmware can hold.
    rx_bytes: usize,
    ticks: TickStatistics,
    stack: StackUse,
}

/// What came of a program.
#[derive(Clone, Debug)]
pub struct EmulatorRun {
    /// From the first running tick to the one that found the motion at rest,
    /// contiguous but for pauses; one frame if nothing moved.
    pub setpoints: Vec<SetpointFrame>,
    /// Instructions of the dearest of these ticks.
    pub worst_tick_instructions: u32,
    /// Control periods missed during the program.
    pub overruns: u32,
    /// Times the moves ran out before the program's end: the PC was too slow to
    /// send, and the setpoints are not those of an uninterrupted run.
    pub starved: u32,
}

/// An emulated board with the firmware on it. Dropping it ends QEMU.
pub struct Emulator {
    commands: CommandPort,
    setpoints: SetpointPort,
    /// Bytes of unanswered lines that the firmware can hold.
    rx_bytes: usize,
    qemu: Qemu,
}

impl Emulator {
    /// Boots `image` at [`Pace::RealTime`].
    pub fn start(image: &Path) -> Result<Self, EmulatorError> {
        Self::start_at(image, Pace::RealTime)
    }

    /// Boots `image` and waits for its banner.
    pub fn start_at(image: &Path, pace: Pace) -> Result<Self, EmulatorError> {
        let (qemu, [commands, setpoints]) = Qemu::boot(image, pace, None)?;
        let mut emulator = Self {
            setpoints: SetpointPort::new(setpoints, commands.try_clone()?),
            commands: CommandPort::new(commands)?,
            rx_bytes: 0,
            qemu,
        };
        emulator.commands.banner()?;
        emulator.rx_bytes = emulator.build_info()?.rx_bytes;
        Ok(emulator)
    }

    /// Sends settings (`name=value`) and a program, a line each, and waits until the
    /// motion has come to rest. A program without an end of its own gets an `M2`; a pause
    /// (M0) is resumed at once.
    pub fn run_program(
        &mut self,
        settings: &[String],
        lines: &[&str],
    ) -> Result<EmulatorRun, EmulatorError> {
        for (index, setting) in settings.iter().enumerate() {
            let line = format!("${setting}");
            let answer = self.ask(line.as_bytes())?;
            accepted(answer, index, &line)?;
        }
        let before = self.statistics()?;
        self.setpoints.forget();
        self.setpoints.resume_pauses(true);
        self.stream(lines)?;
        if !lines.iter().rev().any(|line| ends_program(line)) {
            let answer = self.ask(b"M2")?;
            accepted(answer, lines.len(), "M2")?;
        }
        while self.status()?.split('|').next() != Some("Idle") {
            thread::sleep(STATUS_POLL);
        }
        self.setpoints.resume_pauses(false);
        let after = self.statistics()?;
        let frames = self.setpoints.until(after.count.wrapping_sub(1))?;
        let (lost, bad) = self.setpoints.damage();
        if lost > 0 || bad > 0 {
            return Err(EmulatorError::Lost { lost, bad });
        }
        let setpoints = motion_of(&frames);
        Ok(EmulatorRun {
            worst_tick_instructions: setpoints.iter().map(|f| f.tick_cost).max().unwrap_or(0),
            setpoints,
            overruns: after.overruns - before.overruns,
            starved: after.starved - before.starved,
        })
    }

    /// Sends lines as a sender does: no more bytes unanswered than the firmware holds.
    fn stream(&mut self, lines: &[&str]) -> Result<(), EmulatorError> {
        let mut under_way = VecDeque::new();
        let mut bytes_under_way = 0;
        for (index, line) in lines.iter().enumerate() {
            let length = line.len() + 1;
            while bytes_under_way + length > self.rx_bytes
                && let Some((first, bytes)) = under_way.pop_front()
            {
                accepted(self.commands.answer()?, first, lines[first])?;
                bytes_under_way -= bytes;
            }
            self.send(format!("{line}\n").as_bytes())?;
            under_way.push_back((index, length));
            bytes_under_way += length;
        }
        for (index, _) in under_way {
            accepted(self.commands.answer()?, index, lines[index])?;
        }
        Ok(())
    }

    /// Sends one line and waits for its answer.
    pub fn ask(&mut self, line: &[u8]) -> Result<Answer, EmulatorError> {
        self.send(line)?;
        self.send(b"\n")?;
        self.commands.answer()
    }

    /// Sends bytes as they are.
    pub fn send(&mut self, bytes: &[u8]) -> Result<(), EmulatorError> {
        let sent = self.commands.send(bytes);
        sent.map_err(|_| self.qemu.epitaph())
    }

    /// The answer to the oldest line without one.
    pub fn answer(&mut self) -> Result<Answer, EmulatorError> {
        self.commands.answer()
    }

    /// Whether the firmware says nothing for a while of real time.
    pub fn is_silent_for(&mut self, time: Duration) -> bool {
        self.commands.is_silent_for(time)
    }

    /// Resets the firmware, which must be at rest, and waits for the banner.
    pub fn reset(&mut self) -> Result<(), EmulatorError> {
        self.send(&[0x18])?;
        self.commands.banner()
    }

    /// The status line, without its brackets. No line may be unanswered.
    pub fn status(&mut self) -> Result<String, EmulatorError> {
        self.commands.status()
    }

    /// The firmware's statistics since the boot. No line may be unanswered.
    pub fn statistics(&mut self) -> Result<TickStatistics, EmulatorError> {
        Ok(self.build_info()?.ticks)
    }

    /// How much of its stack the firmware has used since the boot. No line may be unanswered.
    pub fn stack_use(&mut self) -> Result<StackUse, EmulatorError> {
        Ok(self.build_info()?.stack)
    }

    /// The frames of the ticks that have not been taken yet, up to now.
    pub fn frames_until_now(&mut self) -> Result<Vec<SetpointFrame>, EmulatorError> {
        let ticks = self.statistics()?.count;
        self.setpoints.until(ticks.wrapping_sub(1))
    }

    /// Frames lost and damaged since the boot.
    #[must_use]
    pub fn damage(&self) -> (u32, u32) {
        self.setpoints.damage()
    }

    fn build_info(&mut self) -> Result<BuildInfo, EmulatorError> {
        self.send(b"$I\n")?;
        let (_, info) = self.commands.answer_with_info()?;
        parse_build_info(&info).ok_or_else(|| EmulatorError::Unforeseen(info.join("; ")))
    }
}

fn parse_build_info(info: &[String]) -> Option<BuildInfo> {
    let entry = |name| info.iter().find_map(|line| line.strip_prefix(name));
    Some(BuildInfo {
        rx_bytes: entry("OPT:")?.rsplit(',').next()?.parse().ok()?,
        ticks: parse_statistics(entry("TICK:")?)?,
        stack: parse_stack(entry("STACK:")?)?,
    })
}

fn parse_stack(text: &str) -> Option<StackUse> {
    let (used, free) = text.split_once(',')?;
    Some(StackUse {
        used_bytes: used.strip_prefix("used=")?.parse().ok()?,
        free_bytes: free.strip_prefix("free=")?.parse().ok()?,
    })
}

fn parse_statistics(text: &str) -> Option<TickStatistics> {
    let field = |name: &str| {
        text.split(',')
            .find_map(|part| part.strip_prefix(name)?.strip_prefix('='))
    };
    Some(TickStatistics {
        count: field("count")?.parse().ok()?,
        worst_instructions: field("worst")?
            .strip_suffix(" instructions")?
            .parse()
            .ok()?,
        overruns: field("overruns")?.parse().ok()?,
        unsent: field("unsent")?.parse().ok()?,
        starved: field("starved")?.parse().ok()?,
    })
}

fn accepted(answer: Answer, index: usize, line: &str) -> Result<(), EmulatorError> {
    match answer {
        Answer::Ok => Ok(()),
        Answer::Error { code, message } => Err(EmulatorError::Refused {
            number: index + 1,
            line: line.to_owned(),
            code,
            message,
        }),
    }
}

/// Whether a line is the program's end, whatever its case, blanks and comments.
fn ends_program(line: &str) -> bool {
    let code: String = line
        .split([';', '('])
        .next()
        .unwrap_or_default()
        .chars()
        .filter(|c| !c.is_whitespace())
        .collect();
    ["M2", "M02", "M30"]
        .iter()
        .any(|end| code.eq_ignore_ascii_case(end))
}

/// From the first running frame to the first idle one after the last running one, without
/// pauses; if none runs, the last.
fn motion_of(frames: &[SetpointFrame]) -> Vec<SetpointFrame> {
    let runs = |frame: &SetpointFrame| frame.setpoint.state != MotionState::Idle;
    match (frames.iter().position(runs), frames.iter().rposition(runs)) {
        (Some(first), Some(last)) => frames[first..frames.len().min(last + 2)]
            .iter()
            .filter(|frame| frame.setpoint.state != MotionState::Paused)
            .copied()
            .collect(),
        _ => frames.last().copied().into_iter().collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_build_info_is_read() {
        let mut info = [
            "VER:1.1h:Stillpoint",
            "OPT:,64,1024",
            "TICK:count=5,worst=41 instructions,overruns=1,unsent=2,starved=3",
            "STACK:used=5000,free=1192",
        ]
        .map(str::to_owned);
        let ticks = TickStatistics {
            count: 5,
            worst_instructions: 41,
            overruns: 1,
            unsent: 2,
            starved: 3,
        };
        let stack = StackUse {
            used_bytes: 5000,
            free_bytes: 1192,
        };
        let expected = BuildInfo {
            rx_bytes: 1024,
            ticks,
            stack,
        };
        assert_eq!(parse_build_info(&info), Some(expected));
        info[2] = "TICK:count=5,worst=41 cycles".to_owned();
        assert_eq!(parse_build_info(&info), None);
    }

    #[test]
    fn the_end_is_recognised() {
        for end in ["M2", "m30 (done)", " M02 ; end", "M 30"] {
            assert!(ends_program(end), "{end}");
        }
        for other in ["", "(M2)", "M3", "G1 X1", "M20"] {
            assert!(!ends_program(other), "{other}");
        }
    }

    #[test]
    fn the_motion_ends_with_the_first_tick_at_rest() {
        let frame = |sequence: u32, state| {
            let mut frame = SetpointFrame {
                sequence,
                ..SetpointFrame::default()
            };
            frame.setpoint.state = state;
            frame
        };
        use MotionState::{Idle, Running};
        let states = [Idle, Idle, Running, Idle, Running, Idle, Idle];
        let frames: Vec<_> = (0..).zip(states).map(|(n, s)| frame(n, s)).collect();
        let kept: Vec<_> = motion_of(&frames).iter().map(|f| f.sequence).collect();
        assert_eq!(kept, [2, 3, 4, 5]);
        assert_eq!(motion_of(&frames[..2]).len(), 1);
        assert!(motion_of(&[]).is_empty());
    }
}
