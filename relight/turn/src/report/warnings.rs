//! What a user should know of a result.

use crate::fit::probe_light::ProbeLight;
use crate::fit::solution::TurnSolution;
use crate::model::frame::ElevationSource;
use crate::observe::probe::ProbeBall;
use crate::observe::reading::{ReadTurn, RotationSource, TableRotation};
use crate::observe::verdict::TurnVerdict;
use crate::solving::SolvedTurn;
use relit_data::rig::RotationDirection;

/// Parameters of the warnings.
struct WarningParameters {
    /// Residual of a given light, over the energy of the variation, from which it is not that of the turn. By hand.
    most_residual: f64,
}

const PARAMETERS: WarningParameters = WarningParameters { most_residual: 0.4 };

/// Something that a user should know of a result. As text it says what was found; how to change it is for the program
/// to say.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TurnWarning {
    /// The ball does not look like what it was called.
    #[error("the ball was called {given}, but it looks {looks}")]
    BallKind {
        /// What it was called.
        given: ProbeBall,
        /// What it looks like.
        looks: ProbeBall,
    },
    /// The light by the ball fits the ball badly.
    #[error("the residual of the light by the ball is {:.0} % of what varies in it: measure its middle and radius in the video again, and see that nothing shades it", 100.0 * residual)]
    BallResidual {
        /// The residual over the variation.
        residual: f64,
    },
    /// Nobody said which way the table turns, and it is not the usual way.
    #[error(
        "the table is taken to turn {direction}, seen from above: that way the network of turns expects clearly smaller errors"
    )]
    TakenRotation {
        /// Which way.
        direction: RotationDirection,
    },
    /// Nothing says which way the table turns.
    #[error(
        "which way the table turns is not known: it is taken to turn {direction}, seen from above"
    )]
    AssumedRotation {
        /// What is usual.
        direction: RotationDirection,
    },
    /// The network of turns is surer of the turn in the other rotation direction.
    #[error(
        "the network of turns expects its normals to be {other_deg:.0} degrees off in the other rotation direction, and {expected_deg:.0} in this one"
    )]
    SurerInOtherDirection {
        /// The mean expected error in the given direction, degrees.
        expected_deg: f32,
        /// The same in the other one.
        other_deg: f32,
    },
    /// The elevation was assumed.
    #[error(
        "the camera's elevation is not known and taken as {degrees} degrees, {uncertainty_deg} either way"
    )]
    AssumedElevation {
        /// The elevation, degrees.
        degrees: f64,
        /// Its uncertainty, degrees.
        uncertainty_deg: f64,
    },
    /// The frames have no angles.
    #[error("the frames have no angles: they are taken for evenly spread over one turn")]
    NoAngles,
    /// A frame was left out.
    #[error("{0}")]
    Damage(String),
    /// Normals and albedo are not, or not everywhere, observable.
    #[error("{}", .0.advice().unwrap_or("the turn is well lit"))]
    Unfit(TurnVerdict),
    /// The given light is even, and the turn is not.
    #[error(
        "the light that was given hardly changes over the turn, but what the object shows does: it is not the light of this turn"
    )]
    GivenLightIsEven,
    /// The given light fits the turn badly.
    #[error("the residual in the light that was given is {:.0} % of what varies over the turn: see that it is this turn's, in the viewer's frame at the table's angle 0", 100.0 * residual)]
    GivenLightResidual {
        /// The residual over the energy of the variation.
        residual: f64,
    },
}

impl SolvedTurn {
    /// What a user should know of it.
    #[must_use]
    pub fn warnings(&self) -> Vec<TurnWarning> {
        let ball = self.ball.iter().flat_map(of_ball);
        let direction = of_rotation(self.turn.rotation).into_iter();
        let doubt = self.of_doubted_direction().into_iter();
        let solution = of_solution(&self.turn, &self.solution);
        ball.chain(direction).chain(doubt).chain(solution).collect()
    }

    /// Whether no frame was left out and normals and albedo are observable.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        self.turn.damage.is_empty() && self.solution.conditioning().verdict.is_fit()
    }

    /// Where the network of turns speaks against the direction that was taken.
    fn of_doubted_direction(&self) -> Option<TurnWarning> {
        let is_doubted = self.network.is_direction_doubted();
        is_doubted.then(|| TurnWarning::SurerInOtherDirection {
            expected_deg: self.network.expected_error_deg(),
            other_deg: self.network.other_direction_deg,
        })
    }
}

/// Those of a ball.
fn of_ball(measured: &ProbeLight) -> Vec<TurnWarning> {
    let kind = (measured.ball != measured.looks).then_some(TurnWarning::BallKind {
        given: measured.ball,
        looks: measured.looks,
    });
    let is_doubtful = measured.is_doubtful();
    let residual = is_doubtful.then_some(TurnWarning::BallResidual {
        residual: measured.residual,
    });
    kind.into_iter().chain(residual).collect()
}

/// That of a rotation that nobody said: where it was found and is not the usual one, or where nothing tells it.
fn of_rotation(TableRotation { direction, source }: TableRotation) -> Option<TurnWarning> {
    let is_usual = direction == RotationDirection::default();
    match source {
        RotationSource::Network => (!is_usual).then_some(TurnWarning::TakenRotation { direction }),
        RotationSource::Assumed => Some(TurnWarning::AssumedRotation { direction }),
        RotationSource::Given | RotationSource::Rig => None,
    }
}

/// Those of what was found.
fn of_solution(turn: &ReadTurn, solution: &TurnSolution) -> Vec<TurnWarning> {
    let mut warnings = Vec::new();
    let elevation = solution.elevation;
    if elevation.source() == ElevationSource::Assumed {
        warnings.push(TurnWarning::AssumedElevation {
            degrees: elevation.degrees(),
            uncertainty_deg: elevation.uncertainty_deg(),
        });
    }
    warnings.extend((!turn.has_angles).then_some(TurnWarning::NoAngles));
    warnings.extend(turn.damage.iter().cloned().map(TurnWarning::Damage));
    let conditioning = solution.conditioning();
    let is_unfit = conditioning.verdict.advice().is_some();
    warnings.extend(is_unfit.then_some(TurnWarning::Unfit(conditioning.verdict)));
    let is_at_odds = conditioning.is_given_at_odds();
    warnings.extend(is_at_odds.then_some(TurnWarning::GivenLightIsEven));
    let residual = solution.residual();
    let is_bad = residual > PARAMETERS.most_residual || residual.is_nan();
    if solution.measured.is_some() && is_bad && !is_at_odds {
        warnings.push(TurnWarning::GivenLightResidual { residual });
    }
    warnings
}

#[cfg(test)]
mod tests;
