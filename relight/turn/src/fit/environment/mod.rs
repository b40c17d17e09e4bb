//! The environment light that fits the curves of pixels of known normals and albedo best.

use relight_core::image::Planes;
use relight_core::light::{NormalEquations, Order, ShLight};
use relight_core::render::Surface;

use crate::error::TurnError;
use crate::fit::curve_statistics::CurveStatistics;
use crate::model::frame::TableFrame;
use crate::model::harmonics::HarmonicTerm;
use crate::model::lighting::{LAMBERTIAN_TERMS, TERMS, TableLight, terms_along};
use crate::model::material::MaterialKind;
use crate::model::shading::ShadingModel;
use crate::observe::curves::TurnCurves;

/// Ridge of the light's terms, relative to the normal equations. Numerical: light that the normals hardly show
/// stays small.
const RIDGE: f64 = 1e-5;

/// The light that fits the curves of a known surface without gloss best: of a ball whose albedo is known, say, or of an
/// object with its truth. Pixels without a normal do not count. It is in the viewer's frame at the table's angle 0; bands
/// beyond the second are those that metal shows.
///
/// # Errors
/// If a map has another size, or no light fits the curves.
pub fn fit_turn_light(
    curves: &TurnCurves,
    surface: &Surface,
    material: MaterialKind,
    frame: &TableFrame,
) -> Result<ShLight, TurnError> {
    if surface.extent() != curves.extent() {
        let [found, expected] = [surface.extent(), curves.extent()]
            .map(|size| format!("{} x {}", size.width, size.height));
        return Err(TurnError::Refused(format!(
            "the surface has {found} pixels, and the frames {expected}"
        )));
    }
    let (normals, albedo) = (surface.normals().planes(), surface.albedo().planes());
    let width = curves.extent().width;
    let (mut statistics, mut known, mut colours) = (Vec::new(), Vec::new(), Vec::new());
    for (pixel, &place) in curves.places().iter().enumerate() {
        let at = |planes: &Planes<3>| planes.pixel(place % width, place / width).map(f64::from);
        if at(normals) != [0.0; 3] {
            statistics.push(CurveStatistics::new(curves, pixel));
            known.push(at(normals));
            colours.push(at(albedo));
        }
    }
    let statistics: Vec<&CurveStatistics> = statistics.iter().collect();
    let model = fit_model(&statistics, &known, &colours, frame, material);
    let light = model.ok_or(TurnError::NoLight)?.light()?;
    Ok(match material {
        MaterialKind::Diffuse => light.with_order(Order::TWO),
        MaterialKind::Metal => light,
    })
}

/// The shading model that fits the curves of these normals and albedos best, for an object without gloss or of metal: one
/// linear fit of the light. In an unknown light, gloss and the diffuse part can hardly be separated.
pub(crate) fn fit_model(
    statistics: &[&CurveStatistics],
    normals: &[[f64; 3]],
    albedo: &[[f64; 3]],
    frame: &TableFrame,
    material: MaterialKind,
) -> Option<ShadingModel> {
    let mut model = ShadingModel {
        frame: *frame,
        shown: TableLight::new([[0.0; TERMS]; 3]),
        material,
    };
    let normals = normals.iter();
    let terms: Vec<[HarmonicTerm; TERMS]> = normals
        .map(|&normal| terms_along(model.seen_along(normal)))
        .collect();
    let count = match material {
        MaterialKind::Diffuse => LAMBERTIAN_TERMS,
        MaterialKind::Metal => TERMS,
    };
    let mut light = [[0.0; TERMS]; 3];
    for (channel, light) in light.iter_mut().enumerate() {
        let mut equations = NormalEquations::new(count);
        // Bright pixels, whose curves stand out of the noise, count more.
        for ((statistics, terms), albedo) in statistics.iter().zip(&terms).zip(albedo) {
            let albedo = albedo[channel];
            let product = |i: usize, j: usize| {
                albedo * albedo * statistics.term_product(channel, &terms[i], &terms[j])
            };
            let right = |i: usize| [albedo * statistics.term_along(channel, &terms[i]), 0.0, 0.0];
            equations.add_sums(product, right);
        }
        equations.add_ridge(1, RIDGE);
        for (term, [value, ..]) in light.iter_mut().zip(equations.solve()?) {
            *term = value;
        }
    }
    model.shown = TableLight::new(light);
    Some(model)
}

/// The residual of the light that fits an evenly coloured Lambertian object of these normals best, over that of an even
/// light; `None` if nothing varies.
pub(crate) fn relative_residual(
    statistics: &[&CurveStatistics],
    normals: &[[f64; 3]],
    frame: &TableFrame,
) -> Option<f64> {
    let white = vec![[1.0; 3]; normals.len()];
    let model = fit_model(statistics, normals, &white, frame, MaterialKind::Diffuse)?;
    let constant = HarmonicTerm {
        coefficient: 0,
        parts: [1.0, 0.0],
    };
    let (mut rest, mut all, mut by_even) = (0.0, 0.0, 0.0);
    for channel in 0..3 {
        let (mut along, mut own) = (0.0, 0.0);
        for (statistics, &normal) in statistics.iter().zip(normals) {
            along += statistics.term_along(channel, &constant);
            own += statistics.term_product(channel, &constant, &constant);
            all += statistics.energy(channel);
            rest += statistics.residual_energy(channel, &model.harmonics(normal)[channel]);
        }
        if own > 0.0 {
            by_even += along * along / own;
        }
    }
    let varying = all - by_even;
    (varying > 1e-9 * all).then(|| rest / varying)
}

#[cfg(test)]
mod tests;
