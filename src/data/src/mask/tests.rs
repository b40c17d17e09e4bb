//! Masks as programs write them, each a disc or a part of one.

use std::io::Cursor;

use image::codecs::jpeg::JpegEncoder;
use image::imageops::blur;
use image::{DynamicImage, GrayImage, ImageBuffer, Luma, LumaA, Rgb, RgbImage, Rgba, RgbaImage};

use super::*;

const WIDE: u32 = 80;
const HIGH: u32 = 60;

/// Distance from the middle of the disc, whose radius is 20.
fn distance(x: u32, y: u32) -> f64 {
    (f64::from(x) - 38.0).hypot(f64::from(y) - 29.0)
}

fn is_inside(x: u32, y: u32) -> bool {
    distance(x, y) <= 20.0
}

fn disc() -> Vec<bool> {
    let pixels = (0..HIGH).flat_map(|y| (0..WIDE).map(move |x| (x, y)));
    pixels.map(|(x, y)| is_inside(x, y)).collect()
}

fn grey(level: impl Fn(u32, u32) -> u8) -> GrayImage {
    GrayImage::from_fn(WIDE, HIGH, |x, y| Luma([level(x, y)]))
}

/// A disc of one level on another.
fn two(inside: u8, outside: u8) -> GrayImage {
    grey(|x, y| if is_inside(x, y) { inside } else { outside })
}

/// A picture of a shaded ball before a backdrop, with colours.
fn photograph(x: u32, y: u32) -> [u8; 3] {
    let shade = (1.0 - distance(x, y) / 40.0).clamp(0.0, 1.0);
    if is_inside(x, y) {
        [230.0, 150.0, 90.0].map(|c: f64| (c * shade) as u8)
    } else {
        [120 + (x / 2) as u8, 130, 140 - (y / 2) as u8]
    }
}

fn read(image: impl Into<DynamicImage>) -> Result<ObjectPixels, MaskFault> {
    MaskPicture::from_image(&image.into()).object()
}

#[track_caller]
fn assert_disc(image: impl Into<DynamicImage>, wanted: &MaskBasis) {
    let found = read(image).unwrap();
    assert_eq!(&found.basis, wanted);
    assert!(found.inside == disc());
}

/// All but so many pixels are those of the disc.
#[track_caller]
fn assert_nearly_disc(image: impl Into<DynamicImage>, off: usize) {
    let found = read(image).unwrap();
    assert_eq!(found.basis, MaskBasis::Brightness);
    let differ = found
        .inside
        .iter()
        .zip(disc())
        .filter(|(a, b)| **a != *b)
        .count();
    assert!(differ <= off, "{differ}");
}

#[track_caller]
fn assert_labels(image: impl Into<DynamicImage>, wanted: &[&str]) {
    match read(image) {
        Err(MaskFault::Labels(named)) => {
            let (listed, left) = wanted.split_at(wanted.len().min(6));
            let more = if left.is_empty() { "" } else { " and 4 more" };
            let wanted = format!("{}{more}", listed.join(", "));
            assert_eq!(named.split_once(['s']).unwrap().1.trim_start(), wanted);
        }
        other => panic!("{:?}", other.map(|object| object.basis)),
    }
}

#[track_caller]
fn assert_photograph(image: impl Into<DynamicImage>) {
    let found = read(image).map(|object| object.basis);
    assert_eq!(found, Err(MaskFault::Photograph));
}

fn label(text: &str) -> MaskBasis {
    MaskBasis::Label(text.to_owned())
}

#[test]
fn black_and_white_is_read_by_its_brightness() {
    for (inside, outside) in [
        (255, 0),
        (254, 1),
        (128, 0),
        (180, 0),
        (200, 127),
        (255, 100),
    ] {
        assert_disc(two(inside, outside), &MaskBasis::Brightness);
    }
    // In three channels, and in 16 bits.
    assert_disc(
        DynamicImage::from(two(255, 0)).into_rgb8(),
        &MaskBasis::Brightness,
    );
    assert_disc(
        DynamicImage::from(two(255, 0)).into_luma16(),
        &MaskBasis::Brightness,
    );
    assert_disc(
        DynamicImage::from(two(255, 0)).into_rgb32f(),
        &MaskBasis::Brightness,
    );
}

#[test]
fn soft_edges_count_from_one_half_on() {
    let soft = grey(|x, y| (255.0 * (20.5 - distance(x, y)).clamp(0.0, 1.0)).round() as u8);
    assert_nearly_disc(soft, 0);
    for sigma in [1.0, 3.0, 5.0] {
        assert_nearly_disc(blur(&two(255, 0), sigma), 90);
    }
    // Enlarged from a small one without smoothing: levels of edges have areas of their own.
    let small = image::imageops::thumbnail(&two(255, 0), 20, 15);
    let large = image::imageops::resize(&small, WIDE, HIGH, image::imageops::FilterType::Nearest);
    let found = read(large.clone()).unwrap();
    assert_eq!(found.basis, MaskBasis::Brightness);
    assert!(
        found
            .inside
            .into_iter()
            .eq(large.iter().map(|&level| level >= 128))
    );
}

#[test]
fn jpeg_rings_and_its_mask_stays_a_mask() {
    for quality in [30, 60, 75, 90] {
        for picture in [
            DynamicImage::from(two(255, 0)),
            DynamicImage::from(two(255, 0)).into_rgb8().into(),
            grey(|x, y| {
                if (16..56).contains(&x) && (8..48).contains(&y) {
                    255
                } else {
                    0
                }
            })
            .into(),
        ] {
            let mut bytes = Vec::new();
            let encoder = JpegEncoder::new_with_quality(&mut bytes, quality);
            picture.write_with_encoder(encoder).unwrap();
            let image = image::load(Cursor::new(bytes), image::ImageFormat::Jpeg).unwrap();
            let found = read(image).unwrap();
            let sharp = read(picture).unwrap();
            let differ = found
                .inside
                .iter()
                .zip(sharp.inside)
                .filter(|(a, b)| **a != *b)
                .count();
            assert!(differ < 60, "{quality}: {differ}");
        }
    }
}

#[test]
fn a_cut_out_is_read_by_its_alpha() {
    let alpha = |x, y| if is_inside(x, y) { 255 } else { 0 };
    let cut_out = |hidden: bool| {
        RgbaImage::from_fn(WIDE, HIGH, |x, y| {
            let [r, g, b] = if hidden || is_inside(x, y) {
                photograph(x, y)
            } else {
                [0; 3]
            };
            Rgba([r, g, b, alpha(x, y)])
        })
    };
    assert_disc(cut_out(true), &MaskBasis::Alpha);
    assert_disc(cut_out(false), &MaskBasis::Alpha);
    let in_grey = ImageBuffer::from_fn(WIDE, HIGH, |x, y| {
        LumaA([(distance(x, y) * 6.0) as u8, alpha(x, y)])
    });
    assert_disc(in_grey, &MaskBasis::Alpha);
    let wide = DynamicImage::from(cut_out(true)).into_rgba16();
    assert_disc(wide, &MaskBasis::Alpha);
    // Black all over, as a silhouette; and an object that is as bright as a mask.
    let of = |level| ImageBuffer::from_fn(WIDE, HIGH, |x, y| LumaA([level, alpha(x, y)]));
    assert_disc(of(0), &MaskBasis::Alpha);
    assert_disc(of(255), &MaskBasis::Brightness);
}

#[test]
fn a_mask_that_was_painted_on_a_layer_counts_where_it_is_opaque() {
    let layer = ImageBuffer::from_fn(WIDE, HIGH, |x, y| {
        let level = if is_inside(x, y) { 255u8 } else { 0 };
        LumaA([level, if x < 70 { 255 } else { 0 }])
    });
    assert_disc(layer, &MaskBasis::Brightness);
}

#[test]
fn alpha_that_is_the_same_everywhere_says_nothing() {
    for alpha in [0, 1, 200, 255] {
        let image = ImageBuffer::from_fn(WIDE, HIGH, |x, y| {
            LumaA([if is_inside(x, y) { 255u8 } else { 0 }, alpha])
        });
        assert_disc(image, &MaskBasis::Brightness);
    }
    let nearly = ImageBuffer::from_fn(WIDE, HIGH, |x, y| {
        LumaA([if is_inside(x, y) { 255 } else { 0 }, 250 + (x % 5) as u8])
    });
    assert_disc(nearly, &MaskBasis::Brightness);
}

#[test]
fn an_alpha_of_0_and_1_is_a_label() {
    let image = RgbaImage::from_fn(WIDE, HIGH, |x, y| {
        let [r, g, b] = photograph(x, y);
        Rgba([r, g, b, u8::from(is_inside(x, y))])
    });
    assert_disc(image, &label("an alpha of 1"));
    let faint = RgbaImage::from_fn(WIDE, HIGH, |x, y| Rgba([255, 255, 255, (x + y) as u8 / 2]));
    assert_eq!(read(faint).unwrap_err(), MaskFault::Transparent);
}

#[test]
fn one_label_on_0_is_the_object_whatever_its_value() {
    for value in [1, 2, 15, 38, 85, 127] {
        assert_disc(two(value, 0), &label(&format!("the value {value}")));
    }
    let wide = |value| {
        ImageBuffer::<Luma<u16>, _>::from_fn(WIDE, HIGH, |x, y| {
            Luma([if is_inside(x, y) { value } else { 0 }])
        })
    };
    for value in [1, 255, 1000, 32767] {
        assert_disc(
            DynamicImage::from(wide(value)),
            &label(&format!("the value {value}")),
        );
    }
    assert_disc(DynamicImage::from(wide(40000)), &MaskBasis::Brightness);
}

#[test]
fn one_colour_on_black_is_the_object() {
    let of = |colour| {
        RgbImage::from_fn(WIDE, HIGH, |x, y| {
            Rgb(if is_inside(x, y) { colour } else { [0; 3] })
        })
    };
    for bright in [[255, 0, 0], [0, 0, 255], [128, 0, 0], [250, 250, 20]] {
        assert_disc(of(bright), &MaskBasis::Brightness);
    }
    assert_disc(of([64, 0, 0]), &label("the colour #400000"));
    assert_disc(of([0, 100, 90]), &label("the colour #00645a"));
    // With soft edges.
    let soft = RgbImage::from_fn(WIDE, HIGH, |x, y| {
        let part = (20.5 - distance(x, y)).clamp(0.0, 1.0);
        Rgb([(255.0 * part).round() as u8, (40.0 * part) as u8, 0])
    });
    assert_nearly_disc(soft, 0);
}

#[test]
fn several_labels_are_listed() {
    let third = |a: u8, b: u8| {
        grey(move |x, y| {
            if !is_inside(x, y) {
                0
            } else if x < 38 {
                a
            } else {
                b
            }
        })
    };
    assert_labels(third(1, 2), &["0", "1", "2"]);
    assert_labels(third(38, 75), &["0", "38", "75"]);
    assert_labels(third(127, 254), &["0", "127", "254"]);
    assert_labels(third(128, 255), &["0", "128", "255"]);
    // 255 stands for "does not count".
    assert_labels(third(1, 255), &["0", "1", "255"]);
    assert_labels(two(1, 2), &["1", "2"]);
    let instances = grey(|x, y| if y < 50 { (x / 8) as u8 } else { 0 });
    assert_labels(
        instances,
        &["0", "1", "2", "3", "4", "5", "6", "7", "8", "9"],
    );
    let colours = RgbImage::from_fn(WIDE, HIGH, |x, _| {
        Rgb([[0, 0, 0], [128, 0, 0], [0, 128, 0]][(x / 27) as usize])
    });
    assert_labels(colours, &["#000000", "#008000", "#800000"]);
    let text = read(third(1, 2)).unwrap_err().to_string();
    assert!(text.contains("0, 1, 2"), "{text}");
}

#[test]
fn a_photograph_is_no_mask() {
    let colours = RgbImage::from_fn(WIDE, HIGH, |x, y| Rgb(photograph(x, y)));
    assert_photograph(colours.clone());
    let opaque = DynamicImage::from(colours.clone()).into_rgba8();
    assert_photograph(opaque);
    let in_grey = DynamicImage::from(colours).into_luma8();
    assert_photograph(in_grey);
    // A grey object before black, before white, and a map of depth.
    let shaded = |x: u32, y: u32| (250.0 - 8.0 * distance(x, y) + f64::from(x % 7)) as u8;
    let before = |back: u8| grey(move |x, y| if is_inside(x, y) { shaded(x, y) } else { back });
    assert_photograph(before(0));
    assert_photograph(before(255));
    let depth = grey(|x, y| (2 * x + y) as u8);
    assert_photograph(depth);
    let normals = RgbImage::from_fn(WIDE, HIGH, |x, y| {
        if is_inside(x, y) {
            Rgb([(x * 3) as u8, 255 - (y * 3) as u8, 220])
        } else {
            Rgb([0; 3])
        }
    });
    assert_photograph(normals);
}

#[test]
fn a_mask_may_be_all_object_and_not_without_one() {
    for level in [128, 255] {
        let full = read(two(level, level)).unwrap();
        assert!(full.inside.iter().all(|&inside| inside));
    }
    for level in [0, 1, 127] {
        let fault = read(two(level, level)).unwrap_err();
        let wanted = MaskFault::Empty {
            brightest: level.into(),
            white: 255,
        };
        assert_eq!(fault, wanted);
    }
    assert!(matches!(
        read(GrayImage::new(0, 0)),
        Err(MaskFault::Empty { .. })
    ));
    let dim = blur(&two(100, 0), 3.0);
    assert!(matches!(
        read(dim),
        Err(MaskFault::Empty { .. } | MaskFault::Labels(_))
    ));
}

#[test]
fn values_of_floating_point_are_those_of_the_integers_that_they_were() {
    let label = MaskPicture::from_planes((2, 1), [&[0.0, 1.0 / 255.0]; 3], None)
        .object()
        .unwrap();
    assert_eq!(label.basis, MaskBasis::Label("the value 1".to_owned()));
    assert_eq!(label.inside, [false, true]);
    let of = |value: f32| MaskPicture::from_planes((2, 1), [&[0.0, value]; 3], None).object();
    assert_eq!(of(1.0 / 65535.0).unwrap().inside, [false, true]);
    assert_eq!(of(7.5).unwrap().basis, MaskBasis::Brightness);
    for nothing in [0.0, -1.0, f32::NAN] {
        assert!(
            matches!(of(nothing), Err(MaskFault::Empty { .. })),
            "{nothing}"
        );
    }
    let alpha = MaskPicture::from_planes((2, 1), [&[0.2, 0.3]; 3], Some(&[0.4, 0.6])).object();
    assert_eq!(alpha.unwrap().basis, MaskBasis::Alpha);
}

#[test]
fn a_mask_of_another_size_is_recognised_where_it_is_turned_or_scaled() {
    let turned = size_hint((60, 80), (80, 60)).unwrap();
    let hint = size_hint((40, 30), (80, 60)).unwrap();
    assert_ne!(turned, hint);
    for scaled in [(160, 120), (27, 20)] {
        assert_eq!(size_hint(scaled, (80, 60)), Some(hint), "{scaled:?}");
    }
    for other in [(80, 61), (100, 60), (0, 0), (61, 80)] {
        assert_eq!(size_hint(other, (80, 60)), None, "{other:?}");
    }
}

#[test]
fn a_mask_that_marks_the_border_may_be_inverted() {
    let note = |image: GrayImage| read(image).unwrap().note(WIDE);
    let inverted = note(two(0, 255)).unwrap();
    assert_eq!(note(grey(|_, _| 255)), Some(inverted.clone()));
    // An object that the border cuts off, and one that the picture is full of but for a corner.
    assert_eq!(note(grey(|x, _| if x < 50 { 255 } else { 0 })), None);
    assert_eq!(note(grey(|x, y| if x + y > 0 { 255 } else { 0 })), None);
    assert_eq!(note(two(255, 0)), None);
    // What it was taken for goes before.
    assert_eq!(note(two(1, 0)), read(two(1, 0)).unwrap().basis.note());
    assert!(note(two(1, 0)).is_some_and(|label| label != inverted));
}

#[test]
fn one_mask_is_the_same_in_every_depth_and_with_an_alpha_that_says_nothing() {
    let at = |x, y| u16::from(is_inside(x, y));
    let deep = ImageBuffer::from_fn(WIDE, HIGH, |x, y| Luma([at(x, y) * u16::MAX]));
    assert_disc(deep, &MaskBasis::Brightness);
    for alpha in [0, 128, 255] {
        let with_alpha = |x, y| LumaA([at(x, y) as u8 * 255, alpha]);
        assert_disc(
            ImageBuffer::from_fn(WIDE, HIGH, with_alpha),
            &MaskBasis::Brightness,
        );
    }
    let deep_label = ImageBuffer::from_fn(WIDE, HIGH, |x, y| Luma([at(x, y)]));
    let found = read(deep_label).unwrap();
    assert!(found.inside == disc() && matches!(found.basis, MaskBasis::Label(_)));
}
