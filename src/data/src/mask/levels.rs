//! What the levels of a grey picture mean: a mask, labels, or a photograph.

use std::collections::BTreeMap;

use super::{MaskFault, several};

/// Labels are at most so many; a picture of more levels is none of labels.
const MAX_LABELS: usize = 64;
/// The part of a picture that a level has to cover evenly to be a label between black and white.
const LABEL_AREA: f64 = 0.02;
/// A level so near to black or to the brightest one is that, blurred by a lossy format; of 255.
const BLURRED: f64 = 8.0;
/// Tones between these are neither black nor white, of 255.
const TONES: (f64, f64) = (32.0, 224.0);
/// The share of tones, among what is not black or what is not white, from which a picture is not a mask.
const TONES_THERE: f64 = 1.0 / 3.0;
/// Fraction of its half of the levels that is nearly black or nearly white in a mask with soft edges.
const PLATEAU: f64 = 0.2;

/// The levels of a picture, with the number of pixels of each.
pub(super) struct Levels<'a> {
    levels: &'a [u16],
    width: usize,
    white: u16,
    counts: BTreeMap<u16, u64>,
}

impl<'a> Levels<'a> {
    pub(super) fn new(levels: &'a [u16], white: u16, width: u32) -> Self {
        let mut counts = vec![0u64; usize::from(white) + 1];
        for &level in levels {
            counts[usize::from(level.min(white))] += 1;
        }
        let counts = (0..=white)
            .zip(counts)
            .filter(|(_, count)| *count > 0)
            .collect();
        Self {
            levels,
            width: width as usize,
            white,
            counts,
        }
    }

    /// The level other than 0, if there is exactly one, and 0.
    pub(super) fn only_label(&self) -> Option<u16> {
        let mut found = self.counts.keys();
        match (found.next(), found.next(), found.next()) {
            (Some(0), Some(&label), None) => Some(label),
            _ => None,
        }
    }

    /// The least level of the object.
    pub(super) fn threshold(&self) -> Result<u16, MaskFault> {
        let half = self.white / 2 + 1;
        let (lowest, highest) = match (self.counts.keys().next(), self.counts.keys().next_back()) {
            (Some(&lowest), Some(&highest)) => (lowest, highest),
            _ => (0, 0),
        };
        if let Some(label) = self.only_label() {
            return Ok(label.min(half));
        }
        if highest < half {
            return Err(match self.counts.len() {
                2..=MAX_LABELS => labels(self.counts.keys().copied()),
                _ => MaskFault::Empty {
                    brightest: highest,
                    white: self.white,
                },
            });
        }
        // Of two levels one is the object's, or both are.
        if self.counts.len() <= 2 {
            return Ok(half);
        }
        let even = self.even_levels();
        if self.counts.len() <= MAX_LABELS && self.has_labels(&even, highest) {
            return Err(labels(even.into_keys()));
        }
        if self.is_photograph(lowest, highest) {
            Err(MaskFault::Photograph)
        } else {
            Ok(half)
        }
    }

    /// The levels that some pixel shares with all pixels around it, with the number of such pixels.
    fn even_levels(&self) -> BTreeMap<u16, u64> {
        let mut even = BTreeMap::new();
        let rows: Vec<&[u16]> = self.levels.chunks(self.width.max(1)).collect();
        for three in rows.windows(3) {
            let [above, here, below] = three else {
                continue;
            };
            for x in 1..here.len().min(below.len()).saturating_sub(1) {
                let level = here[x];
                let is_even = |row: &[u16]| row[x - 1..=x + 1].iter().all(|&other| other == level);
                if is_even(here) && is_even(above) && is_even(below) {
                    *even.entry(level).or_default() += 1;
                }
            }
        }
        even
    }

    /// Whether something between black and white covers an area evenly, which soft edges do not; or all is even, and
    /// the object is not the brightest alone.
    fn has_labels(&self, even: &BTreeMap<u16, u64>, highest: u16) -> bool {
        let of_white = |level: u16| 255.0 * f64::from(level) / f64::from(self.white);
        let area = LABEL_AREA * self.levels.len() as f64;
        let is_between =
            |level: u16| of_white(level) > BLURRED && of_white(highest) - of_white(level) > BLURRED;
        let between = even
            .iter()
            .any(|(&level, &count)| is_between(level) && count as f64 >= area);
        // Labels beside 255, which stands for "does not count"; a lossy format blurs both ends.
        let dark = even
            .keys()
            .filter(|&&level| of_white(level) <= BLURRED)
            .count();
        let all_even = even.len() == self.counts.len() && dark + 1 == even.len();
        between || (all_even && dark > 1)
    }

    /// Whether tones fill areas, as in a photograph, a rendering or a map; the edges of a mask may be soft.
    fn is_photograph(&self, lowest: u16, highest: u16) -> bool {
        let range = f64::from(highest - lowest).max(1.0);
        let tone = |level: u16| 255.0 * f64::from(level - lowest) / range;
        let count = |wanted: &dyn Fn(f64) -> bool| -> f64 {
            let counted = self
                .counts
                .iter()
                .filter(|(level, _)| wanted(tone(**level)));
            counted.map(|(_, &count)| count as f64).sum()
        };
        let not_black = count(&|tone| tone > TONES.0);
        let not_white = count(&|tone| tone < TONES.1);
        let tones = self.filled(&|level| (TONES.0..TONES.1).contains(&tone(level))) as f64;
        let has_tones = tones > TONES_THERE * not_black.min(not_white);
        let has_white = count(&|tone| tone >= 240.0) >= PLATEAU * count(&|tone| tone >= 128.0);
        let has_black = count(&|tone| tone <= 15.0) >= PLATEAU * count(&|tone| tone < 128.0);
        has_tones && !(has_white && has_black)
    }

    /// Number of pixels around which all pixels, two far in each direction, are `wanted`.
    fn filled(&self, wanted: &dyn Fn(u16) -> bool) -> u64 {
        let width = self.width.max(1);
        // How many rows in sequence have had five wanted pixels side by side, for each column.
        let mut rows = vec![0u32; width];
        let mut filled = 0;
        for row in self.levels.chunks(width) {
            let mut run = 0u32;
            for (x, &level) in row.iter().enumerate() {
                run = if wanted(level) { run + 1 } else { 0 };
                rows[x] = if run >= 5 { rows[x] + 1 } else { 0 };
                filled += u64::from(rows[x] >= 5);
            }
        }
        filled
    }
}

fn labels(levels: impl IntoIterator<Item = u16>) -> MaskFault {
    several("values", levels.into_iter().map(|level| level.to_string()))
}
