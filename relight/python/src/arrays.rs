//! Pictures from Python, as paths or arrays, and arrays for it.

use std::fs;
use std::path::{Path, PathBuf};

use image::{DynamicImage, ImageBuffer, Pixel, Rgb, Rgba};
use numpy::{
    Element, PyArray, PyArrayDyn, PyArrayMethods, PyReadonlyArray3, PyUntypedArrayMethods,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use relight_core::image::{ColourImage, Extent, ImageError, Planes, StoredImage, Transfer};
use relight_core::light::ShLight;

use crate::failure::{Failure, choice};

/// How errors name a picture that is an array.
const ARRAY: &str = "array";

/// A picture from the package: a path, or a contiguous array of rows, columns and 3 or 4 channels, copied, as Python may change
/// it meanwhile.
pub(crate) enum Picture {
    File(PathBuf),
    Memory(DynamicImage),
}

impl<'py> FromPyObject<'_, 'py> for Picture {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(path) = given.extract() {
            return Ok(Self::File(path));
        }
        let image = if let Ok(array) = given.extract() {
            copied::<u8>(&array, DynamicImage::ImageRgb8, DynamicImage::ImageRgba8)
        } else if let Ok(array) = given.extract() {
            copied::<u16>(&array, DynamicImage::ImageRgb16, DynamicImage::ImageRgba16)
        } else {
            let array = given.extract()?;
            copied::<f32>(
                &array,
                DynamicImage::ImageRgb32F,
                DynamicImage::ImageRgba32F,
            )
        };
        image.map(Self::Memory)
    }
}

fn copied<T: Element + Copy>(
    array: &PyReadonlyArray3<'_, T>,
    rgb: fn(ImageBuffer<Rgb<T>, Vec<T>>) -> DynamicImage,
    rgba: fn(ImageBuffer<Rgba<T>, Vec<T>>) -> DynamicImage,
) -> PyResult<DynamicImage>
where
    Rgb<T>: Pixel<Subpixel = T>,
    Rgba<T>: Pixel<Subpixel = T>,
{
    let wrong = || PyValueError::new_err("an image has rows, columns and 3 or 4 channels");
    let &[rows, columns, channels] = array.shape() else {
        return Err(wrong());
    };
    let side = |pixels: usize| u32::try_from(pixels).map_err(|_| wrong());
    let (width, height) = (side(columns)?, side(rows)?);
    let values = array.as_slice()?.to_vec();
    let image = match channels {
        3 => ImageBuffer::from_raw(width, height, values).map(rgb),
        4 => ImageBuffer::from_raw(width, height, values).map(rgba),
        _ => None,
    };
    image.ok_or_else(wrong)
}

impl Picture {
    /// How errors name it.
    pub(crate) fn path(&self) -> &Path {
        match self {
            Self::File(path) => path,
            Self::Memory(_) => Path::new(ARRAY),
        }
    }

    /// The numbers as they are stored.
    pub(crate) fn stored(self) -> Result<StoredImage, Failure> {
        Ok(match self {
            Self::File(path) => StoredImage::read(&path)?,
            Self::Memory(image) => StoredImage::from_image(image)?,
        })
    }

    /// The colours; `transfer` is the encoding of integers, in place of what the file states.
    pub(crate) fn colours(self, transfer: Option<Transfer>) -> Result<ColourImage, Failure> {
        Ok(match self {
            Self::File(path) => ColourImage::from_bytes(&path, &read(&path)?, transfer)?,
            Self::Memory(image) => {
                let stored = StoredImage::from_image(image)?;
                ColourImage::new(stored, transfer.unwrap_or(Transfer::Srgb))
            }
        })
    }
}

/// The content of a file.
pub(crate) fn read(path: &Path) -> Result<Vec<u8>, ImageError> {
    fs::read(path).map_err(ImageError::open(path))
}

/// How integers are encoded, by its name.
pub(crate) fn transfer(name: Option<&str>) -> PyResult<Option<Transfer>> {
    let choices = [
        ("srgb", Transfer::Srgb),
        ("gamma22", Transfer::Gamma22),
        ("linear", Transfer::Linear),
    ];
    name.map(|name| choice("transfer", name, &choices))
        .transpose()
}

/// Values for an array of Python.
pub(crate) struct Array<T> {
    shape: Vec<usize>,
    values: Vec<T>,
}

impl Array<f32> {
    /// Rows, columns and channels; a single channel has no dimension of its own.
    pub(crate) fn from_planes<const C: usize>(planes: &Planes<C>) -> Self {
        let Extent { width, height } = planes.extent();
        let mut values = vec![0.0; C * width * height];
        for (channel, plane) in planes.planes().into_iter().enumerate() {
            let pixels = values.iter_mut().skip(channel).step_by(C);
            pixels.zip(plane).for_each(|(to, &from)| *to = from);
        }
        let mut shape = vec![height, width];
        if C > 1 {
            shape.push(C);
        }
        Self { shape, values }
    }
}

impl Array<f64> {
    /// One row a coefficient.
    pub(crate) fn from_light(light: &ShLight) -> Self {
        let coefficients = light.coefficients();
        Self {
            shape: vec![coefficients.len(), 3],
            values: coefficients.iter().flatten().copied().collect(),
        }
    }
}

impl Array<bool> {
    /// Rows and columns of a mask.
    pub(crate) fn from_mask(mask: &Planes<1>) -> Self {
        let Extent { width, height } = mask.extent();
        Self {
            shape: vec![height, width],
            values: mask.plane(0).iter().map(|&value| value >= 0.5).collect(),
        }
    }
}

impl<T: Element> Array<T> {
    /// Values in this shape.
    pub(crate) fn new(shape: Vec<usize>, values: Vec<T>) -> Self {
        Self { shape, values }
    }

    /// Hands the values over.
    pub(crate) fn into_python(self, py: Python<'_>) -> PyResult<Bound<'_, PyArrayDyn<T>>> {
        PyArray::from_vec(py, self.values).reshape(self.shape)
    }
}

/// The planes of an array of rows, columns and three channels, or of rows and columns alone.
pub(crate) fn to_planes<const C: usize>(
    shape: &[usize],
    values: &[f32],
) -> Result<Planes<C>, ImageError> {
    let extent = match *shape {
        [height, width, ..] => Extent::new(width, height),
        _ => Extent::new(0, 0),
    };
    let plane = |channel| values.iter().skip(channel).step_by(C).copied().collect();
    Planes::from_planes(extent, std::array::from_fn(plane))
}
