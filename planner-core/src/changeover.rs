//! The prefilter of lines and chords, and its change to another one while the robot moves.

use crate::pose::AXES;
use crate::prefilter::{ConvolverPair, Kernel};
use crate::rate::Rate;
use crate::raw::TickTime;
use crate::walker::Ahead;

/// Ticks in which the command passes from one filter to the other.
const FADE_TICKS: u8 = 32;

/// Filters the raw point through the prefilter in force, and changes over to the next one.
///
/// # On the way
/// While the raw point moves evenly on one line, for longer than a filter's window, the output
/// is the raw point `m` ago, `m` being the filter's centroid:
///
/// ```text
/// y(t) = x(t) − v m
/// ```
/// So another filter that is fed with the raw path `m' − m` ahead of it has the same output as
/// soon as its window too has seen nothing else. Then the raw path jumps there, and the command
/// is the other filter's from now on: the move accelerates through one prefilter and
/// decelerates through the other one, and takes `L/F + m − m'` until its raw path ends. Both
/// outputs are equal but for their rounding, some 2^-19 mm, which is faded out over 32 ticks.
///
/// # At rest
/// Both filters yield the raw point, bit for bit: the change costs nothing. It is made so where
/// the segment has ended before the change could be made on its way, because a hold or an
/// override has spoiled the even motion; the next segment waits for it. So the command never
/// leaves the path.
#[derive(Debug)]
pub struct Changeover {
    kernels: [Kernel; 2],
    /// Which of the two is in force.
    second: bool,
    /// A kernel waits in the queue that is to come into force.
    is_expected: bool,
    next: Option<Next>,
    fade: Fade,
}

/// The kernel that is not in force is to be.
#[derive(Clone, Copy, Debug)]
struct Next {
    /// How far ahead its raw path is: `m' − m`.
    ahead: TickTime,
    /// The rate at which its filter has been fed, and for how many ticks; zero if it has to be
    /// reset.
    pace: Rate,
    fed_for: u16,
}

/// What the filter left behind was ahead by, on its way to nothing.
#[derive(Clone, Copy, Debug, Default)]
struct Fade {
    /// In 2^-32 mm.
    offset: [i64; AXES],
    ticks: u8,
}

impl Fade {
    /// Adds what is left of it in this tick to an output.
    #[inline(never)]
    fn step(&mut self, output: &mut [i64; AXES]) {
        self.ticks = self.ticks.saturating_sub(1);
        let part = i64::from(self.ticks);
        for (value, offset) in output.iter_mut().zip(self.offset) {
            let left = offset.wrapping_mul(part) / i64::from(FADE_TICKS);
            *value = value.wrapping_add(left);
        }
    }
}

impl Changeover {
    /// With a kernel in force.
    pub fn new(kernel: &Kernel) -> Self {
        Self {
            kernels: [kernel.clone(), kernel.clone()],
            second: false,
            is_expected: false,
            next: None,
            fade: Fade::default(),
        }
    }

    /// The kernel in force.
    pub fn kernel(&self) -> &Kernel {
        let [one, other] = &self.kernels;
        if self.second { other } else { one }
    }

    /// Puts a kernel in force at rest at a point.
    pub fn set_kernel(&mut self, kernel: Kernel) {
        self.put(self.second, kernel);
    }

    /// Puts the filter in force to rest at a point, and forgets what is to be changed.
    pub fn rest_at(&mut self, filters: &mut ConvolverPair<AXES>, point: [i32; AXES]) {
        self.is_expected = false;
        self.next = None;
        self.fade = Fade::default();
        filters.reset(self.second, point);
    }

    /// A segment has begun on whose way the oldest kernel that waits is to come into force. It
    /// is taken later, because that costs as much as a filter.
    pub fn expect(&mut self) {
        self.is_expected = true;
    }

    /// Whether that kernel still has to be taken.
    pub fn is_expected(&self) -> bool {
        self.is_expected
    }

    /// Takes the kernel that is to come into force.
    pub fn prepare(&mut self, kernel: Kernel) {
        self.is_expected = false;
        self.next = Some(Next {
            ahead: kernel.centroid() - self.kernel().centroid(),
            pace: Rate::ZERO,
            fed_for: 0,
        });
        self.put(!self.second, kernel);
    }

    /// Whether a kernel is to come into force.
    pub fn is_due(&self) -> bool {
        self.is_expected || self.next.is_some()
    }

    /// How far ahead the raw path of the kernel to come is; none if none has been taken.
    pub fn ahead(&self) -> Option<TickTime> {
        self.next.map(|next| next.ahead)
    }

    /// Whether the command is the output of the filter in force and nothing else.
    pub fn has_faded(&self) -> bool {
        self.fade.ticks == 0
    }

    /// Everything stands at a point: the kernel to come, if there is one, is in force.
    pub fn come_to_rest(&mut self, filters: &mut ConvolverPair<AXES>, point: [i32; AXES]) {
        if self.next.take().is_some() {
            self.second = !self.second;
            filters.reset(self.second, point);
        }
    }

    /// The output for the raw point of this tick, in 2^-32 mm.
    pub fn step(&mut self, filters: &mut ConvolverPair<AXES>, chord: [i32; AXES]) -> [i64; AXES] {
        let mut output = filters.process(self.second, self.kernel(), chord);
        if self.fade.ticks != 0 {
            self.fade.step(&mut output);
        }
        output
    }

    /// Feeds the filter to come, if its raw path moves evenly, and yields by how much that path
    /// is ahead when the change-over is made. `command` is the output of this tick.
    pub fn approach(
        &mut self,
        filters: &mut ConvolverPair<AXES>,
        ahead: Option<Ahead>,
        command: [i64; AXES],
    ) -> Option<TickTime> {
        let next = self.next.as_mut()?;
        let Some(Ahead { chord, pace }) = ahead.filter(|_| filters.is_shared()) else {
            next.pace = Rate::ZERO;
            return None;
        };
        let [one, other] = &self.kernels;
        let (left, coming) = if self.second {
            (other, one)
        } else {
            (one, other)
        };
        if next.pace == pace {
            next.fed_for = next.fed_for.saturating_add(1);
        } else {
            next.pace = pace;
            next.fed_for = 0;
            filters.reset(!self.second, chord);
        }
        let fed_for = next.fed_for;
        let output = filters.process(!self.second, coming, chord);
        // the one in force has seen nothing else for at least as long
        if fed_for <= coming.length_ticks() || fed_for <= left.length_ticks() {
            return None;
        }
        let jump = next.ahead;
        self.next = None;
        self.second = !self.second;
        self.fade = Fade {
            offset: core::array::from_fn(|axis| command[axis].wrapping_sub(output[axis])),
            ticks: FADE_TICKS,
        };
        Some(jump)
    }

    fn put(&mut self, second: bool, kernel: Kernel) {
        let [one, other] = &mut self.kernels;
        *(if second { other } else { one }) = kernel;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prefilter::{Kind, Prefilter, PrefilterConfig};
    use proptest::prelude::*;
    use std::boxed::Box;

    fn kernel(kind: Kind, frequency_hz: f32) -> Kernel {
        let config = PrefilterConfig {
            kind,
            frequency_hz,
            damping: 0.02,
            ..PrefilterConfig::DEFAULT
        };
        Kernel::new(&Prefilter::new(&config).unwrap()).unwrap()
    }

    /// 2^-19 mm in the unit of the command.
    const BIT: f64 = (1 << 13) as f64;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]

        /// An even motion with a change on its way (kernels of up to half a second): the command is the raw point `m` ago all the
        /// time, and its second difference shows no more than its rounding.
        #[test]
        fn the_change_does_not_show(
            kinds in (1..Kind::ALL.len(), 1..Kind::ALL.len()),
            frequencies in (6.2_f32..40.0, 6.2_f32..40.0),
            per_tick in 0.01_f64..1.0
        ) {
            let first = kernel(Kind::ALL[kinds.0], frequencies.0);
            let coming = kernel(Kind::ALL[kinds.1], frequencies.1);
            let mut filters = Box::new(ConvolverPair::new());
            filters.share(true);
            let mut changeover = Changeover::new(&first);
            changeover.rest_at(&mut filters, [0; AXES]);
            changeover.prepare(coming.clone());
            let ticks = |time: TickTime| time as f64 / (1_i64 << 32) as f64;
            let per_bit = per_tick * f64::from(1 << 19);
            let sample = |at: f64| {
                let value = (at * per_bit).round() as i32;
                [value, -value, value / 3, 7]
            };
            let (mut at, mut jumped) = (0.0, false);
            let mut last = [0.0_f64; 2];
            for tick in 1..2500_u16 {
                at += 1.0;
                let command = changeover.step(&mut filters, sample(at));
                let centroid = ticks(changeover.kernel().centroid());
                let seen = changeover.ahead().and_then(|ahead| {
                    let chord = sample(at + ticks(ahead));
                    (at + ticks(ahead) > 0.0).then_some(Ahead { chord, pace: Rate::ONE })
                });
                let steady = tick > first.length_ticks() + 2;
                let exact = (at - centroid) * per_bit * BIT;
                if steady {
                    let off = command[0] as f64 - exact;
                    prop_assert!(off.abs() < 2.0 * BIT, "{tick}: off by {} bits", off / BIT);
                    let [before, now] = last;
                    let bend = command[0] as f64 - 2.0 * now + before;
                    prop_assert!(tick < first.length_ticks() + 5 || bend.abs() < 4.0 * BIT, "{}", bend / BIT);
                }
                last = [last[1], command[0] as f64];
                if let Some(jump) = changeover.approach(&mut filters, seen, command) {
                    prop_assert!(!jumped);
                    jumped = true;
                    at += ticks(jump);
                }
            }
            prop_assert!(jumped && !changeover.is_due() && changeover.has_faded());
            prop_assert_eq!(changeover.kernel(), &coming);
            let rest = sample(at);
            let mut command = [0; AXES];
            for _ in 0..=coming.length_ticks() {
                command = changeover.step(&mut filters, rest);
            }
            prop_assert_eq!(command, rest.map(|value| i64::from(value) << 13));
        }
    }

    #[test]
    fn at_rest_the_change_is_exact() {
        let mut filters = Box::new(ConvolverPair::new());
        filters.share(true);
        let mut changeover = Changeover::new(&kernel(Kind::FirZvd, 8.0));
        changeover.rest_at(&mut filters, [0; AXES]);
        changeover.prepare(kernel(Kind::Zv, 20.0));
        let point = [123_456_789, -5, 0, 77];
        for _ in 0..600 {
            let _ = changeover.step(&mut filters, point);
        }
        changeover.come_to_rest(&mut filters, point);
        assert!(!changeover.is_due());
        assert_eq!(changeover.kernel(), &kernel(Kind::Zv, 20.0));
        for _ in 0..3 {
            let command = changeover.step(&mut filters, point);
            assert_eq!(command, point.map(|value| i64::from(value) << 13));
        }
    }
}
