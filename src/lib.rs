//! relit: from one turn of a relighting turntable to 1500 masked frames in training shards.
//!
//! The toolkit is a workspace of crates. Each knows those below it in this table and none above:
//!
//! | crate | folder | purpose | native libraries |
//! | --- | --- | --- | --- |
//! | `relit` (this one) | `src/` | extraction, and the programs | |
//! | [`relit_rig`] | `src/rig/` | camera, turntable, simulator, capture, HTTP service | |
//! | [`relit_web`] | `src/web/` | what the programs' pages share: tokens, who gets in, limits | |
//! | [`relit_mask`] | `src/mask/` | GrabCut on an image | OpenCV |
//! | [`relit_video`] | `src/video/` | decoding and muxing | FFmpeg |
//! | [`relit_console`] | `src/console/` | the output of the programs: text, JSON lines, progress, exit codes | |
//! | [`relit_data`] | `src/data/` | sessions, data sets, reports on disk | none |
//!
//! The modules of this crate bring them together:
//!
//! | module | purpose |
//! | --- | --- |
//! | [`extract`] | recordings and masks to data sets, as one streaming pipeline |
//! | [`masking`] | the mask of a recording: a frame of its video, three files |
//!
//! The programs `relit-capture`, `relit-mask` and `relit-extract` in `src/bin/` parse arguments, call
//! the library and report. The downstream crate `relight` trains on the data sets and depends on
//! `relit-data` only.
//!
//! # Mask the object of a recording
//!
//! ```
//! use std::path::Path;
//!
//! use relit::masking::{MaskFiles, MaskRequest, make_mask};
//! use relit_data::geometry::Rect;
//! use relit_mask::{Hints, SegmentSettings};
//!
//! let recording = Path::new("fixtures/20261120T102000Z-bust-short");
//! let folder = tempfile::tempdir()?;
//! let files = MaskFiles::of(&folder.path().join("mask.png"))?;
//!
//! // On the first frame, by a rectangle that contains the object.
//! let hints = Hints::Rect(Rect::new(170, 20, 325, 390));
//! let request = MaskRequest::new(0, hints, SegmentSettings::default());
//! let mask = make_mask(recording, Some(files), &request)?;
//!
//! assert!(mask.files.mask.is_file() && mask.files.preview.is_file());
//! println!("{} pixels, {:?}", mask.record.result.area_px, mask.record.warnings);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Extract a recording into a data set
//!
//! ```
//! use std::path::Path;
//!
//! use relit::extract::{ExtractOptions, extract};
//! use relit_data::shard::{Dataset, ImageSize, verify};
//!
//! let recording = Path::new("fixtures/20261120T102000Z-bust-short");
//! let out = tempfile::tempdir()?;
//! let options = ExtractOptions {
//!     frames: 24,
//!     size: ImageSize::Pixels(64),
//!     mask: Some(recording.join("mask_gt.png")),
//!     ..ExtractOptions::default()
//! };
//! // The observer `()` ignores the progress.
//! let tally = extract(&[recording.to_owned()], out.path(), &options, &())?;
//! assert_eq!((tally.extracted, tally.failed), (1, 0));
//!
//! let dataset = Dataset::read(out.path())?;
//! assert_eq!(dataset.sessions[0].samples, 24);
//! assert!(verify(out.path(), &|_done, _total| {})?.problems.is_empty());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod extract;
pub mod masking;
