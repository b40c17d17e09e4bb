//! Values of options that several verbs take.

use clap::ValueEnum;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use relight_core::image::Transfer;
use relight_core::light::NormalsFrame;
use relight_photo::decompose::SpecularGate;
use relight_photo::insert::WhiteBalance;
use relit_data::rig::RotationDirection;

/// How integers in files of colour are encoded.
#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum TransferName {
    /// The transfer function of sRGB.
    Srgb,
    /// The power 1 / 2.2.
    Gamma22,
    /// In proportion to light.
    Linear,
}

impl From<TransferName> for Transfer {
    fn from(name: TransferName) -> Self {
        match name {
            TransferName::Srgb => Self::Srgb,
            TransferName::Gamma22 => Self::Gamma22,
            TransferName::Linear => Self::Linear,
        }
    }
}

/// Which way y points in maps of normals.
#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum YName {
    /// As relight writes them.
    Up,
    /// As in the paper's figures and released code and data.
    Down,
}

impl From<YName> for NormalsFrame {
    fn from(name: YName) -> Self {
        match name {
            YName::Up => Self::YUp,
            YName::Down => Self::YDown,
        }
    }
}

/// How the colour of new light is shown.
#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum WhiteName {
    /// As the light has it.
    Light,
    /// As by a camera that is balanced for it: white is as grey as in the picture around.
    Auto,
}

impl From<WhiteName> for WhiteBalance {
    fn from(name: WhiteName) -> Self {
        match name {
            WhiteName::Light => Self::Light,
            WhiteName::Auto => Self::Auto,
        }
    }
}

/// Whether highlights are separated.
#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum GateName {
    /// Where more than 5 % of the object's pixels are saturated.
    Auto,
    /// Always.
    On,
    /// Never.
    Off,
}

impl From<GateName> for SpecularGate {
    fn from(name: GateName) -> Self {
        match name {
            GateName::Auto => Self::Auto,
            GateName::On => Self::On,
            GateName::Off => Self::Off,
        }
    }
}

/// Which way a table turns as its angle grows, seen from above; the help lists both.
pub(crate) fn rotation() -> impl TypedValueParser<Value = RotationDirection> {
    let all = RotationDirection::ALL;
    PossibleValuesParser::new(all.map(RotationDirection::name)).map(move |name| {
        let is_it = |direction: &RotationDirection| direction.name() == name;
        all.into_iter().find(is_it).unwrap_or_default()
    })
}
