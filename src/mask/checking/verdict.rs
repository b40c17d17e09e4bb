//! From figures to a verdict with its reasons.

use relit_grabcut::ShapeCheck;
use serde::Serialize;

use super::drift::DriftCheck;

/// The object may lie so far beside the mask in the worst frame, pixels.
const MOST_DRIFT: f32 = 2.0;
/// And so far in the median frame, pixels.
const MEDIAN_DRIFT: f32 = 1.0;

/// Whether a mask fits its recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum MaskVerdict {
    /// It does, in every frame.
    Fits,
    /// Its shape is right, but the object moves beside it.
    Drifts,
    /// Its shape is not that of the object.
    Wrong,
    /// Hardly anything moves in the video: it does not show what the object is.
    Unknown,
}

impl MaskVerdict {
    /// In a word, and in a sentence.
    #[must_use]
    pub const fn words(self) -> (&'static str, &'static str) {
        match self {
            Self::Fits => ("fits", "the mask fits"),
            Self::Drifts => ("drifts", "the object moves beside the mask"),
            Self::Wrong => ("wrong", "the mask is not that of the object"),
            Self::Unknown => ("unknown", "nothing can be said about the mask"),
        }
    }
}

/// The verdict about a mask, and why it is not "fits".
pub(super) fn verdict(
    drift: Option<&DriftCheck>,
    shape: Option<&ShapeCheck>,
) -> (MaskVerdict, Vec<String>) {
    let mut reasons = shape.map(ShapeCheck::faults).unwrap_or_default();
    let wrong = !reasons.is_empty();
    let moved = drift.and_then(reason_of_drift);
    let verdict = match (wrong, &moved) {
        (true, _) => MaskVerdict::Wrong,
        (false, Some(_)) => MaskVerdict::Drifts,
        // A picture that stands still is found where it is whatever the mask is.
        (false, None) if shape.is_none() => MaskVerdict::Unknown,
        (false, None) => MaskVerdict::Fits,
    };
    reasons.extend(moved);
    if verdict == MaskVerdict::Unknown {
        reasons.push("hardly anything moves in the video, so that it does not show what the object is: look at mask-preview.png".to_owned());
    }
    (verdict, reasons)
}

fn reason_of_drift(drift: &DriftCheck) -> Option<String> {
    let most = drift.most;
    (most.px() > MOST_DRIFT || drift.median_px > MEDIAN_DRIFT).then(|| {
        format!(
            "the object lies up to {:.1} px beside the mask ({:+.1} right, {:+.1} down, in frame {}), {:.1} px in the median frame: extraction aligns the frames unless it is told not to; fasten camera and object, or make the mask on a frame in the middle",
            most.px(), most.dx, most.dy, most.frame, drift.median_px
        )
    })
}

#[cfg(test)]
mod tests {
    use super::super::drift::FrameDrift;
    use super::*;
    use relit_data::geometry::Rect;
    use relit_grabcut::DoubtfulRegion;

    fn shape() -> ShapeCheck {
        ShapeCheck {
            area_px: 10_000,
            outline: 0.8,
            outline_of_turn: 0.8,
            contradicted: false,
            leaks: Vec::new(),
            missing: Vec::new(),
            holes: Vec::new(),
        }
    }

    fn drift(dx: f32) -> DriftCheck {
        DriftCheck {
            median_px: 0.2,
            p95_px: 0.5,
            most: FrameDrift {
                frame: 420,
                dx,
                dy: 0.0,
            },
            frames: 1500,
            unsure: 0,
        }
    }

    #[test]
    fn each_verdict_has_its_reason() {
        let region = |px| {
            vec![DoubtfulRegion {
                px,
                bounds: Rect::new(1, 2, 30, 40),
            }]
        };
        assert_eq!(
            verdict(Some(&drift(0.5)), Some(&shape())),
            (MaskVerdict::Fits, Vec::new())
        );
        let (found, reasons) = verdict(Some(&drift(-3.1)), Some(&shape()));
        assert_eq!(found, MaskVerdict::Drifts);
        assert!(reasons[0].contains("3.1 px") && reasons[0].contains("frame 420"));
        for (changed, word) in [
            (
                ShapeCheck {
                    leaks: region(500),
                    ..shape()
                },
                "background in the mask",
            ),
            (
                ShapeCheck {
                    missing: region(500),
                    ..shape()
                },
                "object outside",
            ),
            (
                ShapeCheck {
                    holes: region(500),
                    ..shape()
                },
                "holes",
            ),
            (
                ShapeCheck {
                    outline: 0.5,
                    ..shape()
                },
                "does not follow",
            ),
        ] {
            let (found, reasons) = verdict(None, Some(&changed));
            assert_eq!((found, reasons.len()), (MaskVerdict::Wrong, 1), "{word}");
            assert!(reasons[0].contains(word), "{}", reasons[0]);
        }
        assert_eq!(verdict(None, None).0, MaskVerdict::Unknown);
        assert_eq!(verdict(None, None).1.len(), 1);
        let still = verdict(Some(&drift(0.1)), None);
        assert_eq!((still.0, still.1.len()), (MaskVerdict::Unknown, 1));
        assert_eq!(verdict(Some(&drift(3.1)), None).0, MaskVerdict::Drifts);
    }

    #[test]
    fn a_mask_that_follows_what_moves_better_than_the_turn_is_not_blamed() {
        let leaks = vec![DoubtfulRegion {
            px: 900,
            bounds: Rect::new(1, 2, 30, 40),
        }];
        let shape = ShapeCheck {
            outline: 0.9,
            leaks,
            ..shape()
        };
        assert_eq!(
            verdict(Some(&drift(0.1)), Some(&shape)).0,
            MaskVerdict::Fits
        );
    }
}
