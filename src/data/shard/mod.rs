//! The data set on disk: samples, records, tables; write, read, verify.
//!
//! A data set is a folder. `dataset.json` describes it and vouches for every other file by
//! length and BLAKE3; each session has a shard (a tar, or in the layout `relit` a folder of
//! images), a table of its records, and possibly a page. `docs/formats.md` tells every file and
//! field.
//!
//! | file | concern |
//! | --- | --- |
//! | [`record`], [`table`](read_table) | what is known of a frame: as JSON, as a row |
//! | [`order`](order()) | in which order samples stand in a shard |
//! | [`measure`] | what is counted under a mask |
//! | `codec` | PNG |
//! | `digest`, `names` | BLAKE3; which names are used and which are safe |
//! | [`OutputFolder`] | one writer a folder; files that appear whole or not at all |
//! | [`SessionWriter`] | samples in any order in, files out; `spool` and `folder` are its layouts |
//! | [`Dataset`], [`Settings`] | `dataset.json`; `vouch` compares files with it |
//! | [`ShardReader`] | any WebDataset shard as a stream of samples; `tarball` is the tar below it |
//! | [`SampleSpans`] | where the samples of a shard stand, for who reads at random |
//! | [`verify`](verify()) | reads everything back and names what is wrong |
//!
//! This room knows pixel rectangles and images. It knows nothing of videos, of how a mask was
//! made, of a rig or of its sessions on disk: a session here is a name with samples.

mod codec;
mod dataset;
mod digest;
mod error;
mod folder;
mod index;
pub mod measure;
mod names;
mod order;
mod output;
mod reader;
pub mod record;
mod settings;
mod spool;
mod table;
mod tarball;
mod verify;
mod vouch;
mod writer;

pub use codec::{decode_mask, decode_rgb, encode_mask, encode_rgb};
pub use dataset::{
    Dataset, FileEntry, Input, MaskInfo, Selection, SessionEntry, ShardEntry, Software,
};
pub use digest::{Digest, NotADigest};
pub use error::Error;
pub use index::{SampleSpan, SampleSpans};
pub use measure::{MaskSpans, Measures};
pub use names::{check_session, sample_key};
pub use order::order;
pub use output::OutputFolder;
pub use reader::{ShardReader, ShardSample};
pub use record::FrameRecord;
pub use settings::{Align, Layout, Native, Settings, Size};
pub use table::{Row, read_table};
pub use verify::{Problem, Verdict, verify};
pub use writer::{Sample, SessionFiles, SessionWriter};

/// Most samples that a session may have.
pub const MAX_SAMPLES: u32 = 1_000_000;
