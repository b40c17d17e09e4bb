//! The room of a turn, on blocks of pixels: what the object is made of, and an unknown light from several starts.

use crate::error::TurnError;
use crate::fit::alternation::{ALTERNATION_PARAMETERS, Alternation};
use crate::fit::blocks::Coarse;
use crate::fit::figures::{BodyFigure, SenseFigure, StartFigure};
use crate::fit::inflation::inflated;
use crate::fit::material_choice::{is_metal, may_be_metal};
use crate::fit::normal_step::Expected;
use crate::fit::setting::Setting;
use crate::model::gloss::GlossLight;
use crate::model::known_light::KnownLight;
use crate::model::material::BodyKind;
use crate::model::shading::Room;
use crate::observe::curves::TurnCurves;

/// Parameters of the initialisation.
struct InitialisationParameters {
    /// The inflated shapes that initialise an unknown light, by name and height, over that of the round shape. By hand.
    heights: [(&'static str, f64); 3],
    /// What metal shows of band l at first: this to the power of l. By hand.
    metal_attenuation: f64,
}

const PARAMETERS: InitialisationParameters = InitialisationParameters {
    heights: [
        ("outline", 1.0),
        ("outline, flatter", 0.6),
        ("outline, rounder", 1.6),
    ],
    metal_attenuation: 0.9,
};

/// A room that was found.
#[derive(Debug, Clone)]
pub(crate) struct FoundRoom {
    pub(crate) room: Room,
    pub(crate) starts: Vec<StartFigure>,
    /// One a kind that was tried, at least one; that of the room first where it was given.
    pub(crate) bodies: Vec<BodyFigure>,
    /// For each of them, what is left of the blocks' curves, with what their normals are off those that are expected.
    pub(crate) costs: Vec<f64>,
}

impl Setting {
    /// The room in which an object of this kind explains the curves best; where the kind is not known, one of the kind that does.
    pub(crate) fn find(
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
    pub(crate) fn sense(
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
        joint.found(
            self.unblurred(known, body),
            ALTERNATION_PARAMETERS.joint_rounds,
            ALTERNATION_PARAMETERS.joint_steps,
        )
    }

    /// A room of known light to begin with: without gloss, or with metal that is hardly rough.
    pub(crate) fn unblurred(&self, known: &KnownLight, body: BodyKind) -> Room {
        let mirror = known.mirror();
        let shares: Vec<f64> = (0..mirror.len())
            .map(|l| PARAMETERS.metal_attenuation.powi(l as i32))
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
        starts.extend(
            PARAMETERS
                .heights
                .map(|(name, height)| (name, inflated(&coarse.curves, height))),
        );
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
