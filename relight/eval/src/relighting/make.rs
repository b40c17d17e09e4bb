//! Making an evaluation set with the renderer of `synth`.

use std::f64::consts::TAU;
use std::fs;
use std::path::Path;

use glam::Vec3;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};
use rayon::prelude::*;
use relit_data::durable::write_whole;
use serde::{Deserialize, Serialize};

use super::method::shown;
use super::set::{FILE, Index, ObjectEntry, Part, SCHEMA, light_file, object_folder};
use crate::predictions::NO_SET;
use crate::{EvalError, EvalProgress};
use relight_core::files::write_png;
use relight_core::image::{Depth, Rgb};
use relight_core::light::Order;
use relight_synth::{
    BlinnPhong, GBuffer, Library, Lighting, Material, Recipe, SampleFolder, Shaded, stream,
};

/// Mean irradiance over all normals under each light: white then has half the value that clips.
const IRRADIANCE: f32 = 0.5;
/// Numbers of random streams that `Recipe` does not use.
const LIGHT_STREAM: u64 = 101;
const OBJECT_STREAM: u64 = 102;

/// The settings of an evaluation set. The same recipe and library make the same set.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct RelightingRecipe {
    /// How many objects; the paper has 100.
    #[serde(skip)]
    pub objects: usize,
    /// Under how many lights each; the paper has 30.
    pub lights: usize,
    /// Width and height of the images, 16..=2048 pixels.
    pub size: u32,
    /// The seed of all draws.
    pub seed: u64,
    /// Whether objects cast shadows on themselves.
    pub shadows: bool,
}

impl Default for RelightingRecipe {
    fn default() -> Self {
        Self {
            objects: 100,
            lights: 30,
            size: 128,
            seed: 0,
            shadows: true,
        }
    }
}

impl RelightingRecipe {
    fn synth(&self) -> Recipe {
        Recipe {
            seed: self.seed,
            size: self.size,
            shadows: self.shadows,
            views: 1,
            lightings: 1,
            ..Recipe::default()
        }
    }

    /// The lights: the panoramas one after the other, each time at a random angle about the vertical.
    fn lightings(&self, library: &Library) -> Vec<(String, Lighting)> {
        let lighting = |number: usize| {
            let mut random =
                Pcg64::seed_from_u64(stream(stream(self.seed, LIGHT_STREAM), number as u64));
            let panorama = number % library.panoramas.len();
            let turn = TAU * unit(&mut random);
            let name = library.panoramas.name(panorama).unwrap_or_default();
            let lighting = Lighting::from_panorama(panorama, turn, IRRADIANCE, self.shadows);
            (name.to_owned(), lighting)
        };
        (0..self.lights).map(lighting).collect()
    }

    fn about(&self, library: &Library) -> String {
        format!(
            "made by relight {}: {} objects of {} meshes and procedural shapes, {} lights of {} \
             panoramas, Blinn-Phong by Monte Carlo, {}cast shadows, {}x{} pixels, seed {}",
            env!("CARGO_PKG_VERSION"),
            self.objects,
            library.meshes.len(),
            self.lights,
            library.panoramas.len(),
            if self.shadows { "" } else { "no " },
            self.size,
            self.size,
            self.seed
        )
    }
}

/// The inputs of all objects of a folder.
#[derive(Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Origin {
    software: String,
    #[serde(flatten)]
    recipe: RelightingRecipe,
    meshes: Vec<String>,
    panoramas: Vec<String>,
}

impl Origin {
    /// The description of a set that is being made.
    const FILE: &str = "recipe.json";

    fn new(recipe: &RelightingRecipe, library: &Library) -> Self {
        Self {
            software: format!("relight {}", env!("CARGO_PKG_VERSION")),
            // More objects can be added later.
            recipe: RelightingRecipe {
                objects: 0,
                ..recipe.clone()
            },
            meshes: library.mesh_names(),
            panoramas: library.panoramas.names(),
        }
    }
}

/// Writes an evaluation set into the folder `out`, objects in parallel on rayon's threads;
/// `progress` is called for each object. Existing objects are kept: an interrupted call can be
/// repeated, also for more objects. `relighting.json` is written last.
///
/// # Errors
/// If the folder holds objects of another recipe, a setting is out of range or a file cannot be written.
pub fn make_relighting(
    recipe: &RelightingRecipe,
    library: &Library,
    out: &Path,
    progress: EvalProgress<'_>,
) -> Result<(), EvalError> {
    recipe.synth().check()?;
    let lightings = recipe.lightings(library);
    let folder = SampleFolder::open(out, Origin::FILE, &Origin::new(recipe, library))?;
    let lights = out.join("lights");
    fs::create_dir_all(&lights).map_err(EvalError::write(&lights))?;
    for (number, (_, lighting)) in lightings.iter().enumerate() {
        let path = light_file(out, number);
        let text = lighting
            .coefficients(Order::HIGHLIGHT, &library.panoramas)
            .to_string();
        write_whole(&path, text.as_bytes()).map_err(EvalError::write(&path))?;
    }
    let objects = (0..recipe.objects)
        .into_par_iter()
        .map(|number| {
            let entry = make_object(recipe, library, &lightings, &folder, number)?;
            progress(recipe.objects);
            Ok(entry)
        })
        .collect::<Result<_, EvalError>>()?;
    let index = Index {
        schema: SCHEMA.to_owned(),
        about: recipe.about(library),
        lights: lightings.into_iter().map(|(name, _)| name).collect(),
        objects,
    };
    write_json(&out.join(FILE), &index)
}

fn write_json(path: &Path, content: &impl Serialize) -> Result<(), EvalError> {
    let bytes = serde_json::to_vec_pretty(content).map_err(EvalError::file(path, NO_SET))?;
    write_whole(path, &bytes).map_err(EvalError::write(path))
}

fn make_object(
    recipe: &RelightingRecipe,
    library: &Library,
    lightings: &[(String, Lighting)],
    folder: &SampleFolder,
    number: usize,
) -> Result<ObjectEntry, EvalError> {
    let synth = recipe.synth();
    let own = stream(stream(recipe.seed, OBJECT_STREAM), number as u64);
    let mut random = Pcg64::seed_from_u64(own);
    let (object, mesh) = synth.object(library, number as u64);
    let input = (unit(&mut random) * lightings.len() as f64) as usize;
    let gloss = draw_gloss(&mut random);
    let entry = ObjectEntry {
        name: object.name(),
        input,
        reflectance: gloss.reflectance.to_array(),
        smoothness: gloss.exponent,
    };
    let name = object_folder(number);
    if folder.has(&name) {
        return Ok(entry);
    }
    let view = synth.view(&object, &mesh, number as u64);
    let material = synth.material(library, &view, number as u64);
    let material = Material {
        gloss: Some(gloss),
        ..material
    };
    folder.write(&name, |place| {
        write_truth(view.scene.buffer(), &material, place)?;
        for (light, (_, lighting)) in lightings.iter().enumerate() {
            let seed = stream(own, light as u64);
            let shaded = view
                .scene
                .light(&material, lighting, &library.panoramas, seed);
            write_images(view.scene.buffer(), &material, &shaded, light, place)?;
        }
        Ok::<_, EvalError>(())
    })?;
    Ok(entry)
}

/// White highlights of every width; a sharper one is brighter, as it gathers the same light.
fn draw_gloss(random: &mut Pcg64) -> BlinnPhong {
    let exponent = (5.0_f64.ln() + (150.0_f64 / 5.0).ln() * unit(random)).exp();
    let strength = (0.05 + 0.45 * unit(random)) * ((exponent + 8.0) / 16.0).min(4.0);
    BlinnPhong {
        reflectance: Vec3::splat(strength as f32),
        exponent: exponent as f32,
    }
}

fn write_truth(buffer: &GBuffer, material: &Material, folder: &Path) -> Result<(), EvalError> {
    let extent = buffer.mask().extent();
    let mask = relight_core::image::Planes::from_planes(
        extent,
        [0, 1, 2].map(|_| buffer.mask().plane(0).to_vec()),
    )?;
    write_png(&folder.join("mask.png"), &mask, Depth::Eight)?;
    buffer
        .normal_map(&material.normals)
        .write_png(&folder.join("normal.png"), Depth::Sixteen)?;
    let albedo = buffer.planes(&material.albedo);
    write_png(&folder.join("albedo.png"), &albedo, Depth::Sixteen)?;
    Ok(())
}

fn write_images(
    buffer: &GBuffer,
    material: &Material,
    shaded: &Shaded,
    light: usize,
    folder: &Path,
) -> Result<(), EvalError> {
    let full = shaded.image(&material.albedo);
    let products = material.albedo.iter().zip(&shaded.shading);
    let diffuse: Vec<Vec3> = products
        .map(|(albedo, shading)| *albedo * *shading)
        .collect();
    for (part, values) in [(Part::Diffuse, diffuse), (Part::Full, full)] {
        let image = shown(Rgb::new(buffer.planes(&values)));
        write_png(&folder.join(part.file(light)), &image, Depth::Eight)?;
    }
    Ok(())
}

/// Uniform in 0..1, 1 left out.
fn unit(random: &mut Pcg64) -> f64 {
    (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
}
