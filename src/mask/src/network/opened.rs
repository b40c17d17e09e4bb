//! A network that is ready to be asked about frames.

use std::fs;
use std::path::{Path, PathBuf};

use image::RgbImage;
use relit_data::geometry::Rect;
use relit_grabcut::{Hints, check_hints};

use super::answer::SoftMap;
use super::engine::{Feed, File, Plan};
use super::kind::{DecoderInput, Kind, Signature};
use super::marks::PlacedMap;
use super::picture::{PictureForm, Placement, part_around};
use super::prompt::Prompt;
use super::{NetworkFile, RecordedNetwork};
use crate::MaskingError;

/// Larger files are refused, bytes: no protobuf message may be longer.
const MAX_FILE: u64 = i32::MAX as u64;
/// Sides of the earlier mask that a decoder takes, where its file leaves them open.
const EARLIER_MASK: usize = 256;

/// A network, asked with the hints with which it was opened.
#[derive(Debug)]
pub(crate) struct Network {
    path: PathBuf,
    form: PictureForm,
    steps: Steps,
    rect: Option<Rect>,
    files: Vec<NetworkFile>,
}

/// What is run one after the other.
#[derive(Debug)]
enum Steps {
    Salient(Plan),
    Prompted(Prompted),
    Pair(Plan, Prompted),
}

/// What takes a prompt.
#[derive(Debug)]
struct Prompted {
    plan: Plan,
    prompt: Prompt,
    /// For each value that is asked for, what it is; `None` for the picture.
    asked: Vec<Option<DecoderInput>>,
}

impl Network {
    /// Reads a network from its file, or from its encoder's and its decoder's, and makes it ready for these hints.
    ///
    /// # Errors
    /// [`MaskingError::Io`], [`MaskingError::Unusable`]; [`MaskingError::Refused`] if it needs hints and there are none.
    pub(crate) fn open(paths: &[PathBuf], hints: &Hints) -> Result<Self, MaskingError> {
        let Some(first) = paths.first() else {
            return Err(MaskingError::Refused(
                "a network needs at least one file".to_owned(),
            ));
        };
        let (mut files, mut read) = (Vec::new(), Vec::new());
        for path in paths {
            files.push(hashed(path, path)?);
            let file = File::read(path).map_err(unusable(path))?;
            for weights in &file.weights {
                files.push(hashed(path, &path.with_file_name(weights))?);
            }
            read.push(file);
        }
        let signatures: Vec<Signature> = read.iter().map(|file| file.signature.clone()).collect();
        let kind = Kind::of(&signatures).map_err(|(at, why)| unusable(&paths[at])(why))?;
        let prompt = || {
            Prompt::from_hints(hints).ok_or_else(|| {
                MaskingError::Refused(format!(
                    "{} needs a hint which object is meant: give --rect, or --seeds with some of the object painted white",
                    first.display()
                ))
            })
        };
        let (at, form, steps) = match kind {
            Kind::Salient(form) => {
                let plan = Plan::new(&read[0], vec![Feed::Asked(form.shape())], &[0]);
                (0, form, plan.map(Steps::Salient))
            }
            Kind::Prompted(form) => {
                let prompted = Prompted::new(&read[0], prompt()?, &form, None);
                (0, form, prompted.map(Steps::Prompted))
            }
            Kind::Pair { form, decoder: at } => {
                let prompt = prompt()?.filled_up();
                (at, form, pair(&read[1 - at], &read[at], prompt, &form))
            }
        };
        Ok(Self {
            path: paths[at].clone(),
            form,
            steps: steps.map_err(unusable(&paths[at]))?,
            rect: hints.rect,
            files,
        })
    }

    /// The marks of the object in a frame, by which it is cut out: those of the network, and where there are some, the
    /// given ones.
    ///
    /// # Errors
    /// [`MaskingError::NothingFound`], [`MaskingError::Unusable`], or [`MaskingError::Mask`] if the hints do not fit.
    pub(crate) fn marks(&self, frame: &RgbImage, hints: &Hints) -> Result<Hints, MaskingError> {
        let size = frame.dimensions();
        let seeds = hints.seeds.as_ref();
        if let Some(rect) = hints.rect {
            check_hints(&rect.into(), size)?;
        }
        if seeds.is_some_and(|seeds| seeds.size() != size) {
            check_hints(hints, size)?;
        }
        let part = match &self.steps {
            Steps::Salient(_) => part_around(hints.rect, size),
            _ => part_around(None, size),
        };
        let (picture, placement) = self.form.values(frame, part);
        let map = self.map(picture, &placement);
        let placed = PlacedMap {
            map: &map.map_err(unusable(&self.path))?,
            placement,
            covers: self.form.covered(),
            part,
        };
        let marks = placed.marks(size, hints.rect, seeds)?;
        let marks = marks.ok_or_else(|| MaskingError::NothingFound(self.path.clone()))?;
        Ok(Hints {
            rect: None,
            seeds: Some(marks),
            strokes: hints.strokes.clone(),
        })
    }

    /// What a record says of it.
    pub(crate) fn recorded(&self) -> RecordedNetwork {
        RecordedNetwork {
            files: self.files.clone(),
            rect: self.rect,
        }
    }

    fn map(&self, picture: Vec<f32>, placement: &Placement) -> Result<SoftMap, String> {
        let covers = self.form.covered();
        match &self.steps {
            Steps::Salient(plan) => match plan.run(&[picture])?.first() {
                Some(answer) => answer.map(covers),
                None => Err("it answers nothing".to_owned()),
            },
            Steps::Prompted(prompted) => prompted.map(picture, placement, covers),
            Steps::Pair(encoder, decoder) => {
                let mut embeddings = encoder.run(&[picture])?.into_iter();
                let embeddings = embeddings.next().map(|answer| answer.values);
                decoder.map(embeddings.unwrap_or_default(), placement, covers)
            }
        }
    }
}

/// Makes an encoder and a decoder ready, whose embeddings have the shape that the encoder answers to an empty picture.
fn pair(
    encoder: &File,
    decoder: &File,
    prompt: Prompt,
    form: &PictureForm,
) -> Result<Steps, String> {
    let shape = form.shape();
    let plan = Plan::new(encoder, vec![Feed::Asked(shape.clone())], &[0])?;
    let empty = plan.run(&[vec![0.0; shape.iter().product()]])?;
    let embeddings = empty.first().map(|answer| answer.shape.as_slice());
    let prompted = Prompted::new(decoder, prompt, form, embeddings)?;
    Ok(Steps::Pair(plan, prompted))
}

impl Prompted {
    fn new(
        file: &File,
        prompt: Prompt,
        form: &PictureForm,
        embeddings: Option<&[usize]>,
    ) -> Result<Self, String> {
        let (mut feeds, mut asked) = (Vec::new(), Vec::new());
        for input in &file.signature.inputs {
            let kind = DecoderInput::named(&input.name);
            let points = prompt.labels.len();
            let of_points = |last: &[usize]| {
                let ones = input.sides.len().saturating_sub(1 + last.len());
                [&vec![1; ones][..], &[points], last].concat()
            };
            feeds.push(match kind {
                None => Feed::Asked(form.shape()),
                Some(DecoderInput::Embeddings) => {
                    Feed::Asked(embeddings.unwrap_or_default().to_vec())
                }
                Some(DecoderInput::Points) => Feed::Asked(of_points(&[2])),
                Some(DecoderInput::Labels) => Feed::Fixed(of_points(&[]), prompt.labels.clone()),
                Some(DecoderInput::EarlierMask) => {
                    let side = |at: usize| input.sides.get(at).copied().flatten();
                    let sides = [2, 3].map(|at| side(at).unwrap_or(EARLIER_MASK));
                    let shape = vec![1, 1, sides[0], sides[1]];
                    Feed::Fixed(shape, vec![0.0; sides[0].saturating_mul(sides[1])])
                }
                Some(DecoderInput::HasEarlierMask) => Feed::Fixed(vec![1], vec![0.0]),
                Some(DecoderInput::Size) => {
                    let (width, height) = form.covered();
                    Feed::Fixed(vec![2], vec![height as f32, width as f32])
                }
            });
            if matches!(feeds.last(), Some(Feed::Asked(_))) {
                asked.push(kind);
            }
        }
        let outputs = &file.signature.outputs;
        let named = |part: &str| outputs.iter().position(|name| name.contains(part));
        // The full-size masks of a decoder are its small ones enlarged.
        let masks = named("low_res_masks")
            .or_else(|| named("mask"))
            .unwrap_or(0);
        let wanted: Vec<usize> = [Some(masks), named("iou")].into_iter().flatten().collect();
        let plan = Plan::new(file, feeds, &wanted)?;
        Ok(Self {
            plan,
            prompt,
            asked,
        })
    }

    /// The best mask; `seen` is the picture, or what the encoder answered to it.
    fn map(
        &self,
        seen: Vec<f32>,
        placement: &Placement,
        covers: (usize, usize),
    ) -> Result<SoftMap, String> {
        let value = |kind: &Option<DecoderInput>| match kind {
            Some(DecoderInput::Points) => self.prompt.placed(placement, covers),
            _ => seen.clone(),
        };
        let asked: Vec<Vec<f32>> = self.asked.iter().map(value).collect();
        match self.plan.run(&asked)?.as_slice() {
            [masks, scores @ ..] => masks.best_mask(scores.first(), &self.prompt, covers),
            [] => Err("it answers nothing".to_owned()),
        }
    }
}

/// The name and the hash of a file of a network, which `network` names.
fn hashed(network: &Path, path: &Path) -> Result<NetworkFile, MaskingError> {
    let read = MaskingError::io;
    let metadata = fs::metadata(path).map_err(read(path, "read"))?;
    if !metadata.is_file() || metadata.len() > MAX_FILE {
        let why = if metadata.is_file() {
            format!("{} bytes are too many", metadata.len())
        } else {
            format!("{} is not a file", path.display())
        };
        return Err(unusable(network)(why));
    }
    let mut hasher = blake3::Hasher::new();
    let file = fs::File::open(path).map_err(read(path, "read"))?;
    hasher.update_reader(file).map_err(read(path, "read"))?;
    let name = path.file_name().unwrap_or_default();
    Ok(NetworkFile {
        name: name.to_string_lossy().into_owned(),
        blake3: hasher.finalize().to_hex().to_string(),
    })
}

fn unusable(path: &Path) -> impl Fn(String) -> MaskingError + use<> {
    let path = path.to_owned();
    move |why| MaskingError::unusable("network", &path, &why)
}
