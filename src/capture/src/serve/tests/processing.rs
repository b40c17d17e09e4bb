//! Sessions processed by programs that only pretend: scripts that the tests write.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::sync::Arc;

use relit_data::geometry::Rect;
use relit_data::shard::{
    Align, Dataset, Digest, ExtractionSettings, FileEntry, ImageSize, Layout, MaskInfo,
    QualityVerdict, SamplingBasis, SessionEntry, SessionQuality, ShardEntry, SourceVideo,
};
use serde_json::{Value, json};

use super::{Fake, Serving, wait_until};
use crate::processing::{Processing, ProcessingPrograms};
use crate::state::{Phase, TakeSummary, Verdict};

const COW: &str = "20261120T101500Z-cow-short";
const BUST: &str = "20261120T102000Z-bust-short";
/// A mask that fits, and an extraction: what the programs leave.
const MASK: &str = r#"printf png > "$1/mask.png""#;
const FITS: &str = r#"echo '{"verdict":"fits","reasons":[]}' > "$1/mask-check.json""#;
const GOOD: &str = r#"mkdir -p "$3"; cp "$here/dataset.json" "$3""#;
/// Waits until the file `go` appears beside the script. It starts no other program meanwhile: a shell that is held
/// while it does so waits for that program, and does not count as stopped.
const WAIT: &str = r#"echo $$ > "$here/pid"; while [ ! -e "$here/go" ]; do :; done"#;

/// Scripts in place of the programs; `None` leaves one out. `relit-mask check` is one of its own here.
#[derive(Clone, Copy)]
struct Scripts<'a> {
    mask: Option<&'a str>,
    check: &'a str,
    extract: Option<&'a str>,
}

const ALL_WELL: Scripts<'_> = Scripts {
    mask: Some(MASK),
    check: FITS,
    extract: Some(GOOD),
};

fn written(folder: &Path, scripts: Scripts<'_>) -> ProcessingPrograms {
    let mut dataset = describe(COW, b"");
    dataset.sessions.push(entry(BUST));
    dataset.write(folder).unwrap();
    let script = |name: &str, body: &str| {
        let path = folder.join(name);
        let here = folder.display();
        let log = format!("echo \"{name} $*\" >> '{here}/log'");
        let text = folder.join(format!("{name}.sh"));
        fs::write(&text, format!("#!/bin/sh\nhere='{here}'\n{log}\n{body}\n")).unwrap();
        // Another process writes the program: while this one has it open, no thread could start it.
        let mut install = Command::new("install");
        let installed = install.args(["-m", "755"]).args([&text, &path]).status();
        assert!(installed.unwrap().success());
        path
    };
    let mask = scripts.mask.map(|mask| {
        let check = scripts.check;
        script(
            "relit-mask",
            &format!("if [ \"$1\" = check ]; then shift; {check}; else {mask}; fi"),
        )
    });
    ProcessingPrograms {
        mask,
        extract: scripts.extract.map(|body| script("relit-extract", body)),
        launcher: vec!["sh".into()],
    }
}

fn start(rig: &Fake, programs: &ProcessingPrograms) -> Arc<Processing> {
    let sets = Some(rig.root.join(".sets"));
    let started = Processing::start(&rig.root, rig.monitor.clone(), sets, programs.clone());
    Arc::new(started.unwrap())
}

/// A server that processes sessions by scripts in a folder.
fn serving(folder: &Path, scripts: Scripts<'_>) -> Serving {
    let programs = written(folder, scripts);
    let serving = Serving::beside(|options, rig| options.processing = Some(start(rig, &programs)));
    serving.hold(&[COW, BUST]);
    serving
}

fn process(serving: &Serving, session: &str, steps: &[&str]) -> super::Answer {
    let body = json!({ "steps": steps }).to_string();
    let headers = ["Content-Type: application/json"];
    let path = format!("/api/v1/sessions/{session}/process");
    serving.ask("POST", &path, &headers, body.as_bytes())
}

fn set(serving: &Serving, settings: &Value) -> super::Answer {
    let headers = ["Content-Type: application/json"];
    let body = settings.to_string();
    serving.ask("PUT", "/api/v1/processing", &headers, body.as_bytes())
}

fn state(serving: &Serving) -> Value {
    serving.get("/api/v1/processing").json()
}

/// Steps that ended, with how.
fn finished(serving: &Serving) -> Vec<(String, String)> {
    let state = state(serving);
    let jobs = state["finished"].as_array().unwrap().iter();
    let text = |value: &Value| value.as_str().unwrap().to_owned();
    jobs.map(|job| (text(&job["step"]), text(&job["outcome"])))
        .collect()
}

fn wait_finished(serving: &Serving, steps: usize) -> Vec<(String, String)> {
    wait_until("the steps ended", || finished(serving).len() >= steps);
    finished(serving)
}

fn steps(wanted: &[(&str, &str)]) -> Vec<(String, String)> {
    let owned = wanted.iter();
    owned
        .map(|(step, end)| ((*step).to_owned(), (*end).to_owned()))
        .collect()
}

/// The state of a process as the kernel calls it: `T` is stopped.
fn state_of(folder: &Path) -> Option<String> {
    let pid = fs::read_to_string(folder.join("pid")).ok()?;
    // The program makes the file before it writes its number there, and `/proc//stat` is another file.
    let number: u32 = pid.trim().parse().ok()?;
    let stat = fs::read_to_string(format!("/proc/{number}/stat")).ok()?;
    stat.rsplit(") ").next()?.chars().next().map(String::from)
}

#[test]
fn a_session_goes_through_mask_check_and_extraction_by_the_programs() {
    let folder = tempfile::tempdir().unwrap();
    let serving = serving(folder.path(), ALL_WELL);
    let answer = process(&serving, COW, &["mask", "check", "extract"]);
    assert_eq!(answer.status, 202);
    assert_eq!(
        wait_finished(&serving, 3),
        steps(&[("mask", "good"), ("check", "good"), ("extract", "good")])
    );
    let listed = serving.get("/api/v1/sessions").json();
    assert_eq!(listed[1]["results"]["stage"], "masked", "{listed}");
    assert_eq!(listed[1]["results"]["mask"]["origin"], "hand");
    assert_eq!(listed[0]["results"]["stage"], "recorded");
    let log = fs::read_to_string(folder.path().join("log")).unwrap();
    let root = serving.root.path().canonicalize().unwrap();
    let session = root.join(COW).display().to_string();
    let dataset = root.join(".sets/dataset").display().to_string();
    let wanted = [
        format!("relit-mask {session} --auto --json"),
        format!("relit-mask check {session} --json"),
        format!("relit-extract {session} -o {dataset} --resume --progress --json"),
    ];
    assert_eq!(log.lines().collect::<Vec<_>>(), wanted);
}

#[test]
fn what_a_program_says_of_its_progress_is_shown_and_a_cancel_ends_it() {
    let folder = tempfile::tempdir().unwrap();
    let progress = r#"echo '{"event":"progress","what":"","done":30,"of":120}'"#;
    let extract = format!("{progress}; {WAIT}");
    let scripts = Scripts {
        extract: Some(&extract),
        ..ALL_WELL
    };
    let serving = serving(folder.path(), scripts);
    let number = process(&serving, COW, &["extract"]).json()["number"].clone();
    let waiting = process(&serving, BUST, &["extract"]).json()["number"].clone();
    wait_until("it has come so far", || {
        let job = &state(&serving)["jobs"][0];
        job["status"] == "running" && job["done"] == 30 && job["of"] == 120
    });
    assert_eq!(process(&serving, COW, &["mask"]).status, 409);
    let path = |number: &Value| format!("/api/v1/processing/jobs/{number}");
    for number in [&waiting, &number] {
        assert_eq!(serving.ask("DELETE", &path(number), &[], b"").status, 204);
    }
    wait_finished(&serving, 2);
    assert_eq!(
        finished(&serving),
        steps(&[("extract", "cancelled"), ("extract", "cancelled")])
    );
    assert_eq!(state_of(folder.path()), None, "the program has ended");
    // The log says the same, and not how the program was ended.
    let rig = serving.rig.monitor.state();
    let ended = rig.processing.finished.last().unwrap();
    let line = format!("{COW}: {}: {}", ended.step, ended.what);
    wait_until("it is in the log", || {
        let log = serving.rig.monitor.state().log;
        log.iter().any(|logged| logged.what == line)
    });
    assert_eq!(serving.ask("DELETE", &path(&number), &[], b"").status, 404);
}

#[test]
fn a_program_is_held_while_the_rig_captures_and_goes_on_afterwards() {
    let folder = tempfile::tempdir().unwrap();
    let extract = format!("{WAIT}; {GOOD}");
    let scripts = Scripts {
        extract: Some(&extract),
        ..ALL_WELL
    };
    let serving = serving(folder.path(), scripts);
    process(&serving, COW, &["extract"]);
    wait_until("it runs", || {
        state_of(folder.path()).is_some_and(|state| state != "T")
    });
    let phase = |phase| serving.rig.monitor.update(|state| state.phase = phase);
    phase(Phase::Preflight);
    wait_until("it is held", || {
        state_of(folder.path()).as_deref() == Some("T")
    });
    wait_until("that is shown", || {
        state(&serving)["jobs"][0]["status"] == "held"
    });
    process(&serving, BUST, &["mask"]);
    fs::write(folder.path().join("go"), "").unwrap();
    phase(Phase::Recording);
    serving.rig.monitor.update(|state| state.frames += 1);
    assert_eq!(finished(&serving), []);
    // The table moves by itself, too: after the take, or by a person's hand.
    serving.rig.monitor.update(|state| {
        state.phase = Phase::Idle;
        state.table.state = "Home".to_owned();
    });
    wait_until("the state was seen", || {
        state(&serving)["jobs"][0]["status"] == "held"
    });
    serving
        .rig
        .monitor
        .update(|state| state.table.state = "Idle".to_owned());
    assert_eq!(
        wait_finished(&serving, 2),
        steps(&[("extract", "good"), ("mask", "good")])
    );
}

#[test]
fn a_cancel_reaches_a_program_that_is_held() {
    let folder = tempfile::tempdir().unwrap();
    let scripts = Scripts {
        extract: Some(WAIT),
        ..ALL_WELL
    };
    let serving = serving(folder.path(), scripts);
    let number = process(&serving, COW, &["extract"]).json()["number"].clone();
    wait_until("it runs", || state_of(folder.path()).is_some());
    serving
        .rig
        .monitor
        .update(|state| state.phase = Phase::Recording);
    wait_until("it is held", || {
        state_of(folder.path()).as_deref() == Some("T")
    });
    let path = format!("/api/v1/processing/jobs/{number}");
    serving.ask("DELETE", &path, &[], b"");
    assert_eq!(
        wait_finished(&serving, 1),
        steps(&[("extract", "cancelled")])
    );
}

#[test]
fn what_goes_wrong_is_told_in_the_programs_own_words() {
    let folder = tempfile::tempdir().unwrap();
    let scripts = Scripts {
        mask: Some(r#"echo '{"event":"error","message":"no object was found"}'; exit 1"#),
        extract: Some("echo 'error: the disk is full' >&2; exit 1"),
        ..ALL_WELL
    };
    let serving = serving(folder.path(), scripts);
    process(&serving, COW, &["mask", "check", "extract"]);
    process(&serving, BUST, &["extract"]);
    assert_eq!(
        wait_finished(&serving, 2),
        steps(&[("mask", "failed"), ("extract", "failed")])
    );
    let state = state(&serving);
    assert_eq!(state["finished"][0]["what"], "no object was found");
    assert_eq!(state["finished"][1]["what"], "the disk is full");
    assert_eq!(state["jobs"], json!([]));
}

#[test]
fn a_mask_that_is_wrong_is_not_extracted_before_a_person_has_looked() {
    let folder = tempfile::tempdir().unwrap();
    let scripts = Scripts {
        check: r#"echo '{"verdict":"wrong","reasons":["a hole"]}' > "$1/mask-check.json"; exit 3"#,
        ..ALL_WELL
    };
    let serving = serving(folder.path(), scripts);
    process(&serving, COW, &["check", "extract"]);
    process(&serving, BUST, &["mask"]);
    assert_eq!(
        wait_finished(&serving, 2),
        steps(&[("check", "doubtful"), ("mask", "good")])
    );
    assert_eq!(state(&serving)["finished"][0]["what"], "wrong: a hole");
}

#[test]
fn where_a_program_is_missing_nothing_is_queued() {
    let folder = tempfile::tempdir().unwrap();
    let scripts = Scripts {
        mask: None,
        extract: None,
        ..ALL_WELL
    };
    let serving = serving(folder.path(), scripts);
    for steps in [&["mask"][..], &["extract"], &["mask", "extract"]] {
        let refused = process(&serving, COW, steps);
        assert_eq!(refused.status, 503);
        let program = format!("relit-{}", steps[0]);
        assert!(refused.error().contains(&program), "{}", refused.error());
    }
    assert_eq!(state(&serving)["has_mask_program"], json!(false));
}

#[test]
fn what_became_of_an_automatic_mask_is_forgotten_once_a_person_has_made_one() {
    let folder = tempfile::tempdir().unwrap();
    let scripts = Scripts {
        mask: Some("exit 1"),
        ..ALL_WELL
    };
    let serving = serving(folder.path(), scripts);
    process(&serving, COW, &["mask"]);
    process(&serving, BUST, &["mask"]);
    let failed = ("mask", "failed");
    assert_eq!(wait_finished(&serving, 2), steps(&[failed, failed]));
    let edit = format!("/api/v1/sessions/{COW}/edit");
    assert_eq!(serving.ask("POST", &edit, &[], b"").status, 200);
    let sketch = json!({ "frame": 0, "auto": false, "rect": [170, 20, 300, 300], "strokes": [] });
    let json = ["Content-Type: application/json"];
    let sketch = sketch.to_string();
    let accepted = serving.ask("POST", "/edit/api/v1/accept", &json, sketch.as_bytes());
    assert_eq!(accepted.status, 200);
    wait_until("it is forgotten", || finished(&serving).len() == 1);
    assert_eq!(state(&serving)["finished"][0]["session"], BUST);
    assert!(serving.root.path().join(COW).join("mask.png").is_file());
}

#[test]
fn settings_outlast_a_restart_and_programs_do_not() {
    let folder = tempfile::tempdir().unwrap();
    let slow = format!("{WAIT}; {MASK}");
    let scripts = Scripts {
        mask: Some(&slow),
        ..ALL_WELL
    };
    let programs = written(folder.path(), scripts);
    let mut serving = serving(folder.path(), scripts);
    assert_eq!(set(&serving, &json!({ "when_done": true })).status, 200);
    process(&serving, COW, &["mask", "check"]);
    wait_until("it runs", || state_of(folder.path()).is_some());
    serving.stop();
    wait_until("the program has ended", || {
        state_of(folder.path()).is_none()
    });
    let again = start(&serving.rig, &programs);
    let state = serving.rig.monitor.state().processing;
    assert!(state.when_done && state.jobs.is_empty());
    drop(again);
}

#[test]
fn a_usable_take_is_processed_by_itself_where_that_is_set_and_another_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let serving = serving(folder.path(), ALL_WELL);
    let take = |session: &str, verdict| {
        serving.rig.monitor.update(|state| {
            state.last_take = Some(TakeSummary {
                session: session.to_owned(),
                verdict,
                frames: 1500,
                dropped: 0,
                is_stopped: false,
                reason: None,
                notes: Vec::new(),
            });
        });
    };
    assert_eq!(set(&serving, &json!({ "when_done": true })).status, 200);
    take(COW, Verdict::Aborted);
    take(BUST, Verdict::Tolerated);
    let ended = wait_finished(&serving, 3);
    assert_eq!(
        ended,
        steps(&[("mask", "good"), ("check", "good"), ("extract", "good")])
    );
    let first = &state(&serving)["finished"][0];
    assert_eq!(first["session"], BUST);
}

#[test]
fn the_page_about_a_session_in_the_data_set_runs_no_scripts() {
    let folder = tempfile::tempdir().unwrap();
    let serving = serving(folder.path(), ALL_WELL);
    assert_eq!(set(&serving, &json!({ "other": 1 })).status, 400);
    let page = |name: &str| {
        serving
            .get(&format!("/api/v1/sessions/{COW}/{name}"))
            .status
    };
    assert_eq!((page("report.html"), page("check.html")), (404, 404));
    let dataset = state(&serving)["dataset_folder"]
        .as_str()
        .unwrap()
        .to_owned();
    let dataset = Path::new(&dataset);
    fs::create_dir_all(dataset).unwrap();
    fs::write(dataset.join(format!("{COW}.html")), "<p>fine").unwrap();
    let report = serving.get(&format!("/api/v1/sessions/{COW}/report.html"));
    fs::remove_file(dataset.join(format!("{COW}.html"))).unwrap();
    assert_eq!(report.body, b"<p>fine");
    let policy = report.header("content-security-policy").unwrap();
    assert!(policy.contains("sandbox") && policy.contains("default-src 'none'"));
}

/// The entry of a session that was extracted, and is good.
fn entry(session: &str) -> SessionEntry {
    let hash = Digest::hash(b"");
    let quality = SessionQuality::from_records(&[], false, None);
    SessionEntry {
        id: session.to_owned(),
        object: "cow".to_owned(),
        input: SourceVideo {
            video: "video.mkv".to_owned(),
            codec: "mjpeg".to_owned(),
            frames: 1500,
            bytes: 0,
            blake3: hash,
            colour_conversion: None,
            index_blake3: None,
        },
        mask: MaskInfo {
            blake3: hash,
            px: 1,
            bounding_box: Rect::new(0, 0, 1, 1),
        },
        selection: SamplingBasis::Angle,
        samples: 1500,
        covered_deg: None,
        rig: None,
        duplicates: 0,
        spec_net: 0,
        lossy: false,
        quality: SessionQuality {
            verdict: QualityVerdict::Good,
            reasons: Vec::new(),
            ..quality
        },
        warnings: Vec::new(),
        table: FileEntry {
            file: format!("{session}.parquet"),
            bytes: 0,
            blake3: hash,
        },
        report: None,
    }
}

/// The description of a data set that has these samples of a session.
fn describe(session: &str, samples: &[u8]) -> Dataset {
    let mut dataset = Dataset::new(ExtractionSettings {
        frames: 1500,
        size: ImageSize::Pixels(256),
        margin: 0.05,
        saturation_level: 250,
        gate: 0.05,
        align: Align::Off,
        align_tolerance: None,
        layout: Layout::Webdataset,
        scaling: "area".to_owned(),
    });
    dataset.sessions.push(entry(session));
    dataset.shards.push(ShardEntry {
        file: format!("{session}.tar"),
        session: session.to_owned(),
        samples: 1,
        bytes: samples.len() as u64,
        blake3: Digest::hash(samples),
        mask: None,
        mean_img: None,
    });
    dataset
}

#[test]
fn the_shard_of_a_session_is_served_for_download_once_it_is_extracted() {
    let folder = tempfile::tempdir().unwrap();
    let serving = serving(folder.path(), ALL_WELL);
    let shard = |session: &str| serving.get(&format!("/api/v1/sessions/{session}/shard.tar"));
    assert_eq!(shard(COW).status, 404);
    let dataset = state(&serving)["dataset_folder"]
        .as_str()
        .unwrap()
        .to_owned();
    let dataset = Path::new(&dataset);
    fs::create_dir_all(dataset).unwrap();
    describe(COW, b"samples").write(dataset).unwrap();
    assert_eq!(shard(COW).status, 404, "it is described, and not there");
    fs::write(dataset.join(format!("{COW}.tar")), b"samples").unwrap();
    let answer = shard(COW);
    assert_eq!((answer.status, &*answer.body), (200, &b"samples"[..]));
    assert_eq!(answer.header("content-length"), Some("7"));
    // The session itself has the shorter name.
    let name = answer.header("content-disposition").unwrap();
    assert!(name.ends_with(&format!("{COW}.shard.tar")), "{name}");
    assert_eq!(shard(BUST).status, 404);
}

#[test]
fn a_session_that_is_put_away_is_no_longer_worked_on_and_its_trash_outlasts_a_reload() {
    let folder = tempfile::tempdir().unwrap();
    let scripts = Scripts {
        extract: Some(WAIT),
        ..ALL_WELL
    };
    let serving = serving(folder.path(), scripts);
    assert_eq!(serving.get("/api/v1/trash").json(), json!([]));
    process(&serving, COW, &["extract"]);
    wait_until("it runs", || state_of(folder.path()).is_some());
    let path = format!("/api/v1/sessions/{COW}");
    assert_eq!(serving.ask("DELETE", &path, &[], b"").status, 204);
    assert_eq!(state_of(folder.path()), None);
    let trash = serving.get("/api/v1/trash").json();
    assert_eq!(trash[0]["id"], COW);
    let restore = format!("{path}/restore");
    assert_eq!(serving.ask("POST", &restore, &[], b"").status, 204);
    assert_eq!(serving.get("/api/v1/trash").json(), json!([]));
    assert_eq!(serving.get(&path).status, 200);
}

#[test]
fn the_editor_is_reached_through_the_rig_by_those_whom_the_rig_lets_in() {
    let folder = tempfile::tempdir().unwrap();
    let scripts = Scripts {
        mask: None,
        ..ALL_WELL
    };
    let serving = serving(folder.path(), scripts);
    assert_eq!(serving.get("/edit/").status, 503, "nothing is open");
    let edit = |session: &str| {
        let path = format!("/api/v1/sessions/{session}/edit");
        serving.ask("POST", &path, &[], b"")
    };
    assert_eq!(edit(COW).json()["path"], "/edit/");
    assert_eq!(edit(COW).status, 200, "it goes on");
    assert_eq!(edit(BUST).status, 409, "one at a time");
    assert_eq!(state(&serving)["editing"], COW);
    assert_eq!(serving.get("/edit/").status, 200);
    let picture = serving.get("/edit/api/v1/frames/0?width=64");
    assert_eq!(picture.header("content-type"), Some("image/jpeg"));
    assert!(picture.header("content-security-policy").is_some());
    let of = |session: &str| serving.get(&format!("/edit/api/v1/recording?of={session}"));
    assert_eq!(of(COW).status, 200);
    assert_eq!(of(BUST).status, 409, "a page of the session before");
    let sketch = json!({ "frame": 0, "auto": false, "rect": [170, 20, 300, 300], "strokes": [] });
    let post = |path: &str, header: &str| {
        let headers = ["Content-Type: application/json", header];
        serving.ask("POST", path, &headers, sketch.to_string().as_bytes())
    };
    let cut = post("/edit/api/v1/mask?draft=true", "Accept: */*");
    assert!(cut.json()["area_px"].as_u64().unwrap() > 0);
    let foreign = post("/edit/api/v1/accept", "Origin: http://evil.example");
    assert_eq!(foreign.status, 403);
    let other = serving.ask("GET", "/edit/", &["Host: evil.example"], b"");
    assert_eq!(other.status, 421);
    let phase = |phase| serving.rig.monitor.update(|state| state.phase = phase);
    phase(Phase::Recording);
    assert_eq!(serving.get("/edit/").status, 503, "it is held");
    assert_eq!(edit(COW).status, 409);
    phase(Phase::Idle);
    assert_eq!(
        post("/edit/api/v1/discard", "Accept: */*").status,
        204,
        "it goes on"
    );
    wait_until("it is over", || state(&serving)["editing"].is_null());
    assert_eq!(serving.get("/edit/").status, 503);
}
