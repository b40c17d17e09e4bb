//! OpenEXR: which of its channels are the picture, and their primaries.

use std::io::Cursor;

use exr::meta::MetaData;
use exr::meta::attribute::{AttributeValue, Chromaticities, Text};
use exr::meta::header::Header;
use exr::prelude::{ReadChannels, ReadLayers, ReadSpecificChannel, Vec2, read};
use image::error::{DecodingError, ImageFormatHint};
use image::{DynamicImage, ImageBuffer, ImageError, ImageFormat, Rgb, Rgba};

use crate::still::colour::{Matrix, Primaries, to_rec709 as matrix_of};
use crate::still::decode::reserve;
use crate::still::{ColourError, StillError};

/// Names of layers that are the picture itself, next to those that it was made of.
const BEAUTY: [&str; 4] = ["combined", "beauty", "rgba", "main"];
/// Bytes in which the names of channels stand.
const HEAD: usize = 65_536;

/// The names of the channels that are the picture.
#[derive(Debug, Clone, PartialEq)]
enum Channels {
    Colours([Text; 3], Option<Text>),
    Grey(Text, Option<Text>),
}

/// The matrix from the primaries that the file states to Rec. 709, which it has without a statement.
pub(crate) fn to_rec709(bytes: &[u8]) -> Result<Option<Matrix>, ColourError> {
    let Ok(meta) = MetaData::read_from_buffered(Cursor::new(bytes), false) else {
        return Ok(None);
    };
    let Some(header) = choose(&meta)
        .ok()
        .and_then(|channels| header_of(&meta, &channels))
    else {
        return Ok(None);
    };
    let shared = &header.shared_attributes;
    match (shared.chromaticities, interoperability(header)) {
        (Some(chromaticities), _) => matrix_of(primaries_of(chromaticities)),
        (None, Some(id)) => match id.as_str() {
            "lin_rec709_scene" | "data" | "unknown" | "" => Ok(None),
            id => matrix_of(primaries_of_id(id)?),
        },
        (None, None) => Ok(None),
    }
}

fn primaries_of(chromaticities: Chromaticities) -> Primaries {
    let pair = |pair: Vec2<f32>| [pair.x(), pair.y()].map(f64::from);
    let Chromaticities {
        red,
        green,
        blue,
        white,
    } = chromaticities;
    Primaries::new(pair(red), pair(green), pair(blue), pair(white))
}

/// The name of the colour space that newer programs write.
fn interoperability(header: &Header) -> Option<String> {
    let name = Text::from("colorInteropID");
    let own = header.own_attributes.other.get(&name);
    match own.or_else(|| header.shared_attributes.other.get(&name)) {
        Some(AttributeValue::Text(text)) => Some(text.to_string()),
        _ => None,
    }
}

fn primaries_of_id(id: &str) -> Result<Primaries, ColourError> {
    Ok(match id {
        "lin_rec2020_scene" => Primaries::REC2020,
        "lin_p3d65_scene" => Primaries::DISPLAY_P3,
        "lin_adobergb_scene" => Primaries::ADOBE_RGB,
        "lin_ap1_scene" => {
            Primaries::from_numbers([0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767])
        }
        "lin_ap0_scene" => {
            Primaries::from_numbers([0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.0770, 0.32168, 0.33767])
        }
        _ => {
            return Err(ColourError(format!(
                "says that its colours are in {id} (colorInteropID)"
            )));
        }
    })
}

/// Width and height of what is displayed.
pub(crate) fn size(bytes: &[u8]) -> Option<(u32, u32)> {
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).ok()?;
    let size = meta.headers.first()?.shared_attributes.display_window.size;
    Some((u32::try_from(size.x()).ok()?, u32::try_from(size.y()).ok()?))
}

/// The picture: colours, with alpha where there is some; a single channel becomes three equal ones.
pub(crate) fn decode(bytes: &[u8]) -> Result<DynamicImage, StillError> {
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(|fault| {
        if has_chroma(bytes) {
            let text =
                "has its colours as luminance and chroma (Y, RY, BY): write them as R, G and B";
            StillError::NotRead(text.to_owned())
        } else {
            decoding(fault)
        }
    })?;
    let channels = choose(&meta)?;
    let header = header_of(&meta, &channels).ok_or_else(|| no_picture(&meta))?;
    let canvas = Canvas::new(header, &channels)?;
    canvas.image(canvas.read(bytes, channels)?)
}

/// What is displayed, and where the pixels of the file lie in it.
#[derive(Clone, Copy)]
struct Canvas {
    width: usize,
    height: usize,
    offset: [i64; 2],
    has_alpha: bool,
}

impl Canvas {
    fn new(header: &Header, channels: &Channels) -> Result<Self, StillError> {
        let (Channels::Colours(_, alpha) | Channels::Grey(_, alpha)) = channels;
        let window = header.shared_attributes.display_window;
        let offset = header.own_attributes.layer_position - window.position;
        let canvas = Self {
            width: window.size.x(),
            height: window.size.y(),
            offset: [offset.x(), offset.y()].map(i64::from),
            has_alpha: alpha.is_some(),
        };
        let bytes = 4 * canvas.channels() as u64;
        for size in [window.size, header.layer_size] {
            let pixels = (size.x() as u64).saturating_mul(size.y() as u64);
            reserve(pixels.saturating_mul(bytes))?;
        }
        Ok(canvas)
    }

    const fn channels(self) -> usize {
        if self.has_alpha { 4 } else { 3 }
    }

    fn read(self, bytes: &[u8], channels: Channels) -> Result<Vec<f32>, StillError> {
        let source = Cursor::new(bytes);
        let length = self.width * self.height * self.channels();
        let read = read()
            .no_deep_data()
            .largest_resolution_level()
            .specific_channels();
        // Every channel needs a name of its own, so that one is asked for which no file has.
        let name_of = |alpha: Option<Text>| alpha.unwrap_or_else(|| Text::from("no alpha"));
        match channels {
            Channels::Colours([red, green, blue], alpha) => read
                .required(red)
                .required(green)
                .required(blue)
                .optional(name_of(alpha), 1.0_f32)
                .collect_pixels(
                    move |_, _| vec![0.0_f32; length],
                    move |pixels: &mut Vec<f32>, place, (r, g, b, a): (f32, f32, f32, f32)| {
                        self.put(pixels, place, [r, g, b, a])
                    },
                )
                .first_valid_layer()
                .all_attributes()
                .from_buffered(source)
                .map(|image| image.layer_data.channel_data.pixels),
            Channels::Grey(grey, alpha) => read
                .required(grey)
                .optional(name_of(alpha), 1.0_f32)
                .collect_pixels(
                    move |_, _| vec![0.0_f32; length],
                    move |pixels: &mut Vec<f32>, place, (y, a): (f32, f32)| {
                        self.put(pixels, place, [y, y, y, a])
                    },
                )
                .first_valid_layer()
                .all_attributes()
                .from_buffered(source)
                .map(|image| image.layer_data.channel_data.pixels),
        }
        .map_err(decoding)
    }

    fn put(self, pixels: &mut [f32], place: Vec2<usize>, values: [f32; 4]) {
        let inside = |at: usize, offset: i64, size: usize| {
            let at = usize::try_from(at as i64 + offset).ok()?;
            (at < size).then_some(at)
        };
        let x = inside(place.x(), self.offset[0], self.width);
        let y = inside(place.y(), self.offset[1], self.height);
        if let (Some(x), Some(y)) = (x, y) {
            let count = self.channels();
            let start = (y * self.width + x) * count;
            pixels[start..start + count].copy_from_slice(&values[..count]);
        }
    }

    fn image(self, values: Vec<f32>) -> Result<DynamicImage, StillError> {
        let side = |side: usize| u32::try_from(side).map_err(|_| StillError::TooLarge);
        let (width, height) = (side(self.width)?, side(self.height)?);
        let image = if self.has_alpha {
            ImageBuffer::<Rgba<f32>, _>::from_raw(width, height, values)
                .map(DynamicImage::ImageRgba32F)
        } else {
            ImageBuffer::<Rgb<f32>, _>::from_raw(width, height, values)
                .map(DynamicImage::ImageRgb32F)
        };
        image.ok_or(StillError::TooLarge)
    }
}

fn decoding(fault: exr::error::Error) -> StillError {
    let format = ImageFormatHint::Exact(ImageFormat::OpenExr);
    StillError::Decode(ImageError::Decoding(DecodingError::new(format, fault)))
}

/// Whether there are channels of chroma, which have fewer samples: the library refuses them.
fn has_chroma(bytes: &[u8]) -> bool {
    let head = &bytes[..bytes.len().min(HEAD)];
    [&b"\0RY\0"[..], b"\0BY\0"]
        .iter()
        .all(|name| head.windows(4).any(|at| at == *name))
}

/// The first layer that has the channels, which is the one that is read.
fn header_of<'a>(meta: &'a MetaData, channels: &Channels) -> Option<&'a Header> {
    let has = |header: &&Header| {
        let has = |name: &Text| header.channels.find_index_of_channel(name).is_some();
        let has_all = match channels {
            Channels::Colours(colours, _) => colours.iter().all(has),
            Channels::Grey(grey, _) => has(grey),
        };
        !header.deep && has_all
    };
    meta.headers.iter().find(has)
}

/// That a file has several layers, or none that shows a picture.
fn no_picture(meta: &MetaData) -> StillError {
    let names: Vec<String> = flat_names(meta).iter().map(ToString::to_string).collect();
    StillError::NotRead(format!(
        "has no channels R, G and B, and not one channel alone: write the wanted one as R, G and B; it has {}",
        names.join(", ")
    ))
}

fn flat_names(meta: &MetaData) -> Vec<Text> {
    let flat = meta.headers.iter().filter(|header| !header.deep);
    flat.flat_map(|header| {
        header
            .channels
            .list
            .iter()
            .map(|channel| channel.name.clone())
    })
    .collect()
}

/// The one sensible picture: R, G and B, or those of the only layer that has them or is called so, or one channel alone.
fn choose(meta: &MetaData) -> Result<Channels, StillError> {
    let names = flat_names(meta);
    let text: Vec<(String, &Text)> = names.iter().map(|name| (name.to_string(), name)).collect();
    let layers: Vec<(String, Channels)> = text
        .iter()
        .filter(|(name, _)| role(name) == Some('r'))
        .filter_map(|(name, _)| {
            let layer = layer(name);
            let find = |wanted| {
                let mut all = text.iter();
                let is_it = |(name, _): &&(String, &Text)| {
                    self::layer(name) == layer && role(name) == Some(wanted)
                };
                all.find(is_it).map(|(_, text)| (*text).clone())
            };
            let channels = Channels::Colours([find('r')?, find('g')?, find('b')?], find('a'));
            Some((layer.to_ascii_lowercase(), channels))
        })
        .collect();
    let is_beauty = |layer: &str| {
        let last = layer.rsplit('.').next().unwrap_or_default();
        BEAUTY.contains(&last)
    };
    let plain = layers.iter().find(|(layer, _)| layer.is_empty());
    let mut beauties = layers.iter().filter(|(layer, _)| is_beauty(layer));
    let chosen = match (plain, &layers[..], beauties.next(), beauties.next()) {
        (Some(plain), ..) => Some(plain),
        (None, [only], ..) => Some(only),
        (None, _, Some(beauty), None) => Some(beauty),
        _ => None,
    };
    if let Some((_, channels)) = chosen {
        return Ok(channels.clone());
    }
    let is_grey =
        |name: &str| ["y", "l", "grey", "gray"].contains(&last(name).to_ascii_lowercase().as_str());
    let grey = match &text[..] {
        [(_, only)] => Some((*only, None)),
        [(a, alpha), (y, grey)] | [(y, grey), (a, alpha)] if role(a) == Some('a') && is_grey(y) => {
            Some((*grey, Some((*alpha).clone())))
        }
        _ => None,
    };
    match grey {
        Some((grey, alpha)) if layers.is_empty() => Ok(Channels::Grey(grey.clone(), alpha)),
        _ => Err(no_picture(meta)),
    }
}

fn layer(name: &str) -> &str {
    name.rsplit_once('.').map_or("", |(layer, _)| layer)
}

fn last(name: &str) -> &str {
    name.rsplit_once('.').map_or(name, |(_, last)| last)
}

fn role(name: &str) -> Option<char> {
    match last(name).to_ascii_lowercase().as_str() {
        "r" | "red" => Some('r'),
        "g" | "green" => Some('g'),
        "b" | "blue" => Some('b'),
        "a" | "alpha" => Some('a'),
        _ => None,
    }
}
