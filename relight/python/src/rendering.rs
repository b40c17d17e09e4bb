//! The render layers, and light as a screen takes it.

use numpy::{
    PyArrayDyn, PyReadonlyArray2, PyReadonlyArray3, PyReadonlyArrayDyn, PyUntypedArrayMethods,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use relight_core::image::{ColourSpace, Planes, Rgb, Srgb};
use relight_core::light::{Direction, Normals, Order, Rotation};
use relight_core::render::{
    DiffuseForm, EXPOSURE, Gloss, RenderSettings, SpecularForm, Surface, exposure_for,
};
use relight_photo::relighting::exposure_for_object;

use crate::arrays::{Array, to_planes};
use crate::failure::{Failure, choice, unlocked};
use crate::light::Light;

/// Reflectance and smoothness from Python.
type GlossInput<'py> = (PyReadonlyArray3<'py, f32>, PyReadonlyArray2<'py, f32>);

/// An object that is given by its maps under a light: a picture for each angle by which it has turned, degrees. Without an
/// exposure, in stops, a white diffuse surface that faces the strongest light is white; a single picture of an object that is
/// lit from behind is brighter.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "Python names them")]
pub(crate) fn render<'py>(
    py: Python<'py>,
    normals: PyReadonlyArray3<'py, f32>,
    albedo: PyReadonlyArray3<'py, f32>,
    gloss: Option<GlossInput<'py>>,
    light: Light,
    order: usize,
    turned: Vec<f64>,
    exposure: Option<f32>,
    diffuse_form: &str,
    specular_form: &str,
) -> PyResult<Vec<Bound<'py, PyArrayDyn<f32>>>> {
    let normals = planes(&normals)?;
    let albedo = planes(&albedo)?;
    let gloss = match gloss {
        None => None,
        Some((reflectance, smoothness)) => {
            let smoothness = to_planes::<1>(smoothness.shape(), smoothness.as_slice()?);
            let smoothness =
                smoothness.map_err(|error| PyValueError::new_err(error.to_string()))?;
            Some((planes(&reflectance)?, smoothness))
        }
    };
    let diffuse = [
        ("irradiance", DiffuseForm::Irradiance),
        ("released", DiffuseForm::Released),
    ];
    let diffuse = choice("diffuse_form", diffuse_form, &diffuse)?;
    let specular = [("lobe", SpecularForm::Lobe), ("power", SpecularForm::Power)];
    let specular = choice("specular_form", specular_form, &specular)?;
    let pictures = unlocked(py, || {
        check("albedo", &albedo)?;
        let gloss = match gloss {
            None => None,
            Some((reflectance, smoothness)) => {
                check("reflectance", &reflectance)?;
                check("smoothness", &smoothness)?;
                Some(Gloss::new(reflectance, smoothness)?)
            }
        };
        let surface = Surface::new(Normals::new(normals), Rgb::new(albedo), gloss)?;
        let light = light.coefficients(Order::new(order)?)?;
        let turned = turned.iter().map(|degrees| {
            let turn = Rotation::about(Direction::UP, degrees.to_radians());
            light.rotated(&turn)
        });
        let lights: Vec<_> = turned.collect();
        let exposure = match exposure {
            Some(stops) => stops.exp2() * EXPOSURE,
            None => match lights.as_slice() {
                [] => 1.0,
                [still] => exposure_for_object(still),
                // It does not change as light turns: one for all pictures.
                [first, ..] => exposure_for(first),
            },
        };
        let settings = RenderSettings {
            diffuse,
            specular,
            exposure,
        };
        let picture = |light| {
            let picture = settings.image(&surface, light)?;
            Ok::<_, Failure>(Array::from_planes(picture.planes()))
        };
        lights.iter().map(picture).collect::<Result<Vec<_>, _>>()
    })?;
    let pictures = pictures.into_iter().map(|picture| picture.into_python(py));
    pictures.collect()
}

fn planes(array: &PyReadonlyArray3<'_, f32>) -> PyResult<Planes<3>> {
    let planes = to_planes(array.shape(), array.as_slice()?);
    planes.map_err(|error| PyValueError::new_err(error.to_string()))
}

/// Checks that no value is negative or not finite.
fn check<const C: usize>(what: &str, map: &Planes<C>) -> Result<(), Failure> {
    let mut values = map.planes().into_iter().flatten();
    if values.all(|value| value.is_finite() && *value >= 0.0) {
        return Ok(());
    }
    Err(Failure::value(format!(
        "{what} has a value that is negative, infinite or not a number"
    )))
}

/// Light as 8-bit sRGB, as the program writes it into a PNG.
#[pyfunction]
pub(crate) fn to_srgb8<'py>(
    py: Python<'py>,
    light: PyReadonlyArrayDyn<'py, f32>,
) -> PyResult<Bound<'py, PyArrayDyn<u8>>> {
    let encoded = light.as_slice()?.iter().map(|&v| level(v, 255.0) as u8);
    Array::new(light.shape().to_vec(), encoded.collect()).into_python(py)
}

/// The same with 16 bits.
#[pyfunction]
pub(crate) fn to_srgb16<'py>(
    py: Python<'py>,
    light: PyReadonlyArrayDyn<'py, f32>,
) -> PyResult<Bound<'py, PyArrayDyn<u16>>> {
    let encoded = light.as_slice()?.iter().map(|&v| level(v, 65_535.0) as u16);
    Array::new(light.shape().to_vec(), encoded.collect()).into_python(py)
}

fn level(light: f32, most: f32) -> f32 {
    (Srgb::from_linear(light).clamp(0.0, 1.0) * most).round()
}
