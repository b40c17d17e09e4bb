//! The specular layers' errors against the Blinn-Phong highlight, summed over a panorama's pixels, on a sphere under each
//! panorama of a folder, as a table in Markdown.
//!
//!     cargo run --release -p relight-core --example specular_error -- FOLDER
#![allow(clippy::print_stdout, reason = "it prints a table")]

mod integral;

use std::error::Error;
use std::path::PathBuf;

use relight_core::image::{Linear, Rgb};
use relight_core::light::{Normals, Order, Panorama};
use relight_core::render::{Gloss, LobeLayer, PowerLayer};

const SMOOTHNESSES: [f32; 6] = [5.0, 10.0, 20.0, 50.0, 100.0, 200.0];

/// Pixels of the sphere's picture, across.
const SIDE: usize = 16;

/// The columns of the table, apart from the smoothness.
const COLUMNS: [&str; 7] = [
    "paper's formula",
    "the same, best scale",
    "lobe, order 2",
    "lobe, order 8",
    "lobe, order 24",
    "lobe, order 48",
    "closed horizon",
];

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
    let mut errors = vec![Vec::new(); SMOOTHNESSES.len()];
    for path in &paths {
        let panorama = Panorama::read(path)?;
        for (errors, smoothness) in errors.iter_mut().zip(SMOOTHNESSES) {
            errors.push(row(&panorama, &normals, smoothness)?);
        }
    }

    println!("{} panoramas.", paths.len());
    println!(
        "Root mean square error over that of the truth, mean (and largest) over the panoramas.\n"
    );
    println!("| α | {} |", COLUMNS.join(" | "));
    println!("| ---{} |", " | ---".repeat(COLUMNS.len()));
    for (rows, smoothness) in errors.iter().zip(SMOOTHNESSES) {
        let cells = (0..COLUMNS.len()).map(|column| {
            let mean = rows.iter().map(|row| row[column]).sum::<f64>() / rows.len() as f64;
            let most = rows.iter().map(|row| row[column]).fold(0.0, f64::max);
            format!("{} ({})", percent(mean), percent(most))
        });
        println!(
            "| {smoothness} | {} |",
            cells.collect::<Vec<_>>().join(" | ")
        );
    }
    Ok(())
}

/// The errors under one panorama, in the order of the columns.
fn row(
    panorama: &Panorama,
    normals: &Normals,
    smoothness: f32,
) -> Result<[f64; COLUMNS.len()], Box<dyn Error>> {
    let gloss = Gloss::even(normals.extent(), [1.0; 3], smoothness);
    let [truth, closed] =
        [false, true].map(|closed| integral::highlight(panorama, normals, smoothness, closed));

    let all = panorama.project(Order::new(48)?);
    let lobe = |order: usize| -> Result<f64, Box<dyn Error>> {
        let layer = LobeLayer::new(&all.with_order(Order::new(order)?));
        Ok(error(&layer.highlight(normals, &gloss)?, &truth, 1.0))
    };
    let power = PowerLayer::new(&all).highlight(normals, &gloss)?;
    let scale = inner(&power, &truth) / inner(&power, &power);
    Ok([
        error(&power, &truth, 1.0),
        error(&power, &truth, scale),
        lobe(2)?,
        lobe(8)?,
        lobe(24)?,
        lobe(48)?,
        error(&closed, &truth, 1.0),
    ])
}

/// The root mean square of `scale * ours - truth`, over that of `truth`.
fn error(ours: &Rgb<Linear>, truth: &Rgb<Linear>, scale: f64) -> f64 {
    let squares = scale * scale * inner(ours, ours) - 2.0 * scale * inner(ours, truth);
    (squares / inner(truth, truth) + 1.0).max(0.0).sqrt()
}

fn inner(a: &Rgb<Linear>, b: &Rgb<Linear>) -> f64 {
    let planes = a.planes().planes().into_iter().zip(b.planes().planes());
    let values = planes.flat_map(|(a, b)| a.iter().zip(b));
    values.map(|(&a, &b)| f64::from(a) * f64::from(b)).sum()
}

/// Three figures; percent up to a hundredfold.
fn percent(part: f64) -> String {
    match part {
        part if part < 0.1 => format!("{:.2} %", 100.0 * part),
        part if part < 100.0 => format!("{:.1} %", 100.0 * part),
        part => format!("{part:.0} ×"),
    }
}
