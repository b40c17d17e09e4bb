//! The errors of reading and writing data sets.

use std::io;
use std::path::{Path, PathBuf};

use parquet::errors::ParquetError;

use crate::disk::{DISK_FULL, is_full};
use crate::image_stats::SizeMismatch;

/// Why a data set could not be written, read or checked.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ShardError {
    /// A file or folder could not be read or written.
    #[error(
        "could not {doing} {path}: check that it exists, may be read and written, and that the disk has space",
        path = .path.display()
    )]
    Io {
        /// What was attempted, as a verb.
        doing: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// The disk is full.
    #[error(
        "{DISK_FULL}: {what} needs about {} in {folder} until it is written, and had {}; free some space, or give another folder",
        in_megabytes(*needed), in_megabytes(*written), folder = .folder.display()
    )]
    DiskFull {
        /// The session or file.
        what: String,
        /// The data set's folder.
        folder: PathBuf,
        /// Bytes that it needs until all is written.
        needed: u64,
        /// Bytes of them that were written.
        written: u64,
        /// The system's error: the disk, a quota or a limit on file sizes is exhausted.
        source: io::Error,
    },
    /// The pieces of several tasks do not make a data set.
    #[error(
        "the tasks' pieces in {path} do not make a whole data set: {}", .problems.join("; "), path = .path.display()
    )]
    Pieces {
        /// The folder of the pieces.
        path: PathBuf,
        /// What is wrong, one sentence each.
        problems: Vec<String>,
    },
    /// Another process is writing into the folder.
    #[error(
        "{path} is being written by another process: wait for it to end, or give another folder",
        path = .path.display()
    )]
    Locked {
        /// The folder.
        path: PathBuf,
    },
    /// The session is being written already, or a killed run left its spool behind.
    #[error(
        "{path} exists: either the session is being written already, or a killed run left it (the next locked run removes it)",
        path = .path.display()
    )]
    Busy {
        /// The file or folder in the way.
        path: PathBuf,
    },
    /// The id is not a valid session name.
    #[error(
        "{name:?} cannot be a session's name: use letters, digits, '-', '_' and '.', at most 120 bytes, neither starting nor ending with '.', and no device's name of Windows such as con"
    )]
    SessionName {
        /// The name.
        name: String,
    },
    /// A path in `dataset.json`, or one given by the caller, that is not a plain path inside the data
    /// set.
    #[error(
        "{path:?} cannot be a file of a data set: use a relative path with `/`, without `..`, `\\` and `:`; do not trust a dataset.json that names it"
    )]
    UnsafePath {
        /// The path.
        path: String,
    },
    /// An unknown layout.
    #[error("{name:?} is not a layout: give webdataset or relit")]
    UnknownLayout {
        /// The name.
        name: String,
    },
    /// A session without samples, or with too many.
    #[error("a session of {samples} samples cannot be written: give 1 to {most}", most = super::MAX_SAMPLES)]
    SampleCount {
        /// The requested number.
        samples: u32,
    },
    /// A sample of another session was pushed.
    #[error("sample {index} belongs to session {found:?}, but {expected:?} is being written")]
    WrongSession {
        /// The sample's index.
        index: u32,
        /// The session of the sample.
        found: String,
        /// The session of the writer.
        expected: String,
    },
    /// A sample with an index that the session does not have.
    #[error("session {session:?} has samples 0 to {last}, but sample {index} was given")]
    OutOfRange {
        /// The session.
        session: String,
        /// The sample's index.
        index: u32,
        /// The largest valid index.
        last: u32,
    },
    /// A sample was pushed twice.
    #[error("sample {index} of session {session:?} was given twice")]
    DoubledSample {
        /// The session.
        session: String,
        /// The sample's index.
        index: u32,
    },
    /// Samples were not pushed.
    #[error(
        "session {session:?} is not complete: {missing} samples were not given, the first is sample {index}"
    )]
    MissingSample {
        /// The session.
        session: String,
        /// The smallest missing index.
        index: u32,
        /// Number of missing samples.
        missing: usize,
    },
    /// A record with a number that JSON cannot hold.
    #[error("{field} of sample {index} of session {session:?} is not a finite number")]
    NotFinite {
        /// The session.
        session: String,
        /// The sample's index.
        index: u32,
        /// The record's field.
        field: &'static str,
    },
    /// An image or mask of the wrong size.
    #[error("{what} is {}x{} pixels, but {}x{} were expected", size[0], size[1], expected[0], expected[1])]
    SizeMismatch {
        /// What has the wrong size.
        what: &'static str,
        /// Its width and height, pixels.
        size: [u32; 2],
        /// The expected width and height, pixels.
        expected: [u32; 2],
    },
    /// A mask with a value other than 0 and 255.
    #[error("the mask has the value {value} at pixel ({x}, {y}): only 0 and 255 are allowed")]
    MaskValue {
        /// The value.
        value: u8,
        /// Column of the pixel.
        x: u32,
        /// Row of the pixel.
        y: u32,
    },
    /// An image that cannot be stored as PNG.
    #[error("could not encode an image of {width}x{height} pixels as PNG")]
    Encode {
        /// Width, pixels.
        width: u32,
        /// Height, pixels.
        height: u32,
        /// The encoder's error.
        source: png::EncodingError,
    },
    /// A PNG that cannot be decoded.
    #[error("the PNG is damaged: restore it, or extract the session again")]
    Decode {
        /// The decoder's error.
        #[from]
        source: png::DecodingError,
    },
    /// A PNG with an unexpected pixel format.
    #[error("the PNG is {found}, but {expected} was expected")]
    PixelFormat {
        /// Its pixel format.
        found: String,
        /// The expected one.
        expected: &'static str,
    },
    /// A PNG that is too large to be decoded.
    #[error("the PNG claims {width}x{height} pixels, more than the limit of {limit}")]
    TooManyPixels {
        /// Width, pixels.
        width: u32,
        /// Height, pixels.
        height: u32,
        /// The limit, pixels.
        limit: u64,
    },
    /// A table that could not be written or read.
    #[error("the table {path} could not be {doing}", path = .path.display())]
    Table {
        /// The table.
        path: PathBuf,
        /// What was attempted: "written" or "read".
        doing: &'static str,
        /// The Parquet library's error.
        source: parquet::errors::ParquetError,
    },
    /// A table in which a column is missing or has an invalid value.
    #[error("the table {path} does not belong to this data set: row {row} has no valid {column}", path = .path.display())]
    TableValue {
        /// The table.
        path: PathBuf,
        /// The row, 0-based.
        row: usize,
        /// The column.
        column: &'static str,
    },
    /// `dataset.json` is damaged.
    #[error("{path} is not a valid description of a data set: restore it, or write the data set again", path = .path.display())]
    Description {
        /// The file.
        path: PathBuf,
        /// The parser's error, with line and column.
        source: serde_json::Error,
    },
    /// `dataset.json` from another version.
    #[error(
        "{path} has the schema {found:?}, and this version reads {expected:?}: use the version of relit that wrote it",
        path = .path.display()
    )]
    Schema {
        /// The file.
        path: PathBuf,
        /// Its schema.
        found: String,
        /// The schema that this version reads.
        expected: &'static str,
    },
    /// A value could not be written as JSON.
    #[error("could not write {what} as JSON")]
    Json {
        /// What was being written.
        what: String,
        /// The serializer's error.
        source: serde_json::Error,
    },
    /// A folder without `dataset.json`.
    #[error(
        "{path} holds no data set: there is no dataset.json; give the folder that relit-extract wrote",
        path = .path.display()
    )]
    NoDataset {
        /// The folder.
        path: PathBuf,
    },
    /// A session that the data set does not have.
    #[error("the data set has no session {session:?}")]
    NoSession {
        /// The session's id.
        session: String,
    },
    /// A session without a shard.
    #[error("session {session:?} has no shard in dataset.json")]
    NoShard {
        /// The session's id.
        session: String,
    },
    /// A file of the data set is not the one that was written.
    #[error("{file} differs from its entry in dataset.json: {what}")]
    Changed {
        /// The file, relative to the data set.
        file: String,
        /// How it differs.
        what: String,
    },
    /// A tar that ends too early.
    #[error("the shard is truncated: it ends at byte {offset}; copy it again")]
    ShardTruncated {
        /// Number of bytes that were read.
        offset: u64,
    },
    /// A block of a tar that is not a header although one is expected.
    #[error("the block at byte {offset} of the shard is not a tar header: the shard is damaged")]
    ShardHeader {
        /// Where the block starts.
        offset: u64,
    },
    /// A member, or a sample, that is too large to be held in memory.
    #[error("{path:?} at byte {offset} of the shard claims more than the limit of {limit} bytes")]
    ShardTooLarge {
        /// The member.
        path: String,
        /// Where its header starts.
        offset: u64,
        /// The limit, bytes.
        limit: u64,
    },
    /// A member whose name is not UTF-8.
    #[error("the name of the member at byte {offset} of the shard is not UTF-8")]
    ShardName {
        /// Where its header starts.
        offset: u64,
    },
    /// A sample with the same member twice, or with too many members.
    #[error(
        "sample {key:?} has {path:?} twice, or has more than {limit} members: pack the shard again, each member once"
    )]
    ShardSample {
        /// The sample's key.
        key: String,
        /// The member.
        path: String,
        /// The largest number of members.
        limit: usize,
    },
    /// A shard that could not be read.
    #[error(
        "could not read the shard at byte {offset}: check the disk or connection that it comes from, and read it again"
    )]
    ShardRead {
        /// Number of bytes that were read.
        offset: u64,
        /// The system's error.
        source: io::Error,
    },
}

/// A number of bytes for a reader.
fn in_megabytes(bytes: u64) -> String {
    format!("{:.1} MB", bytes as f64 / 1e6)
}

impl ShardError {
    /// The same error, or if it says that no more can be written, that `what` needs so many bytes in the
    /// folder, of which so many were written.
    pub(super) fn with_needs(self, what: &str, folder: &Path, needed: u64, written: u64) -> Self {
        let source = match self {
            Self::Io { source, .. } if is_full(&source) => source,
            Self::Table {
                source: ParquetError::External(source),
                ..
            } if source.downcast_ref().is_some_and(is_full) => io::Error::other(source),
            other => return other,
        };
        Self::DiskFull {
            what: what.to_owned(),
            folder: folder.to_owned(),
            needed,
            written,
            source,
        }
    }

    /// For `map_err`: an I/O error with what was attempted and the path.
    pub(super) fn io(doing: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        move |source| Self::Io {
            doing,
            path: path.to_owned(),
            source,
        }
    }
}

impl From<SizeMismatch> for ShardError {
    fn from(SizeMismatch { size, expected }: SizeMismatch) -> Self {
        Self::SizeMismatch {
            what: "the image",
            size,
            expected,
        }
    }
}
