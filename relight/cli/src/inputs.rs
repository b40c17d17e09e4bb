//! Options for reading files and networks, shared by several verbs.

use std::path::PathBuf;

use clap::Args;
use relight_core::image::Transfer;
use relight_core::light::NormalsFrame;
use relight_photo::nets::{NetError, Weights};

use crate::values::{NORMALS_Y, TRANSFERS, one_of};

/// How files of colour are encoded.
#[derive(Args)]
pub(crate) struct TransferArgument {
    /// Encoding of integer colours; EXR and HDR are linear [default: from the file, else sRGB].
    #[arg(long, value_parser = one_of(TRANSFERS))]
    pub(crate) transfer: Option<Transfer>,
}

/// Which way maps of normals have y.
#[derive(Args)]
pub(crate) struct NormalsArgument {
    /// Direction of y in the normals that are read.
    #[arg(long, value_name = "WAY", default_value = "up", value_parser = one_of(NORMALS_Y))]
    pub(crate) normals_y: NormalsFrame,
}

/// The weights of the network that a verb runs.
#[derive(Args)]
pub(crate) struct WeightsArgument {
    /// The network's weights (.safetensors) [default: built in].
    #[arg(long, value_name = "FILE")]
    weights: Option<PathBuf>,
}

impl WeightsArgument {
    /// The weights, or else the built-in ones, and their name.
    pub(crate) fn read_or(
        &self,
        shipped: fn() -> Result<Weights, NetError>,
    ) -> Result<(Weights, String), NetError> {
        let Some(path) = &self.weights else {
            return Ok((shipped()?, "shipped".to_owned()));
        };
        let name = path.file_name().unwrap_or(path.as_os_str());
        Ok((Weights::read(path)?, name.to_string_lossy().into_owned()))
    }
}
