//! What is written of a turn: a folder that appears when it is whole.

use std::path::Path;

use relight_core::captured_object::CapturedObject;
use relight_core::files::{ResultFolder, write_png};
use relight_core::image::{Depth, Extent};
use relight_photo::files::{bright, write_light};

use crate::error::TurnError;
use crate::report::encoding::{grey, write_json};
use crate::report::figures::{FigureGloss, FigureWhites, LightFile, TurnFigures};
use crate::report::maps::TurnMaps;
use crate::report::movie::write_movie;
use crate::report::sheet::contact_sheet;
use crate::solving::SolvedTurn;

/// The file of figures.
const FIGURES: &str = "turn.json";

/// The object as a file that can be lit.
pub(crate) const ASSET: &str = "object.relit";

/// What is written beside it.
const FILES: [&str; 11] = [
    "normal.png",
    "albedo.png",
    "shading.png",
    "shadow.png",
    "confidence.png",
    "mask.png",
    "light.txt",
    "light.json",
    "contact.png",
    "relit.mp4",
    ASSET,
];

const RESULTS: ResultFolder = ResultFolder {
    marker: FIGURES,
    holds: |name| name == FIGURES || FILES.contains(&name),
};

/// What it says it is.
const SCHEMA: &str = "relight.solved_turn/1";

/// A solved turn with all that is written of it.
#[derive(Debug, Clone, Copy)]
pub struct TurnFiles<'a> {
    /// What was read and found.
    pub solved: &'a SolvedTurn,
    /// Where the light is from: a file's name, or none where it was found.
    pub light_source: Option<&'a str>,
    /// The object, where it is to be among the files, as `object.relit`.
    pub asset: Option<&'a CapturedObject>,
    /// Whether to write the video.
    pub has_movie: bool,
}

impl TurnFiles<'_> {
    /// Whether results may be written to the folder `out`: it is not there, empty, or holds earlier results and nothing
    /// else.
    ///
    /// # Errors
    /// Where it holds something else, or cannot be read or written.
    pub fn check(out: &Path) -> Result<(), TurnError> {
        Ok(RESULTS.check(out)?)
    }

    /// Writes all files into the folder `out`, which appears when they are there; an earlier result in it is
    /// replaced.
    ///
    /// # Errors
    /// Where the folder holds something else or a file cannot be written: then the folder is as it was.
    pub fn write(&self, out: &Path) -> Result<TurnFigures, TurnError> {
        RESULTS.write(out, |folder| self.write_files(folder))
    }

    fn write_files(&self, folder: &Path) -> Result<TurnFigures, TurnError> {
        let SolvedTurn { turn, solution, .. } = self.solved;
        let curves = &turn.curves;
        let maps = TurnMaps::new(curves, solution);
        let path = |name: &str| folder.join(name);
        let surface = solution.surface(curves)?;
        let albedo = solution.albedo(curves);
        let shading = solution.shading(curves);
        surface
            .normals()
            .write_png(&path("normal.png"), Depth::Sixteen)?;
        let white = FigureWhites {
            albedo: write_light(&path("albedo.png"), &albedo)?,
            shading: write_light(&path("shading.png"), &shading)?,
        };
        let confidence = grey(&solution.confidence(curves));
        write_png(
            &path("shadow.png"),
            grey(&maps.shadow).planes(),
            Depth::Eight,
        )?;
        write_png(&path("confidence.png"), confidence.planes(), Depth::Eight)?;
        write_png(&path("mask.png"), grey(&turn.mask).planes(), Depth::Eight)?;
        let light = solution.light().to_viewer(solution.frame())?;
        light.write(&path("light.txt"))?;
        write_json(&path("light.json"), &LightFile::new(turn, solution)?)?;
        let sheet = contact_sheet(turn, solution, &maps, (&surface, &light))?;
        write_png(&path("contact.png"), &sheet, Depth::Eight)?;
        if let Some(asset) = self.asset {
            asset.write(&path(ASSET))?;
        }
        if self.has_movie {
            let white = bright(albedo.planes(), &turn.mask);
            write_movie(&path("relit.mp4"), &surface, white)?;
        }
        let figures = self.figures(white, maps)?;
        write_json(&path(FIGURES), &figures)?;
        Ok(figures)
    }

    fn figures(&self, white: FigureWhites, maps: TurnMaps) -> Result<TurnFigures, TurnError> {
        let SolvedTurn {
            turn,
            solution,
            network,
            ..
        } = self.solved;
        let Extent { width, height } = turn.curves.extent();
        let gloss = solution.gloss(&turn.curves)?.map(|gloss| FigureGloss {
            reflectance: gloss.reflectance,
            smoothness: gloss.smoothness,
            residual: gloss.residual,
        });
        Ok(TurnFigures {
            schema: SCHEMA,
            software: format!("relight {}", env!("CARGO_PKG_VERSION")),
            turn: turn.name.clone(),
            size: [width, height],
            pixels: turn.curves.pixels(),
            frames: turn.curves.frames(),
            lost: turn.damage.clone(),
            has_angles: turn.has_angles,
            clipped: turn.curves.clipped(),
            elevation: solution.elevation,
            rotation: turn.rotation,
            conditioning: solution.conditioning(),
            advice: solution.conditioning().verdict.advice(),
            light_source: self.light_source.map(str::to_owned),
            material: solution.material(),
            network: network.clone(),
            residual: solution.residual(),
            expected_error_deg: solution.expected_error_deg(),
            gloss,
            exposure_steps: turn.curves.exposure_steps().to_vec(),
            white,
            over_angle: maps.over_angle,
        })
    }
}
