//! The protocol's state machine: one line in flight, checked or plain, and the answers.

use std::collections::VecDeque;

use super::checksum::{ChecksumResult, check_checksum, with_checksum};
use super::event::{Counts, LineFault, LineOutcome, ProtocolEvent, SendError};
use super::lines::{LineReader, ReceivedLine};
use super::message::{Message, parse};
use super::pending::{Pending, PendingAction, ReplyTimeout};
use super::polling::Polling;
use super::realtime;

/// Longest block, bytes: with number and checksum it fits into Grbl's line buffer of 80.
const MAX_BLOCK_LENGTH: usize = 60;
/// Largest number of a checked line.
const LAST_SEQ: u32 = 9_999_999;
/// Number of consecutive well-formed lines without checksum that show that the controller has left
/// the checked session, which means that it has restarted.
const UNCHECKED: u32 = 3;
/// The controller's error for a line number out of order.
const OUT_OF_ORDER: u8 = 71;
/// The controller's error for a checked line outside a session.
const NO_SESSION: u8 = 72;

/// How lines are sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Session {
    #[default]
    Plain,
    /// The line that opens a checked session waits for its answer.
    Opening,
    /// Checked; the next line has this number.
    Checked { next: u32 },
}

/// The protocol's state machine: takes bytes and times, returns bytes and events.
#[derive(Debug, Default)]
pub struct Machine {
    reader: LineReader,
    session: Session,
    pending: Option<Pending>,
    /// A line was given up whose answer may still arrive.
    unsure: bool,
    unchecked: u32,
    polling: Polling,
    realtime: Vec<u8>,
    lines: Vec<u8>,
    events: VecDeque<ProtocolEvent>,
    next_id: u64,
    counts: Counts,
}

impl Machine {
    /// A machine that sends plain lines and requests no reports.
    pub fn new() -> Self {
        Self::default()
    }

    /// Counters since the start.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// Whether a checked session is open.
    pub fn is_checked(&self) -> bool {
        matches!(self.session, Session::Checked { .. })
    }

    /// Whether a line waits for its answer, or the answer to one that was given up may still arrive.
    pub fn is_open(&self) -> bool {
        self.pending.is_some() || self.unsure
    }

    /// Sets the interval of report requests, microseconds; `None` for no requests.
    pub fn poll_every(&mut self, every_us: Option<i64>) {
        self.polling.set_every(every_us);
    }

    /// Sends a line; checked if a session is open.
    ///
    /// # Errors
    /// [`SendError`]; nothing was sent.
    pub fn send(
        &mut self,
        now_us: i64,
        block: &str,
        timeout: ReplyTimeout,
    ) -> Result<u64, SendError> {
        let plain = |b: u8| (b' '..=b'~').contains(&b) && !matches!(b, b'?' | b'!' | b'~' | b'*');
        if block.len() > MAX_BLOCK_LENGTH || !block.bytes().all(plain) {
            return Err(SendError::Unsendable);
        }
        match self.session {
            Session::Checked { next } => {
                let text = with_checksum(&format!("N{next} {block}"));
                self.launch(now_us, &text, Some(next), timeout)
            }
            Session::Plain | Session::Opening => self.launch(now_us, block, None, timeout),
        }
    }

    /// Opens a checked session, or restarts it.
    ///
    /// # Errors
    /// [`SendError`]; nothing was sent.
    pub fn open_session(&mut self, now_us: i64) -> Result<u64, SendError> {
        let id = self.launch(now_us, &with_checksum("N0"), Some(0), ReplyTimeout::AtOnce)?;
        self.session = Session::Opening;
        Ok(id)
    }

    fn launch(
        &mut self,
        now_us: i64,
        text: &str,
        seq: Option<u32>,
        timeout: ReplyTimeout,
    ) -> Result<u64, SendError> {
        if self.pending.is_some() {
            return Err(SendError::Busy);
        }
        if self.unsure {
            return Err(SendError::Unsure);
        }
        let id = self.next_id;
        self.next_id += 1;
        let pending = Pending::new(id, text, seq, timeout, now_us);
        self.lines.extend_from_slice(&pending.bytes);
        self.pending = Some(pending);
        self.counts.lines += 1;
        Ok(id)
    }

    /// Sends a real-time command before everything else that waits to be sent.
    pub fn realtime(&mut self, byte: u8) {
        self.realtime.push(byte);
    }

    /// Gives up the line in flight. Its unsent rest is discarded, but it may have been executed.
    pub fn give_up(&mut self) {
        self.lines.clear();
        self.fail(LineFault::GivenUp);
    }

    /// The bytes to be sent now. Call it right before writing: it notes the time of requests.
    pub fn take_output(&mut self, now_us: i64) -> Vec<u8> {
        let mut output = std::mem::take(&mut self.realtime);
        if self.polling.is_due(now_us) {
            self.polling.asked(now_us);
            output.push(realtime::STATUS);
        }
        output.append(&mut self.lines);
        output
    }

    /// The next event.
    pub fn next_event(&mut self) -> Option<ProtocolEvent> {
        self.events.pop_front()
    }

    /// Processes the passing of time: repeats or gives up lines without answer.
    pub fn on_time(&mut self, now_us: i64) {
        let next_action = self
            .pending
            .as_ref()
            .map_or(PendingAction::Wait, |line| line.next_action(now_us));
        self.follow(next_action, now_us);
    }

    fn follow(&mut self, next_action: PendingAction, now_us: i64) {
        let Some(pending) = &mut self.pending else {
            return;
        };
        match next_action {
            PendingAction::Wait => {}
            PendingAction::Again => {
                pending.sent_again(now_us);
                self.lines.extend_from_slice(&pending.bytes);
                self.counts.repeats += 1;
            }
            PendingAction::Lost => {
                let tries = pending.tries;
                self.fail(LineFault::NoAnswer { tries });
            }
        }
    }

    /// Processes received bytes.
    pub fn on_bytes(&mut self, now_us: i64, bytes: &[u8]) {
        for &byte in bytes {
            match self.reader.push(now_us, byte) {
                None => {}
                Some(ReceivedLine::Noise) => self.counts.noise += 1,
                Some(ReceivedLine::Line { text, first_us }) => {
                    self.on_line(now_us, &text, first_us)
                }
            }
        }
    }

    fn on_line(&mut self, now_us: i64, line: &str, first_us: i64) {
        match (check_checksum(line), self.session) {
            (ChecksumResult::Good(text), _) => {
                self.unchecked = 0;
                match parse(text) {
                    Some(message) => self.on_message(now_us, message, first_us),
                    None => self.counts.noise += 1,
                }
            }
            (ChecksumResult::Bad, _) => self.counts.noise += 1,
            (ChecksumResult::Open, Session::Plain | Session::Opening) => match parse(line) {
                Some(message) => self.on_message(now_us, message, first_us),
                None => self.counts.noise += 1,
            },
            (ChecksumResult::Open, Session::Checked { .. }) => self.on_unchecked(line),
        }
    }

    /// Processes a line without checksum in a checked session: its end was lost, or the controller
    /// has restarted and left the session.
    fn on_unchecked(&mut self, line: &str) {
        self.counts.noise += 1;
        if line.contains('*') {
            // A damaged checksum.
            return;
        }
        let awaited = self.pending.as_ref().and_then(|line| line.seq);
        match parse(line) {
            Some(Message::Banner(cause)) => self.reset(cause),
            Some(Message::Error { code, seq }) if code == NO_SESSION && seq == awaited => {
                self.reset(None);
            }
            Some(_) => {
                self.unchecked += 1;
                if self.unchecked >= UNCHECKED {
                    self.reset(None);
                }
            }
            None => {}
        }
    }

    fn on_message(&mut self, now_us: i64, message: Message, first_us: i64) {
        match message {
            Message::Ok { seq } => self.on_answer(now_us, seq, None),
            Message::Error { code, seq } => self.on_answer(now_us, seq, Some(code)),
            Message::Alarm(code) => self.events.push_back(ProtocolEvent::Alarm(code)),
            Message::Status(report) => {
                self.counts.reports += 1;
                let report = self.polling.answered(report, first_us);
                self.events.push_back(ProtocolEvent::Status(report));
            }
            Message::Banner(cause) => self.reset(cause),
            other => match &mut self.pending {
                Some(pending) => pending.keep(now_us, other),
                None => self.counts.messages += 1,
            },
        }
    }

    fn on_answer(&mut self, now_us: i64, seq: Option<u32>, code: Option<u8>) {
        let Some(awaited) = self.pending.as_ref().map(|line| line.seq) else {
            self.counts.strays += 1;
            return;
        };
        if awaited != seq {
            // In a session, an answer without number reports a damaged line, and one with another
            // number is a repetition.
            match (awaited, seq) {
                (Some(_), None) => self.on_damaged(now_us),
                _ => self.counts.strays += 1,
            }
            return;
        }
        match code {
            None => self.accept(),
            Some(NO_SESSION) if seq.is_some() => self.reset(None),
            Some(OUT_OF_ORDER) if seq.is_some() => self.fail(LineFault::OutOfOrder),
            Some(code) => self.answer(LineOutcome::Refused(code)),
        }
    }

    fn on_damaged(&mut self, now_us: i64) {
        let damaged = |line: &Pending| line.damaged(now_us);
        let next_action = self.pending.as_ref().map_or(PendingAction::Wait, damaged);
        self.follow(next_action, now_us);
    }

    fn accept(&mut self) {
        let info = self
            .pending
            .as_mut()
            .map(|line| std::mem::take(&mut line.info));
        self.answer(LineOutcome::Done(info.unwrap_or_default()));
    }

    /// Notes that the controller has processed the line: the next one gets the next number.
    fn answer(&mut self, outcome: LineOutcome) {
        let Some(pending) = self.pending.take() else {
            return;
        };
        self.lines.clear();
        let opened = matches!(outcome, LineOutcome::Done(_));
        self.session = match (self.session, pending.seq) {
            (Session::Checked { .. }, Some(LAST_SEQ)) => Session::Plain,
            (Session::Checked { .. }, Some(seq)) => Session::Checked { next: seq + 1 },
            (Session::Opening, _) if opened => Session::Checked { next: 1 },
            (Session::Opening, _) => Session::Plain,
            (session, _) => session,
        };
        let id = pending.id;
        self.events
            .push_back(ProtocolEvent::Answered { id, outcome });
    }

    fn fail(&mut self, fault: LineFault) {
        if let Some(Pending { id, .. }) = self.pending.take() {
            self.unsure = true;
            let outcome = LineOutcome::Failed(fault);
            self.events
                .push_back(ProtocolEvent::Answered { id, outcome });
        }
    }

    /// Notes that the controller was reset although no banner came.
    pub fn assume_reset(&mut self) {
        self.reset(None);
    }

    /// Notes that the controller has restarted: it answers no earlier line and takes plain lines.
    fn reset(&mut self, cause: Option<String>) {
        self.fail(LineFault::Restarted);
        self.lines.clear();
        self.session = Session::Plain;
        self.unsure = false;
        self.unchecked = 0;
        self.polling.forget();
        self.events.push_back(ProtocolEvent::Reset(cause));
    }
}
