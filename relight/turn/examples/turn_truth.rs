//! Holds `relight turn` against truth: `turn_truth SHARD TRUTH [NORMALS] [metal]`.
//!
//! TRUTH is a rendered session (`normal_gt.png`, `albedo_gt.png`, `truth.json`) or a folder that `relight synth --turn`
//! wrote (`normal.png`, `albedo.png`, `turn.json`). NORMALS are those to start from, as `--normals` takes them; without
//! it those of the shipped network. `metal` says how the light that is called known is fitted to the truth.
#![allow(clippy::print_stdout, reason = "the example is a program of its own")]

use std::error::Error;
use std::fs;
use std::path::Path;
use std::time::Instant;

use relight_core::image::{Extent, Linear, Planes, Rgb, Transfer};
use relight_core::light::NormalsFrame;
use relight_core::light::{Normals, YUp};
use relight_core::metrics::{Comparison, ScaleFit, angular_error};
use relight_core::reader::{Encoding, SampleId, Source, Turns};
use relight_core::render::Surface;
use relight_photo::nets::{NetError, Weights};
use relight_turn::{
    Conditioning, Elevation, MaterialKind, NormalsSource, ReadTurn, TableFrame, TableRotation,
    TurnMaps, TurnNetwork, TurnOptions, TurnPrior, fit_turn_light, prior_albedo, prior_normals,
    read_curves, solve_turn,
};
use serde_json::Value;

/// The weights for photographs that the program comes with.
fn shipped() -> Result<Weights, NetError> {
    weights("decompose.safetensors")
}

fn weights(name: &str) -> Result<Weights, NetError> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../cli/weights");
    Weights::read(&folder.join(name))
}

/// Light from which a pixel counts as a highlight, in parts of white.
const HIGHLIGHTS: [f32; 4] = [0.02, 0.05, 0.1, 0.2];
/// Confidences above which the error is told.
const LEVELS: [f32; 6] = [0.0, 0.2, 0.4, 0.6, 0.8, 0.9];

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [shard, truth, normals @ ..] = arguments.as_slice() else {
        return Err("give a shard and its truth".into());
    };
    let (normals, material) = match normals {
        [normals @ .., kind] if kind == "metal" => (normals, MaterialKind::Metal),
        normals => (normals, MaterialKind::Diffuse),
    };
    let (shard, truth) = (Path::new(shard), Path::new(truth));
    let start = Instant::now();
    let turn = read_curves(shard, TableRotation::default(), &|_, _| {})?;
    println!(
        "read in {:.1} s; {:?}",
        start.elapsed().as_secs_f64(),
        Conditioning::of(&turn.curves)
    );
    println!("clipped {:.3}", turn.curves.clipped());
    let truth = Truth::read(truth, shard, &turn)?;
    let frame = TableFrame::new(truth.elevation);
    let source = normals.first().map_or(NormalsSource::Own, |path| {
        NormalsSource::of(Path::new(path))
    });
    let prior = prior_normals(&source, shipped, NormalsFrame::YUp, &turn.first, &turn.mask)?;
    truth.angles("prior alone", &prior)?;
    let known = fit_turn_light(&turn.curves, &truth.surface, material, &frame)?;
    let options = |light, prior| TurnOptions {
        elevation: truth.elevation,
        light,
        prior,
        ..TurnOptions::default()
    };
    truth.tell("light known", &turn, &options(Some(known.clone()), None))?;
    truth.tell(
        "light known, prior",
        &turn,
        &options(Some(known), Some(prior.clone().into())),
    )?;
    truth.tell("light unknown", &turn, &options(None, None))?;
    truth.tell(
        "light unknown, prior",
        &turn,
        &options(None, Some(prior.into())),
    )?;
    let network = TurnNetwork::new(&weights("turn.safetensors")?)?;
    let found = TurnPrior::from(network.predict(&turn.curves, truth.elevation)?);
    let seen = prior_albedo(&shipped()?, &turn.first, &turn.mask)?;
    let prior = found.with_albedo_of_photographs(seen, &turn.mask);
    truth.tell(
        "light unknown, network of turns",
        &turn,
        &options(None, Some(prior)),
    )
}

struct Truth {
    surface: Surface,
    mask: Vec<bool>,
    elevation: Elevation,
    /// The most that each pixel shines anywhere in the turn, where that is known.
    highlight: Option<Vec<f32>>,
}

impl Truth {
    fn read(folder: &Path, shard: &Path, turn: &ReadTurn) -> Result<Self, Box<dyn Error>> {
        let rendered = folder.join("truth.json");
        let (normals, albedo, degrees) = if rendered.is_file() {
            let json: Value = serde_json::from_slice(&fs::read(rendered)?)?;
            let elevation = json["basis"]["config"]["camera"]["elevation"].as_f64();
            let crop = crop(shard)?;
            let part = |planes: &Planes<3>| cut(planes, crop).resized(turn.curves.extent());
            let normals = Normals::<YUp>::read(&folder.join("normal_gt.png"))?;
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
            let normals = Normals::<YUp>::read(&folder.join("normal.png"))?;
            let albedo = Rgb::<Linear>::read(&folder.join("albedo.png"), Transfer::Linear)?;
            (normals, albedo, elevation)
        };
        let [x, y, z] = normals.planes().planes();
        let mask = turn.mask.plane(0).iter().enumerate();
        let mask = mask.map(|(at, &mask)| mask >= 0.5 && [x[at], y[at], z[at]] != [0.0; 3]);
        Ok(Self {
            mask: mask.collect(),
            surface: Surface::new(normals, albedo, None)?,
            highlight: highlight(folder)?,
            elevation: Elevation::given(degrees)?,
        })
    }

    /// Solves a turn, and says how far it is from the truth.
    fn tell(
        &self,
        name: &str,
        turn: &ReadTurn,
        options: &TurnOptions,
    ) -> Result<(), Box<dyn Error>> {
        let start = Instant::now();
        let found = solve_turn(&turn.curves, options)?;
        let seconds = start.elapsed().as_secs_f64();
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
            "    albedo {:.3}, residual {:.3}, expected {:.1} deg, {seconds:.1} s",
            pair.mse(ScaleFit::Channel) / own.mse(ScaleFit::None),
            found.residual(),
            found.expected_error_deg(),
        );
        println!(
            "    material {:?}, {:?}",
            found.material(),
            found.materials()
        );
        for start in found.initialisations() {
            println!("    start {start:?}");
        }
        if let Some(highlight) = &self.highlight {
            let maps = TurnMaps::new(&turn.curves, &found);
            self.tell_highlights(highlight, &maps.highlight);
        }
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

    /// Which pixels shine by more than a level, found and true.
    fn tell_highlights(&self, truth: &[f32], found: &Planes<1>) {
        for level in HIGHLIGHTS {
            let (mut both, mut of_truth, mut of_found) = (0.0, 0.0, 0.0);
            let pairs = truth.iter().zip(found.plane(0)).zip(&self.mask);
            for ((truth, found), _) in pairs.filter(|(_, mask)| **mask) {
                let (is, seems) = (*truth >= level, *found >= level);
                both += f64::from(u8::from(is && seems));
                of_truth += f64::from(u8::from(is));
                of_found += f64::from(u8::from(seems));
            }
            println!(
                "    highlight >= {level}: {of_truth} of {} pixels, precision {:.2}, recall {:.2}",
                self.mask.iter().filter(|&&mask| mask).count(),
                both / f64::max(of_found, 1.0),
                both / f64::max(of_truth, 1.0)
            );
        }
    }

    fn angles(&self, name: &str, normals: &Normals<YUp>) -> Result<(), Box<dyn Error>> {
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

/// The most of the highlights of a simulated turn's frames, the mean of the channels; none where there are none.
fn highlight(folder: &Path) -> Result<Option<Vec<f32>>, Box<dyn Error>> {
    let Ok(lines) = fs::read_to_string(folder.join("frames.jsonl")) else {
        return Ok(None);
    };
    let mut most: Vec<f32> = Vec::new();
    for line in lines.lines() {
        let frame: Value = serde_json::from_str(line)?;
        let index = frame["index"].as_u64().ok_or("no index")?;
        let white = frame["white"]["highlight"].as_f64().ok_or("no white")? as f32;
        let path = folder.join(format!("highlight/{index:04}.png"));
        let image = Rgb::<Linear>::read(&path, Transfer::Linear)?.into_planes();
        let [r, g, b] = image.planes();
        most.resize(r.len(), 0.0);
        for (at, most) in most.iter_mut().enumerate() {
            *most = most.max((r[at] + g[at] + b[at]) / 3.0 * white);
        }
    }
    Ok(Some(most))
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
