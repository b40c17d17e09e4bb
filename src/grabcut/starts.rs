//! Where a cut of a rectangle starts: GrabCut's way, with all of it as object, or with the share of it as background
//! that looks most like what is around it.
//!
//! A share is right for a rectangle with much background in it, and cuts a part off an object that fills its rectangle
//! and is in places like what is around it. So a rectangle is cut from several starts, and the cut of the lowest energy
//! counts. The first cut is made at a small size, and once more at a larger one. Where the cut of the plain start reaches all four sides of its rectangle, as the object of a tight one does,
//! it counts as good, and another has to be better by a margin.

use image::RgbImage;
use relit_data::geometry::Rect;

use super::cut_energy::CutEnergy;
use super::{Mask, MaskError};

/// A cut reaches a side of the rectangle if it comes within this share of the way to the other.
const REACHES: f64 = 0.04;

/// Where a cut of a rectangle starts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start {
    /// The share of the rectangle that is background at first, 0 to 1; 0 is GrabCut's own.
    pub share: f64,
    /// Whether the first cut is made at up to twice the usual size, where thin and low-contrast parts count for more.
    pub fine: bool,
}

/// From which starts a rectangle is cut, and which of the cuts counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StartRule {
    /// The starts, at least one.
    pub starts: &'static [Start],
    /// By how much a cut has to be better than GrabCut's own where that reaches all sides of the rectangle, in units of
    /// the log-likelihood of a pixel.
    pub margin: f64,
}

impl Start {
    /// GrabCut's own, and the one that takes a half for background.
    pub const COARSE: [Self; 2] = [Self::coarse(0.0), Self::coarse(0.5)];
    /// These, and GrabCut's own at a larger size.
    pub const BOTH_SIZES: [Self; 3] = [
        Self::coarse(0.0),
        Self::coarse(0.5),
        Self {
            share: 0.0,
            fine: true,
        },
    ];

    /// A start at the usual size.
    #[must_use]
    pub const fn coarse(share: f64) -> Self {
        Self { share, fine: false }
    }

    fn is_plain(self) -> bool {
        self == Self::coarse(0.0)
    }
}

impl Default for StartRule {
    fn default() -> Self {
        Self {
            starts: &Start::BOTH_SIZES,
            margin: 0.1,
        }
    }
}

/// A rectangle's cuts from several starts, for choosing between rules without cutting again.
#[derive(Debug)]
pub struct StartCuts {
    cuts: Vec<StartCut>,
}

#[derive(Debug)]
struct StartCut {
    start: Start,
    energy: f64,
    reaches_all_sides: bool,
    mask: Mask,
}

impl StartCuts {
    /// The cuts of `starts`, each made by `cut`, as far as there are any.
    ///
    /// # Errors
    /// That of the last start if none gives a cut.
    pub(super) fn make(
        frame: &RgbImage,
        rect: Rect,
        starts: &[Start],
        cut: impl Fn(Start) -> Result<Mask, MaskError>,
    ) -> Result<Self, MaskError> {
        let energy = CutEnergy::new(frame, rect);
        let mut cuts = Vec::new();
        let mut fault = MaskError::Empty;
        for &start in starts {
            match cut(start) {
                Ok(mask) => {
                    let found = mask.bitmap();
                    cuts.push(StartCut {
                        start,
                        energy: energy.of(&found),
                        reaches_all_sides: fills(found.bounds(), rect),
                        mask,
                    });
                }
                Err(error) => fault = error,
            }
        }
        match cuts.is_empty() {
            true => Err(fault),
            false => Ok(Self { cuts }),
        }
    }

    /// The mask that a rule chooses among the cuts of its starts; `None` if there is none of them.
    #[must_use]
    pub fn by(&self, rule: StartRule) -> Option<&Mask> {
        let of_rule = self
            .cuts
            .iter()
            .filter(|cut| rule.starts.contains(&cut.start));
        let best = of_rule
            .clone()
            .min_by(|a, b| a.energy.total_cmp(&b.energy))?;
        let plain = of_rule.clone().find(|cut| cut.start.is_plain());
        let margin = |cut: &StartCut| {
            if cut.reaches_all_sides {
                rule.margin
            } else {
                0.0
            }
        };
        let chosen = plain.filter(|plain| plain.energy - best.energy <= margin(plain));
        Some(&chosen.unwrap_or(best).mask)
    }

    /// As [`Self::by`], by the rule by which they were made.
    pub(super) fn into_mask(self, rule: StartRule) -> Result<Mask, MaskError> {
        self.by(rule).cloned().ok_or(MaskError::Empty)
    }
}

/// Whether a cut reaches all four sides of its rectangle.
fn fills(found: Rect, rect: Rect) -> bool {
    let (across, down) = (f64::from(rect.w) * REACHES, f64::from(rect.h) * REACHES);
    f64::from(found.x) - f64::from(rect.x) <= across
        && f64::from(found.y) - f64::from(rect.y) <= down
        && (rect.right() - found.right()) as f64 <= across
        && (rect.bottom() - found.bottom()) as f64 <= down
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Hints, SegmentSettings, start_cuts};

    #[test]
    fn a_cut_reaches_a_rectangle_or_not() {
        let rect = Rect::new(10, 10, 100, 50);
        assert!(fills(Rect::new(12, 11, 96, 48), rect));
        assert!(!fills(Rect::new(18, 11, 90, 48), rect));
        assert!(!fills(Rect::new(12, 11, 96, 40), rect));
    }

    /// An object whose upper part looks like what is around it.
    fn two_toned() -> RgbImage {
        RgbImage::from_fn(90, 70, |x, y| {
            let grain = ((x * 7 + y * 13) % 11) as u8;
            let inside = (20..70).contains(&x) && (14..58).contains(&y);
            image::Rgb(match (inside, y < 34) {
                (true, true) => [70 + grain, 95, 80],
                (true, false) => [200 + grain, 90, 40],
                (false, _) => [40 + grain, 80, 90],
            })
        })
    }

    #[test]
    fn a_rule_chooses_the_cut_of_the_least_energy_and_needs_no_other() {
        const OTHER: &[Start] = &[Start::coarse(0.4)];
        let rect = Rect::new(16, 10, 58, 52);
        let starts = &Start::BOTH_SIZES;
        let settings = SegmentSettings::default();
        let cuts = start_cuts(&two_toned(), &Hints::Rect(rect), &settings, starts).unwrap();
        let area = |starts, margin| {
            let rule = StartRule { starts, margin };
            cuts.by(rule).map(|mask| mask.statistics().area_px)
        };
        let alone = [
            area(&starts[..1], 0.0),
            area(&starts[1..2], 0.0),
            area(&starts[2..], 0.0),
        ];
        assert!(alone.contains(&area(starts, 0.0)), "{alone:?}");
        assert_eq!(area(starts, f64::INFINITY), alone[0]);
        assert_eq!(area(OTHER, 0.0), None);
    }
}
