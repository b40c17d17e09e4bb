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
use crate::light::{Light, LightInput};
use crate::networks::turn_networks;

/// The results of a turn by name, and its warnings.
#[pyfunction]
pub(crate) fn solve_turn<'py>(
    py: Python<'py>,
    shard: PathBuf,
    rotation: Option<String>,
    elevation: Option<f64>,
    light: Option<LightInput<'py>>,
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
    let light = light.map(|light| light.owned()).transpose()?;
    let (turn, warnings) = unlocked(py, || {
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
        let turn = Turn {
            name: solved.turn.name.clone(),
            normals: Array::from_planes(surface.normals().planes()),
            albedo: Array::from_planes(solution.albedo(curves).planes()),
            shading: Array::from_planes(solution.shading(curves).planes()),
            confidence: Array::from_planes(&solution.confidence(curves)),
            expected_error: Array::from_planes(&solution.expected_errors(curves)),
            mask: Array::from_mask(&solved.turn.mask),
            light: Array::from_light(&solution.light()?),
            median_error: solution.expected_error_deg(),
            specular,
        };
        Ok((turn, solved.warnings()))
    })?;
    Ok((turn.into_python(py)?, warnings))
}

struct Turn {
    name: String,
    normals: Array<f32>,
    albedo: Array<f32>,
    shading: Array<f32>,
    confidence: Array<f32>,
    expected_error: Array<f32>,
    mask: Array<bool>,
    light: Array<f64>,
    median_error: f64,
    specular: Option<(Array<f32>, Array<f32>)>,
}

impl Turn {
    fn into_python(self, py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let fields = PyDict::new(py);
        fields.set_item("name", self.name)?;
        fields.set_item("normals", self.normals.into_python(py)?)?;
        fields.set_item("albedo", self.albedo.into_python(py)?)?;
        fields.set_item("shading", self.shading.into_python(py)?)?;
        fields.set_item("confidence", self.confidence.into_python(py)?)?;
        fields.set_item("expected_error", self.expected_error.into_python(py)?)?;
        fields.set_item("mask", self.mask.into_python(py)?)?;
        fields.set_item("light", self.light.into_python(py)?)?;
        fields.set_item("expected_error_deg", self.median_error)?;
        let specular = match self.specular {
            Some((reflectance, smoothness)) => {
                Some((reflectance.into_python(py)?, smoothness.into_python(py)?))
            }
            None => None,
        };
        fields.set_item("specular", specular)?;
        Ok(fields)
    }
}
