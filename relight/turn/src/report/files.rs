//! The files of a turn: a folder that appears when it is complete.

use std::path::Path;

use relight_core::captured_object::CapturedObject;
use relight_core::files::{ResultFolder, write_png};
use relight_core::image::{Depth, Extent};
use relight_photo::files::write_light;
use relit_data::durable::write_whole;
use serde_json::{Value, json};

use super::contact_sheet::contact_sheet;
use crate::error::TurnError;
use crate::solving::SolvedTurn;

/// The file of figures.
const FIGURES: &str = "turn.json";
/// What is written besides the figures.
const FILES: [&str; 8] = [
    "normal.png",
    "albedo.png",
    "shading.png",
    "confidence.png",
    "mask.png",
    "light.txt",
    "contact.png",
    CapturedObject::FILE,
];

const RESULTS: ResultFolder = ResultFolder {
    marker: FIGURES,
    holds: |name| name == FIGURES || FILES.contains(&name),
};

/// Its schema.
const SCHEMA: &str = "relight.solved_turn/1";

/// A solved turn with all its files.
#[derive(Debug, Clone, Copy)]
pub struct TurnFiles<'a> {
    /// What was read and found.
    pub solved: &'a SolvedTurn,
    /// The source of the light: a file's name, or `None` if it was estimated.
    pub light_source: Option<&'a str>,
}

impl TurnFiles<'_> {
    /// Whether results may be written to the folder `out`: it is missing, empty, or holds only earlier
    /// results.
    ///
    /// # Errors
    /// If it holds something else, or cannot be read or written.
    pub fn check(out: &Path) -> Result<(), TurnError> {
        Ok(RESULTS.check(out)?)
    }

    /// Writes all files into the folder `out`, which appears when they are complete; an earlier result in it is
    /// replaced. Gives the figures that `turn.json` holds.
    ///
    /// # Errors
    /// If the folder holds something else or a file cannot be written: then the folder is as it was.
    pub fn write(&self, out: &Path) -> Result<Value, TurnError> {
        RESULTS.write(out, |folder| self.write_files(folder))
    }

    fn write_files(&self, folder: &Path) -> Result<Value, TurnError> {
        let SolvedTurn { turn, solution, .. } = self.solved;
        let curves = &turn.curves;
        let path = |name: &str| folder.join(name);
        let surface = solution.surface(curves)?;
        let (albedo, shading) = (solution.albedo(curves), solution.shading(curves));
        surface
            .normals()
            .write_png(&path("normal.png"), Depth::Sixteen)?;
        let white = json!({
            "albedo": write_light(&path("albedo.png"), &albedo)?,
            "shading": write_light(&path("shading.png"), &shading)?,
        });
        for (name, plane) in [
            ("confidence.png", solution.confidence(curves)),
            ("mask.png", turn.mask.clone()),
        ] {
            write_png(&path(name), &plane.in_colour(), Depth::Eight)?;
        }
        let light = solution.light()?;
        light.write(&path("light.txt"))?;
        let sheet = contact_sheet(turn, solution, (&surface, &light))?;
        write_png(&path("contact.png"), &sheet, Depth::Eight)?;
        solution
            .captured_object(turn)?
            .write(&path(CapturedObject::FILE))?;
        let figures = self.figures(&white);
        let text = format!("{figures:#}\n");
        let path = path(FIGURES);
        write_whole(&path, text.as_bytes()).map_err(TurnError::write(&path))?;
        Ok(figures)
    }

    /// What `turn.json` holds. `white`: the light that the largest value of a file stands for.
    fn figures(&self, white: &Value) -> Value {
        let SolvedTurn {
            turn,
            solution,
            network,
            ..
        } = self.solved;
        let curves = &turn.curves;
        let Extent { width, height } = curves.extent();
        json!({
            "schema": SCHEMA,
            "software": format!("relight {}", env!("CARGO_PKG_VERSION")),
            "turn": turn.name,
            "size": [width, height],
            "pixels": curves.pixels(),
            "frames": curves.frames(),
            "lost": turn.damage,
            "has_angles": turn.has_angles,
            "clipped": curves.clipped(),
            "elevation": solution.elevation,
            "rotation": turn.rotation,
            "conditioning": solution.conditioning,
            "advice": solution.verdict().advice(),
            "light_source": self.light_source,
            "material": solution.material(),
            "network": network,
            "residual": solution.residual(),
            "expected_error_deg": solution.expected_error_deg(),
            "white": white,
        })
    }
}
