//! Steps of the exposure during a turn, found by the light of the frames themselves.
//!
//! From one frame to the next the light on an object changes little, and not on all of it alike; a step of the exposure
//! changes all pixels by the same factor at once.

use relight_core::statistics::median;
use serde::Serialize;

/// Pixels that are looked at, spread over the object. By hand.
const SAMPLED_PIXELS: usize = 256;
/// Linear light, of the three channels together, below which a pixel does not count. By hand.
const LEAST_LIGHT: f32 = 3e-3;
/// Frames before and after that predict how the light itself changes. By hand.
const NEIGHBOURS: usize = 3;
/// Least step beyond the prediction, natural logarithm of a factor. By hand.
const LEAST_STEP: f64 = 0.03;
/// The same in medians of what frames of the turn differ from their predictions. By hand.
const OUTLIER_FACTOR: f64 = 8.0;
/// Gaps between frames narrower than this predict nothing, in median gaps. By hand.
const LEAST_SPAN: f64 = 0.2;
/// Gaps wider than this tell no step from the light itself, in median gaps. By hand.
const WIDE_SPAN: f64 = 1.5;
/// Gaps narrower than this do so whatever the median, degrees. By hand.
const WIDE_GAP_DEG: f64 = 12.0;
/// What the steps of a whole turn may add up to, natural logarithm of a factor, for each step. Derived: they lead
/// back to where they began; the tolerance is by hand.
const CLOSURE: f64 = 0.02;

/// A change of the exposure between two frames.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct ExposureStep {
    /// The table's angle of the first frame after it, degrees.
    pub(crate) angle_deg: f64,
    /// The exposure after it over that before.
    pub(crate) factor: f64,
}

/// Which pixels are looked at, and what they showed in each frame: the sum of the channels, or nothing where one clips.
#[derive(Debug, Default)]
pub(crate) struct ExposureWatch {
    frames: Vec<Seen>,
}

#[derive(Debug)]
struct Seen {
    angle_deg: f64,
    light: Vec<Option<f32>>,
}

impl ExposureWatch {
    /// Takes up a frame with the pixels at these places.
    pub(crate) fn push(
        &mut self,
        angle_deg: f64,
        places: &[usize],
        planes: [&[f32]; 3],
        clipped: f32,
    ) {
        let every = places.len().div_ceil(SAMPLED_PIXELS).max(1);
        let light = |&at: &usize| {
            let channels = planes.map(|plane| plane[at]);
            let sum: f32 = channels.iter().sum();
            let is_usable = channels.iter().all(|&value| value < clipped) && sum > LEAST_LIGHT;
            is_usable.then_some(sum)
        };
        self.frames.push(Seen {
            angle_deg: angle_deg.rem_euclid(360.0),
            light: places.iter().step_by(every).map(light).collect(),
        });
    }

    /// The steps in order of the angle, and the exposure of each frame in the order in which they came, over that of
    /// most.
    pub(crate) fn finish(&self) -> (Vec<ExposureStep>, Vec<f64>) {
        let even = vec![1.0; self.frames.len()];
        let mut order: Vec<usize> = (0..self.frames.len()).collect();
        order.sort_by(|&a, &b| {
            let angle = |at: usize| self.frames[at].angle_deg;
            angle(a).total_cmp(&angle(b))
        });
        let count = order.len();
        if count <= 2 * NEIGHBOURS + 1 {
            return (Vec::new(), even);
        }
        let frame = |at: usize| &self.frames[order[at % count]];
        // Where frames are missing, the light itself has had longer to change.
        let gaps: Vec<f64> = (0..count)
            .map(|at| {
                let gap = frame(at).angle_deg - frame(at + count - 1).angle_deg;
                gap.rem_euclid(360.0)
            })
            .collect();
        let usual_gap = median(gaps.iter().copied()).unwrap_or(0.0);
        let spans: Vec<f64> = gaps
            .iter()
            .map(|gap| {
                if usual_gap > 0.0 {
                    gap / usual_gap
                } else {
                    1.0
                }
            })
            .collect();
        let changes: Vec<f64> = (0..count)
            .map(|at| change(frame(at + count - 1), frame(at)))
            .collect();
        // The change that leads to each frame, but for how the light itself changes there.
        let jumps: Vec<f64> = (0..count)
            .map(|at| {
                let around = (1..=NEIGHBOURS).flat_map(|k| [at + k, at + count - k]);
                let slopes = around
                    .map(|other| other % count)
                    .filter(|&other| spans[other] > LEAST_SPAN)
                    .map(|other| changes[other] / spans[other]);
                changes[at] - spans[at] * median(slopes).unwrap_or(0.0)
            })
            .collect();
        let usual = median(jumps.iter().map(|jump| jump.abs())).unwrap_or(0.0);
        // What is expected over a gap is off by how the light bends there: by the square of its span.
        let least = |at: usize| LEAST_STEP.max(OUTLIER_FACTOR * usual * spans[at].powi(2).max(1.0));
        let is_observable = |at: usize| spans[at] < WIDE_SPAN || gaps[at] < WIDE_GAP_DEG;
        let steps: Vec<(usize, f64)> = jumps
            .iter()
            .copied()
            .enumerate()
            .filter(|&(at, jump)| is_observable(at) && jump.abs() > least(at))
            .collect();
        let sum: f64 = steps.iter().map(|(_, jump)| jump).sum();
        if steps.is_empty() || sum.abs() > CLOSURE * steps.len() as f64 {
            return (Vec::new(), even);
        }
        let mut exposures = even;
        let mut exposure = 0.0;
        let mut next = steps.iter().peekable();
        for (at, &frame) in order.iter().enumerate() {
            if let Some((_, jump)) = next.next_if(|(step, _)| *step == at) {
                exposure += jump;
            }
            exposures[frame] = exposure;
        }
        let usual = median(exposures.iter().copied()).unwrap_or(0.0);
        exposures
            .iter_mut()
            .for_each(|value| *value = (*value - usual).exp());
        let steps = steps.into_iter().map(|(at, jump)| ExposureStep {
            angle_deg: frame(at).angle_deg,
            factor: jump.exp(),
        });
        (steps.collect(), exposures)
    }
}

/// The logarithm of by how much the pixels are brighter, the median; 0 where none is usable.
fn change(before: &Seen, after: &Seen) -> f64 {
    let pairs = before.light.iter().zip(&after.light);
    let changes = pairs.filter_map(|pair| match pair {
        (Some(before), Some(after)) => Some(f64::from(after / before).ln()),
        _ => None,
    });
    median(changes).unwrap_or(0.0)
}

#[cfg(test)]
mod tests;
