//! Masks of images.
#![allow(
    clippy::unwrap_used,
    reason = "a test fails by a panic, in its helpers too"
)]

mod plain;
mod turn_scene;
mod turns;

use image::{DynamicImage, GrayImage, Luma, Rgb, RgbImage};
use proptest::prelude::*;
use relit_data::geometry::Rect;
use relit_grabcut::{
    Effort, Hints, Mask, MaskError, Seeds, SegmentSettings, TurnFrames, TurnStatistics, segment,
    segment_with,
};

use relit_test_support::disc::{AROUND, HEIGHT, WIDTH, disc_share, in_disc, seeds_image, strokes};
use relit_test_support::is_named;

/// A bright disc of radius 18 around (48, 32) on a dark ground, both with some texture.
fn disc() -> RgbImage {
    RgbImage::from_fn(WIDTH, HEIGHT, |x, y| {
        let noise = ((x * 7 + y * 13) % 11) as u8;
        if in_disc(x, y) {
            Rgb([200 + noise, 150 + noise, 60])
        } else {
            Rgb([20 + noise, 30, 40 + noise])
        }
    })
}

fn around() -> Hints {
    Hints::from(AROUND.parse::<Rect>().unwrap())
}

fn segment_turn(frame: &RgbImage, turn: &TurnStatistics, hints: &Hints) -> Result<Mask, MaskError> {
    let settings = SegmentSettings::default();
    segment_with(frame, Some(turn), hints, &settings, Effort::Fine)
}

fn seeds(marks: impl Fn(u32, u32) -> u8) -> Hints {
    by_seeds(seeds_image(marks))
}

fn by_seeds(marks: GrayImage) -> Hints {
    Hints {
        seeds: Some(Seeds::from_image(&DynamicImage::from(marks)).unwrap()),
        ..Hints::default()
    }
}

/// Whether one of a mask's warnings names this.
fn warns(mask: &Mask, named: &str) -> bool {
    mask.warnings.iter().any(|warning| warning.contains(named))
}

#[test]
fn a_rectangle_finds_the_object_in_it() {
    let mask = segment(&disc(), &around(), &SegmentSettings::default()).unwrap();
    assert!(disc_share(&mask.image) > 0.98);
    assert!(mask.image.pixels().all(|p| p.0[0] == 0 || p.0[0] == 255));
    assert_eq!(mask.warnings, [""; 0]);
    let figures = mask.statistics;
    let set = mask.image.pixels().filter(|p| p.0[0] == 255).count();
    assert_eq!(figures.area_px, set as u64);
    assert_eq!(figures.components_kept, 1);
}

/// A number that looks random, one for each pixel.
fn grain(x: u32, y: u32) -> u32 {
    let mixed = x.wrapping_mul(0x9E37_79B1) ^ y.wrapping_mul(0x85EB_CA77);
    let mixed = (mixed ^ mixed >> 15).wrapping_mul(0x2C1B_3C6D);
    mixed ^ mixed >> 12
}

#[test]
fn an_object_that_hardly_differs_from_what_is_around_it_is_found() {
    let inside = |x: u32, y: u32| (180..220).contains(&x) && (60..100).contains(&y);
    let frame = RgbImage::from_fn(320, 240, |x, y| {
        let grain = grain(x, y);
        let busy = if x < 140 {
            (grain >> 8 & 1) as u8 * 120
        } else {
            0
        };
        let level = 90 + (grain % 12) as u8 + busy;
        Rgb([level + if inside(x, y) { 3 } else { 0 }, level, level])
    });
    let hints = Hints::from(Rect::new(176, 56, 48, 48));
    let mask = segment(&frame, &hints, &SegmentSettings::default()).unwrap();
    let (mut both, mut either) = (0, 0);
    for (x, y, level) in mask.image.enumerate_pixels() {
        let found = level.0[0] >= 128;
        both += u32::from(found && inside(x, y));
        either += u32::from(found || inside(x, y));
    }
    assert!(
        f64::from(both) > 0.95 * f64::from(either),
        "{both} {either}"
    );
}

#[test]
fn strokes_alone_find_the_object() {
    let hints = seeds(strokes);
    let mask = segment(&disc(), &hints, &SegmentSettings::default()).unwrap();
    assert!(disc_share(&mask.image) > 0.98);
}

#[test]
fn a_stroke_on_the_object_alone_is_enough_on_a_plain_background() {
    let hints = seeds(|x, y| strokes(x, y).max(128));
    let mask = segment(&disc(), &hints, &SegmentSettings::default()).unwrap();
    assert!(disc_share(&mask.image) > 0.9);
}

#[test]
fn a_rectangle_that_cuts_the_object_off_gets_a_warning_and_one_around_it_does_not() {
    let mask = |hints: &Hints| segment(&disc(), hints, &SegmentSettings::default()).unwrap();
    let without_left = mask(&Hints::from(Rect::new(38, 8, 36, 48)));
    assert!(warns(&without_left, "left"), "{:?}", without_left.warnings);
    assert_eq!(
        without_left.statistics.bounding_box,
        Rect::new(38, 14, 29, 37)
    );
    let [large, at_border] = [4, 1].map(|by| {
        let frame = image::imageops::resize(
            &disc(),
            WIDTH * by,
            HEIGHT * by,
            image::imageops::FilterType::Nearest,
        );
        let left = if by == 1 { 0 } else { 38 * by as i32 };
        let hints = Hints::from(Rect::new(
            left,
            8 * by as i32,
            74 * by - left as u32,
            48 * by,
        ));
        segment(&frame, &hints, &SegmentSettings::default()).unwrap()
    });
    assert!(warns(&large, "left"), "{:?}", large.warnings);
    assert_eq!(at_border.warnings, [""; 0]);
    let without_top = mask(&Hints::from(Rect::new(24, 24, 50, 34)));
    assert!(warns(&without_top, "upper"), "{:?}", without_top.warnings);
    assert_eq!(mask(&around()).warnings, [""; 0]);
}

#[test]
fn seeds_overrule_the_rectangle() {
    let rect: Rect = AROUND.parse().unwrap();
    let marks = |x, y| {
        if (30..36).contains(&x) && (20..44).contains(&y) {
            0
        } else {
            strokes(x, y)
        }
    };
    let hints = Hints {
        rect: Some(rect),
        ..seeds(marks)
    };
    let mask = segment(&disc(), &hints, &SegmentSettings::default()).unwrap();
    assert!((20..44).all(|y| mask.image.get_pixel(33, y).0[0] == 0));
    assert_eq!(mask.image.get_pixel(48, 31).0[0], 255);
}

#[test]
fn the_same_input_gives_the_same_mask() {
    let make = || {
        let hints = [around(), seeds(strokes)];
        hints.map(|hints| {
            segment(&noisy(), &hints, &SegmentSettings::default())
                .unwrap()
                .image
                .clone()
        })
    };
    let first = make();
    for _ in 0..4 {
        assert_eq!(make(), first);
    }
}

/// The disc with noise that makes GrabCut's clusters a matter of chance.
fn noisy() -> RgbImage {
    let mut state = 1u32;
    let mut image = disc();
    for channel in image.iter_mut() {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        *channel = channel.saturating_add((state >> 26) as u8);
    }
    image
}

#[test]
fn hints_that_do_not_fit_the_frame_are_refused_with_a_sentence() {
    let refused = |hints: Hints, named: &[&str]| {
        let error = segment(&disc(), &hints, &SegmentSettings::default()).unwrap_err();
        assert!(matches!(error, MaskError::Hints(_)), "{error:?}");
        assert!(is_named(&error.to_string(), named), "{error}");
    };
    let rect = |x, y, w, h| Hints::from(Rect::new(x, y, w, h));
    for outside in [rect(96, 0, 5, 5), rect(-9, -9, 9, 9), rect(5, 5, 0, 9)] {
        refused(outside, &["rectangle", "96 x 64"]);
    }
    for whole in [
        rect(0, 0, 96, 64),
        rect(-1, -1, 999, 999),
        seeds(|_, _| 255),
    ] {
        refused(whole, &["background"]);
    }
    let other = GrayImage::from_pixel(9, 7, Luma([255]));
    refused(by_seeds(other), &["seeds", "9 x 7", "96 x 64"]);
}

#[test]
fn frames_that_cannot_be_segmented_are_refused() {
    let tiny = RgbImage::new(15, 400);
    let result = segment(&tiny, &around(), &SegmentSettings::default());
    assert!(matches!(
        result,
        Err(MaskError::FrameSize { width: 15, .. })
    ));
}

#[test]
fn a_frame_of_one_colour_yields_a_mask_with_a_warning_or_a_refusal() {
    for level in [0, 128, 255] {
        let plain = RgbImage::from_pixel(WIDTH, HEIGHT, Rgb([level; 3]));
        match segment(&plain, &around(), &SegmentSettings::default()) {
            Ok(mask) => assert!(!mask.warnings.is_empty()),
            Err(error) => assert!(matches!(error, MaskError::Empty), "{error}"),
        }
    }
}

/// Frame `at` of a turn: the disc on a dark table, before a striped room that passes from left to right,
/// in a light that changes. Two of the room's colours are the disc's.
fn turn_frame(at: u32) -> RgbImage {
    let light = 0.6 + 0.1 * f64::from(at % 5);
    RgbImage::from_fn(WIDTH, HEIGHT, |x, y| {
        let room = [[200, 150, 60], [90, 120, 160], [230, 180, 70], [40, 60, 50]];
        let noise = ((x * 7 + y * 13 + at * 5) % 4) as u8;
        let lit = |rgb: [u8; 3]| Rgb(rgb.map(|v| (f64::from(v) * light) as u8 + noise));
        if in_disc(x, y) {
            lit([210, 160, 60])
        } else if y >= 44 {
            lit([22, 22, 24])
        } else {
            lit(room[((x + 6 * at) / 12 % 4) as usize])
        }
    })
}

fn statistics(frames: u32) -> TurnStatistics {
    let mut turn = TurnFrames::new(WIDTH, HEIGHT);
    (0..frames).for_each(|at| turn.push(&turn_frame(at)));
    TurnStatistics::new(&turn)
}

#[test]
fn a_turn_alone_finds_the_object_before_a_room_of_its_colours() {
    let mask = segment_turn(&turn_frame(0), &statistics(16), &Hints::default()).unwrap();
    assert!(
        disc_share(&mask.image) > 0.95,
        "{}",
        disc_share(&mask.image)
    );
}

#[test]
fn a_turn_of_too_few_frames_leaves_the_decision_to_the_hints_and_says_so() {
    let alone = segment_turn(&turn_frame(0), &statistics(2), &Hints::default());
    assert!(matches!(alone, Err(MaskError::FewFrames { found: 2 })));
    let mask = segment_turn(&disc(), &statistics(2), &around()).unwrap();
    assert!(disc_share(&mask.image) > 0.98);
    assert!(warns(&mask, "turn"), "{:?}", mask.warnings);
}

#[test]
fn a_turn_without_any_frame_is_refused() {
    let alone = segment_turn(&turn_frame(0), &statistics(0), &Hints::default());
    assert!(matches!(alone, Err(MaskError::FewFrames { found: 0 })));
    let of_nothing = TurnStatistics::new(&TurnFrames::new(0, 0));
    let alone = segment_turn(&turn_frame(0), &of_nothing, &Hints::default());
    assert!(matches!(alone, Err(MaskError::FewFrames { found: 0 })));
}

#[test]
fn a_video_in_which_nothing_moves_gives_a_warning() {
    let mut still = TurnFrames::new(WIDTH, HEIGHT);
    (0..8).for_each(|_| still.push(&disc()));
    let mask = segment_turn(&disc(), &TurnStatistics::new(&still), &around()).unwrap();
    assert!(disc_share(&mask.image) > 0.95);
    assert!(warns(&mask, "video"), "{:?}", mask.warnings);
}

#[test]
fn a_large_frame_is_cut_along_the_same_edge_as_a_small_one() {
    let large = image::imageops::resize(
        &disc(),
        WIDTH * 8,
        HEIGHT * 8,
        image::imageops::FilterType::Nearest,
    );
    let hints = Hints::from(Rect::new(24 * 8, 8 * 8, 50 * 8, 48 * 8));
    let mask = segment(&large, &hints, &SegmentSettings::default()).unwrap();
    let small = GrayImage::from_fn(WIDTH, HEIGHT, |x, y| {
        *mask.image.get_pixel(8 * x + 4, 8 * y + 4)
    });
    assert!(disc_share(&small) > 0.97);
}

#[test]
fn an_object_at_the_border_gives_warnings() {
    let frame = RgbImage::from_fn(64, 64, |x, y| {
        let object = x < 30 && (20..40).contains(&y);
        Rgb(if object {
            [220, 180, 40]
        } else {
            [20, (x % 5) as u8, 60]
        })
    });
    let hints = Hints::from(Rect::new(-10, 15, 50, 30));
    let mask = segment(&frame, &hints, &SegmentSettings::default()).unwrap();
    assert!(warns(&mask, "left"), "{:?}", mask.warnings);
    assert!(warns(&mask, "-10,15,50,30"), "{:?}", mask.warnings);
}

prop_compose! {
    fn any_frame()(width in 1u32..40, height in 1u32..40)
        (pixels in any_pixels(width * height), width in Just(width), height in Just(height))
        -> RgbImage {
        RgbImage::from_raw(width, height, pixels).unwrap()
    }
}

/// Noise, or few colours, which make models without spread.
fn any_pixels(count: u32) -> impl Strategy<Value = Vec<u8>> {
    let bytes = count as usize * 3;
    prop_oneof![
        prop::collection::vec(any::<u8>(), bytes),
        prop::collection::vec(prop_oneof![Just(0u8), Just(255u8)], bytes),
        any::<u8>().prop_map(move |level| vec![level; bytes]),
    ]
}

fn any_hints(width: u32, height: u32) -> impl Strategy<Value = Option<Hints>> {
    let rect = (-10i32..50, -10i32..50, 0u32..60, 0u32..60);
    let rect = prop::option::of(rect.prop_map(Rect::from));
    let mark = prop_oneof![8 => Just(128u8), 1 => Just(0u8), 1 => Just(255u8)];
    let marks = prop::collection::vec(mark, (width * height) as usize);
    (rect, prop::option::of(marks)).prop_map(move |(rect, marks)| {
        let image = marks.and_then(|marks| GrayImage::from_raw(width, height, marks));
        let seeds = image.and_then(|image| Seeds::from_image(&image.into()).ok());
        let hints = Hints {
            rect,
            seeds,
            ..Hints::default()
        };
        (!hints.is_empty()).then_some(hints)
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn no_frame_and_no_hint_make_it_panic(
        (frame, hints) in any_frame().prop_flat_map(|frame| {
            let hints = any_hints(frame.width(), frame.height());
            (Just(frame), hints)
        }),
        keep_all in any::<bool>(),
    ) {
        let settings = SegmentSettings { keep_all };
        if let Some(hints) = hints
            && let Ok(mask) = segment(&frame, &hints, &settings)
        {
            prop_assert!(mask.statistics.area_px > 0);
        }
    }
}
