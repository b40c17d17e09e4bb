//! Archives of Sweet Home 3D (`.sh3f`): zip files of models and a catalogue of their names, categories and authors.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::{Component, Path, PathBuf};

use glam::{Mat3, Vec3};
use tempfile::TempDir;
use zip::ZipArchive;

use super::UNKNOWN;
use crate::SynthError;

/// The catalogue's file; others hold translations.
const CATALOGUE: &str = "PluginFurnitureCatalog.properties";
const LICENCE: &str = "LICENSE.TXT";
/// Most bytes that an archive may unpack to.
const MAX_BYTES: u64 = 4 << 30;

/// Licences by what their texts hold; the first that fits counts.
const LICENCES: [(&str, &str); 9] = [
    ("creativecommons.org/licenses/by-sa/", "CC-BY-SA"),
    ("creativecommons.org/licenses/by-nc", "CC-BY-NC"),
    ("creativecommons.org/licenses/by-nd", "CC-BY-ND"),
    ("creativecommons.org/licenses/by/3.0/us", "CC-BY-3.0-US"),
    ("creativecommons.org/licenses/by/3.0", "CC-BY-3.0"),
    ("creativecommons.org/licenses/by/4.0", "CC-BY-4.0"),
    ("creative commons zero", "CC0-1.0"),
    ("cc0", "CC0-1.0"),
    ("public domain", "CC0-1.0"),
];

/// An archive that was unpacked, until it is dropped.
pub(super) struct Furniture {
    folder: TempDir,
    properties: BTreeMap<String, String>,
    licence: String,
    stem: String,
}

/// A model of a catalogue.
#[derive(Debug)]
pub(super) struct Model {
    pub(super) path: PathBuf,
    /// The archive's name and the path within it.
    pub(super) name: String,
    pub(super) title: String,
    pub(super) category: String,
    pub(super) author: String,
    pub(super) licence: String,
    pub(super) origin: String,
    pub(super) is_door_or_window: bool,
    /// From the model's own axes to those in which y is up.
    pub(super) rotation: Mat3,
}

impl Furniture {
    /// Unpacks an archive into a folder of its own.
    ///
    /// # Errors
    /// If it is damaged or has no catalogue.
    pub(super) fn open(path: &Path) -> Result<Self, SynthError> {
        let damaged = |fault: &dyn std::fmt::Display| {
            SynthError::unusable(path, format!("is not an archive of furniture: {fault}"))
        };
        let file = File::open(path).map_err(SynthError::read(path))?;
        let mut archive = ZipArchive::new(file).map_err(|fault| damaged(&fault))?;
        let size = archive.decompressed_size().unwrap_or_default();
        if size > u128::from(MAX_BYTES) {
            return Err(damaged(&format!("it unpacks to {size} bytes")));
        }
        let folder = TempDir::new().map_err(SynthError::write(path))?;
        archive
            .extract(folder.path())
            .map_err(|fault| damaged(&fault))?;
        let catalogue = fs::read(folder.path().join(CATALOGUE));
        let catalogue = catalogue.map_err(|_| damaged(&format!("it has no {CATALOGUE}")))?;
        let text = fs::read(folder.path().join(LICENCE)).unwrap_or_default();
        let properties = properties(&catalogue);
        let own = properties.get("license").map(String::as_str);
        let licence = licence_of(&String::from_utf8_lossy(&text));
        let licence = licence.or_else(|| own.map(|own| licence_of(own).unwrap_or(own.to_owned())));
        Ok(Self {
            folder,
            properties,
            licence: licence.unwrap_or_else(|| UNKNOWN.to_owned()),
            stem: path
                .file_stem()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned(),
        })
    }

    /// The models of the catalogue, in its order.
    pub(super) fn models(&self) -> Vec<Model> {
        let numbers = (1..).take_while(|number| self.of(*number, "name").is_some());
        numbers.filter_map(|number| self.model(number)).collect()
    }

    fn of(&self, number: usize, key: &str) -> Option<&str> {
        self.properties
            .get(&format!("{key}#{number}"))
            .map(String::as_str)
    }

    fn all(&self, key: &str) -> &str {
        self.properties.get(key).map_or("", String::as_str)
    }

    fn model(&self, number: usize) -> Option<Model> {
        let model = self.of(number, "model")?.trim_start_matches('/');
        let is_within = |part: Component<'_>| matches!(part, Component::Normal(_));
        if !Path::new(model).components().all(is_within) {
            return None;
        }
        let text = |key: &str| self.of(number, key).unwrap_or_default().to_owned();
        let licence = self.of(number, "license");
        let licence = licence.map(|own| licence_of(own).unwrap_or(own.to_owned()));
        let known = |text: String| {
            if text.is_empty() {
                UNKNOWN.to_owned()
            } else {
                text
            }
        };
        let origin = [self.all("name"), self.all("version"), self.all("provider")];
        let origin: Vec<&str> = origin.into_iter().filter(|part| !part.is_empty()).collect();
        Some(Model {
            path: self.folder.path().join(model),
            name: format!("{}/{model}", self.stem),
            title: text("name"),
            category: text("category"),
            author: known(text("creator")),
            licence: licence.unwrap_or_else(|| self.licence.clone()),
            origin: origin.join(" "),
            is_door_or_window: self.of(number, "doorOrWindow") == Some("true"),
            rotation: rotation(self.of(number, "modelRotation")),
        })
    }
}

/// Nine numbers row by row; what is not such numbers turns nothing.
fn rotation(text: Option<&str>) -> Mat3 {
    let numbers = text.unwrap_or_default().split_whitespace();
    let numbers: Vec<f32> = numbers.map_while(|word| word.parse().ok()).collect();
    match numbers.try_into() {
        Ok(rows) => {
            let matrix = Mat3::from_cols_array(&rows).transpose();
            let keeps_lengths = (matrix * matrix.transpose())
                .mul_vec3(Vec3::ONE)
                .abs_diff_eq(Vec3::ONE, 1e-2);
            if keeps_lengths {
                matrix
            } else {
                Mat3::IDENTITY
            }
        }
        Err(_) => Mat3::IDENTITY,
    }
}

/// The licence that a text is, or names.
fn licence_of(text: &str) -> Option<String> {
    let text = text.to_lowercase();
    let mut known = LICENCES.iter();
    let found = known.find(|(part, _)| text.contains(part));
    let by_3 = text.contains("creative commons attribution 3.0");
    let by_3 = by_3.then(|| "CC-BY-3.0".to_owned());
    found.map(|(_, name)| (*name).to_owned()).or(by_3)
}

/// A file of Java's properties: keys and values in Latin-1, with `\uXXXX` for other letters.
fn properties(bytes: &[u8]) -> BTreeMap<String, String> {
    let text: String = bytes.iter().map(|&byte| char::from(byte)).collect();
    let mut all = BTreeMap::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        let mut line = line.trim_start().to_owned();
        if line.starts_with(['#', '!']) {
            continue;
        }
        while line
            .chars()
            .rev()
            .take_while(|&letter| letter == '\\')
            .count()
            % 2
            == 1
        {
            line.pop();
            line.push_str(lines.next().unwrap_or_default().trim_start());
        }
        if let Some((key, value)) = line.split_once(['=', ':']) {
            all.insert(unescaped(key.trim()), unescaped(value.trim()));
        }
    }
    all
}

fn unescaped(text: &str) -> String {
    let mut units: Vec<u16> = Vec::new();
    let mut rest = text.chars();
    while let Some(letter) = rest.next() {
        let letter = match letter {
            '\\' => rest.next().unwrap_or('\\'),
            other => {
                units.extend(other.encode_utf16(&mut [0; 2]).iter());
                continue;
            }
        };
        match letter {
            'u' => {
                let code: String = rest.by_ref().take(4).collect();
                units.push(u16::from_str_radix(&code, 16).unwrap_or(0xFFFD));
            }
            't' => units.push(u16::from(b'\t')),
            'n' => units.push(u16::from(b'\n')),
            other => units.extend(other.encode_utf16(&mut [0; 2]).iter()),
        }
    }
    String::from_utf16_lossy(&units)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn properties_are_read_as_java_writes_them() {
        let text =
            b"# a comment\nname = B\xe9b\\u00e9 \\\n   one\nid#1:a\\\\b\n! another\nempty=\n";
        let all = properties(text);
        assert_eq!(all["name"], "B\u{e9}b\u{e9} one");
        assert_eq!(all["id#1"], "a\\b");
        assert_eq!(all["empty"], "");
        assert_eq!(all.len(), 3);
    }

    #[test]
    fn licences_are_known_by_their_texts() {
        for (text, name) in [
            (
                "see http://creativecommons.org/licenses/by/3.0/us/",
                "CC-BY-3.0-US",
            ),
            ("http://creativecommons.org/licenses/by/3.0/", "CC-BY-3.0"),
            (
                "This file is under the Creative Commons Zero (Public Domain)",
                "CC0-1.0",
            ),
            ("Creative Commons Attribution 3.0 license", "CC-BY-3.0"),
        ] {
            assert_eq!(licence_of(text).as_deref(), Some(name));
        }
        assert_eq!(licence_of("all rights reserved"), None);
    }

    #[test]
    fn a_rotation_is_nine_numbers_row_by_row() {
        let turned = rotation(Some("1 0 0 0 0 1 0 -1 0"));
        assert_eq!(turned * Vec3::Z, Vec3::Y);
        assert_eq!(rotation(Some("1 0 0 0 0 1 0 -1")), Mat3::IDENTITY);
        assert_eq!(rotation(Some("9 0 0 0 9 0 0 0 9")), Mat3::IDENTITY);
        assert_eq!(rotation(None), Mat3::IDENTITY);
    }
}
