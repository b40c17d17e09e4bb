//! Codecs and containers against the `ffmpeg` program: the same pictures, in the same order, at the same times, and no loss
//! where nothing is lost.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod numbered;
mod paff;

use std::collections::HashSet;
use std::fs;
use std::path::Path;
use std::process::Command;
use std::sync::Mutex;
use std::thread;

use relit_data::geometry::Rect;
use relit_test_support::ffmpeg;
use relit_video::{PixelFormat, Video};

use numbered::{HEIGHT, Planes, WIDTH, number_of};

/// Frames of each recording.
const FRAMES: u64 = 40;

/// A recording, by the arguments of `ffmpeg` and the name of its file.
struct Case {
    file: &'static str,
    encoding: &'static str,
}

const fn case(file: &'static str, encoding: &'static str) -> Case {
    Case { file, encoding }
}

const CASES: &[Case] = &[
    // Frames that stand alone.
    case("a.mkv", "-c:v mjpeg -q:v 2 -pix_fmt yuvj420p"),
    case("a.avi", "-c:v mjpeg -q:v 2 -pix_fmt yuvj422p"),
    case("a.mov", "-c:v mjpeg -q:v 2 -pix_fmt yuvj444p"),
    case("a.mkv", "-c:v ffv1 -level 3"),
    case("a.avi", "-c:v huffyuv -pix_fmt yuv422p"),
    case("a.avi", "-c:v utvideo"),
    case("a.mov", "-c:v prores_ks -pix_fmt yuv422p10le"),
    case("a.mov", "-c:v png -pix_fmt rgb24"),
    case("a.mkv", "-c:v jpeg2000"),
    case("a.avi", "-c:v rawvideo"),
    case("a.nut", "-c:v rawvideo"),
    // H.264: B-frames and pyramids, intra refresh, open groups, interlaced.
    case("a.mp4", "-c:v libx264 -preset ultrafast -g 12"),
    case("a.mkv", "-c:v libx264 -bf 3 -g 15"),
    case(
        "a.mp4",
        "-c:v libx264 -bf 3 -g 15 -x264-params b-pyramid=normal:open-gop=1",
    ),
    case(
        "a.ts",
        "-c:v libx264 -bf 3 -g 15 -x264-params open-gop=1:b-pyramid=strict",
    ),
    case(
        "a.mkv",
        "-c:v libx264 -g 12 -bf 0 -x264-params intra-refresh=1",
    ),
    case(
        "a.ts",
        "-c:v libx264 -g 12 -bf 0 -x264-params intra-refresh=1",
    ),
    case("a.flv", "-c:v libx264 -bf 2 -g 10"),
    case("a.avi", "-c:v libx264 -bf 2 -g 10"),
    case("a.h264", "-c:v libx264 -bf 2 -g 10"),
    case(
        "a.mts",
        "-c:v libx264 -flags +ildct+ilme -bf 2 -g 10 -f mpegts",
    ),
    case("a.mp4", "-c:v libx264 -flags +ildct+ilme -g 10"),
    case(
        "a.mp4",
        "-c:v libx264 -g 10 -movflags +frag_keyframe+empty_moov",
    ),
    case("a.mov", "-c:v libx264 -bf 2 -pix_fmt yuv422p10le"),
    case("a.3gp", "-c:v libx264 -bf 0"),
    // HEVC.
    case(
        "a.mp4",
        "-c:v libx265 -preset ultrafast -x265-params log-level=none:keyint=15:bframes=3",
    ),
    case(
        "a.ts",
        "-c:v libx265 -preset ultrafast -x265-params log-level=none:keyint=15:open-gop=1",
    ),
    case(
        "a.mkv",
        "-c:v libx265 -preset ultrafast -pix_fmt yuv420p10le -x265-params log-level=none",
    ),
    // MPEG-1, MPEG-2 and MPEG-4.
    case("a.mpg", "-c:v mpeg1video -bf 2 -g 9"),
    case("a.mpg", "-c:v mpeg2video -bf 2 -g 9 -f vob"),
    case("a.ts", "-c:v mpeg2video -bf 2 -g 9 -flags +ildct+ilme"),
    case("a.mkv", "-c:v mpeg2video -bf 2 -g 9"),
    case("a.m2v", "-c:v mpeg2video -bf 2 -g 9"),
    case("a.avi", "-c:v mpeg4 -bf 2 -g 9"),
    case("a.mp4", "-c:v mpeg4 -bf 2 -g 9"),
    case("a.avi", "-c:v libxvid -bf 2 -g 9"),
    case("a.avi", "-c:v msmpeg4 -g 9"),
    case("a.avi", "-c:v h263p -g 9"),
    case("a.wmv", "-c:v wmv2 -g 9"),
    case("a.flv", "-c:v flv -g 9"),
    case("a.rm", "-c:v rv20 -g 9"),
    // VP8, VP9, AV1, Theora.
    case(
        "a.webm",
        "-c:v libvpx -b:v 60k -auto-alt-ref 1 -lag-in-frames 12 -g 20 -deadline good -cpu-used 4",
    ),
    case(
        "a.webm",
        "-c:v libvpx-vp9 -b:v 60k -auto-alt-ref 1 -lag-in-frames 12 -g 20 -deadline good -cpu-used 5",
    ),
    case(
        "a.mkv",
        "-c:v libvpx-vp9 -b:v 60k -lag-in-frames 12 -g 20 -cpu-used 5 -bsf:v vp9_superframe_split",
    ),
    case(
        "a.ivf",
        "-c:v libvpx-vp9 -b:v 60k -lag-in-frames 12 -cpu-used 5",
    ),
    case(
        "a.webm",
        "-c:v libaom-av1 -cpu-used 8 -b:v 60k -lag-in-frames 12",
    ),
    case("a.mp4", "-c:v libsvtav1 -preset 12"),
    case("a.ogv", "-c:v libtheora -q:v 7 -g 9"),
    // Others.
    case(
        "a.gif",
        "-filter_complex split[a][b];[a]palettegen[p];[b][p]paletteuse",
    ),
    case("a.avi", "-c:v cinepak -pix_fmt rgb24"),
    case("a.mov", "-c:v qtrle -pix_fmt rgb24"),
    case("a.mov", "-c:v svq1"),
    case("a.nut", "-c:v snow -strict -2"),
    // Sound that is longer, times that begin below 0 or late, and uneven ones.
    case("a.mp4", "-f lavfi -i sine=duration=6 -c:v libx264 -c:a aac"),
    case(
        "a.mkv",
        "-f lavfi -i sine=duration=6 -c:v mjpeg -q:v 2 -pix_fmt yuvj420p -c:a aac",
    ),
    case(
        "a.avi",
        "-f lavfi -i sine=duration=6 -c:v mpeg4 -c:a pcm_s16le",
    ),
    case("a.ts", "-c:v libx264 -bf 2 -output_ts_offset -0.7"),
    case("a.ts", "-c:v mpeg2video -q:v 2 -output_ts_offset 7000"),
    case(
        "a.mkv",
        "-c:v libx264 -bf 2 -vf setpts=(N+N*N/20)/25/TB -fps_mode passthrough",
    ),
];

/// A file that is made of another one.
struct Derived {
    from: &'static str,
    encoding: &'static str,
    file: &'static str,
    change: Change,
}

enum Change {
    /// By further arguments of `ffmpeg`.
    Ffmpeg(&'static str, &'static str),
    /// By its bytes.
    Bytes(fn(Vec<u8>) -> Vec<u8>),
}

const TS_PACKET: usize = 188;

const DERIVED: &[Derived] = &[
    Derived {
        from: "a.mp4",
        encoding: "-c:v libx264 -bf 2 -g 10",
        file: "trimmed.mp4",
        change: Change::Ffmpeg("-ss 0.6", "-t 0.5 -c copy"),
    },
    Derived {
        from: "a.mp4",
        encoding: "-c:v libx264 -bf 3 -g 10 -x264-params open-gop=1",
        file: "trimmed.mov",
        change: Change::Ffmpeg("-ss 0.68", "-c copy"),
    },
    Derived {
        from: "a.mp4",
        encoding: "-c:v mjpeg -q:v 2 -pix_fmt yuvj420p",
        file: "trimmed.mov",
        change: Change::Ffmpeg("-ss 0.28", "-t 0.6 -c copy"),
    },
    Derived {
        from: "a.ts",
        encoding: "-c:v libx264 -bf 2 -g 10",
        file: "remuxed.mkv",
        change: Change::Ffmpeg("", "-c copy"),
    },
    Derived {
        from: "a.ts",
        encoding: "-c:v libx264 -bf 2 -g 10",
        file: "joined.ts",
        change: Change::Bytes(|ts| ts.repeat(2)),
    },
    Derived {
        from: "a.ts",
        encoding: "-c:v mpeg2video -q:v 2 -bf 2 -g 9",
        file: "joined.ts",
        change: Change::Bytes(|ts| ts.repeat(3)),
    },
    Derived {
        from: "a.ts",
        encoding: "-c:v libx265 -preset ultrafast -x265-params log-level=none:keyint=10",
        file: "joined.ts",
        change: Change::Bytes(|ts| ts.repeat(2)),
    },
    Derived {
        from: "a.m2v",
        encoding: "-c:v mpeg2video -q:v 2 -bf 2 -g 9",
        file: "joined.m2v",
        change: Change::Bytes(|stream| stream.repeat(2)),
    },
    // The beginning is missing: decoding begins at the next key frame or recovery point.
    Derived {
        from: "a.ts",
        encoding: "-c:v libx264 -bf 2 -g 10",
        file: "late.ts",
        change: Change::Bytes(|ts| ts[ts.len() / 3 / TS_PACKET * TS_PACKET..].to_vec()),
    },
    Derived {
        from: "a.ts",
        encoding: "-c:v libx264 -bf 3 -g 10 -x264-params open-gop=1",
        file: "late.ts",
        change: Change::Bytes(|ts| ts[ts.len() / 3 / TS_PACKET * TS_PACKET..].to_vec()),
    },
    Derived {
        from: "a.ts",
        encoding: "-c:v libx264 -bf 0 -g 10 -x264-params intra-refresh=1",
        file: "late.ts",
        change: Change::Bytes(|ts| ts[ts.len() / 3 / TS_PACKET * TS_PACKET..].to_vec()),
    },
    Derived {
        from: "a.ts",
        encoding: "-c:v mpeg2video -q:v 2 -bf 2 -g 9",
        file: "late.ts",
        change: Change::Bytes(|ts| ts[ts.len() / 3 / TS_PACKET * TS_PACKET..].to_vec()),
    },
    Derived {
        from: "a.ts",
        encoding: "-c:v libx265 -preset ultrafast -x265-params log-level=none:keyint=10:open-gop=1",
        file: "late.ts",
        change: Change::Bytes(|ts| ts[ts.len() / 3 / TS_PACKET * TS_PACKET..].to_vec()),
    },
    // The picture is not coded again: the last one stays.
    Derived {
        from: "a.m4v",
        encoding: "-c:v mpeg4 -g 20 -bf 0",
        file: "repeated.m4v",
        change: Change::Bytes(with_repeated_pictures),
    },
];

/// Every third predicted picture of an MPEG-4 stream of 25 frames a second says that nothing is coded (ISO/IEC 14496-2,
/// 6.2.5: the type, ones for seconds and a 0, a marker, 5 bits of time, a marker, `vop_coded`).
fn with_repeated_pictures(mut stream: Vec<u8>) -> Vec<u8> {
    let starts: Vec<usize> = (0..stream.len() - 8)
        .filter(|&at| stream[at..].starts_with(&[0, 0, 1, 0xb6]))
        .collect();
    assert_eq!(starts.len() as u64, FRAMES);
    for at in starts.into_iter().skip(1).step_by(3).map(|at| at + 4) {
        let predicted = stream[at] >> 6 == 1;
        let seconds = (stream[at] << 2).leading_ones() as usize;
        if predicted {
            let bit = 2 + seconds + 1 + 1 + 5 + 1;
            stream[at + bit / 8] &= !(0x80 >> (bit % 8));
        }
    }
    stream
}

/// What the ffmpeg program shows of a file.
struct Reference {
    numbers: Vec<u64>,
    luma: Vec<Vec<u8>>,
    /// Seconds; `None` if the program knows none.
    times: Vec<Option<f64>>,
}

fn reference(folder: &Path, file: &str) -> Reference {
    let arguments =
        format!("-i {file} -map 0:v:0 -fps_mode passthrough -pix_fmt gray -f rawvideo -");
    // The luma as it is stored: grey of YUV would else be expanded.
    let arguments = arguments.replace("-pix_fmt gray", "-vf extractplanes=y");
    let (width, height) = dimensions(folder, file);
    let planes = |arguments: &str| ffmpeg(folder, &arguments.split(' ').collect::<Vec<_>>());
    let rgb = is_rgb(folder, file);
    let raw = if rgb {
        planes(&arguments.replace("extractplanes=y", "format=gray"))
    } else {
        planes(&arguments)
    };
    let depth = if raw.len() % (2 * width * height) == 0 && is_deep(folder, file) {
        2
    } else {
        1
    };
    let frames = raw.chunks_exact(depth * width * height);
    let luma: Vec<Vec<u8>> = frames
        .map(|frame| match depth {
            2 => frame
                .chunks_exact(2)
                .map(|s| (u16::from_le_bytes([s[0], s[1]]) >> 2) as u8)
                .collect(),
            _ => frame.to_vec(),
        })
        .collect();
    let numbers = luma
        .iter()
        .map(|luma| number_of(|x, y| luma[y * width + x]))
        .collect();
    let times = probe(folder, file, "frame=best_effort_timestamp_time");
    Reference {
        numbers,
        luma,
        times: times
            .lines()
            .filter(|line| !line.trim().is_empty())
            .map(|line| line.trim_end_matches(',').parse().ok())
            .collect(),
    }
}

fn probe(folder: &Path, file: &str, entries: &str) -> String {
    let output = Command::new("ffprobe")
        .args(["-v", "error", "-select_streams", "v:0", "-of", "csv=p=0"])
        .args(["-show_entries", entries, file])
        .current_dir(folder)
        .output()
        .expect("ffprobe comes with the ffmpeg program: run `make setup`");
    String::from_utf8(output.stdout).unwrap()
}

fn pixel_format(folder: &Path, file: &str) -> String {
    probe(folder, file, "stream=pix_fmt")
}

fn is_rgb(folder: &Path, file: &str) -> bool {
    let format = pixel_format(folder, file);
    ["rgb", "bgr", "pal8", "gbr"]
        .iter()
        .any(|part| format.contains(part))
}

fn is_deep(folder: &Path, file: &str) -> bool {
    pixel_format(folder, file).contains("10le")
}

fn dimensions(folder: &Path, file: &str) -> (usize, usize) {
    let text = probe(folder, file, "stream=width,height");
    let mut numbers = text
        .lines()
        .next()
        .unwrap()
        .split(',')
        .map(|n| n.trim().parse().unwrap());
    (numbers.next().unwrap(), numbers.next().unwrap())
}

/// What is wrong with how a file is read; empty if nothing is.
fn faults(folder: &Path, file: &str) -> Vec<String> {
    let wanted = reference(folder, file);
    let mut faults = Vec::new();
    let video = match Video::open(&folder.join(file)) {
        Ok(video) => video,
        Err(error) => return vec![error.to_string()],
    };
    faults.extend(
        video
            .damage()
            .iter()
            .map(|damage| format!("damage: {damage}")),
    );
    let count = video.frames().len();
    if count != wanted.numbers.len() || count != wanted.times.len() {
        faults.push(format!(
            "{count} frames, ffmpeg has {} and ffprobe {}",
            wanted.numbers.len(),
            wanted.times.len()
        ));
    }
    let all: Vec<u64> = (0..count as u64).collect();
    let mut numbers = vec![None; count];
    for threads in [1, 3] {
        for pending in video.read(&all, threads).unwrap() {
            let at = pending.number() as usize;
            let picture = match video.picture(pending) {
                Ok(picture) => picture,
                Err(fault) => {
                    faults.push(format!("frame {at}: {fault}"));
                    continue;
                }
            };
            let (width, height) = picture.size();
            let rgb = picture.rgb(Rect::new(0, 0, width, height)).unwrap();
            numbers[at] = Some(number_of(|x, y| rgb.get_pixel(x as u32, y as u32).0[1]));
            let exact = picture
                .raw()
                .ok()
                .filter(|(format, _)| *format == PixelFormat::Nv12);
            if let (Some((_, raw)), Some(luma)) = (exact, wanted.luma.get(at))
                && raw[..luma.len()] != luma[..]
            {
                faults.push(format!("frame {at} has other luma than ffmpeg's"));
            }
        }
    }
    let wanted_numbers: Vec<Option<u64>> = wanted.numbers.iter().copied().map(Some).collect();
    if numbers != wanted_numbers {
        faults.push(format!("pictures {numbers:?}, ffmpeg's {wanted_numbers:?}"));
    }
    // Any frame is found by itself, too.
    for at in [0, count / 2, count - 1] {
        let found = video.frame(at as u64);
        let shown = found.map(|rgb| number_of(|x, y| rgb.get_pixel(x as u32, y as u32).0[1]));
        if shown.as_ref().ok() != wanted.numbers.get(at) {
            faults.push(format!("frame {at} alone shows {shown:?}"));
        }
    }
    if !video
        .frames()
        .windows(2)
        .all(|pair| pair[0].t_us < pair[1].t_us)
    {
        faults.push("the times do not rise".to_owned());
    }
    // Of joined files and AVI with frames out of order, FFmpeg has no times of their own.
    if !file.starts_with("joined") && !file.ends_with(".avi") {
        let times = video.frames().iter().zip(&wanted.times);
        let off =
            times.filter_map(|(frame, time)| Some((frame.t_us as f64 / 1e6 - (*time)?).abs()));
        let worst = off.fold(0.0, f64::max);
        if worst > 0.002 {
            faults.push(format!("times are off by {worst} s"));
        }
    }
    faults
}

/// The encoders that the installed program has.
fn encoders() -> HashSet<String> {
    let output = Command::new("ffmpeg")
        .args(["-hide_banner", "-encoders"])
        .output();
    let output =
        output.expect("the tests make their videos with the ffmpeg program: run `make setup`");
    let text = String::from_utf8(output.stdout).unwrap();
    let names = text
        .lines()
        .filter_map(|line| line.split_whitespace().nth(1));
    names.map(str::to_owned).collect()
}

fn is_possible(encoding: &str, encoders: &HashSet<String>) -> bool {
    let mut words = encoding.split_whitespace();
    let named = words
        .by_ref()
        .find(|word| *word == "-c:v")
        .and_then(|_| words.next());
    named.is_none_or(|name| encoders.contains(name))
}

fn encode(folder: &Path, encoding: &str, file: &str) {
    let mut source = Vec::new();
    for number in 0..FRAMES {
        source.extend(Planes::numbered(number).bytes());
    }
    fs::write(folder.join("source.yuv"), source).unwrap();
    let size = format!("{WIDTH}x{HEIGHT}");
    let mut arguments = vec![
        "-f",
        "rawvideo",
        "-pix_fmt",
        "yuv420p",
        "-video_size",
        &size,
    ];
    arguments.extend(["-framerate", "25", "-i", "source.yuv"]);
    arguments.extend(encoding.split_whitespace());
    arguments.push(file);
    ffmpeg(folder, &arguments);
}

/// Makes a file and reads it; what is wrong.
type Task = Box<dyn Fn(&Path) -> Vec<String> + Send + Sync>;

fn tasks() -> Vec<(String, Task)> {
    let encoders = encoders();
    let mut tasks: Vec<(String, Task)> = Vec::new();
    for case in CASES
        .iter()
        .filter(|case| is_possible(case.encoding, &encoders))
    {
        let name = format!("{} {}", case.encoding, case.file);
        let task = |folder: &Path| {
            encode(folder, case.encoding, case.file);
            faults(folder, case.file)
        };
        tasks.push((name, Box::new(task)));
    }
    for derived in DERIVED
        .iter()
        .filter(|derived| is_possible(derived.encoding, &encoders))
    {
        let name = format!("{} {} {}", derived.encoding, derived.from, derived.file);
        let task = |folder: &Path| {
            encode(folder, derived.encoding, derived.from);
            match derived.change {
                Change::Ffmpeg(before, after) => {
                    let words = |text: &'static str| text.split_whitespace();
                    let mut arguments: Vec<&str> = words(before).collect();
                    arguments.extend(["-i", derived.from]);
                    arguments.extend(words(after));
                    arguments.push(derived.file);
                    ffmpeg(folder, &arguments);
                }
                Change::Bytes(change) => {
                    let bytes = fs::read(folder.join(derived.from)).unwrap();
                    fs::write(folder.join(derived.file), change(bytes)).unwrap();
                }
            }
            faults(folder, derived.file)
        };
        tasks.push((name, Box::new(task)));
    }
    for file in [
        "fields.ts",
        "fields.mts",
        "fields.mp4",
        "fields.mkv",
        "fields.h264",
    ] {
        let task = move |folder: &Path| {
            fs::write(folder.join("source.h264"), paff::stream(FRAMES)).unwrap();
            let mut arguments = vec!["-r", "25", "-i", "source.h264", "-c", "copy"];
            if file.ends_with(".mts") {
                arguments.extend(["-f", "mpegts"]);
            }
            arguments.push(file);
            ffmpeg(folder, &arguments);
            faults(folder, file)
        };
        tasks.push((format!("field pictures {file}"), Box::new(task)));
    }
    tasks
}

#[test]
fn each_codec_and_container_gives_the_pictures_of_the_ffmpeg_program() {
    let tasks = tasks();
    assert!(tasks.len() >= 30, "only {} can be tried", tasks.len());
    let next = Mutex::new(tasks.iter());
    let wrong = Mutex::new(Vec::new());
    thread::scope(|scope| {
        for _ in 0..thread::available_parallelism().map_or(1, std::num::NonZero::get) {
            scope.spawn(|| {
                loop {
                    let Some((name, task)) = next.lock().unwrap().next() else {
                        return;
                    };
                    let folder = tempfile::tempdir().unwrap();
                    let faults = task(folder.path());
                    if !faults.is_empty() {
                        let faults = faults.join("\n    ");
                        wrong.lock().unwrap().push(format!("{name}:\n    {faults}"));
                    }
                }
            });
        }
    });
    let wrong = wrong.into_inner().unwrap();
    assert!(
        wrong.is_empty(),
        "{} of {}:\n{}",
        wrong.len(),
        tasks.len(),
        wrong.join("\n")
    );
}
