//! The files of relit: sessions as a capture records them, data sets of masked frames with
//! statistics, and the report on an extracted session.
//!
//! This crate links no native library (no FFmpeg, no OpenCV, no camera, no serial port). A program
//! that reads or writes relit's data needs this crate and nothing else of the toolkit.
//!
//! | module | purpose |
//! | --- | --- |
//! | [`session`] | the session folder: manifest, frame index, video file; reading, writing, recovery |
//! | [`shard`] | the data set: samples, records, statistics; writing, reading, verifying |
//! | [`report`] | the HTML page of one extracted session |
//! | [`geometry`] | pixel rectangles |
//! | [`image_stats`] | statistics of an image's pixels, all or under a mask |
//! | [`spec_net_gate`] | the 5 % gate of Spec-Net |
//! | [`srgb`] | sRGB values to light and back |
//! | [`statistics`] | medians and quantiles |
//! | `still` | still image files as they are displayed, with the feature `still` |
//! | [`text`] | text in files, with or without a byte order mark |
//! | [`colour`] | colours as videos code them (HDR, wide gamut) to sRGB |
//! | [`turn_light`] | how much light changes over a turn |
//! | [`turn_motion`] | a turn of the table as it was planned, and as the table reported it |
//! | [`rig`] | what is known of a rig |
//! | [`clock`] | the clock of a capture, by which its frames are stamped: real or virtual time, and all waits |
//! | [`naming`] | the names that a session may have |
//! | [`file_names`] | the names of files: videos, hidden ones, and those that are one file where case is ignored |
//! | [`mask`] | which pixels a picture of a mask marks |
//! | [`durable`] | files that appear whole or not at all |
//! | [`disk`] | the error of a full disk |
//! | [`causes`] | errors as text, with their causes |
//! | [`counts`] | numbers of things in sentences |
//!
//! Without the feature `files`, which is on by default, only what needs no operating system is there: all
//! modules but `session`, `shard`, `report`, `clock` and `durable`.
//!
//! `shard` knows `geometry`, `image_stats`, `naming` and `durable`; `report` knows the records of `shard`
//! and `image_stats`; both know `rig`; `session` and `shard` do not know each other. `docs/reference/formats.md`
//! describes every file and field.
//!
//! The folder `examples/` has programs: `session_angles` prints the angle of each frame of a session, `shard_arrays`
//! reads a shard as arrays, `write_shard` writes a small data set, and `verify_dataset` checks one.
//!
//! # Read a session
//!
//! ```
//! use std::path::Path;
//!
//! use relit_data::session::Recording;
//!
//! let recording = Recording::open(Path::new("../../fixtures/20261120T103000Z-cow-dropped"))?;
//! assert_eq!(recording.object, "cow");
//!
//! // What is incomplete is reported, not hidden.
//! let notices: Vec<&str> = recording.notices.iter().map(|notice| notice.text()).collect();
//! assert_eq!(notices[0], "the camera dropped 2 frames before frame 40");
//!
//! // One entry per frame of the video.
//! let index = recording.frames.ok_or("the session has no frame index")?;
//! let frame = index.entries()[40];
//! assert_eq!((frame.n, frame.sequence), (40, 42));
//! println!("frame 40 at {:?} degrees, {} us", frame.angle_deg, frame.t_us);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Write, check and read a shard
//!
//! ```
//! use std::fs::File;
//! use std::io::BufReader;
//!
//! use image::{GrayImage, Luma, Rgb, RgbImage};
//! use relit_data::geometry::Rect;
//! use relit_data::image_stats::{MaskSpans, SATURATION_LEVEL};
//! use relit_data::spec_net_gate::SPEC_NET_GATE;
//! use relit_data::shard::{
//!     Align, Dataset, Digest, ExtractionSettings, FrameRecord, ImageSize, Layout, MaskInfo,
//!     OutputFolder, Sample, SamplingBasis, SessionEntry, SessionQuality, ShardReader,
//!     ShardWriter, SourceVideo, decode_rgb, verify,
//! };
//!
//! const SESSION: &str = "20261120T093015Z-mug";
//! const SAMPLES: u32 = 12;
//! let settings = ExtractionSettings {
//!     frames: SAMPLES,
//!     size: ImageSize::Pixels(8),
//!     margin: 0.0,
//!     saturation_level: SATURATION_LEVEL,
//!     gate: SPEC_NET_GATE,
//!     align: Align::Off,
//!     align_tolerance: None,
//!     layout: Layout::Webdataset,
//!     scaling: "none".to_owned(),
//! };
//!
//! // Write the samples, in any order. The object is the left half of each image.
//! let root = tempfile::tempdir()?;
//! let folder = OutputFolder::lock(root.path())?;
//! let mask = GrayImage::from_fn(8, 8, |x, _| Luma([if x < 4 { 255 } else { 0 }]));
//! let spans = MaskSpans::from_mask(&mask);
//! let mut writer =
//!     ShardWriter::create(folder.path(), settings.layout, SESSION, SAMPLES, &mask)?;
//! let mut records = Vec::new();
//! for index in 0..SAMPLES {
//!     let image = RgbImage::from_fn(8, 8, |x, _| {
//!         Rgb(if x < 4 { [20 * index as u8, 128, 255] } else { [0; 3] })
//!     });
//!     let measures = spans.measure(&image, settings.saturation_level)?;
//!     let crop = Rect::new(0, 0, 8, 8);
//!     let record = FrameRecord {
//!         t_us: 33_333 * i64::from(index),
//!         angle_deg: Some(30.0 * f64::from(index)),
//!         ..FrameRecord::new(SESSION, "mug", index, crop, &measures, settings.gate)
//!     };
//!     records.push(record.clone());
//!     writer.push(Sample::encode(record, image)?)?;
//! }
//! let files = writer.finish()?;
//!
//! // Describe the data set in dataset.json.
//! let mut dataset = Dataset::new(settings);
//! let entry = SessionEntry {
//!     id: SESSION.to_owned(),
//!     object: "mug".to_owned(),
//!     input: SourceVideo {
//!         video: "video.mkv".to_owned(),
//!         codec: "mjpeg".to_owned(),
//!         frames: u64::from(SAMPLES),
//!         bytes: 5,
//!         blake3: Digest::hash(b"video"),
//!         colour_conversion: None,
//!         index_blake3: None,
//!     },
//!     mask: MaskInfo {
//!         blake3: Digest::hash(b"mask"),
//!         px: spans.pixels(),
//!         bounding_box: Rect::new(0, 0, 4, 8),
//!     },
//!     selection: SamplingBasis::Angle,
//!     samples: SAMPLES,
//!     covered_deg: None,
//!     rig: None,
//!     duplicates: 0,
//!     spec_net: 0,
//!     lossy: false,
//!     quality: SessionQuality::from_records(&records, false, None),
//!     warnings: Vec::new(),
//!     table: files.table,
//!     report: None,
//! };
//! dataset.replace(entry, files.shards);
//! dataset.write(folder.path())?;
//!
//! // Check everything that was written.
//! drop(folder);
//! let report = verify(root.path(), &|_done, _total| {})?;
//! assert_eq!((report.samples, report.problems), (12, Vec::new()));
//!
//! // Read the samples. Any 12 in a row cover the whole turn.
//! let shard = File::open(root.path().join(&dataset.shards[0].file))?;
//! for sample in ShardReader::new(BufReader::new(shard)) {
//!     let sample = sample?;
//!     let image = decode_rgb(sample.member("png").ok_or("no image")?)?;
//!     let record: FrameRecord =
//!         serde_json::from_slice(sample.member("json").ok_or("no record")?)?;
//!     assert_eq!(image.get_pixel(0, 0).0[0], 20 * record.index as u8);
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod causes;
#[cfg(all(feature = "files", unix))]
pub mod clock;
#[cfg(feature = "still")]
pub mod colour;
pub mod counts;
pub mod disk;
#[cfg(feature = "files")]
pub mod durable;
pub mod file_names;
pub mod geometry;
pub mod image_stats;
pub mod mask;
pub mod naming;
#[cfg(feature = "files")]
pub mod report;
pub mod rig;
#[cfg(feature = "files")]
pub mod session;
#[cfg(feature = "files")]
pub mod shard;
pub mod spec_net_gate;
pub mod srgb;
pub mod statistics;
#[cfg(feature = "still")]
pub mod still;
pub mod text;
pub mod turn_light;
pub mod turn_motion;
