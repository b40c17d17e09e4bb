//! `frames.jsonl`: in an index that can be read, positions count up from 0, sequence and time grow,
//! angles are finite, and the gaps equal the jumps of the sequence. The index is unchanged after
//! pushing or writing its entries again, and truncated anywhere it holds the lines before.

#![no_main]
#![allow(clippy::expect_used, reason = "a fuzz target reports by a panic")]

use libfuzzer_sys::fuzz_target;
use relit_data::session::FrameIndex;

fuzz_target!(|bytes: &[u8]| {
    let Ok(index) = FrameIndex::parse(bytes) else {
        return;
    };
    holds_what_it_promises(&index);
    comes_back(&index);
    if !index.is_truncated() {
        let sum: usize = bytes.iter().copied().map(usize::from).sum();
        let cut = bytes.get(..sum % (bytes.len() + 1)).unwrap_or(bytes);
        survives_a_cut(&index, cut);
    }
});

fn holds_what_it_promises(index: &FrameIndex) {
    let entries = index.entries();
    assert!((0..).zip(entries).all(|(n, entry)| entry.n == n));
    assert!(entries.is_sorted_by(|a, b| a.sequence < b.sequence && a.t_us < b.t_us));
    let mut angles = entries.iter().filter_map(|entry| entry.angle_deg);
    assert!(angles.all(f64::is_finite));

    let missing: u64 = index.gaps().iter().map(|gap| gap.missing).sum();
    if let (Some(first), Some(last)) = (entries.first(), entries.last()) {
        assert_eq!(last.sequence - first.sequence, last.n + missing);
    }
}

fn comes_back(index: &FrameIndex) {
    let mut pushed = FrameIndex::default();
    let mut text = Vec::new();
    for entry in index.entries() {
        pushed.push(*entry).expect("what was read can be pushed");
        serde_json::to_writer(&mut text, entry).expect("what was read can be written");
        text.push(b'\n');
    }
    assert_eq!(pushed.entries(), index.entries());
    assert_eq!(FrameIndex::parse(&text), Ok(pushed));
}

/// A truncated index can be read and lacks only the lines that are gone.
fn survives_a_cut(whole: &FrameIndex, bytes: &[u8]) {
    let left = FrameIndex::parse(bytes).expect("a cut file can be read");
    let ended = bytes.iter().filter(|&&byte| byte == b'\n').count();
    let lines = left.entries().len();
    assert!(lines == ended || lines == ended + 1);
    assert_eq!(whole.entries().get(..lines), Some(left.entries()));
}
