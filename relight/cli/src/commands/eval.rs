//! `relight eval`: the protocols of the paper's tables.

use std::borrow::Cow;
use std::error::Error;
use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, Subcommand};
use relight_core::reader::{TruthLayout, TruthSet};
use relight_core::render::SpecularForm;
use relight_eval::{
    EvalProgress, IntrinsicInput, Predictions, RelightMethod, RelightingRecipe, RelightingSet,
    ScoreTable, evaluate_highlights, evaluate_intrinsic, evaluate_light, evaluate_normals,
    evaluate_relighting, evaluate_turns, make_relighting,
};
use relight_photo::decompose::Decomposer;
use relight_synth::Library;
use relight_turn::{TurnNetwork, TurnNetworks};
use relit_console::{Console, Outcome};
use relit_data::durable::write_whole;
use serde_json::json;

use crate::commands::CommandResult;
use crate::folder::OutputFolder;
use crate::inputs::{NormalsArgument, WeightsArgument};
use crate::library::{ObjectSources, read_library};
use crate::lighting::ShadingArgument;
use crate::shipped;
use crate::values::{Choices, one_of};

pub(crate) const EXAMPLES: &str = "\
Examples:
  relight eval mit --data MIT-intrinsic
      albedo and shading of the baselines, by both conventions
  relight eval mit --data MIT-intrinsic --predictions out/net -o mit.json
      the same and the estimates out/net/<object>/{albedo,shading}.png
  relight eval normals --layout janner --data intrinsics --count 500 --predictions out/net
      estimates out/net/<name>/normal.png on 500 images, spread over the set
  relight eval relighting make -o relighting
  relight eval relighting --data relighting
      100 objects under 30 lights each, made by the renderer of relight synth
  relight synth sequences --light-kind monte-carlo --count 24 --frames 60 --size 128 --seed 2611 -o turns
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
    /// Light: MSE, SMSE and SSIM of its shading on the true normals.
    Light {
        #[command(flatten)]
        set: SetArguments,
        #[command(flatten)]
        shading: ShadingArgument,
    },
    /// Highlights: MSE and DSSIM of the highlight and of the rest.
    Highlight {
        #[command(flatten)]
        set: SetArguments,
    },
    /// Relighting: MSE and DSSIM of an object under many lights, from its image under one.
    #[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
    Relighting {
        #[command(subcommand)]
        step: Option<RelightingStep>,
        #[command(flatten)]
        table: Option<TableArguments>,
        #[command(flatten)]
        estimates: EstimateArguments,
        #[command(flatten)]
        weights: WeightsArgument,
    },
    /// Whole turns in unknown light: normals, albedo, and whether confident pixels are right.
    Turn(TurnArguments),
}

#[derive(Subcommand)]
enum RelightingStep {
    /// Make the set: objects, each under many lights; existing objects are kept.
    Make(MakeArguments),
}

/// The ground truth, and the table of scores.
#[derive(Args)]
struct TableArguments {
    /// The folder of the ground truth.
    #[arg(long, value_name = "DIR")]
    data: PathBuf,
    /// Write the table as JSON, with all single scores.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

#[derive(Args)]
struct TurnArguments {
    #[command(flatten)]
    table: TableArguments,
    #[command(flatten)]
    weights: WeightsArgument,
}

/// The estimates that are measured besides the baselines.
#[derive(Args)]
struct EstimateArguments {
    /// A folder of estimates, with a folder for each image; can be repeated.
    #[arg(long, value_name = "DIR")]
    predictions: Vec<PathBuf>,
    #[command(flatten)]
    normals_frame: NormalsArgument,
}

#[derive(Args)]
struct SetArguments {
    #[command(flatten)]
    table: TableArguments,
    #[command(flatten)]
    estimates: EstimateArguments,
    /// The layout of the ground truth's folder.
    #[arg(long, value_name = "LAYOUT", default_value = TruthLayout::Mit.name(), value_parser = layout_parser())]
    layout: TruthLayout,
    /// Compare only N images, spread evenly over the set.
    #[arg(long, value_name = "N")]
    count: Option<usize>,
}

/// Layouts by their names, which the help lists.
fn layout_parser() -> impl TypedValueParser<Value = TruthLayout> {
    PossibleValuesParser::new(TruthLayout::ALL.map(TruthLayout::name))
        .try_map(|name| name.parse::<TruthLayout>())
}

#[derive(Args)]
struct MakeArguments {
    #[command(flatten)]
    folder: OutputFolder,
    /// Number of objects.
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u16).range(1..=999))]
    objects: u16,
    /// Lights for each object.
    #[arg(long, value_name = "N", default_value_t = 30, value_parser = clap::value_parser!(u16).range(2..=99))]
    lights: u16,
    /// Width and height of the pictures, pixels.
    #[arg(long, value_name = "PIXELS", default_value_t = 128, value_parser = clap::value_parser!(u32).range(16..=2048))]
    size: u32,
    #[command(flatten)]
    sources: ObjectSources,
}

const INPUTS: Choices<IntrinsicInput> = &[
    ("diffuse", "Without highlights", IntrinsicInput::Diffuse),
    ("original", "As taken", IntrinsicInput::Original),
];

impl Arguments {
    /// The fault of the combination of arguments, if there is one.
    pub(crate) fn fault(&self) -> Option<String> {
        match &self.protocol {
            Protocol::Mit { set, .. }
            | Protocol::Normals { set }
            | Protocol::Light { set, .. }
            | Protocol::Highlight { set } => (set.count == Some(0))
                .then(|| "--count 0 compares nothing: give 1 or more".to_owned()),
            Protocol::Relighting { .. } | Protocol::Turn(_) => None,
        }
    }
}

impl EstimateArguments {
    fn predictions(&self) -> Vec<Predictions> {
        let frame = self.normals_frame.normals_y;
        let folder = |path: &PathBuf| Predictions::new(path.clone(), frame);
        self.predictions.iter().map(folder).collect()
    }
}

impl TableArguments {
    fn name(&self) -> Cow<'_, str> {
        let name = self.data.file_name().unwrap_or(self.data.as_os_str());
        name.to_string_lossy()
    }

    /// What the table calls the images.
    fn split(&self, which: &str) -> String {
        format!("{which} {}", self.name())
    }

    /// Prints the table, and writes it where that is asked for.
    fn report(&self, table: &ScoreTable, console: Console) -> CommandResult {
        if let Some(path) = &self.output {
            let mut bytes = serde_json::to_vec_pretty(table)?;
            bytes.push(b'\n');
            write_whole(path, &bytes)
                .map_err(|error| format!("{} cannot be written: {error}", path.display()))?;
        }
        let event = json!({ "event": "table", "table": table });
        console.print(table.to_string().trim_end(), &event);
        Ok(Outcome::Success)
    }
}

impl SetArguments {
    fn open(&self) -> Result<(TruthSet, String), Box<dyn Error>> {
        let set = TruthSet::open(&self.table.data, self.layout)?;
        let all = set.names().len();
        let set = set.spread(self.count.unwrap_or(all));
        let count = set.names().len();
        let split = if count == all {
            self.table.split("all of")
        } else {
            self.table.split(&format!("{count} spread over"))
        };
        Ok((set, split))
    }
}

pub(crate) fn run(arguments: &Arguments, console: Console) -> CommandResult {
    match &arguments.protocol {
        Protocol::Mit { set, .. }
        | Protocol::Normals { set }
        | Protocol::Light { set, .. }
        | Protocol::Highlight { set } => {
            let table = images(&arguments.protocol, set, console)?;
            set.table.report(&table, console)
        }
        Protocol::Relighting {
            step: Some(RelightingStep::Make(arguments)),
            ..
        } => make(arguments, console),
        Protocol::Relighting {
            step: None,
            table,
            estimates,
            weights,
        } => {
            let table = table.as_ref().ok_or("give the ground truth with --data")?;
            relighting(table, estimates, weights, console)
        }
        Protocol::Turn(arguments) => turns(arguments, console),
    }
}

/// The table of a protocol over single images.
fn images(
    protocol: &Protocol,
    arguments: &SetArguments,
    console: Console,
) -> Result<ScoreTable, Box<dyn Error>> {
    let ((set, split), found) = (arguments.open()?, arguments.estimates.predictions());
    if matches!(protocol, Protocol::Mit { .. } | Protocol::Highlight { .. }) {
        for path in found
            .iter()
            .filter_map(|found| found.undescribed(set.names()))
        {
            console.warn(&format!(
                "{} is read as linear light: the maps of relight decompose are sRGB, and need their decomposition.json beside \
                 them",
                path.display()
            ));
        }
    }
    with_progress("evaluating", console, |progress| match protocol {
        Protocol::Mit { input, .. } => evaluate_intrinsic(&set, &split, *input, &found, progress),
        Protocol::Light { shading, .. } => {
            evaluate_light(&set, &split, shading.diffuse(), &found, progress)
        }
        Protocol::Highlight { .. } => evaluate_highlights(&set, &split, &found, progress),
        _ => evaluate_normals(&set, &split, &found, progress),
    })
}

fn relighting(
    table: &TableArguments,
    estimates: &EstimateArguments,
    weights: &WeightsArgument,
    console: Console,
) -> CommandResult {
    let set = RelightingSet::open(&table.data)?;
    let (weights, _) = weights.read_or(shipped::weights)?;
    let network = Decomposer::new(&weights)?;
    let mut methods = vec![
        RelightMethod::Naive,
        RelightMethod::Photograph(&network),
        RelightMethod::Maps(&network),
        RelightMethod::Oracle(SpecularForm::Power),
        RelightMethod::Oracle(SpecularForm::Lobe),
    ];
    let found = estimates.predictions().into_iter();
    methods.extend(found.map(RelightMethod::Predictions));
    let scores = with_progress("evaluating", console, |progress| {
        evaluate_relighting(&set, &table.split("all of"), &methods, progress)
    })?;
    table.report(&scores, console)
}

fn make(arguments: &MakeArguments, console: Console) -> CommandResult {
    let sources = &arguments.sources;
    let recipe = RelightingRecipe {
        objects: arguments.objects.into(),
        lights: arguments.lights.into(),
        size: arguments.size,
        seed: sources.seed,
        shadows: !sources.no_shadows,
    };
    let (library, outcome) = read_library(&sources.folders(), Library::validation, console)?;
    let out = &arguments.folder.output;
    with_progress("making objects", console, |progress| {
        make_relighting(&recipe, &library, out, progress)
    })?;
    let (objects, lights) = (recipe.objects, recipe.lights);
    let text = format!("{}: {objects} objects under {lights} lights", out.display());
    let event =
        json!({ "event": "relighting_set", "output": out, "objects": objects, "lights": lights });
    console.print(&text, &event);
    Ok(outcome)
}

fn turns(arguments: &TurnArguments, console: Console) -> CommandResult {
    let (weights, _) = arguments.weights.read_or(shipped::turn_weights)?;
    let networks = TurnNetworks {
        photo: shipped::weights()?,
        turn: TurnNetwork::new(&weights)?,
    };
    let table = &arguments.table;
    let scores = with_progress("solving", console, |progress| {
        evaluate_turns(&table.data, &table.name(), &networks, progress)
    })?;
    table.report(&scores, console)
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
