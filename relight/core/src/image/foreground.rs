//! An object's own colours where it covers a pixel only in part.

use super::{Extent, Planes, beside};

/// How far colours are alike from pixel to pixel where alpha does not change.
const EVEN: f32 = 1e-5;
/// How much more alike they are for each unit by which alpha changes.
const ALONG_ALPHA: f32 = 1.0;
/// Levels up to this longest side are solved with [`SMALL_ROUNDS`] rounds of Gauss-Seidel, larger ones with [`LARGE_ROUNDS`].
const SMALL_SIDE: usize = 32;
const SMALL_ROUNDS: usize = 10;
const LARGE_ROUNDS: usize = 2;
/// Alpha from which a pixel shows the object alone, and up to which it shows the background alone, where the first level begins.
const SURE: (f32, f32) = (0.9, 0.1);

impl Planes<3> {
    /// The foreground F of a picture that is `alpha F + (1 - alpha) B`, pixel by pixel, in linear light. Where alpha is 1 it is
    /// the picture; where alpha is 0, colours of the object go on smoothly.
    ///
    /// Germer, Uelwer, Conrad and Harmeling, "Fast Multi-Level Foreground Estimation" (ICPR 2020): F and B are those that explain
    /// the picture and differ little from pixel to pixel, the less the more alpha changes there. It is solved coarse to fine, by
    /// Gauss-Seidel with two unknowns a pixel.
    ///
    /// # Panics
    /// Where alpha has another size.
    pub fn foreground(&self, alpha: &Planes<1>) -> Self {
        assert_eq!(self.extent(), alpha.extent(), "size of alpha");
        if self.extent().pixels() == 0 {
            return self.clone();
        }
        let mut level: Option<Level> = None;
        for extent in levels(self.extent()) {
            let (picture, alpha) = (nearest(self, extent), nearest(alpha, extent));
            let mut next = match &level {
                Some(level) => level.at(extent),
                None => Level::even(&picture, &alpha),
            };
            let longest = extent.width.max(extent.height);
            let rounds = if longest <= SMALL_SIDE {
                SMALL_ROUNDS
            } else {
                LARGE_ROUNDS
            };
            for _ in 0..rounds {
                next.relax(&picture, alpha.plane(0));
            }
            level = Some(next);
        }
        let mut found = level.map_or_else(|| self.clone(), |level| level.foreground);
        for (found, picture) in found.planes_mut().into_iter().zip(self.planes()) {
            let pixels = found.iter_mut().zip(picture).zip(alpha.plane(0));
            for ((found, picture), &alpha) in pixels {
                if alpha >= 1.0 {
                    *found = *picture;
                }
            }
        }
        found
    }
}

/// Sizes from one pixel to the whole, each about twice the one before.
fn levels(whole: Extent) -> Vec<Extent> {
    let longest = whole.width.max(whole.height) as f64;
    let count = longest.log2().ceil().max(1.0) as i32;
    let side = |pixels: usize, level: i32| {
        let part = f64::from(level) / f64::from(count);
        ((pixels as f64).powf(part).round() as usize).max(1)
    };
    (0..=count)
        .map(|level| Extent::new(side(whole.width, level), side(whole.height, level)))
        .collect()
}

/// An image in another size, of the pixels that are nearest.
fn nearest<const C: usize>(image: &Planes<C>, extent: Extent) -> Planes<C> {
    let from = image.extent();
    if from == extent {
        return image.clone();
    }
    Planes::from_fn(extent, |x, y| {
        image.pixel(
            x * from.width / extent.width,
            y * from.height / extent.height,
        )
    })
}

/// Both sides' colours in one size.
struct Level {
    foreground: Planes<3>,
    background: Planes<3>,
}

impl Level {
    /// The mean colours of what is surely one of both.
    fn even(picture: &Planes<3>, alpha: &Planes<1>) -> Self {
        let mean = |counts: &dyn Fn(f32) -> bool| {
            let chosen = || (0..alpha.plane(0).len()).filter(|&at| counts(alpha.plane(0)[at]));
            let count = chosen().count().max(1) as f32;
            picture
                .planes()
                .map(|plane| chosen().map(|at| plane[at]).sum::<f32>() / count)
        };
        Self {
            foreground: Planes::filled(picture.extent(), mean(&|alpha| alpha > SURE.0)),
            background: Planes::filled(picture.extent(), mean(&|alpha| alpha < SURE.1)),
        }
    }

    fn at(&self, extent: Extent) -> Self {
        Self {
            foreground: nearest(&self.foreground, extent),
            background: nearest(&self.background, extent),
        }
    }

    /// One round over all pixels.
    fn relax(&mut self, picture: &Planes<3>, alpha: &[f32]) {
        let extent = picture.extent();
        let (front, back) = (self.foreground.planes_mut(), self.background.planes_mut());
        for at in 0..extent.pixels() {
            let (a, b) = (alpha[at], 1.0 - alpha[at]);
            let around = beside(extent, at).map(|other| {
                let other = other.unwrap_or(at);
                (other, EVEN + ALONG_ALPHA * (a - alpha[other]).abs())
            });
            let all: f32 = around.iter().map(|(_, weight)| weight).sum();
            let (ff, fb, bb) = (a * a + all, a * b, b * b + all);
            let over = 1.0 / (ff * bb - fb * fb);
            for (channel, plane) in picture.planes().into_iter().enumerate() {
                let (front, back) = (&mut *front[channel], &mut *back[channel]);
                let (mut f, mut b_sum) = (a * plane[at], b * plane[at]);
                for (other, weight) in around {
                    f += weight * front[other];
                    b_sum += weight * back[other];
                }
                front[at] = ((bb * f - fb * b_sum) * over).max(0.0);
                back[at] = ((ff * b_sum - fb * f) * over).max(0.0);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: usize = 96;

    /// A light disc with an edge of hairs before a dark ground of another colour, its alpha and its own colours.
    fn fur() -> (Planes<3>, Planes<1>, Planes<3>) {
        let extent = Extent::new(SIDE, SIDE);
        let alpha = Planes::from_fn(extent, |x, y| {
            let [x, y] = [x, y].map(|at| at as f32 - 47.5);
            let hairs = 0.5 + 0.5 * (y.atan2(x) * 40.0).sin();
            let edge = 26.0 + 8.0 * hairs;
            [((edge - x.hypot(y)) / 5.0).clamp(0.0, 1.0)]
        });
        let own = Planes::from_fn(extent, |x, y| {
            let shade = 0.6 + 0.3 * (x as f32 / SIDE as f32);
            [shade, 0.8 * shade, 0.5 * shade + 0.001 * y as f32]
        });
        let picture = Planes::from_fn(extent, |x, y| {
            let (alpha, own) = (alpha.pixel(x, y)[0], own.pixel(x, y));
            let ground = [0.02, 0.05 + 0.002 * y as f32, 0.03];
            [0, 1, 2].map(|c| alpha * own[c] + (1.0 - alpha) * ground[c])
        });
        (picture, alpha, own)
    }

    /// The mean error over what is covered in part, as it shows before another ground.
    fn error(colours: &Planes<3>, own: &Planes<3>, alpha: &Planes<1>) -> f32 {
        let partly: Vec<usize> = (0..SIDE * SIDE)
            .filter(|&at| (0.02..0.98).contains(&alpha.plane(0)[at]))
            .collect();
        let sum: f32 = partly
            .iter()
            .flat_map(|&at| (0..3).map(move |c| (at, c)))
            .map(|(at, c)| alpha.plane(0)[at] * (colours.plane(c)[at] - own.plane(c)[at]).abs())
            .sum();
        sum / (3 * partly.len()) as f32
    }

    #[test]
    fn colours_of_fur_are_free_of_the_dark_ground_behind_it() {
        let (picture, alpha, own) = fur();
        let (before, after) = (
            error(&picture, &own, &alpha),
            error(&picture.foreground(&alpha), &own, &alpha),
        );
        assert!(after < 0.15 * before && before > 0.05, "{before} {after}");
    }

    #[test]
    fn what_is_covered_wholly_stays_and_colours_go_on_beyond_the_edge() {
        let (picture, alpha, _) = fur();
        let found = picture.foreground(&alpha);
        for (x, y) in (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y))) {
            if alpha.pixel(x, y) == [1.0] {
                assert_eq!(found.pixel(x, y), picture.pixel(x, y));
            }
            assert!(found.pixel(x, y).iter().all(|v| v.is_finite() && *v >= 0.0));
        }
        assert!(found.pixel(12, 47)[0] > 0.4, "{:?}", found.pixel(12, 47));
    }

    #[test]
    fn a_picture_of_one_pixel_and_one_without_any_object_are_taken_too() {
        let one = Planes::filled(Extent::new(1, 1), [0.3, 0.2, 0.1]);
        assert_eq!(one.foreground(&Planes::filled(one.extent(), [1.0])), one);
        let none = one.foreground(&Planes::zeros(one.extent()));
        assert!(none.pixel(0, 0).iter().all(|v| v.is_finite()));
    }
}
