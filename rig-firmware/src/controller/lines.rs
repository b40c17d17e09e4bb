//! Lines: taking one in, doing what it says, answering it.

use super::{Alarm, Controller, Job, Mode, Stop, Way};
use crate::board::{Board, Events};
use crate::checked::CheckedLine;
use crate::dollar::{self, Dollar};
use crate::error::Error;
use crate::gcode::{self, Action, Block, Jog, Motion};
use crate::number::Decimal;
use crate::report::{self, Reply};
use crate::settings::Key;

/// Most bytes that one round of the main loop reads.
const BYTES_A_ROUND: u8 = 128;

impl Controller {
    /// Reads up to the end of a line, if the line before is done, and does what it says.
    pub(super) fn take_line<B: Board>(&mut self, board: &mut B) {
        if self.job != Job::None || self.stopping.is_some() {
            return;
        }
        for _ in 0..BYTES_A_ROUND {
            let Some(byte) = board.receive() else {
                self.reader.drained();
                return;
            };
            if self.reader.push(byte) {
                self.take_whole_line(board);
                return;
            }
        }
    }

    fn take_whole_line<B: Board>(&mut self, board: &mut B) {
        // Only now is it known whether a byte of this line was lost, or a reset came behind it.
        self.pending.insert(board.take_events());
        if self.pending.contains(Events::RESET) {
            return;
        }
        if self.pending.remove(Events::LOST_INPUT) {
            self.reader.lose();
        }
        match self.session.judge(&self.reader.line()) {
            CheckedLine::Answer { sequence, answer } => {
                report::answer(board, self.session.is_open(), sequence, answer);
            }
            CheckedLine::Execute { sequence, block } => {
                let locked = self.jogging || matches!(self.mode, Mode::Alarm(_));
                self.sequence = sequence;
                // What is read is a value of its own: the line's text is not needed any more.
                let done = match block {
                    [] => Ok(()),
                    [b'$', rest @ ..] => dollar::parse(rest, &self.modal)
                        .and_then(|command| self.execute_dollar(board, command)),
                    _ if locked => Err(Error::Locked),
                    _ => gcode::parse(block, &self.modal)
                        .and_then(|block| self.execute_block(board, &block)),
                };
                if done.is_err() || (self.job == Job::None && self.stopping.is_none()) {
                    self.answer(board, done);
                }
            }
        }
    }

    /// Ends the job of the line under way, if there is one, and answers the line.
    pub(super) fn finish<B: Board>(&mut self, board: &mut B, done: Result<(), Error>) {
        if core::mem::replace(&mut self.job, Job::None) != Job::None {
            self.answer(board, done);
        }
    }

    fn answer<B: Board>(&mut self, board: &mut B, done: Result<(), Error>) {
        let answer = done.map_or_else(Error::code, |()| 0);
        let sequence = self.sequence.take();
        self.session.remember(sequence, answer);
        report::answer(board, self.session.is_open(), sequence, answer);
    }

    /// Does what a line says, or leaves a job that will.
    fn execute_block<B: Board>(&mut self, board: &mut B, block: &Block) -> Result<(), Error> {
        let feed = match block.modal.motion {
            Motion::Feed => block.modal.feed,
            Motion::Rapid => u32::MAX,
        };
        let target = match block.action {
            Action::Move(target) => Some(self.resolve(target)?),
            Action::Nothing | Action::Dwell(_) => None,
        };
        self.modal = block.modal;
        if let Some(target) = target {
            self.go(board, target, feed);
        } else if let Action::Dwell(left) = block.action {
            self.job = Job::Dwell { since: None, left };
        }
        Ok(())
    }

    fn go<B: Board>(&mut self, board: &mut B, target: i32, feed: u32) {
        if self.is_beyond(target) {
            self.job = Job::Refusal;
            self.stop(board, Stop::Alarm(Alarm::SoftLimit));
            return;
        }
        self.job = Job::Move(Way {
            target,
            feed,
            jog: false,
        });
    }

    fn execute_dollar<B: Board>(&mut self, board: &mut B, command: Dollar) -> Result<(), Error> {
        match command {
            Dollar::Settings => {
                for key in Key::ALL {
                    report::setting(board, self.session.is_open(), &self.settings, key);
                }
            }
            Dollar::Version => {
                for text in ["[VER:1.1h.20261121:relit]", "[OPT:NHtcl,8,128]"] {
                    Reply::new(board, self.session.is_open()).text(text).end();
                }
            }
            Dollar::Modal => self.tell_modal(board),
            Dollar::Set(key, value) => return self.set(board, key, value),
            Dollar::Home => return self.home(board),
            Dollar::Unlock => return self.unlock(board),
            Dollar::Jog(jog) => return self.jog(board, jog),
        }
        Ok(())
    }

    /// Settings change only at rest or locked, for they change what a step is.
    fn require_rest<B: Board>(&self, board: &mut B) -> Result<(), Error> {
        match self.mode {
            Mode::Alarm(_) => Ok(()),
            _ if self.is_idle(board) => Ok(()),
            _ => Err(Error::NotIdle),
        }
    }

    fn set<B: Board>(&mut self, board: &mut B, key: Key, value: Decimal) -> Result<(), Error> {
        self.require_rest(board)?;
        self.settings.set(key, value)?;
        self.apply_settings(board);
        self.store.write(board, &self.settings);
        Ok(())
    }

    fn home<B: Board>(&mut self, board: &mut B) -> Result<(), Error> {
        if !self.settings.flag(Key::Homing) {
            return Err(Error::HomingDisabled);
        }
        if self.emergency {
            return Err(Error::Locked);
        }
        self.require_rest(board)?;
        self.start_homing(board);
        Ok(())
    }

    fn unlock<B: Board>(&mut self, board: &mut B) -> Result<(), Error> {
        if self.emergency {
            return Err(Error::Locked);
        }
        if let Mode::Alarm(_) = self.mode {
            self.mode = Mode::Ready;
            let text = "[MSG:Caution: Unlocked]";
            Reply::new(board, self.session.is_open()).text(text).end();
        }
        Ok(())
    }

    fn jog<B: Board>(&mut self, board: &mut B, jog: Jog) -> Result<(), Error> {
        match self.mode {
            Mode::Alarm(_) => return Err(Error::Locked),
            _ if self.jogging || self.is_idle(board) => {}
            _ => return Err(Error::NotIdle),
        }
        let target = self.resolve(jog.target)?;
        if self.is_beyond(target) {
            return Err(Error::JogTravel);
        }
        self.job = Job::Move(Way {
            target,
            feed: jog.feed,
            jog: true,
        });
        Ok(())
    }
}
