//! An object and its maps back in its photograph, or before another background.

use relight_core::image::{Extent, Linear, Planes, Rgb};

use super::RelightableObject;

impl RelightableObject {
    /// The photograph with these colours of the object in place of its own: its soft edge keeps the background that it has, and
    /// what stands out beyond that, as fur does, changes with it.
    ///
    /// # Panics
    /// Where the photograph or the colours have another size.
    pub fn in_place(&self, photo: &Rgb<Linear>, colours: &Planes<3>) -> Rgb<Linear> {
        let mut picture = self.blended(photo.clone(), recoloured, colours);
        if let Some(fringe) = &self.fringe {
            let part = || photo.planes().cut(self.place, self.extent());
            let gains = fringe.gains(part, &self.matte.alpha, &self.matte.foreground, colours);
            let [left, top] = self.place;
            let width = self.photo.width;
            let planes = picture.planes_mut().planes_mut();
            for (plane, gains) in planes.into_iter().zip(gains.planes()) {
                for (y, gains) in gains.chunks(self.extent().width).enumerate() {
                    let line = &mut plane[(top + y) * width + left..];
                    line.iter_mut()
                        .zip(gains)
                        .for_each(|(value, gain)| *value *= gain);
                }
            }
        }
        picture
    }

    /// A background of the photograph's size with the object before it, at its place and in these colours.
    ///
    /// # Panics
    /// Where the background or the colours have another size.
    pub fn before(&self, background: &Rgb<Linear>, colours: &Planes<3>) -> Rgb<Linear> {
        self.blended(
            background.clone(),
            |alpha, old, _, new| old + alpha * (new - old),
            colours,
        )
    }

    fn check_size(&self, picture: &Rgb<Linear>) {
        let found = picture.planes().extent();
        assert_eq!(found, self.photo, "size of the picture");
    }

    fn blended(
        &self,
        mut picture: Rgb<Linear>,
        blend: impl Fn(f32, f32, f32, f32) -> f32,
        colours: &Planes<3>,
    ) -> Rgb<Linear> {
        self.check_size(&picture);
        let Extent { width, height } = self.extent();
        assert_eq!(colours.extent(), self.extent(), "size of the colours");
        let alpha = self.matte.alpha.plane(0);
        let [left, top] = self.place;
        let planes = picture.planes_mut().planes_mut();
        for (channel, plane) in planes.into_iter().enumerate() {
            let (own, new) = (self.matte.foreground.plane(channel), colours.plane(channel));
            for y in 0..height {
                let line = &mut plane[(top + y) * self.photo.width + left..][..width];
                for (x, value) in line.iter_mut().enumerate() {
                    let at = y * width + x;
                    if alpha[at] > 0.0 {
                        *value = blend(alpha[at], *value, own[at], new[at]);
                    }
                }
            }
        }
        picture
    }
}

/// A pixel of the photograph after the object, which covers the part `alpha` of it, gets the colour `new` in place of `own`. No
/// more changes than the pixel holds: where the object's colour is overestimated, the pixel would turn black.
fn recoloured(alpha: f32, old: f32, own: f32, new: f32) -> f32 {
    let part = alpha * own;
    let held = if part > old { old / part } else { 1.0 };
    (old + held * alpha * (new - own)).max(0.0)
}
