//! Makes the pictures of the manual: the conventions, the specular layers beside the ground truth, and a
//! mug under turning light. All that they show is made here.
//!
//!     cargo run --release -p relight-core --example pictures -- docs/images

mod integral;

use std::error::Error;
use std::path::Path;

use relight_core::image::{Extent, Linear, Planes, Rgb, Srgb};
use relight_core::light::{Direction, Normals, Order, Panorama};
use relight_core::render::{
    DiffuseForm, DiffuseLayer, Gloss, LobeLayer, PowerLayer, RenderSettings, SpecularForm, Surface,
    exposure_for,
};

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).ok_or("give a folder")?;
    let folder = Path::new(&folder);
    save(conventions()?, &folder.join("relight-conventions.png"))?;
    save(highlights()?, &folder.join("relight-highlights.png"))?;
    save(turn()?, &folder.join("relight-turn.png"))?;
    Ok(())
}

fn save(image: Rgb<Linear>, path: &Path) -> Result<(), Box<dyn Error>> {
    Ok(image.encode::<Srgb>().write_png(path)?)
}

/// A panorama with lamps along the axes, a sphere in its light, and the sphere's normals, y up and y down.
fn conventions() -> Result<Rgb<Linear>, Box<dyn Error>> {
    let side = 160;
    let lamps = [
        (Direction::RIGHT, [1.0, 0.05, 0.05]),
        (Direction::UP, [0.05, 1.0, 0.05]),
        (Direction::VIEWER, [0.1, 0.1, 1.0]),
    ];
    let panorama = painted(Extent::new(2 * side, side), |direction| {
        let lit = lamps.iter().find(|(lamp, _)| direction.dot(*lamp) > 0.93);
        lit.map_or([0.03; 3], |(_, colour)| *colour)
    })?;
    let normals = Normals::sphere(side);
    let light = panorama.project(Order::TWO);
    let shading = DiffuseLayer::new(&light, DiffuseForm::Irradiance).shading(&normals);
    let exposure = exposure_for(&light);
    let shading = shading.into_planes().map(|v| v * exposure);
    let colours = |planes: Planes<3>| Rgb::<Srgb>::new(planes).to_linear().into_planes();
    let down = normals.clone().flipped().to_colours();
    let parts = [
        panorama.image().planes().clone(),
        shading,
        colours(normals.to_colours()),
        colours(down),
    ];
    Ok(Rgb::new(beside(&parts)))
}

/// From above: the ground truth, the lobe for light of order 24 and of order 2, and the paper's formula in the
/// scale that suits best; from the left, smoothness from 5 to 200.
fn highlights() -> Result<Rgb<Linear>, Box<dyn Error>> {
    let normals = Normals::sphere(96);
    let panorama = studio(Extent::new(256, 128))?;
    let light = panorama.project(Order::new(24)?);
    let second = light.with_order(Order::TWO);
    let mut rows = [const { Vec::new() }; 4];
    for smoothness in [5.0, 10.0, 20.0, 50.0, 100.0, 200.0] {
        let gloss = Gloss::even(normals.extent(), [1.0; 3], smoothness);
        let truth = integral::highlight(&panorama, &normals, smoothness, false);
        let power = PowerLayer::new(&second).highlight(&normals, &gloss)?;
        let scale = inner(&power, &truth) / inner(&power, &power);
        // All in one exposure, in which the brightest of the ground truth is white.
        let exposure = 1.0 / brightest(&truth);
        let images = [
            (
                LobeLayer::new(&light).highlight(&normals, &gloss)?,
                exposure,
            ),
            (
                LobeLayer::new(&second).highlight(&normals, &gloss)?,
                exposure,
            ),
            (power, scale * exposure),
        ];
        rows[0].push(truth.into_planes().map(|v| v * exposure));
        for (row, (image, factor)) in rows[1..].iter_mut().zip(images) {
            row.push(image.into_planes().map(|v| v * factor));
        }
    }
    Ok(Rgb::new(Planes::sheet(&rows.concat(), 6)?))
}

/// The mug's normals and albedo, and the mug at six moments of a turn of the light.
fn turn() -> Result<Rgb<Linear>, Box<dyn Error>> {
    let surface = mug(192)?;
    let light = studio(Extent::new(256, 128))?.project(Order::new(24)?);
    let settings = settings(exposure_for(&light));
    let colours = Rgb::<Srgb>::new(surface.normals().to_colours()).to_linear();
    let mut tiles = vec![colours.into_planes(), surface.albedo().planes().clone()];
    for step in 0..6 {
        let image = settings.turned(&surface, &light, f64::from(step) / 6.0)?;
        tiles.push(image.into_planes());
    }
    Ok(Rgb::new(Planes::sheet(&tiles, 4)?))
}

fn settings(exposure: f32) -> RenderSettings {
    RenderSettings {
        diffuse: DiffuseForm::Irradiance,
        specular: SpecularForm::Lobe,
        exposure,
    }
}

/// A dark hall with two soft boxes, a strip of light and a warm floor.
fn studio(extent: Extent) -> Result<Panorama, Box<dyn Error>> {
    painted(extent, |direction| {
        let [x, y, z] = direction.components();
        let inside = |a: f64, b: f64, half: [f64; 2]| a.abs() < half[0] && b.abs() < half[1];
        if x > 0.3 && inside(y / x - 0.6, z / x - 0.7, [0.35, 0.35]) {
            [14.0, 13.0, 11.0]
        } else if x < -0.3 && inside(y / x + 0.3, z / x + 0.2, [0.5, 0.2]) {
            [3.0, 4.0, 6.0]
        } else if z < -0.3 && inside(y / z + 1.2, x / z, [0.1, 0.8]) {
            [9.0; 3]
        } else if y < -0.2 {
            [0.25, 0.16, 0.1]
        } else {
            [0.12, 0.13, 0.16]
        }
    })
}

fn painted(
    extent: Extent,
    radiance: impl Fn(Direction) -> [f32; 3],
) -> Result<Panorama, Box<dyn Error>> {
    let black = Panorama::new(Rgb::new(Planes::zeros(extent)))?;
    let pixel = |x: usize, y: usize| radiance(black.direction(x as f64 + 0.5, y as f64 + 0.5));
    Ok(Panorama::new(Rgb::new(Planes::from_fn(extent, pixel)))?)
}

/// A mug, seen a little from above: its maps, found by marching along the lines of sight through a
/// distance function.
fn mug(side: usize) -> Result<Surface, Box<dyn Error>> {
    let extent = Extent::new(side, side);
    let place = |at: usize| 2.05 * ((at as f64 + 0.5) / side as f64 - 0.5);
    let hits: Vec<Option<[f64; 3]>> = (0..side * side)
        .map(|at| march(place(at % side) + 0.13, -place(at / side)))
        .collect();
    let normals = Planes::from_fn(extent, |x, y| {
        hits[y * side + x].map_or([0.0; 3], |hit| slope(hit).map(|v| v as f32))
    });
    let albedo = Planes::from_fn(extent, |x, y| hits[y * side + x].map_or([0.0; 3], colour));
    let normals = Normals::new(normals);
    let gloss = Gloss::even(extent, [0.25; 3], 80.0);
    Ok(Surface::new(normals, Rgb::new(albedo), Some(gloss))?)
}

fn march(x: f64, y: f64) -> Option<[f64; 3]> {
    let mut z = 2.0;
    for _ in 0..200 {
        let left = distance([x, y, z]);
        if left < 1e-4 {
            return Some([x, y, z]);
        }
        z -= 0.8 * left;
        if z < -2.0 {
            return None;
        }
    }
    None
}

fn slope(at: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|axis| {
        let moved = |by: f64| {
            let mut at = at;
            at[axis] += by;
            distance(at)
        };
        (moved(1e-4) - moved(-1e-4)) / 2e-4
    })
}

/// To the mug's own axes: turned to the side, then tipped towards the viewer.
fn own([x, y, z]: [f64; 3]) -> [f64; 3] {
    let (s, c) = 0.5_f64.sin_cos();
    let (y, z) = (c * y + s * z, c * z - s * y);
    let (s, c) = 0.6_f64.sin_cos();
    [c * x + s * z, y, c * z - s * x]
}

fn distance(at: [f64; 3]) -> f64 {
    let [x, y, z] = own(at);
    let around = x.hypot(z);
    let rounded = |radius: f64, half: f64, height: f64, edge: f64| {
        let (out, up) = (around - radius + edge, (y - height).abs() - half + edge);
        out.max(0.0).hypot(up.max(0.0)) + out.max(up).min(0.0) - edge
    };
    let wall = rounded(0.62, 0.72, 0.0, 0.06);
    let hollow = rounded(0.53, 0.75, 0.17, 0.04);
    let ring = ((x - 0.66).hypot(y * 0.85) - 0.36).hypot(z) - 0.085;
    let handle = ring.max(0.55 - around);
    wall.min(handle).max(-hollow)
}

fn colour(at: [f64; 3]) -> [f32; 3] {
    let [x, y, z] = own(at);
    let stripe = ((y + 0.08 * (6.0 * z.atan2(x)).sin()) / 0.36).rem_euclid(1.0) < 0.4;
    if stripe && x.hypot(z) > 0.6 && x.hypot(z) < 0.64 {
        [0.05, 0.18, 0.45]
    } else {
        [0.75, 0.7, 0.62]
    }
}

/// Images of one height side by side.
fn beside(parts: &[Planes<3>]) -> Planes<3> {
    let width = parts.iter().map(|part| part.extent().width).sum();
    let height = parts.first().map_or(0, |part| part.extent().height);
    let mut whole = Planes::zeros(Extent::new(width, height));
    let mut start = 0;
    for part in parts {
        for y in 0..height {
            for x in 0..part.extent().width {
                whole.set_pixel(start + x, y, part.pixel(x, y));
            }
        }
        start += part.extent().width;
    }
    whole
}

fn inner(a: &Rgb<Linear>, b: &Rgb<Linear>) -> f32 {
    let planes = a.planes().planes().into_iter().zip(b.planes().planes());
    planes
        .flat_map(|(a, b)| a.iter().zip(b))
        .map(|(a, b)| a * b)
        .sum()
}

fn brightest(image: &Rgb<Linear>) -> f32 {
    let planes = image.planes().planes();
    planes.into_iter().flatten().copied().fold(0.0, f32::max)
}
