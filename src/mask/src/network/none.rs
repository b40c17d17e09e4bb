//! A program without the feature `networks` runs none.

use std::path::PathBuf;

use image::RgbImage;
use relit_grabcut::Hints;

use super::RecordedNetwork;
use crate::MaskingError;

const WITHOUT_NETWORKS: &str = "networks are not built into this relit-mask: build it with `cargo build --release -p relit-mask --features networks`, or leave out --model";

/// No network.
#[derive(Debug)]
pub(crate) enum Network {}

impl Network {
    pub(crate) fn open(_: &[PathBuf], _: &Hints) -> Result<Self, MaskingError> {
        Err(MaskingError::Refused(WITHOUT_NETWORKS.to_owned()))
    }

    pub(crate) fn marks(&self, _: &RgbImage, _: &Hints) -> Result<Hints, MaskingError> {
        match *self {}
    }

    pub(crate) fn recorded(&self) -> RecordedNetwork {
        match *self {}
    }
}
