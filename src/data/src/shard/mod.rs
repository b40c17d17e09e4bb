//! The data set: writing, reading and verifying shards of samples with records and tables.
//!
//! A data set is a folder. `dataset.json` describes it and lists every other file with length and
//! BLAKE3. Each session has a shard (a tar, or in the layout `paper` a folder of images), a table of
//! its records, and usually a report. `docs/reference/formats.md` describes every file and field.
//!
//! | item | purpose |
//! | --- | --- |
//! | [`record`], [`read_table`] | a frame's record, as JSON and as a row of the table |
//! | [`order`](order()) | the order of the samples in a shard |
//! | [`encode_rgb`], [`decode_rgb`] and others | images as PNG (`codec`) |
//! | [`Digest`], [`sample_key`] | BLAKE3 digests; names and whether they are safe |
//! | [`OutputFolder`] | locks the folder; writes files that appear whole or not at all |
//! | [`ShardWriter`] | writes one session (layouts: `spool` for the tar, `folder` for images) |
//! | [`SessionQuality`] | a session's figures summed, with a verdict |
//! | [`Dataset`], [`ExtractionSettings`] | `dataset.json`; `file` compares the files with it |
//! | [`ShardReader`] | reads any WebDataset shard as a stream of samples (`tar_reader`) |
//! | [`SampleSpans`] | where the samples of a shard stand, for reading in any order (`index`) |
//! | [`ArrayTask`], [`PartialManifest`], [`merge`] | a data set that several tasks write |
//! | [`merge_datasets`], [`convert`](convert()) | finished data sets joined, or in the other layout (`new_dataset`: whole or not at all) |
//! | [`remove_sessions`] | sessions taken out of a data set |
//! | [`verify`](verify()) | reads everything back and reports what is wrong |
//!
//! This module knows pixel rectangles, images and their statistics
//! ([`image_stats`](crate::image_stats)). It knows nothing of videos, of how a mask was made, of the rig
//! or of session folders: here a session is a name and its samples.

mod codec;
mod combine;
mod convert;
mod dataset;
mod digest;
mod error;
mod file;
mod folder;
mod index;
mod names;
mod new_dataset;
mod order;
mod output;
mod parquet_table;
mod partial_manifest;
mod quality;
mod reader;
pub mod record;
mod remove;
mod settings;
mod spool;
mod tar_reader;
mod verify;
mod writer;

pub use codec::{decode_mask, decode_rgb, encode_mask, encode_rgb};
pub use combine::{has_only_partial_manifests, merge_datasets};
pub use convert::convert;
pub use dataset::{Dataset, MaskInfo, SamplingBasis, SessionEntry, ShardEntry, SourceVideo};
pub use digest::Digest;
pub use error::ShardError;
pub use file::FileEntry;
pub use index::{SampleSpan, SampleSpans};
pub use names::{check_session, sample_key};
pub use order::order;
pub use output::OutputFolder;
pub use parquet_table::{TableRow, read_table};
pub use partial_manifest::{
    ArrayTask, MAX_TASKS, MergedDataset, PartialManifest, TaskOutcome, merge, read_partial,
};
pub use quality::{MaskMisfit, QualityVerdict, SessionQuality};
pub use reader::{ShardReader, ShardSample};
pub use record::FrameRecord;
pub use remove::remove_sessions;
pub use settings::{Align, ExtractionSettings, ImageSize, Layout, Native};
pub use verify::{VerifyProblem, VerifyReport, verify};
pub use writer::{Sample, ShardFiles, ShardWriter};

/// Largest number of samples of a session.
pub const MAX_SAMPLES: u32 = 1_000_000;
