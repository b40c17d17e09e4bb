//! A light that was given or measured, band by band.

use std::f64::consts::PI;

use relight_core::light::ShLight;
use relight_core::render::cosine_lobe;

use crate::model::frame::TableFrame;
use crate::model::gloss::{GlossLight, MIRROR};
use crate::model::lighting::{LAMBERTIAN_BANDS, TableLight};

/// A light that was measured.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct KnownLight {
    pub(crate) diffuse: TableLight,
    /// The irradiance by its bands beyond the second, as a mirror would show it.
    pub(crate) diffuse_beyond: GlossLight,
    bands: Vec<GlossLight>,
    mirror: Vec<GlossLight>,
}

impl KnownLight {
    pub(crate) fn new(light: &ShLight, frame: &TableFrame) -> Self {
        let bands = GlossLight::bands(&light.rotated(&frame.rotation()));
        let mirror: Vec<GlossLight> = bands.iter().map(|band| band.times([MIRROR; 3])).collect();
        // A mirror shows π times the light.
        let factors: Vec<f64> = (0..mirror.len())
            .map(|l| {
                if l < LAMBERTIAN_BANDS {
                    0.0
                } else {
                    cosine_lobe(l) / PI
                }
            })
            .collect();
        Self {
            diffuse: TableLight::from_viewer(light, frame),
            diffuse_beyond: GlossLight::sum(&mirror, &factors),
            mirror,
            bands,
        }
    }

    /// What metal of albedo 1 shows of each of its bands that blurs nothing: as bright as a Lambertian white surface in
    /// even light.
    pub(crate) fn mirror(&self) -> &[GlossLight] {
        &self.mirror
    }

    /// What gloss shows of each of its bands that blurs nothing.
    pub(crate) fn bands(&self) -> &[GlossLight] {
        &self.bands
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::shading::ShadingModel;
    use crate::{Elevation, MaterialKind};
    use relight_core::light::Order;

    #[test]
    fn white_metal_is_as_bright_as_a_lambertian_white_surface_in_even_light() {
        let frame = TableFrame::new(Elevation::assumed());
        let known = KnownLight::new(&ShLight::even(Order::TWO, [1.0; 3]), &frame);
        let normal = [0.48, 0.36, 0.8];
        let model = |material| ShadingModel {
            frame,
            light: known.diffuse,
            diffuse_beyond: GlossLight::NONE,
            gloss: GlossLight::sum(known.mirror(), &[1.0; 3]),
            material,
        };
        for material in [MaterialKind::Diffuse, MaterialKind::Metal] {
            let shown = model(material).harmonics(normal).base[1];
            assert!((shown[0] - PI).abs() < 1e-6, "{material:?} {shown:?}");
        }
        let back = TableLight::of_mirror(&model(MaterialKind::Metal).gloss).unwrap();
        let pairs = back
            .terms()
            .iter()
            .flatten()
            .zip(known.diffuse.terms().iter().flatten());
        assert!(pairs.into_iter().all(|(a, b)| (a - b).abs() < 1e-9));
    }
}
