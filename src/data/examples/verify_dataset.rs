//! Reads a whole data set back and says what is wrong with it: `verify_dataset OUT`.
//!
//! Exit 0 if nothing is, 1 if something is.
#![allow(clippy::print_stdout, reason = "the example is a program of its own")]

use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;

use relit_data::shard::verify;

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let out: PathBuf = std::env::args_os().nth(1).ok_or("give a data set")?.into();
    // The closure is called with the samples that are checked and their total, from several threads.
    let report = verify(&out, &|_done, _total| {})?;
    for problem in &report.problems {
        println!("{problem}");
    }
    println!(
        "{} samples, {} problems",
        report.samples,
        report.problems.len()
    );
    Ok(if report.problems.is_empty() {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    })
}
