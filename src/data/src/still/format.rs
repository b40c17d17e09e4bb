//! The format of a file, by its content.

use std::path::Path;

use super::tiff;
use crate::file_names::has_extension;

/// A format of still images.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Portable Network Graphics.
    Png,
    /// JPEG.
    Jpeg,
    /// WebP.
    WebP,
    /// TIFF, unless it is a camera's raw file.
    Tiff,
    /// Windows bitmap.
    Bmp,
    /// GIF; the first picture is read.
    Gif,
    /// OpenEXR.
    Exr,
    /// Radiance.
    Radiance,
    /// AVIF, which is not read.
    Avif,
    /// HEIF with HEVC, as telephones write it, which is not read.
    Heic,
    /// Another one that is not read: what a file of it is called, with its article, and what to do with it.
    Other(&'static str, &'static str),
}

const SAVE: &str = "save it as PNG or JPEG";
const EXPORT: &str = "export it as PNG";

/// Endings of the files that are read.
pub const ENDINGS: [&str; 18] = [
    "png", "jpg", "jpeg", "jpe", "jfif", "jif", "jfi", "webp", "tif", "tiff", "bmp", "dib", "gif",
    "exr", "hdr", "rgbe", "xyze", "pic",
];

/// Whether a file is called as a picture that is read.
pub fn is_named(path: &Path) -> bool {
    has_extension(path, &ENDINGS)
}

impl Format {
    /// A camera's raw file.
    pub const RAW: Self = Self::Other(
        "a camera's raw file",
        "develop it, and export it as PNG or TIFF of 16 bits",
    );
    /// Portable document.
    pub const PDF: Self = Self::Other("a PDF", EXPORT);
    /// Scalable vector graphics.
    pub const SVG: Self = Self::Other("an SVG", EXPORT);
    /// A page of a website.
    pub const HTML: Self = Self::Other("a page of a website", "download the picture itself");

    /// The format that the first bytes of a file show.
    pub fn sniff(bytes: &[u8]) -> Option<Self> {
        let starts = |magic: &[u8]| bytes.starts_with(magic);
        let at = |place: usize, magic: &[u8]| {
            bytes
                .get(place..)
                .is_some_and(|rest| rest.starts_with(magic))
        };
        Some(match bytes {
            _ if starts(b"\x89PNG\r\n\x1a\n") => Self::Png,
            _ if starts(b"\xff\xd8\xff") => Self::Jpeg,
            _ if starts(b"RIFF") && at(8, b"WEBP") => Self::WebP,
            _ if starts(b"v/1\x01") => Self::Exr,
            _ if starts(b"#?") => Self::Radiance,
            _ if starts(b"GIF87a") || starts(b"GIF89a") => Self::Gif,
            _ if starts(b"BM") && bytes.len() > 26 => Self::Bmp,
            _ if is_raw(bytes) => Self::RAW,
            _ if [&b"II*\0"[..], b"MM\0*", b"II+\0", b"MM\0+"]
                .iter()
                .any(|magic| starts(magic)) =>
            {
                Self::Tiff
            }
            _ if at(4, b"ftyp") => return of_brands(bytes),
            _ if starts(b"\xff\x0a") || starts(b"\0\0\0\x0cJXL ") => {
                Self::Other("a JPEG XL image", SAVE)
            }
            _ if starts(b"\0\0\0\x0cjP  ") || starts(b"\xff\x4f\xff\x51") => {
                Self::Other("a JPEG 2000 image", SAVE)
            }
            _ if starts(b"8BPS") => Self::Other("a Photoshop file", EXPORT),
            _ if starts(b"gimp xcf") => Self::Other("a GIMP file", EXPORT),
            [
                b'P',
                b'1'..=b'7' | b'F' | b'f',
                b' ' | b'\n' | b'\r' | b'\t' | b'#',
                ..,
            ] => Self::Other("a PNM image", SAVE),
            _ if starts(b"qoif") => Self::Other("a QOI image", SAVE),
            _ if starts(b"DDS ") => Self::Other("a DDS image", SAVE),
            _ if starts(b"%PDF-") => Self::PDF,
            _ => return of_markup(bytes),
        })
    }

    /// Of a format that is not read: what a file of it is called, with its article, and what to do with it.
    pub const fn unsupported(self) -> Option<(&'static str, &'static str)> {
        match self {
            Self::Avif => Some(("an AVIF image", SAVE)),
            Self::Heic => Some((
                "a HEIC image",
                "save it as JPEG or PNG, or set the phone to JPEG",
            )),
            Self::Other(name, advice) => Some((name, advice)),
            _ => None,
        }
    }
}

/// The formats of the ISO base media file format, by its brands. A file without one of these is not a still image.
fn of_brands(bytes: &[u8]) -> Option<Format> {
    let length = u32::from_be_bytes(bytes.get(..4)?.try_into().ok()?) as usize;
    let end = length.clamp(12, 256).min(bytes.len());
    // The major brand, then its version, then those that it is compatible with.
    let major = bytes.get(8..12)?;
    let others = bytes.get(16..end).unwrap_or_default().chunks_exact(4);
    let is_one_of = |brands: &[&[u8; 4]]| {
        let mut all = std::iter::once(major).chain(others.clone());
        all.any(|brand| brands.iter().any(|&known| known == brand))
    };
    if major == b"crx " {
        Some(Format::RAW)
    } else if is_one_of(&[b"avif", b"avis"]) {
        Some(Format::Avif)
    } else if [
        b"heic", b"heix", b"heim", b"heis", b"hevc", b"hevx", b"mif1", b"msf1",
    ]
    .iter()
    .any(|&known| known == major)
    {
        Some(Format::Heic)
    } else {
        None
    }
}

/// Whether it is a raw file of a camera: most are TIFFs, whose first picture is a small one for display.
fn is_raw(bytes: &[u8]) -> bool {
    let signatures: [&[u8]; 6] = [
        b"FUJIFILMCCD-RAW",
        b"IIRO",
        b"IIRS",
        b"MMOR",
        b"IIU\0",
        b"FOVb",
    ];
    if signatures
        .iter()
        .any(|signature| bytes.starts_with(signature))
    {
        return true;
    }
    if bytes.starts_with(b"II*\0") && bytes.get(8..10) == Some(b"CR") {
        return true;
    }
    let Some(directory) = tiff::Directory::first(bytes) else {
        return false;
    };
    let is_small = directory
        .number(tiff::NEW_SUBFILE_TYPE)
        .is_some_and(|kind| kind & 1 == 1);
    directory.has(tiff::DNG_VERSION)
        || is_small && directory.has(tiff::MAKE) && directory.has(tiff::SUB_IFDS)
}

fn of_markup(bytes: &[u8]) -> Option<Format> {
    let start = &bytes[..bytes.len().min(512)];
    let text = String::from_utf8_lossy(start).to_ascii_lowercase();
    let text = text.trim_start_matches('\u{feff}').trim_start();
    if text.starts_with("<svg") || text.starts_with("<?xml") && text.contains("<svg") {
        Some(Format::SVG)
    } else if text.starts_with("<!doctype html") || text.starts_with("<html") {
        Some(Format::HTML)
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn endings_are_known_in_any_case() {
        for name in ["a.JPG", "a.jfif", "b.jpe", "c.Tiff", "d.HDR"] {
            assert!(is_named(Path::new(name)), "{name}");
        }
        for name in ["a.heic", "jpg", "a.png.txt", ""] {
            assert!(!is_named(Path::new(name)), "{name}");
        }
    }

    #[test]
    fn a_format_is_known_by_its_content() {
        let heic = b"\0\0\0\x18ftypmif1\0\0\0\0mif1heic";
        let avif = b"\0\0\0\x1cftypmif1\0\0\0\0mif1avifmiaf";
        let video = b"\0\0\0\x18ftypisom\0\0\0\0isomhevc";
        for (bytes, format) in [
            (&heic[..], Some(Format::Heic)),
            (avif, Some(Format::Avif)),
            (video, None),
            (b"\0\0\0\x18ftypcrx \0\0\0\0crx ", Some(Format::RAW)),
            (b"#?RGBE\n", Some(Format::Radiance)),
            (b"\xff\x0a\0", Some(Format::Other("a JPEG XL image", SAVE))),
            (b"P6\n1 1\n", Some(Format::Other("a PNM image", SAVE))),
            (b"II*\0\x10\0\0\0CR\x02\0", Some(Format::RAW)),
            (b"II*\0\x08\0\0\0\0\0\0\0\0\0", Some(Format::Tiff)),
            (b"\xef\xbb\xbf<!DOCTYPE html>", Some(Format::HTML)),
            (b"<?xml version=\"1.0\"?><svg/>", Some(Format::SVG)),
            (
                b"8BPS\0\x01",
                Some(Format::Other("a Photoshop file", EXPORT)),
            ),
            (b"a photograph", None),
            (b"", None),
        ] {
            assert_eq!(Format::sniff(bytes), format, "{bytes:?}");
        }
    }

    #[test]
    fn a_raw_file_is_a_tiff_with_a_small_first_picture() {
        let ifd = |entries: &[(u16, u16, u32)]| {
            let mut bytes = b"II*\0\x08\0\0\0".to_vec();
            bytes.extend((entries.len() as u16).to_le_bytes());
            for &(tag, kind, value) in entries {
                bytes.extend(tag.to_le_bytes());
                bytes.extend(kind.to_le_bytes());
                bytes.extend(1_u32.to_le_bytes());
                bytes.extend(value.to_le_bytes());
            }
            bytes.extend([0; 4]);
            bytes
        };
        let nef = ifd(&[(254, 4, 1), (271, 2, 65), (330, 4, 99)]);
        let dng = ifd(&[(254, 4, 0), (50706, 1, 4)]);
        let plain = ifd(&[(254, 4, 0), (256, 4, 8), (271, 2, 65)]);
        assert_eq!(Format::sniff(&nef), Some(Format::RAW));
        assert_eq!(Format::sniff(&dng), Some(Format::RAW));
        assert_eq!(Format::sniff(&plain), Some(Format::Tiff));
    }
}
