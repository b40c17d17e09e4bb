//! Decoding from outside, on files that the `ffmpeg` program makes.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::fs;
use std::path::{Path, PathBuf};

use image::{RgbImage, RgbaImage};
use relit_data::geometry::Rect;
use relit_test_support::{ffmpeg, packets};
use relit_video::{CodedFrame, DecodeFault, PixelFormat, Video, VideoError};
use tempfile::TempDir;

const PATTERN: &str = "testsrc2=size=70x50:rate=25:duration=0.4";

/// A folder with one video in it, made by `ffmpeg` from a test pattern.
fn made(source: &str, name: &str, encoding: &str) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let mut arguments = vec!["-f", "lavfi", "-i", source];
    arguments.extend(encoding.split_whitespace());
    arguments.push(name);
    ffmpeg(folder.path(), &arguments);
    let path = folder.path().join(name);
    (folder, path)
}

/// All frames as the ffmpeg program converts them with its exact settings.
fn reference(path: &Path, width: u32, height: u32) -> Vec<RgbImage> {
    let name = path.file_name().unwrap().to_str().unwrap();
    let flags = "accurate_rnd+full_chroma_int+full_chroma_inp+neighbor";
    let scale = format!("scale=flags={flags}");
    let raw = ffmpeg(
        path.parent().unwrap(),
        &[
            "-i",
            name,
            "-fps_mode",
            "passthrough",
            "-vf",
            &scale,
            "-pix_fmt",
            "rgb24",
            "-f",
            "rawvideo",
            "-",
        ],
    );
    let size = (width * height * 3) as usize;
    raw.chunks_exact(size)
        .map(|f| RgbImage::from_raw(width, height, f.to_vec()).unwrap())
        .collect()
}

fn mean_difference(a: &RgbImage, b: &RgbImage) -> f64 {
    assert_eq!(a.dimensions(), b.dimensions());
    let sum: u64 = a
        .as_raw()
        .iter()
        .zip(b.as_raw())
        .map(|(&a, &b)| u64::from(a.abs_diff(b)))
        .sum();
    sum as f64 / a.as_raw().len() as f64
}

fn largest_difference(a: &RgbImage, b: &RgbImage) -> u8 {
    assert_eq!(a.dimensions(), b.dimensions());
    a.as_raw()
        .iter()
        .zip(b.as_raw())
        .map(|(&a, &b)| a.abs_diff(b))
        .max()
        .unwrap()
}

fn farthest_from(frame: &RgbImage, level: u8) -> u8 {
    frame
        .as_raw()
        .iter()
        .map(|value| value.abs_diff(level))
        .max()
        .unwrap()
}

#[test]
fn white_stays_255_and_black_0_in_every_sampling_of_motion_jpeg() {
    for format in [
        "yuvj420p", "yuvj422p", "yuvj444p", "yuvj440p", "yuvj411p", "gray",
    ] {
        for (colour, level) in [("white", 255), ("black", 0)] {
            let source = format!("color={colour}:size=64x48:rate=5:duration=0.4");
            let encoding = format!("-pix_fmt {format} -c:v mjpeg -q:v 2");
            let (_folder, path) = made(&source, "a.avi", &encoding);
            let frame = Video::open(&path).unwrap().frame(1).unwrap();
            let worst = farthest_from(&frame, level);
            assert!(worst <= 1, "{format} {colour}: off by {worst}");
            assert!(level == 0 || frame.as_raw().iter().filter(|&&v| v == 255).count() > 0);
        }
    }
}

#[test]
fn limited_range_is_expanded() {
    for (colour, level) in [("white", 255), ("black", 0)] {
        let source = format!("color={colour}:size=64x48:rate=5:duration=0.4");
        let (_folder, path) = made(&source, "a.mp4", "-pix_fmt yuv420p -c:v libx264 -qp 0");
        let video = Video::open(&path).unwrap();
        assert!(!video.facts().full_range);
        let frame = video.frame(0).unwrap();
        let worst = farthest_from(&frame, level);
        assert!(worst <= 1, "{colour}: off by {worst}");
    }
}

#[test]
fn the_stated_matrix_is_used() {
    let source = "color=0x20C040:size=64x48:rate=5:duration=0.2";
    for matrix in ["bt709", "smpte170m"] {
        let encoding = format!(
            "-vf scale=out_color_matrix={matrix}:flags=accurate_rnd -colorspace {matrix} -pix_fmt yuv444p -c:v libx264 -qp 0"
        );
        let (_folder, path) = made(source, "a.mp4", &encoding);
        let frame = Video::open(&path).unwrap().frame(0).unwrap();
        for (found, wanted) in frame
            .get_pixel(30, 20)
            .0
            .into_iter()
            .zip([0x20, 0xC0, 0x40])
        {
            assert!(
                u8::abs_diff(found, wanted) <= 3,
                "{matrix}: {frame:?}",
                frame = frame.get_pixel(30, 20)
            );
        }
    }
}

#[test]
fn every_codec_gives_the_pictures_that_the_ffmpeg_program_gives() {
    for (name, encoding, most) in [
        ("a.mkv", "-pix_fmt yuvj444p -c:v mjpeg -q:v 2", 3),
        ("b.mkv", "-pix_fmt yuv444p -c:v ffv1 -level 3", 3),
        ("c.mkv", "-pix_fmt bgr0 -c:v ffv1 -level 3", 1),
        ("d.mp4", "-pix_fmt yuv444p -c:v libx264 -qp 0 -bf 2", 3),
        ("e.avi", "-pix_fmt bgr24 -c:v rawvideo", 1),
        ("f.mkv", "-pix_fmt gray -c:v ffv1", 1),
        ("g.mkv", "-pix_fmt yuv444p10le -c:v ffv1", 4),
    ] {
        let (_folder, path) = made(PATTERN, name, encoding);
        let wanted = reference(&path, 70, 50);
        let video = Video::open(&path).unwrap();
        assert_eq!((video.frames().len(), wanted.len()), (10, 10), "{name}");
        for (number, wanted) in (0..).zip(&wanted) {
            let found = video.frame(number).unwrap();
            let off = largest_difference(&found, wanted);
            assert!(off <= most, "{name} frame {number}: off by {off}");
        }
    }
}

#[test]
fn subsampled_chroma_stays_near_the_ffmpeg_programs_pictures() {
    for (name, encoding) in [
        ("a.mkv", "-pix_fmt yuvj422p -c:v mjpeg -q:v 2"),
        ("b.mkv", "-pix_fmt yuvj420p -c:v mjpeg -q:v 2"),
        ("c.mkv", "-pix_fmt yuvj440p -c:v mjpeg -q:v 2"),
        ("d.mkv", "-pix_fmt yuvj411p -c:v mjpeg -q:v 2"),
        ("e.nut", "-pix_fmt yuyv422 -c:v rawvideo"),
        ("f.mkv", "-pix_fmt yuv422p -c:v ffv1"),
        ("g.mp4", "-pix_fmt yuv420p -c:v libx264 -qp 0 -bf 2"),
        ("h.nut", "-pix_fmt nv12 -c:v rawvideo"),
    ] {
        let (_folder, path) = made(PATTERN, name, encoding);
        let wanted = reference(&path, 70, 50);
        let video = Video::open(&path).unwrap();
        for (number, wanted) in (0..).zip(&wanted) {
            let off = mean_difference(&video.frame(number).unwrap(), wanted);
            assert!(off <= 2.0, "{name} frame {number}: mean difference {off}");
        }
    }
}

#[test]
fn motion_jpeg_without_huffman_tables_is_decoded_like_that_with_them() {
    let (folder, path) = made(
        PATTERN,
        "whole.mjpeg",
        "-pix_fmt yuvj422p -c:v mjpeg -huffman default -q:v 3",
    );
    let stripped = without_huffman_tables(&fs::read(&path).unwrap());
    fs::write(folder.path().join("bare.mjpeg"), stripped).unwrap();
    for name in ["whole", "bare"] {
        let (from, to) = (format!("{name}.mjpeg"), format!("{name}.avi"));
        ffmpeg(
            folder.path(),
            &["-f", "mjpeg", "-r", "25", "-i", &from, "-c", "copy", &to],
        );
    }
    let whole = Video::open(&folder.path().join("whole.avi")).unwrap();
    let bare = Video::open(&folder.path().join("bare.avi")).unwrap();
    assert_eq!(bare.frames().len(), 10);
    for number in 0..10 {
        assert_eq!(whole.frame(number).unwrap(), bare.frame(number).unwrap());
    }
}

/// Drops the DHT segments of a row of JPEGs.
fn without_huffman_tables(jpegs: &[u8]) -> Vec<u8> {
    let mut kept = Vec::new();
    let mut at = 0;
    while at < jpegs.len() {
        let is_table = jpegs[at..].starts_with(&[0xFF, 0xC4]);
        let length = |at: usize| usize::from(jpegs[at + 2]) << 8 | usize::from(jpegs[at + 3]);
        if is_table {
            at += 2 + length(at);
        } else {
            kept.push(jpegs[at]);
            at += 1;
        }
    }
    assert!(kept.len() < jpegs.len());
    kept
}

#[test]
fn a_region_is_cut_from_the_whole_picture_wherever_it_begins() {
    let (_folder, path) = made(PATTERN, "a.mkv", "-pix_fmt yuvj420p -c:v mjpeg -q:v 2");
    let video = Video::open(&path).unwrap();
    let whole = video.frame(3).unwrap();
    for rect in [
        Rect::new(0, 0, 70, 50),
        Rect::new(11, 7, 20, 21),
        Rect::new(69, 49, 1, 1),
        Rect::new(-5, -3, 30, 20),
        Rect::new(60, 40, 30, 30),
        Rect::new(500, 0, 4, 4),
    ] {
        let pending = video.read(&[3], 1).unwrap().next().unwrap();
        let piece = video.picture(pending).unwrap().rgb(rect).unwrap();
        let wanted = RgbImage::from_fn(rect.w, rect.h, |x, y| {
            let (x, y) = (
                i64::from(rect.x) + i64::from(x),
                i64::from(rect.y) + i64::from(y),
            );
            let inside = (0..70).contains(&x) && (0..50).contains(&y);
            if inside {
                *whole.get_pixel(x as u32, y as u32)
            } else {
                image::Rgb([0; 3])
            }
        });
        assert_eq!(largest_difference(&piece, &wanted), 0, "{rect}");
    }
}

#[test]
fn key_frames_are_decoded_alone_and_as_among_the_others() {
    let encoding = "-pix_fmt yuv420p -c:v libx264 -g 4 -sc_threshold 0 -bf 2";
    let (_folder, path) = made(PATTERN, "a.mkv", encoding);
    let video = Video::open(&path).unwrap();
    assert_eq!(video.key_frames(), [0, 4, 8]);
    let picture = |pending| {
        let picture = video.picture(pending).unwrap();
        (picture.number(), picture.rgb(PARTS[0]).unwrap())
    };
    let all: Vec<u64> = (0..10).collect();
    let all: Vec<_> = video.read(&all, 2).unwrap().map(picture).collect();
    let alone: Vec<_> = video.read(&[0, 4, 8], 2).unwrap().map(picture).collect();
    let wanted: Vec<_> = all
        .into_iter()
        .filter(|(number, _)| number % 4 == 0)
        .collect();
    assert!(alone == wanted);
    let (_folder, path) = made(PATTERN, "b.mkv", "-pix_fmt yuvj422p -c:v mjpeg");
    assert_eq!(Video::open(&path).unwrap().key_frames().len(), 10);
}

/// The part of a frame, and whether its fourth bytes say what lies inside the picture.
fn part(video: &Video, number: u64, region: Rect) -> Result<RgbImage, DecodeFault> {
    let pending = video.read(&[number], 1).unwrap().next().unwrap();
    // What an earlier frame left there must not show.
    let mut part = RgbaImage::from_pixel(region.w, region.h, image::Rgba([77; 4]));
    video.part(pending, region, &mut part)?;
    let (width, height) = (video.facts().width, video.facts().height);
    for (x, y, pixel) in part.enumerate_pixels() {
        let at = Rect::new(region.x + x as i32, region.y + y as i32, 1, 1);
        let inside = at.clipped_to(width, height).is_some();
        assert_eq!(pixel.0[3], if inside { 255 } else { 0 });
    }
    Ok(image::DynamicImage::from(part).to_rgb8())
}

const PARTS: [Rect; 5] = [
    Rect::new(0, 0, 70, 50),
    Rect::new(11, 7, 20, 21),
    Rect::new(-5, -3, 30, 20),
    Rect::new(60, 40, 30, 30),
    Rect::new(500, 0, 4, 4),
];

#[test]
fn a_part_of_motion_jpeg_is_the_same_for_any_region_and_nearly_what_ffmpeg_makes_of_it() {
    for format in ["yuvj420p", "yuvj422p", "yuvj444p", "gray"] {
        let encoding = format!("-pix_fmt {format} -c:v mjpeg -q:v 2");
        let (_folder, path) = made(PATTERN, "a.mkv", &encoding);
        let video = Video::open(&path).unwrap();
        let whole = part(&video, 3, PARTS[0]).unwrap();
        let by_ffmpeg = video.frame(3).unwrap();
        assert!(largest_difference(&whole, &by_ffmpeg) <= 4, "{format}");
        assert!(mean_difference(&whole, &by_ffmpeg) < 0.5, "{format}");
        for region in PARTS {
            let mut wanted = RgbImage::new(region.w, region.h);
            let (left, top) = (-i64::from(region.x), -i64::from(region.y));
            image::imageops::replace(&mut wanted, &whole, left, top);
            let found = part(&video, 3, region).unwrap();
            assert_eq!(largest_difference(&found, &wanted), 0, "{format} {region}");
        }
    }
}

#[test]
fn a_part_of_other_video_is_that_of_its_picture() {
    for (name, encoding) in [
        ("a.mkv", "-pix_fmt yuv420p -c:v libx264"),
        ("b.mkv", "-pix_fmt yuv422p -c:v ffv1"),
    ] {
        let (_folder, path) = made(PATTERN, name, encoding);
        let video = Video::open(&path).unwrap();
        for region in PARTS {
            let pending = video.read(&[3], 1).unwrap().next().unwrap();
            let wanted = video.picture(pending).unwrap().rgb(region).unwrap();
            assert!(
                part(&video, 3, region).unwrap() == wanted,
                "{name} {region}"
            );
        }
    }
}

/// Replaces the four numbers of the display matrix that turn the picture of an MP4 file (ISO/IEC 14496-12, `tkhd`).
fn with_display_matrix(mut mp4: Vec<u8>, [a, b, c, d]: [i32; 4]) -> Vec<u8> {
    const TO_MATRIX: usize = 4 + 4 + 5 * 4 + 8 + 8;
    let header = mp4.windows(4).position(|name| name == b"tkhd").unwrap();
    let matrix = [a, b, 0, c, d].map(i32::to_be_bytes).concat();
    let at = header + TO_MATRIX;
    mp4[at..at + matrix.len()].copy_from_slice(&matrix);
    mp4
}

#[test]
fn the_rotation_that_the_file_asks_for_is_applied() {
    let (folder, _) = made(PATTERN, "up.mp4", "-pix_fmt yuv444p -c:v libx264 -qp 0");
    let up = fs::read(folder.path().join("up.mp4")).unwrap();
    const ONE: i32 = 1 << 16;
    for (degrees, matrix) in [
        ("90", [0, ONE, -ONE, 0]),
        ("180", [-ONE, 0, 0, -ONE]),
        ("270", [0, -ONE, ONE, 0]),
    ] {
        let path = folder.path().join(format!("turned{degrees}.mp4"));
        fs::write(&path, with_display_matrix(up.clone(), matrix)).unwrap();
        let video = Video::open(&path).unwrap();
        let (width, height) = (video.facts().width, video.facts().height);
        assert_eq!(
            (width, height),
            if degrees == "180" { (70, 50) } else { (50, 70) }
        );
        let wanted = reference(&path, width, height);
        assert!(
            largest_difference(&video.frame(2).unwrap(), &wanted[2]) <= 3,
            "{degrees}"
        );
    }
}

/// A lossless video of 10 bits, each frame one colour (luma, blue and red difference), with these statements.
fn plain_10_bit(colour: [u16; 3], statements: &str) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let plane = |value: u16, count: usize| value.to_le_bytes().repeat(count);
    let frame = [
        plane(colour[0], 32 * 16),
        plane(colour[1], 16 * 8),
        plane(colour[2], 16 * 8),
    ];
    fs::write(folder.path().join("plain.yuv"), frame.concat().repeat(3)).unwrap();
    let source = "-f rawvideo -pix_fmt yuv420p10le -video_size 32x16 -i plain.yuv -c:v ffv1 -vf";
    let mut arguments: Vec<&str> = source.split(' ').collect();
    let filter = format!("setparams={statements}");
    arguments.push(&filter);
    // What filters state counts in newer versions of the program, what options state in older ones.
    let options: Vec<(String, &str)> = statements
        .split(':')
        .filter_map(|statement| statement.split_once('='))
        .map(|(name, value)| (format!("-{}", name.replace("range", "color_range")), value))
        .collect();
    arguments.extend(
        options
            .iter()
            .flat_map(|(name, value)| [name.as_str(), value]),
    );
    arguments.push("a.mkv");
    ffmpeg(folder.path(), &arguments);
    let path = folder.path().join("a.mkv");
    (folder, path)
}

fn colour_of(path: &Path) -> [u8; 3] {
    Video::open(path)
        .unwrap()
        .frame(1)
        .unwrap()
        .get_pixel(9, 9)
        .0
}

#[test]
fn hdr_and_wide_gamut_become_srgb() {
    const HDR: &str = "range=tv:colorspace=bt2020nc:color_primaries=bt2020:color_trc";
    let near = |found: [u8; 3], wanted: [u8; 3]| {
        found
            .iter()
            .zip(wanted)
            .all(|(found, wanted)| found.abs_diff(wanted) <= 1)
    };
    // BT.2408: 203 cd/m2 are 58 % of PQ and 75 % of HLG.
    for (transfer, luma) in [("smpte2084", 573), ("arib-std-b67", 721)] {
        let (_folder, path) = plain_10_bit([luma, 512, 512], &format!("{HDR}={transfer}"));
        let video = Video::open(&path).unwrap();
        assert!(video.facts().colour_conversion.is_some());
        assert_eq!(video.notes().len(), 1, "{:?}", video.notes());
        assert!(
            near(colour_of(&path), [255; 3]),
            "{transfer}: {:?}",
            colour_of(&path)
        );
    }
    // The same values are grey without a statement.
    let (_folder, path) = plain_10_bit([573, 512, 512], "range=tv:colorspace=bt709");
    assert!(
        Video::open(&path)
            .unwrap()
            .facts()
            .colour_conversion
            .is_none()
    );
    assert!(near(colour_of(&path), [148; 3]), "{:?}", colour_of(&path));
    // Red (200, 60, 50) of Display P3, and what it is in sRGB.
    const P3: &str = "range=tv:colorspace=bt709:color_primaries=smpte432:color_trc";
    let (_folder, path) = plain_10_bit([370, 438, 760], &format!("{P3}=iec61966-2-1"));
    let found = colour_of(&path);
    let off = found
        .iter()
        .zip([217, 42, 39])
        .map(|(found, wanted)| found.abs_diff(wanted));
    assert!(off.max() <= Some(4), "{found:?}");
}

#[test]
fn colours_that_are_not_known_are_refused_by_name() {
    for (statements, name) in [
        ("colorspace=bt2020nc:color_trc=log100", "logarithmic"),
        ("colorspace=ictcp:color_trc=smpte2084", "ICTCP"),
    ] {
        let (_folder, path) = plain_10_bit([400, 512, 512], statements);
        let error = Video::open(&path).unwrap_err();
        assert!(matches!(error, VideoError::Unreadable { .. }), "{error}");
        let text = error.to_string();
        assert!(text.contains(name), "{text}");
    }
}

#[test]
fn pixels_that_are_not_square_are_shown_as_squares() {
    for (ratio, size) in [("4/3", (93, 50)), ("1/2", (70, 100))] {
        let encoding = format!("-vf setsar={ratio} -pix_fmt yuv444p -c:v libx264 -qp 0");
        let (_folder, path) = made(PATTERN, "a.mp4", &encoding);
        let video = Video::open(&path).unwrap();
        let facts = video.facts();
        assert_eq!((facts.width, facts.height), size);
        assert_eq!(facts.stored_size, (70, 50));
        assert!(video.notes().iter().any(|note| note.contains("70 x 50")));
        let whole = video.frame(2).unwrap();
        let plain = ffmpeg_frame(&path, "scale=iw:ih,setsar=1", 2, (70, 50));
        let wanted = image::imageops::resize(
            &plain,
            size.0,
            size.1,
            image::imageops::FilterType::Triangle,
        );
        assert!(mean_difference(&whole, &wanted) < 3.0, "{ratio}");
        let region = Rect::new(11, 7, 20, 21);
        let wanted = image::imageops::crop_imm(&whole, 11, 7, 20, 21).to_image();
        assert!(part(&video, 2, region).unwrap() == wanted, "{ratio}");
    }
}

/// One frame as the ffmpeg program gives it through a filter.
fn ffmpeg_frame(path: &Path, filter: &str, number: usize, (width, height): (u32, u32)) -> RgbImage {
    let name = path.file_name().unwrap().to_str().unwrap();
    let arguments = [
        "-i", name, "-vf", filter, "-pix_fmt", "rgb24", "-f", "rawvideo", "-",
    ];
    let raw = ffmpeg(path.parent().unwrap(), &arguments);
    let size = (width * height * 3) as usize;
    RgbImage::from_raw(
        width,
        height,
        raw[number * size..(number + 1) * size].to_vec(),
    )
    .unwrap()
}

#[test]
fn frames_that_say_themselves_how_to_be_turned_are_turned() {
    // H.264's message.
    let (folder, _) = made(PATTERN, "up.mp4", "-pix_fmt yuv444p -c:v libx264 -qp 0");
    let arguments =
        "-i up.mp4 -c copy -bsf:v h264_metadata=display_orientation=insert:rotate=90 turned.mp4";
    ffmpeg(folder.path(), &arguments.split(' ').collect::<Vec<_>>());
    check_turned(&folder.path().join("turned.mp4"));
    // Exif in each frame of Motion JPEG.
    let (folder, path) = made(PATTERN, "up.mjpeg", "-pix_fmt yuvj444p -c:v mjpeg -q:v 2");
    let turned = with_exif_orientation(&fs::read(&path).unwrap(), 6);
    fs::write(folder.path().join("turned.mjpeg"), turned).unwrap();
    let arguments = "-f mjpeg -r 25 -i turned.mjpeg -c copy turned.mkv";
    ffmpeg(folder.path(), &arguments.split(' ').collect::<Vec<_>>());
    check_turned(&folder.path().join("turned.mkv"));
}

fn check_turned(path: &Path) {
    let video = Video::open(path).unwrap();
    assert_eq!((video.facts().width, video.facts().height), (50, 70));
    // The ffmpeg program forgets the message of H.264 after the first frame.
    let first = video.frame(0).unwrap();
    let off = largest_difference(&first, &reference(path, 50, 70)[0]);
    assert!(off <= 4, "{off}");
    let frame = video.frame(2).unwrap();
    let region = Rect::new(11, 7, 20, 21);
    let wanted = image::imageops::crop_imm(&frame, 11, 7, 20, 21).to_image();
    assert!(part(&video, 2, region).unwrap() == wanted);
}

/// Puts an Exif segment with this orientation into each of a row of JPEGs.
fn with_exif_orientation(jpegs: &[u8], orientation: u8) -> Vec<u8> {
    let mut segment =
        b"\xff\xe1\x00\x22Exif\0\0II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0".to_vec();
    segment.extend([orientation, 0, 0, 0, 0, 0, 0, 0]);
    let mut turned = Vec::new();
    for (at, &byte) in jpegs.iter().enumerate() {
        turned.push(byte);
        if jpegs[..=at].ends_with(&[0xff, 0xd8]) {
            turned.extend(&segment);
        }
    }
    turned
}

#[test]
fn gaps_and_jitter_in_the_time_stamps_are_kept() {
    let (folder, _) = made(PATTERN, "even.mkv", "-c:v mjpeg -pix_fmt yuvj422p");
    let filter = r"setts=ts=round(N*40+7*mod(N\,3)+200*gte(N\,5))";
    ffmpeg(
        folder.path(),
        &["-i", "even.mkv", "-c", "copy", "-bsf:v", filter, "odd.mkv"],
    );
    let video = Video::open(&folder.path().join("odd.mkv")).unwrap();
    let times: Vec<i64> = video.frames().iter().map(|frame| frame.t_us).collect();
    let wanted: Vec<i64> = (0..10)
        .map(|n| 1000 * (n * 40 + 7 * (n % 3) + if n >= 5 { 200 } else { 0 }))
        .collect();
    assert_eq!(times, wanted);
}

#[test]
fn frames_come_in_order_of_presentation_where_the_file_holds_them_in_another() {
    let (_folder, path) = made(
        PATTERN,
        "a.mp4",
        "-pix_fmt yuv420p -c:v libx264 -bf 3 -qp 10",
    );
    let video = Video::open(&path).unwrap();
    let numbers: Vec<u64> = video
        .read(&[8, 2, 3, 2], 2)
        .unwrap()
        .map(|p| p.number())
        .collect();
    assert_eq!(numbers, [2, 3, 8]);
    assert!(
        video
            .frames()
            .windows(2)
            .all(|pair| pair[0].t_us < pair[1].t_us)
    );
}

#[test]
fn a_truncated_file_yields_the_frames_that_it_has_and_says_where_it_ends() {
    for encoding in [
        "-pix_fmt yuvj422p -c:v mjpeg",
        "-pix_fmt yuv420p -c:v libx264",
    ] {
        let (folder, path) = made(PATTERN, "whole.mkv", encoding);
        let whole = fs::read(&path).unwrap();
        let mut opened = 0;
        for percent in [30, 55, 80, 95] {
            let cut = folder.path().join("cut.mkv");
            fs::write(&cut, &whole[..whole.len() * percent / 100]).unwrap();
            let Ok(video) = Video::open(&cut) else {
                continue;
            };
            opened += 1;
            assert!(
                !video.damage().is_empty(),
                "{percent} %: {:?}",
                video.frames().len()
            );
            for frame in video.frames().iter().filter(|frame| !frame.damaged) {
                video.frame(frame.number).unwrap();
            }
        }
        // The first frame alone takes up much of the H.264.
        assert!(
            opened >= if encoding.contains("mjpeg") { 4 } else { 1 },
            "{encoding}: {opened}"
        );
    }
}

#[test]
fn a_cut_is_told_with_its_place() {
    let (folder, path) = made(PATTERN, "whole.mkv", "-pix_fmt yuvj422p -c:v mjpeg");
    let bytes = fs::read(&path).unwrap();
    let cut = folder.path().join("cut.mkv");
    fs::write(&cut, &bytes[..bytes.len() * 2 / 3]).unwrap();
    let video = Video::open(&cut).unwrap();
    let damage = video.damage();
    assert!(damage[0].contains("byte"), "{damage:?}");
}

#[test]
fn a_damaged_jpeg_is_an_error_and_the_frames_around_it_come() {
    let (folder, path) = made(PATTERN, "whole.avi", "-pix_fmt yuvj422p -c:v mjpeg -q:v 2");
    let mut bytes = fs::read(&path).unwrap();
    let starts: Vec<usize> = (0..bytes.len() - 3)
        .filter(|&at| bytes[at..].starts_with(&[0xFF, 0xD8, 0xFF]))
        .collect();
    assert_eq!(starts.len(), 10);
    let middle = (starts[4] + starts[5]) / 2;
    for pair in bytes[middle..middle + 200].chunks_exact_mut(2) {
        pair.copy_from_slice(&[0xFF, 0xD9]);
    }
    let damaged = folder.path().join("damaged.avi");
    fs::write(&damaged, bytes).unwrap();
    let video = Video::open(&damaged).unwrap();
    let fault = video.frame(4).unwrap_err();
    assert!(
        matches!(
            fault,
            VideoError::Frame {
                number: 4,
                fault: DecodeFault::Damaged(_),
                ..
            }
        ),
        "{fault}"
    );
    // The damage lies below the part.
    let above = Rect::new(0, 0, 70, 8);
    assert!(matches!(
        part(&video, 4, above),
        Err(DecodeFault::Damaged(_))
    ));
    for number in (0..10).filter(|&number| number != 4) {
        video.frame(number).unwrap();
        part(&video, number, PARTS[0]).unwrap();
    }
}

#[test]
fn damage_in_h264_costs_the_frames_up_to_the_next_key_frame_and_no_more() {
    let encoding = "-pix_fmt yuv420p -c:v libx264 -g 5 -bf 0 -qp 10 -sc_threshold 0";
    let pattern = "testsrc2=size=320x240:rate=25:duration=0.4";
    let (folder, path) = made(pattern, "whole.mkv", encoding);
    let mut bytes = fs::read(&path).unwrap();
    let at = packets(folder.path(), "whole.mkv")[2].at;
    bytes[at + 60..at + 260].fill(0x5A);
    let damaged = folder.path().join("damaged.mkv");
    fs::write(&damaged, bytes).unwrap();
    let video = Video::open(&damaged).unwrap();
    let all: Vec<u64> = (0..10).collect();
    for threads in [1, 2] {
        let mut whole: Vec<u64> = Vec::new();
        for pending in video.read(&all, threads).unwrap() {
            let number = pending.number();
            if video.picture(pending).is_ok() {
                whole.push(number);
            }
        }
        whole.sort_unstable();
        assert_eq!(whole, [0, 1, 5, 6, 7, 8, 9], "{threads} threads");
    }
}

#[test]
fn a_flipped_byte_in_ffv1_is_found_by_its_checksum_and_not_covered_up() {
    let encoding = "-pix_fmt yuv422p -c:v ffv1 -level 3 -g 1 -slicecrc 1";
    let (folder, path) = made(PATTERN, "whole.mkv", encoding);
    let mut bytes = fs::read(&path).unwrap();
    let packet = packets(folder.path(), "whole.mkv")[4];
    bytes[packet.at + packet.size / 2] ^= 0x10;
    let damaged = folder.path().join("damaged.mkv");
    fs::write(&damaged, bytes).unwrap();
    let video = Video::open(&damaged).unwrap();
    let lost: Vec<u64> = (0..10)
        .filter(|&number| video.frame(number).is_err())
        .collect();
    assert_eq!(lost, [4]);
}

#[test]
fn grey_without_a_stated_range_is_not_expanded() {
    let source = "color=gray:size=64x48:rate=5:duration=0.4";
    let (_folder, path) = made(source, "a.nut", "-pix_fmt gray -c:v rawvideo");
    let video = Video::open(&path).unwrap();
    let wanted = reference(&path, 64, 48);
    assert_eq!(video.frame(0).unwrap(), wanted[0]);
}

#[test]
fn a_file_without_time_stamps_is_spread_by_its_rate_and_says_so() {
    let (_folder, path) = made(PATTERN, "a.h264", "-pix_fmt yuv420p -c:v libx264 -bf 2");
    let video = Video::open(&path).unwrap();
    let times: Vec<i64> = video.frames().iter().map(|frame| frame.t_us).collect();
    assert!(times.windows(2).all(|pair| pair[1] > pair[0]), "{times:?}");
    assert!(
        video.notes()[0].contains("time stamps"),
        "{:?}",
        video.notes()
    );
    check_against_the_ffmpeg_program(&video, &path);
}

#[test]
fn h264_with_frames_out_of_order_in_avi_is_numbered_as_it_is_shown() {
    let (_folder, path) = made(
        PATTERN,
        "a.avi",
        "-pix_fmt yuv420p -c:v libx264 -bf 2 -qp 0",
    );
    check_against_the_ffmpeg_program(&Video::open(&path).unwrap(), &path);
}

#[test]
fn what_a_trimmed_clip_does_not_show_is_not_counted() {
    let encoding = "-pix_fmt yuv420p -c:v libx264 -g 10 -bf 2 -qp 0";
    let (folder, _) = made(
        "testsrc2=size=70x50:rate=25:duration=2",
        "long.mp4",
        encoding,
    );
    ffmpeg(
        folder.path(),
        &["-ss", "0.6", "-i", "long.mp4", "-c", "copy", "clip.mp4"],
    );
    let path = folder.path().join("clip.mp4");
    let video = Video::open(&path).unwrap();
    let wanted = reference(&path, 70, 50);
    assert_eq!(video.frames().len(), wanted.len());
    assert!(video.damage().is_empty(), "{:?}", video.damage());
    check_against_the_ffmpeg_program(&video, &path);
}

fn check_against_the_ffmpeg_program(video: &Video, path: &Path) {
    let wanted = reference(path, 70, 50);
    assert_eq!(video.frames().len(), wanted.len());
    for (number, wanted) in (0..).zip(&wanted) {
        let off = mean_difference(&video.frame(number).unwrap(), wanted);
        assert!(off <= 2.0, "frame {number}: mean difference {off}");
    }
}

#[test]
fn what_is_no_video_is_refused_with_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let text = folder.path().join("notes.txt");
    fs::write(&text, "not a video").unwrap();
    let (_folder, sound) = made("sine=duration=0.2", "a.wav", "");
    for file in [text, sound] {
        let error = Video::open(&file).unwrap_err();
        assert!(matches!(error, VideoError::Unreadable { path, .. } if path == file));
    }
}

#[test]
fn a_frame_beyond_the_end_is_refused() {
    let (_folder, path) = made(PATTERN, "a.mkv", "-c:v mjpeg -pix_fmt yuvj422p");
    let video = Video::open(&path).unwrap();
    assert!(matches!(
        video.frame(10),
        Err(VideoError::NoSuchFrame {
            number: 10,
            last: 9,
            ..
        })
    ));
}

#[test]
fn coded_frames_are_the_bytes_of_the_file() {
    let (folder, path) = made(PATTERN, "clip.avi", "-c:v mjpeg");
    let video = Video::open(&path).unwrap();
    let coded: Vec<_> = video.packets().unwrap().collect();
    let sizes: Vec<usize> = packets(folder.path(), "clip.avi")
        .iter()
        .map(|place| place.size)
        .collect();
    let found: Vec<usize> = coded.iter().map(|frame| frame.data.len()).collect();
    assert_eq!(found, sizes);
    assert!(coded.iter().all(|frame| frame.key && !frame.damaged));
    assert!(coded.iter().map(|frame| frame.number).eq(0..10));
    assert!(video.is_in_order());
    let arguments = "-i clip.avi -c copy -f mjpeg -";
    let stream = ffmpeg(folder.path(), &arguments.split(' ').collect::<Vec<_>>());
    assert!(all_data(&coded) == stream);
}

fn all_data(frames: &[CodedFrame]) -> Vec<u8> {
    frames.iter().flat_map(|frame| frame.data.clone()).collect()
}

/// The units of an H.264 byte stream, without start codes.
fn units(stream: &[u8]) -> Vec<Vec<u8>> {
    let mut units = vec![Vec::new()];
    for &byte in stream {
        let unit = units.last_mut().unwrap();
        unit.push(byte);
        if unit.ends_with(&[0, 0, 1]) {
            let end = unit
                .iter()
                .rposition(|&byte| byte > 1)
                .map_or(0, |at| at + 1);
            unit.truncate(end);
            units.push(Vec::new());
        }
    }
    units.split_off(1)
}

#[test]
fn coded_h264_is_the_byte_stream_of_a_camera() {
    const PARAMETER_SETS: [u8; 2] = [7, 8];
    let kind = |unit: &[u8]| unit[0] & 0x1f;
    let (folder, path) = made(PATTERN, "clip.mp4", "-c:v libx264 -bf 0 -g 4");
    let video = Video::open(&path).unwrap();
    assert!(video.is_in_order());
    let coded: Vec<_> = video.packets().unwrap().collect();
    for frame in &coded {
        let kinds: Vec<u8> = units(&frame.data).iter().map(|unit| kind(unit)).collect();
        assert_eq!(kinds.starts_with(&PARAMETER_SETS), frame.key, "{kinds:?}");
    }
    assert_eq!(coded.iter().filter(|frame| frame.key).count(), 3);
    let arguments = "-i clip.mp4 -c copy -bsf:v h264_mp4toannexb -f h264 -";
    let stream = ffmpeg(folder.path(), &arguments.split(' ').collect::<Vec<_>>());
    // FFmpeg puts the parameter sets behind other headers of the frame.
    let others = |stream: &[u8]| -> Vec<Vec<u8>> {
        let mut units = units(stream);
        units.retain(|unit| !PARAMETER_SETS.contains(&kind(unit)));
        units
    };
    assert!(others(&all_data(&coded)) == others(&stream));
}

#[test]
fn frames_that_stand_out_of_order_are_told() {
    let (_folder, path) = made(PATTERN, "clip.mp4", "-c:v libx264 -bf 2");
    assert!(!Video::open(&path).unwrap().is_in_order());
}

#[test]
fn raw_pictures_hold_the_samples_of_the_video() {
    for (pixels, layout, raw) in [
        ("yuv420p", PixelFormat::Nv12, "nv12"),
        ("yuv422p", PixelFormat::Yuyv, "yuyv422"),
        ("gray", PixelFormat::Grey, "gray"),
        ("bgr0", PixelFormat::Rgb24, "rgb24"),
    ] {
        let encoding = format!("-c:v ffv1 -pix_fmt {pixels}");
        let (folder, path) = made(PATTERN, "clip.mkv", &encoding);
        let video = Video::open(&path).unwrap();
        let wanted: Vec<u64> = (0..video.frames().len() as u64).collect();
        let mut found = Vec::new();
        for pending in video.read(&wanted, 1).unwrap() {
            let (is, data) = video.picture(pending).unwrap().raw().unwrap();
            assert_eq!(is, layout, "{pixels}");
            found.extend(data);
        }
        let arguments = format!("-i clip.mkv -pix_fmt {raw} -f rawvideo -");
        let reference = ffmpeg(folder.path(), &arguments.split(' ').collect::<Vec<_>>());
        assert!(found == reference, "{pixels}");
    }
}
