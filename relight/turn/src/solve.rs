//! Normals, albedo and light of a whole turn.

use std::f64::consts::FRAC_PI_2;

use rayon::prelude::*;
use serde::Serialize;

use super::albedo::shared;
use super::begin::{COARSE_PIXELS, FoundRoom, Setting};
use super::body::{BodyFigure, BodyKind, doubted};
use super::joint::Joint;
use super::moments::Moments;
use super::robust::trust;
use super::room::KnownLight;
use super::search::{Expected, PixelFit, Room, Search, unit};
use super::start::{blurred, inflated};
use super::{Conditioning, Elevation, RoomVerdict, TableFrame, TableLight, TurnCurves, TurnError};
use relight_core::image::{Linear, Planes, Rgb};
use relight_core::light::{Normals, ShLight, YUp};

/// Steps for those whose highlights and shadows are left out.
const ROBUST_STEPS: usize = 3;
/// How much the normals of a body inflated out of the outline count where there is no prior.
const OUTLINE_WEIGHT: f64 = 0.15;
/// The least smoothing of a map of normals, pixels.
const LEAST_BLUR: f64 = 0.6;
/// Rounds in which what does not fit is left out.
const ROBUST_ROUNDS: usize = 3;
/// Nine tenths of normally distributed values are within so many deviations.
const NINTH_TENTH: f64 = 0.9;
const DEVIATIONS: f64 = 1.645;
/// How far the surroundings of a pixel reach, in parts of the frame's width: a normal that differs from theirs is not to be
/// believed as far.
const SURROUNDINGS: f64 = 1.0 / 40.0;
/// Degrees of freedom of what is left of a curve: fitted to the angles that its looseness stands for.
const FREEDOM: f64 = 3.0;
/// A turn of which the median pixel leaves this much is not explained so well that bends of the surface are real.
const UNEXPLAINED: f64 = 0.005;
/// How far normals are off as a whole in unknown light, radians: a bend that light makes up for, which no residual
/// shows. With a prior, and without.
const BENT_WITH_PRIOR: f64 = 0.25;
const BENT_ALONE: f64 = 0.35;
/// What shade in hollows and bounced light do to normals in known light, radians.
const BENT_IN_KNOWN_LIGHT: f64 = 0.08;
/// A sense of turning that leaves no more than this is not doubted, and another one only where it leaves less than this part.
const SENSE_LEAVES: f64 = 0.02;
const SENSE_CLEARLY: f64 = 0.75;
/// How far normals are off where the turn does not tell them, radians.
const UNTOLD: f64 = 1.0;
/// How far a normal is off where nearly all of its light is clipped, radians.
const CLIPPED_ERROR: f64 = 0.8;
/// The expected error at which the confidence is one half, radians.
const HALF_CONFIDENCE: f64 = 0.2;

/// What is known of a turn beforehand.
#[derive(Debug, Clone)]
pub struct TurnOptions {
    /// The camera over the table.
    pub elevation: Elevation,
    /// The light, in the viewer's frame at the table's angle 0, where it was measured; bands up to 6
    /// count, those beyond 2 for gloss alone.
    pub light: Option<ShLight>,
    /// Normals to start from, where there are any.
    pub prior: Option<Normals<YUp>>,
    /// How much these count: `weight (1 - cos)` is added to what is left of a pixel's curve, over the energy
    /// of its variation.
    pub prior_weight: f64,
    /// What the object is made of; what explains the curves where it is not known.
    pub body: Option<BodyKind>,
}

impl Default for TurnOptions {
    fn default() -> Self {
        Self {
            elevation: Elevation::assumed(),
            light: None,
            prior: None,
            prior_weight: 0.15,
            body: None,
        }
    }
}

/// How a start ended.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StartFigure {
    /// Its name.
    pub start: String,
    /// What it left of the curves, with what its normals are off the prior.
    pub residual: f64,
    /// Whether its light was taken.
    pub taken: bool,
}

/// How well both senses in which the table can turn explain the curves.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SenseFigure {
    /// What the one that was taken leaves of the curves of blocks of pixels, with what the normals are off the prior.
    pub residual: f64,
    /// The same of the other one.
    pub other_residual: f64,
}

impl SenseFigure {
    /// Whether the other sense explains clearly more.
    #[must_use]
    pub fn is_doubted(&self) -> bool {
        self.residual > SENSE_LEAVES && self.other_residual < SENSE_CLEARLY * self.residual
    }
}

/// Normals, albedo and light.
#[derive(Debug, Clone)]
pub struct TurnSolution {
    /// One a pixel under the mask.
    pub(super) fits: Vec<PixelFit>,
    /// The albedo of each pixel, which is that of its fit where its normal is to be believed.
    albedo: Vec<[f64; 3]>,
    /// The angle that each normal is expected to be off, radians.
    pub(super) expected_errors: Vec<f64>,
    pub(super) room: Room,
    pub(super) elevation: Elevation,
    /// The light, where it was measured.
    pub(super) measured: Option<ShLight>,
    pub(super) starts: Vec<StartFigure>,
    pub(super) bodies: Vec<BodyFigure>,
    pub(super) has_prior: bool,
    is_prior_left_out: bool,
    sense: Option<SenseFigure>,
    given_body: Option<BodyKind>,
    conditioning: Conditioning,
}

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
    for _ in 0..ROBUST_ROUNDS {
        solver.refine();
    }
    solver.draw_albedo();
    let has_prior = options.prior.is_some() && !is_prior_left_out;
    let common = match &options.light {
        Some(_) => BENT_IN_KNOWN_LIGHT,
        None if has_prior => BENT_WITH_PRIOR,
        None => BENT_ALONE,
    };
    let untold = if conditioning.verdict.is_fit() {
        0.0
    } else {
        UNTOLD
    };
    let common = common
        .hypot(options.elevation.uncertainty_deg().to_radians())
        .hypot(untold);
    let own_errors = solver.own_errors();
    if solver.setting.known.is_none() {
        solver.normalise();
    }
    let albedo = solver.shared_albedo(&own_errors);
    let whole = |own: &OwnError| own.whole().hypot(common).min(FRAC_PI_2);
    let expected_errors = own_errors.iter().map(whole).collect();
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

impl TurnSolution {
    /// The normals in the viewer's frame.
    #[must_use]
    pub fn normals(&self, curves: &TurnCurves) -> Normals<YUp> {
        Normals::new(curves.map(|pixel| self.fits[pixel].normal.map(|v| v as f32)))
    }

    /// The albedo: in the light's units where that was known, else in such units that the mean shading of the
    /// object over the turn is 1 in each channel. Where a normal is hardly to be believed, it is that of the same colour around.
    #[must_use]
    pub fn albedo(&self, curves: &TurnCurves) -> Rgb<Linear> {
        Rgb::new(curves.map(|pixel| self.albedo[pixel].map(|v| v as f32)))
    }

    /// The albedo that goes with each normal's shading, right or wrong.
    #[must_use]
    pub fn fitted_albedo(&self, curves: &TurnCurves) -> Rgb<Linear> {
        Rgb::new(curves.map(|pixel| self.fits[pixel].albedo.map(|v| v as f32)))
    }

    /// The shading over the whole turn: the mean irradiance of each pixel, or what white metal would show.
    #[must_use]
    pub fn shading(&self, curves: &TurnCurves) -> Rgb<Linear> {
        Rgb::new(curves.map(|pixel| {
            let waves = self.room.waves(self.fits[pixel].normal);
            waves.body.map(|waves| waves[0].max(0.0) as f32)
        }))
    }

    /// How far each normal is to be believed, 0 to 1: one half where it is expected to be off by 11.5 degrees.
    #[must_use]
    pub fn confidence(&self, curves: &TurnCurves) -> Planes<1> {
        curves.map(|pixel| [confidence(self.expected_errors[pixel]) as f32])
    }

    /// The light.
    #[must_use]
    pub const fn light(&self) -> &TableLight {
        &self.room.light
    }

    /// The camera over the table.
    #[must_use]
    pub const fn frame(&self) -> &TableFrame {
        &self.room.frame
    }

    /// What the object is taken for.
    #[must_use]
    pub const fn body(&self) -> BodyKind {
        self.room.body
    }

    /// What each kind of body that was tried leaves of the curves.
    #[must_use]
    pub fn bodies(&self) -> &[BodyFigure] {
        &self.bodies
    }

    /// Whether the light, of the turn and where it was given, is fit for this.
    #[must_use]
    pub const fn conditioning(&self) -> Conditioning {
        self.conditioning
    }

    /// The other kind, where one was given and the other explains clearly more.
    #[must_use]
    pub fn doubted_body(&self) -> Option<BodyKind> {
        self.given_body.and_then(|_| doubted(&self.bodies))
    }

    /// How well both senses of turning explain the curves; none where that is not told.
    #[must_use]
    pub const fn sense(&self) -> Option<SenseFigure> {
        self.sense
    }

    /// Whether the normals to start from were left out: a body inflated out of the outline agrees with the turn better.
    #[must_use]
    pub const fn is_prior_left_out(&self) -> bool {
        self.is_prior_left_out
    }

    /// How each start of an unknown light ended; none where it was known.
    #[must_use]
    pub fn starts(&self) -> &[StartFigure] {
        &self.starts
    }

    /// The median over the pixels of what is left of a curve, over the energy of its variation.
    #[must_use]
    pub fn residual(&self) -> f64 {
        median(self.fits.iter().map(|fit| fit.residual))
    }

    /// The median over the pixels of the angle that a normal is expected to be off, degrees.
    #[must_use]
    pub fn expected_error_deg(&self) -> f64 {
        median(self.expected_errors.iter().copied()).to_degrees()
    }
}

pub(super) fn confidence(expected_error: f64) -> f64 {
    1.0 / (1.0 + (expected_error / HALF_CONFIDENCE).powi(2))
}

/// The lower of the two values in the middle; 0 where there are none.
pub(super) fn median(values: impl Iterator<Item = f64>) -> f64 {
    quantile(values, 0.5)
}

/// The value that this part of the others, 0 to 1, does not exceed; 0 where there are none.
fn quantile(values: impl Iterator<Item = f64>, part: f64) -> f64 {
    let mut values: Vec<f64> = values.collect();
    if values.is_empty() {
        return 0.0;
    }
    let place = ((values.len() - 1) as f64 * part) as usize;
    *values.select_nth_unstable_by(place, f64::total_cmp).1
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
            None => Some(prior.unwrap_or_else(|| of_outline(curves, OUTLINE_WEIGHT))),
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

/// What a pixel's normal is expected to be off by itself, radians.
#[derive(Debug, Clone, Copy)]
struct OwnError {
    /// By what is left of its curve, and by what is clipped.
    loose: f64,
    /// By how far it is from the normals around it.
    bent: f64,
}

impl OwnError {
    fn whole(&self) -> f64 {
        self.loose.hypot(self.bent)
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
        let every = self.moments.len().div_ceil(COARSE_PIXELS).max(1);
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
        (self.room, _) = joint.refined(self.room, near, ROBUST_STEPS);
        self.fits = self.search(Some(&self.fits));
    }

    /// Draws the albedo of pixels that hardly see light, or of whose curve much is left, to the median of all.
    fn draw_albedo(&mut self) {
        let fits = &self.fits;
        let of_channel = |c: usize| fits.iter().map(move |fit| fit.albedo[c]);
        let middle = [0, 1, 2].map(|c| median(of_channel(c)));
        // By the ninth tenth of the distances: spots of another colour count, a few pixels that went wrong do not.
        let spread = [0, 1, 2].map(|c| {
            let distances = of_channel(c).map(|one| (one - middle[c]).abs());
            quantile(distances, NINTH_TENTH) / DEVIATIONS
        });
        let room = &self.room;
        self.fits
            .par_iter_mut()
            .zip(&self.moments)
            .filter(|(_, moments)| !moments.is_dark())
            .for_each(|(fit, moments)| {
                let waves = room.waves(fit.normal);
                fit.albedo = moments.drawn_albedo(&waves, (middle, spread), FREEDOM);
            });
    }

    /// The normals around each pixel, smoothed.
    fn surroundings(&self) -> Vec<[f64; 3]> {
        let map = self
            .curves
            .map(|pixel| self.fits[pixel].normal.map(|v| v as f32));
        let deviation = SURROUNDINGS * self.curves.extent().width as f64;
        let smooth = blurred(&map, &self.curves.mask(), deviation.max(LEAST_BLUR));
        let [x, y, z] = smooth.planes();
        let at = |&place: &usize| unit([x, y, z].map(|plane| f64::from(plane[place])));
        self.curves.places().iter().map(at).collect()
    }

    /// What each pixel's normal is expected to be off by itself.
    fn own_errors(&self) -> Vec<OwnError> {
        let search = Search::new(&self.room);
        let surroundings = self.surroundings();
        (0..self.fits.len())
            .into_par_iter()
            .map(|pixel| {
                let moments = &self.moments[pixel];
                if moments.is_dark() {
                    return OwnError {
                        loose: FRAC_PI_2,
                        bent: 0.0,
                    };
                }
                let expected = self.expected.as_ref().map(|all| all[pixel]);
                let fit = &self.fits[pixel];
                let loose = search.looseness(moments, expected, fit, FREEDOM);
                let clipped = CLIPPED_ERROR * self.curves.clipped_at(pixel);
                let bent = super::search::dot(surroundings[pixel], fit.normal);
                OwnError {
                    loose: loose.hypot(clipped),
                    bent: bent.clamp(-1.0, 1.0).acos(),
                }
            })
            .collect()
    }

    /// The albedos, where normals are hardly to be believed by those around them. A bent surface is not to be doubted where the
    /// turn is explained.
    fn shared_albedo(&self, errors: &[OwnError]) -> Vec<[f64; 3]> {
        let left = median(self.fits.iter().map(|fit| fit.residual));
        let doubt = (left / UNEXPLAINED).min(1.0);
        let error = |own: &OwnError| own.loose.hypot(doubt * own.bent);
        let errors: Vec<f64> = errors.iter().map(error).collect();
        let albedo: Vec<[f64; 3]> = self.fits.iter().map(|fit| fit.albedo).collect();
        shared(self.curves, &albedo, &errors)
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

pub(super) fn all_moments(curves: &TurnCurves) -> Vec<Moments> {
    (0..curves.pixels())
        .into_par_iter()
        .map(|pixel| Moments::new(curves, pixel, None))
        .collect()
}

/// The best normals of all pixels: near those of other fits, or anywhere.
pub(super) fn search_all(
    room: &Room,
    moments: &[Moments],
    expected: Option<&[Expected]>,
    near: Option<&[PixelFit]>,
) -> Vec<PixelFit> {
    let search = Search::new(room);
    moments
        .par_iter()
        .enumerate()
        .map(|(pixel, moments)| {
            let expected = expected.map(|all| all[pixel]);
            if moments.is_dark() {
                return PixelFit {
                    normal: expected.map_or([0.0, 0.0, 1.0], |expected| expected.normal),
                    albedo: [0.0; 3],
                    residual: 1.0,
                };
            }
            match near {
                Some(fits) => search.near(moments, expected, fits[pixel].normal),
                None => search.anywhere(moments, expected),
            }
        })
        .collect()
}

/// What is left of the curves, with what normals are off those that are expected, the mean over the pixels.
pub(super) fn cost(fits: &[PixelFit], expected: Option<&[Expected]>) -> f64 {
    let sum: f64 = fits
        .iter()
        .enumerate()
        .map(|(pixel, fit)| {
            let off = expected.map_or(0.0, |all| {
                let expected = all[pixel];
                expected.weight * (1.0 - super::search::dot(expected.normal, fit.normal))
            });
            fit.residual.min(1.0) + off
        })
        .sum();
    sum / fits.len().max(1) as f64
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
