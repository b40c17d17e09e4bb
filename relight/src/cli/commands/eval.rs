//! `relight eval`: the protocols of the paper's tables.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand, ValueEnum};
use relight::data::{TruthLayout, TruthSet};
use relight::eval::{
    HighlightMethod, IntrinsicBaseline, IntrinsicInput, IntrinsicMethod, LightMethod, NormalMethod,
    Predictions, Table, evaluate_highlights, evaluate_intrinsic, evaluate_light, evaluate_normals,
};
use relight::image::Transfer;
use relight::render::{DiffuseForm, NormalsFrame};
use relit_data::durable::write_whole;
use serde_json::json;

use crate::cli::console::{CommandResult, Console, Outcome};

pub(in crate::cli) const EXAMPLES: &str = "\
Examples:
  relight eval mit --data MIT-intrinsic
      albedo and shading of the baselines, by both conventions
  relight eval mit --data MIT-intrinsic --predictions out/net -o mit.json
      the same beside the estimates out/net/<object>/{albedo,shading}.png
  relight eval normals --layout janner --data intrinsics --count 500 --predictions out/net
      estimates out/net/<name>/normal.png on 500 images, spread over the set";

#[derive(Args)]
pub(in crate::cli) struct Arguments {
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
        #[arg(long, value_enum, default_value_t = InputName::Diffuse)]
        input: InputName,
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
        #[arg(long, value_enum, default_value_t = DiffuseName::Irradiance)]
        diffuse: DiffuseName,
    },
    /// Highlights: MSE and DSSIM of the highlight and of what it leaves.
    Highlight {
        #[command(flatten)]
        set: SetArguments,
    },
}

#[derive(Args)]
struct SetArguments {
    /// The folder of images with their truth.
    #[arg(long, value_name = "DIR")]
    data: PathBuf,
    /// How that folder is laid out.
    #[arg(long, value_name = "LAYOUT", default_value_t = TruthLayout::Mit)]
    layout: TruthLayout,
    /// Compare so many images only, spread evenly over the set.
    #[arg(long, value_name = "N")]
    count: Option<usize>,
    /// What the table calls these images [default: the folder's name].
    #[arg(long, value_name = "TEXT")]
    split: Option<String>,
    /// A folder of estimates, with a folder for each image. May be given several times.
    #[arg(long, value_name = "DIR")]
    predictions: Vec<PathBuf>,
    /// How PNG files of colour among the estimates are encoded; EXR is linear.
    #[arg(long, value_enum, value_name = "SPACE", default_value_t = TransferName::Linear)]
    transfer: TransferName,
    /// Which way y points in estimated normals.
    #[arg(long, value_enum, value_name = "WAY", default_value_t = YName::Up)]
    normals_y: YName,
    /// Write the table as JSON, with the scores of each image, to this file.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

#[derive(Clone, Copy, ValueEnum)]
enum InputName {
    /// Without highlights.
    Diffuse,
    /// As it was taken.
    Original,
}

#[derive(Clone, Copy, ValueEnum)]
enum DiffuseName {
    /// The light that arrives at the surface.
    Irradiance,
    /// As the paper's released code has it.
    Released,
}

#[derive(Clone, Copy, ValueEnum)]
enum TransferName {
    /// In proportion to light.
    Linear,
    /// As sRGB.
    Srgb,
}

#[derive(Clone, Copy, ValueEnum)]
enum YName {
    /// As relight writes them.
    Up,
    /// As in the paper's figures and released code.
    Down,
}

impl Arguments {
    /// What is wrong with the arguments together.
    pub(in crate::cli) fn fault(&self) -> Option<String> {
        let (Protocol::Mit { set, .. }
        | Protocol::Normals { set }
        | Protocol::Light { set, .. }
        | Protocol::Highlight { set }) = &self.protocol;
        (set.count == Some(0)).then(|| "--count 0 leaves no image to compare".to_owned())
    }
}

impl SetArguments {
    fn open(&self) -> Result<(TruthSet, String), Box<dyn std::error::Error>> {
        let set = TruthSet::open(&self.data, self.layout)?;
        let all = set.names().len();
        let set = set.spread(self.count.unwrap_or(all));
        let name = self.data.file_name().unwrap_or(self.data.as_os_str());
        let which = if set.names().len() == all {
            "all of".to_owned()
        } else {
            format!("{} spread over", set.names().len())
        };
        let named = || format!("{which} {}", name.to_string_lossy());
        Ok((set, self.split.clone().unwrap_or_else(named)))
    }

    fn predictions(&self) -> impl Iterator<Item = Predictions> {
        let transfer = match self.transfer {
            TransferName::Linear => Transfer::Linear,
            TransferName::Srgb => Transfer::Srgb,
        };
        let frame = match self.normals_y {
            YName::Up => NormalsFrame::YUp,
            YName::Down => NormalsFrame::YDown,
        };
        let folder = move |path: &PathBuf| Predictions::new(path.clone(), transfer, frame);
        self.predictions.iter().map(folder)
    }
}

pub(in crate::cli) fn run(arguments: &Arguments, console: Console) -> CommandResult {
    let (table, output) = match &arguments.protocol {
        Protocol::Mit { set, input } => (mit(set, *input, console)?, &set.output),
        Protocol::Normals { set } => (normals(set, console)?, &set.output),
        Protocol::Light { set, diffuse } => (light(set, *diffuse, console)?, &set.output),
        Protocol::Highlight { set } => (highlight(set, console)?, &set.output),
    };
    tell(&table, output.as_deref(), console)
}

type Evaluated = Result<Table, Box<dyn std::error::Error>>;

fn mit(arguments: &SetArguments, input: InputName, console: Console) -> Evaluated {
    let (set, split) = arguments.open()?;
    let input = match input {
        InputName::Diffuse => IntrinsicInput::Diffuse,
        InputName::Original => IntrinsicInput::Original,
    };
    let baselines = IntrinsicBaseline::all().map(IntrinsicMethod::Baseline);
    let predicted = arguments.predictions().map(IntrinsicMethod::Predictions);
    let methods: Vec<_> = baselines.into_iter().chain(predicted).collect();
    with_progress(&set, methods.len(), console, |progress| {
        evaluate_intrinsic(&set, &split, input, &methods, progress)
    })
}

fn normals(arguments: &SetArguments, console: Console) -> Evaluated {
    let (set, split) = arguments.open()?;
    let predicted = arguments.predictions().map(NormalMethod::Predictions);
    let methods: Vec<_> = [NormalMethod::Viewer]
        .into_iter()
        .chain(predicted)
        .collect();
    with_progress(&set, methods.len(), console, |progress| {
        evaluate_normals(&set, &split, &methods, progress)
    })
}

fn light(arguments: &SetArguments, diffuse: DiffuseName, console: Console) -> Evaluated {
    let (set, split) = arguments.open()?;
    let form = match diffuse {
        DiffuseName::Irradiance => DiffuseForm::Irradiance,
        DiffuseName::Released => DiffuseForm::Released,
    };
    let predicted = arguments.predictions().map(LightMethod::Predictions);
    let baselines = [LightMethod::Even, LightMethod::Oracle];
    let methods: Vec<_> = baselines.into_iter().chain(predicted).collect();
    with_progress(&set, methods.len(), console, |progress| {
        evaluate_light(&set, &split, form, &methods, progress)
    })
}

fn highlight(arguments: &SetArguments, console: Console) -> Evaluated {
    let (set, split) = arguments.open()?;
    let predicted = arguments.predictions().map(HighlightMethod::Predictions);
    let methods: Vec<_> = [HighlightMethod::Nothing]
        .into_iter()
        .chain(predicted)
        .collect();
    with_progress(&set, methods.len(), console, |progress| {
        evaluate_highlights(&set, &split, &methods, progress)
    })
}

fn with_progress<E: std::error::Error + 'static>(
    set: &TruthSet,
    methods: usize,
    console: Console,
    evaluate: impl FnOnce(&(dyn Fn() + Sync)) -> Result<Table, E>,
) -> Evaluated {
    let steps = (set.names().len() * methods) as u64;
    let bar = console.progress(steps, "evaluating");
    let table = evaluate(&|| bar.inc(1));
    bar.finish_and_clear();
    Ok(table?)
}

fn tell(table: &Table, output: Option<&Path>, console: Console) -> CommandResult {
    if let Some(path) = output {
        let mut bytes = serde_json::to_vec_pretty(table)?;
        bytes.push(b'\n');
        write_whole(path, &bytes).map_err(|error| format!("{}: {error}", path.display()))?;
    }
    let event = json!({ "event": "table", "table": table });
    console.say(table.to_string().trim_end(), &event);
    Ok(Outcome::Whole)
}
