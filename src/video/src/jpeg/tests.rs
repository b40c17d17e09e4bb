//! Parts of pictures that FFmpeg encodes, against the whole pictures.
#![allow(clippy::unwrap_used)]

use std::path::Path;
use std::sync::LazyLock;

use image::RgbaImage;
use proptest::prelude::*;
use relit_test_support::ffmpeg;

use super::decode_part;
use crate::Video;
use relit_data::geometry::Rect;

/// Encodings: sampling of chroma, restart markers (by slices), blocks of 8 and 16 rows.
const ENCODINGS: [&str; 6] = [
    "-pix_fmt yuvj420p -q:v 2",
    "-pix_fmt yuvj422p -q:v 3",
    "-pix_fmt yuvj444p -q:v 2",
    "-pix_fmt gray -q:v 2",
    "-pix_fmt yuvj420p -q:v 9 -slices 4",
    "-pix_fmt yuvj422p -q:v 2 -huffman default",
];

/// A picture of an odd size in each encoding.
static JPEGS: LazyLock<Vec<Vec<u8>>> = LazyLock::new(|| ENCODINGS.map(encoded).into());

fn encoded(encoding: &str) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let source = "mandelbrot=size=149x101:rate=1";
    let mut arguments = vec![
        "-f",
        "lavfi",
        "-i",
        source,
        "-frames:v",
        "1",
        "-c:v",
        "mjpeg",
    ];
    arguments.extend(encoding.split(' '));
    arguments.push("clip.mkv");
    ffmpeg(folder.path(), &arguments);
    first(&folder.path().join("clip.mkv"))
}

fn first(path: &Path) -> Vec<u8> {
    let mut packets = Video::open(path).unwrap().packets().unwrap();
    packets.next().unwrap().data
}

const SIZE: (u32, u32) = (149, 101);

fn part(jpeg: &[u8], rect: Rect) -> Result<RgbaImage, super::NotDecoded> {
    let mut image = RgbaImage::new(rect.w, rect.h);
    let mut rows = image.chunks_exact_mut((4 * rect.w as usize).max(1));
    decode_part(jpeg, SIZE, rect, &mut |row| {
        rows.next()?.copy_from_slice(row);
        Some(())
    })?;
    Ok(image)
}

fn whole(jpeg: &[u8]) -> RgbaImage {
    part(jpeg, Rect::new(0, 0, SIZE.0, SIZE.1)).unwrap()
}

fn is_cut_of(found: &RgbaImage, whole: &RgbaImage, rect: Rect) -> bool {
    let (x, y) = (rect.x.unsigned_abs(), rect.y.unsigned_abs());
    *found == image::imageops::crop_imm(whole, x, y, rect.w, rect.h).to_image()
}

#[test]
fn a_part_at_every_border_of_blocks_is_that_of_the_whole_picture() {
    assert!(
        JPEGS[4].windows(2).any(|pair| pair == [0xFF, 0xD0]),
        "no restart markers"
    );
    for (jpeg, encoding) in JPEGS.iter().zip(ENCODINGS) {
        let whole = whole(jpeg);
        for x in [0, 1, 7, 8, 15, 16, 17, 31, 32, 64, 128, 143, 144, 148] {
            for y in [0, 1, 8, 15, 16, 17, 33, 48, 96, 100] {
                for (w, h) in [(1, 1), (2, 3), (16, 16), (17, 9), (85, 53), (149, 101)] {
                    let (w, h) = (w.min(149 - x), h.min(101 - y));
                    let rect = Rect::new(x as i32, y as i32, w, h);
                    let found = part(jpeg, rect).unwrap();
                    assert!(is_cut_of(&found, &whole, rect), "{encoding}: {rect}");
                }
            }
        }
    }
}

#[test]
fn a_webcam_s_jpeg_without_huffman_tables_has_the_standard_ones() {
    let jpeg = &JPEGS[5];
    let mut bare = Vec::new();
    let mut at = 2;
    bare.extend(&jpeg[..2]);
    while jpeg[at + 1] != 0xDA {
        let next = at + 2 + usize::from(u16::from_be_bytes([jpeg[at + 2], jpeg[at + 3]]));
        if jpeg[at + 1] != 0xC4 {
            bare.extend(&jpeg[at..next]);
        }
        at = next;
    }
    bare.extend(&jpeg[at..]);
    assert!(bare.len() + 400 < jpeg.len());
    assert_eq!(whole(&bare), whole(jpeg));
}

#[test]
fn a_part_beyond_the_picture_is_refused() {
    let jpeg = &JPEGS[0];
    for rect in [
        Rect::new(-1, 0, 9, 9),
        Rect::new(140, 0, 10, 9),
        Rect::new(0, 0, 0, 9),
    ] {
        assert!(part(jpeg, rect).is_err(), "{rect}");
    }
}

#[test]
fn data_that_are_cut_off_or_damaged_in_the_part_are_refused() {
    let jpeg = &JPEGS[1];
    let all = Rect::new(0, 0, SIZE.0, SIZE.1);
    for keep in [0, 1, 2, 20, jpeg.len() / 2, jpeg.len() - 1] {
        assert!(part(&jpeg[..keep], all).is_err(), "{keep}");
    }
    let mut early = jpeg.clone();
    let middle = early.len() / 2;
    early[middle..middle + 2].copy_from_slice(&[0xFF, 0xD9]);
    assert!(part(&early, all).is_err());
}

#[test]
fn most_damage_below_a_part_is_noticed_at_the_end_of_the_data() {
    let mut noticed = 0;
    for jpeg in JPEGS.iter() {
        let first = Rect::new(0, 0, 16, 8);
        assert!(part(jpeg, first).is_ok());
        // Pieces of the data that are missing, or there twice: never all of their ends fit by chance.
        for from in [5, 6, 7].map(|eighths| jpeg.len() * eighths / 8) {
            let to = from + 60;
            let missing = [&jpeg[..from], &jpeg[to..]].concat();
            let twice = [&jpeg[..to], &jpeg[from..]].concat();
            noticed += [missing, twice]
                .iter()
                .filter(|jpeg| part(jpeg, first).is_err())
                .count();
        }
    }
    assert!(noticed > 18, "{noticed} of 36");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn any_damage_is_refused_or_gives_a_picture_and_nothing_else(
        mut jpeg in prop::sample::select(JPEGS.clone()),
        hits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..12),
    ) {
        for (at, value) in hits {
            let at = at.index(jpeg.len());
            jpeg[at] = value;
        }
        let _ = part(&jpeg, Rect::new(30, 20, 77, 61));
    }
}
