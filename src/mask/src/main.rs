//! `relit-mask`: finds the object in recordings.

mod cli;

fn main() -> std::process::ExitCode {
    cli::run()
}
