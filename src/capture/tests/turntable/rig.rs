//! A simulated table and its host, on virtual time or at a port in real time.

use relit_data::clock::{Clock, Participant};
use relit_turntable::simulator::{
    SerialFaults, SimulatedTable, Simulator, SimulatorOptions, TableFaults,
};
use relit_turntable::{Table, TableOptions, TurnPlan, TurntableError};

/// Degrees in one step, at the firmware's default of 88.889 steps a degree.
pub(crate) const STEP_DEG: f64 = 1.0 / 88.889;

/// A simulated table on virtual time. The test's thread takes part in it.
pub(crate) struct Rig {
    pub(crate) simulated: SimulatedTable,
    pub(crate) options: TableOptions,
    _participant: Participant,
}

impl Rig {
    /// A table with `faults`.
    pub(crate) fn new(faults: &str) -> Rig {
        Rig::with(SimulatorOptions {
            faults: match faults {
                "" => TableFaults::default(),
                faults => faults.parse().unwrap(),
            },
            ..SimulatorOptions::default()
        })
    }

    /// A table at a bad wire.
    pub(crate) fn wired(faults: SerialFaults, seed: u64) -> Rig {
        Rig::with(SimulatorOptions {
            faults: TableFaults {
                to_chip: faults,
                from_chip: faults,
                ..TableFaults::default()
            },
            seed,
            ..SimulatorOptions::default()
        })
    }

    pub(crate) fn with(options: SimulatorOptions) -> Rig {
        let clock = Clock::virtual_time();
        let participant = clock.participate();
        let simulated = SimulatedTable::new(&SimulatorOptions {
            clock: clock.clone(),
            ..options
        });
        Rig {
            simulated,
            options: TableOptions {
                clock,
                ..TableOptions::default()
            },
            _participant: participant,
        }
    }

    /// A table whose host uses nothing beyond Grbl: no checksums, no chip's time.
    pub(crate) fn plain(mut self) -> Rig {
        self.options.extras = false;
        self
    }

    /// Opens the port as a program would.
    pub(crate) fn open(&self) -> Table {
        self.try_open().unwrap()
    }

    pub(crate) fn try_open(&self) -> Result<Table, TurntableError> {
        Table::open(self.simulated.open(), &self.options)
    }

    /// Where the table stands in truth, degrees.
    pub(crate) fn truth(&self) -> f64 {
        self.simulated.angle_at(self.options.clock.now_us())
    }
}

/// A simulated table on a pseudoterminal, in real time.
pub(crate) struct PacedRig {
    pub(crate) simulator: Simulator,
    pub(crate) options: TableOptions,
}

impl PacedRig {
    pub(crate) fn new(options: &SimulatorOptions) -> PacedRig {
        PacedRig {
            simulator: Simulator::start(options, None).unwrap(),
            options: TableOptions::default(),
        }
    }

    pub(crate) fn open(&self) -> Table {
        Table::open_serial(self.simulator.path(), &self.options).unwrap()
    }
}

/// The paper's turn: 360 degrees at 7.2 degrees/s, between margins.
pub(crate) fn paper_turn(table: &Table) -> TurnPlan {
    turn_by(table, 360.0)
}

/// As much of the paper's turn.
pub(crate) fn turn_by(table: &Table, turn_deg: f64) -> TurnPlan {
    TurnPlan::new(table.identity(), &table.status().unwrap(), 7.2, turn_deg).unwrap()
}

/// Median, 99th percentile and largest of what is given, without their signs.
pub(crate) fn spread(values: impl IntoIterator<Item = f64>) -> (f64, f64, f64) {
    let mut sorted: Vec<f64> = values.into_iter().map(f64::abs).collect();
    sorted.sort_by(f64::total_cmp);
    let at = |share: f64| sorted[((sorted.len() - 1) as f64 * share).round() as usize];
    (at(0.5), at(0.99), at(1.0))
}
