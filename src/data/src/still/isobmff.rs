//! How AVIF and HEIF say that a picture is turned for display: the properties `irot` and `imir` of its primary item.

use image::metadata::Orientation;
use image::{DynamicImage, GrayImage};

/// The most boxes of one file.
const MAX_BOXES: usize = 4096;

/// The orientation for display; `None` if the picture stands as it is stored, or the file cannot be read.
pub(crate) fn orientation(bytes: &[u8]) -> Option<Orientation> {
    // `meta` and `pitm` begin with a version and flags.
    let meta = find(bytes, b"meta")?.get(4..)?;
    let primary = primary_item(find(meta, b"pitm")?)?;
    let properties = find(meta, b"iprp")?;
    let all: Vec<(&[u8], &[u8])> = boxes(find(properties, b"ipco")?).collect();
    let indices = associations(find(properties, b"ipma")?, primary)?;
    let mut shown = sample();
    for index in indices {
        let Some((kind, content)) = index.checked_sub(1).and_then(|at| all.get(at)) else {
            continue;
        };
        let value = content.first().copied().unwrap_or_default();
        shown = match (*kind, value) {
            // Quarters of a turn to the left.
            (b"irot", value) => match value & 3 {
                1 => shown.rotate270(),
                2 => shown.rotate180(),
                3 => shown.rotate90(),
                _ => shown,
            },
            // Top and bottom change places, or left and right.
            (b"imir", value) if value & 1 == 0 => shown.flipv(),
            (b"imir", _) => shown.fliph(),
            _ => shown,
        };
    }
    let is_it = |orientation: &Orientation| {
        let mut turned = sample();
        turned.apply_orientation(*orientation);
        turned == shown
    };
    (2..=8).filter_map(Orientation::from_exif).find(is_it)
}

/// A picture that looks different in each orientation.
fn sample() -> DynamicImage {
    DynamicImage::ImageLuma8(GrayImage::from_fn(2, 3, |x, y| {
        image::Luma([(2 * y + x) as u8])
    }))
}

/// The boxes of a box: their kinds and contents.
fn boxes(mut rest: &[u8]) -> impl Iterator<Item = (&[u8], &[u8])> {
    let next = move || {
        let kind = rest.get(4..8)?;
        let short = u32::from_be_bytes(rest.get(..4)?.try_into().ok()?);
        let (header, length) = match short {
            0 => (8, rest.len()),
            1 => {
                let long = u64::from_be_bytes(rest.get(8..16)?.try_into().ok()?);
                (16, usize::try_from(long).ok()?)
            }
            short => (8, short as usize),
        };
        let content = rest.get(header..length)?;
        rest = &rest[length..];
        Some((kind, content))
    };
    std::iter::from_fn(next).take(MAX_BOXES)
}

fn find<'a>(bytes: &'a [u8], wanted: &[u8; 4]) -> Option<&'a [u8]> {
    boxes(bytes)
        .find(|(kind, _)| kind == wanted)
        .map(|(_, content)| content)
}

fn primary_item(pitm: &[u8]) -> Option<u32> {
    match pitm.first()? {
        0 => Some(u32::from(u16::from_be_bytes(
            pitm.get(4..6)?.try_into().ok()?,
        ))),
        _ => Some(u32::from_be_bytes(pitm.get(4..8)?.try_into().ok()?)),
    }
}

/// The numbers of an item's properties, from 1.
fn associations(ipma: &[u8], item: u32) -> Option<Vec<usize>> {
    let (version, flags) = (*ipma.first()?, *ipma.get(3)?);
    let (id_bytes, index_bytes) = (
        if version == 0 { 2 } else { 4 },
        if flags & 1 == 1 { 2 } else { 1 },
    );
    let number = |bytes: &[u8]| {
        bytes
            .iter()
            .fold(0_u32, |sum, &byte| sum << 8 | u32::from(byte))
    };
    let entries = number(ipma.get(4..8)?);
    let mut at = 8;
    for _ in 0..entries {
        let id = number(ipma.get(at..at + id_bytes)?);
        let count = usize::from(*ipma.get(at + id_bytes)?);
        at += id_bytes + 1;
        let indices = ipma.get(at..at + count * index_bytes)?;
        at += count * index_bytes;
        if id == item {
            // The highest bit says whether the property is essential.
            let mask = if index_bytes == 2 { 0x7fff } else { 0x7f };
            let indices = indices.chunks_exact(index_bytes);
            return Some(
                indices
                    .map(|index| (number(index) & mask) as usize)
                    .collect(),
            );
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn boxed(kind: &[u8; 4], content: &[u8]) -> Vec<u8> {
        let length = 8 + content.len() as u32;
        [&length.to_be_bytes(), &kind[..], content].concat()
    }

    /// The head of a file whose item 1 has these properties.
    fn file(properties: &[(&[u8; 4], u8)]) -> Vec<u8> {
        let ipco: Vec<u8> = properties
            .iter()
            .flat_map(|(kind, value)| boxed(kind, &[*value]))
            .collect();
        let mut ipma = vec![0, 0, 0, 0, 0, 0, 0, 1, 0, 1, properties.len() as u8];
        ipma.extend((1..=properties.len() as u8).map(|index| index | 0x80));
        let iprp = [boxed(b"ipco", &ipco), boxed(b"ipma", &ipma)].concat();
        let meta = [
            vec![0; 4],
            boxed(b"pitm", &[0, 0, 0, 0, 0, 1]),
            boxed(b"iprp", &iprp),
        ]
        .concat();
        [
            boxed(b"ftyp", b"avif\0\0\0\0avifmif1"),
            boxed(b"meta", &meta),
        ]
        .concat()
    }

    #[test]
    fn turns_and_mirrors_become_exifs_numbers() {
        for (properties, number) in [
            (&[(b"irot", 3)][..], Some(6)),
            (&[(b"irot", 1)], Some(8)),
            (&[(b"irot", 2)], Some(3)),
            (&[(b"irot", 0)], None),
            (&[(b"imir", 1)], Some(2)),
            (&[(b"imir", 0)], Some(4)),
            (&[(b"irot", 2), (b"imir", 1)], Some(4)),
            (&[(b"irot", 3), (b"imir", 1)], Some(5)),
            (&[(b"pixi", 3)], None),
            (&[], None),
        ] {
            let found = orientation(&file(properties)).map(Orientation::to_exif);
            assert_eq!(found, number, "{properties:?}");
        }
    }

    #[test]
    fn half_a_file_says_nothing() {
        let whole = file(&[(b"irot", 3)]);
        for length in 0..whole.len() - 1 {
            assert_eq!(orientation(&whole[..length]), None, "{length}");
        }
        assert_eq!(orientation(&[0xff; 64]), None);
    }
}
