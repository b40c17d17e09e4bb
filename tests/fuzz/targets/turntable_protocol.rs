//! A controller's answers: any line is parsed and printed back the same or refused, and any bytes
//! in any pieces leave the wire's machine in order. A checked line is done only by an answer with
//! its own number and checksum.

#![no_main]
#![allow(clippy::expect_used, reason = "a panic is how a target reports")]

use libfuzzer_sys::fuzz_target;
use relit_turntable::protocol::{LineOutcome, Machine, ProtocolEvent, ReplyTimeout, parse};

/// Answers `ok N0`, with its checksum, to the line that opens a session.
const OPENED: &[u8] = b"ok N0*B4B2\r\n";
/// Between two pieces, microseconds.
const PIECE_US: i64 = 40_000;

fuzz_target!(|bytes: &[u8]| {
    for line in bytes.split(|byte| matches!(byte, b'\r' | b'\n')) {
        let _ = std::str::from_utf8(line).ok().and_then(parse);
    }
    plain(bytes);
    checked(bytes);
});

/// Whether the line in flight was done by `bytes`.
fn hear(machine: &mut Machine, bytes: &[u8]) -> bool {
    let mut done = false;
    for (now_us, piece) in (0..).zip(bytes.chunks(7)) {
        let now_us = now_us * PIECE_US;
        machine.on_time(now_us);
        machine.on_bytes(now_us, piece);
        assert!(machine.take_output(now_us).len() < 200);
        while let Some(event) = machine.next_event() {
            let outcome = match event {
                ProtocolEvent::Answered { outcome, .. } => outcome,
                ProtocolEvent::Status(_) | ProtocolEvent::Reset(_) | ProtocolEvent::Alarm(_) => {
                    continue;
                }
            };
            done |= matches!(outcome, LineOutcome::Done(_));
        }
    }
    done
}

fn plain(bytes: &[u8]) {
    let mut machine = Machine::new();
    machine.poll_every(Some(100_000));
    machine
        .send(0, "$$", ReplyTimeout::AtOnce)
        .expect("nothing is in flight");
    if hear(&mut machine, bytes) {
        assert!(bytes.windows(2).any(|pair| pair == b"ok"));
    }
}

fn checked(bytes: &[u8]) {
    let mut machine = Machine::new();
    machine.open_session(0).expect("nothing is in flight");
    machine.on_bytes(0, OPENED);
    assert!(machine.is_checked() && machine.next_event().is_some());
    machine
        .send(0, "$X", ReplyTimeout::AtOnce)
        .expect("nothing is in flight");
    if hear(&mut machine, bytes) {
        assert!(bytes.windows(6).any(|text| text == b"ok N1*"));
    }
}
