//! What the editor works on: one recording, and what was read of it last.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use image::codecs::jpeg::JpegEncoder;
use image::{ImageError, RgbImage, imageops};
use relit_data::geometry::Rect;
use relit_data::session::Recording;
use relit_grabcut::{Drawing, Effort, MIN_TURN_FRAMES, Mask, Seeds, Strokes};
use relit_video::Video;
use serde::{Deserialize, Serialize};

use super::super::files::{check_replaceable, make_folder};
use super::super::making::{cut, write_files};
use super::super::request::TurnRequest;
use super::super::sampling::{SampledTurn, read_frame, read_turn};
use super::super::{MaskFiles, MaskRecord, MaskRequest, MaskingError, SourceFrame};

/// JPEG quality of the frames that are shown, 1 to 100.
const QUALITY: u8 = 88;

/// Everything that was drawn.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Sketch {
    /// The frame on which the mask is made.
    frame: u64,
    /// Whether the turn is looked at.
    auto: bool,
    rect: Option<Rect>,
    strokes: Strokes,
}

/// What the page has to know at its start.
#[derive(Debug, Serialize)]
pub(super) struct Description {
    recording: String,
    width: u32,
    height: u32,
    frames: usize,
    /// Whether there are enough frames to look at the turn.
    turn: bool,
    /// Whether painted seeds apply besides what is drawn.
    seeds: bool,
    /// The mask's file.
    output: String,
    sketch: Sketch,
}

/// A frame of the recording.
#[derive(Debug)]
struct Frame {
    picture: RgbImage,
    source: SourceFrame,
}

/// A recording on which a mask is drawn.
#[derive(Debug)]
pub(super) struct EditorSession {
    recording: String,
    video: Video,
    files: MaskFiles,
    request: MaskRequest,
    seeds: Option<Seeds>,
    frame: Mutex<Option<Arc<Frame>>>,
    turn: Mutex<Option<Arc<SampledTurn>>>,
}

impl EditorSession {
    pub(super) fn new(
        recording: &Recording,
        video: Video,
        files: MaskFiles,
        request: MaskRequest,
    ) -> Result<Self, MaskingError> {
        let session = Self {
            recording: recording.id.clone(),
            video,
            files,
            seeds: request.drawing.seeds.clone(),
            request,
            frame: Mutex::default(),
            turn: Mutex::default(),
        };
        session.frame(session.request.frame)?;
        Ok(session)
    }

    pub(super) fn description(&self) -> Description {
        let facts = self.video.facts();
        let frames = self.video.frames().len();
        Description {
            recording: self.recording.clone(),
            width: facts.width,
            height: facts.height,
            frames,
            turn: frames >= MIN_TURN_FRAMES,
            seeds: self.seeds.is_some(),
            output: self.files.mask.display().to_string(),
            sketch: Sketch {
                frame: self.request.frame,
                auto: self.request.turn != TurnRequest::None,
                rect: self.request.drawing.rect,
                strokes: self.request.drawing.strokes.clone(),
            },
        }
    }

    /// A frame as JPEG, scaled to `width` where it is wider.
    pub(super) fn jpeg(&self, number: u64, width: u32) -> Result<Vec<u8>, MaskingError> {
        let kept = self.kept_frame(number);
        let decoded = match &kept {
            Some(_) => None,
            None => Some(self.video.frame(number)?),
        };
        let picture = kept
            .as_ref()
            .map(|frame| &frame.picture)
            .or(decoded.as_ref());
        let encoded = picture.map(|picture| encode(picture, width)).transpose();
        let encoded = encoded.map_err(|source| relit_grabcut::MaskError::Encode {
            what: "the frame",
            source,
        })?;
        Ok(encoded.unwrap_or_default())
    }

    /// The mask of a sketch.
    pub(super) fn cut(&self, sketch: Sketch, effort: Effort) -> Result<Mask, MaskingError> {
        let frame = self.frame(sketch.frame)?;
        let turn = self.turn(&sketch)?;
        cut(
            &frame.picture,
            turn.as_deref(),
            &self.request_of(sketch),
            effort,
        )
    }

    /// Makes the mask of a sketch and writes its files.
    pub(super) fn write(&self, sketch: Sketch) -> Result<MaskRecord, MaskingError> {
        let frame = self.frame(sketch.frame)?;
        let turn = self.turn(&sketch)?;
        let request = self.request_of(sketch);
        let mask = cut(&frame.picture, turn.as_deref(), &request, Effort::Fine)?;
        let _made = make_folder(&self.files)?;
        // Somebody may have painted one meanwhile.
        check_replaceable(&self.files, request.force, request.settings.alpha)?;
        let source = frame.source.clone();
        let turn = turn.as_deref();
        write_files(&frame.picture, source, turn, &mask, &self.files, &request)
    }

    /// Whether a draft of the mask is the mask itself.
    pub(super) fn is_small(&self) -> bool {
        let facts = self.video.facts();
        Effort::Draft.covers(facts.width, facts.height)
    }

    fn request_of(&self, sketch: Sketch) -> MaskRequest {
        let drawing = Drawing {
            rect: sketch.rect,
            seeds: self.seeds.clone(),
            strokes: sketch.strokes,
        };
        let settings = self.request.settings;
        let request = match sketch.auto {
            true => MaskRequest::auto(sketch.frame, drawing, settings),
            false => MaskRequest::new(sketch.frame, drawing, settings),
        };
        request.with_force(self.request.force)
    }

    fn frame(&self, number: u64) -> Result<Arc<Frame>, MaskingError> {
        if let Some(frame) = self.kept_frame(number) {
            return Ok(frame);
        }
        let (picture, source) = read_frame(&self.video, number)?;
        let frame = Arc::new(Frame { picture, source });
        *lock(&self.frame) = Some(frame.clone());
        Ok(frame)
    }

    fn kept_frame(&self, number: u64) -> Option<Arc<Frame>> {
        let kept = lock(&self.frame).clone();
        kept.filter(|frame| frame.source.frame == number)
    }

    /// What the turn shows, if the sketch wants it; read once.
    fn turn(&self, sketch: &Sketch) -> Result<Option<Arc<SampledTurn>>, MaskingError> {
        if !sketch.auto {
            return Ok(None);
        }
        let mut turn = lock(&self.turn);
        if turn.is_none() {
            let wanted = match &self.request.turn {
                TurnRequest::None => &TurnRequest::Sampled,
                wanted => wanted,
            };
            let facts = self.video.facts();
            *turn = read_turn(&self.video, (facts.width, facts.height), wanted)?.map(Arc::new);
        }
        Ok(turn.clone())
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn encode(picture: &RgbImage, width: u32) -> Result<Vec<u8>, ImageError> {
    let scaled = (picture.width() > width).then(|| {
        let ratio = f64::from(width) / f64::from(picture.width());
        let height = (f64::from(picture.height()) * ratio).round().max(1.0);
        imageops::thumbnail(picture, width, height as u32)
    });
    let mut jpeg = Vec::new();
    JpegEncoder::new_with_quality(&mut jpeg, QUALITY)
        .encode_image(scaled.as_ref().unwrap_or(picture))?;
    Ok(jpeg)
}
