//! `relight train` in a program built without training: prints how to build it.

use clap::Args;
use relit_console::Console;
use thiserror::Error;

use super::CommandResult;

pub(crate) const EXAMPLES: &str =
    "This program was built without training. In relit's source folder:
  make setup-train
  cargo build --release -p relight --features train";

#[derive(Args)]
pub(crate) struct Arguments {
    /// Whatever the verb takes in a program that trains.
    #[arg(
        value_name = "ARGUMENTS",
        trailing_var_arg = true,
        allow_hyphen_values = true
    )]
    _arguments: Vec<String>,
}

#[derive(Debug, Error)]
#[error(
    "this relight was built without training: in relit's source folder, \
     'make setup-train && cargo build --release -p relight --features train' builds one that trains"
)]
struct WithoutTraining;

pub(crate) fn run(_: &Arguments, _: Console) -> CommandResult {
    Err(WithoutTraining.into())
}
