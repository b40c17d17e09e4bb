//! How much light changes over a turn: whether the environment light is uneven enough to tell normals and albedo by. Knows
//! numbers, and nothing of images and files.

use std::f64::consts::TAU;

/// Below this [`modulation`], the median over an object, the environment light is too even: what varies over the turn hardly stands
/// out of the noise.
pub const MIN_MODULATION: f64 = 0.08;
/// Fewest angles that tell two harmonics.
const MIN_SAMPLES: usize = 8;
/// Light too dark to judge, 0 to 1.
const DARK: f64 = 1e-5;

/// The effective value of the first two harmonics of some light over the table's angle, over its mean. `light`:
/// the part of the turn, 0 to 1, and the linear light there; the parts have to be about evenly spread. `None` if they are too
/// few, or dark.
///
/// ```
/// use relit_data::turn_light::modulation;
///
/// let light: Vec<(f64, f64)> = (0..36)
///     .map(|at| f64::from(at) / 36.0)
///     .map(|part| (part, 0.5 + 0.2 * (std::f64::consts::TAU * part).cos()))
///     .collect();
/// let found = modulation(&light).ok_or("dark")?;
/// assert!((found - 0.4 / 2.0_f64.sqrt()).abs() < 1e-9);
/// # Ok::<(), &'static str>(())
/// ```
pub fn modulation(light: &[(f64, f64)]) -> Option<f64> {
    let count = light.len() as f64;
    let mean = light.iter().map(|(_, value)| value).sum::<f64>() / count;
    if light.len() < MIN_SAMPLES || !mean.is_finite() || mean <= DARK {
        return None;
    }
    let energy = |harmonic: f64| {
        let (mut re, mut im) = (0.0, 0.0);
        for &(part, value) in light {
            let (sin, cos) = (TAU * harmonic * part).sin_cos();
            // Without the mean, of which parts that are not quite evenly spread would show some.
            re += (value - mean) * cos;
            im += (value - mean) * sin;
        }
        (2.0 / count).powi(2) * (re * re + im * im) / 2.0
    };
    Some((energy(1.0) + energy(2.0)).sqrt() / mean)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn even_light_has_no_modulation_and_the_dark_and_a_few_frames_none_to_tell() {
        let light = |value: f64, count: u32| -> Vec<(f64, f64)> {
            let parts = (0..count).map(|at| f64::from(at) / f64::from(count));
            parts.map(|part| (part, value)).collect()
        };
        assert_eq!(modulation(&light(0.5, 12)), Some(0.0));
        assert_eq!(modulation(&light(0.0, 12)), None);
        assert_eq!(modulation(&light(f64::NAN, 12)), None);
        assert_eq!(modulation(&light(0.5, 7)), None);
        assert_eq!(modulation(&[]), None);
    }

    #[test]
    fn what_changes_faster_is_no_modulation() {
        let parts = (0..48).map(|at| f64::from(at) / 48.0);
        let light: Vec<(f64, f64)> = parts
            .map(|part| (part, 0.5 + 0.3 * (5.0 * TAU * part).sin()))
            .collect();
        assert!(modulation(&light).is_some_and(|found| found < 1e-9));
    }
}
