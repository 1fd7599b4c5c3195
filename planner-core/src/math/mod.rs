//! Elementary functions of the tick: the same bits on every machine.
//!
//! Integer products and, where a division is needed, `f32` `+ - * /`, which IEEE 754
//! defines to the last bit. No `fma`, no `sqrt` of a platform library, no
//! trigonometry of one. Nothing here panics, indexes or divides 64-bit integers.

mod atan2;
mod root;
mod sign_change;
mod sin_cos;
mod single;

pub use atan2::{PI_Q29, atan2};
pub use root::{root, rsqrt, sine_from_cosine};
pub use sign_change::{Bracket, MAX_EVALUATIONS, sign_change, straight_sign_change};
pub use sin_cos::{sin_cos, turns};
pub use single::{sin_cos_f32, sqrt_f32};

/// One in Q30, the format of a sine or cosine.
pub const ONE_Q30: i32 = 1 << 30;

/// `a b / 2^32`, rounded down. One instruction (`SMMUL`).
const fn mul_high(a: i32, b: i32) -> i32 {
    ((a as i64 * b as i64) >> 32) as i32
}

/// `a b / 2^32`, rounded to nearest. One instruction (`SMMULR`).
const fn mul_high_rounded(a: i32, b: i32) -> i32 {
    ((a as i64 * b as i64 + (1 << 31)) >> 32) as i32
}
