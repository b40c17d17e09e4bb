//! The environment light of a turn, on blocks of pixels: what the object is made of, and an unknown light from several
//! initialisations.

use crate::error::TurnError;
use crate::fit::alternation::{ALTERNATION_PARAMETERS, Alternation};
use crate::fit::blocks::Blocks;
use crate::fit::figures::{DirectionFigure, InitialisationFigure, MaterialFigure};
use crate::fit::inflation::inflated;
use crate::fit::material_choice::{is_metal, may_be_metal};
use crate::fit::normal_step::PriorNormal;
use crate::fit::prior_weight::PriorWeight;
use crate::fit::setting::Setting;
use crate::model::gloss::GlossLight;
use crate::model::known_light::KnownLight;
use crate::model::material::MaterialKind;
use crate::model::shading::ShadingModel;
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

/// A shading model that was fitted.
#[derive(Debug, Clone)]
pub(crate) struct FittedLight {
    pub(crate) model: ShadingModel,
    pub(crate) initialisations: Vec<InitialisationFigure>,
    /// One a kind that was tried, at least one; that of the environment first where it was given.
    pub(crate) materials: Vec<MaterialFigure>,
    /// For each of them, what is left of the blocks' curves, with what their normals are off those that are expected.
    pub(crate) costs: Vec<f64>,
}

impl Setting {
    /// The shading model that fits the curves best: of this material, or of the material that fits them where it is not
    /// known.
    pub(crate) fn find(
        &self,
        curves: &TurnCurves,
        prior: Option<&[PriorNormal]>,
        material: Option<MaterialKind>,
        weight: PriorWeight,
    ) -> Result<FittedLight, TurnError> {
        let mut coarse = Blocks::new(curves, prior, self.has_errors);
        if self.has_errors {
            self.balance(&mut coarse, weight)?;
        }
        let run = |material| self.find_of(&coarse, material);
        if let Some(material) = material {
            let mut given = run(material)?;
            if let Some(other) = self.other_kind(given.materials[0]) {
                // What was given is taken, whatever comes of the other.
                if let Ok(found) = run(other) {
                    given.materials.extend(found.materials);
                    given.costs.extend(found.costs);
                }
            }
            return Ok(given);
        }
        let diffuse = run(MaterialKind::Diffuse)?;
        if !may_be_metal(diffuse.materials[0].residual) {
            return Ok(diffuse);
        }
        let metal = run(MaterialKind::Metal)?;
        let materials = [&diffuse, &metal].map(|found| found.materials[0]);
        let costs = [&diffuse, &metal].map(|found| found.costs[0]);
        let [of_diffuse, of_metal] = materials.map(|figure| figure.residual);
        let taken = if is_metal(of_diffuse, of_metal) {
            metal
        } else {
            diffuse
        };
        Ok(FittedLight {
            materials: materials.to_vec(),
            costs: costs.to_vec(),
            ..taken
        })
    }

    /// Weights a prior whose errors are known by what is left of the curves in the light that goes with its normals.
    fn balance(&self, coarse: &mut Blocks, weight: PriorWeight) -> Result<(), TurnError> {
        let Some(prior) = &coarse.prior else {
            return Ok(());
        };
        let normals: Vec<_> = prior.iter().map(|prior| prior.normal).collect();
        let alternation = Alternation {
            coarse,
            setting: self,
            material: MaterialKind::Diffuse,
        };
        let model = alternation
            .room_of(&normals, &mut alternation.first_albedo(), 0)
            .ok_or(TurnError::NoLight)?;
        let fits = coarse.fits(&model);
        coarse.balance(weight, &fits);
        Ok(())
    }

    /// The other kind, where the residual of the given one does not settle that it is right. Without gloss a diffuse
    /// material is not to be compared with metal.
    fn other_kind(&self, given: MaterialFigure) -> Option<MaterialKind> {
        let has_gloss = self.has_shape || self.known.is_some();
        match given.material {
            MaterialKind::Diffuse => {
                (has_gloss && may_be_metal(given.residual)).then_some(MaterialKind::Metal)
            }
            MaterialKind::Metal => Some(MaterialKind::Diffuse),
        }
    }

    /// How well the other rotation direction fits the curves, beside that of a shading model that was fitted: for the
    /// first material of which it is doubted, else the last that was tried.
    pub(crate) fn direction(
        &self,
        curves: &TurnCurves,
        prior: Option<&[PriorNormal]>,
        found: &FittedLight,
    ) -> Option<DirectionFigure> {
        let coarse = Blocks::new(curves, prior, self.has_errors).with_other_direction();
        let mut told = None;
        // A sure prior settles the material.
        let counts =
            |figure: &MaterialFigure| !self.has_errors || figure.material == found.model.material;
        let tried = found.materials.iter().zip(&found.costs);
        for (figure, &residual) in tried.filter(|(figure, _)| counts(figure)) {
            // Metal in the wrong rotation direction can seem to fit a diffuse material, so that both are compared.
            let other_residual = self.cost_in(&coarse, figure.material)?;
            let direction = DirectionFigure {
                residual,
                other_residual,
            };
            told = Some(direction);
            if direction.is_doubted() {
                break;
            }
        }
        told
    }

    /// The residual of a material: in unknown light, from the best initialisation at hand.
    fn cost_in(&self, coarse: &Blocks, material: MaterialKind) -> Option<f64> {
        if let Some(known) = &self.known {
            return Some(self.find_in(coarse, known, material).0);
        }
        let alternation = Alternation {
            coarse,
            setting: self,
            material,
        };
        let (_, start) = self.initialisations(coarse).swap_remove(0);
        let (cost, model) = alternation.run(start)?;
        if !self.has_shape || material == MaterialKind::Metal || alternation.is_lambertian(&model) {
            return Some(cost);
        }
        Some(alternation.with_gloss(model).0)
    }

    fn find_of(&self, coarse: &Blocks, material: MaterialKind) -> Result<FittedLight, TurnError> {
        let (cost, model, initialisations) = match &self.known {
            Some(known) => {
                let (cost, model) = self.find_in(coarse, known, material);
                (cost, model, Vec::new())
            }
            None => self.find_light(coarse, material)?,
        };
        let fits = coarse.fits(&model);
        Ok(FittedLight {
            model,
            initialisations,
            materials: vec![MaterialFigure::new(material, &fits)],
            costs: vec![cost],
        })
    }

    /// A shading model in known light.
    fn find_in(
        &self,
        coarse: &Blocks,
        known: &KnownLight,
        material: MaterialKind,
    ) -> (f64, ShadingModel) {
        let joint = coarse.joint(self.unknowns(material));
        joint.found(
            self.unblurred(known, material),
            ALTERNATION_PARAMETERS.joint_rounds,
            ALTERNATION_PARAMETERS.joint_steps,
        )
    }

    /// The shading model that initialises a fit in known light: without gloss, or of metal that is hardly rough.
    pub(crate) fn unblurred(&self, known: &KnownLight, material: MaterialKind) -> ShadingModel {
        let mirror = known.mirror();
        let attenuations: Vec<f64> = (0..mirror.len())
            .map(|l| PARAMETERS.metal_attenuation.powi(l as i32))
            .collect();
        let gloss = match material {
            MaterialKind::Diffuse => GlossLight::NONE,
            MaterialKind::Metal => GlossLight::sum(mirror, &attenuations),
        };
        ShadingModel {
            frame: self.frame,
            light: known.diffuse,
            diffuse_beyond: known.diffuse_beyond,
            gloss,
            material,
        }
    }

    /// Normals to start an unknown light from, the best ones first.
    fn initialisations(&self, coarse: &Blocks) -> Vec<(&'static str, Vec<[f64; 3]>)> {
        let mut initialisations = Vec::new();
        if let Some(prior) = coarse.prior.as_ref().filter(|_| self.has_shape) {
            let normals = prior.iter().map(|prior| prior.normal).collect();
            initialisations.push(("prior", normals));
            if self.has_errors {
                return initialisations;
            }
        }
        initialisations.extend(
            PARAMETERS
                .heights
                .map(|(name, height)| (name, inflated(&coarse.curves, height))),
        );
        initialisations
    }

    /// An unknown light, from all initialisations.
    fn find_light(
        &self,
        coarse: &Blocks,
        material: MaterialKind,
    ) -> Result<(f64, ShadingModel, Vec<InitialisationFigure>), TurnError> {
        let alternation = Alternation {
            coarse,
            setting: self,
            material,
        };
        let mut ended: Vec<(&str, Option<(f64, ShadingModel)>)> = self
            .initialisations(coarse)
            .into_iter()
            .map(|(name, normals)| (name, alternation.run(normals)))
            .collect();
        let (_, model) = best(&ended).ok_or(TurnError::NoLight)?;
        if self.has_shape && material == MaterialKind::Diffuse && !alternation.is_lambertian(&model)
        {
            for (_, ended) in &mut ended {
                *ended = ended.map(|(_, model)| alternation.with_gloss(model));
            }
        }
        let (least, model) = best(&ended).ok_or(TurnError::NoLight)?;
        let figures = ended.into_iter().map(|(name, ended)| {
            let residual = ended.map_or(1.0, |(residual, _)| residual);
            InitialisationFigure {
                name: name.to_owned(),
                residual,
                taken: residual <= least,
            }
        });
        Ok((least, model, figures.collect()))
    }
}

/// The end of the smallest residual.
fn best(ended: &[(&str, Option<(f64, ShadingModel)>)]) -> Option<(f64, ShadingModel)> {
    let ended = ended.iter().filter_map(|(_, ended)| *ended);
    ended.min_by(|a, b| a.0.total_cmp(&b.0))
}

#[cfg(test)]
mod tests;
