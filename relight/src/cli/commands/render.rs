//! `relight render`.

use std::path::PathBuf;

use clap::Args;
use relight::light::{Order, Panorama};
use serde_json::json;

use crate::cli::console::{CommandResult, Console, Outcome};

pub(in crate::cli) const EXAMPLES: &str = "\
Example:
  relight render --panorama studio.hdr";

#[derive(Args)]
pub(in crate::cli) struct Arguments {
    /// The light: an HDR or EXR panorama.
    #[arg(long, value_name = "FILE")]
    panorama: PathBuf,
}

pub(in crate::cli) fn run(arguments: &Arguments, console: Console) -> CommandResult {
    let panorama = Panorama::read(&arguments.panorama)?;
    let size = panorama.extent();
    console.say(
        &format!(
            "{} x {} pixels, order {}",
            size.width,
            size.height,
            Order::TWO.get()
        ),
        &json!({ "event": "panorama", "width": size.width, "height": size.height }),
    );
    Ok(Outcome::Whole)
}
