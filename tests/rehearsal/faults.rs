//! Takes that go wrong: each fault ends with its own sentence, nothing of the session is lost, and
//! the table stands.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use relit_camera::{
    self as camera, Camera, CameraError, CameraMode, Control, DeviceInfo, Frame, Mode,
};
use relit_capture::capture::{CaptureError, Settings, StopReason};
use relit_capture::state::{LogLine, Phase, TakeSummary, Verdict};
use relit_data::session::{Status, recordings};
use relit_turntable::simulator::{SimulatedPort, SimulatedTable, SimulatorOptions};
use relit_turntable::{self as turntable, MotionFault, Port, Table, TurntableError};

use crate::support::{Rehearsal, SHORT};

/// Checks that a take was kept as aborted for a reason that names this, and that the table stands.
fn check_aborted(rig: &Rehearsal, take: &TakeSummary, named: &str) {
    assert_eq!(take.verdict, Verdict::Aborted, "{take:?}");
    let reason = take.reason.as_deref().unwrap();
    assert!(reason.contains(named), "{reason}");
    let session = rig.session(take);
    let manifest = session.manifest.unwrap();
    assert_eq!(manifest.status, Status::Aborted(reason.to_owned()));
    assert!(rig.table_stands());
}

/// The camera, as errors name it.
fn device(rig: &Rehearsal) -> String {
    rig.equipment.settings().camera.to_string()
}

#[test]
fn a_camera_unplugged_in_the_turn_ends_the_take_and_what_came_before_is_kept() {
    let mut rig = Rehearsal::short("&unplug=220", |_| {});
    let take = rig.capture().unwrap();
    let unplugged = CameraError::Unplugged {
        device: device(&rig),
        source: None,
    };
    check_aborted(&rig, &take, &unplugged.to_string());
    assert!(take.frames > 0);
}

#[test]
fn a_camera_that_falls_silent_ends_the_take() {
    let mut rig = Rehearsal::short("&stall=220", |_| {});
    let take = rig.capture().unwrap();
    // How long it was waited for.
    check_aborted(&rig, &take, "2.0 s");
}

#[test]
fn a_camera_that_changes_its_size_ends_the_take() {
    let mut rig = Rehearsal::short("&resize=220", |_| {});
    let take = rig.capture().unwrap();
    check_aborted(&rig, &take, " x ");
}

#[test]
fn a_take_with_a_dropped_frame_is_repeated_and_both_are_kept() {
    let mut rig = Rehearsal::short("&drop=220", |settings| settings.retries = 1);
    let take = rig.capture().unwrap();
    check_aborted(&rig, &take, "1 frame");
    assert_eq!((take.frames, take.dropped), (299, 1));
    assert_eq!(recordings(rig.root.path()).unwrap().len(), 2);
    let faults = rig.monitor.state().faults;
    assert!(faults[0].what.contains("1 frame"), "{faults:?}");
}

#[test]
fn a_tolerated_take_is_not_repeated_with_the_usual_settings() {
    let mut rig = Rehearsal::short("&drop=220", |settings| {
        let (camera, table) = (settings.camera.clone(), settings.turntable.clone());
        let usual = Settings::new(settings.root.clone(), camera, table);
        settings.retries = usual.retries;
        settings.max_dropped = 5;
    });
    let captured = rig.capture_all().unwrap();
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

    fn set_control(&mut self, id: u32, value: i64) -> Result<i64, CameraError> {
        self.camera.set_control(id, value)
    }

    fn start(&mut self, want: &CameraMode) -> Result<CameraMode, CameraError> {
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
    let mut rig = Rehearsal::short("", |settings| settings.retries = 1);
    let equipment = &mut rig.equipment;
    let camera = camera::open(&equipment.settings().camera, equipment.clock()).unwrap();
    equipment.camera = Some(Box::new(LosesOneFrame {
        camera,
        frames_until_loss: 220,
    }));
    let captured = rig.capture_all().unwrap();
    assert_eq!(captured.take.verdict, Verdict::Clean, "{captured:?}");
    assert_eq!(captured.repeated, 1);
    assert_eq!(recordings(rig.root.path()).unwrap().len(), 2);
}

#[test]
fn dropped_and_damaged_frames_within_the_limit_are_listed_and_kept() {
    let camera = "&drop=220&damage=240";
    let mut rig = Rehearsal::short(camera, |settings| settings.max_dropped = 2);
    let take = rig.capture().unwrap();
    assert_eq!(
        (take.verdict, take.dropped),
        (Verdict::Tolerated, 1),
        "{take:?}"
    );
    let state = rig.monitor.state();
    assert_eq!((state.frames, state.dropped), (take.frames, take.dropped));
    let manifest = rig.session(&take).manifest.unwrap();
    let faults: Vec<_> = manifest
        .faults
        .iter()
        .map(|fault| fault.what.as_str())
        .collect();
    // One frame that is lost, and one that is damaged.
    let of_frames = faults.iter().filter(|what| what.contains("frame "));
    assert_eq!(of_frames.count(), 2, "{faults:?}");
}

#[test]
fn a_controller_that_restarts_in_the_turn_ends_the_take() {
    let mut rig = Rehearsal::whole(SHORT, "&fault=reset@35s");
    let take = rig.capture().unwrap();
    let restarted = MotionFault::Restarted(None).to_string();
    // Its cause stands before the comma.
    let (_, consequence) = restarted.split_once(',').unwrap();
    check_aborted(&rig, &take, consequence);
    // Its position is lost: the next take looks for zero again, and comes out well.
    rig.equipment.table = None;
    let again = rig.capture().unwrap();
    assert_eq!(again.verdict, Verdict::Clean, "{again:?}");
}

#[test]
fn a_table_that_stalls_ends_the_take() {
    let mut rig = Rehearsal::whole(SHORT, "&fault=stall@35s");
    let take = rig.capture().unwrap();
    check_aborted(&rig, &take, &TurntableError::NotStopped.to_string());
}

/// Runs a capture, and `interfere` two seconds after its recording began.
fn interfere_in_the_turn(rig: &mut Rehearsal, interfere: impl FnOnce() + Send) -> TakeSummary {
    interfere_in(Phase::Recording, rig, interfere)
}

/// Runs a capture, and `interfere` two seconds after this phase began.
fn interfere_in(phase: Phase, rig: &mut Rehearsal, interfere: impl FnOnce() + Send) -> TakeSummary {
    let (clock, monitor) = (rig.equipment.clock(), rig.monitor.clone());
    let recording = || monitor.state().phase == phase;
    clock.scope(|scope| {
        let interferes = scope.spawn("interferes", || {
            // Longer than a whole capture.
            let mut tenths = (0..3000).map(|_| clock.sleep(Duration::from_millis(100)));
            tenths.find(|()| recording()).unwrap();
            clock.sleep(Duration::from_secs(2));
            interfere();
        });
        interferes.unwrap();
        rig.capture().unwrap()
    })
}

#[test]
fn a_stop_ends_the_take_within_five_seconds_and_stops_the_table() {
    let mut rig = Rehearsal::whole(SHORT, "");
    let (clock, stop) = (rig.equipment.clock(), rig.stop.clone());
    let mut asked_us = 0;
    let take = interfere_in_the_turn(&mut rig, || {
        asked_us = clock.now_us();
        stop.request(StopReason::Shutdown);
    });
    let took_us = clock.now_us() - asked_us;
    assert!(took_us < 5_000_000, "{took_us} us");
    check_aborted(&rig, &take, &StopReason::Shutdown.to_string());
    assert!(take.is_stopped);
    // Another capture while the program ends is refused.
    let error = rig.capture().unwrap_err();
    assert!(matches!(error, CaptureError::Stopped(StopReason::Shutdown)));
}

/// Checks that a take is whole although its table did not turn back.
fn check_whole(rig: &Rehearsal, take: &TakeSummary) {
    assert_eq!(take.verdict, Verdict::Clean, "{take:?}");
    let session = rig.session(take);
    assert_eq!(session.manifest.unwrap().status, Status::Complete);
    let frames = session.frames.unwrap();
    assert_eq!(frames.entries().len(), 1500);
    assert!(
        frames
            .entries()
            .iter()
            .all(|entry| entry.angle_deg.is_some())
    );
    assert!(rig.table_stands());
}

#[test]
fn a_stop_while_the_table_turns_back_stops_the_table_and_costs_no_take() {
    let mut rig = Rehearsal::whole(SHORT, "");
    let stop = rig.stop.clone();
    let take = interfere_in(Phase::Unwinding, &mut rig, || {
        stop.request(StopReason::Shutdown)
    });
    check_whole(&rig, &take);
    let state = rig.monitor.state();
    assert!(state.faults.is_empty(), "{:?}", state.faults);
    let is_noted = |line: &LogLine| line.what.contains("did not turn back");
    assert!(state.log.iter().any(is_noted), "{:?}", state.log);
    let at = rig.equipment.simulator().unwrap();
    assert!(at.angle_at(rig.equipment.clock().now_us()) > 30.0);
}

#[test]
fn an_emergency_stop_while_the_table_turns_back_costs_no_take() {
    let mut rig = Rehearsal::whole(SHORT, "");
    let table = rig.equipment.simulator().unwrap().clone();
    let take = interfere_in(Phase::Unwinding, &mut rig, || {
        table.press_emergency_stop(true)
    });
    check_whole(&rig, &take);
    let fault = rig.monitor.state().faults.back().unwrap().what.clone();
    assert!(fault.contains("ALARM:10"), "{fault}");
    let error = rig.capture().unwrap_err();
    assert!(
        matches!(
            error,
            CaptureError::Turntable(TurntableError::EmergencyStop)
        ),
        "{error:?}"
    );
}

#[test]
fn a_take_that_was_stopped_in_its_turn_keeps_the_angles_it_had() {
    let mut rig = Rehearsal::whole(SHORT, "");
    let stop = rig.stop.clone();
    let take = interfere_in_the_turn(&mut rig, || stop.request(StopReason::Person));
    check_aborted(&rig, &take, &StopReason::Person.to_string());
    assert!(take.is_stopped);
    let session = rig.session(&take);
    let entries = session.frames.as_ref().unwrap().entries();
    let table = rig.equipment.simulator().unwrap();
    let known = entries
        .iter()
        .filter_map(|entry| Some((entry.t_us, entry.angle_deg?)));
    let errors: Vec<f64> = known
        .map(|(t_us, angle)| (angle - table.angle_at(t_us)).abs())
        .collect();
    assert!(errors.len() >= 40, "{} of {}", errors.len(), entries.len());
    assert!(errors.iter().all(|error| *error <= 0.05), "{errors:?}");
}

/// A table's port that can be unplugged.
struct Unpluggable {
    port: SimulatedPort,
    unplugged: Arc<AtomicBool>,
}

impl Unpluggable {
    fn check(&self) -> io::Result<()> {
        if self.unplugged.load(Ordering::Relaxed) {
            Err(io::ErrorKind::BrokenPipe.into())
        } else {
            Ok(())
        }
    }
}

impl Port for Unpluggable {
    fn read(&mut self, buffer: &mut [u8], wait: Duration) -> io::Result<usize> {
        self.check()?;
        self.port.read(buffer, wait)
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.check()?;
        self.port.write(bytes)
    }

    fn name(&self) -> String {
        self.port.name()
    }

    fn resets(&self) -> bool {
        self.port.resets()
    }
}

#[test]
fn a_serial_line_that_is_unplugged_ends_the_take_and_the_next_one_finds_it_again() {
    let mut rig = Rehearsal::short("", |_| {});
    let clock = rig.equipment.clock();
    let simulated = SimulatedTable::new(&SimulatorOptions {
        clock: clock.clone(),
        ..SimulatorOptions::default()
    });
    let plug_in = |unplugged: &Arc<AtomicBool>| {
        let port = Unpluggable {
            port: simulated.open(),
            unplugged: Arc::clone(unplugged),
        };
        let options = turntable::TableOptions {
            clock: clock.clone(),
            ..turntable::TableOptions::default()
        };
        Table::open(port, &options).unwrap()
    };
    let unplugged = Arc::new(AtomicBool::new(false));
    rig.equipment.table = Some(plug_in(&unplugged));
    let take = interfere_in_the_turn(&mut rig, || unplugged.store(true, Ordering::Relaxed));
    assert_eq!(take.verdict, Verdict::Aborted);
    let reason = take.reason.unwrap();
    let gone = MotionFault::PortLost(io::Error::from(io::ErrorKind::BrokenPipe).to_string());
    assert!(reason.contains(&gone.to_string()), "{reason}");
    rig.equipment.table = None;
    unplugged.store(false, Ordering::Relaxed);
    rig.equipment.table = Some(plug_in(&unplugged));
    let again = rig.capture().unwrap();
    assert_eq!(again.verdict, Verdict::Clean, "{again:?}");
    assert!(rig.stands(&simulated));
}

#[test]
fn what_preflight_refuses_is_reported_and_nothing_turns() {
    let mut rig = Rehearsal::short("", |settings| settings.mode.fps = 60.0);
    let error = rig.capture().unwrap_err();
    assert!(matches!(error, CaptureError::Refused(_)), "{error:?}");
    assert!(error.to_string().contains("60"), "{error}");
    let simulator = rig.equipment.simulator().unwrap();
    assert_eq!(simulator.angle_at(rig.equipment.clock().now_us()), 0.0);
}
