//! Options of photographs that are taken apart, and pictures that are written, which several verbs take.

use std::error::Error;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use relight_core::files::MovieFormat;
use relight_core::files::write_png;
use relight_core::image::{Depth, Extent, Linear, Planes, Rgb, Srgb};
use relight_nets::Weights;
use relight_photo::decompose::{DecomposeError, DecomposeOptions, Decomposer, Photo, SpecularGate};
use relight_photo::insert::{InsertError, Subject};

use crate::shipped;

/// How photographs are taken apart.
#[derive(Args)]
pub(crate) struct NetworkArguments {
    /// The network's weights (.safetensors or .pth) [default: those that come with the program].
    #[arg(long, value_name = "FILE")]
    weights: Option<PathBuf>,
    /// Separate highlights.
    #[arg(long, value_enum, default_value_t = GateName::Auto)]
    specular: GateName,
}

#[derive(Clone, Copy, ValueEnum)]
enum GateName {
    /// Where more than 5 % of the object's pixels are saturated.
    Auto,
    /// Always.
    On,
    /// Never.
    Off,
}

/// The network and how it is used.
pub(crate) struct Network {
    pub(crate) decomposer: Decomposer,
    pub(crate) options: DecomposeOptions,
}

impl NetworkArguments {
    pub(crate) fn read(&self) -> Result<Network, DecomposeError> {
        let decomposer = match &self.weights {
            None => shipped::decomposer()?,
            Some(path) => Decomposer::new(&Weights::read(path)?)?,
        };
        let options = DecomposeOptions {
            specular: match self.specular {
                GateName::Auto => SpecularGate::Auto,
                GateName::On => SpecularGate::On,
                GateName::Off => SpecularGate::Off,
            },
            ..DecomposeOptions::default()
        };
        Ok(Network {
            decomposer,
            options,
        })
    }
}

impl Network {
    /// The object of a photograph.
    pub(crate) fn subject(&self, photo: &Photo) -> Result<Subject, InsertError> {
        let options = photo.options(&self.options);
        Subject::new(
            &photo.picture,
            &photo.mask,
            photo.alpha.as_ref(),
            &self.decomposer,
            &options,
        )
    }
}

/// The photograph at most so many pixels long.
pub(crate) fn at_most(mut photo: Photo, longest: Option<usize>) -> Photo {
    let Extent { width, height } = photo.picture.planes().extent();
    let Some(longest) = longest.filter(|&longest| longest < width.max(height)) else {
        return photo;
    };
    let side = |pixels: usize| (pixels * longest / width.max(height)).max(1);
    let extent = Extent::new(side(width), side(height));
    photo.picture = Rgb::new(photo.picture.planes().resized(extent));
    let share = photo.mask.resized(extent);
    photo.mask = share.map(|m| f32::from(u8::from(m >= 0.5)));
    photo.alpha = photo.alpha.map(|alpha| alpha.resized(extent));
    photo
}

/// The kinds of file that come out.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum OutputKind {
    Png,
    Exr,
    Movie(MovieFormat),
}

impl OutputKind {
    /// What a file's ending asks for.
    pub(crate) fn of(path: &Path) -> Option<Self> {
        let ending = path.extension()?;
        match MovieFormat::of(path) {
            Some(format) => Some(Self::Movie(format)),
            None if ending.eq_ignore_ascii_case("png") => Some(Self::Png),
            None if ending.eq_ignore_ascii_case("exr") => Some(Self::Exr),
            None => None,
        }
    }
}

/// Bits of a PNG.
#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum Bits {
    #[value(name = "8")]
    Eight,
    #[value(name = "16")]
    Sixteen,
}

/// Writes a picture: linear into an EXR, encoded into a PNG.
pub(crate) fn write_picture(
    path: &Path,
    picture: &Rgb<Linear>,
    bits: Bits,
) -> Result<(), Box<dyn Error>> {
    match OutputKind::of(path) {
        Some(OutputKind::Exr) => picture.write_exr(path)?,
        _ => {
            let depth = match bits {
                Bits::Eight => Depth::Eight,
                Bits::Sixteen => Depth::Sixteen,
            };
            let encoded: Planes<3> = picture.clone().encode::<Srgb>().into_planes();
            write_png(path, &encoded, depth)?;
        }
    }
    Ok(())
}

/// The mask of a photograph of this name: the file itself, or that of the photograph in a folder of masks.
pub(crate) fn own_mask(mask: &Path, name: &str) -> PathBuf {
    if mask.is_dir() {
        return mask.join(format!("{name}.png"));
    }
    mask.to_owned()
}

/// Refuses to overwrite a file that is read.
pub(crate) fn not_an_input(output: &Path, inputs: &[PathBuf]) -> Result<(), String> {
    let Ok(place) = output.canonicalize() else {
        // There is no such file yet.
        return Ok(());
    };
    let is_same = |input: &&PathBuf| input.canonicalize().is_ok_and(|input| input == place);
    inputs.iter().find(is_same).map_or(Ok(()), |_| {
        Err(format!(
            "{} is read as well: give the result another name",
            output.display()
        ))
    })
}

/// The files that patterns with *, ? and [...] name; what is no pattern, or names a file, stays.
pub(crate) fn globbed(paths: &[PathBuf]) -> Result<Vec<PathBuf>, Box<dyn Error>> {
    let mut found = Vec::new();
    for path in paths {
        let text = path.to_string_lossy();
        if path.exists() || !text.contains(['*', '?', '[']) {
            found.push(path.clone());
            continue;
        }
        let before = found.len();
        for file in glob::glob(&text)? {
            found.push(file?);
        }
        if found.len() == before {
            return Err(format!("{text} names no file").into());
        }
    }
    Ok(found)
}
