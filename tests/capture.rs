//! Recording turns with a camera that does as the test says, and recovering what was killed.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout
)]

use std::collections::BTreeMap;
use std::fs;
use std::io::{self, BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use relit_camera::{
    Camera, CameraAddress, CameraError, CameraMode, Control, DeviceInfo, Fourcc, Frame, FrameFault,
    Mode, Rates, open,
};
use relit_capture::capture::{
    EndReason, Recorder, RecordingPlan, Window, recover, recover_session,
};
use relit_capture::preview::Preview;
use relit_capture::state::{Monitor, TakeSummary, Verdict};
use relit_data::clock::Clock;
use relit_data::disk::DISK_FULL;
use relit_data::session::{
    CameraFacts, FrameClock, FrameIndex, Manifest, Recording, SessionError, SoftwareFacts, Status,
    VideoFacts,
};
use relit_data::shard::{Dataset, ImageSize};
use relit_extract::{ExtractOptions, extract};
use relit_tests::{ffmpeg, is_named, packets};
use relit_video::{PixelFormat, StreamFormat, Video};

/// What the camera of a test does next.
enum Step {
    Frame(Box<Frame>),
    /// No frame comes any more.
    Silence,
    Fail(fn() -> CameraError),
}

/// A camera that follows a script: frames come when their time stamps are due on its clock.
struct Scripted {
    info: DeviceInfo,
    steps: Box<dyn Iterator<Item = Step> + Send>,
    clock: Clock,
    silent: bool,
}

impl Scripted {
    fn new(clock: &Clock, steps: impl Iterator<Item = Step> + Send + 'static) -> Box<Self> {
        Box::new(Self {
            info: DeviceInfo {
                address: "v4l2:/dev/video0".parse().unwrap(),
                name: "scripted".to_owned(),
                driver: "none".to_owned(),
                bus: String::new(),
                modes: Vec::new(),
                problems: Vec::new(),
            },
            steps: Box::new(steps),
            clock: clock.clone(),
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

    fn set_control(&mut self, _: u32, value: i64) -> Result<i64, CameraError> {
        Ok(value)
    }

    fn start(&mut self, want: &CameraMode) -> Result<CameraMode, CameraError> {
        Ok(*want)
    }

    fn next_frame(&mut self, timeout: Duration) -> Result<Frame, CameraError> {
        // A frame takes time, so that none comes while a participant of the clock is busy.
        self.clock.sleep(Duration::from_micros(1));
        let step = if self.silent { None } else { self.steps.next() };
        match step {
            Some(Step::Frame(frame)) => {
                self.clock.sleep_until(frame.t_us);
                Ok(*frame)
            }
            Some(Step::Fail(error)) => Err(error()),
            Some(Step::Silence) => {
                self.silent = true;
                self.next_frame(timeout)
            }
            None if self.silent => {
                self.clock.sleep(timeout);
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

/// The session that a test records.
const ID: &str = "20261120T093015Z-cow";
const PERIOD_US: i64 = 33_333;
/// How long a frame may wait for a disk that is busy with something else.
const WAIT: Duration = Duration::from_secs(60);
const SIZE: (u32, u32) = (480, 360);

/// The JPEGs of a fixture, which are the packets of its video.
fn jpegs() -> Vec<Vec<u8>> {
    let folder =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../fixtures/20261120T101500Z-cow-short");
    let bytes = fs::read(folder.join("video.mkv")).unwrap();
    let places = packets(&folder, "video.mkv");
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
        sequence: Some(n),
        t_us: begun + n as i64 * PERIOD_US,
        clock: FrameClock::Driver,
        flagged: false,
    })
}

fn steps(frames: impl Iterator<Item = Frame> + Send) -> impl Iterator<Item = Step> + Send {
    frames.map(|frame| Step::Frame(Box::new(frame)))
}

/// From frame 10 on, for this many frames.
fn turn(frames: i64, begun: i64) -> Window {
    let from = begun + 10 * PERIOD_US - PERIOD_US / 2;
    Window::lasting(from, frames * PERIOD_US)
}

fn manifest() -> Manifest {
    Manifest {
        id: ID.to_owned(),
        object: "cow".to_owned(),
        created: "2026-11-20T09:30:15Z".parse().unwrap(),
        status: Status::Recording,
        camera: CameraFacts {
            backend: "replay".to_owned(),
            device: "script".to_owned(),
            name: "scripted".to_owned(),
            fourcc: "MJPG".to_owned(),
            width: SIZE.0,
            height: SIZE.1,
            fps: 30.0,
            clock: FrameClock::default(),
            controls: BTreeMap::new(),
        },
        turntable: None,
        rig: None,
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
        note: None,
        rating: None,
    }
}

fn plan(root: &Path, clock: &Clock, max_dropped: u64) -> RecordingPlan {
    RecordingPlan {
        root: root.to_owned(),
        manifest: manifest(),
        stream: StreamFormat {
            format: PixelFormat::Mjpeg,
            width: SIZE.0,
            height: SIZE.1,
            fps: 30.0,
        },
        max_dropped,
        queue_wait: Duration::ZERO,
        stall: Duration::from_secs(2),
        clock: clock.clone(),
        preview: None,
    }
}

/// Begins to record; the time of the turn is known before the first frame comes.
fn start(camera: Box<dyn Camera>, plan: RecordingPlan, window: Window) -> Recorder {
    let _participant = plan.clock.clone().participate();
    let recorder = Recorder::start(camera, plan).unwrap();
    recorder.announce(window);
    recorder
}

/// Records a turn of 120 frames; angle 3 degrees a frame.
fn record(
    root: &Path,
    max_dropped: u64,
    steps: impl Iterator<Item = Step> + Send + 'static,
) -> Take {
    record_with(root, max_dropped, steps, &[])
}

fn record_with(
    root: &Path,
    max_dropped: u64,
    steps: impl Iterator<Item = Step> + Send + 'static,
    control_faults: &[String],
) -> Take {
    let clock = Clock::virtual_time();
    let mut plan = plan(root, &clock, max_dropped);
    plan.queue_wait = WAIT;
    let recorder = start(Scripted::new(&clock, steps), plan, turn(120, 0));
    let (_camera, recorded) = recorder.wait().unwrap();
    let angle = |t_us: i64| Some((t_us - 10 * PERIOD_US) as f64 / PERIOD_US as f64 * 3.0);
    let summary = recorded.finish(&angle, control_faults).unwrap();
    Take::read(root, summary)
}

/// A take as a user finds it: its summary, and its session on the disk.
struct Take {
    summary: TakeSummary,
    folder: PathBuf,
    recording: Recording,
    video: Video,
}

impl Take {
    fn read(root: &Path, summary: TakeSummary) -> Self {
        let folder = root.join(&summary.session);
        let recording = Recording::open(&folder).unwrap();
        let video = Video::open(&recording.video).unwrap();
        Self {
            summary,
            folder,
            recording,
            video,
        }
    }

    /// Frames of the turn in the video, and frames lost.
    fn counts(&self) -> (u64, u64) {
        (self.summary.frames, self.summary.dropped)
    }

    fn frames_in_video(&self) -> usize {
        self.video.frames().len()
    }

    fn index(&self) -> &FrameIndex {
        self.recording.frames.as_ref().unwrap()
    }

    fn manifest(&self) -> &Manifest {
        self.recording.manifest.as_ref().unwrap()
    }

    /// What the manifest lists.
    fn faults(&self) -> Vec<&str> {
        let faults = self.manifest().faults.iter();
        faults.map(|fault| fault.what.as_str()).collect()
    }

    /// The reason of a take that is not usable, which is in its manifest too.
    fn rejection(&self) -> &str {
        let reason = self.summary.reason.as_deref().unwrap();
        assert_eq!(self.summary.verdict, Verdict::Aborted, "{reason}");
        let status = &self.manifest().status;
        assert_eq!(*status, Status::Aborted(reason.to_owned()));
        reason
    }

    /// Checks that the take is not usable, by a reason that names these things.
    #[track_caller]
    fn check_rejected(&self, things: &[&str]) {
        let reason = self.rejection();
        assert!(is_named(reason, things), "{reason}");
    }

    #[track_caller]
    fn check_verdict(&self, verdict: Verdict) {
        assert_eq!(self.summary.verdict, verdict, "{:?}", self.summary);
        assert_eq!(self.manifest().status, Status::Complete);
    }
}

#[test]
fn a_whole_turn_is_a_clean_take_of_exactly_its_frames() {
    let root = tempfile::tempdir().unwrap();
    let take = record(root.path(), 0, steps(stream(200, 0)));
    take.check_verdict(Verdict::Clean);
    assert_eq!(take.counts(), (120, 0));
    let notices = &take.recording.notices;
    assert!(notices.is_empty(), "{notices:?}");
    assert!(take.video.damage().is_empty(), "{:?}", take.video.damage());
    assert_eq!(take.frames_in_video(), 120);
    let video = &take.manifest().video;
    assert_eq!((video.codec.as_str(), video.frames), ("mjpeg", Some(120)));
    for (n, entry) in take.index().entries().iter().enumerate() {
        assert_eq!((entry.n, entry.sequence), (n as u64, n as u64 + 10));
        assert_eq!(entry.t_us, (n as i64 + 10) * PERIOD_US);
        assert!((entry.angle_deg.unwrap() - n as f64 * 3.0).abs() < 1e-9);
    }
    // The first frame is the first of the turn.
    let first = "-i video.mkv -c copy -frames 1 -f rawvideo -";
    let arguments: Vec<&str> = first.split(' ').collect();
    assert!(ffmpeg(&take.folder, &arguments) == jpegs()[10]);
}

#[test]
fn a_turn_may_be_announced_seconds_after_it_began() {
    let root = tempfile::tempdir().unwrap();
    let clock = Clock::virtual_time();
    let _part = clock.participate();
    let begun = clock.now_us();
    let camera = Scripted::new(&clock, steps(stream(210, begun)));
    let mut plan = plan(root.path(), &clock, 0);
    plan.queue_wait = WAIT;
    let recorder = Recorder::start(camera, plan).unwrap();
    clock.sleep(Duration::from_millis(4200));
    assert_eq!(recorder.progress().frames, 0);
    recorder.announce(turn(190, begun));
    let (_camera, recorded) = recorder.wait().unwrap();
    let take = Take::read(root.path(), recorded.finish(&|_| None, &[]).unwrap());
    take.check_verdict(Verdict::Clean);
    assert_eq!(take.counts(), (190, 0));
}

#[test]
fn dropped_frames_are_listed_at_their_index_and_make_a_take_unusable_beyond_what_is_allowed() {
    let lost = |frame: &Frame| ![50, 51, 90].contains(&(frame.t_us / PERIOD_US));
    for (max_dropped, tolerated) in [(0, false), (2, false), (3, true)] {
        let root = tempfile::tempdir().unwrap();
        let take = record(root.path(), max_dropped, steps(stream(200, 0).filter(lost)));
        assert_eq!(take.counts(), (117, 3));
        assert_eq!(take.frames_in_video(), 117);
        assert_eq!(take.index().gaps().len(), 2);
        let faults = take.faults();
        assert_eq!(faults.len(), 2, "{faults:?}");
        assert!(is_named(faults[0], &["2 frames", "frame 40"]), "{faults:?}");
        assert!(is_named(faults[1], &["1 frame", "frame 78"]), "{faults:?}");
        if tolerated {
            take.check_verdict(Verdict::Tolerated);
            assert_eq!(take.summary.reason.as_deref(), Some(faults[0]));
        } else {
            take.check_rejected(&["3 frames", &max_dropped.to_string()]);
        }
    }
}

#[test]
fn drops_are_found_by_time_where_the_driver_never_counts() {
    let root = tempfile::tempdir().unwrap();
    let not_counted = |mut frame: Frame| {
        frame.sequence = Some(0);
        frame
    };
    let stream = stream(200, 0).filter(|frame| frame.t_us / PERIOD_US != 70);
    let take = record(root.path(), 1, steps(stream.map(not_counted)));
    take.check_verdict(Verdict::Tolerated);
    let faults = take.faults();
    assert_eq!(faults.len(), 1, "{faults:?}");
    assert!(is_named(faults[0], &["1 frame", "frame 60"]), "{faults:?}");
    let gaps = take.index().gaps();
    assert_eq!((gaps.len(), gaps[0].before, gaps[0].missing), (1, 60, 1));
}

#[test]
fn damaged_frames_are_recorded_as_they_came_and_listed() {
    let damage = |mut frame: Frame| {
        match frame.t_us / PERIOD_US {
            30 => frame.data.truncate(frame.data.len() / 2),
            60 => frame.flagged = true,
            _ => {}
        }
        frame
    };
    let root = tempfile::tempdir().unwrap();
    let take = record(root.path(), 2, steps(stream(200, 0).map(damage)));
    take.check_verdict(Verdict::Tolerated);
    let faults = take.faults();
    assert_eq!(faults.len(), 2, "{faults:?}");
    for (found, frame, fault) in [
        (faults[0], "frame 20", FrameFault::NoEnd),
        (faults[1], "frame 50", FrameFault::Flagged),
    ] {
        assert!(is_named(found, &[frame, &fault.to_string()]), "{found}");
    }
    assert_eq!(take.frames_in_video(), 120);
    assert!(take.video.frame(20).is_err() && take.video.frame(50).is_ok());

    let strict = tempfile::tempdir().unwrap();
    let take = record(strict.path(), 1, steps(stream(200, 0).map(damage)));
    take.check_rejected(&["2 frames"]);
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
    let take = record(root.path(), 0, steps(empty));
    take.check_rejected(&["1 frame"]);
    assert_eq!(take.counts(), (119, 1));
    assert!(is_named(take.faults()[0], &["frame 30"]));
}

#[test]
fn many_faults_of_one_kind_are_listed_up_to_a_number_and_counted() {
    let root = tempfile::tempdir().unwrap();
    let flag = |mut frame: Frame| {
        frame.flagged = (20..=70).contains(&(frame.t_us / PERIOD_US));
        frame
    };
    let take = record(root.path(), 51, steps(stream(200, 0).map(flag)));
    take.check_verdict(Verdict::Tolerated);
    let faults = take.faults();
    assert_eq!(faults.len(), 41);
    assert!(is_named(faults[40], &["11"]), "{}", faults[40]);
}

#[test]
fn an_unplugged_camera_leaves_what_was_recorded() {
    let root = tempfile::tempdir().unwrap();
    let unplugged: fn() -> CameraError = || CameraError::Unplugged {
        device: "/dev/video0".to_owned(),
        source: None,
    };
    let script = steps(stream(55, 0)).chain([Step::Fail(unplugged)]);
    let take = record(root.path(), 5, script);
    take.check_rejected(&[&unplugged().to_string(), "45", "120 frames"]);
    assert_eq!(take.frames_in_video(), 45);
    // The frames after it were never due.
    assert_eq!(take.counts(), (45, 0));
    assert!(take.faults().is_empty(), "{:?}", take.faults());
    let notice = take.recording.notices[0].text();
    assert!(notice.contains(&unplugged().to_string()), "{notice}");
}

#[test]
fn what_the_system_said_of_a_broken_stream_is_in_the_manifest() {
    let root = tempfile::tempdir().unwrap();
    let broken: fn() -> CameraError = || CameraError::Stream {
        device: "/dev/video0".to_owned(),
        doing: "read",
        source: io::Error::from_raw_os_error(5),
    };
    let script = steps(stream(55, 0)).chain([Step::Fail(broken)]);
    let take = record(root.path(), 5, script);
    take.check_rejected(&["(os error 5)"]);
}

#[test]
fn a_camera_that_falls_silent_ends_the_recording() {
    let root = tempfile::tempdir().unwrap();
    let take = record(root.path(), 5, steps(stream(55, 0)).chain([Step::Silence]));
    take.check_rejected(&["2.0 s"]);
    assert_eq!(take.frames_in_video(), 45);
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
    let take = record(root.path(), 5, steps(resized));
    take.check_rejected(&["480 x 360"]);
    assert_eq!(take.frames_in_video(), 70);
}

#[test]
fn a_recording_can_be_stopped() {
    let root = tempfile::tempdir().unwrap();
    let clock = Clock::virtual_time();
    let _part = clock.participate();
    let begun = clock.now_us();
    let camera = Scripted::new(&clock, steps(stream(3000, begun)));
    let mut plan = plan(root.path(), &clock, 0);
    plan.queue_wait = WAIT;
    let recorder = Recorder::start(camera, plan).unwrap();
    recorder.announce(turn(1500, begun));
    // Between two frames.
    clock.sleep_until(begun + 100 * PERIOD_US - 1);
    recorder.stop();
    assert!(recorder.wait_ended(Duration::from_millis(100)));
    let (_camera, recorded) = recorder.wait().unwrap();
    assert!(matches!(recorded.end(), EndReason::Stopped));
    let take = Take::read(root.path(), recorded.finish(&|_| None, &[]).unwrap());
    take.check_rejected(&[&EndReason::Stopped.to_string()]);
    assert_eq!((take.frames_in_video(), take.summary.frames), (91, 91));
}

#[test]
fn settings_that_changed_make_a_take_unusable() {
    let root = tempfile::tempdir().unwrap();
    let changed = ["gain was 4 and is 7".to_owned()];
    let take = record_with(root.path(), 9, steps(stream(200, 0)), &changed);
    take.check_rejected(&[&changed[0]]);
    assert_eq!(take.faults(), changed);
    assert_eq!(take.frames_in_video(), 120);
}

#[test]
fn a_camera_at_half_the_agreed_rate_makes_a_take_unusable() {
    let root = tempfile::tempdir().unwrap();
    let slow = stream(120, 0).map(|mut frame| {
        frame.t_us *= 2;
        frame
    });
    let take = record(root.path(), 9, steps(slow));
    take.check_rejected(&["15.00 frames/s", "30.00"]);
}

#[test]
fn a_viewer_that_never_gives_the_picture_back_costs_no_frame() {
    let root = tempfile::tempdir().unwrap();
    let clock = Clock::virtual_time();
    let monitor = Monitor::default();
    let pictures = monitor.pictures();
    let held = pictures.borrow();
    let mut plan = plan(root.path(), &clock, 0);
    plan.queue_wait = WAIT;
    plan.preview = Some(Preview::start(monitor.clone()).unwrap());
    let camera = Scripted::new(&clock, steps(stream(200, 0)));
    let recorder = start(camera, plan, turn(120, 0));
    let (_camera, recorded) = recorder.wait().unwrap();
    drop(held);
    let take = Take::read(root.path(), recorded.finish(&|_| None, &[]).unwrap());
    take.check_verdict(Verdict::Clean);
    assert_eq!(take.counts(), (120, 0));
    let until = Instant::now() + Duration::from_secs(300);
    while monitor.preview().is_none() {
        assert!(Instant::now() < until);
        thread::sleep(Duration::from_millis(10));
    }
}

/// Replays a recording, and records the time from `from` to `to`, in frames
/// of `period_us`, again.
fn record_replay(root: &Path, path: &Path, period_us: f64, from: f64, to: f64) -> Take {
    let address: CameraAddress = format!("replay:{}", path.display()).parse().unwrap();
    let clock = Clock::virtual_time();
    let mut camera = open(&address, clock.clone()).unwrap();
    let mode = camera.modes().unwrap().remove(0);
    let (width, height) = mode.sizes.largest();
    let Rates::List(rates) = mode.rates else {
        panic!("a recording has one rate");
    };
    let rate = rates[0];
    let request = CameraMode {
        fourcc: mode.fourcc,
        width,
        height,
        rate,
    };
    let mut plan = plan(root, &clock, 0);
    plan.queue_wait = WAIT;
    // A frame's way from the start of the replay to its time stamp is less than half a period.
    let begun = clock.now_us() as f64;
    let mode = camera.start(&request).unwrap();
    plan.stream = StreamFormat {
        format: mode.fourcc.pixel_format().unwrap(),
        width,
        height,
        fps: rate.per_second(),
    };
    let at = |frames: f64| (begun + frames * period_us) as i64;
    let window = Window::lasting(at(from), at(to) - at(from));
    let recorder = start(camera, plan, window);
    let (_camera, recorded) = recorder.wait().unwrap();
    Take::read(root, recorded.finish(&|_| None, &[]).unwrap())
}

#[test]
fn a_replayed_session_is_recorded_again_packet_for_packet() {
    let root = tempfile::tempdir().unwrap();
    let fixture =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../fixtures/20261120T101500Z-cow-short");
    let take = record_replay(root.path(), &fixture, 33_333.3, 0.0, 150.0);
    take.check_verdict(Verdict::Clean);
    assert_eq!(take.counts(), (150, 0));
    let hash = |folder: &Path| {
        let arguments = ["-i", "video.mkv", "-c", "copy", "-f", "md5", "-"];
        ffmpeg(folder, &arguments)
    };
    assert_eq!(hash(&take.folder), hash(&fixture));
}

#[test]
fn a_turn_of_h264_keeps_the_frames_that_its_first_ones_build_on() {
    let root = tempfile::tempdir().unwrap();
    let made = "-f lavfi -i testsrc2=s=160x120:r=30:d=4 -c:v libx264 -bf 0 -g 12 -sc_threshold 0";
    let arguments: Vec<&str> = made.split(' ').chain(["a.mkv"]).collect();
    ffmpeg(root.path(), &arguments);
    let path = root.path().join("a.mkv");
    // The turn begins with frame 31, and decoding with frame 24.
    let take = record_replay(root.path(), &path, 33_333.3, 30.5, 90.5);
    take.check_verdict(Verdict::Clean);
    assert_eq!(take.counts(), (60, 0));
    assert_eq!(take.video.facts().codec, "h264");
    assert_eq!(
        (take.frames_in_video(), take.index().entries().len()),
        (67, 67)
    );
    let notice = take.recording.notices[0].text();
    assert!(is_named(notice, &["7 frames"]), "{notice}");
    assert!(take.video.frame(66).is_ok() && take.video.damage().is_empty());
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
    let take = record(&root, 0, steps(stream(200, 0)));
    let (recorded, dropped) = take.counts();
    assert_eq!(recorded + dropped, 120, "{:?}", take.faults());
    // One number, wherever it stands.
    let lost = format!("{dropped} frames");
    take.check_rejected(&[&lost]);
    let from = format!("frame {recorded}");
    let mut faults = take.faults().into_iter();
    assert!(
        faults.any(|fault| is_named(fault, &[&lost, &from])),
        "{:?}",
        take.faults()
    );
    println!("REASON {}", take.rejection());
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
    let reason = text
        .lines()
        .find_map(|line| line.strip_prefix("REASON "))
        .unwrap();
    let folder = root.path().join(ID);
    assert!(reason.contains(DISK_FULL), "{reason}");
    assert!(
        reason.contains("(os error 27)"),
        "the system's answer: {reason}"
    );
    assert!(reason.contains(folder.to_str().unwrap()), "{reason}");
    let before = reason.split(" bytes").next().unwrap();
    let missing: u64 = before.rsplit(' ').next().unwrap().parse().unwrap();
    // The turn has 120 frames of 11.6 kB, of which 0.6 MB fitted.
    assert!((600_000..1_000_000).contains(&missing), "{reason}");
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
    let clock = match std::env::var("RELIT_TEST_CLOCK").as_deref() {
        Ok("real") => Clock::monotonic(),
        _ => Clock::paced(20.0),
    };
    let begun = clock.now_us();
    let camera = Scripted::new(&clock, steps(stream(100_000, begun)));
    let mut plan = plan(&root, &clock, 0);
    plan.queue_wait = WAIT;
    let recorder = Recorder::start(camera, plan).unwrap();
    recorder.announce(turn(90_000, begun));
    while !recorder.progress().ended {
        println!("WROTE {}", recorder.progress().frames);
        thread::sleep(Duration::from_millis(2));
    }
}

/// `relit-extract` takes the session, and warns of the loss.
fn extracts(folder: &Path, out: &Path) {
    let mask = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../fixtures/20261120T101500Z-cow-short/mask_gt.png");
    let options = ExtractOptions {
        frames: 4,
        size: ImageSize::Pixels(32),
        mask: Some(mask),
        threads: 1,
        ..ExtractOptions::default()
    };
    let tally = extract(&[folder.to_owned()], out, &options, &()).unwrap();
    assert_eq!((tally.extracted, tally.lossy), (1, 1));
    let warnings = &Dataset::read(out).unwrap().sessions[0].warnings;
    let Status::Aborted(reason) = Recording::open(folder).unwrap().manifest.unwrap().status else {
        panic!("{warnings:?}");
    };
    assert!(
        warnings.iter().any(|warning| warning.contains(&reason)),
        "{warnings:?}"
    );
}

/// What a killed recorder lost.
struct Lost {
    /// Frames that it had written.
    frames: u64,
    /// Time since the last frame that was saved, by the system's clock, microseconds.
    us: i64,
}

/// Kills a recorder that has written so many frames, and recovers its session. `clock`: whether it
/// goes by `real` time.
fn kill_and_recover(clock: &str, frames: u64) -> Lost {
    let root = tempfile::tempdir().unwrap();
    let mut child = again("child_that_records_until_it_is_killed", "", root.path())
        .env("RELIT_TEST_CLOCK", clock)
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let lines = BufReader::new(child.stdout.take().unwrap()).lines();
    let mut written = lines.filter_map(|line| line.unwrap().strip_prefix("WROTE ")?.parse().ok());
    let folder = root.path().join(ID);
    assert!(written.any(|written: u64| written >= frames));
    // A session under way is left alone.
    assert!(recover(root.path()).unwrap().is_empty());
    let killed_us = Clock::monotonic().now_us();
    child.kill().unwrap();
    child.wait().unwrap();
    let written = written.last().unwrap_or(frames);

    let video = folder.join("video.mkv");
    let before = fs::read(&video).unwrap();
    let recovered = recover(root.path()).unwrap();
    assert_eq!((recovered.len(), &recovered[0].folder), (1, &folder));
    let saved = recovered[0].saved.as_ref().unwrap();
    assert!(
        before == fs::read(&video).unwrap(),
        "the video stays as it is"
    );

    let recording = Recording::open(&folder).unwrap();
    let status = recording.manifest.unwrap().status;
    let frames = saved.frames;
    let Status::Aborted(reason) = status else {
        panic!("{status:?}");
    };
    let counts = [format!("{frames} frames"), format!("{:.1}", saved.seconds)];
    assert!(
        is_named(&reason, &counts.each_ref().map(|count| &**count)),
        "{reason}"
    );
    let last = *recording.frames.unwrap().entries().last().unwrap();
    assert_eq!(last.n + 1, frames as u64);
    assert!(recover(root.path()).unwrap().is_empty());
    assert!(recover_session(&folder).is_err());
    extracts(&folder, &root.path().join("out"));
    Lost {
        frames: written.saturating_sub(frames as u64),
        us: killed_us - last.t_us,
    }
}

/// Numbers of frames after which a recorder is killed.
fn random_moments() -> impl Iterator<Item = u64> {
    let seed = u64::from(std::process::id()) ^ Clock::monotonic().now_us() as u64;
    let next = |state: &u64| {
        let state = state.wrapping_mul(6_364_136_223_846_793_005);
        Some(state.wrapping_add(1))
    };
    std::iter::successors(Some(seed), next).map(|state| 30 + (state >> 33) % 45)
}

#[test]
fn a_killed_recording_is_recovered_and_loses_a_second_of_what_was_written_at_most() {
    for frames in random_moments().take(5) {
        let lost = kill_and_recover("paced", frames);
        assert!(lost.frames <= 30, "{} frames lost", lost.frames);
    }
}

/// `cargo test --test capture -- --ignored --nocapture a_hundred_killed`
#[test]
#[ignore = "takes five minutes"]
fn a_hundred_killed_recordings_are_recovered_and_lose_a_second_at_most() {
    let lost = random_moments().map(|frames| kill_and_recover("real", frames).us);
    let worst = lost.take(100).max().unwrap();
    println!("at most {worst} us lost");
    assert!(worst <= 1_000_000, "{worst} us lost");
}

#[test]
fn a_recording_killed_before_its_first_frame_is_recovered_as_such() {
    let root = tempfile::tempdir().unwrap();
    let script = steps(stream(5, 0)).chain([Step::Silence]);
    let clock = Clock::virtual_time();
    let camera = Scripted::new(&clock, script);
    let recorder = Recorder::start(camera, plan(root.path(), &clock, 0)).unwrap();
    let folder = root.path().join(ID);
    recorder.stop();
    drop(recorder.wait().unwrap());
    let saved = recover_session(&folder).unwrap();
    assert_eq!((saved.frames, saved.lines_cut), (0, 0));
    let manifest = Manifest::from_json(&fs::read(folder.join("session.json")).unwrap()).unwrap();
    assert!(
        matches!(manifest.status, Status::Aborted(_)),
        "{manifest:?}"
    );

    // It is left out of a batch, with its reason, and is no failure.
    let output = Command::new(relit_tests::program("relit-extract"))
        .arg(root.path())
        .arg("-o")
        .arg(root.path().join("out"))
        .arg("--json")
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(3), "{output:?}");
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    let first: serde_json::Value = serde_json::from_str(said.lines().next().unwrap()).unwrap();
    assert_eq!(first["event"], "left_out", "{said}");
    let none = SessionError::NoFrames(folder).to_string();
    assert_eq!(first["message"], none, "{said}");
}

#[test]
fn frames_whose_content_a_power_cut_took_are_cut_from_the_index() {
    let root = tempfile::tempdir().unwrap();
    let clock = Clock::virtual_time();
    let mut plan = plan(root.path(), &clock, 0);
    plan.queue_wait = WAIT;
    let camera = Scripted::new(&clock, steps(stream(200, 0)));
    let recorder = start(camera, plan, turn(120, 0));
    let folder = root.path().join(ID);
    drop(recorder.wait().unwrap());
    // The last bytes never reached the disk: the file has its length, and zeros there.
    let path = folder.join("video.mkv");
    let places = packets(&folder, "video.mkv");
    let mut bytes = fs::read(&path).unwrap();
    bytes[places[110].at + 100..].fill(0);
    fs::write(&path, bytes).unwrap();
    let saved = recover_session(&folder).unwrap();
    assert_eq!((saved.frames, saved.lines_cut), (110, 10));
    assert!(folder.join("frames.interrupted.jsonl").exists());
    extracts(&folder, &root.path().join("out"));
}
