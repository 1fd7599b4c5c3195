//! A survey of the mode over the workspace: the controller identifies it at every node of a grid,
//! and its map is made of what it found.
//!
//! | step | lines to the controller |
//! |---|---|
//! | go to where the test move begins | `$J=G53 G90 G21 X… Y… F…`, then wait for `Idle` |
//! | move to the node, listen, identify | `$ID=G21 X… Y… F…` |
//! | once all nodes are known | `$map=COLUMNS,ROWS,X0,X1,Y0,Y1`, `$map1=HZ/DAMPING,…` and so on |
//!
//! The test move **ends** at the node, because what is listened to is the swing after its end. It
//! comes from where the robot can: along the given direction, against it, or across it.
//!
//! A record that cannot be trusted is made again with a shorter move, twice: start and stop of a
//! move may cancel in one mode, and not with all three lengths. So is, at the end, one whose
//! frequency is an octave off the middle one of its neighbours: where the mode was not excited, a
//! joint's own mode may have passed for it. What is open then, and nodes that the robot cannot
//! reach, are [filled](fill) from their neighbours. Unless more nodes are known than open there is
//! no map.

mod excitation;
mod fill;
mod grid;
mod run;

pub use excitation::{Excitation, ExcitationError};
pub use fill::fill;
pub use grid::{Grid, GridError, place};
pub use run::{Desk, Finding, Node, Survey, SurveyError, Visit, found, lines};
