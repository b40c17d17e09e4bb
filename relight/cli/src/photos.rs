//! Options of photographs that are decomposed, and of the files that they come from, which several verbs take.

use std::error::Error;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use relight_core::files::OutputKind;
use relight_core::image::Depth;
use relight_nets::Weights;
use relight_photo::decompose::{DecomposeError, DecomposeOptions, Decomposer};
use relight_photo::files::UnusedFile;
use relit_console::Console;
use serde_json::json;

use crate::shipped;
use crate::values::GateName;

/// How photographs are decomposed.
#[derive(Args)]
pub(crate) struct NetworkArguments {
    /// The network's weights (.safetensors or .pth) [default: those that come with the program].
    #[arg(long, value_name = "FILE")]
    weights: Option<PathBuf>,
    /// Separate highlights.
    #[arg(long, value_enum, default_value_t = GateName::Auto)]
    specular: GateName,
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
            specular: self.specular.into(),
            ..DecomposeOptions::default()
        };
        Ok(Network {
            decomposer,
            options,
        })
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

impl Bits {
    /// What is wrong with so many bits in a file of this name, if anything is.
    pub(crate) fn fault(self, output: &Path) -> Option<String> {
        let is_jpeg = OutputKind::of(output) == Some(OutputKind::Jpeg);
        (is_jpeg && matches!(self, Self::Sixteen)).then(|| {
            format!(
                "--output {}: a JPEG has 8 bits; give .png for --bits 16",
                output.display()
            )
        })
    }
}

impl From<Bits> for Depth {
    fn from(bits: Bits) -> Self {
        match bits {
            Bits::Eight => Self::Eight,
            Bits::Sixteen => Self::Sixteen,
        }
    }
}

/// Whether a path is that of the masks or of what is written.
pub(crate) fn is_at(path: &Path, masks: Option<&Path>, output: &Path) -> bool {
    let real = |path: &Path| path.canonicalize().ok();
    let known = masks.into_iter().chain([output]);
    known
        .filter_map(real)
        .any(|known| Some(known) == real(path))
}

/// Names the files of folders that are not used.
pub(crate) fn name_unused(unused: &[UnusedFile], console: Console) {
    for file in unused {
        let text = file.to_string();
        let event = json!({ "event": "unused", "file": file.path(), "message": text });
        console.warn_with(&text, &event);
    }
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
