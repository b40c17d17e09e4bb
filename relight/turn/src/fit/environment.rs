//! The environment light, diffuse and as gloss shows it, that fits the curves of all pixels best.

use relight_core::image::Planes;
use relight_core::light::{NormalEquations, ShLight};
use relight_core::render::Surface;

use crate::error::TurnError;
use crate::fit::curve_statistics::CurveStatistics;
use crate::model::directions::reflected;
use crate::model::frame::TableFrame;
use crate::model::gloss::{GLOSS_TERMS, GlossLight, MIRROR, gloss_terms, mirror_terms};
use crate::model::harmonics::HarmonicTerm;
use crate::model::lighting::{TERMS, TableLight, lambertian_terms};
use crate::model::material::MaterialKind;
use crate::model::shading::ShadingModel;
use crate::observe::curves::TurnCurves;

/// Ridge of the light's terms, relative to the normal equations. Numerical: light that the normals hardly show
/// stays small.
const RIDGE: f64 = 1e-5;
/// The same of the terms of gloss, in parts of the diffuse light. Numerical.
const GLOSS_RIDGE: f64 = 1e-4;
/// Residual up to which a known surface has no gloss, over the curves' energy. By hand.
const LAMBERTIAN_RESIDUAL: f64 = 1e-3;
/// Least part of band 2 that gloss shows if its higher bands are to tell of the light. By hand.
const LEAST_GLOSS: f64 = 0.01;

/// The light that fits the curves of a known surface best: of a ball whose albedo is known, say, or of an object with
/// its truth. Pixels without a normal do not count. It is in the viewer's frame at the table's angle 0. Bands beyond
/// the second, which a Lambertian surface hardly shows, are those that gloss shows, where there is any: as if it
/// blurred them no more than band 2.
///
/// # Errors
/// Where a map has another size, or no light fits the curves.
pub fn fit_turn_light(
    curves: &TurnCurves,
    surface: &Surface,
    material: MaterialKind,
    frame: &TableFrame,
) -> Result<ShLight, TurnError> {
    if surface.extent() != curves.extent() {
        let [found, expected] = [surface.extent(), curves.extent()]
            .map(|size| format!("{} x {}", size.width, size.height));
        return Err(TurnError::Frames(format!(
            "the surface has {found} pixels, and the frames {expected}"
        )));
    }
    let (normals, albedo) = (surface.normals().planes(), surface.albedo().planes());
    let width = curves.extent().width;
    let (mut statistics, mut known, mut colours) = (Vec::new(), Vec::new(), Vec::new());
    for (pixel, &place) in curves.places().iter().enumerate() {
        let at = |planes: &Planes<3>| planes.pixel(place % width, place / width).map(f64::from);
        if at(normals) != [0.0; 3] {
            statistics.push(CurveStatistics::new(curves, pixel, None));
            known.push(at(normals));
            colours.push(at(albedo));
        }
    }
    if material == MaterialKind::Metal {
        let model = fit_reflection(&statistics, &known, &colours, frame);
        let light = model
            .ok_or(TurnError::NoLight)?
            .gloss
            .times([1.0 / MIRROR; 3])
            .light()?;
        return Ok(light.rotated(&frame.rotation().inverse()));
    }
    let pixels = pixels(&statistics, &known, frame);
    let (diffuse, none) =
        fit_light(&pixels, &colours, Finish::Lambertian).ok_or(TurnError::NoLight)?;
    let light = if residual(&pixels, &colours, (&diffuse, &none)) < LAMBERTIAN_RESIDUAL {
        diffuse.coefficients()?
    } else {
        let (light, gloss) =
            fit_light(&pixels, &colours, Finish::Glossy).ok_or(TurnError::NoLight)?;
        with_higher_bands(light.coefficients()?, &gloss)?
    };
    Ok(light.rotated(&frame.rotation().inverse()))
}

/// A light of order 2 with the higher bands that gloss shows of it.
fn with_higher_bands(light: ShLight, gloss: &GlossLight) -> Result<ShLight, TurnError> {
    let shown = gloss.light()?;
    let second = GlossLight::bands(&light).split_off(2);
    let factor = gloss.attenuation_of(&second[0]);
    if factor <= LEAST_GLOSS {
        return Ok(light);
    }
    let mut coefficients = light.coefficients().to_vec();
    let higher = shown.coefficients().iter().skip(coefficients.len());
    coefficients.extend(higher.map(|values| values.map(|value| value / factor)));
    Ok(ShLight::new(coefficients)?)
}

/// The shading model that fits the curves of these normals and albedos best, for a diffuse object without gloss: one linear
/// fit of the light. What gloss shows of a light that is not known can hardly be told from what the diffuse part shows.
pub(crate) fn fit_model(
    statistics: &[CurveStatistics],
    normals: &[[f64; 3]],
    albedo: &[[f64; 3]],
    frame: &TableFrame,
    material: MaterialKind,
) -> Option<ShadingModel> {
    if material == MaterialKind::Metal {
        return fit_reflection(statistics, normals, albedo, frame);
    }
    let pixels = pixels(statistics, normals, frame);
    let (light, gloss) = fit_light(&pixels, albedo, Finish::Lambertian)?;
    Some(ShadingModel {
        frame: *frame,
        light,
        diffuse_beyond: GlossLight::NONE,
        gloss,
        material,
    })
}

/// The same of metal.
fn fit_reflection(
    statistics: &[CurveStatistics],
    normals: &[[f64; 3]],
    albedo: &[[f64; 3]],
    frame: &TableFrame,
) -> Option<ShadingModel> {
    let mut shown = [[0.0; GLOSS_TERMS]; 3];
    for (channel, shown) in shown.iter_mut().enumerate() {
        let mut equations = NormalEquations::new(GLOSS_TERMS);
        for ((statistics, &normal), albedo) in statistics.iter().zip(normals).zip(albedo) {
            let mut terms = mirror_terms(frame.to_table(reflected(normal)));
            for part in terms.iter_mut().flat_map(|term| &mut term.parts) {
                *part *= albedo[channel];
            }
            add(&mut equations, (statistics, channel), &terms);
        }
        equations.add_ridge(1, RIDGE);
        for (term, [value, ..]) in shown.iter_mut().zip(equations.solve()?) {
            *term = value;
        }
    }
    let gloss = GlossLight::new(shown);
    Some(ShadingModel {
        frame: *frame,
        light: TableLight::of_mirror(&gloss).ok()?,
        diffuse_beyond: GlossLight::NONE,
        gloss,
        material: MaterialKind::Metal,
    })
}

/// A pixel with what each term of the environment contributes to it, for an albedo of 1.
struct LitPixel<'a> {
    statistics: &'a CurveStatistics,
    diffuse: [HarmonicTerm; TERMS],
    gloss: [HarmonicTerm; GLOSS_TERMS],
}

fn pixels<'a>(
    statistics: impl IntoIterator<Item = &'a CurveStatistics>,
    normals: &[[f64; 3]],
    frame: &TableFrame,
) -> Vec<LitPixel<'a>> {
    let pixel = |(statistics, &normal): (&'a CurveStatistics, &[f64; 3])| LitPixel {
        statistics,
        diffuse: lambertian_terms(frame.to_table(normal)),
        gloss: gloss_terms(normal[2], frame.to_table(reflected(normal))),
    };
    statistics.into_iter().zip(normals).map(pixel).collect()
}

/// The residual of the light that fits an evenly coloured Lambertian object of these normals best, over that of an even
/// light; none where nothing varies.
pub(crate) fn relative_residual<'a>(
    statistics: impl IntoIterator<Item = &'a CurveStatistics>,
    normals: &[[f64; 3]],
    frame: &TableFrame,
) -> Option<f64> {
    let pixels = pixels(statistics, normals, frame);
    let white = vec![[1.0; 3]; pixels.len()];
    let (light, gloss) = fit_light(&pixels, &white, Finish::Lambertian)?;
    let constant = HarmonicTerm {
        coefficient: 0,
        parts: [1.0, 0.0],
    };
    let (mut by_even, mut all) = (0.0, 0.0);
    for channel in 0..3 {
        let (mut along, mut own) = (0.0, 0.0);
        for pixel in &pixels {
            along += pixel.statistics.term_along(channel, &constant);
            own += pixel.statistics.term_product(channel, &constant, &constant);
            all += pixel.statistics.energy(channel);
        }
        if own > 0.0 {
            by_even += along * along / own;
        }
    }
    let varying = all - by_even;
    (varying > 1e-9 * all).then(|| residual(&pixels, &white, (&light, &gloss)) * all / varying)
}

/// What a surface is taken for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Finish {
    /// It has no gloss.
    Lambertian,
    /// Its gloss shows any light.
    Glossy,
}

/// Light and gloss by least squares, for pixels of known albedo.
fn fit_light(
    pixels: &[LitPixel<'_>],
    albedo: &[[f64; 3]],
    finish: Finish,
) -> Option<(TableLight, GlossLight)> {
    let free = match finish {
        Finish::Lambertian => 0,
        Finish::Glossy => GLOSS_TERMS,
    };
    let mut light = [[0.0; TERMS]; 3];
    let mut gloss = [[0.0; GLOSS_TERMS]; 3];
    for channel in 0..3 {
        let mut equations = NormalEquations::new(TERMS + free);
        for (pixel, albedo) in pixels.iter().zip(albedo) {
            let diffuse = pixel.diffuse.iter().map(|term| HarmonicTerm {
                coefficient: term.coefficient,
                parts: term.parts.map(|part| albedo[channel] * part),
            });
            let terms: Vec<HarmonicTerm> =
                diffuse.chain(pixel.gloss[..free].iter().copied()).collect();
            add(&mut equations, (pixel.statistics, channel), &terms);
        }
        equations.add_ridge(1, RIDGE);
        equations.add_ridge(TERMS, GLOSS_RIDGE);
        let found = equations.solve()?;
        let all = light[channel].iter_mut().chain(&mut gloss[channel]);
        for (term, [value, ..]) in all.zip(found) {
            *term = value;
        }
    }
    Some((TableLight::new(light), GlossLight::new(gloss)))
}

/// What a light and its gloss leave of the curves, over their energy.
fn residual(
    pixels: &[LitPixel<'_>],
    albedo: &[[f64; 3]],
    (light, gloss): (&TableLight, &GlossLight),
) -> f64 {
    let (mut rest, mut all) = (0.0, 0.0);
    for (pixel, albedo) in pixels.iter().zip(albedo) {
        let mut harmonics = gloss.harmonics_of(&pixel.gloss);
        for channel in 0..3 {
            for (light, term) in light.terms()[channel].iter().zip(&pixel.diffuse) {
                let wanted = harmonics[channel][term.coefficient..]
                    .iter_mut()
                    .zip(term.parts);
                wanted
                    .for_each(|(coefficient, part)| *coefficient += albedo[channel] * light * part);
            }
            rest += pixel
                .statistics
                .residual_energy(channel, &harmonics[channel]);
            all += pixel.statistics.energy(channel);
        }
    }
    rest / f64::max(all, f64::MIN_POSITIVE)
}

/// Adds what a pixel says of a channel's light and gloss; bright pixels, whose curves stand out of the noise, count
/// more.
fn add(
    equations: &mut NormalEquations,
    (statistics, channel): (&CurveStatistics, usize),
    terms: &[HarmonicTerm],
) {
    let product = |i: usize, j: usize| statistics.term_product(channel, &terms[i], &terms[j]);
    let right = |i: usize| [statistics.term_along(channel, &terms[i]), 0.0, 0.0];
    equations.add_sums(product, right);
}

#[cfg(test)]
mod tests;
