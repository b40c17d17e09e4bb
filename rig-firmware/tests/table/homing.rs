//! Homing finds the same step every time.

use relit_test_support::firmware::Table;

/// A table with homing on, whose index is active from one position to before another.
fn table(index: (i32, i32), inverted: bool) -> Table {
    let mut table = Table::new();
    table.ok("$22=1");
    if inverted {
        table.ok("$23=1");
    }
    table.board.index = index;
    table
}

#[test]
fn zero_is_the_first_step_of_the_index_from_any_start() {
    for start in [0, 100, 1234, 8000, 8900, 15_000] {
        let mut table = table((9000, 9400), false);
        table.board.turned = start;
        table.ok("$H");
        assert!(table.status().starts_with("<Idle|"), "{start}");
        assert_eq!(table.steps(), 0, "{start}");
        assert_eq!(table.board.turned.rem_euclid(32_000), 9000, "{start}");
    }
}

#[test]
fn a_start_on_the_index_finds_the_same_step() {
    for start in [9000, 9001, 9200, 9399] {
        let mut table = table((9000, 9400), false);
        table.board.turned = start;
        table.ok("$H");
        assert_eq!(table.steps(), 0, "{start}");
        assert_eq!(table.board.turned, 9000, "{start}");
    }
}

#[test]
fn homing_the_other_way_finds_the_other_edge() {
    for start in [12_000, 9400, 9399, 9000] {
        let mut table = table((9000, 9400), true);
        table.board.turned = start;
        table.ok("$H");
        assert_eq!(table.steps(), 0, "{start}");
        assert_eq!(table.board.turned, 9399, "{start}");
    }
}

#[test]
fn an_inverted_index_input_works_alike() {
    let mut table = table((3000, 3300), false);
    table.board.inverted_index = true;
    table.ok("$5=1");
    table.ok("$H");
    assert_eq!(table.board.turned, 3000);
}

#[test]
fn a_glitch_before_the_index_does_not_count() {
    let mut table = table((3000, 3300), false);
    // One step of index, then a gap: the level did not stay.
    table.board.index = (2999, 3300);
    table.board.index_gap = Some(3000);
    table.ok("$H");
    assert_eq!(table.board.turned, 3001);
}

#[test]
fn a_missing_index_is_alarm_9_after_a_turn() {
    let mut table = table((i32::MAX, i32::MAX), false);
    assert_eq!(table.ask("$H"), ["ALARM:9", "error:9"]);
    assert_eq!(table.board.turned, 33_333);
    assert_eq!(table.answer("G0 X1"), "error:9");
}

#[test]
fn an_index_that_never_ends_is_alarm_8() {
    let mut table = table((i32::MIN, i32::MAX), false);
    assert_eq!(table.ask("$H"), ["ALARM:8", "error:9"]);
    assert_eq!(table.board.turned, -4000);
}

#[test]
fn a_reset_while_homing_is_alarm_6() {
    let mut table = table((30_000, 30_400), false);
    table.say(b"$H\n");
    table.run_ms(500);
    assert!(table.status().starts_with("<Home|"));
    let heard = table.say(b"\x18");
    assert_eq!(heard[0], "ALARM:6");
    assert_eq!(table.answer("G0 X1"), "error:9");
}

#[test]
fn homing_can_be_held_and_goes_on() {
    let mut table = table((3000, 3300), false);
    table.say(b"$H\n");
    for _ in 0..12 {
        table.run_ms(300);
        table.say(b"!");
        table.run_ms(600);
        assert!(table.status().starts_with("<Hold:0|"));
        let stood = table.board.turned;
        table.run_ms(500);
        assert_eq!(table.board.turned, stood);
        table.say(b"~");
    }
    table.wait("Idle");
    assert_eq!(table.board.turned, 3000);
    assert_eq!(table.steps(), 0);
}

#[test]
fn lines_wait_while_the_table_homes() {
    let mut table = table((1000, 1300), false);
    table.say(b"$H\nG0 X2\n");
    assert!(table.heard().is_empty());
    table.wait("Idle");
    assert_eq!(table.board.turned, 1000 + 178);
}

#[test]
fn homing_unlocks_a_table_that_starts_locked() {
    let table = table((500, 900), false);
    let mut again = Table::on(table.board);
    again.heard();
    assert_eq!(again.answer("G0 X1"), "error:9");
    again.ok("$H");
    again.ok("G0 X1");
}
