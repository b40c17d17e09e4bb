//! One daemon a folder and one program a camera: lock files that the system frees when their holder
//! dies, with the holder's process number in them.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use super::error::CaptureError;
use super::settings::Settings;
use crate::camera::CameraAddress;

/// Name of the lock in a folder of sessions.
const ROOT_LOCK: &str = ".relit-capture.lock";
/// Longest content of a lock file that is looked at.
const LONGEST: u64 = 20;

/// Something that only one process has; free again when this is dropped.
#[derive(Debug)]
pub struct Exclusive {
    _file: File,
}

impl Exclusive {
    /// Takes the folder of sessions for one daemon.
    ///
    /// # Errors
    /// [`CaptureError::Taken`] with the holder's process number.
    pub fn root(root: &Path) -> Result<Self, CaptureError> {
        Self::take(&root.join(ROOT_LOCK), root.display().to_string())
    }

    /// Takes the camera; `None` for one that any number of programs can have.
    ///
    /// # Errors
    /// [`CaptureError::Taken`] with the holder's process number.
    pub fn camera(settings: &Settings) -> Result<Option<Self>, CaptureError> {
        let CameraAddress::V4l2(path) = &settings.camera else {
            return Ok(None);
        };
        // A camera has many names, one of which is the kernel's.
        let path = path.canonicalize().unwrap_or_else(|_| path.clone());
        let name = path.display().to_string();
        let file: PathBuf = format!("relit-capture{}.lock", name.replace('/', "-")).into();
        Self::take(&settings.runtime_folder.join(file), name).map(Some)
    }

    fn take(path: &Path, what: String) -> Result<Self, CaptureError> {
        let failed = |doing| CaptureError::system(path.display().to_string(), doing);
        let mut options = OpenOptions::new();
        options.create(true).truncate(false).read(true).write(true);
        let mut file = options.open(path).map_err(failed("opened"))?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                let pid = holder(&file);
                return Err(CaptureError::Taken { what, pid });
            }
            Err(TryLockError::Error(error)) => return Err(failed("locked")(error)),
        }
        file.set_len(0).map_err(failed("written"))?;
        let pid = std::process::id().to_string();
        file.write_all(pid.as_bytes()).map_err(failed("written"))?;
        Ok(Self { _file: file })
    }
}

/// The process number in a lock file, where one stands there.
fn holder(file: &File) -> Option<u32> {
    let mut text = String::new();
    file.take(LONGEST).read_to_string(&mut text).ok()?;
    text.trim().parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_is_taken_once_and_the_refusal_names_the_holder() {
        let root = tempfile::tempdir().unwrap();
        let held = Exclusive::root(root.path()).unwrap();
        let error = Exclusive::root(root.path()).unwrap_err();
        let pid = std::process::id();
        assert!(
            error.to_string().contains(&format!("process {pid}")),
            "{error}"
        );
        drop(held);
        Exclusive::root(root.path()).unwrap();
    }
}
