//! How far the bright side of a panorama strip is from that of the light: `strip_azimuth PANORAMA...`.
//!
//! What a turn's video would show above the table is cut out of each panorama, at several elevations of the camera and
//! exposures, and the azimuth of its first harmonic is compared with that of all light.
#![allow(clippy::print_stdout, reason = "the example is a program of its own")]

use std::error::Error;
use std::path::Path;

use relight_core::light::{Direction, Order, Panorama};

/// Half of the camera's vertical field, degrees: the upper half of the picture is the strip.
const HALF_FIELD_DEG: f64 = 10.0;
/// Elevations of the camera over the table, degrees.
const ELEVATIONS_DEG: [f64; 4] = [8.0, 14.0, 20.0, 28.0];
/// What clips, in means of the panorama's light.
const WHITES: [f64; 3] = [0.7, 1.5, 3.0];
/// Azimuths and rows of the strip.
const COLUMNS: usize = 360;
const ROWS: usize = 11;
/// Borders of the sizes of the first harmonic over the mean, between which errors are told.
const PARTS: [f64; 6] = [0.0, 0.05, 0.15, 0.3, 0.6, f64::INFINITY];

fn main() -> Result<(), Box<dyn Error>> {
    let mut seen = Vec::new();
    for path in std::env::args().skip(1) {
        let panorama = Panorama::from_bytes(Path::new(&path), &std::fs::read(&path)?)?;
        let light = panorama.project(Order::TWO);
        let sum = |at: usize| light.coefficients()[at].iter().sum::<f64>();
        // Band 1 is y, z, x; y is up.
        let bright = sum(2).atan2(sum(3)).to_degrees();
        let mean = sum(0) / 3.0 / (4.0 * std::f64::consts::PI).sqrt();
        for elevation in ELEVATIONS_DEG {
            for white in WHITES {
                let (azimuth, part) = strip(&panorama, elevation, white * mean);
                let off = (azimuth - bright + 180.0).rem_euclid(360.0) - 180.0;
                seen.push((part, off));
            }
        }
    }
    println!(
        "bright part   strips   off by, degrees: median   at most, of three quarters   mean resultant length"
    );
    for range in PARTS.windows(2) {
        let mut inside: Vec<f64> = seen
            .iter()
            .filter(|(part, _)| (range[0]..range[1]).contains(part))
            .map(|(_, off)| *off)
            .collect();
        inside.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
        let count = inside.len();
        let at = |part: f64| {
            let place = (part * count as f64) as usize;
            inside.get(place).map_or(0.0, |off| off.abs())
        };
        let (x, y) = inside.iter().fold((0.0, 0.0), |(x, y), off| {
            let (sin, cos) = off.to_radians().sin_cos();
            (x + cos, y + sin)
        });
        let resultant = f64::hypot(x, y) / count.max(1) as f64;
        println!(
            "{:4.2} to {:4.2}  {count:6}  {:22.0}  {:27.0}  {resultant:22.2}",
            range[0],
            range[1],
            at(0.5),
            at(0.75),
        );
    }
    Ok(())
}

/// Azimuth, from x towards z, degrees, and relative size of the first harmonic of what the camera sees above the table.
fn strip(panorama: &Panorama, elevation_deg: f64, white: f64) -> (f64, f64) {
    let (mut x, mut z, mut all) = (0.0, 0.0, 0.0);
    for column in 0..COLUMNS {
        let azimuth = (column as f64).to_radians();
        let light: f64 = (0..ROWS)
            .map(|row| {
                let pitch = HALF_FIELD_DEG * row as f64 / (ROWS - 1) as f64 - elevation_deg;
                let (sin, cos) = pitch.to_radians().sin_cos();
                let towards = Direction::new(cos * azimuth.cos(), sin, cos * azimuth.sin());
                let radiance = towards.map_or([0.0; 3], |towards| panorama.radiance(towards));
                radiance
                    .iter()
                    .map(|&value| f64::from(value).min(white))
                    .sum::<f64>()
            })
            .sum();
        x += light * azimuth.cos();
        z += light * azimuth.sin();
        all += light;
    }
    let part = if all > 0.0 {
        2.0 * x.hypot(z) / all
    } else {
        0.0
    };
    (z.atan2(x).to_degrees(), part)
}
