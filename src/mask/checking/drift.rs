//! How far the object lies beside the mask in each frame.

use relit_grabcut::Registration;
use serde::Serialize;

/// A frame whose likeness is less than this share of the median says nothing about where the object is.
const LEAST_LIKENESS: f32 = 0.4;
/// Frames that the page shows.
const SHOWN: usize = 6;
/// Frames shown are at least so far apart, as a share of the video.
const APART: f64 = 0.02;

/// Where the object is in a frame, against the mask.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FrameDrift {
    /// The frame's number.
    pub frame: u64,
    /// To the right, pixels.
    pub dx: f32,
    /// Down, pixels.
    pub dy: f32,
}

impl FrameDrift {
    /// How far, pixels.
    #[must_use]
    pub fn px(&self) -> f32 {
        self.dx.hypot(self.dy)
    }
}

/// How far the object lies beside the mask over the turn.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DriftCheck {
    /// The median, pixels.
    pub median_px: f32,
    /// What 95 % of the frames stay below, pixels.
    pub p95_px: f32,
    /// The frame with the largest one.
    pub most: FrameDrift,
    /// Frames in which the object was found.
    pub frames: usize,
    /// Frames that were lost, or in which it was not found.
    pub unsure: usize,
}

/// How far the object lies from where it is in the mask's frame (`origin`), or from the median where that is not
/// known; without the frames that are unsure.
pub(super) fn drifts(
    registered: &[(u64, Registration)],
    origin: Option<Registration>,
) -> Vec<FrameDrift> {
    let median_of =
        |value: fn(&Registration) -> f32| median(registered.iter().map(|(_, found)| value(found)));
    let least = LEAST_LIKENESS * median_of(|found| found.likeness);
    let [x, y] = match origin.filter(|origin| origin.likeness >= least) {
        Some(origin) => origin.shift,
        None => [
            median_of(|found| found.shift[0]),
            median_of(|found| found.shift[1]),
        ],
    };
    let sure = registered
        .iter()
        .filter(|(_, found)| found.likeness >= least);
    sure.map(|&(frame, found)| FrameDrift {
        frame,
        dx: found.shift[0] - x,
        dy: found.shift[1] - y,
    })
    .collect()
}

fn median(values: impl Iterator<Item = f32>) -> f32 {
    at_share(values.collect(), 0.5)
}

fn at_share(mut values: Vec<f32>, share: f64) -> f32 {
    values.sort_by(f32::total_cmp);
    let at = (values.len() as f64 * share) as usize;
    values.get(at).or(values.last()).copied().unwrap_or(0.0)
}

pub(super) fn summary(drifts: &[FrameDrift], frames: usize) -> Option<DriftCheck> {
    let px = || drifts.iter().map(FrameDrift::px).collect();
    let most = drifts.iter().max_by(|a, b| a.px().total_cmp(&b.px()))?;
    Some(DriftCheck {
        median_px: at_share(px(), 0.5),
        p95_px: at_share(px(), 0.95),
        most: *most,
        frames: drifts.len(),
        unsure: frames.saturating_sub(drifts.len()),
    })
}

/// The mask's own frame, and those with the largest drifts, some way apart.
pub(super) fn worst(drifts: &[FrameDrift], source: u64, frames: usize) -> Vec<u64> {
    let mut sorted: Vec<&FrameDrift> = drifts.iter().collect();
    sorted.sort_by(|a, b| b.px().total_cmp(&a.px()));
    let apart = (frames as f64 * APART) as u64;
    let mut shown = vec![source];
    for drift in sorted {
        let near = |&other: &u64| other.abs_diff(drift.frame) <= apart;
        if shown.len() < SHOWN && !shown.iter().any(near) {
            shown.push(drift.frame);
        }
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(frame: u64, dx: f32, likeness: f32) -> (u64, Registration) {
        let shift = [dx, 0.0];
        (frame, Registration { shift, likeness })
    }

    #[test]
    fn drift_is_measured_from_the_masks_frame_and_unsure_frames_are_left_out() {
        let registered = [
            found(0, 1.0, 0.5),
            found(1, 2.0, 0.5),
            found(2, -5.0, 0.1),
            found(3, 4.0, 0.6),
        ];
        let drifts = drifts(&registered, Some(registered[0].1));
        let dx: Vec<f32> = drifts.iter().map(|drift| drift.dx).collect();
        assert_eq!(dx, [0.0, 1.0, 3.0]);
        let summary = summary(&drifts, 4).unwrap();
        assert_eq!((summary.most.frame, summary.unsure), (3, 1));
        assert_eq!(summary.median_px, 1.0);
        assert_eq!(summary.most.px(), 3.0);
    }

    #[test]
    fn the_worst_frames_are_some_way_apart() {
        let drifts: Vec<FrameDrift> = (0..1000)
            .map(|frame| FrameDrift {
                frame,
                dx: if frame / 100 == 5 { 3.0 } else { 0.1 },
                dy: 0.0,
            })
            .collect();
        let shown = worst(&drifts, 0, 1000);
        assert_eq!(shown.len(), SHOWN);
        assert_eq!(shown[..2], [0, 500]);
        assert!(shown[2] > 520);
    }
}
