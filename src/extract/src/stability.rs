//! What the shifts of a turn's frames say as a whole.

use relit_data::counts::count_of;
use relit_data::session::Notice;

use super::ExtractError;
use super::align::Alignment;

/// The shifts of a turn, frame by frame, in any order.
#[derive(Debug, Default)]
pub(super) struct Stability {
    max_shift: f64,
    frames: u64,
    unregistered: Vec<u64>,
    /// Frames whose shift is that of the frames around them, and the largest uncertainty, pixels.
    interpolated: (u64, f64),
    /// The first frame whose object lies too far away, and how far.
    beyond: Option<(u64, f64)>,
    /// The frame that is turned or grown most: degrees, factor minus 1.
    turned: Option<(u64, (f64, f64))>,
    turned_frames: u64,
}

impl Stability {
    /// Of a turn whose object may move by `max_shift` pixels.
    pub(super) fn new(max_shift: f64) -> Self {
        Self {
            max_shift,
            ..Self::default()
        }
    }

    /// Notes a frame; `interpolated` is the uncertainty of a shift that was not measured, pixels.
    pub(super) fn add(&mut self, frame: u64, alignment: &Alignment, interpolated: Option<f64>) {
        self.frames += 1;
        if let Some(uncertainty) = interpolated {
            let (frames, most) = self.interpolated;
            self.interpolated = (frames + 1, uncertainty.max(most));
        }
        let Some([dx, dy]) = alignment.shift else {
            return self.unregistered.push(frame);
        };
        let far = dx.hypot(dy);
        if far > self.max_shift && self.beyond.is_none_or(|(first, _)| frame < first) {
            self.beyond = Some((frame, far));
        }
        if let Some((degrees, growth)) = alignment.turned {
            self.turned_frames += 1;
            let size = |(degrees, growth): (f64, f64)| degrees.to_radians().hypot(growth);
            let largest = self.turned.is_none_or(|(first, other)| {
                let (new, old) = (size((degrees, growth)), size(other));
                new > old || (new == old && frame < first)
            });
            if largest {
                self.turned = Some((frame, (degrees, growth)));
            }
        }
    }

    /// An error if the object moved further than it may.
    pub(super) fn check(&self) -> Result<(), ExtractError> {
        match self.beyond {
            None => Ok(()),
            Some((frame, shift)) => Err(ExtractError::Refused(format!(
                "from frame {frame} on the object lies {shift:.1} pixels off its mask, more than {}: record it again, mask another frame, or give a larger --max-shift",
                self.max_shift
            ))),
        }
    }

    /// What a user should know; frames below `min_confidence` were not registered.
    pub(super) fn notices(&self, min_confidence: f64) -> Vec<Notice> {
        let mut notices = Vec::new();
        if let Some(first) = self.unregistered.iter().min() {
            let all = count_of(self.frames, "frame");
            notices.push(Notice::Warning(match self.unregistered.len() {
                1 => format!(
                    "1 of {all} could not be aligned (its align_confidence is below {min_confidence:.2}) and stays as recorded: frame {first}"
                ),
                count => format!(
                    "{count} of {all} could not be aligned (their align_confidence is below {min_confidence:.2}) and stay as recorded, the first is frame {first}"
                ),
            }));
        }
        if let (count @ 1.., most) = self.interpolated {
            let all = count_of(self.frames, "frame");
            notices.push(Notice::Warning(format!(
                "{count} of {all} could not be aligned; {} placed by the frames around, uncertain by at most {most:.2} pixels (see shift_interpolated_sd_px)",
                if count == 1 { "it was" } else { "they were" },
            )));
        }
        if let Some((frame, (degrees, growth))) = self.turned {
            let (count, percent) = (count_of(self.turned_frames, "frame"), 100.0 * growth);
            notices.push(Notice::Warning(format!(
                "in {count} the object is turned or scaled against the mask, at most by {degrees:.2} degrees and {percent:+.2} % (frame {frame}); only shifts are corrected"
            )));
        }
        notices
    }
}

#[cfg(test)]
mod tests {
    use relit_test_support::is_named;

    use super::*;

    fn moved_by(dx: f64) -> Alignment {
        Alignment {
            shift: Some([dx, 0.0]),
            uncertainty: 0.01,
            confidence: 0.9,
            turned: None,
        }
    }

    #[test]
    fn the_first_frame_beyond_the_largest_shift_is_named_in_any_order() {
        let mut stability = Stability::new(8.0);
        for (frame, dx) in [(3, 1.0), (9, -8.5), (7, 9.0), (8, 2.0)] {
            stability.add(frame, &moved_by(dx), None);
        }
        let error = stability.check().unwrap_err().to_string();
        assert!(error.contains("frame 7 "), "{error}");
        assert!(Stability::new(8.0).check().is_ok());
    }

    #[test]
    fn frames_that_cannot_be_registered_are_counted() {
        let mut stability = Stability::new(8.0);
        stability.add(1, &moved_by(0.2), None);
        assert!(stability.notices(0.3).is_empty());
        let lost = Alignment {
            shift: None,
            uncertainty: f64::INFINITY,
            confidence: 0.1,
            turned: None,
        };
        stability.add(6, &lost, None);
        let text = stability.notices(0.5).remove(0).text().to_owned();
        assert!(is_named(&text, &["1", "2 frames", "frame 6"]), "{text}");
        stability.add(5, &lost, None);
        let text = stability.notices(0.5).remove(0).text().to_owned();
        assert!(
            is_named(&text, &["2", "3 frames", "frame 5", "0.50"]),
            "{text}"
        );
        stability.add(7, &moved_by(0.3), Some(0.14));
        let text = stability.notices(0.5).remove(1).text().to_owned();
        assert!(is_named(&text, &["1", "4 frames", "0.14 pixels"]), "{text}");
    }
}
