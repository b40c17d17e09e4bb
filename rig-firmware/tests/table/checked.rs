//! Checked lines: what is damaged, lost or repeated never moves the table.

use relit_test_support::firmware::Table;
use rig_firmware::crc::Crc;

fn sum(text: &str) -> String {
    let mut crc = Crc::new();
    text.bytes().for_each(|byte| crc.update(byte));
    format!("{:04X}", crc.value())
}

/// A line with its checksum.
fn checked(text: &str) -> String {
    format!("{text}*{}", sum(text))
}

fn session() -> Table {
    let mut table = Table::new();
    assert_eq!(table.ask(&checked("N0")), [checked("ok N0")]);
    table
}

#[test]
fn a_session_executes_lines_in_order_and_checks_all_it_says() {
    let mut table = session();
    assert_eq!(table.ask(&checked("N1 G1 X5 F432")), [checked("ok N1")]);
    assert_eq!(table.ask(&checked("N2 G2")), [checked("error:20 N2")]);
    assert_eq!(table.ask(&checked("N3")), [checked("ok N3")]);
    let version = table.ask(&checked("N4 $I"));
    assert_eq!(version[1], checked("[OPT:NHtcl,8,128]"));
    assert_eq!(version[2], checked("ok N4"));
    let status = table.status();
    let (text, crc) = status.rsplit_once('*').unwrap();
    assert_eq!(crc, sum(text));
}

#[test]
fn a_repeated_line_replays_its_answer_and_does_not_move() {
    let mut table = session();
    let line = checked("N1 G91 G0 X1");
    for _ in 0..5 {
        assert_eq!(table.ask(&line), [checked("ok N1")]);
    }
    assert_eq!(table.ask(&checked("N2 G9")), [checked("error:20 N2")]);
    assert_eq!(table.ask(&checked("N2 G9")), [checked("error:20 N2")]);
    table.run_ms(2000);
    assert_eq!(table.steps(), 89);
}

#[test]
fn a_line_out_of_order_is_refused() {
    let mut table = session();
    table.ask(&checked("N1"));
    for sequence in [0, 3, 9_999_999] {
        let line = checked(&format!("N{sequence} G0 X9"));
        let refused = checked(&format!("error:71 N{sequence}"));
        assert_eq!(table.ask(&line), [refused]);
    }
    table.run_ms(500);
    assert_eq!(table.steps(), 0);
}

#[test]
fn any_damaged_byte_keeps_the_table_still() {
    let line = checked("N1 G0 X1");
    for at in 0..line.len() {
        for bit in 0..7 {
            let mut table = session();
            let mut bytes = line.clone().into_bytes();
            bytes[at] ^= 1 << bit;
            bytes.push(b'\n');
            table.say(&bytes);
            table.run_ms(60);
            assert!(table.board.edges.is_empty(), "{at} {bit}");
        }
    }
}

#[test]
fn a_line_that_lost_its_head_or_tail_never_moves_the_table() {
    let line = checked("N1 G0 X1");
    let mut table = session();
    for cut in 1..line.len() {
        for part in [&line[cut..], &line[..cut]] {
            assert_eq!(table.ask(part), [checked("error:70")], "{part}");
        }
    }
    table.run_ms(100);
    assert!(table.board.edges.is_empty());
    assert_eq!(table.ask(&line), [checked("ok N1")]);
}

#[test]
fn lines_that_ran_into_one_another_never_move_the_table() {
    let mut table = session();
    let merged = checked("N1 G0 X1") + &checked("N2 G0 X2");
    assert_eq!(table.ask(&merged), [checked("error:70")]);
    table.run_ms(100);
    assert!(table.board.edges.is_empty());
}

#[test]
fn plain_lines_are_refused_in_a_session_until_a_reset() {
    let mut table = session();
    for line in ["G0 X1", "", "$X", "N1 G0 X1"] {
        assert_eq!(table.ask(line), [checked("error:70")]);
    }
    assert_eq!(
        table.say(b"\x18"),
        ["Grbl 1.1h ['$' for help] [reset: host]"]
    );
    table.ok("G0 X1");
    assert_eq!(table.ask(&checked("N5 G0 X1")), ["error:72 N5"]);
}

#[test]
fn a_session_can_be_opened_again() {
    let mut table = session();
    table.ask(&checked("N1"));
    table.ask(&checked("N2"));
    assert_eq!(table.ask(&checked("N0")), [checked("ok N0")]);
    assert_eq!(table.ask(&checked("N1 G0 X1")), [checked("ok N1")]);
}

#[test]
fn alarms_and_refused_lines_are_checked_and_replayed() {
    let mut table = session();
    let line = checked("N1 G0 X999");
    let expected = [checked("ALARM:2"), checked("error:9 N1")];
    assert_eq!(table.ask(&line), expected);
    assert_eq!(table.ask(&line), [checked("error:9 N1")]);
    let unlocked = [checked("[MSG:Caution: Unlocked]"), checked("ok N2")];
    assert_eq!(table.ask(&checked("N2 $X")), unlocked);
}

#[test]
fn a_line_that_is_sent_again_while_it_waits_is_answered_twice_and_done_once() {
    let mut table = session();
    let line = checked("N1 G4 P1") + "\n";
    table.say(line.as_bytes());
    table.say(line.as_bytes());
    table.run_ms(1500);
    assert_eq!(table.heard(), [checked("ok N1"), checked("ok N1")]);
}
