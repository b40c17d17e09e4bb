//! A ball on the table, matt grey or chrome, which measures the light.

use std::f64::consts::{FRAC_1_PI, PI, TAU};
use std::fmt;

use super::placing::{Surroundings, most_left};
use super::search::reflected;
use super::{
    BodyKind, Conditioning, CurveBuilder, Elevation, TableFrame, TurnError, fit_turn_light,
};
use relight_core::image::{ColourSpace, Extent, Linear, Planes, Rgb, Srgb};
use relight_core::light::{Direction, Normals, Order, ShLight, YUp, basis};
use relight_core::render::Surface;

/// The side of the square to which the ball is brought, pixels.
const SIDE: usize = 48;
/// The part of the ball's radius that is looked at: its rim shows the background too, and reflects it.
const PART: f32 = 0.92;
/// The least part of a pixel that counts as covered.
const TOUCHED: f64 = 1e-6;
/// A ball looks like chrome where more than this part of what varies over the turn lies beyond the second harmonic.
const SHARP: f64 = 0.06;
/// Rows and columns of the panorama that a chrome ball shows.
const ROWS: usize = 32;
const COLUMNS: usize = 2 * ROWS;
/// The order of the light by a chrome ball: as much as gloss is fitted with.
const CHROME_ORDER: usize = 6;

/// What a ball is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ProbeBall {
    /// Matt grey.
    Grey,
    /// It mirrors.
    Chrome,
}

/// A ball that measures the light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Probe {
    /// Where it is.
    pub place: ProbePlace,
    /// What it is made of; what it looks like where that is not known.
    pub ball: Option<ProbeBall>,
    /// The camera over the table.
    pub elevation: Elevation,
}

/// The light that a ball measured.
#[derive(Debug, Clone, PartialEq)]
pub struct ProbeLight {
    /// In the viewer's frame at the table's angle 0: of order 2 by a grey ball, in units in which the ball's albedo is 1; of order 6
    /// by a chrome one, in units in which it reflects everything and a white matt surface has albedo 1.
    pub light: ShLight,
    /// How many frames it was measured in.
    pub frames: u32,
    /// What the ball was taken for.
    pub ball: ProbeBall,
    /// What it looks like.
    pub looks: ProbeBall,
    /// The part of what varies in the ball, over the turn and from place to place, that this light does not explain, 0 to 1.
    pub left: f64,
}

impl ProbeLight {
    /// Whether the light explains so little of the ball that its place is to be checked.
    #[must_use]
    pub fn is_doubtful(&self) -> bool {
        self.left > most_left(self.ball) / 2.0
    }
}

/// Where a ball is in the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProbePlace {
    /// Its middle, pixels from the left and from the top.
    pub middle: [f64; 2],
    /// Its radius, pixels.
    pub radius: f64,
}

impl fmt::Display for ProbePlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y] = self.middle;
        write!(f, "{x},{y},{}", self.radius)
    }
}

/// Gathers what a ball shows over a turn.
#[derive(Debug)]
pub struct ProbeBuilder {
    probe: Probe,
    normals: Normals<YUp>,
    builder: CurveBuilder,
    mirrored: Mirrored,
    /// From the first frame on.
    surroundings: Option<Surroundings>,
}

impl ProbePlace {
    /// A ball with its middle at `x`, `y`.
    ///
    /// # Errors
    /// [`TurnError::Setting`] where the radius is less than 4 pixels or a number is not finite.
    pub fn new([x, y]: [f64; 2], radius: f64) -> Result<Self, TurnError> {
        if !(x.is_finite() && y.is_finite() && radius.is_finite() && radius >= 4.0) {
            return Err(TurnError::Setting {
                what: "the radius of the ball",
                value: radius,
                allowed: "at least 4 pixels, and its middle a place in the picture",
            });
        }
        Ok(Self {
            middle: [x, y],
            radius,
        })
    }

    /// Whether all of it is in a picture of this size.
    fn is_within(&self, extent: Extent) -> bool {
        let [x, y] = self.middle;
        let fits = |at: f64, size: usize| at >= self.radius && at + self.radius <= size as f64;
        fits(x, extent.width) && fits(y, extent.height)
    }
}

impl ProbeBuilder {
    /// For a ball at a place.
    ///
    /// # Errors
    /// None for a ball.
    pub fn new(probe: Probe) -> Result<Self, TurnError> {
        let extent = Extent::new(SIDE, SIDE);
        let mask = Planes::from_fn(extent, |x, y| {
            let from_middle = |at: usize| 2.0 * (at as f32 + 0.5) / SIDE as f32 - 1.0;
            let inside = from_middle(x).hypot(from_middle(y)) < PART;
            [f32::from(u8::from(inside))]
        });
        Ok(Self {
            probe,
            normals: Normals::sphere(SIDE).masked(&mask)?,
            builder: CurveBuilder::new(extent, mask.plane(0))?,
            mirrored: Mirrored::new(TableFrame::new(probe.elevation)),
            surroundings: None,
        })
    }

    /// Takes up a frame at an angle of the table, degrees.
    ///
    /// # Errors
    /// [`TurnError::Setting`] where the ball is not in it.
    pub fn push(&mut self, angle_deg: f64, frame: &Rgb<Srgb>) -> Result<(), TurnError> {
        let planes = frame.planes();
        let place = self.probe.place;
        if !place.is_within(planes.extent()) {
            return Err(TurnError::Setting {
                what: "the radius of the ball",
                value: place.radius,
                allowed: "so small that all of the ball is in the picture",
            });
        }
        let surroundings = match &mut self.surroundings {
            Some(surroundings) => surroundings,
            none => none.insert(Surroundings::new(place, planes.extent())?),
        };
        surroundings.push(angle_deg, planes)?;
        let ball = Planes::from_fn(Extent::new(SIDE, SIDE), |x, y| place.light(planes, x, y));
        self.add_mirrored(angle_deg, &ball);
        self.builder.push(angle_deg, ball.extent(), ball.planes())
    }

    /// Adds what the ball shows were it a mirror.
    fn add_mirrored(&mut self, angle_deg: f64, ball: &Planes<3>) {
        if !angle_deg.is_finite() {
            return;
        }
        let [x, y, z] = self.normals.planes().planes();
        for at in (0..z.len()).filter(|&at| z[at] > 0.0) {
            let normal = [x[at], y[at], z[at]].map(f64::from);
            let value = ball.planes().map(|plane| f64::from(plane[at]));
            self.mirrored.add(angle_deg.to_radians(), normal, value);
        }
    }

    /// The light.
    ///
    /// # Errors
    /// Where the frames tell too little, or the ball is not where it is said to be: [`TurnError::Misplaced`] and
    /// [`TurnError::NoBall`].
    pub fn finish(self) -> Result<ProbeLight, TurnError> {
        let frame = TableFrame::new(self.probe.elevation);
        let curves = self.builder.finish()?;
        let looks = if Conditioning::of(&curves).beyond > SHARP {
            ProbeBall::Chrome
        } else {
            ProbeBall::Grey
        };
        let ball = self.probe.ball.unwrap_or(looks);
        let left = match self.surroundings {
            Some(surroundings) => {
                surroundings
                    .check(ball, self.probe.elevation)
                    .map_err(|error| match error {
                        // Of a ball of the other kind, where it is cannot be told.
                        TurnError::Misplaced {
                            given, explained, ..
                        } if ball != looks => TurnError::NoBall {
                            given,
                            explained: explained[0],
                        },
                        error => error,
                    })?
            }
            None => 1.0,
        };
        let light = match ball {
            ProbeBall::Grey => {
                let albedo = Rgb::<Linear>::new(Planes::filled(self.normals.extent(), [1.0; 3]));
                let surface = Surface::new(self.normals, albedo, None)?;
                fit_turn_light(&curves, &surface, BodyKind::Diffuse, &frame)?
            }
            ProbeBall::Chrome => {
                let light = self.mirrored.light()?;
                light.rotated(&frame.rotation().inverse())
            }
        };
        Ok(ProbeLight {
            light,
            frames: curves.frames(),
            ball,
            looks,
            left,
        })
    }
}

/// The panorama that a chrome ball shows of the room while it turns, in the table's frame at its angle 0.
#[derive(Debug)]
pub(super) struct Mirrored {
    frame: TableFrame,
    sums: Vec<[f64; 3]>,
    counts: Vec<f64>,
}

impl Mirrored {
    pub(super) fn new(frame: TableFrame) -> Self {
        Self {
            frame,
            sums: vec![[0.0; 3]; ROWS * COLUMNS],
            counts: vec![0.0; ROWS * COLUMNS],
        }
    }

    /// Adds what a normal of the ball shows at an angle of the table, radians.
    pub(super) fn add(&mut self, angle: f64, normal: [f64; 3], light: [f64; 3]) {
        let cell = self.cell(angle, normal);
        for (sum, light) in self.sums[cell].iter_mut().zip(light) {
            *sum += light;
        }
        self.counts[cell] += 1.0;
    }

    /// What the same direction of the room showed in the mean; none where it was never added.
    pub(super) fn seen(&self, angle: f64, normal: [f64; 3]) -> Option<[f64; 3]> {
        let cell = self.cell(angle, normal);
        mean(&self.sums[cell..=cell], &self.counts[cell..=cell])
    }

    /// The mean of all that was added.
    pub(super) fn all(&self) -> Option<[f64; 3]> {
        mean(&self.sums, &self.counts)
    }

    /// Where the direction is that a normal of the ball shows.
    fn cell(&self, angle: f64, normal: [f64; 3]) -> usize {
        let [x, y, z] = self.frame.to_table(reflected(normal));
        let azimuth = y.atan2(x) + angle;
        let column = (azimuth.rem_euclid(TAU) / TAU * COLUMNS as f64) as usize % COLUMNS;
        let row = ((z.clamp(-1.0, 1.0).acos() / PI * ROWS as f64) as usize).min(ROWS - 1);
        row * COLUMNS + column
    }

    /// What it shows, as coefficients; directions that it never shows are as bright as their row, or as all.
    fn light(&self) -> Result<ShLight, TurnError> {
        let all = self.all().ok_or(TurnError::NoLight)?;
        let order = Order::new(CHROME_ORDER).unwrap_or(Order::TWO);
        let mut light = ShLight::even(order, [0.0; 3]);
        for row in 0..ROWS {
            let cells = row * COLUMNS..(row + 1) * COLUMNS;
            let of_row = mean(&self.sums[cells.clone()], &self.counts[cells]).unwrap_or(all);
            let polar = PI * (row as f64 + 0.5) / ROWS as f64;
            let edges = [row, row + 1].map(|edge| (PI * edge as f64 / ROWS as f64).cos());
            let area = (edges[0] - edges[1]) * TAU / COLUMNS as f64;
            for column in 0..COLUMNS {
                let cell = row * COLUMNS + column;
                let shown = mean(&self.sums[cell..=cell], &self.counts[cell..=cell]);
                let azimuth = TAU * (column as f64 + 0.5) / COLUMNS as f64;
                let (sin, cos) = azimuth.sin_cos();
                let to = Direction::new(polar.sin() * cos, polar.sin() * sin, polar.cos());
                let Some(to) = to else { continue };
                let values = basis(order, to);
                for (coefficient, value) in light.coefficients_mut().iter_mut().zip(values) {
                    for (sum, shown) in coefficient.iter_mut().zip(shown.unwrap_or(of_row)) {
                        *sum += FRAC_1_PI * area * value * shown;
                    }
                }
            }
        }
        Ok(light)
    }
}

/// The mean of all cells that were seen.
fn mean(sums: &[[f64; 3]], counts: &[f64]) -> Option<[f64; 3]> {
    let count: f64 = counts.iter().sum();
    let sum = |channel: usize| sums.iter().map(|sum| sum[channel]).sum::<f64>();
    (count > 0.0).then(|| [0, 1, 2].map(|channel| sum(channel) / count))
}

impl ProbePlace {
    /// The light at a pixel of the square that the ball fills.
    fn light(&self, planes: &Planes<3>, x: usize, y: usize) -> [f32; 3] {
        let from = |at: usize| (2 * at + 1) as f64 / SIDE as f64 - 1.0;
        let pixel = 2.0 * self.radius / SIDE as f64;
        self.mean_light(planes, self.in_picture([from(x), -from(y)]), pixel)
    }

    /// Where a place is in the picture that is given in radii from the ball's middle, to the right and up.
    pub(super) fn in_picture(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [
            self.middle[0] + self.radius * x,
            self.middle[1] - self.radius * y,
        ]
    }

    /// The light of a square of the picture, the mean of the pixels that it covers; white where one of them is.
    pub(super) fn mean_light(&self, planes: &Planes<3>, [x, y]: [f64; 2], size: f64) -> [f32; 3] {
        let range = |middle: f64| {
            // A pixel that is only touched, by rounding, is not covered.
            let from = (middle - size / 2.0 + TOUCHED).max(0.0) as usize;
            from..((middle + size / 2.0 - TOUCHED).ceil().max(0.0) as usize).max(from + 1)
        };
        let Extent { width, height } = planes.extent();
        let (mut sum, mut count) = ([0.0; 3], 0.0);
        for row in range(y).filter(|&row| row < height) {
            for column in range(x).filter(|&column| column < width) {
                for (sum, value) in sum.iter_mut().zip(planes.pixel(column, row)) {
                    *sum += Srgb::to_linear(value);
                }
                count += 1.0;
            }
        }
        sum.map(|sum: f32| if count > 0.0 { sum / count } else { 0.0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight_core::light::Rotation;
    use relight_core::render::{DiffuseForm, DiffuseLayer};

    const ELEVATION: f64 = 22.0;

    fn probe(ball: Option<ProbeBall>) -> Probe {
        Probe {
            place: ProbePlace::new([61.0, 40.0], 30.0).unwrap(),
            ball,
            elevation: Elevation::given(ELEVATION).unwrap(),
        }
    }

    /// A room with windows: beyond band 2 too.
    fn room() -> ShLight {
        let values = [2.0, 0.3, 0.24, 0.36, 0.07, -0.06, 0.03, 0.12, 0.09];
        let light = ShLight::new(values.map(|v| [v, 0.9 * v, 0.8 * v]).to_vec()).unwrap();
        let mut light = light.with_order(Order::new(4).unwrap());
        for (at, values) in light.coefficients_mut().iter_mut().enumerate().skip(9) {
            *values = [0.15 * (1.7 * at as f64).sin(); 3];
        }
        light
    }

    /// What is seen beside the ball: above, a room that moves past, and below, the table.
    fn behind(angle_deg: f64, x: usize, y: usize) -> [f32; 3] {
        if y > 50 {
            return [0.5, 0.45, 0.4];
        }
        let azimuth = (angle_deg + 0.5 * x as f64).to_radians();
        let wall = 0.5 + 0.2 * (3.0 * azimuth).sin() + 0.2 * (11.0 * azimuth).cos();
        [wall as f32; 3]
    }

    /// Films a ball that shows of a light what `shown` says, pixel by pixel.
    fn measure(
        ball: Option<ProbeBall>,
        shown: impl Fn(&ShLight, &Normals<YUp>) -> Planes<3>,
    ) -> ProbeLight {
        try_measure(probe(ball), shown).unwrap()
    }

    /// The same for a ball that is said to be elsewhere.
    fn try_measure(
        probe: Probe,
        shown: impl Fn(&ShLight, &Normals<YUp>) -> Planes<3>,
    ) -> Result<ProbeLight, TurnError> {
        let mut builder = ProbeBuilder::new(probe).unwrap();
        let normals = Normals::sphere(60);
        let frame = TableFrame::new(Elevation::given(ELEVATION).unwrap());
        let [x, y, z] = frame.axis();
        let axis = Direction::new(x, y, z).unwrap();
        for k in 0..60 {
            let angle = 6.0 * f64::from(k);
            let turned = room().rotated(&Rotation::about(axis, -angle.to_radians()));
            let light = shown(&turned, &normals);
            let picture = Planes::from_fn(Extent::new(120, 90), |x, y| {
                let (at_x, at_y) = (x.wrapping_sub(31), y.wrapping_sub(10));
                if at_x < 60 && at_y < 60 && normals.planes().pixel(at_x, at_y)[2] > 0.0 {
                    light.pixel(at_x, at_y).map(Srgb::from_linear)
                } else {
                    behind(angle, x, y)
                }
            });
            builder.push(angle, &Rgb::new(picture)).unwrap();
        }
        builder.finish()
    }

    fn grey(light: &ShLight, normals: &Normals<YUp>) -> Planes<3> {
        let shading = DiffuseLayer::new(light, DiffuseForm::Irradiance).shading(normals);
        shading.into_planes().map(|v| 0.2 * v)
    }

    fn chrome(light: &ShLight, normals: &Normals<YUp>) -> Planes<3> {
        Planes::from_fn(normals.extent(), |x, y| {
            let normal = normals.planes().pixel(x, y).map(f64::from);
            let [x, y, z] = reflected(normal);
            let Some(to) = Direction::new(x, y, z) else {
                return [0.0; 3];
            };
            let values = basis(light.order(), to);
            [0, 1, 2].map(|c| {
                let pairs = light.coefficients().iter().zip(&values);
                let sum: f64 = pairs.map(|(light, value)| light[c] * value).sum();
                (0.5 * sum) as f32
            })
        })
    }

    fn check(found: &ShLight, factor: f64, count: usize) {
        let wanted = room();
        assert!(found.coefficients().len() >= count);
        for (found, light) in found
            .coefficients()
            .iter()
            .zip(wanted.coefficients())
            .take(count)
        {
            for (found, light) in found.iter().zip(light) {
                assert!(
                    (found - factor * light).abs() < 0.03 * factor,
                    "{found} {light}"
                );
            }
        }
    }

    #[test]
    fn a_grey_ball_tells_the_light_in_units_of_its_albedo() {
        let found = measure(None, grey);
        assert_eq!(
            (found.frames, found.ball, found.looks),
            (60, ProbeBall::Grey, ProbeBall::Grey)
        );
        check(&found.light, 0.2, 9);
    }

    #[test]
    fn a_chrome_ball_tells_more_of_the_light_in_units_of_what_it_reflects() {
        let found = measure(None, chrome);
        assert_eq!(
            (found.ball, found.looks),
            (ProbeBall::Chrome, ProbeBall::Chrome)
        );
        check(&found.light, 0.5 * FRAC_1_PI, 25);
    }

    #[test]
    fn a_ball_that_is_not_of_what_is_said_of_it_is_refused() {
        for refused in [
            try_measure(probe(Some(ProbeBall::Chrome)), grey),
            try_measure(probe(Some(ProbeBall::Grey)), chrome),
        ] {
            let refused = refused.unwrap_err();
            assert!(matches!(refused, TurnError::NoBall { .. }), "{refused}");
            let said = refused.to_string();
            assert!(said.contains("say what the ball is made of"), "{said}");
        }
    }

    #[test]
    fn a_ball_beside_its_place_is_refused_with_where_it_is() {
        type Shown = fn(&ShLight, &Normals<YUp>) -> Planes<3>;
        for (ball, shown) in [
            (ProbeBall::Grey, grey as Shown),
            (ProbeBall::Chrome, chrome as Shown),
        ] {
            let there = measure(Some(ball), shown);
            assert!(there.left < 0.05 && !there.is_doubtful(), "{there:?}");
            for (middle, radius) in [
                ([69.0, 40.0], 30.0),
                ([61.0, 34.0], 30.0),
                ([61.0, 40.0], 24.0),
                ([57.0, 43.0], 36.0),
            ] {
                let place = ProbePlace::new(middle, radius).unwrap();
                let other = Probe {
                    place,
                    ..probe(Some(ball))
                };
                let refused = try_measure(other, shown).unwrap_err();
                let TurnError::Misplaced { better, .. } = &refused else {
                    panic!("{ball:?} at {place}: {refused}");
                };
                let apart = [0, 1, 2].map(|i| (better[i] - [61.0, 40.0, 30.0][i]).abs());
                assert!(apart.iter().all(|&apart| apart <= 2.0), "{refused}");
            }
        }
    }

    #[test]
    fn what_is_no_ball_is_refused() {
        // A board that leans to the camera.
        let flat = |light: &ShLight, normals: &Normals<YUp>| {
            let board = Planes::filled(normals.extent(), [0.0, 0.6, 0.8]);
            grey(light, &Normals::new(board))
        };
        let refused = try_measure(probe(Some(ProbeBall::Grey)), flat).unwrap_err();
        assert!(matches!(refused, TurnError::NoBall { .. }), "{refused}");
    }

    #[test]
    fn a_ball_beyond_the_picture_is_refused() {
        assert!(ProbePlace::new([10.0, 10.0], f64::NAN).is_err());
        assert!(ProbePlace::new([10.0, 10.0], 2.0).is_err());
        let beyond = Probe {
            place: ProbePlace::new([10.0, 10.0], 20.0).unwrap(),
            ..probe(None)
        };
        let picture = Rgb::<Srgb>::new(Planes::zeros(Extent::new(100, 100)));
        let refused = ProbeBuilder::new(beyond).unwrap().push(0.0, &picture);
        assert!(matches!(refused, Err(TurnError::Setting { .. })));
    }
}
