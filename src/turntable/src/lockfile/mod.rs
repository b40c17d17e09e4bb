//! Lock files: a port, a camera or a folder that only one process may have.
//!
//! The lock is the kernel's (`flock`), which frees it when its holder dies. The file's content is the
//! holder's process number, for those who are refused. The files lie in a folder that the accounts of
//! a machine share through a group, [`SHARED_FOLDER`], so that a service and a person who logs in find
//! each other. Where nobody set that up, each account has its own folder. Links are never followed.
//!
//! Knows nothing of devices.

use std::fs::{self, DirBuilder, File, OpenOptions, TryLockError};
use std::io::{self, Read, Write};
use std::os::unix::fs::{DirBuilderExt, MetadataExt, OpenOptionsExt, PermissionsExt};
use std::path::{Path, PathBuf};

use rustix::fs::{Access, OFlags, access};

/// The folder that a group shares: `docs/rig/relit-tmpfiles.conf` makes it.
pub const SHARED_FOLDER: &str = "/run/relit";
/// Name of the lock in a folder of sessions.
const ROOT_LOCK: &str = ".relit-capture.lock";
/// Where each account has its own folder; the second if the first does not exist.
const PRIVATE_BASES: [&str; 2] = ["/run/lock", "/tmp"];
/// Longest content that is read, bytes.
const MAX_LENGTH: u64 = 20;

/// Why a lock was not taken or could not be checked.
#[derive(Debug, thiserror::Error)]
pub enum LockError {
    /// Another process has it.
    #[error("{what} is in use by {}: end that one first", .pid.map_or("another process".to_owned(), |pid| format!("process {pid}")))]
    Held {
        /// What is locked, for a person.
        what: String,
        /// Who has it, where that is known.
        pid: Option<u32>,
    },
    /// The file or its folder cannot be used.
    #[error(
        "{path} could not be {doing}, and without it two programs could use one device: check the folder and who owns it"
    )]
    System {
        /// The file or folder.
        path: PathBuf,
        /// What was to be done, as a participle.
        doing: &'static str,
        /// The system's answer.
        source: io::Error,
    },
}

impl LockError {
    pub(crate) fn system(path: &Path, doing: &'static str) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::System {
            path,
            doing,
            source,
        }
    }
}

/// The folder for locks and sockets on this machine: [`SHARED_FOLDER`] where it was set up, else this
/// account's own, which [`use_folder`] makes.
pub fn standard_folder() -> PathBuf {
    let shared = Path::new(SHARED_FOLDER);
    if shared.is_dir() {
        return shared.to_owned();
    }
    let user = rustix::process::getuid().as_raw();
    let mut bases = PRIVATE_BASES.iter().map(Path::new);
    let base = bases.find(|base| base.is_dir());
    base.unwrap_or(Path::new("/tmp"))
        .join(format!("relit-{user}"))
}

/// Checks that this account may use `folder` and that nobody else can interfere there; makes it, for
/// this account alone, where it does not exist.
///
/// # Errors
/// [`LockError::System`] if it is a link, is not this account's or root's, can be written by
/// everybody, or is closed to this account.
pub fn use_folder(folder: &Path) -> Result<(), LockError> {
    match DirBuilder::new().mode(0o700).create(folder) {
        Err(error) if error.kind() != io::ErrorKind::AlreadyExists => Err(error),
        _ => check_folder(folder),
    }
    .map_err(LockError::system(folder, "used"))
}

fn check_folder(folder: &Path) -> io::Result<()> {
    let found = fs::symlink_metadata(folder)?;
    let owners = [0, rustix::process::getuid().as_raw()];
    if !found.is_dir() || !owners.contains(&found.uid()) || found.mode() & 0o002 != 0 {
        return Err(io::Error::other(
            "it has to be a folder of this account or of root in which not everybody can write",
        ));
    }
    access(folder, Access::EXEC_OK).map_err(|_| {
        io::Error::new(
            io::ErrorKind::PermissionDenied,
            format!("this account is not in the group that shares it (number {}); add it with `usermod --append --groups`, and log in again", found.gid()),
        )
    })
}

/// Something that only this process has, until this is dropped or the process dies.
#[derive(Debug)]
pub struct LockFile {
    _file: File,
}

impl LockFile {
    /// Takes the lock `path`, for what a person knows as `what`. Everybody who may write in the
    /// folder can take it after this process.
    ///
    /// # Errors
    /// [`LockError::Held`], or what the file system answers.
    pub fn take(path: &Path, what: &str) -> Result<Self, LockError> {
        let mut file = open_or_create(path).map_err(LockError::system(path, "opened"))?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                return Err(LockError::Held {
                    what: what.to_owned(),
                    pid: pid_in(&file),
                });
            }
            Err(TryLockError::Error(error)) => {
                return Err(LockError::system(path, "locked")(error));
            }
        }
        let written = file
            .set_len(0)
            .and_then(|()| write!(file, "{}", std::process::id()));
        written.map_err(LockError::system(path, "written"))?;
        Ok(Self { _file: file })
    }

    /// Takes a folder of sessions for one daemon, by a file in it.
    ///
    /// # Errors
    /// As [`LockFile::take`].
    pub fn lock_root(root: &Path) -> Result<Self, LockError> {
        Self::take(&root.join(ROOT_LOCK), &root.display().to_string())
    }

    /// Removes that file from a folder that nobody else has used yet.
    pub fn forget_root(root: &Path) {
        // Where it stays, the folder does too: there is nothing else to be done.
        let _ = fs::remove_file(root.join(ROOT_LOCK));
    }

    /// Takes a device, under whichever of its names, by a file in `folder`.
    ///
    /// # Errors
    /// As [`LockFile::take`] and [`use_folder`].
    pub fn lock_device(device: &Path, folder: &Path) -> Result<Self, LockError> {
        use_folder(folder)?;
        // A device has many names, one of which is the kernel's.
        let device = device.canonicalize().unwrap_or_else(|_| device.to_owned());
        let name = device.display().to_string();
        let file = format!("relit-capture{}.lock", name.replace('/', "-"));
        Self::take(&folder.join(file), &name)
    }
}

/// Opens a lock file to take it, and makes it where it does not exist.
fn open_or_create(path: &Path) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.read(true).write(true);
    match open(&mut options, path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => {}
        opened => return opened,
    }
    // Where the file system can neither link nor rename like this, the file is made in place, for this
    // account alone.
    let _ = create_shared(path);
    open(options.create(true).mode(0o600), path)
}

/// Makes an empty lock file with the permissions of its folder. It gets its name last, so that no other
/// account finds it before it may open it.
fn create_shared(path: &Path) -> io::Result<()> {
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    let folder = folder.unwrap_or(Path::new("."));
    let file = tempfile::NamedTempFile::new_in(folder)?;
    let mode = 0o600 | (fs::metadata(folder)?.mode() & 0o066);
    file.as_file()
        .set_permissions(PermissionsExt::from_mode(mode))?;
    file.persist_noclobber(path)?;
    Ok(())
}

/// Opens a plain file; fails on a link, and neither waits for nor sets off anything else.
fn open(options: &mut OpenOptions, path: &Path) -> io::Result<File> {
    let flags = OFlags::NOFOLLOW | OFlags::NONBLOCK | OFlags::NOCTTY;
    let file = options
        .custom_flags(flags.bits().cast_signed())
        .open(path)?;
    if file.metadata()?.is_file() {
        Ok(file)
    } else {
        Err(io::Error::other("it is not a plain file"))
    }
}

fn pid_in(file: &File) -> Option<u32> {
    let mut text = String::new();
    file.take(MAX_LENGTH).read_to_string(&mut text).ok()?;
    text.trim().parse().ok()
}

#[cfg(test)]
pub(crate) mod tests;
