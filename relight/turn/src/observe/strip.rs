//! A strip of a panorama of the surroundings, out of the background of a turn's video.
//!
//! Camera and object turn together, so that the camera looks all around. Two columns of the picture, near its sides,
//! see the same surroundings one after the other: by how much later the second does follows the angle between them, and
//! which of them is first says which way the table turns.

use std::path::Path;

use relight_core::files::write_png;
use relight_core::image::{ColourSpace, Depth, Extent, Linear, Planes, Rgb, Srgb};
use serde::Serialize;

use crate::error::TurnError;
use crate::observe::reading::RotationDirection;

/// Parameters of the strip.
struct StripParameters {
    /// Columns of the strip. By convention: four a degree.
    columns: usize,
    /// Distance of the two columns of the picture from its sides, in widths. By hand.
    inset: f64,
    /// Their width, in widths of the picture. By hand.
    width: f64,
    /// Share of the picture's height, from the top, that shows the surroundings; below is the table. By hand.
    height: f64,
    /// Columns of the strip that are compared as one. By hand: one degree.
    coarse_columns: usize,
    /// Rows that are compared. By hand.
    coarse_rows: usize,
    /// Largest angle between the two columns, degrees. By hand.
    most_field_deg: usize,
    /// Least angle between them, degrees. By hand.
    least_field_deg: usize,
    /// Correlation from which the columns see the same surroundings, 0 to 1. By hand.
    least_correlation: f64,
    /// By how much that correlation is above the best one of a table that turns the other way. By hand: light that changes
    /// on both sides at once, as under clouds, is as like itself either way.
    least_margin: f64,
}

const PARAMETERS: StripParameters = StripParameters {
    columns: 1440,
    inset: 0.03,
    width: 0.012,
    height: 0.5,
    coarse_columns: 4,
    coarse_rows: 24,
    most_field_deg: 100,
    least_field_deg: 4,
    least_correlation: 0.5,
    least_margin: 0.1,
};

/// Gathers the background of a turn's frames, in any order.
#[derive(Debug)]
pub struct StripBuilder {
    extent: Extent,
    rows: usize,
    sides: [Side; 2],
}

/// What one column of the picture saw, over the table's angle.
#[derive(Debug)]
struct Side {
    /// Where it begins, and how wide it is, pixels.
    from: usize,
    width: usize,
    /// Light by angle, in it row by row.
    light: Vec<[f32; 3]>,
    frames: Vec<u32>,
}

/// The surroundings of the table.
#[derive(Debug, Clone)]
pub struct PanoramaStrip {
    image: Rgb<Linear>,
    /// The camera's focal length by the angle between the two columns, pixels of the video.
    focal: f64,
    figures: StripFigures,
}

/// The figures of the strip.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct StripFigures {
    /// Which way the table turns as the angle grows with which the strip was made.
    #[serde(rename = "sense")]
    pub direction: RotationDirection,
    /// The angle between the two columns, degrees.
    pub field_deg: f64,
    /// How alike the two columns' views are, the one turned by that angle: 0 to 1.
    pub correlation: f64,
    /// From where more light comes, by the first harmonic of the strip: the azimuth in the table's frame at angle 0,
    /// from x towards y, degrees. Clipped windows and the ceiling, which no frame shows, are not in it.
    pub bright_azimuth_deg: f64,
    /// The size of that harmonic over the mean.
    pub bright_part: f64,
}

impl StripBuilder {
    /// For frames of this size.
    ///
    /// # Errors
    /// [`TurnError::Empty`] where they are too small for two columns.
    pub fn new(extent: Extent) -> Result<Self, TurnError> {
        let width = ((PARAMETERS.width * extent.width as f64) as usize).max(1);
        let inset = (PARAMETERS.inset * extent.width as f64) as usize;
        let rows = ((PARAMETERS.height * extent.height as f64) as usize).min(extent.height);
        if rows == 0 || extent.width < 2 * (inset + width) {
            return Err(TurnError::Empty);
        }
        let side = |from| Side {
            from,
            width,
            light: vec![[0.0; 3]; PARAMETERS.columns * rows],
            frames: vec![0; PARAMETERS.columns],
        };
        Ok(Self {
            extent,
            rows,
            sides: [side(inset), side(extent.width - inset - width)],
        })
    }

    /// Takes up a frame at an angle of the table, degrees.
    ///
    /// # Errors
    /// [`TurnError::FrameSize`] where it has another size.
    pub fn push(&mut self, angle_deg: f64, frame: &Rgb<Srgb>) -> Result<(), TurnError> {
        if frame.planes().extent() != self.extent {
            return Err(TurnError::FrameSize {
                found: frame.planes().extent(),
                expected: self.extent,
            });
        }
        if angle_deg.is_finite() {
            let column = (angle_deg.rem_euclid(360.0) / 360.0 * PARAMETERS.columns as f64) as usize
                % PARAMETERS.columns;
            for side in &mut self.sides {
                side.push(column, self.rows, frame);
            }
        }
        Ok(())
    }

    /// The strip; none where the two columns do not show the same surroundings one clearly before the other, or frames are
    /// missing.
    #[must_use]
    pub fn finish(self) -> Option<PanoramaStrip> {
        let rows = self.rows;
        let [left, right] = &self.sides;
        let (left, right) = (left.filled(rows)?, right.filled(rows)?);
        let found = Lag::find(&grey(&left, rows), &grey(&right, rows))?;
        if !found.is_clear() {
            return None;
        }
        let Lag {
            lag, correlation, ..
        } = found;
        let direction = if lag > 0 {
            RotationDirection::CounterClockwise
        } else {
            RotationDirection::Clockwise
        };
        let lag = lag * PARAMETERS.coarse_columns as isize;
        let field_deg = lag.unsigned_abs() as f64 * 360.0 / PARAMETERS.columns as f64;
        let around = |from: usize, by: isize| {
            (from as isize + by).rem_euclid(PARAMETERS.columns as isize) as usize
        };
        // At angle t the middle of the picture shows what the left column saw half the lag before, and the right one
        // sees later.
        let seen = |angle: usize, row: usize| {
            let early = left[around(angle, -lag / 2) * rows + row];
            let late = right[around(angle, lag - lag / 2) * rows + row];
            [0, 1, 2].map(|c| (early[c] + late[c]) / 2.0)
        };
        let (bright_azimuth_deg, bright_part) = first_harmonic(direction, |angle| {
            let sum: f32 = (0..rows).flat_map(|row| seen(angle, row)).sum();
            f64::from(sum) / (3 * rows) as f64
        });
        // Columns by what is to the right in the picture; what the camera sees at angle 0 is in the middle.
        let angle_of = |x: usize| {
            let by = x as isize - (PARAMETERS.columns / 2) as isize;
            around(0, if lag > 0 { -by } else { by })
        };
        let wide = Planes::from_fn(Extent::new(PARAMETERS.columns, rows), |x, y| {
            seen(angle_of(x), y)
        });
        let between = self.sides[1].from - self.sides[0].from;
        let pixels_a_degree = between as f64 / field_deg;
        let height = rows as f64 / pixels_a_degree * PARAMETERS.columns as f64 / 360.0;
        let image = wide.resized(Extent::new(
            PARAMETERS.columns,
            (height.round() as usize).max(1),
        ));
        Some(PanoramaStrip {
            image: Rgb::new(image),
            focal: between as f64 / 2.0 / (field_deg / 2.0).to_radians().tan(),
            figures: StripFigures {
                direction,
                field_deg,
                correlation,
                bright_azimuth_deg,
                bright_part,
            },
        })
    }
}

impl Side {
    fn push(&mut self, column: usize, rows: usize, frame: &Rgb<Srgb>) {
        let width = frame.planes().extent().width;
        let planes = frame.planes().planes();
        for (row, light) in self.light[column * rows..][..rows].iter_mut().enumerate() {
            for (light, plane) in light.iter_mut().zip(planes) {
                let pixels = &plane[row * width + self.from..][..self.width];
                let sum: f32 = pixels.iter().map(|&value| Srgb::to_linear(value)).sum();
                *light += sum / self.width as f32;
            }
        }
        self.frames[column] += 1;
    }

    /// The mean at every angle; angles without a frame are like the one before. None where more than a tenth of the
    /// turn is missing at once.
    fn filled(&self, rows: usize) -> Option<Vec<[f32; 3]>> {
        let mut light = self.light.clone();
        let first = self.frames.iter().position(|&frames| frames > 0)?;
        let mut last = first;
        for at in (first..first + PARAMETERS.columns).map(|at| at % PARAMETERS.columns) {
            if self.frames[at] == 0 {
                if (at + PARAMETERS.columns - last) % PARAMETERS.columns > PARAMETERS.columns / 10 {
                    return None;
                }
                light.copy_within(last * rows..(last + 1) * rows, at * rows);
                continue;
            }
            last = at;
            let frames = self.frames[at] as f32;
            for value in light[at * rows..][..rows].as_flattened_mut() {
                *value /= frames;
            }
        }
        Some(light)
    }
}

impl PanoramaStrip {
    /// Its figures.
    #[must_use]
    pub const fn figures(&self) -> &StripFigures {
        &self.figures
    }

    /// The camera's focal length by the angle between the two columns, pixels of the video.
    pub(crate) const fn focal(&self) -> f64 {
        self.focal
    }

    /// The strip itself: what is to the right in the surroundings is to the right in it, and what the camera sees at
    /// the table's angle 0 is in its middle.
    #[must_use]
    pub const fn image(&self) -> &Rgb<Linear> {
        &self.image
    }

    /// Writes it as a picture.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn write_png(&self, path: &Path) -> Result<(), TurnError> {
        let picture = self.image.clone().encode::<Srgb>();
        Ok(write_png(path, picture.planes(), Depth::Eight)?)
    }
}

/// The grey of a few rows at every few angles, each row less its mean.
fn grey(light: &[[f32; 3]], rows: usize) -> Vec<Vec<f64>> {
    let taken = PARAMETERS.coarse_rows.min(rows);
    (0..taken)
        .map(|at| {
            let row = at * rows / taken;
            let values = (0..PARAMETERS.columns / PARAMETERS.coarse_columns).map(|column| {
                let part = (0..PARAMETERS.coarse_columns)
                    .map(|k| light[(column * PARAMETERS.coarse_columns + k) * rows + row]);
                part.map(|value| f64::from(value.iter().sum::<f32>()))
                    .sum::<f64>()
            });
            let values: Vec<f64> = values.collect();
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            values.into_iter().map(|value| value - mean).collect()
        })
        .collect()
}

/// By how many coarse columns the second view has to be turned to be most like the first.
#[derive(Debug, Clone, Copy)]
struct Lag {
    lag: isize,
    /// How like it is then.
    correlation: f64,
    /// How like it is at best where it is turned the other way.
    other: f64,
}

impl Lag {
    fn find(first: &[Vec<f64>], second: &[Vec<f64>]) -> Option<Self> {
        let count = PARAMETERS.columns / PARAMETERS.coarse_columns;
        let energy = |rows: &[Vec<f64>]| rows.iter().flatten().map(|v| v * v).sum::<f64>();
        let unit = (energy(first) * energy(second)).sqrt();
        if unit <= 0.0 {
            return None;
        }
        let like = |lag: isize| {
            let turn = lag.rem_euclid(count as isize) as usize;
            let rows = first.iter().zip(second);
            let sum: f64 = rows
                .map(|(a, b)| {
                    let turned = b[turn..].iter().chain(&b[..turn]);
                    a.iter().zip(turned).map(|(a, b)| a * b).sum::<f64>()
                })
                .sum();
            (lag, sum / unit)
        };
        let [least, most] = Self::range();
        let best = |sign: isize| {
            let lags = (least..=most).map(|lag| like(sign * lag));
            lags.max_by(|a, b| a.1.total_cmp(&b.1))
        };
        let (one, other) = (best(1)?, best(-1)?);
        let (best, other) = if one.1 >= other.1 {
            (one, other)
        } else {
            (other, one)
        };
        Some(Self {
            lag: best.0,
            correlation: best.1,
            other: other.1,
        })
    }

    /// The least and the largest lag that is looked at.
    fn range() -> [isize; 2] {
        let a_degree = (PARAMETERS.columns / PARAMETERS.coarse_columns) as f64 / 360.0;
        [PARAMETERS.least_field_deg, PARAMETERS.most_field_deg]
            .map(|degrees| (degrees as f64 * a_degree) as isize)
    }

    /// Whether the views are of the same surroundings, and one of them is clearly the earlier one. At the ends of the range
    /// the best lag may lie beyond.
    fn is_clear(self) -> bool {
        self.correlation >= PARAMETERS.least_correlation
            && self.correlation >= self.other + PARAMETERS.least_margin
            && !Self::range().contains(&self.lag.abs())
    }
}

/// Azimuth and relative size of the first harmonic of what the camera sees over the table's angle.
fn first_harmonic(direction: RotationDirection, light: impl Fn(usize) -> f64) -> (f64, f64) {
    let (mut re, mut im, mut sum) = (0.0, 0.0, 0.0);
    for at in 0..PARAMETERS.columns {
        let turned = (at as f64 + 0.5) / PARAMETERS.columns as f64 * std::f64::consts::TAU;
        // The camera looks along y, 90 degrees from x, and turns with the table.
        let azimuth = std::f64::consts::FRAC_PI_2
            + match direction {
                RotationDirection::CounterClockwise => turned,
                RotationDirection::Clockwise => -turned,
            };
        let light = light(at);
        re += light * azimuth.cos();
        im += light * azimuth.sin();
        sum += light;
    }
    let part = if sum > 0.0 {
        2.0 * re.hypot(im) / sum
    } else {
        0.0
    };
    (im.atan2(re).to_degrees(), part)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The grey of an environment at an azimuth, radians: a lamp, a dark door, and a wall.
    fn environment(azimuth: f64) -> f32 {
        let spot = |at: f64, size: f64| {
            let apart = (azimuth - at).sin().hypot((azimuth - at).cos() - 1.0);
            (-(apart / size).powi(2)).exp()
        };
        (0.3 + 0.5 * spot(0.7, 0.2) - 0.2 * spot(2.9, 0.1) + 0.1 * spot(4.4, 0.3)) as f32
    }

    /// What a camera with this field sees when the table stands at an angle, degrees.
    fn frame(angle_deg: f64, field_deg: f64) -> Rgb<Srgb> {
        let extent = Extent::new(100, 20);
        Rgb::new(Planes::from_fn(extent, |x, _| {
            // To the right is clockwise.
            let aside = (x as f64 + 0.5) / 100.0 - 0.5;
            let azimuth = 90.0 + angle_deg - aside * field_deg;
            [Srgb::from_linear(environment(azimuth.to_radians())); 3]
        }))
    }

    fn strip(direction: f64) -> PanoramaStrip {
        let mut builder = StripBuilder::new(Extent::new(100, 20)).unwrap();
        for k in 0..360 {
            let angle = f64::from(k);
            builder
                .push(angle, &frame(direction * angle, 40.0))
                .unwrap();
        }
        builder.finish().unwrap()
    }

    #[test]
    fn the_field_the_direction_and_the_bright_side_of_a_room_are_found() {
        for (direction, expected) in [
            (1.0, RotationDirection::CounterClockwise),
            (-1.0, RotationDirection::Clockwise),
        ] {
            let strip = strip(direction);
            let figures = strip.figures();
            assert_eq!(figures.direction, expected);
            // The columns are 94 of 100 pixels apart.
            assert!((figures.field_deg - 37.6).abs() < 1.5, "{figures:?}");
            assert!(figures.correlation > 0.95, "{figures:?}");
            // The door and the other lamp draw the first harmonic from the lamp's 40 degrees to 19.8.
            assert!(
                (figures.bright_azimuth_deg - 19.8).abs() < 1.5,
                "{figures:?}"
            );
            assert!((figures.bright_part - 0.156).abs() < 0.01, "{figures:?}");
            // The lamp at azimuth 40 degrees is 50 degrees to the right of what the camera sees first.
            let picture = strip.image().planes();
            let light = |x: &usize| picture.pixel(*x, 0)[0];
            let brightest = (0..PARAMETERS.columns).max_by(|a, b| light(a).total_cmp(&light(b)));
            let right = (brightest.unwrap() as f64 - 720.0) / 4.0;
            assert!((right - 50.0).abs() < 2.0, "{right}");
        }
    }

    #[test]
    fn light_that_changes_everywhere_at_once_tells_no_direction() {
        let extent = Extent::new(100, 20);
        let mut builder = StripBuilder::new(extent).unwrap();
        for k in 0..360 {
            let cloud = (f64::from(k).to_radians().sin() * 0.1 + 0.4) as f32;
            let frame = Rgb::<Srgb>::new(Planes::filled(extent, [cloud; 3]));
            builder.push(f64::from(k), &frame).unwrap();
        }
        assert!(builder.finish().is_none());
    }

    #[test]
    fn an_even_room_and_half_a_turn_make_no_strip() {
        let extent = Extent::new(100, 20);
        let even = Rgb::<Srgb>::new(Planes::filled(extent, [0.5; 3]));
        let mut builder = StripBuilder::new(extent).unwrap();
        for k in 0..360 {
            builder.push(f64::from(k), &even).unwrap();
        }
        assert!(builder.finish().is_none());
        let mut half = StripBuilder::new(extent).unwrap();
        for k in 0..180 {
            let angle = f64::from(k);
            half.push(angle, &frame(angle, 40.0)).unwrap();
        }
        assert!(half.finish().is_none());
        let other = Rgb::<Srgb>::new(Planes::zeros(Extent::new(3, 3)));
        let mut builder = StripBuilder::new(extent).unwrap();
        assert!(matches!(
            builder.push(0.0, &other),
            Err(TurnError::FrameSize { .. })
        ));
    }
}
