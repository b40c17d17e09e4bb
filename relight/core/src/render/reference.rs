//! The ground truth that the layers are measured against: the Blinn-Phong model under a panorama, by Monte
//! Carlo integration.

use std::array;
use std::f64::consts::PI;

use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};

use super::surface::Gloss;
use crate::image::{Extent, ImageError, Linear, Planes, Rgb, check_extent};
use crate::light::{Direction, LightSampler, Normals, Panorama, YUp};
use crate::parallel;

/// Which light can make a highlight.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Horizon {
    /// All of it, as the paper's formula (3) sums over all lights: also light from behind the surface,
    /// as long as the half vector is in front of it.
    #[default]
    Open,
    /// Light from in front of the surface only, n·ω > 0, as graphics libraries have it.
    Closed,
}

/// Linear RGB values that were estimated from random samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The mean of the samples.
    pub mean: [f64; 3],
    /// The standard error of that mean: the standard deviation of the samples over the square root
    /// of their number.
    pub standard_error: [f64; 3],
}

/// Integrates the models of diffuse and glossy surfaces over a panorama by Monte Carlo: half of the
/// samples are drawn in proportion to the light, half in proportion to the lobe, and weighted by
/// the balance heuristic (Veach and Guibas, *Optimally Combining Sampling Techniques for Monte Carlo Rendering*,
/// 1995). The same seed gives the same numbers, on any number of threads.
///
/// ```
/// use relight_core::image::Extent;
/// use relight_core::light::{Direction, Order, Panorama, ShLight};
/// use relight_core::render::MonteCarlo;
///
/// let even = Panorama::of_light(&ShLight::even(Order::TWO, [1.0; 3]), Extent::new(64, 32));
/// let irradiance = MonteCarlo::new(&even, 2000).irradiance(Direction::UP, 1);
/// let error = (irradiance.mean[0] - std::f64::consts::PI).abs();
/// assert!(error < 4.0 * irradiance.standard_error[0]);
/// ```
#[derive(Debug, Clone)]
pub struct MonteCarlo<'a> {
    sampler: LightSampler<'a>,
    samples: u32,
    horizon: Horizon,
}

impl<'a> MonteCarlo<'a> {
    /// An integrator that takes so many samples for each value, at least 2.
    #[must_use]
    pub fn new(panorama: &'a Panorama, samples: u32) -> Self {
        Self {
            sampler: LightSampler::new(panorama),
            samples: samples.max(2),
            horizon: Horizon::Open,
        }
    }

    /// The same, with light from behind the surface treated so.
    #[must_use]
    pub fn with_horizon(self, horizon: Horizon) -> Self {
        Self { horizon, ..self }
    }

    /// E(n) = ∫ L(ω) max(0, n·ω) dω.
    #[must_use]
    pub fn irradiance(&self, normal: Direction, seed: u64) -> Estimate {
        let frame = Frame::around(normal);
        self.integrate(seed, |random| {
            let (direction, radiance, by_light) = if random.coin() {
                let drawn = self.sampler.draw(random.pair());
                (drawn.direction, drawn.radiance, drawn.density)
            } else {
                let [part, turn] = random.pair();
                let direction = frame.direction(part.sqrt(), turn);
                self.seen(direction)
            };
            let cosine = normal.dot(direction).max(0.0);
            let density = by_light.midpoint(cosine / PI);
            (radiance, cosine / density)
        })
    }

    /// ∫ L(ω) max(0, n·b)^α dω for one normal: H for s_p = 1.
    #[must_use]
    pub fn highlight(&self, normal: Direction, smoothness: f64, seed: u64) -> Estimate {
        let frame = Frame::around(normal);
        self.integrate(seed, |random| {
            let (direction, radiance, by_light) = if random.coin() {
                let drawn = self.sampler.draw(random.pair());
                (drawn.direction, drawn.radiance, drawn.density)
            } else {
                let [part, turn] = random.pair();
                let half = frame.direction(part.powf(1.0 / (smoothness + 1.0)), turn);
                match mirrored(half) {
                    Some(direction) => self.seen(direction),
                    // No light has a half vector on the far side of the viewer.
                    None => return ([0.0; 3], 0.0),
                }
            };
            let Some(half) = direction.half_way_to(Direction::VIEWER) else {
                return ([0.0; 3], 0.0);
            };
            if self.horizon == Horizon::Closed && normal.dot(direction) <= 0.0 {
                return ([0.0; 3], 0.0);
            }
            let lobe = normal.dot(half).max(0.0).powf(smoothness);
            // dω = 4 (b·v) db.
            let by_lobe =
                lobe * (smoothness + 1.0) / (8.0 * PI * half.dot(Direction::VIEWER).max(1e-9));
            (radiance, lobe / by_light.midpoint(by_lobe))
        })
    }

    /// The irradiance of every normal, and its standard errors.
    #[must_use]
    pub fn shading(&self, normals: &Normals<YUp>, seed: u64) -> [Rgb<Linear>; 2] {
        self.image(normals, |at, normal| {
            self.irradiance(normal, stream(seed, at))
        })
    }

    /// The highlight H of every normal, and its standard errors.
    ///
    /// # Errors
    /// Where the maps differ in size.
    pub fn highlights(
        &self,
        normals: &Normals<YUp>,
        gloss: &Gloss,
        seed: u64,
    ) -> Result<[Rgb<Linear>; 2], ImageError> {
        check_extent("map of gloss", gloss.extent(), normals.extent())?;
        let smoothness = gloss.smoothness().plane(0);
        let reflectance = gloss.reflectance().planes();
        Ok(self.image(normals, |at, normal| {
            let alpha = f64::from(smoothness[at]);
            let sum = self.highlight(normal, alpha, stream(seed, at));
            let scaled =
                |values: [f64; 3]| array::from_fn(|c| values[c] * f64::from(reflectance[c][at]));
            Estimate {
                mean: scaled(sum.mean),
                standard_error: scaled(sum.standard_error),
            }
        }))
    }

    /// A direction with the panorama's radiance and the density with which it is drawn.
    fn seen(&self, direction: Direction) -> (Direction, [f64; 3], f64) {
        let radiance = self.sampler.panorama().radiance(direction).map(f64::from);
        (direction, radiance, self.sampler.density(direction))
    }

    /// The mean of radiance times weight over all samples.
    fn integrate(&self, seed: u64, sample: impl Fn(&mut Random) -> ([f64; 3], f64)) -> Estimate {
        let mut random = Random(Pcg64Mcg::seed_from_u64(seed));
        let [mut sum, mut squares] = [[0.0; 3]; 2];
        for _ in 0..self.samples {
            let (radiance, weight) = sample(&mut random);
            if weight > 0.0 {
                for c in 0..3 {
                    let value = radiance[c] * weight;
                    sum[c] += value;
                    squares[c] += value * value;
                }
            }
        }
        let count = f64::from(self.samples);
        let mean = sum.map(|sum| sum / count);
        let standard_error = array::from_fn(|c| {
            let variance = (squares[c] / count - mean[c] * mean[c]).max(0.0);
            (variance / (count - 1.0)).sqrt()
        });
        Estimate {
            mean,
            standard_error,
        }
    }

    fn image(
        &self,
        normals: &Normals<YUp>,
        estimate: impl Fn(usize, Direction) -> Estimate + Sync,
    ) -> [Rgb<Linear>; 2] {
        let Extent { width, height } = normals.extent();
        let estimates: Vec<Option<Estimate>> = parallel::map(width * height, |at| {
            let [x, y, z] = normals.planes().planes().map(|plane| f64::from(plane[at]));
            Direction::new(x, y, z).map(|normal| estimate(at, normal))
        });
        let collect = |pick: fn(&Estimate) -> [f64; 3]| {
            Rgb::new(Planes::from_fn(normals.extent(), |x, y| {
                let values = estimates[y * width + x].as_ref().map(pick);
                values.unwrap_or_default().map(|v| v as f32)
            }))
        };
        [collect(|e| e.mean), collect(|e| e.standard_error)]
    }
}

/// Where light comes from that has this half vector with the viewer; none behind the viewer's plane.
fn mirrored(half: Direction) -> Option<Direction> {
    let [x, y, z] = half.components();
    (z > 0.0)
        .then(|| Direction::new(2.0 * z * x, 2.0 * z * y, 2.0 * z * z - 1.0))
        .flatten()
}

/// The seed of one pixel.
fn stream(seed: u64, pixel: usize) -> u64 {
    seed.wrapping_mul(0x9e37_79b9_7f4a_7c15)
        .wrapping_add(pixel as u64)
}

/// Two axes around a direction.
struct Frame {
    axes: [[f64; 3]; 3],
}

impl Frame {
    /// Duff and others, *Building an Orthonormal Basis, Revisited*, 2017.
    fn around(direction: Direction) -> Self {
        let [x, y, z] = direction.components();
        let sign = 1.0_f64.copysign(z);
        let a = -1.0 / (sign + z);
        let b = x * y * a;
        Self {
            axes: [
                [1.0 + sign * x * x * a, sign * b, -sign * x],
                [b, sign + y * y * a, -y],
                [x, y, z],
            ],
        }
    }

    /// The direction with this cosine to the frame's, `turn` (0..1) around it.
    fn direction(&self, cosine: f64, turn: f64) -> Direction {
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let (sin, cos) = (2.0 * PI * turn).sin_cos();
        let [a, b, c] = self.axes;
        let [x, y, z] = array::from_fn(|i| sine * (cos * a[i] + sin * b[i]) + cosine * c[i]);
        Direction::new(x, y, z).unwrap_or(Direction::VIEWER)
    }
}

/// Random numbers of one seed.
struct Random(Pcg64Mcg);

impl Random {
    fn coin(&mut self) -> bool {
        self.0.next_u64() >> 63 == 0
    }

    /// Two numbers, each even in 0..1.
    fn pair(&mut self) -> [f64; 2] {
        array::from_fn(|_| (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::{Order, ShLight};
    use crate::render::{DiffuseForm, DiffuseLayer, LobeLayer};

    fn panorama() -> (Panorama, ShLight) {
        let value = |i: usize| ((i * i + 1) as f64).sin() / (i + 1) as f64;
        let mut values: Vec<_> = (0..9).map(|i| [value(i), value(i + 9), 0.1]).collect();
        values[0] = [4.0, 3.0, 5.0];
        let light = ShLight::new(values).unwrap();
        (Panorama::of_light(&light, Extent::new(200, 100)), light)
    }

    /// How many standard errors the images differ by, root mean square.
    fn spread(truth: &[Rgb<Linear>; 2], ours: &Rgb<Linear>) -> f64 {
        let [mean, error] = truth;
        let (mut sum, mut count) = (0.0, 0.0);
        for c in 0..3 {
            let [mean, error] = [mean, error].map(|image| image.planes().plane(c));
            for ((mean, error), ours) in mean.iter().zip(error).zip(ours.planes().plane(c)) {
                if *error > 0.0 {
                    sum += f64::from((mean - ours) / error).powi(2);
                    count += 1.0;
                }
            }
        }
        f64::sqrt(sum / count)
    }

    #[test]
    fn the_errors_that_are_told_are_those_that_are_made() {
        // The layers are exact for light of order 2, to less than the errors of so few samples.
        let (panorama, light) = panorama();
        let normals = Normals::sphere(24);
        let integrator = MonteCarlo::new(&panorama, 400);
        let diffuse = DiffuseLayer::new(&light, DiffuseForm::Irradiance).shading(&normals);
        let ratio = spread(&integrator.shading(&normals, 5), &diffuse);
        assert!((0.9..1.1).contains(&ratio), "diffuse {ratio}");
        for smoothness in [3.0, 40.0] {
            let gloss = Gloss::even(normals.extent(), [0.3; 3], smoothness);
            let ours = LobeLayer::new(&light).highlight(&normals, &gloss).unwrap();
            let ratio = spread(&integrator.highlights(&normals, &gloss, 6).unwrap(), &ours);
            assert!((0.9..1.15).contains(&ratio), "{smoothness}: {ratio}");
        }
    }

    #[test]
    fn the_same_seed_gives_the_same_image_on_one_thread_and_on_two() {
        let (panorama, _) = panorama();
        let normals = Normals::sphere(8);
        let render = |threads: usize, seed: u64| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            let integrator = MonteCarlo::new(&panorama, 16);
            pool.build()
                .unwrap()
                .install(|| integrator.shading(&normals, seed))
        };
        assert_eq!(render(1, 3), render(2, 3));
        assert_ne!(render(1, 3), render(1, 4));
    }

    #[test]
    fn even_light_on_a_normal_to_the_viewer_has_its_closed_forms() {
        let even = Panorama::of_light(&ShLight::even(Order::TWO, [1.0; 3]), Extent::new(40, 20));
        for smoothness in [1.0, 5.0, 20.0] {
            let open = 8.0 * PI / (smoothness + 2.0);
            // Light comes from behind where the half vector is more than 45 degrees away.
            let closed = open * (1.0 - 0.5_f64.powf(smoothness / 2.0 + 1.0));
            for (horizon, truth) in [(Horizon::Open, open), (Horizon::Closed, closed)] {
                let integrator = MonteCarlo::new(&even, 10_000).with_horizon(horizon);
                let ours = integrator.highlight(Direction::VIEWER, smoothness, 2);
                let error = (ours.mean[1] - truth).abs() / ours.standard_error[1];
                assert!(error < 4.0, "{smoothness} {horizon:?}: {error}");
            }
        }
    }
}
