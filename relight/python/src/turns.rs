//! Whole turns: normals, albedo and light.

use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use relight_core::light::Order;
use relight_turn::{
    Elevation, MaterialKind, TurnLight, TurnOptions, read_given_light, solve_turn as solve,
};
use relit_data::rig::RotationDirection;

use crate::arrays::Array;
use crate::failure::{choice, unlocked};
use crate::light::Light;
use crate::networks::turn_networks;

/// The results of a turn by name, and its warnings.
#[pyfunction]
pub(crate) fn solve_turn<'py>(
    py: Python<'py>,
    shard: PathBuf,
    rotation: Option<String>,
    elevation: Option<f64>,
    light: Option<Light>,
    material: &str,
) -> PyResult<(Bound<'py, PyDict>, Vec<String>)> {
    let directions = [
        ("counter-clockwise", RotationDirection::CounterClockwise),
        ("clockwise", RotationDirection::Clockwise),
    ];
    let rotation = rotation.map(|name| choice("rotation", &name, &directions));
    let rotation = rotation.transpose()?;
    let materials = [
        ("diffuse", MaterialKind::Diffuse),
        ("metal", MaterialKind::Metal),
    ];
    let material = choice("material", material, &materials)?;
    let (arrays, solved) = unlocked(py, || {
        let light = match light {
            None => TurnLight::Unknown,
            Some(Light::File(path)) => TurnLight::Given(read_given_light(&path)?),
            Some(light) => TurnLight::Given(light.coefficients(Order::GLOSS)?),
        };
        let options = TurnOptions {
            rotation,
            elevation: elevation.map(Elevation::measured).transpose()?,
            light,
            material,
        };
        let solved = solve(&shard, &options, turn_networks()?, &|_, _| {})?;
        let (curves, solution) = (&solved.turn.curves, &solved.solution);
        let surface = solution.surface(curves)?;
        let specular = surface.gloss().map(|gloss| {
            let reflectance = Array::from_planes(gloss.reflectance());
            (reflectance, Array::from_planes(gloss.smoothness()))
        });
        let layers = [
            ("normals", Array::from_planes(surface.normals().planes())),
            (
                "albedo",
                Array::from_planes(solution.albedo(curves).planes()),
            ),
            (
                "shading",
                Array::from_planes(solution.shading(curves).planes()),
            ),
            (
                "confidence",
                Array::from_planes(&solution.confidence(curves)),
            ),
            (
                "expected_error",
                Array::from_planes(&solution.expected_errors(curves)),
            ),
        ];
        let mask = Array::from_mask(&solved.turn.mask);
        let light = Array::from_light(&solution.light()?);
        Ok(((layers, mask, light, specular), solved))
    })?;
    let (layers, mask, light, specular) = arrays;
    let fields = PyDict::new(py);
    fields.set_item("name", &solved.turn.name)?;
    for (name, layer) in layers {
        fields.set_item(name, layer.into_python(py)?)?;
    }
    fields.set_item("mask", mask.into_python(py)?)?;
    fields.set_item("light", light.into_python(py)?)?;
    fields.set_item("expected_error_deg", solved.solution.expected_error_deg())?;
    let specular = specular.map(|(reflectance, smoothness)| {
        Ok::<_, PyErr>((reflectance.into_python(py)?, smoothness.into_python(py)?))
    });
    fields.set_item("specular", specular.transpose()?)?;
    Ok((fields, solved.warnings()))
}
