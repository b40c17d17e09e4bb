//! Normals, albedo and light of a whole turn.

use relight_core::statistics::{median, quantile};

use rayon::prelude::*;
use relight_core::light::{Normals, YUp};

use crate::error::TurnError;
use crate::fit::blocks::BLOCK_PARAMETERS;
use crate::fit::confidence::{
    ERROR_PARAMETERS, FittedPixels, OwnError, common_error, own_errors, shared_albedo,
};
use crate::fit::curve_statistics::{Moments, all_moments};
use crate::fit::figures::StartFigure;
use crate::fit::inflation::inflated;
use crate::fit::initialisation::FoundRoom;
use crate::fit::joint::Joint;
use crate::fit::normal_step::Expected;
use crate::fit::options::TurnOptions;
use crate::fit::robust::trust;
use crate::fit::search::{PixelFit, search_all};
use crate::fit::setting::Setting;
use crate::fit::solution::TurnSolution;
use crate::model::directions::unit;
use crate::model::frame::TableFrame;
use crate::model::known_light::KnownLight;
use crate::model::material::BodyKind;
use crate::model::shading::Room;
use crate::observe::conditioning::Conditioning;
use crate::observe::curves::TurnCurves;
use crate::observe::verdict::RoomVerdict;

/// Parameters of the solver.
struct SolveParameters {
    /// Gauss-Newton steps of the joint optimisation in each robust round. By hand.
    robust_steps: usize,
    /// Weight of the inflated shape as the prior mean, as `TurnOptions::prior_weight`. By hand.
    outline_weight: f64,
    /// Rounds of robust weights. By hand.
    robust_rounds: usize,
    /// Quantile of the distances that measures the spread of albedos. By hand: spots of another colour count, a few
    /// pixels that went wrong do not.
    spread_quantile: f64,
    /// Where that quantile is, in standard deviations. Derived: of the absolute value of a normal distribution.
    spread_deviations: f64,
}

const PARAMETERS: SolveParameters = SolveParameters {
    robust_steps: 3,
    outline_weight: 0.15,
    robust_rounds: 3,
    spread_quantile: 0.9,
    spread_deviations: 1.645,
};

/// Finds the normals, albedo and light that explain the curves of a turn best.
///
/// With a known light every pixel is solved by itself. With an unknown one, light and normals are found in
/// turns, from several starts, on blocks of pixels; the start with the least residual is taken. Then
/// parts of the turn that a pixel's fit does not explain, shadows and highlights, are left out for that pixel,
/// and it is fitted again.
///
/// # Errors
/// Where the prior has another size, or no light explains the curves: [`TurnError::Unfit`] where the exposure is why.
pub fn solve_turn(curves: &TurnCurves, options: &TurnOptions) -> Result<TurnSolution, TurnError> {
    let of_turn = Conditioning::of(curves);
    let led = Led::find(curves, options).map_err(|error| match (error, of_turn.verdict) {
        (TurnError::NoLight, verdict @ (RoomVerdict::Overexposed | RoomVerdict::Underexposed)) => {
            TurnError::Unfit(verdict)
        }
        (error, _) => error,
    })?;
    let Led {
        expected,
        setting,
        found,
        is_prior_left_out,
    } = led;
    let conditioning = match &setting.known {
        Some(known) => of_turn.in_given(&setting.unblurred(known, found.room.body)),
        None => of_turn,
    };
    let sense = if conditioning.verdict.is_fit() {
        setting.sense(curves, expected.as_deref(), &found)
    } else {
        None
    };
    let mut solver = Solver {
        curves,
        expected,
        room: found.room,
        setting,
        moments: all_moments(curves),
        fits: Vec::new(),
    };
    solver.fits = solver.search(None);
    for _ in 0..PARAMETERS.robust_rounds {
        solver.refine();
    }
    solver.draw_albedo();
    let has_prior = options.prior.is_some() && !is_prior_left_out;
    let common = common_error(options, has_prior, conditioning.verdict.is_fit());
    let own_errors = solver.own_errors();
    if solver.setting.known.is_none() {
        solver.normalise();
    }
    let albedo = shared_albedo(curves, &solver.fits, &own_errors);
    let expected_errors = own_errors.iter().map(|own| own.with(common)).collect();
    Ok(TurnSolution {
        has_prior,
        is_prior_left_out,
        sense,
        given_body: options.body,
        albedo,
        fits: solver.fits,
        expected_errors,
        room: solver.room,
        elevation: options.elevation,
        measured: options.light.clone(),
        starts: found.starts,
        bodies: found.bodies,
        conditioning,
    })
}

/// Normals to lean on, and the room on blocks of pixels that goes with them.
struct Led {
    expected: Option<Vec<Expected>>,
    setting: Setting,
    found: FoundRoom,
    is_prior_left_out: bool,
}

impl Led {
    fn find(curves: &TurnCurves, options: &TurnOptions) -> Result<Self, TurnError> {
        let frame = TableFrame::new(options.elevation);
        let known = options.light.as_ref();
        let known = known.map(|light| KnownLight::new(light, &frame));
        let prior = options
            .prior
            .as_ref()
            .map(|prior| expected(curves, prior, options.prior_weight))
            .transpose()?;
        let has_shape = prior.is_some();
        let expected = match &known {
            None => Some(prior.unwrap_or_else(|| of_outline(curves, PARAMETERS.outline_weight))),
            Some(_) => prior,
        };
        let setting = Setting {
            frame,
            known,
            has_shape,
        };
        let found = setting.find(curves, expected.as_deref(), options.body)?;
        let led = Self {
            expected,
            setting,
            found,
            is_prior_left_out: false,
        };
        Ok(led.or_outline(curves, options.prior_weight))
    }

    /// Where a matt body explains the turn, light and shape that go with the prior explain it as well as others do: then the
    /// outline leads if what it expects is nearer to what explains the turn.
    fn or_outline(mut self, curves: &TurnCurves, weight: f64) -> Self {
        let is_matt = self.found.room.body == BodyKind::Diffuse && self.found.room.gloss.is_none();
        if self.setting.known.is_some() || !self.setting.has_shape || !is_matt || weight <= 0.0 {
            return self;
        }
        let setting = Setting {
            has_shape: false,
            ..self.setting.clone()
        };
        let outline = of_outline(curves, weight);
        let Ok(found) = setting.find(curves, Some(&outline), Some(BodyKind::Diffuse)) else {
            return self;
        };
        let is_nearer = found.costs[0] < self.found.costs[0];
        let groups = [
            (&self.found.starts, "", !is_nearer),
            (&found.starts, " alone", is_nearer),
        ];
        let starts = groups.into_iter().flat_map(|(starts, ending, counts)| {
            starts.iter().map(move |start| StartFigure {
                start: format!("{}{ending}", start.start),
                residual: start.residual,
                taken: start.taken && counts,
            })
        });
        let starts = starts.collect();
        if is_nearer {
            return Self {
                expected: Some(outline),
                setting,
                found: FoundRoom { starts, ..found },
                is_prior_left_out: true,
            };
        }
        self.found.starts = starts;
        self
    }
}

/// All pixels under one light.
struct Solver<'a> {
    curves: &'a TurnCurves,
    expected: Option<Vec<Expected>>,
    room: Room,
    setting: Setting,
    moments: Vec<Moments>,
    fits: Vec<PixelFit>,
}

impl Solver<'_> {
    /// The best normals near others, or anywhere.
    fn search(&self, near: Option<&[PixelFit]>) -> Vec<PixelFit> {
        search_all(&self.room, &self.moments, self.expected.as_deref(), near)
    }

    /// Leaves out what does not fit, fits the room again, and then every pixel.
    fn refine(&mut self) {
        let (curves, room) = (self.curves, &self.room);
        self.moments = (0..curves.pixels())
            .into_par_iter()
            .map(|pixel| {
                let trust = trust(curves, pixel, &self.fits[pixel], room);
                Moments::new(curves, pixel, Some(&trust))
            })
            .collect();
        let every = self.moments.len().div_ceil(BLOCK_PARAMETERS.pixels).max(1);
        let moments: Vec<Moments> = self.moments.iter().step_by(every).copied().collect();
        let fits: Vec<PixelFit> = self.fits.iter().step_by(every).copied().collect();
        let expected = self.expected.as_ref();
        let expected: Option<Vec<Expected>> =
            expected.map(|all| all.iter().step_by(every).copied().collect());
        let joint = Joint {
            moments: &moments,
            expected: expected.as_deref(),
            unknowns: self.setting.unknowns_of(&self.room),
        };
        let near = search_all(&self.room, &moments, joint.expected, Some(&fits));
        (self.room, _) = joint.refined(self.room, near, PARAMETERS.robust_steps);
        self.fits = self.search(Some(&self.fits));
    }

    /// Draws the albedo of pixels that hardly see light, or of whose curve much is left, to the median of all.
    fn draw_albedo(&mut self) {
        let fits = &self.fits;
        let of_channel = |c: usize| fits.iter().map(move |fit| fit.albedo[c]);
        let middle = [0, 1, 2].map(|c| median(of_channel(c)).unwrap_or(0.0));
        // By the ninth tenth of the distances: spots of another colour count, a few pixels that went wrong do not.
        let spread = [0, 1, 2].map(|c| {
            let distances = of_channel(c).map(|one| (one - middle[c]).abs());
            quantile(distances, PARAMETERS.spread_quantile).unwrap_or(0.0)
                / PARAMETERS.spread_deviations
        });
        let room = &self.room;
        self.fits
            .par_iter_mut()
            .zip(&self.moments)
            .filter(|(_, moments)| !moments.is_dark())
            .for_each(|(fit, moments)| {
                let waves = room.waves(fit.normal);
                fit.albedo =
                    moments.drawn_albedo(&waves, (middle, spread), ERROR_PARAMETERS.freedom);
            });
    }

    /// What each pixel's normal is expected to be off by itself.
    fn own_errors(&self) -> Vec<OwnError> {
        own_errors(FittedPixels {
            curves: self.curves,
            moments: &self.moments,
            expected: self.expected.as_deref(),
            room: &self.room,
            fits: &self.fits,
        })
    }

    /// Brings the mean shading of each channel to 1.
    fn normalise(&mut self) {
        let mut sums = [0.0; 3];
        for fit in &self.fits {
            let waves = self.room.waves(fit.normal);
            for (sum, waves) in sums.iter_mut().zip(waves.body) {
                *sum += waves[0];
            }
        }
        let factors = sums.map(|sum| {
            let mean = sum / self.fits.len() as f64;
            if mean > 1e-12 { mean } else { 1.0 }
        });
        let parts = factors.map(|factor| 1.0 / factor);
        self.room.light = self.room.light.times(parts);
        if self.room.body == BodyKind::Metal {
            self.room.gloss = self.room.gloss.times(parts);
        }
        for fit in &mut self.fits {
            fit.albedo = [0, 1, 2].map(|c| fit.albedo[c] * factors[c]);
        }
    }
}

/// The normals of the body in the outline, where nothing else is known of the shape.
fn of_outline(curves: &TurnCurves, weight: f64) -> Vec<Expected> {
    let normal = |normal| Expected { normal, weight };
    inflated(curves, 1.0).into_iter().map(normal).collect()
}

/// The prior at each pixel under the mask.
fn expected(
    curves: &TurnCurves,
    prior: &Normals<YUp>,
    weight: f64,
) -> Result<Vec<Expected>, TurnError> {
    if prior.extent() != curves.extent() {
        return Err(TurnError::PriorSize {
            found: prior.extent(),
            expected: curves.extent(),
        });
    }
    let whole = prior.completed(&curves.mask());
    let [x, y, z] = whole.planes().planes();
    let at = |&place: &usize| Expected {
        normal: unit([x, y, z].map(|plane| f64::from(plane[place]))),
        weight,
    };
    Ok(curves.places().iter().map(at).collect())
}
