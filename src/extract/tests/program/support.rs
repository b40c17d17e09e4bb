//! A folder with small videos, and the program.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use relit_test_support::{ffmpeg, turning};
use tempfile::TempDir;

pub(crate) const PROGRAM: &str = env!("CARGO_BIN_EXE_relit-extract");
/// What all runs have in common.
pub(crate) const SETTINGS: &str = "--mask mask.png --frames 24 --size 48 --align off";

pub(crate) struct Workshop {
    pub(crate) folder: TempDir,
}

impl Workshop {
    /// With these videos.
    pub(crate) fn with(videos: &[&str]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        for (number, video) in videos.iter().enumerate() {
            let object = "lt(hypot(X-50,Y-35),22)";
            let pattern = turning([96, 72], 24, 24, 40 * number as u32, object);
            let path = folder.path().join(video);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            let arguments = ["-f", "lavfi", "-i", &pattern, "-pix_fmt", "yuvj422p"];
            let encoding = ["-c:v", "mjpeg", "-q:v", "2", video];
            ffmpeg(folder.path(), &[&arguments[..], &encoding].concat());
        }
        let mask = image::GrayImage::from_fn(96, 72, |x, y| {
            let far = (f64::from(x) - 50.0).hypot(f64::from(y) - 35.0);
            image::Luma([if far < 22.0 { 255 } else { 0 }])
        });
        mask.save(folder.path().join("mask.png")).unwrap();
        fs::create_dir(folder.path().join("temporary")).unwrap();
        Self { folder }
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn command(&self, line: &str) -> Command {
        let mut command = Command::new(PROGRAM);
        command
            .args(line.split_whitespace())
            .env("TMPDIR", self.path("temporary"))
            .current_dir(self.folder.path());
        command
    }

    pub(crate) fn run(&self, line: &str) -> Output {
        self.command(line).output().unwrap()
    }

    /// Runs the program, asserts the exit code, and returns standard error.
    #[track_caller]
    pub(crate) fn errors(&self, code: i32, line: &str) -> String {
        let output = self.run(line);
        let errors = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(code), "{line}: {errors}");
        errors
    }

    /// Runs the program with `--json`, asserts the exit code, and returns its events.
    #[track_caller]
    pub(crate) fn events(&self, code: i32, line: &str) -> Vec<serde_json::Value> {
        let output = self.run(&format!("{line} --json"));
        let printed = String::from_utf8(output.stdout).unwrap();
        assert_eq!(output.status.code(), Some(code), "{line}: {printed}");
        let events = printed.lines().map(serde_json::from_str);
        events.collect::<Result<_, _>>().unwrap()
    }
}

/// All files under a folder by their relative names, those under temporary names left out.
pub(crate) fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    collect(folder, "", &mut found);
    found
}

fn collect(folder: &Path, prefix: &str, found: &mut BTreeMap<String, Vec<u8>>) {
    for entry in fs::read_dir(folder).into_iter().flatten() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        if name.starts_with('.') {
            continue;
        }
        let name = format!("{prefix}{name}");
        if path.is_dir() {
            collect(&path, &format!("{name}/"), found);
        } else {
            found.insert(name, fs::read(&path).unwrap());
        }
    }
}
