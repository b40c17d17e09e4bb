//! The files of a sample in each data set, and their conventions.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use crate::image::Transfer;
use crate::reader::ReadError;
use crate::reader::listing::listed;

/// How a folder of images with their ground truth is laid out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TruthLayout {
    /// MIT Intrinsic Images (Grosse et al. 2009), as the release of SIRFS has it:
    /// `<object>/{original,diffuse,reflectance,shading,specular,mask}.png`, 16 bits, linear, and
    /// where they are known `normal.png`, y up, with `normal_valid.png`.
    Mit,
    /// The intrinsic images of Janner et al. 2017:
    /// `<category>/<n>_{composite,albedo,shading,specular,normals,mask}.png` (or the files of one
    /// category alone), 8 bits. Values are taken as linear, as their own loader multiplies albedo and
    /// shading as they stand. Their normals hold **y down in red and x in green**; blue is z.
    Janner,
    /// What `relight synth` writes:
    /// `<number>/{image,mask,normal,albedo,shading,highlight}.png`, `light.txt` and `sample.json`. The
    /// image is taken as sRGB; the camera's own response is close to it.
    Synth,
}

/// What a file is of a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    Image,
    Diffuse,
    Normals,
    NormalsValid,
    Albedo,
    Shading,
    Highlight,
    Mask,
    Light,
    /// The largest values that `shading` and `highlight` stand for.
    Whites,
}

/// A file of a sample.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Part {
    pub(super) role: Role,
    pub(super) path: PathBuf,
    /// Whether the sample is damaged without it.
    pub(super) required: bool,
}

/// A sample's name and files.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Entry {
    pub(super) name: String,
    pub(super) parts: Vec<Part>,
}

const MIT: [(Role, &str, bool); 8] = [
    (Role::Mask, "mask.png", true),
    (Role::Image, "original.png", true),
    (Role::Diffuse, "diffuse.png", true),
    (Role::Albedo, "reflectance.png", true),
    (Role::Shading, "shading.png", true),
    (Role::Highlight, "specular.png", true),
    (Role::Normals, "normal.png", false),
    (Role::NormalsValid, "normal_valid.png", false),
];

const JANNER: [(Role, &str, bool); 6] = [
    (Role::Mask, "mask.png", true),
    (Role::Normals, "normals.png", true),
    (Role::Albedo, "albedo.png", true),
    (Role::Shading, "shading.png", true),
    (Role::Image, "composite.png", false),
    (Role::Highlight, "specular.png", false),
];

const SYNTH: [(Role, &str, bool); 8] = [
    (Role::Mask, "mask.png", true),
    (Role::Image, "image.png", true),
    (Role::Normals, "normal.png", true),
    (Role::Albedo, "albedo.png", true),
    (Role::Shading, "shading.png", true),
    (Role::Highlight, "highlight.png", true),
    (Role::Light, "light.txt", true),
    (Role::Whites, "sample.json", true),
];

impl TruthLayout {
    /// All layouts.
    pub const ALL: [Self; 3] = [Self::Synth, Self::Mit, Self::Janner];

    /// The name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Synth => "synth",
            Self::Mit => "mit",
            Self::Janner => "janner",
        }
    }

    pub(super) const fn expected(self) -> &'static str {
        match self {
            Self::Synth | Self::Mit => "folders with a mask.png each",
            Self::Janner => "files <n>_mask.png, or folders of such",
        }
    }

    /// How the values of this file stand for light.
    pub(super) const fn transfer(self, role: Role) -> Transfer {
        match (self, role) {
            (Self::Synth, Role::Image) => Transfer::Srgb,
            _ => Transfer::Linear,
        }
    }

    pub(super) fn entries(self, root: &Path) -> Result<Vec<Entry>, ReadError> {
        match self {
            Self::Synth => folders(root, &SYNTH),
            Self::Mit => folders(root, &MIT),
            Self::Janner => janner(root),
        }
    }
}

impl fmt::Display for TruthLayout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for TruthLayout {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let names = || Self::ALL.map(Self::name).join(", ");
        let found = Self::ALL.into_iter().find(|layout| layout.name() == text);
        found.ok_or_else(|| format!("{text:?} is not a layout: give one of {}", names()))
    }
}

/// Samples that have a folder each, known by their mask.
fn folders(root: &Path, known: &[(Role, &str, bool)]) -> Result<Vec<Entry>, ReadError> {
    let samples = listed(root, |path| path.join("mask.png").is_file())?;
    Ok(samples
        .iter()
        .map(|folder| Entry {
            name: name_of(folder),
            parts: parts(known, |file| folder.join(file)),
        })
        .collect())
}

fn janner(root: &Path) -> Result<Vec<Entry>, ReadError> {
    let mut entries = numbered(root, "")?;
    for category in listed(root, Path::is_dir)? {
        entries.extend(numbered(&category, &format!("{}/", name_of(&category)))?);
    }
    Ok(entries)
}

/// The numbered samples directly in a folder, in the order of their numbers.
fn numbered(folder: &Path, prefix: &str) -> Result<Vec<Entry>, ReadError> {
    let number = |path: &PathBuf| -> Option<u64> {
        let name = path.file_name()?.to_str()?;
        name.strip_suffix("_mask.png")?.parse().ok()
    };
    let masks = listed(folder, Path::is_file)?;
    let mut numbers: Vec<u64> = masks.iter().filter_map(number).collect();
    numbers.sort_unstable();
    Ok(numbers
        .into_iter()
        .map(|n| Entry {
            name: format!("{prefix}{n}"),
            parts: parts(&JANNER, |file| folder.join(format!("{n}_{file}"))),
        })
        .collect())
}

/// The last part of a path.
fn name_of(path: &Path) -> String {
    path.file_name()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned()
}

fn parts(known: &[(Role, &str, bool)], path: impl Fn(&str) -> PathBuf) -> Vec<Part> {
    let part = |&(role, file, required): &(Role, &str, bool)| Part {
        role,
        path: path(file),
        required,
    };
    known.iter().map(part).collect()
}
