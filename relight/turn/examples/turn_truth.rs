//! Holds `relight turn` against truth: `turn_truth SHARD TRUTH [metal]`.
//!
//! TRUTH is a rendered session (`normal_gt.png`, `albedo_gt.png`, `truth.json`) or a folder that `relight synth sequences`
//! wrote (`normal.png`, `albedo.png`, `turn.json`). `metal` gives the material.
#![allow(clippy::print_stdout, reason = "the example is a program of its own")]

use std::error::Error;
use std::fs;
use std::path::Path;
use std::time::Instant;

use relight_core::image::{Extent, Linear, Planes, Rgb, Transfer};
use relight_core::light::Normals;
use relight_core::metrics::{Comparison, ScaleFit, angular_error};
use relight_core::reader::{Encoding, SampleId, Source, Turns};
use relight_core::render::Surface;
use relight_photo::nets::{NetError, Weights};
use relight_turn::{
    Elevation, MaterialKind, ReadTurn, SolvedTurn, TableFrame, TableRotation, TurnLight,
    TurnNetwork, TurnNetworks, TurnOptions, fit_turn_light, read_curves, solve_turn,
};
use relit_data::rig::RotationDirection;
use serde_json::Value;

fn weights(name: &str) -> Result<Weights, NetError> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../cli/weights");
    Weights::read(&folder.join(name))
}

/// Confidences above which the error is printed.
const LEVELS: [f32; 6] = [0.0, 0.2, 0.4, 0.6, 0.8, 0.9];

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [shard, truth, kind @ ..] = arguments.as_slice() else {
        return Err("give a shard and its truth".into());
    };
    let material = match kind {
        [kind] if kind == "metal" => MaterialKind::Metal,
        _ => MaterialKind::Diffuse,
    };
    let (shard, truth) = (Path::new(shard), Path::new(truth));
    let turn = read_curves(shard, TableRotation::default(), &|_, _| {})?;
    let truth = Truth::read(truth, shard, &turn)?;
    let frame = TableFrame::new(truth.elevation);
    let known = fit_turn_light(&turn.curves, &truth.surface, material, &frame)?;
    let networks = TurnNetworks {
        turn: TurnNetwork::new(&weights("turn.safetensors")?)?,
        photo: weights("decompose.safetensors")?,
    };
    for (name, light) in [
        ("light known", TurnLight::Given(known)),
        ("light unknown", TurnLight::Unknown),
    ] {
        let options = TurnOptions {
            rotation: Some(RotationDirection::CounterClockwise),
            elevation: Some(truth.elevation),
            light,
            material,
        };
        let start = Instant::now();
        let solved = solve_turn(shard, &options, &networks, &|_, _| {})?;
        truth.tell(name, &solved)?;
        println!("    {:.1} s", start.elapsed().as_secs_f64());
    }
    Ok(())
}

struct Truth {
    surface: Surface,
    mask: Vec<bool>,
    elevation: Elevation,
}

impl Truth {
    fn read(folder: &Path, shard: &Path, turn: &ReadTurn) -> Result<Self, Box<dyn Error>> {
        let rendered = folder.join("truth.json");
        let (normals, albedo, degrees) = if rendered.is_file() {
            let json: Value = serde_json::from_slice(&fs::read(rendered)?)?;
            let elevation = json["basis"]["config"]["camera"]["elevation"].as_f64();
            let crop = crop(shard)?;
            let part = |planes: &Planes<3>| cut(planes, crop).resized(turn.curves.extent());
            let normals = Normals::read(&folder.join("normal_gt.png"))?;
            let albedo = Rgb::<Linear>::read(&folder.join("albedo_gt.png"), Transfer::Linear)?;
            let normals = Normals::new(part(normals.planes()));
            (
                normals,
                Rgb::new(part(albedo.planes())),
                elevation.ok_or("no elevation")?,
            )
        } else {
            let json: Value = serde_json::from_slice(&fs::read(folder.join("turn.json"))?)?;
            let axis = |at: usize| json["axis"][at].as_f64().ok_or("no axis");
            let elevation = axis(2)?.atan2(axis(1)?).to_degrees();
            let normals = Normals::read(&folder.join("normal.png"))?;
            let albedo = Rgb::<Linear>::read(&folder.join("albedo.png"), Transfer::Linear)?;
            (normals, albedo, elevation)
        };
        let [x, y, z] = normals.planes().planes();
        let mask = turn.mask.plane(0).iter().enumerate();
        let mask = mask.map(|(at, &mask)| mask >= 0.5 && [x[at], y[at], z[at]] != [0.0; 3]);
        Ok(Self {
            mask: mask.collect(),
            surface: Surface::new(normals, albedo, None)?,
            elevation: Elevation::measured(degrees)?,
        })
    }

    /// Says how far a solved turn is from the truth.
    fn tell(&self, name: &str, solved: &SolvedTurn) -> Result<(), Box<dyn Error>> {
        let SolvedTurn {
            turn,
            solution: found,
            ..
        } = solved;
        let normals = found.normals(&turn.curves);
        self.angles(name, &normals)?;
        let (truth, albedo) = (self.surface.albedo().planes(), found.albedo(&turn.curves));
        let extent = truth.extent();
        let pair = Comparison::new(
            extent,
            &truth.planes(),
            &albedo.planes().planes(),
            &self.mask,
        )?;
        let black = Planes::<3>::zeros(extent);
        let own = Comparison::new(extent, &truth.planes(), &black.planes(), &self.mask)?;
        println!(
            "    albedo {:.3}, residual {:.3}, expected {:.1} deg, {:?}, {}",
            pair.mse(ScaleFit::Channel) / own.mse(ScaleFit::None),
            found.residual(),
            found.expected_error_deg(),
            found.verdict(),
            found.material(),
        );
        let confidence = found.confidence(&turn.curves);
        for level in LEVELS {
            let mask: Vec<bool> = (0..self.mask.len())
                .map(|at| self.mask[at] && confidence.plane(0)[at] >= level)
                .collect();
            let kept = mask.iter().filter(|&&m| m).count() as f64;
            let all = self.mask.iter().filter(|&&m| m).count() as f64;
            if kept > 0.0 {
                let error = angular_error(
                    extent,
                    self.surface.normals().planes().planes(),
                    normals.planes().planes(),
                    &mask,
                )?;
                println!(
                    "    confidence >= {level}: {:.2} of the pixels, mean {:.1}, median {:.1}",
                    kept / all,
                    error.mean,
                    error.median
                );
            }
        }
        Ok(())
    }

    fn angles(&self, name: &str, normals: &Normals) -> Result<(), Box<dyn Error>> {
        let whole = normals.completed(&self.mask);
        let truth = self.surface.normals().planes().planes();
        let error = angular_error(normals.extent(), truth, whole.planes().planes(), &self.mask)?;
        println!(
            "{name}: mean {:.1}, median {:.1} degrees",
            error.mean, error.median
        );
        Ok(())
    }
}

/// Where the frames lie in the video, by the first record.
fn crop(shard: &Path) -> Result<[i64; 4], Box<dyn Error>> {
    let turns = Turns::open(shard, Encoding::Srgb)?;
    let (batch, _) = turns.batch(
        &[SampleId {
            turn: 0,
            position: 0,
        }],
        None,
    );
    let record = batch.frames.first().and_then(|frame| frame.record.as_ref());
    let crop = &record.ok_or("no record")?.crop;
    Ok([crop.x.into(), crop.y.into(), crop.w.into(), crop.h.into()])
}

/// The part of an image; 0 beyond its edges.
fn cut(image: &Planes<3>, [x, y, width, height]: [i64; 4]) -> Planes<3> {
    let Extent {
        width: columns,
        height: rows,
    } = image.extent();
    Planes::from_fn(
        Extent::new(width as usize, height as usize),
        |to_x, to_y| {
            let place = (
                usize::try_from(x + to_x as i64),
                usize::try_from(y + to_y as i64),
            );
            match place {
                (Ok(x), Ok(y)) if x < columns && y < rows => image.pixel(x, y),
                _ => [0.0; 3],
            }
        },
    )
}
