//! Programs on a robot whose mode depends on the posture, and which has a map of it.

mod automatic;
mod promises;
mod residual;
mod support;
mod survey;
