//! Values of options that several verbs take.

use clap::ValueEnum;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use relight_core::image::Transfer;
use relight_core::light::NormalsFrame;
use relight_photo::decompose::SpecularGate;
use relight_photo::insert::WhiteBalance;

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

/// A value that has a name, which the help lists and explains.
pub(crate) fn named<T: Clone + Send + Sync + 'static, const N: usize>(
    values: [(&'static str, &'static str, T); N],
) -> impl TypedValueParser<Value = T> {
    let names = values
        .each_ref()
        .map(|(name, help, _)| PossibleValue::new(*name).help(*help));
    PossibleValuesParser::new(names).try_map(move |given| {
        let mut all = values.iter();
        let found = all.find(|(name, ..)| *name == given);
        found.map(|(_, _, value)| value.clone()).ok_or("unknown")
    })
}
