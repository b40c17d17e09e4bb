//! The lines that the fake controller accepts: checked or plain, commands and motions.

use super::{FakeGrbl, Mode, checksum};

impl FakeGrbl {
    pub(super) fn read(&mut self, line: &str) {
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
                let about = if self.rig {
                    &["[VER:1.1h.20190830:]", "[OPT:NHtcl,8,128]"]
                } else {
                    self.dialect.about()
                };
                about.iter().for_each(|line| self.say(line));
                // A radio's state, which changes.
                let strength = self.now_us % 90;
                self.say(&format!("[MSG:INFO: Signal: -{strength} dBm]"));
            }
            "$$" => self.settings(),
            "$X" => {
                self.mode = Mode::Idle;
                self.alarm = None;
            }
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
            let lost = self.trouble.lose_setting;
            if self.dialect.has_setting(&line) && !lost.is_some_and(|start| line.starts_with(start))
            {
                self.say(&line);
            }
        }
        for line in self.dialect.more_settings() {
            self.say(line);
        }
    }

    fn motion(&mut self, block: &str) -> String {
        let Some((words, rest)) = block.split_once('X') else {
            return "error:20".to_owned();
        };
        if self.mode != Mode::Idle {
            return self.dialect.locked().to_owned();
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
