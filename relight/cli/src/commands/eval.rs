//! `relight eval`: the protocols of the paper's tables.

use std::error::Error;
use std::path::{Path, PathBuf};

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, Subcommand};
use relight_core::light::NormalsFrame;
use relight_core::reader::{TruthLayout, TruthSet};
use relight_core::render::{DiffuseForm, SpecularForm};
use relight_eval::{
    EvalProgress, IntrinsicInput, Predictions, RelightMethod, RelightingRecipe, RelightingSet,
    ScoreTable, evaluate_highlights, evaluate_intrinsic, evaluate_light, evaluate_normals,
    evaluate_relighting, evaluate_turns, make_relighting,
};
use relight_photo::decompose::Decomposer;
use relight_photo::nets::Weights;
use relight_synth::{Folders, Library};
use relight_turn::{TurnNetwork, TurnNetworks};
use relit_console::{Console, Outcome};
use relit_data::durable::write_whole;
use serde::Serialize;
use serde_json::json;

use crate::commands::CommandResult;
use crate::library::read_library;
use crate::shipped;
use crate::values::{Choices, DIFFUSE_FORMS, NORMALS_Y, one_of};

pub(crate) const EXAMPLES: &str = "\
Examples:
  relight eval mit --data MIT-intrinsic
      albedo and shading of the baselines, by both conventions
  relight eval mit --data MIT-intrinsic --predictions out/net -o mit.json
      the same beside the estimates out/net/<object>/{albedo,shading}.png
  relight eval normals --layout janner --data intrinsics --count 500 --predictions out/net
      estimates out/net/<name>/normal.png on 500 images, spread over the set
  relight eval relighting --data relighting --make
      100 objects under 30 lights each, made by the renderer of `relight synth`
  relight synth --turn --light monte-carlo --count 24 --frames 60 --size 128 --seed 2611 -o turns
  relight eval turn --data turns
      24 synthetic turns in rooms that no network was trained in";

#[derive(Args)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    protocol: Protocol,
}

#[derive(Subcommand)]
enum Protocol {
    /// Albedo and shading: SMSE and LMSE.
    Mit {
        #[command(flatten)]
        set: SetArguments,
        /// The image that baselines decompose.
        #[arg(long, default_value = "diffuse", value_parser = one_of(INPUTS))]
        input: IntrinsicInput,
    },
    /// Normals: MSE, DSSIM and angles.
    Normals {
        #[command(flatten)]
        set: SetArguments,
    },
    /// Light: MSE, SMSE and SSIM of the shading that it makes on the true normals.
    Light {
        #[command(flatten)]
        set: SetArguments,
        /// How shading follows from coefficients.
        #[arg(long, default_value = "irradiance", value_parser = one_of(DIFFUSE_FORMS))]
        diffuse: DiffuseForm,
    },
    /// Highlights: MSE and DSSIM of the highlight and of what it leaves.
    Highlight {
        #[command(flatten)]
        set: SetArguments,
    },
    /// Relighting: MSE and DSSIM of an object under many lights, from its image under one.
    Relighting(RelightingArguments),
    /// Whole turns in unknown rooms: normals, albedo, and whether what is said to be sure is right.
    Turn(TurnArguments),
}

#[derive(Args)]
struct TurnArguments {
    /// Turns with their ground truth, as relight synth --turn writes them.
    #[arg(long, value_name = "DIR")]
    data: PathBuf,
    /// Weights of the network of turns [default: those that come with the program].
    #[arg(long, value_name = "FILE")]
    turn_network: Option<PathBuf>,
    /// Write the table as JSON, with the scores of each turn, to this file.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

#[derive(Args)]
struct CommonArguments {
    /// The folder of the ground truth.
    #[arg(long, value_name = "DIR")]
    data: PathBuf,
    /// A folder of estimates, with a folder for each image. May be given several times.
    #[arg(long, value_name = "DIR")]
    predictions: Vec<PathBuf>,
    /// Which way y points in estimated normals.
    #[arg(long, value_name = "WAY", default_value = "up", value_parser = one_of(NORMALS_Y))]
    normals_y: NormalsFrame,
    /// Write the table as JSON, with the scores of each image, to this file.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

#[derive(Args)]
struct SetArguments {
    #[command(flatten)]
    common: CommonArguments,
    /// How the folder of the ground truth is laid out.
    #[arg(long, value_name = "LAYOUT", default_value = TruthLayout::Mit.name(), value_parser = layout_parser())]
    layout: TruthLayout,
    /// Compare so many images only, spread evenly over the set.
    #[arg(long, value_name = "N")]
    count: Option<usize>,
}

/// Layouts by their names, which the help lists.
fn layout_parser() -> impl TypedValueParser<Value = TruthLayout> {
    PossibleValuesParser::new(TruthLayout::ALL.map(TruthLayout::name))
        .try_map(|name| name.parse::<TruthLayout>())
}

#[derive(Args)]
struct RelightingArguments {
    #[command(flatten)]
    common: CommonArguments,
    /// Make the set first, in the folder --data; objects that are there are kept.
    #[arg(long)]
    make: bool,
    /// How many objects to make.
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u16).range(1..=999))]
    objects: u16,
    /// Under how many lights.
    #[arg(long, value_name = "N", default_value_t = 30, value_parser = clap::value_parser!(u16).range(2..=99))]
    lights: u16,
    /// Width and height of the images.
    #[arg(long, value_name = "PIXELS", default_value_t = 128, value_parser = clap::value_parser!(u32).range(16..=2048))]
    size: u32,
    /// What objects, materials and lights are drawn from.
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Make objects that cast no shadows on themselves.
    #[arg(long, requires = "make")]
    no_shadows: bool,
    /// The network's weights [default: those that come with the program].
    #[arg(long, value_name = "FILE")]
    weights: Option<PathBuf>,
    /// Meshes to draw from besides procedural shapes (.obj, .gltf, .glb).
    #[arg(long, value_name = "DIR", requires = "make")]
    meshes: Option<PathBuf>,
    /// Panoramas (.hdr, .exr) in place of the synthetic ones.
    #[arg(long, value_name = "DIR", requires = "make")]
    panoramas: Option<PathBuf>,
}

const INPUTS: Choices<IntrinsicInput> = &[
    ("diffuse", "Without highlights", IntrinsicInput::Diffuse),
    ("original", "As it was taken", IntrinsicInput::Original),
];

impl Arguments {
    /// What is wrong with the arguments together.
    pub(crate) fn fault(&self) -> Option<String> {
        match &self.protocol {
            Protocol::Mit { set, .. }
            | Protocol::Normals { set }
            | Protocol::Light { set, .. }
            | Protocol::Highlight { set } => {
                (set.count == Some(0)).then(|| "--count 0 leaves no image to compare".to_owned())
            }
            Protocol::Relighting(_) | Protocol::Turn(_) => None,
        }
    }

    /// The file for the table.
    fn output(&self) -> Option<&Path> {
        let common = match &self.protocol {
            Protocol::Turn(arguments) => return arguments.output.as_deref(),
            Protocol::Mit { set, .. }
            | Protocol::Normals { set }
            | Protocol::Light { set, .. }
            | Protocol::Highlight { set } => &set.common,
            Protocol::Relighting(arguments) => &arguments.common,
        };
        common.output.as_deref()
    }
}

impl CommonArguments {
    /// What the table calls the images.
    fn split(&self, which: &str) -> String {
        let name = self.data.file_name().unwrap_or(self.data.as_os_str());
        format!("{which} {}", name.to_string_lossy())
    }

    fn predictions(&self) -> Vec<Predictions> {
        let folder = |path: &PathBuf| Predictions::new(path.clone(), self.normals_y);
        self.predictions.iter().map(folder).collect()
    }
}

impl SetArguments {
    fn open(&self) -> Result<(TruthSet, String), Box<dyn Error>> {
        let set = TruthSet::open(&self.common.data, self.layout)?;
        let all = set.names().len();
        let set = set.spread(self.count.unwrap_or(all));
        let count = set.names().len();
        let split = if count == all {
            self.common.split("all of")
        } else {
            self.common.split(&format!("{count} spread over"))
        };
        Ok((set, split))
    }
}

pub(crate) fn run(arguments: &Arguments, console: Console) -> CommandResult {
    let (table, outcome) = match &arguments.protocol {
        Protocol::Mit { set, .. }
        | Protocol::Normals { set }
        | Protocol::Light { set, .. }
        | Protocol::Highlight { set } => {
            (images(&arguments.protocol, set, console)?, Outcome::Success)
        }
        Protocol::Relighting(arguments) => relighting(arguments, console)?,
        Protocol::Turn(arguments) => return turns(arguments, console),
    };
    report(&table, arguments.output(), console)?;
    Ok(outcome)
}

/// The table of a protocol over single images.
fn images(
    protocol: &Protocol,
    arguments: &SetArguments,
    console: Console,
) -> Result<ScoreTable, Box<dyn Error>> {
    let ((set, split), found) = (arguments.open()?, arguments.common.predictions());
    with_progress("evaluating", console, |progress| match protocol {
        Protocol::Mit { input, .. } => evaluate_intrinsic(&set, &split, *input, &found, progress),
        Protocol::Light { diffuse, .. } => evaluate_light(&set, &split, *diffuse, &found, progress),
        Protocol::Highlight { .. } => evaluate_highlights(&set, &split, &found, progress),
        _ => evaluate_normals(&set, &split, &found, progress),
    })
}

fn relighting(
    arguments: &RelightingArguments,
    console: Console,
) -> Result<(ScoreTable, Outcome), Box<dyn Error>> {
    let outcome = if arguments.make {
        make(arguments, console)?
    } else {
        Outcome::Success
    };
    let common = &arguments.common;
    let set = RelightingSet::open(&common.data)?;
    let network = match &arguments.weights {
        None => shipped::decomposer()?,
        Some(path) => Decomposer::new(&Weights::read(path)?)?,
    };
    let mut methods = vec![
        RelightMethod::Naive,
        RelightMethod::Photograph(&network),
        RelightMethod::Maps(&network),
        RelightMethod::Oracle(SpecularForm::Power),
        RelightMethod::Oracle(SpecularForm::Lobe),
    ];
    let found = common.predictions().into_iter();
    methods.extend(found.map(RelightMethod::Predictions));
    let table = with_progress("evaluating", console, |progress| {
        evaluate_relighting(&set, &common.split("all of"), &methods, progress)
    })?;
    Ok((table, outcome))
}

fn make(arguments: &RelightingArguments, console: Console) -> CommandResult {
    let recipe = RelightingRecipe {
        objects: arguments.objects.into(),
        lights: arguments.lights.into(),
        size: arguments.size,
        seed: arguments.seed,
        shadows: !arguments.no_shadows,
    };
    let folders = Folders {
        meshes: arguments.meshes.clone(),
        textures: None,
        panoramas: arguments.panoramas.clone(),
    };
    let (library, outcome) = read_library(&folders, Library::validation, console)?;
    with_progress("making objects", console, |progress| {
        make_relighting(&recipe, &library, &arguments.common.data, progress)
    })?;
    Ok(outcome)
}

fn turns(arguments: &TurnArguments, console: Console) -> CommandResult {
    let weights = match &arguments.turn_network {
        Some(path) => Weights::read(path)?,
        None => shipped::turn_weights()?,
    };
    let networks = TurnNetworks {
        photo: shipped::weights()?,
        turn: TurnNetwork::new(&weights)?,
    };
    let name = arguments
        .data
        .file_name()
        .unwrap_or(arguments.data.as_os_str());
    let split = name.to_string_lossy();
    let table = with_progress("solving", console, |progress| {
        evaluate_turns(&arguments.data, &split, &networks, progress)
    })?;
    write_json(&table, arguments.output.as_deref())?;
    let event = json!({ "event": "table", "table": table });
    console.say(table.to_string().trim_end(), &event);
    Ok(Outcome::Success)
}

fn with_progress<T, E: Error + 'static>(
    label: &'static str,
    console: Console,
    work: impl FnOnce(EvalProgress<'_>) -> Result<T, E>,
) -> Result<T, Box<dyn Error>> {
    let bar = console.progress(0, label);
    let result = work(&|steps| {
        bar.set_length(steps as u64);
        bar.inc(1);
    });
    bar.finish_and_clear();
    Ok(result?)
}

fn write_json(table: &impl Serialize, output: Option<&Path>) -> Result<(), Box<dyn Error>> {
    if let Some(path) = output {
        let mut bytes = serde_json::to_vec_pretty(table)?;
        bytes.push(b'\n');
        write_whole(path, &bytes)
            .map_err(|error| format!("{} cannot be written: {error}", path.display()))?;
    }
    Ok(())
}

fn report(
    table: &ScoreTable,
    output: Option<&Path>,
    console: Console,
) -> Result<(), Box<dyn Error>> {
    write_json(table, output)?;
    let event = json!({ "event": "table", "table": table });
    console.say(table.to_string().trim_end(), &event);
    Ok(())
}
