//! Arcs in flight: the filtered progress of each, and from it the bow over its chord.

use core::array;

use crate::prefilter::{Convolver, FINE_BITS, Kernel};
use crate::raw::{Bow, UNIT};
use crate::walker::RawStep;

/// Arcs that can be in flight at once: one that ends and one that begins.
///
/// The schedule rounds corners at arcs one at a time, so that more are not needed, but for the
/// last ticks of settling after an exact stop between short arcs. With no channel free the raw
/// path waits: slower, never wrong.
pub const ARC_CHANNELS: usize = 2;

/// The filter of the arcs: they share what a tap costs.
pub type ArcFilter = Convolver<ARC_CHANNELS>;

/// The arcs in flight; each has a channel of the filter of its own, because filtering X and Y of
/// an arc would cut its curve, and filtering its progress does not.
///
/// A channel rests at 0 or 1, where its last arc has left it, and the next one goes from there:
/// its progress counts up to 1, or down to 0. So a channel that has settled can begin another arc
/// while the other one is in flight, without a reset that both would feel.
#[derive(Debug, Default)]
pub struct Arcs {
    channels: [Channel; ARC_CHANNELS],
}

/// One arc in flight.
#[derive(Clone, Copy, Debug, Default)]
struct Channel {
    phase: Phase,
    bow: Bow,
    /// The input counts down from 1.
    counts_down: bool,
}

/// What a channel does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Phase {
    /// Nothing; it takes the next arc.
    #[default]
    Free,
    /// The raw point is on the arc.
    Feeding,
    /// The raw point has left the arc for so many ticks; the filter follows. Free when it
    /// has settled: then the bow is exactly zero.
    Settling { ticks: u16 },
}

impl Arcs {
    /// Forgets them, when their bows are part of the point at which everything stands.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// Whether none is in flight.
    pub fn are_clear(&self) -> bool {
        self.channels
            .iter()
            .all(|channel| channel.phase == Phase::Free)
    }

    /// Whether another arc may begin.
    pub fn has_room(&self) -> bool {
        self.channels
            .iter()
            .any(|channel| channel.phase == Phase::Free)
    }

    /// Takes this tick's step of the raw path; returns the sum of the bows in X and Y, in
    /// 2^-32 mm.
    pub fn step(&mut self, filter: &mut ArcFilter, kernel: &Kernel, raw: &RawStep<'_>) -> [i64; 2] {
        for channel in &mut self.channels {
            channel.settle(raw.ended, kernel.length_ticks());
        }
        if let Some(bow) = raw.began {
            self.begin(filter, bow);
        }
        if self.are_clear() {
            return [0, 0];
        }
        let inputs = array::from_fn(|i| self.channels[i].input(raw.progress));
        let mut sum = [0_i64; 2];
        for (channel, filtered) in self.channels.iter().zip(filter.process(kernel, inputs)) {
            if channel.phase != Phase::Free {
                let [x, y] = channel.bow(filtered);
                sum = [sum[0].wrapping_add(x), sum[1].wrapping_add(y)];
            }
        }
        sum
    }

    /// An arc begins, on a free channel; the raw path waits for one.
    fn begin(&mut self, filter: &mut ArcFilter, bow: &Bow) {
        if self.are_clear() {
            for channel in &mut self.channels {
                channel.counts_down = false;
            }
            filter.reset([0; ARC_CHANNELS]);
        }
        let mut channels = self.channels.iter_mut();
        if let Some(channel) = channels.find(|channel| channel.phase == Phase::Free) {
            channel.bow = bow.copied();
            channel.phase = Phase::Feeding;
        }
    }
}

impl Channel {
    /// A tick after the raw point has left the arc, or the one in which it does.
    fn settle(&mut self, has_ended: bool, length_ticks: u16) {
        match &mut self.phase {
            Phase::Feeding if has_ended => self.phase = Phase::Settling { ticks: 1 },
            Phase::Settling { ticks } if *ticks >= length_ticks => {
                self.phase = Phase::Free;
                self.counts_down = !self.counts_down;
            }
            Phase::Settling { ticks } => *ticks += 1,
            Phase::Free | Phase::Feeding => {}
        }
    }

    /// Its input of this tick, when the raw point is so far along the segment under way.
    fn input(&self, progress: i32) -> i32 {
        let progress = match self.phase {
            Phase::Free => 0,
            Phase::Feeding => progress,
            Phase::Settling { .. } => UNIT,
        };
        if self.counts_down {
            UNIT - progress
        } else {
            progress
        }
    }

    /// The bow for what the filter makes of it.
    fn bow(&self, filtered: i64) -> [i64; 2] {
        let counted = (filtered >> FINE_BITS) as i32;
        let progress = if self.counts_down {
            UNIT - counted
        } else {
            counted
        };
        self.bow.at(progress)
    }
}
