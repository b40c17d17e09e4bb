//! The editor's page in a real browser, with mouse, keys and fingers.

use std::path::PathBuf;

use relit_test_support::chromium::{self, Chromium};
use relit_test_support::disc::{disc_share, in_disc};
use relit_test_support::editor_canvas::EditorCanvas;
use relit_test_support::say_skipped;
use serde_json::Value;

use super::editing::Editing;
use super::support::{clip, code, read, relit_mask, said};

const READY: &str = "document.getElementById('state')?.dataset.state === 'ready'";
const NONE: &str = "document.getElementById('state')?.dataset.state === 'none'";

/// The browser, if there is one.
fn browser() -> Option<PathBuf> {
    chromium::find()
        .inspect_err(|reason| say_skipped(reason))
        .ok()
}

fn strokes(page: &mut Chromium) -> usize {
    // The page's modules keep their state to themselves: it shows in what can be undone.
    page.value("document.getElementById('undo').disabled ? 0 : 1")
        .as_u64()
        .unwrap() as usize
}

#[test]
fn drawn_undone_drawn_again_and_accepted_with_the_mouse() {
    let Some(program) = browser() else { return };
    let folder = clip();
    let path = folder.path();
    let editing = Editing::start(path, &["clip.y4m"]);
    let mut page = Chromium::open(&program, &editing.url, (1280, 800), false);
    page.wait_for(NONE);
    // The token is gone from the URL.
    assert_eq!(page.value("location.search"), "");
    assert_eq!(
        page.value("document.getElementById('accept').disabled"),
        true
    );
    let screen = EditorCanvas::find(&mut page);

    // A box around the disc.
    page.drag(&[
        screen.at(24.0, 8.0),
        screen.at(50.0, 30.0),
        screen.at(74.0, 56.0),
    ]);
    page.wait_for(READY);
    // An object stroke, then a background stroke above it; the latter is taken back, and comes again.
    page.key("o", 0);
    let stroke = |height| [40.0, 48.0, 56.0].map(|x| screen.at(x, height));
    page.drag(&stroke(38.0));
    page.wait_for(READY);
    page.key("b", 0);
    page.drag(&stroke(24.0));
    page.wait_for(READY);
    let share = |page: &mut Chromium| {
        let text = page.value("document.getElementById('state').textContent");
        let mut words = text.as_str().unwrap().split(' ');
        words.find_map(|word| word.parse::<f64>().ok()).unwrap()
    };
    let parted = share(&mut page);
    page.key("z", 2);
    page.wait_for(&format!(
        "{READY} && !document.getElementById('redo').disabled"
    ));
    let whole = share(&mut page);
    assert!(parted < whole - 1.0, "{parted} % and {whole} %");
    page.key("y", 2);
    page.wait_for(&format!(
        "{READY} && document.getElementById('redo').disabled"
    ));
    assert!((share(&mut page) - parted).abs() < 0.05);
    page.click("#undo");
    page.wait_for(&format!(
        "{READY} && !document.getElementById('redo').disabled"
    ));
    assert_eq!(strokes(&mut page), 1);

    page.click("#accept");
    page.wait_for("document.getElementById('state').dataset.state === 'accepted'");
    assert!(editing.end().success());
    let mask = image::load_from_memory(&read(path, "mask.png")).unwrap();
    assert!(disc_share(mask.as_luma8().unwrap()) > 0.98);
    let record: Value = serde_json::from_slice(&read(path, "mask.json")).unwrap();
    assert_eq!(record["hints"]["rect"], serde_json::json!([24, 8, 50, 48]));
    assert_eq!(record["hints"]["strokes"].as_array().unwrap().len(), 1);
    let output = relit_mask(path, &["clip.y4m", "--recipe", "mask.json", "-o", "b.png"]);
    assert_eq!(code(&output), 0, "{}", said(&output));
    assert!(read(path, "mask.png") == read(path, "b.png"));
}

#[test]
fn a_finger_draws_and_two_zoom_on_a_phone() {
    let Some(program) = browser() else { return };
    let folder = clip();
    let path = folder.path();
    let editing = Editing::start(path, &["clip.y4m"]);
    let mut page = Chromium::open(&program, &editing.url, (390, 760), true);
    page.wait_for(NONE);
    // Nothing hangs over the side of the screen.
    assert_eq!(
        page.value("tools.scrollWidth <= tools.clientWidth && document.documentElement.scrollWidth <= innerWidth"),
        true
    );

    // Two fingers apart: twice as large, and nothing drawn.
    let screen = EditorCanvas::find(&mut page);
    let apart = |way: f64| {
        let [x, y] = screen.at(48.0, 32.0);
        vec![[x - way, y], [x + way, y]]
    };
    page.touch(&[apart(40.0), apart(60.0), apart(80.0)]);
    // The page notes its view with the next picture of the screen.
    page.wait_for(&format!(
        "Number(canvas.dataset.view.split(' ')[0]) > {}",
        1.7 * screen.scale
    ));
    assert_eq!(strokes(&mut page), 0);
    page.click("#fit");
    page.wait_for(&format!(
        "Number(canvas.dataset.view.split(' ')[0]) < {}",
        1.01 * screen.scale
    ));

    // A box, an object stroke and a background stroke with one finger.
    let line = |places: &[[f64; 2]]| {
        places
            .iter()
            .map(|p| vec![screen.at(p[0], p[1])])
            .collect::<Vec<_>>()
    };
    page.touch(&line(&[[24.0, 8.0], [50.0, 30.0], [74.0, 56.0]]));
    page.wait_for(READY);
    page.click("[data-tool=object]");
    page.touch(&line(&[[40.0, 32.0], [48.0, 33.0], [56.0, 32.0]]));
    page.click("[data-tool=background]");
    page.touch(&line(&[[30.0, 12.0], [36.0, 11.0], [30.0, 12.0]]));
    page.wait_for(READY);
    page.click("#accept");
    page.wait_for("document.getElementById('state').dataset.state === 'accepted'");
    assert!(editing.end().success());
    let mask = image::load_from_memory(&read(path, "mask.png")).unwrap();
    let mask = mask.as_luma8().unwrap();
    assert!(disc_share(mask) > 0.97);
    let record: Value = serde_json::from_slice(&read(path, "mask.json")).unwrap();
    let painted = record["hints"]["strokes"].as_array().unwrap();
    let brushes: Vec<_> = painted
        .iter()
        .map(|stroke| stroke["brush"].clone())
        .collect();
    assert_eq!(brushes, ["object", "background"]);
    // The strokes are where the finger was.
    let [x, y]: [f64; 2] = serde_json::from_value(painted[0]["points"][0].clone()).unwrap();
    assert!((x - 40.0).abs() < 1.0 && (y - 32.0).abs() < 1.0, "{x} {y}");
    assert!(in_disc(x as u32, y as u32));
}
