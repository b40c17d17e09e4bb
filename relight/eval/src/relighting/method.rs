//! Ways to show an object under another light.

use std::f64::consts::PI;

use super::set::{Object, Part, RelightingSet, read_image};
use crate::run::cut_out;
use crate::{EvalError, Predictions};
use relight_core::image::{Linear, Planes, Rgb, Srgb};
use relight_core::light::{Order, ShLight};
use relight_core::render::{DiffuseForm, Gloss, Layers, SpecularForm, Surface};
use relight_photo::decompose::{DecomposeOptions, Decomposer, Decomposition, SpecularGate};
use relight_photo::relighting::{MaterialChange, RelightableObject};

/// What cannot be done with an object.
const NOT_RELIT: &str = "cannot be decomposed or relit";

/// Where relit images come from.
#[derive(Debug, Clone)]
pub enum RelightMethod<'d> {
    /// The image as it is, whatever the light: naive insertion.
    Naive,
    /// The true maps of the object through the render layers, with this specular layer, under the true light: with the
    /// paper's layer under its nine coefficients, which tells what the paper's representation costs; with the lobe under
    /// all bands.
    Oracle(SpecularForm),
    /// What was predicted: the relit images, under the names that the set has.
    Predictions(Predictions),
    /// The result of `relight relight` on the image: layers, light and hedge. The mean irradiance of the image's light is
    /// given, since all lights of a set have the same: an image does not show how bright its light is compared with the new one.
    Photograph(&'d Decomposer),
    /// The result of `relight decompose` with the same inputs: its normals, albedo and gloss, rendered as those of the
    /// oracle.
    Maps(&'d Decomposer),
}

impl RelightMethod<'_> {
    pub(super) fn name(&self) -> String {
        match self {
            Self::Naive => "naive insertion".to_owned(),
            Self::Oracle(SpecularForm::Power) => "oracle, the paper's specular layer".to_owned(),
            Self::Oracle(SpecularForm::Lobe) => "oracle, lobe layer".to_owned(),
            Self::Predictions(predictions) => predictions.name(),
            Self::Photograph(_) => "relight relight".to_owned(),
            Self::Maps(_) => "relight decompose, its maps rendered".to_owned(),
        }
    }

    /// The object under the light of a number, sRGB, 0 outside the object. What all lights share is made once.
    pub(super) fn prepare<'a>(
        &'a self,
        set: &'a RelightingSet,
        object: &'a Object,
        part: Part,
    ) -> Result<Relight<'a>, EvalError> {
        let own = move |image: &Planes<3>| cut_out(image, &object.mask);
        let rendered = move |surface: Surface, form| {
            let surface = match part {
                Part::Full => surface,
                Part::Diffuse => surface.with_gloss(None)?,
            };
            let relight: Relight<'a> =
                Box::new(move |light| Ok(own(&render(&surface, &set.lights()[light], form)?)));
            Ok(relight)
        };
        match self {
            Self::Naive => {
                let image = set.image(object, object.input, part)?;
                Ok(Box::new(move |_| Ok(image.clone())))
            }
            Self::Oracle(form) => rendered(object.surface.clone(), *form),
            Self::Predictions(predictions) => Ok(Box::new(move |light| {
                let path = predictions.file(&object.name, &part.file(light));
                Ok(own(&read_image(path, object.surface.extent())?))
            })),
            Self::Photograph(decomposer) => {
                let (picture, mask, options) = photograph(set, object, part)?;
                let made =
                    RelightableObject::new(&picture, &mask, Some(&mask), decomposer, &options);
                let made = made.map_err(EvalError::sample(&object.name, NOT_RELIT))?;
                Ok(Box::new(move |light| {
                    let new = &set.lights()[light];
                    let exposure = mean_irradiance(&made.light) / mean_irradiance(new);
                    let new = new.clone().tinted([f64::from(exposure); 3]);
                    let colours = made.relit(&new, &MaterialChange::default());
                    let colours = colours.map_err(EvalError::sample(&object.name, NOT_RELIT))?;
                    Ok(own(&shown(made.in_place(&picture, &colours))))
                }))
            }
            Self::Maps(decomposer) => {
                let (picture, mask, options) = photograph(set, object, part)?;
                let found = decomposer.decompose(&picture, &mask, &options);
                let found = found.map_err(EvalError::sample(&object.name, NOT_RELIT))?;
                let white = mean_irradiance(&set.lights()[object.input]);
                rendered(surface_of(found, white)?, SpecularForm::Lobe)
            }
        }
    }
}

/// An object under the light of a number.
pub(super) type Relight<'a> = Box<dyn Fn(usize) -> Result<Planes<3>, EvalError> + 'a>;

/// The image that is relit as a photograph, its mask, and how it is decomposed.
fn photograph(
    set: &RelightingSet,
    object: &Object,
    part: Part,
) -> Result<(Rgb<Linear>, Planes<1>, DecomposeOptions), EvalError> {
    let image = set.image(object, object.input, part)?;
    let mask = object
        .mask
        .iter()
        .map(|&inside| f32::from(u8::from(inside)));
    let mask = Planes::from_planes(image.extent(), [mask.collect()])?;
    let specular = match part {
        Part::Diffuse => SpecularGate::Off,
        Part::Full => SpecularGate::On,
    };
    let options = DecomposeOptions {
        specular,
        ..DecomposeOptions::default()
    };
    Ok((Rgb::<Srgb>::new(image).to_linear(), mask, options))
}

/// The maps of a photograph in the units of the set, where the mean irradiance of its light is known.
fn surface_of(found: Decomposition, irradiance: f32) -> Result<Surface, EvalError> {
    let extent = found.normals.extent();
    let scale = mean_irradiance(&found.shading_light) / irradiance;
    let gloss = found.gloss.map(|gloss| {
        let reflectance = gloss.reflectance * scale;
        Gloss::even(extent, [reflectance; 3], gloss.smoothness)
    });
    let albedo = found.albedo.into_planes().map(|value| value * scale);
    Ok(Surface::new(found.normals, Rgb::new(albedo), gloss)?)
}

/// Irradiance, the mean over all normals and channels: √π / 2 of the mean first coefficient.
fn mean_irradiance(light: &ShLight) -> f32 {
    let first = light.coefficients()[0].iter().sum::<f64>() / 3.0;
    (first * PI.sqrt() / 2.0) as f32
}

fn render(surface: &Surface, light: &ShLight, form: SpecularForm) -> Result<Planes<3>, EvalError> {
    let light = match form {
        SpecularForm::Power => &light.with_order(Order::TWO),
        SpecularForm::Lobe => light,
    };
    let layers = Layers::new(light, DiffuseForm::Irradiance, form);
    let image = layers.render(surface).image(surface.albedo())?;
    Ok(shown(image))
}

/// Light as an 8-bit picture has it: sRGB, clipped.
pub(super) fn shown(light: Rgb<Linear>) -> Planes<3> {
    let clipped = Rgb::<Linear>::new(light.into_planes().map(|value| value.clamp(0.0, 1.0)));
    clipped.encode::<Srgb>().into_planes()
}
