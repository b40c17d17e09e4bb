//! The position of each record on the turn, 0 to 360 degrees.

use crate::shard::record::FrameRecord;

/// Degrees of one turn.
pub(super) const FULL: f64 = 360.0;

/// The positions of a session's records on the turn.
#[derive(Debug)]
pub(super) struct Turn {
    /// True if the positions are the table's angles.
    pub(super) measured: bool,
    /// One position per record, degrees, 0..=360.
    pub(super) degrees: Vec<f64>,
}

impl Turn {
    /// By the table's angle if every record has one, else by the index: mixing them would draw a
    /// line between two different axes.
    pub(super) fn from_records(records: &[FrameRecord]) -> Self {
        let angles: Option<Vec<f64>> = records
            .iter()
            .map(|r| r.angle_deg.map(|angle| angle.rem_euclid(FULL)))
            .collect();
        if let Some(degrees) = angles {
            return Self {
                measured: true,
                degrees,
            };
        }
        let frames = records.last().map_or(1.0, |r| f64::from(r.index) + 1.0);
        let degrees = records
            .iter()
            .map(|r| FULL * f64::from(r.index) / frames)
            .collect();
        Self {
            measured: false,
            degrees,
        }
    }

    /// What the horizontal axis shows.
    pub(super) fn label(&self) -> &'static str {
        if self.measured {
            "table angle (degrees)"
        } else {
            "place in the turn (degrees)"
        }
    }

    /// What each position is.
    pub(super) fn angle(&self) -> &'static str {
        if self.measured {
            "table angle"
        } else {
            "angle by its place in the turn"
        }
    }

    /// The origin of the positions, as a sentence.
    pub(super) fn origin(&self) -> &'static str {
        if self.measured {
            "Angles are the table\u{2019}s, as recorded."
        } else {
            "Some samples have no table angle: angles follow from the samples\u{2019} indices."
        }
    }

    /// The points (position, `value`), sorted from 0 to 360 degrees, also for a turn that starts at
    /// 90 degrees and passes 360.
    pub(super) fn points(
        &self,
        records: &[FrameRecord],
        value: impl Fn(&FrameRecord) -> f64,
    ) -> Vec<(f64, f64)> {
        let mut points: Vec<(f64, f64)> = self
            .degrees
            .iter()
            .copied()
            .zip(records.iter().map(value))
            .collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        points
    }
}
