//! A data set at a glance, by its description and its tables.

use std::fs;

use relit_data::shard::{
    ArrayTask, Dataset, Layout, Overview, QualityVerdict, SessionQuality, ShardError, TaskOutcome,
    TaskPiece,
};

use crate::sample_set::{self, SAMPLES, SESSION};

fn two_sessions() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let indices: Vec<u32> = (0..SAMPLES).collect();
    for id in ["a", "b"] {
        sample_set::write_with(dir.path(), Layout::Webdataset, id, &indices, |sample| {
            if id == "b" {
                sample.record.blur = Some(1.5);
                sample.record.shift_px = Some([0.3, 0.4]);
            }
        });
    }
    dir
}

#[test]
fn sessions_are_summed_from_their_tables_alone() {
    let dir = two_sessions();
    for id in ["a", "b"] {
        fs::remove_file(dir.path().join(format!("{id}.tar"))).unwrap();
    }
    let overview = Overview::read(dir.path()).unwrap();
    assert_eq!(overview.problems, Vec::<String>::new());
    let totals = overview.totals();
    assert_eq!(
        (totals.samples, totals.objects),
        (2 * u64::from(SAMPLES), 1)
    );
    assert_eq!(totals.histogram.iter().sum::<u64>(), totals.samples);
    assert_eq!(totals.blurred, u64::from(SAMPLES));
    assert_eq!(overview.count(QualityVerdict::Broken), 1);
    assert_eq!(overview.sessions[1].0.quality.shift_max_px, Some(0.5));
}

#[test]
fn a_table_that_is_missing_or_damaged_is_named_and_the_others_are_summed() {
    let dir = two_sessions();
    let table = dir.path().join("a.parquet");
    let mut bytes = fs::read(&table).unwrap();
    bytes[100] ^= 1;
    fs::write(&table, bytes).unwrap();
    for says in ["BLAKE3", "could not open"] {
        let overview = Overview::read(dir.path()).unwrap();
        assert_eq!(overview.sessions.len(), 1);
        let [problem] = overview.problems.as_slice() else {
            panic!("{:?}", overview.problems);
        };
        assert!(
            problem.contains("session a is left out") && problem.contains(says),
            "{problem}"
        );
        let _ = fs::remove_file(&table);
    }
    let empty = tempfile::tempdir().unwrap();
    let error = Overview::read(empty.path()).unwrap_err();
    assert!(matches!(error, ShardError::NoDataset(_)), "{error}");
}

#[test]
fn what_tasks_have_written_so_far_is_summed_and_said_to_be_unmerged() {
    let dir = two_sessions();
    let dataset = Dataset::read(dir.path()).unwrap();
    fs::remove_file(dir.path().join(Dataset::FILE)).unwrap();
    fs::create_dir(dir.path().join("tasks")).unwrap();
    let names = ["a", "b", "c"].map(str::to_owned).to_vec();
    let mut piece = TaskPiece::new(ArrayTask::new(0, 2).unwrap(), names, dataset);
    for (position, session) in [(0, "a"), (2, "b")] {
        let session = session.to_owned();
        piece
            .outcomes
            .insert(position, TaskOutcome::Extracted { session });
    }
    piece.write(dir.path()).unwrap();
    let overview = Overview::read(dir.path()).unwrap();
    assert_eq!(overview.sessions.len(), 2);
    let problem = &overview.problems[0];
    assert!(
        problem.contains("1 of 2 tasks") && problem.contains("2 of 3"),
        "{problem}"
    );
    assert!(problem.contains("relit-extract merge"), "{problem}");
}

#[test]
fn figures_that_are_not_those_of_the_records_are_a_problem() {
    let dir = sample_set::dataset(Layout::Webdataset);
    let mut dataset = Dataset::read(dir.path()).unwrap();
    let wrong = SessionQuality {
        identical: 3,
        ..dataset.sessions[0].quality.clone()
    };
    sample_set::assert_intact(dir.path());
    dataset.sessions[0].quality = wrong;
    dataset.write(dir.path()).unwrap();
    let problems = sample_set::verified(dir.path()).problems;
    assert_eq!(problems.len(), 1, "{SESSION}");
    assert!(problems[0].what.contains("under quality"));
}
