//! Results as text and as JSON.

use std::fmt;

use relight_core::metrics::ScaleFit;
use serde::Serialize;

/// Which pixels a measure is taken over.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum MaskRule {
    /// Those of the object.
    Object,
    /// Those of the object at which the ground truth is known.
    Known,
    /// All of the image; both images are 0 outside the object.
    WholeImage,
}

impl fmt::Display for MaskRule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Object => "object",
            Self::Known => "where known",
            Self::WholeImage => "whole image",
        })
    }
}

/// A measure, the mean over all images.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Measured {
    /// Its name.
    pub name: String,
    /// Its value; null in JSON where it is not finite.
    pub value: f64,
}

/// One line of a table.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ScoreLine {
    /// What made the estimate.
    pub method: String,
    /// What was compared: albedo, shading, their mean, ...
    pub part: String,
    /// The means over all images.
    pub measures: Vec<Measured>,
    /// Colour space and units of the values that were compared.
    pub colour: String,
    /// Which scales were fitted to the estimate.
    pub scale: String,
    /// Which pixels count.
    pub mask: MaskRule,
    /// How many images there were.
    pub images: usize,
    /// The data set, and its part.
    pub split: String,
}

impl ScoreLine {
    /// Of one image, of a method and split that are not named yet.
    pub(super) fn of_image(
        part: &str,
        measures: &[(&str, f64)],
        (colour, fit): (&str, ScaleFit),
        mask: MaskRule,
    ) -> Self {
        let measured = |&(name, value): &(&str, f64)| Measured {
            name: name.to_owned(),
            value,
        };
        Self {
            method: String::new(),
            part: part.to_owned(),
            measures: measures.iter().map(measured).collect(),
            colour: colour.to_owned(),
            scale: fit.name().to_owned(),
            mask,
            images: 1,
            split: String::new(),
        }
    }
}

/// What a method scored on one image.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ImageScores {
    /// What made the estimate.
    pub method: String,
    /// The image.
    pub image: String,
    /// The measures, named by part and measure.
    pub measures: Vec<Measured>,
}

/// The result of a protocol. [`Display`](fmt::Display) writes it for a terminal; as JSON it holds the
/// scores of each image as well.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ScoreTable {
    /// The protocol's name.
    pub protocol: String,
    /// What a reader should know of all lines.
    pub notes: Vec<String>,
    /// The lines.
    pub lines: Vec<ScoreLine>,
    /// The scores of each image.
    pub images: Vec<ImageScores>,
}

impl ScoreTable {
    /// One without lines.
    pub(super) fn new(protocol: &str, notes: Vec<String>) -> Self {
        Self {
            protocol: protocol.to_owned(),
            notes,
            lines: Vec::new(),
            images: Vec::new(),
        }
    }

    /// The columns of measures, in the order in which lines name them.
    fn measures(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for measured in self.lines.iter().flat_map(|line| &line.measures) {
            if !names.contains(&measured.name.as_str()) {
                names.push(&measured.name);
            }
        }
        names
    }

    fn cells(&self) -> Vec<Vec<String>> {
        let measures = self.measures();
        let names = ["method", "part"].into_iter().chain(measures.clone());
        let terms = ["values", "scale fitted", "pixels", "images", "split"];
        let mut rows = vec![names.chain(terms).map(str::to_owned).collect::<Vec<_>>()];
        for line in &self.lines {
            let mut row = vec![line.method.clone(), line.part.clone()];
            row.extend(measures.iter().map(|name| {
                let found = line.measures.iter().find(|one| one.name == *name);
                found.map_or_else(String::new, |one| number(one.value))
            }));
            row.extend([line.colour.clone(), line.scale.clone()]);
            row.push(line.mask.to_string());
            row.extend([line.images.to_string(), line.split.clone()]);
            rows.push(row);
        }
        rows
    }
}

/// Four decimals for fractions, fewer for larger numbers.
fn number(value: f64) -> String {
    if value.abs() < 10.0 {
        format!("{value:.4}")
    } else {
        format!("{value:.2}")
    }
}

impl fmt::Display for ScoreTable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.protocol)?;
        for note in &self.notes {
            writeln!(f, "  {note}")?;
        }
        let rows = self.cells();
        let columns = rows.first().map_or(0, Vec::len);
        let widths: Vec<usize> = (0..columns)
            .map(|column| {
                let lengths = rows.iter().map(|row| row[column].chars().count());
                lengths.max().unwrap_or(0)
            })
            .collect();
        for row in &rows {
            let cells = row.iter().zip(&widths);
            let padded: Vec<String> = cells
                .map(|(cell, &width)| format!("{cell:width$}"))
                .collect();
            writeln!(f, "{}", padded.join("  ").trim_end())?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(method: &str, name: &str, value: f64) -> ScoreLine {
        ScoreLine {
            method: method.to_owned(),
            part: "albedo".to_owned(),
            measures: vec![Measured {
                name: name.to_owned(),
                value,
            }],
            colour: "linear grey".to_owned(),
            scale: "one an image".to_owned(),
            mask: MaskRule::Object,
            images: 10,
            split: "all".to_owned(),
        }
    }

    #[test]
    fn a_table_says_of_each_line_how_it_was_measured() {
        let table = ScoreTable {
            protocol: "intrinsic images".to_owned(),
            notes: vec!["a note".to_owned()],
            lines: vec![
                line("one", "SMSE", 0.01234),
                line("other one", "PSNR", 31.5),
            ],
            images: Vec::new(),
        };
        let text = table.to_string();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[1], "  a note");
        let head =
            "method     part    SMSE    PSNR   values       scale fitted  pixels  images  split";
        assert_eq!(lines[2], head);
        let first =
            "one        albedo  0.0123         linear grey  one an image  object  10      all";
        assert_eq!(lines[3], first);
        let json = serde_json::to_value(&table).unwrap();
        assert_eq!(json["lines"][1]["measures"][0]["value"], 31.5);
        assert_eq!(json["lines"][0]["mask"], "object");
    }

    #[test]
    fn an_infinite_measure_is_null_in_json() {
        let json = serde_json::to_value(line("one", "PSNR", f64::INFINITY)).unwrap();
        assert!(json["measures"][0]["value"].is_null());
    }
}
