//! The commands of the program `stillpoint`, one a file: arguments in, sentences out.

mod cascade_args;
pub mod compare;
pub mod corner;
pub mod demo;
pub mod emulate;
mod failure;
pub mod forward;
pub mod identify;
mod identify_grid;
pub mod inverse;
pub mod methods;
mod model_args;
pub mod monitor;
pub mod output;
pub mod overlap;
pub mod prefilter;
pub mod profile;
pub mod run;
mod scenario_args;
pub mod send;

pub use cascade_args::CascadeArgs;
pub use failure::Failure;
pub use model_args::ModelArgs;
pub use scenario_args::ScenarioArgs;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use planner_core::prefilter::Kind;

/// Reads a prefilter's name; its help lists them all.
fn prefilter_parser() -> impl TypedValueParser<Value = Kind> {
    PossibleValuesParser::new(Kind::ALL.map(Kind::name))
        .try_map(|name| Kind::from_name(&name).ok_or("there is no such prefilter"))
}
