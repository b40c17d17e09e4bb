//! The turntable's firmware: it survives any input, and nothing moves before a line was accepted or
//! while the emergency stop is pressed.

#![no_main]
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a fuzz target reports by a panic"
)]

use libfuzzer_sys::fuzz_target;
use relit_test_support::firmware::Table;

/// More would only take longer.
const MAX_LENGTH: usize = 1024;

fuzz_target!(|bytes: &[u8]| {
    let mut table = Table::new();
    let mut accepted = false;
    for piece in bytes.chunks(16).take(MAX_LENGTH / 16) {
        let before = table.board.turned;
        let heard = table.say(piece);
        accepted |= heard.iter().any(|line| line.starts_with("ok"));
        accepted |= table.status().starts_with("<Home");
        assert!(accepted || table.board.turned == before, "moved unasked");
    }
    // A setting says which of the two levels is the pressed one.
    let pressed = table.board.press_emergency(true) || table.board.press_emergency(false);
    assert!(pressed, "no level is the pressed one");
    let stood = table.board.turned;
    table.run_ms(20);
    assert_eq!(
        table.board.turned, stood,
        "moved with the emergency stop pressed"
    );
    assert!(table.status().starts_with("<Alarm"));
});
