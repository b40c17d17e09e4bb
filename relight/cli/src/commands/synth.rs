//! `relight synth`.

use std::path::{Path, PathBuf};

use clap::Args;
use relight_synth::{
    Folders, Library, LightKind, Recipe, SynthError, SynthTally, TurnRecipe, made_panoramas,
    write_samples, write_turns,
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
      the panoramas that are used where none are given, as EXR";

#[derive(Args)]
pub(crate) struct Arguments {
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
    /// Objects of one's own, also in folders within it: .obj, .gltf, .glb.
    #[arg(long, value_name = "FOLDER")]
    meshes: Option<PathBuf>,
    /// Pictures to lay onto objects: .png, .jpg.
    #[arg(long, value_name = "FOLDER")]
    textures: Option<PathBuf>,
    /// Light: .hdr, .exr [default: synthetic panoramas].
    #[arg(long, value_name = "FOLDER")]
    panoramas: Option<PathBuf>,
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
    if arguments.write_panoramas {
        return panoramas(&arguments.output, console);
    }
    let folders = Folders {
        meshes: arguments.meshes.clone(),
        textures: arguments.textures.clone(),
        panoramas: arguments.panoramas.clone(),
    };
    let (library, outcome) = read_library(&folders, console)?;
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

fn recipe(arguments: &Arguments) -> Recipe {
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

fn samples(arguments: &Arguments, library: &Library, console: Console) -> Result<(), SynthError> {
    let count = arguments.count.unwrap_or(1000);
    let bar = console.progress(count, "samples");
    let recipe = recipe(arguments);
    let written = write_samples(&recipe, library, count, &arguments.output, &|| bar.inc(1));
    bar.finish_and_clear();
    report(arguments, console, "samples", written?);
    Ok(())
}

fn turns(arguments: &Arguments, library: &Library, console: Console) -> Result<(), SynthError> {
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

fn report(arguments: &Arguments, console: Console, what: &str, written: SynthTally) {
    let SynthTally { new, kept, .. } = written;
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
    Ok(Outcome::Whole)
}
