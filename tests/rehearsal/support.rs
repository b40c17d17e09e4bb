//! A rig of a replayed camera and a simulated table, and what it leaves.

use std::path::{Path, PathBuf};
use std::time::Duration;

use relit_capture::capture::{
    CaptureContext, CaptureError, CaptureOutcome, Equipment, Settings, StopRequest, capture,
};
use relit_capture::state::{Monitor, TakeSummary};
use relit_data::clock::Participant;
use relit_data::session::Recording;
use relit_turntable::simulator::SimulatedTable;

/// A whole turn, H.264 out of order, which a replay delivers as raw pictures.
pub(crate) const TURN: &str = "20261120T093015Z-cow";
/// Motion JPEG, 150 frames.
pub(crate) const SHORT: &str = "20261120T101500Z-cow-short";

pub(crate) fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../fixtures")
        .join(name)
}

/// A rig on virtual time, whose sessions go into its own folder. The test's thread takes part.
pub(crate) struct Rehearsal {
    pub(crate) root: tempfile::TempDir,
    pub(crate) equipment: Equipment,
    pub(crate) monitor: Monitor,
    pub(crate) stop: StopRequest,
    _part: Participant,
}

impl Rehearsal {
    /// A whole turn; `table`: options of the simulated table, such as `&fault=stall@35s`.
    pub(crate) fn whole(fixture_name: &str, table: &str) -> Self {
        let table = format!("sim:?speed=0{table}");
        Self::with(fixture_name, "", &table, |_| {})
    }

    /// A turn of ten seconds, 300 frames; `camera`: options of the replay, such as `&drop=7`.
    pub(crate) fn short(camera: &str, change: impl FnOnce(&mut Settings)) -> Self {
        Self::with(SHORT, camera, "sim:?speed=0", |settings| {
            settings.degrees_per_second = 36.0;
            change(settings);
        })
    }

    /// `table`: its address. Takes are not repeated, unless `change` says so.
    pub(crate) fn with(
        fixture_name: &str,
        camera: &str,
        table: &str,
        change: impl FnOnce(&mut Settings),
    ) -> Self {
        let root = tempfile::tempdir().unwrap();
        let camera = format!("replay:{}?loop=1{camera}", fixture(fixture_name).display());
        let mut settings = Settings::new(
            root.path().to_owned(),
            camera.parse().unwrap(),
            table.parse().unwrap(),
        );
        settings.retries = 0;
        change(&mut settings);
        let equipment = Equipment::new(settings).unwrap();
        let clock = equipment.clock();
        Self {
            root,
            equipment,
            monitor: Monitor::default(),
            stop: StopRequest::new(&clock),
            _part: clock.participate(),
        }
    }

    /// The same, with its sessions in `root`.
    pub(crate) fn in_folder(mut self, root: &Path) -> Self {
        let mut settings = self.equipment.settings().clone();
        settings.root = root.to_owned();
        self.equipment = Equipment::new(settings).unwrap();
        let clock = self.equipment.clock();
        self.stop = StopRequest::new(&clock);
        self._part = clock.participate();
        self
    }

    /// Captures, and gives the take that counts.
    pub(crate) fn capture(&mut self) -> Result<TakeSummary, CaptureError> {
        Ok(self.capture_all()?.take)
    }

    pub(crate) fn capture_all(&mut self) -> Result<CaptureOutcome, CaptureError> {
        let context = CaptureContext {
            monitor: &self.monitor,
            preview: None,
            stop: &self.stop,
        };
        capture(&mut self.equipment, "mug", context)
    }

    /// The session that a take left.
    pub(crate) fn session(&self, take: &TakeSummary) -> Recording {
        Recording::open(&self.root.path().join(&take.session)).unwrap()
    }

    /// Whether the equipment's simulated table stands.
    pub(crate) fn table_stands(&self) -> bool {
        self.stands(self.equipment.simulator().unwrap())
    }

    /// Whether a simulated table stands.
    pub(crate) fn stands(&self, table: &SimulatedTable) -> bool {
        let clock = self.equipment.clock();
        let at = table.angle_at(clock.now_us());
        // It would be degrees further.
        clock.sleep(Duration::from_millis(500));
        (table.angle_at(clock.now_us()) - at).abs() < 1e-9
    }
}
