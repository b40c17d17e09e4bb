//! Pictures of colours, with the encoding of their numbers.

use std::path::Path;

use relit_data::still::Colour;

use super::{ColourSpace, ImageError, Linear, Planes, Rgb, Samples, Srgb, StoredImage, Transfer};

/// A picture of colours: its numbers as stored, and their encoding.
///
/// ```
/// use std::path::Path;
/// use relight_core::image::{ColourImage, Depth, Extent, Planes, encode_png};
///
/// let path = Path::new("grey.png");
/// let grey = Planes::filled(Extent::new(2, 2), [0.5; 3]);
/// let file = encode_png(path, &grey, Depth::Eight).unwrap();
/// let light = ColourImage::from_bytes(path, &file, None).unwrap().into_light();
/// assert!((light.planes().pixel(0, 0)[0] - 0.216).abs() < 1e-3);
/// ```
#[derive(Debug, Clone)]
pub struct ColourImage {
    stored: StoredImage,
    colour: Colour,
}

impl ColourImage {
    /// Decodes the content of a file. The encoding of integers is `transfer`, or else that of the file: a colour profile or a
    /// statement of another kind; by default sRGB. Floating point values are light, in the primaries that the
    /// file states. Errors name it as `path`.
    ///
    /// # Errors
    /// If it is not an image of a known format, is too large or cut off, or its colours cannot be converted.
    pub fn from_bytes(
        path: &Path,
        bytes: &[u8],
        transfer: Option<Transfer>,
    ) -> Result<Self, ImageError> {
        let stored = StoredImage::from_bytes(path, bytes)?;
        let transfer = transfer.filter(|_| stored.samples == Samples::Integer);
        let colour = colour_of(path, bytes, transfer)?;
        Ok(Self { stored, colour })
    }

    /// A picture in memory. Its integers are encoded as `transfer` says; floating point values are light in Rec. 709.
    pub const fn new(stored: StoredImage, transfer: Transfer) -> Self {
        let colour = match stored.samples {
            Samples::Integer => of_transfer(transfer),
            Samples::Float => Colour::LINEAR,
        };
        Self { stored, colour }
    }

    /// The numbers and alpha as they are stored.
    pub const fn stored(&self) -> &StoredImage {
        &self.stored
    }

    /// The light.
    pub fn into_light(self) -> Rgb<Linear> {
        let Self { stored, colour } = self;
        in_light(stored.planes, &colour, stored.samples)
    }

    /// The light, while the picture is kept.
    pub fn to_light(&self) -> Rgb<Linear> {
        in_light(
            self.stored.planes.clone(),
            &self.colour,
            self.stored.samples,
        )
    }

    /// The values for a screen, in sRGB; floating point may exceed 1.
    pub fn to_srgb(&self) -> Rgb<Srgb> {
        if self.colour.is_srgb() {
            return Rgb::new(self.stored.planes.clone());
        }
        self.to_light().encode()
    }

    /// The light of a neutral pixel that is stored as `level`. Where values are floating point, of one that a screen shows
    /// with that level.
    pub fn light_at(&self, level: f32) -> f32 {
        if self.stored.samples == Samples::Float {
            return Srgb::to_linear(level);
        }
        let [mut red, mut green, mut blue] = [[level]; 3];
        self.colour.to_light([&mut red, &mut green, &mut blue]);
        red[0].min(green[0]).min(blue[0])
    }
}

fn in_light(mut planes: Planes<3>, colour: &Colour, samples: Samples) -> Rgb<Linear> {
    match samples {
        Samples::Integer => colour.to_light(planes.planes_mut()),
        Samples::Float => colour.to_open_light(planes.planes_mut()),
    }
    Rgb::new(planes)
}

/// The encoding of a file's numbers: `transfer`, or else that of the file.
pub(super) fn colour_of(
    path: &Path,
    bytes: &[u8],
    transfer: Option<Transfer>,
) -> Result<Colour, ImageError> {
    match transfer {
        Some(transfer) => Ok(of_transfer(transfer)),
        None => Colour::from_file(bytes).map_err(|fault| ImageError::Colour {
            path: path.to_owned(),
            fault,
        }),
    }
}

const fn of_transfer(transfer: Transfer) -> Colour {
    match transfer {
        Transfer::Linear => Colour::LINEAR,
        Transfer::Srgb => Colour::SRGB,
        Transfer::Gamma22 => Colour::GAMMA22,
    }
}
