//! The raw path, walked in time: constant feedrate, standing still at corners.

use crate::pose::AXES;
use crate::prefilter::Kernel;
use crate::queue::{Action, RawItem, SegmentConsumer};
use crate::rate::{GradualRate, Rate};
use crate::raw::{Bow, ONE_TICK, Pace, RawSegment, TickTime, WHOLE};

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
    /// Whether the raw point moved in this tick.
    pub moved: bool,
    /// Whether a segment began on whose way the prefilter changes.
    pub changes_over: bool,
    /// Axes that the prefilter does not act on.
    pub direct: [bool; AXES],
}

/// The raw path as another filter has to see it while the raw point moves evenly.
#[derive(Clone, Copy, Debug)]
pub struct Ahead {
    /// The point so much further along the segment.
    pub chord: [i32; AXES],
    /// The rate of the last tick, in which nothing began or ended.
    pub pace: Rate,
}

/// The rates that the raw path is walked at.
#[derive(Clone, Copy, Debug)]
pub struct Rates {
    /// Of moves at a feedrate.
    pub feed: Rate,
    /// Of rapids.
    pub rapid: Rate,
}

impl Rates {
    fn of(&self, segment: &RawSegment) -> Rate {
        match segment.pace {
            Pace::Feed => self.feed,
            Pace::Rapid => self.rapid,
            Pace::StandStill => Rate::ONE,
        }
    }
}

/// The state of the walk.
#[derive(Clone, Copy, Debug)]
enum Walk {
    /// The raw point stands. It goes on when the next segment is there and its dwell is over.
    Standing(Stand),
    /// On the first segment of the queue. Goes over to standing at its end, and the queue to
    /// the next item.
    Moving(Way),
}

/// At the end of a segment.
#[derive(Clone, Copy, Debug)]
struct Stand {
    /// For so long.
    time: TickTime,
    /// The licence of that segment.
    licence: Rate,
}

impl Stand {
    /// Everything has come to rest long ago: three days, so that the ten that a segment may
    /// last at the lowest rate can be added.
    const AT_REST: Self = Self {
        time: 1 << 60,
        licence: Rate::ONE,
    };

    /// The way along the next segment, if its dwell ends within what is `left` of the tick.
    fn begin(
        &self,
        kernel: &Kernel,
        next: &RawSegment,
        wanted: Rate,
        left: TickTime,
    ) -> Option<Way> {
        let licence = wanted.min(next.top_rate).max(Rate::ONE);
        let dwell = self.dwell(kernel, next.overlap, licence, left);
        let wait = dwell.wrapping_sub(self.time).max(0);
        if wait >= left {
            return None;
        }
        let mut way = Way {
            progress: 0,
            remaining: next.duration,
            since_corner: self.time.wrapping_add(wait),
            licence,
            pace: Rate::ZERO,
            hop_rate: GradualRate::steady(wanted.min(Rate::ONE)),
        };
        way.advance(next, wanted.min(licence).raw(left - wait), left - wait);
        Some(way)
    }

    /// How long to stand before a segment that is walked at up to `licence`, when `left` of the
    /// tick is left.
    fn dwell(&self, kernel: &Kernel, overlap: TickTime, licence: Rate, left: TickTime) -> TickTime {
        let fastest = self.licence.max(licence);
        let overlap = if fastest > Rate::ONE {
            fastest.real(overlap) - ONE_TICK
        } else {
            overlap
        };
        if overlap > 0 {
            kernel.length() - overlap
        } else {
            let since_arrival = self.time.wrapping_add(left);
            let stop = kernel.stop_time(since_arrival & (ONE_TICK - 1));
            stop.max(kernel.length() - overlap)
        }
    }
}

/// Along a segment.
#[derive(Clone, Copy, Debug)]
struct Way {
    progress: u64,
    /// Raw time to go.
    remaining: TickTime,
    /// Real time since the raw point arrived at the corner before the segment.
    since_corner: TickTime,
    /// The highest rate that the corners on both sides allow for, at least 1.
    licence: Rate,
    /// The rate of the last tick; zero if only a part of it was moved in.
    pace: Rate,
    /// The rate along a hop, never above the planned one. It changes gradually, because nothing
    /// smooths the axes that the prefilter does not act on.
    hop_rate: GradualRate,
}

impl Way {
    /// The progress and the raw time to go `ahead` of real time further along, at the rate of
    /// the last tick; nothing beyond the segment's ends.
    fn ahead(&self, segment: &RawSegment, ahead: TickTime) -> Option<(u64, TickTime)> {
        let share = self.pace.raw(ahead);
        let way = part_of_tick(segment.rate, share.abs());
        let progress = if share < 0 {
            self.progress.checked_sub(way)?
        } else {
            self.progress.wrapping_add(way)
        };
        let remaining = self.remaining - share;
        (remaining > 0).then_some((progress, remaining))
    }

    /// The rate of the moment.
    fn rate(&mut self, kernel: &Kernel, segment: &RawSegment, wanted: Rate) -> Rate {
        if wanted > self.licence && self.since_corner >= kernel.settling_time() {
            self.licence = wanted.min(segment.top_rate);
        }
        wanted.min(self.licence)
    }

    /// Goes on for `share` of raw time, which takes `time`.
    fn advance(&mut self, segment: &RawSegment, share: TickTime, time: TickTime) {
        let progress = part_of_tick(segment.rate, share);
        self.progress = self.progress.wrapping_add(progress);
        self.remaining -= share;
        self.since_corner = self.since_corner.wrapping_add(time);
    }
}

/// Which segments may begin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MayBegin {
    /// None: the prefilter has to change first.
    None,
    /// Lines only: there is no room for another arc.
    Lines,
    /// Any.
    Any,
}

impl MayBegin {
    fn allows(self, next: &RawSegment) -> bool {
        match self {
            Self::None => false,
            Self::Lines => next.bow.is_none(),
            Self::Any => true,
        }
    }
}

/// What became of the segment under way in a tick.
struct Gone {
    ended: bool,
    /// Whether the raw point moved.
    moved: bool,
    /// What is left of the tick.
    left: TickTime,
}

/// Walks the queued segments, one tick at a time.
///
/// Segments begin and end between ticks: what is left of a tick after a segment's end
/// belongs to the dwell, and what is left of that to the next segment. A segment lasts at
/// least one tick, so that a tick sees one end and one beginning at the most.
///
/// # Rates
/// Raw time passes at a rate that may change with every tick: 0 in a hold, 0.1 to 2 by an
/// override. Dwells pass in real time. The prefilter follows as it follows every raw path, and
/// the corners keep their tolerance:
///
/// **Up to 1.** With `a` the mean distance of the raw point before a corner and `b` that behind
/// it, over the filter's window, the command is at `P_c − a u₁ + b u₂`. A lower rate and a
/// longer dwell leave both at most what was planned for the same time after the arrival. `a`
/// falls and `b` grows, so in the plane of `a` and `b` the curve runs below the planned one: on
/// each ray from the corner it is nearer, and with it, in proportion, the closest approach and
/// every distance from the path. Where several corners are being rounded, the schedule adds up
/// the lesser of `a` and `b` of each, which does not grow either, and no corner begins earlier
/// after another one than planned.
///
/// **At k above 1** the feedrates grow by `k`, and the overlap shrinks to `t_c / k`. The ramp
/// response `I` is convex and `I(0) = 0`, so `k F I(x / k) ≤ F I(x)`: the curve again runs below
/// the planned one. A tick is taken off the overlap besides, because the margin for what the
/// trace does within a tick grows with `k`. Only segments whose first corner is planned to be
/// done at their end are hurried, `D ≥ t_c`; then that corner really is done when the next one
/// begins, since `(T − t_c/k) + D/k + (T − t_c'/k) ≥ T`. Where corners share the tolerance, the
/// raw point is slow enough as well:
/// - after the arrival at a corner, a hurried segment behind it brings the raw point to where
///   the plan has it only when the corner is done: until then `b` is at most as planned;
/// - before the arrival, a hurried segment further back counts no more than planned in `a`,
///   because the dwell between, `T − t_c/k`, takes more time than was gained.
///
/// So a corner has to be left, after it was arrived at, by the highest rate on either side:
/// the **licence** of a segment. It is settled when the segment begins, and can rise only when
/// the corner before it is done.
pub struct Walker<'q> {
    queue: SegmentConsumer<'q>,
    walk: Walk,
    point: [i32; AXES],
    rates: Rates,
    held: bool,
    /// Axes that the prefilter does not act on, from the begin of a hop to that of what follows.
    direct: [bool; AXES],
    /// The number of the line under way, or of the last one.
    line: u32,
}

impl<'q> Walker<'q> {
    /// A walker that stands at a point.
    pub fn new(queue: SegmentConsumer<'q>, point: [i32; AXES]) -> Self {
        Self {
            queue,
            walk: Walk::Standing(Stand::AT_REST),
            point,
            rates: Rates {
                feed: Rate::ONE,
                rapid: Rate::ONE,
            },
            held: false,
            direct: [false; AXES],
            line: 0,
        }
    }

    /// The number of the line under way, or of the last one.
    pub fn line(&self) -> u32 {
        self.line
    }

    /// Puts the raw point elsewhere, at rest.
    pub fn place(&mut self, point: [i32; AXES]) {
        self.point = point;
        self.walk = Walk::Standing(Stand::AT_REST);
        self.direct = [false; AXES];
    }

    /// Walks at these rates from now on.
    pub fn set_rates(&mut self, rates: Rates) {
        self.rates = rates;
    }

    /// Stands from now on, wherever the raw point is, or goes on.
    pub fn hold(&mut self, held: bool) {
        self.held = held;
    }

    /// Whether the raw point stands and nothing waits.
    pub fn is_done(&self) -> bool {
        matches!(self.walk, Walk::Standing(_)) && self.queue.is_empty()
    }

    /// The action at the point to which the raw path has come, if there is one, now that
    /// everything stands.
    pub fn take_action(&mut self) -> Option<Action> {
        if matches!(self.walk, Walk::Moving(_)) {
            return None;
        }
        let action = self.queue.action()?;
        self.queue.pop();
        self.walk = Walk::Standing(Stand::AT_REST);
        Some(action)
    }

    /// Forgets the oldest item; the raw point has to stand.
    pub fn forget(&mut self) -> Option<RawItem> {
        self.queue.pop()
    }

    /// The kernel that goes with [`Action::Prefilter`].
    pub fn take_kernel(&mut self) -> Option<Kernel> {
        self.queue.pop_kernel()
    }

    /// The raw path `ahead` of real time further along the segment under way, if the raw point
    /// moves on it and it reaches as far.
    pub fn look_ahead(&self, ahead: TickTime) -> Option<Ahead> {
        let (Walk::Moving(way), Some(segment)) = (&self.walk, self.queue.segment()) else {
            return None;
        };
        if way.pace == Rate::ZERO {
            return None;
        }
        let (progress, _) = way.ahead(segment, ahead)?;
        Some(Ahead {
            chord: segment.chord_point(to_unit(progress)),
            pace: way.pace,
        })
    }

    /// Goes on from there: what [`Walker::look_ahead`] has shown is the raw path from now on.
    pub fn jump(&mut self, ahead: TickTime) {
        if let (Walk::Moving(way), Some(segment)) = (&mut self.walk, self.queue.segment())
            && let Some((progress, remaining)) = way.ahead(segment, ahead)
        {
            way.progress = progress;
            way.remaining = remaining;
        }
    }

    /// Leaves the segment under way, if there is one, as if it had ended.
    pub fn leave(&mut self) {
        if matches!(self.walk, Walk::Moving(_)) {
            self.queue.pop();
            self.walk = Walk::Standing(Stand::AT_REST);
        }
    }

    /// Walks on for one tick. A segment begins only where it may, and an arc where an arc may.
    pub fn step(&mut self, kernel: &Kernel, may_begin: MayBegin) -> RawStep<'_> {
        let Gone {
            ended,
            mut moved,
            left,
        } = self.go_on(kernel);
        let segment = self.queue.segment();
        let mut began = false;
        if let Walk::Standing(stand) = &mut self.walk {
            let next = segment.filter(|next| !self.held && may_begin.allows(next));
            let way = next.and_then(|next| stand.begin(kernel, next, self.rates.of(next), left));
            match way {
                Some(way) => {
                    self.walk = Walk::Moving(way);
                    moved |= next.is_some_and(RawSegment::moves);
                    self.line = next.map_or(self.line, |next| next.line);
                    self.direct = match next {
                        Some(next) if next.is_hop => {
                            self.queue.hop().map_or([false; AXES], |hop| hop.direct)
                        }
                        _ => [false; AXES],
                    };
                    began = true;
                }
                None => stand.time = stand.time.wrapping_add(left),
            }
        }
        let mut step = RawStep {
            chord: self.point,
            ended,
            began: None,
            progress: 0,
            moved,
            changes_over: false,
            direct: self.direct,
        };
        if let (Walk::Moving(way), Some(segment)) = (&self.walk, segment) {
            step.progress = to_unit(way.progress);
            step.chord = if segment.is_hop
                && let Some(hop) = self.queue.hop()
            {
                hop.point(segment, segment.duration.wrapping_sub(way.remaining))
            } else {
                segment.chord_point(step.progress)
            };
            if began {
                step.began = segment.bow.as_ref();
                step.changes_over = segment.changes_over;
            }
            self.point = step.chord;
        }
        step
    }

    /// Goes on along the segment under way for a tick, or to its end if that comes before.
    fn go_on(&mut self, kernel: &Kernel) -> Gone {
        let standing = Gone {
            ended: false,
            moved: false,
            left: ONE_TICK,
        };
        // one after the other: the tick in which a segment begins is the dearest
        let Walk::Moving(way) = &mut self.walk else {
            return standing;
        };
        let Some(segment) = self.queue.segment() else {
            return standing;
        };
        if self.held && !segment.is_hop {
            way.since_corner = way.since_corner.wrapping_add(ONE_TICK);
            way.pace = Rate::ZERO;
            return Gone {
                ended: false,
                moved: false,
                left: 0,
            };
        }
        let (share, rate) = if segment.is_hop {
            let wanted = if self.held {
                Rate::ZERO
            } else {
                self.rates.of(segment).min(Rate::ONE)
            };
            let step = self.queue.hop().map_or(u32::MAX, |hop| hop.rate_step);
            way.hop_rate.next_tick(wanted, step)
        } else {
            let rate = way.rate(kernel, segment, self.rates.of(segment));
            (rate.raw(ONE_TICK), rate)
        };
        let moved = segment.moves() && share > 0;
        if way.remaining > share {
            way.advance(segment, share, ONE_TICK);
            way.pace = rate;
            return Gone {
                ended: false,
                moved,
                left: 0,
            };
        }
        let left = rate.real(share - way.remaining);
        self.point = segment.target;
        self.walk = Walk::Standing(if segment.moves() {
            Stand {
                time: 0,
                licence: way.licence,
            }
        } else {
            Stand::AT_REST
        });
        self.queue.pop();
        Gone {
            ended: true,
            moved,
            left,
        }
    }
}

/// Progress in 2^-62 as one in 2^-30.
fn to_unit(progress: u64) -> i32 {
    (progress.min(WHOLE) >> 32) as i32
}

/// `rate` (a whole tick's) for a time of a few ticks, rounded down, without overflow.
fn part_of_tick(rate: u64, time: TickTime) -> u64 {
    let (ticks, rest) = ((time >> 32) as u32, u64::from(time as u32));
    let (high, low) = (rate >> 32, rate & 0xFFFF_FFFF);
    rate.wrapping_mul(u64::from(ticks))
        .wrapping_add(high * rest)
        .wrapping_add((low * rest) >> 32)
}
