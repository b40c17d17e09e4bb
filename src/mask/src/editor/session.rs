//! What the editor works on: one recording, and what was read of it last.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use image::codecs::jpeg::JpegEncoder;
use image::{ImageError, RgbImage, imageops};
use relit_data::geometry::Rect;
use relit_data::session::Recording;
use relit_grabcut::{Effort, Hints, MIN_TURN_FRAMES, Mask, Strokes};
use relit_video::Video;
use serde::Deserialize;
use serde_json::{Value, json};

use super::super::files::{check_replaceable, make_folder};
use super::super::making::{cut, write_files};
use super::super::request::TurnRequest;
use super::super::sampling::{SampledTurn, is_photograph, read_frame, read_turn};
use super::super::{MaskFiles, MaskRecord, MaskRequest, MaskingError, SourceFrame};

/// JPEG quality of the frames that are shown, 1 to 100.
const QUALITY: u8 = 88;

/// Everything that was drawn.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Sketch {
    /// The frame on which the mask is made.
    frame: u64,
    /// Whether the turn is looked at.
    auto: bool,
    rect: Option<Rect>,
    strokes: Strokes,
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
            request,
            frame: Mutex::default(),
            turn: Mutex::default(),
        };
        session.frame(session.request.frame)?;
        Ok(session)
    }

    /// The name of the recording.
    pub(super) fn recording(&self) -> &str {
        &self.recording
    }

    /// What the page has to know at its start.
    pub(super) fn description(&self) -> Value {
        let facts = self.video.facts();
        let frames = self.video.frames().len();
        let MaskRequest {
            frame, hints, turn, ..
        } = &self.request;
        json!({
            "recording": self.recording,
            "width": facts.width,
            "height": facts.height,
            "frames": frames,
            // What shows the object without a hint: enough frames of a turn, or a photograph's plain background.
            "auto": if frames >= MIN_TURN_FRAMES {
                Some("turn")
            } else {
                is_photograph(&self.video).then_some("background")
            },
            // Whether painted seeds apply besides what is drawn.
            "seeds": hints.seeds.is_some(),
            "output": self.files.mask.display().to_string(),
            "sketch": {
                "frame": frame,
                "auto": *turn != TurnRequest::None,
                "rect": hints.rect,
                "strokes": hints.strokes,
            },
        })
    }

    /// A frame as JPEG, scaled to `width` where it is wider.
    pub(super) fn jpeg(&self, number: u64, width: u32) -> Result<Vec<u8>, MaskingError> {
        let encoded = match self.kept_frame(number) {
            Some(frame) => encode(&frame.picture, width),
            None => encode(&self.video.frame(number)?, width),
        };
        let what = "the frame";
        Ok(encoded.map_err(|source| relit_grabcut::MaskError::Encode { what, source })?)
    }

    /// The mask of a sketch.
    pub(super) fn cut(&self, sketch: Sketch, effort: Effort) -> Result<Mask, MaskingError> {
        let frame = self.frame(sketch.frame)?;
        let turn = self.turn(&sketch)?;
        let request = self.request_of(sketch);
        let (mask, _) = cut(&frame.picture, turn.as_deref(), &request, effort)?;
        Ok(mask)
    }

    /// Makes the mask of a sketch and writes its files, unless the editor is over by then.
    pub(super) fn write(
        &self,
        sketch: Sketch,
        is_over: impl Fn() -> bool,
    ) -> Result<MaskRecord, MaskingError> {
        let frame = self.frame(sketch.frame)?;
        let turn = self.turn(&sketch)?;
        let request = self.request_of(sketch);
        let (mask, request) = cut(&frame.picture, turn.as_deref(), &request, Effort::Fine)?;
        if is_over() {
            let why = "the editor was closed: no mask is written";
            return Err(MaskingError::Refused(why.to_owned()));
        }
        let _made = make_folder(&self.files)?;
        // Somebody may have painted one meanwhile.
        let inputs = self.request.all_inputs(self.video.path());
        check_replaceable(&self.files, inputs, request.force)?;
        let source = frame.source.clone();
        let turn = turn.as_deref();
        write_files(&frame.picture, source, turn, &mask, &self.files, &request)
    }

    /// Whether a draft of the mask is the mask itself.
    pub(super) fn is_small(&self) -> bool {
        let facts = self.video.facts();
        Effort::Draft.covers(facts.width as usize * facts.height as usize)
    }

    fn request_of(&self, sketch: Sketch) -> MaskRequest {
        let hints = Hints {
            rect: sketch.rect,
            seeds: self.request.hints.seeds.clone(),
            strokes: sketch.strokes,
        };
        let mut request = MaskRequest::new(sketch.frame, hints, self.request.settings);
        if sketch.auto {
            request = request.by_turn();
        }
        request.force = self.request.force;
        request.found_by = self.request.found_by.clone();
        request
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
