//! The captured object in memory.

use super::manifest::check_size;
use crate::image::{Extent, ImageError, Planes, check_extent};
use crate::render::Surface;

/// An object that can be lit.
///
/// ```
/// use relight_core::captured_object::CapturedObject;
/// use relight_core::image::{Planes, Rgb};
/// use relight_core::light::Normals;
/// use relight_core::render::Surface;
///
/// let normals = Normals::sphere(9);
/// let extent = normals.extent();
/// let albedo = Rgb::new(Planes::filled(extent, [0.5, 0.4, 0.3]));
/// let full = Planes::filled(extent, [1.0]);
/// let ball = CapturedObject::new("ball", Surface::new(normals, albedo, None)?, full.clone(), full)?;
/// let back = CapturedObject::from_bytes(&ball.to_bytes()?)?;
/// assert_eq!(back.name(), "ball");
/// assert!((back.surface().albedo().planes().pixel(4, 4)[1] - 0.4).abs() < 1e-4);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct CapturedObject {
    name: String,
    surface: Surface,
    alpha: Planes<1>,
    confidence: Planes<1>,
}

impl CapturedObject {
    /// The largest file that is read, bytes.
    pub const MAX_BYTES: u64 = 1 << 29;
    /// What the file is called in a folder of results.
    pub const FILE: &'static str = "object.relit";

    /// An object of these maps. Coverage and confidence are brought to 0 to 1, what is not a number to 0.
    ///
    /// # Errors
    /// If they differ in size, or are too large for a file.
    pub fn new(
        name: impl Into<String>,
        surface: Surface,
        alpha: Planes<1>,
        confidence: Planes<1>,
    ) -> Result<Self, ImageError> {
        let extent = surface.extent();
        check_size(extent)?;
        for (what, map) in [
            ("map of coverage", &alpha),
            ("map of confidence", &confidence),
        ] {
            check_extent(what, map.extent(), extent)?;
        }
        let part = |value: f32| if value > 0.0 { value.min(1.0) } else { 0.0 };
        Ok(Self {
            name: name.into(),
            surface,
            alpha: alpha.map(part),
            confidence: confidence.map(part),
        })
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Normals, albedo and gloss.
    pub const fn surface(&self) -> &Surface {
        &self.surface
    }

    /// The part of each pixel that the object covers, 0 to 1. Colours are not multiplied with it.
    pub const fn alpha(&self) -> &Planes<1> {
        &self.alpha
    }

    /// How confident each normal is, 0 to 1.
    pub const fn confidence(&self) -> &Planes<1> {
        &self.confidence
    }

    /// Width and height.
    pub const fn extent(&self) -> Extent {
        self.surface.extent()
    }
}
