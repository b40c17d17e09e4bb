//! What each command does and says.

use relit_test_support::firmware::{FakeBoard, Table};
use rig_firmware::board::ResetCause;

#[test]
fn the_banner_tells_why_the_chip_started() {
    let causes = [
        (ResetCause::PowerOn, "power-on"),
        (ResetCause::External, "external"),
        (ResetCause::BrownOut, "brown-out"),
        (ResetCause::Watchdog, "watchdog"),
    ];
    for (cause, name) in causes {
        let mut board = FakeBoard::new();
        board.cause = cause;
        let banner = format!("Grbl 1.1h ['$' for help] [reset: {name}]");
        assert_eq!(Table::on(board).heard(), [banner]);
    }
    let host = Table::new().say(b"\x18");
    assert_eq!(host, ["Grbl 1.1h ['$' for help] [reset: host]"]);
}

#[test]
fn every_line_gets_one_answer_whatever_its_end() {
    let mut table = Table::new();
    let heard = table.say(b"G21\rG90\nG21\r\n\n\r\n(comment)\n");
    assert_eq!(heard, ["ok"; 6]);
}

#[test]
fn the_settings_are_listed_as_grbl_does() {
    let heard = Table::new().ask("$$");
    let expected = [
        "$0=10",
        "$1=250",
        "$2=0",
        "$3=0",
        "$4=0",
        "$5=0",
        "$14=0",
        "$20=1",
        "$22=0",
        "$23=0",
        "$24=72.000",
        "$25=720.000",
        "$26=20",
        "$27=2.000",
        "$60=0",
        "$61=15.500",
        "$100=88.889",
        "$110=2160.000",
        "$120=36.000",
        "$130=400.000",
        "ok",
    ];
    assert_eq!(heard, expected);
}

#[test]
fn version_and_modal_state_are_told() {
    let mut table = Table::new();
    let version = ["[VER:1.1h.20261121:relit]", "[OPT:NHtcl,8,128]", "ok"];
    assert_eq!(table.ask("$I"), version);
    let modal = "[GC:G0 G54 G17 G21 G90 G94 M5 M9 T0 F0 S0]";
    assert_eq!(table.ask("$G"), [modal, "ok"]);
    table.ok("G1 G91 F254");
    let modal = "[GC:G1 G54 G17 G21 G91 G94 M5 M9 T0 F254 S0]";
    assert_eq!(table.ask("$g"), [modal, "ok"]);
    table.say(b"\x18");
    assert!(table.ask("$G")[0].contains("G0 G54 G17 G21 G90"));
}

#[test]
fn a_status_report_has_all_its_fields() {
    let mut table = Table::new();
    table.board.battery = 781;
    let status = table.status();
    let (head, time) = status.split_once("|T:").unwrap();
    assert_eq!(head, "<Idle|MPos:0.000,0.000,0.000|Bf:8,128|FS:0,0");
    let (time, tail) = time.split_once('|').unwrap();
    assert!(
        (1..100_000).contains(&time.parse::<u32>().unwrap()),
        "{time}"
    );
    assert_eq!(tail, "Bat:11.83>");
}

#[test]
fn pins_show_only_while_active() {
    let mut table = Table::new();
    assert_eq!(table.field("Pn"), None);
    table.board.index = (0, 1);
    assert_eq!(table.field("Pn").as_deref(), Some("X"));
    table.board.press_emergency(true);
    table.run_ms(1);
    assert_eq!(table.field("Pn").as_deref(), Some("XR"));
}

#[test]
fn time_and_position_of_a_report_belong_together() {
    let mut table = Table::new();
    table.ok("G1 X40 F432");
    for _ in 0..40 {
        table.run_ms(100);
        let status = table.status();
        let field = |name: &str| {
            let field = status.split('|').find_map(|field| field.strip_prefix(name));
            field.unwrap().split(',').next().unwrap().to_owned()
        };
        let at = field("T:").parse::<u64>().unwrap() * 2 + 1;
        let truth = table.board.edges.iter().rfind(|edge| edge.at <= at);
        let steps = field("MPos:").parse::<f64>().unwrap() * 88.889;
        let truth = truth.map_or(0, |edge| edge.position);
        assert!((steps - f64::from(truth)).abs() < 0.2, "{status} {truth}");
    }
}

#[test]
fn a_dwell_begins_at_rest_and_lasts() {
    let mut table = Table::new();
    table.ok("G1 X3 F432");
    let start = table.board.now;
    table.ok("G4 P0.5");
    let rest = table.board.edges.last().unwrap().at;
    assert!(rest > start);
    let dwelt = (table.board.now - rest) as f64 / 2e6;
    assert!((0.5..0.51).contains(&dwelt), "{dwelt}");
    table.ok("G4 P0");
}

#[test]
fn bytes_that_grbl_takes_for_overrides_vanish() {
    let mut table = Table::new();
    let heard = table.say(b"G\x901\x84 \xA0X\xFF1 F\x80100\n");
    assert_eq!(heard, ["ok"]);
    table.wait("Idle");
    assert_eq!(table.steps(), 89);
}
