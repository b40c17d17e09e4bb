//! Ways to show an object under another light.

use super::set::{Object, Part, RelightingSet, read_image};
use crate::run::cut_out;
use crate::{EvalError, Predictions};
use relight_core::image::{Linear, Planes, Rgb, Srgb};
use relight_core::light::{Order, ShLight};
use relight_core::render::{DiffuseForm, Layers, SpecularForm, Surface};

/// Where relit images come from.
#[derive(Debug, Clone)]
pub enum RelightMethod {
    /// The image as it is, whatever the light: naive insertion.
    Naive,
    /// The true maps of the object through the render layers, with this specular layer, under the true light: with the
    /// paper's layer under its nine coefficients, which tells what the paper's representation costs; with the lobe under
    /// all bands.
    Oracle(SpecularForm),
    /// What was predicted from the image: maps of the object, which are rendered as those of the
    /// oracle (`normal`, `albedo`, and `reflectance` with `smoothness` for highlights, in a folder
    /// for each object), or else the relit images under the names that the set has.
    Predictions(Predictions, SpecularForm),
}

impl RelightMethod {
    pub(super) fn name(&self) -> String {
        match self {
            Self::Naive => "naive insertion".to_owned(),
            Self::Oracle(SpecularForm::Power) => "oracle, the paper's specular layer".to_owned(),
            Self::Oracle(SpecularForm::Lobe) => "oracle, lobe layer".to_owned(),
            Self::Predictions(predictions, _) => predictions.name(),
        }
    }

    /// What is the same for all lights.
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
            Self::Predictions(predictions, form) => {
                match predictions.surface(&object.name, object.surface.extent())? {
                    Some(surface) => rendered(surface, *form),
                    None => Ok(Relight::Files {
                        predictions,
                        object,
                        part,
                    }),
                }
            }
        }
    }
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
