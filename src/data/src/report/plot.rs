//! Line plots over the turn, as inline SVG. Colours come from the page's style sheet by class.

use super::text::{number, percent};
use super::turn::FULL;

/// Edges of the plotting area, in units of a plot 600 wide; the page scales it to the column.
const LEFT: f64 = 54.0;
const RIGHT: f64 = 554.0;
const TOP: f64 = 30.0;
const BELOW: f64 = 52.0;
/// Distance between ticks of the horizontal axis, degrees.
const ANGLE_STEP: u16 = 45;

/// One line: its class in the style sheet, and (degrees, value) by ascending degrees, at least one point.
pub(super) type Series = (&'static str, Vec<(f64, f64)>);

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
    /// The fraction above which the region is tinted; the vertical axis is in per cent then.
    pub(super) gate: Option<f64>,
}

impl Plot<'_> {
    /// The plot as one `<svg>` element.
    pub(super) fn svg(&self) -> String {
        let total = TOP + self.height + BELOW;
        let top = self.top();
        let lines = self.series.iter().map(|line| self.polyline(line, top));
        let lines: String = lines.collect();
        format!(
            "<svg viewBox=\"0 0 600 {total}\" role=\"img\" aria-label=\"{}\">\n{}{}{}{lines}</svg>\n",
            self.alternative,
            self.gate
                .map(|gate| self.gate_line(gate, top))
                .unwrap_or_default(),
            self.ordinate(top),
            self.abscissa_axis(),
        )
    }

    /// The upper end of the vertical axis: above every line, and twice the gate.
    fn top(&self) -> f64 {
        let values = self.series.iter().flat_map(|(_, points)| points);
        let gate = self.gate.map_or(0.0, |gate| 200.0 * gate);
        let largest = values.map(|point| point.1).fold(gate, f64::max);
        if largest > 1e-6 { largest } else { 1.0 }
    }

    fn y(&self, value: f64, top: f64) -> String {
        number(TOP + self.height * (1.0 - value / top), 1)
    }

    /// The gate's label is in the margin, where no line crosses it.
    fn gate_line(&self, gate: f64, top: f64) -> String {
        let y = self.y(100.0 * gate, top);
        format!(
            "<path class=\"tint\" d=\"M{LEFT} {TOP}H{RIGHT}V{y}H{LEFT}Z\"/>\
             <path class=\"gate\" d=\"M{LEFT} {y}H{RIGHT}\"/>\
             <text class=\"end gate-label\" x=\"{}\" y=\"{y}\">{}</text>\n",
            RIGHT + 8.0,
            percent(gate),
        )
    }

    /// The quantity, with grid lines at zero, half way and the top.
    fn ordinate(&self, top: f64) -> String {
        let title = format!("<text x=\"0\" y=\"14\">{}</text>\n", self.quantity);
        // Four digits, of which the last are mostly zeros and go.
        let decimals = (3.0 - top.log10().floor()).clamp(0.0, 8.0) as usize;
        let ticks = [0.0, top / 2.0, top].map(|value| {
            let (y, label) = (self.y(value, top), number(value, decimals));
            format!(
                "<path class=\"grid\" d=\"M{LEFT} {y}H{RIGHT}\"/>\
                 <text class=\"ordinate\" x=\"{}\" y=\"{y}\">{label}</text>\n",
                LEFT - 8.0,
            )
        });
        title + &ticks.concat()
    }

    fn abscissa_axis(&self) -> String {
        let bottom = TOP + self.height;
        let ticks = (0..=360u16).step_by(usize::from(ANGLE_STEP)).map(|angle| {
            format!(
                "<text class=\"middle\" x=\"{}\" y=\"{}\">{angle}</text>\n",
                number(x(f64::from(angle)), 1),
                bottom + 20.0,
            )
        });
        ticks.collect::<String>()
            + &format!(
                "<text class=\"middle\" x=\"{}\" y=\"{}\">{}</text>\n",
                f64::midpoint(LEFT, RIGHT),
                bottom + 44.0,
                self.abscissa
            )
    }

    fn polyline(&self, (class, points): &Series, top: f64) -> String {
        let at = |&(angle, value): &(f64, f64)| {
            format!("{},{}", number(x(angle), 1), self.y(value, top))
        };
        let mut points: Vec<String> = points.iter().map(at).collect();
        // A line of one point would not be drawn; a line from a point to itself is a dot.
        if let [only] = points.as_slice() {
            points.push(only.clone());
        }
        format!(
            "<polyline class=\"{class}\" points=\"{}\"/>\n",
            points.join(" ")
        )
    }
}

fn x(angle: f64) -> f64 {
    LEFT + (RIGHT - LEFT) * angle / FULL
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(points: Vec<(f64, f64)>) -> Plot<'static> {
        Plot {
            alternative: "",
            quantity: "q",
            abscissa: "a",
            height: 200.0,
            series: vec![("c", points)],
            gate: Some(0.05),
        }
    }

    #[test]
    fn the_gate_is_drawn_at_its_height() {
        // The axis reaches 10 %, so 5 % is half way up a plot of 200 units.
        let svg = plot(vec![(0.0, 1.0), (360.0, 9.0)]).svg();
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
    fn a_small_range_has_labels_that_differ() {
        let plot = Plot {
            gate: None,
            series: vec![("c", vec![(0.0, 0.003), (360.0, 0.001)])],
            ..plot(Vec::new())
        };
        let svg = plot.svg();
        assert!(svg.contains(">0.003<") && svg.contains(">0.0015<"), "{svg}");
    }

    #[test]
    fn a_single_point_is_drawn_as_a_dot() {
        let svg = plot(vec![(180.0, 0.0)]).svg();
        assert!(svg.contains("points=\"304,230 304,230\""), "{svg}");
    }
}
