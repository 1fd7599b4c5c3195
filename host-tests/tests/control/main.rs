//! The motion under control while it runs: hold, resume, override, stop, outputs, pauses and
//! changes of the prefilter, judged by the independent checker.

mod actions;
mod holds;
mod overrides;
mod random;
mod stops;
mod support;
