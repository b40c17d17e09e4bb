//! Panoramas of another size or turned about the vertical.

use super::Panorama;
use crate::image::{Extent, Planes, Rgb, area_shares};

impl Panorama {
    /// The panorama turned about the vertical axis (+y, right-hand rule) by `columns` of its width:
    /// the light of [`ShLight::rotated`](crate::light::ShLight::rotated) by `2π columns / width`.
    pub fn turned(&self, columns: usize) -> Self {
        let Extent { width, height } = self.extent();
        let mut turned = self.image.planes().clone();
        for plane in turned.planes_mut() {
            for row in plane.chunks_exact_mut(width).take(height) {
                row.rotate_left(columns % width);
            }
        }
        Self {
            image: Rgb::new(turned),
        }
    }

    /// The panorama in another size: each pixel is the mean of the area that it covers.
    ///
    /// # Panics
    /// Where `extent` has no pixels.
    pub fn resized(&self, extent: Extent) -> Self {
        assert!(extent.pixels() > 0, "a panorama has pixels");
        let from = self.extent();
        let across = area_shares(from.width, extent.width);
        let down = area_shares(from.height, extent.height);
        let mut resized = Planes::zeros(extent);
        let planes = self.image.planes().planes();
        resized.fill_rows(|y, row| {
            for (channel, out) in planes.iter().zip(row) {
                for (value, columns) in out.iter_mut().zip(&across) {
                    let mean_of_row = |row: usize| -> f64 {
                        let pixel = |&(x, share): &(usize, f64)| {
                            share * f64::from(channel[row * from.width + x])
                        };
                        columns.iter().map(pixel).sum()
                    };
                    let rows = down[y].iter();
                    *value = rows
                        .map(|&(row, share)| share * mean_of_row(row))
                        .sum::<f64>() as f32;
                }
            }
        });
        Self {
            image: Rgb::new(resized),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::{Direction, Order, Rotation};
    use std::f64::consts::PI;

    fn ramp(extent: Extent) -> Panorama {
        let pixel = |x: usize, y: usize| [x as f32, y as f32, ((x * 7 + y * 3) % 5) as f32];
        Panorama::new(Rgb::new(Planes::from_fn(extent, pixel))).unwrap()
    }

    #[test]
    fn a_turned_panorama_is_light_turned_about_the_vertical() {
        let panorama = ramp(Extent::new(24, 12));
        let order = Order::new(6).unwrap();
        let turn = Rotation::about(Direction::UP, 2.0 * PI * 5.0 / 24.0);
        let turned = panorama.turned(5).project(order);
        for (a, b) in turned
            .coefficients()
            .iter()
            .zip(panorama.project(order).rotated(&turn).coefficients())
        {
            assert!((a[0] - b[0]).abs() < 1e-11, "{a:?} {b:?}");
        }
    }

    #[test]
    fn means_stay_and_the_own_size_changes_nothing() {
        let panorama = ramp(Extent::new(30, 12));
        assert_eq!(panorama.resized(panorama.extent()), panorama);
        let mean = |p: &Panorama| {
            let plane = p.image.planes().plane(2);
            plane.iter().sum::<f32>() / plane.len() as f32
        };
        let smaller = panorama.resized(Extent::new(7, 5));
        assert!((mean(&smaller) - mean(&panorama)).abs() < 1e-5);
    }
}
