use std::fs;
use std::io::Read;

use relit_data::session::{Recording, Status};

use super::Serving;
use relit_video::Video;

const COW: &str = "20261120T101500Z-cow-short";
const BUST: &str = "20261120T102000Z-bust-short";
const DROPPED: &str = "20261120T103000Z-cow-dropped";
const CUT: &str = "20261120T104500Z-cow-cut";

fn path(session: &str, rest: &str) -> String {
    format!("/api/v1/sessions/{session}{rest}")
}

#[test]
fn sessions_are_listed_newest_first_with_their_verdicts() {
    let serving = Serving::start();
    assert_eq!(
        serving.get("/api/v1/sessions").json(),
        serde_json::json!([])
    );
    serving.hold(&[COW, BUST, DROPPED, CUT]);
    fs::create_dir(serving.root.path().join("no-session")).unwrap();
    let list = serving.get("/api/v1/sessions").json();
    let ids: Vec<_> = list
        .as_array()
        .unwrap()
        .iter()
        .map(|s| s["id"].as_str().unwrap())
        .collect();
    assert_eq!(ids, [CUT, DROPPED, BUST, COW]);
    assert_eq!(list[0]["status"], "aborted");
    assert!(list[0]["reason"].is_string());
    assert_eq!(list[1]["status"], "complete");
    assert!(list[1]["dropped"].as_u64() > Some(0));
    assert_eq!(
        (&list[3]["object"], &list[3]["dropped"]),
        (&"cow".into(), &0.into())
    );
    assert_eq!(list[3]["created"], "2026-11-20T10:15:00Z");
    assert!(list[3]["frames"].as_u64() > Some(100));
    assert!(list[3]["duration_s"].as_f64() > Some(4.0));
    let part = serving
        .get(&format!("/api/v1/sessions?limit=1&before={DROPPED}"))
        .json();
    assert_eq!(
        (part.as_array().unwrap().len(), &part[0]["id"]),
        (1, &BUST.into())
    );
}

#[test]
fn what_concerns_the_whole_take_is_listed_with_it_and_faults_of_frames_are_not() {
    let serving = Serving::start();
    serving.hold(&[COW]);
    assert_eq!(
        serving.get("/api/v1/sessions").json()[0]["notes"],
        serde_json::json!([])
    );
    let path = serving.root.path().join(COW).join("session.json");
    let mut manifest: serde_json::Value =
        serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    manifest["faults"] = serde_json::json!([
        { "t_us": 0, "what": "the light is too even" },
        { "t_us": 5, "what": "1 frame missing" },
    ]);
    fs::write(&path, manifest.to_string()).unwrap();
    assert_eq!(
        serving.get("/api/v1/sessions").json()[0]["notes"],
        serde_json::json!(["the light is too even"])
    );
}

#[test]
fn a_session_that_changes_is_listed_as_it_is_now() {
    let serving = Serving::start();
    serving.hold(&[COW]);
    let manifest = serving.root.path().join(COW).join("session.json");
    let text = fs::read_to_string(&manifest).unwrap();
    fs::write(&manifest, text.replace("\"complete\"", "\"recording\"")).unwrap();
    let list = serving.get("/api/v1/sessions").json();
    assert_eq!(list[0]["status"], "recording");
    for rest in ["/thumbnail.jpg", "/frames/0.jpg", "/video"] {
        let refused = serving.get(&path(COW, rest));
        assert_eq!(refused.status, 409, "{rest}");
        assert!(refused.error().contains(COW), "{rest}");
    }
    fs::write(&manifest, &text).unwrap();
    assert_eq!(
        serving.get("/api/v1/sessions").json()[0]["status"],
        "complete"
    );
    fs::write(&manifest, "{").unwrap();
    let list = serving.get("/api/v1/sessions").json();
    assert_eq!(
        (&list[0]["status"], &list[0]["object"]),
        (&"unreadable".into(), &"cow-short".into())
    );
    assert_eq!(serving.get(&path(COW, "")).status, 500);
}

#[test]
fn one_session_is_told_with_each_frames_time_and_angle() {
    let serving = Serving::start();
    serving.hold(&[DROPPED]);
    let detail = serving.get(&path(DROPPED, "")).json();
    assert_eq!(detail["id"], DROPPED);
    assert_eq!(detail["manifest"]["camera"]["fourcc"], "MJPG");
    let frames = detail["frames"].as_u64().unwrap() as usize;
    assert_eq!(detail["times_s"].as_array().unwrap().len(), frames);
    assert_eq!(detail["angles_deg"].as_array().unwrap().len(), frames);
    assert_eq!(detail["times_s"][0], 0.0);
    assert!(detail["dropped"].as_u64() > Some(0));
}

#[test]
fn any_frame_of_a_turn_is_served_as_a_picture() {
    let serving = Serving::start();
    serving.hold(&[COW]);
    let video = Video::open(&serving.root.path().join(COW).join("video.mkv")).unwrap();
    for number in [0, 77, video.frames().len() - 1] {
        let answer = serving.get(&path(COW, &format!("/frames/{number}.jpg")));
        assert_eq!(
            answer.status,
            200,
            "{}",
            String::from_utf8_lossy(&answer.body)
        );
        assert_eq!(answer.header("content-type"), Some("image/jpeg"));
        let served = image::load_from_memory(&answer.body).unwrap().to_rgb8();
        let truth = video.frame(number as u64).unwrap();
        assert_eq!(served.dimensions(), truth.dimensions());
        let pairs = served.as_raw().iter().zip(truth.as_raw());
        let sum: u64 = pairs
            .map(|(one, other)| u64::from(one.abs_diff(*other)))
            .sum();
        assert!(sum / (served.as_raw().len() as u64) < 3, "frame {number}");
    }
    let small = serving.get(&path(COW, "/frames/5.jpg?width=100"));
    assert_eq!(image::load_from_memory(&small.body).unwrap().width(), 100);
    let thumbnail = serving.get(&path(COW, "/thumbnail.jpg"));
    assert_eq!(
        image::load_from_memory(&thumbnail.body).unwrap().width(),
        192
    );
    assert!(thumbnail.body.len() < 20_000);
    for wrong in [
        "/frames/99999.jpg",
        "/frames/-1.jpg",
        "/frames/0",
        "/frames/x.jpg",
    ] {
        assert_eq!(serving.get(&path(COW, wrong)).status, 404, "{wrong}");
    }
}

#[test]
fn the_video_is_served_for_download() {
    let serving = Serving::start();
    serving.hold(&[COW]);
    let bytes = fs::read(serving.root.path().join(COW).join("video.mkv")).unwrap();
    let video = serving.get(&path(COW, "/video"));
    let size = bytes.len().to_string();
    assert_eq!(video.header("content-length"), Some(size.as_str()));
    assert!(video.status == 200 && video.body == bytes);
    let name = video.header("content-disposition").unwrap();
    assert!(name.ends_with("cow-short.mkv"), "{name}");
}

#[test]
fn nothing_outside_the_folder_of_sessions_can_be_reached() {
    let serving = Serving::start();
    serving.hold(&[COW]);
    let outside = tempfile::tempdir().unwrap();
    let secret = outside.path().join("20261120T000000Z-secret");
    fs::create_dir(&secret).unwrap();
    for file in ["session.json", "video.mkv", "frames.jsonl"] {
        fs::copy(serving.root.path().join(COW).join(file), secret.join(file)).unwrap();
    }
    let way = format!("{}", secret.display()).replace('/', "%2f");
    let near = outside
        .path()
        .file_name()
        .unwrap()
        .to_str()
        .unwrap()
        .to_owned();
    let up = format!("..%2f{near}%2f20261120T000000Z-secret");
    for id in [
        "..",
        ".",
        "%2e%2e",
        "..%2f",
        "%2e%2e%2f%2e%2e%2fetc",
        "..%5c",
        ".hidden",
        "%00",
        "",
        "%ff",
        way.as_str(),
        up.as_str(),
        "20261120T101500Z-cow-short%2f..%2f20261120T101500Z-cow-short",
    ] {
        for rest in ["", "/video", "/thumbnail.jpg", "/frames/0.jpg"] {
            let status = serving.get(&path(id, rest)).status;
            assert!(matches!(status, 400 | 404), "{id}{rest} gave {status}");
        }
    }
    let manifest = serving.root.path().join(COW).join("session.json");
    let text = fs::read_to_string(&manifest).unwrap();
    fs::write(&manifest, text.replace("video.mkv", "../../etc/passwd")).unwrap();
    assert_eq!(serving.get(&path(COW, "/video")).status, 500);
}

/// The names in a tar file, in order; unpacks it into `to`.
fn unpack(tar: &[u8], to: &std::path::Path) -> Vec<String> {
    let mut names = Vec::new();
    for entry in tar::Archive::new(tar).entries().unwrap() {
        let mut entry = entry.unwrap();
        let name = entry.path().unwrap().to_str().unwrap().to_owned();
        let mut bytes = Vec::new();
        entry.read_to_end(&mut bytes).unwrap();
        let path = to.join(&name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
        names.push(name);
    }
    names
}

#[test]
fn a_session_comes_as_a_tar_file_that_unpacks_to_a_session() {
    let serving = Serving::start();
    serving.hold(&[COW]);
    let folder = serving.root.path().join(COW);
    fs::write(folder.join("mask.png"), b"a mask").unwrap();
    fs::write(folder.join(".hidden"), b"").unwrap();
    let answer = serving.get(&path(COW, ".tar"));
    assert_eq!(answer.status, 200);
    assert_eq!(answer.header("content-type"), Some("application/x-tar"));
    let length = answer.body.len().to_string();
    assert_eq!(answer.header("content-length"), Some(length.as_str()));
    let to = tempfile::tempdir().unwrap();
    let names = unpack(&answer.body, to.path());
    let wanted = ["session.json", "frames.jsonl", "mask.png", "video.mkv"];
    assert_eq!(names, wanted.map(|name| format!("{COW}/{name}")));
    let recording = Recording::open(&to.path().join(COW)).unwrap();
    assert_eq!(recording.manifest.unwrap().status, Status::Complete);
    assert!(recording.notices.is_empty(), "{:?}", recording.notices);
    for name in wanted {
        let original = fs::read(folder.join(name)).unwrap();
        assert!(
            fs::read(to.path().join(COW).join(name)).unwrap() == original,
            "{name}"
        );
    }
}

#[test]
fn a_session_that_is_being_recorded_is_not_sent() {
    let serving = Serving::start();
    serving.hold(&[DROPPED]);
    let manifest = serving.root.path().join(DROPPED).join("session.json");
    let text = fs::read_to_string(&manifest).unwrap();
    fs::write(&manifest, text.replace("\"complete\"", "\"recording\"")).unwrap();
    assert_eq!(serving.get(&path(DROPPED, ".tar")).status, 409);
    assert_eq!(serving.get("/api/v1/sessions/nothing.tar").status, 404);
}

#[test]
fn a_session_is_put_away_and_taken_back() {
    let serving = Serving::start();
    serving.hold(&[COW]);
    let ask = |method: &str, rest: &str| serving.ask(method, &path(COW, rest), &[], b"").status;
    let listed = || {
        serving
            .get("/api/v1/sessions")
            .json()
            .as_array()
            .unwrap()
            .len()
    };
    assert_eq!(ask("DELETE", ""), 204);
    assert_eq!((listed(), ask("DELETE", "")), (0, 404));
    let trash = serving.root.path().join(".trash").join(COW);
    assert!(trash.join("video.mkv").is_file());
    assert_eq!(ask("POST", "/restore"), 204);
    assert_eq!((listed(), ask("POST", "/restore")), (1, 404));
    let outside = serving.ask("POST", "/api/v1/sessions/..%2Fx/restore", &[], b"");
    assert_eq!(outside.status, 404);
    let other_site = ["Origin: http://evil.example"];
    let refused = serving.ask("DELETE", &path(COW, ""), &other_site, b"");
    assert_eq!((refused.status, listed()), (403, 1));
}

#[test]
fn note_and_rating_are_written_to_the_manifest() {
    let serving = Serving::start();
    serving.hold(&[COW]);
    let put = |body: &str| {
        let headers = ["Content-Type: application/json"];
        let answer = serving.ask("PUT", &path(COW, "/remarks"), &headers, body.as_bytes());
        answer.status
    };
    assert_eq!(put(r#"{"note": " a fly on it ", "rating": 2}"#), 204);
    let list = serving.get("/api/v1/sessions").json();
    assert_eq!(
        (&list[0]["note"], &list[0]["rating"]),
        (&"a fly on it".into(), &2.into())
    );
    assert_eq!(put(r#"{"rating": 6}"#), 400);
    assert_eq!(put(r#"{"stars": 1}"#), 400);
    assert_eq!(put("{}"), 204);
    let manifest = serving.get(&path(COW, "")).json()["manifest"].clone();
    assert!(manifest.get("note").is_none() && manifest.get("rating").is_none());
    // Everything else is as it was.
    let original = serving.root.path().join(COW).join("session.json");
    assert!(Recording::open(original.parent().unwrap()).is_ok());
}

#[test]
fn a_mask_is_served_where_there_is_one() {
    let serving = Serving::start();
    serving.hold(&[COW]);
    assert_eq!(serving.get(&path(COW, "/mask.png")).status, 404);
    assert_eq!(serving.get(&path(COW, "")).json()["has_mask"], false);
    fs::write(serving.root.path().join(COW).join("mask.png"), b"a mask").unwrap();
    let mask = serving.get(&path(COW, "/mask.png"));
    assert_eq!(
        (mask.header("content-type"), &mask.body[..]),
        (Some("image/png"), &b"a mask"[..])
    );
    assert_eq!(serving.get(&path(COW, "")).json()["has_mask"], true);
}
