//! The sun, or a bare lamp, that is seen in a picture: the only sign of the direction of hard light that needs no
//! knowledge of the picture's content.

use relight_core::image::{Extent, Planes, connected_parts};

/// The longer side of the picture that is searched, pixels.
const LOOK: usize = 256;
/// Values from which on all channels are clipped.
const CLIPPED: f32 = 0.92;
/// The least of it, pixels, and the most, as a part of the picture: larger bright places are sky, windows and walls.
const MIN_PIXELS: usize = 3;
const MAX_PART: f64 = 0.03;
/// The part of the rectangle around it that it fills at least; a disc fills 0.79.
const FILLED: f64 = 0.55;
/// The lower part of a picture shows what mirrors the sun.
const MAX_HEIGHT: f64 = 0.6;
/// The least part of all clipped pixels that belongs to it.
const SHARE: f64 = 0.5;

/// A sun that is seen.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct SeenSun {
    /// Column and row of its middle, -1 to 1 from left to right and from the upper edge to the lower.
    pub place: [f64; 2],
    /// The confidence, 0 to 1: its part of all clipped pixels, and how the glow around it falls off.
    pub confidence: f64,
}

impl SeenSun {
    /// The sun in linear light: one small, round, clipped place in the upper part, in a glow that falls off. `None` if nothing
    /// is like that.
    pub(crate) fn find(picture: &Planes<3>) -> Option<Self> {
        let small = picture.resized(picture.extent().at_most(LOOK));
        let spots = spots(&small);
        let all: usize = spots.iter().map(Vec::len).sum();
        let largest = spots.into_iter().max_by_key(Vec::len)?;
        let share = largest.len() as f64 / all as f64;
        let spot = Spot::new(&largest, small.extent());
        if share < SHARE || !spot.is_like_a_sun(small.extent()) {
            return None;
        }
        let [near, far] = [1.5, 4.0].map(|times| spot.glow(&small, times));
        let glow = (near / far.max(1e-3) - 1.0).clamp(0.0, 1.0);
        let confidence = (share - SHARE) / (1.0 - SHARE) * f64::from(glow);
        let Extent { width, height } = small.extent();
        let part = |at: f64, side: usize| 2.0 * (at + 0.5) / side as f64 - 1.0;
        (confidence > 0.0).then(|| Self {
            place: [part(spot.middle[0], width), part(spot.middle[1], height)],
            confidence,
        })
    }
}

/// A clipped place.
struct Spot {
    middle: [f64; 2],
    sides: [f64; 2],
    area: f64,
}

impl Spot {
    fn new(pixels: &[usize], extent: Extent) -> Self {
        let line = |axis: usize| {
            pixels.iter().map(move |at| match axis {
                0 => at % extent.width,
                _ => at / extent.width,
            })
        };
        let axes = [0, 1];
        let count = pixels.len().max(1) as f64;
        Self {
            middle: axes.map(|axis| line(axis).sum::<usize>() as f64 / count),
            sides: axes.map(|axis| {
                let (first, last) = (line(axis).min(), line(axis).max());
                (last.unwrap_or(0) - first.unwrap_or(0) + 1) as f64
            }),
            area: count,
        }
    }

    fn is_like_a_sun(&self, extent: Extent) -> bool {
        let [wide, high] = self.sides;
        self.area >= MIN_PIXELS as f64
            && self.area <= MAX_PART * extent.pixels() as f64
            && self.area >= FILLED * wide * high
            && (0.5..=2.0).contains(&(wide / high))
            && self.middle[1] <= MAX_HEIGHT * extent.height as f64
    }

    /// The mean of the values on a ring so many times as wide as it.
    fn glow(&self, picture: &Planes<3>, times: f64) -> f32 {
        let radius = times * (self.area / std::f64::consts::PI).sqrt() + 1.0;
        let Extent { width, height } = picture.extent();
        let (mut sum, mut count) = (0.0, 0.0);
        for step in 0..48 {
            let (sin, cos) = (f64::from(step) * std::f64::consts::TAU / 48.0).sin_cos();
            let [x, y] = [self.middle[0] + radius * cos, self.middle[1] + radius * sin];
            if x >= 0.0 && y >= 0.0 && x < width as f64 && y < height as f64 {
                sum += picture.pixel(x as usize, y as usize).iter().sum::<f32>() / 3.0;
                count += 1.0;
            }
        }
        sum / f32::max(count, 1.0)
    }
}

/// The connected places in which all channels are clipped.
fn spots(picture: &Planes<3>) -> Vec<Vec<usize>> {
    let extent = picture.extent();
    let [red, green, blue] = picture.planes();
    let is_clipped = |at: usize| red[at].min(green[at]).min(blue[at]) >= CLIPPED;
    connected_parts(extent, (0..extent.pixels()).map(is_clipped).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXTENT: Extent = Extent::new(240, 160);

    /// A sky over a dark ground, with a disc of this radius in a glow.
    fn sky(at: [f64; 2], radius: f64, glow: f64) -> Planes<3> {
        Planes::from_fn(EXTENT, |x, y| {
            let from = (x as f64 - at[0]).hypot(y as f64 - at[1]);
            let ground = if y > 100 { 0.1 } else { 0.35 };
            let value = if from < radius {
                1.0
            } else {
                (ground + glow * (-(from - radius) / 8.0).exp()).min(0.9)
            };
            [value as f32; 3]
        })
    }

    #[test]
    fn a_sun_in_its_glow_is_found_where_it_is() {
        let found = SeenSun::find(&sky([180.0, 40.0], 5.0, 0.5)).unwrap();
        let [x, y] = found.place;
        assert!((x - (2.0 * 180.5 / 240.0 - 1.0)).abs() < 0.02, "{found:?}");
        assert!((y - (2.0 * 40.5 / 160.0 - 1.0)).abs() < 0.02, "{found:?}");
        assert!(found.confidence > 0.5, "{found:?}");
    }

    #[test]
    fn what_is_no_sun_is_not_taken_for_one() {
        // A mirror image in water, a wall, a window without a glow, a bright sky.
        for picture in [
            sky([180.0, 140.0], 5.0, 0.5),
            sky([120.0, 40.0], 60.0, 0.5),
            sky([120.0, 40.0], 6.0, 0.0),
            Planes::filled(EXTENT, [1.0; 3]),
            Planes::filled(EXTENT, [0.4; 3]),
            Planes::zeros(Extent::new(1, 1)),
        ] {
            assert_eq!(SeenSun::find(&picture), None);
        }
        // A bright bar, and many bright places.
        let bar = Planes::from_fn(EXTENT, |x, y| {
            [if (20..26).contains(&y) && x > 60 && x < 180 {
                1.0
            } else {
                0.3
            }; 3]
        });
        assert_eq!(SeenSun::find(&bar), None);
        let many = Planes::from_fn(EXTENT, |x, y| {
            [if x % 20 < 4 && y % 20 < 4 { 1.0 } else { 0.3 }; 3]
        });
        assert_eq!(SeenSun::find(&many), None);
    }
}
