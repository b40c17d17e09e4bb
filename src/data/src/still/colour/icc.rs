//! Colour profiles of the International Color Consortium, by the library moxcms.

use moxcms::{
    ColorProfile, DataColorSpace, Layout, ProfileClass, ToneReprCurve, TransferCharacteristics,
    TransformOptions,
};

use super::{Colour, Curve, Curves, Model};
use crate::colour::primaries::{inverse, multiply, significant};
use crate::srgb::from_linear_f32;
use crate::still::ColourError;

/// How far a curve may be from sRGB's, encoded: about half a level of 8 bits.
const SAME_CURVE: f32 = 0.6 / 255.0;

const INKS: &str = "inks (CMYK)";

/// What a profile says; `is_grey`: the picture has no colours.
pub(super) fn colour_of_profile(icc: &[u8], is_grey: bool) -> Result<Colour, ColourError> {
    let profile = ColorProfile::new_from_slice(icc).map_err(|_| unsupported(icc))?;
    check(&profile, is_grey)?;
    if profile.color_space == DataColorSpace::Gray {
        let curve = profile.gray_trc.as_ref().ok_or_else(ColourError::profile)?;
        return Ok(Colour::new(curve_of(curve)?, None));
    }
    let has_table = profile.lut_a_to_b_perceptual.is_some()
        || profile.lut_a_to_b_colorimetric.is_some()
        || profile.lut_a_to_b_saturation.is_some();
    if has_table || !profile.is_matrix_shaper() {
        return of_table(&profile);
    }
    of_matrix(&profile)
}

/// What is wrong with a profile that the library does not read.
fn unsupported(icc: &[u8]) -> ColourError {
    match icc.get(16..20) {
        Some(b"CMYK") => other_space(INKS),
        _ => ColourError::profile(),
    }
}

/// Refuses what is not converted.
fn check(profile: &ColorProfile, is_grey: bool) -> Result<(), ColourError> {
    let wrong = |space| Err(other_space(space));
    match profile.color_space {
        DataColorSpace::Rgb => {}
        DataColorSpace::Gray if is_grey => {}
        DataColorSpace::Gray => return wrong("pictures without colours"),
        DataColorSpace::Cmyk => return wrong(INKS),
        DataColorSpace::Lab => return wrong("Lab"),
        _ => return wrong("another kind of numbers"),
    }
    match profile.profile_class {
        ProfileClass::InputDevice | ProfileClass::DisplayDevice | ProfileClass::ColorSpace => {}
        _ => return wrong("conversions"),
    }
    let transfer = profile.cicp.map(|points| points.transfer_characteristics);
    let transfer = match transfer {
        Some(TransferCharacteristics::Smpte2084) => "PQ",
        Some(TransferCharacteristics::Hlg) => "HLG",
        _ => return Ok(()),
    };
    Err(ColourError(format!(
        "has a colour profile, which is encoded by {transfer}"
    )))
}

fn other_space(space: &str) -> ColourError {
    ColourError(format!("has a colour profile, which is for {space}"))
}

fn of_matrix(profile: &ColorProfile) -> Result<Colour, ColourError> {
    let own = profile.colorant_matrix().v;
    let to_rec709 = inverse(&ColorProfile::new_srgb().colorant_matrix().v);
    let matrix = multiply(&to_rec709.ok_or_else(ColourError::profile)?, &own);
    if inverse(&own).is_none() || matrix.iter().flatten().any(|value| !value.is_finite()) {
        return Err(ColourError::profile());
    }
    let curves = [&profile.red_trc, &profile.green_trc, &profile.blue_trc];
    let curves = curves.map(|curve| curve_of(curve.as_ref().ok_or_else(ColourError::profile)?));
    let [red, green, blue] = curves;
    let curves = match [red?, green?, blue?] {
        [Curve::Srgb, Curve::Srgb, Curve::Srgb] => Curves::Same(Curve::Srgb),
        [Curve::Linear, Curve::Linear, Curve::Linear] => Curves::Same(Curve::Linear),
        curves => Curves::Each(curves),
    };
    Ok(Colour(Model::Shaper {
        curves,
        matrix: significant(matrix),
    }))
}

fn of_table(profile: &ColorProfile) -> Result<Colour, ColourError> {
    let srgb = ColorProfile::new_srgb();
    let options = TransformOptions::default();
    let table = profile.create_transform_f32(Layout::Rgb, &srgb, Layout::Rgb, options);
    Ok(Colour(Model::Table(
        table.map_err(|_| ColourError::profile())?,
    )))
}

/// A profile's curve, which is sRGB's or none where it is nearly that.
fn curve_of(curve: &ToneReprCurve) -> Result<Curve, ColourError> {
    let evaluator = curve
        .make_linear_evaluator()
        .map_err(|_| ColourError::profile())?;
    let at = |value: f32| evaluator.evaluate_value(value).clamp(0.0, 1.0);
    let levels = (0..=255_u8).map(|level| f32::from(level) / 255.0);
    if levels.clone().any(|value| !at(value).is_finite()) {
        return Err(ColourError::profile());
    }
    let is = |known: fn(f32) -> f32| {
        let mut levels = levels.clone();
        levels.all(|value| (known(at(value)) - value).abs() <= SAME_CURVE)
    };
    Ok(if is(from_linear_f32) {
        Curve::Srgb
    } else if is(|light| light) {
        Curve::Linear
    } else {
        Curve::from_table(at)
    })
}
