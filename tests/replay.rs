//! Replay: every session folder in `fixtures/` is extracted by the program and compared with its
//! `expect.json` and `truth.json`. A new folder there is a new test, of the folder's name.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Output};

use relit_data::session::{FrameIndex, Recording};
use relit_data::shard::{Dataset, FrameRecord, ShardReader};
use relit_tests::trials::{self, free_trial};
use relit_tests::{is_named, program};
use serde::Deserialize;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Expect {
    /// Samples of a whole turn, where the fixture is part of one.
    partial_of: Option<u32>,
    samples: u32,
    duplicates: u32,
    lossy: bool,
    selection: String,
    warnings: Vec<Vec<String>>,
    saturated_tolerance: f64,
}

#[derive(Deserialize)]
struct Truth {
    by_sequence: Vec<FrameTruth>,
}

#[derive(Deserialize)]
struct FrameTruth {
    angle_deg: f64,
    saturated_fraction: f64,
}

fn fixtures() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fixtures");
    let mut found: Vec<PathBuf> = fs::read_dir(root)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.join("session.json").exists())
        .collect();
    found.sort();
    assert!(found.len() >= 5);
    found
}

fn read_json<T: for<'a> Deserialize<'a>>(path: &Path) -> T {
    let text = fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    serde_json::from_str(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

fn run(arguments: &[&str]) -> Output {
    Command::new(program("relit-extract"))
        .args(arguments)
        .output()
        .unwrap()
}

fn records(out: &Path, dataset: &Dataset) -> Vec<FrameRecord> {
    let shard = File::open(out.join(&dataset.shards[0].file)).unwrap();
    let mut records: Vec<FrameRecord> = ShardReader::new(shard)
        .map(|sample| serde_json::from_slice(sample.unwrap().member("json").unwrap()).unwrap())
        .collect();
    records.sort_by_key(|record| record.index);
    records
}

fn name_of(session: &Path) -> &str {
    session.file_name().unwrap().to_str().unwrap()
}

fn main() -> ExitCode {
    let trials = fixtures().into_iter().map(|session| {
        let name = name_of(&session).to_owned();
        free_trial(name, move || comes_out_as_it_says(&session))
    });
    trials::run(trials.collect())
}

fn comes_out_as_it_says(session: &Path) {
    let name = name_of(session);
    let expect: Expect = read_json(&session.join("expect.json"));
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let (from, to) = (session.to_str().unwrap(), out.to_str().unwrap());
    let mask = session.join("mask_gt.png");
    let samples = expect.partial_of.unwrap_or(expect.samples).to_string();
    let mut arguments = vec![
        from,
        "-o",
        to,
        "--mask",
        mask.to_str().unwrap(),
        "--frames",
        &samples,
        "--size",
        "64",
    ];
    if expect.partial_of.is_some() {
        let refused = run(&arguments);
        assert_eq!(refused.status.code(), Some(3), "{name}: {refused:?}");
        let said = String::from_utf8_lossy(&refused.stdout).into_owned();
        assert!(is_named(&said, &[from]), "{name}: {said}");
        assert!(!out.join(format!("{name}.tar")).exists(), "{name}");
        arguments.push("--partial");
    }
    let output = run(&arguments);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(
        output.status.code(),
        Some(if expect.lossy { 3 } else { 0 }),
        "{name}: {errors}"
    );
    let verified = run(&["verify", to]);
    assert_eq!(verified.status.code(), Some(0), "{name}: {verified:?}");

    let dataset = Dataset::read(&out).unwrap();
    check_entry(name, &expect, &dataset);
    let records = records(&out, &dataset);
    assert_eq!(records.len(), expect.samples as usize, "{name}");
    check_records(name, session, &expect, &records);
}

fn check_entry(name: &str, expect: &Expect, dataset: &Dataset) {
    let entry = dataset.session(name).unwrap();
    assert_eq!(
        (entry.samples, entry.duplicates),
        (expect.samples, expect.duplicates),
        "{name}"
    );
    assert_eq!(
        serde_json::to_value(entry.selection).unwrap(),
        expect.selection,
        "{name}"
    );
    assert_eq!(entry.lossy, expect.lossy, "{name}");
    assert_eq!(
        entry.warnings.len(),
        expect.warnings.len(),
        "{name}: {:?}",
        entry.warnings
    );
    for (found, things) in entry.warnings.iter().zip(&expect.warnings) {
        let things: Vec<&str> = things.iter().map(String::as_str).collect();
        assert!(
            is_named(found, &things),
            "{name}: {found:?} lacks {things:?}"
        );
    }
}

fn check_records(name: &str, session: &Path, expect: &Expect, records: &[FrameRecord]) {
    let truth: Truth = read_json(&session.join("truth.json"));
    let index: FrameIndex = Recording::open(session).unwrap().frames.unwrap();
    for record in records {
        let entry = index.entries()[record.source_frame as usize];
        let truth = &truth.by_sequence[entry.sequence as usize];
        assert_eq!(record.t_us, entry.t_us, "{name} {}", record.index);
        assert!(
            (record.angle_deg.unwrap() - truth.angle_deg).abs() < 1e-6,
            "{name}"
        );
        let off = (record.saturated_fraction - truth.saturated_fraction).abs();
        assert!(
            off <= expect.saturated_tolerance,
            "{name} {}: off by {off}",
            record.index
        );
        let far = (truth.saturated_fraction - 0.05).abs() > expect.saturated_tolerance;
        assert!(
            !far || record.spec_net == (truth.saturated_fraction > 0.05),
            "{name}"
        );
    }
}
