//! `relight synth`.

use std::error::Error;
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use relight_synth::{
    LIBRARY_EXTENSION, Library, LibrarySources, LibrarySummary, LightKind, Recipe, SequenceRecipe,
    SynthSummary, build_library, made_panoramas, write_samples, write_sequences,
};
use relit_console::{Console, Outcome};
use serde_json::json;

use crate::commands::CommandResult;
use crate::folder::{OutputFolder, make_folder};
use crate::library::{ObjectSources, read_library};
use crate::values::{Choices, one_of};

pub(crate) const EXAMPLES: &str = "\
Examples:
  relight synth samples --count 50000 -o warmup
      procedural objects under random light, each with its ground truth
  relight synth samples --count 50000 --meshes meshes --panoramas hdri -o warmup
      with your own files
  relight synth sequences --count 20 --panoramas hdri -o sequences
      whole turns as shards, with their ground truth
  relight synth panoramas -o panoramas
      the default panoramas, as EXR
  relight synth library --meshes furniture meshes --panoramas hdri -o library.relib
      objects and panoramas packed into one file, for --meshes and --panoramas";

#[derive(Args)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    product: Product,
}

#[derive(Subcommand)]
enum Product {
    /// Pictures of objects, each with its ground truth.
    Samples(SampleArguments),
    /// Whole turns as shards, as from relit-extract: the object stands still, the light rotates.
    Sequences(SequenceArguments),
    /// Objects and panoramas packed into one file for training, with a table of authors and licences.
    Library(LibraryArguments),
    /// The synthetic panoramas.
    Panoramas(OutputFolder),
}

#[derive(Args)]
struct LibraryArguments {
    /// The file to write, .relib; its table is written next to it as .csv.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Folders of .obj, .gltf, .glb and Sweet Home 3D archives (.sh3f), with their subfolders.
    #[arg(long, value_name = "FOLDER", num_args = 1.., required_unless_present = "panoramas")]
    meshes: Vec<PathBuf>,
    /// Folders of .hdr and .exr, with their subfolders.
    #[arg(long, value_name = "FOLDER", num_args = 1..)]
    panoramas: Vec<PathBuf>,
}

#[derive(Args)]
struct SampleArguments {
    /// Number of samples.
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = clap::value_parser!(u64).range(1..=1_000_000_000))]
    count: u64,
    /// Views of each object.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    views: u32,
    /// Samples of each view, each in another material and light.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    lightings: u32,
    /// Use an sRGB camera without noise, deliberate clipping or compression.
    #[arg(long)]
    plain_camera: bool,
    #[command(flatten)]
    pictures: PictureArguments,
}

#[derive(Args)]
struct SequenceArguments {
    /// Number of turns.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=1_000_000_000))]
    count: u64,
    /// Frames of a turn.
    #[arg(long, value_name = "N", default_value_t = 1500, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    frames: u32,
    #[command(flatten)]
    pictures: PictureArguments,
}

/// What pictures of objects are made of.
#[derive(Args)]
struct PictureArguments {
    #[command(flatten)]
    folder: OutputFolder,
    /// Width and height of the pictures, pixels.
    #[arg(long, value_name = "PIXELS", default_value_t = 256, value_parser = clap::value_parser!(u32).range(16..=2048))]
    size: u32,
    /// Kind of light.
    #[arg(long, value_name = "KIND", default_value = "mixed", value_parser = one_of(LIGHT_KINDS))]
    light_kind: LightKind,
    #[command(flatten, next_help_heading = "Objects and light")]
    sources: ObjectSources,
    /// Keep the meshes' own albedo in all samples [default: in half of them].
    #[arg(long)]
    own_albedo: bool,
    /// Use the validation part of packed libraries [default: the training part].
    #[arg(long)]
    validation: bool,
}

const LIGHT_KINDS: Choices<LightKind> = &[
    (
        "mixed",
        "Mostly lamps, else panoramas, with ambient and bounced light",
        LightKind::Mixed,
    ),
    (
        "lamps",
        "One to three lamps, with ambient and bounced light",
        LightKind::Lamps,
    ),
    ("sh", "A panorama by its nine coefficients", LightKind::Sh),
    ("monte-carlo", "A panorama by rays", LightKind::MonteCarlo),
];

pub(crate) fn run(arguments: &Arguments, console: Console) -> CommandResult {
    match &arguments.product {
        Product::Samples(arguments) => samples(arguments, console),
        Product::Sequences(arguments) => sequences(arguments, console),
        Product::Library(arguments) => library(arguments, console),
        Product::Panoramas(folder) => panoramas(&folder.output, console),
    }
}

fn library(arguments: &LibraryArguments, console: Console) -> CommandResult {
    let out = &arguments.output;
    if out
        .extension()
        .is_none_or(|found| found != LIBRARY_EXTENSION)
    {
        let fault = format!(
            "--output {}: give a name that ends in .{LIBRARY_EXTENSION}",
            out.display()
        );
        return Err(fault.into());
    }
    let sources = LibrarySources {
        meshes: arguments.meshes.clone(),
        panoramas: arguments.panoramas.clone(),
    };
    let bar = console.progress(0, "files");
    let built = build_library(&sources, out, &|count| match count {
        Some(count) => bar.set_length(count as u64),
        None => bar.inc(1),
    });
    bar.finish_and_clear();
    let summary = built?;
    for fault in &summary.faults {
        let event = json!({ "event": "left_out", "path": fault.path, "message": fault.what });
        console.warn_with(&fault.to_string(), &event);
    }
    for origin in summary.without_licence() {
        let text = format!(
            "{origin}: the licence is unknown, so it is not certain that training on it is allowed: write an origin.toml there"
        );
        let event = json!({ "event": "no_licence", "origin": origin });
        console.warn_with(&text, &event);
    }
    report_library(out, &summary, console);
    Ok(if summary.faults.is_empty() {
        Outcome::Success
    } else {
        Outcome::Partial
    })
}

fn report_library(out: &Path, summary: &LibrarySummary, console: Console) {
    let (objects, panoramas) = (&summary.objects, &summary.panoramas);
    let left_out: Vec<String> = summary
        .left_out
        .iter()
        .map(|(reason, count)| format!("{count} {reason}"))
        .collect();
    let mut text = format!(
        "{}: {} objects and {} panoramas, {:.1} MB",
        out.display(),
        objects.len(),
        panoramas.len(),
        summary.bytes as f64 / 1e6
    );
    if !left_out.is_empty() {
        text = format!("{text}; left out: {}", left_out.join(", "));
    }
    let event = json!({
        "event": "library",
        "out": out,
        "objects": objects.len(),
        "panoramas": panoramas.len(),
        "bytes": summary.bytes,
        "left_out": summary.left_out,
    });
    console.print(&text, &event);
}

/// Warns of meshes whose files have no materials.
fn tell_of_plain_meshes(library: &Library, console: Console) -> Result<(), &'static str> {
    let plain = library
        .meshes
        .iter()
        .filter(|(_, mesh)| !mesh.has_own_surface());
    let plain: Vec<&str> = plain.map(|(name, _)| name.as_str()).collect();
    if plain.len() == library.meshes.len() {
        return Err(
            "--own-albedo: no mesh has materials: give meshes with materials with --meshes",
        );
    }
    if !plain.is_empty() {
        let text = format!(
            "{} of {} meshes have no materials and are painted: {}",
            plain.len(),
            library.meshes.len(),
            plain.join(", ")
        );
        let event = json!({ "event": "plain_meshes", "meshes": plain });
        console.warn_with(&text, &event);
    }
    Ok(())
}

impl PictureArguments {
    /// The library that the pictures are made of.
    fn library(&self, console: Console) -> Result<(Library, Outcome), Box<dyn Error>> {
        let part = if self.validation {
            Library::validation
        } else {
            Library::training
        };
        let folders = self.sources.folders();
        let (library, outcome) = read_library(&folders, part, console)?;
        if self.own_albedo {
            tell_of_plain_meshes(&library, console)?;
        }
        Ok((library, outcome))
    }

    fn recipe(&self) -> Recipe {
        Recipe {
            seed: self.sources.seed,
            size: self.size,
            light: self.light_kind,
            shadows: !self.sources.no_shadows,
            own_albedo: self.own_albedo,
            ..Recipe::default()
        }
    }

    fn report(&self, console: Console, what: &str, written: &SynthSummary) {
        let SynthSummary { new, kept, .. } = written;
        let out = &self.folder.output;
        console.print(
            &format!("{}: {new} {what} written, {kept} kept", out.display()),
            &json!({ "event": what, "out": out, "new": new, "kept": kept }),
        );
    }
}

fn samples(arguments: &SampleArguments, console: Console) -> CommandResult {
    let pictures = &arguments.pictures;
    let (library, outcome) = pictures.library(console)?;
    let recipe = Recipe {
        views: arguments.views,
        lightings: arguments.lightings,
        random_camera: !arguments.plain_camera,
        ..pictures.recipe()
    };
    let bar = console.progress(arguments.count, "samples");
    let out = &pictures.folder.output;
    let written = write_samples(&recipe, &library, arguments.count, out, &|| bar.inc(1));
    bar.finish_and_clear();
    pictures.report(console, "samples", &written?);
    Ok(outcome)
}

fn sequences(arguments: &SequenceArguments, console: Console) -> CommandResult {
    let pictures = &arguments.pictures;
    let (library, outcome) = pictures.library(console)?;
    let turns = SequenceRecipe {
        recipe: pictures.recipe(),
        frames: arguments.frames,
    };
    let bar = console.progress(arguments.count * u64::from(arguments.frames), "frames");
    let out = &pictures.folder.output;
    let written = write_sequences(&turns, &library, arguments.count, out, &|| bar.inc(1));
    bar.finish_and_clear();
    pictures.report(console, "turns", &written?);
    Ok(outcome)
}

fn panoramas(out: &Path, console: Console) -> CommandResult {
    make_folder(out)?;
    let made = made_panoramas()?;
    for (name, panorama) in &made {
        panorama
            .image()
            .write_exr(&out.join(format!("{name}.exr")))?;
    }
    console.print(
        &format!("{}: {} panoramas", out.display(), made.len()),
        &json!({ "event": "panoramas", "out": out, "count": made.len() }),
    );
    Ok(Outcome::Success)
}
