//! Where files end, and what is missing of them.

use image::ImageFormat;
use relit_data::still::{StillError, decode};

use crate::files::{AREAS, areas, encoded, jpeg_with};

/// 40 x 24 pixels, ten scans, written by libjpeg's progression for colours.
const PROGRESSIVE: &[u8] = include_bytes!("progressive.jpg");

fn baseline() -> Vec<u8> {
    let busy = image::RgbImage::from_fn(40, 24, |x, y| {
        image::Rgb([(x * 6) as u8, (x * y * 7) as u8, (y * 9) as u8])
    });
    encoded(busy, ImageFormat::Jpeg)
}

fn without_end(jpeg: &[u8]) -> &[u8] {
    jpeg.strip_suffix(&[0xff, 0xd9]).unwrap()
}

#[test]
fn a_jpeg_of_which_only_the_end_marker_is_missing_is_the_same_picture() {
    let whole = baseline();
    let picture = decode(&whole).unwrap();
    let bare = without_end(&whole);
    let trailers: [&[u8]; 6] = [
        b"",
        b"\0\0\0\0",
        b"a trailer of a telephone",
        b"\xff",
        b"\xff\xd8\xff\xe0\0\x04ab and another picture",
        b"\xff\xee\0\x06abcd",
    ];
    for trailer in trailers {
        let file = [bare, trailer].concat();
        assert!(decode(&file).unwrap() == picture, "{trailer:?}");
    }
}

#[test]
fn what_follows_the_end_is_not_looked_at() {
    let whole = baseline();
    let picture = decode(&whole).unwrap();
    for trailer in [&b"trailer"[..], &baseline(), &[0; 4096]] {
        assert!(decode(&[&whole, trailer].concat()).unwrap() == picture);
    }
}

#[test]
fn a_jpeg_that_is_cut_anywhere_else_is_refused() {
    for whole in [baseline(), PROGRESSIVE.to_vec()] {
        let bare = without_end(&whole);
        for length in 0..bare.len() {
            let result = decode(&bare[..length]);
            assert!(result.is_err(), "{length} of {}", bare.len());
        }
        let cut = decode(&bare[..bare.len() - 1]).unwrap_err();
        assert!(matches!(cut, StillError::CutOff), "{cut}");
    }
}

#[test]
fn a_progressive_jpeg_without_its_end_is_refused() {
    assert!(decode(PROGRESSIVE).is_ok());
    let bare = decode(without_end(PROGRESSIVE));
    assert!(matches!(bare, Err(StillError::CutOff)));
    // Cut before each of its scans but the first.
    let scans = PROGRESSIVE
        .windows(2)
        .enumerate()
        .filter(|(_, pair)| pair == &[0xff, 0xda]);
    let places: Vec<usize> = scans.map(|(place, _)| place).collect();
    assert!(places.len() >= 6);
    for place in &places[1..] {
        let error = decode(&PROGRESSIVE[..*place]).unwrap_err();
        assert!(matches!(error, StillError::CutOff), "{place}: {error}");
    }
}

#[test]
fn a_grey_jpeg_and_one_with_a_restart_interval_may_lack_their_end_too() {
    let grey = image::GrayImage::from_fn(37, 21, |x, y| image::Luma([(x * y) as u8]));
    let whole = encoded(grey, ImageFormat::Jpeg);
    assert!(decode(without_end(&whole)).unwrap() == decode(&whole).unwrap());
    // A statement that restarts follow only after more blocks than there are changes nothing.
    let restarts = jpeg_with(&whole, &[(0xdd, vec![1, 0])]);
    assert!(decode(without_end(&restarts)).unwrap() == decode(&whole).unwrap());
}

#[test]
fn half_a_file_is_refused_in_every_format() {
    for format in [
        ImageFormat::Png,
        ImageFormat::WebP,
        ImageFormat::Tiff,
        ImageFormat::Bmp,
        ImageFormat::Gif,
    ] {
        let whole = encoded(areas(AREAS), format);
        assert!(decode(&whole).is_ok(), "{format:?}");
        assert!(decode(&whole[..whole.len() / 2]).is_err(), "{format:?}");
    }
}
