//! Light, gloss, normals and albedo at once: Gauss and Newton's steps for the room, in which every pixel follows.
//!
//! To fit the room and the pixels in turns takes many rounds, for each is held by the other. A step here takes from what the
//! room's unknowns do to a curve that part which the pixel's own normal and albedo could do as well (Schur's complement of
//! their equations); what is left tells of the room alone.

use rayon::prelude::*;

use super::body::BodyKind;
use super::gloss::{GLOSS_TERMS, GlossLight, gloss_terms, mirror_terms};
use super::light::{MATT_BANDS, MATT_IN_GLOSS, TERMS, WAVES, WaveTerm, wave_terms};
use super::moments::Moments;
use super::room::{KnownLight, Shares, band, shares};
use super::search::{Expected, PixelFit, Room, Search, Slope, reflected, tangents};
use super::solve::{cost, search_all};
use super::{TableFrame, TableLight};
use relight_core::light::NormalEquations;

/// The damping at first, and where it ends.
const DAMPING: f64 = 1e-3;
const MOST_DAMPING: f64 = 1e3;
/// The steps end where one improves the cost by less than this part of it.
const SETTLED: f64 = 2e-3;
/// The most that gloss shows of a band, over what a smooth dielectric shows of it: light by a dark grey ball is in small units.
const MOST_SHARE: f64 = 20.0;
/// The most that metal shows of a band, over the first.
const MOST_METAL_SHARE: f64 = 1.2;
/// The least share of the first band by which those of metal are divided.
const LEAST_FIRST_SHARE: f64 = 0.05;
/// Pixels added up by one task.
const CHUNK: usize = 128;
/// How much a pixel counts falls to a quarter where it leaves this many times the median of what pixels leave.
const OUTLIER: f64 = 4.0;
/// The least residual that is taken for the median.
const LEAST_MEDIAN: f64 = 1e-3;

/// What of a room is to be found.
#[derive(Debug, Clone, Copy)]
pub(super) enum Unknowns<'a> {
    /// How much gloss shows of the bands of a light that is known.
    Gloss(&'a KnownLight),
    /// Light, and gloss that shows so many bands of it; 0 for a matt object.
    Light {
        /// Those from the fourth on are free, the others are shares of the light.
        bands: usize,
    },
    /// How much metal shows of the bands of a light that is known.
    Mirror(&'a KnownLight),
    /// What metal shows of an unknown light: all terms are free.
    Reflection,
}

/// Pixels whose room is to be found.
#[derive(Debug, Clone, Copy)]
pub(super) struct Joint<'a> {
    pub(super) moments: &'a [Moments],
    pub(super) expected: Option<&'a [Expected]>,
    pub(super) unknowns: Unknowns<'a>,
}

impl Joint<'_> {
    /// What is left in the end, and the room: its normals are looked for anywhere, then all is refined, and so on.
    pub(super) fn found(&self, start: Room, rounds: usize, steps: usize) -> (f64, Room) {
        let mut room = start;
        let mut left = f64::INFINITY;
        for _ in 0..rounds {
            let fits = search_all(&room, self.moments, self.expected, None);
            let (found, fits) = self.refined(room, fits, steps);
            let reached = cost(&fits, self.expected);
            if reached < left {
                (room, left) = (found, reached);
            }
        }
        (left, room)
    }

    /// Room and pixels after at most so many steps from these.
    pub(super) fn refined(
        &self,
        room: Room,
        fits: Vec<PixelFit>,
        steps: usize,
    ) -> (Room, Vec<PixelFit>) {
        let (mut guess, mut fits) = (Guess::of(&room, self.unknowns), fits);
        let (frame, mut damping) = (room.frame, DAMPING);
        let mut least = cost(&fits, self.expected);
        for _ in 0..steps {
            let room = guess.room(&frame, self.unknowns);
            let Some(step) = self.step(&guess, &room, &fits, damping) else {
                break;
            };
            let other = guess.moved(&step, self.unknowns);
            let room = other.room(&frame, self.unknowns);
            let found = search_all(&room, self.moments, self.expected, Some(&fits));
            let reached = cost(&found, self.expected);
            if reached < least {
                let gain = (least - reached) / least;
                (guess, fits, least) = (other, found, reached);
                damping *= 0.2;
                if gain < SETTLED {
                    break;
                }
            } else {
                damping *= 10.0;
                if damping > MOST_DAMPING {
                    break;
                }
            }
        }
        (guess.room(&frame, self.unknowns), fits)
    }

    /// How the unknowns should change.
    fn step(
        &self,
        guess: &Guess,
        room: &Room,
        fits: &[PixelFit],
        damping: f64,
    ) -> Option<Vec<f64>> {
        let weights = weights(fits);
        let columns = Columns {
            guess,
            bands: self.unknowns.bands(guess)?,
            layout: self.unknowns.layout(),
            room,
        };
        let search = Search::new(room);
        let sums = (0..fits.len().div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| {
                let mut sums = Sums::new(columns.layout.count());
                let pixels = chunk * CHUNK..((chunk + 1) * CHUNK).min(fits.len());
                for pixel in pixels.filter(|&pixel| !self.moments[pixel].is_dark()) {
                    let expected = self.expected.map(|all| all[pixel]);
                    let one = (&self.moments[pixel], expected, fits[pixel].normal);
                    sums.add_pixel(&search, &columns, one, weights[pixel]);
                }
                sums
            })
            .reduce(|| Sums::new(columns.layout.count()), Sums::plus);
        sums.solve(damping)
    }
}

/// How much the energy that is left of each pixel's curve counts, so that bright pixels, which stand out of the noise, count
/// more: less where the model does not explain it.
fn weights(fits: &[PixelFit]) -> Vec<f64> {
    let median = super::solve::median(fits.iter().map(|fit| fit.residual)).max(LEAST_MEDIAN);
    let weight = |fit: &PixelFit| {
        let size = fit.residual / (OUTLIER * median);
        1.0 / (1.0 + size).powi(2)
    };
    fits.iter().map(weight).collect()
}

/// A room by its unknowns.
#[derive(Debug, Clone, PartialEq)]
struct Guess {
    light: TableLight,
    shares: Vec<f64>,
    /// Bands of the gloss that a matt surface does not show, in an unknown light.
    higher: GlossLight,
}

impl Guess {
    fn of(room: &Room, unknowns: Unknowns<'_>) -> Self {
        let shares = match unknowns {
            Unknowns::Gloss(known) | Unknowns::Mirror(known) => {
                let share = |band| room.gloss.share_of(band);
                unknowns.known_bands(known).iter().map(share).collect()
            }
            Unknowns::Light { bands } => shares(room)[..bands.min(MATT_BANDS)].to_vec(),
            Unknowns::Reflection => Vec::new(),
        };
        let layout = unknowns.layout();
        Self {
            light: room.light,
            shares,
            higher: room.gloss.beyond(layout.first.isqrt()),
        }
    }

    fn room(&self, frame: &TableFrame, unknowns: Unknowns<'_>) -> Room {
        let mut parts = unknowns.bands(self).unwrap_or_default();
        let mut factors = self.shares.clone();
        if unknowns.layout().higher > 0 {
            parts.truncate(factors.len());
            parts.push(self.higher);
            factors.push(1.0);
        }
        let gloss = GlossLight::sum(&parts, &factors);
        let light = match unknowns {
            Unknowns::Reflection => TableLight::of_mirror(&gloss).unwrap_or(self.light),
            _ => self.light,
        };
        Room {
            frame: *frame,
            light,
            gloss,
            body: unknowns.body(),
        }
    }

    fn moved(&self, step: &[f64], unknowns: Unknowns<'_>) -> Self {
        let layout = unknowns.layout();
        let mut terms = *self.light.terms();
        let mut higher = self.higher;
        for (channel, terms) in terms.iter_mut().enumerate() {
            let own = &step[layout.of_channel(channel)..][..layout.light + layout.higher];
            let (light, rest) = own.split_at(layout.light);
            terms
                .iter_mut()
                .zip(light)
                .for_each(|(term, by)| *term += by);
            for (at, by) in rest.iter().enumerate() {
                higher = higher.moved(channel, layout.first + at, *by);
            }
        }
        let by = &step[layout.of_channel(3)..];
        let shares = self.shares.iter().zip(by);
        let mut shares: Vec<f64> = shares
            .map(|(share, by)| (share + by).clamp(0.0, MOST_SHARE))
            .collect();
        if let (Unknowns::Mirror(_), Some(&first)) = (unknowns, shares.first()) {
            // Of an even light metal shows its albedo's part, whatever its lobe is.
            let first = first.max(LEAST_FIRST_SHARE);
            for share in &mut shares {
                *share = (*share / first).min(MOST_METAL_SHARE);
            }
        }
        Self {
            light: TableLight::new(terms),
            shares,
            higher,
        }
    }

    /// The shares of the bands of a light, which a matt surface shows too.
    fn matt_shares(&self) -> Shares {
        [0, 1, 2].map(|l| self.shares.get(l).copied().unwrap_or(0.0))
    }
}

impl Unknowns<'_> {
    /// What the object is taken for.
    const fn body(&self) -> BodyKind {
        match self {
            Self::Gloss(_) | Self::Light { .. } => BodyKind::Diffuse,
            Self::Mirror(_) | Self::Reflection => BodyKind::Metal,
        }
    }

    /// What the object would show of each band of a light if it blurred nothing.
    fn known_bands<'a>(&self, known: &'a KnownLight) -> &'a [GlossLight] {
        match self.body() {
            BodyKind::Diffuse => known.bands(),
            BodyKind::Metal => known.mirror(),
        }
    }

    /// The same of each band of the light that the object has shares of.
    fn bands(&self, guess: &Guess) -> Option<Vec<GlossLight>> {
        match self {
            Self::Gloss(known) | Self::Mirror(known) => Some(self.known_bands(known).to_vec()),
            Self::Light { .. } => Some(GlossLight::bands(&guess.light.coefficients().ok()?)),
            Self::Reflection => Some(Vec::new()),
        }
    }

    fn layout(&self) -> Layout {
        match *self {
            Self::Gloss(known) | Self::Mirror(known) => Layout {
                light: 0,
                first: TERMS,
                higher: 0,
                shares: known.bands().len(),
            },
            Self::Light { bands } => Layout {
                light: TERMS,
                first: TERMS,
                higher: (bands * bands).clamp(TERMS, GLOSS_TERMS) - TERMS,
                shares: bands.min(MATT_BANDS),
            },
            Self::Reflection => Layout {
                light: 0,
                first: 0,
                higher: GLOSS_TERMS,
                shares: 0,
            },
        }
    }
}

/// Where the unknowns stand: of each channel terms of the light and of the higher bands of its gloss, then the shares.
#[derive(Debug, Clone, Copy)]
struct Layout {
    light: usize,
    /// The first term of the gloss that is free, and how many are.
    first: usize,
    higher: usize,
    shares: usize,
}

impl Layout {
    const fn of_channel(&self, channel: usize) -> usize {
        channel * (self.light + self.higher)
    }

    const fn count(&self) -> usize {
        self.of_channel(3) + self.shares
    }
}

/// What each unknown does to the curve of a pixel.
struct Columns<'a> {
    guess: &'a Guess,
    bands: Vec<GlossLight>,
    layout: Layout,
    room: &'a Room,
}

impl Columns<'_> {
    /// The unknowns that act on a channel of a pixel, and its waves for each.
    fn of(&self, normal: [f64; 3], albedo: [f64; 3]) -> [Vec<(usize, [f64; WAVES])>; 3] {
        let frame = &self.room.frame;
        let matt = wave_terms(frame.to_table(normal));
        let reflected = frame.to_table(reflected(normal));
        // What gloss shows does not depend on the albedo, and what metal shows is times it.
        let (gloss, colour) = match self.room.body {
            BodyKind::Diffuse => (gloss_terms(normal[2], reflected), [1.0; 3]),
            BodyKind::Metal => (mirror_terms(reflected), albedo),
        };
        let matt_shares = self.guess.matt_shares();
        let bands: Vec<_> = self.bands[..self.layout.shares]
            .iter()
            .map(|band| band.waves_of(&gloss))
            .collect();
        [0, 1, 2].map(|channel| {
            let first = self.layout.of_channel(channel);
            let mut columns = Vec::with_capacity(self.layout.count());
            let light = matt.iter().zip(MATT_IN_GLOSS).take(self.layout.light);
            for (term, (at, factor)) in light {
                let share = matt_shares[band(at)] / factor;
                let mut waves = spread(term, albedo[channel]);
                add(&mut waves, &spread(&gloss[at], share));
                columns.push((first + columns.len(), waves));
            }
            for term in &gloss[self.layout.first..][..self.layout.higher] {
                columns.push((first + columns.len(), spread(term, colour[channel])));
            }
            let shares = self.layout.of_channel(3);
            let bands = bands.iter().enumerate();
            columns.extend(bands.map(|(l, waves)| {
                (
                    shares + l,
                    waves[channel].map(|wave| colour[channel] * wave),
                )
            }));
            columns
        })
    }
}

/// A term times a factor, among all waves.
fn spread(term: &WaveTerm, factor: f64) -> [f64; WAVES] {
    let mut waves = [0.0; WAVES];
    for (wave, part) in waves[term.wave..].iter_mut().zip(term.parts) {
        *wave = factor * part;
    }
    waves
}

fn add(waves: &mut [f64; WAVES], others: &[f64; WAVES]) {
    waves.iter_mut().zip(others).for_each(|(a, b)| *a += b);
}

fn dot(a: &[f64; WAVES], b: &[f64; WAVES]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The normal equations of the unknowns, without what the pixels do by themselves.
struct Sums {
    count: usize,
    /// The lower triangle, row by row, in a square.
    matrix: Vec<f64>,
    right: Vec<f64>,
}

impl Sums {
    fn new(count: usize) -> Self {
        Self {
            count,
            matrix: vec![0.0; count * count],
            right: vec![0.0; count],
        }
    }

    fn plus(mut self, other: Self) -> Self {
        let all = self.matrix.iter_mut().chain(&mut self.right);
        all.zip(other.matrix.into_iter().chain(other.right))
            .for_each(|(sum, value)| *sum += value);
        self
    }

    fn add_pixel(
        &mut self,
        search: &Search<'_>,
        columns: &Columns<'_>,
        (moments, expected, normal): (&Moments, Option<Expected>, [f64; 3]),
        weight: f64,
    ) {
        let axes = tangents(normal);
        let leaning = search.leaning(moments, normal, axes);
        let mut slope = Slope::default();
        let mut couplings = vec![[0.0; 2]; self.count];
        let all = columns.of(normal, leaning.albedo);
        for (channel, mut columns) in all.into_iter().enumerate() {
            let (body, ways) = (&leaning.body[channel], &leaning.ways[channel]);
            slope.add(moments, channel, ways, &leaning.seen[channel]);
            let along = moments.times(channel, body);
            let own = dot(body, &along);
            let rest = moments.rest(channel, &leaning.seen[channel]);
            if own > 1e-12 && leaning.albedo[channel] > 0.0 {
                // The albedo follows.
                for (_, waves) in &mut columns {
                    let share = dot(waves, &along) / own;
                    waves
                        .iter_mut()
                        .zip(body)
                        .for_each(|(wave, body)| *wave -= share * body);
                }
            }
            for (k, (at, waves)) in columns.iter().enumerate() {
                let image = moments.times(channel, waves);
                self.right[*at] += weight * dot(waves, &rest);
                for (coupling, way) in couplings[*at].iter_mut().zip(ways) {
                    *coupling += dot(way, &image);
                }
                for (other, waves) in &columns[..=k] {
                    self.matrix[at * self.count + other] += weight * dot(waves, &image);
                }
            }
        }
        slope.scale(moments.unit());
        couplings
            .iter_mut()
            .flatten()
            .for_each(|value| *value *= moments.unit());
        if let Some(expected) = expected {
            slope.lean(expected, normal, axes);
        }
        self.take_out(&slope, &couplings, weight / moments.unit());
    }

    /// Takes out what the normal could do as well.
    fn take_out(&mut self, slope: &Slope, couplings: &[[f64; 2]], weight: f64) {
        let [uu, uv, vv] = slope.bend;
        let more = 1e-6 * (uu + vv) + 1e-12;
        let (uu, vv) = (uu + more, vv + more);
        let determinant = uu * vv - uv * uv;
        let inverse = |[a, b]: [f64; 2]| {
            [
                weight * (vv * a - uv * b) / determinant,
                weight * (uu * b - uv * a) / determinant,
            ]
        };
        // The slope is half the gradient: a step goes against it.
        let by_slope = inverse(slope.gradient);
        for (i, row) in couplings.iter().enumerate() {
            let by_row = inverse(*row);
            self.right[i] += row[0] * by_slope[0] + row[1] * by_slope[1];
            for (j, other) in couplings[..=i].iter().enumerate() {
                self.matrix[i * self.count + j] -= by_row[0] * other[0] + by_row[1] * other[1];
            }
        }
    }

    /// The unknowns' change; each is held by this part of what holds it already.
    fn solve(self, damping: f64) -> Option<Vec<f64>> {
        let Self {
            count,
            matrix,
            right,
        } = self;
        // In units of what holds each: they are of very different sizes.
        let largest = (0..count)
            .map(|i| matrix[i * count + i])
            .fold(0.0, f64::max);
        let least = 1e-12 * largest + f64::MIN_POSITIVE;
        let units: Vec<f64> = (0..count)
            .map(|i| matrix[i * count + i].max(least).sqrt())
            .collect();
        let mut equations = NormalEquations::new(count);
        let product = |i: usize, j: usize| {
            let more = if i == j { damping } else { 0.0 };
            matrix[i * count + j] / (units[i] * units[j]) + more
        };
        equations.add_sums(product, |i| [right[i] / units[i], 0.0, 0.0]);
        let solution = equations.solve()?;
        let pairs = solution.into_iter().zip(units);
        Some(pairs.map(|([value, ..], unit)| value / unit).collect())
    }
}
