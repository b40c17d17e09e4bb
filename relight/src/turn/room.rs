//! The light of the room, matt and as gloss shows it, that explains the curves of all pixels best.

use std::ops::Range;

use super::gloss::{GLOSS_TERMS, GlossLight, gloss_terms};
use super::light::{MATT_BANDS, MATT_IN_GLOSS, TERMS, WAVES, WaveTerm, wave_terms};
use super::moments::Moments;
use super::search::{Room, reflected};
use super::{TableFrame, TableLight, TurnCurves, TurnError};
use crate::image::Planes;
use crate::light::{NormalEquations, ShLight};
use crate::render::Surface;

/// Rounds of albedo and light in turn.
const ROUNDS: usize = 3;
/// Keeps light that the normals hardly tell small.
const STIFFNESS: f64 = 1e-5;
/// The same for gloss, in parts of the matt light.
const GLOSS_STIFFNESS: f64 = 1e-4;
/// The least part of the light that counts as shown by gloss.
const LEAST_GLOSS: f64 = 0.05;

/// How much gloss shows of the bands of a light that a matt surface shows too.
pub(super) type Shares = [f64; MATT_BANDS];

/// What is to be found of a room.
#[derive(Debug, Clone, Copy)]
pub(super) enum RoomFit<'a> {
    /// Light, and gloss that shows so many bands of it, 0 for a matt object, and the first of them by these shares.
    All { bands: usize, shares: Shares },
    /// How much gloss shows of the bands of a light that is known.
    Gloss(&'a KnownLight),
}

/// A light that was measured.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct KnownLight {
    pub(super) matt: TableLight,
    bands: Vec<GlossLight>,
}

impl KnownLight {
    pub(super) fn new(light: &ShLight, frame: &TableFrame) -> Self {
        Self {
            matt: TableLight::from_viewer(light, frame),
            bands: GlossLight::bands(&light.rotated(&frame.rotation())),
        }
    }
}

/// The light that explains the curves of a known surface best: of a ball whose albedo is known, say, or of an object
/// with its truth. Pixels without a normal do not count. It is in the viewer's frame at the table's angle 0. Bands beyond the
/// second, which a matt surface does not show, are those that gloss shows, where there is any: as if it blurred them no
/// more than band 2.
///
/// # Errors
/// Where a map has another size, or no light explains the curves.
pub fn fit_turn_light(
    curves: &TurnCurves,
    surface: &Surface,
    frame: &TableFrame,
) -> Result<ShLight, TurnError> {
    if surface.extent() != curves.extent() {
        return Err(TurnError::PriorSize {
            found: surface.extent(),
            expected: curves.extent(),
        });
    }
    let (normals, albedo) = (surface.normals().planes(), surface.albedo().planes());
    let width = curves.extent().width;
    let (mut moments, mut known, mut colours) = (Vec::new(), Vec::new(), Vec::new());
    for (pixel, &place) in curves.places().iter().enumerate() {
        let at = |planes: &Planes<3>| planes.pixel(place % width, place / width).map(f64::from);
        if at(normals) != [0.0; 3] {
            moments.push(Moments::new(curves, pixel, None));
            known.push(at(normals));
            colours.push(at(albedo));
        }
    }
    let pixels = pixels(&moments, &known, frame);
    let (light, gloss) = fit_light(&pixels, &colours, Tie::Free).ok_or(TurnError::NoLight)?;
    let light = with_higher_bands(light.coefficients()?, &gloss)?;
    Ok(light.rotated(&frame.rotation().inverse()))
}

/// A light of order 2 with the higher bands that gloss shows of it.
fn with_higher_bands(light: ShLight, gloss: &GlossLight) -> Result<ShLight, TurnError> {
    let shown = gloss.light()?;
    let second = GlossLight::bands(&light).split_off(2);
    let factor = gloss.share_of(&second[0]);
    if factor <= LEAST_GLOSS {
        return Ok(light);
    }
    let mut coefficients = light.coefficients().to_vec();
    let higher = shown.coefficients().iter().skip(coefficients.len());
    coefficients.extend(higher.map(|values| values.map(|value| value / factor)));
    Ok(ShLight::new(coefficients)?)
}

/// The room that explains the curves best on these normals, in turns with the albedo, which is brought along.
pub(super) fn fit_room(
    moments: &[Moments],
    normals: &[[f64; 3]],
    albedo: &mut [[f64; 3]],
    frame: &TableFrame,
    fit: RoomFit<'_>,
) -> Option<Room> {
    let pixels = pixels(moments, normals, frame);
    let mut found = None;
    for _ in 0..ROUNDS {
        let (light, gloss) = match fit {
            RoomFit::All { bands, shares } => {
                let tie = if bands == 0 {
                    Tie::Matt
                } else {
                    Tie::Shares(shares, bands)
                };
                fit_light(&pixels, albedo, tie)?
            }
            RoomFit::Gloss(known) => (known.matt, fit_gloss(&pixels, albedo, known)?),
        };
        let room = Room {
            frame: *frame,
            light,
            gloss,
        };
        for ((moments, &normal), albedo) in moments.iter().zip(normals).zip(albedo.iter_mut()) {
            *albedo = moments.albedo(&room.waves(normal));
        }
        found = Some(room);
    }
    found
}

/// A pixel with what each term of the room contributes to it, for an albedo of 1.
struct LitPixel<'a> {
    moments: &'a Moments,
    matt: [WaveTerm; TERMS],
    gloss: [WaveTerm; GLOSS_TERMS],
}

fn pixels<'a>(
    moments: &'a [Moments],
    normals: &[[f64; 3]],
    frame: &TableFrame,
) -> Vec<LitPixel<'a>> {
    let pixel = |(moments, &normal): (&'a Moments, &[f64; 3])| LitPixel {
        moments,
        matt: wave_terms(frame.to_table(normal)),
        gloss: gloss_terms(normal[2], frame.to_table(reflected(normal))),
    };
    moments.iter().zip(normals).map(pixel).collect()
}

/// What gloss has to do with the matt light.
#[derive(Debug, Clone, Copy)]
enum Tie {
    /// There is no gloss.
    Matt,
    /// It shows these shares of the light's first bands, and any light in those from there to so many.
    Shares(Shares, usize),
    /// It shows any light.
    Free,
}

/// Light and gloss by least squares, for pixels of known albedo.
fn fit_light(
    pixels: &[LitPixel<'_>],
    albedo: &[[f64; 3]],
    tie: Tie,
) -> Option<(TableLight, GlossLight)> {
    let (shares, free) = match tie {
        Tie::Matt => ([0.0; MATT_BANDS], 0..0),
        Tie::Shares(shares, bands) => (shares, TERMS..(bands * bands).max(TERMS)),
        Tie::Free => ([0.0; MATT_BANDS], 0..GLOSS_TERMS),
    };
    let mut light = [[0.0; TERMS]; 3];
    let mut gloss = [[0.0; GLOSS_TERMS]; 3];
    for channel in 0..3 {
        let mut equations = NormalEquations::new(TERMS + free.len());
        for (pixel, albedo) in pixels.iter().zip(albedo) {
            let terms = pixel.terms(albedo[channel], &shares, free.clone());
            pixel.add(&mut equations, channel, &terms);
        }
        equations.add_ridge(1, STIFFNESS);
        equations.add_ridge(TERMS, GLOSS_STIFFNESS);
        let found = equations.solve()?;
        let all = light[channel]
            .iter_mut()
            .chain(&mut gloss[channel][free.clone()]);
        for (term, [value, ..]) in all.zip(found) {
            *term = value;
        }
        for (light, (at, factor)) in light[channel].into_iter().zip(MATT_IN_GLOSS) {
            gloss[channel][at] += shares[band(at)] * light / factor;
        }
    }
    Some((TableLight::new(light), GlossLight::new(gloss)))
}

/// The band of a term of gloss.
const fn band(at: usize) -> usize {
    at.isqrt()
}

/// How much gloss shows of the first bands of a light that was found, by the light of its other bands and these pixels.
pub(super) fn next_shares(
    room: &Room,
    (moments, normals, albedo): (&[Moments], &[[f64; 3]], &[[f64; 3]]),
) -> Shares {
    let pixels = pixels(moments, normals, &room.frame);
    let Ok(light) = room.light.coefficients() else {
        return Shares::default();
    };
    let known = KnownLight {
        matt: room.light,
        bands: GlossLight::bands(&light)
            .into_iter()
            .chain([room.gloss.beyond(MATT_BANDS)])
            .collect(),
    };
    let gloss = fit_gloss(&pixels, albedo, &known);
    let found = gloss.map(|gloss| shares(&Room { gloss, ..*room }));
    found.unwrap_or_default().map(|share| share.max(0.0))
}

/// How much gloss shows of the first bands of a light that was found.
pub(super) fn shares(room: &Room) -> Shares {
    let Ok(light) = room.light.coefficients() else {
        return [0.0; MATT_BANDS];
    };
    let mut bands = GlossLight::bands(&light).into_iter();
    [0; MATT_BANDS].map(|_| bands.next().map_or(0.0, |band| room.gloss.share_of(&band)))
}

/// How much gloss shows of each band of a known light, by least squares, for pixels of known albedo.
fn fit_gloss(
    pixels: &[LitPixel<'_>],
    albedo: &[[f64; 3]],
    known: &KnownLight,
) -> Option<GlossLight> {
    let mut equations = NormalEquations::new(known.bands.len());
    for (pixel, albedo) in pixels.iter().zip(albedo) {
        let bands: Vec<_> = known
            .bands
            .iter()
            .map(|band| band.waves_of(&pixel.gloss))
            .collect();
        for channel in 0..3 {
            let matt = pixel.matt_waves(known.matt.terms()[channel], albedo[channel]);
            let moments = pixel.moments;
            let product = |i: usize, j: usize| {
                moments.product(channel, &bands[i][channel], &bands[j][channel])
            };
            let right = |i: usize| {
                let band = &bands[i][channel];
                [
                    moments.along(channel, band) - moments.product(channel, &matt, band),
                    0.0,
                    0.0,
                ]
            };
            equations.add_sums(product, right);
        }
    }
    equations.add_ridge(0, GLOSS_STIFFNESS);
    let factors: Vec<f64> = equations
        .solve()?
        .iter()
        .map(|[factor, ..]| *factor)
        .collect();
    Some(GlossLight::sum(&known.bands, &factors))
}

impl LitPixel<'_> {
    /// What each term of the light contributes where gloss shows shares of it, and what those terms of the gloss do that
    /// are free.
    fn terms(&self, albedo: f64, shares: &Shares, free: Range<usize>) -> Vec<WaveTerm> {
        let tied = self
            .matt
            .iter()
            .zip(MATT_IN_GLOSS)
            .map(|(matt, (at, factor))| {
                let share = shares[band(at)] / factor;
                let gloss = self.gloss[at].parts;
                WaveTerm {
                    wave: matt.wave,
                    parts: [0, 1].map(|i| albedo * matt.parts[i] + share * gloss[i]),
                }
            });
        tied.chain(self.gloss[free].iter().copied()).collect()
    }

    /// Adds what the pixel says of a channel's light and gloss; bright pixels, whose curves stand out of the noise,
    /// count more.
    fn add(&self, equations: &mut NormalEquations, channel: usize, terms: &[WaveTerm]) {
        let product = |i: usize, j: usize| self.moments.term_product(channel, &terms[i], &terms[j]);
        let right = |i: usize| [self.moments.term_along(channel, &terms[i]), 0.0, 0.0];
        equations.add_sums(product, right);
    }

    /// The waves of its matt part in a channel.
    fn matt_waves(&self, light: [f64; TERMS], albedo: f64) -> [f64; WAVES] {
        let mut waves = [0.0; WAVES];
        for (light, term) in light.into_iter().zip(&self.matt) {
            for (wave, part) in waves[term.wave..].iter_mut().zip(term.parts) {
                *wave += albedo * light * part;
            }
        }
        waves
    }
}
