//! From which side of the table the light comes, by all that says so.
//!
//! Turning all normals about the table's axis, and the light with them, changes no Lambertian curve: no residual says
//! how far an answer is turned. Each source here says where the light's bright side is, with an uncertainty. They are put
//! together as von Mises distributions, whose product is one again.

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
    /// Pixels on which the light of the network's normals is fitted. By hand.
    pixels: usize,
    /// Standard deviation of the network's azimuth, as a part of the error that it expects of normals. By hand, after
    /// the 24 turns of docs/results/turns.md, on which normals are turned by 4 degrees in the mean.
    of_network: f64,
    /// Least standard deviation of it, degrees. By hand.
    least_network_deg: f64,
    /// Standard deviation of the panorama strip's azimuth, degrees. Measured: the example `strip_azimuth`.
    of_panorama_deg: f64,
    /// Least bright part of a strip that says something. Measured: below, it points anywhere.
    least_bright_part: f64,
    /// Standard deviation of the outline's azimuth, degrees. By hand.
    of_outline_deg: f64,
    /// Distance from the outline, pixels, in which normals are compared with it. By hand.
    rim: usize,
    /// Least upward part of the outline's direction: below, the object ends at the table and not at its own bend. By hand.
    least_up: f64,
    /// Least number of pixels at the outline. By hand.
    least_outline: usize,
    /// Standard deviation of a light that was given or measured, degrees. By hand.
    of_given_deg: f64,
}

const PARAMETERS: AzimuthParameters = AzimuthParameters {
    pixels: 2500,
    of_network: 0.5,
    least_network_deg: 2.0,
    of_panorama_deg: 70.0,
    least_bright_part: 0.6,
    of_outline_deg: 12.0,
    rim: 2,
    least_up: -0.3,
    least_outline: 30,
    of_given_deg: 3.0,
};

/// What says from which side the light comes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum AzimuthSource {
    /// The network's normals, with the light that goes with them.
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
    /// By how much the network's normals were turned about the table's axis for it, degrees.
    pub turned_deg: f64,
    /// The sources.
    pub evidence: Vec<AzimuthEvidence>,
}

/// What is known beside the network's answer.
#[derive(Debug, Clone, Copy)]
pub(crate) struct AzimuthSources<'a> {
    pub(crate) frame: TableFrame,
    pub(crate) panorama: Option<&'a StripFigures>,
    pub(crate) given: Option<&'a TableLight>,
}

impl AzimuthSources<'_> {
    /// The prior of the network, turned about the table's axis to where all sources together see the light; as it is
    /// where it does not know its errors, or no light goes with it.
    pub(crate) fn align(
        &self,
        curves: &TurnCurves,
        prior: &TurnPrior,
    ) -> Option<(TurnPrior, AzimuthFigures)> {
        let expected = mean_expected_error(curves, prior)?;
        let normals = normals_of(curves, &prior.normals);
        let own = light_of(curves, &normals, &self.frame)?.bright_azimuth_deg();
        let deviation = (PARAMETERS.of_network * expected).max(PARAMETERS.least_network_deg);
        let mut evidence = vec![AzimuthEvidence {
            source: AzimuthSource::Network,
            azimuth_deg: own,
            uncertainty_deg: deviation,
        }];
        let outline = turn_of_outline(curves, &normals, &self.frame);
        evidence.extend(outline.map(|by| AzimuthEvidence {
            source: AzimuthSource::Outline,
            azimuth_deg: own + by,
            uncertainty_deg: PARAMETERS.of_outline_deg,
        }));
        evidence.extend(self.panorama.and_then(of_panorama));
        evidence.extend(self.given.map(|light| AzimuthEvidence {
            source: AzimuthSource::Given,
            azimuth_deg: light.bright_azimuth_deg(),
            uncertainty_deg: PARAMETERS.of_given_deg,
        }));
        let (azimuth_deg, uncertainty_deg) = product(&evidence);
        let turned_deg = half_turn(azimuth_deg - own);
        let aligned = turned(curves, &prior.normals, &self.frame, turned_deg);
        Some((
            TurnPrior {
                normals: aligned,
                ..prior.clone()
            },
            AzimuthFigures {
                azimuth_deg,
                uncertainty_deg,
                turned_deg,
                evidence,
            },
        ))
    }
}

/// The mean error that the network expects, degrees.
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

/// The product of von Mises distributions: its mean and circular standard deviation, degrees.
fn product(evidence: &[AzimuthEvidence]) -> (f64, f64) {
    let (mut x, mut y) = (0.0, 0.0);
    for one in evidence {
        let (sin, cos) = one.azimuth_deg.to_radians().sin_cos();
        let concentration = concentration(one.uncertainty_deg.to_radians());
        x += concentration * cos;
        y += concentration * sin;
    }
    let length = resultant(x.hypot(y)).clamp(1e-9, 1.0);
    let deviation = (-2.0 * length.ln()).max(0.0).sqrt();
    (y.atan2(x).to_degrees(), deviation.to_degrees())
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

/// An angle between -180 and 180 degrees.
fn half_turn(degrees: f64) -> f64 {
    (degrees + 180.0).rem_euclid(360.0) - 180.0
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
