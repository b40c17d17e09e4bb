//! From a picture under a mask to its layers and its light.

use std::path::Path;

use super::answer::{Engine, Fields, Looks, MapsNet, Whole, details, to_maps};
use super::compose::{ComposedLayers, normalised, possible_highlight};
use super::encoding::AnsweredMaps;
use super::error::DecomposeError;
use super::gloss::{FittedGloss, fit_gloss};
use super::other::OtherNormals;
use super::region::{Region, cut_out, enlarged, inside};
use crate::image::{ColourSpace, Extent, Linear, Planes, Rgb, Srgb};
use crate::light::{Normals, ShLight, YUp};
use crate::nets::{Inference, NetError, Weights, decomposer};
use crate::render::{DiffuseForm, DiffuseLayer, NormalsFrame, fit_light};

/// Width and height of the picture that the network sees.
pub const WORKING_SIDE: usize = 256;
/// A picture is looked at for highlights where a larger part of its pixels is saturated, as in the paper.
const SATURATED_PART: f64 = 0.05;
/// Keeps the light from behind, which normals hardly tell, small: see [`fit_light`].
const STIFFNESS: f64 = 1e-3;

/// At which size a picture is decomposed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum WorkingSize {
    /// At the network's: its maps are enlarged to the picture's size.
    #[default]
    Network,
    /// At the network's, and what is finer by tiles of the picture at its own size.
    Native,
}

/// Whether highlights are separated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SpecularGate {
    /// Where more than 5 % of the object's pixels are saturated.
    #[default]
    Auto,
    /// Always.
    On,
    /// Never.
    Off,
}

/// How a picture is decomposed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DecomposeOptions {
    /// At which size.
    pub size: WorkingSize,
    /// Whether the mirror image is looked at too, and the mean of both answers taken: at half the network's size, and of
    /// tiles.
    pub mirror: bool,
    /// Whether highlights are separated.
    pub specular: SpecularGate,
    /// Light from which on a channel counts as saturated; a pixel is, where all three are.
    pub saturated_from: f32,
    /// The part of the object's pixels that are saturated, where it is known from a larger picture;
    /// else it is counted.
    pub saturated_fraction: Option<f64>,
}

impl Default for DecomposeOptions {
    fn default() -> Self {
        Self {
            size: WorkingSize::default(),
            mirror: true,
            specular: SpecularGate::default(),
            saturated_from: Srgb::to_linear(SATURATED_VALUE),
            saturated_fraction: None,
        }
    }
}

/// The value in a file from which on a channel counts as saturated: 250 of 255, less rounding.
pub(super) const SATURATED_VALUE: f32 = 249.5 / 255.0;

/// A picture in layers, I = R S + H, with its normals and light. Everything is as large as the picture
/// and 0 outside the mask.
#[derive(Debug, Clone, PartialEq)]
pub struct Decomposition {
    /// The normals.
    pub normals: Normals<YUp>,
    /// The albedo R, in such units that the mean shading is 1.
    pub albedo: Rgb<Linear>,
    /// The shading S, grey, mean 1 under the mask.
    pub shading: Planes<1>,
    /// R S.
    pub diffuse: Rgb<Linear>,
    /// The highlight H, grey; 0 where none was separated.
    pub highlight: Planes<1>,
    /// The light of order 2 whose irradiance on the normals is nearest to the shading: grey, as the
    /// shading is. The colour of the light is part of the albedo.
    pub light: ShLight,
    /// The gloss of the whole object, where a highlight was separated and the light explains it.
    pub gloss: Option<FittedGloss>,
    /// Where in the picture the network looked.
    pub region: Region,
    /// Whether highlights were separated.
    pub is_glossy: bool,
    /// The part of the object's pixels that are saturated.
    pub saturated_fraction: f64,
    /// How far R S + H is from the picture: the root mean square of the rest over that of the picture.
    pub residual: f64,
    /// How far the light's irradiance is from the shading, in the same way.
    pub light_residual: f64,
}

/// Decomposes pictures: the network, ready to be run.
///
/// ```
/// use relight::decompose::{DecomposeOptions, Decomposer};
/// use relight::image::{Extent, Planes, Rgb};
/// use relight::nets::{Weights, decomposer};
///
/// let weights = Weights::initial(&decomposer(), 1); // not trained: Decomposer::shipped() is
/// let decomposer = Decomposer::with_side(&weights, 32)?;
/// let picture = Rgb::new(Planes::filled(Extent::new(60, 40), [0.5, 0.4, 0.3]));
/// let mask = Planes::filled(Extent::new(60, 40), [1.0]);
/// let found = decomposer.decompose(&picture, &mask, &DecomposeOptions::default())?;
/// assert_eq!(found.normals.extent(), Extent::new(60, 40));
/// assert!(found.residual < 0.5);
/// # Ok::<(), relight::decompose::DecomposeError>(())
/// ```
pub struct Decomposer {
    looks: Looks,
    normals: Option<OtherNormals>,
}

impl std::fmt::Debug for Decomposer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Decomposer")
            .field("side", &self.side())
            .field("normals", &self.normals)
            .finish()
    }
}

impl Decomposer {
    /// The network with these weights, for pictures of [`WORKING_SIDE`].
    ///
    /// # Errors
    /// Where the weights are not this network's.
    pub fn new(weights: &Weights) -> Result<Self, DecomposeError> {
        Self::with_side(weights, WORKING_SIDE)
    }

    /// The network with the weights that come with the program.
    ///
    /// # Errors
    /// [`DecomposeError::NoWeights`] where it was built without.
    pub fn shipped() -> Result<Self, DecomposeError> {
        let bytes = super::shipped::WEIGHTS.ok_or(DecomposeError::NoWeights)?;
        let weights = Weights::from_bytes(bytes).map_err(|fault| NetError::File {
            path: super::shipped::NAME.into(),
            fault,
        })?;
        Self::new(&weights)
    }

    /// The network with these weights, for pictures of `side` x `side` pixels, a multiple of 32.
    ///
    /// # Errors
    /// Where the weights are not this network's, or it cannot take such pictures.
    pub fn with_side(weights: &Weights, side: usize) -> Result<Self, DecomposeError> {
        let graph = decomposer();
        let look = |side: usize| -> Result<Box<dyn MapsNet>, NetError> {
            let inference = Inference::new(&graph, weights, (side, side))?;
            Ok(Box::new(Engine { inference, side }))
        };
        let has_half = side.is_multiple_of(2 * graph.multiple());
        let half = || has_half.then(|| look(side / 2)).transpose();
        let (full, half) = rayon::join(|| look(side), half);
        Ok(Self::of(full?, half?))
    }

    pub(super) fn of(full: Box<dyn MapsNet>, half: Option<Box<dyn MapsNet>>) -> Self {
        Self {
            looks: Looks { full, half },
            normals: None,
        }
    }

    /// Takes the normals of another network from now on, in an ONNX file. It takes one picture,
    /// 1 x 3 x side x side, (x - 0.5) / 0.5 of the sRGB values x, 0 outside the mask; and answers with
    /// 1 x 3 x side x side, vectors of any length, or with 1 x 2 x side x side, slopes (p, q) of normals
    /// (p, q, 1).
    ///
    /// # Errors
    /// Where the file cannot be read or run, or answers something else; then all stays as it was.
    pub fn set_normals(&mut self, path: &Path, frame: NormalsFrame) -> Result<(), DecomposeError> {
        self.normals = Some(OtherNormals::read(path, self.side(), frame)?);
        Ok(())
    }

    /// Width and height of what the network sees, pixels.
    #[must_use]
    pub fn side(&self) -> usize {
        self.looks.full.side()
    }

    /// Decomposes a picture under a mask, which is the object where it is at least one half. Values
    /// of the picture that are negative or no numbers count as black.
    ///
    /// # Errors
    /// Where the mask has another size or is empty, or the network fails.
    pub fn decompose(
        &self,
        picture: &Rgb<Linear>,
        mask: &Planes<1>,
        options: &DecomposeOptions,
    ) -> Result<Decomposition, DecomposeError> {
        let (extent, expected) = (mask.extent(), picture.planes().extent());
        if extent != expected {
            return Err(DecomposeError::MaskSize {
                found: extent,
                expected,
            });
        }
        let region = Region::around(mask).ok_or(DecomposeError::EmptyMask)?;
        let mask = region.cut(mask).map(|m| f32::from(u8::from(m >= 0.5)));
        let picture = region.cut(picture.planes()).map(usable);
        let picture = cut_out(&picture, &mask);
        let under = inside(&mask);
        let saturated_fraction = options
            .saturated_fraction
            .unwrap_or_else(|| saturated(&picture, &under, options.saturated_from));
        let is_glossy = match options.specular {
            SpecularGate::Auto => saturated_fraction > SATURATED_PART,
            SpecularGate::On => true,
            SpecularGate::Off => false,
        };
        let whole = Whole::new(&self.looks, &picture, &mask, options.mirror)?;
        let explained = self.explain(&whole, is_glossy)?;
        let mut maps = self.maps(&whole, &picture, &mask, options)?;
        if self.normals.is_some() {
            let known = inside(&whole.mask);
            let vectors = enlarged(explained.normals.planes(), &known, region.extent());
            maps.normals = Normals::new(cut_out(&vectors, &mask));
        }
        let layers = ComposedLayers::new(&picture, &under, &maps, is_glossy);
        let residual = layers.residual(&picture, &under);
        let normals = region.put_back(maps.normals.planes(), extent);
        Ok(Decomposition {
            normals: Normals::new(normals),
            albedo: Rgb::new(region.put_back(&layers.albedo, extent)),
            shading: region.put_back(&layers.shading, extent),
            diffuse: Rgb::new(region.put_back(&layers.diffuse, extent)),
            highlight: region.put_back(&layers.highlight, extent),
            light: explained.light,
            gloss: explained.gloss,
            region,
            is_glossy,
            saturated_fraction,
            residual,
            light_residual: explained.light_residual,
        })
    }

    /// The maps at the picture's own size.
    fn maps(
        &self,
        whole: &Whole,
        picture: &Planes<3>,
        mask: &Planes<1>,
        options: &DecomposeOptions,
    ) -> Result<AnsweredMaps, DecomposeError> {
        let extent = picture.extent();
        let mut fields = enlarged(&whole.fields, &inside(&whole.mask), extent);
        if options.size == WorkingSize::Native && extent.width > self.side() {
            add(
                &mut fields,
                &details(self.looks.full.as_ref(), picture, mask, options.mirror)?,
            );
        }
        Ok(to_maps(&fields, &inside(mask)))
    }

    /// Normals, light and gloss at the network's size.
    fn explain(&self, whole: &Whole, is_glossy: bool) -> Result<Explained, DecomposeError> {
        let known = inside(&whole.mask);
        let maps = to_maps(&whole.fields, &known);
        let others = match &self.normals {
            Some(other) => other.run(&whole.picture, &known)?,
            None => None,
        };
        let normals = others.unwrap_or(maps.normals);
        let shading = normalised(&maps.shading, &known);
        let light = fit_light(&normals, &grey(&shading), &known, STIFFNESS)?;
        let lit = DiffuseLayer::new(&light, DiffuseForm::Irradiance).shading(&normals);
        let gloss = if is_glossy {
            let highlight = possible_highlight(&whole.picture, &known, &maps.highlight);
            fit_gloss(&light, &normals, &highlight)?
        } else {
            None
        };
        Ok(Explained {
            light_residual: relative_difference(lit.planes().plane(0), shading.plane(0)),
            normals,
            light,
            gloss,
        })
    }
}

/// What is told of the object as a whole.
struct Explained {
    normals: Normals<YUp>,
    light: ShLight,
    light_residual: f64,
    gloss: Option<FittedGloss>,
}

/// A value as light: black where it is negative or no number.
fn usable(value: f32) -> f32 {
    if value.is_finite() {
        value.max(0.0)
    } else {
        0.0
    }
}

/// The part of the pixels under the mask of which all channels have at least so much light.
fn saturated(picture: &Planes<3>, mask: &[bool], from: f32) -> f64 {
    let [red, green, blue] = picture.planes();
    let (mut all, mut full) = (0_u64, 0_u64);
    for at in (0..mask.len()).filter(|&at| mask[at]) {
        all += 1;
        full += u64::from(red[at].min(green[at]).min(blue[at]) >= from);
    }
    full as f64 / all.max(1) as f64
}

fn add(fields: &mut Fields, details: &Fields) {
    for (to, from) in fields.planes_mut().into_iter().zip(details.planes()) {
        for (to, from) in to.iter_mut().zip(from) {
            *to += from;
        }
    }
}

/// A colour image of one plane.
pub(super) fn grey(plane: &Planes<1>) -> Rgb<Linear> {
    let Extent { width, .. } = plane.extent();
    let values = plane.plane(0);
    Rgb::new(Planes::from_fn(plane.extent(), |x, y| {
        [values[y * width + x]; 3]
    }))
}

/// The root mean square of the difference over that of `b`.
fn relative_difference(a: &[f32], b: &[f32]) -> f64 {
    let square = |v: f32| f64::from(v).powi(2);
    let difference: f64 = a.iter().zip(b).map(|(&a, &b)| square(a - b)).sum();
    let all: f64 = b.iter().map(|&b| square(b)).sum();
    if all > 0.0 {
        (difference / all).sqrt()
    } else {
        0.0
    }
}
