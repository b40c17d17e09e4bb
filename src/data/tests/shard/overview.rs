//! A data set at a glance, by its description.

use std::fs;

use relit_data::shard::{
    ArrayTask, Dataset, Layout, PartialManifest, SessionQuality, ShardError, TaskOutcome,
    read_partial,
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
fn what_tasks_have_written_so_far_is_summed_and_said_to_be_unmerged() {
    let dir = two_sessions();
    let dataset = Dataset::read(dir.path()).unwrap();
    fs::remove_file(dir.path().join(Dataset::FILE)).unwrap();
    fs::create_dir(dir.path().join("tasks")).unwrap();
    let names = ["a", "b", "c"].map(str::to_owned).to_vec();
    let mut piece = PartialManifest::new(ArrayTask::new(0, 2).unwrap(), names, dataset);
    for (position, session) in [(0, "a"), (2, "b")] {
        let session = session.to_owned();
        piece
            .outcomes
            .insert(position, TaskOutcome::Extracted { session });
    }
    piece.write(dir.path()).unwrap();
    let (dataset, problem) = read_partial(dir.path()).unwrap();
    assert_eq!(dataset.sessions.len(), 2);
    let problem = problem.unwrap();
    for named in ["1 ", "2 tasks", "3 recordings"] {
        assert!(problem.contains(named), "{named}: {problem}");
    }
    assert!(problem.contains("relit-extract merge"), "{problem}");
    let empty = tempfile::tempdir().unwrap();
    let error = read_partial(empty.path()).unwrap_err();
    assert!(matches!(error, ShardError::NoDataset(_)), "{error}");
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
    assert!(problems[0].what.contains("quality"));
}
