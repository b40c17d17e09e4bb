//! A fake Grbl controller for tests: an own implementation of the published interface, without any
//! code of the firmware.
//!
//! It moves with ramps, answers after a delay, and has faults on demand.

mod dialect;
mod lines;
mod port;

use std::collections::VecDeque;

use crc::{CRC_16_IBM_3740, Crc};

pub(crate) use dialect::Dialect;
pub(crate) use port::FakePort;

const STEPS: f64 = 88.889;
const ACCELERATION: f64 = 36.0;
/// Time step of the motion.
const TICK_US: i64 = 1000;

/// The faults to inject.
#[derive(Debug, Clone, Default)]
pub(crate) struct InjectedFaults {
    /// From this time on it answers nothing.
    pub(crate) silent_from_us: Option<i64>,
    /// It restarts at this time.
    pub(crate) reset_at_us: Option<i64>,
    /// From this time on it reports motion but stands still.
    pub(crate) stall_from_us: Option<i64>,
    /// It raises this alarm at this time.
    pub(crate) alarm_at_us: Option<(i64, u8)>,
    /// Somebody presses feed hold at this time.
    pub(crate) hold_at_us: Option<i64>,
    /// Number of answers to lines that are lost.
    pub(crate) lose_answers: u32,
    /// Number of lines with a motion that lose the digit after X.
    pub(crate) wrong_digits: u32,
    /// Its next report has this position.
    pub(crate) wrong_report: Option<f64>,
    /// It leaves out the setting that begins so.
    pub(crate) lose_setting: Option<&'static str>,
    /// Its banner was echoed: soon after its first report it answers a part of the echo and keeps the
    /// rest as the beginning of a line.
    pub(crate) echo: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Mode {
    Idle,
    Run,
    Jog,
    Holding,
    Held,
    Alarm,
}

#[derive(Debug)]
pub(crate) struct FakeGrbl {
    pub(crate) trouble: InjectedFaults,
    rig: bool,
    dialect: Dialect,
    homing: bool,
    found: bool,
    /// The number of its last alarm.
    alarm: Option<u8>,
    now_us: i64,
    pub(crate) rate: f64,
    pub(crate) delay_us: i64,
    mode: Mode,
    pub(crate) at: f64,
    speed: f64,
    target: f64,
    feed: f64,
    line: Vec<u8>,
    out: VecDeque<(i64, Vec<u8>)>,
    session: Option<(u32, String)>,
    pub(crate) lease: f64,
    /// Executed lines, without number and checksum.
    pub(crate) executed: Vec<String>,
    pub(crate) resets: u32,
    /// Times and true positions while it moved, every millisecond.
    pub(crate) truth: Vec<(i64, f64)>,
}

impl FakeGrbl {
    pub(crate) fn new(rig: bool) -> FakeGrbl {
        FakeGrbl::speaking(Dialect::Grbl, rig)
    }

    /// A relative of Grbl.
    pub(crate) fn relative(dialect: Dialect) -> FakeGrbl {
        FakeGrbl::speaking(dialect, false)
    }

    fn speaking(dialect: Dialect, rig: bool) -> FakeGrbl {
        let mut fake_grbl = FakeGrbl {
            trouble: InjectedFaults::default(),
            rig,
            dialect,
            homing: false,
            found: true,
            alarm: None,
            now_us: 0,
            rate: 1.0,
            delay_us: 2000,
            mode: Mode::Idle,
            at: 0.0,
            speed: 0.0,
            target: 0.0,
            feed: 0.0,
            line: Vec::new(),
            out: VecDeque::new(),
            session: None,
            lease: 0.0,
            executed: Vec::new(),
            resets: 0,
            truth: Vec::new(),
        };
        fake_grbl.banner("power-on");
        fake_grbl
    }

    /// With homing enabled; `found`: whether the index sensor works.
    pub(crate) fn with_homing(mut self, found: bool) -> FakeGrbl {
        self.homing = true;
        self.found = found;
        self
    }

    pub(crate) fn is_moving(&self) -> bool {
        self.speed > 0.0
    }

    pub(crate) fn leave_session_open(&mut self) {
        self.session = Some((17, "ok N17".to_owned()));
        self.out.clear();
    }

    fn silent(&self) -> bool {
        self.trouble
            .silent_from_us
            .is_some_and(|from| self.now_us >= from)
    }

    fn say(&mut self, text: &str) {
        let sealed = match self.session {
            Some(_) => with_checksum(text),
            None => text.to_owned(),
        };
        self.say_as_is(&sealed);
    }

    fn say_as_is(&mut self, text: &str) {
        if !self.silent() {
            let due = self.now_us + self.delay_us;
            self.out
                .push_back((due, format!("{text}\r\n").into_bytes()));
        }
    }

    fn answer_echo(&mut self) {
        if std::mem::take(&mut self.trouble.echo) {
            self.line.extend_from_slice(b"Grbl 1.1h ['$' f");
            let due = self.now_us + self.delay_us + 5000;
            for answer in ["error:2\r\n", "ok\r\n"] {
                self.out.push_back((due, answer.as_bytes().to_vec()));
            }
        }
    }

    fn banner(&mut self, cause: &str) {
        self.session = None;
        let cause = if self.rig {
            format!(" [reset: {cause}]")
        } else {
            String::new()
        };
        if let Some(banner) = self.dialect.banner() {
            self.say_as_is(&format!("\r\n{banner}{cause}"));
        }
    }

    fn restart(&mut self, cause: &str) {
        self.resets += 1;
        let moving = self.is_moving();
        self.speed = 0.0;
        self.line.clear();
        if cause == "host" {
            if moving {
                self.say("ALARM:3");
            }
            self.mode = if moving || self.mode == Mode::Alarm {
                Mode::Alarm
            } else {
                Mode::Idle
            };
        } else {
            self.at = 0.0;
            self.out.clear();
            self.mode = Mode::Idle;
            for line in self.dialect.boot_log() {
                self.say_as_is(line);
            }
        }
        self.banner(cause);
    }

    /// Advances to `now_us`.
    pub(crate) fn advance(&mut self, now_us: i64) {
        if self.now_us == 0 {
            self.now_us = now_us;
        }
        while self.now_us + TICK_US <= now_us {
            self.now_us += TICK_US;
            self.happen();
            self.tick();
        }
    }

    fn happen(&mut self) {
        let due = |at: &mut Option<i64>, now| at.take_if(|at| *at <= now).is_some();
        if due(&mut self.trouble.reset_at_us, self.now_us) {
            self.restart("watchdog");
        }
        if due(&mut self.trouble.hold_at_us, self.now_us) {
            self.hold();
        }
        if let Some((_, code)) = self
            .trouble
            .alarm_at_us
            .take_if(|(at, _)| *at <= self.now_us)
        {
            self.speed = 0.0;
            self.mode = Mode::Alarm;
            self.alarm = Some(code);
            self.say(&format!("ALARM:{code}"));
        }
    }

    fn tick(&mut self) {
        if !matches!(self.mode, Mode::Run | Mode::Jog | Mode::Holding) {
            return;
        }
        if self
            .trouble
            .stall_from_us
            .is_some_and(|from| self.now_us >= from)
        {
            return;
        }
        let seconds = TICK_US as f64 * 1e-6 * self.rate;
        let left = (self.target - self.at).abs();
        let brake = self.speed * self.speed / (2.0 * ACCELERATION);
        if self.mode == Mode::Holding || left <= brake {
            self.speed = (self.speed - ACCELERATION * seconds).max(0.0);
        } else {
            self.speed = (self.speed + ACCELERATION * seconds).min(self.feed);
        }
        self.at += (self.target - self.at).signum() * (self.speed * seconds).min(left);
        self.truth.push((self.now_us, self.at));
        let slow = self.speed < 2.0 * ACCELERATION * seconds;
        if self.mode == Mode::Holding {
            if slow {
                self.speed = 0.0;
                self.mode = Mode::Held;
            }
        } else if left < 0.003 || (slow && left < 0.05 && brake >= left) {
            self.at = self.target;
            self.speed = 0.0;
            self.mode = Mode::Idle;
        }
    }

    fn hold(&mut self) {
        self.mode = match self.mode {
            Mode::Run | Mode::Jog | Mode::Holding => Mode::Holding,
            Mode::Idle | Mode::Held => Mode::Held,
            Mode::Alarm => Mode::Alarm,
        };
    }

    /// Receives bytes at the time of the last [`FakeGrbl::advance`].
    pub(crate) fn take(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            match byte {
                _ if self.silent() => {}
                b'?' => {
                    self.report();
                    self.answer_echo();
                }
                b'!' => self.hold(),
                0x18 => self.restart("host"),
                b'\n' | b'\r' => {
                    let line = std::mem::take(&mut self.line);
                    self.read(&String::from_utf8_lossy(&line));
                }
                0x80.. => {}
                _ => self.line.push(byte),
            }
        }
    }

    /// The bytes that it has sent by now.
    pub(crate) fn give(&mut self) -> Vec<u8> {
        let mut bytes = Vec::new();
        while let Some((_, text)) = self.out.pop_front_if(|(due, _)| *due <= self.now_us) {
            bytes.extend(text);
        }
        bytes
    }

    fn report(&mut self) {
        let state = match self.mode {
            Mode::Idle => "Idle",
            Mode::Run => "Run",
            Mode::Jog => "Jog",
            Mode::Holding => "Hold:1",
            Mode::Held => "Hold:0",
            Mode::Alarm => "Alarm",
        };
        let at = self.trouble.wrong_report.take().unwrap_or(self.at);
        let steps = at * STEPS;
        let ahead = self.target >= at;
        let steps = if ahead {
            (steps + 1e-6).floor()
        } else {
            (steps - 1e-6).ceil()
        };
        let place = format!("{:.3},0.000,0.000", steps / STEPS);
        let feed = (self.speed * 60.0).round();
        let chip = (self.now_us as f64 * self.rate) as u64 as u32;
        let stamp = if self.rig {
            format!("|T:{chip}|Bat:11.84")
        } else {
            String::new()
        };
        let report = format!("<{state}|MPos:{place}|FS:{feed},0{stamp}>");
        self.say(&self.dialect.report(report, self.alarm));
    }
}

pub(crate) fn checksum(text: &str) -> String {
    let crc = Crc::<u16>::new(&CRC_16_IBM_3740);
    format!("{:04X}", crc.checksum(text.as_bytes()))
}

pub(crate) fn with_checksum(text: &str) -> String {
    format!("{text}*{}", checksum(text))
}
