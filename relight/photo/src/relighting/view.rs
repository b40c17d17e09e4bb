//! What a camera sees of a panorama.

use std::f64::consts::PI;

use relight_core::image::{Extent, Linear, Planes, Rgb};
use relight_core::light::Panorama;

/// A camera in the centre of a panorama that looks along the viewer's axis (-z), or lower.
///
/// ```
/// use relight_core::image::Extent;
/// use relight_photo::relighting::PanoramaView;
/// use relight_core::light::{Order, Panorama, ShLight};
///
/// let sky = Panorama::from_light(&ShLight::even(Order::TWO, [0.2, 0.4, 1.0]), Extent::new(32, 16));
/// let seen = PanoramaView::new(Extent::new(40, 30), 50.0, 0.0).picture(&sky, 0.0);
/// assert!((seen.planes().pixel(20, 15)[2] - 1.0).abs() < 1e-5);
/// ```
#[derive(Debug, Clone)]
pub struct PanoramaView {
    extent: Extent,
    /// For each pixel the part of the panorama's width and of its height.
    places: Vec<[f32; 2]>,
}

impl PanoramaView {
    /// A camera whose longer side sees `field` degrees (1 to 150), and which looks `down` degrees below the horizon.
    #[must_use]
    pub fn new(extent: Extent, field: f64, down: f64) -> Self {
        let Extent { width, height } = extent;
        let tangent = (field.clamp(1.0, 150.0) / 2.0).to_radians().tan();
        let scale = 2.0 * tangent / width.max(height).max(1) as f64;
        let (sin, cos) = down.to_radians().sin_cos();
        let place = |at: usize| {
            let x = (at % width) as f64 + 0.5 - width as f64 / 2.0;
            let y = height as f64 / 2.0 - ((at / width) as f64 + 0.5);
            let [x, y, z] = [x * scale, y * scale, -1.0];
            let [y, z] = [cos * y + sin * z, cos * z - sin * y];
            let across = x.atan2(-z) / (2.0 * PI) + 0.5;
            let polar = (y / (x * x + y * y + z * z).sqrt()).clamp(-1.0, 1.0).acos();
            [across as f32, (polar / PI) as f32]
        };
        Self {
            extent,
            places: (0..extent.pixels()).map(place).collect(),
        }
    }

    /// The radiance that it sees after the panorama has turned about the vertical by `turn` radians, from the viewer to the
    /// right, as light does by [`ShLight::rotated`](relight_core::light::ShLight::rotated). Between pixels it is interpolated linearly.
    #[must_use]
    pub fn picture(&self, panorama: &Panorama, turn: f64) -> Rgb<Linear> {
        let source = panorama.image().planes();
        let Extent { width, height } = source.extent();
        let planes = source.planes();
        let shift = (turn / (2.0 * PI)).rem_euclid(1.0) as f32;
        let mut picture = Planes::zeros(self.extent);
        let columns = self.extent.width;
        picture.fill_rows(|y, [red, green, blue]| {
            let places = &self.places[y * columns..][..columns];
            let pixels = red.iter_mut().zip(green).zip(blue).zip(places);
            for (((red, green), blue), &[across, down]) in pixels {
                let (left, right, part) = between_around(across + shift, width);
                let (above, below, under) = between(down, height);
                let (above, below) = (above * width, below * width);
                let corners = [above + left, above + right, below + left, below + right];
                *red = mixed(planes[0], corners, [part, under]);
                *green = mixed(planes[1], corners, [part, under]);
                *blue = mixed(planes[2], corners, [part, under]);
            }
        });
        Rgb::new(picture)
    }
}

/// The value between four pixels, so far to the right and down.
#[inline]
fn mixed(plane: &[f32], [a, b, c, d]: [usize; 4], [right, down]: [f32; 2]) -> f32 {
    let upper = plane[a] + (plane[b] - plane[a]) * right;
    let lower = plane[c] + (plane[d] - plane[c]) * right;
    upper + (lower - upper) * down
}

/// The pixels between whose middles a place lies, and how far it is to the second; the ends meet. A place lies less than a width
/// outside.
fn between_around(part: f32, pixels: usize) -> (usize, usize, f32) {
    let place = part * pixels as f32 - 0.5;
    let place = if place < 0.0 {
        place + pixels as f32
    } else {
        place
    };
    let first = place as usize;
    let left = if first >= pixels {
        first - pixels
    } else {
        first
    };
    let right = if left + 1 == pixels { 0 } else { left + 1 };
    (left, right, place - first as f32)
}

/// The same, where there is nothing beyond the ends.
fn between(part: f32, pixels: usize) -> (usize, usize, f32) {
    let place = (part * pixels as f32 - 0.5).clamp(0.0, (pixels - 1) as f32);
    let first = place as usize;
    (first, (first + 1).min(pixels - 1), place - first as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbered() -> Panorama {
        let planes = Planes::from_fn(Extent::new(64, 32), |x, y| [x as f32, y as f32, 0.0]);
        Panorama::new(Rgb::new(planes)).unwrap()
    }

    fn middle(view: &PanoramaView, turn: f64) -> [f32; 3] {
        let seen = view.picture(&numbered(), turn);
        seen.planes().pixel(20, 20)
    }

    #[test]
    fn the_middle_is_seen_straight_ahead_and_what_is_right_on_the_right() {
        let view = PanoramaView::new(Extent::new(41, 41), 90.0, 0.0);
        let [x, y, _] = middle(&view, 0.0);
        assert!(
            (x - 31.5).abs() < 1e-3 && (y - 15.5).abs() < 1e-3,
            "{x} {y}"
        );
        let seen = view.picture(&numbered(), 0.0);
        assert!(seen.planes().pixel(40, 20)[0] > 38.0);
        assert!(seen.planes().pixel(20, 0)[1] < 8.5);
    }

    #[test]
    fn it_turns_as_a_turned_panorama_does() {
        let view = PanoramaView::new(Extent::new(41, 41), 60.0, 10.0);
        let turned = view.picture(&numbered().turned(5), 0.0);
        let seen = view.picture(&numbered(), 2.0 * PI * 5.0 / 64.0);
        let apart = seen.planes().plane(0).iter().zip(turned.planes().plane(0));
        assert!(apart.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max) < 1e-3);
    }

    #[test]
    fn a_camera_that_looks_down_sees_the_ground() {
        let level = middle(&PanoramaView::new(Extent::new(41, 41), 60.0, 0.0), 0.0);
        let down = middle(&PanoramaView::new(Extent::new(41, 41), 60.0, 30.0), 0.0);
        assert!((down[1] - level[1] - 32.0 / 6.0).abs() < 1e-2);
    }
}
