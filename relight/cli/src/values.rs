//! Values of options that several verbs take.

use std::fmt::Display;
use std::ops::RangeInclusive;
use std::str::FromStr;

use clap::ValueEnum;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use relight_core::image::Transfer;
use relight_core::light::NormalsFrame;
use relight_photo::decompose::SpecularGate;
use relight_photo::insert::WhiteBalance;
use relight_turn::RotationDirection;

/// One of some values by its name; each with what the help says of it.
pub(crate) fn one_of<T: Copy + Send + Sync + 'static, const N: usize>(
    values: [(&'static str, T, &'static str); N],
) -> impl TypedValueParser<Value = T> {
    let named = values.map(|(name, _, help)| PossibleValue::new(name).help(help));
    PossibleValuesParser::new(named).try_map(move |given| {
        let found = values.iter().find(|(name, ..)| *name == given);
        found.map(|(_, value, _)| *value).ok_or("no such value")
    })
}

/// How integers in files of colour are encoded.
pub(crate) fn transfer() -> impl TypedValueParser<Value = Transfer> {
    one_of([
        ("srgb", Transfer::Srgb, "The transfer function of sRGB"),
        ("gamma22", Transfer::Gamma22, "The power 1 / 2.2"),
        ("linear", Transfer::Linear, "In proportion to light"),
    ])
}

/// Which way y points in maps of normals.
pub(crate) fn normals_frame() -> impl TypedValueParser<Value = NormalsFrame> {
    let paper = "As in the paper's figures and released code and data";
    one_of([
        ("up", NormalsFrame::YUp, "As relight writes them"),
        ("down", NormalsFrame::YDown, paper),
    ])
}

/// How the colour of new light is shown.
pub(crate) fn white_balance() -> impl TypedValueParser<Value = WhiteBalance> {
    let auto = "As by a camera that is balanced for it: white is as grey as in the picture around";
    one_of([
        ("light", WhiteBalance::Light, "As the light has it"),
        ("auto", WhiteBalance::Auto, auto),
    ])
}

/// Whether highlights are separated.
pub(crate) fn gate() -> impl TypedValueParser<Value = SpecularGate> {
    let auto = "Where more than 5 % of the object's pixels are saturated";
    one_of([
        ("auto", SpecularGate::Auto, auto),
        ("on", SpecularGate::On, "Always"),
        ("off", SpecularGate::Off, "Never"),
    ])
}

/// Which way a table turns as its angle grows, seen from above.
#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum DirectionName {
    /// The background moves to the right.
    CounterClockwise,
    /// The background moves to the left.
    Clockwise,
}

impl From<DirectionName> for RotationDirection {
    fn from(name: DirectionName) -> Self {
        match name {
            DirectionName::CounterClockwise => Self::CounterClockwise,
            DirectionName::Clockwise => Self::Clockwise,
        }
    }
}

/// An angle that a light is turned by.
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
