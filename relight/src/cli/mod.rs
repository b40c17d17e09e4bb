//! The command line of `relight`.

mod commands;
mod console;

use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, Subcommand};

#[cfg(feature = "train")]
use commands::train;
use commands::{eval, render, synth};
use console::Console;

/// Single-view relighting: light, rendering, data with truth, and the measures of the results.
#[derive(Parser)]
#[command(
    name = "relight",
    version,
    after_help = "Exit codes: 0 done, 1 failed, 2 wrong usage, 3 finished, but something was left out or lost."
)]
struct CommandLine {
    #[command(subcommand)]
    verb: Verb,
    /// Print one JSON line an event on standard output.
    #[arg(long, global = true)]
    json: bool,
}

#[derive(Subcommand)]
enum Verb {
    /// Light an object that is given by its maps: an image, a turn, or a sweep of materials.
    #[command(after_help = render::EXAMPLES)]
    Render(render::Arguments),
    /// Measure estimates, and baselines beside them, by the protocols of the paper's tables.
    #[command(after_help = eval::EXAMPLES)]
    Eval(eval::Arguments),
    /// Make pictures of objects together with their truth: samples, whole turns, panoramas.
    #[command(after_help = synth::EXAMPLES)]
    Synth(synth::Arguments),
    /// Train networks (built with the feature `train`).
    #[cfg(feature = "train")]
    #[command(after_help = train::EXAMPLES)]
    Train(train::Arguments),
}

impl Verb {
    /// What is wrong with the arguments together: wrong usage, exit code 2.
    fn fault(&self) -> Option<String> {
        match self {
            Self::Render(arguments) => arguments.fault(),
            Self::Eval(arguments) => arguments.fault(),
            Self::Synth(_) => None,
            #[cfg(feature = "train")]
            Self::Train(_) => None,
        }
    }
}

/// Runs the verb that the command line names; its exit code.
pub(crate) fn run() -> ExitCode {
    let line = CommandLine::parse();
    if let Some(fault) = line.verb.fault() {
        CommandLine::command()
            .error(ErrorKind::ValueValidation, fault)
            .exit();
    }
    let console = Console::new(line.json);
    console.finish(match line.verb {
        Verb::Render(arguments) => render::run(&arguments, console),
        Verb::Eval(arguments) => eval::run(&arguments, console),
        Verb::Synth(arguments) => synth::run(&arguments, console),
        #[cfg(feature = "train")]
        Verb::Train(arguments) => train::run(&arguments, console),
    })
}
