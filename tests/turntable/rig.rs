//! A simulated table, and a host that has its port.

use relit_rig::clock::Clock;
use relit_rig::simulator::{Simulator, SimulatorOptions};
use relit_rig::turntable::{Options, Table, TurnPlan, TurnRequest};
use tempfile::TempDir;

/// Degrees in one step, at the firmware's default of 88.889 steps a degree.
pub(crate) const STEP_DEG: f64 = 1.0 / 88.889;

/// A simulated table and the folder in which its owner leaves lock and socket.
pub(crate) struct Rig {
    pub(crate) simulator: Simulator,
    pub(crate) options: Options,
    _folder: TempDir,
}

impl Rig {
    /// A table that runs `speed` times faster than real time, with `faults`.
    pub(crate) fn new(speed: f64, faults: &str) -> Rig {
        Rig::with(speed, faults, SimulatorOptions::default())
    }

    pub(crate) fn with(speed: f64, faults: &str, options: SimulatorOptions) -> Rig {
        let clock = if speed == 1.0 {
            Clock::monotonic()
        } else {
            Clock::scaled(speed)
        };
        let simulator = Simulator::start(SimulatorOptions {
            clock: clock.clone(),
            faults: faults.parse().unwrap(),
            ..options
        })
        .unwrap();
        let folder = TempDir::new().unwrap();
        let options = Options {
            clock,
            runtime_folder: folder.path().to_owned(),
            ..Options::default()
        };
        Rig {
            simulator,
            options,
            _folder: folder,
        }
    }

    /// A table whose host uses nothing beyond Grbl: no checksums, no chip's time.
    pub(crate) fn plain(mut self) -> Rig {
        self.options.extras = false;
        self
    }

    /// Opens the port as a program would.
    pub(crate) fn open(&self) -> Table {
        Table::open_serial(self.simulator.path(), &self.options).unwrap()
    }

    /// Where the table stands in truth, degrees.
    pub(crate) fn truth(&self) -> f64 {
        self.simulator.angle_at(self.options.clock.now_us())
    }
}

/// The paper's turn: 360 degrees at 7.2 degrees/s, between margins.
pub(crate) fn paper_turn(table: &Table) -> TurnPlan {
    let request = TurnRequest {
        degrees_per_second: 7.2,
        turn_deg: 360.0,
        margin_deg: 3.6,
        direction: None,
        unwind: true,
    };
    TurnPlan::new(table.identity(), &table.status().unwrap(), &request).unwrap()
}

/// Median, 99th percentile and largest of what is given, without their signs.
pub(crate) fn spread(values: impl IntoIterator<Item = f64>) -> (f64, f64, f64) {
    let mut sorted: Vec<f64> = values.into_iter().map(f64::abs).collect();
    sorted.sort_by(f64::total_cmp);
    let at = |share: f64| sorted[((sorted.len() - 1) as f64 * share).round() as usize];
    (at(0.5), at(0.99), at(1.0))
}
