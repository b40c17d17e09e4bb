//! Line plots over the turn, as inline SVG. Colours come from the page's style sheet by class.

use super::axis::{Axis, number, percent, tick_label};
use super::turn::FULL;

/// Width of a plot, in its own units; the page scales it to the column.
const WIDTH: f64 = 600.0;
/// Edges of the plotting area. The margins have space for the labels at a phone's text size.
const LEFT: f64 = 54.0;
const RIGHT: f64 = 554.0;
const TOP: f64 = 30.0;
const BELOW: f64 = 52.0;
/// Distance between ticks of the horizontal axis, degrees.
const ANGLE_STEP: u16 = 45;
/// Smallest distance between ticks of the vertical axis.
const TICK_GAP: f64 = 36.0;
/// Distance from the plotting area to a label on its right.
const LABEL_INDENT: f64 = 8.0;
/// Smallest distance between two labels at the ends of lines.
const LABEL_GAP: f64 = 17.0;

/// One line.
#[derive(Debug)]
pub(super) struct Series {
    /// Class in the style sheet.
    pub(super) class: &'static str,
    /// Label at the line's end; empty for none.
    pub(super) label: &'static str,
    /// (degrees, value), by ascending degrees, at least one point.
    pub(super) points: Vec<(f64, f64)>,
}

/// A horizontal line across the plot, with the region above it tinted.
#[derive(Debug, Clone, Copy)]
pub(super) struct Level {
    /// Its value, in the unit of the vertical axis.
    pub(super) at: f64,
    /// The same as a fraction, for the label.
    pub(super) fraction: f64,
}

/// A plot over the turn.
#[derive(Debug)]
pub(super) struct Plot<'a> {
    /// Text alternative for readers who do not see the plot.
    pub(super) alternative: &'a str,
    /// Quantity and unit of the vertical axis.
    pub(super) quantity: &'a str,
    /// Quantity and unit of the horizontal axis.
    pub(super) abscissa: &'a str,
    /// Height of the plotting area.
    pub(super) height: f64,
    /// The lines, the last one on top.
    pub(super) series: Vec<Series>,
    /// The gate, if the plot has one.
    pub(super) level: Option<Level>,
}

impl Plot<'_> {
    /// The plot as one `<svg>` element.
    pub(super) fn svg(&self) -> String {
        let axis = self.axis();
        format!(
            "<svg viewBox=\"0 0 {WIDTH} {total}\" role=\"img\" aria-label=\"{alternative}\">\n\
             {tint}{ordinate}{abscissa}{lines}{level}{labels}</svg>\n",
            total = TOP + self.height + BELOW,
            alternative = self.alternative,
            tint = self.tint(axis),
            ordinate = self.ordinate(axis),
            abscissa = self.abscissa_axis(),
            lines = self
                .series
                .iter()
                .map(|s| self.polyline(axis, s))
                .collect::<String>(),
            level = self.level_line(axis),
            labels = self.end_labels(axis),
        )
    }

    /// Covers every line, and twice the level so that the region above it is visible.
    fn axis(&self) -> Axis {
        let values = self
            .series
            .iter()
            .flat_map(|s| s.points.iter().map(|p| p.1));
        let level = self.level.map_or(0.0, |level| 2.0 * level.at);
        Axis::holding(
            values.fold(level, f64::max),
            (self.height / TICK_GAP).floor(),
        )
    }

    fn bottom(&self) -> f64 {
        TOP + self.height
    }

    fn y(&self, axis: Axis, value: f64) -> f64 {
        self.bottom() - self.height * axis.position(value)
    }

    fn tint(&self, axis: Axis) -> String {
        let Some(level) = self.level else {
            return String::new();
        };
        let (width, height) = (RIGHT - LEFT, number(self.y(axis, level.at) - TOP, 1));
        format!(
            "<rect class=\"tint\" x=\"{LEFT}\" y=\"{TOP}\" width=\"{width}\" height=\"{height}\"/>\n"
        )
    }

    fn ordinate(&self, axis: Axis) -> String {
        let title = format!("<text x=\"0\" y=\"14\">{}</text>\n", self.quantity);
        let ticks = axis.ticks().map(|tick| {
            let y = number(self.y(axis, tick), 1);
            let label = tick_label(tick);
            let end = LEFT - 8.0;
            format!(
                "<path class=\"grid\" d=\"M{LEFT} {y}H{RIGHT}\"/>\
                 <text class=\"ordinate\" x=\"{end}\" y=\"{y}\">{label}</text>\n"
            )
        });
        std::iter::once(title).chain(ticks).collect()
    }

    fn abscissa_axis(&self) -> String {
        let bottom = self.bottom();
        let (label_y, title_y) = (bottom + 20.0, bottom + 44.0);
        let line = format!("<path class=\"axis\" d=\"M{LEFT} {bottom}H{RIGHT}\"/>\n");
        let ticks = (0..=360u16).step_by(usize::from(ANGLE_STEP)).map(|angle| {
            let x = number(x(f64::from(angle)), 1);
            format!(
                "<path class=\"axis\" d=\"M{x} {bottom}v5\"/>\
                 <text class=\"middle\" x=\"{x}\" y=\"{label_y}\">{angle}</text>\n"
            )
        });
        let title = format!(
            "<text class=\"middle\" x=\"{}\" y=\"{title_y}\">{}</text>\n",
            f64::midpoint(LEFT, RIGHT),
            self.abscissa
        );
        std::iter::once(line)
            .chain(ticks)
            .chain(std::iter::once(title))
            .collect()
    }

    fn polyline(&self, axis: Axis, series: &Series) -> String {
        let mut points: Vec<String> = series
            .points
            .iter()
            .map(|&(angle, value)| {
                format!("{},{}", number(x(angle), 1), number(self.y(axis, value), 1))
            })
            .collect();
        // A line of one point would not be drawn; a line from a point to itself is a dot.
        if let [only] = points.as_slice() {
            points.push(only.clone());
        }
        format!(
            "<polyline class=\"{}\" points=\"{}\"/>\n",
            series.class,
            points.join(" ")
        )
    }

    /// The level's label is in the margin, where no line crosses it.
    fn level_line(&self, axis: Axis) -> String {
        let Some(level) = self.level else {
            return String::new();
        };
        format!(
            "<path class=\"gate\" d=\"M{LEFT} {y}H{RIGHT}\"/>\
             <text class=\"end gate-label\" x=\"{x}\" y=\"{y}\">{gate}</text>\n",
            y = number(self.y(axis, level.at), 1),
            x = RIGHT + LABEL_INDENT,
            gate = percent(level.fraction),
        )
    }

    /// The lines' labels at their ends, moved apart if they would overlap.
    fn end_labels(&self, axis: Axis) -> String {
        let mut labels: Vec<(f64, &Series)> = self
            .series
            .iter()
            .filter(|s| !s.label.is_empty())
            .filter_map(|s| s.points.last().map(|end| (self.y(axis, end.1), s)))
            .collect();
        labels.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut free = TOP;
        let mut text = String::new();
        for (position, (wanted, series)) in labels.iter().enumerate() {
            let below = f64::from(u32::try_from(labels.len() - position - 1).unwrap_or(0));
            let lowest = self.bottom() - below * LABEL_GAP;
            let y = wanted.max(free).min(lowest);
            free = y + LABEL_GAP;
            text.push_str(&format!(
                "<text class=\"end {}\" x=\"{}\" y=\"{}\">{}</text>\n",
                series.class,
                RIGHT + LABEL_INDENT,
                number(y, 1),
                series.label
            ));
        }
        text
    }
}

fn x(angle: f64) -> f64 {
    LEFT + (RIGHT - LEFT) * angle / FULL
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(series: Vec<Series>) -> Plot<'static> {
        Plot {
            alternative: "",
            quantity: "q",
            abscissa: "a",
            height: 200.0,
            series,
            level: Some(Level {
                at: 5.0,
                fraction: 0.05,
            }),
        }
    }

    fn line(points: Vec<(f64, f64)>) -> Series {
        Series {
            class: "c",
            label: "C",
            points,
        }
    }

    #[test]
    fn the_gate_is_drawn_at_its_height() {
        // The axis reaches 10 %, so 5 % is half way up a plot of 200 units.
        let svg = plot(vec![line(vec![(0.0, 1.0), (360.0, 9.0)])]).svg();
        assert!(
            svg.contains("<path class=\"gate\" d=\"M54 130H554\"/>"),
            "{svg}"
        );
        assert!(
            svg.contains("<polyline class=\"c\" points=\"54,210 554,50\"/>"),
            "{svg}"
        );
    }

    #[test]
    fn a_single_point_is_drawn_as_a_dot() {
        let svg = plot(vec![line(vec![(180.0, 0.0)])]).svg();
        assert!(svg.contains("points=\"304,230 304,230\""), "{svg}");
    }

    #[test]
    fn labels_of_lines_that_end_together_stand_apart() {
        let ends = || line(vec![(0.0, 3.0), (360.0, 0.0)]);
        let plot = plot(vec![ends(), ends(), ends()]);
        let svg = plot.svg();
        let heights: Vec<f64> = svg
            .lines()
            .filter(|l| l.contains("class=\"end c"))
            .map(|l| {
                l.split("y=\"")
                    .nth(1)
                    .unwrap()
                    .split('"')
                    .next()
                    .unwrap()
                    .parse()
                    .unwrap()
            })
            .collect();
        assert_eq!(heights, [196.0, 213.0, 230.0]);
    }
}
