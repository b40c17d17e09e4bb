//! Several accounts within one test, where it runs as root.
#![allow(clippy::unwrap_used, reason = "a test's own mistakes should be loud")]

use std::fs::{self, Permissions};
use std::os::unix::fs::{PermissionsExt, chown};
use std::path::Path;
use std::thread;

use rustix::process::{Gid, Uid, getuid};
use rustix::thread::{set_thread_groups, set_thread_res_gid, set_thread_res_uid};

/// The account that a service runs as, and that of a person; both are in the group of the rig.
pub(crate) const SERVICE: u32 = 64_001;
pub(crate) const OPERATOR: u32 = 64_002;
/// An account that is not in it.
pub(crate) const OUTSIDER: u32 = 64_003;
const GROUP: u32 = 64_010;

/// Runs `work` as an account: Linux lets each thread of a process have its own.
pub(crate) fn as_user<T: Send>(user: u32, work: impl FnOnce() -> T + Send) -> T {
    let become_user = move || {
        let groups = [Gid::from_raw(GROUP)];
        set_thread_groups(if user == OUTSIDER { &[] } else { &groups })?;
        let group = Gid::from_raw(user);
        set_thread_res_gid(group, group, group)?;
        let user = Uid::from_raw(user);
        set_thread_res_uid(user, user, user)
    };
    thread::scope(|scope| {
        let working = scope.spawn(move || {
            become_user().unwrap();
            work()
        });
        working.join().unwrap()
    })
}

/// Shares a folder as `docs/rig/relit-tmpfiles.conf` does; false, and a word, where this is not root.
pub(crate) fn share(folder: &Path) -> bool {
    if !getuid().is_root() {
        relit_test_support::say_skipped("only root can be several accounts");
        return false;
    }
    chown(folder, Some(0), Some(GROUP)).unwrap();
    fs::set_permissions(folder, Permissions::from_mode(0o2770)).unwrap();
    true
}
