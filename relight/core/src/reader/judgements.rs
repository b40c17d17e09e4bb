//! What people judged of pairs of points: the files of Intrinsic Images in the Wild.

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::listing::listed;
use super::{DamagedSample, OpenError, SampleFault};
use crate::metrics::{Darker, Judgement};

/// The images of a folder in the layout of Intrinsic Images in the Wild (Bell et al. 2014):
/// `<id>.json` with the judgements, `<id>.png` with the image, sRGB.
pub struct JudgedImages {
    files: Vec<PathBuf>,
}

impl JudgedImages {
    /// Finds the images of the folder `root`, in the order of their names.
    ///
    /// # Errors
    /// [`OpenError::Read`], [`OpenError::Content`].
    pub fn open(root: &Path) -> Result<Self, OpenError> {
        let is_json = |path: &Path| path.extension().is_some_and(|found| found == "json");
        let files = listed(root, is_json)?;
        if files.is_empty() {
            return Err(OpenError::empty(root, "files <id>.json with judgements"));
        }
        Ok(Self { files })
    }

    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.files.len()
    }

    /// Whether there is none: never.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.files.is_empty()
    }

    /// The name of an image.
    ///
    /// # Panics
    /// Where there are not so many.
    #[must_use]
    pub fn name(&self, index: usize) -> String {
        let stem = self.files[index].file_stem().unwrap_or_default();
        stem.to_string_lossy().into_owned()
    }

    /// The file of an image.
    ///
    /// # Panics
    /// Where there are not so many.
    #[must_use]
    pub fn image(&self, index: usize) -> PathBuf {
        self.files[index].with_extension("png")
    }

    /// What people judged of an image: of points on opaque surfaces, where they agreed.
    ///
    /// # Errors
    /// [`DamagedSample`], which names the file.
    ///
    /// # Panics
    /// Where there are not so many.
    pub fn judgements(&self, index: usize) -> Result<Vec<Judgement>, DamagedSample> {
        let path = &self.files[index];
        let read = || -> Result<Vec<Judgement>, SampleFault> {
            let bytes = fs::read(path).map_err(SampleFault::read(path))?;
            let file: File = serde_json::from_slice(relit_data::text::unmarked(&bytes))
                .map_err(SampleFault::numbers(path))?;
            Ok(file.judgements())
        };
        read().map_err(|fault| DamagedSample {
            sample: self.name(index),
            fault,
        })
    }
}

#[derive(Deserialize)]
struct File {
    intrinsic_points: Vec<Point>,
    intrinsic_comparisons: Vec<Pair>,
}

#[derive(Deserialize)]
struct Point {
    id: u64,
    x: f64,
    y: f64,
    opaque: bool,
}

#[derive(Deserialize)]
struct Pair {
    point1: u64,
    point2: u64,
    darker: Option<String>,
    darker_score: Option<f64>,
}

impl File {
    fn judgements(&self) -> Vec<Judgement> {
        let opaque = self.intrinsic_points.iter().filter(|point| point.opaque);
        let places: HashMap<u64, [f64; 2]> =
            opaque.map(|point| (point.id, [point.x, point.y])).collect();
        let judgement = |pair: &Pair| {
            let darker = match pair.darker.as_deref()? {
                "1" => Darker::First,
                "2" => Darker::Second,
                "E" => Darker::Neither,
                _ => return None,
            };
            Some(Judgement {
                first: *places.get(&pair.point1)?,
                second: *places.get(&pair.point2)?,
                darker,
                weight: pair.darker_score.filter(|&score| score > 0.0)?,
            })
        };
        self.intrinsic_comparisons
            .iter()
            .filter_map(judgement)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_judgements_of_opaque_points_that_people_agreed_on_count() {
        let dir = tempfile::tempdir().unwrap();
        let text = r#"{
            "intrinsic_points": [
                {"id": 1, "x": 0.25, "y": 0.5, "opaque": true, "sRGB": "808080"},
                {"id": 2, "x": 0.75, "y": 0.5, "opaque": true},
                {"id": 3, "x": 0.5, "y": 0.5, "opaque": false}],
            "intrinsic_comparisons": [
                {"point1": 1, "point2": 2, "darker": "2", "darker_score": 1.5},
                {"point1": 1, "point2": 3, "darker": "1", "darker_score": 1.0},
                {"point1": 1, "point2": 2, "darker": null, "darker_score": 1.0},
                {"point1": 2, "point2": 1, "darker": "E", "darker_score": null},
                {"point1": 2, "point2": 1, "darker": "E", "darker_score": 0.5}]}"#;
        fs::write(dir.path().join("77.json"), text).unwrap();
        let images = JudgedImages::open(dir.path()).unwrap();
        assert_eq!((images.len(), images.name(0).as_str()), (1, "77"));
        assert!(images.image(0).ends_with("77.png"));
        let found = images.judgements(0).unwrap();
        let weights: Vec<f64> = found.iter().map(|one| one.weight).collect();
        assert_eq!(weights, [1.5, 0.5]);
        assert_eq!(found[0].darker, Darker::Second);
        assert_eq!(found[0].second, [0.75, 0.5]);
        fs::write(dir.path().join("77.json"), "[]").unwrap();
        assert!(images.judgements(0).is_err());
    }
}
