//! The schedule of the learning rate.

use crate::settings::RunSettings;

/// The learning rate of a step, from 0: it grows evenly over the first `warmup_steps`, and falls along a cosine to
/// `min_lr_ratio` of itself.
pub(crate) fn learning_rate(settings: &RunSettings, step: u64) -> f64 {
    let warm = (step + 1) as f64 / settings.warmup_steps.max(1) as f64;
    let part = step as f64 / settings.steps as f64;
    let cosine = 0.5 + 0.5 * (std::f64::consts::PI * part).cos();
    settings.learning_rate
        * warm.min(1.0)
        * (settings.min_lr_ratio + (1.0 - settings.min_lr_ratio) * cosine)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_learning_rate_rises_and_falls() {
        let run = RunSettings {
            steps: 1000,
            ..RunSettings::default()
        };
        let part = |step| learning_rate(&run, step) / run.learning_rate;
        assert!(part(0) < 0.02);
        assert!(part(120) > 0.9);
        assert!((part(999) - run.min_lr_ratio).abs() < 1e-3);
    }
}
