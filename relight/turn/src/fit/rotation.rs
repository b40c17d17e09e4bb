//! Which way the table turns, by all that says so.

use crate::network::predict::HypothesisFigures;
use crate::observe::reading::{ReadTurn, RotationDirection, RotationSource, TableRotation};
use crate::observe::strip::StripFigures;

impl TableRotation {
    /// The rotation of a turn that was read: as it was given, or else by the background of its video, or else by the network
    /// of turns where that is clearly surer of one direction. Where it is another than the turn was read with, the turn has
    /// to be read again.
    #[must_use]
    pub fn of_turn(
        turn: &ReadTurn,
        background: Option<&StripFigures>,
        network: Option<&HypothesisFigures>,
    ) -> Self {
        let TableRotation { direction, source } = turn.rotation;
        if source != RotationSource::Assumed {
            return turn.rotation;
        }
        if let Some(background) = background {
            // Angles are negated for a clockwise table: with the right direction they grow counter-clockwise.
            let is_right = background.direction == RotationDirection::CounterClockwise;
            return Self {
                direction: if is_right {
                    direction
                } else {
                    direction.other()
                },
                source: RotationSource::Background,
            };
        }
        match network {
            Some(figures) if figures.is_direction_doubted() => Self {
                direction: direction.other(),
                source: RotationSource::Network,
            },
            Some(figures) if figures.is_direction_sure() => Self {
                direction,
                source: RotationSource::Network,
            },
            _ => turn.rotation,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::network::input::PhaseHypothesis;
    use crate::network::predict::PhaseFigure;
    use crate::test_turns::{ball, environment, read};

    fn expecting(this: f32, other: f32) -> HypothesisFigures {
        HypothesisFigures {
            phase: PhaseHypothesis::First,
            phases: vec![PhaseFigure {
                phase: PhaseHypothesis::First,
                expected_error_deg: this,
            }],
            other_direction_deg: other,
        }
    }

    fn background(direction: RotationDirection) -> StripFigures {
        StripFigures {
            direction,
            field_deg: 40.0,
            correlation: 0.9,
            bright_azimuth_deg: 0.0,
            bright_part: 0.1,
        }
    }

    #[test]
    fn the_background_says_more_than_the_network() {
        let mut turn = read(&ball(), &environment());
        let network = expecting(10.0, 20.0);
        let (right, wrong) = (
            RotationDirection::CounterClockwise,
            RotationDirection::Clockwise,
        );
        for (seen, expected) in [(right, right), (wrong, wrong)] {
            let found = TableRotation::of_turn(&turn, Some(&background(seen)), Some(&network));
            assert_eq!(found.direction, expected);
            assert_eq!(found.source, RotationSource::Background);
        }
        // With its angles negated it moves as those of a table that turns counter-clockwise.
        turn.rotation = TableRotation::given(wrong);
        let found = TableRotation::of_turn(&turn, Some(&background(right)), None);
        assert_eq!(found, TableRotation::given(wrong));
    }

    #[test]
    fn what_was_given_stands_and_else_the_network_chooses_where_it_is_sure() {
        let mut turn = read(&ball(), &environment());
        let of = |turn: &ReadTurn, this, other| {
            let found = TableRotation::of_turn(turn, None, Some(&expecting(this, other)));
            (found.direction, found.source)
        };
        let (right, wrong) = (
            RotationDirection::CounterClockwise,
            RotationDirection::Clockwise,
        );
        assert_eq!(of(&turn, 10.0, 20.0), (right, RotationSource::Network));
        assert_eq!(of(&turn, 20.0, 10.0), (wrong, RotationSource::Network));
        assert_eq!(of(&turn, 20.0, 19.0), (right, RotationSource::Assumed));
        turn.rotation = TableRotation::given(wrong);
        assert_eq!(of(&turn, 20.0, 10.0), (wrong, RotationSource::Given));
    }
}
