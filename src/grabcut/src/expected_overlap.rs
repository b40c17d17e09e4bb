//! How well a mask fits, by what a network says.

/// The overlap (intersection over union) with the object that is to be expected of a mask: of each pixel whether the
/// mask has it, whether that is sure, and the logarithm of the odds that it is object.
pub(crate) fn expected_overlap(pixels: impl Iterator<Item = (bool, bool, f32)>) -> f32 {
    let (mut both, mut either) = (0.0, 0.0);
    for (is_inside, is_sure, odds) in pixels {
        let inside = f32::from(u8::from(is_inside));
        let probability = if is_sure {
            inside
        } else {
            1.0 / (1.0 + (-odds).exp())
        };
        both += inside * probability;
        either += inside.max(probability);
    }
    both / either.max(1.0)
}
