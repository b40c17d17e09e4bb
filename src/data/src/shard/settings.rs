//! How the sessions of a data set are extracted and stored, as `dataset.json` records it.

use std::collections::BTreeSet;
use std::fmt;

use serde::{Deserialize, Serialize};

use super::names;

/// How samples are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Layout {
    /// One tar per session: `<session>.tar`, with members `<session>/<kkkk>.{png,mask.png,json}`.
    Webdataset,
    /// Folders: `imgs/<session>/<k>.png`, `masks/<session>.png`, `mean_img/<session>.png`.
    Paper,
}

impl Layout {
    /// All layouts.
    pub const ALL: [Self; 2] = [Self::Webdataset, Self::Paper];

    /// The name on the command line and in `dataset.json`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Webdataset => "webdataset",
            Self::Paper => "paper",
        }
    }

    /// The shard of a session, relative to the data set: a tar or a folder.
    pub(super) fn shard_file(self, session: &str) -> String {
        match self {
            Self::Webdataset => names::tar_file(session),
            Self::Paper => names::image_folder(session),
        }
    }
}

impl fmt::Display for Layout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The size of images and masks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum ImageSize {
    /// Scaled to a square of this side, pixels.
    Pixels(u32),
    /// The source's own pixels: `"native"`.
    Native(Native),
}

/// The word `"native"`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Native {
    /// Not scaled.
    #[serde(rename = "native")]
    Native,
}

impl ImageSize {
    /// The source's own pixels.
    pub const NATIVE: Self = Self::Native(Native::Native);
}

/// How shifts of the object are handled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Align {
    /// Measured, and corrected where they exceed the tolerance.
    Correct,
    /// Measured only.
    Measure,
    /// Neither measured nor corrected.
    Off,
}

/// How the sessions of a data set were extracted; the same for all of them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ExtractionSettings {
    /// Samples per session.
    pub frames: u32,
    /// ImageSize of images and masks.
    pub size: ImageSize,
    /// Margin around the mask's bounding box, as a fraction of its longer side, 0 and above.
    pub margin: f64,
    /// The 8-bit value from which a channel is saturated, 0..=255.
    pub saturation_level: u8,
    /// The fraction of saturated pixels above which `spec_net` is set, 0..=1.
    pub gate: f64,
    /// How shifts are handled.
    pub align: Align,
    /// Shifts up to this, source pixels, are not corrected; `None` unless `align` is `correct`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub align_tolerance: Option<f64>,
    /// How samples are stored.
    pub layout: Layout,
    /// The name of the method that scaled the images.
    pub scaling: String,
}

impl ExtractionSettings {
    /// Names and values as they are shown to people beside the samples. The layout is not among them: it says nothing of
    /// the samples, and a page outlasts its change.
    pub fn rows(&self) -> Vec<(String, String)> {
        let settings = serde_json::to_value(self).unwrap_or_default();
        let rows = settings.as_object().into_iter().flatten();
        let rows = rows.filter(|(name, _)| *name != "layout");
        rows.map(|(name, value)| {
            let text = value
                .as_str()
                .map_or_else(|| value.to_string(), str::to_owned);
            (name.replace('_', " "), text)
        })
        .collect()
    }

    /// In what other settings differ from these, one phrase each with both values.
    pub fn differences(&self, other: &Self) -> Vec<String> {
        let [old, new] = [self, other].map(|s| serde_json::to_value(s).unwrap_or_default());
        let names = old.as_object().into_iter().chain(new.as_object());
        let names: BTreeSet<&String> = names.flat_map(serde_json::Map::keys).collect();
        let differ = names.into_iter().filter(|name| old[*name] != new[*name]);
        let phrases = differ.map(|name| format!("{name} {} there, {} here", old[name], new[name]));
        phrases.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_size_is_a_number_or_the_word_native() {
        for (size, json) in [
            (ImageSize::Pixels(256), "256"),
            (ImageSize::NATIVE, "\"native\""),
        ] {
            assert_eq!(serde_json::to_string(&size).unwrap(), json);
            assert_eq!(serde_json::from_str::<ImageSize>(json).unwrap(), size);
        }
        assert!(serde_json::from_str::<ImageSize>("\"large\"").is_err());
    }
}
