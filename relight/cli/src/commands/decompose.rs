//! `relight decompose`: photographs into normals, albedo, shading, highlight and light.

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use clap::builder::RangedU64ValueParser;
use relight_core::parallel;
use relight_photo::decompose::{DecomposeError, DecomposeOptions, Decomposer, MaskSource};
use relight_photo::files::{DecompositionFigures, DecompositionFiles, PhotoInput, PhotoReading};
use relit_console::{Console, Outcome};
use relit_data::causes::with_causes;
use serde_json::{Value, json};

use crate::commands::CommandResult;
use crate::folder::OutputFolder;
use crate::photos::{NetworkArguments, PhotoArguments, name_lost, name_notes, outcome};

/// Each photograph takes memory, gigabytes if it is large.
const MAX_SIDE_BY_SIDE: usize = 4;

pub(crate) const EXAMPLES: &str = "\
Examples:
  relight decompose mug.jpg --mask mug-mask.png -o mug
      a photograph and its mask: mug/normal.png, albedo.png, shading.png, light.txt, contact.png ...
  relight decompose cut-out.png -o cut-out
      a photograph whose alpha is the mask
  relight decompose photos --mask masks -o out
      a folder of photographs, with masks of the same names: out/<name>/";

#[derive(Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    photos: PhotoArguments,
    #[command(flatten)]
    folder: OutputFolder,
    /// Photographs decomposed in parallel [default: one per core, at most 4].
    #[arg(long, value_name = "N", value_parser = RangedU64ValueParser::<usize>::new().range(1..=1024))]
    threads: Option<usize>,
    #[command(flatten, next_help_heading = "Network")]
    network: NetworkArguments,
}

impl Arguments {
    /// The fault of the combination of arguments, if there is one.
    pub(crate) fn fault(&self) -> Option<String> {
        self.photos.fault()
    }
}

pub(crate) fn run(arguments: &Arguments, console: Console) -> CommandResult {
    let found = (arguments.photos).find(&arguments.folder.output, console)?;
    let inputs = &found.inputs;
    let own_folders = inputs.len() > 1 || arguments.photos.has_set();
    let run = Run::new(arguments, own_folders)?;
    if !run.own_folders
        && let [input] = inputs.as_slice()
    {
        let done = run.decompose(input)?;
        done.say(console);
        return Ok(Outcome::Success);
    }
    let bar = console.progress(inputs.len() as u64, "photographs");
    let failed = |input: &PhotoInput, message: &str| {
        bar.suspend(|| name_lost(input, message, console));
    };
    let decompose = |input: &PhotoInput| {
        let result = parallel::caught(|| run.decompose(input));
        match &result {
            Ok(Ok(done)) => bar.suspend(|| done.say(console)),
            Ok(Err(error)) => failed(input, &with_causes(error)),
            Err(panic) => failed(input, &panic.to_string()),
        }
        bar.inc(1);
        matches!(result, Ok(Ok(_)))
    };
    let side_by_side = arguments
        .threads
        .unwrap_or_else(|| rayon::current_num_threads().min(MAX_SIDE_BY_SIDE));
    let whole = parallel::jobs(inputs, side_by_side, decompose);
    let lost = whole.iter().filter(|is_whole| !**is_whole).count();
    bar.finish_and_clear();
    outcome(&found, lost, "decomposed")
}

/// What is reported about a photograph.
struct Decomposed {
    photo: String,
    notes: Vec<String>,
    text: String,
    event: Value,
}

impl Decomposed {
    fn say(&self, console: Console) {
        name_notes(&self.photo, &self.notes, console);
        console.print(&self.text, &self.event);
    }
}

/// All that is the same for every photograph.
struct Run {
    decomposer: Decomposer,
    weights: String,
    options: DecomposeOptions,
    reading: PhotoReading,
    output: PathBuf,
    own_folders: bool,
}

impl Run {
    fn new(arguments: &Arguments, own_folders: bool) -> Result<Self, DecomposeError> {
        let (weights, name) = arguments.network.weights()?;
        Ok(Self {
            decomposer: Decomposer::new(&weights)?,
            weights: name,
            options: arguments.network.options(),
            reading: arguments.photos.reading(),
            output: arguments.folder.output.clone(),
            own_folders,
        })
    }

    fn decompose(&self, input: &PhotoInput) -> Result<Decomposed, DecomposeError> {
        let photo = input.load(&self.reading)?;
        let out = if self.own_folders {
            let out = self.output.join(&photo.name);
            PhotoInput::check_result(&out)?;
            out
        } else {
            self.output.clone()
        };
        DecompositionFiles::check(&out)?;
        let options = photo.options(&self.options);
        let start = Instant::now();
        let found = self
            .decomposer
            .decompose(&photo.picture, &photo.mask, &options)?;
        let seconds = start.elapsed().as_secs_f64();
        let files = DecompositionFiles {
            photo: &photo,
            found: &found,
            options: &options,
            weights: &self.weights,
        };
        let figures: DecompositionFigures = files.write(&out)?;
        let source = match photo.mask_source {
            MaskSource::BlackBackground => "; the object is what is not black",
            MaskSource::File | MaskSource::Alpha | MaskSource::Rectangle => "",
        };
        let highlights = if found.is_glossy {
            "separated"
        } else {
            "not separated"
        };
        let text = format!(
            "{}: {seconds:.2} s; {:.1} % saturated, highlights {highlights}; residual {:.1} % of the picture{source}",
            out.display(),
            100.0 * found.saturated_fraction,
            100.0 * found.residual,
        );
        let event = json!({
            "event": "decomposed",
            "photo": input.place(),
            "output": out,
            "seconds": seconds,
            "figures": figures,
        });
        Ok(Decomposed {
            photo: input.place(),
            notes: photo.notes,
            text,
            event,
        })
    }
}
