//! Recording turns with a camera that does as the test says, and salvaging what was killed.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout
)]

mod support;

use std::collections::BTreeMap;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use relit::extract::{self, Observer, Options, Outcome};
use relit_data::session::{
    CameraFacts, FrameClock, Manifest, Recording, SoftwareFacts, Status, TurntableFacts, VideoFacts,
};
use relit_data::shard::{Layout, Size};
use relit_rig::camera::{
    Camera, CameraAddress, CameraError, Control, ControlId, DeviceInfo, Fourcc, Frame, GrantedMode,
    Mode, ModeRequest, Rate, Sequence, StampSource, open,
};
use relit_rig::capture::{
    End, Plan, Recorder, Report, Stage, Take, WhenFull, Window, salvage, salvage_session,
};
use relit_rig::clock::Clock;
use relit_video::Video;

/// What the camera of a test does next.
enum Step {
    Frame(Box<Frame>),
    /// No frame comes any more.
    Silence,
    Fail(fn() -> CameraError),
}

/// A camera that does as it is told.
struct Scripted {
    info: DeviceInfo,
    steps: Box<dyn Iterator<Item = Step> + Send>,
    /// Frames come when their time stamps are due, not at once.
    clock: Option<Clock>,
    silent: bool,
}

impl Scripted {
    fn new(steps: impl Iterator<Item = Step> + Send + 'static) -> Box<Self> {
        Box::new(Self {
            info: DeviceInfo {
                address: "v4l2:/dev/video0".parse().unwrap(),
                name: "scripted".to_owned(),
                driver: "none".to_owned(),
                bus: String::new(),
                modes: Vec::new(),
                other_formats: Vec::new(),
                problems: Vec::new(),
            },
            steps: Box::new(steps),
            clock: None,
            silent: false,
        })
    }
}

impl Camera for Scripted {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn modes(&mut self) -> Result<Vec<Mode>, CameraError> {
        Ok(Vec::new())
    }

    fn controls(&mut self) -> Result<Vec<Control>, CameraError> {
        Ok(Vec::new())
    }

    fn set_control(&mut self, _: ControlId, value: i64) -> Result<i64, CameraError> {
        Ok(value)
    }

    fn start(&mut self, want: &ModeRequest) -> Result<GrantedMode, CameraError> {
        Ok(GrantedMode {
            fourcc: want.fourcc,
            width: want.width,
            height: want.height,
            rate: Some(want.rate),
        })
    }

    fn next_frame(&mut self, timeout: Duration) -> Result<Frame, CameraError> {
        let step = if self.silent { None } else { self.steps.next() };
        match step {
            Some(Step::Frame(frame)) => {
                if let Some(clock) = self.clock {
                    let early = frame.t_us - clock.now_us();
                    thread::sleep(Duration::from_micros(early.max(0) as u64));
                }
                Ok(*frame)
            }
            Some(Step::Fail(error)) => Err(error()),
            Some(Step::Silence) => {
                self.silent = true;
                self.next_frame(timeout)
            }
            None if self.silent => {
                thread::sleep(timeout);
                Err(CameraError::Timeout {
                    device: "scripted".to_owned(),
                    waited: timeout,
                })
            }
            None => Err(CameraError::EndOfRecording {
                path: PathBuf::from("script"),
                frames: 0,
            }),
        }
    }

    fn stop(&mut self) -> Result<(), CameraError> {
        Ok(())
    }
}

const PERIOD_US: i64 = 33_333;
const SIZE: (u32, u32) = (480, 360);

/// The JPEGs of a fixture, which are the packets of its video.
fn jpegs() -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/20261120T101500Z-cow-short");
    let bytes = fs::read(folder.join("video.mkv")).unwrap();
    let places = support::packets(&folder, "video.mkv");
    let found = places.iter().map(|place| {
        let from = (place.at..).find(|&at| bytes[at..].starts_with(&[0xFF, 0xD8]));
        bytes[from.unwrap()..][..place.size].to_vec()
    });
    found.collect()
}

/// The stream of a camera without faults: frame n at `begun + n` periods.
fn stream(frames: u64, begun: i64) -> impl Iterator<Item = Frame> + Send {
    let jpegs = jpegs();
    (0..frames).map(move |n| Frame {
        fourcc: Fourcc::MJPG,
        width: SIZE.0,
        height: SIZE.1,
        data: jpegs[n as usize % jpegs.len()].clone(),
        sequence: Some(Sequence {
            raw: n as u32,
            unwrapped: n,
        }),
        t_us: begun + n as i64 * PERIOD_US,
        stamp: StampSource::EndOfFrame,
        flagged: false,
    })
}

fn steps(frames: impl Iterator<Item = Frame> + Send) -> impl Iterator<Item = Step> + Send {
    frames.map(|frame| Step::Frame(Box::new(frame)))
}

/// From frame 10 on, for this many frames.
fn turn(frames: i64, begun: i64) -> Window {
    let from = begun + 10 * PERIOD_US - PERIOD_US / 2;
    Window::new(from, from + frames * PERIOD_US).unwrap()
}

fn manifest(id: &str) -> Manifest {
    Manifest {
        id: id.to_owned(),
        object: "cow".to_owned(),
        created: "2026-11-20T09:30:15Z".parse().unwrap(),
        status: Status::Recording,
        camera: CameraFacts {
            backend: "replay".to_owned(),
            device: "script".to_owned(),
            name: "scripted".to_owned(),
            fourcc: String::new(),
            width: 0,
            height: 0,
            fps: 30.0,
            clock: FrameClock::default(),
            controls: BTreeMap::new(),
        },
        turntable: Some(TurntableFacts {
            port: "sim:".to_owned(),
            firmware: "simulated".to_owned(),
            degrees_per_second: 72.0,
            steps_per_degree: 88.889,
        }),
        video: VideoFacts {
            file: String::new(),
            codec: String::new(),
            frames: None,
            bytes: None,
            blake3: None,
        },
        faults: Vec::new(),
        software: SoftwareFacts {
            version: "1".to_owned(),
            commit: String::new(),
        },
    }
}

fn plan(root: &Path, max_dropped: u64) -> Plan {
    Plan {
        root: root.to_owned(),
        manifest: manifest("20261120T093015Z-cow"),
        mode: GrantedMode {
            fourcc: Fourcc::MJPG,
            width: SIZE.0,
            height: SIZE.1,
            rate: Rate::new(30, 1),
        },
        fps: 30.0,
        window: None,
        max_dropped,
        when_full: WhenFull::Drop,
        stall: Duration::from_millis(400),
    }
}

/// Records a turn of 120 frames; angle 3 degrees a frame.
fn record(
    root: &Path,
    max_dropped: u64,
    steps: impl Iterator<Item = Step> + Send + 'static,
) -> Report {
    record_with(root, max_dropped, steps, &[])
}

fn record_with(
    root: &Path,
    max_dropped: u64,
    steps: impl Iterator<Item = Step> + Send + 'static,
    moved: &[String],
) -> Report {
    let mut plan = plan(root, max_dropped);
    plan.window = Some(turn(120, 0));
    let recorder = Recorder::start(Scripted::new(steps), plan).unwrap();
    let (_camera, ended) = recorder.wait().unwrap();
    let angle = |t_us: i64| Some((t_us - 10 * PERIOD_US) as f64 / PERIOD_US as f64 * 3.0);
    ended.finish(&angle, moved).unwrap()
}

fn read_back(report: &Report) -> (Recording, Video) {
    let recording = Recording::open(&report.folder).unwrap();
    let video = Video::open(&recording.video).unwrap();
    (recording, video)
}

fn bad(report: &Report) -> &str {
    match &report.take {
        Take::Bad { reason } => reason,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_whole_turn_is_a_clean_take_of_exactly_its_frames() {
    let root = tempfile::tempdir().unwrap();
    let report = record(root.path(), 0, steps(stream(200, 0)));
    assert_eq!(report.take, Take::Clean);
    assert_eq!((report.expected, report.recorded), (120, 120));
    let (recording, video) = read_back(&report);
    assert!(recording.notices.is_empty(), "{:?}", recording.notices);
    assert!(video.damage().is_empty(), "{:?}", video.damage());
    assert_eq!(video.frames().len(), 120);
    let manifest = recording.manifest.unwrap();
    assert_eq!(manifest.status, Status::Complete);
    assert_eq!(
        (manifest.camera.fourcc.as_str(), manifest.camera.width),
        ("MJPG", 480)
    );
    let frames = recording.frames.unwrap();
    for (n, entry) in frames.entries().iter().enumerate() {
        assert_eq!((entry.n, entry.sequence), (n as u64, n as u64 + 10));
        assert_eq!(entry.t_us, (n as i64 + 10) * PERIOD_US);
        assert!((entry.angle_deg.unwrap() - n as f64 * 3.0).abs() < 1e-9);
    }
    // The first frame is the first of the turn.
    let folder = root.path().join("20261120T093015Z-cow");
    let first = support::ffmpeg(
        &folder,
        &[
            "-i",
            "video.mkv",
            "-c",
            "copy",
            "-frames",
            "1",
            "-f",
            "rawvideo",
            "-",
        ],
    );
    assert!(first == jpegs()[10]);
}

#[test]
fn a_turn_may_be_announced_seconds_after_it_began() {
    let root = tempfile::tempdir().unwrap();
    let clock = Clock::monotonic();
    let begun = clock.now_us() + 100_000;
    let mut camera = Scripted::new(steps(stream(110, begun)));
    camera.clock = Some(clock);
    let recorder = Recorder::start(camera, plan(root.path(), 0)).unwrap();
    thread::sleep(Duration::from_millis(1500));
    assert_eq!(recorder.progress().stage, Stage::Waiting);
    recorder.announce(turn(90, begun));
    let (_camera, ended) = recorder.wait().unwrap();
    let report = ended.finish(&|_| None, &[]).unwrap();
    assert_eq!((report.take, report.recorded), (Take::Clean, 90));
}

#[test]
fn dropped_frames_are_told_at_their_index_and_make_a_take_bad_beyond_what_is_allowed() {
    let lost = |frame: &Frame| ![50, 51, 90].contains(&(frame.t_us / PERIOD_US));
    for (max_dropped, good) in [(0, false), (2, false), (3, true)] {
        let root = tempfile::tempdir().unwrap();
        let report = record(root.path(), max_dropped, steps(stream(200, 0).filter(lost)));
        let missing: Vec<_> = report
            .missing
            .iter()
            .map(|m| (m.exposure, m.count, m.before))
            .collect();
        assert_eq!(missing, [(40, 2, 40), (80, 1, 78)]);
        assert_eq!((report.expected, report.recorded), (120, 117));
        let (recording, video) = read_back(&report);
        assert_eq!(video.frames().len(), 117);
        assert_eq!(recording.frames.unwrap().gaps().len(), 2);
        if good {
            assert_eq!(report.take, Take::Tolerated);
            assert_eq!(report.manifest.status, Status::Complete);
        } else {
            assert!(bad(&report).contains("3 frames lost"), "{}", bad(&report));
            assert!(matches!(report.manifest.status, Status::Aborted(_)));
        }
        assert!(
            report.manifest.faults[0]
                .what
                .contains("2 frames missing before frame 40")
        );
    }
}

#[test]
fn drops_are_found_by_time_where_the_driver_never_counts() {
    let root = tempfile::tempdir().unwrap();
    let stands = stream(200, 0)
        .filter(|f| f.t_us / PERIOD_US != 70)
        .map(|mut frame| {
            frame.sequence = Some(Sequence {
                raw: 0,
                unwrapped: 0,
            });
            frame
        });
    let report = record(root.path(), 1, steps(stands));
    assert_eq!(report.take, Take::Tolerated);
    assert_eq!(
        (report.missing[0].exposure, report.missing[0].before),
        (60, 60)
    );
    let (recording, _) = read_back(&report);
    let gaps = recording.frames.unwrap().gaps();
    assert_eq!((gaps.len(), gaps[0].before, gaps[0].missing), (1, 60, 1));
}

#[test]
fn damaged_frames_are_recorded_as_they_came_and_told() {
    let root = tempfile::tempdir().unwrap();
    let damage = |mut frame: Frame| {
        match frame.t_us / PERIOD_US {
            30 => frame.data.truncate(frame.data.len() / 2),
            60 => frame.flagged = true,
            _ => {}
        }
        frame
    };
    let report = record(root.path(), 2, steps(stream(200, 0).map(damage)));
    assert_eq!(report.take, Take::Tolerated);
    let places: Vec<usize> = report
        .damaged
        .iter()
        .map(|damaged| damaged.delivered)
        .collect();
    assert_eq!(places, [20, 50]);
    let (_, video) = read_back(&report);
    assert_eq!(video.frames().len(), 120);
    assert!(video.frame(20).is_err() && video.frame(50).is_ok());
    assert!(
        report.manifest.faults[0]
            .what
            .contains("frame 20 is damaged")
    );

    let strict = tempfile::tempdir().unwrap();
    let report = record(strict.path(), 1, steps(stream(200, 0).map(damage)));
    assert!(
        bad(&report).contains("2 frames damaged"),
        "{}",
        bad(&report)
    );
}

#[test]
fn an_empty_frame_counts_as_lost() {
    let root = tempfile::tempdir().unwrap();
    let empty = stream(200, 0).map(|mut frame| {
        if frame.t_us == 40 * PERIOD_US {
            frame.data.clear();
        }
        frame
    });
    let report = record(root.path(), 0, steps(empty));
    assert!(bad(&report).contains("1 frame lost"), "{}", bad(&report));
    assert_eq!((report.left_out, report.recorded), (vec![30], 119));
}

#[test]
fn an_unplugged_camera_leaves_what_was_recorded() {
    let root = tempfile::tempdir().unwrap();
    let unplugged: fn() -> CameraError = || CameraError::Unplugged {
        device: "/dev/video0".to_owned(),
        source: None,
    };
    let script = steps(stream(55, 0)).chain([Step::Fail(unplugged)]);
    let report = record(root.path(), 5, script);
    assert!(
        bad(&report).contains("/dev/video0 was unplugged"),
        "{}",
        bad(&report)
    );
    assert!(
        bad(&report).contains("45 of 120 frames"),
        "{}",
        bad(&report)
    );
    let (recording, video) = read_back(&report);
    assert_eq!(video.frames().len(), 45);
    assert!(recording.notices[0].text().contains("unplugged"));
}

#[test]
fn a_camera_that_falls_silent_is_told_in_time() {
    let root = tempfile::tempdir().unwrap();
    let begun = Instant::now();
    let report = record(root.path(), 5, steps(stream(55, 0)).chain([Step::Silence]));
    assert!(begun.elapsed() < Duration::from_secs(20));
    assert!(
        bad(&report).contains("gave no frame for 0."),
        "{}",
        bad(&report)
    );
    assert_eq!(read_back(&report).1.frames().len(), 45);
}

#[test]
fn another_size_than_agreed_ends_the_recording() {
    let root = tempfile::tempdir().unwrap();
    let resized = stream(200, 0).map(|mut frame| {
        if frame.t_us >= 80 * PERIOD_US {
            // The agreed size is what the frame does not have.
            (frame.width, frame.height) = (640, 480);
        }
        frame
    });
    let report = record(root.path(), 5, steps(resized));
    assert!(bad(&report).contains("480 x 360"), "{}", bad(&report));
    assert_eq!(read_back(&report).1.frames().len(), 70);
}

#[test]
fn a_recording_can_be_stopped_and_given_up() {
    let root = tempfile::tempdir().unwrap();
    let clock = Clock::monotonic();
    let begun = clock.now_us();
    let mut camera = Scripted::new(steps(stream(3000, begun)));
    camera.clock = Some(clock);
    let recorder = Recorder::start(camera, plan(root.path(), 0)).unwrap();
    recorder.announce(turn(1500, begun));
    let patience = Instant::now() + Duration::from_secs(30);
    while recorder.progress().frames < 10 && Instant::now() < patience {
        thread::sleep(Duration::from_millis(20));
    }
    let asked = Instant::now();
    recorder.stop();
    let (_camera, ended) = recorder.wait().unwrap();
    assert!(asked.elapsed() < Duration::from_secs(5));
    assert!(matches!(ended.end(), End::Stopped));
    let report = ended.finish(&|_| None, &[]).unwrap();
    assert!(bad(&report).contains("stopped before the turn was over"));
    assert_eq!(read_back(&report).1.frames().len() as u64, report.recorded);
}

#[test]
fn settings_that_moved_fail_the_take() {
    let root = tempfile::tempdir().unwrap();
    let moved = ["gain was 4 and is 7".to_owned()];
    let report = record_with(root.path(), 9, steps(stream(200, 0)), &moved);
    assert!(bad(&report).contains("gain was 4 and is 7"));
    assert_eq!(read_back(&report).1.frames().len(), 120);
}

#[test]
fn a_camera_at_half_the_agreed_rate_fails_the_take() {
    let root = tempfile::tempdir().unwrap();
    let slow = stream(120, 0).map(|mut frame| {
        frame.t_us *= 2;
        frame
    });
    let report = record(root.path(), 9, steps(slow));
    assert!(
        bad(&report).contains("15.00 frames/s where 30.00"),
        "{}",
        bad(&report)
    );
}

#[test]
fn viewers_that_never_come_back_cost_no_frame() {
    let root = tempfile::tempdir().unwrap();
    let mut plan = plan(root.path(), 0);
    plan.window = Some(turn(120, 0));
    let recorder = Recorder::start(Scripted::new(steps(stream(200, 0))), plan).unwrap();
    thread::scope(|scope| {
        let viewers: Vec<_> = (0..50)
            .map(|_| {
                scope.spawn(|| {
                    let mut seen = 0;
                    while let Some((number, frame)) =
                        recorder.preview().newer_than(seen, Duration::from_secs(10))
                    {
                        seen = number;
                        thread::sleep(Duration::from_millis(50));
                        assert!(!frame.data.is_empty());
                    }
                })
            })
            .collect();
        for viewer in viewers {
            viewer.join().unwrap();
        }
    });
    let (_camera, ended) = recorder.wait().unwrap();
    let report = ended.finish(&|_| None, &[]).unwrap();
    assert_eq!((report.take, report.recorded), (Take::Clean, 120));
}

/// Replays a recording as fast as it is read, and records the time from `from` to `to`, in frames
/// of `period_us`, again.
fn record_replay(root: &Path, path: &Path, period_us: f64, from: f64, to: f64) -> Report {
    let address: CameraAddress = format!("replay:{}?speed=0", path.display())
        .parse()
        .unwrap();
    let clock = address.clock();
    let mut camera = open(&address, clock).unwrap();
    let mode = camera.modes().unwrap().remove(0);
    let (width, height) = mode.sizes.largest();
    let rate = mode.rates.fastest().unwrap();
    let request = ModeRequest {
        fourcc: mode.fourcc,
        width,
        height,
        rate,
    };
    let mut plan = plan(root, 0);
    plan.fps = rate.per_second();
    plan.when_full = WhenFull::Wait;
    // A frame's way from the start of the replay to its time stamp is less than half a period.
    let begun = clock.now_us() as f64;
    plan.mode = camera.start(&request).unwrap();
    let at = |frames: f64| (begun + frames * period_us) as i64;
    plan.window = Window::new(at(from), at(to));
    let recorder = Recorder::start(camera, plan).unwrap();
    let (_camera, ended) = recorder.wait().unwrap();
    ended.finish(&|_| None, &[]).unwrap()
}

#[test]
fn a_replayed_session_is_recorded_again_packet_for_packet() {
    let root = tempfile::tempdir().unwrap();
    let fixture = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/20261120T101500Z-cow-short");
    let report = record_replay(root.path(), &fixture, 33_333.3, 0.0, 150.0);
    assert_eq!((report.take.clone(), report.recorded), (Take::Clean, 150));
    let hash = |folder: &Path| {
        let arguments = ["-i", "video.mkv", "-c", "copy", "-f", "md5", "-"];
        support::ffmpeg(folder, &arguments)
    };
    assert_eq!(hash(&report.folder), hash(&fixture));
}

#[test]
fn a_turn_of_h264_keeps_the_frames_that_its_first_ones_build_on() {
    let root = tempfile::tempdir().unwrap();
    let encode = [
        "-c:v",
        "libx264",
        "-bf",
        "0",
        "-g",
        "12",
        "-sc_threshold",
        "0",
        "a.mkv",
    ];
    let source = ["-f", "lavfi", "-i", "testsrc2=s=160x120:r=30:d=4"];
    support::ffmpeg(root.path(), &[&source[..], &encode].concat());
    let path = root.path().join("a.mkv");
    // The turn begins with frame 31, and decoding with frame 24.
    let report = record_replay(root.path(), &path, 33_333.3, 30.5, 90.5);
    assert_eq!((report.expected, report.recorded), (60, 60));
    assert_eq!(report.take, Take::Clean);
    let (recording, video) = read_back(&report);
    assert_eq!(
        (video.facts().codec.as_str(), video.frames().len()),
        ("h264", 67)
    );
    assert_eq!(recording.frames.unwrap().entries().len(), 67);
    assert!(
        recording.notices[0]
            .text()
            .contains("7 frames before the turn")
    );
    assert!(video.frame(66).is_ok() && video.damage().is_empty());
}

/// Runs this test binary again, with only the (ignored) test `name`, by way of `sh`.
fn again(name: &str, script: &str, root: &Path) -> Command {
    let mut command = Command::new("sh");
    command
        .arg("-c")
        .arg(format!(
            "{script} exec \"$0\" --ignored --exact --nocapture {name}"
        ))
        .arg(std::env::current_exe().unwrap())
        .env("RELIT_TEST_ROOT", root);
    command
}

#[test]
#[ignore = "run by a_full_disk_ends_the_recording_and_says_how_much_is_missing"]
fn child_that_records_into_a_limit() {
    let root = PathBuf::from(std::env::var("RELIT_TEST_ROOT").unwrap());
    let report = record(&root, 0, steps(stream(200, 0)));
    println!("TOLD {}", bad(&report));
}

#[test]
fn a_full_disk_ends_the_recording_and_says_how_much_is_missing() {
    let root = tempfile::tempdir().unwrap();
    // 1200 blocks of 512 bytes.
    let script = "trap '' XFSZ; ulimit -f 1200;";
    let output = again("child_that_records_into_a_limit", script, root.path())
        .output()
        .unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{text}");
    let told = text
        .lines()
        .find_map(|line| line.strip_prefix("TOLD "))
        .unwrap();
    let folder = root.path().join("20261120T093015Z-cow");
    assert!(told.contains("the disk is full"), "{told}");
    assert!(told.contains(folder.to_str().unwrap()), "{told}");
    let missing: u64 = told
        .split("about ")
        .nth(1)
        .and_then(|rest| rest.split(' ').next())
        .unwrap()
        .parse()
        .unwrap();
    // The turn has 120 frames of 11.6 kB, of which 0.6 MB fitted.
    assert!((600_000..1_000_000).contains(&missing), "{told}");
    let recording = Recording::open(&folder).unwrap();
    let index = recording.frames.unwrap();
    assert!(
        index
            .entries()
            .iter()
            .all(|entry| entry.angle_deg.is_some())
    );
    let lines = index.entries().len();
    let frames = Video::open(&recording.video).unwrap().frames().len();
    assert!(
        lines > 20 && lines == frames,
        "{lines} lines, {frames} frames"
    );
    let manifest = recording.manifest.unwrap();
    assert!(
        matches!(manifest.status, Status::Aborted(_)),
        "{manifest:?}"
    );
}

#[test]
#[ignore = "run by the tests that kill a recorder"]
fn child_that_records_until_it_is_killed() {
    let root = PathBuf::from(std::env::var("RELIT_TEST_ROOT").unwrap());
    let clock = Clock::monotonic();
    let begun = clock.now_us();
    let mut camera = Scripted::new(steps(stream(100_000, begun)));
    camera.clock = Some(clock);
    let recorder = Recorder::start(camera, plan(&root, 0)).unwrap();
    recorder.announce(turn(90_000, begun));
    println!("RECORDING");
    recorder.wait().unwrap();
}

struct Silent;

impl Observer for Silent {
    fn begun(&self, _: &Path, _: u32) {}
    fn advanced(&self) {}
    fn ended(&self, recording: &Path, outcome: &Outcome) {
        match outcome {
            Outcome::Extracted(entry) => {
                let told = entry
                    .warnings
                    .iter()
                    .any(|w| w.contains("recording was interrupted"));
                assert!(told, "{:?}", entry.warnings);
            }
            other => panic!("{}: {other:?}", recording.display()),
        }
    }
}

/// `relit-extract` takes the session, with the loss told.
fn extracts(folder: &Path, out: &Path) {
    let mask = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("fixtures/20261120T101500Z-cow-short/mask_gt.png");
    let options = Options {
        frames: 4,
        size: Size::Pixels(32),
        margin: 0.1,
        saturation_level: 250,
        gate: 0.05,
        layout: Layout::Webdataset,
        mask: Some(mask),
        strict: false,
        resume: false,
        replace: false,
        threads: 1,
    };
    let tally = extract::extract(&[folder.to_owned()], out, &options, &Silent).unwrap();
    assert_eq!((tally.extracted, tally.lossy), (1, 1));
}

/// Kills a recorder `after` its start, salvages, and answers how much was lost, microseconds.
fn kill_and_salvage(after: Duration) -> i64 {
    let root = tempfile::tempdir().unwrap();
    let mut child = again("child_that_records_until_it_is_killed", "", root.path())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let lines = BufReader::new(child.stdout.take().unwrap()).lines();
    let mut lines = lines.map(Result::unwrap);
    assert!(lines.any(|line| line.contains("RECORDING")));
    let folder = root.path().join("20261120T093015Z-cow");
    thread::sleep(after);
    // A session under way is left alone.
    assert!(salvage(root.path()).unwrap().is_empty());
    let killed_us = Clock::monotonic().now_us();
    child.kill().unwrap();
    child.wait().unwrap();

    let video = folder.join("video.mkv");
    let before = fs::read(&video).unwrap();
    let salvaged = salvage(root.path()).unwrap();
    assert_eq!((salvaged.len(), &salvaged[0].folder), (1, &folder));
    let saved = salvaged[0].saved.as_ref().unwrap();
    assert!(
        before == fs::read(&video).unwrap(),
        "the video stays as it is"
    );
    assert!(saved.frames > 0 && saved.frames > (after.as_secs_f64() * 30.0) as usize / 2);

    let recording = Recording::open(&folder).unwrap();
    let status = recording.manifest.unwrap().status;
    let frames = saved.frames;
    let reason = format!(
        "recording was interrupted: {frames} frames, {:.1} seconds",
        saved.seconds
    );
    assert_eq!(status, Status::Aborted(reason));
    let last = *recording.frames.unwrap().entries().last().unwrap();
    assert_eq!(last.n + 1, frames as u64);
    assert!(salvage(root.path()).unwrap().is_empty());
    assert!(salvage_session(&folder).is_err());
    extracts(&folder, &root.path().join("out"));
    killed_us - last.t_us
}

fn kill_at_random_moments(times: u32) {
    let mut worst = 0;
    let mut state = u64::from(std::process::id()) ^ Clock::monotonic().now_us() as u64;
    for time in 0..times {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        let after = Duration::from_millis(1100 + (state >> 33) % 1500);
        let lost = kill_and_salvage(after);
        worst = worst.max(lost);
        assert!(
            lost <= 1_000_000,
            "kill {time} after {after:?} lost {lost} us"
        );
    }
    println!("{times} kills, at most {worst} us lost");
}

#[test]
fn a_killed_recording_is_salvaged_and_loses_a_second_at_most() {
    kill_at_random_moments(5);
}

/// `cargo test --test capture -- --ignored --nocapture a_hundred_killed`
#[test]
#[ignore = "takes five minutes"]
fn a_hundred_killed_recordings_are_salvaged_and_lose_a_second_at_most() {
    kill_at_random_moments(100);
}

#[test]
fn a_recording_killed_before_its_first_frame_is_salvaged_as_such() {
    let root = tempfile::tempdir().unwrap();
    let script = steps(stream(5, 0)).chain([Step::Silence]);
    let recorder = Recorder::start(Scripted::new(script), plan(root.path(), 0)).unwrap();
    let folder = recorder.folder().to_owned();
    recorder.stop();
    drop(recorder.wait().unwrap());
    let saved = salvage_session(&folder).unwrap();
    assert_eq!((saved.frames, saved.lines_cut), (0, 0));
    let manifest = Manifest::from_json(&fs::read(folder.join("session.json")).unwrap()).unwrap();
    let Status::Aborted(reason) = manifest.status else {
        panic!("{manifest:?}");
    };
    assert!(reason.contains("before its first frame"), "{reason}");
}

#[test]
fn frames_whose_content_a_power_cut_took_are_cut_from_the_index() {
    let root = tempfile::tempdir().unwrap();
    let mut plan = plan(root.path(), 0);
    plan.window = Some(turn(120, 0));
    let recorder = Recorder::start(Scripted::new(steps(stream(200, 0))), plan).unwrap();
    let folder = recorder.folder().to_owned();
    drop(recorder.wait().unwrap());
    // The last bytes never reached the disk: the file has its length, and zeros there.
    let path = folder.join("video.mkv");
    let places = support::packets(&folder, "video.mkv");
    let mut bytes = fs::read(&path).unwrap();
    bytes[places[110].at + 100..].fill(0);
    fs::write(&path, bytes).unwrap();
    let saved = salvage_session(&folder).unwrap();
    assert_eq!((saved.frames, saved.lines_cut), (110, 10));
    assert!(folder.join("frames.interrupted.jsonl").exists());
    extracts(&folder, &root.path().join("out"));
}

/// What `/proc/self` says: CPU time of this process in seconds, and its largest memory in MiB.
fn used() -> (f64, u64) {
    let stat = fs::read_to_string("/proc/self/stat").unwrap();
    let fields: Vec<&str> = stat
        .rsplit(')')
        .next()
        .unwrap()
        .split_whitespace()
        .collect();
    let ticks: u64 = fields[11].parse::<u64>().unwrap() + fields[12].parse::<u64>().unwrap();
    let status = fs::read_to_string("/proc/self/status").unwrap();
    let peak = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))
        .unwrap();
    let kib: u64 = peak.trim().trim_end_matches(" kB").parse().unwrap();
    (ticks as f64 / 100.0, kib >> 10)
}

/// `RELIT_VIDEO=... cargo test --release --test capture -- --ignored --nocapture cost`
#[test]
#[ignore = "measures with a video that is given"]
fn cost_of_recording_a_video_as_fast_as_it_goes() {
    let path = PathBuf::from(std::env::var("RELIT_VIDEO").expect("RELIT_VIDEO names a video"));
    let root = tempfile::tempdir_in(path.parent().unwrap()).unwrap();
    let frames = Video::open(&path).unwrap().frames().len() as f64;
    let (cpu, begun) = (used().0, Instant::now());
    let report = record_replay(root.path(), &path, 33_333.3, 0.0, frames);
    let (after, peak) = used();
    println!(
        "{:?}: {} frames, {:.2} CPU-s, {:.2} s, at most {peak} MiB",
        report.take,
        report.recorded,
        after - cpu,
        begun.elapsed().as_secs_f64()
    );
}
