//! Recording a stream to a file: what comes back is what went in, also where the recorder dies.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::fs;
use std::path::Path;
use std::process::Command;

use proptest::prelude::*;
use relit_test_support::{ffmpeg, packets};
use relit_video::{
    BayerPattern, Muxer, PixelFormat, StreamFormat, Video, VideoError, WriteOutcome,
};

fn stream(format: PixelFormat, width: u32, height: u32) -> StreamFormat {
    StreamFormat {
        format,
        width,
        height,
        fps: 30.0,
    }
}

/// The JPEGs of a fixture, which are the packets of its video.
fn jpegs() -> Vec<Vec<u8>> {
    let folder =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/20261120T101500Z-cow-short");
    let bytes = fs::read(folder.join("video.mkv")).unwrap();
    let places = packets(&folder, "video.mkv");
    let found = places.iter().map(|place| {
        let from = (place.at..).find(|&at| bytes[at..].starts_with(&[0xFF, 0xD8]));
        bytes[from.unwrap()..][..place.size].to_vec()
    });
    found.collect()
}

/// Access units of an H.264 stream without B-frames, a key frame every ten.
fn access_units(folder: &Path, frames: u32) -> Vec<Vec<u8>> {
    let source = format!("testsrc2=s=160x120:r=30:d={}", f64::from(frames) / 30.0);
    let arguments = [
        "-f", "lavfi", "-i", &source, "-c:v", "libx264", "-bf", "0", "-g", "10",
    ];
    let more = ["-x264-params", "aud=1:scenecut=0", "-f", "h264", "a.h264"];
    ffmpeg(folder, &[&arguments[..], &more].concat());
    let bytes = fs::read(folder.join("a.h264")).unwrap();
    let delimiter = [0, 0, 0, 1, 9];
    let starts: Vec<usize> = (0..bytes.len())
        .filter(|&at| bytes[at..].starts_with(&delimiter))
        .chain([bytes.len()])
        .collect();
    let units = starts
        .windows(2)
        .map(|pair| bytes[pair[0]..pair[1]].to_vec());
    units.collect()
}

fn noise(length: usize, seed: u64) -> Vec<u8> {
    let mut state = seed | 1;
    (0..length)
        .map(|_| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 56) as u8
        })
        .collect()
}

#[test]
fn jpegs_come_back_byte_for_byte_with_their_times_to_the_millisecond() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("video.mkv");
    let jpegs = jpegs();
    let times: Vec<i64> = (0..jpegs.len() as i64)
        .map(|n| 77_000_123_456 + n * 33_367 + (n % 7) * 911)
        .collect();
    let mut muxer = Muxer::create(&path, stream(PixelFormat::Mjpeg, 480, 360)).unwrap();
    for (jpeg, &t_us) in jpegs.iter().zip(&times) {
        assert_eq!(muxer.write(jpeg, t_us).unwrap(), WriteOutcome::Kept);
    }
    muxer.finish().unwrap();

    let arguments = ["-i", "video.mkv", "-c", "copy", "-f", "rawvideo", "-"];
    assert!(ffmpeg(folder.path(), &arguments) == jpegs.concat());
    let video = Video::open(&path).unwrap();
    assert!(video.damage().is_empty(), "{:?}", video.damage());
    assert_eq!(video.facts().codec, "mjpeg");
    let found: Vec<i64> = video.frames().iter().map(|frame| frame.t_us).collect();
    assert_eq!(found.len(), times.len());
    for (found, &t_us) in found.iter().zip(&times) {
        assert!((found - (t_us - times[0])).abs() <= 500, "{found}");
    }
}

#[test]
fn what_was_synced_is_read_without_the_recorder_having_ended_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("video.mkv");
    let mut muxer = Muxer::create(&path, stream(PixelFormat::Mjpeg, 480, 360)).unwrap();
    for (jpeg, n) in jpegs().iter().zip(0..) {
        muxer.write(jpeg, n * 33_333).unwrap();
        if n % 10 == 9 {
            muxer.sync().unwrap();
            let copy = folder.path().join("copy.mkv");
            fs::copy(&path, &copy).unwrap();
            let video = Video::open(&copy).unwrap();
            assert_eq!(video.frames().len() as i64, n + 1);
            assert!(video.damage().is_empty(), "{:?}", video.damage());
            video.frame(n as u64).unwrap();
        }
    }
}

#[test]
fn without_a_sync_half_a_second_at_most_is_held_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("video.mkv");
    let mut muxer = Muxer::create(&path, stream(PixelFormat::Mjpeg, 480, 360)).unwrap();
    for (jpeg, n) in jpegs().iter().zip(0..) {
        muxer.write(jpeg, n * 33_333).unwrap();
        let held = n + 1 - frames_in(&path);
        // A cluster of 0.4 s, and some small frames that do not fill the buffer.
        assert!(held <= 17, "{held} of {n}");
    }
}

fn frames_in(path: &Path) -> i64 {
    Video::open(path).map_or(0, |video| video.frames().len() as i64)
}

#[test]
fn h264_begins_at_a_key_frame_and_decodes_to_the_same_pictures() {
    let folder = tempfile::tempdir().unwrap();
    let units = access_units(folder.path(), 45);
    assert_eq!(units.len(), 45);
    let path = folder.path().join("video.mkv");
    let mut muxer = Muxer::create(&path, stream(PixelFormat::H264, 160, 120)).unwrap();
    let written: Vec<WriteOutcome> = (0..)
        .zip(&units)
        .skip(3)
        .map(|(n, unit)| muxer.write(unit, n * 33_333).unwrap())
        .collect();
    muxer.finish().unwrap();
    let left_out = written
        .iter()
        .filter(|&&w| w == WriteOutcome::BeforeKeyFrame)
        .count();
    assert_eq!(left_out, 7);

    let video = Video::open(&path).unwrap();
    assert_eq!(
        (video.facts().codec.as_str(), video.frames().len()),
        ("h264", 35)
    );
    assert!(video.damage().is_empty(), "{:?}", video.damage());
    let hash = |name: &str, skip: usize| {
        let filter = format!("select=gte(n\\,{skip})");
        let arguments = ["-i", name, "-vf", &filter, "-fps_mode", "passthrough"];
        ffmpeg(
            folder.path(),
            &[&arguments[..], &["-f", "md5", "-"]].concat(),
        )
    };
    assert_eq!(hash("video.mkv", 0), hash("a.h264", 10));
}

#[test]
fn h264_without_start_codes_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("video.mkv");
    let mut muxer = Muxer::create(&path, stream(PixelFormat::H264, 160, 120)).unwrap();
    let refused = muxer.write(&[0, 0, 0, 9, 0x65, 1, 2, 3], 0);
    let Err(VideoError::Refused(text)) = refused else {
        panic!("{refused:?}");
    };
    assert!(text.contains("H.264"), "{text}");
}

/// The name of the planar format that holds the same values, and a picture's planes in a row.
fn planar(raw: PixelFormat, picture: &[u8], pixels: usize) -> (&'static str, Vec<u8>) {
    let every = |bytes: &[u8], first: usize, step: usize| -> Vec<u8> {
        bytes.iter().copied().skip(first).step_by(step).collect()
    };
    match raw {
        PixelFormat::Grey | PixelFormat::Bayer(_) => ("gray", picture.to_vec()),
        PixelFormat::Rgb24 => ("rgb24", picture.to_vec()),
        PixelFormat::Yuyv => {
            let planes = [(0, 2), (1, 4), (3, 4)].map(|(first, step)| every(picture, first, step));
            ("yuv422p", planes.concat())
        }
        PixelFormat::Nv12 => {
            let (luma, colour) = picture.split_at(pixels);
            let planes = [luma.to_vec(), every(colour, 0, 2), every(colour, 1, 2)];
            ("yuv420p", planes.concat())
        }
        PixelFormat::Mjpeg | PixelFormat::H264 => panic!("{raw:?} is compressed"),
    }
}

/// Records pictures of noise and compares them with what FFmpeg's own program decodes.
fn there_and_back(raw: PixelFormat, size: (u32, u32), seed: u64) {
    let folder = tempfile::tempdir().unwrap();
    let (width, height) = size;
    let path = folder.path().join("video.mkv");
    let bytes = raw.frame_bytes(width, height).unwrap();
    let pictures: Vec<Vec<u8>> = (0..4).map(|n| noise(bytes, seed + n)).collect();
    let mut muxer = Muxer::create(&path, stream(raw, width, height)).unwrap();
    for (picture, n) in pictures.iter().zip(0..) {
        assert_eq!(
            muxer.write(picture, n * 40_000).unwrap(),
            WriteOutcome::Kept
        );
    }
    muxer.finish().unwrap();
    let mut wanted = Vec::new();
    let mut pixel_format = "";
    for picture in &pictures {
        let (name, planes) = planar(raw, picture, (width * height) as usize);
        pixel_format = name;
        wanted.extend(planes);
    }
    let arguments = [
        "-i",
        "video.mkv",
        "-fps_mode",
        "passthrough",
        "-f",
        "rawvideo",
        "-pix_fmt",
    ];
    let back = ffmpeg(
        folder.path(),
        &[&arguments[..], &[pixel_format, "-"]].concat(),
    );
    assert!(back == wanted, "{raw:?} {width} x {height}");
    let video = Video::open(&path).unwrap();
    assert_eq!(
        (video.facts().codec.as_str(), video.frames().len()),
        ("ffv1", 4)
    );
    assert!(video.damage().is_empty() && video.notes().is_empty());
    assert!(video.frame(3).is_ok());
}

#[test]
fn uncompressed_pictures_come_back_bit_for_bit() {
    // Widths that fill no row of FFmpeg's alignment.
    let formats = [
        (PixelFormat::Yuyv, (162, 91)),
        (PixelFormat::Nv12, (162, 90)),
        (PixelFormat::Rgb24, (161, 91)),
        (PixelFormat::Grey, (161, 91)),
        (PixelFormat::Bayer(BayerPattern::Grbg), (162, 90)),
    ];
    for (raw, size) in formats {
        there_and_back(raw, size, 7);
    }
}

#[test]
fn every_slice_of_ffv1_is_checked_by_its_checksum() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("video.mkv");
    let format = stream(PixelFormat::Grey, 160, 120);
    let mut muxer = Muxer::create(&path, format).unwrap();
    for n in 0..5 {
        muxer
            .write(&noise(160 * 120, n), n as i64 * 33_333)
            .unwrap();
    }
    muxer.finish().unwrap();
    let mut bytes = fs::read(&path).unwrap();
    let places = packets(folder.path(), "video.mkv");
    bytes[places[2].at + places[2].size / 3] ^= 0x10;
    fs::write(&path, bytes).unwrap();
    let video = Video::open(&path).unwrap();
    assert_eq!(video.damage().len(), 1, "{:?}", video.damage());
    assert!(
        video.damage()[0].contains("frame 2"),
        "{:?}",
        video.damage()
    );
}

#[test]
fn a_picture_of_another_size_is_refused_and_the_next_may_follow() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("video.mkv");
    let format = stream(PixelFormat::Yuyv, 64, 48);
    let mut muxer = Muxer::create(&path, format).unwrap();
    let refused = muxer.write(&noise(100, 1), 0);
    let Err(VideoError::Refused(text)) = refused else {
        panic!("{refused:?}");
    };
    assert!(text.contains("100") && text.contains("6144"), "{text}");
    muxer.write(&noise(6144, 1), 33_333).unwrap();
    muxer.finish().unwrap();
    assert_eq!(Video::open(&path).unwrap().frames().len(), 1);
    let odd = Muxer::create(
        &folder.path().join("odd.mkv"),
        stream(format.format, 63, 48),
    );
    let Err(VideoError::Refused(text)) = odd else {
        panic!("{odd:?}");
    };
    assert!(text.contains("63 x 48"), "{text}");
}

#[test]
fn a_file_is_never_written_over() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("video.mkv");
    fs::write(&path, b"precious").unwrap();
    let refused = Muxer::create(&path, stream(PixelFormat::Mjpeg, 64, 48));
    assert!(matches!(refused, Err(VideoError::Write { .. })));
    assert_eq!(fs::read(&path).unwrap(), b"precious");
}

/// Runs under a limit on file sizes: see the test below.
#[test]
#[ignore = "run by a_full_disk_is_told_with_folder_and_missing_bytes"]
fn child_that_writes_into_a_limit() {
    let path = std::env::var("RELIT_TEST_FILE").unwrap();
    let format = stream(PixelFormat::Mjpeg, 480, 360);
    let mut muxer = Muxer::create(Path::new(&path), format).unwrap();
    let jpegs = jpegs();
    let error = (0..1000)
        .find_map(|n| {
            let jpeg = &jpegs[n as usize % jpegs.len()];
            muxer.write(jpeg, n * 33_333).err()
        })
        .expect("the limit is reached");
    let VideoError::DiskFull { missing, .. } = error else {
        panic!("{error}");
    };
    assert!(missing > 0);
    println!("TOLD {error}");
    assert!(muxer.write(&jpegs[0], i64::from(u32::MAX)).is_err());
}

#[test]
fn a_full_disk_is_told_with_folder_and_missing_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("video.mkv");
    let script = r#"trap '' XFSZ; ulimit -f 1024; exec "$0" --ignored --exact --nocapture child_that_writes_into_a_limit"#;
    let output = Command::new("sh")
        .arg("-c")
        .arg(script)
        .arg(std::env::current_exe().unwrap())
        .env("RELIT_TEST_FILE", &path)
        .output()
        .unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{text}");
    let told = text.lines().find(|line| line.starts_with("TOLD")).unwrap();
    assert!(told.contains(folder.path().to_str().unwrap()), "{told}");
    // What fitted is there, and readable.
    assert!(frames_in(&path) > 10);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn any_size_of_any_uncompressed_format_comes_back(
        which in 0_usize..5, width in 8_u32..70, height in 8_u32..50, seed in any::<u64>(),
    ) {
        let raw = [
            PixelFormat::Yuyv,
            PixelFormat::Nv12,
            PixelFormat::Rgb24,
            PixelFormat::Grey,
            PixelFormat::Bayer(BayerPattern::Rggb),
        ][which];
        let even = |value: u32| value & !1;
        let size = if which < 2 { (even(width), even(height)) } else { (width, height) };
        there_and_back(raw, size, seed >> 8);
    }
}
