//! What a user should know of a result.

use crate::fit::options::TurnOptions;
use crate::fit::probe_light::ProbeLight;
use crate::fit::solution::TurnSolution;
use crate::model::frame::ElevationSource;
use crate::model::material::MaterialKind;
use crate::observe::probe::ProbeBall;
use crate::observe::reading::{ReadTurn, RotationDirection, RotationSource, TableRotation};
use crate::observe::strip::PanoramaStrip;
use crate::observe::verdict::LightVerdict;

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
    #[error("the table is taken to turn {direction}, seen from above: {}", if *by_background {
        "the background of the video moves that way"
    } else {
        "that way the network of turns expects clearly smaller errors"
    })]
    TakenRotation {
        /// Which way.
        direction: RotationDirection,
        /// Whether the background says so, and not the network.
        by_background: bool,
    },
    /// Nothing says which way the table turns.
    #[error(
        "which way the table turns is not known: it is taken to turn {direction}, seen from above"
    )]
    AssumedRotation {
        /// What is usual.
        direction: RotationDirection,
    },
    /// The background moves against the rotation direction that was given.
    #[error("the background moves the other way: the normals are mirrored")]
    BackgroundMovesOtherWay,
    /// The sides of the picture do not show the same surroundings one after the other.
    #[error(
        "the two sides of the picture do not show the same surroundings: there is no room.png, and the video does not tell the rotation direction"
    )]
    NoPanoramaStrip,
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
    /// The other rotation direction fits the turn clearly better.
    #[error("the other rotation direction fits the turn clearly better, with a residual of {:.0} % instead of {:.0} %", 100.0 * other_residual, 100.0 * residual)]
    OtherDirection {
        /// The residual of the given direction, over the energy of the variation.
        residual: f64,
        /// That of the other one.
        other_residual: f64,
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
    Unfit(LightVerdict),
    /// The given light is even, and the turn is not.
    #[error(
        "the light that was given hardly changes over the turn, but what the object shows does: it is not the light of this turn"
    )]
    GivenLightIsEven,
    /// The other material fits the turn clearly better than the given one.
    #[error("the other material fits the turn clearly better, with a residual of {:.0} % of what varies instead of {:.0} %", 100.0 * other_residual, 100.0 * residual)]
    OtherMaterial {
        /// The other one.
        material: MaterialKind,
        /// The residual of the given one, over the energy of the variation.
        residual: f64,
        /// That of the other one.
        other_residual: f64,
    },
    /// The given light fits the turn badly.
    #[error("the residual in the light that was given is {:.0} % of what varies over the turn: see that it is this turn's, in the viewer's frame at the table's angle 0", 100.0 * residual)]
    GivenLightResidual {
        /// The residual over the energy of the variation.
        residual: f64,
    },
    /// The given normals were left out.
    #[error(
        "the given normals agree less with the turn than a shape inflated out of the outline: they were left out"
    )]
    PriorLeftOut,
    /// The object is taken for metal in unknown light.
    #[error("the object is taken for metal, which in unknown light can be wrong")]
    MetalInUnknownLight,
}

impl TurnWarning {
    /// Those of a ball.
    #[must_use]
    pub fn of_ball(measured: &ProbeLight) -> Vec<Self> {
        let kind = (measured.ball != measured.looks).then_some(Self::BallKind {
            given: measured.ball,
            looks: measured.looks,
        });
        let residual = measured.is_doubtful().then_some(Self::BallResidual {
            residual: measured.residual,
        });
        kind.into_iter().chain(residual).collect()
    }

    /// That of a rotation that nobody said: where it was found and is not the usual one, or where nothing tells it.
    #[must_use]
    pub fn of_rotation(turn: &ReadTurn) -> Option<Self> {
        let TableRotation { direction, source } = turn.rotation;
        let found = |by_background| {
            let is_usual = direction == RotationDirection::default();
            (!is_usual).then_some(Self::TakenRotation {
                direction,
                by_background,
            })
        };
        match source {
            RotationSource::Background => found(true),
            RotationSource::Network => found(false),
            RotationSource::Assumed => Some(Self::AssumedRotation { direction }),
            RotationSource::Given => None,
        }
    }

    /// That of the background of a video that was read.
    #[must_use]
    pub fn of_background(strip: Option<&PanoramaStrip>) -> Option<Self> {
        match strip.map(|strip| strip.figures().direction) {
            // Angles are negated for a clockwise table: with the right direction they grow counter-clockwise.
            Some(RotationDirection::CounterClockwise) => None,
            Some(RotationDirection::Clockwise) => Some(Self::BackgroundMovesOtherWay),
            None => Some(Self::NoPanoramaStrip),
        }
    }

    /// Where the network of turns speaks against the direction that was taken, or, where neither it nor a background says
    /// anything, the residuals do.
    #[must_use]
    pub fn of_direction(turn: &ReadTurn, solution: &TurnSolution) -> Option<Self> {
        let network = solution.hypotheses();
        if let Some(figures) = network.filter(|figures| figures.is_direction_doubted()) {
            return Some(Self::SurerInOtherDirection {
                expected_deg: figures.expected_error_deg(),
                other_deg: figures.other_direction_deg,
            });
        }
        let source = turn.rotation.source;
        if matches!(source, RotationSource::Background | RotationSource::Network) {
            return None;
        }
        let figure = solution.direction().filter(|figure| figure.is_doubted())?;
        Some(Self::OtherDirection {
            residual: figure.residual,
            other_residual: figure.other_residual,
        })
    }

    /// Those of a solved turn.
    #[must_use]
    pub fn of_solution(
        turn: &ReadTurn,
        options: &TurnOptions,
        solution: &TurnSolution,
    ) -> Vec<Self> {
        let mut warnings = Vec::new();
        if options.elevation.source() == ElevationSource::Assumed {
            warnings.push(Self::AssumedElevation {
                degrees: options.elevation.degrees(),
                uncertainty_deg: options.elevation.uncertainty_deg(),
            });
        }
        warnings.extend((!turn.has_angles).then_some(Self::NoAngles));
        warnings.extend(turn.damage.iter().cloned().map(Self::Damage));
        let conditioning = solution.conditioning();
        let is_unfit = conditioning.verdict.advice().is_some();
        warnings.extend(is_unfit.then_some(Self::Unfit(conditioning.verdict)));
        let is_at_odds = conditioning.is_given_at_odds();
        warnings.extend(is_at_odds.then_some(Self::GivenLightIsEven));
        warnings.extend(Self::of_choices(options, solution));
        let is_metal = solution.material() == MaterialKind::Metal;
        let is_guessed = options.material.is_none() && options.light.is_none();
        warnings.extend((is_metal && is_guessed).then_some(Self::MetalInUnknownLight));
        warnings
    }

    /// Where what was given does not fit the turn.
    fn of_choices(options: &TurnOptions, solution: &TurnSolution) -> Vec<Self> {
        let mut warnings = Vec::new();
        if let (Some(material), [given, other, ..]) =
            (solution.doubted_material(), solution.materials())
        {
            warnings.push(Self::OtherMaterial {
                material,
                residual: given.residual,
                other_residual: other.residual,
            });
        }
        let residual = solution.residual();
        let is_bad = residual > PARAMETERS.most_residual || residual.is_nan();
        if options.light.is_some() && is_bad && !solution.conditioning().is_given_at_odds() {
            warnings.push(Self::GivenLightResidual { residual });
        }
        warnings.extend(solution.is_prior_left_out().then_some(Self::PriorLeftOut));
        warnings
    }
}

impl TurnSolution {
    /// Whether no frame was left out and normals and albedo are observable.
    #[must_use]
    pub fn is_whole(&self, turn: &ReadTurn) -> bool {
        turn.damage.is_empty() && self.conditioning().verdict.is_fit()
    }
}

#[cfg(test)]
mod tests;
