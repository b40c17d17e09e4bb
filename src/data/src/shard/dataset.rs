//! `dataset.json`: the description of a data set, with the digest of every file.

use std::collections::BTreeMap;
use std::io;
use std::path::Path;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::digest::Digest;
use super::file::{FileEntry, read_limited};
use super::quality::{QualityVerdict, SessionQuality};
use super::settings::ExtractionSettings;
use super::{ShardError, names, output};
use crate::file_names::folded;
use crate::geometry::Rect;
use crate::rig::RigFacts;

/// The schema that this version writes and reads.
const SCHEMA: &str = "relit.dataset/1";
/// Largest description that is read, bytes.
const MAX_BYTES: u64 = 1 << 30;

/// The program that wrote the data set.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct Software {
    name: String,
    version: String,
}

/// A shard: a tar, or in the layout `paper` a folder of images.
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
    /// BLAKE3 of the tar; for a folder, BLAKE3 over the digests (32 bytes each) of its images in
    /// index order.
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
pub struct SourceVideo {
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
    /// How the video's colours were converted to sRGB, in words; `None` if they were taken as sRGB.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub colour_conversion: Option<String>,
    /// BLAKE3 of the session's `frames.jsonl`; `None` without one.
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

/// The quantity over which the samples are evenly spaced.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SamplingBasis {
    /// The table's angle, over one turn.
    Angle,
    /// Time, over the whole video.
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
    pub input: SourceVideo,
    /// The mask.
    pub mask: MaskInfo,
    /// The quantity over which the samples are evenly spaced.
    pub selection: SamplingBasis,
    /// Number of samples.
    pub samples: u32,
    /// The part of a turn that the frames cover, degrees, where they cover no whole one: then
    /// there are fewer samples than the settings say, the first ones of the turn.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub covered_deg: Option<f64>,
    /// What is known of the rig, as the session has it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rig: Option<RigFacts>,
    /// Samples with `duplicate`.
    pub duplicates: u32,
    /// Samples with `spec_net`.
    pub spec_net: u32,
    /// True if something of the source was lost; the warnings say what.
    pub lossy: bool,
    /// Its figures summed, with a verdict.
    pub quality: SessionQuality,
    /// What a user should know, one sentence each.
    pub warnings: Vec<String>,
    /// The table, `<session>.parquet`.
    pub table: FileEntry,
    /// The page, `<session>.html`, if there is one.
    pub report: Option<FileEntry>,
}

impl SessionEntry {
    /// Whether its mask does not fit, in part or as a whole, as far as that is known.
    pub fn has_misfit(&self) -> bool {
        self.quality.mask_misfit.is_some()
    }

    /// Whether its verdict is the worst one.
    pub fn is_broken(&self) -> bool {
        self.quality.verdict == QualityVerdict::Broken
    }

    /// Whether a person should look at it before it is used: something is lost, its mask does not fit, or it is broken.
    pub fn is_flawed(&self) -> bool {
        self.lossy || self.has_misfit() || self.is_broken()
    }
}

/// An object with all its turns: it may have been put on the table in several poses.
#[derive(Serialize)]
struct ObjectTurns {
    name: String,
    /// The ids of its sessions, sorted.
    sessions: Vec<String>,
    /// Samples of all of them.
    samples: u64,
}

/// What is written: the description, and what follows from it for readers that know no more than JSON.
#[derive(Serialize)]
struct WrittenDataset<'a> {
    #[serde(flatten)]
    dataset: &'a Dataset,
    objects: Vec<ObjectTurns>,
}

/// The description of a data set, `dataset.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Dataset {
    /// `relit.dataset/1`.
    pub schema: String,
    /// The program that wrote it.
    software: Software,
    /// How all sessions were extracted.
    pub settings: ExtractionSettings,
    /// The sessions, sorted by id.
    pub sessions: Vec<SessionEntry>,
    /// The shards, sorted by file.
    pub shards: Vec<ShardEntry>,
}

impl Dataset {
    /// Its file name in the data set's folder.
    pub const FILE: &'static str = "dataset.json";

    /// A data set without sessions, written by this version of relit.
    pub fn new(settings: ExtractionSettings) -> Self {
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
    /// [`ShardError::NoDataset`] if there is none, [`ShardError::Description`] if it is damaged or of another version,
    /// [`ShardError::Refused`] if it names a file outside the folder,
    /// [`ShardError::Io`].
    pub fn read(out: &Path) -> Result<Self, ShardError> {
        let path = out.join(Self::FILE);
        let bytes = read_limited(&path, MAX_BYTES).map_err(|error| match error.kind() {
            io::ErrorKind::NotFound => ShardError::NoDataset(out.to_owned()),
            _ => ShardError::io("read", &path)(error),
        })?;
        let dataset: Self = described(&path, &bytes, SCHEMA)?;
        dataset.check_names()?;
        Ok(dataset)
    }

    /// Writes the description into the folder `out`, whole or not at all.
    ///
    /// # Errors
    /// [`ShardError::Refused`] if an entry could not be read back,
    /// [`ShardError::Refused`] if a number is not finite, [`ShardError::Io`].
    pub fn write(&self, out: &Path) -> Result<(), ShardError> {
        self.check_names()?;
        let written = WrittenDataset {
            dataset: self,
            objects: self.objects(),
        };
        output::write_whole(out, Self::FILE, &json_of(&written, Self::FILE)?).map(|_| ())
    }

    /// The objects, sorted by name, each with all its turns.
    fn objects(&self) -> Vec<ObjectTurns> {
        let mut objects: BTreeMap<&str, ObjectTurns> = BTreeMap::new();
        for session in &self.sessions {
            let object = objects
                .entry(&session.object)
                .or_insert_with(|| ObjectTurns {
                    name: session.object.clone(),
                    sessions: Vec::new(),
                    samples: 0,
                });
            object.sessions.push(session.id.clone());
            object.samples += u64::from(session.samples);
        }
        objects.into_values().collect()
    }

    /// The entry of a session.
    pub fn session(&self, id: &str) -> Option<&SessionEntry> {
        self.sessions.iter().find(|session| session.id == id)
    }

    /// The entry of a session whose files a session of this name would have for its own on a file system that ignores
    /// case: it has this name, or one that is like it.
    pub fn session_alike(&self, id: &str) -> Option<&SessionEntry> {
        let wanted = folded(id);
        let alike = |session: &&SessionEntry| folded(&session.id) == wanted;
        self.session(id)
            .or_else(|| self.sessions.iter().find(alike))
    }

    /// The shards of a session.
    pub fn shards_of<'a>(&'a self, id: &'a str) -> impl Iterator<Item = &'a ShardEntry> {
        self.shards.iter().filter(move |shard| shard.session == id)
    }

    /// The files of a session, with their lengths; a folder of images has none.
    pub fn files_of<'a>(&'a self, id: &'a str) -> impl Iterator<Item = (&'a str, Option<u64>)> {
        let sessions = self.session(id).into_iter();
        let files =
            sessions.flat_map(|session| std::iter::once(&session.table).chain(&session.report));
        let shards = self.shards_of(id);
        let files = files.chain(shards.flat_map(|shard| shard.mask.iter().chain(&shard.mean_img)));
        let own = self.shards_of(id).map(|shard| {
            let is_folder = shard.mask.is_some();
            (shard.file.as_str(), (!is_folder).then_some(shard.bytes))
        });
        let files = files.map(|entry| (entry.file.as_str(), Some(entry.bytes)));
        files.chain(own)
    }

    /// Adds a session and its shards, replacing an older entry with the same id.
    pub fn replace(&mut self, session: SessionEntry, shards: Vec<ShardEntry>) {
        self.remove(&session.id);
        self.sessions.push(session);
        self.shards.extend(shards);
        self.sessions.sort_by(|a, b| a.id.cmp(&b.id));
        self.shards.sort_by(|a, b| a.file.cmp(&b.file));
    }

    /// Removes the entry of a session and its shards. The files stay.
    pub fn remove(&mut self, id: &str) {
        self.sessions.retain(|session| session.id != id);
        self.shards.retain(|shard| shard.session != id);
    }

    /// All files of all sessions that the description lists. A folder of images counts as one.
    pub(super) fn files(&self) -> impl Iterator<Item = &str> {
        let sessions = self.sessions.iter();
        let files =
            sessions.flat_map(|session| std::iter::once(&session.table).chain(&session.report));
        let shards = self.shards.iter();
        let files = files.chain(shards.flat_map(|shard| shard.mask.iter().chain(&shard.mean_img)));
        let shards = self.shards.iter().map(|shard| &shard.file);
        files
            .map(|entry| &entry.file)
            .chain(shards)
            .map(String::as_str)
    }

    pub(super) fn check_names(&self) -> Result<(), ShardError> {
        self.sessions
            .iter()
            .try_for_each(|session| names::check_session(&session.id))?;
        self.shards
            .iter()
            .try_for_each(|shard| names::check_session(&shard.session))?;
        self.files().try_for_each(names::check_path)
    }
}

/// A description with its schema, which is read first: complaints about the fields of another version would mislead.
pub(super) fn described<T: DeserializeOwned>(
    path: &Path,
    bytes: &[u8],
    expected: &str,
) -> Result<T, ShardError> {
    #[derive(Deserialize)]
    struct Header {
        schema: String,
    }
    let wrong = |what| ShardError::Description {
        path: path.to_owned(),
        what,
    };
    let damaged = |error| wrong(format!("restore it, or write the data set again ({error})"));
    let Header { schema } = serde_json::from_slice(bytes).map_err(damaged)?;
    if schema != expected {
        return Err(wrong(format!(
            "its schema is {schema:?}, and this version reads {expected:?}: use the version of relit that wrote it"
        )));
    }
    serde_json::from_slice(bytes).map_err(damaged)
}

/// The content of a description's file.
pub(super) fn json_of(value: &impl Serialize, file: &str) -> Result<Vec<u8>, ShardError> {
    let json = serde_json::to_vec_pretty(value);
    let mut bytes =
        json.map_err(|error| ShardError::Refused(format!("could not write {file}: {error}")))?;
    bytes.push(b'\n');
    Ok(bytes)
}
