//! Properties of parser and state machine on a damaged line and on arbitrary bytes.

#![allow(clippy::unwrap_used, reason = "a test's own mistakes should be loud")]

use proptest::collection::vec;
use proptest::prelude::*;

use super::{checked, events, outcome};
use crate::protocol::*;
use crate::tests::fake_grbl::{FakeGrbl, with_checksum};

/// A fault of the serial line that changes a line.
#[derive(Debug, Clone, Copy)]
enum SerialFault {
    None,
    Drop(usize),
    Flip(usize),
    Twice,
    Merge,
    Lose,
}

fn fault() -> impl Strategy<Value = SerialFault> {
    prop_oneof![
        6 => Just(SerialFault::None),
        1 => any::<usize>().prop_map(SerialFault::Drop),
        1 => any::<usize>().prop_map(SerialFault::Flip),
        1 => Just(SerialFault::Twice),
        1 => Just(SerialFault::Merge),
        1 => Just(SerialFault::Lose),
    ]
}

fn damage(bytes: &[u8], fault: SerialFault) -> Vec<u8> {
    let mut damaged = bytes.to_vec();
    match fault {
        SerialFault::None => {}
        SerialFault::Drop(at) => drop(damaged.remove(at % bytes.len())),
        SerialFault::Flip(at) => damaged[at / 8 % bytes.len()] ^= 1 << (at % 8),
        SerialFault::Twice => damaged.extend(bytes),
        SerialFault::Merge => damaged.retain(|byte| !matches!(byte, b'\r' | b'\n')),
        SerialFault::Lose => damaged.clear(),
    }
    damaged
}

/// Sends one line through a faulty line until it is done or has failed.
fn exchange(
    machine: &mut Machine,
    fake_grbl: &mut FakeGrbl,
    now_us: &mut i64,
    block: &str,
    faults: &mut impl Iterator<Item = SerialFault>,
) -> LineOutcome {
    machine.send(*now_us, block, ReplyTimeout::AtOnce).unwrap();
    for _ in 0..2000 {
        *now_us += 5000;
        machine.on_time(*now_us);
        let output = machine.take_output(*now_us);
        if !output.is_empty() {
            fake_grbl.take(&damage(&output, faults.next().unwrap()));
        }
        fake_grbl.advance(*now_us);
        for line in fake_grbl.give().split_inclusive(|byte| *byte == b'\n') {
            machine.on_bytes(*now_us, &damage(line, faults.next().unwrap()));
        }
        if let Some(outcome) = outcome(machine) {
            return outcome;
        }
    }
    panic!("an exchange without end");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn the_first_line_of_every_controller_is_a_restart(text in banner()) {
        prop_assert_eq!(parse(&text), Some(Message::Banner(None)));
    }

    #[test]
    fn on_a_faulty_wire_a_checked_line_is_done_once_or_fails(faults in vec(fault(), 50)) {
        let (mut fake_grbl, mut machine, mut now_us) = (FakeGrbl::new(true), checked(), 1);
        fake_grbl.advance(1);
        fake_grbl.take(format!("{}\n", with_checksum("N0")).as_bytes());
        fake_grbl.advance(10_000);
        fake_grbl.give();
        let mut faults = faults.into_iter().cycle();
        for number in 0..40 {
            // A flipped bit can turn a digit into the reset command.
            if !machine.is_checked() {
                break;
            }
            let block = format!("G4P{number}");
            let before = fake_grbl.executed.len();
            let outcome = exchange(&mut machine, &mut fake_grbl, &mut now_us, &block, &mut faults);
            let done = fake_grbl.executed[before..].to_vec();
            match outcome {
                LineOutcome::Done(_) => prop_assert_eq!(done, [block]),
                LineOutcome::Refused(code) => prop_assert!(false, "refused with {}", code),
                LineOutcome::Failed(_) => {
                    prop_assert!(done.is_empty() || done == [block.clone()], "{:?} for {}", done, block);
                    break;
                }
            }
        }
    }

    #[test]
    fn any_bytes_are_processed_without_a_panic(pieces in vec(vec(any::<u8>(), 0..40), 0..30)) {
        for mut machine in [Machine::new(), checked()] {
            machine.send(0, "$X", ReplyTimeout::AtOnce).unwrap();
            for (now_us, piece) in (0..).zip(&pieces) {
                machine.on_bytes(now_us * 100_000, piece);
                machine.on_time(now_us * 100_000);
            }
            let done = events(&mut machine).into_iter().any(|event| {
                matches!(event, ProtocolEvent::Answered { outcome: LineOutcome::Done(_), .. })
            });
            prop_assert!(!done || !machine.is_checked());
        }
    }

    #[test]
    fn any_line_is_parsed_or_refused(line in "[ -~]{0,60}") {
        if let Some(message) = parse(&line) {
            let printed = message.to_string();
            prop_assert_eq!(parse(&printed), Some(message));
        }
    }

    #[test]
    fn what_is_not_known_in_a_report_changes_nothing_that_is(
        report in report(),
        axes in 0..5_usize,
        sub in proptest::option::of("[0-9A-Za-z]{0,3}"),
        fields in vec(other_field(), 0..6),
        at in 0..7_usize,
    ) {
        let plain = StatusReport { pins: Pins::default(), chip_us: None, battery_v: None, homed: None, ..report };
        let printed = plain.to_string();
        let mut parts: Vec<String> = printed[1..printed.len() - 1].split('|').map(str::to_owned).collect();
        if let Some(sub) = sub.filter(|_| matches!(plain.state, ControllerState::Idle | ControllerState::Run)) {
            parts[0] += &format!(":{sub}");
        }
        for axis in 0..axes {
            parts[1] += &format!(",{axis}.500");
        }
        let at = 2 + at % (parts.len() - 1);
        let at = at.min(parts.len());
        parts.splice(at..at, fields);
        let Some(Message::Status(read)) = parse(&format!("<{}>", parts.join("|"))) else {
            return Err(TestCaseError::fail(parts.join("|")));
        };
        let known = StatusReport { pins: Pins::default(), chip_us: None, battery_v: None, homed: None, ..read };
        prop_assert_eq!(known, plain);
    }

    #[test]
    fn a_message_printed_is_the_same_read(message in message()) {
        prop_assert_eq!(parse(&message.to_string()), Some(message));
    }
}

fn thousandths() -> impl Strategy<Value = f64> {
    (-9_999_999..9_999_999i32).prop_map(|n| f64::from(n) / 1000.0)
}

fn seq() -> impl Strategy<Value = Option<u32>> {
    proptest::option::of(0..=9_999_999u32)
}

fn report() -> impl Strategy<Value = StatusReport> {
    use ControllerState::*;
    let state = [Idle, Run, Held, Holding, Jog, Home, Alarm, Check, Unknown];
    let position = thousandths();
    let pins = (any::<bool>(), any::<bool>());
    let pins = pins.prop_map(|(index, emergency_stop)| Pins {
        index,
        emergency_stop,
    });
    let whole = proptest::option::of((0..40_000u32).prop_map(f64::from));
    let volts = proptest::option::of((0..2000u32).prop_map(|n| f64::from(n) / 100.0));
    let stamp = proptest::option::of(any::<u32>());
    let state = proptest::sample::select(state.to_vec());
    let state = (state, any::<Option<u8>>(), any::<Option<bool>>());
    (state, position, whole, stamp, volts, pins).prop_map(
        |((state, alarm, homed), position, feed, chip_us, battery_v, pins)| StatusReport {
            state,
            alarm: alarm.filter(|_| state == Alarm),
            homed,
            machine_deg: position,
            feed,
            chip_us,
            battery_v,
            pins,
            asked_us: None,
            came_us: 0,
            certain: false,
        },
    )
}

/// The first lines of controllers.
fn banner() -> impl Strategy<Value = String> {
    prop_oneof![
        "[0-9]\\.[0-9]{1,2}[a-z]?".prop_map(|version| format!("Grbl {version} ['$' for help]")),
        "[0-9]\\.[0-9]{1,2}[a-z]?"
            .prop_map(|version| format!("GrblHAL {version} ['$' or '$HELP' for help]")),
        ("[0-9]\\.[0-9]", "[a-z+-]{0,12}").prop_map(|(version, radio)| {
            format!("Grbl {version} [FluidNC v{version}.1 ({radio}) '$' for help]")
        }),
    ]
}

/// A field that this program does not know, or one it reads as far as it understands it.
fn other_field() -> impl Strategy<Value = String> {
    prop_oneof![
        "[A-Z][A-Za-z0-9]{0,4}(:[ -;=?-{}~]{0,20})?",
        "Pn:[A-Z0-9a-z]{0,8}",
        "(Bf|Ov|A|Ln|SD|H|T|Bat|FW|SP1|Sc|MPG|WCS|TLR|In|AR|S):[ -;=?-{}~]{0,20}",
    ]
    .prop_filter("a known field", |field| {
        let known = ["MPos:", "FS:", "F:"];
        !known.iter().any(|name| field.starts_with(name))
    })
}

fn message() -> impl Strategy<Value = Message> {
    let cause = proptest::option::of("power-on|external|brown-out|watchdog|host");
    prop_oneof![
        seq().prop_map(|seq| Message::Ok { seq }),
        (any::<u8>(), seq()).prop_map(|(code, seq)| Message::Error { code, seq }),
        any::<u8>().prop_map(Message::Alarm),
        report().prop_map(Message::Status),
        cause.prop_map(Message::Banner),
        ("[0-9.a-z]{0,12}", "[ a-z:]{0,12}")
            .prop_map(|(version, note)| Message::Version { version, note }),
        "[A-Za-z]{0,8}".prop_map(|letters| Message::Build { letters }),
        (
            "G[0-9]{2}(\\.1)?|GC|HLP|MSG|FIRMWARE|NVS STORAGE",
            "[ -~]{0,40}"
        )
            .prop_map(|(tag, text)| Message::Info { tag, text }),
        (any::<u16>(), thousandths())
            .prop_map(|(number, value)| Message::Setting { number, value }),
        Just(Message::Other),
    ]
}
