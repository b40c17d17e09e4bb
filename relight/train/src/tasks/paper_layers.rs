//! The paper's render layers on tensors, `batch x channels x height x width`: the same numbers as the plain ones of
//! [`relight_core::render`], with gradients by libtorch.

use tch::Tensor;

use crate::engine::tensors::{of_light, over_channels, srgb_value};
use relight_core::render::{RELEASED_AMBIENT, diffuse_constants, power_constants};

/// Keeps a division by nothing from being one.
const TINY: f64 = 1e-6;

/// A picture in sRGB, `3` channels of 0..=1, as the paper's networks are fed: `(x - 0.5) / 0.5` inside the mask.
pub(crate) fn network_input(srgb: &Tensor, mask: &Tensor) -> Tensor {
    (srgb * 2.0 - 1.0) * mask
}

/// The sRGB values of linear light, 0..=1.
pub(crate) fn to_srgb(linear: &Tensor) -> Tensor {
    srgb_value(&linear.clamp(0.0, 1.0))
}

/// Normals (p, q, 1) over their length of slopes (p, q), 0 outside the mask. y is as the slopes have it: down in the
/// paper's figures and in the predictions of Normal-Net.
pub(crate) fn normals_of_slopes(slopes: &Tensor, mask: &Tensor) -> Tensor {
    let length = (over_channels(&slopes.square()) + 1.0).sqrt();
    let one = slopes.narrow(1, 0, 1).ones_like();
    let vectors = Tensor::cat(&[slopes.shallow_clone(), one], 1);
    &vectors / &length * mask
}

/// The shading of normals (y up) under coefficients, `batch x 9 x 3` (harmonic, colour): `batch x 3 x height x width`.
///
/// The released form takes |L00| and adds 0.1, as [`relight_core::render::DiffuseForm::Released`] says.
pub(crate) fn diffuse_shading(normals: &Tensor, coefficients: &Tensor) -> Tensor {
    let first = coefficients.narrow(1, 0, 1).abs();
    let coefficients = Tensor::cat(&[first, coefficients.narrow(1, 1, 8)], 1);
    of_light(&coefficients, &diffuse_terms(normals)).clamp_min(0.0) + RELEASED_AMBIENT
}

/// The paper's highlight (5) of normals (y up): s_p times the sum of C_lm (Â_l Ŷ_lm(n))^α, each power with the sign of what
/// is raised. `reflectance` is `batch x 3`, `smoothness` `batch`.
pub(crate) fn power_highlight(
    normals: &Tensor,
    coefficients: &Tensor,
    reflectance: &Tensor,
    smoothness: &Tensor,
) -> Tensor {
    let terms = power_terms(normals);
    let exponent = smoothness.view([-1, 1, 1, 1]);
    let powers = terms.abs().clamp_min(TINY).pow(&exponent) * terms.sign();
    of_light(coefficients, &powers) * reflectance.view([-1, 3, 1, 1])
}

/// x, y and z of normals.
fn components(normals: &Tensor) -> [Tensor; 3] {
    [
        normals.narrow(1, 0, 1),
        normals.narrow(1, 1, 1),
        normals.narrow(1, 2, 1),
    ]
}

/// Â_l Y_lm of normals, `batch x 9 x h x w`: the quadratic form's terms.
fn diffuse_terms(normals: &Tensor) -> Tensor {
    let [c1, c2, c3, c4, c5] = diffuse_constants();
    let [x, y, z] = components(normals);
    let product = |a: &Tensor, b: &Tensor, c: f64| a * b * c;
    Tensor::cat(
        &[
            x.zeros_like() + c4,
            &y * (2.0 * c2),
            &z * (2.0 * c2),
            &x * (2.0 * c2),
            product(&x, &y, 2.0 * c1),
            product(&y, &z, 2.0 * c1),
            product(&z, &z, c3) - c5,
            product(&x, &z, 2.0 * c1),
            (x.square() - y.square()) * c1,
        ],
        1,
    )
}

/// Â_l Ŷ_lm of normals, `batch x 9 x h x w`: the harmonics at twice the polar angle.
fn power_terms(normals: &Tensor) -> Tensor {
    let [c0, c1, c2, c3, c4] = power_constants();
    let [x, y, z] = components(normals);
    let square = z.square();
    // 4 z^3 - 2 z.
    let odd = (&square * 4.0 - 2.0) * &z;
    let product = |a: &Tensor, b: &Tensor, c: f64| a * b * c;
    // 4 z^4 - 4 z^2 + 1.
    let even = (square.square() - &square) * 4.0 + 1.0;
    Tensor::cat(
        &[
            x.zeros_like() + c0,
            product(&y, &z, 2.0 * c1),
            &square * (2.0 * c1) - c1,
            product(&x, &z, 2.0 * c1),
            product(&(&x * &y), &square, 4.0 * c2),
            product(&y, &odd, c2),
            &even * (3.0 * c3) - c3,
            product(&x, &odd, c2),
            product(&(x.square() - y.square()), &square, 4.0 * c4),
        ],
        1,
    )
}

/// Light-Net's output, `batch x 12`, as coefficients for each colour, `batch x 9 x 3`: nine of length 1, times the
/// light's colour.
pub(crate) fn predicted_light(output: &Tensor) -> Tensor {
    let nine = output.narrow(1, 0, 9);
    let length = over_channels(&nine.square()).clamp_min(TINY).sqrt();
    let nine = (&nine / &length).unsqueeze(2);
    nine.matmul(&output.narrow(1, 9, 3).unsqueeze(1))
}

/// The reflectance net's output, `batch x 4`, as s_p (`batch x 3`, above 0) and α (`batch`, 1 to 201).
pub(crate) fn predicted_gloss(output: &Tensor) -> (Tensor, Tensor) {
    let reflectance = output.narrow(1, 0, 3).softplus();
    let smoothness = output.select(1, 3).sigmoid() * 200.0 + 1.0;
    (reflectance, smoothness)
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight_core::image::Extent;
    use relight_core::light::{Normals, ShLight};
    use relight_core::render::{DiffuseForm, DiffuseLayer, Gloss, PowerLayer};
    use tch::{Device, Kind};

    const SIDE: usize = 21;

    fn some_light() -> ShLight {
        let value = |i: usize| ((i * i + 1) as f64).sin();
        let colours = (0..9).map(|i| [value(i), value(i + 9), 0.4]);
        ShLight::new(colours.collect()).unwrap()
    }

    fn coefficients(light: &ShLight) -> Tensor {
        let flat: Vec<f32> = light.coefficients()[..9]
            .iter()
            .flatten()
            .map(|&c| c as f32)
            .collect();
        Tensor::from_slice(&flat).view([1, 9, 3])
    }

    fn sphere() -> (Tensor, Tensor, Normals) {
        let normals = Normals::sphere(SIDE);
        let planes: Vec<f32> = normals.planes().planes().concat();
        let tensor = Tensor::from_slice(&planes).view([1, 3, SIDE as i64, SIDE as i64]);
        let mask = tensor
            .square()
            .sum_dim_intlist([1_i64].as_slice(), true, None::<Kind>)
            .gt(0.5);
        (tensor, mask.to_kind(Kind::Float), normals)
    }

    fn largest_difference(tensor: &Tensor, planes: [&[f32]; 3]) -> f32 {
        let values = Vec::<f32>::try_from(tensor.flatten(0, -1)).unwrap();
        let plain = planes.concat();
        let pairs = values.iter().zip(&plain);
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
    }

    #[test]
    fn shading_is_that_of_the_plain_layer() {
        let (tensor, mask, normals) = sphere();
        let light = some_light();
        let plain = DiffuseLayer::new(&light, DiffuseForm::Released).shading(&normals);
        let ours = diffuse_shading(&tensor, &coefficients(&light)) * &mask;
        let error = largest_difference(&ours, plain.planes().planes());
        assert!(error < 1e-5, "{error}");
    }

    #[test]
    fn the_papers_highlight_is_that_of_the_plain_layer() {
        let (tensor, mask, normals) = sphere();
        let light = some_light();
        let gloss = Gloss::even(Extent::new(SIDE, SIDE), [0.5, 0.25, 1.0], 6.0);
        let plain = PowerLayer::new(&light).highlight(&normals, &gloss).unwrap();
        let reflectance = Tensor::from_slice(&[0.5_f32, 0.25, 1.0]).view([1, 3]);
        let smoothness = Tensor::from_slice(&[6.0_f32]);
        let ours = power_highlight(&tensor, &coefficients(&light), &reflectance, &smoothness);
        let ours = ours * &mask;
        let error = largest_difference(&ours, plain.planes().planes());
        let largest = plain
            .planes()
            .planes()
            .concat()
            .into_iter()
            .fold(0.0, f32::max);
        assert!(error < 1e-5 * largest.max(1.0), "{error}");
    }

    #[test]
    fn light_of_length_one_has_the_colour_that_was_answered() {
        tch::manual_seed(2);
        let output = Tensor::rand([3, 12], (Kind::Float, Device::Cpu)) - 0.3;
        let light = predicted_light(&output);
        let lengths = light
            .square()
            .sum_dim_intlist([1_i64].as_slice(), false, None::<Kind>)
            .sqrt();
        let colours = output.narrow(1, 9, 3).abs();
        assert!((lengths - colours).abs().max().double_value(&[]) < 1e-5);
    }

    #[test]
    fn srgb_has_a_slope_everywhere() {
        let light = Tensor::from_slice(&[0.0_f32, 0.001, 0.3, 1.0]).set_requires_grad(true);
        to_srgb(&light).sum(None::<Kind>).backward();
        let slopes = Vec::<f32>::try_from(light.grad()).unwrap();
        assert!(slopes.iter().all(|slope| slope.is_finite()), "{slopes:?}");
    }
}
