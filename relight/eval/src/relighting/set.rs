//! The evaluation set in its folder.

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::EvalError;
use crate::predictions::{NO_SET, read_light};
use relight_core::files::read_planes;
use relight_core::image::{Extent, Linear, Planes, Rgb, Transfer};
use relight_core::light::{Normals, ShLight};
use relight_core::render::{Gloss, Surface};

/// The description's schema.
pub(super) const SCHEMA: &str = "relight.relighting/2";
/// The description of a set.
pub(super) const FILE: &str = "relighting.json";

/// The objects of a set and its lights:
///
/// ```text
/// relighting.json             the contents and their inputs; written last
/// lights/<ll>.txt             the light as coefficients of order 24, in the units of the images
/// <ooo>/{mask,normal,albedo}.png      the ground truth of an object: 16 bits, linear, y up
/// <ooo>/<ll>-diffuse.png      the object without highlights under a light, sRGB
/// <ooo>/<ll>-full.png         the same with its highlights
/// ```
#[derive(Debug, Clone)]
pub struct RelightingSet {
    root: PathBuf,
    index: Index,
    lights: Vec<ShLight>,
}

/// `relighting.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Index {
    pub(super) schema: String,
    /// Its program and inputs.
    pub(super) about: String,
    pub(super) lights: Vec<String>,
    pub(super) objects: Vec<ObjectEntry>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct ObjectEntry {
    pub(super) name: String,
    /// The light of the image that is relit.
    pub(super) input: usize,
    /// The paper's s_p.
    pub(super) reflectance: [f32; 3],
    /// The paper's alpha.
    pub(super) smoothness: f32,
}

/// An object of the set with its ground truth.
pub(super) struct Object {
    /// Its folder.
    pub(super) name: String,
    /// The light of the image that is relit.
    pub(super) input: usize,
    pub(super) mask: Vec<bool>,
    pub(super) surface: Surface,
}

/// Which images are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    Diffuse,
    Full,
}

impl Part {
    pub(super) const ALL: [Self; 2] = [Self::Diffuse, Self::Full];

    /// How a table names it.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Diffuse => "diffuse",
            Self::Full => "with specularity",
        }
    }

    /// The name of the image under a light.
    pub(super) fn file(self, light: usize) -> String {
        match self {
            Self::Diffuse => format!("{light:02}-diffuse.png"),
            Self::Full => format!("{light:02}-full.png"),
        }
    }
}

impl RelightingSet {
    /// Opens the set in the folder `root`.
    ///
    /// # Errors
    /// If a file of it cannot be read, or is of another version.
    pub fn open(root: &Path) -> Result<Self, EvalError> {
        let path = root.join(FILE);
        let bytes = fs::read(&path).map_err(EvalError::read(&path))?;
        let index: Index =
            serde_json::from_slice(&bytes).map_err(EvalError::file(&path, NO_SET))?;
        if index.schema != SCHEMA {
            return Err(EvalError::schema(&path, &index.schema, SCHEMA));
        }
        let lights = (0..index.lights.len())
            .map(|number| read_light(&light_file(root, number)))
            .collect::<Result<_, _>>()?;
        Ok(Self {
            root: root.to_owned(),
            index,
            lights,
        })
    }

    /// How many objects there are.
    pub fn objects(&self) -> usize {
        self.index.objects.len()
    }

    /// The lights, in the viewer's frame and in the units of the images.
    pub fn lights(&self) -> &[ShLight] {
        &self.lights
    }

    /// Its inputs, as a sentence.
    pub(super) fn about(&self) -> String {
        self.index.about.clone()
    }

    pub(super) fn object(&self, number: usize) -> Result<Object, EvalError> {
        let entry = &self.index.objects[number];
        let name = object_folder(number);
        let folder = self.root.join(&name);
        let (mask, _) = read_planes(&folder.join("mask.png"))?;
        let normals = Normals::read(&folder.join("normal.png"))?;
        let albedo = Rgb::<Linear>::read(&folder.join("albedo.png"), Transfer::Linear)?;
        let gloss = Gloss::even(normals.extent(), entry.reflectance, entry.smoothness);
        Ok(Object {
            name,
            input: entry.input,
            mask: mask.plane(0).iter().map(|&value| value >= 0.5).collect(),
            surface: Surface::new(normals, albedo, Some(gloss))?,
        })
    }

    /// The true image of an object under a light, sRGB.
    pub(super) fn image(
        &self,
        object: &Object,
        light: usize,
        part: Part,
    ) -> Result<Planes<3>, EvalError> {
        let path = self.root.join(&object.name).join(part.file(light));
        read_image(path, object.surface.extent())
    }
}

impl Object {
    /// The lights under which it is to be shown.
    pub(super) fn targets(&self, set: &RelightingSet) -> impl Iterator<Item = usize> + use<> {
        let input = self.input;
        (0..set.lights.len()).filter(move |&light| light != input)
    }
}

/// The values of an image file, which must have this size.
pub(super) fn read_image(path: PathBuf, expected: Extent) -> Result<Planes<3>, EvalError> {
    let (planes, _) = read_planes(&path)?;
    if planes.extent() == expected {
        return Ok(planes);
    }
    Err(EvalError::size(&path, planes.extent(), expected))
}

pub(super) fn object_folder(number: usize) -> String {
    format!("{number:03}")
}

pub(super) fn light_file(root: &Path, number: usize) -> PathBuf {
    root.join("lights").join(format!("{number:02}.txt"))
}
