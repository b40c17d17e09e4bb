//! `relight synth`.

use std::error::Error;
use std::path::{Path, PathBuf};

use clap::builder::RangedU64ValueParser;
use clap::{Args, ValueEnum};
use rayon::ThreadPoolBuilder;
use relight_synth::{
    AlbedoKind, Folders, Library, LightKind, Recipe, SynthTally, TurnRecipe, made_panoramas,
    write_preview, write_samples, write_turns,
};
use relit_console::{Console, Outcome};
use serde_json::json;

use crate::commands::CommandResult;
use crate::folder::make_folder;
use crate::library::read_library;

/// Objects on one sheet, at most.
const LARGEST_SHEET: u64 = 500;

/// What a mode returns from rayon's threads.
type ModeResult = Result<(), Box<dyn Error + Send + Sync>>;

pub(crate) const EXAMPLES: &str = "\
Examples:
  relight synth --count 50000 -o warmup
      procedural objects under random light, each with its truth
  relight synth --count 50000 --meshes meshes --panoramas hdri --textures photos -o warmup
      with files of one's own
  relight synth --turn --count 20 --panoramas hdri -o turns
      whole turns as shards, with their truth beside them
  relight synth --preview -o look
      look/preview.png: a sheet of pictures beside their truth
  relight synth --write-panoramas -o panoramas
      the panoramas that are used where none are given, as EXR";

#[derive(Args)]
pub(crate) struct Arguments {
    /// The folder to write into; made where it is missing.
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// How many samples, turns or objects [default: 1000; with --turn 1, with --preview 24].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1_000_000_000))]
    count: Option<u64>,
    /// The same seed gives the same bytes.
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Width and height of the pictures, pixels [default: 256; with --preview 128].
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(16..=2048))]
    size: Option<u32>,
    /// What light there is.
    #[arg(long, value_enum, default_value_t = LightName::Mixed)]
    light: LightName,
    /// Let light pass through objects: neither cast shadows nor dark hollows.
    #[arg(long)]
    no_shadows: bool,
    /// An sRGB camera without noise, clipping on purpose, or compression.
    #[arg(long)]
    plain_camera: bool,
    /// Paint all objects in one way [default: each kind as often as networks learn most from].
    #[arg(long, value_enum, value_name = "KIND")]
    albedo: Option<AlbedoName>,
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
    /// Threads that work side by side [default: as many as there are cores].
    #[arg(long, value_name = "N", value_parser = RangedU64ValueParser::<usize>::new().range(1..=1024))]
    threads: Option<usize>,
    /// Write whole turns as shards, as relit-extract does: the object stands still, the light turns.
    #[arg(long, group = "mode")]
    turn: bool,
    /// Frames a turn.
    #[arg(long, value_name = "N", default_value_t = 1500, requires = "turn", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    frames: u32,
    /// Write a sheet of pictures beside their ground truth, OUT/preview.png, and nothing else.
    #[arg(long, group = "mode")]
    preview: bool,
    /// Write the synthetic panoramas, and nothing else.
    #[arg(long, group = "mode")]
    write_panoramas: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum LightName {
    /// Lamps mostly, panoramas else, with ambient and bounced light.
    Mixed,
    /// One to three lamps, with ambient and bounced light.
    Lamps,
    /// A panorama by its nine coefficients.
    Sh,
    /// A panorama by rays.
    MonteCarlo,
}

impl From<LightName> for LightKind {
    fn from(name: LightName) -> Self {
        match name {
            LightName::Mixed => Self::Mixed,
            LightName::Lamps => Self::Lamps,
            LightName::Sh => Self::Sh,
            LightName::MonteCarlo => Self::MonteCarlo,
        }
    }
}

#[derive(Clone, Copy, ValueEnum)]
enum AlbedoName {
    /// One colour.
    Constant,
    /// Two colours that go over into one another.
    Gradient,
    /// Patterns of greys.
    Grey,
    /// Nearly white against dark.
    TwoTone,
    /// Labels, glyphs, logos and bar codes, in dark and neutral ink mostly.
    Print,
    /// Patterns of two to five colours.
    Patterned,
    /// What the mesh's own file says; other objects as without --albedo.
    Own,
}

impl From<AlbedoName> for AlbedoKind {
    fn from(name: AlbedoName) -> Self {
        match name {
            AlbedoName::Constant => Self::Constant,
            AlbedoName::Gradient => Self::Gradient,
            AlbedoName::Grey => Self::Grey,
            AlbedoName::TwoTone => Self::TwoTone,
            AlbedoName::Print => Self::Print,
            AlbedoName::Patterned => Self::Patterned,
            AlbedoName::Own => Self::Own,
        }
    }
}

impl Arguments {
    /// What is wrong with the arguments together.
    pub(crate) fn fault(&self) -> Option<String> {
        let is_too_long = self.preview && self.count.is_some_and(|count| count > LARGEST_SHEET);
        is_too_long.then(|| format!("--count: a sheet has at most {LARGEST_SHEET} objects"))
    }
}

pub(crate) fn run(arguments: &Arguments, console: Console) -> CommandResult {
    let mut builder = ThreadPoolBuilder::new();
    if let Some(threads) = arguments.threads {
        builder = builder.num_threads(threads);
    }
    let pool = builder.build()?;
    if arguments.write_panoramas {
        return panoramas(&arguments.output, console);
    }
    let folders = Folders {
        meshes: arguments.meshes.clone(),
        textures: arguments.textures.clone(),
        panoramas: arguments.panoramas.clone(),
    };
    let (library, outcome) = read_library(&folders, console)?;
    if matches!(arguments.albedo, Some(AlbedoName::Own)) {
        tell_of_plain_meshes(&library, console)?;
    }
    let made = pool.install(|| {
        if arguments.preview {
            preview(arguments, &library, console)
        } else if arguments.turn {
            turns(arguments, &library, console)
        } else {
            samples(arguments, &library, console)
        }
    });
    match made {
        Ok(()) => Ok(outcome),
        Err(error) => Err(error),
    }
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

fn recipe(arguments: &Arguments, size: u32) -> Recipe {
    Recipe {
        seed: arguments.seed,
        size: arguments.size.unwrap_or(size),
        light: arguments.light.into(),
        shadows: !arguments.no_shadows,
        views: arguments.views,
        lightings: arguments.lightings,
        random_camera: !arguments.plain_camera,
        albedo: arguments.albedo.map(Into::into),
    }
}

fn samples(arguments: &Arguments, library: &Library, console: Console) -> ModeResult {
    let count = arguments.count.unwrap_or(1000);
    let bar = console.progress(count, "samples");
    let recipe = recipe(arguments, 256);
    let written = write_samples(&recipe, library, count, &arguments.output, &|| bar.inc(1));
    bar.finish_and_clear();
    report(arguments, console, "samples", written?);
    Ok(())
}

fn turns(arguments: &Arguments, library: &Library, console: Console) -> ModeResult {
    let count = arguments.count.unwrap_or(1);
    let bar = console.progress(count * u64::from(arguments.frames), "frames");
    let turns = TurnRecipe {
        recipe: recipe(arguments, 256),
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

fn preview(arguments: &Arguments, library: &Library, console: Console) -> ModeResult {
    let count = u32::try_from(arguments.count.unwrap_or(24))?;
    make_folder(&arguments.output)?;
    let path = arguments.output.join("preview.png");
    write_preview(&recipe(arguments, 128), library, count, &path)?;
    console.say(
        &format!(
            "{}: picture, albedo, shading, highlight and normals of {count} objects",
            path.display()
        ),
        &json!({ "event": "preview", "file": path, "objects": count }),
    );
    Ok(())
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
