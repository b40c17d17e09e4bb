//! `mask.json`: a record that can be read is unchanged after writing and reading it again, and so are
//! its hints if they are valid.

#![no_main]
#![allow(clippy::expect_used, reason = "a fuzz target reports by a panic")]

mod completed;

use libfuzzer_sys::fuzz_target;
use relit_mask::{Hints, MASK_SCHEMA, MaskRecord, RecordedHints};

/// A whole record.
const WHOLE: &[u8] = include_bytes!("../seeds/mask_record/both.json");

fuzz_target!(|bytes: &[u8]| {
    check(bytes);
    if let Some(bytes) = completed::completed(bytes, WHOLE) {
        check(&bytes);
    }
});

fn check(bytes: &[u8]) {
    let Ok(record) = MaskRecord::from_json(bytes) else {
        return;
    };
    assert_eq!(record.schema, MASK_SCHEMA);
    let written = record.to_json().expect("what was read can be written");
    let read = MaskRecord::from_json(&written).expect("what was written can be read");
    assert_eq!(read, record);

    let Ok(hints) = record.hints.hints() else {
        return;
    };
    assert_eq!(hints.as_ref().and_then(Hints::rect), record.hints.rect);
    let again = RecordedHints::new(hints.as_ref(), &record.hints.turn_frames)
        .expect("hints that were read can be recorded");
    assert_eq!(again.hints().ok(), Some(hints));
}
