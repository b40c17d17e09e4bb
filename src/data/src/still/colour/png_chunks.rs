//! How a PNG says what its numbers mean: in the first of the chunks cICP, iCCP, sRGB, gAMA and cHRM.

use png::Info;

use super::icc::colour_of_profile;
use super::{Colour, Curve, Primaries, to_rec709};
use crate::still::ColourError;

/// The number of ITU-T H.273 that says nothing.
const UNSPECIFIED: u8 = 2;
/// How far a gamma may be from one that is known.
const SAME_GAMMA: f32 = 0.02;
/// The gammas of gAMA that are possible.
const GAMMAS: std::ops::RangeInclusive<f32> = 0.1..=10.0;

/// What the chunks say; `None` without chunks.
pub(super) fn stated(info: &Info<'_>, is_grey: bool) -> Result<Option<Colour>, ColourError> {
    if let Some(points) = info.coding_independent_code_points {
        if !points.is_video_full_range_image {
            return Err(ColourError::transfer("the narrow range of videos (cICP)"));
        }
        let matrix = match points.color_primaries {
            UNSPECIFIED => None,
            code => match Primaries::from_code(code.into()) {
                Some((_, primaries)) => to_rec709(primaries)?,
                None => {
                    return Err(ColourError(format!(
                        "says that its colours are in unknown primaries (number {code} in cICP)"
                    )));
                }
            },
        };
        let curve = match points.transfer_function {
            UNSPECIFIED => Curve::Srgb,
            function => curve_of_function(function)?,
        };
        return Ok(Some(Colour::new(curve, matrix)));
    }
    if let Some(icc) = &info.icc_profile {
        return colour_of_profile(icc, is_grey).map(Some);
    }
    if info.srgb.is_some() {
        return Ok(Some(Colour::SRGB));
    }
    let matrix = match info.chrm_chunk {
        Some(c) => {
            let pairs = [c.red, c.green, c.blue, c.white];
            let [red, green, blue, white] =
                pairs.map(|(x, y)| [x, y].map(|v| f64::from(v.into_value())));
            to_rec709(Primaries::new(red, green, blue, white))?
        }
        None => None,
    };
    match (info.gama_chunk, matrix) {
        (Some(gamma), matrix) => Ok(Some(Colour::new(
            curve_of_gamma(gamma.into_value())?,
            matrix,
        ))),
        (None, Some(matrix)) => Ok(Some(Colour::new(Curve::Srgb, Some(matrix)))),
        (None, None) => Ok(None),
    }
}

/// 1 / 2.2 is what programs write for sRGB.
fn curve_of_gamma(gamma: f32) -> Result<Curve, ColourError> {
    let near = |known: f32| (gamma / known - 1.0).abs() < SAME_GAMMA;
    if near(1.0) {
        Ok(Curve::Linear)
    } else if near(1.0 / 2.2) {
        Ok(Curve::Srgb)
    } else if GAMMAS.contains(&gamma) {
        Ok(Curve::Power(1.0 / gamma))
    } else {
        Err(ColourError::transfer(&format!("the power {gamma} (gAMA)")))
    }
}

/// The curve of a transfer function of ITU-T H.273. Those of BT.709 and its like are shown as sRGB is.
fn curve_of_function(function: u8) -> Result<Curve, ColourError> {
    let name = match function {
        8 => return Ok(Curve::Linear),
        4 => return Ok(Curve::Power(2.2)),
        5 => return Ok(Curve::Power(2.8)),
        1 | 6 | 7 | 11..=15 => return Ok(Curve::Srgb),
        9 | 10 => "a logarithm",
        16 => "PQ",
        17 => "SMPTE ST 428-1",
        18 => "HLG",
        _ => "an unknown function",
    };
    let text = format!("{name} (transfer function {function} in cICP)");
    Err(ColourError::transfer(&text))
}
