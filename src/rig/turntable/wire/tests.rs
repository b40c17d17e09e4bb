#![allow(clippy::unwrap_used, reason = "a test's own mistakes should be loud")]

use super::*;
use crate::turntable::fake_grbl::seal;

const HALF_SECOND: i64 = 500_000;

pub(super) fn events(machine: &mut Machine) -> Vec<WireEvent> {
    std::iter::from_fn(|| machine.next_event()).collect()
}

pub(super) fn outcome(machine: &mut Machine) -> Option<LineOutcome> {
    events(machine).into_iter().find_map(|event| match event {
        WireEvent::Answered { outcome, .. } => Some(outcome),
        _ => None,
    })
}

fn text(machine: &mut Machine, now_us: i64) -> String {
    String::from_utf8(machine.take_output(now_us)).unwrap()
}

pub(super) fn checked() -> Machine {
    let mut machine = Machine::new();
    machine.open_session(0).unwrap();
    assert_eq!(text(&mut machine, 0), format!("{}\n", seal("N0")));
    hear(&mut machine, 0, "ok N0");
    assert!(machine.is_checked());
    events(&mut machine);
    machine
}

/// Receives a complete line with its checksum.
fn hear(machine: &mut Machine, now_us: i64, line: &str) {
    machine.on_bytes(now_us, format!("{}\r\n", seal(line)).as_bytes());
}

#[test]
fn a_plain_line_is_done_by_its_ok_and_gives_what_stood_before_it() {
    let mut machine = Machine::new();
    machine.send(0, "$$", ReplyTimeout::AtOnce).unwrap();
    assert_eq!(text(&mut machine, 0), "$$\n");
    machine.on_bytes(
        10,
        b"$100=88.889\r\n<Idle|MPos:0.000,0.000,0.000>\r\nok\r\n",
    );
    let number = 100;
    let setting = Message::Setting {
        number,
        value: 88.889,
    };
    assert_eq!(
        outcome(&mut machine),
        Some(LineOutcome::Done(vec![setting]))
    );
}

#[test]
fn a_value_with_more_digits_than_grbl_writes_keeps_them() {
    for line in [
        "$100=88.8895",
        "$100=88.889",
        "$27=1.000",
        "$100=-84444494444440",
        "<Idle|MPos:0.0005,0.000,0.000>",
        "<Run|WPos:12.340,0.000,0.000|FS:432,0|Bat:11.845|WCO:0.1234,0.000,0.000>",
    ] {
        let message = parse(line).unwrap();
        assert_eq!(message.to_string(), line);
        assert_eq!(parse(&message.to_string()), Some(message));
    }
}

#[test]
fn a_plain_line_is_never_sent_twice_and_after_a_lost_answer_nothing_is_sent_until_a_reset() {
    let mut machine = Machine::new();
    machine.send(0, "G1X1F10", ReplyTimeout::AtOnce).unwrap();
    text(&mut machine, 0);
    machine.on_time(HALF_SECOND);
    let lost = LineOutcome::Failed(LineFault::NoAnswer { tries: 1 });
    assert_eq!(outcome(&mut machine), Some(lost));
    assert_eq!(text(&mut machine, HALF_SECOND), "");
    assert_eq!(
        machine.send(HALF_SECOND, "$X", ReplyTimeout::AtOnce),
        Err(SendError::Unsure)
    );
    machine.on_bytes(HALF_SECOND, b"ok\r\n");
    assert_eq!(
        machine.send(HALF_SECOND, "$X", ReplyTimeout::AtOnce),
        Err(SendError::Unsure)
    );
    machine.on_bytes(HALF_SECOND, b"Grbl 1.1h ['$' for help]\r\n");
    assert_eq!(events(&mut machine), [WireEvent::Reset(None)]);
    assert!(
        machine
            .send(HALF_SECOND, "$X", ReplyTimeout::AtOnce)
            .is_ok()
    );
}

#[test]
fn only_one_line_is_in_flight() {
    let mut machine = checked();
    machine.send(0, "$X", ReplyTimeout::AtOnce).unwrap();
    assert_eq!(
        machine.send(0, "$X", ReplyTimeout::AtOnce),
        Err(SendError::Busy)
    );
}

#[test]
fn what_would_not_be_one_line_is_not_sent() {
    let mut machine = Machine::new();
    for block in ["G1\nG1", "G1?", "!", "G1*3F", "\u{e4}", &"x".repeat(61)] {
        let sent = machine.send(0, block, ReplyTimeout::AtOnce);
        assert_eq!(sent, Err(SendError::Unsendable), "{block:?}");
    }
    assert_eq!(text(&mut machine, 0), "");
}

#[test]
fn a_checked_line_is_repeated_with_its_number_until_the_fifth_time() {
    let mut machine = checked();
    machine.send(0, "G1X1F10", ReplyTimeout::AtOnce).unwrap();
    let line = format!("{}\n", seal("N1 G1X1F10"));
    assert_eq!(text(&mut machine, 0), line);
    for again in 1..5 {
        machine.on_time(again * HALF_SECOND - 1);
        assert_eq!(text(&mut machine, 0), "");
        machine.on_time(again * HALF_SECOND);
        assert_eq!(text(&mut machine, 0), line);
    }
    machine.on_time(5 * HALF_SECOND);
    let lost = LineOutcome::Failed(LineFault::NoAnswer { tries: 5 });
    assert_eq!(outcome(&mut machine), Some(lost));
}

#[test]
fn a_line_that_takes_long_is_asked_after_without_filling_the_controllers_buffer() {
    let mut machine = checked();
    let mut sent = 0;
    machine
        .send(0, "$H", ReplyTimeout::Within(60_000_000))
        .unwrap();
    for now_us in (0..60_000_000).step_by(10_000) {
        machine.on_time(now_us);
        sent += machine.take_output(now_us).len();
    }
    assert!((2 * 11..100).contains(&sent), "{sent} bytes");
    hear(&mut machine, 59_999_999, "ok N1");
    assert_eq!(outcome(&mut machine), Some(LineOutcome::Done(Vec::new())));
}

#[test]
fn a_line_that_came_damaged_is_repeated_at_once() {
    let mut machine = checked();
    machine.send(0, "$X", ReplyTimeout::AtOnce).unwrap();
    let line = text(&mut machine, 0);
    hear(&mut machine, 20_000, "error:70");
    assert_eq!(text(&mut machine, 20_000), line);
    hear(&mut machine, 40_000, "error:9 N1");
    assert_eq!(outcome(&mut machine), Some(LineOutcome::Refused(9)));
}

#[test]
fn a_repeated_answer_is_not_taken_for_the_next_lines() {
    let mut machine = checked();
    machine.send(0, "$X", ReplyTimeout::AtOnce).unwrap();
    hear(&mut machine, 1, "ok N1");
    hear(&mut machine, 2, "ok N1");
    events(&mut machine);
    machine.send(3, "$X", ReplyTimeout::AtOnce).unwrap();
    hear(&mut machine, 4, "ok N1");
    assert_eq!(outcome(&mut machine), None);
    hear(&mut machine, 5, "ok N2");
    assert_eq!(outcome(&mut machine), Some(LineOutcome::Done(Vec::new())));
    assert_eq!(machine.counts().strays, 2);
}

#[test]
fn in_a_session_an_answer_without_or_with_a_wrong_checksum_is_noise() {
    let mut machine = checked();
    machine.send(0, "$X", ReplyTimeout::AtOnce).unwrap();
    machine.on_bytes(1, b"ok N1\r\nok N1*0000\r\nok N1okN1\r\n");
    assert_eq!(outcome(&mut machine), None);
    assert_eq!(machine.counts().noise, 3);
}

#[test]
fn a_banner_in_the_middle_is_a_reset_and_fails_the_line() {
    let mut machine = checked();
    machine.send(0, "G1X1F10", ReplyTimeout::AtOnce).unwrap();
    machine.on_bytes(1, b"\r\nGrbl 1.1h ['$' for help] [reset: brown-out]\r\n");
    let found = events(&mut machine);
    let failed = LineOutcome::Failed(LineFault::Restarted);
    assert!(matches!(&found[0], WireEvent::Answered { outcome, .. } if *outcome == failed));
    assert_eq!(found[1], WireEvent::Reset(Some(RestartCause::BrownOut)));
    assert!(!machine.is_checked());
}

#[test]
fn a_controller_that_has_left_the_session_unnoticed_has_restarted() {
    let mut machine = checked();
    machine.send(0, "$X", ReplyTimeout::AtOnce).unwrap();
    machine.on_bytes(1, b"error:72 N1\r\n");
    assert!(events(&mut machine).contains(&WireEvent::Reset(None)));

    let mut machine = checked();
    let report = b"<Idle|MPos:0.000,0.000,0.000|FS:0,0>\r\n";
    machine.on_bytes(1, report);
    machine.on_bytes(2, report);
    assert_eq!(events(&mut machine), []);
    machine.on_bytes(3, report);
    assert_eq!(events(&mut machine), [WireEvent::Reset(None)]);
}

#[test]
fn a_line_given_up_leaves_it_unsure_what_was_done() {
    let mut machine = checked();
    machine.send(0, "G1X1F10", ReplyTimeout::AtOnce).unwrap();
    machine.give_up();
    assert_eq!(text(&mut machine, 0), "");
    assert_eq!(
        outcome(&mut machine),
        Some(LineOutcome::Failed(LineFault::GivenUp))
    );
    assert!(machine.is_open());
}

#[test]
fn a_report_is_bracketed_by_its_question_and_its_first_byte() {
    let mut machine = Machine::new();
    machine.poll_every(Some(100_000));
    assert_eq!(text(&mut machine, 1000), "?");
    machine.on_bytes(3000, b"<Run|MPos:1.000,0");
    machine.on_bytes(4000, b".000,0.000>\r\n");
    let [WireEvent::Status(poll)] = events(&mut machine)[..] else {
        panic!("one report");
    };
    assert_eq!(
        (poll.asked_us, poll.came_us, poll.certain),
        (Some(1000), 3000, true)
    );
    machine.on_bytes(5000, b"<Run|MPos:1.000,0.000,0.000>\r\n");
    let [WireEvent::Status(poll)] = events(&mut machine)[..] else {
        panic!("one report");
    };
    assert_eq!((poll.asked_us, poll.certain), (None, false));
    assert_eq!(text(&mut machine, 100_999), "");
    assert_eq!(text(&mut machine, 101_000), "?");
}

#[test]
fn after_a_lost_report_the_next_ones_are_not_trusted_for_time() {
    let mut machine = Machine::new();
    machine.poll_every(Some(100_000));
    text(&mut machine, 0);
    assert_eq!(text(&mut machine, 119_999), "");
    assert_eq!(text(&mut machine, 120_000), "?");
    machine.on_bytes(122_000, b"<Run|MPos:1.000,0.000,0.000>\r\n");
    let certain = |machine: &mut Machine| match events(machine)[..] {
        [WireEvent::Status(poll)] => poll.certain,
        _ => panic!("one report"),
    };
    assert!(!certain(&mut machine));
    assert_eq!(text(&mut machine, 630_000), "?");
    machine.on_bytes(632_000, b"<Run|MPos:1.000,0.000,0.000>\r\n");
    assert!(certain(&mut machine));
}
