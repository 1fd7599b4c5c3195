//! The prefilter at run time: a delay line and, for each box, a running sum.

use super::MAX_STAGES;
use super::kernel::{HALF_SLOTS, Kernel, SLOTS, Shape, Tap, WEIGHT_BITS};

/// The output has this many bits below the input's.
pub const FINE_BITS: u32 = 13;

/// A place in the part of a delay line that a filter has: `USED` slots from slot `FIRST` on. Both
/// are known when it is compiled, because they cost in each tap; the last remainder only tells
/// the compiler what holds anyway.
const fn slot<const FIRST: usize, const USED: usize>(at: usize) -> usize {
    (FIRST + at % USED) % SLOTS
}

/// The samples of a delay line, a slot a tick.
type Line<const AXES: usize> = [[i32; AXES]; SLOTS];

/// Filters `AXES` coordinates that share one prefilter, a sample a tick.
///
/// All stages live in one delay line: each stage's samples end where the next one's begin,
/// and the whole line moves by one slot a tick. Inputs are positions; with weights that sum
/// to exactly one, the output at rest equals the input bit for bit, for ever.
///
/// Cost on a Cortex-M4F: about 15 instructions a tap and axis, whatever the length.
#[derive(Clone, Debug)]
pub struct Convolver<const AXES: usize> {
    line: Line<AXES>,
    filter: Filter<AXES>,
}

impl<const AXES: usize> Default for Convolver<AXES> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const AXES: usize> Convolver<AXES> {
    /// A convolver at rest at zero.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            line: [[0; AXES]; SLOTS],
            filter: Filter::new(),
        }
    }

    /// Puts the filter to rest at a value, as if that had been the input for ever.
    ///
    /// Constant cost: the delay line is not touched, its old samples just no longer count.
    pub fn reset(&mut self, rest: [i32; AXES]) {
        self.filter.reset(rest);
    }

    /// Takes the input of this tick, returns the output in 2^-[`FINE_BITS`] of its unit.
    #[must_use]
    pub fn process(&mut self, kernel: &Kernel, input: [i32; AXES]) -> [i64; AXES] {
        self.filter
            .process::<0, SLOTS>(&mut self.line, kernel, input)
    }
}

/// Two filters of `AXES` coordinates in the memory of one [`Convolver`]: while they share it,
/// each has a half of the delay line and takes kernels of up to [`HALF_SLOTS`]; otherwise the
/// first one has all of it.
#[derive(Clone, Debug)]
pub struct ConvolverPair<const AXES: usize> {
    line: Line<AXES>,
    filters: [Filter<AXES>; 2],
    is_shared: bool,
}

impl<const AXES: usize> Default for ConvolverPair<AXES> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const AXES: usize> ConvolverPair<AXES> {
    /// Both at rest at zero, the first one with the whole delay line.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            line: [[0; AXES]; SLOTS],
            filters: [const { Filter::new() }; 2],
            is_shared: false,
        }
    }

    /// Whether they share the delay line. Both have to be reset after it has been changed.
    pub fn share(&mut self, is_shared: bool) {
        self.is_shared = is_shared;
    }

    /// Whether they share the delay line.
    #[must_use]
    pub fn is_shared(&self) -> bool {
        self.is_shared
    }

    /// As [`Convolver::reset`], of the first (`false`) or the second one.
    pub fn reset(&mut self, second: bool, rest: [i32; AXES]) {
        self.filters[usize::from(second)].reset(rest);
    }

    /// As [`Convolver::process`], of the first (`false`) or the second one.
    #[must_use]
    #[inline(always)]
    pub fn process(&mut self, second: bool, kernel: &Kernel, input: [i32; AXES]) -> [i64; AXES] {
        let line = &mut self.line;
        let [one, other] = &mut self.filters;
        match (self.is_shared, second) {
            (false, false) => one.process::<0, SLOTS>(line, kernel, input),
            (true, false) => one.process::<0, HALF_SLOTS>(line, kernel, input),
            // the second one is not in use where there is no room for it
            (_, true) => other.process::<HALF_SLOTS, HALF_SLOTS>(line, kernel, input),
        }
    }
}

/// What a filter remembers beside its samples.
#[derive(Clone, Debug)]
struct Filter<const AXES: usize> {
    /// Slot of the newest sample of the first stage.
    head: usize,
    /// Running sums of the boxes, by stage, in 2^-30 of the input's unit; since the reset.
    sums: [[i64; AXES]; MAX_STAGES],
    /// Samples from before the reset read as this.
    rest: [i32; AXES],
    /// Samples since the reset.
    age: usize,
}

impl<const AXES: usize> Filter<AXES> {
    const fn new() -> Self {
        Self {
            head: 0,
            sums: [[0; AXES]; MAX_STAGES],
            rest: [0; AXES],
            age: 0,
        }
    }

    fn reset(&mut self, rest: [i32; AXES]) {
        self.rest = rest;
        self.age = 0;
    }

    #[inline(never)]
    fn process<const FIRST: usize, const USED: usize>(
        &mut self,
        line: &mut Line<AXES>,
        kernel: &Kernel,
        input: [i32; AXES],
    ) -> [i64; AXES] {
        self.head = self.head.wrapping_sub(1);
        let mut taps = kernel.taps.as_slice();
        let mut stages = kernel.stages.iter().zip(&mut self.sums);
        let Some((mut stage, mut sums)) = stages.next() else {
            return input.map(|value| i64::from(value) << FINE_BITS);
        };
        let mut sample = input;
        let total = loop {
            let newest = self.head.wrapping_add(usize::from(stage.first_slot));
            line[slot::<FIRST, USED>(newest)] = sample;
            let delayed = Delayed::<AXES, FIRST, USED> {
                line,
                newest: &sample,
                head: self.head,
                oldest: self.age.saturating_add(usize::from(stage.first_slot)),
                rest: &self.rest,
            };
            let total = match stage.shape {
                Shape::Two => delayed.weighted::<3>(&mut taps, [0; AXES]),
                Shape::Three => delayed.weighted::<5>(&mut taps, [0; AXES]),
                Shape::Four => delayed.weighted::<7>(&mut taps, [0; AXES]),
                Shape::Five => delayed.weighted::<9>(&mut taps, [0; AXES]),
                Shape::Box => {
                    if self.age == 0 {
                        *sums = self.rest.map(|value| i64::from(value) << WEIGHT_BITS);
                    }
                    *sums = delayed.weighted::<5>(&mut taps, *sums);
                    *sums
                }
            };
            let Some(next) = stages.next() else {
                break total;
            };
            (stage, sums) = next;
            sample = total.map(|value| round_off(value, WEIGHT_BITS) as i32);
        };
        self.age = self.age.saturating_add(1);
        total.map(|value| round_off(value, WEIGHT_BITS - FINE_BITS))
    }
}

/// The delay line as a stage reads it.
struct Delayed<'a, const AXES: usize, const FIRST: usize, const USED: usize> {
    line: &'a Line<AXES>,
    /// What the stage's first tap reads.
    newest: &'a [i32; AXES],
    head: usize,
    /// The last of its slots, counted from `head`, that holds a sample from after the reset.
    oldest: usize,
    rest: &'a [i32; AXES],
}

impl<const AXES: usize, const FIRST: usize, const USED: usize> Delayed<'_, AXES, FIRST, USED> {
    /// `sum` and the samples weighted by the next taps, in 2^-30 of the input's unit.
    #[inline(always)]
    fn weighted<const TAPS: usize>(&self, left: &mut &[Tap], mut sum: [i64; AXES]) -> [i64; AXES] {
        let Some((taps, others)) = left.split_first_chunk::<TAPS>() else {
            return sum;
        };
        *left = others;
        let samples: [&[i32; AXES]; TAPS] = core::array::from_fn(|i| {
            let place = usize::from(taps[i].slot);
            if i == 0 {
                self.newest
            } else if place <= self.oldest {
                &self.line[slot::<FIRST, USED>(self.head.wrapping_add(place))]
            } else {
                self.rest
            }
        });
        for (axis, sum) in sum.iter_mut().enumerate() {
            for (sample, tap) in samples.iter().zip(taps) {
                *sum = sum.wrapping_add(i64::from(sample[axis]) * i64::from(tap.weight));
            }
        }
        sum
    }
}

/// Rounds to nearest while dropping `bits` bits.
const fn round_off(value: i64, bits: u32) -> i64 {
    value.wrapping_add(1 << (bits - 1)) >> bits
}
