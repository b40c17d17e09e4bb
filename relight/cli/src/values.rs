//! Values of options that several verbs take.

use std::fmt::Display;
use std::ops::RangeInclusive;
use std::str::FromStr;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use relight_core::image::Transfer;
use relight_core::light::NormalsFrame;
use relight_photo::decompose::SpecularGate;
use relight_photo::relighting::WhiteBalance;

/// Values of an option: the name on the command line, its help, and its meaning.
pub(crate) type Choices<T> = &'static [(&'static str, &'static str, T)];

/// How integers in files of colour are encoded.
pub(crate) const TRANSFERS: Choices<Transfer> = &[
    ("srgb", "sRGB transfer function", Transfer::Srgb),
    ("gamma22", "Power 1 / 2.2", Transfer::Gamma22),
    ("linear", "Linear light", Transfer::Linear),
];

/// Which way y points in maps of normals.
pub(crate) const NORMALS_Y: Choices<NormalsFrame> = &[
    ("up", "As relight writes them", NormalsFrame::YUp),
    (
        "down",
        "As in the paper's figures, code and data",
        NormalsFrame::YDown,
    ),
];

/// How the colour of new light is shown.
pub(crate) const WHITE_BALANCES: Choices<WhiteBalance> = &[
    (
        "adapted",
        "Partly adapted to a lamp, as the eye is; a panorama keeps its colour",
        WhiteBalance::Adapted,
    ),
    ("light", "The light keeps its colour", WhiteBalance::Light),
    (
        "auto",
        "As by a camera balanced for the light: white is as neutral as in the background",
        WhiteBalance::Auto,
    ),
];

/// Whether highlights are separated.
pub(crate) const GATES: Choices<SpecularGate> = &[
    (
        "auto",
        "If more than 5 % of the object's pixels are saturated",
        SpecularGate::Auto,
    ),
    ("on", "Always", SpecularGate::On),
    ("off", "Never", SpecularGate::Off),
];

/// The parser of an option that takes one of these values; the help lists them.
pub(crate) fn one_of<T: Copy + Send + Sync>(
    choices: Choices<T>,
) -> impl TypedValueParser<Value = T> {
    let names = choices
        .iter()
        .map(|&(name, help, _)| PossibleValue::new(name).help(help));
    PossibleValuesParser::new(names).try_map(move |given| {
        let found = choices.iter().find(|(name, ..)| *name == given);
        found
            .map(|&(.., value)| value)
            .ok_or("it is not a possible value")
    })
}

/// An angle that a light is rotated by.
pub(crate) fn degrees() -> impl Fn(&str) -> Result<f64, String> + Clone {
    within(-36_000.0..=36_000.0, "degrees")
}

/// A number within a range, of what the range counts.
pub(crate) fn within<T>(
    range: RangeInclusive<T>,
    what: &'static str,
) -> impl Fn(&str) -> Result<T, String> + Clone
where
    T: FromStr + PartialOrd + Display + Clone,
{
    move |text| {
        let number = text.parse().ok().filter(|number| range.contains(number));
        number.ok_or_else(|| format!("give {what} from {} to {}", range.start(), range.end()))
    }
}
