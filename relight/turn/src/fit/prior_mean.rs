//! The prior mean of a turn's normals, and the shading model that a fit begins with.

use relight_core::image::Extent;

use crate::error::TurnError;
use crate::fit::azimuth::{AzimuthFigures, AzimuthSources};
use crate::fit::figures::InitialisationFigure;
use crate::fit::inflation::inflated;
use crate::fit::initialisation::FittedLight;
use crate::fit::normal_step::PriorNormal;
use crate::fit::options::{TurnOptions, TurnPrior};
use crate::fit::prior_weight::PriorWeight;
use crate::fit::setting::Setting;
use crate::model::directions::unit;
use crate::model::frame::TableFrame;
use crate::model::known_light::KnownLight;
use crate::model::material::MaterialKind;
use crate::observe::curves::TurnCurves;

/// Parameters of the prior mean.
struct PriorParameters {
    /// Weight of the inflated shape as the prior mean, as `TurnOptions::prior_weight`. By hand.
    outline_weight: f64,
    /// Range in which the expected error of a normal counts, degrees. By hand.
    errors_deg: (f64, f64),
}

const PARAMETERS: PriorParameters = PriorParameters {
    outline_weight: 0.15,
    errors_deg: (5.0, 40.0),
};

/// The prior normals, and the shading model on blocks of pixels that goes with them.
pub(crate) struct Initialised {
    pub(crate) prior: Option<Vec<PriorNormal>>,
    pub(crate) setting: Setting,
    pub(crate) found: FittedLight,
    pub(crate) is_prior_left_out: bool,
    /// From which side the light comes, where anything says so.
    pub(crate) azimuth: Option<AzimuthFigures>,
}

impl Initialised {
    pub(crate) fn find(curves: &TurnCurves, options: &TurnOptions) -> Result<Self, TurnError> {
        let frame = TableFrame::new(options.elevation);
        let known = options.light.as_ref();
        let known = known.map(|light| KnownLight::new(light, &frame));
        let sources = AzimuthSources {
            frame,
            panorama: options.panorama.as_ref(),
            given: known.as_ref().map(|known| &known.diffuse),
        };
        let (aligned, azimuth) = sources.align(curves, options.prior.as_ref());
        let prior = aligned
            .as_ref()
            .or(options.prior.as_ref())
            .map(|prior| prior_of(curves, prior, options.prior_weight))
            .transpose()?;
        let has_shape = prior.is_some();
        let prior = match &known {
            None => Some(prior.unwrap_or_else(|| of_outline(curves, PARAMETERS.outline_weight))),
            Some(_) => prior,
        };
        let has_errors = |prior: &TurnPrior| prior.expected_errors.is_some();
        let has_errors = options.prior.as_ref().is_some_and(has_errors);
        let setting = Setting {
            frame,
            known,
            has_shape,
            has_errors,
        };
        let weight = PriorWeight::of(options);
        let found = setting.find(curves, prior.as_deref(), options.material, weight)?;
        let initialised = Self {
            prior,
            setting,
            found,
            is_prior_left_out: false,
            azimuth,
        };
        Ok(initialised.or_outline(curves, options))
    }

    /// Where a Lambertian material fits the turn, light and shape that go with the prior mean fit it as well as others
    /// do. Then the shape inflated out of the outline becomes the prior mean, if it is nearer to what fits the turn.
    fn or_outline(mut self, curves: &TurnCurves, options: &TurnOptions) -> Self {
        let weight = options.prior_weight;
        // A prior that knows how far it is off has seen the turn: the outline says nothing more.
        let is_lambertian =
            self.found.model.material == MaterialKind::Diffuse && self.found.model.gloss.is_none();
        if self.setting.known.is_some()
            || !self.setting.has_shape
            || !is_lambertian
            || weight <= 0.0
            || self.setting.has_errors
        {
            return self;
        }
        let setting = Setting {
            has_shape: false,
            has_errors: false,
            ..self.setting.clone()
        };
        let outline = of_outline(curves, weight);
        let diffuse = Some(MaterialKind::Diffuse);
        let by_outline = PriorWeight::of(options);
        let Ok(found) = setting.find(curves, Some(&outline), diffuse, by_outline) else {
            return self;
        };
        let is_nearer = found.costs[0] < self.found.costs[0];
        let groups = [
            (&self.found.initialisations, "", !is_nearer),
            (&found.initialisations, " alone", is_nearer),
        ];
        let initialisations = groups
            .into_iter()
            .flat_map(|(initialisations, ending, counts)| {
                initialisations
                    .iter()
                    .map(move |start| InitialisationFigure {
                        name: format!("{}{ending}", start.name),
                        residual: start.residual,
                        taken: start.taken && counts,
                    })
            });
        let initialisations = initialisations.collect();
        if is_nearer {
            return Self {
                prior: Some(outline),
                setting,
                found: FittedLight {
                    initialisations,
                    ..found
                },
                is_prior_left_out: true,
                // It was that of the prior.
                azimuth: None,
            };
        }
        self.found.initialisations = initialisations;
        self
    }
}

/// The normals of the shape inflated out of the outline, where nothing else is known of the shape.
fn of_outline(curves: &TurnCurves, weight: f64) -> Vec<PriorNormal> {
    let normal = |normal| PriorNormal {
        normal,
        weight,
        sureness: 1.0,
    };
    inflated(curves, 1.0).into_iter().map(normal).collect()
}

/// The prior at each pixel under the mask.
fn prior_of(
    curves: &TurnCurves,
    prior: &TurnPrior,
    weight: f64,
) -> Result<Vec<PriorNormal>, TurnError> {
    let errors = prior.expected_errors.as_ref();
    let fits = |extent: Extent| extent == curves.extent();
    for found in [
        Some(prior.normals.extent()),
        errors.map(|errors| errors.extent()),
    ] {
        if let Some(found) = found.filter(|&found| !fits(found)) {
            return Err(TurnError::PriorSize {
                found,
                expected: curves.extent(),
            });
        }
    }
    let whole = prior.normals.completed(&curves.mask());
    let [x, y, z] = whole.planes().planes();
    let sureness = |place: usize| {
        let (least, most) = PARAMETERS.errors_deg;
        errors.map_or(1.0, |errors| {
            let error = f64::from(errors.plane(0)[place]).clamp(least, most);
            error.to_radians().powi(-2)
        })
    };
    let at = |&place: &usize| PriorNormal {
        normal: unit([x, y, z].map(|plane| f64::from(plane[place]))),
        weight,
        sureness: sureness(place),
    };
    Ok(curves.places().iter().map(at).collect())
}
