//! The error of the diffuse layer against exact integration over each panorama of a folder, by the order of the light, as
//! a table in Markdown, with what an image costs.
//!
//!     cargo run --release -p relight-core --example irradiance_error -- FOLDER
#![allow(clippy::print_stdout, reason = "it prints a table")]

use std::error::Error;
use std::path::PathBuf;
use std::time::Instant;

use relight_core::image::Extent;
use relight_core::light::{Direction, Normals, Order, Panorama};
use relight_core::render::{DiffuseForm, DiffuseLayer};

const ORDERS: [usize; 7] = [2, 4, 8, 12, 24, 48, 64];

/// Pixels of the sphere's picture, across.
const SIDE: usize = 48;
/// The width of the picture that is timed, pixels.
const TIMED_SIDE: usize = 512;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args()
        .nth(1)
        .ok_or("give a folder of panoramas")?;
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder)?
        .map(|entry| entry.map(|entry| entry.path()))
        .collect::<Result<_, _>>()?;
    paths.retain(|path| path.extension().is_some_and(|e| e == "hdr" || e == "exr"));
    paths.sort();

    let normals = Normals::sphere(SIDE);
    let timed = Normals::sphere(TIMED_SIDE);
    let mut errors = vec![Vec::new(); ORDERS.len()];
    let mut seconds = [0.0; ORDERS.len()];
    for path in &paths {
        let panorama = Panorama::read(path)?;
        let truth = Irradiance::from_panorama(&panorama);
        let light = panorama.project(Order::new(ORDERS[ORDERS.len() - 1])?);
        for (at, order) in ORDERS.into_iter().enumerate() {
            let light = light.with_order(Order::new(order)?);
            let layer = DiffuseLayer::new(&light, DiffuseForm::Irradiance);
            errors[at].push(truth.error(&layer, &normals));
            let start = Instant::now();
            std::hint::black_box(layer.shading(&timed));
            seconds[at] += start.elapsed().as_secs_f64();
        }
    }

    println!("{} panoramas.\n", paths.len());
    println!("| order | mean | median | worst | image of {TIMED_SIDE} x {TIMED_SIDE}, ms |");
    println!("| --- | --- | --- | --- | --- |");
    for ((order, mut errors), seconds) in ORDERS.into_iter().zip(errors).zip(seconds) {
        errors.sort_by(f64::total_cmp);
        let count = errors.len() as f64;
        println!(
            "| {order} | {:.2} % | {:.2} % | {:.2} % | {:.1} |",
            100.0 * errors.iter().sum::<f64>() / count,
            100.0 * errors[errors.len() / 2],
            100.0 * errors[errors.len() - 1],
            1000.0 * seconds / count
        );
    }
    Ok(())
}

/// A panorama as a list of small lights.
struct Irradiance {
    lights: Vec<([f64; 3], [f64; 3])>,
}

impl Irradiance {
    fn from_panorama(panorama: &Panorama) -> Self {
        let planes = panorama.image().planes();
        let Extent { width, height } = planes.extent();
        let mut lights = Vec::with_capacity(width * height);
        for y in 0..height {
            let step = std::f64::consts::PI / height as f64;
            let (upper, lower) = (y as f64 * step, (y + 1) as f64 * step);
            let area = (upper.cos() - lower.cos()) * 2.0 * std::f64::consts::PI / width as f64;
            for x in 0..width {
                let towards = panorama.direction(x as f64 + 0.5, y as f64 + 0.5);
                let radiance = planes.pixel(x, y).map(|v| f64::from(v) * area);
                lights.push((towards.components(), radiance));
            }
        }
        Self { lights }
    }

    fn at(&self, normal: Direction) -> [f64; 3] {
        let [x, y, z] = normal.components();
        let mut sum = [0.0; 3];
        for (towards, radiance) in &self.lights {
            let cosine = (x * towards[0] + y * towards[1] + z * towards[2]).max(0.0);
            for (sum, radiance) in sum.iter_mut().zip(radiance) {
                *sum += cosine * radiance;
            }
        }
        sum
    }

    /// The root mean square of the layer's difference over that of the irradiance, on the front of a sphere.
    fn error(&self, layer: &DiffuseLayer, normals: &Normals) -> f64 {
        let shading = layer.shading(normals);
        let (mut square, mut whole) = (0.0, 0.0);
        for y in (0..SIDE).step_by(3) {
            for x in (0..SIDE).step_by(3) {
                let [nx, ny, nz] = normals.planes().pixel(x, y).map(f64::from);
                let Some(normal) = Direction::new(nx, ny, nz) else {
                    continue;
                };
                let pairs = self
                    .at(normal)
                    .into_iter()
                    .zip(shading.planes().pixel(x, y));
                for (exact, found) in pairs {
                    square += (f64::from(found) - exact).powi(2);
                    whole += exact * exact;
                }
            }
        }
        (square / whole).sqrt()
    }
}
