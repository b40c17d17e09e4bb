//! From which side of the table the light comes, by all that says so.
//!
//! Turning all normals about the table's axis, and the light with them, changes no Lambertian curve: no residual says
//! how far an answer is turned. Two things are found here, each with its uncertainty: by how much the prior's normals are
//! turned, and where the light's bright side is. What knows the shape says nothing of the light but through the light that
//! fits the curves on it, which is the less sure of its bright side the weaker that is; what has seen the light says
//! something of the shape by the same way. Sources are put together as von Mises distributions, whose product is one again.

use serde::Serialize;

use crate::fit::curve_statistics::CurveStatistics;
use crate::fit::environment::fit_lambertian;
use crate::fit::options::TurnPrior;
use crate::model::directions::{LEAST_FACING, unit};
use crate::model::frame::TableFrame;
use crate::model::lighting::TableLight;
use crate::observe::curves::TurnCurves;
use crate::observe::strip::StripFigures;
use relight_core::light::{Normals, YUp};

/// Parameters of the sources.
struct AzimuthParameters {
    /// Pixels on which the light of the prior's normals is fitted. By hand.
    pixels: usize,
    /// Expected error of normals that do not know it, degrees. By hand.
    untold_error_deg: f64,
    /// Standard deviation by which normals are turned about the axis, as a part of the error that is expected of them.
    /// Measured: with the next but one, on the 16 synthetic turns of seed 3001 (docs/results/turns.md).
    of_normals: f64,
    /// The same of normals that do not know their errors. By hand: those of single photographs were turned by 8 to 29
    /// degrees on three sessions.
    of_untold_normals: f64,
    /// Standard deviation of the bright side of the light that is fitted to normals, as a part of the error that is
    /// expected of them, over the light's bright part. Measured.
    of_light: f64,
    /// Least standard deviation of each, degrees. By hand.
    least_deg: f64,
    /// Standard deviation of the panorama strip's azimuth, degrees. Measured: the example `strip_azimuth`.
    of_panorama_deg: f64,
    /// Least bright part of a strip that says something. Measured: below, it points anywhere.
    least_bright_part: f64,
    /// Standard deviation of the turn that the outline shows, degrees. By hand.
    of_outline_deg: f64,
    /// Distance from the outline, pixels, in which normals are compared with it. By hand.
    rim: usize,
    /// Least upward part of the outline's direction: below, the object ends at the table and not at its own bend. By hand.
    least_up: f64,
    /// Least number of pixels at the outline. By hand.
    least_outline: usize,
    /// Standard deviation of the frame in which a light was given or measured, degrees. By hand.
    of_given_deg: f64,
    /// Error of such a light from one side, in parts of its mean. By hand: in even light it hides the bright side.
    of_given_part: f64,
}

const PARAMETERS: AzimuthParameters = AzimuthParameters {
    pixels: 2500,
    untold_error_deg: 20.0,
    of_normals: 0.2,
    of_untold_normals: 1.0,
    of_light: 0.14,
    least_deg: 1.0,
    of_panorama_deg: 70.0,
    least_bright_part: 0.6,
    of_outline_deg: 12.0,
    rim: 2,
    least_up: -0.3,
    least_outline: 30,
    of_given_deg: 3.0,
    of_given_part: 0.02,
};

/// What says from which side the light comes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum AzimuthSource {
    /// The network's normals, or others that were given, with the light that goes with them.
    Network,
    /// The bright side of what the video shows of the room.
    Panorama,
    /// The outline, at which normals stand at right angles to the line of sight.
    Outline,
    /// A light that was given or measured.
    Given,
}

/// One source of the azimuth.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AzimuthEvidence {
    /// Which.
    pub source: AzimuthSource,
    /// The light's bright side in the table's frame at the angle 0, from x towards y, degrees.
    pub azimuth_deg: f64,
    /// Its circular standard deviation, degrees.
    pub uncertainty_deg: f64,
}

/// From which side the light comes, by all sources together.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AzimuthFigures {
    /// The light's bright side in the table's frame at the angle 0, from x towards y, degrees.
    pub azimuth_deg: f64,
    /// Its circular standard deviation, degrees.
    pub uncertainty_deg: f64,
    /// By how much the prior's normals were turned about the table's axis for it, degrees; 0 without a prior.
    pub turned_deg: f64,
    /// The sources.
    pub evidence: Vec<AzimuthEvidence>,
}

/// What is known beside the prior.
#[derive(Debug, Clone, Copy)]
pub(crate) struct AzimuthSources<'a> {
    pub(crate) frame: TableFrame,
    pub(crate) panorama: Option<&'a StripFigures>,
    pub(crate) given: Option<&'a TableLight>,
}

/// What is known of the shape: a prior, the light that fits it, and how far both may be turned, degrees.
struct TurnedShape {
    azimuth_deg: f64,
    normals_deviation_deg: f64,
    light_deviation_deg: f64,
    /// By how much the outline would turn it.
    by_outline_deg: Option<f64>,
}

impl AzimuthSources<'_> {
    /// The prior, turned about the table's axis to where all sources together see it, and where they see the light; none
    /// where nothing says where that is.
    pub(crate) fn align(
        &self,
        curves: &TurnCurves,
        prior: Option<&TurnPrior>,
    ) -> (Option<TurnPrior>, Option<AzimuthFigures>) {
        let shape = prior.and_then(|prior| self.shape(curves, prior));
        let of_light = self.of_light();
        let turned_deg = shape.as_ref().map_or(0.0, |shape| shape.turn(&of_light));
        let own = shape
            .as_ref()
            .map(|shape| shape.light(product(shape.turns())));
        let seen = own.into_iter().chain(of_light.iter().map(stated));
        let mut evidence = shape.as_ref().map_or_else(Vec::new, TurnedShape::evidence);
        let (azimuth_deg, uncertainty_deg) = product(seen);
        evidence.extend(of_light);
        let figures = (!evidence.is_empty()).then_some(AzimuthFigures {
            azimuth_deg,
            uncertainty_deg,
            turned_deg,
            evidence,
        });
        let aligned = prior.filter(|_| shape.is_some()).map(|prior| TurnPrior {
            normals: turned(curves, &prior.normals, &self.frame, turned_deg),
            ..prior.clone()
        });
        (aligned, figures)
    }

    /// What has seen the light itself.
    fn of_light(&self) -> Vec<AzimuthEvidence> {
        let given = self.given.map(|light| AzimuthEvidence {
            source: AzimuthSource::Given,
            azimuth_deg: light.bright_azimuth_deg(),
            uncertainty_deg: of_given(light),
        });
        let panorama = self.panorama.and_then(of_panorama);
        panorama.into_iter().chain(given).collect()
    }

    fn shape(&self, curves: &TurnCurves, prior: &TurnPrior) -> Option<TurnedShape> {
        if prior.normals.extent() != curves.extent() {
            return None;
        }
        let normals = normals_of(curves, &prior.normals);
        let light = light_of(curves, &normals, &self.frame)?;
        let (expected, of_normals) = match mean_expected_error(curves, prior) {
            Some(expected) => (expected, PARAMETERS.of_normals),
            None => (PARAMETERS.untold_error_deg, PARAMETERS.of_untold_normals),
        };
        let of_light = PARAMETERS.of_light / light.bright_part().max(f64::MIN_POSITIVE);
        let deviation = |part: f64| (part * expected).max(PARAMETERS.least_deg);
        Some(TurnedShape {
            azimuth_deg: light.bright_azimuth_deg(),
            normals_deviation_deg: deviation(of_normals),
            light_deviation_deg: deviation(of_light),
            by_outline_deg: turn_of_outline(curves, &normals, &self.frame),
        })
    }
}

impl TurnedShape {
    /// By how much prior and outline say that it is turned, degrees.
    fn turns(&self) -> Vec<(f64, f64)> {
        let outline = self
            .by_outline_deg
            .map(|by| (by, PARAMETERS.of_outline_deg));
        let own = (0.0, self.normals_deviation_deg);
        std::iter::once(own).chain(outline).collect()
    }

    /// By how much it is to be turned, degrees, by these and by what has seen the light.
    fn turn(&self, of_light: &[AzimuthEvidence]) -> f64 {
        let by_light = (!of_light.is_empty()).then(|| {
            let (seen_deg, deviation_deg) = product(of_light.iter().map(stated));
            let deviation = deviation_deg.hypot(self.light_deviation_deg);
            (seen_deg - self.azimuth_deg, deviation)
        });
        product(self.turns().into_iter().chain(by_light)).0
    }

    /// Where it sees the light, degrees, turned by so much with such a standard deviation.
    fn light(&self, (turn_deg, deviation_deg): (f64, f64)) -> (f64, f64) {
        let deviation = deviation_deg.hypot(self.light_deviation_deg);
        (self.azimuth_deg + turn_deg, deviation)
    }

    /// What the prior and the outline say of the light, each by itself.
    fn evidence(&self) -> Vec<AzimuthEvidence> {
        let sources = [AzimuthSource::Network, AzimuthSource::Outline];
        let turns = self.turns().into_iter().zip(sources);
        turns
            .map(|(turn, source)| {
                let (azimuth_deg, uncertainty_deg) = self.light(turn);
                AzimuthEvidence {
                    source,
                    azimuth_deg,
                    uncertainty_deg,
                }
            })
            .collect()
    }
}

/// The standard deviation of the bright side of a light that was given, degrees.
fn of_given(light: &TableLight) -> f64 {
    let hidden = PARAMETERS.of_given_part.atan2(light.bright_part());
    PARAMETERS.of_given_deg.hypot(hidden.to_degrees())
}

/// An azimuth with its standard deviation, degrees.
fn stated(evidence: &AzimuthEvidence) -> (f64, f64) {
    (evidence.azimuth_deg, evidence.uncertainty_deg)
}

/// The mean error that is expected of a prior, degrees.
fn mean_expected_error(curves: &TurnCurves, prior: &TurnPrior) -> Option<f64> {
    let errors = prior.expected_errors.as_ref()?;
    if errors.extent() != curves.extent() {
        return None;
    }
    let sum: f64 = curves
        .places()
        .iter()
        .map(|&place| f64::from(errors.plane(0)[place]))
        .sum();
    Some(sum / curves.pixels().max(1) as f64)
}

fn normals_of(curves: &TurnCurves, normals: &Normals<YUp>) -> Vec<[f64; 3]> {
    let planes = normals.planes().planes();
    let at = |&place: &usize| unit(planes.map(|plane| f64::from(plane[place])));
    curves.places().iter().map(at).collect()
}

/// The light of order 2 that goes with normals.
fn light_of(curves: &TurnCurves, normals: &[[f64; 3]], frame: &TableFrame) -> Option<TableLight> {
    let every = curves.pixels().div_ceil(PARAMETERS.pixels).max(1);
    let taken = (0..curves.pixels()).step_by(every);
    let statistics: Vec<CurveStatistics> = taken
        .clone()
        .map(|pixel| CurveStatistics::new(curves, pixel, None))
        .collect();
    let normals: Vec<[f64; 3]> = taken.clone().map(|pixel| normals[pixel]).collect();
    let mut albedo: Vec<[f64; 3]> = taken
        .map(|pixel| CurveStatistics::mean(curves, pixel).map(|mean| mean.max(1e-6)))
        .collect();
    fit_lambertian(&statistics, &normals, &mut albedo, frame).map(|model| model.light)
}

/// What a panorama strip says, where it has a bright side.
fn of_panorama(strip: &StripFigures) -> Option<AzimuthEvidence> {
    (strip.bright_part >= PARAMETERS.least_bright_part).then_some(AzimuthEvidence {
        source: AzimuthSource::Panorama,
        azimuth_deg: strip.bright_azimuth_deg,
        uncertainty_deg: PARAMETERS.of_panorama_deg,
    })
}

/// By how much normals have to be turned about the table's axis, degrees, to stand at right angles to the line of sight
/// along the outline, where that is not at the table; none where there is little of it.
fn turn_of_outline(curves: &TurnCurves, normals: &[[f64; 3]], frame: &TableFrame) -> Option<f64> {
    let axis = frame.axis();
    let (mut along, mut across, mut count) = (0.0, 0.0, 0);
    for (outward, normal) in outline(curves).zip(normals) {
        let Some([x, y]) = outward.filter(|[_, y]| *y >= PARAMETERS.least_up) else {
            continue;
        };
        // Rodrigues: the part of the turned normal along the outline's direction is a cos + b sin, and a constant.
        let outward = [x, y, 0.0];
        let level = axis.iter().zip(normal).map(|(a, n)| a * n).sum::<f64>();
        let onto = axis.iter().zip(outward).map(|(a, o)| a * o).sum::<f64>();
        let facing = normal.iter().zip(outward).map(|(n, o)| n * o).sum::<f64>();
        along += facing - level * onto;
        let [ax, ay, az] = axis;
        let [nx, ny, nz] = *normal;
        let cross = [ay * nz - az * ny, az * nx - ax * nz, ax * ny - ay * nx];
        across += cross.iter().zip(outward).map(|(c, o)| c * o).sum::<f64>();
        count += 1;
    }
    (count >= PARAMETERS.least_outline && along > 0.0).then(|| across.atan2(along).to_degrees())
}

/// At each pixel near the outline the direction out of the mask, x to the right and y up.
fn outline(curves: &TurnCurves) -> impl Iterator<Item = Option<[f64; 2]>> {
    let extent = curves.extent();
    let mut inside = vec![false; extent.pixels()];
    curves
        .places()
        .iter()
        .for_each(|&place| inside[place] = true);
    let reach = PARAMETERS.rim as isize;
    curves.places().iter().map(move |&place| {
        let (x, y) = (
            (place % extent.width) as isize,
            (place / extent.width) as isize,
        );
        let mut out = [0.0, 0.0];
        for dy in -reach..=reach {
            for dx in -reach..=reach {
                let (u, v) = (x + dx, y + dy);
                // Where the picture ends nothing is known of the outline.
                let within =
                    u >= 0 && v >= 0 && u < extent.width as isize && v < extent.height as isize;
                if within && !inside[v as usize * extent.width + u as usize] {
                    out[0] += dx as f64;
                    out[1] -= dy as f64;
                }
            }
        }
        let length = out[0].hypot(out[1]);
        (length > 0.5).then(|| out.map(|part| part / length))
    })
}

/// The product of von Mises distributions, each by its mean and circular standard deviation, degrees. Where they are
/// further apart than they say, it is the wider for it (Birge, "The Calculation of Errors by the Method of Least Squares",
/// 1932).
fn product(all: impl IntoIterator<Item = (f64, f64)>) -> (f64, f64) {
    let all: Vec<(f64, f64)> = all.into_iter().collect();
    let (mut x, mut y) = (0.0, 0.0);
    for (mean_deg, deviation_deg) in &all {
        let (sin, cos) = mean_deg.to_radians().sin_cos();
        let concentration = concentration(deviation_deg.to_radians());
        x += concentration * cos;
        y += concentration * sin;
    }
    let mean = y.atan2(x).to_degrees();
    let length = resultant(x.hypot(y)).clamp(1e-9, 1.0);
    let deviation = (-2.0 * length.ln()).max(0.0).sqrt().to_degrees();
    let apart = |(one, deviation): &(f64, f64)| {
        let off = (one - mean + 180.0).rem_euclid(360.0) - 180.0;
        (off / deviation).powi(2)
    };
    let misfit: f64 = all.iter().map(apart).sum();
    let freedom = all.len().saturating_sub(1).max(1) as f64;
    (mean, deviation * (misfit / freedom).max(1.0).sqrt())
}

/// The concentration of a circular standard deviation, radians (Fisher, "Statistical Analysis of Circular Data", 1993,
/// equation 3.43).
fn concentration(deviation: f64) -> f64 {
    let r = (-0.5 * deviation * deviation).exp();
    if r < 0.53 {
        2.0 * r + r.powi(3) + 5.0 * r.powi(5) / 6.0
    } else if r < 0.85 {
        -0.4 + 1.39 * r + 0.43 / (1.0 - r)
    } else {
        1.0 / (r.powi(3) - 4.0 * r * r + 3.0 * r)
    }
}

/// The mean resultant length of a concentration, I_1 / I_0, by its continued fraction.
fn resultant(concentration: f64) -> f64 {
    if concentration > 500.0 {
        return 1.0 - 0.5 / concentration;
    }
    let mut fraction = 0.0;
    for k in (1..=200).rev() {
        fraction = 1.0 / (2.0 * f64::from(k) / concentration.max(1e-9) + fraction);
    }
    fraction
}

/// Normals turned about the table's axis; those that would look away are at right angles to the line of sight.
fn turned(
    curves: &TurnCurves,
    normals: &Normals<YUp>,
    frame: &TableFrame,
    degrees: f64,
) -> Normals<YUp> {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let planes = normals.planes().planes();
    Normals::new(curves.map(|pixel| {
        let place = curves.places()[pixel];
        let [x, y, z] = frame.to_table(planes.map(|plane| f64::from(plane[place])));
        let [x, y, z] = frame.to_viewer([cos * x - sin * y, sin * x + cos * y, z]);
        unit([x, y, z.max(LEAST_FACING)]).map(|value| value as f32)
    }))
}

#[cfg(test)]
mod tests;
