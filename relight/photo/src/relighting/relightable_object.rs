//! An object from a photograph, decomposed for relighting.

use std::sync::Arc;

use super::InsertError;
use super::cut::Cut;
use super::fringe::Fringe;
use super::material::{MaterialChange, ObjectGloss};
use super::matte::Matte;
use super::placed_object::{PlacedObject, PlacedObjectCache};
use super::placement::Fit;
use super::shading::{DARK, LeastKept, Shading};
use super::smooth::weighted_mean;
use super::source::{directedness, likeness};
use crate::decompose::{
    DecomposeError, DecomposeOptions, Decomposer, Decomposition, Photo, WORKING_SIDE,
};
use relight_core::captured_object::CapturedObject;
use relight_core::image::{Extent, Linear, Planes, Rgb};
use relight_core::light::{Normals, Order, ShLight};
use relight_core::render::{DiffuseForm, DiffuseLayer, Gloss, LobeLayer, exposure_for};

/// The most by which the residual of a pixel grows with the light.
const REST_GROWTH: f32 = 3.0;

/// An object of a photograph: its matte, its layers, and what they do not explain, so that its own light gives the
/// photograph back.
///
/// ```
/// use relight_photo::decompose::{DecomposeOptions, Decomposer};
/// use relight_core::image::{Extent, Planes, Rgb};
/// use relight_photo::relighting::{MaterialChange, RelightableObject};
/// use relight_photo::nets::{Weights, decomposer};
///
/// let weights = Weights::initial(&decomposer(), 1); // not trained
/// let decomposer = Decomposer::with_side(&weights, 32)?;
/// let photo = Rgb::new(Planes::filled(Extent::new(60, 40), [0.5, 0.4, 0.3]));
/// let mask = Planes::from_fn(Extent::new(60, 40), |x, _| [f32::from(u8::from((10..50).contains(&x)))]);
/// let relightable = RelightableObject::new(&photo, &mask, None, &decomposer, &DecomposeOptions::default())?;
/// let same = relightable.relit(&relightable.light, &MaterialChange::default())?;
/// let shown = relightable.in_place(&photo, &same);
/// assert!((shown.planes().pixel(30, 20)[0] - 0.5).abs() < 1e-3);
/// # Ok::<(), relight_photo::relighting::InsertError>(())
/// ```
#[derive(Debug, Clone)]
pub struct RelightableObject {
    /// Column and row of the maps' first pixel in the photograph.
    pub(crate) place: [usize; 2],
    /// Width and height of the photograph.
    pub(crate) photo: Extent,
    /// What the object covers of each pixel, and its colours.
    pub(crate) matte: Matte,
    /// Of a photograph without alpha.
    pub(crate) fringe: Option<Fringe>,
    /// Also under the soft edge.
    pub(crate) normals: Normals,
    /// In units in which the mean shading is 1.
    albedo: Planes<3>,
    shading: Shading,
    /// The highlight minus the gloss in the photograph's own light.
    highlight: Planes<1>,
    gloss: Option<ObjectGloss>,
    /// Foreground less diffuse part and highlight.
    rest: Planes<3>,
    /// The photograph's light, grey, of order 2, in units in which the mean shading is 1.
    pub light: ShLight,
    placed_cache: PlacedObjectCache,
}

impl RelightableObject {
    /// Decomposes the object that a mask (1 on it, else 0) shows in a photograph of linear light. Of a cut-out
    /// picture, `alpha` is that of its file; else alpha and the colours of its edge are estimated.
    ///
    /// # Errors
    /// If the photograph has a value that is negative or not finite, mask or alpha have another size, the mask is empty, or the
    /// network fails.
    pub fn new(
        photo: &Rgb<Linear>,
        mask: &Planes<1>,
        alpha: Option<&Planes<1>>,
        decomposer: &Decomposer,
        options: &DecomposeOptions,
    ) -> Result<Self, InsertError> {
        let cut = Cut::new(photo, (mask, alpha))?;
        let foreground = Rgb::new(cut.matte.foreground.clone());
        let options = DecomposeOptions { ..*options };
        let found = decomposer.decompose(&foreground, &cut.mask, &options)?;
        Self::from_parts(cut, &found)
    }

    /// The object of a photograph with its mask.
    ///
    /// # Errors
    /// As [`RelightableObject::new`].
    pub fn from_photo(
        photo: &Photo,
        decomposer: &Decomposer,
        options: &DecomposeOptions,
    ) -> Result<Self, InsertError> {
        let options = photo.options(options);
        Self::new(
            &photo.picture,
            &photo.mask,
            photo.alpha.as_ref(),
            decomposer,
            &options,
        )
    }

    /// A captured object, whose maps are known. It counts as photographed in even light of irradiance 1, in which it looks as
    /// its albedo is; its gloss is the mean over what it covers.
    ///
    /// # Errors
    /// If it covers no pixel by a half.
    pub fn from_captured(asset: &CapturedObject) -> Result<Self, InsertError> {
        let (extent, surface) = (asset.extent(), asset.surface());
        let mask = asset.alpha().clone().map(|a| f32::from(u8::from(a >= 0.5)));
        let covered: Vec<usize> = (0..extent.pixels())
            .filter(|&at| mask.plane(0)[at] > 0.0)
            .collect();
        if covered.is_empty() {
            return Err(DecomposeError::EmptyMask.into());
        }
        let wanted: Vec<bool> = asset.alpha().plane(0).iter().map(|&a| a > 0.0).collect();
        let albedo = surface.albedo().planes().clone();
        let light = even_light();
        let ones = Planes::filled(extent, [1.0]);
        let even = Planes::filled(extent, [1.0; 3]);
        let shading = Shading::new(&ones, &even, &wanted);
        Ok(Self {
            place: [0, 0],
            photo: extent,
            matte: Matte::from_cut_out(&albedo, asset.alpha()),
            fringe: None,
            normals: surface.normals().completed(&wanted),
            albedo,
            shading,
            highlight: Planes::zeros(extent),
            gloss: surface.gloss().map(|gloss| mean_gloss(gloss, &covered)),
            rest: Planes::zeros(extent),
            light,
            placed_cache: PlacedObjectCache::default(),
        })
    }

    /// The layers of a cut-out part, continued over its soft edge.
    fn from_parts(cut: Cut, found: &Decomposition) -> Result<Self, InsertError> {
        let extent = cut.mask.extent();
        let known: Vec<bool> = cut.mask.plane(0).iter().map(|&m| m >= 0.5).collect();
        let covered = cut.matte.alpha.plane(0).iter();
        let wanted: Vec<bool> = covered
            .zip(&known)
            .map(|(&a, &known)| a > 0.0 || known)
            .collect();
        let normals = smoothed(
            &found.normals.completed(&wanted),
            &wanted,
            found.region.side,
        );
        let paint = found.paint().extended(&known, &wanted);
        let own =
            DiffuseLayer::new(&found.shading_light, DiffuseForm::Irradiance).shading(&normals);
        let shading = found.shading.clone().extended(&known, &wanted);
        let highlight = found.highlight.clone().extended(&known, &wanted);
        let mut albedo = found.albedo.planes().clone().extended(&known, &wanted);
        let mut rest = cut.matte.foreground.clone();
        let layers = albedo.planes_mut().into_iter().zip(rest.planes_mut());
        for (albedo, rest) in layers {
            for at in 0..extent.pixels() {
                let (s, h) = (shading.plane(0)[at], highlight.plane(0)[at]);
                if !wanted[at] {
                    (albedo[at], rest[at]) = (0.0, 0.0);
                    continue;
                }
                if !known[at] && s > DARK {
                    albedo[at] = ((rest[at] - h) / s).max(0.0);
                }
                rest[at] -= albedo[at] * s + h;
            }
        }
        let gloss = found.gloss.map(|gloss| ObjectGloss {
            reflectance: [gloss.reflectance; 3],
            smoothness: gloss.smoothness,
        });
        let mut highlight = highlight;
        if let Some(gloss) = gloss {
            let lobe = lobes(&found.shading_light, &normals, gloss)?;
            let pairs = highlight.planes_mut()[0].iter_mut().zip(lobe.plane(0));
            pairs.for_each(|(highlight, lobe)| *highlight -= lobe);
        }
        Ok(Self {
            place: cut.place,
            photo: cut.photo,
            shading: Shading::new(&shading, own.planes(), &wanted).doubted(&paint, &wanted),
            matte: cut.matte,
            fringe: cut.fringe,
            normals,
            albedo,
            highlight,
            gloss,
            rest,
            light: found.shading_light.clone(),
            placed_cache: PlacedObjectCache::default(),
        })
    }

    /// Width and height of the part of the photograph that holds the object.
    pub const fn extent(&self) -> Extent {
        self.albedo.extent()
    }

    /// The object as it stands by this fit.
    pub(crate) fn placed(&self, fit: Fit) -> Arc<PlacedObject> {
        self.placed_cache.get_or_place(fit, &self.matte.alpha)
    }

    /// The object's colours in another light, in the units of [`RelightableObject::light`] (see
    /// [`exposure_between`](super::exposure_between)), of the size of [`RelightableObject::extent`], not yet multiplied with alpha.
    ///
    /// With E the irradiance of the old light on the normals and E' that of the new, R the albedo, S and H shading and highlight
    /// of the photograph I, and w the likeness of the lights:
    ///
    /// ```text
    /// D = (S + d) / (E + d) = relief x shadow, d = 0.05
    /// S' = relief x shadow^w x (E' + d) - d
    /// c  = ln((mean of S' + d) / (S + d)), m the mean of c over the object
    /// h  = exp(-(1 - t) m - (1 - u) (c - m))
    /// I' = h (R S' + (E' + d) / (E + d) (I - R S - H)) + H'
    /// H' = lobe(E') + w (H - lobe(E))
    /// ```
    ///
    /// where t and u are the confidence in the decomposition. For a photograph t is 0.6. u is 0.2 where it is dark (S up to
    /// 0.15) to 0.8 where it is bright (from 0.5 on), 0.25 more where it is certain how much of the dark is paint, and
    /// as much less where it is uncertain; in the light of a lamp alone it is at least 0.8. For a captured object both are 1. So
    /// relief and fine texture stay, shadows stay as far as the light comes from the same directions, brightness changes only as
    /// far as the confidence allows, and the photograph's own light gives the photograph.
    ///
    /// # Errors
    /// None for a relightable, whose maps have one size; those of the render layers in general.
    pub fn relit(
        &self,
        light: &ShLight,
        change: &MaterialChange,
    ) -> Result<Planes<3>, InsertError> {
        self.relit_by(light, change, LeastKept::in_light(directedness(light)))
    }

    /// The same, where the mean change of brightness is kept wholly: before what the light shows too, less would be wrong.
    pub(crate) fn relit_wholly(
        &self,
        light: &ShLight,
        change: &MaterialChange,
    ) -> Result<Planes<3>, InsertError> {
        let least = LeastKept::in_light(directedness(light)).with_mean();
        self.relit_by(light, change, least)
    }

    fn relit_by(
        &self,
        light: &ShLight,
        change: &MaterialChange,
        least: LeastKept,
    ) -> Result<Planes<3>, InsertError> {
        let kept = likeness(&self.light, light) as f32;
        let irradiance = DiffuseLayer::new(light, DiffuseForm::Irradiance).shading(&self.normals);
        let mut image = irradiance.into_planes();
        let mean_change = self.shading.mean_change(&image, kept);
        let width = self.extent().width;
        image.fill_rows(|y, [red, green, blue]| {
            let pixels = red.iter_mut().zip(green).zip(blue);
            for (x, ((red, green), blue)) in pixels.enumerate() {
                let at = y * width + x;
                let irradiance = [*red, *green, *blue];
                let shades = self.shading.at(at, irradiance, kept);
                let own = self.shading.own[at] + DARK;
                let damping = self.shading.damping(at, shades, mean_change, least);
                let colours: [f32; 3] = std::array::from_fn(|channel| {
                    let grown = ((irradiance[channel] + DARK) / own).min(REST_GROWTH);
                    let colour = self.albedo.plane(channel)[at] * shades[channel]
                        + self.rest.plane(channel)[at] * grown;
                    colour * damping * change.tint[channel]
                });
                [*red, *green, *blue] = colours;
            }
        });
        self.add_highlight(&mut image, light, change, kept)?;
        Ok(image.map(|v| v.max(0.0)))
    }

    fn add_highlight(
        &self,
        image: &mut Planes<3>,
        light: &ShLight,
        change: &MaterialChange,
        kept: f32,
    ) -> Result<(), InsertError> {
        let gloss = change.gloss.or(self.gloss);
        let lobe = match gloss {
            Some(gloss) if gloss.reflectance != [0.0; 3] => {
                Some(lobes(light, &self.normals, gloss)?)
            }
            _ => None,
        };
        // What was seen of other gloss says nothing of this one.
        let kept = if change.gloss.is_some() { 0.0 } else { kept };
        for (channel, plane) in image.planes_mut().into_iter().enumerate() {
            for (at, value) in plane.iter_mut().enumerate() {
                let lobe = lobe.as_ref().map_or(0.0, |lobe| lobe.plane(channel)[at]);
                *value += (lobe + kept * self.highlight.plane(0)[at]).max(0.0);
            }
        }
        Ok(())
    }
}

/// Normals without what is finer than the network's pixels: a grid of them would show where light falls flat. Fine relief is in
/// the shading.
fn smoothed(normals: &Normals, wanted: &[bool], side: usize) -> Normals {
    let radius = (side as f64 / WORKING_SIDE as f64).round() as usize;
    let weights = wanted.iter().map(|&w| f32::from(u8::from(w))).collect();
    match Planes::from_planes(normals.extent(), [weights]) {
        Ok(weights) if radius > 0 => {
            let (once, _) = weighted_mean(normals.planes(), &weights, radius);
            Normals::new(weighted_mean(&once, &weights, radius).0)
        }
        _ => normals.clone(),
    }
}

/// Light from everywhere, in which a white diffuse surface is 1.
fn even_light() -> ShLight {
    let light = ShLight::even(Order::TWO, [1.0; 3]);
    let exposure = f64::from(exposure_for(&light));
    light.tinted([exposure; 3])
}

fn mean_gloss(gloss: &Gloss, covered: &[usize]) -> ObjectGloss {
    let mean = |plane: &[f32]| {
        let sum: f64 = covered.iter().map(|&at| f64::from(plane[at])).sum();
        (sum / covered.len() as f64) as f32
    };
    ObjectGloss {
        reflectance: gloss.reflectance().planes().map(mean),
        smoothness: mean(gloss.smoothness().plane(0)).max(1.0),
    }
}

fn lobes(light: &ShLight, normals: &Normals, gloss: ObjectGloss) -> Result<Planes<3>, InsertError> {
    let even = Gloss::even(normals.extent(), gloss.reflectance, gloss.smoothness);
    Ok(LobeLayer::new(light)
        .highlight(normals, &even)?
        .into_planes())
}
