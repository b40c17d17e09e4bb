//! `relit-extract` with URLs, over `file://`. `tests/objects/s3` does the same with an S3 server.

use std::fs;

use relit_test_support::is_named;

use super::support::{SETTINGS, Workshop, files};

/// Two sessions, each a folder with a video, and the URL of their folder.
fn workshop() -> (Workshop, String) {
    let workshop = Workshop::with(&["in/a/video.mkv", "in/b/video.mkv"]);
    let url = format!("file://{}", workshop.folder.path().display());
    (workshop, url)
}

pub(crate) fn a_data_set_at_a_url_is_that_of_a_folder_and_nothing_stays_on_the_way() {
    let (workshop, url) = workshop();
    for layout in ["webdataset", "paper"] {
        let line = format!("{SETTINGS} --layout {layout}");
        workshop.errors(0, &format!("in {line} -o whole-{layout}"));
        let whole = files(&workshop.path(&format!("whole-{layout}")));
        let remote = format!("{url}/in {line} -o {url}/out-{layout}");
        workshop.errors(0, &remote);
        let out = workshop.path(&format!("out-{layout}"));
        assert!(files(&out) == whole, "{:?}", files(&out).keys());
        assert_eq!(fs::read_dir(workshop.path("temporary")).unwrap().count(), 0);
        // What is there is skipped, and what is gone is made again.
        let again = || {
            let events = workshop.events(0, &format!("{remote} --resume"));
            let done = events.last().unwrap();
            ["extracted", "skipped"].map(|count| done[count].clone())
        };
        assert_eq!(again(), [0, 2]);
        fs::remove_file(out.join("a.parquet")).unwrap();
        assert_eq!(again(), [1, 1]);
        assert!(files(&out) == whole);
    }
}

pub(crate) fn tasks_write_to_a_url_and_are_merged_and_summed_there() {
    let (workshop, url) = workshop();
    workshop.errors(0, &format!("in {SETTINGS} -o whole"));
    let part = |index: u32| format!("{url}/in {SETTINGS} -o {url}/out --resume --task {index}/2");
    workshop.errors(0, &part(0));
    let errors = workshop.errors(1, &format!("merge {url}/out"));
    assert!(is_named(&errors, &["task 1", &url]), "{errors}");
    let errors = workshop.errors(3, &format!("stats {url}/out"));
    assert!(is_named(&errors, &["1", "2 tasks", &url]), "{errors}");
    workshop.errors(0, &part(1));
    workshop.errors(0, &format!("merge {url}/out"));
    workshop.errors(0, &format!("stats {url}/out"));
    let mut merged = files(&workshop.path("out"));
    merged.retain(|name, _| !name.starts_with("tasks/"));
    assert!(merged == files(&workshop.path("whole")));
    fs::remove_file(workshop.path("out/b.tar")).unwrap();
    let errors = workshop.errors(1, &format!("merge {url}/out"));
    assert!(errors.contains("b.tar"), "{errors}");
}

pub(crate) fn what_is_not_there_and_credentials_in_a_url_are_refused_in_one_sentence() {
    let (workshop, url) = workshop();
    let errors = workshop.errors(1, &format!("{url}/nowhere {SETTINGS} -o {url}/out"));
    assert!(is_named(&errors, &[&format!("{url}/nowhere")]), "{errors}");
    let errors = workshop.errors(1, &format!("s3://key:secret@lab/in {SETTINGS} -o out"));
    assert!(
        is_named(&errors, &["s3://"]) && !errors.contains("secret"),
        "{errors}"
    );
    let errors = workshop.errors(1, &format!("verify {url}/out"));
    assert!(is_named(&errors, &[&url]), "{errors}");
    assert_eq!(errors.lines().count(), 1, "{errors}");
}
