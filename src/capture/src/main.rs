//! `relit-capture`: lists cameras and turntables, records a turn, serves the rig, and looks after the
//! turntable.

mod cli;

fn main() -> std::process::ExitCode {
    cli::run()
}
