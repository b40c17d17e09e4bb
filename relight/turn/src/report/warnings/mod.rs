//! What a user should know of a result, and which option changes it.

use relit_data::rig::RotationDirection;

use crate::fit::probe_light::ProbeLight;
use crate::model::frame::FactSource;
use crate::solving::SolvedTurn;

/// Residual of a given light, over the energy of the variation, from which it is not that of the turn. By hand.
const MAX_RESIDUAL: f64 = 0.4;

impl SolvedTurn {
    /// What a user should know of it.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings: Vec<String> = self.ball.iter().flat_map(of_ball).collect();
        warnings.extend(self.of_rotation());
        warnings.extend(self.of_doubted_direction());
        let elevation = self.solution.elevation;
        if elevation.source() == FactSource::Assumed {
            warnings.push(format!(
                "the camera's elevation is not known and taken as {} degrees, {} either way: give --elevation",
                elevation.degrees(),
                elevation.uncertainty_deg()
            ));
        }
        if !self.turn.has_angles {
            let spread =
                "the frames have no angles: they are taken for evenly spread over one turn";
            warnings.push(spread.to_owned());
        }
        warnings.extend(self.turn.damage.iter().cloned());
        warnings.extend(self.solution.verdict().advice().map(str::to_owned));
        let residual = self.solution.residual();
        let is_bad = residual > MAX_RESIDUAL || residual.is_nan();
        if self.solution.conditioning.contradicts_given_light() {
            let odd = "the light that was given hardly changes over the turn, but what the object shows does: \
                       it is not the light of this turn";
            warnings.push(odd.to_owned());
        } else if self.solution.measured.is_some() && is_bad {
            warnings.push(format!(
                "the residual in the light that was given is {:.0} % of what varies over the turn: \
                 check that it is this turn's, in the viewer's frame at the table's angle 0",
                100.0 * residual
            ));
        }
        warnings
    }

    /// Whether no frame was left out and normals and albedo are observable.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        self.turn.damage.is_empty() && self.solution.verdict().is_fit()
    }

    /// Where nobody said which way the table turns: it was found and is not the usual way, or nothing tells it.
    fn of_rotation(&self) -> Option<String> {
        let rotation = self.turn.rotation;
        let (direction, other) = (rotation.direction, rotation.direction.other());
        let is_usual = direction == RotationDirection::default();
        match rotation.source {
            FactSource::Network if !is_usual => Some(format!(
                "the table is taken to turn {direction}, seen from above: that way the network of turns expects clearly \
                 smaller errors; give --rotation {direction} if that is right, else {other}"
            )),
            FactSource::Assumed => Some(format!(
                "which way the table turns is not known: it is taken to turn {direction}, seen from above: look at it from \
                 above as it turns, and give --rotation"
            )),
            FactSource::Network | FactSource::Given | FactSource::Rig => None,
        }
    }

    /// Where the network of turns speaks against the direction that was taken.
    fn of_doubted_direction(&self) -> Option<String> {
        let other = self.turn.rotation.direction.other();
        self.network.is_direction_doubted().then(|| {
            format!(
                "the network of turns expects its normals to be {:.0} degrees off in the other rotation direction, and {:.0} \
                 in this one: try --rotation {other}",
                self.network.other_direction_deg, self.network.expected_error_deg
            )
        })
    }
}

/// Where a ball does not look like what it was called, or its light fits it badly.
fn of_ball(measured: &ProbeLight) -> Vec<String> {
    let (ball, looks) = (measured.ball, measured.looks);
    let kind = (ball != looks).then(|| format!("the ball was called {ball}, but it looks {looks}"));
    let residual = measured.is_doubtful().then(|| {
        format!(
            "the residual of the light by the ball is {:.0} % of what varies in it: \
             measure its middle and radius in the video again, and check that nothing shadows it",
            100.0 * measured.residual
        )
    });
    kind.into_iter().chain(residual).collect()
}

#[cfg(test)]
mod tests;
