//! What stands out beyond an object's soft edge, as fur and threads do. Relit in place it changes with the object, else it would
//! shine in the old light as a rim.

use std::sync::OnceLock;

use super::smooth::{blurred, weighted_mean};
use relight_core::image::Planes;
use relit_data::srgb;

/// How far beyond the mask it is looked for, in widths of the soft edge.
const REACH: usize = 6;
/// The width of the soft edge in the smaller picture, pixels.
const SMALL_EDGE: usize = 2;
/// The variance of sRGB values below which a place shows nothing.
const LEAST_VARIANCE: f32 = 1e-4;
/// Shares of up to this are chance: a background is never wholly unlike the object.
const CHANCE: f32 = 0.07;
/// The most by which it becomes brighter: what is extrapolated may be wrong.
const MAX_GAIN: f32 = 4.0;

/// What beyond an object's soft edge belongs to it, found when it is first asked for.
#[derive(Debug, Clone)]
pub(crate) struct Fringe {
    mask: Planes<1>,
    edge: usize,
    share: OnceLock<Planes<1>>,
}

impl Fringe {
    /// That of an object with this mask, whose soft edge is so many pixels wide.
    pub(crate) fn new(mask: &Planes<1>, edge: usize) -> Self {
        Self {
            mask: mask.clone(),
            edge,
            share: OnceLock::new(),
        }
    }

    /// How much of each pixel beyond the soft edge belongs to the object, 0 to 1: what of the picture, of linear light, looks
    /// like the nearby object, by the guided filter (He, Sun and Tang, *Guided Image Filtering*, 2013): with I the colours
    /// and p the mask, in each window the line `a I + b` that is nearest to p,
    ///
    /// ```text
    /// a = (cov(I) + e)^-1 cov(I, p),  b = mean(p) - a mean(I),  share = mean(w a) I + mean(w b)
    /// ```
    ///
    /// where w is the part of p's variance that the line explains: beside a background that looks like the object nobody can
    /// tell, and the background stays as it is. The lines are found in a smaller picture, in which the soft edge is two pixels
    /// wide (He and Sun, *Fast Guided Filter*, 2015).
    fn share(&self, picture: &Planes<3>) -> Planes<1> {
        let guide = picture
            .clone()
            .map(|v| srgb::from_linear_f32(v.clamp(0.0, 1.0)));
        let extent = guide.extent();
        let reduction = self.edge.div_ceil(SMALL_EDGE);
        let small = extent.at_most(extent.width.max(extent.height).div_ceil(reduction));
        let lines = lines(
            &guide.resized(small),
            &self.mask.resized(small),
            REACH * self.edge / reduction,
        );
        let lines = lines.resized(extent);
        let band = blurred(&self.mask, self.edge);
        Planes::from_fn(extent, |x, y| {
            let (i, [r, g, b, offset]) = (guide.pixel(x, y), lines.pixel(x, y));
            let found = i[0] * r + i[1] * g + i[2] * b + offset;
            let is_beyond = band.pixel(x, y)[0] < 1e-4;
            let part = ((found - CHANCE) / (1.0 - CHANCE)).clamp(0.0, 1.0);
            [if is_beyond { part } else { 0.0 }]
        })
    }

    /// How much brighter each pixel of the picture becomes where the object, of this alpha, has the colours `new` in place of
    /// `own`: as its nearby colours do on the whole.
    pub(crate) fn gains(
        &self,
        picture: impl FnOnce() -> Planes<3>,
        alpha: &Planes<1>,
        own: &Planes<3>,
        new: &Planes<3>,
    ) -> Planes<3> {
        let share = self.share.get_or_init(|| self.share(&picture()));
        let reach = REACH * self.edge;
        let (own, _) = weighted_mean(own, alpha, reach);
        let (new, _) = weighted_mean(new, alpha, reach);
        Planes::from_fn(alpha.extent(), |x, y| {
            let share = share.pixel(x, y)[0];
            let (own, new) = (own.pixel(x, y), new.pixel(x, y));
            [0, 1, 2].map(|c| match own[c] {
                own if own > 0.0 => 1.0 + share * ((new[c] / own).min(MAX_GAIN) - 1.0),
                _ => 1.0,
            })
        })
    }
}

/// The lines of all windows, each pixel's the mean of those of the windows that it is in.
fn lines(guide: &Planes<3>, mask: &Planes<1>, reach: usize) -> Planes<4> {
    let products = Planes::from_fn(guide.extent(), |x, y| {
        let ([r, g, b], p) = (guide.pixel(x, y), mask.pixel(x, y)[0]);
        [
            r,
            g,
            b,
            r * r,
            r * g,
            r * b,
            g * g,
            g * b,
            b * b,
            p,
            r * p,
            g * p,
            b * p,
        ]
    });
    let means = blurred(&products, reach);
    blurred(
        &Planes::from_fn(guide.extent(), |x, y| line(means.pixel(x, y))),
        reach,
    )
}

/// The factors of the colours and the offset of the line that is nearest to the mask in a window with these means, times the part
/// of the mask's variance that it explains.
fn line([r, g, b, rr, rg, rb, gg, gb, bb, p, rp, gp, bp]: [f32; 13]) -> [f32; 4] {
    let e = LEAST_VARIANCE;
    let (rr, gg, bb) = (rr - r * r + e, gg - g * g + e, bb - b * b + e);
    let (rg, rb, gb) = (rg - r * g, rb - r * b, gb - g * b);
    let with_mask = [rp - r * p, gp - g * p, bp - b * p];
    // The inverse of a symmetric matrix, by its cofactors.
    let rows = [
        [gg * bb - gb * gb, rb * gb - rg * bb, rg * gb - rb * gg],
        [rb * gb - rg * bb, rr * bb - rb * rb, rb * rg - rr * gb],
        [rg * gb - rb * gg, rb * rg - rr * gb, rr * gg - rg * rg],
    ];
    let determinant = rr * rows[0][0] + rg * rows[0][1] + rb * rows[0][2];
    let dot =
        |row: [f32; 3], with: [f32; 3]| row[0] * with[0] + row[1] * with[1] + row[2] * with[2];
    let factors = rows.map(|row| dot(row, with_mask) / determinant);
    let explained = (dot(factors, with_mask) / (p - p * p).max(e)).clamp(0.0, 1.0);
    let [red, green, blue] = factors;
    [red, green, blue, p - dot(factors, [r, g, b])].map(|v| v * explained)
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight_core::image::Extent;

    const EXTENT: Extent = Extent::new(120, 80);
    const EDGE: usize = 2;
    const FUR: [f32; 3] = [0.7, 0.6, 0.5];

    /// A body on the left, from which hairs two pixels wide stand out by nine pixels before a wall, lit by `light`.
    fn furry(light: f32, wall: [f32; 3]) -> Planes<3> {
        Planes::from_fn(EXTENT, |x, y| {
            let is_hair = x < 69 && y % 6 < 2;
            let grain = 1.0 + 0.02 * ((x * 7 + y * 3) % 5) as f32;
            if x < 60 || is_hair {
                FUR.map(|v| v * grain * light)
            } else {
                wall.map(|v| v * grain)
            }
        })
    }

    /// The mean change of hairs, and of the wall between and behind them, where the body becomes darker by a half.
    fn changes(wall: [f32; 3]) -> [f32; 2] {
        let (picture, relit) = (furry(1.0, wall), furry(0.5, wall));
        let mask = Planes::from_fn(EXTENT, |x, _| [f32::from(u8::from(x < 60))]);
        let fringe = Fringe::new(&mask, EDGE);
        let gains = fringe.gains(|| picture.clone(), &mask, &picture, &relit);
        let mean = |is_wanted: &dyn Fn(usize, usize) -> bool| {
            let places = (0..EXTENT.height).flat_map(|y| (63..100).map(move |x| (x, y)));
            let values: Vec<f32> = places
                .filter(|&(x, y)| is_wanted(x, y))
                .map(|(x, y)| gains.pixel(x, y)[0])
                .collect();
            values.iter().sum::<f32>() / values.len() as f32
        };
        [
            mean(&|x, y| x < 69 && y % 6 < 2),
            mean(&|x, y| x >= 69 || y % 6 >= 2),
        ]
    }

    #[test]
    fn hairs_beyond_the_mask_change_with_the_body_and_the_wall_does_not() {
        let [hairs, wall] = changes([0.1, 0.2, 0.15]);
        assert!(hairs < 0.92, "{hairs}");
        assert!(wall > 0.97, "{wall}");
    }

    #[test]
    fn before_a_wall_that_looks_like_the_object_nothing_changes() {
        let [hairs, wall] = changes(FUR);
        assert!(hairs > 0.97 && wall > 0.97, "{hairs} {wall}");
    }
}
