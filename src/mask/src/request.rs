//! What mask is wanted.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use relit_grabcut::{Hints, Seeds, SegmentSettings};

use super::network::Network;
use super::{MaskEngine, MaskRecord, MaskingError, RecordedNetwork};

/// How to make a mask.
#[derive(Debug, Clone)]
pub struct MaskRequest {
    /// The number of the frame on which it is made, 0-based.
    pub frame: u64,
    /// Where the object is; may be empty where the turn is looked at.
    pub hints: Hints,
    pub(super) turn: TurnRequest,
    pub(super) engine: MaskEngine,
    /// The network that is asked where the object is.
    pub(super) network: Option<Arc<Network>>,
    /// The one by which the hints were found already.
    pub(super) found_by: Option<RecordedNetwork>,
    /// The settings.
    pub settings: SegmentSettings,
    pub(super) recipe: Option<Recipe>,
    /// Replaces a mask that differs from its record, and accepts another result of a recipe.
    pub force: bool,
    /// Files that are not overwritten, even by force: other recordings, and those that hints were read from.
    pub inputs: Vec<PathBuf>,
}

/// Which frames of the turn are looked at.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum TurnRequest {
    /// None but the one on which the mask is made.
    None,
    /// Some, spread over the video.
    Sampled,
    /// These.
    Frames(Vec<u64>),
}

impl TurnRequest {
    /// The frames by which a recorded mask was made.
    pub(super) fn from_record(record: &MaskRecord) -> Self {
        match record.hints.turn_frames.as_slice() {
            [] => Self::None,
            frames => Self::Frames(frames.to_vec()),
        }
    }
}

/// A record whose mask has to be reproduced byte for byte.
#[derive(Debug, Clone)]
pub(super) struct Recipe {
    pub(super) path: PathBuf,
    pub(super) record: MaskRecord,
}

impl MaskRequest {
    /// A mask on frame number `frame` by these hints.
    #[must_use]
    pub fn new(frame: u64, hints: impl Into<Hints>, settings: SegmentSettings) -> Self {
        Self {
            frame,
            hints: hints.into(),
            turn: TurnRequest::None,
            engine: MaskEngine::default(),
            network: None,
            found_by: None,
            settings,
            recipe: None,
            force: false,
            inputs: Vec::new(),
        }
    }

    /// The same by what the whole video shows, too; without other hints, of a photograph by its plain background.
    #[must_use]
    pub fn by_turn(self) -> Self {
        Self {
            turn: TurnRequest::Sampled,
            ..self
        }
    }

    /// What is not overwritten when a mask of `recording` is made.
    pub(super) fn all_inputs<'a>(&'a self, recording: &'a Path) -> impl Iterator<Item = &'a Path> {
        self.inputs.iter().map(PathBuf::as_path).chain([recording])
    }

    /// Whether the object is to be found without a hint where it is; strokes correct what is found.
    pub(super) fn is_unhinted(&self) -> bool {
        let Hints { rect, seeds, .. } = &self.hints;
        self.turn == TurnRequest::Sampled && rect.is_none() && seeds.is_none()
    }

    /// The mask that the record `path` describes, to the same bytes.
    ///
    /// # Errors
    /// [`MaskingError::Io`] or [`MaskingError::Unusable`]; those of [`Self::with_engine`].
    pub fn from_recipe(path: &Path) -> Result<Self, MaskingError> {
        let bytes = fs::read(path).map_err(MaskingError::io(path, "read"))?;
        let read = MaskRecord::from_json(&bytes).and_then(|record| {
            let hints = record.hints.hints()?;
            Ok((record, hints))
        });
        let (record, hints) =
            read.map_err(|fault| MaskingError::unusable("recipe", path, &fault))?;
        let engine = record.engine;
        let request = Self {
            turn: TurnRequest::from_record(&record),
            recipe: Some(Recipe {
                path: path.to_owned(),
                record: record.clone(),
            }),
            found_by: record.network,
            ..Self::new(record.source.frame, hints, record.settings)
        };
        request.with_engine(engine)
    }

    /// Lets a segmentation network find the object by the hints of this request: `files` are its ONNX file, or its
    /// encoder and its decoder. Its answer becomes hints for the cut. [`edit`](super::edit) does not ask it.
    ///
    /// # Errors
    /// [`MaskingError::Io`] or [`MaskingError::Unusable`] if it cannot be used; [`MaskingError::Refused`] if it needs
    /// hints and there are none, or networks are not built in.
    pub fn with_network(self, files: &[PathBuf]) -> Result<Self, MaskingError> {
        let network = Some(Arc::new(Network::open(files, &self.hints)?));
        Ok(Self { network, ..self })
    }

    /// Lets this engine cut the object out. [`edit`](super::edit) cuts by relit's nevertheless.
    ///
    /// # Errors
    /// [`MaskingError::Refused`] if it is not built in, or knows no turn.
    pub fn with_engine(self, engine: MaskEngine) -> Result<Self, MaskingError> {
        engine.check(self.turn != TurnRequest::None)?;
        Ok(Self { engine, ..self })
    }
}

/// Reads seeds from a PNG file of any colour type and depth.
///
/// # Errors
/// [`MaskingError::Io`] or [`MaskingError::Unusable`].
pub fn read_seeds(path: &Path) -> Result<Seeds, MaskingError> {
    let bytes = fs::read(path).map_err(MaskingError::io(path, "read"))?;
    Seeds::from_png(&bytes).map_err(|fault| MaskingError::unusable("seeds", path, &fault))
}
