//! The command line of relit-mask.

use std::path::PathBuf;

use clap::error::ErrorKind;
use clap::{ArgGroup, Args, CommandFactory, Parser, Subcommand};
use relit_console::ConsoleOptions;
use relit_data::geometry::Rect;
use relit_grabcut::{Hints, SegmentSettings};
use relit_mask::{
    MaskEngine, MaskRequest, MaskTarget, MaskingError, OPENCV_KNOWS_NO_TURN, read_seeds,
};
use relit_web::ListenAddress;

const EXAMPLES: &str = "\
Examples:
  relit-mask 20261120T093015Z-mug --auto
  relit-mask 20261120T093015Z-mug --rect 610,240,420,380
  relit-mask 20261120T093015Z-mug --edit
  relit-mask clip.mp4 --seeds seeds.png --frame 30 -o masks/mug.png
  relit-mask sessions/ --rect 610,240,420,380 --keep-all
  relit-mask videos/ --auto -o masks/
  relit-mask photographs/ --auto -o masks/
  relit-mask photographs/ --model u2netp.onnx -o masks/
  relit-mask cup.jpg --model encoder.onnx --model decoder.onnx --rect 120,40,260,420
  relit-mask cup.jpg bowl.jpg --rect 120,40,260,420 -o masks/
  relit-mask check 20261120T093015Z-mug

Check mask-preview.png afterwards. Exit codes: 0 all masks made, 1 none, 2 wrong usage, \
3 some recordings have no mask.";

/// Find the object in one frame of a recording; writes mask.png, mask.json and mask-preview.png.
#[derive(Debug, Parser)]
#[command(
    name = "relit-mask",
    version,
    after_help = EXAMPLES,
    subcommand_negates_reqs = true
)]
pub(crate) struct CommandLine {
    #[command(subcommand)]
    pub(crate) verb: Option<Verb>,
    #[command(flatten)]
    pub(crate) mask: Option<MaskArguments>,
    #[command(flatten)]
    pub(crate) console: ConsoleOptions,
}

/// What is done other than making masks.
#[derive(Debug, Subcommand)]
pub(crate) enum Verb {
    /// Compare a recording's mask with what its turn shows; writes NAME-check.html
    #[command(
        after_help = "Example:\n  relit-mask check 20261120T093015Z-mug\n\nExit codes: 0 the mask fits, 1 it could not be checked, 2 wrong usage, 3 it does not fit or that is unknown."
    )]
    Check {
        /// A session folder, a video, or a folder of sessions or videos
        #[arg(value_name = "SESSION")]
        input: PathBuf,
        /// The mask, or a folder of masks: clip.png for clip.mp4 [default: mask.png in the session folder, or here]
        #[arg(long, value_name = "PNG|DIR")]
        mask: Option<PathBuf>,
    },
}

/// What mask is to be made.
#[derive(Debug, Args)]
#[command(group = ArgGroup::new("hint").args(["rect", "seeds", "auto", "edit", "model", "recipe"]).required(true).multiple(true))]
pub(crate) struct MaskArguments {
    /// Session folders, videos, photographs, or folders of them; all use the same hints
    #[arg(value_name = "INPUT", required = true)]
    pub(crate) inputs: Vec<PathBuf>,

    /// A rectangle that contains the whole object, in pixels of the frame
    #[arg(long, value_name = "X,Y,W,H", allow_hyphen_values = true)]
    rect: Option<Rect>,

    /// An image of the frame's size: white is object, black is background, the rest is unknown
    #[arg(long, value_name = "PNG")]
    seeds: Option<PathBuf>,

    /// Find the object without hints: in a video by what stands still during the turn (--rect and --seeds may be
    /// added), in a photograph by its plain background (other hints count alone)
    #[arg(long)]
    auto: bool,

    /// An ONNX file of a segmentation network that finds the object, by --rect and --seeds if they are given; twice for
    /// an encoder and its decoder; needs the feature `networks`
    #[arg(long, value_name = "ONNX", conflicts_with_all = ["auto", "edit"])]
    model: Vec<PathBuf>,

    /// Draw hints in the browser, starting from the other hints
    #[arg(long)]
    pub(crate) edit: bool,

    /// The page's address and port; a port alone serves this machine only, 0 is any free port
    #[arg(
        long,
        value_name = "ADDRESS:PORT",
        default_value = "127.0.0.1:0",
        requires = "edit"
    )]
    pub(crate) listen: ListenAddress,

    /// The frame to mask, counted from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    frame: u64,

    /// The segmentation engine; opencv takes only --rect and --seeds
    #[arg(
        long,
        value_name = "NAME",
        default_value = "relit",
        conflicts_with = "edit"
    )]
    engine: MaskEngine,

    /// Keep every connected part, also those smaller than three tenths of the largest
    #[arg(long)]
    keep_all: bool,

    /// The mask's file, NAME.png, or a folder for masks named after their inputs [default: mask.png in the session
    /// folder, or here; NAME-mask.png for several clips or photographs]
    #[arg(short, long, value_name = "PNG|DIR", value_parser = output)]
    pub(crate) output: Option<MaskTarget>,

    /// Replace a mask that was changed by hand or is another input's; drop the old mask's strokes
    #[arg(long)]
    force: bool,

    /// Make the mask that this mask.json describes again, byte for byte
    #[arg(long, value_name = "JSON", conflicts_with_all =
        ["rect", "seeds", "auto", "model", "frame", "engine", "keep_all"])]
    recipe: Option<PathBuf>,
}

impl MaskArguments {
    /// The requested mask.
    ///
    /// # Errors
    /// If seeds, recipe or network cannot be read, or the engine is not built in.
    pub(crate) fn request(&self) -> Result<MaskRequest, MaskingError> {
        if let Some(path) = &self.recipe {
            let mut request = MaskRequest::from_recipe(path)?;
            request.force = self.force;
            return Ok(request);
        }
        let hints = Hints {
            rect: self.rect,
            seeds: self.seeds.as_deref().map(read_seeds).transpose()?,
            ..Hints::default()
        };
        let keep_all = self.keep_all;
        let mut request = MaskRequest::new(self.frame, hints, SegmentSettings { keep_all });
        if self.auto {
            request = request.by_turn();
        }
        request.force = self.force;
        request.inputs.extend(self.seeds.clone());
        request = request.with_engine(self.engine)?;
        if self.model.is_empty() {
            Ok(request)
        } else {
            request.with_network(&self.model)
        }
    }

    /// Refuses OpenCV's engine for a turn, networks of more than two files, and one name, or one page, for the masks of several recordings.
    ///
    /// # Errors
    /// A usage error, ready to be printed.
    pub(crate) fn check(&self, recordings: usize) -> Result<(), clap::Error> {
        let text = if self.auto && self.engine == MaskEngine::OpenCv {
            OPENCV_KNOWS_NO_TURN.to_owned()
        } else if self.model.len() > 2 {
            "--model takes a network in one file, or its encoder and its decoder".to_owned()
        } else if recordings <= 1 {
            return Ok(());
        } else if self.edit {
            format!("--edit shows one recording, but {recordings} are given: name one of them")
        } else if matches!(self.output, Some(MaskTarget::File(_))) {
            format!(
                "-o names one mask, but {recordings} recordings are given: name a folder, such as masks/, and each gets a mask of its name"
            )
        } else {
            return Ok(());
        };
        Err(CommandLine::command().error(ErrorKind::ArgumentConflict, text))
    }
}

fn output(text: &str) -> Result<MaskTarget, MaskingError> {
    MaskTarget::from_path(text.as_ref())
}
