//! A hop in machine units: what the tick walks.

use super::ramp::{PROGRESS_BITS, Ramp};
use crate::pose::AXES;
use crate::raw::{RawSegment, TickTime};

/// The raw path of a hop; start and target are those of its segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RawHop {
    /// How far it goes up from the start, in 2^-19 mm.
    pub up_bits: i32,
    /// How far it goes down to the target, in 2^-19 mm.
    pub down_bits: i32,
    /// The motion up, from the begin.
    pub up: Ramp,
    /// When the motion across begins, in ticks.
    pub across_begins: u32,
    /// The motion of X, Y and C.
    pub across: Ramp,
    /// When the motion down begins, in ticks.
    pub down_begins: u32,
    /// The motion down.
    pub down: Ramp,
    /// Axes that the prefilter does not act on.
    pub direct: [bool; AXES],
    /// How much of a change of its rate passes in a tick: [`crate::rate::GradualRate::step`].
    pub rate_step: u32,
}

/// The axis that goes up and down.
const Z: usize = 2;

impl RawHop {
    /// How long the raw path takes, in ticks.
    #[must_use]
    pub fn ticks(&self) -> u32 {
        let across = self.across_begins + self.across.ticks();
        let down = self.down_begins + self.down.ticks();
        across.max(down)
    }

    /// The raw point at a time since the begin, in bits of a pose: exactly the target at the end.
    ///
    /// Constant cost: three progresses and six products of 64 bits.
    #[must_use]
    #[inline(never)]
    pub fn point(&self, segment: &RawSegment, elapsed: TickTime) -> [i32; AXES] {
        let since = |ticks: u32| elapsed - (TickTime::from(ticks) << 32);
        let across = self.across.progress(since(self.across_begins)) as i64;
        let up = self.up.progress(elapsed) as i64;
        let down = self.down.progress(since(self.down_begins)) as i64;
        let mut point = segment.start;
        for (axis, (value, target)) in point.iter_mut().zip(segment.target).enumerate() {
            let scaled = if axis == Z {
                i64::from(self.up_bits) * up - i64::from(self.down_bits) * down
            } else {
                (i64::from(target) - i64::from(*value)) * across
            };
            let moved = (scaled + (1 << (PROGRESS_BITS - 1))) >> PROGRESS_BITS;
            *value = value.wrapping_add(moved as i32);
        }
        point
    }
}
