//! Light from all around at unit vectors, on the device: smooth functions of a direction are drawn into small maps, and looked up
//! at each pixel.

use std::f64::consts::PI;

use relight_core::light::{Direction, Order, basis};
use relight_core::render::cosine_lobe;
use tch::{Device, Kind, Tensor};

use crate::engine::tensors::upload;

/// Rows of a map of directions, from +y to -y; columns go once around, the first and the last are the same.
const ROWS: usize = 25;
const COLUMNS: usize = 49;
/// Bilinear interpolation, and the border's values beyond the border, as `grid_sampler` counts them.
const BILINEAR: i64 = 0;
const BORDER: i64 = 1;

/// Harmonics on a map of directions.
#[derive(Debug)]
pub(crate) struct DirectionMaps {
    /// `directions x coefficients`.
    radiance: Tensor,
    /// The same after the cosine's lobe.
    irradiance: Tensor,
    bands: Vec<f64>,
}

impl DirectionMaps {
    pub(crate) fn new(order: Order, (kind, device): (Kind, Device)) -> Self {
        let lobes: Vec<f64> = (0..order.coefficients())
            .map(|at| cosine_lobe(at.isqrt()))
            .collect();
        let harmonics: Vec<f64> = (0..ROWS * COLUMNS)
            .flat_map(|at| harmonics_at(order, at / COLUMNS, at % COLUMNS))
            .collect();
        let radiance =
            Tensor::from_slice(&harmonics).reshape([(ROWS * COLUMNS) as i64, lobes.len() as i64]);
        let irradiance = &radiance * Tensor::from_slice(&lobes);
        let place = |of: Tensor| of.to_kind(kind).to_device(device);
        Self {
            radiance: place(radiance),
            irradiance: place(irradiance),
            bands: (0..lobes.len()).map(|at| at.isqrt() as f64).collect(),
        }
    }

    /// The irradiance of lights (`batch x coefficients x channels`) on surfaces of these unit normals.
    pub(crate) fn irradiance(&self, lights: &Tensor, normals: &Tensor) -> Tensor {
        look_up(&self.irradiance.matmul(lights), normals)
    }

    /// The radiance of lights from these directions, each light blurred by a Gaussian on the sphere of a standard deviation in
    /// radians.
    pub(crate) fn radiance(&self, lights: &Tensor, towards: &Tensor, blurs: &[f32]) -> Tensor {
        let left: Vec<f32> = blurs
            .iter()
            .flat_map(|&blur| {
                let square = f64::from(blur * blur);
                let left = move |&l: &f64| (-0.5 * l * (l + 1.0) * square).exp() as f32;
                self.bands.iter().map(left)
            })
            .collect();
        let shape = [blurs.len() as i64, self.bands.len() as i64, 1];
        let left = upload(&left, &shape, lights);
        look_up(&self.radiance.matmul(&(lights * &left)), towards)
    }
}

/// The harmonics at a cell of a map.
fn harmonics_at(order: Order, row: usize, column: usize) -> Vec<f64> {
    let polar = PI * row as f64 / (ROWS - 1) as f64;
    let around = PI * (2.0 * column as f64 / (COLUMNS - 1) as f64 - 1.0);
    let [x, y, z] = [
        polar.sin() * around.sin(),
        polar.cos(),
        polar.sin() * around.cos(),
    ];
    Direction::new(x, y, z).map_or_else(Vec::new, |at| basis(order, at))
}

/// Values of maps (`batch x directions x channels`) at unit vectors (`batch x 3 x side x side`).
fn look_up(maps: &Tensor, at: &Tensor) -> Tensor {
    let channels = maps.size()[2];
    let maps = maps
        .transpose(1, 2)
        .reshape([-1, channels, ROWS as i64, COLUMNS as i64]);
    let axis = |axis: i64| at.select(1, axis);
    let row = axis(1).clamp(-1.0, 1.0).acos() * (2.0 / PI) - 1.0;
    let column = axis(0).atan2(&axis(2)) * (1.0 / PI);
    let grid = Tensor::stack(&[column, row], -1);
    maps.grid_sampler(&grid, BILINEAR, BORDER, true)
}
