//! `dataset.json`: what a data set holds and vouches for.

use std::io;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::digest::Digest;
use super::settings::Settings;
use super::{Error, names, output};
use crate::geometry::Rect;

/// The schema that is written and read here.
const SCHEMA: &str = "relit.dataset/1";
/// Largest description that is read, bytes.
const MOST_BYTES: u64 = 1 << 30;

/// What wrote the data set.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Software {
    /// The program's name.
    pub name: String,
    /// Its version.
    pub version: String,
}

/// A file that the data set vouches for.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FileEntry {
    /// Path relative to the data set, with `/`.
    pub file: String,
    /// Its length, bytes.
    pub bytes: u64,
    /// BLAKE3 of its bytes.
    pub blake3: Digest,
}

/// A shard: a tar, or in the layout `relit` a folder of images.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ShardEntry {
    /// Path relative to the data set: `<session>.tar` or `imgs/<session>`.
    pub file: String,
    /// The session it belongs to.
    pub session: String,
    /// Number of samples in it.
    pub samples: u32,
    /// Length of the tar, or of all images of the folder together, bytes.
    pub bytes: u64,
    /// BLAKE3 of the tar; for a folder, BLAKE3 over the digests (32 bytes each) of its images,
    /// one after the other in the order of their indices.
    pub blake3: Digest,
    /// Layout `relit`: the session's mask, `masks/<session>.png`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mask: Option<FileEntry>,
    /// Layout `relit`: the mean of the session's images, `mean_img/<session>.png`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mean_img: Option<FileEntry>,
}

/// The video that a session was extracted from.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Input {
    /// The video's file name, without folders.
    pub video: String,
    /// The codec's name.
    pub codec: String,
    /// Number of frames found in the file.
    pub frames: u64,
    /// Length of the file, bytes.
    pub bytes: u64,
    /// BLAKE3 of the file.
    pub blake3: Digest,
    /// BLAKE3 of the session's `frames.jsonl`; `None` where there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub index_blake3: Option<Digest>,
}

/// The mask that a session was extracted with.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct MaskInfo {
    /// BLAKE3 of the mask's file.
    pub blake3: Digest,
    /// Pixels of the object in the source frame.
    pub px: u64,
    /// Smallest rectangle around the object, source pixels.
    pub bounding_box: Rect,
}

/// How frames were chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Selection {
    /// Uniform in the table's angle over one turn.
    Angle,
    /// Uniform in time over the whole video.
    Time,
}

/// One session of a data set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SessionEntry {
    /// The session's id.
    pub id: String,
    /// The object's name.
    pub object: String,
    /// The video.
    pub input: Input,
    /// The mask.
    pub mask: MaskInfo,
    /// How frames were chosen.
    pub selection: Selection,
    /// Number of samples.
    pub samples: u32,
    /// Samples with `duplicate`.
    pub duplicates: u32,
    /// Samples with `spec_net`.
    pub spec_net: u32,
    /// True where something of the source was lost, as the warnings tell.
    pub lossy: bool,
    /// What a user should know, one sentence each.
    pub warnings: Vec<String>,
    /// The table, `<session>.parquet`.
    pub table: FileEntry,
    /// The page, `<session>.html`; null where there is none.
    pub report: Option<FileEntry>,
}

/// The description of a data set, `dataset.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Dataset {
    /// `relit.dataset/1`.
    pub schema: String,
    /// What wrote it.
    pub software: Software,
    /// How all sessions were extracted.
    pub settings: Settings,
    /// The sessions, sorted by id.
    pub sessions: Vec<SessionEntry>,
    /// The shards, sorted by file.
    pub shards: Vec<ShardEntry>,
}

impl Dataset {
    /// Its name in the folder of the data set.
    pub const FILE: &'static str = "dataset.json";

    /// A data set without sessions, written by this version of this software.
    #[must_use]
    pub fn new(settings: Settings) -> Self {
        Self {
            schema: SCHEMA.to_owned(),
            software: Software {
                name: "relit".to_owned(),
                version: env!("CARGO_PKG_VERSION").to_owned(),
            },
            settings,
            sessions: Vec::new(),
            shards: Vec::new(),
        }
    }

    /// Reads the description of the data set in the folder `out`.
    ///
    /// # Errors
    /// [`Error::NoDataset`] where there is none, [`Error::Schema`] where it is of another
    /// version, [`Error::Description`] where it is damaged, [`Error::UnsafePath`] or
    /// [`Error::SessionName`] where it names a file outside the folder, [`Error::Io`].
    pub fn read(out: &Path) -> Result<Self, Error> {
        let path = out.join(Self::FILE);
        let bytes = read_limited(&path).map_err(|source| match source.kind() {
            io::ErrorKind::NotFound => Error::NoDataset {
                path: out.to_owned(),
            },
            _ => Error::Io {
                doing: "read",
                path: path.clone(),
                source,
            },
        })?;
        let damaged = |source| Error::Description {
            path: path.clone(),
            source,
        };
        let Header { schema } = serde_json::from_slice(&bytes).map_err(damaged)?;
        if schema != SCHEMA {
            return Err(Error::Schema {
                path,
                found: schema,
                expected: SCHEMA,
            });
        }
        let dataset: Self = serde_json::from_slice(&bytes).map_err(damaged)?;
        dataset.check_names()?;
        Ok(dataset)
    }

    /// Writes the description into the folder `out`, whole or not at all.
    ///
    /// # Errors
    /// [`Error::UnsafePath`] or [`Error::SessionName`] where an entry could not be read back,
    /// [`Error::Json`] where a number is not finite, [`Error::Io`].
    pub fn write(&self, out: &Path) -> Result<(), Error> {
        self.check_names()?;
        let mut bytes = serde_json::to_vec_pretty(self).map_err(|source| Error::Json {
            what: Self::FILE.to_owned(),
            source,
        })?;
        bytes.push(b'\n');
        output::write_whole(out, Self::FILE, &bytes)?;
        Ok(())
    }

    /// The entry of a session.
    #[must_use]
    pub fn session(&self, id: &str) -> Option<&SessionEntry> {
        self.sessions.iter().find(|session| session.id == id)
    }

    /// The shards of a session.
    pub fn shards_of<'a>(&'a self, id: &'a str) -> impl Iterator<Item = &'a ShardEntry> {
        self.shards.iter().filter(move |shard| shard.session == id)
    }

    /// Enters a session with its shards, in place of an older entry with this id.
    pub fn replace(&mut self, session: SessionEntry, shards: Vec<ShardEntry>) {
        self.remove(&session.id);
        self.sessions.push(session);
        self.shards.extend(shards);
        self.sessions.sort_by(|a, b| a.id.cmp(&b.id));
        self.shards.sort_by(|a, b| a.file.cmp(&b.file));
    }

    /// Takes the entry of a session and its shards out. The files stay.
    pub fn remove(&mut self, id: &str) {
        self.sessions.retain(|session| session.id != id);
        self.shards.retain(|shard| shard.session != id);
    }

    /// All files that the description names, of all sessions. Folders of images stand for
    /// themselves.
    pub(super) fn files(&self) -> impl Iterator<Item = &str> {
        let of_sessions = self.sessions.iter().flat_map(|session| {
            std::iter::once(&session.table)
                .chain(&session.report)
                .map(|entry| &entry.file)
        });
        let of_shards = self.shards.iter().flat_map(|shard| {
            let beside = shard
                .mask
                .iter()
                .chain(&shard.mean_img)
                .map(|entry| &entry.file);
            std::iter::once(&shard.file).chain(beside)
        });
        of_sessions.chain(of_shards).map(String::as_str)
    }

    fn check_names(&self) -> Result<(), Error> {
        self.sessions
            .iter()
            .try_for_each(|session| names::check_session(&session.id))?;
        self.shards
            .iter()
            .try_for_each(|shard| names::check_session(&shard.session))?;
        self.files().try_for_each(names::check_path)
    }
}

/// The one field that is read before the rest.
#[derive(Deserialize)]
struct Header {
    schema: String,
}

fn read_limited(path: &Path) -> io::Result<Vec<u8>> {
    let length = std::fs::metadata(path)?.len();
    if length > MOST_BYTES {
        return Err(io::Error::other(format!(
            "{length} bytes are more than are read"
        )));
    }
    std::fs::read(path)
}
