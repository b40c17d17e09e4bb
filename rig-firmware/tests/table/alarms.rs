//! Alarms, holds, resets and the lease.

use relit_test_support::firmware::Table;

#[test]
fn a_target_beyond_the_soft_limit_stops_the_table_and_locks_it() {
    let mut table = Table::new();
    table.ok("G1 X50 F432");
    table.run_ms(2000);
    assert_eq!(table.ask("G1 X400.001"), ["ALARM:2", "error:9"]);
    assert!(table.status().starts_with("<Alarm|"));
    let stopped = table.position("MPos");
    assert!((10.0..20.0).contains(&stopped), "{stopped}");
    assert_eq!(table.answer("G0 X0"), "error:9");
    table.say(b"\x18");
    assert!((table.position("MPos") - stopped).abs() < 1e-9);
    table.ok("G1 X20 F1000");
    table.wait("Idle");
    assert!((table.position("MPos") - 20.0).abs() < 0.006);
}

#[test]
fn the_soft_limit_counts_either_way_and_can_be_off() {
    let mut table = Table::new();
    table.ok("$130=10");
    table.ok("$110=6000");
    table.ok("G0 X-10");
    assert_eq!(table.answer("G0 X-10.001"), "error:9");
    table.answer("$X");
    assert_eq!(table.answer("G1 X11 F100"), "error:9");
    table.answer("$X");
    table.ok("$20=0");
    table.ok("G0 X-11");
    table.wait("Idle");
    assert!((table.position("MPos") + 11.0).abs() < 0.006);
}

#[test]
fn a_reset_stops_at_once_and_locks_a_table_that_moved() {
    let mut table = Table::new();
    table.ok("G1 X50 F432");
    table.run_ms(1000);
    table.board.hear(0x18);
    let steps = table.board.edges.len();
    table.run_ms(20);
    assert_eq!(table.board.edges.len(), steps);
    let expected = [
        "ALARM:3",
        "Grbl 1.1h ['$' for help] [reset: host]",
        "[MSG:'$H'|'$X' to unlock]",
    ];
    assert_eq!(table.heard(), expected);
    table.say(b"\x18");
    assert_eq!(table.answer("G0 X1"), "error:9");
    table.answer("$X");
    table.ok("G0 X1");
}

#[test]
fn a_reset_at_rest_locks_nothing() {
    let mut table = Table::new();
    table.ok("G1 X5 F432");
    table.run_ms(300);
    table.say(b"!");
    table.wait("Hold:0");
    let stood = table.steps();
    assert_eq!(table.say(b"\x18").len(), 1);
    assert!(table.status().starts_with("<Idle|"));
    assert_eq!(table.steps(), stood);
    table.run_ms(100);
    assert_eq!(table.steps(), stood);
}

#[test]
fn an_emergency_stop_is_immediate_and_latched() {
    let mut table = Table::new();
    table.ok("G1 X50 F432");
    table.run_ms(1000);
    table.board.press_emergency(true);
    let steps = table.board.edges.len();
    table.run_ms(10);
    assert_eq!(table.board.edges.len(), steps);
    assert!(!table.board.driver);
    assert_eq!(table.heard(), ["ALARM:10"]);
    table.ok("");
    for line in ["$X", "$H", "G0 X1"] {
        let answer = table.answer(line);
        assert!(answer == "error:9" || (line == "$H" && answer == "error:5"));
    }
    table.say(b"\x18");
    assert_eq!(table.answer("$X"), "error:9", "pressed still");
    table.board.press_emergency(false);
    assert_eq!(table.answer("$X"), "error:9", "no reset since its release");
    table.say(b"\x18");
    assert_eq!(table.answer("G0 X1"), "error:9");
    assert_eq!(table.answer("$X"), "ok");
    table.ok("G0 X1");
}

#[test]
fn an_emergency_stop_answers_the_line_that_waits() {
    let mut table = Table::new();
    table.say(b"G4 P10\n");
    table.board.press_emergency(true);
    table.run_ms(5);
    assert_eq!(table.heard(), ["ALARM:10", "error:9"]);
}

#[test]
fn an_inverted_emergency_stop_is_active_when_open() {
    let mut table = Table::new();
    table.board.emergency = true;
    table.run_ms(5);
    assert_eq!(table.heard(), ["ALARM:10"]);
    table.ok("$14=1");
    table.say(b"\x18");
    table.answer("$X");
    table.ok("G0 X1");
    table.board.press_emergency(false);
    table.run_ms(5);
    assert_eq!(table.heard(), ["ALARM:10"]);
}

#[test]
fn a_silent_host_loses_its_moving_table() {
    let mut table = Table::new();
    table.ok("$60=2");
    table.ok("G1 X100 F432");
    for _ in 0..6 {
        table.run_ms(1000);
        table.board.type_bytes(b"?");
    }
    assert!(table.status().starts_with("<Run|"));
    let heard = table.board.now;
    table.run_ms(2500);
    assert_eq!(table.heard().last().unwrap(), "ALARM:20");
    let ramp = 2.0 + 7.2 / 36.0 + 0.05;
    let stopped = (table.board.edges.last().unwrap().at - heard) as f64 / 2e6;
    assert!((2.0..ramp).contains(&stopped), "{stopped}");
    let stood = table.position("MPos");
    assert_eq!(table.answer("$X"), "ok");
    table.run_ms(3000);
    assert!(
        (table.position("MPos") - stood).abs() < 1e-9,
        "the plan is gone"
    );
    table.ok("G0 X0");
    table.wait("Idle");
    assert_eq!(table.steps(), 0);
}

#[test]
fn the_lease_leaves_a_table_at_rest_alone() {
    let mut table = Table::new();
    table.ok("$60=1");
    table.ok("G0 X5");
    table.wait("Idle");
    table.run_ms(5000);
    assert!(table.heard().is_empty());
    table.ok("G0 X0");
}

#[test]
fn the_lease_refuses_the_line_that_waits_for_room() {
    let mut table = Table::new();
    table.ok("$60=1");
    for x in 1..=8 {
        table.ok(&format!("G1 X{} F100", x * 10));
    }
    table.say(b"G1 X90\n");
    table.run_ms(2500);
    assert_eq!(table.heard(), ["ALARM:20", "error:9"]);
}

#[test]
fn a_table_that_has_to_be_homed_starts_locked() {
    let mut table = Table::new();
    table.ok("$22=1");
    let board = table.board;
    let mut again = Table::on(board);
    let heard = again.heard();
    assert_eq!(heard.last().unwrap(), "[MSG:'$H'|'$X' to unlock]");
    assert_eq!(again.answer("G0 X1"), "error:9");
    assert!(again.status().starts_with("<Alarm|"));
    again.say(b"\x18");
    assert_eq!(again.answer("G0 X1"), "error:9");
    again.answer("$X");
    again.ok("G0 X1");
}
