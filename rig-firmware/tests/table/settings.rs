//! Settings in the EEPROM: kept, checked, and safe against a supply that goes away.

use relit_test_support::firmware::{FakeBoard, Table};

/// The values after a restart, and what the start said.
fn restart(mut board: FakeBoard) -> (Table, Vec<String>) {
    board.writes_left = usize::MAX;
    board.sent.clear();
    let mut table = Table::on(board);
    let heard = table.heard();
    (table, heard)
}

fn value(table: &mut Table, name: &str) -> String {
    let lines = table.ask("$$");
    let found = lines.iter().find_map(|line| line.strip_prefix(name));
    found.unwrap().trim_start_matches('=').to_owned()
}

#[test]
fn settings_outlive_a_restart() {
    let mut table = Table::new();
    table.ok("$120=50.5");
    table.ok("$1=255");
    let (mut table, heard) = restart(table.board);
    assert_eq!(heard.len(), 1);
    assert_eq!(value(&mut table, "$120"), "50.500");
    assert_eq!(value(&mut table, "$1"), "255");
}

#[test]
fn a_supply_that_goes_away_while_writing_leaves_old_or_new_settings() {
    let mut table = Table::new();
    table.ok("$120=50");
    table.ok("$110=1000");
    for writes in 0..130 {
        let mut board = FakeBoard::new();
        board.eeprom = table.board.eeprom.clone();
        let (mut writing, _) = restart(board);
        writing.board.writes_left = writes;
        writing.ok("$120=123.456");
        let (mut after, heard) = restart(writing.board);
        let got = value(&mut after, "$120");
        assert!(got == "50.000" || got == "123.456", "{writes}: {got}");
        assert_eq!(value(&mut after, "$110"), "1000.000");
        let torn = heard.first().is_some_and(|line| line == "error:7");
        assert!(!torn || got == "50.000");
        let (_, heard) = restart(after.board);
        assert_eq!(heard.len(), 1, "told and mended");
    }
}

#[test]
fn only_bytes_that_change_are_written() {
    let mut table = Table::new();
    for line in ["$120=50", "$120=51"] {
        table.ok(line);
    }
    table.board.writes_left = 10;
    table.ok("$120=52");
    assert!(table.board.writes_left >= 4, "{}", table.board.writes_left);
    let (mut table, _) = restart(table.board);
    assert_eq!(value(&mut table, "$120"), "52.000");
}

#[test]
fn settings_that_are_damaged_beyond_both_copies_are_restored_and_told() {
    let mut table = Table::new();
    table.ok("$120=50");
    table.ok("$120=51");
    let mut board = table.board;
    board.eeprom[20] ^= 1;
    board.eeprom[128 + 20] ^= 1;
    let (mut table, heard) = restart(board);
    assert_eq!(heard[0], "error:7");
    assert!(heard[1].starts_with("Grbl"));
    assert_eq!(value(&mut table, "$120"), "36.000");
    let (_, heard) = restart(table.board);
    assert_eq!(heard.len(), 1);
}

#[test]
fn any_single_damaged_bit_is_told_and_no_value_is_invented() {
    let mut table = Table::new();
    table.ok("$120=50");
    table.ok("$120=51");
    let good = table.board.eeprom.clone();
    for at in (0..84).chain(128..212) {
        let mut board = FakeBoard::new();
        board.eeprom = good.clone();
        board.eeprom[at] ^= 1 << (at % 8);
        let (mut table, heard) = restart(board);
        assert_eq!(heard[0], "error:7", "{at}");
        let got = value(&mut table, "$120");
        assert!(got == "50.000" || got == "51.000", "{at}: {got}");
    }
}

#[test]
fn the_board_hears_of_outputs_when_they_change() {
    let mut table = Table::new();
    for line in ["$0=5", "$2=1", "$3=1", "$4=1"] {
        table.ok(line);
    }
    let outputs = table.board.outputs.unwrap();
    assert_eq!(outputs.pulse_us, 5);
    assert!(outputs.invert_step && outputs.invert_direction && outputs.invert_enable);
}

#[test]
fn the_driver_is_released_after_rest_and_only_then() {
    let mut table = Table::new();
    assert!(!table.board.driver);
    table.ok("G1 X1 F432");
    table.wait("Idle");
    table.run_ms(200);
    assert!(table.board.driver);
    table.run_ms(60);
    assert!(!table.board.driver);
    table.ok("$1=255");
    table.ok("G1 X2");
    table.wait("Idle");
    table.run_ms(5000);
    assert!(table.board.driver);
}

#[test]
fn a_held_table_keeps_its_driver() {
    let mut table = Table::new();
    table.ok("G1 X20 F432");
    table.run_ms(500);
    table.say(b"!");
    table.run_ms(3000);
    assert!(table.board.driver);
    assert!(table.status().starts_with("<Hold:0|"));
}
