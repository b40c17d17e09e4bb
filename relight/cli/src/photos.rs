//! Options of photographs that are decomposed, and of the files that they come from, which several verbs take.

use std::path::{Path, PathBuf};

use clap::Args;
use relight_photo::decompose::{DecomposeError, DecomposeOptions, Decomposer, SpecularGate};
use relight_photo::files::UnusedFile;
use relight_photo::nets::{NetError, Weights};
use relit_console::Console;
use serde_json::json;

use crate::shipped;
use crate::values::{GATES, one_of};

/// How photographs are decomposed.
#[derive(Args)]
pub(crate) struct NetworkArguments {
    /// The network's weights (.safetensors) [default: those that come with the program].
    #[arg(long, value_name = "FILE")]
    weights: Option<PathBuf>,
    /// Separate highlights.
    #[arg(long, default_value = "auto", value_parser = one_of(GATES))]
    specular: SpecularGate,
}

/// The network and how it is used.
pub(crate) struct Network {
    pub(crate) decomposer: Decomposer,
    pub(crate) options: DecomposeOptions,
}

impl NetworkArguments {
    pub(crate) fn read(&self) -> Result<Network, DecomposeError> {
        let (weights, _) = self.weights()?;
        Ok(Network {
            decomposer: Decomposer::new(&weights)?,
            options: self.options(),
        })
    }

    /// The weights, and how they are named.
    pub(crate) fn weights(&self) -> Result<(Weights, String), NetError> {
        let Some(path) = &self.weights else {
            return Ok((shipped::weights()?, "shipped".to_owned()));
        };
        let name = path.file_name().unwrap_or(path.as_os_str());
        Ok((Weights::read(path)?, name.to_string_lossy().into_owned()))
    }

    pub(crate) fn options(&self) -> DecomposeOptions {
        DecomposeOptions {
            specular: self.specular,
            ..DecomposeOptions::default()
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
        let event = json!({ "event": "unused", "file": file.path, "message": file.message });
        console.warn_with(&file.message, &event);
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
