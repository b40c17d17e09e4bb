//! Light that Python gives: coefficients, a panorama, a file, a lamp.

use std::path::PathBuf;

use numpy::{PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use relight_core::image::Extent;
use relight_core::light::{Order, Panorama, ShLight};
use relight_photo::relighting::{DiscLamp, LightSource};

use crate::arrays::Picture;
use crate::failure::Failure;

/// Light from the package: a lamp's `AZIMUTH,ELEVATION[,COLOUR][,SIZE]` and the ambient light, coefficients, a panorama, or a
/// file. Arrays are copied, as Python may change them meanwhile.
pub(crate) enum Light {
    Source(LightSource),
    File(PathBuf),
    Panorama(Picture),
}

impl<'py> FromPyObject<'_, 'py> for Light {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if let Ok((text, ambient)) = given.extract::<(String, f64)>() {
            let lamp: DiscLamp = text
                .parse()
                .map_err(|fault| PyValueError::new_err(format!("lamp: {fault}")))?;
            return Ok(Self::Source(LightSource::Lamp(DiscLamp {
                ambient,
                ..lamp
            })));
        }
        if let Ok(array) = given.extract() {
            let light = ShLight::new(coefficients(&array)?);
            let light = light.map_err(|error| PyValueError::new_err(error.to_string()))?;
            return Ok(Self::Source(LightSource::Coefficients(light)));
        }
        Ok(match given.extract()? {
            Picture::File(path) => Self::File(path),
            picture => Self::Panorama(picture),
        })
    }
}

fn coefficients(array: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<[f64; 3]>> {
    let values = array.as_slice()?;
    match array.shape() {
        [_, 3] => Ok(values.as_chunks().0.to_vec()),
        shape => Err(PyValueError::new_err(format!(
            "the light has the shape {shape:?}: give rows of red, green and blue, or a panorama of rows, columns and 3 channels"
        ))),
    }
}

impl Light {
    /// The light, read where it is a file.
    pub(crate) fn source(self) -> Result<LightSource, Failure> {
        match self {
            Self::Source(source) => Ok(source),
            Self::File(path) => Ok(LightSource::read(&path)?),
            Self::Panorama(picture) => {
                let image = picture.colours(None)?.into_light();
                let Extent { width, height } = image.planes().extent();
                if width != 2 * height {
                    return Err(Failure::value(format!(
                        "the panorama has {width} x {height} pixels: it has to be twice as wide as high"
                    )));
                }
                Ok(LightSource::Panorama(Panorama::new(image)?))
            }
        }
    }

    /// Its coefficients; a panorama is brought to this order.
    pub(crate) fn coefficients(self, order: Order) -> Result<ShLight, Failure> {
        Ok(match self.source()? {
            LightSource::Panorama(panorama) => panorama.project(order),
            LightSource::Coefficients(light) => light,
            LightSource::Lamp(lamp) => lamp.light(order),
        })
    }
}
