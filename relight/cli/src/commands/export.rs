//! `relight export`: objects as files that other programs read.

use std::path::PathBuf;

use clap::Args;
use relight_photo::export::{ObjectMesh, read_object, to_glb, to_layers};
use relit_console::{Console, Outcome};
use relit_data::durable::write_whole;
use relit_data::file_names::has_extension;
use serde_json::json;

use crate::commands::CommandResult;

pub(crate) const EXAMPLES: &str = "\
Examples:
  relight export mug.relit -o mug.glb
      a relief mesh with colours, normals and gloss, for Blender, three.js and other viewers
  relight export mug -o mug.exr
      all maps of a folder of relight turn or relight decompose as layers of one EXR";

#[derive(Args)]
pub(crate) struct Arguments {
    /// object.relit, or a folder of relight turn or relight decompose.
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// The file to write: .glb or .exr.
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// Vertices of a GLB's relief along the picture's longer side.
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = clap::value_parser!(u32).range(2..=2048))]
    vertices: u32,
}

impl Arguments {
    /// The fault of the combination of arguments, if there is one.
    pub(crate) fn fault(&self) -> Option<String> {
        let is_known = has_extension(&self.output, &["glb", "exr"]);
        (!is_known).then(|| format!("--output {}: give .glb or .exr", self.output.display()))
    }
}

pub(crate) fn run(arguments: &Arguments, console: Console) -> CommandResult {
    let object = read_object(&arguments.input)?;
    let output = &arguments.output;
    let bytes = if has_extension(output, &["exr"]) {
        to_layers(&object)?
    } else {
        let mesh = ObjectMesh::from_object(&object, arguments.vertices as usize)?;
        to_glb(&object, &mesh)?
    };
    write_whole(output, &bytes)
        .map_err(|error| format!("{} cannot be written: {error}", output.display()))?;
    console.print(
        &output.display().to_string(),
        &json!({ "event": "exported", "output": output, "object": object.name() }),
    );
    Ok(Outcome::Success)
}
