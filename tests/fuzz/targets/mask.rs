//! Pictures of masks: any pixels are a mask of their size with an object in it, or are refused.

#![no_main]
#![allow(clippy::expect_used, reason = "a fuzz target reports by a panic")]

use image::DynamicImage;
use libfuzzer_sys::fuzz_target;
use relit_data::mask::MaskPicture;

/// Values that masks often have are tried more often than chance would.
fn value(byte: u8) -> u8 {
    match byte % 4 {
        0 => 0,
        1 => 255,
        2 => byte / 64,
        _ => byte,
    }
}

fuzz_target!(|bytes: &[u8]| {
    let [kind, width, rest @ ..] = bytes else {
        return;
    };
    let width = u32::from(width % 64) + 1;
    let channels = u32::from(kind % 4) + 1;
    let height = rest.len() as u32 / (width * channels);
    let count = (width * height * channels) as usize;
    let values: Vec<u8> = rest[..count].iter().map(|&byte| value(byte)).collect();
    let picture = match channels {
        1 => image::GrayImage::from_raw(width, height, values).map(DynamicImage::from),
        2 => image::GrayAlphaImage::from_raw(width, height, values).map(DynamicImage::from),
        3 => image::RgbImage::from_raw(width, height, values).map(DynamicImage::from),
        _ => image::RgbaImage::from_raw(width, height, values).map(DynamicImage::from),
    };
    let picture = picture.expect("there are as many values as pixels need");
    let picture = MaskPicture::from_image(&picture);
    assert_eq!(picture.size(), (width, height));
    match picture.object() {
        Ok(object) => {
            assert_eq!(
                object.inside.len() as u64,
                u64::from(width) * u64::from(height)
            );
            assert!(object.inside.contains(&true));
        }
        Err(fault) => assert!(!fault.to_string().is_empty()),
    }
});
