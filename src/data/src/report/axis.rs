//! Axes that start at zero and have round ticks, and the formatting of numbers.

/// An axis from 0 to `top` with a tick each `step`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Axis {
    /// The upper end, a multiple of `step`.
    pub(super) top: f64,
    /// Distance between two ticks.
    pub(super) step: f64,
}

impl Axis {
    /// The axis that shows values in 0..=`largest`, which is finite, in at most `intervals` steps.
    /// If `largest` is 0, the axis is 0 to 1.
    pub(super) fn holding(largest: f64, intervals: f64) -> Self {
        let largest = if largest > 1e-6 { largest } else { 1.0 };
        let raw = largest / intervals;
        let magnitude = 10f64.powf(raw.log10().floor());
        let step = [1.0, 2.0, 2.5, 5.0]
            .map(|factor| factor * magnitude)
            .into_iter()
            .find(|step| *step >= raw)
            .unwrap_or(10.0 * magnitude);
        Self {
            top: (largest / step).ceil() * step,
            step,
        }
    }

    /// The ticks, from 0 to `top`.
    pub(super) fn ticks(self) -> impl Iterator<Item = f64> {
        let step = self.step;
        std::iter::successors(Some(0u32), |n| n.checked_add(1))
            .map(move |n| f64::from(n) * step)
            .take_while(move |tick| *tick <= self.top + step / 2.0)
    }

    /// The position of `value` on the axis: 0 at zero, 1 at the top.
    pub(super) fn position(self, value: f64) -> f64 {
        value / self.top
    }
}

/// `value` with at most `decimals` decimals and no trailing zeros.
pub(super) fn number(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let text = if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.')
    } else {
        &text
    };
    if text == "-0" {
        "0".to_owned()
    } else {
        text.to_owned()
    }
}

/// A tick's label; large numbers are shortened to fit into the margin.
pub(super) fn tick_label(value: f64) -> String {
    if value >= 1e7 {
        format!("{} M", number(value / 1e6, 1))
    } else if value >= 1e4 {
        format!("{} k", number(value / 1e3, 1))
    } else {
        number(value, 6)
    }
}

/// A fraction as percent, `0.05` as `5 %`.
pub(super) fn percent(fraction: f64) -> String {
    format!("{} %", number(fraction * 100.0, 2))
}

/// An angle, `12.34` as `12.3°`.
pub(super) fn degrees(angle: f64) -> String {
    format!("{angle:.1}°")
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn ticks_are_round_and_reach_the_top() {
        let ticks: Vec<f64> = Axis::holding(9.9, 5.0).ticks().collect();
        assert_eq!(ticks, [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]);
        assert_eq!(
            Axis::holding(255.0, 3.0),
            Axis {
                top: 300.0,
                step: 100.0
            }
        );
    }

    #[test]
    fn an_axis_without_values_still_has_ticks() {
        assert_eq!(Axis::holding(0.0, 5.0).top, 1.0);
    }

    #[test]
    fn numbers_have_no_trailing_zeros() {
        assert_eq!(number(5.0, 2), "5");
        assert_eq!(number(0.19, 2), "0.19");
        assert_eq!(number(100.0, 0), "100");
        assert_eq!(number(-0.001, 2), "0");
        assert_eq!(percent(1.0 / 3.0), "33.33 %");
        assert_eq!(tick_label(25_000.0), "25 k");
    }

    proptest! {
        #[test]
        fn any_largest_value_lies_on_its_axis(largest in 0.0..1e9f64) {
            let axis = Axis::holding(largest, 5.0);
            prop_assert!(axis.position(largest) <= 1.0 + 1e-9);
            prop_assert!((3..=6).contains(&axis.ticks().count()));
        }
    }
}
