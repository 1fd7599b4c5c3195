//! Tests that run the firmware, and the core's cost, on the emulated board.

mod firmware;
mod homing;
mod identification;
mod instructions;
mod link;
mod same_bits;
mod support;
