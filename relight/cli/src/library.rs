//! The library of the verbs that make objects: what a user brings.

use relight_synth::{Folders, Library, SynthError};
use relit_console::{Console, Outcome};
use serde_json::json;

/// Reads a library, of packed ones a part, and names what of its folders is not used; then what comes of it is incomplete.
pub(crate) fn read_library(
    folders: &Folders,
    part: fn(Library) -> Result<Library, SynthError>,
    console: Console,
) -> Result<(Library, Outcome), SynthError> {
    let library = part(Library::read(folders)?)?;
    for left_out in &library.left_out {
        let event = json!({ "event": "left_out", "path": left_out.path, "message": left_out.what });
        console.warn_with(&left_out.to_string(), &event);
    }
    let outcome = if library.left_out.is_empty() {
        Outcome::Success
    } else {
        Outcome::Partial
    };
    Ok((library, outcome))
}
