//! Objects and shadows as layers over a background.

use relight_core::image::{ColourSpace, Extent, Planes, Srgb};

use super::harmonisation::noise;

/// An object as seen in a scene, ready for any background.
#[derive(Debug, Clone)]
pub struct SceneLayer {
    /// Column and row of its first pixel; it may begin outside.
    pub(crate) place: [i64; 2],
    pub(crate) alpha: Planes<1>,
    /// Times alpha.
    pub(crate) colours: Planes<3>,
    pub(crate) shadow: Option<GroundShadow>,
    /// The grain that it lacks.
    pub(crate) grain: f32,
}

/// What an object keeps from the ground.
#[derive(Debug, Clone)]
pub(crate) struct GroundShadow {
    /// Column and row of its first pixel.
    pub(crate) place: [i64; 2],
    /// The part of the light that arrives.
    pub(crate) arriving: Planes<3>,
}

impl SceneLayer {
    /// Column and row of its first pixel in the picture; it may begin outside.
    pub const fn place(&self) -> [i64; 2] {
        self.place
    }

    /// How far it covers each pixel, 0 to 1.
    pub const fn alpha(&self) -> &Planes<1> {
        &self.alpha
    }

    /// Its linear colours, times alpha.
    pub const fn colours(&self) -> &Planes<3> {
        &self.colours
    }

    /// Column and row of its shadow's first pixel, and the part of the light that arrives there, 0 to 1.
    pub fn shadow(&self) -> Option<([i64; 2], &Planes<3>)> {
        let shadow = self.shadow.as_ref()?;
        Some((shadow.place, &shadow.arriving))
    }

    /// Casts the object's shadow.
    pub(crate) fn darken(&self, picture: &mut Planes<3>) {
        let Some(shadow) = &self.shadow else { return };
        over(
            picture,
            &shadow.arriving,
            shadow.place,
            |at, value, channel| value * shadow.arriving.plane(channel)[at],
        );
    }

    /// Puts the object on a picture, with the grain of a video's `frame`.
    pub(crate) fn cover(&self, picture: &mut Planes<3>, frame: u64) {
        let alpha = self.alpha.plane(0);
        over(picture, &self.colours, self.place, |at, value, channel| {
            if alpha[at] <= 0.0 {
                return value;
            }
            let covered = value * (1.0 - alpha[at]) + self.colours.plane(channel)[at];
            if self.grain <= 0.0 {
                return covered;
            }
            let noise = self.grain * alpha[at] * noise(frame, at * 3 + channel);
            Srgb::to_linear(Srgb::from_linear(covered) + noise).max(0.0)
        });
    }
}

/// Changes the pixels of a picture that lie under an image whose first pixel is at `place`; `change` takes the pixel of the
/// image, the value and the channel.
fn over(
    picture: &mut Planes<3>,
    image: &Planes<3>,
    place: [i64; 2],
    change: impl Fn(usize, f32, usize) -> f32 + Sync,
) {
    let Extent { width, height } = image.extent();
    picture.fill_rows(|y, row| {
        let Some(line) = usize::try_from(y as i64 - place[1])
            .ok()
            .filter(|&line| line < height)
        else {
            return;
        };
        for (channel, values) in row.into_iter().enumerate() {
            for (x, value) in values.iter_mut().enumerate() {
                let column = usize::try_from(x as i64 - place[0]).ok();
                if let Some(column) = column.filter(|&column| column < width) {
                    *value = change(line * width + column, *value, channel);
                }
            }
        }
    });
}
