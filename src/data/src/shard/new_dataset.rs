//! A data set that is made of others, whole or not at all: it is built under a temporary name, and gets its own when
//! everything is in it.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::dataset::{Dataset, SessionEntry, ShardEntry};
use super::digest::{FolderHasher, Hashing};
use super::file::{FileEntry, compare};
use super::output::{self, OutputFolder, PartialFile};
use super::settings::Layout;
use super::{Digest, ShardError, names};
use crate::durable::{self, CreatedFolder};

/// A data set that is being built. Dropping it removes what was written.
pub(super) struct NewDataset {
    /// Where it will be.
    place: PathBuf,
    /// Where it is built, locked.
    folder: OutputFolder,
    /// The folders around it that were missing.
    _made: CreatedFolder,
}

impl NewDataset {
    /// Begins the data set that will be at `place`, where nothing but an empty folder may be. What a killed run left of
    /// it is removed.
    ///
    /// # Errors
    /// [`ShardError::Refused`] if something is there; [`ShardError::Locked`] if another process is building it;
    /// [`ShardError::Io`].
    pub(super) fn create(place: &Path) -> Result<Self, ShardError> {
        let (Some(name), Some(parent)) = (place.file_name(), place.parent()) else {
            return Err(ShardError::Refused(format!(
                "{} cannot be a new data set: name a folder that does not exist",
                place.display()
            )));
        };
        let is_free = match fs::read_dir(place) {
            Ok(mut entries) => entries.next().is_none(),
            Err(error) => error.kind() == io::ErrorKind::NotFound,
        };
        if !is_free {
            return Err(ShardError::Refused(format!(
                "{} is there already: name a new folder, or an empty one",
                place.display()
            )));
        }
        let made =
            CreatedFolder::make(parent).map_err(ShardError::io("make the folder", parent))?;
        let mut temporary = std::ffi::OsString::from(".");
        temporary.push(name);
        temporary.push(".partial");
        let path = parent.join(temporary);
        fs::create_dir_all(&path).map_err(ShardError::io("make the folder", &path))?;
        let folder = OutputFolder::lock_existing(&path).map_err(|error| match error {
            ShardError::Locked(_) => ShardError::Locked(place.to_owned()),
            other => other,
        })?;
        let new = Self {
            place: place.to_owned(),
            folder,
            _made: made,
        };
        new.clear()?;
        Ok(new)
    }

    /// The folder in which it is built.
    pub(super) fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Writes the description, and gives the data set its name.
    pub(super) fn finish(self, dataset: &Dataset) -> Result<(), ShardError> {
        dataset.write(self.path())?;
        output::sync(self.path())?;
        match fs::remove_dir(&self.place) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => {
                return Err(ShardError::io("replace the empty folder", &self.place)(
                    error,
                ));
            }
            _ => {}
        }
        durable::publish(self.path(), &self.place).map_err(ShardError::io(
            "rename the finished data set to",
            &self.place,
        ))
    }

    /// Copies the files of a session of the data set in `from`, and compares each with what `dataset` says about it.
    pub(super) fn copy_session(
        &self,
        from: &Path,
        dataset: &Dataset,
        session: &SessionEntry,
    ) -> Result<(), ShardError> {
        for entry in std::iter::once(&session.table).chain(&session.report) {
            self.copy(from, entry)?;
        }
        for shard in dataset.shards_of(&session.id) {
            match dataset.settings.layout {
                Layout::Webdataset => self.copy(from, &FileEntry::from(shard))?,
                Layout::Paper => self.copy_folder(from, shard)?,
            }
            for entry in shard.mask.iter().chain(&shard.mean_img) {
                self.copy(from, entry)?;
            }
        }
        Ok(())
    }

    /// Copies a file that a description lists, and compares the copy with its entry.
    pub(super) fn copy(&self, from: &Path, entry: &FileEntry) -> Result<(), ShardError> {
        names::check_path(&entry.file)?;
        let path = from.join(&entry.file);
        let source = fs::File::open(&path).map_err(ShardError::io("read", &path))?;
        let mut source = Hashing::new(source);
        self.make_parent(&entry.file)?;
        let mut copy = PartialFile::create(self.path(), &entry.file)?;
        io::copy(&mut source, &mut copy).map_err(ShardError::io("copy", &path))?;
        compare(&entry.file, (entry.bytes, entry.blake3), source.digest())?;
        copy.seal()?.publish().map(|_| ())
    }

    fn copy_folder(&self, from: &Path, shard: &ShardEntry) -> Result<(), ShardError> {
        names::check_path(&shard.file)?;
        let folder = self.path().join(&shard.file);
        fs::create_dir_all(&folder).map_err(ShardError::io("make the folder", &folder))?;
        let mut images = FolderImages::default();
        for index in 0..shard.samples {
            let png = images.read(from, shard, index)?;
            let path = folder.join(image_name(index));
            fs::write(&path, png).map_err(ShardError::io("write", &path))?;
        }
        images.check(shard)?;
        output::sync_content(&folder)
    }

    fn make_parent(&self, file: &str) -> Result<(), ShardError> {
        let path = self.path().join(file);
        let parent = path.parent().unwrap_or(self.path());
        fs::create_dir_all(parent).map_err(ShardError::io("make the folder", parent))
    }

    /// Removes everything in the folder.
    fn clear(&self) -> Result<(), ShardError> {
        for name in output::names_in(self.path())? {
            let path = self.path().join(name);
            let removed = if path.is_dir() && !path.is_symlink() {
                fs::remove_dir_all(&path)
            } else {
                fs::remove_file(&path)
            };
            removed.map_err(ShardError::io("remove", &path))?;
        }
        Ok(())
    }
}

impl Drop for NewDataset {
    fn drop(&mut self) {
        // Where it has its name there is nothing under this one, and an error cannot be returned here.
        let _ = fs::remove_dir_all(self.path());
    }
}

/// The images of a folder that are read one by one, in the order of their indices.
#[derive(Default)]
pub(super) struct FolderImages {
    hasher: FolderHasher,
    bytes: u64,
}

impl FolderImages {
    /// The bytes of the next image.
    pub(super) fn read(
        &mut self,
        out: &Path,
        shard: &ShardEntry,
        index: u32,
    ) -> Result<Vec<u8>, ShardError> {
        let path = out.join(&shard.file).join(image_name(index));
        let png = fs::read(&path).map_err(ShardError::io("read", &path))?;
        self.hasher.add(&Digest::hash(&png));
        self.bytes += png.len() as u64;
        Ok(png)
    }

    /// That all of them together are as their entry says.
    pub(super) fn check(&self, shard: &ShardEntry) -> Result<(), ShardError> {
        let found = (self.bytes, self.hasher.finish());
        compare(&shard.file, (shard.bytes, shard.blake3), found)
    }
}

pub(super) fn image_name(index: u32) -> String {
    format!("{index}.png")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_finished_leaves_nothing_behind_and_a_killed_run_is_cleared() {
        let root = tempfile::tempdir().unwrap();
        let place = root.path().join("sets/new");
        let new = NewDataset::create(&place).unwrap();
        fs::write(new.path().join("a.tar"), b"half").unwrap();
        assert!(matches!(
            NewDataset::create(&place),
            Err(ShardError::Locked(path)) if path == place
        ));
        drop(new);
        assert_eq!(fs::read_dir(root.path()).unwrap().count(), 0);
        // A killed run leaves its folder.
        let left = root.path().join("sets/.new.partial");
        fs::create_dir_all(left.join("imgs/a")).unwrap();
        let new = NewDataset::create(&place).unwrap();
        assert_eq!(fs::read_dir(new.path()).unwrap().count(), 0);
    }

    #[test]
    fn a_folder_that_holds_something_is_refused() {
        let root = tempfile::tempdir().unwrap();
        fs::write(root.path().join("notes"), b"").unwrap();
        for place in [root.path(), &root.path().join("notes"), Path::new("/")] {
            let refused = NewDataset::create(place);
            assert!(matches!(refused, Err(ShardError::Refused(_))), "{place:?}");
        }
    }
}
