//! The app's engine beside the program: what the page shows, saves and keeps is what `relight` makes of the same files; and
//! `relight serve` from outside. The network is not trained.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test that cannot go on has failed"
)]

use std::fs;
use std::io::{BufRead, BufReader, Cursor, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};

use image::{DynamicImage, ImageFormat, Rgb, RgbImage};
use relight_app::{Studio, pack, unpack};
use relight_photo::nets::{WeightPrecision, Weights, decomposer};
use serde_json::{Value, json};

const WIDTH: u32 = 120;
const HEIGHT: u32 = 90;

fn png(image: RgbImage) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let image = DynamicImage::ImageRgb8(image);
    image.write_to(&mut bytes, ImageFormat::Png).unwrap();
    bytes.into_inner()
}

/// A ball before a sky.
fn photo() -> Vec<u8> {
    png(RgbImage::from_fn(WIDTH, HEIGHT, |x, y| {
        let is_ball = (f64::from(x) - 60.0).hypot(f64::from(y) - 45.0) < 26.0;
        if is_ball {
            Rgb([150 + (x / 2) as u8, 60, 20 + y as u8])
        } else {
            Rgb([70 + (x % 3) as u8, 120, 200])
        }
    }))
}

fn room() -> Vec<u8> {
    png(RgbImage::from_fn(200, 150, |x, y| {
        let noise = (x * 7 + y * 13) % 5;
        Rgb([60 + x as u8 / 2, 70 + (noise + y / 3) as u8, 90])
    }))
}

/// An engine that is asked as a page asks it.
struct Page {
    studio: Studio,
    weights: Vec<u8>,
}

impl Page {
    fn new(folder: &Path) -> Self {
        let weights = Weights::initial(&decomposer(), 3);
        let path = folder.join("w.safetensors");
        weights.write(&path, WeightPrecision::Half).unwrap();
        let mut page = Self {
            studio: Studio::new(),
            weights: fs::read(&path).unwrap(),
        };
        let weights = page.weights.clone();
        page.ask(json!({ "op": "load" }), &weights);
        page
    }

    fn answer(&mut self, says: &Value, part: &[u8]) -> (Value, Vec<Vec<u8>>) {
        let reply = self
            .studio
            .answer(&pack(&[says.to_string().as_bytes(), part]));
        let parts = unpack(&reply).unwrap();
        let others = parts[1..].iter().map(|part| part.to_vec()).collect();
        (serde_json::from_slice(parts[0]).unwrap(), others)
    }

    fn ask(&mut self, says: Value, part: &[u8]) -> (Value, Vec<Vec<u8>>) {
        let (answer, parts) = self.answer(&says, part);
        assert_eq!(answer.get("error"), None, "{says}: {answer}");
        (answer, parts)
    }

    fn fault(&mut self, says: Value, part: &[u8]) -> String {
        let (answer, parts) = self.answer(&says, part);
        assert!(parts.is_empty());
        answer["error"].as_str().expect("an error").to_owned()
    }

    /// A ball that is cut out, before a room.
    fn with_ball(folder: &Path) -> Self {
        let mut page = Self::new(folder);
        let open = json!({ "op": "open_photo", "object": 1, "name": "my ball.png" });
        let (answer, parts) = page.ask(open, &photo());
        assert_eq!(answer["masked"], false);
        assert_eq!(parts[0].len() as u32, 4 * WIDTH * HEIGHT);
        let mask = json!({ "op": "mask", "object": 1, "rect": [30, 15, 60, 60], "strokes": [] });
        let (answer, parts) = page.ask(mask, &[]);
        let area = answer["area"].as_u64().unwrap();
        assert!((1900..2300).contains(&area), "{answer}");
        assert_eq!(parts[0].iter().filter(|v| **v >= 128).count() as u64, area);
        let room_file = room();
        page.ask(
            json!({ "op": "background", "kind": "photo", "name": "room.png" }),
            &room_file,
        );
        page
    }
}

fn scene(light: Value) -> Value {
    json!({
        "size": [160, 120], "fov": 60.0, "down": 10.0, "match": true, "white_balance": "light",
        "exposure": 0.0,
        "light": light,
        "objects": [{
            "object": 1, "at": [0.4, 0.8], "height": 0.5, "rotation": 12.5, "tint": [1.0, 0.8, 0.6],
            "gloss": [0.2, 30.0], "exposure": 0.1, "shadow": 0.9,
        }],
    })
}

fn lamp(turn: f64) -> Value {
    json!({ "lamp": "-40,35,#ffcc99,20", "ambient": 0.2, "angle": turn })
}

fn evening() -> Vec<u8> {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../app/page");
    fs::read(page.join("evening.hdr")).unwrap()
}

fn relight(folder: &Path, arguments: &[&str]) -> (i32, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_relight"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap();
    let errors = String::from_utf8(output.stderr).unwrap();
    (output.status.code().unwrap(), errors)
}

fn unzip(archive: &[u8], folder: &Path) {
    let mut archive = zip::ZipArchive::new(Cursor::new(archive)).unwrap();
    archive.extract(folder).unwrap();
}

#[test]
fn the_program_makes_the_page_s_picture_of_the_scene_that_the_page_keeps() {
    for (light, is_panorama) in [
        (json!({ "angle": 0.0 }), false),
        (lamp(25.0), false),
        (json!({ "angle": -70.0 }), true),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let mut page = Page::with_ball(folder.path());
        if is_panorama {
            let name = "evening.hdr";
            page.ask(
                json!({ "op": "background", "kind": "panorama_file", "name": name }),
                &evening(),
            );
        }
        let scene = scene(light);
        let save = json!({ "op": "save", "scene": scene, "format": "png" });
        let (_, saved) = page.ask(save, &[]);
        let (_, kept) = page.ask(json!({ "op": "export", "scene": scene, "name": "a" }), &[]);
        let out = folder.path().join("kept");
        unzip(&kept[0], &out);
        let (code, errors) = relight(
            &out,
            &[
                "insert",
                "--scene",
                "scene.toml",
                "--weights",
                "../w.safetensors",
                "-o",
                "out.png",
            ],
        );
        assert_eq!((code, errors.as_str()), (0, ""), "{scene}");
        let theirs = image::open(out.join("out.png")).unwrap().into_rgb8();
        let ours = image::load_from_memory(&saved[0]).unwrap().into_rgb8();
        assert_eq!(ours.dimensions(), theirs.dimensions());
        let pairs = ours.as_raw().iter().zip(theirs.as_raw());
        let most = pairs.map(|(a, b)| a.abs_diff(*b)).max();
        assert!(most <= Some(1), "{scene}: {most:?}");
    }
}

#[test]
fn the_layers_put_together_are_the_picture() {
    let folder = tempfile::tempdir().unwrap();
    let mut page = Page::with_ball(folder.path());
    let mut given = scene(lamp(0.0));
    given["match"] = json!(false);
    let (whole, picture) = page.ask(
        json!({ "op": "render", "scene": given, "longest": 160 }),
        &[],
    );
    let (told, parts) = page.ask(
        json!({ "op": "layers", "scene": given, "longest": 160 }),
        &[],
    );
    let side = |of: &Value, name: &str| of[name].as_i64().unwrap();
    let (width, height) = (side(&told, "width"), side(&told, "height"));
    assert_eq!(
        (width, height),
        (side(&whole, "width"), side(&whole, "height"))
    );
    let linear = |byte: u8| {
        let v = f64::from(byte) / 255.0;
        if v <= 0.04045 {
            v / 12.92
        } else {
            ((v + 0.055) / 1.055).powf(2.4)
        }
    };
    let encoded = |v: f64| {
        let v = if v <= 0.003_130_8 {
            12.92 * v
        } else {
            1.055 * v.powf(1.0 / 2.4) - 0.055
        };
        (v.clamp(0.0, 1.0) * 255.0).round()
    };
    let object = &told["objects"][0];
    let part = |layer: &Value, bytes: &[u8], x: i64, y: i64| {
        let (left, top) = (
            layer["place"][0].as_i64().unwrap(),
            layer["place"][1].as_i64().unwrap(),
        );
        let (w, h) = (side(layer, "width"), side(layer, "height"));
        let (x, y) = (x - left, y - top);
        let inside = x >= 0 && y >= 0 && x < w && y < h;
        inside.then(|| bytes[4 * (y * w + x) as usize..][..4].to_vec())
    };
    let mut most = 0.0_f64;
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let at = 4 * (y * width + x) as usize;
        for c in 0..3 {
            let mut value = linear(parts[0][at + c]);
            if let Some(shadow) = part(&object["shadow"], &parts[2], x, y) {
                value *= f64::from(shadow[c]) / 255.0;
            }
            if let Some(colour) = part(object, &parts[1], x, y) {
                let alpha = f64::from(colour[3]) / 255.0;
                value = value * (1.0 - alpha) + linear(colour[c]);
            }
            most = most.max((encoded(value) - f64::from(picture[0][at + c])).abs());
        }
    }
    assert!(most <= 2.0, "{most}");
}

#[test]
fn what_cannot_be_done_is_a_sentence_and_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let mut page = Page::with_ball(folder.path());
    let open =
        |object: u32, name: &str| json!({ "op": "open_photo", "object": object, "name": name });
    let whole = photo();
    for (name, bytes) in [
        ("cut.png", &whole[..whole.len() / 2]),
        ("text.jpg", b"no picture"),
        ("empty.png", b""),
        ("drawing.svg", b"<svg xmlns='http://www.w3.org/2000/svg'/>"),
        ("broken.relit", b"PK\x03\x04"),
    ] {
        let fault = page.fault(open(2, name), bytes);
        assert!(fault.len() > 10 && !fault.contains('\n'), "{name}: {fault}");
        assert!(!fault.contains("Error"), "{name}: {fault}");
    }
    // The header of a PNG of 20,000 x 20,000 pixels: it is refused before anything is decoded.
    let mut large = whole.clone();
    large[16..24].copy_from_slice(&[0, 0, 0x4e, 0x20, 0, 0, 0x4e, 0x20]);
    let fault = page.fault(open(2, "large.png"), &large);
    assert!(
        fault.contains("20000 x 20000") || fault.contains("large.png"),
        "{fault}"
    );
    let bare = json!({ "op": "render", "scene": scene(lamp(0.0)), "longest": 64 });
    page.ask(bare.clone(), &[]);
    for number in 2..=12 {
        page.ask(open(number, "ball.png"), &whole);
    }
    let fault = page.fault(open(13, "ball.png"), &whole);
    assert!(fault.contains("12"), "{fault}");
    let mut unmarked = scene(lamp(0.0));
    unmarked["objects"][0]["object"] = json!(2);
    let fault = page.fault(
        json!({ "op": "render", "scene": unmarked, "longest": 64 }),
        &[],
    );
    assert!(!fault.is_empty());
    let outside = json!({ "op": "mask", "object": 1, "rect": [500, 500, 10, 10], "strokes": [] });
    page.fault(outside, &[]);
    page.fault(json!({ "op": "dance" }), &[]);
    page.fault(
        json!({ "op": "background", "kind": "panorama_file", "name": "a.png" }),
        &whole,
    );
    page.ask(bare, &[]);
}

#[test]
fn a_large_photograph_is_made_smaller_and_kept_so() {
    let folder = tempfile::tempdir().unwrap();
    let mut page = Page::new(folder.path());
    let large = png(RgbImage::from_fn(2400, 1600, |x, y| {
        Rgb([(x / 10) as u8, (y / 8) as u8, 90])
    }));
    let open = json!({ "op": "open_photo", "object": 1, "name": "large.png" });
    let (answer, _) = page.ask(open, &large);
    assert_eq!(answer["reduced"], true);
    let pixels = answer["width"].as_u64().unwrap() * answer["height"].as_u64().unwrap();
    assert!((1_900_000..=2_000_000).contains(&pixels), "{answer}");
}

/// `relight serve`, ended when it is dropped.
struct Server(Child);

impl Server {
    /// With a page of two files; its address.
    fn start(folder: &Path, arguments: &[&str]) -> (Self, String) {
        let page = folder.join("page");
        fs::create_dir_all(&page).unwrap();
        fs::write(
            page.join("files.json"),
            r#"{"version": "1", "files": {"index.html": 37, "a.wasm": 4}}"#,
        )
        .unwrap();
        fs::write(
            page.join("index.html"),
            "<!doctype html><title>relight</title>",
        )
        .unwrap();
        fs::write(page.join("a.wasm"), b"\0asm").unwrap();
        fs::write(page.join("a.wasm.gz"), "compressed").unwrap();
        let mut child = Command::new(env!("CARGO_BIN_EXE_relight"))
            .args(["--json", "serve", "--page", "page"])
            .args(arguments)
            .current_dir(folder)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        let output = child.stdout.take().unwrap();
        BufReader::new(output).read_line(&mut line).unwrap();
        let event: Value = serde_json::from_str(&line).unwrap();
        assert_eq!(event["event"], "serving");
        (Self(child), event["url"].as_str().unwrap().to_owned())
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Sends a request's head to the address of a URL; status and all of the answer.
fn ask(url: &str, head: &str) -> (u16, String) {
    let address = url.split('/').nth(2).unwrap();
    let mut stream = TcpStream::connect(address).unwrap();
    write!(stream, "{head}\r\nConnection: close\r\n\r\n").unwrap();
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).unwrap();
    let text = String::from_utf8_lossy(&answer).into_owned();
    (text.split(' ').nth(1).unwrap().parse().unwrap(), text)
}

#[test]
fn the_page_is_handed_out_and_nothing_is_taken() {
    let folder = tempfile::tempdir().unwrap();
    let (_server, url) = Server::start(folder.path(), &["--listen", "127.0.0.1:0"]);
    let get = |path: &str| ask(&url, &format!("GET {path} HTTP/1.1\r\nHost: localhost"));
    let (status, index) = get("/");
    assert_eq!(status, 200);
    let lower = index.to_lowercase();
    assert!(lower.contains(
        "content-security-policy: default-src 'none'; script-src 'self' 'wasm-unsafe-eval'"
    ));
    for header in [
        "cross-origin-opener-policy: same-origin",
        "cross-origin-embedder-policy: require-corp",
    ] {
        assert!(lower.contains(header), "{index}");
    }
    let (status, wasm) = get("/a.wasm");
    assert!(status == 200 && wasm.contains("application/wasm"), "{wasm}");
    for path in [
        "/nothing",
        "/../w.safetensors",
        "/%2e%2e/secret",
        "/page/index.html",
    ] {
        assert_eq!(get(path).0, 404, "{path}");
    }
    let of = |head: &str| ask(&url, head).0;
    assert_eq!(
        of("POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 0"),
        405
    );
    assert_eq!(
        of("PUT /a.wasm HTTP/1.1\r\nHost: localhost\r\nContent-Length: 0"),
        405
    );
    assert_eq!(of("GET / HTTP/1.1\r\nHost: evil.example"), 421);
    assert_eq!(
        of("GET / HTTP/1.1\r\nHost: localhost\r\nOrigin: http://evil.example"),
        403
    );
    let tag = wasm
        .lines()
        .find_map(|line| line.strip_prefix("etag: "))
        .unwrap();
    let again = format!("GET /a.wasm HTTP/1.1\r\nHost: localhost\r\nIf-None-Match: {tag}");
    assert_eq!(of(&again), 304);
    let accepting = format!("{again}\r\nAccept-Encoding: gzip, br");
    let (status, compressed) = ask(&url, &accepting);
    assert_eq!(status, 200, "another encoding is another answer");
    for part in [
        "content-encoding: gzip",
        "vary: accept-encoding",
        "content-length: 10",
        "\r\n\r\ncompressed",
    ] {
        assert!(compressed.contains(part), "{compressed}");
    }
}

#[test]
fn others_need_the_token_which_becomes_a_cookie() {
    let folder = tempfile::tempdir().unwrap();
    let (_server, url) = Server::start(
        folder.path(),
        &["--listen", "127.0.0.1:0", "--token-file", "token"],
    );
    let token = url.split("token=").nth(1).unwrap().to_owned();
    let get = |path: &str, more: &str| {
        ask(
            &url,
            &format!("GET {path} HTTP/1.1\r\nHost: localhost{more}"),
        )
    };
    assert_eq!(get("/", "").0, 401);
    assert_eq!(get("/a.wasm", "").0, 401);
    assert_eq!(get("/?token=0123456789abcdef", "").0, 401);
    let (status, answer) = get(&format!("/?token={token}"), "");
    assert_eq!(status, 303, "{answer}");
    let cookie = answer
        .lines()
        .find_map(|line| line.strip_prefix("set-cookie: "))
        .unwrap();
    let cookie = cookie.split(';').next().unwrap();
    assert_eq!(get("/a.wasm", &format!("\r\nCookie: {cookie}")).0, 200);
}

#[test]
fn a_page_that_is_missing_or_not_whole_is_named_and_so_is_a_taken_address() {
    let folder = tempfile::tempdir().unwrap();
    drop(Server::start(folder.path(), &["--listen", "127.0.0.1:0"]));
    let half = folder.path().join("half");
    fs::create_dir(&half).unwrap();
    for name in ["files.json", "a.wasm"] {
        fs::copy(folder.path().join("page").join(name), half.join(name)).unwrap();
    }
    fs::write(half.join("index.html"), "half").unwrap();
    for page in ["nowhere", "half"] {
        let (code, errors) = relight(folder.path(), &["serve", "--page", page]);
        assert!(
            code == 1 && errors.contains(page) && errors.contains("make app"),
            "{errors}"
        );
    }
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap().to_string();
    let (code, errors) = relight(
        folder.path(),
        &["serve", "--page", "page", "--listen", &address],
    );
    assert!(code == 1 && errors.contains(&address), "{errors}");
}
