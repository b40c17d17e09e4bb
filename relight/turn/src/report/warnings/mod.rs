//! Warnings about a result, and the option that changes it.

use relit_data::rig::RotationDirection;

use crate::fit::probe_light::ProbeLight;
use crate::model::frame::FactSource;
use crate::solving::SolvedTurn;

/// Residual of a given light, over the energy of the variation, from which it is not that of the turn. Measured: on nine synthetic
/// turns 0.02 to 0.80 in their light, and 0.89 to 1.86 in the same light turned by 90 or 180 degrees.
const MAX_RESIDUAL: f64 = 0.85;

impl SolvedTurn {
    /// Its warnings.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings: Vec<String> = self.ball.iter().flat_map(of_ball).collect();
        warnings.extend(self.broken.iter().map(|reasons| {
            format!("the data set says that this turn is broken ({reasons}): look at its page, correct it and extract it again")
        }));
        warnings.extend(self.of_rotation());
        warnings.extend(self.of_doubted_direction());
        let elevation = self.solution.elevation;
        if elevation.source() == FactSource::Assumed {
            warnings.push(format!(
                "the camera's elevation is unknown, {} ± {} degrees is assumed: give --elevation",
                elevation.degrees(),
                elevation.uncertainty_deg()
            ));
        }
        if !self.turn.has_angles {
            let spread =
                "the frames have no angles: they are assumed to be evenly spread over one turn";
            warnings.push(spread.to_owned());
        }
        warnings.extend(self.turn.damage.iter().cloned());
        warnings.extend(self.solution.verdict().advice().map(str::to_owned));
        let residual = self.solution.residual();
        let is_bad = residual > MAX_RESIDUAL || residual.is_nan();
        if self.solution.measured.is_some() && is_bad {
            warnings.push(format!(
                "the residual in the given light is {:.0} % of the variation: check that it is this turn's light, in the \
                 viewer's frame at angle 0",
                100.0 * residual
            ));
        }
        warnings
    }

    /// Whether no frame was left out, normals and albedo are observable, and the data set does not say that the turn is broken.
    pub fn is_whole(&self) -> bool {
        self.broken.is_none() && self.turn.damage.is_empty() && self.solution.verdict().is_fit()
    }

    /// For a rotation direction that was not given: it was estimated and is not the usual one, or is unknown.
    fn of_rotation(&self) -> Option<String> {
        let rotation = self.turn.rotation;
        let (direction, other) = (rotation.direction, rotation.direction.other());
        let is_usual = direction == RotationDirection::default();
        match rotation.source {
            FactSource::Network if !is_usual => Some(format!(
                "the table seems to turn {direction}, seen from above: the network then expects clearly smaller errors; give \
                 --rotation {direction} if right, else {other}"
            )),
            FactSource::Assumed => Some(format!(
                "the rotation direction is unknown, {direction} is assumed: look at the turning table from above, and give \
                 --rotation"
            )),
            FactSource::Network | FactSource::Given | FactSource::Rig => None,
        }
    }

    /// If the network of turns contradicts the direction that was used.
    fn of_doubted_direction(&self) -> Option<String> {
        let other = self.turn.rotation.direction.other();
        self.network.is_direction_doubted().then(|| {
            format!(
                "the network expects errors of {:.0} degrees in the other rotation direction, and {:.0} in this one: try \
                 --rotation {other}",
                self.network.other_direction_deg, self.network.expected_error_deg
            )
        })
    }
}

/// If a ball does not look like its given kind, or its light fits it badly.
fn of_ball(measured: &ProbeLight) -> Vec<String> {
    let (ball, looks) = (measured.ball, measured.looks);
    let kind =
        (ball != looks).then(|| format!("the ball was given as {ball}, but it looks {looks}"));
    let residual = measured.is_doubtful().then(|| {
        format!(
            "the residual of the ball's light is {:.0} % of its variation: measure its centre and radius again, and check \
             that nothing shadows it",
            100.0 * measured.residual
        )
    });
    kind.into_iter().chain(residual).collect()
}

#[cfg(test)]
mod tests;
