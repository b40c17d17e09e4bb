//! `mask.json`: a record that can be read is unchanged after writing and reading it again, and so are
//! its hints if they are valid; its strokes can be painted or are refused.

#![no_main]
#![allow(clippy::expect_used, reason = "a fuzz target reports by a panic")]

mod completed;

use libfuzzer_sys::fuzz_target;
use relit_mask::{MASK_SCHEMA, MaskRecord, RecordedHints};

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
    assert_eq!(hints.rect, record.hints.rect);
    let again = RecordedHints::new(&hints, &record.hints.turn_frames)
        .expect("hints that were read can be recorded");
    assert_eq!(again.hints().ok().as_ref(), Some(&hints));

    // A frame of any size can be said to be the source; what is painted on a small one shows the same.
    let (width, height) = (record.source.width.min(64), record.source.height.min(64));
    if let Ok(Some(seeds)) = hints.strokes.paint((width, height), None) {
        assert_eq!(seeds.size(), (width, height));
    }
}
