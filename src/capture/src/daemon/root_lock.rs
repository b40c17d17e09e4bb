//! The lock of a folder of sessions, which one daemon has.

use std::fs::{self, File, TryLockError};
use std::path::Path;

use relit_turntable::holder;

use crate::capture::CaptureError;

/// Name of the file that is locked.
const FILE: &str = ".relit-capture.lock";

/// Takes a folder of sessions until the file is closed or the process dies.
pub(super) fn lock(root: &Path) -> Result<File, CaptureError> {
    let path = root.join(FILE);
    let failed = |doing| CaptureError::system(path.display().to_string(), doing);
    let file = File::create(&path).map_err(failed("opened"))?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => {
            drop(file);
            Err(CaptureError::InUse {
                root: root.to_owned(),
                pid: holder(&path),
            })
        }
        Err(TryLockError::Error(error)) => Err(failed("locked")(error)),
    }
}

/// Removes the file from a folder that nobody else has used yet.
pub fn forget_root(root: &Path) {
    // Where it stays, the folder does too: there is nothing else to be done.
    let _ = fs::remove_file(root.join(FILE));
}
