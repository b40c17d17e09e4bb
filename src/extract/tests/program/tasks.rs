//! Several tasks that write one data set, and their merge.

use std::fs;

use relit_test_support::is_named;
use serde_json::Value;

use crate::support::{SETTINGS, Workshop, files};

const VIDEOS: &str = "a.mkv b.mkv c.mkv d.mkv";

fn workshop() -> Workshop {
    Workshop::with(&["a.mkv", "b.mkv", "c.mkv", "d.mkv"])
}

fn part(index: u32, count: u32) -> String {
    format!("{VIDEOS} {SETTINGS} -o out --resume --task {index}/{count}")
}

pub(crate) fn tasks_at_the_same_time_and_a_merge_make_the_same_data_set_as_one_run() {
    let workshop = workshop();
    workshop.errors(0, &format!("{VIDEOS} {SETTINGS} -o whole"));
    let whole = files(&workshop.path("whole"));
    let running: Vec<_> = (0..3)
        .map(|index| workshop.command(&part(index, 3)).spawn().unwrap())
        .collect();
    for mut child in running {
        assert!(child.wait().unwrap().success());
    }
    for _ in 0..2 {
        workshop.errors(0, "merge out");
        let mut merged = files(&workshop.path("out"));
        merged.retain(|name, _| !name.starts_with("tasks/"));
        assert!(merged == whole, "{:?}", merged.keys());
    }
    workshop.errors(0, "verify out");
}

pub(crate) fn a_task_that_is_missing_or_was_killed_is_named_and_nothing_is_written() {
    let workshop = workshop();
    workshop.errors(0, &part(0, 3));
    workshop.errors(0, &part(2, 3));
    let errors = workshop.errors(1, "merge out");
    assert!(is_named(&errors, &["task 1"]), "{errors}");
    // A task that was killed after its first of two recordings: the second is not in its piece.
    workshop.errors(0, &part(1, 3));
    let piece = workshop.path("out/tasks/0-of-3.json");
    let whole = fs::read_to_string(&piece).unwrap();
    let mut cut: serde_json::Value = serde_json::from_str(&whole).unwrap();
    cut["outcomes"].as_object_mut().unwrap().remove("3");
    fs::write(&piece, cut.to_string()).unwrap();
    let errors = workshop.errors(1, "merge out");
    assert!(is_named(&errors, &["task 0", "d.mkv"]), "{errors}");
    assert!(!workshop.path("out/dataset.json").exists());
    // Requeued, it goes on.
    let events = workshop.events(0, &part(0, 3));
    let done = events.last().unwrap();
    let counts = ["extracted", "lossy", "skipped"].map(|count| done[count].clone());
    assert_eq!(counts, [0, 0, 2]);
    assert_eq!(fs::read_to_string(&piece).unwrap(), whole);
    workshop.errors(0, "merge out");
}

pub(crate) fn a_merge_names_what_failed_and_refuses_tasks_of_different_inputs() {
    let workshop = workshop();
    fs::create_dir(workshop.path("x")).unwrap();
    fs::copy(workshop.path("a.mkv"), workshop.path("x/a.mkv")).unwrap();
    for (index, code) in [(0, 0), (1, 1)] {
        let line = format!("a.mkv x/a.mkv {SETTINGS} -o twice --task {index}/2");
        workshop.errors(code, &line);
    }
    // The first is there, and the other is named.
    let errors = workshop.errors(3, "merge twice");
    assert!(errors.contains("a.mkv"), "{errors}");
    assert!(workshop.path("twice/dataset.json").exists());

    fs::write(workshop.path("bad.mkv"), "no video").unwrap();
    workshop.errors(1, &format!("bad.mkv {SETTINGS} -o bad --task 0/1"));
    let errors = workshop.errors(1, "merge bad");
    assert!(errors.contains("bad.mkv"), "{errors}");
    assert!(!workshop.path("bad/dataset.json").exists());

    workshop.errors(0, &part(0, 2));
    workshop.errors(0, &format!("b.mkv d.mkv {SETTINGS} -o out --task 1/2"));
    let errors = workshop.errors(1, "merge out");
    assert!(
        is_named(&errors, &["task", "0", "1", "recordings"]),
        "{errors}"
    );
}

pub(crate) fn a_session_that_no_task_made_and_a_file_that_is_gone_are_noticed() {
    let workshop = workshop();
    workshop.errors(0, &part(0, 1));
    fs::remove_file(workshop.path("out/c.parquet")).unwrap();
    let errors = workshop.errors(1, "merge out");
    assert!(errors.contains("c.parquet"), "{errors}");
    workshop.errors(0, &part(0, 1));
    workshop.errors(0, "merge out");
    fs::copy(workshop.path("a.mkv"), workshop.path("e.mkv")).unwrap();
    workshop.errors(0, &format!("e.mkv {SETTINGS} -o out"));
    let errors = workshop.errors(1, "merge out");
    assert!(
        is_named(&errors, &["session e", "dataset.json"]),
        "{errors}"
    );
}

pub(crate) fn another_number_of_tasks_takes_over_what_the_data_set_has() {
    let workshop = workshop();
    for index in 0..2 {
        workshop.errors(0, &part(index, 2));
    }
    workshop.errors(0, "merge out");
    let whole = files(&workshop.path("out"));
    fs::remove_dir_all(workshop.path("out/tasks")).unwrap();
    for index in 0..3 {
        let events = workshop.events(0, &part(index, 3));
        assert_eq!(events.last().unwrap()["extracted"], 0, "{events:?}");
    }
    workshop.errors(0, "merge out");
    let mut merged = files(&workshop.path("out"));
    merged.retain(|name, _| !name.starts_with("tasks/"));
    assert!(
        merged
            .iter()
            .all(|(name, bytes)| whole.get(name) == Some(bytes))
    );
}

fn warnings(events: &[Value]) -> impl Iterator<Item = &str> {
    let warnings = events.iter().filter(|event| event["event"] == "warning");
    warnings.filter_map(|event| event["message"].as_str())
}

pub(crate) fn a_task_without_recordings_says_so() {
    let workshop = workshop();
    let events = workshop.events(0, &part(7, 100));
    assert_eq!(events[0]["task"], "7-of-100");
    assert!(
        warnings(&events).any(|text| is_named(text, &["7-of-100"])),
        "{events:?}"
    );
    let events = workshop.events(0, &part(0, 1));
    assert_eq!(events[0]["task"], "0-of-1");
    assert!(
        !warnings(&events).any(|text| is_named(text, &["0-of-1"])),
        "{events:?}"
    );
}

#[cfg(not(feature = "object-store"))]
pub(crate) fn a_url_is_refused_by_a_program_without_object_stores() {
    let workshop = Workshop::with(&[]);
    for line in [
        "s3://lab/in -o out",
        "in -o s3://lab/out",
        "merge s3://lab/out",
        "stats s3://lab/out",
    ] {
        let errors = workshop.errors(1, line);
        assert!(
            is_named(&errors, &["s3://lab/", "object-store"]),
            "{errors}"
        );
    }
}
