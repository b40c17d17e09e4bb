//! Where a cut of a rectangle starts: GrabCut's way, with all of it as object, or with the share of it as background
//! that looks most like what is around it.
//!
//! A share is right for a rectangle with much background in it, and cuts a part off an object that fills its rectangle
//! and is in places like what is around it. So a rectangle is cut from several starts, and the cut of the lowest energy
//! counts. Where the cut of the plain start reaches all four sides of its rectangle, as the object of a tight one does,
//! it counts as good, and another has to be better by a margin.

use image::RgbImage;
use relit_data::geometry::Rect;

use super::MaskError;
use super::cut_energy::CutEnergy;
use super::mask::Mask;

/// A cut reaches a side of the rectangle if it comes within this share of the way to the other.
const REACHES: f64 = 0.04;

/// From which starts a rectangle is cut, and which of the cuts counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StartRule {
    /// The share of the rectangle that is background at first, 0 to 1, of each start; 0 is GrabCut's own. At least one.
    pub shares: &'static [f64],
    /// By how much a cut has to be better than that of the plain start where that reaches all sides of the rectangle,
    /// in units of the log-likelihood of a pixel.
    pub margin: f64,
}

impl Default for StartRule {
    fn default() -> Self {
        Self {
            shares: &[0.0, 0.5],
            margin: 0.2,
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
    share: f64,
    energy: f64,
    reaches_all_sides: bool,
    mask: Mask,
}

impl StartCuts {
    /// The cuts of `shares`, each made by `cut`, as far as there are any.
    ///
    /// # Errors
    /// That of the last start if none gives a cut.
    pub(super) fn make(
        frame: &RgbImage,
        rect: Rect,
        shares: &[f64],
        cut: impl Fn(f64) -> Result<Mask, MaskError>,
    ) -> Result<Self, MaskError> {
        let energy = CutEnergy::new(frame, rect);
        let mut cuts = Vec::new();
        let mut fault = MaskError::Empty;
        for &share in shares {
            match cut(share) {
                Ok(mask) => {
                    let found = mask.bitmap();
                    cuts.push(StartCut {
                        share,
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

    /// The mask that a rule chooses among the cuts of its shares; `None` if there is none of them.
    #[must_use]
    pub fn by(&self, rule: StartRule) -> Option<&Mask> {
        let of_rule = self
            .cuts
            .iter()
            .filter(|cut| rule.shares.contains(&cut.share));
        let best = of_rule
            .clone()
            .min_by(|a, b| a.energy.total_cmp(&b.energy))?;
        let plain = of_rule.clone().find(|cut| cut.share <= 0.0);
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
        let rect = Rect::new(16, 10, 58, 52);
        let shares = &[0.0, 0.25, 0.5];
        let settings = SegmentSettings::default();
        let cuts = start_cuts(&two_toned(), &Hints::Rect(rect), &settings, shares).unwrap();
        let area = |shares, margin| {
            let rule = StartRule { shares, margin };
            cuts.by(rule).map(|mask| mask.statistics().area_px)
        };
        let alone = [area(&[0.0], 0.0), area(&[0.25], 0.0), area(&[0.5], 0.0)];
        assert!(alone.contains(&area(shares, 0.0)), "{alone:?}");
        assert_eq!(area(shares, f64::INFINITY), alone[0]);
        assert_eq!(area(&[0.4], 0.0), None);
    }
}
