//! The program `relit-extract`: command lines, results and failures.

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use relit_data::rig::{RigFacts, RotationDirection};
use relit_data::shard::{Dataset, FrameRecord, ShardReader};
use relit_test_support::{ffmpeg, is_named, packets, turning};
use serde_json::Value;

use super::support::Place;

/// The object: a disc in the middle.
const OBJECT: &str = "lt(hypot(X-50,Y-35),22)";

struct Bench {
    place: Place,
}

impl Bench {
    fn new() -> Self {
        let bench = Self {
            place: Place::new(),
        };
        bench.video("clip.mkv", "-pix_fmt yuvj422p -c:v mjpeg -q:v 2");
        let mask = image::GrayImage::from_fn(96, 72, |x, y| {
            let far = (f64::from(x) - 50.0).hypot(f64::from(y) - 35.0);
            image::Luma([if far < 22.0 { 255 } else { 0 }])
        });
        mask.save(bench.path("mask.png")).unwrap();
        bench
    }

    fn path(&self, name: &str) -> PathBuf {
        self.place.path(name)
    }

    fn video(&self, name: &str, encoding: &str) {
        let pattern = turning([96, 72], 30, 30, 0, OBJECT);
        let mut arguments = vec!["-f", "lavfi", "-i", &pattern];
        arguments.extend(encoding.split_whitespace());
        arguments.push(name);
        ffmpeg(self.place.folder(), &arguments);
    }

    #[track_caller]
    fn errors(&self, code: i32, line: &str) -> String {
        self.place.errors(code, &without_shifts(line))
    }

    #[track_caller]
    fn events(&self, code: i32, line: &str) -> Vec<Value> {
        self.place.events(code, &without_shifts(line))
    }

    /// Runs `verify`, asserts the exit code, and returns its events.
    #[track_caller]
    fn verified(&self, code: i32, out: &str) -> Vec<Value> {
        self.events(code, &format!("verify {out}"))
    }

    /// Asserts that all warnings in the data set's description were printed too, and that one names these things.
    #[track_caller]
    fn assert_warned(&self, errors: &str, out: &str, things: &[&str]) {
        let dataset = Dataset::read(&self.path(out)).unwrap();
        let warnings = &dataset.sessions[0].warnings;
        for warning in warnings {
            assert!(errors.contains(&**warning), "{warning}: {errors}");
        }
        let named = warnings.iter().any(|warning| is_named(warning, things));
        assert!(named, "{things:?}: {warnings:?}");
    }

    fn records(&self, shard: &str) -> Vec<FrameRecord> {
        let file = File::open(self.path(shard)).unwrap();
        let mut records: Vec<FrameRecord> = ShardReader::new(file)
            .map(|sample| serde_json::from_slice(sample.unwrap().member("json").unwrap()).unwrap())
            .collect();
        records.sort_by_key(|record| record.index);
        records
    }
}

/// The pattern moves, and no object does: its shifts are not looked for unless the line says so.
fn without_shifts(line: &str) -> String {
    let extracts = line.contains(" -o ") && !line.contains("--align");
    format!("{line}{}", if extracts { " --align=off" } else { "" })
}

#[test]
fn the_shard_is_the_same_bytes_for_any_number_of_threads() {
    for (name, encoding) in [
        ("clip.mkv", "-pix_fmt yuvj422p -c:v mjpeg"),
        ("film.mp4", "-pix_fmt yuv420p -c:v libx264"),
    ] {
        let bench = Bench::new();
        bench.video(name, encoding);
        let mut shards = Vec::new();
        for threads in [1, 2, 5] {
            let out = format!("out{threads}");
            bench.errors(
                0,
                &format!(
                    "{name} --mask mask.png --frames 30 --size 40 -o {out} --threads {threads}"
                ),
            );
            let stem = name.split('.').next().unwrap();
            shards.push(fs::read(bench.path(&format!("{out}/{stem}.tar"))).unwrap());
        }
        assert!(shards.windows(2).all(|pair| pair[0] == pair[1]), "{name}");
    }
}

#[test]
fn native_size_keeps_source_pixels_and_its_statistics_are_recomputed_by_verify() {
    let bench = Bench::new();
    bench.errors(
        0,
        "clip.mkv --mask mask.png --frames 30 --size native -o out",
    );
    let events = bench.verified(0, "out");
    let verified = events.last().unwrap();
    assert_eq!(
        (&verified["samples"], &verified["problems"]),
        (&30.into(), &0.into())
    );
    let record = &bench.records("out/clip.tar")[7];
    assert_eq!(record.size, [record.crop.w, record.crop.h]);
    assert_eq!(record.crop.w, 43 + 2 * 2);
}

#[test]
fn the_paper_layout_has_gap_free_names_and_is_verified() {
    let bench = Bench::new();
    bench.errors(
        0,
        "clip.mkv --mask mask.png --frames 30 --size 32 --layout paper -o out",
    );
    bench.verified(0, "out");
    for k in 0..30 {
        assert!(bench.path(&format!("out/imgs/clip/{k}.png")).is_file());
    }
    assert!(bench.path("out/masks/clip.png").is_file());
    assert!(bench.path("out/mean_img/clip.png").is_file());
    fs::copy(
        bench.path("out/imgs/clip/3.png"),
        bench.path("out/imgs/clip/4.png"),
    )
    .unwrap();
    let events = bench.verified(1, "out");
    let mut problems = events.iter().filter(|event| event["event"] == "problem");
    assert!(
        problems.any(|problem| problem["sample"] == "clip/0004"),
        "{events:?}"
    );
}

#[test]
fn more_samples_than_frames_are_flagged() {
    let bench = Bench::new();
    let errors = bench.errors(0, "clip.mkv --mask mask.png --frames 45 --size 32 -o out");
    bench.assert_warned(&errors, "out", &["15", "45"]);
    let records = bench.records("out/clip.tar");
    assert_eq!(records.iter().filter(|record| record.duplicate).count(), 15);
}

#[test]
fn frames_that_replace_dropped_ones_are_flagged_and_not_the_originals() {
    let bench = Bench::new();
    let drop = r"noise=amount=0:drop=eq(n\,9)+eq(n\,10)+eq(n\,20)";
    ffmpeg(
        bench.place.folder(),
        &["-i", "clip.mkv", "-c", "copy", "-bsf:v", drop, "gaps.mkv"],
    );
    let errors = bench.errors(0, "gaps.mkv --mask mask.png --frames 30 --size 32 -o out");
    bench.assert_warned(&errors, "out", &["2 more", "frame 9"]);
    let records = bench.records("out/gaps.tar");
    let flagged: Vec<u32> = records
        .iter()
        .filter(|r| r.duplicate)
        .map(|r| r.index)
        .collect();
    assert_eq!(flagged, [9, 10, 20]);
}

#[test]
fn a_damaged_frame_is_replaced_by_a_neighbour_and_reported() {
    let bench = Bench::new();
    bench.video("clip.avi", "-pix_fmt yuvj422p -c:v mjpeg -q:v 2");
    let mut bytes = fs::read(bench.path("clip.avi")).unwrap();
    let starts: Vec<usize> = (0..bytes.len() - 3)
        .filter(|&at| bytes[at..].starts_with(&[0xFF, 0xD8, 0xFF]))
        .collect();
    let middle = (starts[4] + starts[5]) / 2;
    for pair in bytes[middle..middle + 200].chunks_exact_mut(2) {
        pair.copy_from_slice(&[0xFF, 0xD9]);
    }
    fs::write(bench.path("clip.avi"), bytes).unwrap();
    let errors = bench.errors(3, "clip.avi --mask mask.png --frames 30 --size 32 -o out");
    bench.assert_warned(&errors, "out", &["frame 4 "]);
    let records = bench.records("out/clip.tar");
    assert_eq!(records.len(), 30);
    assert!(records[4].duplicate && [3, 5].contains(&records[4].source_frame));
    assert!(
        records
            .iter()
            .filter(|record| record.index != 4)
            .all(|record| !record.duplicate)
    );
    bench.verified(0, "out");
}

#[test]
fn a_truncated_video_gives_what_it_has_and_exit_code_3() {
    let bench = Bench::new();
    let whole = fs::read(bench.path("clip.mkv")).unwrap();
    fs::write(bench.path("cut.mkv"), &whole[..whole.len() / 2]).unwrap();
    let errors = bench.errors(3, "cut.mkv --mask mask.png --frames 30 --size 32 -o out");
    assert!(is_named(&errors, &["cut"]), "{errors}");
    assert!(Dataset::read(&bench.path("out")).unwrap().sessions[0].lossy);
    assert_eq!(bench.records("out/cut.tar").len(), 30);
    bench.verified(0, "out");
}

#[test]
fn one_bad_input_does_not_stop_the_others() {
    let bench = Bench::new();
    fs::write(bench.path("bad.mkv"), "no video").unwrap();
    fs::copy(bench.path("clip.mkv"), bench.path("other.mkv")).unwrap();
    let errors = bench.errors(
        3,
        "clip.mkv bad.mkv other.mkv --mask mask.png --frames 30 --size 32 -o out",
    );
    assert!(errors.contains("bad.mkv"), "{errors}");
    let dataset = Dataset::read(&bench.path("out")).unwrap();
    let ids: Vec<&str> = dataset
        .sessions
        .iter()
        .map(|session| session.id.as_str())
        .collect();
    assert_eq!(ids, ["clip", "other"]);
    bench.verified(0, "out");
    bench.errors(1, "bad.mkv --mask mask.png -o none");
}

#[test]
fn a_missing_input_does_not_stop_the_others() {
    let bench = Bench::new();
    let errors = bench.errors(
        3,
        "nowhere.mkv clip.mkv --mask mask.png --frames 30 --size 32 -o out",
    );
    assert!(errors.contains("nowhere.mkv"), "{errors}");
    bench.verified(0, "out");
}

#[test]
fn transparent_pixels_of_the_mask_are_not_the_object() {
    let bench = Bench::new();
    let mask = image::open(bench.path("mask.png")).unwrap().into_luma8();
    image::RgbaImage::from_fn(96, 72, |x, y| {
        image::Rgba([255, 255, 255, mask.get_pixel(x, y).0[0]])
    })
    .save(bench.path("layer.png"))
    .unwrap();
    for (mask, out) in [("mask.png", "a"), ("layer.png", "b")] {
        bench.errors(
            0,
            &format!("clip.mkv --mask {mask} --frames 30 --size 32 -o {out}"),
        );
    }
    let shards = ["a", "b"].map(|out| fs::read(bench.path(&format!("{out}/clip.tar"))).unwrap());
    assert!(shards[0] == shards[1]);
}

#[test]
fn damaged_h264_gives_the_same_shard_for_any_number_of_threads() {
    let bench = Bench::new();
    bench.video(
        "film.mkv",
        "-pix_fmt yuv420p -c:v libx264 -g 6 -bf 2 -sc_threshold 0",
    );
    let mut bytes = fs::read(bench.path("film.mkv")).unwrap();
    let packet = packets(bench.place.folder(), "film.mkv")[14];
    bytes[packet.at + 8..packet.at + packet.size].fill(0);
    fs::write(bench.path("film.mkv"), bytes).unwrap();
    let mut shards = Vec::new();
    for threads in [1, 2, 4, 8] {
        let out = format!("out{threads}");
        let errors = bench.errors(
            3,
            &format!("film.mkv --mask mask.png --frames 30 --size 40 -o {out} --threads {threads}"),
        );
        shards.push((
            errors,
            fs::read(bench.path(&format!("{out}/film.tar"))).unwrap(),
        ));
    }
    assert!(
        shards.windows(2).all(|pair| pair[0] == pair[1]),
        "{:?}",
        shards.iter().map(|s| &s.0).collect::<Vec<_>>()
    );
}

#[test]
fn names_that_look_like_ffmpeg_urls_are_files() {
    let bench = Bench::new();
    for name in ["09:30.mkv", "concat:clip.mkv", "ü.mkv"] {
        fs::copy(bench.path("clip.mkv"), bench.path(name)).unwrap();
        bench.errors(
            0,
            &format!("{name} --mask mask.png --frames 30 --size 32 -o out"),
        );
    }
}

#[test]
fn a_name_that_is_not_utf_8_is_refused_and_does_not_stop_the_others() {
    use std::os::unix::ffi::OsStrExt;
    let bench = Bench::new();
    let odd = bench
        .place
        .path(std::ffi::OsStr::from_bytes(b"od\xFFd.mkv"));
    fs::copy(bench.path("clip.mkv"), &odd).unwrap();
    let output = bench
        .place
        .command()
        .arg(&odd)
        .args("clip.mkv --mask mask.png --frames 30 --size 32 -o out".split(' '))
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(3));
    assert!(String::from_utf8_lossy(&output.stderr).contains("d.mkv"));
    bench.verified(0, "out");
}

#[test]
fn lines_that_do_not_fit_onto_the_disk_are_told() {
    let bench = Bench::new();
    let output = bench
        .place
        .command()
        .args("clip.mkv --mask mask.png --frames 30 --size 32 -o out".split(' '))
        .stdout(fs::File::create("/dev/full").unwrap())
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(3));
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(told.contains("(os error 28)"), "{told}");
    bench.verified(0, "out");
}

#[test]
fn resume_skips_what_is_intact_and_makes_again_what_is_damaged() {
    let bench = Bench::new();
    fs::copy(bench.path("clip.mkv"), bench.path("other.mkv")).unwrap();
    let line = "clip.mkv other.mkv --mask mask.png --frames 30 --size 32 -o out --resume";
    bench.errors(0, line);
    let shard = bench.path("out/clip.tar");
    let good = fs::read(&shard).unwrap();
    let mut damaged = good.clone();
    damaged[5000] ^= 1;
    fs::write(&shard, damaged).unwrap();
    let events = bench.events(0, line);
    let skipped = events.iter().filter(|event| event["event"] == "skipped");
    let skipped: Vec<_> = skipped.map(|event| event["session"].clone()).collect();
    assert_eq!(skipped, ["other"]);
    let done = events.last().unwrap();
    let counts = ["extracted", "lossy", "skipped"].map(|count| done[count].clone());
    assert_eq!(counts, [1, 0, 1]);
    assert_eq!(fs::read(&shard).unwrap(), good);
}

#[test]
fn a_data_set_keeps_its_settings() {
    let bench = Bench::new();
    bench.errors(0, "clip.mkv --mask mask.png --frames 30 --size 32 -o out");
    let errors = bench.errors(1, "clip.mkv --mask mask.png --frames 30 --size 48 -o out");
    assert!(is_named(&errors, &["size", "32", "48"]), "{errors}");
    bench.verified(0, "out");
}

#[test]
fn what_is_missing_or_does_not_fit_is_reported_in_one_line() {
    let bench = Bench::new();
    image::GrayImage::new(96, 72)
        .save(bench.path("empty.png"))
        .unwrap();
    image::GrayImage::new(10, 10)
        .save(bench.path("small.png"))
        .unwrap();
    fs::write(bench.path("text.png"), "text").unwrap();
    for (line, things) in [
        ("clip.mkv -o out", &["clip.mkv", "relit-mask"][..]),
        ("clip.mkv --mask nowhere.png -o out", &["nowhere.png"]),
        ("clip.mkv --mask empty.png -o out", &["empty.png"]),
        (
            "clip.mkv --mask small.png -o out",
            &["small.png", "10 x 10", "96 x 72"],
        ),
        ("clip.mkv --mask text.png -o out", &["text.png"]),
        ("nowhere --mask mask.png -o out", &["nowhere"]),
        ("verify out/nothing", &["out/nothing"]),
    ] {
        let errors = bench.errors(1, line);
        assert!(is_named(&errors, things), "{line}: {errors}");
        assert_eq!(errors.lines().count(), 1, "{errors}");
    }
    for line in [
        "",
        "clip.mkv",
        "clip.mkv -o out --size 0",
        "clip.mkv -o out --align maybe",
    ] {
        bench.errors(2, line);
    }
}

#[test]
fn two_inputs_with_the_same_name_are_not_mixed_up() {
    let bench = Bench::new();
    fs::create_dir(bench.path("b")).unwrap();
    fs::copy(bench.path("clip.mkv"), bench.path("b/clip.mkv")).unwrap();
    let errors = bench.errors(
        3,
        "clip.mkv b/clip.mkv --mask mask.png --frames 30 --size 32 -o out",
    );
    assert!(is_named(&errors, &["b/clip.mkv"]), "{errors}");
    let sessions = Dataset::read(&bench.path("out")).unwrap().sessions;
    assert_eq!((sessions.len(), &*sessions[0].id), (1, "clip"));
}

#[test]
fn another_video_of_the_same_name_is_not_replaced_unasked() {
    let bench = Bench::new();
    let line = "clip.mkv --mask mask.png --frames 30 --size 32 -o out";
    bench.errors(0, line);
    let first = fs::read(bench.path("out/clip.tar")).unwrap();
    bench.video("clip.mkv", "-vf hue=h=90 -pix_fmt yuvj422p -c:v mjpeg");
    for more in ["", " --resume"] {
        let errors = bench.errors(1, &format!("{line}{more}"));
        assert!(is_named(&errors, &["out", "clip", "--replace"]), "{errors}");
    }
    assert!(fs::read(bench.path("out/clip.tar")).unwrap() == first);
    bench.errors(0, &format!("{line} --replace"));
    assert!(fs::read(bench.path("out/clip.tar")).unwrap() != first);
    bench.verified(0, "out");
}

#[test]
fn a_photograph_is_not_a_turn() {
    let bench = Bench::new();
    fs::copy(bench.path("mask.png"), bench.path("photo.png")).unwrap();
    let errors = bench.errors(1, "photo.png --mask mask.png -o out");
    assert!(is_named(&errors, &["photo.png"]), "{errors}");
}

#[test]
fn a_session_folder_does_not_become_a_data_set() {
    let bench = Bench::new();
    fs::create_dir(bench.path("taken")).unwrap();
    fs::write(bench.path("taken/session.json"), "{}").unwrap();
    let errors = bench.errors(1, "clip.mkv --mask mask.png -o taken");
    assert!(is_named(&errors, &["taken"]), "{errors}");
    assert_eq!(names_in(&bench.path("taken")), ["session.json"]);
}

#[test]
fn with_json_events_are_printed_as_json_lines() {
    let bench = Bench::new();
    bench.video("film.mp4", "-pix_fmt yuv420p -c:v libx264");
    let output = bench
        .place
        .run("film.mp4 --mask mask.png --frames 30 --size 32 --align=off -o out --json");
    let said = String::from_utf8(output.stderr).unwrap();
    let events: Vec<serde_json::Value> = String::from_utf8(output.stdout)
        .unwrap()
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    // Warnings are told to people too, and nothing else is.
    let warnings = events.iter().filter(|event| event["event"] == "warning");
    let warnings =
        warnings.map(|event| format!("warning: film: {}\n", event["message"].as_str().unwrap()));
    assert_eq!(said, warnings.collect::<String>());
    // The file does not state its colour matrix, and that is said first.
    assert_eq!(events[0]["event"], "warning");
    assert_eq!(events[0]["session"], "film");
    let extracted = events.iter().find(|event| event["event"] == "extracted");
    assert_eq!(extracted.unwrap()["entry"]["samples"], 30);
    assert_eq!(events.last().unwrap()["event"], "done");
}

#[test]
fn pixels_outside_the_mask_never_reach_the_shard() {
    let bench = Bench::new();
    bench.errors(0, "clip.mkv --mask mask.png --frames 30 --size 40 -o out");
    let shard = File::open(bench.path("out/clip.tar")).unwrap();
    for sample in ShardReader::new(shard) {
        let sample = sample.unwrap();
        let image = read(sample.member("png").unwrap()).into_rgb8();
        let mask = read(sample.member("mask.png").unwrap()).into_luma8();
        for (pixel, mask) in image.pixels().zip(mask.pixels()) {
            assert!(
                mask.0[0] == 255 || (mask.0[0] == 0 && pixel.0 == [0; 3]),
                "{}",
                sample.key
            );
        }
    }
}

fn read(png: &[u8]) -> image::DynamicImage {
    image::load_from_memory(png).unwrap()
}

#[test]
fn what_a_killed_run_left_behind_is_removed_by_the_next() {
    let bench = Bench::new();
    fs::create_dir(bench.path("out")).unwrap();
    for name in [".clip.tar.7.0.partial", ".clip.spool"] {
        fs::write(bench.path("out").join(name), "half").unwrap();
    }
    bench.errors(0, "clip.mkv --mask mask.png --frames 30 --size 32 -o out");
    let names = names_in(&bench.path("out"));
    assert_eq!(
        names,
        ["clip.html", "clip.parquet", "clip.tar", "dataset.json"]
    );
}

fn names_in(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

const SHAKEN: &str = "../../fixtures/20261120T102000Z-bust-short";

/// The true shifts of the frames of [`SHAKEN`], pixels.
fn true_shifts() -> Vec<[f64; 2]> {
    let truth = fs::read(
        Path::new(env!("CARGO_MANIFEST_DIR"))
            .join(SHAKEN)
            .join("truth.json"),
    );
    let truth: serde_json::Value = serde_json::from_slice(&truth.unwrap()).unwrap();
    let frames = truth["by_sequence"].as_array().unwrap().iter();
    frames
        .map(|frame| serde_json::from_value(frame["shift_px"].clone()).unwrap())
        .collect()
}

#[test]
fn shifts_of_a_shaken_turn_are_measured_and_corrected() {
    let bench = Bench::new();
    let session = Path::new(env!("CARGO_MANIFEST_DIR")).join(SHAKEN);
    let session = session.display();
    let line = format!("{session} --mask {session}/mask_gt.png --frames 30 --size 64");
    bench.errors(0, &format!("{line} --align correct -o corrected"));
    let records = bench.records("corrected/20261120T102000Z-bust-short.tar");
    let truth = true_shifts();
    let mut squares = 0.0;
    for record in &records {
        let [dx, dy] = record.shift_px.unwrap();
        let [tx, ty] = truth[record.source_frame as usize];
        let (tx, ty) = (tx - truth[0][0], ty - truth[0][1]);
        let error = (dx - tx).hypot(dy - ty);
        assert!(error < 0.35, "{}: {dx} {dy} for {tx} {ty}", record.index);
        squares += error * error;
        assert_eq!(record.shift_applied, dx.hypot(dy) > 0.1, "{}", record.index);
        assert!(record.align_confidence.unwrap() > 0.5);
    }
    let rms = (squares / records.len() as f64).sqrt();
    assert!(rms < 0.2, "{rms}");
    bench.verified(0, "corrected");

    bench.errors(0, &format!("{line} --align measure -o measured"));
    let measured = bench.records("measured/20261120T102000Z-bust-short.tar");
    assert!(measured.iter().all(|record| !record.shift_applied));
    let shifts = |records: &[FrameRecord]| -> Vec<_> {
        records.iter().map(|record| record.shift_px).collect()
    };
    assert_eq!(shifts(&measured), shifts(&records));

    let line = format!("{line} --max-shift 1.5 --align measure -o refused");
    let errors = bench.errors(1, &line);
    assert!(is_named(&errors, &["frame", "1.5"]), "{errors}");
    assert!(
        !bench
            .path("refused/20261120T102000Z-bust-short.tar")
            .exists()
    );
}

#[test]
fn a_mask_of_another_session_lowers_the_verdict_and_exits_with_3() {
    let bench = Bench::new();
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures");
    let (session, other) = (
        fixtures.join("20261120T102000Z-bust-short"),
        fixtures.join("20261120T101500Z-cow-short"),
    );
    let line = |mask: &Path, out: &str| {
        let (session, mask) = (session.display(), mask.join("mask_gt.png"));
        let mask = mask.display();
        format!("{session} --mask {mask} --frames 30 --size 40 -o {out}")
    };
    let quality = |out: &str| {
        let bytes = fs::read(bench.path(&format!("{out}/dataset.json"))).unwrap();
        let dataset: serde_json::Value = serde_json::from_slice(&bytes).unwrap();
        dataset["sessions"][0]["quality"].clone()
    };
    let errors = bench.errors(3, &line(&other, "wrong"));
    bench.assert_warned(&errors, "wrong", &["mask"]);
    assert_eq!(quality("wrong")["verdict"], "broken");
    assert_eq!(quality("wrong")["mask_misfit"], "as-a-whole");
    bench.verified(0, "wrong");
    // Nor is it forgotten when nothing is done again.
    bench.errors(3, &format!("{} --resume", line(&other, "wrong")));
    // Nor when the pieces of tasks are merged.
    bench.errors(3, &format!("{} --task 0/1", line(&other, "pieces")));
    bench.errors(3, "merge pieces");
    bench.errors(0, &line(&session, "right"));
    assert_eq!(quality("right")["mask_misfit"], serde_json::Value::Null);
}

#[test]
fn what_a_session_knows_of_its_rig_stands_in_the_data_set() {
    let bench = Bench::new();
    let fixture =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/20261120T101500Z-cow-short");
    let session = bench.path("20261120T101500Z-cow-short");
    fs::create_dir(&session).unwrap();
    for name in names_in(&fixture) {
        fs::copy(fixture.join(&name), session.join(name)).unwrap();
    }
    let extracted = |out: &str| {
        let session = session.display();
        let line = format!("{session} --mask {session}/mask_gt.png --frames 30 --size 40 -o {out}");
        bench.errors(0, &line);
        let mut dataset = Dataset::read(&bench.path(out)).unwrap();
        bench.verified(0, out);
        dataset.sessions.remove(0).rig
    };
    assert_eq!(extracted("unknown"), None);
    let path = session.join("session.json");
    let mut manifest: serde_json::Value =
        serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    manifest["rig"] =
        serde_json::json!({ "rotation": "counter-clockwise", "camera_elevation_deg": 17.5 });
    fs::write(&path, manifest.to_string()).unwrap();
    let rig = RigFacts {
        rotation: Some(RotationDirection::CounterClockwise),
        camera_elevation_deg: Some(17.5),
    };
    assert_eq!(extracted("known"), Some(rig));
}

#[test]
fn frames_that_cannot_be_registered_are_placed_by_the_frames_around() {
    let bench = Bench::new();
    let session = Path::new(env!("CARGO_MANIFEST_DIR")).join(SHAKEN);
    let from = session.join("video.mkv");
    let black = "drawbox=t=fill:color=black:enable='between(n,40,41)+eq(n,90)'";
    let options = [
        "-i",
        from.to_str().unwrap(),
        "-vf",
        black,
        "-q:v",
        "2",
        "dark.avi",
    ];
    ffmpeg(bench.place.folder(), &options);
    fs::copy(session.join("mask_gt.png"), bench.path("mask.png")).unwrap();
    let line = "dark.avi --mask mask.png --frames 150 --size 40 --align correct -o out";
    let errors = bench.errors(3, line);
    bench.assert_warned(&errors, "out", &["3", "150"]);
    let records = bench.records("out/dark.tar");
    let truth = true_shifts();
    for record in &records {
        let [dx, dy] = record.shift_px.unwrap();
        let [tx, ty] = truth[record.source_frame as usize];
        let error = (dx - tx + truth[0][0]).hypot(dy - ty + truth[0][1]);
        let is_dark = [40, 41, 90].contains(&record.source_frame);
        assert_eq!(
            record.shift_interpolated_sd_px.is_some(),
            is_dark,
            "{record:?}"
        );
        if let Some(sd) = record.shift_interpolated_sd_px {
            assert!(
                (0.05..=1.0).contains(&sd) && error < 3.0 * sd,
                "{error}: {record:?}"
            );
        }
    }
    bench.verified(0, "out");
    let bytes = fs::read(bench.path("out/dataset.json")).unwrap();
    let dataset: serde_json::Value = serde_json::from_slice(&bytes).unwrap();
    let quality = &dataset["sessions"][0]["quality"];
    assert_eq!(
        (&quality["interpolated"], &quality["unregistered"]),
        (&3.into(), &0.into())
    );
}

#[test]
fn a_shaken_object_that_the_border_cuts_off_gets_no_black_pixels_and_only_what_was_seen_counts() {
    let bench = Bench::new();
    let session = Path::new(env!("CARGO_MANIFEST_DIR")).join(SHAKEN);
    let cut = |from: &str, to: &str| {
        let from = session.join(from);
        let options = ["-vf", "crop=480:250:0:0", "-q:v", "2"];
        let arguments = [&["-i", from.to_str().unwrap()][..], &options, &[to]].concat();
        ffmpeg(bench.place.folder(), &arguments);
    };
    cut("video.mkv", "cut.avi");
    cut("mask_gt.png", "cut.png");
    bench.errors(
        0,
        "cut.avi --mask cut.png --frames 30 --size native --align correct -o out",
    );
    let whole = Dataset::read(&bench.path("out")).unwrap().sessions[0]
        .mask
        .px;
    let records = bench.records("out/cut.tar");
    assert!(records.iter().all(|record| record.shift_px.is_some()));
    let seen = |record: &FrameRecord| record.mask_px;
    assert_eq!(records.iter().map(seen).max(), Some(whole));
    assert!(records.iter().any(|record| seen(record) < whole));
    for sample in ShardReader::new(File::open(bench.path("out/cut.tar")).unwrap()) {
        let sample = sample.unwrap();
        let image = read(sample.member("png").unwrap()).into_rgb8();
        let mask = read(sample.member("mask.png").unwrap()).into_luma8();
        let pixels = image.pixels().zip(mask.pixels());
        let black = pixels.filter(|(pixel, mask)| mask.0[0] == 255 && pixel.0 == [0; 3]);
        assert_eq!(black.count(), 0, "{}", sample.key);
    }
    bench.verified(0, "out");
}

#[test]
fn two_turns_of_one_object_are_one_object_of_the_data_set() {
    use relit_data::shard::{Align, ExtractionSettings};
    let bench = Bench::new();
    bench.errors(0, "clip.mkv --mask mask.png -o out --frames 6 --size 32");
    let mut dataset = Dataset::read(&bench.path("out")).unwrap();
    let settings: &ExtractionSettings = &dataset.settings;
    assert_eq!(settings.align, Align::Off);
    let mut other = dataset.sessions[0].clone();
    other.id = "clip-upside-down".to_owned();
    dataset.sessions.push(other);
    dataset.write(&bench.path("out")).unwrap();
    let text = fs::read_to_string(bench.path("out/dataset.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(json["objects"].as_array().unwrap().len(), 1);
    assert_eq!(
        json["objects"][0]["sessions"],
        serde_json::json!(["clip", "clip-upside-down"])
    );
    assert_eq!(json["objects"][0]["samples"], 12);
    assert_eq!(Dataset::read(&bench.path("out")).unwrap(), dataset);
}
