//! Takes that go wrong: each fault ends with its own sentence, nothing of the session is lost, and
//! the table stands.

use std::thread;
use std::time::{Duration, Instant};

use relit_data::causes::with_causes;
use relit_data::session::{Status, recordings};
use relit_rig::camera::{
    self, Camera, CameraError, Control, ControlId, DeviceInfo, Frame, GrantedMode, Mode,
    ModeRequest,
};
use relit_rig::capture::preflight::check_disk;
use relit_rig::capture::{CaptureError, MeterFault, Refusal, Settings, Stopped};
use relit_rig::simulator::{Simulator, SimulatorOptions};
use relit_rig::state::{TakeSummary, Verdict};

use crate::support::{Rehearsal, SHORT};

/// A quick turn of ten seconds, 300 frames, five times as fast.
fn quick(camera: &str) -> Rehearsal {
    Rehearsal::with(SHORT, camera, "sim:?speed=3", |settings| {
        settings.degrees_per_second = 36.0;
    })
}

/// Checks that a take was kept as aborted for a reason that says `words`, and that the table stands.
fn check_aborted(rig: &Rehearsal, take: &TakeSummary, words: &str) {
    assert_eq!(take.verdict, Verdict::Aborted, "{take:?}");
    let reason = take.reason.as_deref().unwrap();
    assert!(reason.contains(words), "{reason}");
    let session = rig.session(take);
    let manifest = session.manifest.unwrap();
    assert_eq!(manifest.status, Status::Aborted(reason.to_owned()));
    assert!(rig.table_stands());
}

#[test]
fn a_camera_unplugged_in_the_turn_ends_the_take_and_what_came_before_is_kept() {
    let mut rig = quick("&unplug=220");
    let take = rig.capture(false).unwrap();
    check_aborted(&rig, &take, "was unplugged");
    assert!(take.frames > 0);
}

#[test]
fn a_camera_that_falls_silent_ends_the_take() {
    let mut rig = quick("&stall=220");
    let take = rig.capture(false).unwrap();
    check_aborted(&rig, &take, "gave no frame");
}

#[test]
fn a_camera_that_changes_its_size_ends_the_take() {
    let mut rig = quick("&resize=220");
    let take = rig.capture(false).unwrap();
    check_aborted(&rig, &take, "changed what it delivers");
}

#[test]
fn a_take_with_a_dropped_frame_is_repeated_and_both_are_kept() {
    let mut rig = Rehearsal::with(SHORT, "&drop=220", "sim:?speed=3", |settings| {
        settings.degrees_per_second = 36.0;
        settings.retries = 1;
    });
    let take = rig.capture(false).unwrap();
    check_aborted(&rig, &take, "1 frame lost");
    assert_eq!((take.frames, take.dropped), (299, 1));
    assert_eq!(recordings(rig.root.path()).unwrap().len(), 2);
    let told = rig.monitor.state().faults;
    assert!(
        told[0]
            .what
            .starts_with("the take is repeated: 1 frame lost"),
        "{told:?}"
    );
}

#[test]
fn a_tolerated_take_is_not_repeated_with_the_usual_settings() {
    let mut rig = Rehearsal::with(SHORT, "&drop=220", "sim:?speed=3", |settings| {
        let usual = Settings::new(
            settings.root.clone(),
            settings.camera.clone(),
            settings.turntable.clone(),
        );
        settings.retries = usual.retries;
        settings.degrees_per_second = 36.0;
        settings.max_dropped = 5;
    });
    let captured = rig.capture_all(false).unwrap();
    assert_eq!(captured.take.verdict, Verdict::Tolerated, "{captured:?}");
    assert_eq!(captured.repeated, 0);
    assert_eq!(recordings(rig.root.path()).unwrap().len(), 1);
    assert!(rig.monitor.state().faults.is_empty());
}

/// A camera that loses a frame the first time that it streams.
struct LosesOneFrame {
    camera: Box<dyn Camera>,
    frames_until_loss: u32,
}

impl Camera for LosesOneFrame {
    fn info(&self) -> &DeviceInfo {
        self.camera.info()
    }

    fn modes(&mut self) -> Result<Vec<Mode>, CameraError> {
        self.camera.modes()
    }

    fn controls(&mut self) -> Result<Vec<Control>, CameraError> {
        self.camera.controls()
    }

    fn set_control(&mut self, id: ControlId, value: i64) -> Result<i64, CameraError> {
        self.camera.set_control(id, value)
    }

    fn start(&mut self, want: &ModeRequest) -> Result<GrantedMode, CameraError> {
        self.camera.start(want)
    }

    fn next_frame(&mut self, timeout: Duration) -> Result<Frame, CameraError> {
        self.frames_until_loss = self.frames_until_loss.saturating_sub(1);
        if self.frames_until_loss == 1 {
            let _lost = self.camera.next_frame(timeout)?;
        }
        self.camera.next_frame(timeout)
    }

    fn stop(&mut self) -> Result<(), CameraError> {
        self.camera.stop()
    }
}

#[test]
fn a_clean_take_after_one_that_is_not_usable_counts_and_the_first_is_kept() {
    let mut rig = Rehearsal::with(SHORT, "", "sim:?speed=3", |settings| {
        settings.degrees_per_second = 36.0;
        settings.retries = 1;
    });
    let equipment = &mut rig.equipment;
    let camera = camera::open(&equipment.settings().camera, equipment.clock()).unwrap();
    equipment.camera = Some(Box::new(LosesOneFrame {
        camera,
        frames_until_loss: 220,
    }));
    let captured = rig.capture_all(false).unwrap();
    assert_eq!(captured.take.verdict, Verdict::Clean, "{captured:?}");
    assert_eq!(captured.repeated, 1);
    assert_eq!(recordings(rig.root.path()).unwrap().len(), 2);
}

#[test]
fn dropped_and_damaged_frames_within_the_limit_are_told_and_kept() {
    let mut rig = Rehearsal::with(SHORT, "&drop=220&damage=240", "sim:?speed=3", |settings| {
        settings.degrees_per_second = 36.0;
        settings.max_dropped = 2;
    });
    let take = rig.capture(false).unwrap();
    assert_eq!(
        (take.verdict, take.dropped),
        (Verdict::Tolerated, 1),
        "{take:?}"
    );
    let manifest = rig.session(&take).manifest.unwrap();
    let told: Vec<_> = manifest
        .faults
        .iter()
        .map(|fault| fault.what.as_str())
        .collect();
    assert!(
        told.iter()
            .any(|what| what.contains("missing before frame")),
        "{told:?}"
    );
    assert!(
        told.iter().any(|what| what.contains("is damaged")),
        "{told:?}"
    );
}

#[test]
fn a_controller_that_restarts_in_the_turn_ends_the_take() {
    let mut rig = Rehearsal::new(SHORT, "", "sim:?speed=3&fault=reset@35s");
    let take = rig.capture(false).unwrap();
    check_aborted(&rig, &take, "restarted");
    // Its position is lost: the next take looks for zero again, and comes out well.
    rig.equipment.drop_table();
    thread::sleep(Duration::from_millis(1100));
    let again = rig.capture(false).unwrap();
    assert_eq!(again.verdict, Verdict::Clean, "{again:?}");
}

#[test]
fn a_table_that_stalls_ends_the_take() {
    let mut rig = Rehearsal::new(SHORT, "", "sim:?speed=3&fault=stall@35s");
    let take = rig.capture(false).unwrap();
    check_aborted(&rig, &take, "could not be seen at rest");
}

/// Runs a capture while `meddle` waits for its 50th frame and then does something.
fn meddle_in_the_turn(rig: &mut Rehearsal, meddle: impl FnOnce() + Send) -> TakeSummary {
    let monitor = rig.monitor.clone();
    thread::scope(|scope| {
        scope.spawn(move || {
            let until = Instant::now() + Duration::from_secs(120);
            while monitor.state().frames < 50 && Instant::now() < until {
                thread::sleep(Duration::from_millis(10));
            }
            meddle();
        });
        rig.capture(false).unwrap()
    })
}

#[test]
fn a_stop_ends_the_take_within_seconds_and_stops_the_table() {
    let mut rig = Rehearsal::new(SHORT, "", "sim:?speed=3");
    let stop = rig.stop.clone();
    let asked = std::sync::Mutex::new(None);
    let take = meddle_in_the_turn(&mut rig, || {
        *asked.lock().unwrap() = Some(Instant::now());
        stop.ask(Stopped::Shutdown);
    });
    let took = asked.lock().unwrap().unwrap().elapsed();
    assert!(took < Duration::from_secs(5), "{took:?}");
    check_aborted(&rig, &take, "the program was told to end");
    // Whoever tries again while the program ends is refused.
    let error = rig.capture(false).unwrap_err();
    assert!(matches!(error, CaptureError::Stopped(Stopped::Shutdown)));
}

#[test]
fn a_serial_line_that_is_unplugged_ends_the_take_and_the_next_one_finds_it_again() {
    let ports = tempfile::tempdir().unwrap();
    let link = ports.path().join("table");
    let table = || Simulator::start(&SimulatorOptions::default(), Some(&link)).unwrap();
    let simulator = table();
    let address = format!("serial:{}", link.display());
    let mut rig = Rehearsal::with(SHORT, "", &address, |settings| {
        settings.degrees_per_second = 36.0;
    });
    let take = meddle_in_the_turn(&mut rig, || drop(simulator));
    assert_eq!(take.verdict, Verdict::Aborted);
    let reason = take.reason.unwrap();
    assert!(reason.contains("the port is gone"), "{reason}");
    let simulator = table();
    rig.equipment.drop_table();
    thread::sleep(Duration::from_millis(1100));
    let again = rig.capture(false).unwrap();
    assert_eq!(again.verdict, Verdict::Clean, "{again:?}");
    drop(simulator);
}

#[test]
fn a_camera_whose_exposure_cannot_be_set_is_not_metered_and_nothing_is_recorded() {
    let mut rig = quick("");
    let error = rig.capture(true).unwrap_err();
    let fault = matches!(error, CaptureError::Meter(MeterFault::NoExposure));
    assert!(fault, "{error}");
    assert!(rig.table_stands());
    assert!(recordings(rig.root.path()).is_err(), "no session was begun");
}

#[test]
fn what_preflight_refuses_is_said_with_its_numbers_and_nothing_turns() {
    let root = tempfile::tempdir().unwrap();
    let error = check_disk(root.path(), 1 << 60).unwrap_err();
    assert!(matches!(
        error,
        CaptureError::Refused(Refusal::DiskFull { .. })
    ));
    let error = with_causes(&error);
    assert!(error.contains("1383505805529 MB"), "{error}");

    let mut rig = Rehearsal::with(SHORT, "", "sim:?speed=3", |settings| {
        settings.min_battery_v = Some(13.0);
    });
    let error = with_causes(&rig.capture(false).unwrap_err());
    assert!(error.contains("V and 13.00 V are demanded"), "{error}");
    let simulator = rig.equipment.simulator().unwrap();
    assert_eq!(simulator.angle_at(rig.equipment.clock().now_us()), 0.0);
    drop(rig);

    let mut rig = Rehearsal::with(SHORT, "", "sim:?speed=3", |settings| {
        settings.mode.fps = 60.0;
    });
    let error = with_causes(&rig.capture(false).unwrap_err());
    assert!(
        error.contains("does not offer any format of any size at 60"),
        "{error}"
    );
}
