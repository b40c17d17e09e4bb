//! A data set at a glance, by its description and its tables.

use std::fs;
use std::path::Path;

use relit_data::report::render_overview;
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
    let mut dataset = Dataset::read(dir.path()).unwrap();
    let sessions = Overview::read(dir.path()).unwrap().sessions;
    for (entry, summed) in dataset.sessions.iter_mut().zip(sessions) {
        entry.quality = Some(summed.quality);
    }
    dataset.write(dir.path()).unwrap();
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
    assert_eq!(overview.count(Some(QualityVerdict::Broken)), 1);
    assert_eq!(overview.count(None), 0);
    assert_eq!(overview.sessions[1].quality.shift_max_px, Some(0.5));
    // Sample 0 has no highlight, later ones more and more.
    let profile = &overview.sessions[0].profile;
    assert_eq!((profile[0], profile.len()), (0.0, SAMPLES as usize));
    assert!(profile[SAMPLES as usize - 1] > 0.0);
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
    assert!(matches!(error, ShardError::NoDataset { .. }), "{error}");
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
fn the_page_shows_every_session_and_leads_to_their_pages_only_from_beside_them() {
    let dir = two_sessions();
    let mut overview = Overview::read(dir.path()).unwrap();
    let mut report = overview.sessions[0].entry.table.clone();
    report.file = "a.html".to_owned();
    overview.sessions[0].entry.report = Some(report);
    overview.sessions[0].entry.object = "<mug>".to_owned();
    let html = render_overview("out", &overview, true);
    assert!(html.contains("<a href=\"a.html\">") && html.contains("&lt;mug&gt;"));
    assert_eq!(html.matches("class=\"small\"").count(), 2);
    assert!(html.contains("<b class=\"badge broken\">broken</b> 1"));
    assert!(!html.contains("not judged"));
    assert!(html.contains("the picture is blurred in 14 samples"));
    let elsewhere = render_overview("out", &overview, false);
    for outside in [
        "href=", "http://", "https://", "<script", "url(", "NaN", "inf",
    ] {
        assert!(!elsewhere.contains(outside), "{outside}");
    }
    overview.sessions.clear();
    assert!(!render_overview("out", &overview, true).contains("NaN"));
}

/// Written before records had `blur`, tables its column, and descriptions `quality`.
#[test]
fn a_data_set_of_an_earlier_version_is_read_verified_and_summed_and_not_judged() {
    let earlier = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/earlier");
    sample_set::assert_intact(&earlier);
    let overview = Overview::read(&earlier).unwrap();
    assert_eq!(overview.problems, Vec::<String>::new());
    assert_eq!(overview.sessions[0].entry.quality, None);
    assert_eq!(overview.sessions[0].verdict(), None);
    assert_eq!(overview.count(None), 1);
    assert_eq!(overview.count(Some(QualityVerdict::Good)), 0);
    assert_eq!(overview.totals().samples, 12);
    let html = render_overview("out", &overview, false);
    assert_eq!(
        html.matches("<b class=\"badge none\">not judged</b>")
            .count(),
        2
    );
}

#[test]
fn figures_that_are_not_those_of_the_records_are_a_problem() {
    let dir = sample_set::dataset(Layout::Webdataset);
    let mut dataset = Dataset::read(dir.path()).unwrap();
    let quality = Overview::read(dir.path())
        .unwrap()
        .sessions
        .remove(0)
        .quality;
    let wrong = SessionQuality {
        identical: 3,
        ..quality.clone()
    };
    dataset.sessions[0].quality = Some(quality);
    dataset.write(dir.path()).unwrap();
    sample_set::assert_intact(dir.path());
    dataset.sessions[0].quality = Some(wrong);
    dataset.write(dir.path()).unwrap();
    let problems = sample_set::verified(dir.path()).problems;
    assert_eq!(problems.len(), 1, "{SESSION}");
    assert!(problems[0].what.contains("under quality"));
}
