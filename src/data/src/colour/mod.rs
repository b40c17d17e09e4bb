//! Colours as videos code them to sRGB: the transfer characteristics and primaries of ITU-T H.273, by their numbers.
//!
//! HDR is scaled as Report ITU-R BT.2408 maps it to SDR: reference white, 203 cd/m², becomes white, and what is brighter
//! is clipped.

pub(crate) mod primaries;

use crate::srgb;
use primaries::Primaries;

/// Luminance of diffuse white in HDR (BT.2408), which becomes white, cd/m².
const HDR_WHITE: f64 = 203.0;
/// Luminance of the brightest value of PQ (SMPTE ST 2084), cd/m².
const PQ_PEAK: f64 = 10_000.0;
/// Luminance of the brightest value on HLG's nominal display, cd/m², and that display's system gamma (BT.2100).
const HLG_PEAK: f64 = 1000.0;
const HLG_GAMMA: f64 = 1.2;
/// Values that are looked up.
const LEVELS: usize = 1 << 16;

/// Colours that cannot be converted.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ColourFault {
    /// By their transfer characteristics.
    #[error("its transfer function {0}")]
    Transfer(String),
    /// By their primaries.
    #[error("its colour primaries {0}")]
    Primaries(String),
    /// By their matrix.
    #[error("its colour matrix {0}")]
    Matrix(String),
}

/// ITU-T H.273's number for what a file does not state.
const NOT_STATED: u32 = 2;

fn numbered(code: u32) -> String {
    format!("number {code} of ITU-T H.273")
}

/// How values become light.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Transfer {
    /// They are shown as sRGB, as players do with BT.709 and its relatives.
    Sdr,
    Linear,
    Gamma28,
    /// SMPTE ST 428-1.
    Cinema,
    Pq,
    Hlg,
}

impl Transfer {
    fn from_code(code: u32) -> Result<Self, ColourFault> {
        Ok(match code {
            // BT.709, not stated, gamma 2.2, BT.601, SMPTE 240M, xvYCC, BT.1361, sRGB, BT.2020 of 10 and 12 bits.
            0..=4 | 6 | 7 | 11..=15 => Self::Sdr,
            5 => Self::Gamma28,
            8 => Self::Linear,
            16 => Self::Pq,
            17 => Self::Cinema,
            18 => Self::Hlg,
            9 => return Err(ColourFault::Transfer("logarithmic 100:1".to_owned())),
            10 => return Err(ColourFault::Transfer("logarithmic 316:1".to_owned())),
            _ => return Err(ColourFault::Transfer(numbered(code))),
        })
    }

    const fn name(self) -> &'static str {
        match self {
            Self::Sdr => "SDR",
            Self::Linear => "linear",
            Self::Gamma28 => "gamma 2.8",
            Self::Cinema => "SMPTE 428",
            Self::Pq => "PQ",
            Self::Hlg => "HLG",
        }
    }

    /// Light of a value, with white as 1; of HLG the scene's light, with its brightest value as 1.
    fn to_light(self, value: f64) -> f64 {
        match self {
            Self::Sdr => srgb::to_linear(value),
            Self::Linear => value,
            Self::Gamma28 => value.powf(2.8),
            Self::Cinema => value.powf(2.6) * 52.37 / 48.0,
            Self::Pq => pq_to_luminance(value) / HDR_WHITE,
            Self::Hlg => hlg_to_scene(value),
        }
    }
}

/// SMPTE ST 2084, equation 5.1.
fn pq_to_luminance(value: f64) -> f64 {
    const M1: f64 = 2610.0 / 16384.0;
    const M2: f64 = 2523.0 / 4096.0 * 128.0;
    const C1: f64 = 3424.0 / 4096.0;
    const C2: f64 = 2413.0 / 4096.0 * 32.0;
    const C3: f64 = 2392.0 / 4096.0 * 32.0;
    let root = value.powf(1.0 / M2);
    PQ_PEAK * ((root - C1).max(0.0) / (C2 - C3 * root)).powf(1.0 / M1)
}

/// The inverse of HLG's opto-electronic transfer function (BT.2100, table 5).
fn hlg_to_scene(value: f64) -> f64 {
    const A: f64 = 0.178_832_77;
    const B: f64 = 1.0 - 4.0 * A;
    const C: f64 = 0.559_910_73;
    if value <= 0.5 {
        value * value / 3.0
    } else {
        (((value - C) / A).exp() + B) / 12.0
    }
}

/// The conversion of coded RGB to sRGB.
pub struct ToSrgb {
    transfer: Transfer,
    primaries: &'static str,
    /// Light by value.
    light: Vec<f32>,
    /// The sRGB level by light.
    level: Vec<u8>,
    matrix: [[f32; 3]; 3],
    /// Weights of light in luminance, for HLG.
    luminance: [f32; 3],
}

impl std::fmt::Debug for ToSrgb {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "ToSrgb({self})")
    }
}

impl PartialEq for ToSrgb {
    fn eq(&self, other: &Self) -> bool {
        (self.transfer, self.primaries) == (other.transfer, other.primaries)
    }
}

/// What is converted, and how.
impl std::fmt::Display for ToSrgb {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (transfer, primaries) = (self.transfer.name(), self.primaries);
        write!(f, "{transfer} with {primaries} primaries to sRGB")?;
        match self.transfer {
            Transfer::Pq | Transfer::Hlg => write!(f, ", {HDR_WHITE} cd/m² as white (BT.2408)"),
            _ => Ok(()),
        }
    }
}

impl ToSrgb {
    /// For transfer characteristics and primaries by their numbers in ITU-T H.273; `None` if the values are sRGB as they
    /// are. What is not stated (2) counts as BT.709.
    ///
    /// # Errors
    /// [`ColourFault`] for those that are not known here.
    pub fn new(transfer: u32, primaries: u32) -> Result<Option<Self>, ColourFault> {
        let transfer = Transfer::from_code(transfer)?;
        let unknown = || ColourFault::Primaries(numbered(primaries));
        // What is not stated, or reserved, is BT.709.
        let code = if primaries <= 3 { 1 } else { primaries };
        let (name, primaries) = Primaries::from_code(code).ok_or_else(unknown)?;
        if transfer == Transfer::Sdr && primaries == Primaries::REC709 {
            return Ok(None);
        }
        let to_rec709 = primaries.to_rec709().ok_or_else(unknown)?;
        let to_xyz = primaries.to_xyz().ok_or_else(unknown)?;
        let part = |level: usize| level as f64 / (LEVELS - 1) as f64;
        let light = (0..LEVELS).map(|level| transfer.to_light(part(level)) as f32);
        let level = (0..LEVELS).map(|light| (255.0 * srgb::from_linear(part(light))).round() as u8);
        let narrow = |row: [f64; 3]| row.map(|entry| entry as f32);
        Ok(Some(Self {
            transfer,
            primaries: name,
            light: light.collect(),
            level: level.collect(),
            matrix: to_rec709.map(narrow),
            luminance: narrow(to_xyz[1]),
        }))
    }

    /// As [`Self::new`], by the names that FFmpeg gives them.
    ///
    /// # Errors
    /// [`ColourFault`] for those that are not known here.
    pub fn named(
        transfer: Option<&str>,
        primaries: Option<&str>,
    ) -> Result<Option<Self>, ColourFault> {
        const TRANSFERS: [(&str, u32); 16] = [
            ("bt709", 1),
            ("bt470m", 4),
            ("gamma22", 4),
            ("bt470bg", 5),
            ("gamma28", 5),
            ("smpte170m", 6),
            ("smpte240m", 7),
            ("linear", 8),
            ("iec61966-2-4", 11),
            ("bt1361e", 12),
            ("iec61966-2-1", 13),
            ("bt2020-10", 14),
            ("bt2020-12", 15),
            ("smpte2084", 16),
            ("smpte428", 17),
            ("arib-std-b67", 18),
        ];
        const PRIMARIES: [(&str, u32); 11] = [
            ("bt709", 1),
            ("bt470m", 4),
            ("bt470bg", 5),
            ("smpte170m", 6),
            ("smpte240m", 7),
            ("film", 8),
            ("bt2020", 9),
            ("smpte428", 10),
            ("smpte431", 11),
            ("smpte432", 12),
            ("ebu3213", 22),
        ];
        let code = |known: &[(&str, u32)], name: Option<&str>| match name {
            None => Ok(NOT_STATED),
            Some(name) => known
                .iter()
                .find(|(known, _)| *known == name)
                .map(|&(_, code)| code)
                .ok_or_else(|| name.to_owned()),
        };
        Self::new(
            code(&TRANSFERS, transfer).map_err(ColourFault::Transfer)?,
            code(&PRIMARIES, primaries).map_err(ColourFault::Primaries)?,
        )
    }

    /// The sRGB levels of a coded colour, whose values are 0 to 1; others are clipped.
    pub fn levels(&self, coded: [f32; 3]) -> [u8; 3] {
        let index = |value: f32| (value * (LEVELS - 1) as f32 + 0.5) as usize;
        let mut light = coded.map(|value| self.light[index(value).min(LEVELS - 1)]);
        if self.transfer == Transfer::Hlg {
            let [r, g, b] = self.luminance;
            let luminance = r * light[0] + g * light[1] + b * light[2];
            // The system's gamma of the nominal display (BT.2100, table 5).
            let scale = (HLG_PEAK / HDR_WHITE) as f32 * luminance.powf(HLG_GAMMA as f32 - 1.0);
            light = light.map(|light| light * scale);
        }
        self.matrix.map(|row| {
            let light = row[0] * light[0] + row[1] * light[1] + row[2] * light[2];
            self.level[index(light).min(LEVELS - 1)]
        })
    }
}

/// From luma and colour differences of 16 bits to RGB, 0 to 1.
#[derive(Debug, Clone, PartialEq)]
pub struct YuvDecoding {
    /// Black, and the span to white.
    luma: [f32; 2],
    /// The span of colour differences.
    chroma: f32,
    /// What the differences of red and blue are multiplied by.
    differences: [f32; 2],
    /// The weights of red, green and blue in luma.
    weights: [f32; 3],
}

impl YuvDecoding {
    /// For matrix coefficients by their number in ITU-T H.273. Full range: black is 0 and white 65535.
    ///
    /// # Errors
    /// [`ColourFault::Matrix`] for those that are not known here.
    pub fn new(matrix: u32, full_range: bool) -> Result<Self, ColourFault> {
        let (red, blue) = match matrix {
            1 => (0.2126, 0.0722),
            4 => (0.30, 0.11),
            5 | 6 => (0.299, 0.114),
            7 => (0.212, 0.087),
            9 => (0.2627, 0.0593),
            _ => return Err(ColourFault::Matrix(numbered(matrix))),
        };
        let (luma, chroma) = if full_range {
            ([0.0, 65535.0], 65535.0)
        } else {
            ([4096.0, 219.0 * 256.0], 224.0 * 256.0)
        };
        Ok(Self {
            luma,
            chroma,
            differences: [2.0 * (1.0 - red), 2.0 * (1.0 - blue)],
            weights: [red, 1.0 - red - blue, blue],
        })
    }

    /// RGB of luma and the differences of blue and red.
    pub fn rgb(&self, [luma, blue, red]: [f32; 3]) -> [f32; 3] {
        let luma = (luma - self.luma[0]) / self.luma[1];
        let difference = |value: f32| (value - 32768.0) / self.chroma;
        let red = luma + self.differences[0] * difference(red);
        let blue = luma + self.differences[1] * difference(blue);
        let green = (luma - self.weights[0] * red - self.weights[2] * blue) / self.weights[1];
        [red, green, blue]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(found: [u8; 3], wanted: [u8; 3], most: u8) {
        let off = found.iter().zip(wanted).map(|(a, b)| a.abs_diff(b)).max();
        assert!(off <= Some(most), "{found:?} {wanted:?}");
    }

    #[test]
    fn bt709_and_srgb_stay_as_they_are() {
        for transfer in [0, 1, 2, 6, 13, 14, 15] {
            assert!(ToSrgb::new(transfer, 1).unwrap().is_none());
        }
        assert!(ToSrgb::new(2, 2).unwrap().is_none());
    }

    #[test]
    fn white_of_203_nits_is_white_in_pq_and_hlg() {
        // BT.2408: reference white is 58 % of PQ and 75 % of HLG.
        for (transfer, value) in [(16, 0.5807), (18, 0.75)] {
            let by = ToSrgb::new(transfer, 9).unwrap().unwrap();
            near(by.levels([value; 3]), [255; 3], 1);
            near(by.levels([1.0; 3]), [255; 3], 0);
            near(by.levels([0.0; 3]), [0; 3], 0);
        }
    }

    #[test]
    fn greys_keep_their_level_where_only_the_primaries_differ() {
        for primaries in [4, 5, 6, 8, 9, 11, 12, 22] {
            let by = ToSrgb::new(13, primaries).unwrap().unwrap();
            near(by.levels([128.0 / 255.0; 3]), [128; 3], 1);
        }
    }

    #[test]
    fn display_p3_is_what_littlecms_makes_of_it() {
        let by = ToSrgb::new(13, 12).unwrap().unwrap();
        let coded = |levels: [u8; 3]| levels.map(|level| f32::from(level) / 255.0);
        near(by.levels(coded([200, 60, 50])), [217, 42, 39], 2);
        near(by.levels(coded([60, 180, 70])), [0, 183, 49], 2);
    }

    #[test]
    fn linear_values_are_encoded() {
        let by = ToSrgb::new(8, 1).unwrap().unwrap();
        near(by.levels([0.215_86; 3]), [128; 3], 0);
    }

    #[test]
    fn luma_and_differences_become_rgb() {
        for (matrix, full_range) in [(1, false), (6, true), (9, false), (7, false), (4, true)] {
            let by = YuvDecoding::new(matrix, full_range).unwrap();
            let (black, white) = if full_range {
                (0.0, 65535.0)
            } else {
                (4096.0, 60160.0)
            };
            for (luma, wanted) in [(black, 0.0), (white, 1.0)] {
                for value in by.rgb([luma, 32768.0, 32768.0]) {
                    assert!((value - wanted).abs() < 1e-5, "{matrix}: {value}");
                }
            }
        }
        // Red of BT.709.
        let by = YuvDecoding::new(1, false).unwrap();
        let found = by.rgb([
            4096.0 + 0.2126 * 56064.0,
            32768.0 - 0.2126 / 1.8556 * 57344.0,
            61440.0,
        ]);
        for (found, wanted) in found.into_iter().zip([1.0, 0.0, 0.0]) {
            assert!((found - wanted).abs() < 1e-4, "{found}");
        }
        assert!(matches!(
            YuvDecoding::new(14, false),
            Err(ColourFault::Matrix(_))
        ));
    }

    #[test]
    fn what_is_not_known_is_refused() {
        assert!(matches!(ToSrgb::new(9, 1), Err(ColourFault::Transfer(_))));
        assert!(matches!(ToSrgb::new(77, 1), Err(ColourFault::Transfer(_))));
        assert!(matches!(ToSrgb::new(1, 77), Err(ColourFault::Primaries(_))));
        let named = |transfer, primaries| ToSrgb::named(Some(transfer), Some(primaries));
        assert!(named("log100", "bt709").is_err() && named("bt709", "mars").is_err());
        assert_eq!(named("smpte2084", "bt2020"), ToSrgb::new(16, 9));
    }

    #[test]
    fn values_beyond_the_range_are_clipped() {
        let by = ToSrgb::new(16, 9).unwrap().unwrap();
        for value in [f32::NEG_INFINITY, -1.0, 2.0, f32::INFINITY, f32::NAN] {
            let _ = by.levels([value; 3]);
        }
    }
}
