//! Painted seeds: any bytes are marks of the image's size, or are refused.

#![no_main]
#![allow(clippy::expect_used, reason = "a fuzz target reports by a panic")]

use libfuzzer_sys::fuzz_target;
use relit_grabcut::{Hints, Mark, Seeds};
use relit_mask::RecordedHints;

fuzz_target!(|bytes: &[u8]| {
    let Ok(seeds) = Seeds::from_png(bytes) else {
        return;
    };
    let (width, height) = seeds.size();
    assert_eq!(
        seeds.marks().len() as u64,
        u64::from(width) * u64::from(height)
    );
    assert!(seeds.marks().iter().any(|&mark| mark != Mark::Unknown));
    let hints = Hints {
        seeds: Some(seeds),
        ..Hints::default()
    };
    let recorded = RecordedHints::new(&hints, &[]).expect("seeds can be recorded");
    let again = recorded.hints().expect("what was recorded can be read");
    assert_eq!(again, hints);
});
