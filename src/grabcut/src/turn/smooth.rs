//! Values averaged with those of the pixels around them.

/// The mean over three by three pixels of an image of `width` x `height`; its border is repeated.
pub(super) fn smooth(values: &[f32], (width, height): (usize, usize)) -> Vec<f32> {
    let three = |values: &[f32], at: usize, step: usize, place: usize, length: usize| {
        let before = if place > 0 { at - step } else { at };
        let after = if place + 1 < length { at + step } else { at };
        (values[before] + values[at] + values[after]) / 3.0
    };
    let all = 0..values.len();
    let across = all
        .clone()
        .map(|at| three(values, at, 1, at % width, width));
    let across: Vec<f32> = across.collect();
    let both = all.map(|at| three(&across, at, width, at / width, height));
    both.collect()
}
