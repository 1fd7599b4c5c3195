//! The stack's high-water mark, on every board.
//!
//! There is one stack, of the thread and of all interrupts: it has what the static
//! variables leave of the RAM, and nothing but luck stops it from growing into them.
//! cortex-m-rt paints it before `main` (feature `paint-stack`); the lowest word that
//! has lost its paint is as far as the stack ever came. A frame that left its lowest
//! words unwritten hides them, so a test should ask for some room above that.
#![allow(
    unsafe_code,
    reason = "it reads memory between the linker script's symbols"
)]

use cortex_m_rt::STACK_PAINT_VALUE;

/// Bytes of the stack since the boot.
#[derive(Clone, Copy)]
pub struct StackUse {
    /// That were used at the fullest moment.
    pub used: usize,
    /// That never were.
    pub free: usize,
}

// SAFETY: both linker scripts define them, as ends of the stack, and never as variables.
unsafe extern "C" {
    static _stack_start: u32;
    static _stack_end: u32;
}

/// Looks how far the stack ever came. It takes some four instructions a free word.
pub fn stack_use() -> StackUse {
    let end = &raw const _stack_end;
    let start = &raw const _stack_start;
    let mut lowest = end;
    // SAFETY: these words are RAM and aligned, and volatile reads see whatever is there.
    while lowest < start && unsafe { lowest.read_volatile() } == STACK_PAINT_VALUE {
        lowest = lowest.wrapping_add(1);
    }
    StackUse {
        used: start.addr() - lowest.addr(),
        free: lowest.addr() - end.addr(),
    }
}
