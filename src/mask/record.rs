//! `mask.json`: how a mask was made, with everything needed to make it again.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use relit_data::geometry::Rect;
use relit_grabcut::{
    Drawing, MaskError, MaskStatistics, Seeds, SeedsFault, SegmentSettings, Strokes,
};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::MaskEngine;
use super::engine::opencv_version;

/// The schema that this version writes and reads.
pub const MASK_SCHEMA: &str = "relit.mask/1";

/// The content of `mask.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct MaskRecord {
    /// [`MASK_SCHEMA`].
    pub schema: String,
    /// The software that made the mask.
    pub software: MaskSoftware,
    /// The frame it was made on.
    pub source: SourceFrame,
    /// The hints.
    pub hints: RecordedHints,
    /// What cut the object out; in older records relit's GrabCut.
    #[serde(default)]
    pub engine: MaskEngine,
    /// The settings.
    pub settings: SegmentSettings,
    /// The result.
    pub result: RecordedResult,
    /// The warnings, as sentences.
    pub warnings: Vec<String>,
}

/// The versions on which a mask's bytes depend.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct MaskSoftware {
    /// Version of relit.
    pub version: String,
    /// Version of OpenCV, if that cut the mask; older records have it wherever it was linked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub opencv: Option<String>,
}

/// The frame on which a mask was made.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct SourceFrame {
    /// File name of the video, without folders.
    pub video: String,
    /// The frame's number, 0-based.
    pub frame: u64,
    /// Its time stamp in the video, microseconds.
    pub t_us: i64,
    /// Its width, pixels.
    pub width: u32,
    /// Its height, pixels.
    pub height: u32,
    /// Exif's number, 2 to 8, by which a photograph was turned for display before; width, height and mask are those after.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exif_orientation: Option<u8>,
    /// How the video's colours were converted to sRGB, in words; none where they were taken as sRGB.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub colour_conversion: Option<String>,
    /// BLAKE3 of its 8-bit RGB values, row by row, in hexadecimal.
    pub frame_blake3: String,
}

/// A [`Drawing`] as it is recorded, and the turn.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct RecordedHints {
    /// The rectangle as given; null without one.
    pub rect: Option<Rect>,
    /// The seeds as a grey PNG in base64 (255 object, 0 background, 128 unknown); null without
    /// seeds.
    pub seeds: Option<String>,
    /// Number of coloured pixels of the painted seeds, which count as unknown.
    pub seeds_coloured_px: u64,
    /// What was painted over them in the editor.
    #[serde(default, skip_serializing_if = "Strokes::is_empty")]
    pub strokes: Strokes,
    /// The frames of the video by which the mask was made; none if only one frame was looked at.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub turn_frames: Vec<u64>,
}

/// [`MaskStatistics`] and hash of a mask as they are recorded.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct RecordedResult {
    /// BLAKE3 of the mask's file, in hexadecimal.
    pub mask_blake3: String,
    /// Pixels of the object.
    pub area_px: u64,
    /// The smallest rectangle around them.
    pub bounding_box: Rect,
    /// Connected components before the clean-up.
    pub components: u64,
    /// Connected components that were kept.
    pub components_kept: u64,
    /// Pixels of the holes that were filled.
    pub holes_filled_px: u64,
}

/// Why a file is not a mask's record, or cannot be used to make the mask again.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordFault {
    /// Not JSON, or without the fields of a record.
    #[error("{0}")]
    Json(#[from] serde_json::Error),
    /// Another schema.
    #[error("its schema is {found}, not {MASK_SCHEMA:?}")]
    Schema {
        /// The field `schema`, as JSON.
        found: Value,
    },
    /// Neither rectangle nor seeds.
    #[error("it records no hints")]
    NoHints,
    /// Seeds that are not base64.
    #[error("its seeds are not base64 ({0})")]
    Base64(#[from] base64::DecodeError),
    /// Seeds that are not a valid image.
    #[error("its seeds are not valid: {0}")]
    Seeds(#[from] SeedsFault),
}

impl MaskRecord {
    /// Reads the content of a `mask.json`.
    ///
    /// # Errors
    /// [`RecordFault::Json`] or [`RecordFault::Schema`].
    pub fn from_json(bytes: &[u8]) -> Result<Self, RecordFault> {
        let value: Value = serde_json::from_slice(relit_data::text::unmarked(bytes))?;
        let schema = value.get("schema").unwrap_or(&Value::Null);
        if schema != MASK_SCHEMA {
            return Err(RecordFault::Schema {
                found: schema.clone(),
            });
        }
        Ok(serde_json::from_value(value)?)
    }

    /// The content of a `mask.json`.
    ///
    /// # Errors
    /// If serialization fails, which does not happen.
    pub fn to_json(&self) -> serde_json::Result<Vec<u8>> {
        let mut bytes = serde_json::to_vec_pretty(self)?;
        bytes.push(b'\n');
        Ok(bytes)
    }
}

impl MaskSoftware {
    /// The versions on which a mask depends that this program makes by an engine.
    #[must_use]
    pub fn of(engine: MaskEngine) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            opencv: match engine {
                MaskEngine::Relit => None,
                MaskEngine::OpenCv => opencv_version(),
            },
        }
    }
}

impl std::fmt::Display for MaskSoftware {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "relit {}", self.version)?;
        match &self.opencv {
            Some(opencv) => write!(f, " with OpenCV {opencv}"),
            None => Ok(()),
        }
    }
}

impl RecordedHints {
    /// The hints in the form in which they are recorded.
    ///
    /// # Errors
    /// [`MaskError::Encode`].
    pub fn new(drawing: &Drawing, turn_frames: &[u64]) -> Result<Self, MaskError> {
        let seeds = drawing.seeds.as_ref();
        let png = seeds.map(Seeds::to_marks_png).transpose()?;
        Ok(Self {
            rect: drawing.rect,
            strokes: drawing.strokes.clone(),
            seeds: png.map(|png| STANDARD.encode(png)),
            seeds_coloured_px: seeds.map_or(0, Seeds::coloured_px),
            turn_frames: turn_frames.to_vec(),
        })
    }

    /// The hints that were recorded; empty where the video alone was enough.
    ///
    /// # Errors
    /// [`RecordFault::NoHints`], [`RecordFault::Base64`] or [`RecordFault::Seeds`].
    pub fn drawing(&self) -> Result<Drawing, RecordFault> {
        let seeds = match &self.seeds {
            None => None,
            Some(text) => {
                let png = STANDARD.decode(text)?;
                Some(Seeds::from_marks_png(&png, self.seeds_coloured_px)?)
            }
        };
        let drawing = Drawing {
            rect: self.rect,
            seeds,
            strokes: self.strokes.clone(),
        };
        if drawing.is_empty() && self.turn_frames.is_empty() {
            return Err(RecordFault::NoHints);
        }
        Ok(drawing)
    }
}

impl RecordedResult {
    /// The statistics and the hash of a mask whose file has the bytes `png`.
    #[must_use]
    pub fn new(statistics: MaskStatistics, png: &[u8]) -> Self {
        Self {
            mask_blake3: blake3::hash(png).to_hex().to_string(),
            area_px: statistics.area_px,
            bounding_box: statistics.bounding_box,
            components: statistics.components as u64,
            components_kept: statistics.components_kept as u64,
            holes_filled_px: statistics.holes_filled_px,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use relit_grabcut::{Brush, Hints, Stroke};

    fn record() -> MaskRecord {
        let statistics = MaskStatistics {
            area_px: 12,
            bounding_box: Rect::new(1, 2, 3, 4),
            components: 2,
            components_kept: 1,
            holes_filled_px: 0,
        };
        MaskRecord {
            schema: MASK_SCHEMA.to_owned(),
            software: MaskSoftware::of(MaskEngine::Relit),
            source: SourceFrame {
                video: "video.mkv".to_owned(),
                frame: 3,
                t_us: 100_000,
                width: 64,
                height: 48,
                exif_orientation: None,
                colour_conversion: None,
                frame_blake3: "00".to_owned(),
            },
            hints: RecordedHints::new(&Hints::Rect(Rect::new(-1, 2, 30, 40)).into(), &[]).unwrap(),
            engine: MaskEngine::OpenCv,
            settings: SegmentSettings::default(),
            result: RecordedResult::new(statistics, b"png"),
            warnings: vec!["look".to_owned()],
        }
    }

    #[test]
    fn a_record_is_read_back_as_it_was_written() {
        let bytes = record().to_json().unwrap();
        assert_eq!(MaskRecord::from_json(&bytes).unwrap(), record());
    }

    #[test]
    fn a_record_that_names_no_engine_is_of_relits_own() {
        let text = String::from_utf8(record().to_json().unwrap()).unwrap();
        let older = text.replace("  \"engine\": \"opencv\",\n", "");
        assert_ne!(older, text);
        let read = MaskRecord::from_json(older.as_bytes()).unwrap();
        assert_eq!(read.engine, MaskEngine::Relit);
    }

    #[test]
    fn strokes_are_read_back_as_they_were_painted() {
        let stroke = Stroke {
            brush: Brush::Eraser,
            radius: 7.3,
            points: vec![[0.1, 1.0 / 3.0], [-12.5, 99.999]],
        };
        let drawing = Drawing {
            strokes: Strokes::new(vec![stroke]).unwrap(),
            ..Drawing::default()
        };
        let hints = RecordedHints::new(&drawing, &[]).unwrap();
        let bytes = MaskRecord { hints, ..record() }.to_json().unwrap();
        let read = MaskRecord::from_json(&bytes).unwrap();
        assert_eq!(read.hints.drawing().unwrap(), drawing);
        let text = String::from_utf8(bytes).unwrap();
        let wrong = text.replace("\"eraser\"", "\"magic\"");
        assert!(MaskRecord::from_json(wrong.as_bytes()).is_err());
        let wrong = text.replace("\"radius\": 7.3", "\"radius\": 0.0");
        let error = MaskRecord::from_json(wrong.as_bytes()).unwrap_err();
        assert!(error.to_string().contains("stroke 0"), "{error}");
    }

    #[test]
    fn another_schema_is_refused_by_name() {
        let error = MaskRecord::from_json(br#"{"schema": "relit.session/1"}"#).unwrap_err();
        assert!(error.to_string().contains("relit.session/1"), "{error}");
        assert!(MaskRecord::from_json(b"[]").is_err());
        assert!(MaskRecord::from_json(b"").is_err());
    }

    #[test]
    fn a_recipe_with_impossible_settings_is_refused() {
        let text = String::from_utf8(record().to_json().unwrap()).unwrap();
        let text = text.replace("\"iterations\": 5", "\"iterations\": 0");
        let error = MaskRecord::from_json(text.as_bytes()).unwrap_err();
        assert!(error.to_string().contains("0 iterations"), "{error}");
    }

    #[test]
    fn invalid_recorded_hints_are_refused() {
        let of = |rect, seeds: Option<&str>| RecordedHints {
            rect,
            seeds: seeds.map(str::to_owned),
            seeds_coloured_px: 0,
            strokes: Strokes::default(),
            turn_frames: Vec::new(),
        };
        let no_hints = of(None, None).drawing();
        assert!(matches!(no_hints, Err(RecordFault::NoHints)));
        let no_base64 = of(None, Some("%")).drawing();
        assert!(matches!(no_base64, Err(RecordFault::Base64(_))));
        let no_png = of(None, Some("aaaa")).drawing();
        assert!(matches!(no_png, Err(RecordFault::Seeds(_))));
    }
}
