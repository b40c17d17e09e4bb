//! `mask.json`: how a mask was made, with everything needed to make it again.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use relit_data::geometry::Rect;
use relit_grabcut::{Hints, MaskError, MaskStatistics, Seeds, SegmentSettings, Strokes};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::engine::opencv_version;
use super::{MaskEngine, RecordedNetwork};

/// The schema that this version writes and reads.
pub const MASK_SCHEMA: &str = "relit.mask/1";

/// The content of `mask.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaskRecord {
    /// [`MASK_SCHEMA`].
    pub schema: String,
    /// The software that made the mask.
    pub software: MaskSoftware,
    /// The frame it was made on.
    pub source: SourceFrame,
    /// The hints.
    pub hints: RecordedHints,
    /// The network that found the object, whose marks are among the hints; `None` without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub network: Option<RecordedNetwork>,
    /// What cut the object out.
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
pub struct MaskSoftware {
    /// Version of relit.
    pub version: String,
    /// Version of OpenCV, if that cut the mask.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub opencv: Option<String>,
}

/// The frame on which a mask was made.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
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
    /// How the video's colours were converted to sRGB, in words; `None` if they were taken as sRGB.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub colour_conversion: Option<String>,
    /// BLAKE3 of its 8-bit RGB values, row by row, in hexadecimal.
    pub frame_blake3: String,
}

/// [`Hints`] as they are recorded, and the turn.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
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

/// What came out, and the hash of the mask's file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct RecordedResult {
    /// BLAKE3 of the mask's file, in hexadecimal.
    pub mask_blake3: String,
    /// Area, bounding box and components.
    #[serde(flatten)]
    pub statistics: MaskStatistics,
}

impl MaskRecord {
    /// Reads the content of a `mask.json`.
    ///
    /// # Errors
    /// If it is not JSON, has another schema, or is not a record.
    pub fn from_json(bytes: &[u8]) -> Result<Self, String> {
        let value = serde_json::from_slice(relit_data::text::unmarked(bytes));
        let value: Value = value.map_err(|error: serde_json::Error| error.to_string())?;
        let schema = value.get("schema").unwrap_or(&Value::Null);
        if schema != MASK_SCHEMA {
            let why = format!("its schema is {schema}, not {MASK_SCHEMA:?}");
            return Err(why);
        }
        serde_json::from_value(value).map_err(|error| error.to_string())
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
    pub fn for_engine(engine: MaskEngine) -> Self {
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
    pub fn new(hints: &Hints, turn_frames: &[u64]) -> Result<Self, MaskError> {
        let seeds = hints.seeds.as_ref();
        let png = seeds.map(Seeds::to_marks_png).transpose()?;
        Ok(Self {
            rect: hints.rect,
            strokes: hints.strokes.clone(),
            seeds: png.map(|png| STANDARD.encode(png)),
            seeds_coloured_px: seeds.map_or(0, Seeds::coloured_px),
            turn_frames: turn_frames.to_vec(),
        })
    }

    /// The hints that were recorded; empty where the video alone was enough.
    ///
    /// # Errors
    /// If there are none, or the seeds are damaged.
    pub fn hints(&self) -> Result<Hints, String> {
        let wrong = |why: &dyn std::fmt::Display| format!("its seeds are not valid: {why}");
        let seeds = match &self.seeds {
            None => None,
            Some(text) => {
                let png = STANDARD.decode(text).map_err(|error| wrong(&error))?;
                let seeds = Seeds::from_marks_png(&png, self.seeds_coloured_px);
                Some(seeds.map_err(|error| wrong(&error))?)
            }
        };
        let hints = Hints {
            rect: self.rect,
            seeds,
            strokes: self.strokes.clone(),
        };
        if hints.is_empty() && self.turn_frames.is_empty() {
            return Err("it records no hints".to_owned());
        }
        Ok(hints)
    }
}

impl RecordedResult {
    /// The statistics and the hash of a mask whose file has the bytes `png`.
    #[must_use]
    pub fn new(statistics: MaskStatistics, png: &[u8]) -> Self {
        Self {
            mask_blake3: blake3::hash(png).to_hex().to_string(),
            statistics,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use relit_grabcut::{Brush, Stroke};

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
            software: MaskSoftware::for_engine(MaskEngine::Relit),
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
            hints: RecordedHints::new(&Rect::new(-1, 2, 30, 40).into(), &[]).unwrap(),
            network: None,
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
    fn strokes_are_read_back_as_they_were_painted() {
        let stroke = Stroke {
            brush: Brush::Eraser,
            radius: 7.3,
            points: vec![[0.1, 1.0 / 3.0], [-12.5, 99.999]],
        };
        let painted = Hints {
            strokes: Strokes::new(vec![stroke]).unwrap(),
            ..Hints::default()
        };
        let hints = RecordedHints::new(&painted, &[]).unwrap();
        let bytes = MaskRecord { hints, ..record() }.to_json().unwrap();
        let read = MaskRecord::from_json(&bytes).unwrap();
        assert_eq!(read.hints.hints().unwrap(), painted);
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
    fn a_recipe_with_unknown_settings_is_refused() {
        let text = String::from_utf8(record().to_json().unwrap()).unwrap();
        let text = text.replace("\"keep_all\":", "\"feather\": 3, \"keep_all\":");
        let error = MaskRecord::from_json(text.as_bytes()).unwrap_err();
        assert!(error.to_string().contains("feather"), "{error}");
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
        let refused = |seeds| of(None, seeds).hints().unwrap_err().to_string();
        assert!(refused(None).contains("hints"));
        assert!(refused(Some("%")).contains("seeds"));
        assert!(refused(Some("aaaa")).contains("PNG"));
    }
}
