//! From a picture under a mask to its layers and its light.

use super::compose::{normalised, possible_highlight};
use super::crop::{CropSquare, Window, cut_out, inside};
use super::error::DecomposeError;
use super::gloss::{FittedGloss, fit_gloss};
use super::light::light_of_shading;
use super::network_output::{MapNetwork, PhotoPrediction, Scales, to_maps};
use super::tiled_compose::{LayerPlan, MapUpscaler};
use crate::nets::{Inference, LIGHT_PARAMETERS, NetError, Weights, decomposer_of};
use relight_core::image::{ColourSpace, Extent, Linear, Planes, Rgb, Srgb};
use relight_core::light::{Normals, ShLight};
use relight_core::parallel;
use relight_core::render::{DiffuseForm, DiffuseLayer};
use relit_data::image_stats::SATURATED_VALUE;
use relit_data::mask::size_hint;
use relit_data::spec_net_gate::{self, SPEC_NET_GATE};

/// Most pixels of a photograph: 16 million take 1.3 GB of memory, so these more than 5 GB.
pub const MAX_PIXELS: usize = 64_000_000;
/// Width and height of the picture that the network sees.
pub const WORKING_SIDE: usize = 256;
/// The factor that tilts normals before light is fitted to them: the network's are slightly flatter than the true ones.
/// Measured on synthetic objects (docs/results/decomposition.md).
const TILT: f32 = 1.1;

/// Whether highlights are separated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SpecularGate {
    /// Where a larger fraction of the object's pixels is saturated than [`SPEC_NET_GATE`].
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
    /// Whether the network sees the mirror image too, and the mean of both answers is taken, at the coarse
    /// scale.
    pub mirror: bool,
    /// Whether highlights are separated.
    pub specular: SpecularGate,
    /// Light from which on a channel counts as saturated; a pixel is, where all three are.
    pub saturated_from: f32,
}

impl Default for DecomposeOptions {
    fn default() -> Self {
        Self {
            mirror: true,
            specular: SpecularGate::default(),
            saturated_from: Srgb::to_linear(SATURATED_VALUE),
        }
    }
}

/// A picture in layers, I = R S + H, with its normals and light. Everything is as large as the picture
/// and 0 outside the mask.
#[derive(Debug, Clone, PartialEq)]
pub struct Decomposition {
    /// The normals.
    pub normals: Normals,
    /// The albedo R, in such units that the mean shading is 1.
    pub albedo: Rgb<Linear>,
    /// The shading S, grey, mean 1 under the mask.
    pub shading: Planes<1>,
    /// R S.
    pub diffuse: Rgb<Linear>,
    /// The highlight H, grey; 0 where none was separated.
    pub highlight: Planes<1>,
    /// The light of order 2 around the object, from its shading and the network's prediction: grey, as the
    /// shading is. The colour of the light is part of the albedo.
    pub light: ShLight,
    /// The light of order 2 whose irradiance on the normals is nearest to the shading, without the network's prediction. Its
    /// direction is less certain, but it has the light that reaches the object: relighting starts from it.
    pub shading_light: ShLight,
    /// The gloss of the whole object, where a highlight was separated and [`Self::shading_light`] explains it.
    pub gloss: Option<FittedGloss>,
    /// The square of the picture that the network saw.
    pub region: CropSquare,
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
/// use relight_photo::decompose::{DecomposeOptions, Decomposer};
/// use relight_core::image::{Extent, Planes, Rgb};
/// use relight_photo::nets::{Weights, decomposer};
///
/// let weights = Weights::initial(&decomposer(), 1); // not trained
/// let decomposer = Decomposer::with_side(&weights, 32)?;
/// let picture = Rgb::new(Planes::filled(Extent::new(60, 40), [0.5, 0.4, 0.3]));
/// let mask = Planes::filled(Extent::new(60, 40), [1.0]);
/// let found = decomposer.decompose(&picture, &mask, &DecomposeOptions::default())?;
/// assert_eq!(found.normals.extent(), Extent::new(60, 40));
/// assert!(found.residual < 0.5);
/// # Ok::<(), relight_photo::decompose::DecomposeError>(())
/// ```
pub struct Decomposer {
    scales: Scales,
}

impl std::fmt::Debug for Decomposer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Decomposer")
            .field("side", &self.side())
            .finish_non_exhaustive()
    }
}

impl Decomposer {
    /// The network with these weights, for pictures of [`WORKING_SIDE`].
    ///
    /// # Errors
    /// If the weights are not this network's.
    pub fn new(weights: &Weights) -> Result<Self, DecomposeError> {
        Self::with_side(weights, WORKING_SIDE)
    }

    /// The network with these weights, for pictures of `side` x `side` pixels, a multiple of 32.
    ///
    /// # Errors
    /// If the weights are not this network's, or it cannot take such pictures.
    pub fn with_side(weights: &Weights, side: usize) -> Result<Self, DecomposeError> {
        let graph = decomposer_of(weights);
        let net = |weights: &Weights, side: usize| -> Result<MapNetwork, NetError> {
            let graph = decomposer_of(weights);
            let inference = Inference::new(&graph, weights, (side, side))?;
            Ok(MapNetwork::new(inference, side))
        };
        let has_coarse = side.is_multiple_of(2 * graph.multiple());
        let coarse = || has_coarse.then(|| net(weights, side / 2)).transpose();
        // The light is told at the coarse scale, and each head takes its time to be prepared.
        let fine = || {
            if has_coarse {
                net(&weights.without(LIGHT_PARAMETERS), side)
            } else {
                net(weights, side)
            }
        };
        let (fine, coarse) = parallel::join(fine, coarse);
        Ok(Self::from_nets(fine?, coarse?))
    }

    pub(super) fn from_nets(fine: MapNetwork, coarse: Option<MapNetwork>) -> Self {
        Self {
            scales: Scales { fine, coarse },
        }
    }

    /// Width and height of what the network sees, pixels.
    pub fn side(&self) -> usize {
        self.scales.fine.side
    }

    /// Decomposes a picture under a mask, which is the object where it is at least one half. Values
    /// of the picture that are negative or no numbers count as black.
    ///
    /// # Errors
    /// If the mask has another size or is empty, the picture is black under it or has more than [`MAX_PIXELS`], or the
    /// network fails.
    pub fn decompose(
        &self,
        picture: &Rgb<Linear>,
        mask: &Planes<1>,
        options: &DecomposeOptions,
    ) -> Result<Decomposition, DecomposeError> {
        let extent = picture.planes().extent();
        check_mask_size(mask.extent(), extent)?;
        let object = CutObject::new(picture, mask)?;
        let saturated_fraction = object.saturated(options.saturated_from);
        let is_glossy = match options.specular {
            SpecularGate::Auto => spec_net_gate::opens(saturated_fraction, SPEC_NET_GATE),
            SpecularGate::On => true,
            SpecularGate::Off => false,
        };
        let (region, window) = (object.region, object.window);
        let part = region.part(&window);
        let whole = PhotoPrediction::new(
            &self.scales,
            &object.picture,
            &object.mask,
            &part,
            options.mirror,
        )?;
        let fitted = FittedLight::new(&whole, is_glossy)?;
        let maps = MapUpscaler::new(&whole.fields, &whole.mask, part);
        let CutObject {
            picture,
            inside,
            mask,
            ..
        } = object;
        // Of large photographs every plane counts.
        drop(mask);
        let plan = LayerPlan {
            picture: &picture,
            inside: &inside,
            window,
        };
        let mut found = Decomposition {
            normals: Normals::new(Planes::zeros(Extent::new(0, 0))),
            albedo: Rgb::new(Planes::zeros(extent)),
            shading: Planes::zeros(extent),
            diffuse: Rgb::new(Planes::zeros(extent)),
            highlight: Planes::zeros(extent),
            light: fitted.light,
            shading_light: fitted.shading_light,
            gloss: fitted.gloss,
            region,
            is_glossy,
            saturated_fraction,
            residual: 0.0,
            light_residual: fitted.light_residual,
        };
        plan.compose(&maps, &mut found)?;
        Ok(found)
    }
}

/// An object cut out of its photograph.
struct CutObject {
    /// The square that the network sees.
    region: CropSquare,
    /// Where in the photograph these pixels are.
    window: Window,
    /// Light, 0 outside the mask.
    picture: Planes<3>,
    /// 0 or 1.
    mask: Planes<1>,
    /// The same.
    inside: Vec<bool>,
}

impl CutObject {
    fn new(picture: &Rgb<Linear>, mask: &Planes<1>) -> Result<Self, DecomposeError> {
        let region = CropSquare::around(mask).ok_or(DecomposeError::EmptyMask)?;
        let window = Window::around(mask).ok_or(DecomposeError::EmptyMask)?;
        check_size(mask.extent())?;
        let mask = window.cut(mask).map(|m| f32::from(u8::from(m >= 0.5)));
        let picture = cut_out(window.cut(picture.planes()).map(usable), &mask);
        if !picture.planes().into_iter().flatten().any(|&v| v > 0.0) {
            let fault = "the object is black: give a brighter photograph, or another mask";
            return Err(DecomposeError::Photo(fault.to_owned()));
        }
        Ok(Self {
            region,
            window,
            picture,
            inside: inside(&mask),
            mask,
        })
    }

    /// The part of the pixels under the mask whose channels all have at least so much light.
    fn saturated(&self, from: f32) -> f64 {
        let [red, green, blue] = self.picture.planes();
        let (mut all, mut full) = (0_u64, 0_u64);
        for at in (0..self.inside.len()).filter(|&at| self.inside[at]) {
            all += 1;
            full += u64::from(red[at].min(green[at]).min(blue[at]) >= from);
        }
        full as f64 / all.max(1) as f64
    }
}

/// Whether there is memory for the layers of so many pixels.
pub(super) fn check_size(extent: Extent) -> Result<(), DecomposeError> {
    if extent.width.saturating_mul(extent.height) > MAX_PIXELS {
        return Err(DecomposeError::Photo(format!(
            "the photograph has {} x {} pixels; the limit is {MAX_PIXELS}: make it smaller",
            extent.width, extent.height
        )));
    }
    Ok(())
}

/// Whether a mask has the size of its photograph.
pub(super) fn check_mask_size(found: Extent, expected: Extent) -> Result<(), DecomposeError> {
    if found == expected {
        return Ok(());
    }
    let hint = size_hint(found.sides().into(), expected.sides().into());
    let hint = hint.map_or_else(String::new, |hint| format!(": {hint}"));
    Err(DecomposeError::Photo(format!(
        "the mask has {} x {} pixels, and the photograph {} x {}{hint}",
        found.width, found.height, expected.width, expected.height
    )))
}

/// Light and gloss at the network's size.
struct FittedLight {
    light: ShLight,
    shading_light: ShLight,
    light_residual: f64,
    gloss: Option<FittedGloss>,
}

impl FittedLight {
    /// Fits light and gloss to the maps at the network's size.
    fn new(whole: &PhotoPrediction, is_glossy: bool) -> Result<Self, DecomposeError> {
        let known = inside(&whole.mask);
        let maps = to_maps(whole.fields.clone(), &known)?;
        let normals = maps.normals;
        let shading = normalised(maps.shading, &known);
        let target = Rgb::new(shading.clone().in_colour());
        let steep = normals.clone().steeper(TILT);
        let light_near = |predicted| light_of_shading(&steep, &target, &known, predicted);
        let shading_light = light_near(None)?;
        let light = match &whole.light {
            Some(predicted) => light_near(Some(predicted))?,
            None => shading_light.clone(),
        };
        let lit = DiffuseLayer::new(&light, DiffuseForm::Irradiance).shading(&steep);
        let gloss = if is_glossy {
            let highlight = possible_highlight(&whole.picture, &known, maps.highlight);
            fit_gloss(&shading_light, &normals, &highlight)?
        } else {
            None
        };
        Ok(Self {
            light_residual: relative_difference(lit.planes().plane(0), shading.plane(0)),
            light,
            shading_light,
            gloss,
        })
    }
}

/// A value as light: black if it is negative, infinite or NaN.
pub(super) fn usable(value: f32) -> f32 {
    if value.is_finite() {
        value.max(0.0)
    } else {
        0.0
    }
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
