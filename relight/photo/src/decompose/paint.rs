//! What of a pixel's darkness is paint and what is lack of light.

use relight_core::image::Planes;
use relit_data::statistics::above_part;

use super::Decomposition;

/// Keeps logarithms of dark values finite.
const FLOOR: f32 = 0.02;
/// A place is the brightest that is brighter than this part of the object.
const BRIGHTEST: f64 = 0.99;
/// Where a pixel is hardly darker than the brightest place, by less than this logarithm, nobody can tell.
const HARDLY_DARK: f32 = 0.1;

impl Decomposition {
    /// Per pixel, which part of its darkness is paint, 0..=1: near 1 print, near 0 shadow, 0.5 where it is not dark.
    ///
    /// A pixel of albedo R under a shading S is darker than the object's brightest place by `ln(R_b / R) + ln(S_b / S)`: the
    /// first summand's part of the sum. 0 outside the mask.
    pub fn paint(&self) -> Planes<1> {
        let [red, green, blue] = self.albedo.planes().planes();
        let shading = self.shading.plane(0);
        let albedo = |at: usize| (red[at] + green[at] + blue[at]) / 3.0;
        let inside = || (0..shading.len()).filter(|&at| shading[at] > 0.0);
        let (Some(brightest), Some(lightest)) = (
            above_part(inside().map(albedo), BRIGHTEST),
            above_part(inside().map(|at| shading[at]), BRIGHTEST),
        ) else {
            return Planes::zeros(self.shading.extent());
        };
        let mut part = Planes::zeros(self.shading.extent());
        let [values] = part.planes_mut();
        for at in inside() {
            let paint = darkness(albedo(at), brightest);
            let shadow = darkness(shading[at], lightest);
            values[at] = (paint + HARDLY_DARK / 2.0) / (paint + shadow + HARDLY_DARK);
        }
        part
    }
}

/// By how much a value is darker than the brightest place, as a logarithm, 0 and above.
fn darkness(value: f32, brightest: f32) -> f32 {
    ((brightest + FLOOR) / (value.max(0.0) + FLOOR))
        .ln()
        .max(0.0)
}

#[cfg(test)]
mod tests {
    use relight_core::image::{Extent, Rgb};

    use crate::decompose::{DecomposeOptions, Decomposer};
    use crate::nets::{Weights, decomposer};
    use relight_core::image::Planes;

    #[test]
    fn black_print_in_even_light_is_paint_and_a_shadow_on_even_paint_is_not() {
        let extent = Extent::new(40, 40);
        let net = Decomposer::with_side(&Weights::initial(&decomposer(), 1), 32).unwrap();
        let picture = Rgb::new(Planes::filled(extent, [0.5; 3]));
        let mask = Planes::from_fn(extent, |x, _| [f32::from(u8::from(x > 0))]);
        let mut found = net
            .decompose(&picture, &mask, &DecomposeOptions::default())
            .unwrap();
        let place = |x: usize| (x > 0, x > 20);
        found.albedo = Rgb::new(Planes::from_fn(extent, |x, y| match place(x) {
            (false, _) => [0.0; 3],
            (_, true) if y < 20 => [0.05; 3],
            _ => [0.8; 3],
        }));
        found.shading = Planes::from_fn(extent, |x, y| match place(x) {
            (false, _) => [0.0],
            (_, true) if y >= 20 => [0.1],
            _ => [1.5],
        });
        let paint = found.paint();
        let at = |x, y| paint.pixel(x, y)[0];
        assert!(
            at(30, 10) > 0.9 && at(30, 30) < 0.1,
            "{} {}",
            at(30, 10),
            at(30, 30)
        );
        assert!(
            (at(10, 10) - 0.5).abs() < 0.01,
            "where it is bright nobody can tell"
        );
        assert_eq!(at(0, 10), 0.0);
    }
}
