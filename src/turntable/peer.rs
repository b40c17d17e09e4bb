//! A table to test against: what the published interface says, and nothing of the firmware's code.
//!
//! It moves with ramps, answers after a delay, and goes wrong on demand.

#![allow(clippy::unwrap_used, reason = "a test's own mistakes should be loud")]

use std::collections::VecDeque;
use std::io;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use crc::{CRC_16_IBM_3740, Crc};

use super::port::Port;
use crate::clock::Clock;

const STEPS: f64 = 88.889;
const ACCELERATION: f64 = 36.0;
/// Motion is followed in steps of this.
const TICK_US: i64 = 1000;

/// What goes wrong.
#[derive(Debug, Clone, Default)]
pub(super) struct Trouble {
    /// It answers nothing from this time on.
    pub(super) silent_from_us: Option<i64>,
    /// It restarts at this time.
    pub(super) reset_at_us: Option<i64>,
    /// It reports motion and stands, from this time on.
    pub(super) stall_from_us: Option<i64>,
    /// This alarm comes at this time.
    pub(super) alarm_at_us: Option<(i64, u8)>,
    /// Somebody presses hold at this time.
    pub(super) hold_at_us: Option<i64>,
    /// So many answers to lines are lost.
    pub(super) lose_answers: u32,
    /// The first so many lines with a motion lose the digit after X.
    pub(super) wrong_digits: u32,
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
pub(super) struct Peer {
    pub(super) trouble: Trouble,
    rig: bool,
    homing: bool,
    found: bool,
    now_us: i64,
    pub(super) rate: f64,
    pub(super) delay_us: i64,
    mode: Mode,
    pub(super) at: f64,
    speed: f64,
    target: f64,
    feed: f64,
    line: Vec<u8>,
    out: VecDeque<(i64, Vec<u8>)>,
    session: Option<(u32, String)>,
    pub(super) lease: f64,
    /// Lines that were carried out, without number and checksum.
    pub(super) executed: Vec<String>,
    pub(super) resets: u32,
    /// Where it was, a millisecond apart, while it moved.
    pub(super) truth: Vec<(i64, f64)>,
}

impl Peer {
    pub(super) fn new(rig: bool) -> Peer {
        let mut peer = Peer {
            trouble: Trouble::default(),
            rig,
            homing: false,
            found: true,
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
        peer.banner("power-on");
        peer
    }

    /// With an index sensor, which is there or not.
    pub(super) fn with_homing(mut self, found: bool) -> Peer {
        self.homing = true;
        self.found = found;
        self
    }

    pub(super) fn is_moving(&self) -> bool {
        self.speed > 0.0
    }

    pub(super) fn leave_session_open(&mut self) {
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
            Some(_) => seal(text),
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

    fn banner(&mut self, cause: &str) {
        self.session = None;
        let cause = if self.rig {
            format!(" [reset: {cause}]")
        } else {
            String::new()
        };
        self.say_as_is(&format!("\r\nGrbl 1.1h ['$' for help]{cause}"));
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
        }
        self.banner(cause);
    }

    /// Follows the motion up to `now_us`.
    pub(super) fn advance(&mut self, now_us: i64) {
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

    /// Takes bytes at the time of the last [`Peer::advance`].
    pub(super) fn take(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            match byte {
                _ if self.silent() => {}
                b'?' => self.report(),
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

    /// What comes from it by now.
    pub(super) fn give(&mut self) -> Vec<u8> {
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
        let steps = self.at * STEPS;
        let ahead = self.target >= self.at;
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
        self.say(&format!("<{state}|MPos:{place}|FS:{feed},0{stamp}>"));
    }

    fn read(&mut self, line: &str) {
        let sealed = line
            .rsplit_once('*')
            .filter(|(text, crc)| checksum(text) == *crc);
        let Some((text, _)) = sealed.filter(|_| self.rig) else {
            if self.session.is_some() || (self.rig && line.contains('*')) {
                return self.answer("error:70");
            }
            let answer = self.execute(line);
            return self.answer(&answer);
        };
        let (number, block) = text.split_once(' ').unwrap_or((text, ""));
        let seq: u32 = number
            .strip_prefix('N')
            .and_then(|n| n.parse().ok())
            .unwrap();
        match self.session.clone() {
            _ if seq == 0 => {
                self.session = Some((0, "ok N0".to_owned()));
                self.answer("ok N0");
            }
            None => self.answer(&format!("error:72 N{seq}")),
            Some((last, again)) if seq == last => self.answer(&again),
            Some((last, _)) if seq == last + 1 => {
                let answer = format!("{} N{seq}", self.execute(block));
                self.session = Some((seq, answer.clone()));
                self.answer(&answer);
            }
            Some(_) => self.answer(&format!("error:71 N{seq}")),
        }
    }

    fn answer(&mut self, text: &str) {
        if self.trouble.lose_answers > 0 {
            self.trouble.lose_answers -= 1;
        } else {
            self.say(text);
        }
    }

    fn execute(&mut self, block: &str) -> String {
        let answer = self.carry_out(block);
        if answer == "ok" && !block.is_empty() {
            self.executed.push(block.to_owned());
        }
        answer
    }

    fn carry_out(&mut self, block: &str) -> String {
        match block {
            "$I" => {
                let options = if self.rig { "NHtcl,8,128" } else { "V,15,128" };
                self.say("[VER:1.1h.20190830:]");
                self.say(&format!("[OPT:{options}]"));
            }
            "$$" => self.settings(),
            "$X" => self.mode = Mode::Idle,
            "$H" if !self.homing => return "error:5".to_owned(),
            "$H" if self.found => {
                self.at = 0.0;
                self.mode = Mode::Idle;
            }
            "$H" => {
                self.mode = Mode::Alarm;
                self.say("ALARM:9");
            }
            _ if block.is_empty() || block.starts_with("G4") => {}
            _ if block.starts_with("$60=") => self.lease = block[4..].parse().unwrap(),
            _ => return self.motion(block),
        }
        "ok".to_owned()
    }

    fn settings(&mut self) {
        let homing = u8::from(self.homing);
        let lease = if self.rig {
            format!("$60={}", self.lease)
        } else {
            "$32=0".to_owned()
        };
        let soft = u8::from(self.rig);
        for line in [
            "$10=1".to_owned(),
            "$13=0".to_owned(),
            format!("$20={soft}"),
            format!("$22={homing}"),
            lease,
            "$100=88.889".to_owned(),
            "$110=2160.000".to_owned(),
            "$120=36.000".to_owned(),
            "$130=400.000".to_owned(),
        ] {
            self.say(&line);
        }
    }

    fn motion(&mut self, block: &str) -> String {
        let Some((words, rest)) = block.split_once('X') else {
            return "error:20".to_owned();
        };
        if self.mode != Mode::Idle {
            return "error:9".to_owned();
        }
        let (target, feed) = rest.split_once('F').unwrap();
        let mut target = target.to_owned();
        if self.trouble.wrong_digits > 0 {
            self.trouble.wrong_digits -= 1;
            target.remove(0);
        }
        self.target = target.parse().unwrap_or(0.0);
        self.feed = feed.parse::<f64>().unwrap() / 60.0;
        self.mode = if words.starts_with("$J=") {
            Mode::Jog
        } else {
            Mode::Run
        };
        "ok".to_owned()
    }
}

pub(super) fn checksum(text: &str) -> String {
    let crc = Crc::<u16>::new(&CRC_16_IBM_3740);
    format!("{:04X}", crc.checksum(text.as_bytes()))
}

pub(super) fn seal(text: &str) -> String {
    format!("{text}*{}", checksum(text))
}

/// The peer at the end of a port.
pub(super) struct PeerPort {
    pub(super) peer: Arc<Mutex<Peer>>,
    pub(super) clock: Clock,
}

impl Port for PeerPort {
    fn read(&mut self, buffer: &mut [u8], wait: Duration) -> io::Result<usize> {
        let until = std::time::Instant::now() + wait;
        loop {
            let mut peer = self.peer.lock().unwrap();
            peer.advance(self.clock.now_us());
            let bytes = peer.give();
            drop(peer);
            if !bytes.is_empty() {
                assert!(
                    bytes.len() <= buffer.len(),
                    "the peer says too much at once"
                );
                buffer[..bytes.len()].copy_from_slice(&bytes);
                return Ok(bytes.len());
            }
            if std::time::Instant::now() >= until {
                return Ok(0);
            }
            std::thread::sleep(Duration::from_micros(100));
        }
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        let mut peer = self.peer.lock().unwrap();
        peer.advance(self.clock.now_us());
        peer.take(bytes);
        Ok(())
    }

    fn name(&self) -> String {
        "the test's table".to_owned()
    }

    fn resets(&self) -> bool {
        false
    }
}
