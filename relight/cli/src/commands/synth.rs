//! `relight synth`.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use relight_synth::{
    Folders, LIBRARY_EXTENSION, Library, LibrarySources, LibrarySummary, LightKind, Recipe,
    SynthError, SynthSummary, TurnRecipe, build_library, made_panoramas, write_samples,
    write_turns,
};
use relit_console::{Console, Outcome};
use serde_json::json;

use crate::commands::CommandResult;
use crate::folder::make_folder;
use crate::library::read_library;
use crate::values::{Choices, one_of};

pub(crate) const EXAMPLES: &str = "\
Examples:
  relight synth --count 50000 -o warmup
      procedural objects under random light, each with its truth
  relight synth --count 50000 --meshes meshes --panoramas hdri --textures photos -o warmup
      with files of one's own
  relight synth --turn --count 20 --panoramas hdri -o turns
      whole turns as shards, with their truth beside them
  relight synth --write-panoramas -o panoramas
      the panoramas that are used where none are given, as EXR
  relight synth library --meshes furniture meshes --panoramas hdri -o library.relib
      objects and panoramas packed into one file, for --meshes and --panoramas";

#[derive(Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    mode: Option<Mode>,
    #[command(flatten)]
    samples: Option<SampleArguments>,
}

#[derive(Subcommand)]
enum Mode {
    /// Pack objects and panoramas into one file to learn from, with a table of their authors and licences.
    Library(LibraryArguments),
}

#[derive(Args)]
struct LibraryArguments {
    /// The file to write, .relib; its table is written beside it as .csv and .md.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Folders of .obj, .gltf, .glb and archives of Sweet Home 3D (.sh3f), also in folders within them.
    #[arg(long, value_name = "FOLDER", num_args = 1.., required_unless_present = "panoramas")]
    meshes: Vec<PathBuf>,
    /// Folders of .hdr and .exr, also in folders within them.
    #[arg(long, value_name = "FOLDER", num_args = 1..)]
    panoramas: Vec<PathBuf>,
}

#[derive(Args)]
struct SampleArguments {
    /// The folder to write into; made where it is missing.
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// How many samples or turns [default: 1000; with --turn 1].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1_000_000_000))]
    count: Option<u64>,
    /// The same seed gives the same bytes.
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Width and height of the pictures.
    #[arg(long, value_name = "PIXELS", default_value_t = 256, value_parser = clap::value_parser!(u32).range(16..=2048))]
    size: u32,
    /// What light there is.
    #[arg(long, default_value = "mixed", value_parser = one_of(LIGHTS))]
    light: LightKind,
    /// Let light pass through objects: neither cast shadows nor dark hollows.
    #[arg(long)]
    no_shadows: bool,
    /// An sRGB camera without noise, clipping on purpose, or compression.
    #[arg(long)]
    plain_camera: bool,
    /// Keep what the files of meshes say of their albedo [default: of half of the samples].
    #[arg(long, value_name = "own", value_parser = ["own"])]
    albedo: Option<String>,
    /// Views of each object.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    views: u32,
    /// Materials and lightings of each view.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    lightings: u32,
    /// Objects of one's own, also in folders within it: .obj, .gltf, .glb; or a packed library, .relib.
    #[arg(long, value_name = "FOLDER")]
    meshes: Option<PathBuf>,
    /// Pictures to lay onto objects: .png, .jpg.
    #[arg(long, value_name = "FOLDER")]
    textures: Option<PathBuf>,
    /// Light: .hdr, .exr; or a packed library, .relib [default: synthetic panoramas].
    #[arg(long, value_name = "FOLDER")]
    panoramas: Option<PathBuf>,
    /// Take from packed libraries what is for validation only [default: what is for training].
    #[arg(long)]
    validation: bool,
    /// Write whole turns as shards, as relit-extract does: the object stands still, the light turns.
    #[arg(long, group = "mode")]
    turn: bool,
    /// Frames a turn.
    #[arg(long, value_name = "N", default_value_t = 1500, requires = "turn", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    frames: u32,
    /// Write the synthetic panoramas, and nothing else.
    #[arg(long, group = "mode")]
    write_panoramas: bool,
}

const LIGHTS: Choices<LightKind> = &[
    (
        "mixed",
        "Lamps mostly, panoramas else, with ambient and bounced light",
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
    match (&arguments.mode, &arguments.samples) {
        (Some(Mode::Library(arguments)), _) => library(arguments, console),
        (None, Some(arguments)) => synthesise(arguments, console),
        (None, None) => Err("--output is missing".into()),
    }
}

fn library(arguments: &LibraryArguments, console: Console) -> CommandResult {
    let out = &arguments.output;
    if out
        .extension()
        .is_none_or(|found| found != LIBRARY_EXTENSION)
    {
        let fault = format!("{} does not end in .{LIBRARY_EXTENSION}", out.display());
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
            "{origin}: no licence is known, so nobody can tell what may be learned from it: write an origin.toml there"
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
    console.say(&text, &event);
}

fn synthesise(arguments: &SampleArguments, console: Console) -> CommandResult {
    if arguments.write_panoramas {
        return panoramas(&arguments.output, console);
    }
    let folders = Folders {
        meshes: arguments.meshes.clone(),
        textures: arguments.textures.clone(),
        panoramas: arguments.panoramas.clone(),
    };
    let part = if arguments.validation {
        Library::validation
    } else {
        Library::training
    };
    let (library, outcome) = read_library(&folders, part, console)?;
    if arguments.albedo.is_some() {
        tell_of_plain_meshes(&library, console)?;
    }
    if arguments.turn {
        turns(arguments, &library, console)?;
    } else {
        samples(arguments, &library, console)?;
    }
    Ok(outcome)
}

/// Warns of meshes whose files do not say how they look.
fn tell_of_plain_meshes(library: &Library, console: Console) -> Result<(), &'static str> {
    let plain = library
        .meshes
        .iter()
        .filter(|(_, mesh)| !mesh.has_own_surface());
    let plain: Vec<&str> = plain.map(|(name, _)| name.as_str()).collect();
    if plain.len() == library.meshes.len() {
        return Err(
            "--albedo own: no mesh says how it looks: give a folder with some whose files have materials, by --meshes",
        );
    }
    if !plain.is_empty() {
        let text = format!(
            "{} of {} meshes do not say how they look, and are painted: {}",
            plain.len(),
            library.meshes.len(),
            plain.join(", ")
        );
        let event = json!({ "event": "plain_meshes", "meshes": plain });
        console.warn_with(&text, &event);
    }
    Ok(())
}

fn recipe(arguments: &SampleArguments) -> Recipe {
    Recipe {
        seed: arguments.seed,
        size: arguments.size,
        light: arguments.light,
        shadows: !arguments.no_shadows,
        views: arguments.views,
        lightings: arguments.lightings,
        random_camera: !arguments.plain_camera,
        own_albedo: arguments.albedo.is_some(),
    }
}

fn samples(
    arguments: &SampleArguments,
    library: &Library,
    console: Console,
) -> Result<(), SynthError> {
    let count = arguments.count.unwrap_or(1000);
    let bar = console.progress(count, "samples");
    let recipe = recipe(arguments);
    let written = write_samples(&recipe, library, count, &arguments.output, &|| bar.inc(1));
    bar.finish_and_clear();
    report(arguments, console, "samples", written?);
    Ok(())
}

fn turns(
    arguments: &SampleArguments,
    library: &Library,
    console: Console,
) -> Result<(), SynthError> {
    let count = arguments.count.unwrap_or(1);
    let bar = console.progress(count * u64::from(arguments.frames), "frames");
    let turns = TurnRecipe {
        recipe: recipe(arguments),
        frames: arguments.frames,
    };
    let written = write_turns(&turns, library, count, &arguments.output, &|| bar.inc(1));
    bar.finish_and_clear();
    report(arguments, console, "turns", written?);
    Ok(())
}

fn report(arguments: &SampleArguments, console: Console, what: &str, written: SynthSummary) {
    let SynthSummary { new, kept, .. } = written;
    let out = &arguments.output;
    console.say(
        &format!("{}: {new} {what} written, {kept} were there", out.display()),
        &json!({ "event": what, "out": out, "new": new, "kept": kept }),
    );
}

fn panoramas(out: &Path, console: Console) -> CommandResult {
    make_folder(out)?;
    let made = made_panoramas()?;
    for (name, panorama) in &made {
        panorama
            .image()
            .write_exr(&out.join(format!("{name}.exr")))?;
    }
    console.say(
        &format!("{}: {} panoramas", out.display(), made.len()),
        &json!({ "event": "panoramas", "out": out, "count": made.len() }),
    );
    Ok(Outcome::Success)
}
