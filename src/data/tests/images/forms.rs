//! Formats, orientations and the layers of EXR.

use std::io::Cursor;

use exr::meta::attribute::Chromaticities;
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, ImageAttributes, Layer, LayerAttributes,
    Vec2, WritableImage, f16,
};
use image::{ImageFormat, RgbImage};
use relit_data::still::{Colour, Format, StillError, decode, orientation, stored_size};

use crate::files::{AREAS, areas, encoded, exif, exif_segment, jpeg_with, png_with};

const SIDES: (usize, usize) = (6, 4);

/// An EXR whose channels have these values everywhere.
fn exr(channels: &[(&str, FlatSamples)], chromaticities: Option<Chromaticities>) -> Vec<u8> {
    let channels = channels
        .iter()
        .map(|(name, samples)| AnyChannel::new(*name, samples.clone()));
    let layer = Layer::new(
        SIDES,
        LayerAttributes::named("layer"),
        Encoding::SMALL_LOSSLESS,
        AnyChannels::sort(channels.collect()),
    );
    let mut attributes = ImageAttributes::with_size(SIDES);
    attributes.chromaticities = chromaticities;
    let mut bytes = Cursor::new(Vec::new());
    Image::empty(attributes)
        .with_layer(layer)
        .write()
        .to_buffered(&mut bytes)
        .unwrap();
    bytes.into_inner()
}

fn full(value: f32) -> FlatSamples {
    FlatSamples::F32(vec![value; SIDES.0 * SIDES.1])
}

fn pixel(bytes: &[u8]) -> [f32; 4] {
    decode(bytes).unwrap().into_rgba32f().get_pixel(2, 1).0
}

#[test]
fn a_single_channel_is_a_grey_picture() {
    let half = FlatSamples::F16(vec![f16::from_f32(0.5); 24]);
    let whole = FlatSamples::U32(vec![1; 24]);
    for (name, samples, value) in [
        ("Y", full(0.75), 0.75),
        ("Y", half, 0.5),
        ("Z", full(3.5), 3.5),
        ("A", full(0.25), 0.25),
        ("mask.Y", full(1.0), 1.0),
        ("id", whole, 1.0),
    ] {
        let bytes = exr(&[(name, samples)], None);
        assert_eq!(pixel(&bytes), [value, value, value, 1.0], "{name}");
    }
    let with_alpha = exr(&[("Y", full(0.25)), ("A", full(0.5))], None);
    assert_eq!(pixel(&with_alpha), [0.25, 0.25, 0.25, 0.5]);
}

#[test]
fn the_only_layer_with_colours_is_the_picture() {
    let named = |layer: &str, value: f32| {
        ["R", "G", "B"].map(|channel| (format!("{layer}.{channel}"), full(value)))
    };
    let file = |channels: Vec<(String, FlatSamples)>| {
        let channels: Vec<(&str, FlatSamples)> = channels
            .iter()
            .map(|(name, samples)| (name.as_str(), samples.clone()))
            .collect();
        exr(&channels, None)
    };
    let mut one = named("beauty pass", 0.5).to_vec();
    one.push(("depth.Z".to_owned(), full(9.0)));
    assert_eq!(pixel(&file(one))[0], 0.5);
    let blender = [
        named("View Layer.Combined", 0.25).to_vec(),
        named("View Layer.DiffCol", 0.75).to_vec(),
        vec![("View Layer.Combined.A".to_owned(), full(0.5))],
    ];
    assert_eq!(pixel(&file(blender.concat())), [0.25, 0.25, 0.25, 0.5]);
    let plain = ["R", "G", "B"].map(|channel| (channel.to_owned(), full(0.125)));
    let beside = [plain.to_vec(), named("other", 1.0).to_vec()].concat();
    assert_eq!(pixel(&file(beside))[0], 0.125);
    let two = [named("left", 0.25).to_vec(), named("right", 0.75).to_vec()].concat();
    let error = decode(&file(two)).unwrap_err();
    assert!(error.to_string().contains("left.R"), "{error}");
    assert!(matches!(error, StillError::NotRead(text) if text.matches(", right.").count() == 3));
    let motion = exr(&[("forward.u", full(0.0)), ("forward.v", full(0.0))], None);
    assert!(matches!(decode(&motion), Err(StillError::NotRead(_))));
}

#[test]
fn chromaticities_become_rec709_and_white_stays_white() {
    let of = |red, green, blue, white| Chromaticities {
        red,
        green,
        blue,
        white,
    };
    let acescg = of(
        Vec2(0.713, 0.293),
        Vec2(0.165, 0.830),
        Vec2(0.128, 0.044),
        Vec2(0.32168, 0.33767),
    );
    let xyz = of(
        Vec2(1.0, 0.0),
        Vec2(0.0, 1.0),
        Vec2(0.0, 0.0),
        Vec2(1.0 / 3.0, 1.0 / 3.0),
    );
    let rec709 = of(
        Vec2(0.64, 0.33),
        Vec2(0.30, 0.60),
        Vec2(0.15, 0.06),
        Vec2(0.3127, 0.3290),
    );
    let light = |rgb: [f32; 3], chromaticities| {
        let channels = [
            ("R", full(rgb[0])),
            ("G", full(rgb[1])),
            ("B", full(rgb[2])),
        ];
        let bytes = exr(&channels, Some(chromaticities));
        let [r, g, b, _] = pixel(&bytes);
        let mut planes = [[r], [g], [b]];
        let [red, green, blue] = &mut planes;
        Colour::from_file(&bytes)
            .unwrap()
            .to_open_light([red, green, blue]);
        planes.map(|[value]| value)
    };
    let is_near = |found: [f32; 3], expected: [f32; 3]| {
        found
            .iter()
            .zip(expected)
            .all(|(a, b)| (a - b).abs() < 2e-3 * b.abs().max(1.0))
    };
    for chromaticities in [acescg, xyz, rec709] {
        assert!(
            is_near(light([7.0; 3], chromaticities), [7.0; 3]),
            "{chromaticities:?}"
        );
    }
    assert_eq!(light([3.0, 0.5, 0.25], rec709), [3.0, 0.5, 0.25]);
    // Red, green and blue of Rec. 709 in ACEScg.
    let red = light([0.6131, 0.0702, 0.0206], acescg);
    assert!(is_near(red, [1.0, 0.0, 0.0]), "{red:?}");
    // What lies outside is not negative light.
    assert!(
        light([0.0, 1.0, 0.0], acescg)
            .iter()
            .all(|&value| value >= 0.0)
    );
    let flat = of(
        Vec2(0.3, 0.3),
        Vec2(0.3, 0.3),
        Vec2(0.3, 0.3),
        Vec2(0.3, 0.3),
    );
    let channels = [("R", full(1.0)), ("G", full(1.0)), ("B", full(1.0))];
    assert!(Colour::from_file(&exr(&channels, Some(flat))).is_err());
}

/// A picture in which every pixel is another one.
fn numbered() -> RgbImage {
    RgbImage::from_fn(16, 8, |x, y| {
        image::Rgb([(16 * x) as u8, (32 * y) as u8, 0])
    })
}

#[test]
fn every_format_that_states_an_orientation_is_turned() {
    let upright = {
        let mut image = image::DynamicImage::from(numbered());
        image.apply_orientation(image::metadata::Orientation::Rotate90);
        image.into_rgb8()
    };
    let jpeg = jpeg_with(
        &encoded(numbered(), ImageFormat::Jpeg),
        &[exif_segment(exif(6, 1, b"R98\0"))],
    );
    let before = png_with(&numbered(), &[(b"eXIf", exif(6, 1, b"R98\0"))]);
    let plain = encoded(numbered(), ImageFormat::Png);
    // The chunk may stand behind the pixels, before IEND.
    let chunk = {
        let start = before.windows(4).position(|at| at == b"eXIf").unwrap() - 4;
        let length = u32::from_be_bytes(before[start..start + 4].try_into().unwrap()) as usize;
        before[start..start + length + 12].to_vec()
    };
    let end = plain.len() - 12;
    let behind = [&plain[..end], &chunk, &plain[end..]].concat();
    let tiff = {
        let mut bytes = encoded(numbered(), ImageFormat::Tiff);
        set_tiff_orientation(&mut bytes, 6);
        bytes
    };
    for (name, bytes, lossy) in [
        ("JPEG", jpeg, true),
        ("PNG", before, false),
        ("PNG, behind", behind, false),
        ("TIFF", tiff, false),
    ] {
        assert_eq!(
            orientation(&bytes).map(|found| found.to_exif()),
            Some(6),
            "{name}"
        );
        let image = decode(&bytes).unwrap().into_rgb8();
        assert_eq!(image.dimensions(), (8, 16), "{name}");
        assert!(lossy || image == upright, "{name}");
        assert_eq!(stored_size(&bytes), Some((16, 8)), "{name}");
    }
    assert_eq!(orientation(&plain), None);
}

/// Puts another directory behind the file, which has the orientation too.
fn set_tiff_orientation(bytes: &mut Vec<u8>, orientation: u16) {
    assert_eq!(&bytes[..4], b"II*\0");
    let start = u32::from_le_bytes(bytes[4..8].try_into().unwrap()) as usize;
    let count = usize::from(u16::from_le_bytes(
        bytes[start..start + 2].try_into().unwrap(),
    ));
    let mut entries: Vec<[u8; 12]> = bytes[start + 2..start + 2 + 12 * count]
        .chunks_exact(12)
        .map(|entry| entry.try_into().unwrap())
        .collect();
    let mut entry = [0; 12];
    entry[..8].copy_from_slice(&[0x12, 1, 3, 0, 1, 0, 0, 0]);
    entry[8..10].copy_from_slice(&orientation.to_le_bytes());
    entries.push(entry);
    entries.sort_by_key(|entry| u16::from_le_bytes([entry[0], entry[1]]));
    let place = bytes.len().next_multiple_of(2);
    bytes.resize(place, 0);
    bytes[4..8].copy_from_slice(&(place as u32).to_le_bytes());
    bytes.extend((entries.len() as u16).to_le_bytes());
    bytes.extend(entries.concat());
    bytes.extend([0; 4]);
}

#[test]
fn formats_that_are_not_read_are_named_with_what_to_do() {
    for (bytes, name) in [
        (
            &b"\0\0\0\x18ftypheic\0\0\0\0mif1heic rest"[..],
            "a HEIC image",
        ),
        (b"\0\0\0\x18ftypavif\0\0\0\0avifmif1 rest", "an AVIF image"),
        (b"\0\0\0\x0cJXL \r\n\x87\n", "a JPEG XL image"),
        (b"\0\0\0\x0cjP  \r\n\x87\n", "a JPEG 2000 image"),
        (b"8BPS\0\x01\0\0\0\0\0\0", "a Photoshop file"),
        (b"FUJIFILMCCD-RAW 0201", "a camera's raw file"),
        (
            b"<!doctype html><title>Not found</title>",
            "a page of a website",
        ),
        (b"P6 2 2 255 ", "a PNM image"),
    ] {
        let error = decode(bytes).unwrap_err();
        let text = error.to_string();
        assert!(matches!(error, StillError::NotRead(_)), "{text}");
        let (found, advice) = Format::sniff(bytes).and_then(Format::unsupported).unwrap();
        assert_eq!(found, name);
        assert!(text.contains(name) && text.contains(advice), "{text}");
    }
}

#[test]
fn tiff_bmp_and_gif_are_read() {
    for format in [ImageFormat::Tiff, ImageFormat::Bmp, ImageFormat::Gif] {
        let image = decode(&encoded(areas(AREAS), format)).unwrap().into_rgb8();
        assert_eq!(crate::files::middles(&image), AREAS, "{format:?}");
    }
}

#[test]
fn what_claims_too_many_pixels_is_refused() {
    let header = b"#?RADIANCE\n\n-Y 100000 +X 100000\n".to_vec();
    assert!(matches!(
        decode(&header),
        Err(StillError::TooLarge | StillError::Decode(_))
    ));
}
