//! An object out of a photograph, taken apart so that it can be shown in another light.

use super::InsertError;
use super::matte::Matte;
use super::smooth::weighted_mean;
use super::source::likeness;
use crate::decompose::{
    CropSquare, DecomposeError, DecomposeOptions, Decomposer, Decomposition, Photo, WORKING_SIDE,
};
use relight_core::captured_object::CapturedObject;
use relight_core::image::{Extent, Linear, Planes, Rgb};
use relight_core::light::{Normals, Order, ShLight, YUp};
use relight_core::render::{
    DiffuseForm, DiffuseLayer, Gloss, LobeLayer, exposure_for, mirror_reflectance,
};

/// Added to irradiance, whose mean on the object is 1, before ratios of it are taken.
const DARK: f32 = 0.05;
/// The most and the least that the shading may be of what the light makes on the normals; what is beyond it is kept as a
/// difference.
const RATIOS: (f32, f32) = (0.25, 4.0);
/// Details of shading up to this part of the object's side are relief; larger ones are shadows, of which as much is kept as the
/// lights are alike.
const RELIEF: f64 = 0.04;
/// The most by which the unexplained rest of a pixel grows with the light.
const REST_GROWTH: f32 = 3.0;

/// An object of a photograph: its matte, its layers, and what they do not explain, so that its own light gives the
/// photograph back.
///
/// ```
/// use relight_photo::decompose::{DecomposeOptions, Decomposer};
/// use relight_core::image::{Extent, Planes, Rgb};
/// use relight_photo::insert::{MaterialChange, Subject};
/// use relight_nets::{Weights, decomposer};
///
/// let weights = Weights::initial(&decomposer(), 1); // not trained
/// let decomposer = Decomposer::with_side(&weights, 32)?;
/// let photo = Rgb::new(Planes::filled(Extent::new(60, 40), [0.5, 0.4, 0.3]));
/// let mask = Planes::from_fn(Extent::new(60, 40), |x, _| [f32::from(u8::from((10..50).contains(&x)))]);
/// let subject = Subject::new(&photo, &mask, None, &decomposer, &DecomposeOptions::default())?;
/// let same = subject.relit(subject.light(), &MaterialChange::default())?;
/// let shown = subject.in_place(&photo, &same);
/// assert!((shown.planes().pixel(30, 20)[0] - 0.5).abs() < 1e-3);
/// # Ok::<(), relight_photo::insert::InsertError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Subject {
    /// Column and row of the maps' first pixel in the photograph.
    place: [usize; 2],
    photo: Extent,
    mask: Planes<1>,
    matte: Matte,
    normals: Normals<YUp>,
    albedo: Planes<3>,
    shading: Shading,
    /// What the highlight has that gloss in the own light has not.
    highlight: Planes<1>,
    gloss: Option<ObjectGloss>,
    /// Foreground less diffuse part and highlight.
    rest: Planes<3>,
    light: ShLight,
}

/// Which colours the soft edge of an object has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum EdgeColours {
    /// The object's own: those of the background are taken out.
    #[default]
    Freed,
    /// What the photograph shows there, mixed with its background: to see what the other way is good for.
    Photographed,
}

/// How an object shines all over.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObjectGloss {
    /// Specular reflectance s_p, red, green and blue.
    pub reflectance: [f32; 3],
    /// Smoothness α, above 0.
    pub smoothness: f32,
}

impl ObjectGloss {
    /// White gloss that reflects this part of even light towards a viewer at a right angle.
    #[must_use]
    pub fn of_part(part: f32, smoothness: f32) -> Self {
        Self {
            reflectance: [mirror_reflectance(part, smoothness); 3],
            smoothness,
        }
    }
}

/// What is to be another material than it was.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MaterialChange {
    /// What the albedo is multiplied with.
    pub tint: [f32; 3],
    /// Gloss in place of that which was found; a reflectance of 0 makes the object matt.
    pub gloss: Option<ObjectGloss>,
}

impl Default for MaterialChange {
    fn default() -> Self {
        Self {
            tint: [1.0; 3],
            gloss: None,
        }
    }
}

/// The shading S of a photograph beside the irradiance E of its light on the normals, with D = (S + d) / (E + d), d = 0.05.
#[derive(Debug, Clone)]
struct Shading {
    /// The fine part of D.
    relief: Vec<f32>,
    /// The coarse part of D: shadows, bounced light, and what order 2 cannot say.
    shadow: Vec<f32>,
    /// What the bounds of D leave of S.
    left: Vec<f32>,
    /// E.
    own: Vec<f32>,
}

impl Subject {
    /// Takes the object apart that a mask (1 on it, else 0) shows in a photograph of linear light. Of a cut-out
    /// picture, `alpha` is what its file says; else alpha and the colours of its edge are estimated.
    ///
    /// # Errors
    /// Where the photograph has values that are no light, mask or alpha have another size, the mask is empty, or the network
    /// fails.
    pub fn new(
        photo: &Rgb<Linear>,
        mask: &Planes<1>,
        alpha: Option<&Planes<1>>,
        decomposer: &Decomposer,
        options: &DecomposeOptions,
    ) -> Result<Self, InsertError> {
        Self::with_edges(
            photo,
            (mask, alpha),
            decomposer,
            options,
            EdgeColours::Freed,
        )
    }

    /// The object of a photograph with its mask.
    ///
    /// # Errors
    /// As [`Subject::new`].
    pub fn of_photo(
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

    /// As [`Subject::new`], with mask and alpha in one, and a choice of the colours of the edge.
    ///
    /// # Errors
    /// As [`Subject::new`].
    pub fn with_edges(
        photo: &Rgb<Linear>,
        (mask, alpha): (&Planes<1>, Option<&Planes<1>>),
        decomposer: &Decomposer,
        options: &DecomposeOptions,
        edges: EdgeColours,
    ) -> Result<Self, InsertError> {
        let mut cut = Cut::new(photo, mask, alpha)?;
        if edges == EdgeColours::Photographed {
            cut.matte.foreground = cropped(photo.planes(), cut.place, cut.mask.extent());
        }
        let foreground = Rgb::new(cut.matte.foreground.clone());
        let found = decomposer.decompose(&foreground, &cut.mask, options)?;
        Self::of_parts(cut, &found)
    }

    /// A captured object, whose maps are known. It counts as photographed in even light of irradiance 1, in which it looks as
    /// its albedo is; its gloss is the mean over what it covers.
    ///
    /// # Errors
    /// Where it covers no pixel by a half.
    pub fn of_captured(asset: &CapturedObject) -> Result<Self, InsertError> {
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
        Ok(Self {
            place: [0, 0],
            photo: extent,
            mask,
            matte: Matte::of_cut_out(&albedo, asset.alpha()),
            normals: surface.normals().completed(&wanted),
            albedo,
            shading: Shading::new(&ones, &Planes::filled(extent, [1.0; 3]), &wanted),
            highlight: Planes::zeros(extent),
            gloss: surface.gloss().map(|gloss| mean_gloss(gloss, &covered)),
            rest: Planes::zeros(extent),
            light,
        })
    }

    /// The layers of a cut-out part, continued over its soft edge.
    fn of_parts(cut: Cut, found: &Decomposition) -> Result<Self, InsertError> {
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
        let own = DiffuseLayer::new(&found.light, DiffuseForm::Irradiance).shading(&normals);
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
            let lobe = lobes(&found.light, &normals, gloss)?;
            let pairs = highlight.planes_mut()[0].iter_mut().zip(lobe.plane(0));
            pairs.for_each(|(highlight, lobe)| *highlight -= lobe);
        }
        Ok(Self {
            place: cut.place,
            photo: cut.photo,
            mask: cut.mask,
            shading: Shading::new(&shading, own.planes(), &wanted),
            matte: cut.matte,
            normals,
            albedo,
            highlight,
            gloss,
            rest,
            light: found.light.clone(),
        })
    }

    /// The light in which the object was, grey, of order 2, in units in which the mean shading is 1.
    #[must_use]
    pub const fn light(&self) -> &ShLight {
        &self.light
    }

    /// Width and height of the part of the photograph that holds the object.
    #[must_use]
    pub const fn extent(&self) -> Extent {
        self.albedo.extent()
    }

    /// Column and row of that part's first pixel in the photograph.
    #[must_use]
    pub const fn place(&self) -> [usize; 2] {
        self.place
    }

    /// Width and height of the photograph.
    #[must_use]
    pub const fn photo_extent(&self) -> Extent {
        self.photo
    }

    /// 1 on the object, else 0.
    #[must_use]
    pub const fn mask(&self) -> &Planes<1> {
        &self.mask
    }

    /// What the object covers of each pixel, and its colours.
    #[must_use]
    pub const fn matte(&self) -> &Matte {
        &self.matte
    }

    /// The object's normals, also under its soft edge.
    #[must_use]
    pub const fn normals(&self) -> &Normals<YUp> {
        &self.normals
    }

    /// The object's albedo, in units in which the mean shading is 1.
    #[must_use]
    pub const fn albedo(&self) -> &Planes<3> {
        &self.albedo
    }

    /// The gloss that was found.
    #[must_use]
    pub const fn gloss(&self) -> Option<ObjectGloss> {
        self.gloss
    }

    /// The object's colours in another light, in the units of [`Subject::light`] (see
    /// [`exposure_between`](super::exposure_between)), of the size of [`Subject::extent`], not yet multiplied with alpha.
    ///
    /// With E the irradiance of the old light on the normals and E' that of the new, R the albedo, S and H shading and highlight
    /// of the photograph I, and w the [`likeness`] of the lights:
    ///
    /// ```text
    /// D = (S + d) / (E + d) = relief x shadow, d = 0.05
    /// S' = relief x shadow^w x (E' + d) - d
    /// I' = R S' + (E' + d) / (E + d) (I - R S - H) + H'
    /// H' = lobe(E') + w (H - lobe(E))
    /// ```
    ///
    /// So relief and fine texture stay, shadows stay as far as the light comes from where it came from, and the photograph's own
    /// light gives the photograph.
    ///
    /// # Errors
    /// None for a subject, whose maps have one size; those of the render layers in general.
    pub fn relit(
        &self,
        light: &ShLight,
        change: &MaterialChange,
    ) -> Result<Planes<3>, InsertError> {
        let kept = likeness(&self.light, light) as f32;
        let irradiance = DiffuseLayer::new(light, DiffuseForm::Irradiance).shading(&self.normals);
        let mut image = irradiance.into_planes();
        let width = self.extent().width;
        image.fill_rows(|y, row| {
            for (channel, line) in row.into_iter().enumerate() {
                let start = y * width;
                let albedo = &self.albedo.plane(channel)[start..];
                let rest = &self.rest.plane(channel)[start..];
                for (x, value) in line.iter_mut().enumerate() {
                    let at = start + x;
                    let own = self.shading.own[at] + DARK;
                    let grown = (*value + DARK) / own;
                    let shade = self.shading.at(at, *value, kept);
                    let colour = albedo[x] * shade + rest[x] * grown.min(REST_GROWTH);
                    *value = colour * change.tint[channel];
                }
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

    /// The photograph with these colours of the object in place of its own: its soft edge keeps the background that it has.
    ///
    /// # Panics
    /// Where the photograph or the colours have another size.
    #[must_use]
    pub fn in_place(&self, photo: &Rgb<Linear>, colours: &Planes<3>) -> Rgb<Linear> {
        assert_eq!(
            photo.planes().extent(),
            self.photo,
            "size of the photograph"
        );
        self.blended(
            photo.clone(),
            |alpha, old, own, new| (old + alpha * (new - own)).max(0.0),
            colours,
        )
    }

    /// A background of the photograph's size with the object before it, at its place and in these colours.
    ///
    /// # Panics
    /// Where the background or the colours have another size.
    #[must_use]
    pub fn before(&self, background: &Rgb<Linear>, colours: &Planes<3>) -> Rgb<Linear> {
        assert_eq!(
            background.planes().extent(),
            self.photo,
            "size of the background"
        );
        self.blended(
            background.clone(),
            |alpha, old, _, new| old + alpha * (new - old),
            colours,
        )
    }

    /// A map of the size of [`Subject::extent`] at its place in the photograph; 0 elsewhere.
    ///
    /// # Panics
    /// Where the map has another size.
    #[must_use]
    pub fn in_photo(&self, map: &Planes<3>) -> Planes<3> {
        let Extent { width, height } = self.extent();
        assert_eq!(map.extent(), self.extent(), "size of the map");
        let [left, top] = self.place;
        let mut photo = Planes::zeros(self.photo);
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            photo.set_pixel(left + x, top + y, map.pixel(x, y));
        }
        photo
    }

    /// A background with the photograph's pixels under the mask, as they are: naive insertion.
    ///
    /// # Panics
    /// Where the background or the photograph has another size.
    #[must_use]
    pub fn pasted(&self, photo: &Rgb<Linear>, background: &Rgb<Linear>) -> Rgb<Linear> {
        assert_eq!(
            photo.planes().extent(),
            self.photo,
            "size of the photograph"
        );
        assert_eq!(
            background.planes().extent(),
            self.photo,
            "size of the background"
        );
        let mut picture = background.clone();
        let Extent { width, height } = self.extent();
        let [left, top] = self.place;
        for y in 0..height {
            for x in 0..width {
                if self.mask.pixel(x, y)[0] >= 0.5 {
                    let (x, y) = (left + x, top + y);
                    let pixel = photo.planes().pixel(x, y);
                    picture.planes_mut().set_pixel(x, y, pixel);
                }
            }
        }
        picture
    }

    fn blended(
        &self,
        mut picture: Rgb<Linear>,
        blend: impl Fn(f32, f32, f32, f32) -> f32,
        colours: &Planes<3>,
    ) -> Rgb<Linear> {
        let Extent { width, height } = self.extent();
        assert_eq!(colours.extent(), self.extent(), "size of the colours");
        let alpha = self.matte.alpha.plane(0);
        let planes = picture.planes_mut().planes_mut();
        for (channel, plane) in planes.into_iter().enumerate() {
            let (own, new) = (self.matte.foreground.plane(channel), colours.plane(channel));
            for y in 0..height {
                let line =
                    &mut plane[(self.place[1] + y) * self.photo.width + self.place[0]..][..width];
                for (x, value) in line.iter_mut().enumerate() {
                    let at = y * width + x;
                    if alpha[at] > 0.0 {
                        *value = blend(alpha[at], *value, own[at], new[at]);
                    }
                }
            }
        }
        picture
    }
}

impl Shading {
    fn new(shading: &Planes<1>, own: &Planes<3>, wanted: &[bool]) -> Self {
        let extent = shading.extent();
        // The light is grey: its channels are equal.
        let own = own.plane(0).to_vec();
        let mut logarithm = Planes::zeros(extent);
        let [logs] = logarithm.planes_mut();
        for at in (0..own.len()).filter(|&at| wanted[at]) {
            let ratio = (shading.plane(0)[at] + DARK) / (own[at] + DARK);
            logs[at] = ratio.clamp(RATIOS.0, RATIOS.1).ln();
        }
        let weights = Planes::from_planes(
            extent,
            [wanted.iter().map(|&w| f32::from(u8::from(w))).collect()],
        );
        let radius = (extent.width.max(extent.height) as f64 * RELIEF).ceil() as usize;
        let coarse = match weights {
            Ok(weights) => {
                let (once, _) = weighted_mean(&logarithm, &weights, radius);
                weighted_mean(&once, &weights, radius).0
            }
            Err(_) => logarithm.clone(),
        };
        let mut result = Self {
            relief: vec![1.0; own.len()],
            shadow: vec![1.0; own.len()],
            left: vec![0.0; own.len()],
            own,
        };
        for at in (0..wanted.len()).filter(|&at| wanted[at]) {
            let (all, coarse) = (logarithm.plane(0)[at], coarse.plane(0)[at]);
            result.relief[at] = (all - coarse).exp();
            result.shadow[at] = coarse.exp();
            let held = all.exp() * (result.own[at] + DARK) - DARK;
            result.left[at] = shading.plane(0)[at] - held;
        }
        result
    }

    /// The shading of a pixel in new irradiance, where `kept` of the shadows are kept.
    fn at(&self, at: usize, irradiance: f32, kept: f32) -> f32 {
        let shadow = if self.shadow[at] == 1.0 {
            1.0
        } else {
            self.shadow[at].powf(kept)
        };
        let shade = self.relief[at] * shadow * (irradiance + DARK) - DARK;
        (shade + kept * self.left[at]).max(0.0)
    }
}

/// The part of a photograph around an object.
struct Cut {
    place: [usize; 2],
    photo: Extent,
    mask: Planes<1>,
    matte: Matte,
}

impl Cut {
    fn new(
        photo: &Rgb<Linear>,
        mask: &Planes<1>,
        alpha: Option<&Planes<1>>,
    ) -> Result<Self, InsertError> {
        let expected = photo.planes().extent();
        for (what, image) in [("mask", Some(mask)), ("alpha", alpha)] {
            if let Some(found) = image.map(Planes::extent).filter(|&found| found != expected) {
                return Err(InsertError::Size {
                    what,
                    found,
                    expected,
                });
            }
        }
        check_light(photo)?;
        let region = CropSquare::around(mask).ok_or(DecomposeError::EmptyMask)?;
        let edge = Matte::edge_for(region.extent());
        let margin = 4 * edge + 4;
        let (place, extent) = window(&region, margin, expected);
        let picture = cropped(photo.planes(), place, extent);
        let mask = cropped(mask, place, extent).map(|m| f32::from(u8::from(m >= 0.5)));
        let matte = match alpha {
            Some(alpha) => Matte::of_cut_out(&picture, &cropped(alpha, place, extent)),
            None => Matte::estimate(&picture, &mask, edge),
        };
        Ok(Self {
            place,
            photo: expected,
            mask,
            matte,
        })
    }
}

/// Whether all values are light.
fn check_light(photo: &Rgb<Linear>) -> Result<(), InsertError> {
    let width = photo.planes().extent().width;
    for plane in photo.planes().planes() {
        let odd = plane
            .iter()
            .position(|value| !(value.is_finite() && *value >= 0.0));
        if let Some(at) = odd {
            return Err(InsertError::NotLight {
                x: at % width,
                y: at / width,
            });
        }
    }
    Ok(())
}

/// The part of an image that a square with a margin covers.
fn window(region: &CropSquare, margin: usize, image: Extent) -> ([usize; 2], Extent) {
    let margin = margin as i64;
    let line = |from: i64, length: usize| {
        let inside = |at: i64| at.clamp(0, length as i64) as usize;
        (
            inside(from - margin),
            inside(from + region.side as i64 + margin),
        )
    };
    let ((left, right), (top, bottom)) =
        (line(region.x, image.width), line(region.y, image.height));
    ([left, top], Extent::new(right - left, bottom - top))
}

fn cropped<const C: usize>(image: &Planes<C>, place: [usize; 2], extent: Extent) -> Planes<C> {
    let width = image.extent().width;
    let mut part = Planes::zeros(extent);
    for (to, from) in part.planes_mut().into_iter().zip(image.planes()) {
        for (y, line) in to.chunks_exact_mut(extent.width.max(1)).enumerate() {
            line.copy_from_slice(&from[(place[1] + y) * width + place[0]..][..extent.width]);
        }
    }
    part
}

/// Normals without what is finer than the network's pixels: a grid of them would show where light falls flat. Fine relief is in
/// the shading.
fn smoothed(normals: &Normals<YUp>, wanted: &[bool], side: usize) -> Normals<YUp> {
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

/// Light from everywhere, of which a white matt surface is 1.
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

fn lobes(
    light: &ShLight,
    normals: &Normals<YUp>,
    gloss: ObjectGloss,
) -> Result<Planes<3>, InsertError> {
    let even = Gloss::even(normals.extent(), gloss.reflectance, gloss.smoothness);
    Ok(LobeLayer::new(light)
        .highlight(normals, &even)?
        .into_planes())
}
