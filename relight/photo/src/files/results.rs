//! The files of a decomposition: a folder that appears when it is complete.

use std::path::Path;

use relit_data::durable::write_whole;
use serde::Serialize;

use crate::decompose::{
    CropSquare, DecomposeError, DecomposeOptions, Decomposition, MaskSource, Photo, SpecularGate,
};
use relight_core::files::ResultFolder;
use relight_core::files::{write_png, write_png_of};
use relight_core::image::{ColourSpace, Depth, Extent, ImageError, Linear, Planes, Rgb, Srgb};
use relight_core::light::{Normals, Panorama};
use relight_core::parallel;
use relight_core::render::{DiffuseForm, DiffuseLayer, exposure_for};
use relit_data::statistics::above_part;

/// The file of figures.
pub(super) const FIGURES: &str = "decomposition.json";
/// All files of a decomposition.
const FILES: [&str; 11] = [
    "normal.png",
    "albedo.png",
    "shading.png",
    "diffuse.png",
    "specular.png",
    "light.txt",
    "light-sphere.png",
    "light-panorama.exr",
    "mask.png",
    "contact.png",
    FIGURES,
];
const RESULTS: ResultFolder = ResultFolder {
    marker: FIGURES,
    holds: |name| FILES.contains(&name),
};
/// Its schema.
const SCHEMA: &str = "relight.decomposition/1";
/// Width and height of the lit ball, and of the pictures of the sheet, pixels.
const TILE: usize = 256;
/// The panorama's size, pixels.
const PANORAMA: Extent = Extent::new(256, 128);
/// Pictures in a row of the sheet.
const COLUMNS: usize = 4;
/// On the sheet, the part of the values that is brighter than white.
const BEYOND_WHITE: f64 = 0.005;

/// The figures of a decomposition, as `decomposition.json` holds them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DecompositionFigures {
    schema: &'static str,
    software: String,
    photo: String,
    weights: String,
    size: [usize; 2],
    region: CropSquare,
    working_size: &'static str,
    mirrored: bool,
    mask: FigureMask,
    specular: FigureSpecular,
    transfer: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    scale: Option<f32>,
    white: FigureWhites,
    light: FigureLight,
    residual: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
struct FigureMask {
    source: MaskSource,
    pixels: usize,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
struct FigureSpecular {
    setting: &'static str,
    saturated_fraction: f64,
    separated: bool,
    reflectance: Option<f32>,
    smoothness: Option<f32>,
    residual: Option<f64>,
}

/// The light that the largest value of a file stands for.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
struct FigureWhites {
    albedo: f32,
    shading: f32,
    diffuse: f32,
    specular: f32,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
struct FigureLight {
    order: usize,
    coefficients: Vec<[f64; 3]>,
    residual: f64,
}

/// A decomposition with its inputs, ready to be written.
#[derive(Debug, Clone, Copy)]
pub struct DecompositionFiles<'a> {
    /// The photograph.
    pub photo: &'a Photo,
    /// What was found.
    pub found: &'a Decomposition,
    /// How.
    pub options: &'a DecomposeOptions,
    /// How the weights are named.
    pub weights: &'a str,
}

impl DecompositionFiles<'_> {
    /// Writes all files into the folder `out`, which appears when they are complete. An earlier
    /// decomposition in it is replaced.
    ///
    /// # Errors
    /// As [`Self::check`], or if a file cannot be written: then the folder is as it was.
    pub fn write(&self, out: &Path) -> Result<DecompositionFigures, DecomposeError> {
        RESULTS.write(out, |folder| self.write_files(folder))
    }

    /// Whether a decomposition may be written to the folder `out`: it is missing, empty, or holds the files of an
    /// earlier decomposition and nothing else.
    ///
    /// # Errors
    /// If it holds something else, is not a folder, or cannot be read.
    pub fn check(out: &Path) -> Result<(), DecomposeError> {
        Ok(RESULTS.check(out)?)
    }

    fn write_files(&self, folder: &Path) -> Result<DecompositionFigures, DecomposeError> {
        let found = self.found;
        let path = |name: &str| folder.join(name);
        // Two at a time: each is in memory as it will stand in its file.
        let normals = || found.normals.write_png(&path("normal.png"), Depth::Sixteen);
        let albedo = || write_light(&path("albedo.png"), &found.albedo);
        let shading = || write_grey(&path("shading.png"), &found.shading);
        let diffuse = || write_light(&path("diffuse.png"), &found.diffuse);
        let specular = || write_grey(&path("specular.png"), &found.highlight);
        let (normals, albedo) = parallel::join(normals, albedo);
        normals?;
        let (shading, diffuse) = parallel::join(shading, diffuse);
        let (specular, mask) = parallel::join(specular, || self.write_mask(&path("mask.png")));
        mask?;
        let white = FigureWhites {
            albedo: albedo?,
            shading: shading?,
            diffuse: diffuse?,
            specular: specular?,
        };
        let light = || self.write_light(folder);
        let sheet = || {
            write_png(&path("contact.png"), &self.sheet()?, Depth::Eight)?;
            Ok::<_, DecomposeError>(())
        };
        let (light, sheet) = parallel::join(light, sheet);
        light?;
        sheet?;
        let figures = self.figures(white);
        let mut json = serde_json::to_vec_pretty(&figures).unwrap_or_default();
        json.push(b'\n');
        let file = path(FIGURES);
        write_whole(&file, &json).map_err(DecomposeError::write(&file))?;
        Ok(figures)
    }

    /// The light, as coefficients, on a ball and all around.
    fn write_light(&self, folder: &Path) -> Result<(), DecomposeError> {
        let light = &self.found.light;
        light.write(&folder.join("light.txt"))?;
        ball(self.found)
            .encode::<Srgb>()
            .write_png(&folder.join("light-sphere.png"))?;
        let panorama = Panorama::from_light(light, PANORAMA)
            .image()
            .planes()
            .clone();
        Rgb::<Linear>::new(panorama.map(|value| value.max(0.0)))
            .write_exr(&folder.join("light-panorama.exr"))?;
        Ok(())
    }

    fn write_mask(&self, path: &Path) -> Result<(), ImageError> {
        let mask = self.photo.mask.plane(0);
        write_png_of(path, self.photo.mask.extent(), Depth::Eight, |at| {
            [mask[at]; 3]
        })
    }

    fn figures(&self, white: FigureWhites) -> DecompositionFigures {
        let Self {
            photo,
            found,
            options,
            weights,
        } = *self;
        let gloss = found.gloss;
        let Extent { width, height } = found.normals.extent();
        DecompositionFigures {
            schema: SCHEMA,
            software: format!("relight {}", env!("CARGO_PKG_VERSION")),
            photo: photo.name.clone(),
            weights: weights.to_owned(),
            size: [width, height],
            region: found.region,
            working_size: "network",
            mirrored: options.mirror,
            mask: FigureMask {
                source: photo.mask_source,
                pixels: photo.mask.plane(0).iter().filter(|&&m| m >= 0.5).count(),
            },
            specular: FigureSpecular {
                setting: match options.specular {
                    SpecularGate::Auto => "auto",
                    SpecularGate::On => "on",
                    SpecularGate::Off => "off",
                },
                saturated_fraction: found.saturated_fraction,
                separated: found.is_glossy,
                reflectance: gloss.map(|gloss| gloss.reflectance),
                smoothness: gloss.map(|gloss| gloss.smoothness),
                residual: gloss.map(|gloss| gloss.residual),
            },
            transfer: "srgb",
            scale: (photo.scale != 1.0).then_some(photo.scale),
            white,
            light: FigureLight {
                order: found.light.order().get(),
                coefficients: found.light.coefficients().to_vec(),
                residual: found.light_residual,
            },
            residual: found.residual,
        }
    }

    /// One sheet: the photograph, normals, albedo and shading; the diffuse part, the highlight, a ball in
    /// the light, and the shading that this light makes on the normals.
    fn sheet(&self) -> Result<Planes<3>, DecomposeError> {
        let (found, mask) = (self.found, &self.photo.mask);
        let picture = self.photo.picture.planes();
        let (albedo, diffuse) = (found.albedo.planes(), found.diffuse.planes());
        let region = &found.region;
        let lit = {
            let layer = DiffuseLayer::new(&found.light, DiffuseForm::Irradiance);
            region.resized(layer.shading(&found.normals).planes(), square())
        };
        // The layers are shown as bright as the photograph, whose values are light of a screen.
        let own = bright(picture, mask).max(1.0);
        let white = bright(&found.shading, mask);
        let shown = |tile: Planes<3>, white: f32| {
            tile.map(|value| Srgb::from_linear((value / white).clamp(0.0, 1.0)))
        };
        let colour = |planes: &Planes<3>, white| shown(region.resized(planes, square()), white);
        let grey =
            |planes: &Planes<1>, white| shown(region.resized(planes, square()).in_colour(), white);
        let tiles = [
            colour(picture, own),
            region.resized(&found.normals.to_colours(), square()),
            colour(albedo, bright(albedo, mask)),
            grey(&found.shading, white),
            colour(diffuse, own),
            grey(&found.highlight, own),
            ball(found).encode::<Srgb>().into_planes(),
            shown(lit, white),
        ];
        Ok(Planes::sheet(&tiles, COLUMNS)?)
    }
}

fn square() -> Extent {
    Extent::new(TILE, TILE)
}

/// A white ball in the light, as bright as the light allows.
fn ball(found: &Decomposition) -> Rgb<Linear> {
    let layer = DiffuseLayer::new(&found.light, DiffuseForm::Irradiance);
    let exposure = exposure_for(&found.light);
    let shading = layer.shading(&Normals::sphere(TILE)).into_planes();
    Rgb::new(shading.map(|value| value * exposure))
}

/// Writes light as a PNG of 16 bits, sRGB; the light that its largest value stands for.
pub fn write_light(path: &Path, light: &Rgb<Linear>) -> Result<f32, ImageError> {
    let white = white_of(light.planes());
    let planes = light.planes().planes();
    write_png_of(path, light.planes().extent(), Depth::Sixteen, |at| {
        planes.map(|plane| Srgb::from_linear(plane[at] / white))
    })?;
    Ok(white)
}

/// The same of grey light.
fn write_grey(path: &Path, light: &Planes<1>) -> Result<f32, ImageError> {
    let white = white_of(light);
    let plane = light.plane(0);
    write_png_of(path, light.extent(), Depth::Sixteen, |at| {
        [Srgb::from_linear(plane[at] / white); 3]
    })?;
    Ok(white)
}

/// The light of the largest value of a file: 1 if everything fits, so that files can be compared.
fn white_of<const C: usize>(light: &Planes<C>) -> f32 {
    let values = light.planes().into_iter().flatten();
    values.fold(1.0_f32, |a, &b| a.max(b))
}

/// The value that one in two hundred under the mask exceeds; 1 where all is dark.
pub fn bright<const C: usize>(planes: &Planes<C>, mask: &Planes<1>) -> f32 {
    let pixels = planes.brightest().zip(mask.plane(0));
    let values = pixels.filter_map(|(value, &mask)| (mask >= 0.5).then_some(value));
    let value = above_part(values, 1.0 - BEYOND_WHITE);
    value.filter(|value| *value > 0.0).unwrap_or(1.0)
}
