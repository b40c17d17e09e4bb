//! How much of each pixel the object covers, and its colours without the background's. Knows nothing of light.

use super::smooth::{blurred, weighted_mean};
use relight_core::image::{Extent, Planes};

/// How far a matte may differ from the mask if the colours contradict it: on the mask's edge, and at the band's ends.
const GEOMETRY_DEVIATIONS: (f32, f32) = (0.25, 0.12);
/// The deviation of colours that counts where they do not vary at all, as a part of them.
const MIN_DEVIATION: f32 = 0.08;
/// The most by which it may differ, whatever the colours are: a mask is rarely wrong by more than the width of its soft edge,
/// and a bite out of the object is visible at once.
const MAX_FROM_MASK: f32 = 0.4;
/// The weight of what lies near the edge, where nothing from further inside or outside is near.
const EDGE_WEIGHT: f32 = 1e-3;
/// The part of the variance nearby that colours have about that of the nearest place.
const NEAREST_VARIANCE: f32 = 0.2;
/// How far a colour may lie from those near it where the object covers nothing, standard deviations; the more it covers, the
/// further.
const SPREAD: f32 = 1.5;
/// Steps in which the most probable alpha is found.
const STEPS: usize = 4;
/// The most by which values differ that are one colour but for rounding.
const ONE_COLOUR: f32 = 0.01;
/// The part of an object's side that its soft edge is wide.
const EDGE_PART: f64 = 1.0 / 160.0;

/// What an object covers, and its own colours.
///
/// The picture is `alpha x foreground + (1 - alpha) x background`. Pixels at the edge show both; pasted as they are, they
/// bring a rim of the old background along.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Matte {
    /// The part of each pixel that the object covers, 0 to 1.
    pub(crate) alpha: Planes<1>,
    /// The object's colours, linear, also where it covers little or nothing of a pixel: those of its edge are continued there.
    pub(crate) foreground: Planes<3>,
}

impl Matte {
    /// The matte of an object in a picture of linear light, near whose mask (0 or 1) it is to be looked for: `edge` pixels to
    /// both sides of the mask's edge.
    ///
    /// In that band, F and B are colours of the object and of the background: the means nearby, or those of the nearest places,
    /// whichever explain the pixel better. Alpha is the most probable value where colours are spread about
    /// `alpha F + (1 - alpha) B` as those of both sides are, and alpha about the smoothed mask. So a bright place of a
    /// many-coloured object stays part of it before a bright wall, and its shadow on the ground does not become part of it. The
    /// colours are those of [`Planes::foreground`], as far as the object's colours nearby reach: where alpha is too high, they would
    /// be the background's, as dark or white dots on the rim.
    ///
    /// # Panics
    /// Where the mask has another size.
    pub(crate) fn estimate(picture: &Planes<3>, mask: &Planes<1>, edge: usize) -> Self {
        assert_eq!(picture.extent(), mask.extent(), "size of the mask");
        let edge = edge.max(1);
        let share = blurred(mask, edge);
        let smooth = blurred(&blurred(mask, edge.div_ceil(2)), edge.div_ceil(2));
        let inside = share.clone().map(|s| f32::from(u8::from(s > 1.0 - 1e-4)));
        let outside = share.map(|s| f32::from(u8::from(s < 1e-4)));
        let object = Neighbours::new(picture, &inside, mask, edge);
        let beside = mask.clone().map(|m| 1.0 - m);
        let around = Neighbours::new(picture, &outside, &beside, edge);
        let mut alpha = inside.clone();
        let Extent { width, height } = picture.extent();
        let pixels = || (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        // The colour that the object has at a pixel of the band, and how far from it its colours may be.
        let mut near = vec![None; picture.extent().pixels()];
        for (x, y) in pixels() {
            if inside.pixel(x, y) == [1.0] || outside.pixel(x, y) == [1.0] {
                continue;
            }
            let sides = object.at(x, y).zip(around.at(x, y));
            let (found, colour) = mixed(picture.pixel(x, y), smooth.pixel(x, y)[0], sides);
            alpha.set_pixel(x, y, [found]);
            near[y * width + x] = colour;
        }
        let mut foreground = picture.foreground(&alpha);
        for (x, y) in pixels() {
            if let Some(near) = near[y * width + x] {
                let colour = near.reached(foreground.pixel(x, y), alpha.pixel(x, y)[0]);
                foreground.set_pixel(x, y, colour);
            }
        }
        Self { alpha, foreground }.continued(2 * edge + 1)
    }

    /// The matte of a picture that has alpha. Where it covers nothing, a picture that was cut out has one colour near the object,
    /// and its colours are the object's own wherever it covers something. Else it still shows the background there, and at the soft
    /// edge both: colours are freed of it, by [`Planes::foreground`].
    ///
    /// # Panics
    /// Where alpha has another size.
    pub(crate) fn from_alpha(picture: &Planes<3>, alpha: &Planes<1>) -> Self {
        let near = blurred(alpha, 2);
        let mut range = [[f32::INFINITY, f32::NEG_INFINITY]; 3];
        let bare = (0..near.plane(0).len())
            .filter(|&at| alpha.plane(0)[at] <= 0.0 && near.plane(0)[at] > 0.0);
        for at in bare {
            for (range, plane) in range.iter_mut().zip(picture.planes()) {
                *range = [range[0].min(plane[at]), range[1].max(plane[at])];
            }
        }
        if range.iter().all(|[least, most]| most - least < ONE_COLOUR) {
            return Self::from_cut_out(picture, alpha);
        }
        Self::from_cut_out(&picture.foreground(alpha), alpha)
    }

    /// The matte of an object whose colours are its own wherever it covers something.
    ///
    /// # Panics
    /// Where alpha has another size.
    pub(crate) fn from_cut_out(picture: &Planes<3>, alpha: &Planes<1>) -> Self {
        assert_eq!(picture.extent(), alpha.extent(), "size of alpha");
        let matte = Self {
            alpha: alpha.clone().map(|a| a.clamp(0.0, 1.0)),
            foreground: picture.clone(),
        };
        matte.continued(1)
    }

    /// The assumed width of the soft edge of an object of this size, pixels, for an unknown lens.
    pub(crate) fn edge_for(extent: Extent) -> usize {
        let side = extent.width.max(extent.height) as f64;
        ((side * EDGE_PART).round() as usize).clamp(2, 12)
    }

    /// Colours where the object covers nothing: the nearest that it has.
    fn continued(mut self, reach: usize) -> Self {
        let covered: Vec<bool> = self.alpha.plane(0).iter().map(|&a| a > 0.0).collect();
        let near = blurred(&self.alpha, reach);
        let wanted: Vec<bool> = near.plane(0).iter().map(|&a| a > 0.0).collect();
        for plane in self.foreground.planes_mut() {
            for (value, covered) in plane.iter_mut().zip(&covered) {
                *value = if *covered { *value } else { 0.0 };
            }
        }
        self.foreground = self.foreground.extended(&covered, &wanted);
        self
    }
}

/// Colours of one side near each pixel: their mean and variance, and those of the nearest place.
struct Neighbours {
    mean: Planes<3>,
    square: Planes<3>,
    weight: Planes<1>,
    nearest: Planes<3>,
}

/// A colour that a side may have at a pixel, and its variance a channel.
#[derive(Clone, Copy)]
struct SideColour {
    colour: [f32; 3],
    variance: f32,
}

impl Neighbours {
    /// The colours of a `side` (1 on it, else 0), whose pixels `far` from the edge count. Where there are none, as in a handle or
    /// in the opening of it, those count that do not touch the edge.
    fn new(picture: &Planes<3>, far: &Planes<1>, side: &Planes<1>, edge: usize) -> Self {
        let reach = 2 * edge + 1;
        let near = blurred(side, 1);
        let mut weights = far.clone();
        let own = side.plane(0).iter().zip(near.plane(0));
        for (weight, (own, near)) in weights.planes_mut()[0].iter_mut().zip(own) {
            // What touches the edge shows both sides.
            *weight = weight.max(EDGE_WEIGHT * own * near.powi(8));
        }
        let (mean, weight) = weighted_mean(picture, &weights, reach);
        let squares = picture.clone().map(|v| v * v);
        let (square, _) = weighted_mean(&squares, &weights, reach);
        Self {
            mean,
            square,
            weight,
            nearest: nearest(picture, far, &near, edge + 1),
        }
    }

    /// The mean colour and that of the nearest place; `None` without one nearby.
    fn at(&self, x: usize, y: usize) -> Option<[SideColour; 2]> {
        if self.weight.pixel(x, y)[0] <= 0.0 {
            return None;
        }
        let (mean, square) = (self.mean.pixel(x, y), self.square.pixel(x, y));
        let variance: f32 = (0..3)
            .map(|c| (square[c] - mean[c] * mean[c]).max(0.0))
            .sum::<f32>()
            / 3.0;
        let of = |colour, variance| SideColour { colour, variance };
        let nearest = self.nearest.pixel(x, y);
        Some([of(mean, variance), of(nearest, NEAREST_VARIANCE * variance)])
    }
}

/// The colour of the nearest place that is `far` from the edge, or beyond `reach` of all these, as in a handle, of the nearest that
/// does not touch it.
fn nearest(picture: &Planes<3>, far: &Planes<1>, near: &Planes<1>, reach: usize) -> Planes<3> {
    let holds = |plane: &Planes<1>, least: f32| -> Vec<bool> {
        plane.plane(0).iter().map(|&v| v > least).collect()
    };
    let reached = holds(&blurred(far, reach), 0.0);
    let first = picture.clone().extended(&holds(far, 0.0), &reached);
    let mut known = holds(near, 1.0 - 1e-4);
    for (known, reached) in known.iter_mut().zip(&reached) {
        *known |= reached;
    }
    let wanted = vec![true; known.len()];
    first.extended(&known, &wanted)
}

/// The object's colour near a pixel of its edge.
#[derive(Clone, Copy)]
struct NearColour {
    colour: [f32; 3],
    /// How far a channel may be from it.
    most: f32,
}

impl NearColour {
    /// A colour as far as the object's reach, and the nearer to this one the less of the pixel the object covers: the more of it is
    /// noise and background.
    fn reached(self, colour: [f32; 3], alpha: f32) -> [f32; 3] {
        [0, 1, 2].map(|c| {
            let apart = (colour[c] - self.colour[c]).clamp(-self.most, self.most);
            (self.colour[c] + alpha * apart).max(0.0)
        })
    }
}

/// Alpha of a pixel that may show both, and the object's colour there.
fn mixed(
    pixel: [f32; 3],
    geometry: f32,
    sides: Option<([SideColour; 2], [SideColour; 2])>,
) -> (f32, Option<NearColour>) {
    let Some((objects, arounds)) = sides else {
        return (geometry, None);
    };
    let mut best = (f32::INFINITY, geometry, None);
    for (object, around) in objects
        .into_iter()
        .flat_map(|object| arounds.map(|around| (object, around)))
    {
        let (object, around, variances) = (
            object.colour,
            around.colour,
            [object.variance, around.variance],
        );
        let least = least(object, around);
        let mixture = Mixture {
            pixel,
            object,
            around,
            variances: variances.map(|variance| variance + least),
            geometry,
        };
        let alpha = mixture.alpha();
        let cost = mixture.cost(alpha);
        if cost < best.0 {
            let near = NearColour {
                colour: object,
                most: SPREAD * mixture.variances[0].sqrt() / (1.0 - alpha).max(1e-6),
            };
            best = (cost, alpha, Some(near));
        }
    }
    (best.1, best.2)
}

/// The least variance that colours of these sides have.
fn least(object: [f32; 3], around: [f32; 3]) -> f32 {
    let sum: f32 = (0..3).map(|c| object[c].abs() + around[c].abs()).sum();
    let deviation = MIN_DEVIATION * (sum / 6.0 + MIN_DEVIATION);
    deviation * deviation
}

/// A pixel that may show both sides.
struct Mixture {
    pixel: [f32; 3],
    object: [f32; 3],
    around: [f32; 3],
    /// Of the object's and of the background's colours, a channel.
    variances: [f32; 2],
    /// The smoothed mask.
    geometry: f32,
}

impl Mixture {
    /// The most probable part of the pixel that the object covers.
    ///
    /// Where the variance is that of a fixed alpha, the most probable alpha is known; so it is looked for from both ends and
    /// from the mask's value, and the best of the three is taken.
    fn alpha(&self) -> f32 {
        let difference: [f32; 3] = [0, 1, 2].map(|c| self.object[c] - self.around[c]);
        let along: f32 = (0..3)
            .map(|c| (self.pixel[c] - self.around[c]) * difference[c])
            .sum();
        let length: f32 = difference.iter().map(|d| d * d).sum();
        let prior = 1.0 / self.prior_variance();
        let least = (self.geometry - MAX_FROM_MASK).max(0.0);
        let most = (self.geometry + MAX_FROM_MASK).min(1.0);
        let next = |alpha: f32| {
            let variance = self.variance(alpha);
            let sum = along / variance + self.geometry * prior;
            (sum / (length / variance + prior)).clamp(least, most)
        };
        let found =
            [0.0, self.geometry, 1.0].map(|start| (0..STEPS).fold(start, |alpha, _| next(alpha)));
        let better = |best: f32, other: f32| {
            if self.cost(other) < self.cost(best) {
                other
            } else {
                best
            }
        };
        better(better(found[1], found[0]), found[2])
    }

    /// The negative logarithm of how probable an alpha is.
    fn cost(&self, alpha: f32) -> f32 {
        let apart: f32 = (0..3)
            .map(|c| self.pixel[c] - alpha * self.object[c] - (1.0 - alpha) * self.around[c])
            .map(|d| d * d)
            .sum();
        let variance = self.variance(alpha);
        let from_mask = alpha - self.geometry;
        0.5 * (apart / variance + from_mask * from_mask / self.prior_variance())
            + 1.5 * variance.ln()
    }

    fn variance(&self, alpha: f32) -> f32 {
        alpha * self.variances[0] + (1.0 - alpha) * self.variances[1]
    }

    fn prior_variance(&self) -> f32 {
        let (edge, end) = GEOMETRY_DEVIATIONS;
        let deviation = end + (edge - end) * 4.0 * self.geometry * (1.0 - self.geometry);
        deviation * deviation
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const OBJECT: [f32; 3] = [0.6, 0.3, 0.1];
    const AROUND: [f32; 3] = [0.05, 0.2, 0.7];

    /// The part of a pixel that lies in a disc, by 8 x 8 samples.
    fn coverage(x: usize, y: usize) -> f32 {
        let inside = (0..64).filter(|k| {
            let place = |at: usize, k: usize| at as f64 + (k as f64 + 0.5) / 8.0 - 32.0;
            place(x, k % 8).hypot(place(y, k / 8)) < 20.3
        });
        inside.count() as f32 / 64.0
    }

    fn picture() -> (Planes<3>, Planes<1>) {
        let extent = Extent::new(64, 64);
        let mix = |x, y| {
            let alpha = coverage(x, y);
            [0, 1, 2].map(|c| alpha * OBJECT[c] + (1.0 - alpha) * AROUND[c])
        };
        let mask = Planes::from_fn(extent, |x, y| [f32::from(u8::from(coverage(x, y) >= 0.5))]);
        (Planes::from_fn(extent, mix), mask)
    }

    #[test]
    fn alpha_is_the_coverage_and_colours_are_free_of_the_background() {
        let (picture, mask) = picture();
        let matte = Matte::estimate(&picture, &mask, 2);
        for y in 0..64 {
            for x in 0..64 {
                let alpha = matte.alpha.pixel(x, y)[0];
                assert!((alpha - coverage(x, y)).abs() < 0.02, "{x} {y} {alpha}");
                if alpha > 0.0 {
                    let colour = matte.foreground.pixel(x, y);
                    let apart = (0..3)
                        .map(|c| (colour[c] - OBJECT[c]).abs())
                        .fold(0.0, f32::max);
                    assert!(apart < 0.02, "{x} {y} {colour:?}");
                }
            }
        }
    }

    #[test]
    fn where_colours_are_alike_the_mask_decides() {
        let (_, mask) = picture();
        let grey = Planes::filled(mask.extent(), [0.4; 3]);
        let matte = Matte::estimate(&grey, &mask, 2);
        for y in 0..64 {
            for x in 0..64 {
                let apart = matte.alpha.pixel(x, y)[0] - coverage(x, y);
                assert!(apart.abs() < 0.75, "{x} {y} {apart}");
            }
        }
        assert_eq!(matte.alpha.pixel(32, 32), [1.0]);
        assert_eq!(matte.alpha.pixel(1, 1), [0.0]);
    }

    /// An object of two colours, one nearly that of the wall behind it, with a handle of five pixels.
    fn cup() -> (Planes<3>, Planes<1>) {
        let extent = Extent::new(80, 60);
        let is_body = |x: usize, y: usize| (10..50).contains(&x) && (8..52).contains(&y);
        let is_handle = |x: usize, y: usize| {
            let from = (x as f64 - 49.5).hypot(y as f64 - 30.0);
            x >= 50 && (14.0..19.0).contains(&from)
        };
        let mask = Planes::from_fn(extent, |x, y| {
            [f32::from(u8::from(is_body(x, y) || is_handle(x, y)))]
        });
        let picture = Planes::from_fn(extent, |x, y| {
            let is_glint = (y / 5) % 3 == 0;
            match (is_body(x, y) || is_handle(x, y), is_glint) {
                (false, _) => [0.85, 0.86, 0.84],
                (true, true) => [0.75, 0.74, 0.75],
                (true, false) => [0.15, 0.1, 0.3],
            }
        });
        (picture, mask)
    }

    #[test]
    fn bright_places_of_an_object_before_a_bright_wall_are_not_bitten_out_of_its_edge_and_handle() {
        let (picture, mask) = cup();
        for (edge, most) in [(2, 12), (4, 8)] {
            let matte = Matte::estimate(&picture, &mask, edge);
            let apart = |x: usize, y: usize| mask.pixel(x, y)[0] - matte.alpha.pixel(x, y)[0];
            let wrong = (0..60)
                .flat_map(|y| (0..80).map(move |x| (x, y)))
                .filter(|&(x, y)| apart(x, y).abs() > 0.5);
            let wrong: Vec<_> = wrong.collect();
            assert!(wrong.len() <= most, "edge {edge}: {wrong:?}");
        }
    }

    #[test]
    fn a_many_coloured_background_leaves_no_dots_on_the_rim() {
        let extent = Extent::new(64, 64);
        let around = |x: usize, y: usize| [0.3, 0.9][(x / 2 + y / 3) % 2];
        let picture = Planes::from_fn(extent, |x, y| {
            let alpha = coverage(x, y);
            [alpha * 0.2 + (1.0 - alpha) * around(x, y); 3]
        });
        let mask = Planes::from_fn(extent, |x, y| [f32::from(u8::from(coverage(x, y) >= 0.5))]);
        let matte = Matte::estimate(&picture, &mask, 3);
        for (x, y) in (0..64).flat_map(|y| (0..64).map(move |x| (x, y))) {
            let (alpha, colour) = (matte.alpha.pixel(x, y)[0], matte.foreground.pixel(x, y)[0]);
            // What is seen of it, less what ought to be.
            let seen = alpha * (colour - 0.2);
            assert!(seen.abs() < 0.12, "{x} {y}: {alpha} of {colour}");
        }
    }

    #[test]
    fn a_cut_out_keeps_its_alpha_and_what_lies_under_nothing_is_forgotten() {
        let extent = Extent::new(8, 1);
        let picture = Planes::from_fn(extent, |x, _| [if x < 4 { 0.5 } else { 9.0 }; 3]);
        let alpha = Planes::from_fn(extent, |x, _| [[1.0, 1.0, 0.7, 0.2, 0.0, 0.0, 0.0, 0.0][x]]);
        let matte = Matte::from_cut_out(&picture, &alpha);
        assert_eq!(matte.alpha, alpha);
        assert_eq!(matte.foreground.pixel(4, 0), [0.5; 3]);
    }

    #[test]
    fn a_picture_with_alpha_that_still_shows_its_background_is_freed_of_it() {
        let extent = Extent::new(64, 64);
        let alpha = Planes::from_fn(extent, |x, y| [coverage(x, y)]);
        let ground = |x: usize| 0.05 + 0.01 * x as f32;
        let picture = Planes::from_fn(extent, |x, y| {
            let alpha = coverage(x, y);
            OBJECT.map(|own| alpha * own + (1.0 - alpha) * ground(x))
        });
        let worst = |matte: &Matte| {
            let partly = (0..extent.pixels()).filter(|&at| alpha.plane(0)[at] > 0.2);
            partly
                .map(|at| (matte.foreground.plane(0)[at] - OBJECT[0]).abs())
                .fold(0.0, f32::max)
        };
        let freed = worst(&Matte::from_alpha(&picture, &alpha));
        let kept = worst(&Matte::from_cut_out(&picture, &alpha));
        assert!(freed < 0.1 && kept > 0.3, "{freed} {kept}");
        // What was cut out has its own colours already.
        let cut = Planes::from_fn(extent, |x, y| {
            if coverage(x, y) > 0.0 {
                OBJECT
            } else {
                [0.0; 3]
            }
        });
        assert!(worst(&Matte::from_alpha(&cut, &alpha)) < 1e-6);
    }
}
