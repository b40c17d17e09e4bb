//! Pictures of an object on a table with their truth: the same object photographed under one panorama and
//! standing in another's light.

use std::f32::consts::TAU;

use glam::{Affine3A, Vec3};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};
use rayon::prelude::*;

use relight_core::image::{ColourSpace, Extent, Linear, Planes, Rgb, Srgb};
use relight_core::light::{LightError, LightSampler, Order, Panorama};
use relight_synth::{
    GBuffer, Library, Lighting, Material, Occluder, Pose, Projection, Recipe, SyntheticScene,
    SyntheticView, stream,
};

/// Pixels of the rendering along a pixel of the picture.
const SUPERSAMPLES: u32 = 2;
/// Mean irradiance over all normals: white then has half the value that clips.
const IRRADIANCE: f32 = 0.5;
/// How far the camera looks down on the table, radians.
pub(super) const TILT: f32 = 0.5;
/// The part of the picture's side that the object takes.
const FILL: f32 = 0.55;
/// Rays by which the light on a place of the table is found.
const TABLE_RAYS: u32 = 64;
/// The albedo of a table before which edges are seen best.
const BRIGHT_TABLE: f32 = 0.9;
/// The most albedo of black paint.
const BLACK: f32 = 0.04;
/// How narrow its bands are, radians over half the object.
const BLACK_BANDS: f32 = 3.0;
/// What is drawn here: a stream that `Recipe` does not use.
const STREAM: u64 = 104;

/// An object with its photograph, and the picture into which it is to be put.
pub(super) struct Stage {
    /// Its number and its shape's name.
    pub(super) name: String,
    /// The object on another table under other light, as a camera's 8 bits have it, linear.
    pub(super) photo: Rgb<Linear>,
    /// The part of each pixel that it covers.
    pub(super) coverage: Planes<1>,
    /// The new table without the object.
    pub(super) background: Rgb<Linear>,
    /// The new light.
    pub(super) light: Panorama,
    /// The object on the new table.
    pub(super) truth: Rgb<Linear>,
    /// A nearly white table in the same light, without the object and with it.
    pub(super) bright: [Rgb<Linear>; 2],
}

/// What is made beside the objects of a recipe.
#[derive(Debug, Clone, Copy)]
pub(super) struct StageRecipe {
    pub(super) seed: u64,
    pub(super) size: u32,
    /// Whether a part of each object is painted black.
    pub(super) black_paint: bool,
}

/// The table of a picture, and what stands on it.
struct Table<'a> {
    up: Vec3,
    level: f32,
    occluder: &'a Occluder,
    size: u32,
}

/// What a light makes of a stage, before the table has its colours.
struct Lit {
    object: Planes<3>,
    mask: Planes<1>,
    /// The irradiance at each pixel's place on the table, without and with the object in the way.
    table: Vec<[Vec3; 2]>,
    /// The mean of the first.
    open: Vec3,
    pattern: Pattern,
}

/// A light around a stage.
struct Around {
    panorama: usize,
    columns: usize,
    /// As it is in the viewer's frame and in the picture's units.
    radiance: Panorama,
}

impl Stage {
    /// The stage of a number. The same seed and library make the same stages.
    pub(super) fn make(
        library: &Library,
        stage: StageRecipe,
        number: u64,
    ) -> Result<Self, LightError> {
        let StageRecipe { seed, size, .. } = stage;
        let recipe = Recipe {
            seed,
            size: size * SUPERSAMPLES,
            ..Recipe::default()
        };
        let own = stream(stream(seed, STREAM), number);
        let mut random = Pcg64::seed_from_u64(own);
        let (object, mesh) = recipe.object(library, number);
        let pose = Pose::upright(TILT, TAU * unit(&mut random), FILL);
        let placement = pose.place(&mesh, Projection::Orthographic);
        let buffer = GBuffer::render(&mesh, placement, Projection::Orthographic, recipe.size);
        let name = format!("{number:03}-{}", object.name());
        let view = SyntheticView {
            object,
            pose,
            projection: Projection::Orthographic,
            scene: SyntheticScene::shaded(buffer, Occluder::new(&mesh, placement), 16, own),
        };
        let mut material = recipe.material(library, &view, number);
        if stage.black_paint {
            paint_black(&mut material, &view.scene.buffer().object_points, own);
        }
        let occluder = Occluder::new(&mesh, placement);
        let table = Table::under(&mesh.positions, placement, &occluder, recipe.size);
        let old = Around::draw(library, &mut random)?;
        let new = Around::draw(library, &mut random)?;
        let before = table.lit(library, (&view, &material), &old, stream(own, 1));
        let after = table.lit(library, (&view, &material), &new, stream(own, 2));
        let [_, photo] = before.pictures(&before.pattern);
        let [background, truth] = after.pictures(&after.pattern);
        let bright = after.pictures(&Pattern::even(BRIGHT_TABLE));
        let small = Extent::new(size as usize, size as usize);
        let camera = |light: Planes<3>| {
            let seen = light
                .resized(small)
                .map(|v| Srgb::from_linear(v.clamp(0.0, 1.0)));
            Rgb::<Srgb>::new(seen.map(|v| (v * 255.0).round() / 255.0)).to_linear()
        };
        Ok(Self {
            name,
            photo: camera(photo),
            coverage: view.scene.buffer().mask().resized(small),
            background: camera(background),
            light: new.radiance,
            truth: camera(truth),
            bright: bright.map(camera),
        })
    }
}

impl Around {
    fn draw(library: &Library, random: &mut Pcg64) -> Result<Self, LightError> {
        let panorama = (unit(random) * library.panoramas.len() as f32) as usize;
        let panorama = panorama.min(library.panoramas.len().saturating_sub(1));
        let given = library.panoramas.get(panorama).ok_or(LightError::Empty)?;
        let columns = (unit(random) * given.extent().width as f32) as usize;
        let mean = given.project(Order::TWO).coefficients()[0]
            .iter()
            .sum::<f64>()
            / 3.0;
        // The mean irradiance is π times the mean radiance, which is the first coefficient over √(4π).
        let scale = f64::from(IRRADIANCE) * (4.0 / std::f64::consts::PI).sqrt() / mean;
        let radiance = given
            .turned(columns)
            .image()
            .planes()
            .clone()
            .map(|v| v * scale as f32);
        Ok(Self {
            panorama,
            columns,
            radiance: Panorama::new(Rgb::new(radiance))?,
        })
    }
}

impl<'a> Table<'a> {
    /// The table on which the lowest point stands.
    fn under(positions: &[Vec3], placement: Affine3A, occluder: &'a Occluder, size: u32) -> Self {
        let up = Vec3::new(0.0, TILT.cos(), TILT.sin());
        let heights = positions
            .iter()
            .map(|&p| placement.transform_point3(p).dot(up));
        let level = heights.fold(f32::INFINITY, f32::min);
        Self {
            up,
            level,
            occluder,
            size,
        }
    }

    /// Object and table in a light.
    fn lit(
        &self,
        library: &Library,
        (view, material): (&SyntheticView, &Material),
        around: &Around,
        seed: u64,
    ) -> Lit {
        let width = around.radiance.extent().width;
        let turn = f64::from(TAU) * around.columns as f64 / width as f64;
        let lighting = Lighting::of_panorama(around.panorama, turn, IRRADIANCE, true);
        let shaded = view
            .scene
            .light(material, &lighting, &library.panoramas, seed);
        let object = view.scene.buffer().planes(&shaded.image(&material.albedo));
        let mask = view.scene.buffer().mask();
        let sampler = LightSampler::new(&around.radiance);
        let side = self.size as usize;
        let table: Vec<[Vec3; 2]> = (0..side * side)
            .into_par_iter()
            .map(|at| self.lit_at(at, &sampler, seed))
            .collect();
        // What is open sends the same light everywhere: its mean has less noise.
        let open = table.iter().map(|[open, _]| *open).sum::<Vec3>() / table.len().max(1) as f32;
        Lit {
            object,
            mask,
            table,
            open,
            pattern: Pattern::of(seed),
        }
    }

    /// The irradiance at a pixel's place on the table, without and with the object in the way.
    fn lit_at(&self, at: usize, sampler: &LightSampler<'_>, seed: u64) -> [Vec3; 2] {
        let place = |at: usize| 2.0 * (at as f32 + 0.5) / self.size as f32 - 1.0;
        let (x, y) = (
            place(at % self.size as usize),
            -place(at / self.size as usize),
        );
        let z = (self.level - y * self.up.y) / self.up.z;
        let from = Vec3::new(x, y, z) + self.up * 2e-3;
        let mut random = Pcg64::seed_from_u64(stream(seed, at as u64));
        let (mut all, mut arriving) = (Vec3::ZERO, Vec3::ZERO);
        for ray in 0..TABLE_RAYS {
            let stratum = (f64::from(ray) + f64::from(unit(&mut random))) / f64::from(TABLE_RAYS);
            let drawn = sampler.draw([stratum, f64::from(unit(&mut random))]);
            let towards = Vec3::from_array(drawn.direction.components().map(|c| c as f32));
            let cosine = towards.dot(self.up);
            if cosine <= 0.0 || drawn.density <= 0.0 {
                continue;
            }
            let light = Vec3::from_array(drawn.radiance.map(|r| r as f32));
            let light = light * (cosine / (drawn.density as f32 * TABLE_RAYS as f32));
            all += light;
            if !self.occluder.blocks(from, towards, f32::INFINITY) {
                arriving += light;
            }
        }
        [all, arriving]
    }
}

impl Lit {
    /// A table with these colours, without and with the object on it.
    fn pictures(&self, pattern: &Pattern) -> [Planes<3>; 2] {
        let extent = self.mask.extent();
        let side = extent.width;
        let albedo =
            |x: usize, y: usize| pattern.at(x as f32 / side as f32, y as f32 / side as f32);
        let empty = Planes::from_fn(extent, |x, y| (albedo(x, y) * self.open).to_array());
        let full = Planes::from_fn(extent, |x, y| {
            if self.mask.pixel(x, y) == [1.0] {
                return self.object.pixel(x, y);
            }
            let [all, arriving] = self.table[y * side + x];
            let part = arriving / all.max(Vec3::splat(1e-6));
            (albedo(x, y) * self.open * part).to_array()
        });
        [empty, full]
    }
}

/// Paints about half of an object black, in bands that stick to it and are as wide as it is.
fn paint_black(material: &mut Material, points: &[Vec3], seed: u64) {
    let mut random = Pcg64::seed_from_u64(stream(seed, 11));
    let mut centred = || 2.0 * unit(&mut random) - 1.0;
    let across = Vec3::new(centred(), centred(), centred()).normalize_or(Vec3::Y);
    let phase = centred() * TAU;
    for (albedo, point) in material.albedo.iter_mut().zip(points) {
        if (point.dot(across) * BLACK_BANDS + phase).sin() > 0.0 {
            *albedo = albedo.min(Vec3::splat(BLACK));
        }
    }
}

/// A table's top: checks of two colours, or stripes.
struct Pattern {
    colours: [Vec3; 2],
    across: f32,
    down: f32,
}

impl Pattern {
    fn of(seed: u64) -> Self {
        let mut random = Pcg64::seed_from_u64(stream(seed, 9));
        let mut colour =
            || Vec3::new(unit(&mut random), unit(&mut random), unit(&mut random)) * 0.6 + 0.15;
        let first = colour();
        let second = first.lerp(colour(), 0.5);
        let mut count = |most: f32| (unit(&mut random) * most).floor();
        Self {
            colours: [first, second],
            across: count(6.0),
            down: count(6.0),
        }
    }

    /// The same grey everywhere.
    const fn even(albedo: f32) -> Self {
        Self {
            colours: [Vec3::splat(albedo); 2],
            across: 0.0,
            down: 0.0,
        }
    }

    fn at(&self, x: f32, y: f32) -> Vec3 {
        let number = (x * self.across).floor() + (y * self.down).floor();
        self.colours[usize::from(number.rem_euclid(2.0) >= 1.0)]
    }
}

/// Uniform in 0..1, 1 left out.
fn unit(random: &mut Pcg64) -> f32 {
    (random.next_u64() >> 40) as f32 / (1_u64 << 24) as f32
}
