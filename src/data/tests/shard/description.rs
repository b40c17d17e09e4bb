//! `dataset.json`: what is written is read back, and unsafe content is refused.

use std::fs;

use relit_data::rig::{RigFacts, RotationDirection};
use relit_data::shard::{Dataset, Digest, FileEntry, Layout, SessionEntry, ShardError, ShardFiles};

use crate::sample_set::{self, settings};

fn entry(id: &str) -> SessionEntry {
    let files = ShardFiles {
        shards: Vec::new(),
        table: FileEntry {
            file: format!("{id}.parquet"),
            bytes: 0,
            blake3: Digest::hash(b""),
        },
    };
    sample_set::entry(id, &files, &[])
}

#[test]
fn a_description_comes_back_as_it_was_written() {
    let dir = tempfile::tempdir().unwrap();
    let mut dataset = Dataset::new(settings(Layout::Webdataset));
    dataset.replace(entry("b"), Vec::new());
    dataset.replace(entry("a"), Vec::new());
    let changed = SessionEntry {
        spec_net: 4,
        rig: Some(RigFacts {
            rotation: Some(RotationDirection::Clockwise),
            camera_elevation_deg: Some(21.5),
        }),
        warnings: vec!["a warning".to_owned()],
        ..entry("b")
    };
    dataset.replace(changed.clone(), Vec::new());
    dataset.write(dir.path()).unwrap();
    let back = Dataset::read(dir.path()).unwrap();
    assert_eq!(back, dataset);
    assert_eq!(back.sessions, [entry("a"), changed]);
}

#[test]
fn a_description_without_the_digest_of_an_index_is_read() {
    let dir = tempfile::tempdir().unwrap();
    let mut dataset = Dataset::new(settings(Layout::Webdataset));
    let mut bare = entry("a");
    bare.input.index_blake3 = None;
    dataset.replace(bare, Vec::new());
    dataset.write(dir.path()).unwrap();
    let text = fs::read_to_string(dir.path().join(Dataset::FILE)).unwrap();
    assert!(!text.contains("index_blake3"), "{text}");
    assert_eq!(Dataset::read(dir.path()).unwrap(), dataset);
}

#[test]
fn a_folder_without_a_description_and_one_of_another_version_are_told_apart() {
    let dir = tempfile::tempdir().unwrap();
    let read = || Dataset::read(dir.path()).unwrap_err();
    let write = |text: &str| fs::write(dir.path().join(Dataset::FILE), text).unwrap();
    assert!(matches!(read(), ShardError::NoDataset(_)));
    write(r#"{"schema": "relit.dataset/2"}"#);
    let other = read();
    assert!(matches!(other, ShardError::Description { .. }));
    assert!(other.to_string().contains("relit.dataset/2"), "{other}");
    write("{");
    assert!(matches!(read(), ShardError::Description { .. }));
}

#[test]
fn a_description_that_points_out_of_its_folder_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let mut dataset = Dataset::new(settings(Layout::Webdataset));
    let mut bad = entry("a");
    bad.table.file = "../a.parquet".to_owned();
    dataset.replace(bad, Vec::new());
    assert!(matches!(
        dataset.write(dir.path()),
        Err(ShardError::Refused(_))
    ));
    let json = serde_json::to_vec(&dataset).unwrap();
    fs::write(dir.path().join(Dataset::FILE), json).unwrap();
    assert!(matches!(
        Dataset::read(dir.path()),
        Err(ShardError::Refused(_))
    ));
}
