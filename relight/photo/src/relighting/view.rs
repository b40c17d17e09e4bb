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
    /// In the middle.
    pixels_a_radian: f64,
}

impl PanoramaView {
    /// A camera whose longer side sees `field` degrees (1 to 150), and which looks `down` degrees below the horizon.
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
            pixels_a_radian: 1.0 / scale,
        }
    }

    /// The radiance that it sees after the panorama has turned about the vertical by `turn` radians, from the viewer to the
    /// right, as light does by [`ShLight::rotated`](relight_core::light::ShLight::rotated), in units in which 1 is shown as white.
    pub fn picture(&self, panorama: &Panorama, turn: f64) -> Rgb<Linear> {
        self.exposed(panorama, turn, [1.0; 3])
    }

    /// The same times `scale`; 1 is shown as white.
    ///
    /// An enlarged panorama is interpolated by the cubic B-spline, which has neither steps nor dark rims, any other linearly.
    /// Values above white are compressed before and expanded after it: a window is a hundred times as bright as its wall, and
    /// would otherwise grow by a pixel and have a staircase as its outline.
    pub(crate) fn exposed(&self, panorama: &Panorama, turn: f64, scale: [f32; 3]) -> Rgb<Linear> {
        let source = panorama.image().planes();
        let Extent { width, height } = source.extent();
        let planes = source.planes();
        let shift = (turn / (2.0 * PI)).rem_euclid(1.0) as f32;
        let is_smooth = self.enlargement(panorama) > MAX_LINEAR;
        let mut picture = Planes::zeros(self.extent);
        let columns = self.extent.width;
        picture.fill_rows(|y, mut row| {
            let places = &self.places[y * columns..][..columns];
            for (x, &[across, down]) in places.iter().enumerate() {
                let (first, across) = taps((across + shift).rem_euclid(1.0), width, is_smooth);
                let (top, down) = taps(down, height, is_smooth);
                let at = |tap: i64| (first + tap).rem_euclid(width as i64) as usize;
                let columns = [0, 1, 2, 3].map(at);
                let mut sum = [0.0; 3];
                for (tap, weight) in (0..).zip(down) {
                    let line = (top + tap).clamp(0, height as i64 - 1) as usize * width;
                    for (channel, plane) in planes.into_iter().enumerate() {
                        let values =
                            columns.map(|column| compressed(scale[channel] * plane[line + column]));
                        let across = values.iter().zip(across).map(|(value, part)| value * part);
                        sum[channel] += weight * across.sum::<f32>();
                    }
                }
                for (line, sum) in row.iter_mut().zip(sum) {
                    line[x] = expanded(sum);
                }
            }
        });
        Rgb::new(picture)
    }

    /// How many of its pixels there are to one of a panorama, across, in the middle of what it sees: from about 4 on, the picture of
    /// it is visibly blurred.
    pub fn enlargement(&self, panorama: &Panorama) -> f64 {
        self.pixels_a_radian * 2.0 * PI / panorama.extent().width as f64
    }
}

/// How many pixels of a picture there are to one of a panorama until linear interpolation shows.
const MAX_LINEAR: f64 = 1.5;
/// The most that a compressed value is.
const MAX_COMPRESSED: f32 = 2.0 - 1e-5;

/// Values up to white are as they are, and all brighter ones less than 2.
#[inline]
fn compressed(value: f32) -> f32 {
    if value > 1.0 {
        (2.0 - 1.0 / value).min(MAX_COMPRESSED)
    } else {
        value
    }
}

/// What was compressed.
#[inline]
fn expanded(value: f32) -> f32 {
    if value > 1.0 {
        1.0 / (2.0 - value.min(MAX_COMPRESSED))
    } else {
        value.max(0.0)
    }
}

/// The first of the four pixels of a line around a place, which may lie outside, and their weights.
fn taps(part: f32, pixels: usize, is_smooth: bool) -> (i64, [f32; 4]) {
    let place = part * pixels as f32 - 0.5;
    let first = place.floor();
    let (t, u) = (place - first, 1.0 - (place - first));
    let weights = if is_smooth {
        let near = |d: f32| 2.0 / 3.0 - d * d * (2.0 - d) / 2.0;
        [u * u * u / 6.0, near(t), near(u), t * t * t / 6.0]
    } else {
        [0.0, u, t, 0.0]
    };
    (first as i64 - 1, weights)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbered() -> Panorama {
        let planes = Planes::from_fn(Extent::new(64, 32), |x, y| {
            [x as f32 / 64.0, y as f32 / 64.0, 0.0]
        });
        Panorama::new(Rgb::new(planes)).unwrap()
    }

    fn middle(view: &PanoramaView, turn: f64) -> [f32; 3] {
        let seen = view.picture(&numbered(), turn);
        seen.planes().pixel(20, 20).map(|part| 64.0 * part)
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
        assert!(64.0 * seen.planes().pixel(40, 20)[0] > 38.0);
        assert!(64.0 * seen.planes().pixel(20, 0)[1] < 8.5);
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

    /// Light beyond a slanted edge, a hundred times as bright as white, seen much larger.
    fn window() -> Rgb<Linear> {
        let planes = Planes::from_fn(Extent::new(64, 32), |x, y| {
            [if 2 * x + y > 82 { 100.0 } else { 0.2 }; 3]
        });
        let panorama = Panorama::new(Rgb::new(planes)).unwrap();
        PanoramaView::new(Extent::new(200, 200), 60.0, 0.0).picture(&panorama, 0.0)
    }

    #[test]
    fn a_window_much_brighter_than_white_has_a_smooth_outline() {
        let seen = window();
        // In each row the first column that is shown as white.
        let edge: Vec<i64> = (60..140)
            .map(|y| {
                (0..200)
                    .position(|x| seen.planes().pixel(x, y)[0] >= 1.0)
                    .unwrap() as i64
            })
            .collect();
        // A straight line but for a third of the panorama's pixels, which are 17 of these wide.
        let (first, last) = (edge[0] as f64, edge[edge.len() - 1] as f64);
        for (at, &column) in edge.iter().enumerate() {
            let along = first + (last - first) * at as f64 / (edge.len() - 1) as f64;
            assert!((column as f64 - along).abs() < 6.0, "{at} {column} {along}");
        }
    }

    #[test]
    fn light_beyond_white_keeps_its_strength() {
        let seen = window();
        let strongest = seen.planes().brightest().fold(0.0_f32, f32::max);
        assert!((strongest / 100.0 - 1.0).abs() < 0.02, "{strongest}");
        assert!(seen.planes().plane(0).iter().all(|&v| v >= 0.0));
    }

    #[test]
    fn how_much_a_panorama_is_enlarged_is_known() {
        let view = PanoramaView::new(Extent::new(200, 100), 60.0, 0.0);
        // 200 pixels across 2 tan 30 degrees, and 64 across all around.
        let expected = 200.0 / (2.0 * 30_f64.to_radians().tan()) * 2.0 * PI / 64.0;
        assert!((view.enlargement(&numbered()) - expected).abs() < 1e-9);
    }
}
