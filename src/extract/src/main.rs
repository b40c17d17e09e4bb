//! `relit-extract`: turns recordings into training shards of masked frames, joins, verifies and sums them up.

mod cli;

fn main() -> std::process::ExitCode {
    cli::run()
}
