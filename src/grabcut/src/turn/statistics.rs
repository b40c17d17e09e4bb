//! What a turn tells about each pixel: how its colour is on average and how much it changes.
//!
//! Object and table stand still in the image while background and light move. Averaged over a turn the
//! background becomes a smooth band without structure, shadows on the table disappear, and highlights
//! fade; how much brightness and colour change separates what moves from what is only lit differently.
//! Two neighbours on the object change together, those on both sides of its outline do not: that is the
//! contrast along which the cut runs.

use image::RgbImage;

use super::edge;
use super::frame_shift;
use super::network::Classes;
use super::pixel_series::PixelSeries;
use super::smooth::smooth;
use crate::MaskError;
use crate::bitmap::Bitmap;
use crate::cut::grab_cut;
use crate::cut::grab_cut::{
    DIRECTIONS_AHEAD, Field, Label, Models, SMOOTHNESS, change, neighbour, squared_distance,
};
use crate::cut::lab::LabTable;
use crate::cut::pyramid::{InitialModels, RgbField, ascend, half_image, levels, start};
use crate::expected_overlap::expected_overlap;
use crate::hints::trimap::Trimap;
use crate::{Effort, Hints};

/// Fewest frames from which anything can be learned.
pub const MIN_TURN_FRAMES: usize = 4;
/// Frames that are sampled of a turn.
pub const TURN_FRAMES: usize = 32;
/// Frames are halved until they have at most so many pixels; the object is cut at that size.
const MAX_PIXELS: usize = 600_000;
/// Share of the frame's shorter side that is background at each border.
const BORDER: f64 = 0.01;
/// Share of the frame's shorter side from which the background is learned at first.
const RING: f64 = 0.06;
/// Share of the pixels within the ring that is taken for background at first.
const SHARE: f64 = 0.7;
/// The same share of the pixels in a rectangle.
const SHARE_OF_RECT: f64 = 0.5;
/// Weight of what the network says, in units of the log-likelihood.
const NETWORK_WEIGHT: f32 = 1.3;
/// Weight of the average colour against that of the current one.
const COLOUR_WEIGHT: f32 = 1.0 / 3.0;
/// Weight of the logarithms of the changes.
const CHANGE_WEIGHT: f32 = 3.0;
/// How much a constant difference counts against one that changes: edges of paint on the object are
/// constant, its outline is not.
const CONSTANT_WEIGHT: f32 = 0.25;
/// A smaller change of the brightness, in L, is noise.
const STILL: f32 = 1.0;
/// A larger contrast counts as this.
const MAX_CONTRAST: f32 = 100.0;
/// A step of the brightness, as a logarithm, that is an edge: of this size or larger.
const EDGE: f32 = 0.05;
/// Added to a luminance, 0..=1, before its logarithm: noise counts little below.
const DARK: f32 = 0.003;

/// Frames of a turn, all of one size, reduced to what the statistics need.
#[derive(Debug, Clone)]
pub struct TurnFrames {
    frames: Vec<RgbImage>,
    full: (u32, u32),
}

impl TurnFrames {
    /// A turn without frames, whose frames are `width` x `height` pixels large.
    #[must_use]
    pub fn new(width: u32, height: u32) -> Self {
        Self {
            frames: Vec::new(),
            full: (width, height),
        }
    }

    /// Adds a frame. One of another size is left out.
    pub fn push(&mut self, frame: &RgbImage) {
        if frame.dimensions() != self.full {
            return;
        }
        let mut small = None;
        while pixels(small.as_ref().unwrap_or(frame)) > MAX_PIXELS {
            small = Some(half_image(small.as_ref().unwrap_or(frame)));
        }
        self.frames.push(small.unwrap_or_else(|| frame.clone()));
    }
}

fn pixels(image: &RgbImage) -> usize {
    image.width() as usize * image.height() as usize
}

/// What the frames of a turn tell about each pixel; any number of cuts can be made with it.
#[derive(Debug, Clone)]
pub struct TurnStatistics {
    frames: usize,
    /// The frames' width and height.
    pub(crate) full: (u32, u32),
    pub(crate) field: TurnField,
    pub(crate) series: PixelSeries,
}

impl TurnStatistics {
    /// Looks at the frames of a turn.
    #[must_use]
    pub fn new(turn: &TurnFrames) -> Self {
        let colours = LabTable::new();
        let classes = Classes::from_frames(&turn.frames);
        let field = TurnField::new(&turn.frames, &colours, classes.as_ref());
        Self {
            frames: turn.frames.len(),
            full: turn.full,
            series: PixelSeries::new(&turn.frames, field.size),
            field,
        }
    }

    /// The same if the network says nothing.
    fn without_network(&self) -> Self {
        let mut silent = self.clone();
        silent.field.object_odds.fill(0.0);
        silent
    }

    /// That there are enough frames.
    pub(crate) fn check(&self) -> Result<(), MaskError> {
        if self.frames >= MIN_TURN_FRAMES {
            Ok(())
        } else {
            Err(MaskError::FewFrames { found: self.frames })
        }
    }

    /// The frames are so many times larger: a power of two.
    pub(crate) fn factor(&self) -> usize {
        let ratio = (self.full.0 as usize).div_ceil(self.field.size.0.max(1));
        ratio.next_power_of_two()
    }

    /// A bitmap of the frames' size in that of the statistics.
    pub(crate) fn downscaled(&self, object: &Bitmap) -> Bitmap {
        let ((columns, rows), factor) = (self.field.size, self.factor());
        let is_set = |at: usize| {
            let (x, y) = (at % columns * factor, at / columns * factor);
            object.bits().get(y * self.full.0 as usize + x) == Some(&true)
        };
        Bitmap::new(
            (columns as u32, rows as u32),
            (0..columns * rows).map(is_set),
        )
    }

    /// How well an outline follows what moves differently: the mean over its edges of the strength of
    /// the contrast there, 0..=1.
    pub(crate) fn outline(&self, object: &Bitmap) -> f32 {
        let object = self.downscaled(object);
        self.field.outline(&object)
    }

    /// The overlap (intersection over union) with the object that is to be expected of a mask, if the network's
    /// probabilities are right, and the mask where it is sure.
    pub(crate) fn expected_overlap(&self, mask: &Bitmap, sure: &Bitmap) -> f32 {
        let (mask, sure) = (self.downscaled(mask), self.downscaled(sure));
        let pixels = mask.bits().iter().zip(sure.bits());
        let pixels = pixels.zip(&self.field.object_odds);
        expected_overlap(pixels.map(|((&mask, &sure), &odds)| (mask, sure, odds)))
    }

    /// Whether anything moves: a quarter of the pixels changes its brightness.
    pub(crate) fn moves(&self) -> bool {
        let features = self.field.features.iter();
        let mut changes: Vec<f32> = features.map(|feature| feature[3]).collect();
        let upper = changes.len() * 3 / 4;
        if changes.is_empty() {
            return false;
        }
        let (_, change, _) = changes.select_nth_unstable_by(upper, f32::total_cmp);
        *change > CHANGE_WEIGHT * STILL.ln_1p()
    }
}

/// Averages and changes of each pixel over the frames.
#[derive(Debug, Clone)]
pub(crate) struct TurnField {
    pub(crate) size: (usize, usize),
    features: Vec<[f32; 5]>,
    /// To the neighbours in [`DIRECTIONS_AHEAD`].
    contrasts: Vec<[f32; 4]>,
    /// In which share of the frames there is an edge next to a pixel: a shadow's passes by, an outline stays.
    lasting: Vec<f32>,
    /// What the network says, as logarithms of odds: the object, and the table.
    object_odds: Vec<f32>,
    table_odds: Vec<f32>,
}

impl TurnField {
    fn new(frames: &[RgbImage], colours: &LabTable, classes: Option<&Classes>) -> Self {
        let first = frames.first().filter(|frame| pixels(frame) > 0);
        let size = first.map_or((0, 0), RgbImage::dimensions);
        let size = (size.0 as usize, size.1 as usize);
        let count = size.0 * size.1;
        let mut sum = vec![[0.0_f32; 3]; count];
        let mut square = vec![[0.0_f32; 2]; count];
        let mut difference = vec![[0.0_f32; 4]; count];
        let mut steps = vec![[0.0_f32; 4]; count];
        for frame in frames {
            let lab: Vec<[f32; 3]> = frame.pixels().map(|p| colours.lab(p.0)).collect();
            let logs = smooth_logs(&lab, size);
            for (at, &[l, a, b]) in lab.iter().enumerate() {
                sum[at].iter_mut().zip([l, a, b]).for_each(|(s, v)| *s += v);
                square[at][0] += l * l;
                square[at][1] += a * a + b * b;
                for (to, &direction) in DIRECTIONS_AHEAD.iter().enumerate() {
                    if let Some(next) = neighbour(at, direction, size) {
                        difference[at][to] += squared_distance(&lab[at], &lab[next]);
                        steps[at][to] += ((logs[at] - logs[next]) / EDGE).powi(2).min(1.0);
                    }
                }
            }
        }
        let many = frames.len().max(1) as f32;
        let mean: Vec<[f32; 3]> = sum.iter().map(|sum| sum.map(|s| s / many)).collect();
        let feature = |at: usize| {
            let [l, a, b] = mean[at];
            let change_of_light = (square[at][0] / many - l * l).max(0.0).sqrt();
            let change_of_colour = (square[at][1] / many - a * a - b * b).max(0.0).sqrt();
            [
                COLOUR_WEIGHT * l,
                COLOUR_WEIGHT * a,
                COLOUR_WEIGHT * b,
                CHANGE_WEIGHT * change_of_light.ln_1p(),
                CHANGE_WEIGHT * change_of_colour.ln_1p(),
            ]
        };
        let contrast = |at: usize| {
            std::array::from_fn(|to| {
                let Some(next) = neighbour(at, DIRECTIONS_AHEAD[to], size) else {
                    return 0.0;
                };
                let constant = squared_distance(&mean[at], &mean[next]);
                let all = difference[at][to] / many - (1.0 - CONSTANT_WEIGHT) * constant;
                let lasting = MAX_CONTRAST * steps[at][to] / many;
                (all.clamp(0.0, MAX_CONTRAST) * lasting).sqrt()
            })
        };
        let features: Vec<[f32; 5]> = (0..count).map(feature).collect();
        let contrasts: Vec<[f32; 4]> = (0..count).map(contrast).collect();
        let lasting = largest(&steps, size).into_iter().map(|steps| steps / many);
        let lasting: Vec<f32> = lasting.collect();
        let odds = |of: fn(&Classes, (usize, usize)) -> Vec<f32>| {
            classes.map_or_else(|| vec![0.0; count], |classes| of(classes, size))
        };
        Self {
            size,
            object_odds: odds(Classes::object),
            table_odds: odds(Classes::table),
            features,
            contrasts,
            lasting,
        }
    }

    /// Cuts the object out at this size. The first guess is the network's, or that the frame's ring is background.
    fn cut(&self, labels: &mut [Label], share: f64) -> Result<Models<5>, MaskError> {
        if !self.initialise_by_network(labels) {
            let size = (self.size.0 as u32, self.size.1 as u32);
            grab_cut::rank(self, labels, share, ring(size, RING));
        }
        start(self, labels, InitialModels::All, SMOOTHNESS)
    }

    /// The average brightness L of each pixel.
    pub(crate) fn light(&self) -> Vec<f32> {
        let features = self.features.iter();
        features.map(|feature| feature[0] / COLOUR_WEIGHT).collect()
    }

    /// In which share of the frames there is an edge along an outline.
    pub(crate) fn outline(&self, object: &Bitmap) -> f32 {
        let boundary = self.boundary(object, &object.inverted());
        boundary.unwrap_or(0.0)
    }

    /// In which share of the frames there is an edge along the boundary between two parts, which have its size; `None` if
    /// they do not touch.
    pub(crate) fn boundary(&self, one: &Bitmap, other: &Bitmap) -> Option<f32> {
        let (columns, rows) = self.size;
        let (one, other) = (one.bits(), other.bits());
        let (mut sum, mut edges) = (0.0, 0.0);
        for at in 0..columns * rows {
            for direction in [4, 6] {
                let next = neighbour(at, direction, self.size);
                let is_edge = |next: &usize| one[at] && other[*next] || other[at] && one[*next];
                if let Some(next) = next.filter(is_edge) {
                    // The edge may lie a pixel beside it.
                    sum += self.lasting[at].max(self.lasting[next]);
                    edges += 1.0;
                }
            }
        }
        (edges > 0.0).then_some(sum / edges)
    }

    /// What the network says of a part, as a mean of the logarithms of its pixels' odds: whether it is object.
    pub(crate) fn odds(&self, part: &Bitmap) -> f32 {
        let odds = part.bits().iter().zip(&self.object_odds);
        let sum: f32 = odds.filter(|(bit, _)| **bit).map(|(_, odds)| odds).sum();
        sum / part.count().max(1) as f32
    }

    /// What the network takes for the table.
    pub(crate) fn table(&self) -> Bitmap {
        let size = (self.size.0 as u32, self.size.1 as u32);
        Bitmap::new(size, self.table_odds.iter().map(|&odds| odds > 0.0))
    }

    /// Takes what the network takes for background as such at first. False, and nothing is done, if that is all or
    /// nothing of what is open.
    fn initialise_by_network(&self, labels: &mut [Label]) -> bool {
        let open = |label: &Label| *label == Label::ProbablyObject;
        let odds = labels.iter().zip(&self.object_odds);
        let (object, background): (Vec<f32>, Vec<f32>) = odds
            .filter(|(label, _)| open(label))
            .map(|(_, &odds)| odds)
            .partition(|&odds| odds > 0.0);
        if object.is_empty() || background.is_empty() {
            return false;
        }
        for (label, &odds) in labels.iter_mut().zip(&self.object_odds) {
            if open(label) && odds <= 0.0 {
                *label = Label::ProbablyBackground;
            }
        }
        true
    }
}

/// The logarithms of the luminances, each averaged with its neighbours against noise.
fn smooth_logs(lab: &[[f32; 3]], size: (usize, usize)) -> Vec<f32> {
    let light: Vec<f32> = lab.iter().map(|lab| luminance(lab[0]) + DARK).collect();
    smooth(&light, size).into_iter().map(f32::ln).collect()
}

/// The luminance, 0..=1, of a lightness L.
fn luminance(light: f32) -> f32 {
    if light > 8.0 {
        ((light + 16.0) / 116.0).powi(3)
    } else {
        light * 27.0 / 24389.0
    }
}

/// The largest contrast of each pixel to its eight neighbours.
fn largest(contrasts: &[[f32; 4]], size: (usize, usize)) -> Vec<f32> {
    let mut largest = vec![0.0_f32; contrasts.len()];
    for (at, ahead) in contrasts.iter().enumerate() {
        for (&contrast, &direction) in ahead.iter().zip(&DIRECTIONS_AHEAD) {
            if let Some(next) = neighbour(at, direction, size) {
                largest[at] = largest[at].max(contrast);
                largest[next] = largest[next].max(contrast);
            }
        }
    }
    largest
}

impl Field<5> for TurnField {
    const VARIANCE_FLOOR: f64 = 0.05;

    fn size(&self) -> (usize, usize) {
        self.size
    }

    fn feature(&self, at: usize) -> [f32; 5] {
        self.features[at]
    }

    fn contrast(&self, a: usize, b: usize) -> f32 {
        let (first, second) = (a.min(b), a.max(b));
        let step = second - first;
        let to = match step {
            1 => 0,
            _ if step + 1 == self.size.0 => 1,
            _ if step == self.size.0 => 2,
            _ => 3,
        };
        self.contrasts[first][to]
    }

    fn evidence(&self, at: usize) -> f32 {
        NETWORK_WEIGHT * self.object_odds[at]
    }
}

/// A frame larger than the turn's statistics: these say what a pixel is, the frame says where the edge
/// is.
struct FrameInTurn<'a> {
    turn: &'a TurnField,
    frame: RgbField<'a>,
    /// The frame is so many times larger.
    factor: usize,
}

impl Field<5> for FrameInTurn<'_> {
    const VARIANCE_FLOOR: f64 = TurnField::VARIANCE_FLOOR;

    fn size(&self) -> (usize, usize) {
        self.frame.size()
    }

    fn feature(&self, at: usize) -> [f32; 5] {
        self.turn.features[self.in_turn(at)]
    }

    fn contrast(&self, a: usize, b: usize) -> f32 {
        self.frame.contrast(a, b)
    }

    fn evidence(&self, at: usize) -> f32 {
        NETWORK_WEIGHT * self.turn.object_odds[self.in_turn(at)]
    }
}

impl FrameInTurn<'_> {
    fn in_turn(&self, at: usize) -> usize {
        let (width, _) = self.frame.size();
        let (columns, rows) = self.turn.size;
        let (x, y) = (at % width / self.factor, at / width / self.factor);
        y.min(rows - 1) * columns + x.min(columns - 1)
    }
}

/// Cuts the object out by what the turn tells, on the pixels of `frame`; without the network if nothing is found by it.
pub(crate) fn segment(
    frame: &RgbImage,
    turn: &TurnStatistics,
    hints: &Hints,
    effort: Effort,
) -> Result<Bitmap, MaskError> {
    turn.check()?;
    match cut_out(frame, turn, hints, effort) {
        Err(MaskError::Empty | MaskError::Everything) => {
            cut_out(frame, &turn.without_network(), hints, effort)
        }
        cut => cut,
    }
}

fn cut_out(
    frame: &RgbImage,
    turn: &TurnStatistics,
    hints: &Hints,
    effort: Effort,
) -> Result<Bitmap, MaskError> {
    if turn.full != frame.dimensions() {
        return Err(MaskError::FewFrames { found: 0 });
    }
    let table = LabTable::new();
    let (known, share) = known(hints, frame.dimensions())?;
    let levels = levels(frame, known, MAX_PIXELS);
    let field = &turn.field;
    let (own, finer) = levels
        .split_last()
        .ok_or(MaskError::FewFrames { found: 0 })?;
    let mut labels = own.labels.clone();
    let mut models = field.cut(&mut labels, share)?;
    change(&mut labels, field.size, |object| {
        edge::along_series(&turn.series, &field.object_odds, object)
    });
    // From where the object is on average to where it is in the frame.
    change(&mut labels, field.size, |object| {
        let pixels = own.image.pixels();
        let light: Vec<f32> = pixels.map(|pixel| table.lab(pixel.0)[0]).collect();
        let by = frame_shift::shift(&field.light(), &light, object, field.size);
        frame_shift::moved(object, by, field.size)
    });
    let in_frame = |steps, image| FrameInTurn {
        turn: field,
        frame: RgbField::new(image, &table),
        factor: 2_usize << steps,
    };
    Ok(ascend(
        finer,
        labels,
        field.size,
        &mut models,
        effort,
        in_frame,
    ))
}

/// What is known of each pixel: hints, and that the object does not touch the frame's border. With it
/// the share of the rest that is taken for background at first.
fn known(hints: &Hints, size: (u32, u32)) -> Result<(Vec<Label>, f64), MaskError> {
    let border = ring(size, BORDER);
    let open = |at: usize| {
        if border(at) {
            Label::Background
        } else {
            Label::ProbablyObject
        }
    };
    let initial = Trimap::new(hints, size)?;
    let labels = initial.labels.into_iter().enumerate();
    let labels = labels.map(|(at, label)| match label {
        Label::ProbablyBackground => open(at),
        other => other,
    });
    let share = initial.rect.map_or(SHARE, |_| SHARE_OF_RECT);
    Ok((labels.collect(), share))
}

/// Whether a pixel is within `share` of the shorter side from the border, at least one pixel.
fn ring(size: (u32, u32), share: f64) -> impl Fn(usize) -> bool {
    let (width, height) = (size.0 as usize, size.1 as usize);
    let depth = ((width.min(height) as f64 * share).round() as usize).max(1);
    move |at| {
        let (x, y) = (at % width, at / width);
        x < depth || y < depth || x + depth >= width || y + depth >= height
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_outline_of_a_dark_object_lasts_and_the_edge_of_a_shadow_passes_by() {
        let mut turn = TurnFrames::new(80, 60);
        for frame in 0..32 {
            turn.push(&RgbImage::from_fn(80, 60, |x, y| {
                let light = if x < 2 * frame + 8 { 40 } else { 60 };
                let level = if y < 30 { light - 8 } else { light };
                image::Rgb([level; 3])
            }));
        }
        let field = TurnStatistics::new(&turn).field;
        let all = Bitmap::new((80, 60), std::iter::repeat_n(true, 80 * 60));
        let outline = field.outline(&all.map(|at, _| at / 80 < 30));
        let shadow = field.outline(&all.map(|at, _| at % 80 < 40));
        assert!(outline > 0.9 && shadow < 0.3, "{outline} {shadow}");
    }

    #[test]
    fn the_expected_overlap_is_that_of_the_odds_and_of_what_is_sure() {
        let mut turn = TurnFrames::new(80, 60);
        (0..4).for_each(|_| turn.push(&RgbImage::new(80, 60)));
        let mut statistics = TurnStatistics::new(&turn);
        let odds = (0..80 * 60).map(|at| if at % 80 < 40 { 2.0 } else { -2.0 });
        statistics.field.object_odds = odds.collect();
        let all = Bitmap::new((80, 60), std::iter::repeat_n(true, 80 * 60));
        let (left, none) = (all.map(|at, _| at % 80 < 40), all.map(|_, _| false));
        let probability = 1.0 / (1.0 + (-2.0_f32).exp());
        let expected = probability / (2.0 - probability);
        let found = statistics.expected_overlap(&left, &none);
        assert!((found - expected).abs() < 1e-3, "{found} {expected}");
        assert!(statistics.expected_overlap(&left.inverted(), &none) < 0.1);
        assert!((statistics.expected_overlap(&left, &all) - 1.0).abs() < 1e-6);
    }
}
