//! What files say about their colours, and what becomes of them in sRGB.

use image::{DynamicImage, ImageFormat, RgbImage};
use moxcms::{ColorProfile, DataColorSpace, ToneReprCurve, curve_from_gamma};
use relit_data::still::{Colour, decode};

use crate::files::{
    AREAS, areas, encoded, exif, exif_segment, hundred_thousandths, jpeg_with, middles, png_with,
    png_with_icc, png_with_profile, profile_segments,
};

/// The areas of a file in sRGB.
fn shown(bytes: &[u8]) -> [[u8; 3]; 4] {
    let mut image = decode(bytes).unwrap().into_rgb8();
    Colour::from_file(bytes).unwrap().to_srgb8(&mut image);
    middles(&image)
}

fn is_near(found: [[u8; 3]; 4], expected: [[u8; 3]; 4], by: u8) -> bool {
    let pairs = found.iter().flatten().zip(expected.iter().flatten());
    pairs.into_iter().all(|(a, b)| a.abs_diff(*b) <= by)
}

/// What littleCMS makes of the areas in Display P3.
const OF_P3: [[u8; 3]; 4] = [[217, 42, 39], [0, 183, 49], [44, 71, 197], [128, 128, 128]];
/// What the areas in Adobe RGB are in sRGB.
const OF_ADOBE: [[u8; 3]; 4] = [[231, 57, 46], [0, 181, 57], [34, 68, 195], [129, 129, 129]];

fn p3() -> Vec<u8> {
    ColorProfile::new_display_p3().encode().unwrap()
}

#[test]
fn display_p3_is_converted_in_every_format_that_has_profiles() {
    let image = areas(AREAS);
    let jpeg = encoded(image.clone(), ImageFormat::Jpeg);
    let webp = {
        let mut bytes = Vec::new();
        let mut encoder = image::codecs::webp::WebPEncoder::new_lossless(&mut bytes);
        image::ImageEncoder::set_icc_profile(&mut encoder, p3()).unwrap();
        encoder
            .encode(image.as_raw(), 40, 24, image::ExtendedColorType::Rgb8)
            .unwrap();
        bytes
    };
    for (name, bytes) in [
        ("PNG", png_with_icc(&image, p3())),
        ("JPEG", jpeg_with(&jpeg, &profile_segments(&p3(), 60_000))),
        (
            "JPEG in parts",
            jpeg_with(&jpeg, &profile_segments(&p3(), 100)),
        ),
        ("WebP", webp),
    ] {
        // JPEG loses a little by itself.
        let by = if name.starts_with("JPEG") { 6 } else { 1 };
        assert!(
            is_near(shown(&bytes), OF_P3, by),
            "{name}: {:?}",
            shown(&bytes)
        );
    }
}

#[test]
fn adobe_rgb_is_known_by_profile_and_by_exif() {
    let image = areas(AREAS);
    let jpeg = encoded(image.clone(), ImageFormat::Jpeg);
    let profile = png_with_profile(&image, &ColorProfile::new_adobe_rgb());
    assert!(
        is_near(shown(&profile), OF_ADOBE, 3),
        "{:?}",
        shown(&profile)
    );
    for (space, index) in [(0xffff, b"R03\0"), (2, b"R98\0")] {
        let bytes = jpeg_with(&jpeg, &[exif_segment(exif(1, space, index))]);
        assert!(is_near(shown(&bytes), OF_ADOBE, 6), "{:?}", shown(&bytes));
    }
    let png = png_with(&image, &[(b"eXIf", exif(1, 0xffff, b"R03\0"))]);
    assert!(is_near(shown(&png), OF_ADOBE, 3));
    // sRGB, and a colour space of which nothing is known.
    for (space, index) in [(1, b"R98\0"), (0xffff, b"R98\0")] {
        let bytes = jpeg_with(&jpeg, &[exif_segment(exif(1, space, index))]);
        assert!(Colour::from_file(&bytes).unwrap().is_srgb());
    }
}

#[test]
fn a_profile_counts_more_than_exif() {
    let jpeg = encoded(areas(AREAS), ImageFormat::Jpeg);
    let mut segments = vec![exif_segment(exif(1, 0xffff, b"R03\0"))];
    segments.extend(profile_segments(&p3(), 60_000));
    assert!(is_near(shown(&jpeg_with(&jpeg, &segments)), OF_P3, 6));
}

#[test]
fn srgb_is_left_as_it_is_stored() {
    let image = areas(AREAS);
    let mut tables = ColorProfile::new_srgb();
    let level = |entry: u16| {
        let value = f32::from(entry) / 1023.0;
        let light = if value <= 0.04045 {
            value / 12.92
        } else {
            ((value + 0.055) / 1.055).powf(2.4)
        };
        (light * 65535.0).round() as u16
    };
    let table: Vec<u16> = (0..1024).map(level).collect();
    for curve in [
        &mut tables.red_trc,
        &mut tables.green_trc,
        &mut tables.blue_trc,
    ] {
        *curve = Some(ToneReprCurve::Lut(table.clone()));
    }
    tables.cicp = None;
    let rec709 = [0.3127, 0.3290, 0.64, 0.33, 0.30, 0.60, 0.15, 0.06];
    for bytes in [
        encoded(image.clone(), ImageFormat::Png),
        png_with_profile(&image, &ColorProfile::new_srgb()),
        png_with_profile(&image, &tables),
        png_with(&image, &[(b"sRGB", vec![0])]),
        png_with(&image, &[(b"gAMA", hundred_thousandths(&[0.45455]))]),
        png_with(&image, &[(b"cHRM", hundred_thousandths(&rec709))]),
        png_with(&image, &[(b"cICP", vec![1, 13, 0, 1])]),
        encoded(image.clone(), ImageFormat::Tiff),
        encoded(image.clone(), ImageFormat::Bmp),
    ] {
        assert!(Colour::from_file(&bytes).unwrap().is_srgb());
        assert_eq!(shown(&bytes), AREAS);
    }
}

#[test]
fn linear_gamma_and_wide_profiles_are_converted() {
    let image = areas([[255; 3], [188; 3], [55; 3], [0; 3]]);
    let curve = |gamma: f32| {
        let mut profile = ColorProfile::new_srgb();
        profile.cicp = None;
        for curve in [
            &mut profile.red_trc,
            &mut profile.green_trc,
            &mut profile.blue_trc,
        ] {
            *curve = Some(curve_from_gamma(gamma));
        }
        png_with_profile(&image, &profile)
    };
    // 55 of 255 light is grey 128, 188 is 222.
    assert!(is_near(
        shown(&curve(1.0)),
        [[255; 3], [222; 3], [128; 3], [0; 3]],
        1
    ));
    let linear = png_with(&image, &[(b"gAMA", hundred_thousandths(&[1.0]))]);
    assert_eq!(shown(&linear), shown(&curve(1.0)));
    let old_mac = png_with(&image, &[(b"gAMA", hundred_thousandths(&[1.0 / 1.8]))]);
    assert!(is_near(shown(&old_mac), shown(&curve(1.8)), 1));
    assert!(shown(&old_mac)[2][0] > 60);
    let wide = png_with_profile(&areas(AREAS), &ColorProfile::new_pro_photo_rgb());
    // Its gamma is 1.8, so that 128 is lighter in sRGB.
    let of_pro_photo = [[255, 0, 60], [0, 209, 49], [0, 92, 213], [146; 3]];
    assert!(is_near(shown(&wide), of_pro_photo, 1), "{:?}", shown(&wide));
}

#[test]
fn of_several_statements_in_a_png_the_first_in_rank_counts() {
    let image = areas(AREAS);
    let linear = (b"gAMA", hundred_thousandths(&[1.0]));
    let wide = (
        b"cHRM",
        hundred_thousandths(&[0.3127, 0.329, 0.68, 0.32, 0.265, 0.69, 0.15, 0.06]),
    );
    let srgb = (b"sRGB", vec![0]);
    let p3 = (b"cICP", vec![12, 13, 0, 1]);
    let with = |chunks: &[(&[u8; 4], Vec<u8>)]| shown(&png_with(&image, chunks));
    assert_eq!(with(&[srgb.clone(), linear.clone(), wide.clone()]), AREAS);
    assert!(is_near(with(&[p3, srgb, linear.clone()]), OF_P3, 1));
    assert!(is_near(with(std::slice::from_ref(&wide)), OF_P3, 1));
    let both = with(&[linear, wide]);
    assert_eq!(both[3], [188; 3]);
}

#[test]
fn a_grey_profile_is_for_pictures_without_colours() {
    let icc = ColorProfile::new_gray_with_gamma(1.0).encode().unwrap();
    let grey = image::GrayImage::from_pixel(40, 24, image::Luma([55]));
    let jpeg = encoded(grey, ImageFormat::Jpeg);
    let bytes = jpeg_with(&jpeg, &profile_segments(&icc, 60_000));
    assert!(
        is_near(shown(&bytes), [[128; 3]; 4], 2),
        "{:?}",
        shown(&bytes)
    );
    let fault = Colour::from_file(&png_with_icc(&areas(AREAS), icc)).unwrap_err();
    assert!(fault.to_string().contains("colour profile"), "{fault}");
}

#[test]
fn what_is_not_converted_is_refused_by_its_name() {
    let image = areas(AREAS);
    let mut inks = ColorProfile::new_srgb();
    inks.color_space = DataColorSpace::Cmyk;
    let fault = |bytes: &[u8]| Colour::from_file(bytes).unwrap_err();
    let cmyk = fault(&png_with_profile(&image, &inks));
    assert!(cmyk.to_string().contains("CMYK"), "{cmyk}");
    let pq = fault(&png_with_profile(&image, &ColorProfile::new_bt2020_pq()));
    assert!(pq.to_string().contains("PQ"), "{pq}");
    for (function, name) in [(16, "PQ"), (18, "HLG"), (9, "logarithm")] {
        let fault = fault(&png_with(&image, &[(b"cICP", vec![9, function, 0, 1])]));
        let text = fault.to_string();
        assert!(text.contains(name), "{text}");
    }
    let narrow = fault(&png_with(&image, &[(b"cICP", vec![1, 13, 0, 0])]));
    assert!(narrow.to_string().contains("narrow range"), "{narrow}");
    let other = fault(&png_with(&image, &[(b"cICP", vec![99, 13, 0, 1])]));
    assert!(other.to_string().contains("99"), "{other}");
    let broken = fault(&png_with_icc(&image, b"no profile at all".to_vec()));
    assert!(broken.to_string().contains("colour profile"), "{broken}");
    let flat = [0.3127, 0.3290, 0.64, 0.33, 0.64, 0.33, 0.15, 0.06];
    let flat = fault(&png_with(&image, &[(b"cHRM", hundred_thousandths(&flat))]));
    assert!(flat.to_string().contains("primaries"), "{flat}");
    // The second of two parts of a profile is missing.
    let jpeg = encoded(image, ImageFormat::Jpeg);
    let parts = profile_segments(&p3(), p3().len() / 2 + 1);
    assert_eq!(fault(&jpeg_with(&jpeg, &parts[..1])), broken);
}

#[test]
fn a_jpeg_of_inks_is_refused() {
    // The header of a frame of four components.
    let sof = [
        8, 0, 8, 0, 8, 4, 1, 0x11, 0, 2, 0x11, 0, 3, 0x11, 0, 4, 0x11, 0,
    ];
    let bytes = jpeg_with(&[0xff, 0xd8, 0xff, 0xda, 0, 2], &[(0xc0, sof.to_vec())]);
    let fault = Colour::from_file(&bytes).unwrap_err();
    assert!(fault.to_string().contains("CMYK"), "{fault}");
}

#[test]
fn a_tiff_of_floating_point_is_light() {
    let image = image::Rgb32FImage::from_pixel(4, 4, image::Rgb([2.0, 0.5, 0.25]));
    let bytes = encoded(DynamicImage::from(image), ImageFormat::Tiff);
    assert!(Colour::from_file(&bytes).unwrap().is_linear());
    assert_eq!(
        decode(&bytes).unwrap().into_rgb32f().get_pixel(1, 1).0,
        [2.0, 0.5, 0.25]
    );
}

#[test]
fn a_table_of_16_bits_keeps_the_dark() {
    let image = RgbImage::from_pixel(40, 24, image::Rgb([1; 3]));
    let bytes = png_with(&image, &[(b"gAMA", hundred_thousandths(&[0.5]))]);
    let mut planes = [[1.0_f32 / 255.0]; 3];
    let [red, green, blue] = &mut planes;
    Colour::from_file(&bytes)
        .unwrap()
        .to_light([red, green, blue]);
    assert!((planes[0][0] * 65025.0 - 1.0).abs() < 1e-3);
}
