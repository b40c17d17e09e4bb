//! The frames of a recording and the table's angle at each: `session_angles SESSION`.
//!
//! SESSION is a session folder, such as `fixtures/20261120T101500Z-cow-short`.
#![allow(clippy::print_stdout, reason = "the example is a program of its own")]

use std::error::Error;
use std::path::PathBuf;

use relit_data::session::Recording;

fn main() -> Result<(), Box<dyn Error>> {
    let folder: PathBuf = std::env::args_os()
        .nth(1)
        .ok_or("give a session folder")?
        .into();
    let recording = Recording::open(&folder)?;
    for notice in &recording.notices {
        println!("# {}", notice.text());
    }
    let index = recording.frames.ok_or("the session has no frame index")?;
    println!("frame\tt_us\tangle_deg");
    for frame in index.entries() {
        let angle = frame
            .angle_deg
            .map_or_else(String::new, |deg| format!("{deg:.4}"));
        println!("{}\t{}\t{angle}", frame.n, frame.t_us);
    }
    Ok(())
}
