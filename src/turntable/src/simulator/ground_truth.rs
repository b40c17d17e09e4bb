//! The true position of the table over time: every step of the motor.

use std::collections::VecDeque;

/// Motor steps per turn of the table.
pub const STEPS_PER_TURN: f64 = 32_000.0;
/// Number of steps kept; the oldest are discarded first.
const LOG: usize = 1 << 21;
/// A longer time between two steps is a rest, microseconds.
const REST_US: i64 = 100_000;

/// A step of the motor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StepEdge {
    /// Time, microseconds of the simulator's clock.
    pub t_us: i64,
    /// Motor position after it, steps from the position at power-on.
    pub steps: i64,
}

/// The steps so far.
pub(super) struct GroundTruth {
    start_angle: f64,
    edges: VecDeque<StepEdge>,
}

impl GroundTruth {
    pub(super) fn new(start_angle: f64, start_us: i64) -> GroundTruth {
        let start = StepEdge {
            t_us: start_us,
            steps: 0,
        };
        GroundTruth {
            start_angle,
            edges: VecDeque::from([start]),
        }
    }

    pub(super) fn extend(&mut self, edges: impl Iterator<Item = StepEdge>) {
        self.edges.extend(edges);
        let surplus = self.edges.len().saturating_sub(LOG);
        self.edges.drain(..surplus);
    }

    pub(super) fn edges(&self) -> Vec<StepEdge> {
        self.edges.iter().copied().collect()
    }

    /// The table's angle, degrees; linear over time between two steps.
    pub(super) fn angle_at(&self, us: i64) -> f64 {
        let after = self.edges.partition_point(|edge| edge.t_us <= us);
        let next = self.edges.get(after);
        let steps = match (after.checked_sub(1).and_then(|at| self.edges.get(at)), next) {
            (Some(before), Some(next)) if next.t_us - before.t_us <= REST_US => {
                let way = (us - before.t_us) as f64 / (next.t_us - before.t_us) as f64;
                before.steps as f64 + way * (next.steps - before.steps) as f64
            }
            (Some(edge), _) | (None, Some(edge)) => edge.steps as f64,
            (None, None) => 0.0,
        };
        self.start_angle + steps * 360.0 / STEPS_PER_TURN
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn between_steps_the_angle_grows_with_time_and_in_a_rest_it_stands() {
        let mut truth = GroundTruth::new(10.0, 1000);
        assert_eq!(truth.angle_at(5000), 10.0);
        let edges = [(2_001_000, 1), (2_003_000, 2), (5_000_000, 3)];
        truth.extend(
            edges
                .into_iter()
                .map(|(t_us, steps)| StepEdge { t_us, steps }),
        );
        let step = 360.0 / STEPS_PER_TURN;
        let cases = [
            (0, 0.0),
            (2_000_999, 0.0),
            (2_001_000, 1.0),
            (2_002_000, 1.5),
            (3_000_000, 2.0),
            (9_000_000, 3.0),
        ];
        for (us, steps) in cases {
            let expected = 10.0 + steps * step;
            assert!((truth.angle_at(us) - expected).abs() < 1e-9, "{us}");
        }
    }
}
