//! Shifts of synthetic objects whose place is known.

use image::{GrayImage, Luma, Rgba, RgbaImage};

use super::{AlignBuffers, AlignSample, Aligner, Alignment, Motion};
use crate::CropView;

const SIDE: u32 = 150;

fn grey(level: u8) -> Rgba<u8> {
    Rgba([level, level, level, 255])
}

/// A disc in the middle.
fn mask() -> GrayImage {
    GrayImage::from_fn(SIDE, SIDE, |x, y| {
        let far = (f64::from(x) - 74.5).hypot(f64::from(y) - 74.5);
        Luma([if far < 55.0 { 255 } else { 0 }])
    })
}

/// A painted object at a shift, under a light from `angle` with a highlight that travels with it, in front of
/// a background that travels too.
fn frame(shift: [f64; 2], angle: f64) -> AlignSample {
    let image = RgbaImage::from_fn(SIDE, SIDE, |x, y| {
        let (x, y) = (f64::from(x) - 74.5, f64::from(y) - 74.5);
        let (u, v) = (x - shift[0], y - shift[1]);
        if u.hypot(v) >= 58.0 {
            let stripes = 120.0 + 100.0 * (0.3 * x + 20.0 * angle).sin();
            return grey(stripes as u8);
        }
        let paint = 90.0
            + 25.0 * ((0.55 * u + 0.2 * v).sin() + (0.5 * v - 0.31 * u).cos())
            + 20.0 * (0.9 * u + 1.7).sin() * (0.8 * v).cos();
        let light = 1.0 + 0.012 * (u * angle.cos() + v * angle.sin());
        let (hx, hy) = (25.0 * angle.cos(), 25.0 * angle.sin());
        let highlight = 150.0 * (-((u - hx).powi(2) + (v - hy).powi(2)) / 60.0).exp();
        grey((paint * light + highlight).round().clamp(0.0, 255.0) as u8)
    });
    AlignSample::from_crop(CropView::whole(&image))
}

fn angle(at: usize, of: usize) -> f64 {
    std::f64::consts::TAU * at as f64 / of as f64
}

/// Learns from a turn whose frames have these shifts, counted from the first.
fn learnt(shift: impl Fn(usize) -> [f64; 2]) -> Aligner {
    let samples: Vec<AlignSample> = (0..24).map(|at| frame(shift(at), angle(at, 24))).collect();
    Aligner::learn(&samples, 0, &mask(), 8.0).unwrap()
}

fn measured(aligner: &Aligner, frame: &AlignSample) -> Alignment {
    let mut buffers = AlignBuffers::default();
    let regions = &aligner.required_regions;
    let lumas = regions.lumas_of_sample(&frame.0, &mut buffers.lumas);
    aligner.located(lumas, &mut buffers.gradients).0
}

fn error(aligner: &Aligner, shift: [f64; 2], angle: f64) -> f64 {
    let found = measured(aligner, &frame(shift, angle)).shift.unwrap();
    (found[0] - shift[0]).hypot(found[1] - shift[1])
}

#[test]
fn shifts_are_found_to_a_tenth_of_a_pixel_while_light_and_highlight_move() {
    let aligner = learnt(|at| [0.1 * at as f64, 0.3 * (at as f64).sin()]);
    for (shift, at) in [
        ([0.0, 0.0], 1),
        ([0.4, -0.7], 5),
        ([2.3, 1.1], 11),
        ([-6.2, 4.9], 17),
    ] {
        let error = error(&aligner, shift, angle(at, 20));
        assert!(error < 0.1, "{shift:?}: {error}");
    }
}

#[test]
fn patches_tell_the_shift_of_the_whole_object() {
    let shift = |at: usize| [0.1 * at as f64, 0.3 * (at as f64).sin()];
    let (by_patches, mut whole) = (learnt(shift), learnt(shift));
    assert!(whole.patches.take().is_some());
    for (shift, at) in [([0.4, -0.7], 5), ([2.3, 1.1], 11), ([-6.2, 4.9], 17)] {
        let frame = frame(shift, angle(at, 20));
        let [found, wanted] = [&by_patches, &whole].map(|by| measured(by, &frame).shift.unwrap());
        let apart = (found[0] - wanted[0]).hypot(found[1] - wanted[1]);
        assert!(apart > 0.0 && apart < 0.06, "{apart}");
    }
}

#[test]
fn patches_that_agree_less_than_usual_are_not_believed() {
    let [mut doubtful, mut whole] = [0, 1].map(|_| learnt(|_| [0.0; 2]));
    whole.patches = None;
    doubtful.patches.as_mut().unwrap().expect(&[2.0]);
    for (shift, at) in [([0.4, -0.7], 5), ([2.3, 1.1], 11)] {
        let frame = frame(shift, angle(at, 20));
        assert_eq!(measured(&doubtful, &frame), measured(&whole, &frame));
    }
}

#[test]
fn a_turn_that_stands_still_stays_where_it_is() {
    let aligner = learnt(|_| [0.0; 2]);
    for at in 0..15 {
        let error = error(&aligner, [0.0; 2], angle(at, 15));
        assert!(error < 0.05, "{at}: {error}");
    }
}

#[test]
fn shifts_count_from_the_frame_of_the_mask() {
    // All frames but the mask's lie 2 pixels further right.
    let aligner = learnt(|at| [if at == 0 { 0.0 } else { 2.0 }, 0.0]);
    let error = error(&aligner, [2.0, 0.0], angle(7, 24));
    assert!(error < 0.1, "{error}");
}

#[test]
fn a_frame_without_the_object_is_not_registered() {
    let aligner = learnt(|_| [0.0; 2]);
    let noise = RgbaImage::from_fn(SIDE, SIDE, |x, y| {
        grey((x.wrapping_mul(2_654_435_761) ^ y.wrapping_mul(40_503_001)).to_le_bytes()[2])
    });
    for image in [noise, RgbaImage::from_pixel(SIDE, SIDE, grey(9))] {
        let found = measured(&aligner, &AlignSample::from_crop(CropView::whole(&image)));
        assert_eq!(found.shift, None, "{found:?}");
    }
}

#[test]
fn an_object_without_structure_cannot_be_learnt() {
    let grey = AlignSample::from_crop(CropView::whole(&RgbaImage::from_pixel(
        SIDE,
        SIDE,
        grey(99),
    )));
    let samples = vec![grey; 8];
    assert!(Aligner::learn(&samples, 0, &mask(), 8.0).is_none());
}

/// A picture turned about its middle.
fn turned(still: &GrayImage, degrees: f64) -> GrayImage {
    let (sin, cos) = degrees.to_radians().sin_cos();
    GrayImage::from_fn(SIDE, SIDE, |x, y| {
        let (x, y) = (f64::from(x) - 74.5, f64::from(y) - 74.5);
        let (u, v) = (74.5 + cos * x + sin * y, 74.5 - sin * x + cos * y);
        let (left, top) = (u.floor().clamp(0.0, 148.0), v.floor().clamp(0.0, 148.0));
        let at =
            |dx: u32, dy: u32| f64::from(still.get_pixel(left as u32 + dx, top as u32 + dy).0[0]);
        let (across, down) = ((u - left).clamp(0.0, 1.0), (v - top).clamp(0.0, 1.0));
        let line = |dy| (1.0 - across) * at(0, dy) + across * at(1, dy);
        Luma([((1.0 - down) * line(0) + down * line(1)).round() as u8])
    })
}

#[test]
fn a_rotation_is_reported_where_it_is_significant_and_not_else() {
    let aligner = learnt(|_| [0.0; 2]);
    assert_eq!(measured(&aligner, &frame([1.3, 0.4], 0.7)).turned, None);
    let AlignSample(still) = frame([0.0; 2], 0.7);
    let degrees = 1.5;
    let turned = turned(&still, degrees);
    let found = measured(&aligner, &AlignSample(turned)).turned.unwrap();
    assert!((found.0 - degrees).abs() < 0.4, "{found:?}");
    assert!(found.1.abs() < 0.01, "{found:?}");
}

/// The same picture with noise, different for each `seed`.
fn noisy(AlignSample(image): AlignSample, seed: u32) -> AlignSample {
    let mut state = seed.wrapping_mul(2_654_435_761) | 1;
    let noise = |level: u8| {
        let sum: i32 = (0..4)
            .map(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                i32::from(state.to_be_bytes()[0]) - 128
            })
            .sum();
        (i32::from(level) + sum / 20).clamp(0, 255) as u8
    };
    let (width, height) = image.dimensions();
    let levels = image.into_raw().into_iter().map(noise).collect();
    AlignSample(GrayImage::from_raw(width, height, levels).unwrap())
}

#[test]
fn in_a_turn_that_stands_still_no_shift_is_found_in_noise_and_a_jolt_is() {
    let samples: Vec<AlignSample> = (0..24)
        .map(|at| noisy(frame([0.0; 2], angle(at, 24)), at as u32))
        .collect();
    let aligner = Aligner::learn(&samples, 0, &mask(), 8.0).unwrap();
    let (mut noise, mut found) = (0.0, 0.0);
    for at in 0..30 {
        let frame = noisy(frame([0.0; 2], angle(at, 30)), 100 + at as u32);
        let Alignment {
            shift, uncertainty, ..
        } = measured(&aligner, &frame);
        let [dx, dy] = shift.unwrap();
        noise += uncertainty * uncertainty / 30.0;
        found += (dx * dx + dy * dy) / 30.0;
    }
    assert!(found < noise / 9.0, "{} {}", found.sqrt(), noise.sqrt());
    let jolt = measured(&aligner, &noisy(frame([1.2, -0.8], angle(3, 24)), 77));
    let [dx, dy] = jolt.shift.unwrap();
    assert!((dx - 1.2).hypot(dy + 0.8) < 0.15, "{jolt:?}");
}

#[test]
fn what_is_measured_counts_as_far_as_the_turn_moves() {
    let shaken = Motion {
        variance: Some(4.0),
        ..Motion::default()
    };
    assert_eq!(shaken.most_likely([1.5, -0.5], 0.3), [1.5, -0.5]);
    // All frames but the mask's lie to the right.
    let beside = Motion {
        centre: [2.0, 0.0],
        variance: Some(0.0),
        ..Motion::default()
    };
    assert_eq!(beside.most_likely([2.1, 0.03], 0.08), [2.0, 0.0]);
    assert_eq!(beside.most_likely([0.0, 0.0], 0.08), [0.0, 0.0]);
    let trembling = Motion {
        variance: Some(0.01),
        ..Motion::default()
    };
    let [dx, _] = trembling.most_likely([0.2, 0.0], 0.2);
    assert!((dx - 0.05).abs() < 1e-9);
}

#[test]
fn the_masks_frame_is_no_other_place_than_the_rest_unless_it_surely_is() {
    let found = |shift: [f64; 2]| Alignment {
        shift: Some(shift),
        uncertainty: 0.08,
        confidence: 0.8,
        turned: None,
    };
    let still = [
        [0.0, 0.0],
        [0.15, 0.05],
        [0.16, 0.04],
        [0.14, 0.05],
        [0.15, 0.06],
    ]
    .map(found);
    let motion = Motion::from_alignments(&still, 0);
    assert_eq!(motion.against_mask([0.15, 0.05], 0.08), [0.0; 2]);
    let pushed = [
        [-2.0, 0.0],
        [0.15, 0.05],
        [0.15, 0.05],
        [0.15, 0.05],
        [0.15, 0.05],
    ]
    .map(found);
    let [dx, dy] = Motion::from_alignments(&pushed, 0).against_mask([0.15, 0.05], 0.08);
    assert!((dx - 2.15).hypot(dy - 0.05) < 0.01, "{dx} {dy}");
}

#[test]
fn a_turned_object_that_a_shift_does_not_bring_back_is_not_registered() {
    let aligner = learnt(|_| [0.0; 2]);
    let AlignSample(still) = frame([0.0; 2], 0.7);
    for degrees in [4.0, -4.0] {
        let found = measured(&aligner, &AlignSample(turned(&still, degrees)));
        assert_eq!(found.shift, None, "{found:?}");
    }
}

#[test]
fn a_large_picture_is_measured_in_its_own_pixels() {
    let large = |sample: &AlignSample| {
        let side = 5 * SIDE;
        RgbaImage::from_fn(side, side, |x, y| {
            grey(sample.0.get_pixel(x / 5, y / 5).0[0])
        })
    };
    let samples: Vec<AlignSample> = (0..24)
        .map(|at| AlignSample::from_crop(CropView::whole(&large(&frame([0.0; 2], angle(at, 24))))))
        .collect();
    assert!(samples[0].0.width() <= 640);
    let mask = image::imageops::resize(&mask(), 5 * SIDE, 5 * SIDE, image::imageops::Nearest);
    let aligner = Aligner::learn(&samples, 0, &mask, 16.0).unwrap();
    let moved = large(&frame([2.0, -1.0], angle(7, 24)));
    let found = measured(&aligner, &AlignSample::from_crop(CropView::whole(&moved)))
        .shift
        .unwrap();
    assert!((found[0] - 10.0).hypot(found[1] + 5.0) < 0.5, "{found:?}");
}
