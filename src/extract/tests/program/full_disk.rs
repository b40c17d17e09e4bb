//! A small file system that fills up, and files that may not be read or written.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::Command;

use relit_data::disk::DISK_FULL;
use relit_test_support::trials::Trial;
use relit_test_support::{is_named, trials};

use crate::support::{PROGRAM, SETTINGS, Workshop, files};

/// The system's numbers of its reasons, which stand behind its words.
const NO_SPACE: &str = "(os error 28)";
const NOT_PERMITTED: &str = "(os error 13)";

/// A file system in memory; unmounted when dropped.
struct SmallDisk {
    path: PathBuf,
}

impl SmallDisk {
    fn mount(path: PathBuf, kilobytes: u64) -> Result<Self, String> {
        fs::create_dir_all(&path).unwrap();
        let size = format!("size={kilobytes}k");
        let mounted = Command::new("mount")
            .args(["-t", "tmpfs", "-o", &size, "tmpfs"])
            .arg(&path)
            .output();
        match mounted {
            Ok(output) if output.status.success() => Ok(Self { path }),
            Ok(output) => {
                let why = String::from_utf8_lossy(&output.stderr).trim().to_owned();
                Err(format!("no small file system can be mounted: {why}"))
            }
            Err(error) => Err(format!("no small file system can be mounted: {error}")),
        }
    }

    fn resize(&self, kilobytes: u64) {
        let size = format!("remount,size={kilobytes}k");
        let done = Command::new("mount")
            .args(["-o", &size])
            .arg(&self.path)
            .status();
        assert!(done.unwrap().success());
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(&self.path).status();
    }
}

pub(crate) fn trials() -> Vec<Trial> {
    let mut trials =
        trials![if small_disks => a_full_disk_ends_with_what_is_needed_and_leaves_no_partial_file];
    trials.extend(trials![if runs_without_rights =>
        what_may_not_be_read_or_written_is_named_with_the_systems_reason,
        a_folder_that_may_not_be_looked_into_is_named_and_the_others_go_on,
    ]);
    trials
}

/// Whether small file systems can be mounted.
fn small_disks() -> Result<(), String> {
    let folder = tempfile::tempdir().unwrap();
    SmallDisk::mount(folder.path().join("disk"), 64).map(drop)
}

fn a_full_disk_ends_with_what_is_needed_and_leaves_no_partial_file() {
    let workshop = Workshop::with(&["a.mkv"]);
    for layout in ["webdataset", "paper"] {
        let line = format!("a.mkv {SETTINGS} --layout {layout} --resume -o");
        workshop.errors(0, &format!("{line} whole-{layout}"));
        let whole = files(&workshop.path(&format!("whole-{layout}")));
        let kilobytes: u64 = whole.values().map(|bytes| bytes.len() as u64).sum::<u64>() / 1024;
        // From too small for the first image to too small for the last file.
        for part in [4, 30, 60, 90] {
            let name = format!("{layout}-{part}");
            let disk = SmallDisk::mount(workshop.path(&name), 4 + kilobytes * part / 100).unwrap();
            let errors = workshop.errors(1, &format!("{line} {name}/out"));
            assert!(errors.contains(NO_SPACE), "{errors}");
            if part >= 30 {
                // What it needs.
                assert!(is_named(&errors, &[DISK_FULL, " MB"]), "{errors}");
            }
            for (file, bytes) in files(&disk.path.join("out")) {
                assert!(whole[&file] == bytes, "{file} is torn at {part} %");
            }
            disk.resize(16 * kilobytes + 1024);
            workshop.errors(0, &format!("{line} {name}/out"));
            assert!(files(&disk.path.join("out")) == whole, "{layout} {part}");
        }
    }
}

fn is_root() -> bool {
    let answer = Command::new("id").arg("-u").output().unwrap();
    answer.stdout == b"0\n"
}

/// Makes root's commands those of a user without rights.
fn without_rights(command: &mut Command) -> &mut Command {
    if is_root() {
        command.uid(65_534).gid(65_534);
    }
    command
}

/// Whether a program can be run as a user without rights.
fn runs_without_rights() -> Result<(), String> {
    match without_rights(Command::new("id").arg("-u")).output() {
        Ok(_) => Ok(()),
        Err(error) => Err(format!("no program can be run without rights: {error}")),
    }
}

/// Runs the program as a user without rights: its exit code and standard error.
fn as_nobody(workshop: &Workshop, line: &str) -> (Option<i32>, String) {
    let mut command = workshop.command(line);
    if is_root() {
        let program = workshop.path("program");
        if !program.exists() {
            fs::copy(PROGRAM, &program).unwrap();
            fs::set_permissions(workshop.folder.path(), fs::Permissions::from_mode(0o755)).unwrap();
        }
        command = Command::new(program);
        command
            .args(line.split_whitespace())
            .current_dir(workshop.folder.path());
    }
    let output = without_rights(&mut command).output().unwrap();
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    (output.status.code(), errors)
}

fn forbid(path: &Path) {
    fs::set_permissions(path, fs::Permissions::from_mode(0o000)).unwrap();
}

fn what_may_not_be_read_or_written_is_named_with_the_systems_reason() {
    let workshop = Workshop::with(&["a.mkv", "b.mkv"]);
    let open = workshop.path("open");
    fs::create_dir(&open).unwrap();
    fs::set_permissions(&open, fs::Permissions::from_mode(0o777)).unwrap();
    let closed = workshop.path("closed");
    fs::create_dir(&closed).unwrap();
    fs::set_permissions(&closed, fs::Permissions::from_mode(0o555)).unwrap();
    forbid(&workshop.path("b.mkv"));
    let line = format!("a.mkv b.mkv {SETTINGS} -o open/out");
    let (code, errors) = as_nobody(&workshop, &line);
    assert_eq!(code, Some(3), "{errors}");
    assert!(is_named(&errors, &["b.mkv", NOT_PERMITTED]), "{errors}");
    assert!(open.join("out/a.tar").is_file() && !open.join("out/b.tar").exists());
    let line = format!("a.mkv {SETTINGS} -o closed");
    let (code, errors) = as_nobody(&workshop, &line);
    assert_eq!(code, Some(1), "{errors}");
    assert!(is_named(&errors, &["closed", NOT_PERMITTED]), "{errors}");
    assert!(files(&closed).is_empty());
}

fn a_folder_that_may_not_be_looked_into_is_named_and_the_others_go_on() {
    let workshop = Workshop::with(&["sessions/a/video.mkv"]);
    let closed = workshop.path("sessions/b");
    fs::create_dir(&closed).unwrap();
    forbid(&closed);
    let open = workshop.path("open");
    fs::create_dir(&open).unwrap();
    fs::set_permissions(&open, fs::Permissions::from_mode(0o777)).unwrap();
    let (code, errors) = as_nobody(&workshop, &format!("sessions {SETTINGS} -o open/out"));
    assert_eq!(code, Some(3), "{errors}");
    assert!(
        is_named(&errors, &["sessions/b", NOT_PERMITTED]),
        "{errors}"
    );
    assert!(open.join("out/a.tar").is_file());
}
