//! Dropped frames: exposures of the camera that it did not deliver.

/// Frames that were exposed and not delivered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct MissingFrames {
    /// The first missing exposure.
    pub exposure: u64,
    /// How many in a row.
    pub count: u64,
    /// The delivered frame that comes after them, from 0.
    pub before: usize,
}

/// The exposures up to, but not with, `end` that are none of the delivered frames', in order.
pub(crate) fn gaps(exposures: &[u64], end: u64) -> Vec<MissingFrames> {
    let mut due = 0;
    let mut missing = Vec::new();
    for (before, &exposure) in exposures.iter().chain([&end]).enumerate() {
        if exposure > due {
            missing.push(MissingFrames {
                exposure: due,
                count: exposure - due,
                before,
            });
        }
        due = exposure.saturating_add(1);
    }
    missing
}
