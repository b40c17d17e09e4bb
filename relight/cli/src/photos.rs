//! Options for photographs and their files, shared by several verbs.

use std::path::{Path, PathBuf};

use clap::Args;
use relight_photo::decompose::{DecomposeError, DecomposeOptions, Decomposer, SpecularGate};
use relight_photo::files::{PhotoInput, PhotoList, PhotoReading, UnusedFile};
use relight_photo::nets::{NetError, Weights};
use relit_console::{Console, Outcome};
use relit_data::geometry::Rect;
use serde_json::json;

use crate::commands::CommandResult;
use crate::inputs::{TransferArgument, WeightsArgument};
use crate::shipped;
use crate::values::{GATES, one_of};

/// Photographs, and where their objects are.
#[derive(Args)]
pub(crate) struct PhotoArguments {
    /// Photographs (PNG, JPEG, WebP, TIFF, BMP, GIF, EXR, HDR), or folders of them.
    #[arg(required = true, value_name = "PHOTO")]
    pub(crate) photos: Vec<PathBuf>,
    /// A grey image of the photograph's size, white on the object; or a folder of them, PHOTO.png [default: the photograph's
    /// alpha, or all but its black background].
    #[arg(long, value_name = "FILE|DIR")]
    pub(crate) mask: Option<PathBuf>,
    /// A rectangle around the object, pixels: the object is cut out within it, as by relit-mask --rect; of a photograph with
    /// alpha, what alpha shows within it.
    #[arg(long, value_name = "X,Y,W,H", conflicts_with = "mask")]
    pub(crate) rect: Option<Rect>,
    #[command(flatten)]
    pub(crate) encoding: TransferArgument,
}

impl PhotoArguments {
    /// Whether one of the inputs is a folder.
    pub(crate) fn has_set(&self) -> bool {
        self.photos.iter().any(|path| path.is_dir())
    }

    /// Whether there may be several photographs.
    pub(crate) fn is_set(&self) -> bool {
        self.photos.len() > 1 || self.has_set()
    }

    /// The fault of the combination of arguments, if there is one.
    pub(crate) fn fault(&self) -> Option<String> {
        let mask = self.mask.as_ref().filter(|mask| !mask.is_dir())?;
        self.is_set().then(|| {
            let mask = mask.display();
            format!("--mask {mask} is one mask for several photographs: give a folder of masks")
        })
    }

    pub(crate) fn reading(&self) -> PhotoReading {
        PhotoReading {
            mask: self.mask.clone(),
            rectangle: self.rect,
            transfer: self.encoding.transfer,
        }
    }

    /// The photographs; names the files of folders that are not used.
    pub(crate) fn find(
        &self,
        output: &Path,
        console: Console,
    ) -> Result<PhotoList, DecomposeError> {
        let mut found = PhotoInput::find(&self.photos)?;
        found
            .unused
            .retain(|file| !is_at(&file.path, self.mask.as_deref(), output));
        name_unused(&found.unused, console);
        Ok(found)
    }
}

/// The outcome of a run with so many lost photographs.
pub(crate) fn outcome(found: &PhotoList, lost: usize, what: &str) -> CommandResult {
    match lost {
        0 if found.unused.is_empty() => Ok(Outcome::Success),
        _ if lost > 0 && lost == found.inputs.len() => {
            Err(format!("no photograph could be {what}").into())
        }
        _ => Ok(Outcome::Partial),
    }
}

/// Says that a photograph is lost, and why.
pub(crate) fn name_lost(input: &PhotoInput, message: &str, console: Console) {
    let place = input.place();
    // Most faults name the file themselves.
    let text = if message.starts_with(&place) {
        message.to_owned()
    } else {
        format!("{place}: {message}")
    };
    let event = json!({ "event": "failed", "photo": place, "message": message });
    console.warn_with(&text, &event);
}

/// Names what a person may want to know of a photograph.
pub(crate) fn name_notes(photo: &str, notes: &[String], console: Console) {
    for note in notes {
        console.warn(&format!("{photo}: {note}"));
    }
}

/// How photographs are decomposed.
#[derive(Args)]
pub(crate) struct NetworkArguments {
    #[command(flatten)]
    weights: WeightsArgument,
    /// Separate highlights.
    #[arg(long, default_value = "auto", value_parser = one_of(GATES))]
    specular: SpecularGate,
}

/// The network and how it is used.
pub(crate) struct Network {
    pub(crate) decomposer: Decomposer,
    pub(crate) options: DecomposeOptions,
}

impl NetworkArguments {
    pub(crate) fn read(&self) -> Result<Network, DecomposeError> {
        let (weights, _) = self.weights()?;
        Ok(Network {
            decomposer: Decomposer::new(&weights)?,
            options: self.options(),
        })
    }

    /// The weights, and how they are named.
    pub(crate) fn weights(&self) -> Result<(Weights, String), NetError> {
        self.weights.read_or(shipped::weights)
    }

    pub(crate) fn options(&self) -> DecomposeOptions {
        DecomposeOptions {
            specular: self.specular,
            ..DecomposeOptions::default()
        }
    }
}

/// Whether a path is that of the masks or of what is written.
fn is_at(path: &Path, masks: Option<&Path>, output: &Path) -> bool {
    let real = |path: &Path| path.canonicalize().ok();
    let known = masks.into_iter().chain([output]);
    known
        .filter_map(real)
        .any(|known| Some(known) == real(path))
}

/// Names the files of folders that are not used.
fn name_unused(unused: &[UnusedFile], console: Console) {
    for file in unused {
        let event = json!({ "event": "unused", "file": file.path, "message": file.message });
        console.warn_with(&file.message, &event);
    }
}

/// Refuses to overwrite a file that is read.
pub(crate) fn not_an_input(output: &Path, inputs: &[PathBuf]) -> Result<(), String> {
    let Ok(place) = output.canonicalize() else {
        // There is no such file yet.
        return Ok(());
    };
    let is_same = |input: &&PathBuf| input.canonicalize().is_ok_and(|input| input == place);
    inputs.iter().find(is_same).map_or(Ok(()), |_| {
        Err(format!(
            "{} is also an input: give the result another name",
            output.display()
        ))
    })
}
