//! The layout `webdataset`: images are collected in a spool file and then written to the tar in the
//! shard's order.

use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

use super::names::{self, Part};
use super::order::order;
use super::output::{PartialFile, ScratchFile, SealedFile};
use super::parquet_table::TableRow;
use super::{ShardError, tar_reader};

/// Part of the spool that holds an image.
#[derive(Debug, Clone, Copy, Default)]
struct Extent {
    offset: u64,
    bytes: u64,
}

/// The images of a session that will be written into a tar.
pub(super) struct SpoolStore {
    out: PathBuf,
    session: String,
    scratch: ScratchFile,
    /// The extent of each image, by index.
    extents: Vec<Extent>,
    bytes: u64,
}

impl SpoolStore {
    pub(super) fn create(out: &Path, session: &str, samples: u32) -> Result<Self, ShardError> {
        Ok(Self {
            out: out.to_owned(),
            session: session.to_owned(),
            scratch: ScratchFile::create(out.join(names::spool(session)))?,
            extents: vec![Extent::default(); samples as usize],
            bytes: 0,
        })
    }

    pub(super) fn push(&mut self, index: u32, png: &[u8]) -> Result<(), ShardError> {
        let extent = Extent {
            offset: self.bytes,
            bytes: png.len() as u64,
        };
        // A failed push may have left bytes behind: each image is written at its own offset.
        let file = &self.scratch.file;
        file.write_all_at(png, extent.offset)
            .map_err(ShardError::io("write", &self.scratch.path))?;
        self.bytes += extent.bytes;
        if let Some(slot) = self.extents.get_mut(index as usize) {
            *slot = extent;
        }
        Ok(())
    }

    /// Writes the tar under its temporary name. The spool is removed when `self` is dropped.
    pub(super) fn seal(
        &self,
        rows: &[TableRow],
        mask_png: &[u8],
    ) -> Result<SealedFile, ShardError> {
        let partial = PartialFile::create(&self.out, &names::tar_file(&self.session))?;
        let samples = u32::try_from(rows.len()).unwrap_or(u32::MAX);
        let mut tar = tar::Builder::new(partial);
        let mut png = Vec::new();
        for index in order(samples) {
            let slot = index as usize;
            let (Some(row), Some(&extent)) = (rows.get(slot), self.extents.get(slot)) else {
                continue;
            };
            self.read(extent, &mut png)?;
            let json = serde_json::to_vec(&row.record);
            let json = json.map_err(|error| {
                let key = names::sample_key(&self.session, index);
                ShardError::Refused(format!("could not write the record of {key}: {error}"))
            })?;
            for (part, data) in [
                (Part::Image, png.as_slice()),
                (Part::Mask, mask_png),
                (Part::Record, json.as_slice()),
            ] {
                self.append(&mut tar, &names::member(&self.session, index, part), data)?;
            }
        }
        let partial = tar.into_inner();
        partial
            .map_err(ShardError::io("write", &self.path()))?
            .seal()
    }

    fn append(
        &self,
        tar: &mut tar::Builder<PartialFile>,
        path: &str,
        data: &[u8],
    ) -> Result<(), ShardError> {
        let written = tar_reader::header(path, data.len() as u64)
            .and_then(|header| tar.append(&header, data));
        written.map_err(ShardError::io("write", &self.path()))
    }

    fn path(&self) -> PathBuf {
        self.out.join(names::tar_file(&self.session))
    }

    fn read(&self, extent: Extent, png: &mut Vec<u8>) -> Result<(), ShardError> {
        png.resize(extent.bytes as usize, 0);
        let file = &self.scratch.file;
        file.read_exact_at(png, extent.offset)
            .map_err(ShardError::io("read back", &self.scratch.path))
    }
}
