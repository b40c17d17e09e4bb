//! Light, gloss, normals and albedo at once: Gauss and Newton's steps for the room, in which every pixel follows.
//!
//! To fit the room and the pixels in turns takes many rounds, for each is held by the other. A step here takes from what the
//! room's unknowns do to a curve that part which the pixel's own normal and albedo could do as well (Schur's complement of
//! their equations); what is left tells of the room alone.

use rayon::prelude::*;
use relight_core::statistics::median;

use crate::fit::curve_statistics::Moments;
use crate::fit::normal_step::Expected;
use crate::fit::schur::Sums;
use crate::fit::search::{PixelFit, Search, cost, search_all};
use crate::fit::unknowns::{Columns, Guess, Unknowns};
use crate::model::shading::Room;

/// Parameters of the joint optimisation.
struct JointParameters {
    /// Damping of the first step, relative to the diagonal (Levenberg-Marquardt). Numerical.
    damping: f64,
    /// Factor of the damping after a step that lowers the cost. Numerical.
    damping_fall: f64,
    /// Factor of the damping after one that does not. Numerical.
    damping_rise: f64,
    /// Damping at which the steps end. Numerical.
    most_damping: f64,
    /// Relative gain of a step below which the steps end. Numerical.
    settled: f64,
    /// Pixels that one task adds up. Fixed, so that sums do not depend on the number of threads.
    chunk: usize,
    /// Residual at which a pixel counts one quarter, in medians. By hand.
    outlier: f64,
    /// Least residual that is taken for the median, over the energy of the variation. Numerical.
    least_median: f64,
}

const PARAMETERS: JointParameters = JointParameters {
    damping: 1e-3,
    damping_fall: 0.2,
    damping_rise: 10.0,
    most_damping: 1e3,
    settled: 2e-3,
    chunk: 128,
    outlier: 4.0,
    least_median: 1e-3,
};

/// Pixels whose room is to be found.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Joint<'a> {
    pub(crate) moments: &'a [Moments],
    pub(crate) expected: Option<&'a [Expected]>,
    pub(crate) unknowns: Unknowns<'a>,
}

impl Joint<'_> {
    /// What is left in the end, and the room: its normals are looked for anywhere, then all is refined, and so on.
    pub(crate) fn found(&self, start: Room, rounds: usize, steps: usize) -> (f64, Room) {
        let mut room = start;
        let mut left = f64::INFINITY;
        for _ in 0..rounds {
            let fits = search_all(&room, self.moments, self.expected, None);
            let (found, fits) = self.refined(room, fits, steps);
            let reached = cost(&fits, self.expected);
            if reached < left {
                (room, left) = (found, reached);
            }
        }
        (left, room)
    }

    /// Room and pixels after at most so many steps from these.
    pub(crate) fn refined(
        &self,
        room: Room,
        fits: Vec<PixelFit>,
        steps: usize,
    ) -> (Room, Vec<PixelFit>) {
        let (mut guess, mut fits) = (Guess::of(&room, self.unknowns), fits);
        let (frame, mut damping) = (room.frame, PARAMETERS.damping);
        let mut least = cost(&fits, self.expected);
        for _ in 0..steps {
            let room = guess.room(&frame, self.unknowns);
            let Some(step) = self.step(&guess, &room, &fits, damping) else {
                break;
            };
            let other = guess.moved(&step, self.unknowns);
            let room = other.room(&frame, self.unknowns);
            let found = search_all(&room, self.moments, self.expected, Some(&fits));
            let reached = cost(&found, self.expected);
            if reached < least {
                let gain = (least - reached) / least;
                (guess, fits, least) = (other, found, reached);
                damping *= PARAMETERS.damping_fall;
                if gain < PARAMETERS.settled {
                    break;
                }
            } else {
                damping *= PARAMETERS.damping_rise;
                if damping > PARAMETERS.most_damping {
                    break;
                }
            }
        }
        (guess.room(&frame, self.unknowns), fits)
    }

    /// How the unknowns should change.
    fn step(
        &self,
        guess: &Guess,
        room: &Room,
        fits: &[PixelFit],
        damping: f64,
    ) -> Option<Vec<f64>> {
        let weights = weights(fits);
        let columns = Columns {
            guess,
            bands: self.unknowns.bands(guess)?,
            layout: self.unknowns.layout(),
            room,
        };
        let search = Search::new(room);
        let sums = (0..fits.len().div_ceil(PARAMETERS.chunk))
            .into_par_iter()
            .map(|chunk| {
                let mut sums = Sums::new(columns.layout.count());
                let pixels =
                    chunk * PARAMETERS.chunk..((chunk + 1) * PARAMETERS.chunk).min(fits.len());
                for pixel in pixels.filter(|&pixel| !self.moments[pixel].is_dark()) {
                    let expected = self.expected.map(|all| all[pixel]);
                    let one = (&self.moments[pixel], expected, fits[pixel].normal);
                    sums.add_pixel(&search, &columns, one, weights[pixel]);
                }
                sums
            })
            .reduce(|| Sums::new(columns.layout.count()), Sums::plus);
        sums.solve(damping)
    }
}

/// How much the energy that is left of each pixel's curve counts, so that bright pixels, which stand out of the noise, count
/// more: less where the model does not explain it.
fn weights(fits: &[PixelFit]) -> Vec<f64> {
    let median = median(fits.iter().map(|fit| fit.residual))
        .unwrap_or(0.0)
        .max(PARAMETERS.least_median);
    let weight = |fit: &PixelFit| {
        let size = fit.residual / (PARAMETERS.outlier * median);
        1.0 / (1.0 + size).powi(2)
    };
    fits.iter().map(weight).collect()
}
