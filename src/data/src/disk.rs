//! A full disk: how it is recognised, and the words that every message about it begins with.

use std::io;

/// The words that every message about a full disk begins with. What does not fit, where, and the way out follow.
pub const DISK_FULL: &str = "the disk is full";

/// True if a write failed because a disk, a quota or a limit on file sizes is exhausted.
///
/// ```
/// use std::io::{Error, ErrorKind};
/// use relit_data::disk::is_full;
///
/// assert!(is_full(&Error::from(ErrorKind::StorageFull)));
/// assert!(!is_full(&Error::from(ErrorKind::PermissionDenied)));
/// ```
pub fn is_full(error: &io::Error) -> bool {
    use io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
    matches!(error.kind(), StorageFull | QuotaExceeded | FileTooLarge)
}
