//! Every error number that a line can get.

use relit_test_support::firmware::Table;

#[test]
fn each_wrong_line_gets_its_number_and_moves_nothing() {
    let cases = [
        ("1X5", 1),
        ("GX", 2),
        ("$SLP", 3),
        ("$N0=G0", 3),
        ("G4 P-1", 4),
        ("$H", 5),
        ("$0=2", 6),
        ("$110=7000", 12),
        ("$J=X401 F100", 15),
        ("$J X1F1", 16),
        ("$J=G1X1F1", 16),
        ("G2 X1", 20),
        ("M3", 20),
        ("G0 G1", 21),
        ("G1 X1", 22),
        ("G1.5 X1", 23),
        ("X1 X2", 25),
        ("$J=F1", 26),
        ("G92 X1", 20),
        ("G20", 20),
        ("N10000000", 27),
        ("G4", 28),
        ("G28", 20),
        ("G53", 30),
        ("G4 P1 X1", 31),
        ("X2147484", 33),
        ("G0 X1 P1", 36),
        ("N1 G0 X1*0000", 70),
    ];
    for (line, code) in cases {
        let mut table = Table::new();
        assert_eq!(table.ask(line), [format!("error:{code}")], "{line}");
        table.run_ms(100);
        assert!(table.board.edges.is_empty(), "{line}");
        table.ok("G0 X1");
    }
}

#[test]
fn settings_stay_while_the_table_moves() {
    let mut table = Table::new();
    table.ok("G1 X5 F432");
    for line in ["$120=40", "$J=X1 F1"] {
        assert_eq!(table.answer(line), "error:8", "{line}");
    }
    table.wait("Idle");
    table.ok("$120=40");
}

#[test]
fn homing_needs_rest() {
    let mut table = Table::new();
    table.ok("$22=1");
    table.ok("G1 X5 F432");
    assert_eq!(table.answer("$H"), "error:8");
    table.say(b"!");
    assert_eq!(table.answer("$H"), "error:8");
}

#[test]
fn a_locked_table_answers_settings_and_refuses_motion() {
    let mut table = Table::new();
    table.answer("G0 X500");
    for line in ["G0 X1", "$J=X1 F1", "nonsense"] {
        assert_eq!(table.answer(line), "error:9", "{line}");
    }
    table.ok("");
    table.ok("$120=30");
    assert_eq!(table.ask("$X"), ["[MSG:Caution: Unlocked]", "ok"]);
    table.ok("G0 X1");
}

#[test]
fn a_jogging_table_refuses_g_code() {
    let mut table = Table::new();
    table.ok("$J=X20 F432");
    assert_eq!(table.answer("G0 X1"), "error:9");
    table.ok("$J=X21 F432");
    table.wait("Idle");
    table.ok("G0 X1");
}

#[test]
fn a_line_too_long_is_refused_whole() {
    let mut table = Table::new();
    let long = format!("G0 X1 {}", "N1".repeat(60));
    assert_eq!(table.answer(&long), "error:11");
    let blanks = format!("G0 X1 {}", " ".repeat(60));
    table.ok(&blanks);
}

#[test]
fn lost_bytes_make_the_line_an_error() {
    let mut table = Table::new();
    table.say(b"G0 X");
    table.board.lose_byte();
    assert_eq!(table.say(b"1\n"), ["error:70"]);
    table.ok("G0 X1");
    table.wait("Idle");
    assert_eq!(table.steps(), 89);
}

#[test]
fn a_receive_buffer_that_overflows_refuses_what_it_held() {
    let mut table = Table::new();
    let mut burst = b"G4P0.2\n".to_vec();
    burst.extend(b"G91 G0 X1\n".repeat(20));
    let heard = table.say(&burst);
    let mut all = heard;
    table.run_ms(400);
    all.extend(table.heard());
    assert_eq!(all[0], "ok");
    assert!(all.contains(&"error:70".to_owned()), "{all:?}");
    table.wait("Idle");
    let moves = all.iter().filter(|line| *line == "ok").count() as i32 - 1;
    let expected = (f64::from(moves) * 88.889).round() as i32;
    assert_eq!(table.steps(), expected, "{all:?}");
}
