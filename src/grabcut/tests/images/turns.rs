//! Masks by the turn of objects with holes, handles, dark parts and parts in shade, and what their check says.

use image::GrayImage;
use relit_grabcut::{Effort, Hints, MaskCheck, ShapeCheck};

use super::turn_scene::{Difficulty, Scene, TROUBLES, scene};
use super::{by_seeds, segment_turn};

/// Small enough to be made on the fly.
const SMALL: (u32, u32) = (176, 132);
/// Seeds of the tests; others were used to choose constants.
const SEED: u64 = 4_000;

/// What a mask has to reach: intersection over union, and the share of the critical part that is right.
const MIN_IOU: f64 = 0.96;
const MIN_RIGHT: f64 = 0.95;

/// Intersection over union.
fn iou(mask: &GrayImage, truth: &GrayImage) -> f64 {
    let pairs = || {
        let pixels = mask.pixels().zip(truth.pixels());
        pixels.map(|(mask, truth)| (mask.0[0] >= 128, truth.0[0] >= 128))
    };
    let both = pairs().filter(|(mask, truth)| *mask && *truth).count();
    both as f64 / pairs().filter(|(mask, truth)| *mask || *truth).count() as f64
}

/// The share of the critical part of which the mask is right.
fn right_there(mask: &GrayImage, scene: &Scene) -> f64 {
    let pixels = mask
        .pixels()
        .zip(scene.truth.pixels())
        .zip(scene.critical.pixels());
    let critical: Vec<bool> = pixels
        .filter(|(_, critical)| critical.0[0] > 0)
        .map(|((mask, truth), _)| (mask.0[0] >= 128) == (truth.0[0] >= 128))
        .collect();
    critical.iter().filter(|right| **right).count() as f64 / critical.len() as f64
}

/// Intersection over union, and the share of the critical part that is right.
fn figures(trouble: Difficulty, size: (u32, u32), frames: usize, seed: u64) -> (f64, f64) {
    let scene = scene(trouble, size, frames, seed);
    let mask = segment_turn(&scene.frames[0], &scene.statistics(), &Hints::default());
    let mask = mask.unwrap().image;
    if let Some(folder) = std::env::var_os("RELIT_LOOK") {
        let folder = std::path::Path::new(&folder);
        mask.save(folder.join(format!("{trouble:?}-{seed}.png")))
            .unwrap();
        scene.frames[0]
            .save(folder.join(format!("{trouble:?}-{seed}-frame.png")))
            .unwrap();
    }
    (iou(&mask, &scene.truth), right_there(&mask, &scene))
}

#[test]
fn holes_stay_open_and_dark_and_shaded_parts_stay_in() {
    let found = TROUBLES.map(|trouble| (trouble, figures(trouble, SMALL, 24, SEED)));
    let wrong = |(iou, right): (f64, f64)| iou < MIN_IOU || right < MIN_RIGHT;
    assert!(
        !found.iter().any(|(_, figures)| wrong(*figures)),
        "{found:.3?}"
    );
}

/// `RELIT_LOOK=FOLDER cargo test --release -p relit-grabcut --test images -- --ignored --nocapture larger`
#[test]
#[ignore = "minutes: the figures of docs/results/masks.md"]
fn larger_turns_are_cut_as_well() {
    let mut wrong = Vec::new();
    for trouble in TROUBLES {
        for seed in [9_001, 9_002, 9_003] {
            let (iou, right) = figures(trouble, (640, 480), 32, seed);
            let percent = 100.0 * right;
            println!("{trouble:?} {seed}: IoU {iou:.4}, critical part {percent:.1} %");
            if iou < MIN_IOU || right < MIN_RIGHT {
                wrong.push((trouble, seed));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

#[test]
fn the_check_sees_a_hole_in_the_object() {
    let scene = scene(Difficulty::Shade, SMALL, 24, SEED);
    let turn = scene.statistics();
    let mut holed = scene.truth.clone();
    for (mask, critical) in holed.pixels_mut().zip(scene.critical.pixels()) {
        if critical.0[0] > 0 {
            mask.0[0] = 0;
        }
    }
    let shape = |mask: &GrayImage| {
        let check = MaskCheck::new(mask, &turn).unwrap();
        check
            .shape(&scene.frames[0], Effort::Fine)
            .unwrap()
            .unwrap()
    };
    let found = shape(&holed);
    assert_eq!(found.missing.len(), 1, "{found:?}");
    assert!(!found.faults().is_empty());
    assert!(
        shape(&scene.truth).faults().is_empty(),
        "{:?}",
        shape(&scene.truth)
    );
}

/// What the check says of a true mask with more pixels.
fn shape_with(scene: &Scene, more: impl Fn(u32, u32) -> bool) -> ShapeCheck {
    let mask = GrayImage::from_fn(scene.truth.width(), scene.truth.height(), |x, y| {
        let is_object = scene.truth.get_pixel(x, y).0[0] > 0;
        image::Luma([if is_object || more(x, y) { 255 } else { 0 }])
    });
    let turn = scene.statistics();
    let check = MaskCheck::new(&mask, &turn).unwrap();
    let shape = check.shape(&scene.frames[0], Effort::Fine).unwrap();
    shape.unwrap()
}

#[test]
fn the_check_sees_the_table_in_an_opening_that_a_mask_includes() {
    let scene = scene(Difficulty::LowHandle, SMALL, 24, SEED);
    let near = |at: u32, side: u32| at.saturating_sub(5)..(at + 6).min(side);
    let found = shape_with(&scene, |x, y| {
        let mut around = near(y, SMALL.1).flat_map(|y| near(x, SMALL.0).map(move |x| (x, y)));
        around.any(|(x, y)| scene.critical.get_pixel(x, y).0[0] > 0)
    });
    assert_eq!(found.leaks.len(), 1, "{found:?}");
    assert!(!found.faults().is_empty());
}

#[test]
fn the_check_sees_a_thin_piece_of_the_rim_in_a_mask() {
    let scene = scene(Difficulty::DarkPart, SMALL, 24, SEED);
    // The rim is where the table's dark begins, at the left border.
    let level = |y: u32| scene.frames[0].get_pixel(2, y).0[1];
    let rim = (70..90).max_by_key(|&y| level(y - 2).saturating_sub(level(y + 2)));
    let rim = rim.unwrap();
    let row = |x: u32| scene.truth.get_pixel(x, rim).0[0] > 0;
    let left = (0..SMALL.0).find(|&x| row(x)).unwrap();
    let found = shape_with(&scene, |x, y| {
        (rim..rim + 2).contains(&y) && (left - 20..left).contains(&x)
    });
    assert_eq!(found.whiskers.len(), 1, "{found:?}");
    assert!(!found.faults().is_empty());
    assert!(found.quick_faults().is_empty());
}

#[test]
fn a_true_mask_is_not_blamed_whatever_the_object() {
    let faults = |trouble: Difficulty| {
        let scene = scene(trouble, SMALL, 24, SEED + 1);
        let turn = scene.statistics();
        let check = MaskCheck::new(&scene.truth, &turn).unwrap();
        let shape = check
            .shape(&scene.frames[0], Effort::Fine)
            .unwrap()
            .unwrap();
        (trouble, shape.faults())
    };
    let found = [
        Difficulty::LowHandle,
        Difficulty::TwoHoles,
        Difficulty::OpenShade,
    ]
    .map(faults);
    assert!(
        found.iter().all(|(_, faults)| faults.is_empty()),
        "{found:?}"
    );
}

#[test]
fn a_stroke_over_the_opening_of_a_handle_is_told() {
    let scene = scene(Difficulty::Handle, SMALL, 24, SEED);
    let turn = scene.statistics();
    let marks = GrayImage::from_fn(SMALL.0, SMALL.1, |x, y| {
        let critical = scene.critical.get_pixel(x, y).0[0] > 0;
        image::Luma([if critical { 255 } else { 128 }])
    });
    let seeds = by_seeds(marks);
    let told = segment_turn(&scene.frames[0], &turn, &seeds)
        .unwrap()
        .warnings;
    assert!(told.iter().any(|text| text.contains("hole")), "{told:?}");
    let plain = segment_turn(&scene.frames[0], &turn, &Hints::default()).unwrap();
    assert!(plain.warnings.is_empty(), "{:?}", plain.warnings);
}

#[test]
fn background_in_a_mask_and_object_outside_are_found() {
    let scene = scene(Difficulty::DarkPart, SMALL, 24, SEED);
    let turn = scene.statistics();
    let is_object = |x: u32, y: u32| scene.truth.get_pixel(x, y).0[0] > 0;
    let shape = |inside: &dyn Fn(u32, u32) -> bool| {
        let mask = GrayImage::from_fn(SMALL.0, SMALL.1, |x, y| {
            image::Luma([if inside(x, y) { 255 } else { 0 }])
        });
        let check = MaskCheck::new(&mask, &turn).unwrap();
        let shape = check.shape(&scene.frames[0], Effort::Fine).unwrap();
        shape.unwrap()
    };
    let right = shape(&is_object);
    assert!(right.faults().is_empty(), "{right:?}");
    let beside = |x, y| (10..30).contains(&x) && (20..40).contains(&y);
    let leaking = shape(&|x, y| is_object(x, y) || beside(x, y));
    assert!(
        leaking.leaks.iter().any(|part| part.px > 300),
        "{leaking:?}"
    );
    let half = shape(&|x, y| is_object(x, y) && x < 88);
    assert!(half.missing.iter().any(|part| part.px > 300), "{half:?}");
    for wrong in [leaking, half] {
        assert!(!wrong.faults().is_empty(), "{wrong:?}");
    }
}
