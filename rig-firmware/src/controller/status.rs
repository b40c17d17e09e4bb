//! Status reports, and what `$G` tells.

use super::{Controller, Job, Mode};
use crate::board::Board;
use crate::gcode::Motion;
use crate::number::scaled;
use crate::report::Reply;
use crate::settings::Key;

/// The battery input's full scale.
const BATTERY_FULL: u32 = 1023;

/// What the stepper knows, at one moment.
struct Snapshot {
    micros: u32,
    position: i32,
    interval: Option<u32>,
    free: u8,
    planned: bool,
}

impl Controller {
    /// Answers `?`.
    pub(super) fn report_status<B: Board>(&self, board: &mut B) {
        let now = board.with_stepper(|stepper, micros| Snapshot {
            micros,
            position: stepper.position(),
            interval: stepper.interval(),
            free: stepper.free(),
            planned: stepper.has_plan(),
        });
        let (room, battery, inputs) = (board.receive_room(), board.battery(), board.inputs());
        let index = inputs.index != self.settings.flag(Key::InvertIndex);
        let emergency = inputs.emergency_stop != self.settings.flag(Key::InvertEmergency);

        let mut reply = Reply::new(board, self.session.is_open());
        reply.text("<").text(self.state(&now));
        reply.text("|MPos:").position(self.angle(now.position));
        let buffers = reply.text("|Bf:").whole(u32::from(now.free)).text(",");
        buffers.whole(u32::from(room));
        let feed = now
            .interval
            .map_or(0, |interval| self.profile.feed(interval));
        reply.text("|FS:").speed(feed).text(",0");
        reply.text("|T:").whole(now.micros);
        reply.text("|Bat:").decimal(self.centivolts(battery), 2);
        if index || emergency {
            reply.text("|Pn:");
            reply.text(if index { "X" } else { "" });
            reply.text(if emergency { "R" } else { "" });
        }
        reply.text(">").end();
    }

    fn state(&self, now: &Snapshot) -> &'static str {
        let moving = now.interval.is_some();
        match (self.mode, self.job) {
            (Mode::Alarm(_), _) => "Alarm",
            _ if self.hold && moving => "Hold:1",
            _ if self.hold => "Hold:0",
            (_, Job::Home(_)) => "Home",
            _ if self.jogging => "Jog",
            (_, Job::None) if !moving && !now.planned => "Idle",
            _ => "Run",
        }
    }

    fn centivolts(&self, battery: u16) -> i32 {
        let scale = self.settings.amount(Key::BatteryScale);
        scaled(i32::from(battery), scale, BATTERY_FULL * 10).unwrap_or(0)
    }

    /// `$G`.
    pub(super) fn tell_modal<B: Board>(&self, board: &mut B) {
        let mut reply = Reply::new(board, self.session.is_open());
        reply.text("[GC:G");
        reply.text(match self.modal.motion {
            Motion::Rapid => "0",
            Motion::Feed => "1",
        });
        reply.text(" G54 G17 G21 G9");
        reply.text(if self.modal.relative { "1" } else { "0" });
        reply.text(" G94 M5 M9 T0 F");
        reply.speed(self.modal.feed).text(" S0]").end();
    }
}
