//! Motion as the motor sees it: the times of the step pulses.

use relit_test_support::firmware::{Edge, Table, extremes};

const STEPS_PER_DEGREE: f64 = 88.889;
const ACCELERATION: f64 = 36.0 * STEPS_PER_DEGREE;
const TICKS_PER_SECOND: f64 = 2e6;

fn seconds(from: &Edge, to: &Edge) -> f64 {
    (to.at - from.at) as f64 / TICKS_PER_SECOND
}

/// Interval before each pulse, in ticks.
fn intervals(edges: &[Edge]) -> Vec<f64> {
    edges
        .windows(2)
        .map(|pair| (pair[1].at - pair[0].at) as f64)
        .collect()
}

/// Speed and acceleration at their highest, as fractions of what is allowed.
fn worst(edges: &[Edge], top: f64) -> (f64, f64) {
    let (fastest, hardest) = extremes(edges);
    (fastest / top, hardest / ACCELERATION)
}

#[test]
fn a_turn_is_360_degrees_at_an_even_speed() {
    let mut table = Table::new();
    table.ok("G1 X360 F432");
    table.wait("Idle");
    let edges = &table.board.edges;
    assert_eq!(table.steps(), 32_000);
    assert_eq!(edges.len(), 32_000);
    let ramp = (7.2_f64.powi(2) / (2.0 * 36.0) * STEPS_PER_DEGREE).round() as usize;
    let even = &edges[ramp..edges.len() - ramp];
    // A video frame is 0.24 degrees: 21 and a third steps.
    let frame = 64;
    let expected = frame as f64 / (7.2 * STEPS_PER_DEGREE);
    for pair in even.windows(frame + 1).step_by(16) {
        let took = seconds(&pair[0], &pair[frame]);
        assert!((took / expected - 1.0).abs() < 0.001, "{took} {expected}");
    }
    for pair in even.windows(22) {
        let took = seconds(&pair[0], &pair[21]);
        let expected = 21.0 / (7.2 * STEPS_PER_DEGREE);
        assert!((took / expected - 1.0).abs() < 0.005, "{took} {expected}");
    }
    let whole = seconds(&even[0], even.last().unwrap());
    let speed = (even.len() - 1) as f64 / whole;
    let exact = 7.2 * STEPS_PER_DEGREE;
    assert!((speed / exact - 1.0).abs() < 1.5e-6, "{speed} {exact}");
}

#[test]
fn a_turn_and_its_ramps_take_their_time() {
    let mut table = Table::new();
    table.ok("G1 X360 F432");
    table.wait("Idle");
    let edges = &table.board.edges;
    let took = seconds(&edges[0], edges.last().unwrap());
    // 50 s, and half of the 0.2 s of a ramp at either end; less the way to the first pulse,
    // sqrt(2 / a), and what the correction takes off the last interval.
    let expected = 50.2 - (2.0 / ACCELERATION).sqrt() * (1.0 + 0.324);
    assert!((took - expected).abs() < 0.002, "{took} {expected}");
}

#[test]
fn ramps_have_the_length_of_constant_acceleration() {
    for feed in [200.0, 432.0, 1000.0, 2160.0] {
        let mut table = Table::new();
        table.ok(&format!("G1 X200 F{feed}"));
        table.wait("Idle");
        let speed = feed / 60.0 * STEPS_PER_DEGREE;
        let cruise = TICKS_PER_SECOND / speed;
        let intervals = intervals(&table.board.edges);
        let ramp = intervals.iter().take_while(|&&ticks| ticks > cruise + 1.0);
        let exact = speed.powi(2) / (2.0 * ACCELERATION);
        let got = ramp.count() as f64 + 1.0;
        assert!(
            (got - exact).abs() < (exact * 0.01).max(1.5),
            "{feed}: {got} {exact}"
        );
        let braking = intervals
            .iter()
            .rev()
            .take_while(|&&ticks| ticks > cruise + 1.0);
        let got = braking.count() as f64;
        assert!(
            (got - exact).abs() < (exact * 0.01).max(1.5),
            "{feed}: {got} {exact}"
        );
    }
}

#[test]
fn speed_and_acceleration_stay_within_their_limits() {
    let mut table = Table::new();
    table.ok("G0 X100");
    table.ok("G0 X-3");
    table.ok("G0 X-2.9");
    table.wait("Idle");
    let turn = table
        .board
        .edges
        .iter()
        .position(|edge| edge.position == 8889);
    let (fastest, hardest) = worst(&table.board.edges[..turn.unwrap()], 36.0 * STEPS_PER_DEGREE);
    assert!(fastest < 1.001 && hardest < 1.1, "{fastest} {hardest}");
    assert_eq!(table.steps(), -258);
}

#[test]
fn chained_blocks_run_through_without_a_stop() {
    let mut table = Table::new();
    table.ok("G91");
    for feed in [432, 432, 1000, 300, 300, 900] {
        table.ok(&format!("G1 X10 F{feed}"));
    }
    table.wait("Idle");
    let edges = &table.board.edges;
    let (fastest, hardest) = worst(edges, 1000.0 / 60.0 * STEPS_PER_DEGREE);
    assert!(fastest < 1.001 && hardest < 1.1, "{fastest} {hardest}");
    let slowest = TICKS_PER_SECOND / (300.0 / 60.0 * STEPS_PER_DEGREE);
    let inner = intervals(edges);
    let inner = &inner[200..inner.len() - 800];
    let longest = inner.iter().copied().fold(0.0, f64::max);
    assert!(longest <= slowest * 1.01, "{longest} {slowest}");
    // Each block is at its speed in its middle.
    for (block, feed) in [(0, 432.0), (1, 432.0), (2, 1000.0), (3, 300.0), (5, 900.0)] {
        let middle = block * 889 + 400;
        let speed = TICKS_PER_SECOND / (edges[middle + 1].at - edges[middle].at) as f64;
        let expected = feed / 60.0 * STEPS_PER_DEGREE;
        assert!((speed / expected - 1.0).abs() < 0.01, "{block}: {speed}");
    }
}

#[test]
fn a_reversal_stops_in_between() {
    let mut table = Table::new();
    table.ok("G1 X5 F1000");
    table.ok("G1 X-5");
    table.wait("Idle");
    let edges = &table.board.edges;
    assert_eq!(table.steps(), -444);
    let top = edges.iter().position(|edge| edge.position == 444).unwrap();
    let pause = seconds(&edges[top], &edges[top + 1]);
    assert!(pause > 0.01, "{pause}");
}

#[test]
fn relative_moves_do_not_drift() {
    let mut table = Table::new();
    table.ok("G91 F2000");
    for _ in 0..300 {
        table.ok("G1 X0.333");
    }
    table.wait("Idle");
    assert_eq!(table.steps(), (99.9 * STEPS_PER_DEGREE).round() as i32);
    table.ok("G1 X-99.9");
    table.wait("Idle");
    assert_eq!(table.steps(), 0);
}

#[test]
fn very_short_and_very_slow_moves_arrive() {
    let mut table = Table::new();
    for target in ["0.01", "0.02", "0.05", "0.06"] {
        table.ok(&format!("G1 X{target} F432"));
    }
    table.ok("G1 X0.1 F1");
    table.wait("Idle");
    assert_eq!(table.steps(), 9);
    let edges = &table.board.edges;
    let last = edges.len() - 1;
    let slow = seconds(&edges[last - 1], &edges[last]);
    assert!((slow - 60.0 / STEPS_PER_DEGREE).abs() < 0.001, "{slow}");
}

#[test]
fn a_hold_ramps_down_at_the_next_step_and_keeps_the_plan() {
    let mut table = Table::new();
    for turn in 1..=8 {
        table.ok(&format!("G1 X{} F432", turn * 10));
    }
    table.run_ms(3000);
    let held = table.board.now;
    table.board.hear(b'!');
    table.wait("Hold:0");
    let after: Vec<_> = table
        .board
        .edges
        .iter()
        .filter(|edge| edge.at > held)
        .collect();
    // One step was under way already.
    let first = (after[2].at - after[1].at) as f64;
    assert!(first > 3125.5, "{first}");
    assert!((after.len() as i32 - 64).abs() <= 2, "{}", after.len());
    let stopped = (after.last().unwrap().at - held) as f64 / TICKS_PER_SECOND;
    assert!(stopped < 0.22, "{stopped}");
    assert_eq!(table.field("FS").as_deref(), Some("0,0"));
    table.run_ms(1000);
    table.say(b"~");
    assert!(table.status().starts_with("<Run|"));
    table.wait("Idle");
    assert_eq!(table.steps(), 7111);
}

#[test]
fn holds_in_the_ramps_end_on_the_step() {
    for hold_at in [5, 40, 120, 190, 300, 2500, 2900, 2960, 3050, 3190] {
        let mut table = Table::new();
        table.ok("G1 X21.6 F432");
        table.run_ms(hold_at);
        table.say(b"!");
        assert!(table.status().starts_with("<Hold:"), "{hold_at}");
        table.run_ms(60);
        table.say(b"~");
        table.run_ms(30);
        table.say(b"!");
        table.wait("Hold:0");
        table.say(b"~");
        table.wait("Idle");
        assert_eq!(table.steps(), 1920, "{hold_at}");
        let (fastest, hardest) = worst(&table.board.edges, 640.0);
        assert!(
            fastest < 1.001 && hardest < 1.1,
            "{hold_at}: {fastest} {hardest}"
        );
    }
}

#[test]
fn a_hold_is_told_while_it_ramps_and_once_it_stands() {
    let mut table = Table::new();
    table.ok("G1 X50 F2160");
    table.run_ms(2000);
    table.say(b"!");
    assert!(table.status().starts_with("<Hold:1|"));
    table.wait("Hold:0");
    table.ok("G1 X40");
    table.run_ms(500);
    assert!(table.status().starts_with("<Hold:0|"));
    table.say(b"~");
    table.wait("Idle");
    assert_eq!(table.steps(), 3556);
}

#[test]
fn a_hold_at_rest_keeps_lines_waiting() {
    let mut table = Table::new();
    table.say(b"!");
    assert!(table.status().starts_with("<Hold:0|"));
    table.ok("G1 X5 F432");
    table.run_ms(1000);
    assert_eq!(table.steps(), 0);
    table.say(b"~");
    table.wait("Idle");
    assert_eq!(table.steps(), 444);
}

#[test]
fn a_full_queue_makes_the_line_wait() {
    let mut table = Table::new();
    for x in 1..=8 {
        table.ok(&format!("G1 X{x} F432"));
    }
    assert_eq!(table.field("Bf").as_deref(), Some("0,128"));
    table.board.type_bytes(b"G1 X9\nG1 X10\n");
    table.run_ms(50);
    assert!(table.heard().is_empty());
    assert!(table.status().starts_with("<Run|"), "real-time bytes go on");
    table.run_ms(400);
    assert_eq!(table.heard(), ["ok", "ok"]);
    table.wait("Idle");
    assert_eq!(table.steps(), 889);
}

#[test]
fn a_jog_is_cancelled_and_forgotten() {
    for cancel in [b"\x85", b"!"] {
        let mut table = Table::new();
        table.ok("G1 F100");
        table.ok("$J=G91 X100 F432");
        table.ok("$J=G91 X100 F432");
        table.run_ms(1000);
        assert!(table.status().starts_with("<Jog|"));
        table.say(cancel);
        table.wait("Idle");
        let stood = table.steps();
        assert!((500..800).contains(&stood), "{stood}");
        table.run_ms(500);
        table.say(b"~");
        table.run_ms(500);
        assert_eq!(table.steps(), stood);
        table.ok("G91 G0 X1");
        table.wait("Idle");
        assert!((table.steps() - stood - 89).abs() <= 1);
        assert!(table.ask("$G")[0].contains("G0"));
    }
}

#[test]
fn a_jog_that_waits_for_room_is_dropped_with_the_others() {
    let mut table = Table::new();
    for _ in 0..8 {
        table.ok("$J=G91 X5 F432");
    }
    table.board.type_bytes(b"$J=G91 X5 F432\n");
    table.run_ms(50);
    assert!(table.heard().is_empty());
    table.say(b"\x85");
    table.wait("Idle");
    let stood = table.steps();
    table.run_ms(1000);
    assert_eq!(table.steps(), stood);
}

#[test]
fn a_cancel_without_a_jog_does_nothing() {
    let mut table = Table::new();
    table.ok("G1 X5 F432");
    table.run_ms(100);
    table.say(b"\x85");
    assert!(table.status().starts_with("<Run|"));
    table.wait("Idle");
    assert_eq!(table.steps(), 444);
}

#[test]
fn the_reported_speed_is_the_real_one() {
    let mut table = Table::new();
    table.ok("G1 X20 F432");
    table.run_ms(1000);
    assert_eq!(table.field("FS").as_deref(), Some("432,0"));
    table.ok("G0 X0");
    table.run_ms(3000);
    table.wait("Idle");
    table.ok("$110=300");
    table.ok("G1 X20 F5000");
    table.run_ms(1000);
    assert_eq!(table.field("FS").as_deref(), Some("300,0"));
}
