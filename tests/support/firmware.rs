//! A table without a chip: the core on a board of pure time, where a test holds every wire.

use std::collections::VecDeque;

use rig_firmware::board::{Board, Events, Inputs, Outputs, ResetCause};
use rig_firmware::controller::Controller;
use rig_firmware::realtime::{Received, classify};
use rig_firmware::stepper::Stepper;

/// Timer ticks a microsecond.
const TICKS: u64 = 2;
/// One byte at 115200 baud.
const BYTE_US: u64 = 87;
/// One round of the main loop.
const ROUND_US: u64 = 100;
/// Bytes that the receive buffer holds.
const RECEIVE_BUFFER: usize = 128;

/// Steps of a turn at 88.889 steps/degree.
const TURN: i32 = 32_000;

/// A pulse: when, in ticks, and the position after it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Edge {
    /// Timer ticks.
    pub at: u64,
    /// Steps.
    pub position: i32,
}

/// The highest speed in steps/s, and the highest acceleration in steps/s^2: from the mean speeds
/// over neighbouring stretches of some steps, each of which is the speed in its middle.
pub fn extremes(edges: &[Edge]) -> (f64, f64) {
    const STRETCH: usize = 16;
    let mut fastest = 0.0_f64;
    for pair in edges.windows(2) {
        fastest = fastest.max(2e6 / (pair[1].at - pair[0].at) as f64);
    }
    let mut hardest = 0.0_f64;
    for span in edges.windows(2 * STRETCH + 1) {
        let before = (span[STRETCH].at - span[0].at) as f64 / 2e6;
        let after = (span[2 * STRETCH].at - span[STRETCH].at) as f64 / 2e6;
        let change = STRETCH as f64 / after - STRETCH as f64 / before;
        hardest = hardest.max(change.abs() * 2.0 / (before + after));
    }
    (fastest, hardest)
}

/// A board whose time continues only as the test lets it.
pub struct FakeBoard {
    /// The firmware's stepper.
    pub stepper: Stepper,
    /// The time, timer ticks.
    pub now: u64,
    next: Option<u64>,
    forward: bool,
    /// Where the motor stands, whatever the stepper calls it.
    pub turned: i32,
    /// All pulses so far.
    pub edges: Vec<Edge>,
    receive: VecDeque<u8>,
    /// Bytes to the host that were not read yet.
    pub sent: Vec<u8>,
    events: Events,
    /// The index is active from the first to before the second position of every turn.
    pub index: (i32, i32),
    /// Positions at which the index fails to show.
    pub index_gap: Option<i32>,
    /// Whether the index switch is wired the other way.
    pub inverted_index: bool,
    /// Whether the emergency stop is pressed.
    pub emergency: bool,
    /// The supply, millivolts.
    pub battery: u16,
    /// What outlasts a reset.
    pub eeprom: Vec<u8>,
    /// Writes until the supply goes away.
    pub writes_left: usize,
    /// Whether the motor's driver is on.
    pub driver: bool,
    /// What the core last set.
    pub outputs: Option<Outputs>,
    /// Why the chip was reset.
    pub cause: ResetCause,
    /// Bytes from the host that come one after the other as time continues.
    wire: VecDeque<u8>,
    wire_at: u64,
}

impl FakeBoard {
    /// A board after a power cut, nothing pressed.
    #[allow(clippy::new_without_default, reason = "made by tests alone")]
    pub fn new() -> FakeBoard {
        FakeBoard {
            stepper: Stepper::new(),
            now: 0,
            next: None,
            forward: true,
            turned: 0,
            edges: Vec::new(),
            receive: VecDeque::new(),
            sent: Vec::new(),
            events: Events::NONE,
            index: (i32::MAX, i32::MAX),
            index_gap: None,
            inverted_index: false,
            emergency: false,
            battery: 0,
            eeprom: vec![0xFF; 1024],
            writes_left: usize::MAX,
            driver: false,
            outputs: None,
            cause: ResetCause::PowerOn,
            wire: VecDeque::new(),
            wire_at: 0,
        }
    }

    fn index_level(&self) -> bool {
        let active = (self.index.0..self.index.1).contains(&self.turned.rem_euclid(TURN))
            && self.index_gap != Some(self.turned);
        active != self.inverted_index
    }

    /// What the receive interrupt does.
    pub fn hear(&mut self, byte: u8) {
        self.events.insert(Events::RECEIVED);
        match classify(byte) {
            Received::Data(_) if self.receive.len() >= RECEIVE_BUFFER => {
                self.events.insert(Events::LOST_INPUT);
            }
            Received::Data(byte) => self.receive.push_back(byte),
            Received::Realtime(realtime) => {
                self.stepper.obey(realtime);
                self.events.insert(realtime.into());
            }
        }
    }

    /// A byte that came damaged.
    pub fn lose_byte(&mut self) {
        self.events.insert(Events::LOST_INPUT);
    }

    /// What the interrupt of the emergency-stop pin does; whether it stops the table.
    pub fn press_emergency(&mut self, level: bool) -> bool {
        self.emergency = level;
        let active = self.stepper.emergency(level);
        if active {
            self.events.insert(Events::EMERGENCY);
        }
        active
    }

    /// Lets time go on, with all that interrupts do in it.
    pub fn pass(&mut self, us: u64) {
        let end = self.now + us * TICKS;
        loop {
            let step = self.next.filter(|at| *at <= end);
            let byte = (!self.wire.is_empty())
                .then_some(self.wire_at)
                .filter(|at| *at <= end);
            match (step, byte) {
                (Some(at), byte) if byte.is_none_or(|byte| at <= byte) => self.fire(at),
                (_, Some(at)) => {
                    self.now = self.now.max(at);
                    self.wire_at = at.max(self.now) + BYTE_US * TICKS;
                    let byte = self.wire.pop_front().unwrap();
                    self.hear(byte);
                }
                _ => break,
            }
        }
        self.now = end;
    }

    fn fire(&mut self, at: u64) {
        self.now = self.now.max(at);
        let forward = self.forward;
        let fire = self.stepper.fire(self.index_level());
        if fire.pulse {
            assert!(self.driver, "a pulse to a driver that is off");
            self.turned += if forward { 1 } else { -1 };
            let position = self.turned;
            self.edges.push(Edge { at, position });
        }
        self.forward = fire.forward;
        self.next = fire.next.map(|ticks| at + u64::from(ticks));
    }

    /// Puts bytes on the wire to the board.
    pub fn type_bytes(&mut self, bytes: &[u8]) {
        if self.wire.is_empty() {
            self.wire_at = self.wire_at.max(self.now);
        }
        self.wire.extend(bytes);
    }
}

impl Board for FakeBoard {
    fn with_stepper<R>(&mut self, f: impl FnOnce(&mut Stepper, u32) -> R) -> R {
        let micros = (self.now / TICKS) as u32;
        let result = f(&mut self.stepper, micros);
        if self.stepper.interval().is_none() {
            self.next = None;
        }
        result
    }

    fn start_steps(&mut self) {
        if self.next.is_none() {
            self.next = Some(self.now + 10);
        }
    }

    fn micros(&mut self) -> u32 {
        (self.now / TICKS) as u32
    }

    fn receive(&mut self) -> Option<u8> {
        self.receive.pop_front()
    }

    fn receive_room(&mut self) -> u8 {
        (RECEIVE_BUFFER - self.receive.len()) as u8
    }

    fn take_events(&mut self) -> Events {
        self.events.take()
    }

    fn send(&mut self, byte: u8) {
        self.sent.push(byte);
        self.pass(BYTE_US);
    }

    fn enable_driver(&mut self, enabled: bool) {
        self.driver = enabled;
    }

    fn configure_outputs(&mut self, outputs: Outputs) {
        self.outputs = Some(outputs);
    }

    fn inputs(&mut self) -> Inputs {
        Inputs {
            index: self.index_level(),
            emergency_stop: self.emergency,
        }
    }

    fn battery(&mut self) -> u16 {
        self.battery
    }

    fn eeprom_read(&mut self, address: u16) -> u8 {
        self.eeprom[usize::from(address)]
    }

    fn eeprom_write(&mut self, address: u16, byte: u8) {
        if self.writes_left > 0 {
            self.writes_left -= 1;
            self.eeprom[usize::from(address)] = byte;
        }
        self.pass(3400);
    }

    fn pet_watchdog(&mut self) {}

    fn reset_cause(&mut self) -> ResetCause {
        self.cause
    }
}

/// A table that is switched on.
pub struct Table {
    /// The board.
    pub board: FakeBoard,
    /// The firmware's core.
    pub controller: Controller,
    seen: usize,
    kept: Vec<String>,
}

impl Table {
    /// A new table, past its banner.
    #[allow(clippy::new_without_default, reason = "made by tests alone")]
    pub fn new() -> Table {
        let mut table = Table::on(FakeBoard::new());
        table.heard();
        table
    }

    /// Switches a board on.
    pub fn on(mut board: FakeBoard) -> Table {
        let controller = Controller::new(&mut board);
        Table {
            board,
            controller,
            seen: 0,
            kept: Vec::new(),
        }
    }

    /// One round of the main loop.
    pub fn round(&mut self) {
        self.controller.poll(&mut self.board);
        self.board.pass(ROUND_US);
    }

    /// Runs for a while.
    pub fn run_ms(&mut self, ms: u64) {
        let end = self.board.now + ms * 1000 * TICKS;
        while self.board.now < end {
            self.round();
        }
    }

    /// What the table said since the last look, without the empty lines.
    pub fn heard(&mut self) -> Vec<String> {
        let text = String::from_utf8_lossy(&self.board.sent[self.seen..]).into_owned();
        self.seen = self.board.sent.len();
        let lines = text.split("\r\n").filter(|line| !line.is_empty());
        let mut heard = std::mem::take(&mut self.kept);
        heard.extend(lines.map(str::to_owned));
        heard
    }

    /// Sends bytes and runs until they have come.
    pub fn say(&mut self, bytes: &[u8]) -> Vec<String> {
        self.board.type_bytes(bytes);
        self.run_ms(2 + bytes.len() as u64 / 5);
        self.heard()
    }

    /// Sends a line and runs until it is answered; what was said before the answer comes along.
    pub fn ask(&mut self, line: &str) -> Vec<String> {
        self.board.type_bytes(line.as_bytes());
        self.board.type_bytes(b"\n");
        let mut heard = Vec::new();
        let end = self.board.now + 200_000_000 * TICKS;
        while self.board.now < end {
            self.round();
            heard.extend(self.heard());
            if heard
                .last()
                .is_some_and(|last| last.starts_with("ok") || last.starts_with("error:"))
            {
                return heard;
            }
        }
        panic!("no answer to {line:?}, only {heard:?}");
    }

    /// Sends a line that is answered `ok` and nothing else.
    pub fn ok(&mut self, line: &str) {
        assert_eq!(self.ask(line), ["ok"], "{line}");
    }

    /// Sends a line and gives the last line of the answer.
    pub fn answer(&mut self, line: &str) -> String {
        self.ask(line).pop().unwrap()
    }

    /// Runs until the table is in a state that begins like this.
    pub fn wait(&mut self, state: &str) {
        let end = self.board.now + 400_000_000 * TICKS;
        while self.board.now < end {
            if self.status().starts_with(&format!("<{state}")) {
                return;
            }
            self.run_ms(5);
        }
        panic!("never {state}, but {}", self.status());
    }

    /// Asks for a status report. Other lines stay to be heard.
    pub fn status(&mut self) -> String {
        self.board.hear(b'?');
        for _ in 0..3 {
            self.round();
            let mut heard = self.heard();
            let report = heard.iter().position(|line| line.starts_with('<'));
            let report = report.map(|at| heard.remove(at));
            self.kept = heard;
            if let Some(report) = report {
                return report;
            }
        }
        panic!("no status report");
    }

    /// A field of a status report.
    pub fn field(&mut self, name: &str) -> Option<String> {
        let status = self.status();
        let fields = status.trim_matches(['<', '>']).split('|');
        let found = fields.filter_map(|field| field.strip_prefix(name)?.strip_prefix(':'));
        found.map(str::to_owned).next()
    }

    /// The first axis of a position in a status report.
    pub fn position(&mut self, name: &str) -> f64 {
        let field = self.field(name).unwrap();
        field.split(',').next().unwrap().parse().unwrap()
    }

    /// Steps by the stepper's count.
    pub fn steps(&self) -> i32 {
        self.board.stepper.position()
    }
}
