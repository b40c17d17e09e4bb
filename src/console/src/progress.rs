//! How far work has come: a bar for a person, or lines for a machine that asked for them.

use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use indicatif::ProgressStyle;

use super::{Event, json_of, print_line};

/// Shortest time between two lines.
const BETWEEN_LINES: Duration = Duration::from_millis(500);

/// Shows the progress of some work; several threads may report to it.
#[derive(Debug)]
pub struct ProgressBar {
    bar: indicatif::ProgressBar,
    lines: Option<Mutex<Lines>>,
}

/// The lines for a machine.
#[derive(Debug)]
struct Lines {
    session: Option<String>,
    what: String,
    done: u64,
    of: u64,
    printed: Option<Instant>,
}

impl Lines {
    /// Prints where things stand, if that is due.
    fn show(&mut self) {
        let now = Instant::now();
        let recent = |printed: Instant| now.duration_since(printed) < BETWEEN_LINES;
        let is_end = self.of > 0 && self.done >= self.of;
        if !is_end && self.printed.is_some_and(recent) {
            return;
        }
        self.printed = Some(now);
        let event = Event::Progress {
            session: self.session.clone(),
            what: self.what.clone(),
            done: self.done,
            of: self.of,
        };
        print_line(&json_of(&event));
    }
}

impl ProgressBar {
    /// Shows nothing.
    pub fn hidden() -> Self {
        Self {
            bar: indicatif::ProgressBar::hidden(),
            lines: None,
        }
    }

    /// Lines for a machine about `of` steps.
    pub(super) fn lines(session: Option<&str>, of: u64, what: &str) -> Self {
        let lines = Lines {
            session: session.map(str::to_owned),
            what: what.to_owned(),
            done: 0,
            of,
            printed: None,
        };
        Self {
            lines: Some(Mutex::new(lines)),
            ..Self::hidden()
        }
    }

    /// A bar of `of` steps on standard error, where that is a terminal.
    pub(super) fn visible(of: u64, what: &str) -> Self {
        let bar = indicatif::ProgressBar::new(of).with_message(what.to_owned());
        let template = "{msg:.bold} {wide_bar} {pos}/{len} {per_sec} {eta}";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(200));
        Self { bar, lines: None }
    }

    fn change(&self, change: impl FnOnce(&mut Lines)) {
        if let Some(lines) = &self.lines {
            let mut lines = lines.lock().unwrap_or_else(PoisonError::into_inner);
            change(&mut lines);
        }
    }

    /// There are so many steps.
    pub fn set_length(&self, of: u64) {
        self.bar.set_length(of);
        self.change(|lines| lines.of = of);
    }

    /// So many steps are done.
    pub fn set_position(&self, done: u64) {
        self.bar.set_position(done);
        self.change(|lines| {
            lines.done = done;
            lines.show();
        });
    }

    /// So many more steps are done.
    pub fn inc(&self, steps: u64) {
        self.bar.inc(steps);
        self.change(|lines| {
            lines.done += steps;
            lines.show();
        });
    }

    /// Says beside the bar what is being done.
    pub fn set_message(&self, text: String) {
        self.bar.set_message(text);
    }

    /// Does something, such as printing, while the bar is out of the way.
    pub fn suspend<T>(&self, work: impl FnOnce() -> T) -> T {
        self.bar.suspend(work)
    }

    /// Restarts the estimate of when the work ends: the work until now had another speed.
    pub fn reset_eta(&self) {
        self.bar.reset_eta();
    }

    /// Takes the bar away.
    pub fn finish_and_clear(&self) {
        self.bar.finish_and_clear();
    }
}
