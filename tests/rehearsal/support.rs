//! A rig of a replayed camera and a simulated table, and what it leaves.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use relit_data::session::Recording;
use relit_rig::capture::{
    CaptureContext, CaptureError, CaptureRequest, Captured, Equipment, Settings, StopRequest,
    capture,
};
use relit_rig::state::{Monitor, TakeSummary};

/// A whole turn, H.264 out of order, which a replay delivers as raw pictures.
pub(crate) const TURN: &str = "20261120T093015Z-cow";
/// Motion JPEG, 150 frames.
pub(crate) const SHORT: &str = "20261120T101500Z-cow-short";

pub(crate) fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("fixtures")
        .join(name)
}

/// Rigs that run faster than real time need the machine for themselves: one test at a time.
pub(crate) fn alone() -> MutexGuard<'static, ()> {
    static ONE: Mutex<()> = Mutex::new(());
    ONE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A rig whose sessions go into a folder of its own.
pub(crate) struct Rehearsal {
    pub(crate) root: tempfile::TempDir,
    pub(crate) equipment: Equipment,
    pub(crate) monitor: Monitor,
    pub(crate) stop: StopRequest,
    _alone: MutexGuard<'static, ()>,
}

impl Rehearsal {
    /// `camera`: options of the replay, such as `drop=7`; `table`: options of the simulator.
    pub(crate) fn new(fixture_name: &str, camera: &str, table: &str) -> Self {
        Self::with(fixture_name, camera, table, |_| {})
    }

    pub(crate) fn with(
        fixture_name: &str,
        camera: &str,
        table: &str,
        change: impl FnOnce(&mut Settings),
    ) -> Self {
        let alone = alone();
        let root = tempfile::tempdir().unwrap();
        let camera = format!("replay:{}?loop=1{camera}", fixture(fixture_name).display());
        let mut settings = Settings::new(
            root.path().to_owned(),
            camera.parse().unwrap(),
            table.parse().unwrap(),
        );
        settings.runtime_folder = root.path().to_owned();
        settings.retries = 0;
        change(&mut settings);
        Self {
            root,
            equipment: Equipment::new(settings).unwrap(),
            monitor: Monitor::default(),
            stop: StopRequest::default(),
            _alone: alone,
        }
    }

    /// Captures, and gives the take that counts.
    pub(crate) fn capture(&mut self, meter: bool) -> Result<TakeSummary, CaptureError> {
        Ok(self.capture_all(meter)?.take)
    }

    pub(crate) fn capture_all(&mut self, meter: bool) -> Result<Captured, CaptureError> {
        let context = CaptureContext {
            monitor: &self.monitor,
            preview: None,
            stop: &self.stop,
        };
        let request = CaptureRequest {
            object: "mug".to_owned(),
            meter,
        };
        capture(&mut self.equipment, &request, context)
    }

    /// The session that a take left.
    pub(crate) fn session(&self, take: &TakeSummary) -> Recording {
        Recording::open(&self.root.path().join(&take.session)).unwrap()
    }

    /// Asks the simulator whether its table stands.
    pub(crate) fn table_stands(&self) -> bool {
        let simulator = self.equipment.simulator().unwrap();
        let clock = self.equipment.clock();
        let at = simulator.angle_at(clock.now_us());
        // Half a second of the table's time: it would be degrees further.
        clock.sleep(std::time::Duration::from_millis(500));
        (simulator.angle_at(clock.now_us()) - at).abs() < 1e-9
    }
}
