//! What mask is wanted.

use std::fs;
use std::path::{Path, PathBuf};

use relit_grabcut::{Drawing, SegmentSettings};

use super::{MaskEngine, MaskRecord, MaskingError, RecordFault};

/// How to make a mask.
#[derive(Debug, Clone)]
pub struct MaskRequest {
    pub(super) frame: u64,
    pub(super) drawing: Drawing,
    pub(super) turn: TurnRequest,
    pub(super) engine: MaskEngine,
    pub(super) settings: SegmentSettings,
    pub(super) recipe: Option<Recipe>,
    pub(super) force: bool,
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
    pub(super) fn of(record: &MaskRecord) -> Self {
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
    /// A mask on frame number `frame`, 0-based, with these hints.
    #[must_use]
    pub fn new(frame: u64, drawing: impl Into<Drawing>, settings: SegmentSettings) -> Self {
        Self {
            frame,
            drawing: drawing.into(),
            turn: TurnRequest::None,
            engine: MaskEngine::default(),
            settings,
            recipe: None,
            force: false,
        }
    }

    /// A mask by what the whole video tells, on frame number `frame`; the hints may be empty.
    #[must_use]
    pub fn auto(frame: u64, drawing: impl Into<Drawing>, settings: SegmentSettings) -> Self {
        Self {
            frame,
            drawing: drawing.into(),
            turn: TurnRequest::Sampled,
            engine: MaskEngine::default(),
            settings,
            recipe: None,
            force: false,
        }
    }

    /// The mask that the record `path` describes, to the same bytes.
    ///
    /// # Errors
    /// [`MaskingError::Io`] or [`MaskingError::Recipe`]; those of [`Self::with_engine`].
    pub fn from_recipe(path: &Path) -> Result<Self, MaskingError> {
        let wrong = |fault: RecordFault| MaskingError::Recipe {
            path: path.to_owned(),
            why: fault.to_string(),
        };
        let bytes = fs::read(path).map_err(MaskingError::io(path, "read"))?;
        let record = MaskRecord::from_json(&bytes).map_err(wrong)?;
        let drawing = record.hints.drawing().map_err(wrong)?;
        let path = path.to_owned();
        let engine = record.engine;
        let request = Self {
            frame: record.source.frame,
            drawing,
            turn: TurnRequest::of(&record),
            engine: MaskEngine::default(),
            settings: record.settings,
            recipe: Some(Recipe { path, record }),
            force: false,
        };
        request.with_engine(engine)
    }

    /// Lets this engine cut the object out. [`edit`](super::edit) cuts by relit's nevertheless.
    ///
    /// # Errors
    /// [`MaskingError::WithoutOpenCv`], [`MaskingError::OpenCvKnowsNoTurn`].
    pub fn with_engine(self, engine: MaskEngine) -> Result<Self, MaskingError> {
        engine.check(self.turn != TurnRequest::None)?;
        Ok(Self { engine, ..self })
    }

    /// With `force`, replaces a mask that differs from its record, and accepts another result of a
    /// recipe.
    #[must_use]
    pub fn with_force(self, force: bool) -> Self {
        Self { force, ..self }
    }
}
