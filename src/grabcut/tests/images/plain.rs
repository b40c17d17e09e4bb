//! Objects before plain backgrounds, without a hint.

use image::{GrayImage, Luma, Rgb, RgbImage};
use proptest::prelude::*;
use relit_grabcut::{
    Brush, Effort, MaskError, PlainCut, SegmentSettings, Stroke, Strokes, segment, segment_on_plain,
};

const WIDTH: u32 = 240;
const HEIGHT: u32 = 180;

/// A colour between two others.
fn mixed(a: [f64; 3], b: [f64; 3], part: f64) -> [f64; 3] {
    [0, 1, 2].map(|c| a[c] + (b[c] - a[c]) * part)
}

/// The part of a pixel that a cup with a lid covers, 0 to 1.
fn covered(x: f64, y: f64) -> f64 {
    let cup = 40.0 - (x - 120.0).hypot(1.1 * (y - 90.0));
    let handle = 7.0 - ((x - 160.0).hypot(y - 90.0) - 20.0).abs();
    (cup.max(handle) + 0.5).clamp(0.0, 1.0)
}

fn truth() -> GrayImage {
    GrayImage::from_fn(WIDTH, HEIGHT, |x, y| {
        Luma([255 * u8::from(covered(x.into(), y.into()) >= 0.5)])
    })
}

/// A background's name, and its linear colour at a place.
type Background<'a> = (&'a str, &'a dyn Fn(f64, f64) -> [f64; 3]);

/// The cup, striped, before a background; in linear light, with noise.
fn photograph(background: impl Fn(f64, f64) -> [f64; 3]) -> RgbImage {
    RgbImage::from_fn(WIDTH, HEIGHT, |x, y| {
        let (x, y) = (f64::from(x), f64::from(y));
        let stripe = if ((y / 12.0) as u32).is_multiple_of(2) {
            [0.5, 0.1, 0.05]
        } else {
            [0.05, 0.12, 0.4]
        };
        let light = mixed(background(x, y), stripe, covered(x, y));
        let noise = super::grain(x as u32, y as u32) % 5;
        Rgb(light
            .map(|value| (255.0 * value.powf(1.0 / 2.2)) as u8)
            .map(|v| v.saturating_add(noise as u8)))
    })
}

/// A wall that is brighter at one side, with the cup's soft shadow.
fn graded(x: f64, y: f64) -> [f64; 3] {
    let wall = 0.35 + 0.0012 * x + 0.0004 * y;
    let distance = ((x - 100.0) / 70.0).hypot((y - 132.0) / 14.0);
    let shadow = 1.0 - 0.45 * (-distance * distance).exp();
    [wall, 0.98 * wall, 0.9 * wall].map(|value| value * shadow)
}

fn cut(photograph: &RgbImage) -> Result<PlainCut, MaskError> {
    let settings = SegmentSettings::default();
    segment_on_plain(photograph, &Strokes::default(), &settings, Effort::Fine)
}

/// Intersection over union.
fn overlap(a: &GrayImage, b: &GrayImage) -> f64 {
    let pairs = || {
        a.pixels()
            .zip(b.pixels())
            .map(|(a, b)| (a.0[0] >= 128, b.0[0] >= 128))
    };
    let both = pairs().filter(|&(a, b)| a && b).count();
    let either = pairs().filter(|&(a, b)| a || b).count();
    both as f64 / either as f64
}

#[test]
fn an_object_before_a_plain_or_graded_background_is_found_without_its_shadow() {
    let backgrounds: [Background<'_>; 4] = [
        ("white", &|_, _| [0.85; 3]),
        ("black", &|_, _| [0.01; 3]),
        ("green", &|_, _| [0.1, 0.5, 0.15]),
        ("graded with a shadow", &graded),
    ];
    for (name, background) in backgrounds {
        let found = cut(&photograph(background)).unwrap();
        let overlap = overlap(&found.mask.image, &truth());
        assert!(overlap >= 0.97, "{name}: {overlap}");
    }
}

#[test]
fn the_hints_that_were_found_make_the_same_mask_again() {
    let photograph = photograph(graded);
    let found = cut(&photograph).unwrap();
    let again = segment(&photograph, &found.hints, &SegmentSettings::default()).unwrap();
    assert_eq!(again.image, found.mask.image);
}

#[test]
fn strokes_overrule_what_the_background_shows() {
    let photograph = photograph(graded);
    let stroke = Stroke {
        brush: Brush::Background,
        radius: 9.0,
        points: vec![[160.0, 71.0], [160.0, 71.0]],
    };
    let strokes = Strokes::new(vec![stroke]).unwrap();
    let settings = SegmentSettings::default();
    let found = segment_on_plain(&photograph, &strokes, &settings, Effort::Fine).unwrap();
    assert_eq!(found.mask.image.get_pixel(160, 71).0, [0]);
    assert_eq!(found.mask.image.get_pixel(120, 90).0, [255]);
}

#[test]
fn a_background_that_is_not_plain_asks_for_a_rectangle() {
    let backgrounds: [Background<'_>; 4] = [
        ("squares", &|x, y| {
            if (x as u32 / 20 + y as u32 / 20).is_multiple_of(2) {
                [0.8; 3]
            } else {
                [0.2; 3]
            }
        }),
        ("table and wall", &|_, y| {
            if y > 110.0 {
                [0.3, 0.15, 0.05]
            } else {
                [0.7; 3]
            }
        }),
        ("stripes", &|x, _| [0.3 + 0.2 * (x / 3.0).sin(); 3]),
        ("grain", &|x, y| {
            [f64::from(super::grain(x as u32, y as u32) % 200) / 255.0; 3]
        }),
    ];
    for (name, background) in backgrounds {
        let refused = cut(&photograph(background));
        assert!(matches!(refused, Err(MaskError::NotPlain { .. })), "{name}");
    }
}

#[test]
fn nothing_or_several_things_before_a_plain_background_ask_for_a_rectangle() {
    let empty = RgbImage::from_pixel(WIDTH, HEIGHT, Rgb([180, 170, 160]));
    let mut pair = empty.clone();
    for (x, y, pixel) in pair.enumerate_pixels_mut() {
        let near = |centre: f64| (f64::from(x) - centre).hypot(f64::from(y) - 90.0) < 30.0;
        if near(70.0) || near(170.0) {
            *pixel = Rgb([30, 60, 160]);
        }
    }
    let mut at_the_edge = empty.clone();
    for (x, _, pixel) in at_the_edge.enumerate_pixels_mut() {
        if x < WIDTH / 3 {
            *pixel = Rgb([30, 60, 160]);
        }
    }
    for (name, photograph) in [("empty", empty), ("pair", pair), ("edge", at_the_edge)] {
        let refused = cut(&photograph);
        assert!(matches!(refused, Err(MaskError::NotPlain { .. })), "{name}");
    }
}

#[test]
fn a_picture_that_is_too_small_is_refused() {
    let refused = cut(&RgbImage::new(15, 40));
    assert!(matches!(refused, Err(MaskError::FrameSize { .. })));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn no_picture_panics(width in 16u32..70, height in 16u32..70, levels in prop::collection::vec(any::<u8>(), 1..60)) {
        let picture = RgbImage::from_fn(width, height, |x, y| {
            Rgb([0, 1, 2].map(|c| levels[(x / 5 + 7 * (y / 5) + c) as usize % levels.len()]))
        });
        let _ = cut(&picture);
    }
}
