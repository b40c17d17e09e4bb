#![allow(clippy::unwrap_used, reason = "a test's own mistakes should be loud")]

pub(crate) mod accounts;

use std::os::unix::fs::{chown, symlink};

use super::*;
use accounts::{OPERATOR, OUTSIDER, SERVICE, as_user, share};

#[test]
fn a_lock_is_taken_once_and_the_refusal_names_the_holder() {
    let root = tempfile::tempdir().unwrap();
    let held = LockFile::lock_root(root.path()).unwrap();
    let error = LockFile::lock_root(root.path()).unwrap_err();
    let pid = std::process::id();
    assert!(
        matches!(error, LockError::Held { pid: Some(holder), .. } if holder == pid),
        "{error}"
    );
    drop(held);
    LockFile::lock_root(root.path()).unwrap();
}

#[test]
fn every_name_of_a_device_leads_to_one_lock() {
    let folder = tempfile::tempdir().unwrap();
    let link = folder.path().join("camera");
    symlink("/dev/null", &link).unwrap();
    let _held = LockFile::lock_device(Path::new("/dev/null"), folder.path()).unwrap();
    let again = LockFile::lock_device(&link, folder.path());
    assert!(matches!(again, Err(LockError::Held { .. })), "{again:?}");
}

#[test]
fn a_lock_that_is_a_link_or_no_plain_file_is_refused_and_what_it_leads_to_kept() {
    let folder = tempfile::tempdir().unwrap();
    let (target, path) = (folder.path().join("target"), folder.path().join("lock"));
    fs::write(&target, "precious").unwrap();
    symlink(&target, &path).unwrap();
    assert!(matches!(
        LockFile::take(&path, "x"),
        Err(LockError::System { .. })
    ));
    assert_eq!(fs::read_to_string(&target).unwrap(), "precious");
    fs::remove_file(&path).unwrap();
    rustix::fs::mknodat(
        rustix::fs::CWD,
        &path,
        rustix::fs::FileType::Fifo,
        rustix::fs::Mode::RUSR | rustix::fs::Mode::WUSR,
        0,
    )
    .unwrap();
    assert!(LockFile::take(&path, "x").is_err());
}

#[test]
fn a_folder_that_everybody_can_write_in_or_that_is_a_link_is_not_used() {
    let base = tempfile::tempdir().unwrap();
    let folder = base.path().join("locks");
    use_folder(&folder).unwrap();
    assert_eq!(fs::metadata(&folder).unwrap().mode() & 0o777, 0o700);
    fs::set_permissions(&folder, PermissionsExt::from_mode(0o777)).unwrap();
    assert!(use_folder(&folder).is_err());
    fs::set_permissions(&folder, PermissionsExt::from_mode(0o700)).unwrap();
    let link = base.path().join("link");
    symlink(&folder, &link).unwrap();
    assert!(use_folder(&link).is_err());
}

#[test]
fn accounts_of_one_group_see_and_take_each_others_locks_and_no_other_account_does() {
    let folder = tempfile::tempdir().unwrap();
    if !share(folder.path()) {
        return;
    }
    let path = folder.path().join("lock");
    let take = || {
        use_folder(folder.path()).unwrap();
        LockFile::take(&path, "x")
    };
    let of_service = as_user(SERVICE, take).unwrap();
    as_user(OPERATOR, || {
        assert!(matches!(take(), Err(LockError::Held { .. })));
    });
    drop(of_service);
    drop(as_user(OPERATOR, take).unwrap());
    drop(as_user(SERVICE, take).unwrap());
    as_user(OUTSIDER, || {
        let refused = use_folder(folder.path()).unwrap_err();
        let LockError::System { path, source, .. } = &refused else {
            panic!("{refused}");
        };
        assert_eq!(path, folder.path());
        assert_eq!(source.kind(), io::ErrorKind::PermissionDenied);
    });
}

#[test]
fn another_accounts_folder_is_not_used() {
    let folder = tempfile::tempdir().unwrap();
    if !share(folder.path()) {
        return;
    }
    chown(folder.path(), Some(SERVICE), None).unwrap();
    assert!(as_user(OPERATOR, || use_folder(folder.path())).is_err());
}

#[test]
fn a_new_lock_has_its_folders_permissions_and_nothing_else_stays_there() {
    let folder = tempfile::tempdir().unwrap();
    fs::set_permissions(folder.path(), PermissionsExt::from_mode(0o770)).unwrap();
    let path = folder.path().join("lock");
    let _held = LockFile::take(&path, "x").unwrap();
    assert_eq!(fs::metadata(&path).unwrap().mode() & 0o777, 0o660);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}
