//! From a panorama to coefficients.

use std::f64::consts::{PI, SQRT_2};

use super::Panorama;
use crate::image::Extent;
use crate::light::basis::polar_functions;
use crate::light::quadrature::Quadrature;
use crate::light::{Order, Rotation, ShLight};
use crate::parallel;

/// Takes the panorama's own axes (pole at the zenith) to the viewer's.
const FROM_ZENITH: Rotation =
    Rotation::from_known([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]]);

impl Panorama {
    /// The coefficients of the light that the panorama shows: the integrals of each pixel's radiance
    /// times the spherical harmonics over the pixel's solid angle, exact to rounding whatever the
    /// panorama's size.
    ///
    /// With the zenith as pole a harmonic is a function of the polar angle times one of the azimuth,
    /// so that the integral over a pixel is a product of two; the sum is then rotated to the viewer's
    /// frame.
    pub fn project(&self, order: Order) -> ShLight {
        let Extent { width, height } = self.extent();
        let harmonics = AzimuthHarmonics::new(order, width);
        let step = PI / height as f64;
        let quadrature = Quadrature::for_waves(order.get() + 1, step);
        let rows: Vec<Vec<[f64; 3]>> = parallel::map(height, |row| {
            let sums = self.sums_of_row(row, &harmonics);
            let polar = polar_integrals(order, &quadrature, row as f64 * step, step);
            spread(order, &sums, &polar)
        });
        // In one order, so that the result does not depend on the threads.
        let mut light = ShLight::dark(order);
        for row in rows {
            for (sum, value) in light.coefficients_mut().iter_mut().zip(row) {
                for (sum, v) in sum.iter_mut().zip(value) {
                    *sum += v;
                }
            }
        }
        light.rotated(&FROM_ZENITH)
    }

    /// The integrals over the azimuth of a row's radiance times cos mφ (at m) and sin mφ (at -m), with
    /// -order first.
    fn sums_of_row(&self, row: usize, harmonics: &AzimuthHarmonics) -> Vec<[f64; 3]> {
        let width = self.extent().width;
        let planes = self.image.planes().planes();
        let row = planes.map(|plane| &plane[row * width..(row + 1) * width]);
        let sum = |harmonic: &[f64], channel: &[f32]| -> f64 {
            let products = harmonic.iter().zip(channel);
            products.map(|(w, &value)| w * f64::from(value)).sum()
        };
        let harmonics = harmonics.integrals.chunks_exact(width);
        harmonics
            .map(|harmonic| row.map(|channel| sum(harmonic, channel)))
            .collect()
    }
}

/// The integrals of cos mφ and sin mφ over each column, by m from -order on.
struct AzimuthHarmonics {
    integrals: Vec<f64>,
}

impl AzimuthHarmonics {
    fn new(order: Order, width: usize) -> Self {
        let order = order.get() as i32;
        let step = 2.0 * PI / width as f64;
        let integral = |m: i32, x: usize| {
            // The azimuth about the zenith grows to the left.
            let middle = PI - (x as f64 + 0.5) * step;
            let frequency = f64::from(m.abs());
            match m {
                0 => step,
                _ => {
                    let length = 2.0 * (frequency * step / 2.0).sin() / frequency;
                    let (sin, cos) = (frequency * middle).sin_cos();
                    length * SQRT_2 * if m > 0 { cos } else { sin }
                }
            }
        };
        let integrals = (-order..=order).flat_map(|m| (0..width).map(move |x| integral(m, x)));
        Self {
            integrals: integrals.collect(),
        }
    }
}

/// The integrals over a row's polar angles of the polar part of (l, m), at l (l + 1) / 2 + m.
fn polar_integrals(order: Order, quadrature: &Quadrature, from: f64, length: f64) -> Vec<f64> {
    let count = (order.get() + 1) * (order.get() + 2) / 2;
    let (mut sums, mut values) = (vec![0.0; count], vec![0.0; count]);
    for [polar, weight] in quadrature.over(from, from + length) {
        polar_functions(order, polar, &mut values);
        let area = weight * polar.sin();
        for (sum, value) in sums.iter_mut().zip(&values) {
            *sum += area * value;
        }
    }
    sums
}

/// A row's part in all coefficients.
fn spread(order: Order, sums: &[[f64; 3]], polar: &[f64]) -> Vec<[f64; 3]> {
    let order = order.get() as i32;
    (0..=order)
        .flat_map(|l| (-l..=l).map(move |m| (l, m)))
        .map(|(l, m)| {
            let factor = polar[(l * (l + 1) / 2 + m.abs()) as usize];
            sums[(m + order) as usize].map(|sum| sum * factor)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::{Planes, Rgb};
    use crate::light::{Direction, basis};

    fn speckles(extent: Extent) -> Panorama {
        let value = |i: usize| ((i * 2_654_435_761) % 1000) as f32 / 250.0;
        let planes = Planes::from_fn(extent, |x, y| [0, 1, 2].map(|c| value(x + 97 * y + 7 * c)));
        Panorama::new(Rgb::new(planes)).unwrap()
    }

    /// The integral by many points in each pixel.
    fn by_numbers(panorama: &Panorama, order: Order) -> ShLight {
        let Extent { width, height } = panorama.extent();
        let fine = 40;
        let mut light = ShLight::dark(order);
        for y in 0..height * fine {
            let [top, bottom] = [y, y + 1].map(|e| (PI * e as f64 / (height * fine) as f64).cos());
            let area = (top - bottom) * 2.0 * PI / (width * fine) as f64;
            for x in 0..width * fine {
                let at = [x, y].map(|v| (v as f64 + 0.5) / fine as f64);
                let radiance = panorama.image.planes().pixel(x / fine, y / fine);
                let values = basis(order, panorama.direction(at[0], at[1]));
                for (sum, value) in light.coefficients_mut().iter_mut().zip(values) {
                    for (sum, r) in sum.iter_mut().zip(radiance) {
                        *sum += area * value * f64::from(r);
                    }
                }
            }
        }
        light
    }

    fn largest_difference(a: &ShLight, b: &ShLight) -> f64 {
        let pairs = a
            .coefficients()
            .iter()
            .flatten()
            .zip(b.coefficients().iter().flatten());
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn a_projection_is_what_numbers_come_to() {
        let panorama = speckles(Extent::new(8, 4));
        let order = Order::new(4).unwrap();
        let difference =
            largest_difference(&panorama.project(order), &by_numbers(&panorama, order));
        assert!(difference < 2e-3, "{difference}");
    }

    #[test]
    fn a_projection_does_not_depend_on_how_finely_pixels_are_cut() {
        // The same steps of radiance in pixels of a third of the size: exact means equal.
        let coarse = speckles(Extent::new(10, 6));
        let fine = coarse.resized(Extent::new(30, 18));
        let order = Order::new(20).unwrap();
        let difference = largest_difference(&coarse.project(order), &fine.project(order));
        // The fine panorama's values are rounded to f32.
        assert!(difference < 1e-6, "{difference}");
    }

    #[test]
    fn the_first_coefficient_is_the_mean_radiance() {
        let panorama = speckles(Extent::new(9, 5));
        let mut mean = 0.0;
        for y in 0..5 {
            for x in 0..9 {
                mean += panorama.solid_angle(y) * f64::from(panorama.image.planes().pixel(x, y)[1]);
            }
        }
        let first = panorama.project(Order::TWO).coefficients()[0][1];
        assert!((first - mean / (4.0 * PI).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn the_energy_of_a_smooth_panorama_is_that_of_its_coefficients() {
        // Parseval: the integral of radiance squared is the sum of coefficients squared.
        let light = ShLight::new((0..16).map(|i| [(i as f64).cos(); 3]).collect()).unwrap();
        let panorama = Panorama::from_light(&light, Extent::new(400, 200));
        let mut energy = 0.0;
        for y in 0..200 {
            let row = &panorama.image.planes().plane(0)[y * 400..(y + 1) * 400];
            let squares: f64 = row.iter().map(|&v| f64::from(v).powi(2)).sum();
            energy += panorama.solid_angle(y) * squares;
        }
        let projected = panorama.project(Order::new(5).unwrap());
        let sum: f64 = projected.coefficients().iter().map(|c| c[0] * c[0]).sum();
        assert!((sum / energy - 1.0).abs() < 3e-4, "{sum} {energy}");
    }

    #[test]
    fn a_bright_spot_lies_in_its_direction() {
        let extent = Extent::new(64, 32);
        let lamp = Direction::new(0.5, 0.7, 0.4).unwrap();
        let (x, y) = speckles(extent).pixel_towards(lamp);
        let pixel = |i: usize, j: usize| [f32::from(u8::from((i, j) == (x, y))); 3];
        let panorama = Panorama::new(Rgb::new(Planes::from_fn(extent, pixel))).unwrap();
        let light = panorama.project(Order::TWO);
        // Band 1 points to the light: (y, z, x).
        let band = light.coefficients();
        let to = Direction::new(band[3][0], band[1][0], band[2][0]).unwrap();
        assert!(to.dot(lamp) > 0.998, "{to:?}");
    }
}
