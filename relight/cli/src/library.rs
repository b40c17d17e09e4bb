//! Options and the library of the verbs that make objects: the user's own files.

use std::path::PathBuf;

use clap::Args;
use relight_synth::{Folders, Library, SynthError};
use relit_console::{Console, Outcome};
use serde_json::json;

/// What synthetic objects and their light are drawn from.
#[derive(Args)]
pub(crate) struct ObjectSources {
    /// The same seed gives the same bytes.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) seed: u64,
    /// Let light pass through objects: no cast shadows, no dark hollows.
    #[arg(long)]
    pub(crate) no_shadows: bool,
    /// Your own objects besides procedural shapes: a folder of .obj, .gltf, .glb, or a packed library, .relib.
    #[arg(long, value_name = "FOLDER")]
    pub(crate) meshes: Option<PathBuf>,
    /// Panoramas for the light: a folder of .hdr, .exr, or a packed library, .relib [default: synthetic].
    #[arg(long, value_name = "FOLDER")]
    pub(crate) panoramas: Option<PathBuf>,
}

impl ObjectSources {
    /// The folders.
    pub(crate) fn folders(&self) -> Folders {
        Folders {
            meshes: self.meshes.clone(),
            panoramas: self.panoramas.clone(),
        }
    }
}

/// Reads a library (a part of packed ones), and names the unused files of its folders; with any, the outcome is incomplete.
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
