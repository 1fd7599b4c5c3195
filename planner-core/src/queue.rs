//! The look-ahead: what the planner hands to the tick, without locks.

use heapless::spsc::{Consumer, Producer, Queue};

use crate::hop::RawHop;
use crate::kinematics::Elbow;
use crate::pose::Pose;
use crate::prefilter::Kernel;
use crate::raw::RawSegment;

/// Segments and actions that can wait between the planner and the tick.
///
/// 64 segments of 0.5 mm at 160 mm/s last 0.2 s, longer than a serial line hesitates.
pub const LOOKAHEAD: usize = 64;

/// Kernels that can wait. With a map of the mode a move may need two, one at its start and one
/// on its way; it lasts longer than its prefilter then, so that two such moves are look-ahead
/// enough.
pub const KERNELS: usize = 4;

/// Kernels that a move may need.
pub const KERNELS_A_MOVE: usize = 2;

/// Pick-and-place moves that can wait: each lasts some tenths of a second.
pub const HOPS: usize = 3;

/// What the tick carries out, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RawItem {
    /// The raw path goes on.
    Segment(RawSegment),
    /// Something happens where the path has come to.
    Action(Action),
}

/// What happens as soon as everything stands at a point of the path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// The digital outputs are switched: bit 0 the gripper, bit 1 the blow-off.
    Outputs(u8),
    /// The motion pauses until it is resumed.
    Pause,
    /// The oldest kernel that waits becomes the prefilter.
    Prefilter,
    /// The segments that follow are joint moves: see [`crate::joint_space`].
    ToJoints,
    /// The segments that follow are the tool's again. It stands at the pose, with the elbow on
    /// the side; without a pose, its position is not known.
    ToTool(Option<Pose>, Elbow),
}

/// The queue between planner and tick; one place stays empty to tell full from empty.
#[derive(Default)]
pub struct SegmentQueue {
    items: Queue<RawItem, { LOOKAHEAD + 1 }>,
    kernels: Queue<Kernel, { KERNELS + 1 }>,
    hops: Queue<RawHop, { HOPS + 1 }>,
}

impl SegmentQueue {
    /// An empty queue.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            items: Queue::new(),
            kernels: Queue::new(),
            hops: Queue::new(),
        }
    }

    /// The planner's end and the tick's.
    pub fn split(&mut self) -> (SegmentProducer<'_>, SegmentConsumer<'_>) {
        let (items_in, items_out) = self.items.split();
        let (kernels_in, kernels_out) = self.kernels.split();
        let (hops_in, hops_out) = self.hops.split();
        (
            SegmentProducer {
                items: items_in,
                kernels: kernels_in,
                hops: hops_in,
            },
            SegmentConsumer {
                items: items_out,
                kernels: kernels_out,
                hops: hops_out,
            },
        )
    }
}

/// The planner's end of the queue.
pub struct SegmentProducer<'q> {
    items: Producer<'q, RawItem>,
    kernels: Producer<'q, Kernel>,
    hops: Producer<'q, RawHop>,
}

impl SegmentProducer<'_> {
    /// Items that can wait.
    #[must_use]
    pub fn capacity(&self) -> usize {
        self.items.capacity()
    }

    /// Places for items that are free; none while a change of the prefilter or a hop finds no
    /// room.
    #[must_use]
    pub fn free_places(&self) -> usize {
        if self.kernels.ready() && self.hops.ready() {
            self.items.capacity() - self.items.len()
        } else {
            0
        }
    }

    /// Places for kernels that are free.
    #[must_use]
    pub fn free_kernels(&self) -> usize {
        self.kernels.capacity() - self.kernels.len()
    }

    /// Appends an item; `false` if there is no room.
    pub fn push(&mut self, item: RawItem) -> bool {
        self.items.enqueue(item).is_ok()
    }

    /// Appends a change of the prefilter at rest; `false` if there is no room.
    pub fn push_kernel(&mut self, kernel: Kernel) -> bool {
        self.push_with(kernel, RawItem::Action(Action::Prefilter))
    }

    /// Appends a segment on whose way the prefilter changes; `false` if there is no room.
    pub fn push_changing(&mut self, segment: RawSegment, kernel: Kernel) -> bool {
        self.push_with(
            kernel,
            RawItem::Segment(RawSegment {
                changes_over: true,
                ..segment
            }),
        )
    }

    /// The kernel first: the tick looks for it when it comes to the item.
    fn push_with(&mut self, kernel: Kernel, item: RawItem) -> bool {
        self.items.ready() && self.kernels.enqueue(kernel).is_ok() && self.push(item)
    }

    /// Appends a hop, whose segment says that it is one; `false` if there is no room.
    pub fn push_hop(&mut self, hop: RawHop, segment: RawSegment) -> bool {
        // The hop first, as a kernel.
        self.free_places() > 0
            && self.hops.enqueue(hop).is_ok()
            && self.push(RawItem::Segment(segment))
    }
}

/// The tick's end of the queue.
pub struct SegmentConsumer<'q> {
    items: Consumer<'q, RawItem>,
    kernels: Consumer<'q, Kernel>,
    hops: Consumer<'q, RawHop>,
}

impl SegmentConsumer<'_> {
    /// Whether nothing waits.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        !self.items.ready()
    }

    /// The oldest item, if it is a segment.
    #[must_use]
    pub fn segment(&self) -> Option<&RawSegment> {
        match self.items.peek() {
            Some(RawItem::Segment(segment)) => Some(segment),
            Some(RawItem::Action(_)) | None => None,
        }
    }

    /// The oldest item, if it is an action.
    #[must_use]
    pub fn action(&self) -> Option<Action> {
        match self.items.peek() {
            Some(&RawItem::Action(action)) => Some(action),
            Some(RawItem::Segment(_)) | None => None,
        }
    }

    /// The oldest hop: that of the oldest segment that is one.
    #[must_use]
    pub fn hop(&self) -> Option<&RawHop> {
        self.hops.peek()
    }

    /// Removes the oldest item, and the hop that goes with it.
    pub fn pop(&mut self) -> Option<RawItem> {
        let item = self.items.dequeue();
        if matches!(&item, Some(RawItem::Segment(segment)) if segment.is_hop) {
            self.hops.dequeue();
        }
        item
    }

    /// The oldest kernel that waits.
    pub fn pop_kernel(&mut self) -> Option<Kernel> {
        self.kernels.dequeue()
    }
}
