//! The program `relit-extract` on finished data sets: merged, and turned from one layout into the other.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use relit_data::shard::{Dataset, Layout};

use super::support::{BUST, COW, Place, fixture};

impl Place {
    /// Extracts a session that comes with the repository.
    fn extract(&self, session: &str, more: &str) {
        let session = fixture(session);
        let (session, mask) = (session.display(), session.join("mask_gt.png"));
        let mask = mask.display();
        let settings = "--frames 40 --size 32 --align off";
        self.events(0, &format!("{session} --mask {mask} {settings} {more}"));
    }

    #[track_caller]
    fn assert_sound(&self, out: &str, samples: u64) {
        let report = relit_data::shard::verify(&self.path(out), &|_, _| {}).unwrap();
        assert_eq!((report.problems, report.samples), (Vec::new(), samples));
    }

    /// All files under a folder, with their bytes.
    fn files(&self, out: &str) -> BTreeMap<PathBuf, Vec<u8>> {
        let (mut files, mut folders) = (BTreeMap::new(), vec![self.path(out)]);
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    folders.push(path);
                } else {
                    let bytes = fs::read(&path).unwrap();
                    let name = path.strip_prefix(self.path(out)).unwrap().to_owned();
                    files.insert(name, bytes);
                }
            }
        }
        files
    }

    /// What lies in the folder, with hidden files.
    fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(self.folder()).unwrap();
        let mut names: Vec<String> = entries
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }
}

#[track_caller]
fn assert_same(one: &BTreeMap<PathBuf, Vec<u8>>, other: &BTreeMap<PathBuf, Vec<u8>>) {
    assert_eq!(
        one.keys().collect::<Vec<_>>(),
        other.keys().collect::<Vec<_>>()
    );
    for (name, bytes) in one {
        assert!(Some(bytes) == other.get(name), "{} differs", name.display());
    }
}

#[test]
fn merged_data_sets_are_the_files_of_one_extraction_of_all() {
    for layout in ["webdataset", "paper"] {
        let place = Place::new();
        for (session, out) in [(COW, "a"), (BUST, "b"), (COW, "both"), (BUST, "both")] {
            place.extract(session, &format!("--layout {layout} -o {out}"));
        }
        // An empty folder may be there already.
        fs::create_dir(place.path("c")).unwrap();
        let events = place.events(0, "merge b a -o c");
        let merged = events.last().unwrap();
        assert_eq!(
            (&merged["sessions"], &merged["datasets"]),
            (&2.into(), &2.into())
        );
        assert_eq!(merged["samples"], 80);
        place.assert_sound("c", 80);
        assert_same(&place.files("c"), &place.files("both"));
        assert_eq!(place.names(), ["a", "b", "both", "c"]);
    }
}

#[test]
fn data_sets_that_do_not_fit_together_are_not_merged() {
    let place = Place::new();
    place.extract(COW, "-o a");
    place.extract(COW, "-o same");
    place.extract(BUST, "-o b --margin 0.1");
    place.extract(BUST, "-o full");
    for line in [
        "merge a same -o c",
        "merge a b -o c",
        "merge a missing -o c",
        "merge a full -o b",
        "merge a full -o a",
        "merge a file:///b -o c",
    ] {
        place.events(1, line);
        assert_eq!(place.names(), ["a", "b", "full", "same"], "{line}");
    }
    for line in ["merge a -o c", "merge a b", "merge"] {
        assert_eq!(place.run(line).status.code(), Some(2), "{line}");
    }
}

#[test]
fn what_is_broken_or_damaged_decides_the_exit_code_of_a_merge() {
    let place = Place::new();
    let fixture = |name: &str| {
        let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures");
        fixtures.join(name)
    };
    let (cow, mask) = (fixture(COW), fixture(BUST).join("mask_gt.png"));
    let (cow, mask) = (cow.display(), mask.display());
    let settings = "--frames 40 --size 32 --align off";
    place.events(3, &format!("{cow} --mask {mask} {settings} -o misfit"));
    place.extract(BUST, "-o b");
    place.events(3, "merge misfit b -o c");
    place.assert_sound("c", 80);
    let tar = place.path(format!("b/{BUST}.tar"));
    let mut bytes = fs::read(&tar).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&tar, bytes).unwrap();
    place.events(1, "merge misfit b -o d");
    place.events(1, "convert b -o e --layout paper");
    assert_eq!(place.names(), ["b", "c", "misfit"]);
}

#[test]
fn pieces_of_tasks_are_merged_first() {
    let place = Place::new();
    place.extract(COW, "-o tasks --task 0/1");
    place.extract(BUST, "-o b");
    place.events(1, "merge tasks b -o c");
    place.events(0, "merge tasks");
    place.events(0, "merge tasks b -o c");
    place.assert_sound("c", 80);
}

#[test]
fn a_converted_data_set_is_what_an_extraction_in_that_layout_gives() {
    let place = Place::new();
    for layout in ["webdataset", "paper"] {
        for session in [COW, BUST] {
            place.extract(session, &format!("--layout {layout} -o {layout}"));
        }
    }
    for (from, to) in [("webdataset", "paper"), ("paper", "webdataset")] {
        let out = format!("{to}-again");
        let events = place.events(0, &format!("convert {from} -o {out} --layout {to}"));
        let converted = events.last().unwrap();
        assert_eq!(
            (&converted["sessions"], &converted["samples"]),
            (&2.into(), &80.into())
        );
        assert_same(&place.files(&out), &place.files(to));
        place.assert_sound(&out, 80);
        // It is there now.
        place.events(1, &format!("convert {from} -o {out} --layout {to}"));
    }
    let dataset = Dataset::read(&place.path("paper-again")).unwrap();
    assert_eq!(dataset.settings.layout, Layout::Paper);
    place.events(1, "convert paper -o c --layout paper");
    place.events(1, "convert missing -o c --layout paper");
    assert!(!place.path("c").exists());
}

#[test]
fn damage_in_a_folder_of_images_ends_a_conversion_and_leaves_nothing() {
    let place = Place::new();
    place.extract(COW, "--layout paper -o a");
    let image = |name: &str| place.path(format!("a/imgs/{COW}/{name}"));
    fs::copy(image("7.png"), image("8.png")).unwrap();
    place.events(1, "convert a -o b --layout webdataset");
    fs::remove_file(image("8.png")).unwrap();
    place.events(1, "convert a -o b --layout webdataset");
    assert_eq!(place.names(), ["a"]);
}

#[test]
fn a_removed_session_leaves_no_file_and_a_sound_data_set() {
    for layout in ["webdataset", "paper"] {
        let place = Place::new();
        for session in [COW, BUST] {
            place.extract(session, &format!("--layout {layout} -o all"));
        }
        place.extract(BUST, &format!("--layout {layout} -o bust"));
        place.events(1, &format!("remove all {COW} nobody"));
        place.assert_sound("all", 80);
        let events = place.events(0, &format!("remove all {COW}"));
        assert_eq!(events[0]["event"], "removed");
        assert_eq!(events[0]["sessions"], serde_json::json!([COW]));
        assert_same(&place.files("all"), &place.files("bust"));
        place.events(1, &format!("remove all {COW}"));
    }
    let place = Place::new();
    place.events(1, "remove missing x");
    assert_eq!(place.run("remove missing").status.code(), Some(2));
}

#[test]
fn flawed_sessions_of_a_merged_data_set_are_named() {
    let place = Place::new();
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures");
    let (cow, mask) = (fixtures.join(COW), fixtures.join(BUST).join("mask_gt.png"));
    let settings = "--frames 40 --size 32 --align off";
    place.events(
        3,
        &format!(
            "{} --mask {} {settings} -o a",
            cow.display(),
            mask.display()
        ),
    );
    place.extract(BUST, "-o b");
    for line in ["merge a b -o c", "convert a -o d --layout paper"] {
        let events = place.events(3, line);
        let flawed = &events.last().unwrap()["flawed"];
        assert_eq!(*flawed, serde_json::json!([COW]), "{line}");
    }
}

#[test]
fn a_mask_that_does_not_exist_is_told_once_and_before_the_recordings() {
    let place = Place::new();
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures");
    let events = place.events(1, &format!("{} --mask nowhere -o a", fixtures.display()));
    assert_eq!(events.len(), 1, "{events:?}");
    assert!(place.names().is_empty());
}
