//! Still images: any bytes are decoded or refused, and what they say about their colours gives numbers.

#![no_main]

use libfuzzer_sys::fuzz_target;
use relit_data::still::{Colour, Format, decode, orientation, stored_size};

fuzz_target!(|bytes: &[u8]| {
    // Large pictures take time and find nothing.
    if stored_size(bytes)
        .is_some_and(|(width, height)| u64::from(width) * u64::from(height) > 1 << 20)
    {
        return;
    }
    let _ = orientation(bytes);
    if let Ok(image) = decode(bytes) {
        assert!(Format::sniff(bytes).is_none_or(|format| format.unsupported().is_none()));
        drop(image);
    }
    if let Ok(colour) = Colour::from_file(bytes) {
        let mut pixels = [0, 128, 255, 255, 1, 2];
        colour.to_srgb8(&mut pixels);
        let mut planes = [[0.0_f32, 1.0]; 3];
        let [red, green, blue] = &mut planes;
        colour.to_light([red, green, blue]);
        assert!(planes.iter().flatten().all(|value| value.is_finite()));
    }
});
