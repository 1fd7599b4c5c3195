//! The serial command protocol, byte by byte, against the unchanged core.

mod dialect;
mod elbow;
mod fuzzing;
mod homing;
mod identification;
mod noise;
mod realtime;
mod records;
