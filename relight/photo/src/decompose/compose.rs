//! From the network's maps to layers that give the picture back.

use super::encoding::PredictedMaps;
use relight_core::image::Planes;
use relight_core::light::Normals;

/// How much the albedo follows the network's own where there is little light: what is added to the
/// square of the shading, whose mean is 1.
const RIDGE: f64 = 0.1;

/// Layers of a picture I: I = R S + H up to the ridge. All are 0 outside the mask.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ComposedLayers {
    /// The network's normals.
    pub(super) normals: Normals,
    /// R.
    pub(super) albedo: Planes<3>,
    /// S, mean 1 under the mask of the whole picture.
    pub(super) shading: Planes<1>,
    /// H, in no channel more than the picture.
    pub(super) highlight: Planes<1>,
    /// R S.
    pub(super) diffuse: Planes<3>,
    /// Energies of I - R S - H and of I under the mask.
    pub(super) residual: ResidualSums,
}

/// Energies of what layers leave of a picture, and of the picture.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct ResidualSums {
    rest: f64,
    all: f64,
}

impl ResidualSums {
    pub(super) fn and(self, other: Self) -> Self {
        Self {
            rest: self.rest + other.rest,
            all: self.all + other.all,
        }
    }

    /// The root mean square of the rest over that of the picture; 0 for a black picture.
    pub(super) fn relative(self) -> f64 {
        if self.all > 0.0 {
            (self.rest / self.all).sqrt()
        } else {
            0.0
        }
    }
}

/// What layers need to know of the whole picture: its strips are composed one by one.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct LayerSums {
    shading: f64,
    pixels: u64,
    /// Of albedo times shading and the picture less its highlight.
    product: f64,
    /// Of albedo times shading with itself.
    square: f64,
}

impl LayerSums {
    /// The sums over a picture, or a strip of it, whose maps have a highlight that is possible.
    pub(super) fn from_maps(picture: &Planes<3>, mask: &[bool], maps: &PredictedMaps) -> Self {
        let (s, h) = (maps.shading.plane(0), maps.highlight.plane(0));
        let mut sums = Self::default();
        for at in (0..mask.len()).filter(|&at| mask[at]) {
            sums.shading += f64::from(s[at]);
            sums.pixels += 1;
        }
        for (light, albedo) in picture.planes().into_iter().zip(maps.albedo.planes()) {
            for at in (0..mask.len()).filter(|&at| mask[at]) {
                let predicted = f64::from(albedo[at]) * f64::from(s[at]);
                sums.product += predicted * f64::from(diffuse_part(light[at], h[at]));
                sums.square += predicted * predicted;
            }
        }
        sums
    }

    pub(super) fn and(self, other: Self) -> Self {
        Self {
            shading: self.shading + other.shading,
            pixels: self.pixels + other.pixels,
            product: self.product + other.product,
            square: self.square + other.square,
        }
    }

    /// By what the network's shading is multiplied, so that its mean is 1.
    fn shading_scale(&self) -> f64 {
        let mean = self.shading / self.pixels.max(1) as f64;
        if mean > 0.0 { 1.0 / mean } else { 0.0 }
    }

    /// The factor that brings albedo times that shading nearest to the picture less its highlight, by least squares.
    fn albedo_scale(&self) -> f64 {
        let scale = self.shading_scale();
        if self.square > 0.0 && scale > 0.0 {
            self.product / (self.square * scale)
        } else {
            0.0
        }
    }
}

impl ComposedLayers {
    /// The layers of a picture, or of a strip of one that has these sums. Its maps have a highlight that is possible.
    ///
    /// I_d = I - H. S is the network's shading over its mean. R = (I_d S + 0.1 R_h) / (S² + 0.1), where R_h is the
    /// network's albedo, scaled so that R_h S is nearest to I_d: the albedo is I_d / S where there is
    /// light, and the network's where there is hardly any.
    ///
    /// Everything is computed in the memory of the picture and the maps.
    pub(super) fn new(
        picture: Planes<3>,
        mask: &[bool],
        maps: PredictedMaps,
        sums: &LayerSums,
    ) -> Self {
        let (shading_scale, scale) = (sums.shading_scale() as f32, sums.albedo_scale());
        let mut shading = maps.shading;
        for (value, &inside) in shading.planes_mut()[0].iter_mut().zip(mask) {
            *value = if inside { *value * shading_scale } else { 0.0 };
        }
        let (s, h) = (shading.plane(0), maps.highlight.plane(0));
        let (mut albedo, mut diffuse) = (maps.albedo, picture);
        let mut residual = ResidualSums::default();
        let layers = albedo.planes_mut().into_iter().zip(diffuse.planes_mut());
        for (albedo, diffuse) in layers {
            for at in 0..mask.len() {
                if !mask[at] {
                    [albedo[at], diffuse[at]] = [0.0; 2];
                    continue;
                }
                let light = diffuse[at];
                let (shading, target) = (f64::from(s[at]), f64::from(diffuse_part(light, h[at])));
                let predicted = scale * f64::from(albedo[at]);
                let r = (target * shading + RIDGE * predicted) / (shading * shading + RIDGE);
                albedo[at] = r as f32;
                diffuse[at] = (r * shading) as f32;
                residual.rest += f64::from(light - diffuse[at] - h[at]).powi(2);
                residual.all += f64::from(light).powi(2);
            }
        }
        Self {
            normals: maps.normals,
            albedo,
            shading,
            highlight: maps.highlight,
            diffuse,
            residual,
        }
    }
}

/// The highlight under the mask, in no channel more than the picture.
pub(super) fn possible_highlight(
    picture: &Planes<3>,
    mask: &[bool],
    mut highlight: Planes<1>,
) -> Planes<1> {
    let [red, green, blue] = picture.planes();
    for (at, value) in highlight.planes_mut()[0].iter_mut().enumerate() {
        let least = red[at].min(green[at]).min(blue[at]);
        *value = if mask[at] {
            value.min(least).max(0.0)
        } else {
            0.0
        };
    }
    highlight
}

/// The shading over its mean under the mask.
pub(super) fn normalised(mut shading: Planes<1>, mask: &[bool]) -> Planes<1> {
    let inside = shading.plane(0).iter().zip(mask).filter(|(_, m)| **m);
    let (sum, count) = inside.fold((0.0_f64, 0_u64), |(sum, count), (&value, _)| {
        (sum + f64::from(value), count + 1)
    });
    let mean = sum / count.max(1) as f64;
    let scale = if mean > 0.0 { (1.0 / mean) as f32 } else { 0.0 };
    for (value, &inside) in shading.planes_mut()[0].iter_mut().zip(mask) {
        *value = if inside { *value * scale } else { 0.0 };
    }
    shading
}

/// Light less its highlight.
fn diffuse_part(light: f32, highlight: f32) -> f32 {
    (light - highlight).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight_core::image::Extent;
    use relight_core::light::Normals;

    const EXTENT: Extent = Extent::new(16, 12);

    /// A picture that is exactly albedo times shading and a highlight, and those.
    fn scene() -> (Planes<3>, PredictedMaps) {
        let albedo = Planes::from_fn(EXTENT, |x, _| {
            if x < 8 {
                [0.6, 0.3, 0.2]
            } else {
                [0.2, 0.5, 0.7]
            }
        });
        let shading = Planes::from_fn(EXTENT, |x, y| [0.2 + 0.1 * (x + y) as f32]);
        let highlight = Planes::from_fn(EXTENT, |x, y| [if (x, y) == (3, 3) { 0.05 } else { 0.0 }]);
        let picture = Planes::from_fn(EXTENT, |x, y| {
            let [s] = shading.pixel(x, y);
            let [h] = highlight.pixel(x, y);
            albedo.pixel(x, y).map(|a| a * s + h)
        });
        let maps = PredictedMaps {
            normals: Normals::new(Planes::filled(EXTENT, [0.0, 0.0, 1.0])),
            albedo,
            shading,
            highlight,
        };
        (picture, maps)
    }

    /// The layers of a whole picture.
    fn composed(
        picture: Planes<3>,
        mask: &[bool],
        mut maps: PredictedMaps,
        with_highlight: bool,
    ) -> ComposedLayers {
        maps.highlight = if with_highlight {
            possible_highlight(&picture, mask, maps.highlight)
        } else {
            Planes::zeros(EXTENT)
        };
        let sums = LayerSums::from_maps(&picture, mask, &maps);
        ComposedLayers::new(picture, mask, maps, &sums)
    }

    #[test]
    fn strips_with_the_sums_of_all_are_strips_of_the_whole() {
        let (picture, maps) = scene();
        let mask: Vec<bool> = (0..EXTENT.pixels()).map(|at| at % 5 != 0).collect();
        let whole = composed(picture.clone(), &mask, maps.clone(), true);
        let half = Extent::new(EXTENT.width, EXTENT.height / 2);
        fn rows<const C: usize>(of: &Planes<C>, half: Extent, first: usize) -> Planes<C> {
            Planes::from_fn(half, |x, y| of.pixel(x, first + y))
        }
        let strip = |first: usize| {
            let picture = rows(&picture, half, first);
            let mask = mask[first * half.width..][..half.pixels()].to_vec();
            let highlight = rows(&maps.highlight, half, first);
            let maps = PredictedMaps {
                normals: Normals::new(Planes::filled(half, [0.0, 0.0, 1.0])),
                albedo: rows(&maps.albedo, half, first),
                shading: rows(&maps.shading, half, first),
                highlight: possible_highlight(&picture, &mask, highlight),
            };
            (picture, mask, maps)
        };
        let strips = [0, half.height].map(strip);
        let sums = strips
            .iter()
            .map(|(p, m, maps)| LayerSums::from_maps(p, m, maps));
        let sums = sums.fold(LayerSums::default(), LayerSums::and);
        let mut residual = ResidualSums::default();
        for (number, (picture, mask, maps)) in strips.into_iter().enumerate() {
            let layers = ComposedLayers::new(picture, &mask, maps, &sums);
            let first = number * half.height;
            assert_eq!(layers.shading, rows(&whole.shading, half, first));
            assert_eq!(layers.albedo, rows(&whole.albedo, half, first));
            residual = residual.and(layers.residual);
        }
        assert!((residual.relative() - whole.residual.relative()).abs() < 1e-12);
    }

    #[test]
    fn maps_that_are_right_give_the_picture_back_and_the_shading_has_mean_one() {
        let (picture, maps) = scene();
        let mask = vec![true; EXTENT.pixels()];
        let layers = composed(picture, &mask, maps.clone(), true);
        assert!(layers.residual.relative() < 1e-6);
        let mean = layers.shading.plane(0).iter().sum::<f32>() / EXTENT.pixels() as f32;
        assert!((mean - 1.0).abs() < 1e-5);
        assert_eq!(layers.highlight, maps.highlight);
        let ratio = |x, y| layers.albedo.pixel(x, y)[0] / maps.albedo.pixel(x, y)[0];
        assert!((ratio(1, 1) / ratio(14, 9) - 1.0).abs() < 1e-5);
    }

    #[test]
    fn wrong_maps_give_the_picture_back_up_to_the_ridge() {
        let (picture, mut maps) = scene();
        maps.albedo = Planes::filled(EXTENT, [0.5; 3]);
        let mask = vec![true; EXTENT.pixels()];
        let layers = composed(picture.clone(), &mask, maps.clone(), false);
        let without = PredictedMaps {
            highlight: Planes::zeros(EXTENT),
            ..maps
        };
        let scale = LayerSums::from_maps(&picture, &mask, &without).albedo_scale() as f32;
        for at in 0..EXTENT.pixels() {
            let s = layers.shading.plane(0)[at];
            let rest = picture.plane(1)[at] - layers.diffuse.plane(1)[at];
            let ridge = 0.1 * (picture.plane(1)[at] - scale * 0.5 * s) / (s * s + 0.1);
            assert!((rest - ridge).abs() < 1e-5, "{rest} {ridge}");
        }
        assert!(layers.residual.relative() < 0.1);
    }

    #[test]
    fn a_highlight_takes_no_more_than_the_picture_has() {
        let (picture, mut maps) = scene();
        maps.highlight = Planes::filled(EXTENT, [9.0]);
        let mask: Vec<bool> = (0..EXTENT.pixels()).map(|at| at != 5).collect();
        let layers = composed(picture.clone(), &mask, maps, true);
        for at in 0..EXTENT.pixels() {
            let least = [0, 1, 2].map(|c| picture.plane(c)[at]);
            let least = least.into_iter().fold(f32::INFINITY, f32::min);
            let expected = if at == 5 { 0.0 } else { least };
            assert_eq!(layers.highlight.plane(0)[at], expected);
        }
        assert_eq!(layers.albedo.plane(2)[5], 0.0);
    }

    #[test]
    fn a_black_picture_has_black_layers() {
        let (_, maps) = scene();
        let mask = vec![true; EXTENT.pixels()];
        let black = Planes::zeros(EXTENT);
        let layers = composed(black, &mask, maps, true);
        assert!(
            layers
                .albedo
                .planes()
                .into_iter()
                .flatten()
                .all(|&v| v == 0.0)
        );
        assert_eq!(layers.residual.relative(), 0.0);
    }
}
