//! Arcs in flight: the filtered progress of each, and from it the bow over its chord.

use crate::prefilter::{Convolver, FINE_BITS, Kernel};
use crate::raw::{Bow, UNIT};
use crate::walker::RawStep;

/// Arcs that can be in flight at once: one that ends and one that begins.
///
/// The schedule rounds corners at arcs one at a time, so that more are not needed, but for the
/// last ticks of settling after an exact stop between short arcs. With no channel free the raw
/// path waits: slower, never wrong.
pub const ARC_CHANNELS: usize = 2;

/// The filters of the arcs, one a channel.
pub type ArcFilters = [Convolver<1>; ARC_CHANNELS];

/// The arcs in flight; each has a filter of its own, because filtering X and Y of an arc
/// would cut its curve, and filtering its progress does not.
#[derive(Debug, Default)]
pub struct Arcs {
    channels: [Channel; ARC_CHANNELS],
}

/// One arc in flight.
#[derive(Clone, Copy, Debug, Default)]
struct Channel {
    phase: Phase,
    bow: Bow,
}

/// What a channel does.
#[derive(Clone, Copy, Debug, Default)]
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
            .all(|channel| matches!(channel.phase, Phase::Free))
    }

    /// Whether another arc may begin.
    pub fn has_room(&self) -> bool {
        self.channels
            .iter()
            .any(|channel| matches!(channel.phase, Phase::Free))
    }

    /// Takes this tick's step of the raw path; returns the sum of the bows in X and Y, in
    /// 2^-32 mm.
    // within the tick it would spill registers of the lines' filter
    #[inline(never)]
    pub fn step(
        &mut self,
        filters: &mut ArcFilters,
        kernel: &Kernel,
        raw: &RawStep<'_>,
    ) -> [i64; 2] {
        let mut began = raw.began;
        let mut sum = [0_i64; 2];
        for (channel, filter) in self.channels.iter_mut().zip(filters) {
            if raw.ended {
                channel.end();
            }
            if matches!(channel.phase, Phase::Free)
                && let Some(bow) = began.take()
            {
                filter.reset([0]);
                channel.bow = *bow;
                channel.phase = Phase::Feeding;
            }
            let [x, y] = channel.step(filter, kernel, raw.progress);
            sum = [sum[0].wrapping_add(x), sum[1].wrapping_add(y)];
        }
        sum
    }
}

impl Channel {
    /// The raw point has left the segment under way.
    fn end(&mut self) {
        if matches!(self.phase, Phase::Feeding) {
            self.phase = Phase::Settling { ticks: 0 };
        }
    }

    fn step(&mut self, filter: &mut Convolver<1>, kernel: &Kernel, progress: i32) -> [i64; 2] {
        let input = match &mut self.phase {
            Phase::Free => return [0, 0],
            Phase::Feeding => progress,
            Phase::Settling { ticks } => {
                *ticks += 1;
                if *ticks > kernel.length_ticks() {
                    self.phase = Phase::Free;
                    return [0, 0];
                }
                UNIT
            }
        };
        let [filtered] = filter.process(kernel, [input]);
        self.bow.at((filtered >> FINE_BITS) as i32)
    }
}
