//! An unknown light from one start.

use crate::fit::blocks::Coarse;
use crate::fit::curve_statistics::Moments;
use crate::fit::environment::{fit_matt_room, fit_metal_room};
use crate::fit::figures::BodyFigure;
use crate::fit::search::PixelFit;
use crate::fit::setting::{GLOSS_BANDS, Setting};
use crate::fit::smoothing::smoothed_normals;
use crate::fit::unknowns::Unknowns;
use crate::model::material::BodyKind;
use crate::model::shading::Room;

/// Rounds of light and normals in turn, for an object without gloss, with which an unknown light begins.
const ROUNDS: usize = 8;

/// Bands of the light that metal is taken to show in these rounds, at first and in the end: one more every other round.
const FIRST_BANDS: usize = 3;

/// Then all that is unknown is refined together, in so many steps; after that the best normals are looked for anywhere,
/// and so on for so many rounds.
pub(crate) const JOINT_STEPS: usize = 8;

pub(crate) const JOINT_ROUNDS: usize = 2;

/// How smooth the normals are that an unknown light is fitted to: the deviation in the first round, in parts of
/// the frame's width, by how much it falls with each round, and the least, pixels.
const FIRST_BLUR: f64 = 6.0 / 256.0;

const BLUR_FALL: f64 = 0.8;

const LEAST_BLUR: f64 = 0.6;

/// A matt object in an unknown light that leaves no more than this of the curves has no gloss: with it, light and shape could be
/// others and explain as much.
const MATT_LEAVES: f64 = 0.005;

/// An unknown light from one start.
pub(crate) struct Alternation<'a> {
    pub(crate) coarse: &'a Coarse,
    pub(crate) setting: &'a Setting,
    pub(crate) body: BodyKind,
}

impl Alternation<'_> {
    /// What is left in the end, and the room: light and normals in turns, then both together. A diffuse object has no gloss yet.
    pub(crate) fn run(&self, start: Vec<[f64; 3]>) -> Option<(f64, Room)> {
        let coarse = self.coarse;
        let mut normals = start;
        let mut albedo = self.first_albedo();
        let mut room = None;
        for round in 0..ROUNDS {
            let found = self.room_of(&normals, &mut albedo, round)?;
            let fits = coarse.fits(&found);
            for (albedo, fit) in albedo.iter_mut().zip(&fits) {
                *albedo = fit.albedo;
            }
            normals = self.smoothed(&fits, round);
            room = Some(found);
        }
        if self.body == BodyKind::Metal {
            let all = coarse.joint(self.setting.unknowns(self.body));
            return Some(all.found(room?, JOINT_ROUNDS, JOINT_STEPS));
        }
        let matt = coarse.joint(Unknowns::Light { bands: 0 });
        Some(matt.found(room?, 1, JOINT_STEPS))
    }

    /// The same with gloss.
    pub(crate) fn with_gloss(&self, room: Room) -> (f64, Room) {
        let all = self.coarse.joint(self.setting.unknowns(self.body));
        all.found(room, JOINT_ROUNDS, JOINT_STEPS)
    }

    /// Whether a room without gloss explains the curves.
    pub(crate) fn is_matt(&self, room: &Room) -> bool {
        let fits = self.coarse.fits(room);
        BodyFigure::new(self.body, &fits).residual <= MATT_LEAVES
    }

    /// The room that goes with normals, in turns with the albedo.
    pub(crate) fn room_of(
        &self,
        normals: &[[f64; 3]],
        albedo: &mut [[f64; 3]],
        round: usize,
    ) -> Option<Room> {
        let (moments, frame) = (&self.coarse.moments, &self.setting.frame);
        match self.body {
            BodyKind::Diffuse => fit_matt_room(moments, normals, albedo, frame),
            BodyKind::Metal => {
                let bands = (FIRST_BANDS + round / 2).min(GLOSS_BANDS);
                fit_metal_room(moments, normals, albedo, frame, bands)
            }
        }
    }

    /// As if the shading were even.
    pub(crate) fn first_albedo(&self) -> Vec<[f64; 3]> {
        let curves = &self.coarse.curves;
        (0..curves.pixels())
            .map(|pixel| Moments::mean(curves, pixel).map(|mean| mean.max(1e-6)))
            .collect()
    }

    pub(crate) fn smoothed(&self, fits: &[PixelFit], round: usize) -> Vec<[f64; 3]> {
        let across = self.coarse.curves.extent().width as f64;
        let deviation = if self.setting.has_shape {
            0.0
        } else {
            let fall = BLUR_FALL.powi(round as i32);
            (FIRST_BLUR * across * fall).max(LEAST_BLUR / self.coarse.side as f64)
        };
        if deviation < 0.3 {
            return fits.iter().map(|fit| fit.normal).collect();
        }
        smoothed_normals(&self.coarse.curves, deviation, |pixel| fits[pixel].normal)
    }
}
