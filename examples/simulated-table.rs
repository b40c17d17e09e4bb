//! A simulated turntable on a pseudoterminal, for any program that speaks to a Grbl controller.
//!
//! ```text
//! cargo run --example simulated-table -- LINK
//! ```
//!
//! makes `LINK` a name of the port, prints `ready LINK`, and runs until it is ended from outside.
#![allow(
    clippy::print_stdout,
    reason = "its one line is for whoever started it"
)]

use std::env;
use std::error::Error;
use std::path::PathBuf;
use std::thread;

use relit::simulator::{Simulator, SimulatorOptions};

fn main() -> Result<(), Box<dyn Error>> {
    let link = env::args_os().nth(1).map(PathBuf::from);
    let link = link.ok_or("give the name that the port shall have")?;
    let _table = Simulator::start(SimulatorOptions {
        link: Some(link.clone()),
        ..SimulatorOptions::default()
    })?;
    println!("ready {}", link.display());
    loop {
        thread::park();
    }
}
