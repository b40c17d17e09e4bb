//! The room of a turn, on blocks of pixels: what the object is made of, and an unknown light from several starts.

use super::body::{BodyFigure, BodyKind, is_metal, may_be_metal};
use super::gloss::{GLOSS_ORDER, GlossLight};
use super::joint::{Joint, Unknowns};
use super::moments::Moments;
use super::room::{KnownLight, fit_matt_room, fit_metal_room};
use super::search::{Expected, PixelFit, Room, unit};
use super::solve::{SenseFigure, StartFigure, all_moments, search_all};
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
/// A matt object in an unknown light that leaves no more than this of the curves has no gloss: with it, light and shape could be
/// others and explain as much.
const MATT_LEAVES: f64 = 0.005;
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
    /// One a kind that was tried, at least one; that of the room first where it was given.
    pub(super) bodies: Vec<BodyFigure>,
    /// For each of them, what is left of the blocks' curves, with what their normals are off those that are expected.
    pub(super) costs: Vec<f64>,
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

    /// What is still to be found of a room.
    pub(super) fn unknowns_of(&self, room: &Room) -> Unknowns<'_> {
        match self.unknowns(room.body) {
            Unknowns::Light { .. } if room.gloss.is_none() => Unknowns::Light { bands: 0 },
            unknowns => unknowns,
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
            let mut given = run(body)?;
            if let Some(other) = self.other_kind(given.bodies[0]) {
                // What was given is taken, whatever comes of the other.
                if let Ok(found) = run(other) {
                    given.bodies.extend(found.bodies);
                    given.costs.extend(found.costs);
                }
            }
            return Ok(given);
        }
        let diffuse = run(BodyKind::Diffuse)?;
        if !may_be_metal(diffuse.bodies[0].residual) {
            return Ok(diffuse);
        }
        let metal = run(BodyKind::Metal)?;
        let bodies = [&diffuse, &metal].map(|found| found.bodies[0]);
        let costs = [&diffuse, &metal].map(|found| found.costs[0]);
        let [of_diffuse, of_metal] = bodies.map(|figure| figure.residual);
        let taken = if is_metal(of_diffuse, of_metal) {
            metal
        } else {
            diffuse
        };
        Ok(FoundRoom {
            bodies: bodies.to_vec(),
            costs: costs.to_vec(),
            ..taken
        })
    }

    /// The other kind, where what the given one leaves does not settle that it is right. Without gloss a diffuse body is not to
    /// be compared with metal.
    fn other_kind(&self, given: BodyFigure) -> Option<BodyKind> {
        let has_gloss = self.has_shape || self.known.is_some();
        match given.body {
            BodyKind::Diffuse => {
                (has_gloss && may_be_metal(given.residual)).then_some(BodyKind::Metal)
            }
            BodyKind::Metal => Some(BodyKind::Diffuse),
        }
    }

    /// How well the other sense of turning explains the curves, beside that of a room that was found: for the first kind of body
    /// of which it is doubted, else the last that was tried.
    pub(super) fn sense(
        &self,
        curves: &TurnCurves,
        expected: Option<&[Expected]>,
        found: &FoundRoom,
    ) -> Option<SenseFigure> {
        let coarse = Coarse::new(curves, expected).with_other_sense();
        let mut told = None;
        for (figure, &residual) in found.bodies.iter().zip(&found.costs) {
            // Metal in the wrong sense can seem to explain a diffuse body, so that both are compared.
            let other_residual = self.cost_in(&coarse, figure.body)?;
            let sense = SenseFigure {
                residual,
                other_residual,
            };
            told = Some(sense);
            if sense.is_doubted() {
                break;
            }
        }
        told
    }

    /// What an object leaves: in unknown light, from the best start that is at hand.
    fn cost_in(&self, coarse: &Coarse, body: BodyKind) -> Option<f64> {
        if let Some(known) = &self.known {
            return Some(self.find_in(coarse, known, body).0);
        }
        let alternation = Alternation {
            coarse,
            setting: self,
            body,
        };
        let (_, start) = self.starts(coarse).swap_remove(0);
        let (cost, room) = alternation.run(start)?;
        if !self.has_shape || body == BodyKind::Metal || alternation.is_matt(&room) {
            return Some(cost);
        }
        Some(alternation.with_gloss(room).0)
    }

    fn find_of(&self, coarse: &Coarse, body: BodyKind) -> Result<FoundRoom, TurnError> {
        let (cost, room, starts) = match &self.known {
            Some(known) => {
                let (cost, room) = self.find_in(coarse, known, body);
                (cost, room, Vec::new())
            }
            None => self.find_light(coarse, body)?,
        };
        let fits = coarse.fits(&room);
        Ok(FoundRoom {
            room,
            starts,
            bodies: vec![BodyFigure::new(body, &fits)],
            costs: vec![cost],
        })
    }

    /// A room of known light.
    fn find_in(&self, coarse: &Coarse, known: &KnownLight, body: BodyKind) -> (f64, Room) {
        let joint = coarse.joint(self.unknowns(body));
        joint.found(self.unblurred(known, body), JOINT_ROUNDS, JOINT_STEPS)
    }

    /// A room of known light to begin with: without gloss, or with metal that is hardly rough.
    pub(super) fn unblurred(&self, known: &KnownLight, body: BodyKind) -> Room {
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

    /// Normals to start an unknown light from, the best ones first.
    fn starts(&self, coarse: &Coarse) -> Vec<(&'static str, Vec<[f64; 3]>)> {
        let mut starts = Vec::new();
        if let Some(expected) = coarse.expected.as_ref().filter(|_| self.has_shape) {
            let normals = expected.iter().map(|expected| expected.normal).collect();
            starts.push(("prior", normals));
        }
        starts.extend(HEIGHTS.map(|(name, height)| (name, inflated(&coarse.curves, height))));
        starts
    }

    /// An unknown light, from all starts.
    fn find_light(
        &self,
        coarse: &Coarse,
        body: BodyKind,
    ) -> Result<(f64, Room, Vec<StartFigure>), TurnError> {
        let alternation = Alternation {
            coarse,
            setting: self,
            body,
        };
        let mut ended: Vec<(&str, Option<(f64, Room)>)> = self
            .starts(coarse)
            .into_iter()
            .map(|(name, normals)| (name, alternation.run(normals)))
            .collect();
        let (_, room) = best(&ended).ok_or(TurnError::NoLight)?;
        if self.has_shape && body == BodyKind::Diffuse && !alternation.is_matt(&room) {
            for (_, ended) in &mut ended {
                *ended = ended.map(|(_, room)| alternation.with_gloss(room));
            }
        }
        let (least, room) = best(&ended).ok_or(TurnError::NoLight)?;
        let figures = ended.into_iter().map(|(start, ended)| {
            let residual = ended.map_or(1.0, |(residual, _)| residual);
            StartFigure {
                start: start.to_owned(),
                residual,
                taken: residual <= least,
            }
        });
        Ok((least, room, figures.collect()))
    }
}

/// The end that leaves least.
fn best(ended: &[(&str, Option<(f64, Room)>)]) -> Option<(f64, Room)> {
    let ended = ended.iter().filter_map(|(_, ended)| *ended);
    ended.min_by(|a, b| a.0.total_cmp(&b.0))
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

    /// The same if the table turns the other way.
    fn with_other_sense(self) -> Self {
        let curves = self.curves.with_other_sense();
        Self {
            moments: all_moments(&curves),
            curves,
            ..self
        }
    }

    /// The best normals anywhere, and what they leave.
    fn fits(&self, room: &Room) -> Vec<PixelFit> {
        search_all(room, &self.moments, self.expected.as_deref(), None)
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
    /// What is left in the end, and the room: light and normals in turns, then both together. A diffuse object has no gloss yet.
    fn run(&self, start: Vec<[f64; 3]>) -> Option<(f64, Room)> {
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
    fn with_gloss(&self, room: Room) -> (f64, Room) {
        let all = self.coarse.joint(self.setting.unknowns(self.body));
        all.found(room, JOINT_ROUNDS, JOINT_STEPS)
    }

    /// Whether a room without gloss explains the curves.
    fn is_matt(&self, room: &Room) -> bool {
        let fits = self.coarse.fits(room);
        BodyFigure::new(self.body, &fits).residual <= MATT_LEAVES
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
