//! A light that was measured, out of a file.

use std::path::Path;

use relight_core::light::{Order, Panorama, ShLight};
use relit_data::file_names::has_extension;

use crate::error::TurnError;

/// The light of a file: its coefficients, or a panorama (.hdr, .exr) projected to the order that gloss is
/// fitted with.
///
/// # Errors
/// If the file cannot be read.
pub fn read_given_light(path: &Path) -> Result<ShLight, TurnError> {
    if !has_extension(path, &["hdr", "exr"]) {
        return Ok(ShLight::read(path)?);
    }
    Ok(Panorama::read(path)?.project(Order::GLOSS))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::harmonics::GLOSS_ORDER;
    use relight_core::files::write_exr;
    use relight_core::image::{Extent, Planes};

    #[test]
    fn a_panorama_has_all_the_bands_that_gloss_is_fitted_with() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("light.exr");
        let picture = Planes::from_fn(Extent::new(64, 32), |x, _| {
            [1.0 + f32::from(u8::from(x < 4)); 3]
        });
        write_exr(&path, &picture).unwrap();
        let light = read_given_light(&path).unwrap();
        assert_eq!(light.order().get(), GLOSS_ORDER);
        let highest = &light.coefficients()[GLOSS_ORDER * GLOSS_ORDER..];
        assert!(highest.iter().flatten().any(|value| value.abs() > 1e-3));
    }
}
