//! Rendering one image of 256 x 256 on one thread, in processor time: the layers, compared with the same formulas in plain
//! loops over pixels.
#![allow(missing_docs, reason = "criterion's macros make undocumented items")]
#![allow(
    clippy::expect_used,
    reason = "a benchmark that cannot start has nothing to measure"
)]

use std::f32::consts::PI;
use std::hint::black_box;
use std::time::Duration;

use criterion::measurement::{Measurement, ValueFormatter, WallTime};
use criterion::{Criterion, criterion_group, criterion_main};
use rayon::ThreadPoolBuilder;
use relight_core::image::{Extent, Planes, Rgb};
use relight_core::light::{Normals, Order, Panorama, ShLight};
use relight_core::render::{DiffuseForm, Gloss, Layers, SpecularForm, Surface};

const SIDE: usize = 256;

/// The processor's time for this process: what other programs take on a busy machine does not count.
struct ProcessorTime;

impl Measurement for ProcessorTime {
    type Intermediate = Duration;
    type Value = Duration;

    fn start(&self) -> Duration {
        let now = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
        now.try_into().unwrap_or_default()
    }

    fn end(&self, start: Duration) -> Duration {
        self.start() - start
    }

    fn add(&self, a: &Duration, b: &Duration) -> Duration {
        *a + *b
    }

    fn zero(&self) -> Duration {
        Duration::ZERO
    }

    fn to_f64(&self, value: &Duration) -> f64 {
        value.as_nanos() as f64
    }

    fn formatter(&self) -> &dyn ValueFormatter {
        WallTime.formatter()
    }
}

fn surface() -> Surface {
    let normals = Normals::sphere(SIDE);
    let extent = normals.extent();
    let pattern = |x: usize, y: usize| 0.2 + 0.6 * (((x / 16 + y / 16) % 2) as f32);
    let albedo = Planes::from_fn(extent, |x, y| [pattern(x, y), 0.5, 0.4]);
    let smoothness = Planes::from_fn(extent, |x, _| [5.0 + x as f32 * 0.7]);
    let gloss = Gloss::new(Planes::filled(extent, [0.3; 3]), smoothness);
    Surface::new(normals, Rgb::new(albedo), gloss.ok()).expect("maps of one size")
}

fn light(order: usize) -> ShLight {
    let order = Order::new(order).expect("an order in range");
    let value = |i: usize| ((i * i + 1) as f64).sin() / (i + 1) as f64;
    let mut values: Vec<_> = (0..order.coefficients())
        .map(|i| [value(i), value(i + 9), 0.1])
        .collect();
    values[0] = [4.0, 3.0, 5.0];
    ShLight::new(values).expect("finite values")
}

/// The paper's two layers, pixel after pixel, as one writes them down.
fn plain_loop(surface: &Surface, light: &ShLight) -> Vec<[f32; 3]> {
    let c = |at: usize| light.coefficients()[at].map(|v| v as f32);
    let (normals, albedo) = (surface.normals().planes(), surface.albedo().planes());
    let gloss = surface.gloss().expect("a glossy surface");
    let mut image = Vec::with_capacity(SIDE * SIDE);
    for row in 0..SIDE {
        for column in 0..SIDE {
            let [x, y, z] = normals.pixel(column, row);
            let albedo = albedo.pixel(column, row);
            let s_p = gloss.reflectance().pixel(column, row);
            let [alpha] = gloss.smoothness().pixel(column, row);
            let diffuse = [
                0.886_227,
                1.023_328 * y,
                1.023_328 * z,
                1.023_328 * x,
                0.858_086 * x * y,
                0.858_086 * y * z,
                0.743_125 * z * z - 0.247_708,
                0.858_086 * x * z,
                0.429_043 * (x * x - y * y),
            ];
            let (a0, a1, a2) = (PI, PI * 2.0 / 3.0, PI / 4.0);
            let specular = [
                a0 * 0.282_095,
                a1 * 0.977_206 * y * z,
                a1 * 0.488_603 * (2.0 * z * z - 1.0),
                a1 * 0.977_206 * x * z,
                a2 * 4.370_192 * x * y * z * z,
                a2 * 1.092_548 * (4.0 * y * z.powi(3) - 2.0 * y * z),
                a2 * 0.315_392 * (3.0 * (4.0 * z.powi(4) - 4.0 * z * z + 1.0) - 1.0),
                a2 * 1.092_548 * (4.0 * x * z.powi(3) - 2.0 * x * z),
                a2 * 2.185_096 * (x * x - y * y) * z * z,
            ]
            .map(|v: f32| v.abs().powf(alpha).copysign(v));
            let mut pixel = [0.0; 3];
            if z != 0.0 {
                for channel in 0..3 {
                    let sum = |terms: &[f32; 9]| -> f32 {
                        (0..9).map(|at| terms[at] * c(at)[channel]).sum()
                    };
                    pixel[channel] =
                        albedo[channel] * sum(&diffuse).max(0.0) + s_p[channel] * sum(&specular);
                }
            }
            image.push(pixel);
        }
    }
    image
}

fn render(c: &mut Criterion<ProcessorTime>) {
    let surface = surface();
    let one = ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("a thread");
    let mut group = c.benchmark_group("256x256, one thread");
    let mut layers = |name: &str, order: usize, form: SpecularForm| {
        let layers = Layers::new(&light(order), DiffuseForm::Irradiance, form);
        group.bench_function(name, |b| {
            b.iter(|| one.install(|| layers.render(black_box(&surface)).image(surface.albedo())));
        });
    };
    layers(
        "diffuse and paper's specular, order 2",
        2,
        SpecularForm::Power,
    );
    layers("diffuse and lobe, order 2", 2, SpecularForm::Lobe);
    layers("diffuse and lobe, order 8", 8, SpecularForm::Lobe);
    layers("diffuse and lobe, order 24", 24, SpecularForm::Lobe);
    group.bench_function("plain loop: diffuse and paper's specular, order 2", |b| {
        let light = light(2);
        b.iter(|| plain_loop(black_box(&surface), &light));
    });
    group.bench_function("layers made for a light of order 2", |b| {
        let light = light(2);
        b.iter(|| {
            Layers::new(
                black_box(&light),
                DiffuseForm::Irradiance,
                SpecularForm::Lobe,
            )
        });
    });
    group.finish();
}

fn project(c: &mut Criterion<ProcessorTime>) {
    let panorama = Panorama::from_light(&light(6), Extent::new(512, 256));
    let one = ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("a thread");
    let mut group = c.benchmark_group("512x256 panorama, one thread");
    for order in [2, 24] {
        let order = Order::new(order).expect("an order in range");
        group.bench_function(format!("projected, order {}", order.get()), |b| {
            b.iter(|| one.install(|| black_box(&panorama).project(order)));
        });
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default().with_measurement(ProcessorTime).sample_size(20);
    targets = render, project
}
criterion_main!(benches);
