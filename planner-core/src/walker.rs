//! The raw path, walked in time: constant feedrate, standing still at corners.

use crate::pose::AXES;
use crate::rate::Rate;
use crate::raw::{Bow, ONE_TICK, RawSegment, SegmentConsumer, TickTime, WHOLE};

/// What the raw path did in a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RawStep<'s> {
    /// The point on lines and chords, in bits of a pose.
    pub chord: [i32; AXES],
    /// Whether the segment under way ended.
    pub ended: bool,
    /// The bow of the arc that began, if one did.
    pub began: Option<&'s Bow>,
    /// Progress along the segment under way in 2^-30; 0 while standing.
    pub progress: i32,
    /// Whether the raw point goes on moving after this tick.
    pub moves: bool,
}

/// The state of the walk.
#[derive(Clone, Copy, Debug)]
enum Walk {
    /// The raw point stands at the end of the last segment, for `stood` so far. It goes on
    /// when the next segment is there and its dwell is over.
    Standing { stood: TickTime },
    /// On the first segment of the queue, with `remaining` of raw time to go. Goes over to
    /// standing at its end, and the queue to the next segment.
    Moving { progress: u64, remaining: TickTime },
}

/// Walks the queued segments, one tick at a time.
///
/// Segments begin and end between ticks: what is left of a tick after a segment's end
/// belongs to the dwell, and what is left of that to the next segment. A segment lasts at
/// least one tick, so that a tick sees one end and one beginning at the most.
pub struct Walker<'q> {
    segments: SegmentConsumer<'q>,
    walk: Walk,
    point: [i32; AXES],
    rate: Rate,
}

impl<'q> Walker<'q> {
    /// A walker that stands at a point.
    pub fn new(segments: SegmentConsumer<'q>, point: [i32; AXES]) -> Self {
        Self {
            segments,
            walk: Walk::Standing {
                stood: TickTime::MAX,
            },
            point,
            rate: Rate::ONE,
        }
    }

    /// Puts the raw point elsewhere, at rest.
    pub fn place(&mut self, point: [i32; AXES]) {
        self.point = point;
        self.walk = Walk::Standing {
            stood: TickTime::MAX,
        };
    }

    /// Stands from now on, wherever the raw point is, or goes on.
    pub fn hold(&mut self, held: bool) {
        self.rate = if held { Rate::ZERO } else { Rate::ONE };
    }

    /// Whether the raw point stands and no segment waits.
    pub fn is_done(&self) -> bool {
        matches!(self.walk, Walk::Standing { .. }) && !self.segments.ready()
    }

    /// Forgets the oldest segments, `count` at the most; `true` if none is left.
    pub fn forget(&mut self, count: usize) -> bool {
        for _ in 0..count {
            self.segments.dequeue();
        }
        !self.segments.ready()
    }

    /// Walks on for one tick. An arc begins only where `arc_may_begin`.
    pub fn step(&mut self, arc_may_begin: bool) -> RawStep<'_> {
        let mut left = ONE_TICK;
        let ended = self.finish(&mut left);
        let began = self.begin(&mut left, arc_may_begin);
        let progress = self.advance(left);
        let moves = matches!(self.walk, Walk::Moving { .. }) && self.rate != Rate::ZERO;
        let bow = self.head().and_then(|segment| segment.bow.as_ref());
        RawStep {
            chord: self.point,
            ended,
            began: bow.filter(|_| began),
            progress,
            moves,
        }
    }

    /// The first segment of the queue.
    fn head(&self) -> Option<&RawSegment> {
        self.segments.peek()
    }

    /// Ends the segment under way if it ends within what is `left` of the tick.
    fn finish(&mut self, left: &mut TickTime) -> bool {
        match self.walk {
            Walk::Moving { remaining, .. } if self.rate != Rate::ZERO => {
                let within = self.rate.raw(*left);
                if remaining > within {
                    return false;
                }
                *left = self.rate.real(within - remaining);
                if let Some(segment) = self.segments.peek() {
                    self.point = segment.target;
                }
                self.segments.dequeue();
                self.walk = Walk::Standing { stood: 0 };
                true
            }
            _ => false,
        }
    }

    /// Begins the next segment if its dwell ends within what is `left` of the tick, else
    /// stands on.
    fn begin(&mut self, left: &mut TickTime, arc_may_begin: bool) -> bool {
        let Walk::Standing { stood } = &mut self.walk else {
            return false;
        };
        let next = self.segments.peek().filter(|_| self.rate != Rate::ZERO);
        let next = next.filter(|next| arc_may_begin || next.bow.is_none());
        if let Some(next) = next {
            let wait = next.dwell.saturating_sub(*stood).max(0);
            if wait < *left {
                *left -= wait;
                self.walk = Walk::Moving {
                    progress: 0,
                    remaining: next.duration,
                };
                return true;
            }
        }
        *stood = stood.saturating_add(*left);
        false
    }

    /// Moves along the segment under way for what is `left` of the tick.
    fn advance(&mut self, left: TickTime) -> i32 {
        let share = self.rate.raw(left);
        let (
            Walk::Moving {
                progress,
                remaining,
            },
            Some(segment),
        ) = (&mut self.walk, self.segments.peek())
        else {
            return 0;
        };
        *progress = progress.wrapping_add(part_of_tick(segment.rate, share));
        *remaining -= share;
        let so_far = ((*progress).min(WHOLE) >> 32) as i32;
        self.point = segment.chord_point(so_far);
        so_far
    }
}

/// `rate` (a whole tick's) for a time of up to two ticks, without overflow.
fn part_of_tick(rate: u64, time: TickTime) -> u64 {
    let time = time as u64;
    let (high, low) = (rate >> 32, rate & 0xFFFF_FFFF);
    high.wrapping_mul(time)
        .wrapping_add((low >> 1).wrapping_mul(time) >> 31)
}
