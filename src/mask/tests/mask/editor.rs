//! The editor over HTTP, as its page uses it.

use std::fs;

use serde_json::{Value, json};

use super::editing::Editing;
use super::program::turn_video;
use super::support::{clip, code, read, relit_mask, said};
use relit_test_support::disc::{WIDTH, disc_share};

/// A sketch with a rectangle around the disc, and a stroke of each kind.
fn sketch() -> Value {
    json!({
        "frame": 1, "auto": false, "rect": [24, 8, 50, 48],
        "strokes": [
            { "brush": "object", "radius": 4.25, "points": [[40.0, 30.5], [55.125, 33.0]] },
            { "brush": "background", "radius": 2, "points": [[28, 10], [40, 10.5]] },
            { "brush": "eraser", "radius": 3, "points": [[28, 10]] },
        ],
    })
}

#[test]
fn an_accepted_sketch_is_written_and_its_recipe_makes_the_same_files_again() {
    let folder = clip();
    let path = folder.path();
    let editing = Editing::start(path, &["clip.y4m"]);
    let about = editing.get("/api/v1/recording").json();
    assert_eq!(
        (about["width"].as_u64(), about["frames"].as_u64()),
        (Some(96), Some(3))
    );
    assert_eq!(about["sketch"]["rect"], Value::Null);
    let shown = editing.post("/api/v1/mask?draft=true", &sketch()).json();
    assert_eq!(shown["exact"], true);
    assert_eq!(fs::read_dir(path).unwrap().count(), 1);
    let accepted = editing.post("/api/v1/accept", &sketch()).json();
    assert_eq!(accepted["area_px"], shown["area_px"]);
    assert!(editing.end().success());

    let mask = image::load_from_memory(&read(path, "mask.png")).unwrap();
    assert!(disc_share(mask.as_luma8().unwrap()) > 0.97);
    let record: Value = serde_json::from_slice(&read(path, "mask.json")).unwrap();
    assert_eq!(record["source"]["frame"], 1);
    assert_eq!(
        record["hints"]["strokes"][0]["points"][1],
        json!([55.125, 33.0])
    );
    assert_eq!(record["result"]["mask_blake3"], accepted["mask_blake3"]);
    let output = relit_mask(path, &["clip.y4m", "--recipe", "mask.json", "-o", "b.png"]);
    assert_eq!(code(&output), 0, "{}", said(&output));
    for (first, second) in [("mask.png", "b.png"), ("mask.json", "b.json")] {
        assert!(read(path, first) == read(path, second), "{second} differs");
    }
}

#[test]
fn a_recipe_is_taken_up_where_it_was_left() {
    let folder = clip();
    let editing = Editing::start(folder.path(), &["clip.y4m"]);
    editing.post("/api/v1/accept", &sketch());
    assert!(editing.end().success());
    let editing = Editing::start(folder.path(), &["clip.y4m", "--recipe", "mask.json"]);
    let about = editing.get("/api/v1/recording").json();
    assert_eq!(about["sketch"]["rect"], sketch()["rect"]);
    assert_eq!(
        about["sketch"]["strokes"][0]["points"],
        sketch()["strokes"][0]["points"]
    );
    assert_eq!(about["sketch"]["frame"], 1);
}

#[test]
fn without_the_token_or_under_another_name_nothing_is_shown_and_nothing_done() {
    let folder = clip();
    let editing = Editing::start(folder.path(), &["clip.y4m"]);
    assert!(editing.address.starts_with("127.0.0.1:"));
    assert_eq!(editing.token.len(), 32);
    assert!(editing.url.contains(&editing.address), "{}", editing.url);
    let body = sketch().to_string();
    let json = "Content-Type: application/json";
    for (method, path) in [
        ("GET", "/api/v1/recording"),
        ("GET", "/api/v1/frames/0"),
        ("POST", "/api/v1/mask"),
        ("POST", "/api/v1/accept"),
        ("POST", "/api/v1/discard"),
    ] {
        let without = editing.ask(method, path, &[json], &body);
        assert_eq!(without.status, 401, "{path}");
        let wrong = format!("Authorization: Bearer {}", "0".repeat(32));
        assert_eq!(
            editing.ask(method, path, &[json, &wrong], &body).status,
            401
        );
        let right = format!("Authorization: Bearer {}", editing.token);
        for (line, status) in [
            ("Host: evil.example", 421),
            ("Origin: http://evil.example", 403),
            ("Origin: null", 403),
        ] {
            let refused = editing.ask(method, path, &[json, &right, line], &body);
            assert_eq!(refused.status, status, "{path} {line}");
        }
    }
    let entry = editing.ask("GET", &format!("/?token={}", editing.token), &[], "");
    assert_eq!(entry.status, 303);
    assert!(entry.head.contains("SameSite=Strict") && entry.head.contains("HttpOnly"));
    assert_eq!(editing.ask("GET", "/", &[], "").status, 200);
    assert!(!folder.path().join("mask.png").exists());
}

#[test]
fn what_cannot_be_cut_is_answered_with_a_sentence_and_the_editor_goes_on() {
    let folder = clip();
    let editing = Editing::start(folder.path(), &["clip.y4m"]);
    let with = |change: &[(&str, Value)]| {
        let mut sketch = sketch();
        change
            .iter()
            .for_each(|(name, value)| sketch[*name] = value.clone());
        editing.post("/api/v1/mask", &sketch)
    };
    let none = [("rect", Value::Null), ("strokes", json!([]))];
    let background = json!([{ "brush": "background", "radius": 3, "points": [[5, 5]] }]);
    for (change, status, named) in [
        (&none[..], 422, ""),
        (&[("rect", json!([900, 0, 9, 9]))], 422, "96 x 64"),
        (&[("rect", json!([0, 0, 96, 64])), none[1].clone()], 422, ""),
        (&[("rect", Value::Null), ("strokes", background)], 422, ""),
        (
            &[("auto", json!(true)), none[0].clone(), none[1].clone()],
            422,
            "3 ",
        ),
        (&[("frame", json!(3))], 404, "2"),
        (&[("frame", json!(-1))], 400, ""),
        (&[("surplus", json!(1))], 400, "surplus"),
        (
            &[(
                "strokes",
                json!([{ "brush": "object", "radius": 0, "points": [[1, 1]] }]),
            )],
            400,
            "stroke 0",
        ),
    ] {
        let answer = with(change);
        assert_eq!(answer.status, status, "{change:?}");
        let sentence = answer.error();
        assert!(sentence.contains(named), "{change:?}: {sentence}");
        assert!(!sentence.is_empty(), "{change:?}");
    }
    let plain = editing.ask(
        "POST",
        "/api/v1/mask",
        &[&format!("Authorization: Bearer {}", editing.token)],
        "{}",
    );
    assert_eq!(plain.status, 415);
    assert_eq!(with(&[]).status, 200);
}

#[test]
fn frames_are_shown_in_the_size_that_is_asked_for() {
    let folder = clip();
    let editing = Editing::start(folder.path(), &["clip.y4m"]);
    let jpeg = editing.get("/api/v1/frames/2?width=48");
    let picture = image::load_from_memory(&jpeg.body).unwrap();
    assert_eq!((picture.width(), picture.height()), (48, 32));
    let jpeg = editing.get("/api/v1/frames/0");
    assert_eq!(image::load_from_memory(&jpeg.body).unwrap().width(), WIDTH);
    assert_eq!(editing.get("/api/v1/frames/3").status, 404);
    assert_eq!(editing.get("/api/v1/frames/x").status, 400);
}

#[test]
fn a_discarded_sketch_writes_nothing_and_exits_with_1() {
    let folder = clip();
    let editing = Editing::start(folder.path(), &["clip.y4m", "--rect", "24,8,50,48"]);
    assert_eq!(
        editing.get("/api/v1/recording").json()["sketch"]["rect"],
        json!([24, 8, 50, 48])
    );
    assert_eq!(editing.post("/api/v1/discard", &Value::Null).status, 204);
    assert_eq!(editing.end().code(), Some(1));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn a_mask_that_was_painted_meanwhile_is_kept() {
    let folder = clip();
    let editing = Editing::start(folder.path(), &["clip.y4m"]);
    fs::write(folder.path().join("mask.png"), "painted").unwrap();
    let answer = editing.post("/api/v1/accept", &sketch());
    assert_eq!(answer.status, 409);
    assert!(answer.error().contains("mask.png"), "{}", answer.error());
    assert_eq!(read(folder.path(), "mask.png"), b"painted");
}

#[test]
fn the_turn_and_strokes_of_background_alone_work_together() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("turn.y4m"), turn_video()).unwrap();
    let editing = Editing::start(folder.path(), &["turn.y4m"]);
    let of = |strokes: Value| {
        let sketch = json!({ "frame": 0, "auto": true, "rect": null, "strokes": strokes });
        editing.post("/api/v1/mask", &sketch).json()["area_px"]
            .as_u64()
            .unwrap()
    };
    let stroke = |brush, x| json!({ "brush": brush, "radius": 3, "points": [[x, 24], [x, 40]] });
    let whole = of(json!([]));
    let unchanged = of(json!([{ "brush": "background", "radius": 3, "points": [[9, 9]] }]));
    assert!(
        unchanged.abs_diff(whole) < whole / 50,
        "{unchanged} and {whole}"
    );
    let parted = of(json!([stroke("object", 42), stroke("background", 60)]));
    assert!(parted < whole * 95 / 100, "{parted} of {whole}");
}

#[test]
fn a_folder_of_several_recordings_is_a_usage_error() {
    let folder = clip();
    fs::copy(folder.path().join("clip.y4m"), folder.path().join("a.mkv")).unwrap();
    let wrong: [&[&str]; 2] = [
        &["clip.y4m", "--rect", "1,1,9,9", "--listen", "127.0.0.1:0"],
        &["clip.y4m", "--edit", "--listen", "everywhere"],
    ];
    for arguments in wrong {
        assert_eq!(
            code(&relit_mask(folder.path(), arguments)),
            2,
            "{arguments:?}"
        );
    }
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap().to_string();
    let output = relit_mask(folder.path(), &["clip.y4m", "--edit", "--listen", &address]);
    assert_eq!(code(&output), 1);
    assert!(said(&output).contains(&address), "{}", said(&output));
}
