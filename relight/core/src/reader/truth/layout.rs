//! Where data sets keep which part of a sample, and how their files are to be understood.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use super::entry::{Entry, Part, Role, name_of};
use super::scenes;
use crate::image::Transfer;
use crate::reader::OpenError;
use crate::reader::listing::listed;

/// How a folder of images with their ground truth is laid out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
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
    /// The part of LIME (Meka et al. 2018) that the paper's warm-up reads: the files of
    /// `Input_Masked`, `Normal` and `Mask`, paired in the order of their names; also of `Albedo` and
    /// `Shading` where those folders are. Assumed, as no description is published: input and albedo
    /// are sRGB, shading is linear, normals are y down as in the paper's colour figure.
    Lime,
    /// ARAP (Bonneel et al. 2017), one folder: the pictures `<scene>.<ext>` or `<scene>_light<n>.<ext>`, beside each
    /// `<name>_albedo.<ext>` (of the picture, or of the scene for all its lights) and perhaps `<name>_shading.<ext>` and
    /// `<name>_mask.png`. HDR and EXR are linear, PNG and JPEG sRGB. Without a mask the whole picture counts, as far as its
    /// albedo is known; without a shading that is picture over albedo.
    Arap,
    /// Stanford-ORB (Kuang et al. 2023), single images: the test pictures of `blender_HDR/<scene>`, else of `blender_LDR`
    /// (sRGB), with their masks, and of `ground_truth/<scene>` the normals and the albedo (PNG: sRGB). All are brought to
    /// 512 x 512 pixels, at which that benchmark measures. Normals are taken as the camera's of Blender: x right, y up.
    Orb,
}

/// How a file of normals holds its axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NormalFile {
    /// Red is x, green is y up.
    YUp,
    /// Red is x, green is y down.
    YDown,
    /// Red is y down, green is x.
    RedDownGreenRight,
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

const LIME: [(Role, &str, bool); 5] = [
    (Role::Mask, "Mask", true),
    (Role::Image, "Input_Masked", true),
    (Role::Normals, "Normal", true),
    (Role::Albedo, "Albedo", false),
    (Role::Shading, "Shading", false),
];

impl TruthLayout {
    /// All layouts.
    pub const ALL: [Self; 6] = [
        Self::Synth,
        Self::Mit,
        Self::Janner,
        Self::Lime,
        Self::Arap,
        Self::Orb,
    ];

    /// The name on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Synth => "synth",
            Self::Mit => "mit",
            Self::Janner => "janner",
            Self::Lime => "lime",
            Self::Arap => "arap",
            Self::Orb => "orb",
        }
    }

    pub(super) const fn expected(self) -> &'static str {
        match self {
            Self::Synth | Self::Mit => "folders with a mask.png each",
            Self::Janner => "files <n>_mask.png, or folders of such",
            Self::Lime => "folders Input_Masked, Normal and Mask",
            Self::Arap => "pictures with a file <name>_albedo beside them",
            Self::Orb => "folders blender_HDR (or blender_LDR) and ground_truth",
        }
    }

    /// How the values of this file stand for light.
    pub(super) const fn transfer(self, role: Role) -> Transfer {
        match (self, role) {
            (Self::Lime | Self::Orb, Role::Image | Role::Albedo)
            | (Self::Synth, Role::Image)
            | (Self::Arap, Role::Image | Role::Albedo | Role::Shading) => Transfer::Srgb,
            _ => Transfer::Linear,
        }
    }

    pub(super) const fn normal_file(self) -> NormalFile {
        match self {
            Self::Synth | Self::Mit | Self::Arap | Self::Orb => NormalFile::YUp,
            Self::Janner => NormalFile::RedDownGreenRight,
            Self::Lime => NormalFile::YDown,
        }
    }

    pub(super) fn entries(self, root: &Path) -> Result<Vec<Entry>, OpenError> {
        match self {
            Self::Synth => folders(root, &SYNTH),
            Self::Mit => folders(root, &MIT),
            Self::Janner => janner(root),
            Self::Lime => lime(root),
            Self::Arap => scenes::arap(root),
            Self::Orb => scenes::orb(root),
        }
    }

    /// The width and height to which larger pictures are brought.
    pub(super) const fn measured_side(self) -> Option<usize> {
        match self {
            Self::Orb => Some(512),
            _ => None,
        }
    }

    /// Whether a picture of its own without highlights is lacking, and that with them stands for it.
    pub(super) const fn has_one_picture(self) -> bool {
        matches!(self, Self::Arap | Self::Orb)
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
fn folders(root: &Path, known: &[(Role, &str, bool)]) -> Result<Vec<Entry>, OpenError> {
    let samples = listed(root, |path| path.join("mask.png").is_file())?;
    Ok(samples
        .iter()
        .map(|folder| Entry {
            name: name_of(folder),
            parts: parts(known, |file| folder.join(file)),
        })
        .collect())
}

fn janner(root: &Path) -> Result<Vec<Entry>, OpenError> {
    let mut entries = numbered(root, "")?;
    for category in listed(root, Path::is_dir)? {
        entries.extend(numbered(&category, &format!("{}/", name_of(&category)))?);
    }
    Ok(entries)
}

/// The numbered samples directly in a folder, in the order of their numbers.
fn numbered(folder: &Path, prefix: &str) -> Result<Vec<Entry>, OpenError> {
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

fn lime(root: &Path) -> Result<Vec<Entry>, OpenError> {
    let masks = listed(&root.join("Mask"), Path::is_file)?;
    let entry = |path: &PathBuf| Entry {
        name: path
            .file_stem()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned(),
        parts: Vec::new(),
    };
    let mut entries: Vec<Entry> = masks.iter().map(entry).collect();
    for (role, name, required) in LIME {
        let folder = root.join(name);
        if !required && !folder.is_dir() {
            continue;
        }
        let files = listed(&folder, Path::is_file)?;
        if files.len() != entries.len() {
            let fault = format!(
                "has {} files and {} has {}: they cannot be paired",
                files.len(),
                root.join("Mask").display(),
                entries.len()
            );
            return Err(OpenError::Content {
                path: folder,
                fault,
            });
        }
        for (entry, path) in entries.iter_mut().zip(files) {
            let required = true;
            entry.parts.push(Part {
                role,
                path,
                required,
            });
        }
    }
    Ok(entries)
}

fn parts(known: &[(Role, &str, bool)], path: impl Fn(&str) -> PathBuf) -> Vec<Part> {
    let part = |&(role, file, required): &(Role, &str, bool)| Part {
        role,
        path: path(file),
        required,
    };
    known.iter().map(part).collect()
}
