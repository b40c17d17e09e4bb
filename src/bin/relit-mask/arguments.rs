//! The command line of relit-mask.

use std::path::PathBuf;

use clap::error::ErrorKind;
use clap::{ArgGroup, CommandFactory, Parser};
use relit::masking::{Error, MaskFiles, Request};
use relit_data::geometry::Rect;
use relit_mask::{Feather, Hints, Iterations, Seeds, Settings};

const EXAMPLES: &str = "\
Examples:
  relit-mask 20261120T093015Z-mug --rect 610,240,420,380
  relit-mask clip.mp4 --seeds seeds.png --frame 30 -o masks/mug.png
  relit-mask sessions/ --rect 610,240,420,380 --keep-all

Look at mask-preview.png afterwards. Exit codes: 0 all masks made, 1 none, 2 wrong usage, \
3 some recordings have no mask.";

/// Find the object on one frame of a recording: mask.png, mask.json and mask-preview.png.
#[derive(Debug, Parser)]
#[command(name = "relit-mask", version, after_help = EXAMPLES)]
#[command(group = ArgGroup::new("hint").args(["rect", "seeds", "recipe"]).required(true).multiple(true))]
pub(crate) struct Arguments {
    /// A session folder, a folder of sessions (each gets a mask by the same hints), or a video
    #[arg(value_name = "INPUT")]
    pub(crate) input: PathBuf,

    /// The object lies within this rectangle, all of it; in pixels of the frame
    #[arg(long, value_name = "X,Y,W,H", allow_hyphen_values = true)]
    rect: Option<Rect>,

    /// An image of the frame's size: white is object, black background, the rest unknown
    #[arg(long, value_name = "PNG")]
    seeds: Option<PathBuf>,

    /// The frame to make the mask on, from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    frame: u64,

    /// Rounds of GrabCut
    #[arg(long, value_name = "N", default_value = "5", value_parser = iterations)]
    iterations: Iterations,

    /// Keep every part that was found, not only the largest
    #[arg(long)]
    keep_all: bool,

    /// Make the edge soft, about so many pixels wide; 0 is hard
    #[arg(long, value_name = "PX", default_value = "0", value_parser = feather)]
    feather: Feather,

    /// The mask's name, ending in .png [default: mask.png in the session folder, or here]
    #[arg(short, long, value_name = "PNG", value_parser = output)]
    pub(crate) output: Option<MaskFiles>,

    /// Replace a mask that was painted or changed by hand
    #[arg(long)]
    force: bool,

    /// Make the mask again that this mask.json tells of, to the same bytes
    #[arg(long, value_name = "JSON", conflicts_with_all =
        ["rect", "seeds", "frame", "iterations", "keep_all", "feather"])]
    recipe: Option<PathBuf>,

    /// Say everything as JSON lines
    #[arg(long)]
    pub(crate) json: bool,
}

impl Arguments {
    /// What is asked for.
    ///
    /// # Errors
    /// Where seeds or recipe cannot be read.
    pub(crate) fn request(&self) -> Result<Request, Error> {
        let request = match &self.recipe {
            Some(path) => Request::from_recipe(path)?,
            None => {
                let seeds = self.seeds.as_deref().map(Seeds::read).transpose()?;
                let hints = Hints::from_parts(self.rect, seeds)?;
                Request::new(self.frame, hints, self.settings())
            }
        };
        Ok(request.with_force(self.force))
    }

    /// Refuses one name for the masks of several recordings.
    ///
    /// # Errors
    /// A usage error, ready to be printed.
    pub(crate) fn check_output(&self, recordings: usize) -> Result<(), clap::Error> {
        if self.output.is_none() || recordings == 1 {
            return Ok(());
        }
        let text = format!(
            "-o names one mask, but {} holds {recordings} recordings: leave it out, and each gets its mask.png",
            self.input.display()
        );
        Err(Self::command().error(ErrorKind::ArgumentConflict, text))
    }

    fn settings(&self) -> Settings {
        Settings {
            iterations: self.iterations,
            keep_all: self.keep_all,
            feather: self.feather,
        }
    }
}

fn iterations(text: &str) -> Result<Iterations, String> {
    let count = text.parse().map_err(|_| "not a whole number".to_owned())?;
    Iterations::new(count).map_err(|error| error.to_string())
}

fn feather(text: &str) -> Result<Feather, String> {
    let px = text.parse().map_err(|_| "not a whole number".to_owned())?;
    Feather::new(px).map_err(|error| error.to_string())
}

fn output(text: &str) -> Result<MaskFiles, Error> {
    MaskFiles::of(text.as_ref())
}
