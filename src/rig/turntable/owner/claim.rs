//! The lock that makes a process a port's owner.

use std::fs::{self, Permissions};
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};

use super::server::Server;
use crate::lockfile::{self, LockError, LockFile};
use crate::turntable::error::TurntableError;
use crate::turntable::link::Link;

/// Lock and socket of a port.
#[derive(Debug, Clone)]
pub(super) struct Files {
    pub(super) port: PathBuf,
    pub(super) lock: PathBuf,
    pub(super) socket: PathBuf,
}

impl Files {
    /// Their names in the folder for locks and sockets.
    pub(super) fn of(port: &Path, folder: &Path) -> Result<Files, TurntableError> {
        let device = fs::metadata(port).map_err(|source| TurntableError::Open {
            path: port.to_owned(),
            source,
        })?;
        lockfile::use_folder(folder)?;
        let number = device.rdev();
        Ok(Files {
            port: port.to_owned(),
            lock: folder.join(format!("turntable-{number:x}.lock")),
            socket: folder.join(format!("turntable-{number:x}.sock")),
        })
    }
}

/// The lock of a port. Held while this is there, and no longer than the process lives.
#[derive(Debug)]
pub(in crate::turntable) struct Claim {
    files: Files,
    _lock: LockFile,
}

impl Claim {
    /// Makes this process the owner of `port`, without opening it.
    pub(in crate::turntable) fn take(port: &Path, folder: &Path) -> Result<Claim, TurntableError> {
        let files = Files::of(port, folder)?;
        match LockFile::take(&files.lock, &port.display().to_string()) {
            Ok(lock) => Ok(Claim { files, _lock: lock }),
            Err(LockError::Held { pid, .. }) => Err(TurntableError::Owned {
                path: files.port,
                pid: pid.unwrap_or(0),
            }),
            Err(error) => Err(error.into()),
        }
    }

    /// Answers other processes from now on: those of every account that can take the lock.
    pub(in crate::turntable) fn serve(&self, link: Link) -> Result<Server, TurntableError> {
        let Files { lock, socket, .. } = &self.files;
        let server = Server::start(socket, link)?;
        let mode = fs::metadata(lock)
            .map_err(LockError::system(lock, "checked"))?
            .mode();
        fs::set_permissions(socket, Permissions::from_mode(mode & 0o777))
            .map_err(LockError::system(socket, "shared"))?;
        Ok(server)
    }
}
