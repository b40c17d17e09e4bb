//! Whole turns: an object that stands still while its light changes.

mod batch;
mod folder;
mod shard;

use std::path::{Path, PathBuf};

use crate::parallel;
use relit_data::shard::{Dataset, Layout};

use super::listing::listed;
use super::{DamagedSample, ReadError, SampleId, Source};
use batch::{BatchBuilder, Frame};
use folder::FolderTurn;
use shard::ShardTurn;

pub use batch::{Encoding, TurnBatch, TurnFrame};

/// The turns of a data set. Each is a shard, or a folder of images; its samples are numbered by
/// their position, in an order in which any 12 neighbours cover the whole turn.
///
/// Opening finds the samples' places and reads none of them. A sample that is lost is then reported as
/// [`DamagedSample`] of its batch, in each epoch.
pub struct Turns {
    turns: Vec<Turn>,
    encoding: Encoding,
}

enum Turn {
    Shard(ShardTurn),
    Folder(FolderTurn),
}

impl Turns {
    /// Opens
    ///
    /// - a shard, `*.tar`, by the rule of WebDataset with members `png`, `mask.png` and `json`;
    /// - a folder that `relit-extract` has written, in either layout: `dataset.json` states what
    ///   should be there;
    /// - a folder of shards;
    /// - a folder in the layout of the paper's released data set: `imgs/<video>/<k>.png` (or `.jpg`)
    ///   with k = 0, 1, 2, ... in order of time, `masks/<video>.png`, at least half white where the
    ///   object is.
    ///
    /// # Errors
    /// If it cannot be read, or holds no samples.
    pub fn open(path: &Path, encoding: Encoding) -> Result<Self, ReadError> {
        let turns = if path.is_file() {
            let shard = ShardTurn::open(path, None)?;
            if let Some(why) = shard.whole_loss() {
                let why = if relit_data::still::is_named(path) {
                    "it is a picture"
                } else {
                    why
                };
                return Err(ReadError::file(
                    path,
                    format!(
                        "holds no sample that can be read ({why}): give a shard (.tar) as relit-extract writes them"
                    ),
                ));
            }
            vec![Turn::Shard(shard)]
        } else if path.join(Dataset::FILE).is_file() {
            open_dataset(path)?
        } else if path.join("imgs").is_dir() {
            open_folders(path)?
        } else {
            open_shards(&listed(path, is_shard)?)?
        };
        if turns.iter().all(|turn| turn.samples() == 0) {
            return Err(ReadError::empty(
                path,
                "dataset.json, shards (*.tar) or a folder imgs",
            ));
        }
        Ok(Self { turns, encoding })
    }

    /// The names of the turns, in order: those of their shards or folders.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.turns.iter().map(|turn| match turn {
            Turn::Shard(shard) => shard.name(),
            Turn::Folder(folder) => folder.name(),
        })
    }

    /// The bytes in which the samples of each turn are stored, in the same order: turns that differ hardly ever have the same
    /// number.
    pub fn bytes(&self) -> impl Iterator<Item = u64> {
        self.turns.iter().map(|turn| match turn {
            Turn::Shard(shard) => shard.bytes(),
            Turn::Folder(folder) => folder.bytes(),
        })
    }
}

impl Turn {
    fn samples(&self) -> u32 {
        match self {
            Self::Shard(shard) => shard.samples(),
            Self::Folder(folder) => folder.samples(),
        }
    }

    fn frame(&self, position: u32) -> Result<Frame, DamagedSample> {
        match self {
            Self::Shard(shard) => shard.frame(position),
            Self::Folder(folder) => folder.frame(position),
        }
    }
}

impl Source for Turns {
    type Batch = TurnBatch;

    fn turns(&self) -> Vec<u32> {
        self.turns.iter().map(Turn::samples).collect()
    }

    fn batch(
        &self,
        samples: &[SampleId],
        spare: Option<TurnBatch>,
    ) -> (TurnBatch, Vec<DamagedSample>) {
        let mut batch = BatchBuilder::new(self.encoding, samples.len(), spare);
        let mut damage = Vec::new();
        for id in samples {
            let Some(turn) = self.turns.get(id.turn as usize) else {
                continue;
            };
            if let Err(damaged) = turn.frame(id.position).and_then(|frame| batch.push(frame)) {
                damage.push(damaged);
            }
        }
        (batch.finish(), damage)
    }
}

fn open_dataset(path: &Path) -> Result<Vec<Turn>, ReadError> {
    let dataset = Dataset::read(path).map_err(ReadError::dataset(path))?;
    let layout = dataset.settings.layout;
    let open = |at: usize| {
        let shard = &dataset.shards[at];
        match layout {
            Layout::Webdataset => {
                ShardTurn::open(&path.join(&shard.file), Some(shard.samples)).map(Turn::Shard)
            }
            Layout::Paper => {
                FolderTurn::open(path, &shard.session, Some(shard.samples)).map(Turn::Folder)
            }
        }
    };
    parallel::map(dataset.shards.len(), open)
        .into_iter()
        .collect()
}

fn open_shards(paths: &[PathBuf]) -> Result<Vec<Turn>, ReadError> {
    let open = |at: usize| ShardTurn::open(&paths[at], None).map(Turn::Shard);
    parallel::map(paths.len(), open).into_iter().collect()
}

fn open_folders(path: &Path) -> Result<Vec<Turn>, ReadError> {
    let folders = listed(&path.join("imgs"), Path::is_dir)?;
    let open = |at: usize| {
        let name = folders[at]
            .file_name()
            .unwrap_or_default()
            .to_string_lossy();
        FolderTurn::open(path, &name, None).map(Turn::Folder)
    };
    parallel::map(folders.len(), open).into_iter().collect()
}

fn is_shard(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "tar") && path.is_file()
}
