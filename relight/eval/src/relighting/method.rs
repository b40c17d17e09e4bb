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

    /// What all lights share.
    pub(super) fn prepare<'a>(
        &'a self,
        set: &'a RelightingSet,
        object: &'a Object,
        part: Part,
    ) -> Result<Relight<'a>, EvalError> {
        let rendered = |surface: Surface, form| {
            let surface = match part {
                Part::Full => surface,
                Part::Diffuse => surface.with_gloss(None)?,
            };
            Ok(Relight::Rendered {
                set,
                object,
                surface: Box::new(surface),
                form,
            })
        };
        match self {
            Self::Naive => Ok(Relight::Same(set.image(object, object.input, part)?)),
            Self::Oracle(form) => rendered(object.surface.clone(), *form),
            Self::Predictions(predictions) => Ok(Relight::Files {
                predictions,
                object,
                part,
            }),
            Self::Photograph(decomposer) => {
                let photo = SourcePhotograph::new(set, object, part)?;
                let mask = &photo.mask;
                let relightable = RelightableObject::new(
                    &photo.picture,
                    mask,
                    Some(mask),
                    decomposer,
                    &photo.options,
                );
                let relightable =
                    Box::new(relightable.map_err(EvalError::sample(&object.name, NOT_RELIT))?);
                Ok(Relight::RelightableObject {
                    set,
                    object,
                    photo,
                    relightable,
                })
            }
            Self::Maps(decomposer) => {
                let SourcePhotograph {
                    picture,
                    mask,
                    options,
                } = SourcePhotograph::new(set, object, part)?;
                let found = decomposer.decompose(&picture, &mask, &options);
                let found = found.map_err(EvalError::sample(&object.name, NOT_RELIT))?;
                let white = mean_irradiance(&set.lights()[object.input]);
                rendered(surface_of(found, white)?, SpecularForm::Lobe)
            }
        }
    }
}

/// The image that is relit, as a photograph.
pub(super) struct SourcePhotograph {
    picture: Rgb<Linear>,
    mask: Planes<1>,
    options: DecomposeOptions,
}

impl SourcePhotograph {
    fn new(set: &RelightingSet, object: &Object, part: Part) -> Result<Self, EvalError> {
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
        Ok(Self {
            picture: Rgb::<Srgb>::new(image).to_linear(),
            mask,
            options: DecomposeOptions {
                specular,
                ..DecomposeOptions::default()
            },
        })
    }
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

/// A method for one object.
pub(super) enum Relight<'a> {
    /// One image for all lights.
    Same(Planes<3>),
    /// Maps, rendered.
    Rendered {
        set: &'a RelightingSet,
        object: &'a Object,
        surface: Box<Surface>,
        form: SpecularForm,
    },
    /// Images that were predicted.
    Files {
        predictions: &'a Predictions,
        object: &'a Object,
        part: Part,
    },
    /// A photograph's object.
    RelightableObject {
        set: &'a RelightingSet,
        object: &'a Object,
        photo: SourcePhotograph,
        relightable: Box<RelightableObject>,
    },
}

impl Relight<'_> {
    /// The object under a light, sRGB, 0 outside the object.
    pub(super) fn image(&self, light: usize) -> Result<Planes<3>, EvalError> {
        match self {
            Self::Same(image) => Ok(image.clone()),
            Self::Rendered {
                set,
                object,
                surface,
                form,
            } => {
                let image = render(surface, &set.lights()[light], *form)?;
                Ok(cut_out(&image, &object.mask))
            }
            Self::Files {
                predictions,
                object,
                part,
            } => {
                let path = predictions.file(&object.name, &part.file(light));
                let image = read_image(path, object.surface.extent())?;
                Ok(cut_out(&image, &object.mask))
            }
            Self::RelightableObject {
                set,
                object,
                photo,
                relightable,
            } => {
                let new = &set.lights()[light];
                let exposure = mean_irradiance(&relightable.light) / mean_irradiance(new);
                let new = new.clone().tinted([f64::from(exposure); 3]);
                let colours = relightable.relit(&new, &MaterialChange::default());
                let colours = colours.map_err(EvalError::sample(&object.name, NOT_RELIT))?;
                let image = shown(relightable.in_place(&photo.picture, &colours));
                Ok(cut_out(&image, &object.mask))
            }
        }
    }
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
