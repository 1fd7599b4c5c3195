//! The command link from outside: `stillpoint emulate`, `send` and `monitor` together, over a
//! pseudo-terminal and over TCP.

mod emulate;
mod identify;
mod intervene;
mod monitor;
mod noise;
mod send;
mod support;
