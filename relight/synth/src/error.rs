//! What can go wrong while data is made.

use std::io;
use std::path::{Path, PathBuf};

use relit_data::{report, shard};

use relight_core::image::ImageError;
use relight_core::light::LightError;

/// Why data could not be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SynthError {
    /// A file or folder could not be read.
    #[error("{path} could not be read")]
    Read {
        /// The file or folder.
        path: PathBuf,
        /// The system's answer.
        source: io::Error,
    },
    /// A file or folder could not be written.
    #[error("{path} could not be written")]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// The system's answer.
        source: io::Error,
    },
    /// A mesh is damaged, or not a surface.
    #[error("the mesh {path} cannot be used: {reason}; mend it, or take it out of the folder")]
    Mesh {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// A file is no mesh, or one of another kind.
    #[error("{path} is not a mesh of a kind that can be read: give .obj, .gltf or .glb")]
    MeshKind {
        /// The file.
        path: PathBuf,
    },
    /// A folder holds nothing of what it is for.
    #[error("{path} holds no {what}: put files in it that end in .{}", extensions.join(", ."))]
    Nothing {
        /// The folder.
        path: PathBuf,
        /// What was looked for.
        what: &'static str,
        /// How such files end.
        extensions: &'static [&'static str],
    },
    /// All panoramas are black.
    #[error("all panoramas are black: give one with light")]
    Dark,
    /// A texture or an image cannot be read.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// Numbers are no light.
    #[error(transparent)]
    Light(#[from] LightError),
    /// A setting is out of range.
    #[error("{name} is {value}: give {allowed}")]
    Setting {
        /// The setting.
        name: &'static str,
        /// What was given.
        value: u64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// A picture could not be encoded.
    #[error("a picture could not be encoded as PNG")]
    Png(#[from] png::EncodingError),
    /// The folder was made with other settings.
    #[error(
        "{path} holds samples that were made with other settings: give the same ones, or another folder"
    )]
    OtherSettings {
        /// The folder.
        path: PathBuf,
    },
    /// The folder holds something else.
    #[error(
        "{path} is not empty and has no {file}: give an empty folder, or one of `relight synth`"
    )]
    Foreign {
        /// The folder.
        path: PathBuf,
        /// The description that is missing.
        file: &'static str,
    },
    /// Another process writes into the folder.
    #[error("another process writes into {path}: wait until it ends, or give another folder")]
    Locked {
        /// The folder.
        path: PathBuf,
    },
    /// The description of a folder is damaged.
    #[error("{path} is damaged")]
    Description {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: serde_json::Error,
    },
    /// A shard could not be written.
    #[error(transparent)]
    Shard(#[from] shard::ShardError),
    /// The page of a turn could not be made.
    #[error(transparent)]
    Report(#[from] report::ReportError),
    /// An image and its mask differ in size.
    #[error(transparent)]
    Size(#[from] relit_data::image_stats::SizeMismatch),
}

impl SynthError {
    /// For `map_err` on what reads `path`.
    pub(super) fn read(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Read { path, source }
    }

    /// For `map_err` on what writes `path`.
    pub(super) fn write(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Write { path, source }
    }
}
