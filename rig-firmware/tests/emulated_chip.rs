//! The firmware that is flashed, on an emulated ATmega328P, timed in the chip's own cycles.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    missing_docs
)]

mod chip;

use std::process::ExitCode;

use relit_test_support::trials;

use chip::{CYCLES_PER_US, Chip, MS, STEPS_PER_DEGREE, Step};

/// Cycles of one step at 432 degrees/min.
const TURN_INTERVAL: f64 = 60.0 * 16e6 / (432.0 * STEPS_PER_DEGREE);

/// A byte's time on the wire.
const BYTE: u64 = 1360;

fn main() -> ExitCode {
    let mut trials = trials![with power_on =>
        a_whole_turn_takes_50_s_at_constant_speed_while_the_host_polls,
        speed_grows_and_falls_by_the_set_acceleration,
        a_feed_hold_ramps_down_at_once_with_a_full_buffer_and_resumes_to_the_exact_target,
        a_reset_stops_at_once_and_names_its_cause,
        a_silent_host_loses_its_lease,
        the_emergency_stop_ends_steps_and_current_within_a_millisecond_and_latches,
        homing_finds_the_same_step_from_everywhere_and_from_both_sides,
        a_table_without_an_index_gives_homing_up,
        a_hung_program_stops_the_motor_and_starts_anew_and_says_so,
        the_battery_is_measured,
        the_driver_is_fed_before_the_first_step_and_released_after_rest,
        time_and_position_of_a_report_belong_together,
        ten_thousand_checked_lines_at_full_speed_lose_no_byte,
        the_direction_pin_is_the_one_of_grbl,
    ];
    trials.extend(trials![with Chip::start => settings_survive_a_reset_and_damage_is_told]);
    trials::run(trials)
}

/// The chip after power-on.
fn power_on() -> Result<Chip, String> {
    Chip::start().map(|(chip, _)| chip)
}

fn intervals(steps: &[Step]) -> impl Iterator<Item = f64> + '_ {
    steps
        .windows(2)
        .map(|pair| (pair[1].cycle - pair[0].cycle) as f64)
}

fn degrees(steps: f64) -> f64 {
    steps / STEPS_PER_DEGREE
}

/// Moves at the speed of a turn, with more blocks behind, long enough to have ramped up.
fn turn_with_full_buffer(chip: &mut Chip) {
    chip.accept("G91");
    for _ in 0..13 {
        chip.write(b"G1X5F432\n");
    }
    chip.run(1000 * MS);
    assert_eq!(chip.status().state(), "Run");
}

/// The first step of the ramp to the last one, which is 7.2^2 / (2 * 36) degrees long.
fn ramp_down_began(chip: &Chip) -> u64 {
    let ramp = (0.72 * STEPS_PER_DEGREE - 0.5) as usize;
    chip.steps[chip.steps.len() - ramp].cycle
}

fn a_whole_turn_takes_50_s_at_constant_speed_while_the_host_polls(mut chip: Chip) {
    chip.accept("G91");
    chip.accept("G1 X362 F432");
    while chip.status().state() == "Run" {
        chip.run(50 * MS);
    }
    assert_eq!(chip.net_steps(), (362.0 * STEPS_PER_DEGREE).round() as i64);

    // One degree is left for each ramp, which takes 0.72.
    let margin = STEPS_PER_DEGREE.ceil() as usize;
    let turn = (360.0 * STEPS_PER_DEGREE).round() as usize;
    let constant = &chip.steps[margin..=margin + turn];
    let seconds = (constant[turn].cycle - constant[0].cycle) as f64 / 16e6;
    assert!((seconds - 50.0).abs() <= 0.05, "{seconds} s");

    let frame = (0.24 * STEPS_PER_DEGREE).floor() as usize;
    let worst = constant
        .windows(frame + 1)
        .map(|steps| {
            let interval = (steps[frame].cycle - steps[0].cycle) as f64 / frame as f64;
            (TURN_INTERVAL / interval - 1.0).abs()
        })
        .fold(0.0, f64::max);
    let shortest = intervals(constant).fold(f64::MAX, f64::min);
    let longest = intervals(constant).fold(0.0, f64::max);
    println!(
        "a turn: {seconds:.5} s; worst speed error over 0.24 degrees {:.4} %; steps {:.1} to \
         {:.1} us apart",
        worst * 100.0,
        shortest / 16.0,
        longest / 16.0
    );
    assert!(worst <= 0.005, "{worst}");
    assert_eq!(chip.overruns, 0);
}

fn speed_grows_and_falls_by_the_set_acceleration(mut chip: Chip) {
    chip.accept("G91");
    chip.accept("G1 X20 F432");
    chip.rest();
    let fast = |steps: &[Step]| {
        steps
            .windows(2)
            .position(|pair| ((pair[1].cycle - pair[0].cycle) as f64) < TURN_INTERVAL * 1.002)
            .expect("the table reaches its speed") as f64
    };
    let up = degrees(fast(&chip.steps));
    let mut backwards: Vec<Step> = chip.steps.clone();
    let end = backwards.last().unwrap().cycle;
    backwards.reverse();
    for step in &mut backwards {
        step.cycle = end - step.cycle;
    }
    let down = degrees(fast(&backwards));
    println!("ramps: {up:.3} and {down:.3} degrees");
    assert!((up - 0.72).abs() < 0.05, "{up}");
    assert!((down - 0.72).abs() < 0.05, "{down}");
}

fn a_feed_hold_ramps_down_at_once_with_a_full_buffer_and_resumes_to_the_exact_target(
    mut chip: Chip,
) {
    turn_with_full_buffer(&mut chip);
    let held = chip.cycle + BYTE;
    chip.write(b"!");
    chip.run(500 * MS);
    let slowed = ramp_down_began(&chip);
    println!("hold: slower {} us after the byte", (slowed - held) / 16);
    assert!(slowed - held <= 10 * MS);

    let stopped = chip.steps.last().unwrap().cycle;
    assert!(stopped - held < 230 * MS, "the ramp of 0.2 s and a little");
    assert_eq!(chip.status().state(), "Hold:0");
    chip.write(b"~");
    chip.rest();
    assert_eq!(chip.net_steps(), (65.0 * STEPS_PER_DEGREE).round() as i64);
}

fn a_reset_stops_at_once_and_names_its_cause(mut chip: Chip) {
    turn_with_full_buffer(&mut chip);
    let reset = chip.cycle + BYTE;
    chip.write(&[0x18]);
    chip.run(20 * MS);
    let last = chip.steps.last().unwrap().cycle;
    assert!(last < reset + 100 * CYCLES_PER_US, "{last} {reset}");

    let mut lines = Vec::new();
    while let Some(line) = chip.line(200 * MS) {
        lines.push(line);
    }
    assert!(lines.contains(&"ALARM:3".to_string()), "{lines:?}");
    assert!(
        lines.contains(&"Grbl 1.1h ['$' for help] [reset: host]".to_string()),
        "{lines:?}"
    );
    assert_eq!(chip.ask("G1 X1 F100").1, "error:9");
    chip.accept("$X");
}

fn a_silent_host_loses_its_lease(mut chip: Chip) {
    chip.accept("$60=1");
    chip.accept("G91");
    chip.accept("G1 X100 F432");
    chip.run(500 * MS);
    let last_byte = chip.cycle + BYTE;
    chip.status();
    chip.run(1500 * MS);
    let slowed = ramp_down_began(&chip);
    println!(
        "lease of 1 s: slower after {} ms",
        (slowed - last_byte) / MS
    );
    assert!(slowed > last_byte + 990 * MS, "not before its time");
    assert!(slowed <= last_byte + 1100 * MS);
    assert!(chip.steps.last().unwrap().cycle <= last_byte + 1310 * MS);
    assert_eq!(chip.line(MS).as_deref(), Some("ALARM:20"));
    assert_eq!(chip.status().state(), "Alarm");
    let position = (chip.status().position() * STEPS_PER_DEGREE).round() as i64;
    assert_eq!(position, chip.net_steps(), "the position is kept");
    chip.accept("$X");
}

fn the_emergency_stop_ends_steps_and_current_within_a_millisecond_and_latches(mut chip: Chip) {
    turn_with_full_buffer(&mut chip);
    // The main loop is busy for some 50 ms.
    chip.write(b"$$\n");
    chip.run(10 * MS);
    let pressed = chip.cycle;
    chip.command("pin estop 0");
    chip.run(300 * MS);
    let last = chip.steps.last().unwrap().cycle;
    let released = chip.enables.last().unwrap();
    println!(
        "emergency stop: last step {} us after, driver released {} us after",
        last.saturating_sub(pressed) / 16,
        (released.cycle - pressed) / 16
    );
    assert!(last <= pressed + MS);
    assert!(released.level && released.cycle <= pressed + MS);
    assert!(released.cycle >= pressed);

    while let Some(line) = chip.line(MS) {
        if line == "ALARM:10" {
            break;
        }
    }
    assert_eq!(chip.status().field("Pn"), Some("R"));
    assert_eq!(chip.ask("$X").1, "error:9");
    chip.command("pin estop 1");
    chip.run(10 * MS);
    assert_eq!(chip.ask("$X").1, "error:9", "latched until a reset");
    chip.write(&[0x18]);
    chip.banner();
    chip.accept("$X");
}

/// Homes from where the table stands; returns the step, counted since power-on, that is zero now.
fn home(chip: &mut Chip) -> i64 {
    chip.accept("$H");
    let position = (chip.status().position() * STEPS_PER_DEGREE).round() as i64;
    chip.net_steps() - position
}

fn homing_finds_the_same_step_from_everywhere_and_from_both_sides(mut chip: Chip) {
    chip.command("index 1000 1050 32000");
    chip.accept("$22=1");
    let first = home(&mut chip);
    for start in [
        "G1 X-5 F2160",
        "G1 X-9.5 F2160",
        "G1 X0.2 F2160",
        "G1 X0 F2160",
    ] {
        chip.accept("G90");
        chip.accept(start);
        chip.rest();
        assert_eq!(home(&mut chip), first, "after {start}");
    }
    assert_eq!(first, 1000, "the first step at which the index is active");

    chip.accept("$23=1");
    let other = home(&mut chip);
    for start in ["G1 X6 F2160", "G1 X-0.3 F2160"] {
        chip.accept("G90");
        chip.accept(start);
        chip.rest();
        assert_eq!(home(&mut chip), other, "after {start}");
    }
    assert_eq!(
        other, 1050,
        "from the other side, the index begins at its other end"
    );
}

fn a_table_without_an_index_gives_homing_up(mut chip: Chip) {
    chip.accept("$22=1");
    chip.accept("$25=2160");
    chip.write(b"$H\n");
    let mut lines = Vec::new();
    while !lines.iter().any(|line| line == "ALARM:9") {
        lines.push(chip.line(30_000 * MS).expect("the search ends"));
    }
    let searched = degrees(chip.steps.len() as f64);
    assert!((374.9..376.0).contains(&searched), "{searched} degrees");
}

fn settings_survive_a_reset_and_damage_is_told((mut chip, banner): (Chip, String)) {
    assert!(banner.ends_with("[reset: power-on]"), "{banner}");
    chip.accept("$120=40");
    chip.accept("$1=255");
    chip.command("reset external");
    assert!(chip.banner().ends_with("[reset: external]"));
    let (listing, _) = chip.ask("$$");
    assert!(listing.contains(&"$120=40.000".to_string()), "{listing:?}");
    assert!(listing.contains(&"$1=255".to_string()), "{listing:?}");

    for address in 0..512 {
        chip.command(&format!("eeprom {address} {}", (address * 7 + 3) % 256));
    }
    chip.command("reset power-on");
    let told = chip.line(500 * MS);
    assert_eq!(told.as_deref(), Some("error:7"));
    chip.banner();
    let (listing, _) = chip.ask("$$");
    assert!(listing.contains(&"$120=36.000".to_string()), "{listing:?}");
}

fn a_hung_program_stops_the_motor_and_starts_anew_and_says_so(mut chip: Chip) {
    turn_with_full_buffer(&mut chip);
    let hung = chip.cycle;
    chip.command("hang");
    let banner = chip.banner();
    assert!(banner.ends_with("[reset: watchdog]"), "{banner}");
    let last = chip.steps.last().unwrap().cycle;
    assert!(last < hung + 600 * MS, "{last} {hung}");
    assert!(chip.enables.last().unwrap().level, "the driver is released");
    assert_eq!(chip.status().position(), 0.0);

    chip.command("reset brown-out");
    assert!(chip.banner().ends_with("[reset: brown-out]"));
    chip.command("reset external");
    assert!(chip.banner().ends_with("[reset: external]"));
}

fn the_battery_is_measured(mut chip: Chip) {
    for (millivolts, full_scale, volts) in [(3000_u32, "15.5", 9.3), (4000, "16", 12.8)] {
        chip.accept(&format!("$61={full_scale}"));
        chip.command(&format!("battery {millivolts}"));
        chip.run(10 * MS);
        let shown: f64 = chip.status().field("Bat").unwrap().parse().unwrap();
        assert!((shown - volts).abs() <= 0.02, "{shown} for {volts}");
    }
}

fn the_driver_is_fed_before_the_first_step_and_released_after_rest(mut chip: Chip) {
    let before = chip.enables.len();
    chip.accept("G91");
    chip.accept("G1 X2 F432");
    chip.rest();
    chip.run(400 * MS);
    let [fed, released] = chip.enables[before..] else {
        panic!("{:?}", &chip.enables[before..]);
    };
    assert!(!fed.level && released.level);
    let lead = chip.steps[0].cycle - fed.cycle;
    assert!((MS..50 * MS).contains(&lead), "{} us", lead / 16);
    let rest = released.cycle - chip.steps.last().unwrap().cycle;
    assert!((245 * MS..280 * MS).contains(&rest), "{} ms", rest / MS);
}

fn time_and_position_of_a_report_belong_together(mut chip: Chip) {
    chip.accept("G91");
    chip.accept("G1 X30 F2160");
    chip.run(300 * MS);
    // The clock starts with the pins; a step's pulse lags behind its interrupt's beginning.
    let start = chip.enables[0].cycle;
    let slack = 150 * CYCLES_PER_US;
    for pause in [3, 7, 11, 13, 17, 19, 23, 29, 31, 37] {
        chip.run(pause * MS + pause * 1237);
        let status = chip.status();
        let at = start + status.micros() * CYCLES_PER_US;
        let steps =
            |cycle: u64| chip.steps.iter().filter(|step| step.cycle <= cycle).count() as f64;
        let told = (status.position() * STEPS_PER_DEGREE).round();
        assert!(
            (steps(at - slack)..=steps(at + slack)).contains(&told),
            "{told} steps at {at}, {} to {}",
            steps(at - slack),
            steps(at + slack)
        );
    }
}

/// CRC-16/CCITT-FALSE, bit by bit.
fn crc(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0xFFFF, |crc, byte| {
        (0..8).fold(crc ^ (u16::from(*byte) << 8), |crc, _| {
            if crc & 0x8000 == 0 {
                crc << 1
            } else {
                (crc << 1) ^ 0x1021
            }
        })
    })
}

fn checked(text: &str) -> String {
    format!("{text}*{:04X}", crc(text.as_bytes()))
}

fn ten_thousand_checked_lines_at_full_speed_lose_no_byte(mut chip: Chip) {
    chip.accept("$110=2160");
    chip.accept("G90");
    for target in [390, -390, 390, -390, 390] {
        chip.accept(&format!("G1 X{target} F2160"));
    }
    let blocks = ["G90", "F2160", "", "(a comment that makes it long) G1 F432"];
    let session = checked("N0 ");
    chip.write(format!("{session}\n").as_bytes());
    assert_eq!(chip.line(100 * MS), Some(checked("ok N0")));

    // Four lines without a pause, as many as the buffer takes, and a report between them.
    for burst in 0..2500 {
        let numbers = burst * 4 + 1..=burst * 4 + 4;
        let mut bytes = String::new();
        for number in numbers.clone() {
            bytes += &checked(&format!("N{number} {}", blocks[number % blocks.len()]));
            bytes += "\n";
        }
        assert!(bytes.len() <= 128, "{}", bytes.len());
        bytes.insert(bytes.len() / 2, '?');
        chip.write(bytes.as_bytes());
        for number in numbers {
            let mut answer = chip.line(500 * MS).expect("an answer within 500 ms");
            while answer.starts_with('<') {
                assert!(answer.starts_with("<Run"), "{answer}");
                answer = chip.line(500 * MS).expect("an answer within 500 ms");
            }
            assert_eq!(answer, checked(&format!("ok N{number}")));
        }
    }
    assert_eq!(chip.overruns, 0);
    let free = chip.stack_free();
    println!("stack: {free} bytes were never used");
    assert!(free >= 128, "{free}");
}

/// The level of DIR at the first step that a line makes.
fn first_direction(chip: &mut Chip, line: &str) -> u8 {
    let before = chip.steps.len();
    chip.write(format!("{line}\n").as_bytes());
    while chip.steps.len() == before {
        chip.run(10 * MS);
    }
    let level = u8::from(!chip.steps[before].forward);
    chip.write(&[0x18]);
    chip.run(500 * MS);
    while chip.line(MS).is_some() {}
    chip.accept("$X");
    level
}

fn the_direction_pin_is_the_one_of_grbl(mut chip: Chip) {
    chip.command("index 1000 1050 32000");
    // Grbl's documentation of 1.1: "By default, the axes move in a positive direction when the
    // direction pin signal is low, and a negative direction when the pin is high" ($3); homing
    // first moves in positive direction, and the other way with $23.
    let table = [
        ("G91G1X5F432", [0, 1], [0, 1]),
        ("G91G1X-5F432", [1, 0], [1, 0]),
        ("$J=G91X5F432", [0, 1], [0, 1]),
        ("$J=G91X-5F432", [1, 0], [1, 0]),
        ("$H", [0, 1], [1, 0]),
    ];
    chip.accept("$22=1");
    for homing_inverted in [0, 1] {
        chip.accept(&format!("$23={homing_inverted}"));
        for inverted in [0, 1] {
            chip.accept(&format!("$3={inverted}"));
            for (line, usual, other) in &table {
                let wanted = [usual, other][homing_inverted][inverted];
                let found = first_direction(&mut chip, line);
                assert_eq!(
                    found, wanted,
                    "{line} with $3={inverted} $23={homing_inverted}"
                );
            }
        }
    }
}
