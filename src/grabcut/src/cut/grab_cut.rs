//! GrabCut on any features: colour models of both sides and minimum cuts take turns.
//!
//! The energy is that of Rother, Kolmogorov and Blake (2004): the costs of the pixels under two Gaussian
//! mixtures, and a cost for every pair of neighbours that the cut separates, which is smaller where
//! they differ. Only a set of active pixels is decided; the others keep their labels.

use super::gmm::GaussianMixture;
use super::max_flow::{DIRECTIONS, NONE, PixelGraph};
use crate::MaskError;
use crate::bitmap::Bitmap;

/// Rounds of models and cuts, at most.
pub const ITERATIONS: u32 = 5;
/// Gaussians of each side.
const COMPONENTS: usize = 5;
/// Cost of separating two equal neighbours, in units of the log-likelihood.
pub(crate) const SMOOTHNESS: f32 = 50.0;
/// Integer capacity of one unit of cost.
const UNIT: f32 = 256.0;
/// The largest cost of a pixel, far above any sum of smoothness around it.
const MAX_COST: f32 = 4000.0;
/// Most pixels from which a model learns, and over which the contrast is averaged.
const MAX_SAMPLES: usize = 120_000;

/// The half of the directions that lead to later pixels.
pub(crate) const DIRECTIONS_AHEAD: [usize; 4] = [4, 5, 6, 7];

/// What is known of a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Label {
    Background,
    Object,
    ProbablyBackground,
    ProbablyObject,
}

impl Label {
    pub(crate) fn is_object(self) -> bool {
        matches!(self, Self::Object | Self::ProbablyObject)
    }

    pub(crate) fn is_sure(self) -> bool {
        matches!(self, Self::Object | Self::Background)
    }

    pub(crate) fn probably(object: bool) -> Self {
        if object {
            Self::ProbablyObject
        } else {
            Self::ProbablyBackground
        }
    }
}

/// The pixels that are object.
pub(crate) fn object_of(labels: &[Label], (width, height): (usize, usize)) -> Bitmap {
    let object = labels.iter().map(|label| label.is_object());
    Bitmap::new((width as u32, height as u32), object)
}

/// Makes another object of what is object; what is sure stays.
pub(crate) fn change(
    labels: &mut [Label],
    size: (usize, usize),
    how: impl FnOnce(&Bitmap) -> Bitmap,
) {
    let changed = how(&object_of(labels, size));
    for (label, &object) in labels.iter_mut().zip(changed.bits()) {
        if !label.is_sure() {
            *label = Label::probably(object);
        }
    }
}

/// The squared distance of two features.
pub(crate) fn squared_distance<const D: usize>(a: &[f32; D], b: &[f32; D]) -> f32 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

/// Pixels with features, as far as the cut needs them.
pub(crate) trait Field<const D: usize> {
    /// Variance of the features of equal surfaces.
    const VARIANCE_FLOOR: f64;

    /// Columns and rows.
    fn size(&self) -> (usize, usize);
    /// The feature of a pixel, whose units are those of the colour space L*a*b*.
    fn feature(&self, at: usize) -> [f32; D];
    /// How different two neighbours are, squared.
    fn contrast(&self, a: usize, b: usize) -> f32;
    /// What else makes a pixel more likely object (positive) or background (negative), in units of the
    /// log-likelihood.
    fn evidence(&self, _at: usize) -> f32 {
        0.0
    }
    /// Whether it is in the part from which the models learn.
    fn is_sampled(&self, _at: usize) -> bool {
        true
    }
}

/// The colour models of both sides.
#[derive(Debug, Clone)]
pub(crate) struct Models<const D: usize> {
    object: GaussianMixture<D>,
    background: GaussianMixture<D>,
}

impl<const D: usize> Models<D> {
    /// Learns both from the pixels for which `take` is true of their label.
    pub(crate) fn learn<F: Field<D>>(
        field: &F,
        labels: &[Label],
        take: impl Fn(Label) -> bool,
    ) -> Self {
        let of = |object| {
            samples(field, labels, |label| {
                take(label) && label.is_object() == object
            })
        };
        Self {
            object: GaussianMixture::learn(&of(true), COMPONENTS, F::VARIANCE_FLOOR),
            background: GaussianMixture::learn(&of(false), COMPONENTS, F::VARIANCE_FLOOR),
        }
    }

    /// Learns again from all pixels, starting from these models.
    pub(crate) fn refine<F: Field<D>>(&mut self, field: &F, labels: &[Label]) {
        self.object
            .refine(&samples(field, labels, Label::is_object));
        self.background
            .refine(&samples(field, labels, |label| !label.is_object()));
    }

    /// How much more likely a feature is object than background, as a logarithm.
    pub(crate) fn log_ratio(&self, feature: &[f32; D]) -> f32 {
        self.background.cost(feature) - self.object.cost(feature)
    }
}

/// Of the pixels that are probably object, makes the `share` that is most like the sure background, or
/// like what `also` names, probably background.
pub(crate) fn rank<const D: usize, F: Field<D>>(
    field: &F,
    labels: &mut [Label],
    share: f64,
    also: impl Fn(usize) -> bool,
) {
    let known: Vec<Label> = labels
        .iter()
        .enumerate()
        .map(|(at, &label)| match label {
            Label::ProbablyObject if also(at) => Label::Background,
            other => other,
        })
        .collect();
    let background = samples(field, &known, |label| label == Label::Background);
    let model = GaussianMixture::learn(&background, COMPONENTS, F::VARIANCE_FLOOR);
    let open = |&at: &usize| known[at] == Label::ProbablyObject;
    let mut costs: Vec<(f32, usize)> = (0..known.len())
        .filter(open)
        .map(|at| (model.cost(&field.feature(at)), at))
        .collect();
    let split = (costs.len() as f64 * share) as usize;
    if split > 0 && split < costs.len() {
        costs.select_nth_unstable_by(split, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for &(_, at) in &costs[..split] {
            labels[at] = Label::ProbablyBackground;
        }
    }
    for (label, known) in labels.iter_mut().zip(&known) {
        if *known == Label::Background && !label.is_sure() {
            *label = Label::ProbablyBackground;
        }
    }
}

/// Lets models and cuts take turns until nothing changes, at most [`ITERATIONS`] times. `smoothness` is what separating
/// two equal neighbours costs, usually [`SMOOTHNESS`].
pub(crate) fn iterate<const D: usize, F: Field<D>>(
    field: &F,
    labels: &mut [Label],
    first: Option<Models<D>>,
    smoothness: f32,
) -> Result<Models<D>, MaskError> {
    let active = open_pixels(labels);
    let scale = contrast_scale(field);
    let mut open = IncrementalCut::new(field, scale, smoothness, labels, &active);
    let mut models = match first {
        Some(models) => {
            open.decide(field, &models, labels);
            check_sides(labels)?;
            models
        }
        None => {
            check_sides(labels)?;
            Models::learn(field, labels, |_| true)
        }
    };
    for round in 0..ITERATIONS {
        if round > 0 {
            models.refine(field, labels);
        }
        let changed = open.decide(field, &models, labels);
        check_sides(labels)?;
        if changed == 0 && round > 0 {
            break;
        }
    }
    Ok(models)
}

/// The pixels that are not sure, in order.
fn open_pixels(labels: &[Label]) -> Vec<u32> {
    let open = labels.iter().enumerate();
    open.filter(|(_, label)| !label.is_sure())
        .map(|(at, _)| at as u32)
        .collect()
}

fn check_sides(labels: &[Label]) -> Result<(), MaskError> {
    if !labels.iter().any(|label| label.is_object()) {
        return Err(MaskError::Empty);
    }
    if labels.iter().all(|label| label.is_object()) {
        return Err(MaskError::Everything);
    }
    Ok(())
}

/// The factor that makes the average contrast 1/2.
pub(crate) fn contrast_scale<const D: usize, F: Field<D>>(field: &F) -> f32 {
    let (width, height) = field.size();
    let step = (width * height).div_ceil(MAX_SAMPLES).max(1);
    let (mut sum, mut count) = (0.0, 0_u32);
    for at in (0..width * height).step_by(step) {
        for direction in DIRECTIONS_AHEAD {
            if let Some(next) = neighbour(at, direction, (width, height)) {
                sum += f64::from(field.contrast(at, next));
                count += 1;
            }
        }
    }
    let mean = sum / f64::from(count.max(1));
    (0.5 / mean.max(1e-6)) as f32
}

/// Minimum cuts of the same pixels by changing models.
pub(crate) struct IncrementalCut<'a> {
    /// The pixels that are decided, in order.
    active: &'a [u32],
    graph: PixelGraph,
    /// What neighbours that are not decided make each of them cost.
    border: Vec<i32>,
    /// The costs of the last cut.
    terminals: Vec<i32>,
}

impl<'a> IncrementalCut<'a> {
    /// The graph of the `active` pixels, which are in order. Labels of the others may not change between cuts.
    pub(crate) fn new<const D: usize, F: Field<D>>(
        field: &F,
        scale: f32,
        smoothness: f32,
        labels: &[Label],
        active: &'a [u32],
    ) -> Self {
        let size = field.size();
        let mut node_of = vec![NONE; labels.len()];
        for (node, &at) in active.iter().enumerate() {
            node_of[at as usize] = node as u32;
        }
        let mut graph = PixelGraph::default();
        let mut border = vec![0; active.len()];
        for (&at, border) in active.iter().zip(&mut border) {
            let at = at as usize;
            let mut neighbours = [NONE; 8];
            let mut capacity = [0; 8];
            for direction in 0..8 {
                let Some(next) = neighbour(at, direction, size) else {
                    continue;
                };
                let cost = separation(field, scale, smoothness, at, next, direction);
                match node_of[next] {
                    NONE if labels[next].is_object() => *border += cost,
                    NONE => *border -= cost,
                    node => {
                        neighbours[direction] = node;
                        capacity[direction] = cost;
                    }
                }
            }
            graph.add(0, neighbours, capacity);
        }
        Self {
            active,
            graph,
            terminals: vec![0; border.len()],
            border,
        }
    }

    /// Decides the pixels by one minimum cut. Returns how many changed.
    pub(crate) fn decide<const D: usize, F: Field<D>>(
        &mut self,
        field: &F,
        models: &Models<D>,
        labels: &mut [Label],
    ) -> usize {
        for (node, &at) in self.active.iter().enumerate() {
            let at = at as usize;
            let ratio = models.log_ratio(&field.feature(at)) + field.evidence(at);
            let own = (ratio.clamp(-MAX_COST, MAX_COST) * UNIT) as i32;
            let terminal = own + self.border[node];
            self.graph
                .change(node as u32, terminal - self.terminals[node]);
            self.terminals[node] = terminal;
        }
        let mut changed = 0;
        for (&at, object) in self.active.iter().zip(self.graph.cut()) {
            let label = &mut labels[at as usize];
            changed += usize::from(label.is_object() != object);
            *label = Label::probably(object);
        }
        changed
    }
}

fn separation<const D: usize, F: Field<D>>(
    field: &F,
    scale: f32,
    smoothness: f32,
    at: usize,
    next: usize,
    direction: usize,
) -> i32 {
    let (dx, dy) = DIRECTIONS[direction];
    let length = if dx != 0 && dy != 0 {
        std::f32::consts::SQRT_2
    } else {
        1.0
    };
    let alike = (-scale * field.contrast(at.min(next), at.max(next))).exp();
    (smoothness / length * alike * UNIT) as i32
}

/// The neighbour of a pixel in one of [`DIRECTIONS`].
pub(crate) fn neighbour(
    at: usize,
    direction: usize,
    (width, height): (usize, usize),
) -> Option<usize> {
    let (dx, dy) = DIRECTIONS[direction];
    let x = (at % width).checked_add_signed(dx).filter(|&x| x < width)?;
    let y = (at / width)
        .checked_add_signed(dy)
        .filter(|&y| y < height)?;
    Some(y * width + x)
}

/// The features of the pixels whose label is wanted, thinned out evenly if there are too many.
fn samples<const D: usize, F: Field<D>>(
    field: &F,
    labels: &[Label],
    wanted: impl Fn(Label) -> bool,
) -> Vec<[f32; D]> {
    // A side of which nothing is in the sampled part is learned from all of it.
    let is_near = (0..labels.len()).any(|at| wanted(labels[at]) && field.is_sampled(at));
    let wanted = |&at: &usize| wanted(labels[at]) && (field.is_sampled(at) || !is_near);
    let all = (0..labels.len()).filter(wanted).count();
    let step = all.div_ceil(MAX_SAMPLES).max(1);
    let taken = (0..labels.len()).filter(wanted).step_by(step);
    taken.map(|at| field.feature(at)).collect()
}
