//! The mask of a recording or a photograph: which of its pixels are the object.
//!
//! `NAME.png` is the mask, `NAME.json` its record, `NAME-preview.png` the image for checking it. An
//! existing mask is replaced only if its record has its hash, because then it can be made again, and only by one of the
//! same input. Strokes that were
//! painted for it are applied again, and `NAME-previous.json` keeps its record.
//!
//! [`make_mask`] makes a mask from hints that are known; [`edit`] lets a person draw them in a browser, [`MaskEditor`] within another server;
//! [`check_mask`] compares a mask with what the turn shows.
//!
//! This crate brings frames and folders to [`relit_grabcut`], and is the program `relit-mask` (in `cli/`).
//! It knows nothing of data sets and the rig.
//!
//! With the feature `networks`, which is off by default, a segmentation network from an ONNX file can find the object
//! ([`MaskRequest::with_network`]).
//!
//! With the feature `opencv`, which is off by default, OpenCV's GrabCut can cut a mask as well: a reference
//! ([`MaskEngine::OpenCv`]).
//!
//! # Mask the object of a recording
//!
//! ```
//! use std::path::Path;
//!
//! use relit_data::geometry::Rect;
//! use relit_grabcut::{Hints, SegmentSettings};
//! use relit_mask::{MaskFiles, MaskRequest, make_mask};
//!
//! let recording = Path::new("../../fixtures/20261120T102000Z-bust-short");
//! let folder = tempfile::tempdir()?;
//! let files = MaskFiles::from_mask_path(&folder.path().join("mask.png"))?;
//!
//! // On the first frame, by a rectangle that contains the object.
//! let hints = Hints::from(Rect::new(170, 20, 325, 390));
//! let request = MaskRequest::new(0, hints, SegmentSettings::default());
//! let mask = make_mask(recording, Some(files), &request)?;
//!
//! assert!(mask.files.mask.is_file() && mask.files.preview.is_file());
//! println!("{} pixels, {:?}", mask.record.result.statistics.area_px, mask.record.warnings);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod against_turn;
mod earlier;
mod editor;
mod engine;
mod error;
mod files;
mod inputs;
mod making;
mod network;
#[cfg(feature = "opencv")]
mod opencv_grab_cut;
mod record;
mod request;
mod sampling;

pub use against_turn::{CheckOutput, MaskReport, MaskVerdict, check_mask};
pub use editor::{MaskEditor, edit};
pub use engine::{MaskEngine, OPENCV_KNOWS_NO_TURN};
pub use error::MaskingError;
pub use files::MaskFiles;
pub use inputs::{MaskInputs, MaskTarget};
pub use making::{MaskOutput, make_mask};
pub use network::{NetworkFile, RecordedNetwork};
pub use record::{
    MASK_SCHEMA, MaskRecord, MaskSoftware, RecordedHints, RecordedResult, SourceFrame,
};
pub use request::{MaskRequest, read_seeds};
