//! From a recording and its mask to a training shard: select -> decode -> crop -> align ->
//! measure -> scale -> encode -> write, as one streaming pipeline whose memory does not grow with the video.
//!
//! [`extract`] extracts any number of recordings into one data set; a failure does not stop the
//! others. The steps can be used alone: [`square_around`]
//! makes the crop, [`Aligner`] measures how far the object moved, [`Scaler`] scales without mixing object and background.
//!
//! The crate knows the formats (`relit-data`) and videos (`relit-video`), and looks at a mask before it is
//! used (`relit-grabcut`); it knows nothing of how masks are made or of the rig. It prints nothing: progress
//! goes to an [`Observer`]. The program `relit-extract` around it is in `cli/`.
//!
//! # Extract a recording into a data set
//!
//! ```
//! use std::path::Path;
//!
//! use relit_data::shard::{Dataset, ImageSize, verify};
//! use relit_extract::{ExtractOptions, extract};
//!
//! let recording = Path::new("../../fixtures/20261120T102000Z-bust-short");
//! let out = tempfile::tempdir()?;
//! let options = ExtractOptions {
//!     frames: 24,
//!     size: ImageSize::Pixels(64),
//!     mask: Some(recording.join("mask_gt.png")),
//!     ..ExtractOptions::default()
//! };
//! // The observer `()` ignores the progress.
//! let summary = extract(&[recording.to_owned()], out.path(), &options, &())?;
//! assert_eq!((summary.extracted, summary.failed), (1, 0));
//!
//! let dataset = Dataset::read(out.path())?;
//! assert_eq!(dataset.sessions[0].samples, 24);
//! assert!(verify(out.path(), &|_done, _total| {})?.problems.is_empty());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod align;
mod batch;
mod blur;
mod crop;
mod crop_view;
mod dataset_index;
mod error;
mod interpolated_shifts;
mod job;
mod mask_warnings;
mod object;
pub mod objects;
mod observer;
mod options;
mod pipeline;
mod plan;
mod quality;
mod scale;
mod select;
mod stability;
mod timeline;

use std::path::{Path, PathBuf};

pub use align::{AlignBuffers, AlignSample, Aligner, Alignment};
pub use crop::{cut, square_around};
pub use crop_view::CropView;
pub use error::ExtractError;
pub use mask_warnings::mask_warnings;
pub use observer::{ExtractSummary, Observer, RecordingOutcome};
pub use options::{ExtractOptions, MAX_MARGIN, MAX_SHIFT, MAX_SIDE};
pub use scale::{APRON, ScaleBuffers, Scaler};

/// Extracts all recordings in `inputs` (session folders, folders of sessions or of videos, video files) into the
/// data set in the folder `out`, which is created if it does not exist. With the feature `object-store`, both may
/// be URLs: see [`objects`].
///
/// # Errors
/// [`ExtractError`] if nothing can be extracted: `out` holds a data set with other
/// settings, or it cannot be written. A failure with one input or recording is reported to `observer`
/// and counted.
pub fn extract(
    inputs: &[PathBuf],
    out: &Path,
    options: &ExtractOptions,
    observer: &dyn Observer,
) -> Result<ExtractSummary, ExtractError> {
    if let Some(mask) = options.mask.as_deref().filter(|mask| !mask.exists()) {
        return Err(object::missing_mask(mask));
    }
    if inputs.iter().any(|input| objects::is_url(input)) || objects::is_url(out) {
        return objects::extract(inputs, out, options, observer);
    }
    let mut summary = ExtractSummary::default();
    let found = batch::find(inputs, out, options, observer, &mut summary);
    batch::extract_recordings(&found, out, options, observer, &(), summary)
}
