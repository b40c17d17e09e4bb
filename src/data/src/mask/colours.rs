//! What the colours of a picture mean: one label on black, several, one hue with soft edges, or a photograph.

use std::collections::BTreeSet;

/// A spread of the channels that is a colour, of 255; a smaller one may come from a lossy format.
const COLOURED: f64 = 24.0;
/// The part of a picture that has to be coloured.
const COLOURED_AREA: f64 = 0.002;
/// Colours of labels are at most so many.
const MAX_LABELS: usize = 64;
/// How far a colour may be from the one hue of a picture, of 255.
const SAME_HUE: f64 = 32.0;

/// The colours of a picture.
pub(super) struct Colours<'a> {
    colours: &'a [[u16; 3]],
    white: f64,
    /// All that there are, if they are few.
    few: Option<BTreeSet<[u16; 3]>>,
}

impl<'a> Colours<'a> {
    pub(super) fn new(colours: &'a [[u16; 3]], white: u16) -> Self {
        let mut few = BTreeSet::new();
        let mut last = None;
        for colour in colours {
            // Neighbours are mostly alike.
            if last.replace(colour) != Some(colour) && few.len() <= MAX_LABELS {
                few.insert(*colour);
            }
        }
        Self {
            colours,
            white: f64::from(white),
            few: (few.len() <= MAX_LABELS).then_some(few),
        }
    }

    /// Whether there are any, but for the noise of a lossy format.
    pub(super) fn are_there(&self) -> bool {
        let spread = |[r, g, b]: &[u16; 3]| r.max(g).max(b) - r.min(g).min(b);
        let is_coloured = |colour: &&[u16; 3]| self.of_255(spread(colour)) > COLOURED;
        let coloured = self.colours.iter().filter(is_coloured).count();
        coloured as f64 > COLOURED_AREA * self.colours.len() as f64
    }

    /// The colour other than black, if there is exactly one, and black.
    pub(super) fn only_label(&self) -> Option<[u16; 3]> {
        let mut found = self.few.as_ref()?.iter();
        match (found.next(), found.next(), found.next()) {
            (Some([0, 0, 0]), Some(label), None) => Some(*label),
            _ => None,
        }
    }

    /// Whether all lie between black and one colour.
    pub(super) fn are_of_one_hue(&self) -> bool {
        let sum = |colour: &[u16; 3]| colour.iter().map(|&c| u32::from(c)).sum::<u32>();
        let Some(purest) = self.colours.iter().max_by_key(|colour| sum(colour)) else {
            return false;
        };
        let all = f64::from(sum(purest)).max(1.0);
        let part = purest.map(|c| f64::from(c) / all);
        self.colours.iter().all(|colour| {
            let brightness = f64::from(sum(colour));
            let near = |(&c, part): (&u16, f64)| {
                255.0 / self.white * (f64::from(c) - part * brightness).abs() <= SAME_HUE
            };
            colour.iter().zip(part).all(near)
        })
    }

    /// Their names, if they are few.
    pub(super) fn few(&self) -> Option<impl Iterator<Item = String>> {
        let few = self.few.as_ref()?;
        Some(few.iter().map(|colour| self.name(*colour)))
    }

    /// As in a style sheet: `#800000`.
    pub(super) fn name(&self, colour: [u16; 3]) -> String {
        let [r, g, b] = colour.map(|c| self.of_255(c).round() as u8);
        format!("#{r:02x}{g:02x}{b:02x}")
    }

    fn of_255(&self, value: u16) -> f64 {
        255.0 * f64::from(value) / self.white
    }
}
