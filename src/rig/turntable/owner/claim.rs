//! The lock that makes a process a port's owner.

use std::fs::{self, DirBuilder, File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, Write};
use std::os::unix::fs::{DirBuilderExt, MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

use super::server::Server;
use crate::turntable::error::TurntableError;
use crate::turntable::link::Link;

/// A lock that is only looked at is held for a moment: so often it is tried again, and so long is
/// waited between.
const TRIES: u32 = 5;
const PAUSE: Duration = Duration::from_millis(40);

/// Lock and socket of a port.
#[derive(Debug, Clone)]
pub(super) struct Files {
    pub(super) port: PathBuf,
    pub(super) lock: PathBuf,
    pub(super) socket: PathBuf,
}

impl Files {
    /// Their names, in this user's folder under `runtime`, which is made where it is not there.
    pub(super) fn of(port: &Path, runtime: &Path) -> Result<Files, TurntableError> {
        let device = fs::metadata(port).map_err(|source| TurntableError::Open {
            path: port.to_owned(),
            source,
        })?;
        let folder = own_folder(runtime)?;
        let number = device.rdev();
        Ok(Files {
            port: port.to_owned(),
            lock: folder.join(format!("turntable-{number:x}.lock")),
            socket: folder.join(format!("turntable-{number:x}.sock")),
        })
    }
}

/// `<runtime>/relit-<user>`, which nobody else can write in.
fn own_folder(runtime: &Path) -> Result<PathBuf, TurntableError> {
    let user = rustix::process::getuid().as_raw();
    let folder = runtime.join(format!("relit-{user}"));
    match DirBuilder::new().mode(0o700).create(&folder) {
        Err(error) if error.kind() != io::ErrorKind::AlreadyExists => Err(error),
        _ => fs::symlink_metadata(&folder),
    }
    .and_then(|found| {
        let own = found.is_dir() && found.uid() == user && found.mode() & 0o022 == 0;
        own.then_some(())
            .ok_or_else(|| io::Error::other("it is not this user's own folder"))
    })
    .map_err(claim_error(&folder, "used"))?;
    Ok(folder)
}

pub(super) fn claim_error(
    path: &Path,
    doing: &'static str,
) -> impl FnOnce(io::Error) -> TurntableError {
    let path = path.to_owned();
    move |source| TurntableError::Claim {
        path,
        doing,
        source,
    }
}

/// The lock of a port. Held while this is there, and no longer than the process lives.
#[derive(Debug)]
pub(in crate::turntable) struct Claim {
    files: Files,
    _lock: File,
}

impl Claim {
    /// Makes this process the owner of `port`, without opening it.
    pub(in crate::turntable) fn take(port: &Path, runtime: &Path) -> Result<Claim, TurntableError> {
        let files = Files::of(port, runtime)?;
        for _ in 0..TRIES {
            let Some(mut lock) = try_lock(&files)? else {
                thread::sleep(PAUSE);
                continue;
            };
            let pid = std::process::id().to_string();
            lock.set_len(0)
                .and_then(|()| lock.rewind())
                .and_then(|()| lock.write_all(pid.as_bytes()))
                .map_err(claim_error(&files.lock, "written"))?;
            return Ok(Claim { files, _lock: lock });
        }
        Err(TurntableError::Owned {
            pid: owner_pid(&files.lock),
            path: files.port,
        })
    }

    /// Answers other processes from now on.
    pub(in crate::turntable) fn serve(&self, link: Link) -> Result<Server, TurntableError> {
        Server::start(&self.files.socket, link)
    }
}

/// The lock, where nobody has it.
pub(super) fn try_lock(files: &Files) -> Result<Option<File>, TurntableError> {
    let path = &files.lock;
    let lock = OpenOptions::new()
        .read(true)
        .write(true)
        .create(true)
        .truncate(false)
        .mode(0o600)
        .open(path)
        .map_err(claim_error(path, "opened"))?;
    match lock.try_lock() {
        Ok(()) => Ok(Some(lock)),
        Err(TryLockError::WouldBlock) => Ok(None),
        Err(TryLockError::Error(error)) => Err(claim_error(path, "locked")(error)),
    }
}

/// The process that has the lock, by what it wrote into it; 0 where it has not yet.
pub(super) fn owner_pid(lock: &Path) -> u32 {
    let mut text = String::new();
    let read = File::open(lock).and_then(|file| file.take(16).read_to_string(&mut text));
    read.ok()
        .and_then(|_| text.trim().parse().ok())
        .unwrap_or(0)
}
