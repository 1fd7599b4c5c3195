//! The serial command protocol, byte by byte, against the unchanged core.

mod dialect;
mod fuzzing;
mod noise;
mod realtime;
mod records;
