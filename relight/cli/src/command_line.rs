//! The command line of `relight`.

use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{ArgMatches, CommandFactory, Error, FromArgMatches, Parser, Subcommand};
use relit_console::Console;

use crate::commands::{
    decompose, eval, export, insert, relight, render, serve, synth, train, turn, weights,
};

/// Single-view relighting: decompose, relight and insert photographed objects; render, train, score.
#[derive(Parser)]
#[command(
    name = "relight",
    version,
    after_help = "Exit codes: 0 done, 1 failed, 2 wrong usage, 3 finished, but something was left out or lost."
)]
struct CommandLine {
    #[command(subcommand)]
    verb: Verb,
    /// Print one JSON line per event on standard output.
    #[arg(long, global = true)]
    json: bool,
}

#[derive(Subcommand)]
enum Verb {
    /// Decompose photographs: normals, albedo, shading, highlight and light.
    #[command(after_help = decompose::EXAMPLES)]
    Decompose(decompose::Arguments),
    /// Relight the objects of photographs: a picture, or a video in which the light rotates.
    #[command(after_help = relight::EXAMPLES, mut_arg("light", relight::or_own))]
    Relight(Box<relight::Arguments>),
    /// Insert the objects of photographs into another picture, a panorama or a video.
    #[command(after_help = insert::EXAMPLES)]
    Insert(Box<insert::Arguments>),
    /// Render an object from its maps: an image or a video.
    #[command(after_help = render::EXAMPLES)]
    Render(render::Arguments),
    /// Score estimates and baselines by the protocols of the paper's tables.
    #[command(after_help = eval::EXAMPLES)]
    Eval(eval::Arguments),
    /// Render synthetic objects with their ground truth: samples, whole turns, panoramas.
    #[command(after_help = synth::EXAMPLES)]
    Synth(synth::Arguments),
    /// Train networks (in a build with the feature `train`).
    #[command(after_help = train::EXAMPLES)]
    Train(train::Arguments),
    /// Decompose a whole turn of the table: normals, albedo and light.
    #[command(after_help = turn::EXAMPLES)]
    Turn(turn::Arguments),
    /// Export objects for other programs, as GLB or layered EXR.
    #[command(after_help = export::EXAMPLES)]
    Export(export::Arguments),
    /// Serve the web app: cut objects out of photographs, relight them, compose scenes.
    #[command(after_help = serve::EXAMPLES)]
    Serve(serve::Arguments),
    /// Convert network weights.
    #[command(after_help = weights::EXAMPLES)]
    Weights(weights::Arguments),
}

impl Verb {
    /// The fault of a combination of arguments: wrong usage, exit code 2.
    fn fault(&self) -> Option<String> {
        match self {
            Self::Decompose(arguments) => arguments.fault(),
            Self::Relight(arguments) => arguments.fault(),
            Self::Insert(arguments) => arguments.fault(),
            Self::Render(arguments) => arguments.fault(),
            Self::Eval(arguments) => arguments.fault(),
            Self::Synth(_) | Self::Train(_) | Self::Turn(_) | Self::Serve(_) => None,
            Self::Export(arguments) => arguments.fault(),
            Self::Weights(arguments) => arguments.fault(),
        }
    }
}

/// Runs the verb that the command line names; its exit code.
pub(crate) fn run() -> ExitCode {
    if let Some(code) = relit_console::written_manual(CommandLine::command()) {
        return code;
    }
    let matches = CommandLine::command().get_matches();
    let line = CommandLine::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
    if let Some(fault) = line.verb.fault() {
        wrong_usage(&matches, fault).exit();
    }
    let console = Console::new(line.json);
    console.finish(match line.verb {
        Verb::Decompose(arguments) => decompose::run(&arguments, console),
        Verb::Relight(arguments) => relight::run(&arguments, console),
        Verb::Insert(arguments) => insert::run(&arguments, console),
        Verb::Render(arguments) => render::run(&arguments, console),
        Verb::Eval(arguments) => eval::run(&arguments, console),
        Verb::Synth(arguments) => synth::run(&arguments, console),
        Verb::Train(arguments) => train::run(&arguments, console),
        Verb::Turn(arguments) => turn::run(&arguments, console),
        Verb::Export(arguments) => export::run(&arguments, console),
        Verb::Serve(arguments) => serve::run(&arguments, console),
        Verb::Weights(arguments) => weights::run(&arguments, console),
    })
}

/// The error for a fault in the arguments of the given verb, with the verb's usage.
fn wrong_usage(matches: &ArgMatches, fault: String) -> Error {
    let mut command = CommandLine::command();
    command.build();
    let mut matches = matches;
    while let Some((name, inner)) = matches.subcommand()
        && let Some(verb) = command.find_subcommand(name).cloned()
    {
        (command, matches) = (verb, inner);
    }
    command.error(ErrorKind::ValueValidation, fault)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The most lines of a help without headings.
    const SCREEN: usize = 50;

    #[test]
    fn the_options_of_every_verb_fit_together() {
        CommandLine::command().debug_assert();
    }

    #[test]
    fn the_help_of_every_verb_fits_a_screen_or_is_grouped_under_headings() {
        let mut program = CommandLine::command();
        program.build();
        let mut waiting = vec![program];
        while let Some(mut command) = waiting.pop() {
            let lines = command.render_long_help().to_string().lines().count();
            let is_grouped = command
                .get_arguments()
                .any(|argument| argument.get_help_heading().is_some());
            let name = command.get_bin_name().unwrap_or_default();
            assert!(lines <= SCREEN || is_grouped, "{name}: {lines} lines");
            waiting.extend(command.get_subcommands().cloned());
        }
    }
}
