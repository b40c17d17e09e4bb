//! `relight export`: objects and turns as files that other programs read.

use std::error::Error;
use std::f64::consts::PI;
use std::fs;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use relight_core::captured_object::CapturedObject;
use relight_core::image::{Extent, encode_exr};
use relight_core::light::{Panorama, ShLight};
use relight_export::frames::write_frames;
use relight_export::glb::to_glb;
use relight_export::lamp::TurnLamp;
use relight_export::layers::to_layers;
use relight_export::mesh::{MeshShape, ObjectMesh};
use relight_export::source::read_object;
use relight_export::{ExportError, blender};
use relit_console::{Console, Outcome};
use relit_data::durable::write_whole;
use relit_data::rig::RotationDirection;
use serde::Deserialize;
use serde_json::json;

use crate::commands::CommandResult;

pub(crate) const EXAMPLES: &str = "\
Examples:
  relight export mug.relit -o mug.glb
      a relief mesh with colours, normals and gloss, for Blender, three.js and other viewers
  relight export mug -o mug.exr
      all maps of a folder of relight turn or relight decompose as layers of one EXR
  relight export mug.relit -o scene.py --light light.txt
      a script for Blender, with the object and the light beside it
  relight export mug.tar -o mug.data --frames 48 --lamps mug
      frames and mask for methods of photometric stereo, and where the lamp stood in each";

/// The size of the panorama beside a script, pixels.
const PANORAMA: Extent = Extent::new(512, 256);

#[derive(Args)]
pub(crate) struct Arguments {
    /// object.relit, a folder of relight turn or relight decompose, or with --frames the shard of a turn.
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// The file to write (.glb, .exr, .py), or with --frames a folder.
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// What carries the maps in a GLB.
    #[arg(long, value_enum, default_value_t = ShapeName::Relief, conflicts_with = "frames")]
    shape: ShapeName,
    /// Vertices of a relief along the longer side of the picture.
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = clap::value_parser!(u32).range(2..=2048))]
    vertices: u32,
    /// The longer side of the picture in the scene, metres.
    #[arg(long, value_name = "METRES", default_value_t = 1.0, value_parser = metres)]
    size: f32,
    /// For a script: the light, coefficients (.txt) or a panorama (.exr, .hdr) [default: even light].
    #[arg(long, value_name = "FILE", conflicts_with = "frames")]
    light: Option<PathBuf>,
    /// Write so many frames of a turn, spread over it, with its mask.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1500))]
    frames: Option<u32>,
    /// With --frames: the folder of relight turn that has the turn's light, for lights.lp.
    #[arg(long, value_name = "DIR", requires = "frames")]
    lamps: Option<PathBuf>,
}

#[derive(Clone, Copy, ValueEnum)]
enum ShapeName {
    /// The integrated normals, with the object's outline.
    Relief,
    /// The picture's rectangle.
    Plane,
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
        let format = ExportFormat::of(&self.output);
        let output = self.output.display();
        match (self.frames, format) {
            (None, None) => Some(format!("--output {output}: give .glb, .exr or .py")),
            (Some(_), Some(_)) => Some(format!("--output {output}: give a folder for --frames")),
            (None, Some(format)) if self.light.is_some() && format != ExportFormat::Script => {
                Some("--light is for a script (.py)".to_owned())
            }
            _ => None,
        }
    }
}

pub(crate) fn run(arguments: &Arguments, console: Console) -> CommandResult {
    if let Some(frames) = arguments.frames {
        return run_frames(arguments, frames, console);
    }
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

fn run_frames(arguments: &Arguments, frames: u32, console: Console) -> CommandResult {
    let (lamp, doubt) = match &arguments.lamps {
        None => (None, None),
        Some(folder) => {
            let (lamp, doubt) = lamp(folder, &arguments.input)?;
            (Some(lamp), doubt)
        }
    };
    let output = &arguments.output;
    let written = write_frames(&arguments.input, output, frames, lamp.as_ref())?;
    let shown = match lamp {
        None => format!("{}: {written} frames", output.display()),
        Some(lamp) => format!(
            "{}: {written} frames; the light has {:.2} of a single lamp's direction",
            output.display(),
            lamp.dominance
        ),
    };
    console.say(
        &shown,
        &json!({
            "event": "exported", "output": output, "frames": written,
            "dominance": lamp.map(|lamp| lamp.dominance),
        }),
    );
    let few = (written < frames as usize)
        .then(|| format!("the turn has {written} frames, fewer than {frames}"));
    let mut outcome = Outcome::Whole;
    for warning in few.into_iter().chain(doubt) {
        console.warn(&warning);
        outcome = Outcome::Incomplete;
    }
    Ok(outcome)
}

/// What is read of `turn.json`.
#[derive(Deserialize)]
struct TurnFigures {
    turn: String,
    conditioning: Conditioning,
    elevation: Elevation,
    rotation: Rotation,
}

#[derive(Deserialize)]
struct Conditioning {
    verdict: String,
}

#[derive(Deserialize)]
struct Elevation {
    degrees: f64,
}

#[derive(Deserialize)]
struct Rotation {
    direction: RotationDirection,
}

/// The lamp of the turn `shard` that was solved into a folder, and what is wrong with its light, if anything is.
fn lamp(folder: &Path, shard: &Path) -> Result<(TurnLamp, Option<String>), Box<dyn Error>> {
    let path = folder.join("turn.json");
    let wrong = |reason: String| ExportError::Figures {
        path: path.clone(),
        reason,
    };
    let json = fs::read(&path)
        .map_err(|error| wrong(format!("{error}; --lamps takes a folder of relight turn")))?;
    let solved: TurnFigures =
        serde_json::from_slice(&json).map_err(|error| wrong(error.to_string()))?;
    let name = shard.file_stem().unwrap_or_default().to_string_lossy();
    if solved.turn != name {
        return Err(wrong(format!("it is of the turn {}, not of {name}", solved.turn)).into());
    }
    let verdict = solved.conditioning.verdict;
    let is_fit = ["good", "not_lambertian"].contains(&verdict.as_str());
    let doubt = || {
        format!(
            "the light of {} is not to be believed ({verdict})",
            folder.display()
        )
    };
    let light = ShLight::read(&folder.join("light.txt"))?;
    let elevation = solved.elevation.degrees.to_radians();
    let lamp = TurnLamp::new(&light, elevation, solved.rotation.direction)?;
    Ok((lamp, (!is_fit).then(doubt)))
}

fn glb(arguments: &Arguments, object: &CapturedObject) -> Result<Vec<u8>, Box<dyn Error>> {
    let shape = match arguments.shape {
        ShapeName::Plane => MeshShape::Plane,
        ShapeName::Relief => MeshShape::Relief(arguments.vertices as usize),
    };
    let mesh = ObjectMesh::new(object, shape)?;
    Ok(to_glb(object, &mesh, arguments.size)?)
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
        let found = if is_coefficients(light) {
            Panorama::of_light(&ShLight::read(light)?, PANORAMA)
        } else {
            Panorama::read(light)?
        };
        // A light of few bands can be negative somewhere; a renderer's cannot.
        let radiance = found.image().planes().clone().map(|v| v.max(0.0));
        // Coefficients are in the units of our albedo, which leaves out Lambert's 1 / π; a panorama holds radiance.
        let strength = if is_coefficients(light) { PI } else { 1.0 };
        panorama = Some((name(&path), strength));
        files.push((path.clone(), encode_exr(&path, &radiance)?));
    }
    let extent = object.extent();
    let text = blender::script(
        &name(&object_file),
        panorama
            .as_ref()
            .map(|(name, strength)| (name.as_str(), *strength)),
        arguments.size,
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

fn is_coefficients(light: &Path) -> bool {
    light
        .extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("txt"))
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), String> {
    write_whole(path, bytes)
        .map_err(|error| format!("{} cannot be written: {error}", path.display()))
}

fn metres(text: &str) -> Result<f32, String> {
    match text.parse() {
        Ok(metres) if (1e-4..=1e4).contains(&metres) => Ok(metres),
        _ => Err("give metres from 0.0001 to 10000".to_owned()),
    }
}
