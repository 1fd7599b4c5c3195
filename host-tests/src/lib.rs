//! The PC side of Stillpoint: the software loop with its plant, the checker that trusts
//! nobody, and the program `stillpoint`.
//!
//! | from | through | to |
//! |---|---|---|
//! | [`robot_file`], [`program_file`] | [`machine`]: planner and tick, here or emulated | setpoints |
//! | setpoints | [`trace`]: the [`plant`] | the tool's motion |
//! | trace | [`checker`], [`vibration`] | [`scenario`]'s outcome: [`summary`], [`pictures`] |

pub mod any_program;
pub mod bridge;
pub mod checker;
pub mod commands;
pub mod emulator;
pub mod judged_run;
pub mod limit_use;
pub mod link;
pub mod machine;
pub mod methods;
pub mod mode_use;
pub mod oracle;
pub mod paired_run;
pub mod payload_search;
pub mod pictures;
pub mod plant;
pub mod plant_config;
pub mod prefilters_chosen;
pub mod program_file;
pub mod progress;
pub mod random_program;
pub mod record_file;
pub mod robot_file;
pub mod scenario;
pub mod sender;
pub mod sensed_plant;
pub mod serial_loop;
pub mod setpoint_watch;
pub mod software_loop;
pub mod summary;
pub mod survey;
pub mod switched_arm;
mod toml_place;
pub mod tool_path;
pub mod trace;
pub mod vector;
pub mod vibration;
