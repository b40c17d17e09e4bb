//! From a network's answer to how sure it is of the object at each place.

use super::prompt::Prompt;

/// Values of a map that is already between 0 and 1 may be beyond by so much.
const ROUNDING: f32 = 1e-3;
/// A smaller map says nothing of an outline.
const LEAST_SIDE: usize = 8;
/// Segment Anything's decoders answer so many masks: the one for clear prompts first, then three guesses.
const WITH_SINGLE: usize = 4;

/// The values of an output.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Answer {
    pub(super) shape: Vec<usize>,
    pub(super) values: Vec<f32>,
}

/// How sure the object is, 0 to 1, row by row.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct SoftMap {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) values: Vec<f32>,
}

impl Answer {
    /// The only map of an answer that covers a picture of this width and height.
    pub(super) fn map(&self, covers: (usize, usize)) -> Result<SoftMap, String> {
        let maps = self.maps(covers)?;
        if maps != 1 {
            return Err(self.unfit());
        }
        let is_share = |value: &f32| (-ROUNDING..=1.0 + ROUNDING).contains(value);
        let is_sure = if self.values.iter().all(is_share) {
            |value: f32| value.clamp(0.0, 1.0)
        } else {
            sigmoid
        };
        Ok(self.soft(0, is_sure))
    }

    /// The best of the masks, with the scores that the network gives them.
    pub(super) fn best_mask(
        &self,
        scores: Option<&Self>,
        prompt: &Prompt,
        covers: (usize, usize),
    ) -> Result<SoftMap, String> {
        let masks = self.maps(covers)?;
        let skipped = usize::from(masks == WITH_SINGLE);
        let scores = scores.filter(|scores| scores.values.len() == masks);
        let best = match scores {
            Some(scores) if !(skipped == 1 && prompt.is_clear()) => {
                let scores = scores.values.iter().enumerate().skip(skipped);
                scores
                    .max_by(|a, b| a.1.total_cmp(b.1))
                    .map_or(0, |(at, _)| at)
            }
            _ => 0,
        };
        Ok(self.soft(best, sigmoid))
    }

    /// How many maps it holds.
    fn maps(&self, (width, height): (usize, usize)) -> Result<usize, String> {
        let &[.., rows, columns] = self.shape.as_slice() else {
            return Err(self.unfit());
        };
        let longer = columns.max(rows).max(width.max(height));
        let is_alike = (columns * height).abs_diff(rows * width) <= longer;
        let pixels = rows * columns;
        if columns.min(rows) < LEAST_SIDE || !is_alike || !self.values.len().is_multiple_of(pixels)
        {
            return Err(self.unfit());
        }
        if self.values.iter().all(|value| value.is_finite()) {
            Ok(self.values.len() / pixels)
        } else {
            Err("its answer has values that are not numbers".to_owned())
        }
    }

    fn soft(&self, at: usize, is_sure: impl Fn(f32) -> f32) -> SoftMap {
        let [height, width] = [2, 1].map(|from_end| self.shape[self.shape.len() - from_end]);
        let values = self.values.iter().skip(at * width * height);
        SoftMap {
            width,
            height,
            values: values
                .take(width * height)
                .map(|&value| is_sure(value))
                .collect(),
        }
    }

    fn unfit(&self) -> String {
        let sides: Vec<String> = self.shape.iter().map(usize::to_string).collect();
        format!(
            "its answer has {} values, which is not a map of its picture",
            sides.join(" x ")
        )
    }
}

fn sigmoid(value: f32) -> f32 {
    1.0 / (1.0 + (-value).exp())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answer(shape: &[usize], value: impl Fn(usize) -> f32) -> Answer {
        let values = (0..shape.iter().product()).map(value).collect();
        Answer {
            shape: shape.to_vec(),
            values,
        }
    }

    #[test]
    fn shares_are_taken_as_they_are_and_logits_become_shares() {
        let shares = answer(&[1, 1, 8, 8], |at| at as f32 / 63.0);
        let map = shares.map((320, 320)).unwrap();
        assert_eq!((map.width, map.height, map.values[63]), (8, 8, 1.0));
        let logits = answer(&[1, 8, 8], |at| at as f32 - 32.0);
        let map = logits.map((1024, 1024)).unwrap();
        assert_eq!(map.values[32], 0.5);
        assert!(map.values[0] < 1e-6 && map.values[63] > 0.999);
    }

    #[test]
    fn what_is_not_a_map_of_the_picture_is_refused() {
        for shape in [&[1, 4, 8, 8][..], &[1, 1, 8, 16], &[1, 1, 1, 1], &[64], &[]] {
            assert!(answer(shape, |_| 0.0).map((320, 320)).is_err(), "{shape:?}");
        }
        let wide = answer(&[1, 1, 9, 16], |_| 0.0);
        assert!(wide.map((1024, 576)).is_ok());
        for value in [f32::NAN, f32::INFINITY] {
            let one = answer(&[8, 8], |at| if at == 7 { value } else { 0.0 });
            assert!(one.map((8, 8)).is_err());
        }
    }

    #[test]
    fn a_clear_prompt_gets_the_first_of_four_masks_and_a_point_the_best_guess() {
        let masks = answer(&[1, 4, 8, 8], |at| (at / 64) as f32);
        let scores = answer(&[1, 4], |at| [0.99, 0.2, 0.7, 0.5][at]);
        let prompt = |labels: &[f32]| Prompt {
            points: vec![[0.0; 2]; labels.len()],
            labels: labels.to_vec(),
        };
        let found = |masks: &Answer, scores: &Answer, labels: &[f32]| {
            let map = masks.best_mask(Some(scores), &prompt(labels), (1024, 1024));
            map.unwrap().values[0]
        };
        assert_eq!(found(&masks, &scores, &[2.0, 3.0]), 0.5);
        assert_eq!(found(&masks, &scores, &[1.0]), sigmoid(2.0));
        let masks = answer(&[1, 1, 3, 8, 8], |at| (at / 64) as f32);
        let scores = answer(&[1, 1, 3], |at| [0.1, 0.2, 0.7][at]);
        assert_eq!(found(&masks, &scores, &[2.0, 3.0]), sigmoid(2.0));
        let one = answer(&[1, 1, 8, 8], |_| 3.0);
        assert_eq!(found(&one, &scores, &[1.0]), sigmoid(3.0));
    }
}
