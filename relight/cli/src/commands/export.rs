//! `relight export`: objects as files that other programs read.

use std::error::Error;
use std::f64::consts::PI;
use std::path::{Path, PathBuf};

use clap::Args;
use relight_core::captured_object::CapturedObject;
use relight_core::image::{Extent, encode_exr};
use relight_core::light::Panorama;
use relight_photo::export::{self, ExportError, ObjectMesh, read_object, to_glb, to_layers};
use relight_photo::insert::LightSource;
use relit_console::{Console, Outcome};
use relit_data::durable::write_whole;
use serde_json::json;

use crate::commands::CommandResult;

pub(crate) const EXAMPLES: &str = "\
Examples:
  relight export mug.relit -o mug.glb
      a relief mesh with colours, normals and gloss, for Blender, three.js and other viewers
  relight export mug -o mug.exr
      all maps of a folder of relight turn or relight decompose as layers of one EXR
  relight export mug.relit -o scene.py --light light.txt
      a script for Blender, with the object and the light beside it";

/// The size of the panorama beside a script, pixels.
const PANORAMA: Extent = Extent::new(512, 256);

#[derive(Args)]
pub(crate) struct Arguments {
    /// object.relit, or a folder of relight turn or relight decompose.
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// The file to write: .glb, .exr or .py.
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// Vertices of the relief in a GLB along the longer side of the picture.
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = clap::value_parser!(u32).range(2..=2048))]
    vertices: u32,
    /// For a script: the light, coefficients (.txt) or a panorama (.exr, .hdr) [default: even light].
    #[arg(long, value_name = "FILE")]
    light: Option<PathBuf>,
}

/// The kind of file that an object is written into.
#[derive(Clone, Copy, PartialEq)]
enum ExportFormat {
    Glb,
    Exr,
    Script,
}

impl ExportFormat {
    fn of(path: &Path) -> Option<Self> {
        let ending = path.extension()?;
        [("glb", Self::Glb), ("exr", Self::Exr), ("py", Self::Script)]
            .into_iter()
            .find_map(|(known, format)| ending.eq_ignore_ascii_case(known).then_some(format))
    }
}

impl Arguments {
    /// What is wrong with the combination of arguments, if anything is.
    pub(crate) fn fault(&self) -> Option<String> {
        match ExportFormat::of(&self.output) {
            None => Some(format!(
                "--output {}: give .glb, .exr or .py",
                self.output.display()
            )),
            Some(ExportFormat::Script) => None,
            Some(_) => self
                .light
                .is_some()
                .then(|| "--light is for a script (.py)".to_owned()),
        }
    }
}

pub(crate) fn run(arguments: &Arguments, console: Console) -> CommandResult {
    let object = read_object(&arguments.input)?;
    let output = &arguments.output;
    let mut files = vec![output.clone()];
    match ExportFormat::of(output) {
        Some(ExportFormat::Exr) => write(output, &to_layers(&object)?)?,
        Some(ExportFormat::Script) => files.extend(write_script(arguments, &object)?),
        Some(ExportFormat::Glb) | None => write(output, &glb(arguments, &object)?)?,
    }
    for file in files {
        console.say(
            &file.display().to_string(),
            &json!({ "event": "exported", "output": file, "object": object.name() }),
        );
    }
    Ok(Outcome::Whole)
}

fn glb(arguments: &Arguments, object: &CapturedObject) -> Result<Vec<u8>, ExportError> {
    let mesh = ObjectMesh::relief(object, arguments.vertices as usize)?;
    to_glb(object, &mesh)
}

/// Writes the object and the light beside the script, and then the script: the files beside it.
fn write_script(
    arguments: &Arguments,
    object: &CapturedObject,
) -> Result<Vec<PathBuf>, Box<dyn Error>> {
    let script = &arguments.output;
    let beside = |ending: &str| script.with_extension(ending);
    let name = |path: &Path| {
        path.file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned()
    };
    // All is made before anything is written: a light that cannot be read takes no file away.
    let object_file = beside("glb");
    let mut files = vec![(object_file.clone(), glb(arguments, object)?)];
    let mut panorama = None;
    if let Some(light) = &arguments.light {
        let path = beside("light.exr");
        // Coefficients are in the units of our albedo, which leaves out Lambert's 1 / π; a panorama holds radiance.
        let (found, strength) = match LightSource::read(light)? {
            LightSource::Coefficients(light) => (Panorama::of_light(&light, PANORAMA), PI),
            given => (given.panorama(), 1.0),
        };
        // A light of few bands can be negative somewhere; a renderer's cannot.
        let radiance = found.image().planes().clone().map(|v| v.max(0.0));
        panorama = Some((name(&path), strength));
        files.push((path.clone(), encode_exr(&path, &radiance)?));
    }
    let extent = object.extent();
    let text = export::script(
        &name(&object_file),
        panorama
            .as_ref()
            .map(|(name, strength)| (name.as_str(), *strength)),
        extent.width as f64 / extent.height as f64,
    );
    files.push((script.clone(), text.into_bytes()));
    for (path, bytes) in &files {
        write(path, bytes)?;
    }
    // The script has been told of already.
    files.pop();
    Ok(files.into_iter().map(|(path, _)| path).collect())
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), String> {
    write_whole(path, bytes)
        .map_err(|error| format!("{} cannot be written: {error}", path.display()))
}
