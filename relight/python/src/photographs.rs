//! Photographs: decomposed, relit, put into other pictures, and their masks.

use std::path::PathBuf;

use image::RgbImage;
use numpy::PyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use relight_core::image::{Extent, Planes, StoredImage, Transfer};
use relight_photo::compositing::{SceneDescription, SceneObject};
use relight_photo::decompose::{
    DecomposeError, DecomposeOptions, Decomposition, Photo, PhotoHints, SpecularGate,
};
use relight_photo::export::{is_object, read_object};
use relight_photo::files::{BackgroundFile, InsertSource, Insertion};
use relight_photo::relighting::{
    Backdrop, LightSource, PanoramaView, RelightableObject, RelightingSequence, WhiteBalance,
};
use relit_data::geometry::Rect;
use relit_grabcut::{Hints, Seeds, SegmentSettings, segment};

use crate::arrays::{Array, Picture, read, transfer};
use crate::failure::{Failure, choice, unlocked};
use crate::light::Light;
use crate::networks::decomposer;

/// A photograph from the package: the picture, its mask, a rectangle, and the encoding of integers.
pub(crate) struct Photograph {
    picture: Picture,
    mask: Option<Picture>,
    rectangle: Option<Rect>,
    transfer: Option<Transfer>,
}

/// x, y, width and height.
type Rectangle = (i32, i32, u32, u32);

impl<'py> FromPyObject<'_, 'py> for Photograph {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let (picture, mask, rectangle, encoding): (_, _, Option<Rectangle>, Option<String>) =
            given.extract()?;
        Ok(Self {
            picture,
            mask,
            rectangle: rectangle.map(|(x, y, w, h)| Rect::new(x, y, w, h)),
            transfer: transfer(encoding.as_deref())?,
        })
    }
}

impl Photograph {
    /// The photograph with its mask, as the program reads it.
    pub(crate) fn load(self) -> Result<Photo, Failure> {
        let mask: Option<(PathBuf, StoredImage)> = match self.mask {
            Some(mask) => Some((mask.path().to_owned(), mask.stored()?)),
            None => None,
        };
        let hints = PhotoHints {
            mask: mask.as_ref().map(|(path, image)| (path.as_path(), image)),
            rectangle: self.rectangle,
            transfer: self.transfer,
        };
        let path = self.picture.path().to_owned();
        let photo = match self.picture {
            Picture::File(path) => Photo::from_bytes(&path, &read(&path)?, &hints),
            picture => Photo::from_image(&path, picture.colours(self.transfer)?, &hints),
        };
        photo.map_err(|error| match error {
            DecomposeError::NoMask { path } => Failure::value(format!(
                "{} does not say where the object is: give a mask, such as relit.mask(image, box=(x, y, width, height))",
                path.display()
            )),
            error => error.into(),
        })
    }
}

fn gate(name: &str) -> PyResult<SpecularGate> {
    let choices = [
        ("auto", SpecularGate::Auto),
        ("on", SpecularGate::On),
        ("off", SpecularGate::Off),
    ];
    choice("highlights", name, &choices)
}

/// A photograph's layers and light, by name, and what a person may want to know of the photograph.
#[pyfunction]
pub(crate) fn decompose<'py>(
    py: Python<'py>,
    photograph: Photograph,
    highlights: &str,
    mirror: bool,
) -> PyResult<(Bound<'py, PyDict>, Vec<String>)> {
    let options = DecomposeOptions {
        mirror,
        specular: gate(highlights)?,
        ..DecomposeOptions::default()
    };
    let ((layers, mask), found, notes) = unlocked(py, || {
        let photo = photograph.load()?;
        let options = photo.options(&options);
        let found = decomposer()?.decompose(&photo.picture, &photo.mask, &options)?;
        let mask = Array::from_mask(&photo.mask);
        Ok(((layers(&found, &photo.mask), mask), found, photo.notes))
    })?;
    let fields = PyDict::new(py);
    for (name, layer) in layers {
        fields.set_item(name, layer.into_python(py)?)?;
    }
    fields.set_item("mask", mask.into_python(py)?)?;
    fields.set_item("light", Array::from_light(&found.light).into_python(py)?)?;
    let gloss = found
        .gloss
        .map(|gloss| (gloss.reflectance, gloss.smoothness));
    fields.set_item("specular", gloss)?;
    fields.set_item("saturated_fraction", found.saturated_fraction)?;
    fields.set_item("residual", found.residual)?;
    Ok((fields, notes))
}

/// The layers of a decomposition by name.
fn layers(found: &Decomposition, mask: &Planes<1>) -> [(&'static str, Array<f32>); 5] {
    // Paint outside the mask is 0, which would be certain.
    let mut confidence = found.paint().map(|paint| (2.0 * paint - 1.0).abs());
    let pixels = confidence.planes_mut()[0].iter_mut().zip(mask.plane(0));
    pixels.for_each(|(value, &mask)| *value *= f32::from(u8::from(mask >= 0.5)));
    [
        ("normals", Array::from_planes(found.normals.planes())),
        ("albedo", Array::from_planes(found.albedo.planes())),
        ("shading", Array::from_planes(&found.shading)),
        ("highlight", Array::from_planes(&found.highlight)),
        ("confidence", Array::from_planes(&confidence)),
    ]
}

/// The background of a relit object.
#[derive(Clone, Copy)]
enum Behind {
    Photo,
    Light,
    Even(f32),
}

/// A picture for each angle, and what is to be known of the photograph.
type RelitPictures<'py> = (Vec<Bound<'py, PyArrayDyn<f32>>>, Vec<String>);

/// A photograph's object in another light: a picture for each angle by which it has turned, degrees.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "Python names them")]
pub(crate) fn relight<'py>(
    py: Python<'py>,
    photograph: Photograph,
    light: Option<Light>,
    turned: Vec<f64>,
    background: Option<String>,
    field: f64,
    white_balance: &str,
    exposure: f32,
    size: Option<usize>,
    highlights: &str,
) -> PyResult<RelitPictures<'py>> {
    let white_balance = balance(white_balance)?;
    let choices = [
        ("photo", Behind::Photo),
        ("light", Behind::Light),
        ("grey", Behind::Even(0.18)),
        ("black", Behind::Even(0.0)),
        ("white", Behind::Even(1.0)),
    ];
    let background = background.map(|name| choice("background", &name, &choices));
    let background = background.transpose()?;
    let options = DecomposeOptions {
        specular: gate(highlights)?,
        ..DecomposeOptions::default()
    };
    let (pictures, notes) = unlocked(py, || {
        let light = match light {
            Some(light) => Some(white_balance.shown(light.source()?)?),
            None => None,
        };
        let photo = photograph.load()?;
        let photo = match size {
            Some(longest) => photo.at_most(longest),
            None => photo,
        };
        let relightable = RelightableObject::from_photo(&photo, decomposer()?, &options)?;
        let extent = photo.picture.planes().extent();
        let backdrop = backdrop(background, light.as_ref(), field, extent)?;
        let own = LightSource::Coefficients(relightable.light.clone());
        let light = light.as_ref().unwrap_or(&own).light()?;
        let shot = RelightingSequence::new(
            &photo.picture,
            &relightable,
            &light,
            backdrop,
            exposure.exp2(),
        )?;
        let picture = |degrees: &f64| {
            let picture = shot.picture(degrees.to_radians())?;
            Ok::<_, Failure>(Array::from_planes(picture.planes()))
        };
        let pictures = turned.iter().map(picture).collect::<Result<Vec<_>, _>>()?;
        Ok((pictures, photo.notes))
    })?;
    let pictures = pictures.into_iter().map(|picture| picture.into_python(py));
    Ok((pictures.collect::<PyResult<_>>()?, notes))
}

/// By default the panorama that lights the object, its photograph in its own light, or grey.
fn backdrop(
    background: Option<Behind>,
    light: Option<&LightSource>,
    field: f64,
    extent: Extent,
) -> Result<Backdrop, Failure> {
    let panorama = match light {
        Some(LightSource::Panorama(panorama)) => Some(panorama),
        _ => None,
    };
    let background = background.unwrap_or(match (light, panorama) {
        (None, _) => Behind::Photo,
        (_, Some(_)) => Behind::Light,
        (_, None) => Behind::Even(0.18),
    });
    match (background, panorama) {
        (Behind::Photo, _) => Ok(Backdrop::Photo),
        (Behind::Even(value), _) => Ok(Backdrop::Even([value; 3])),
        (Behind::Light, Some(panorama)) => {
            let view = PanoramaView::new(extent, field, 0.0);
            Ok(Backdrop::Panorama(view, panorama.clone()))
        }
        (Behind::Light, None) => Err(Failure::value(
            "background=\"light\" needs a panorama: give one as light",
        )),
    }
}

fn balance(name: &str) -> PyResult<WhiteBalance> {
    let choices = [
        ("adapted", WhiteBalance::Adapted),
        ("light", WhiteBalance::Light),
        ("auto", WhiteBalance::Auto),
    ];
    choice("white_balance", name, &choices)
}

/// Objects in another picture. `scene` is the scene as JSON, with the names of a scene's file.
#[pyfunction]
pub(crate) fn insert<'py>(
    py: Python<'py>,
    photographs: Vec<Photograph>,
    into: Picture,
    scene: &str,
    light: Option<Light>,
    highlights: &str,
) -> PyResult<(Bound<'py, PyArrayDyn<f32>>, Vec<String>)> {
    let options = DecomposeOptions {
        specular: gate(highlights)?,
        ..DecomposeOptions::default()
    };
    let (picture, notes) = unlocked(py, || {
        let scene: SceneDescription = serde_json::from_str(scene)?;
        scene.check()?;
        let sources = photographs.into_iter().map(inserted);
        let sources = sources.collect::<Result<Vec<_>, _>>()?;
        let background = background(into, &scene)?;
        let light = light.map(|light| light.source()).transpose()?;
        let (mut relightables, mut notes) = (Vec::new(), background.notes().to_vec());
        let insertion = Insertion::in_light(&scene, background, light, decomposer()?, options)?;
        for (object, source) in scene.objects.iter().zip(sources) {
            if let InsertSource::Photo(photo) = &source {
                notes.extend(photo.notes.clone());
            }
            relightables.push(insertion.relightable(object, source)?);
        }
        let pairs = scene.objects.iter().zip(&relightables);
        let objects =
            pairs.map(|(object, relightable)| SceneObject::described(object, relightable));
        let set = insertion.environment().scene(objects.collect())?;
        let picture = insertion.picture(&set)?;
        Ok((Array::from_planes(picture.planes()), notes))
    })?;
    Ok((picture.into_python(py)?, notes))
}

/// The source of an object: a photograph, or a captured object's file.
fn inserted(photograph: Photograph) -> Result<InsertSource, Failure> {
    match &photograph.picture {
        Picture::File(path) if is_object(path) => {
            if photograph.mask.is_some() {
                return Err(Failure::value(format!(
                    "{} has its own mask: do not give one",
                    path.display()
                )));
            }
            Ok(InsertSource::Captured(Box::new(read_object(path)?)))
        }
        _ => Ok(InsertSource::Photo(Box::new(photograph.load()?))),
    }
}

/// A background: a file; or an array, which is a panorama where it is of light and twice as wide as high.
fn background(picture: Picture, scene: &SceneDescription) -> Result<BackgroundFile, Failure> {
    let image = match picture {
        Picture::File(path) => return Ok(BackgroundFile::read(&path, scene)?),
        Picture::Memory(image) => image,
    };
    let is_light = matches!(
        image,
        image::DynamicImage::ImageRgb32F(_) | image::DynamicImage::ImageRgba32F(_)
    );
    let is_panorama = is_light && image.width() == 2 * image.height();
    let picture = Picture::Memory(image).colours(None)?;
    Ok(if is_panorama {
        let panorama = relight_core::light::Panorama::new(picture.into_light())?;
        BackgroundFile::from_panorama(panorama, scene)
    } else {
        BackgroundFile::from_picture(picture)
    })
}

/// The object's mask by GrabCut, and what its user should check.
#[pyfunction]
pub(crate) fn mask<'py>(
    py: Python<'py>,
    image: Picture,
    rectangle: Option<Rectangle>,
    seeds: Option<Picture>,
    keep_all: bool,
) -> PyResult<(Bound<'py, PyArrayDyn<bool>>, Vec<String>)> {
    let (mask, warnings) = unlocked(py, || {
        let shown = image.colours(None)?.to_srgb();
        let extent = shown.planes().extent();
        let [width, height] = extent.sides();
        let frame = RgbImage::from_raw(width, height, shown.planes().to_bytes());
        let seeds = match seeds {
            None => None,
            Some(Picture::File(path)) => Some(Seeds::from_png(&read(&path)?)?),
            Some(Picture::Memory(image)) => Some(Seeds::from_image(&image)?),
        };
        let hints = Hints {
            rect: rectangle.map(|(x, y, w, h)| Rect::new(x, y, w, h)),
            seeds,
            ..Hints::default()
        };
        let found = segment(
            &frame.unwrap_or_default(),
            &hints,
            &SegmentSettings { keep_all },
        )?;
        let inside = found.image.as_raw().iter().map(|&level| level > 0);
        let shape = vec![extent.height, extent.width];
        Ok((Array::new(shape, inside.collect()), found.warnings))
    })?;
    Ok((mask.into_python(py)?, warnings))
}

/// The light of a picture's file, with alpha where it has it.
#[pyfunction]
pub(crate) fn read_image<'py>(
    py: Python<'py>,
    path: PathBuf,
    encoding: Option<String>,
) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
    let encoding = transfer(encoding.as_deref())?;
    let array = unlocked(py, || {
        let image = Picture::File(path).colours(encoding)?;
        let alpha = image.stored().alpha.clone();
        let light = image.into_light().into_planes();
        Ok(match alpha {
            None => Array::from_planes(&light),
            Some(alpha) => {
                let extent = light.extent();
                let ([red, green, blue], [alpha]) = (light.into_planes(), alpha.into_planes());
                Array::from_planes(&Planes::from_planes(extent, [red, green, blue, alpha])?)
            }
        })
    })?;
    array.into_python(py)
}
