//! The room of a turn, on blocks of pixels: what the object is made of, and an unknown light from several starts.

use super::body::{BodyFigure, BodyKind, is_metal, may_be_metal};
use super::gloss::{GLOSS_ORDER, GlossLight};
use super::joint::{Joint, Unknowns};
use super::moments::Moments;
use super::room::{KnownLight, fit_matt_room, fit_metal_room};
use super::search::{Expected, PixelFit, Room, unit};
use super::solve::{StartFigure, all_moments, search_all};
use super::start::{blurred, inflated};
use super::{TableFrame, TurnCurves, TurnError};

/// Pixels on which a room is looked for: more are averaged in blocks first.
pub(super) const COARSE_PIXELS: usize = 2500;
/// Rounds of light and normals in turn, for an object without gloss, with which an unknown light begins.
const ROUNDS: usize = 8;
/// Bands of the light that metal is taken to show in these rounds, at first and in the end: one more every other round.
const FIRST_BANDS: usize = 3;
/// Then all that is unknown is refined together, in so many steps; after that the best normals are looked for anywhere,
/// and so on for so many rounds.
const JOINT_STEPS: usize = 8;
const JOINT_ROUNDS: usize = 2;
/// Bands of the room's light that gloss is fitted with, of order 0 and up.
const GLOSS_BANDS: usize = GLOSS_ORDER + 1;
/// How smooth the normals are that an unknown light is fitted to: the deviation in the first round, in parts of
/// the frame's width, by how much it falls with each round, and the least, pixels.
const FIRST_BLUR: f64 = 6.0 / 256.0;
const BLUR_FALL: f64 = 0.8;
const LEAST_BLUR: f64 = 0.6;
/// How round the bodies are that an unknown light is started from.
const HEIGHTS: [(&str, f64); 3] = [
    ("outline", 1.0),
    ("outline, flatter", 0.6),
    ("outline, rounder", 1.6),
];
/// What metal is taken to show of band l of a light at first: this to the power of l.
const METAL_FALL: f64 = 0.9;

/// What is known of a turn's room.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Setting {
    pub(super) frame: TableFrame,
    pub(super) known: Option<KnownLight>,
    /// Whether more is known of the shape than its outline.
    pub(super) has_shape: bool,
}

/// A room that was found.
#[derive(Debug, Clone)]
pub(super) struct FoundRoom {
    pub(super) room: Room,
    pub(super) starts: Vec<StartFigure>,
    /// One a kind that was tried, at least one.
    pub(super) bodies: Vec<BodyFigure>,
}

impl Setting {
    /// What is to be found of the room of such an object. Where nothing is known of the shape but its outline, light and gloss
    /// together could explain any shape: a diffuse object is taken for one without gloss.
    pub(super) fn unknowns(&self, body: BodyKind) -> Unknowns<'_> {
        let bands = if self.has_shape { GLOSS_BANDS } else { 0 };
        match (body, &self.known) {
            (BodyKind::Diffuse, Some(known)) => Unknowns::Gloss(known),
            (BodyKind::Diffuse, None) => Unknowns::Light { bands },
            (BodyKind::Metal, Some(known)) => Unknowns::Mirror(known),
            (BodyKind::Metal, None) => Unknowns::Reflection,
        }
    }

    /// The room in which an object of this kind explains the curves best; where the kind is not known, one of the kind that does.
    pub(super) fn find(
        &self,
        curves: &TurnCurves,
        expected: Option<&[Expected]>,
        body: Option<BodyKind>,
    ) -> Result<FoundRoom, TurnError> {
        let coarse = Coarse::new(curves, expected);
        let run = |body| self.find_of(&coarse, body);
        if let Some(body) = body {
            return run(body);
        }
        let diffuse = run(BodyKind::Diffuse)?;
        if !may_be_metal(diffuse.bodies[0].residual) {
            return Ok(diffuse);
        }
        let metal = run(BodyKind::Metal)?;
        let bodies = [&diffuse, &metal].map(|found| found.bodies[0]);
        let [of_diffuse, of_metal] = bodies.map(|figure| figure.residual);
        let taken = if is_metal(of_diffuse, of_metal) {
            metal
        } else {
            diffuse
        };
        Ok(FoundRoom {
            bodies: bodies.to_vec(),
            ..taken
        })
    }

    fn find_of(&self, coarse: &Coarse, body: BodyKind) -> Result<FoundRoom, TurnError> {
        let (room, starts) = match &self.known {
            Some(known) => {
                let joint = coarse.joint(self.unknowns(body));
                let start = self.unblurred(known, body);
                (joint.found(start, JOINT_ROUNDS, JOINT_STEPS).1, Vec::new())
            }
            None => self.find_light(coarse, body)?,
        };
        let fits = search_all(&room, &coarse.moments, coarse.expected.as_deref(), None);
        Ok(FoundRoom {
            room,
            starts,
            bodies: vec![BodyFigure::new(body, &fits)],
        })
    }

    /// A room of known light to begin with: without gloss, or with metal that is hardly rough.
    fn unblurred(&self, known: &KnownLight, body: BodyKind) -> Room {
        let mirror = known.mirror();
        let shares: Vec<f64> = (0..mirror.len())
            .map(|l| METAL_FALL.powi(l as i32))
            .collect();
        let gloss = match body {
            BodyKind::Diffuse => GlossLight::NONE,
            BodyKind::Metal => GlossLight::sum(mirror, &shares),
        };
        Room {
            frame: self.frame,
            light: known.matt,
            gloss,
            body,
        }
    }

    /// An unknown light, from all starts.
    fn find_light(
        &self,
        coarse: &Coarse,
        body: BodyKind,
    ) -> Result<(Room, Vec<StartFigure>), TurnError> {
        let mut begun: Vec<(&str, Vec<[f64; 3]>)> = Vec::new();
        if let Some(expected) = coarse.expected.as_ref().filter(|_| self.has_shape) {
            let normals = expected.iter().map(|expected| expected.normal).collect();
            begun.push(("prior", normals));
        }
        for (name, height) in HEIGHTS {
            begun.push((name, inflated(&coarse.curves, height)));
        }
        let alternation = Alternation {
            coarse,
            setting: self,
            body,
        };
        let ended: Vec<(String, Option<(f64, Room)>)> = begun
            .into_iter()
            .map(|(name, normals)| (name.to_owned(), alternation.run(normals)))
            .collect();
        let best = ended
            .iter()
            .filter_map(|(_, ended)| *ended)
            .min_by(|a, b| a.0.total_cmp(&b.0));
        let (least, room) = best.ok_or(TurnError::NoLight)?;
        let figures = ended.into_iter().map(|(start, ended)| {
            let residual = ended.map_or(1.0, |(residual, _)| residual);
            StartFigure {
                start,
                residual,
                taken: residual <= least,
            }
        });
        Ok((room, figures.collect()))
    }
}

/// A turn on blocks of pixels.
struct Coarse {
    side: usize,
    curves: TurnCurves,
    moments: Vec<Moments>,
    expected: Option<Vec<Expected>>,
}

impl Coarse {
    fn new(curves: &TurnCurves, expected: Option<&[Expected]>) -> Self {
        let pixels = curves.pixels() as f64 / COARSE_PIXELS as f64;
        let side = (pixels.sqrt().ceil() as usize).max(1);
        let coarse = curves.reduced(side);
        Self {
            side,
            moments: all_moments(&coarse),
            expected: expected.map(|fine| reduced(curves, fine, &coarse, side)),
            curves: coarse,
        }
    }

    fn joint<'a>(&'a self, unknowns: Unknowns<'a>) -> Joint<'a> {
        Joint {
            moments: &self.moments,
            expected: self.expected.as_deref(),
            unknowns,
        }
    }
}

/// The prior on blocks of pixels.
fn reduced(
    curves: &TurnCurves,
    fine: &[Expected],
    coarse: &TurnCurves,
    side: usize,
) -> Vec<Expected> {
    let (width, across) = (curves.extent().width, coarse.extent().width);
    let mut sums = vec![[0.0; 3]; coarse.extent().pixels()];
    for (expected, &place) in fine.iter().zip(curves.places()) {
        let block = place / width / side * across + place % width / side;
        for (sum, value) in sums[block].iter_mut().zip(expected.normal) {
            *sum += value;
        }
    }
    let weight = fine.first().map_or(0.0, |expected| expected.weight);
    let at = |&place: &usize| Expected {
        normal: unit(sums[place]),
        weight,
    };
    coarse.places().iter().map(at).collect()
}

/// An unknown light from one start.
struct Alternation<'a> {
    coarse: &'a Coarse,
    setting: &'a Setting,
    body: BodyKind,
}

impl Alternation<'_> {
    /// What is left in the end, and the room: light and normals in turns for an object without gloss, then both together, and
    /// then with gloss.
    fn run(&self, start: Vec<[f64; 3]>) -> Option<(f64, Room)> {
        let coarse = self.coarse;
        let mut normals = start;
        let mut albedo = self.first_albedo();
        let mut room = None;
        for round in 0..ROUNDS {
            let found = self.room_of(&normals, &mut albedo, round)?;
            let fits = search_all(&found, &coarse.moments, coarse.expected.as_deref(), None);
            for (albedo, fit) in albedo.iter_mut().zip(&fits) {
                *albedo = fit.albedo;
            }
            normals = self.smoothed(&fits, round);
            room = Some(found);
        }
        let all = coarse.joint(self.setting.unknowns(self.body));
        if self.body == BodyKind::Metal {
            return Some(all.found(room?, JOINT_ROUNDS, JOINT_STEPS));
        }
        let matt = coarse.joint(Unknowns::Light { bands: 0 });
        let (cost, room) = matt.found(room?, 1, JOINT_STEPS);
        if !self.setting.has_shape {
            return Some((cost, room));
        }
        Some(all.found(room, JOINT_ROUNDS, JOINT_STEPS))
    }

    /// The room that goes with normals, in turns with the albedo.
    fn room_of(&self, normals: &[[f64; 3]], albedo: &mut [[f64; 3]], round: usize) -> Option<Room> {
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
    fn first_albedo(&self) -> Vec<[f64; 3]> {
        let curves = &self.coarse.curves;
        (0..curves.pixels())
            .map(|pixel| Moments::mean(curves, pixel).map(|mean| mean.max(1e-6)))
            .collect()
    }

    fn smoothed(&self, fits: &[PixelFit], round: usize) -> Vec<[f64; 3]> {
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
        let map = self
            .coarse
            .curves
            .map(|pixel| fits[pixel].normal.map(|v| v as f32));
        let smooth = blurred(&map, &self.coarse.curves.mask(), deviation);
        let [x, y, z] = smooth.planes();
        let at = |&place: &usize| unit([x, y, z].map(|plane| f64::from(plane[place])));
        self.coarse.curves.places().iter().map(at).collect()
    }
}
