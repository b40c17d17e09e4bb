#![allow(clippy::unwrap_used, reason = "a test's own mistakes should be loud")]

mod printed;
mod properties;

use crate::protocol::*;
use crate::tests::fake_grbl::with_checksum;

const HALF_SECOND: i64 = 500_000;

pub(super) fn events(machine: &mut Machine) -> Vec<ProtocolEvent> {
    std::iter::from_fn(|| machine.next_event()).collect()
}

pub(super) fn outcome(machine: &mut Machine) -> Option<LineOutcome> {
    events(machine).into_iter().find_map(|event| match event {
        ProtocolEvent::Answered { outcome, .. } => Some(outcome),
        _ => None,
    })
}

fn text(machine: &mut Machine, now_us: i64) -> String {
    String::from_utf8(machine.take_output(now_us)).unwrap()
}

pub(super) fn checked() -> Machine {
    let mut machine = Machine::new();
    machine.open_session(0).unwrap();
    assert_eq!(text(&mut machine, 0), format!("{}\n", with_checksum("N0")));
    hear(&mut machine, 0, "ok N0");
    assert!(machine.is_checked());
    events(&mut machine);
    machine
}

/// Receives a complete line with its checksum.
fn hear(machine: &mut Machine, now_us: i64, line: &str) {
    machine.on_bytes(now_us, format!("{}\r\n", with_checksum(line)).as_bytes());
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
        "<Run|MPos:12.3401,0.000,0.000|FS:432,0|Bat:11.845>",
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
    assert_eq!(events(&mut machine), [ProtocolEvent::Reset(None)]);
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
    let line = format!("{}\n", with_checksum("N1 G1X1F10"));
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
    assert!(matches!(&found[0], ProtocolEvent::Answered { outcome, .. } if *outcome == failed));
    assert_eq!(found[1], ProtocolEvent::Reset(Some("brown-out".to_owned())));
    assert!(!machine.is_checked());
}

#[test]
fn a_controller_that_has_left_the_session_unnoticed_has_restarted() {
    let mut machine = checked();
    machine.send(0, "$X", ReplyTimeout::AtOnce).unwrap();
    machine.on_bytes(1, b"error:72 N1\r\n");
    assert!(events(&mut machine).contains(&ProtocolEvent::Reset(None)));

    let mut machine = checked();
    let report = b"<Idle|MPos:0.000,0.000,0.000|FS:0,0>\r\n";
    machine.on_bytes(1, report);
    machine.on_bytes(2, report);
    assert_eq!(events(&mut machine), []);
    machine.on_bytes(3, report);
    assert_eq!(events(&mut machine), [ProtocolEvent::Reset(None)]);
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
    let [ProtocolEvent::Status(poll)] = events(&mut machine)[..] else {
        panic!("one report");
    };
    assert_eq!(
        (poll.asked_us, poll.came_us, poll.certain),
        (Some(1000), 3000, true)
    );
    machine.on_bytes(5000, b"<Run|MPos:1.000,0.000,0.000>\r\n");
    let [ProtocolEvent::Status(poll)] = events(&mut machine)[..] else {
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
        [ProtocolEvent::Status(poll)] => poll.certain,
        _ => panic!("one report"),
    };
    assert!(!certain(&mut machine));
    assert_eq!(text(&mut machine, 630_000), "?");
    machine.on_bytes(632_000, b"<Run|MPos:1.000,0.000,0.000>\r\n");
    assert!(certain(&mut machine));
}

/// What controllers of the family say, one transcript each: all of it is understood.
const TRANSCRIPTS: [(&str, &str); 4] = [
    (
        "grblhal",
        include_str!("../../../../../tests/fuzz/seeds/turntable_protocol/grblhal.txt"),
    ),
    (
        "fluidnc",
        include_str!("../../../../../tests/fuzz/seeds/turntable_protocol/fluidnc.txt"),
    ),
    (
        "grbl-esp32",
        include_str!("../../../../../tests/fuzz/seeds/turntable_protocol/grbl-esp32.txt"),
    ),
    (
        "stock",
        include_str!("../../../../../tests/fuzz/seeds/turntable_protocol/stock.txt"),
    ),
];

#[test]
fn transcripts_of_grbls_relatives_hold_no_noise() {
    for (name, transcript) in TRANSCRIPTS {
        let mut machine = Machine::new();
        machine.send(0, "$I", ReplyTimeout::AtOnce).unwrap();
        for (now_us, line) in (0..).zip(transcript.lines()) {
            let before = machine.counts();
            machine.on_bytes(now_us, format!("{line}\r\n").as_bytes());
            // Reports without a machine position are not read.
            let foreign = ["ets ", "configsip:"]
                .iter()
                .any(|boot| line.starts_with(boot))
                || line.contains("|WPos:");
            assert!(
                foreign || machine.counts().noise == before.noise,
                "{name}: {line}"
            );
        }
    }
}

#[test]
fn any_first_line_of_the_family_is_a_restart() {
    for line in [
        "Grbl 0.9j ['$' for help]",
        "Grbl 1.1h ['$' for help]",
        "Grbl 1.3a ['$' for help]",
        "GrblHAL 1.1f ['$' or '$HELP' for help]",
        "grblHAL 1.1f ['$' or '$HELP' for help]",
        "Grbl 3.9 [FluidNC v3.9.1 (esp32-wifi) '$' for help]",
        "Grbl 3.7 [FluidNC v3.7.8 (noradio)]",
        "Grbl v1.1 [My Table '$' for help]",
        "rbl 1.1h ['$' for help]",
        "Grbl 1.1h ['$",
    ] {
        let mut machine = Machine::new();
        machine.on_bytes(0, format!("\r\n{line}\r\n").as_bytes());
        assert_eq!(events(&mut machine), [ProtocolEvent::Reset(None)], "{line}");
    }
    let boot = "rst:0xf (RTCWDT_BROWN_OUT_RESET),boot:0x13 (SPI_FAST_FLASH_BOOT)";
    let mut machine = Machine::new();
    machine.on_bytes(0, format!("{boot}\r\n").as_bytes());
    let cause = Some("rtcwdt_brown_out_reset".to_owned());
    assert_eq!(events(&mut machine), [ProtocolEvent::Reset(cause)]);
}

#[test]
fn lines_that_only_mention_grbl_are_no_restart() {
    for line in [
        "[MSG:Grbl_ESP32 Ver 1.3a Date 20211103]",
        "[FIRMWARE:grblHAL]",
        "$300=grblHAL 1.1f",
        "<Idle|MPos:0.000,0.000,0.000|FW:grblHAL>",
        "[HLP:$$ $# $G $I $N $x=val $Nx=line $J=line $SLP $C $X $H ~ ! ? ctrl-x]",
        "[MSG:'$' for help]",
    ] {
        let mut machine = Machine::new();
        machine.on_bytes(0, format!("{line}\r\n").as_bytes());
        let found = events(&mut machine);
        assert!(
            !found
                .iter()
                .any(|event| matches!(event, ProtocolEvent::Reset(_))),
            "{line}"
        );
    }
}

#[test]
fn a_report_of_a_relative_gives_its_state_its_alarm_and_its_pins() {
    let report = |line: &str| match parse(line) {
        Some(Message::Status(report)) => report,
        other => panic!("{line}: {other:?}"),
    };
    let alarm = report(
        "<Alarm:11|MPos:1.000,0.000,0.000,0.000,0.000,0.000|Bf:35,1023|FS:0,0,0|Pn:XE2|A:|AR>",
    );
    assert_eq!(
        (alarm.state, alarm.alarm),
        (ControllerState::Alarm, Some(11))
    );
    assert!(alarm.pins.index && alarm.pins.emergency_stop);
    let tool = report("<Tool|MPos:1.000,0.000,0.000|WCO:2.000,0.000,0.000|T:3|H:1,7>");
    assert_eq!(
        (tool.state, tool.homed),
        (ControllerState::Held, Some(true))
    );
    assert_eq!(tool.machine_deg, 1.0);
    let states = [
        ("Hold", ControllerState::Held),
        ("Hold:0", ControllerState::Held),
        ("Hold:2", ControllerState::Holding),
        ("Door:1", ControllerState::Held),
        ("Door:4", ControllerState::Holding),
        ("Run:2", ControllerState::Run),
        ("Idle:x", ControllerState::Idle),
        ("Critical", ControllerState::Unknown),
        ("", ControllerState::Unknown),
    ];
    for (name, state) in states {
        let line = format!("<{name}|MPos:0.000,0.000,0.000||FS:0,0|SD:12.3,/a b.nc|X>");
        assert_eq!(report(&line).state, state, "{name}");
    }
}

#[test]
fn a_report_whose_position_is_damaged_or_twice_is_noise() {
    for line in [
        "<Idle|MPos:1.0x0,0.000,0.000>",
        "<Idle|MPos:1.000,0.000,>",
        "<Idle|MPos:1.000|MPos:2.000>",
        "<Idle|WPos:1.000,0.000,0.000>",
        "<Idle|FS:0,0>",
        "<Idle|MPos:1.000<Idle|MPos:1.000>",
        "<Idle|MPos:1.000",
    ] {
        assert_eq!(parse(line), None, "{line}");
    }
}

#[test]
fn an_answer_of_many_lines_may_take_longer_than_one() {
    let mut machine = Machine::new();
    machine.send(0, "$$", ReplyTimeout::AtOnce).unwrap();
    for number in 0..300_i64 {
        let now_us = number * 5_000;
        machine.on_bytes(now_us, format!("${number}=1.000\r\n").as_bytes());
        machine.on_time(now_us);
    }
    machine.on_bytes(1_500_000, b"ok\r\n");
    let Some(LineOutcome::Done(settings)) = outcome(&mut machine) else {
        panic!("an answer");
    };
    assert_eq!(settings.len(), 300);
}
