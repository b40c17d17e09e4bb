//! What a promptable network is asked with: a box, points on the object and on the background.

use relit_grabcut::{Hints, Mark};

use super::picture::Placement;

/// How such networks number what a point is.
const BACKGROUND: f32 = 0.0;
const OBJECT: f32 = 1.0;
const UPPER_LEFT: f32 = 2.0;
const LOWER_RIGHT: f32 = 3.0;
/// None: it fills up.
const NO_POINT: f32 = -1.0;
/// Points of the object, and of the background; EfficientSAM takes 6, and a box is 2 of them.
const MOST_OF_EACH: usize = 2;

/// Points in pixels of the frame, each with what it is.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Prompt {
    pub(super) points: Vec<[f64; 2]>,
    pub(super) labels: Vec<f32>,
}

impl Prompt {
    /// The prompt that hints say; `None` if they say nothing.
    pub(super) fn from_hints(hints: &Hints) -> Option<Self> {
        let (mut points, mut labels) = (Vec::new(), Vec::new());
        if let Some(rect) = hints.rect {
            points.push([f64::from(rect.x), f64::from(rect.y)]);
            points.push([rect.right() as f64, rect.bottom() as f64]);
            labels.extend([UPPER_LEFT, LOWER_RIGHT]);
        }
        for (mark, label) in [(Mark::Object, OBJECT), (Mark::Background, BACKGROUND)] {
            let found = spread(&marked(hints, mark));
            labels.extend(found.iter().map(|_| label));
            points.extend(found);
        }
        (!points.is_empty()).then_some(Self { points, labels })
    }

    /// Whether it says which object is meant, not only a place on it.
    pub(super) fn is_clear(&self) -> bool {
        let points = self.labels.iter().filter(|&&label| label != NO_POINT);
        points.count() > 1
    }

    /// With the placeholder that networks which were trained with boxes want in place of a box.
    pub(super) fn filled_up(mut self) -> Self {
        if !self.labels.contains(&UPPER_LEFT) {
            self.points.push([0.0; 2]);
            self.labels.push(NO_POINT);
        }
        self
    }

    /// The points on a network's picture of this width and height, as it takes them: x and y of each in turn.
    pub(super) fn placed(
        &self,
        placement: &Placement,
        (width, height): (usize, usize),
    ) -> Vec<f32> {
        let points = self.points.iter().zip(&self.labels);
        let placed = points.flat_map(|(&point, &label)| {
            if label == NO_POINT {
                [0.0; 2]
            } else {
                let [x, y] = placement.of(point);
                [x.clamp(0.0, width as f64), y.clamp(0.0, height as f64)]
            }
        });
        placed.map(|side| side as f32).collect()
    }
}

/// The middles of the pixels that are painted so.
fn marked(hints: &Hints, mark: Mark) -> Vec<[f64; 2]> {
    let Some(seeds) = &hints.seeds else {
        return Vec::new();
    };
    let width = seeds.size().0 as usize;
    let pixels = seeds.marks().iter().enumerate();
    let pixels = pixels.filter(|(_, found)| **found == mark);
    pixels
        .map(|(at, _)| [(at % width) as f64 + 0.5, (at / width) as f64 + 0.5])
        .collect()
}

/// A few of the places, far from each other: first the one nearest to the middle of all.
fn spread(places: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mean =
        |axis: usize| places.iter().map(|place| place[axis]).sum::<f64>() / places.len() as f64;
    let middle = [mean(0), mean(1)];
    let apart = |a: &[f64; 2], b: &[f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
    let nearest = places
        .iter()
        .min_by(|a, b| apart(a, &middle).total_cmp(&apart(b, &middle)));
    let mut found: Vec<[f64; 2]> = nearest.copied().into_iter().collect();
    while (1..MOST_OF_EACH).contains(&found.len()) {
        let free = |place: &[f64; 2]| {
            let distances = found.iter().map(|taken| apart(taken, place));
            distances.fold(f64::INFINITY, f64::min)
        };
        let farthest = places.iter().max_by(|a, b| free(a).total_cmp(&free(b)));
        match farthest.copied().filter(|place| free(place) > 0.0) {
            Some(place) => found.push(place),
            None => break,
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use image::{DynamicImage, GrayImage, Luma};
    use relit_data::geometry::Rect;
    use relit_grabcut::Seeds;

    use super::*;

    fn seeds(marks: &[(u32, u32, u8)]) -> Seeds {
        let mut image = GrayImage::from_pixel(20, 10, Luma([128]));
        for &(x, y, level) in marks {
            image.put_pixel(x, y, Luma([level]));
        }
        Seeds::from_image(&DynamicImage::from(image)).unwrap()
    }

    #[test]
    fn a_rectangle_is_two_points_that_are_labelled_as_a_box() {
        let prompt = Prompt::from_hints(&Rect::new(3, 4, 10, 5).into()).unwrap();
        assert_eq!(prompt.points, [[3.0, 4.0], [13.0, 9.0]]);
        assert_eq!(prompt.labels, [2.0, 3.0]);
        assert!(prompt.is_clear());
        assert_eq!(prompt.clone().filled_up(), prompt);
    }

    #[test]
    fn seeds_are_points_of_the_object_and_of_the_background_far_from_each_other() {
        let marks = [(4, 5, 255), (5, 5, 255), (6, 5, 255), (19, 9, 0)];
        let hints = Hints {
            seeds: Some(seeds(&marks)),
            ..Hints::default()
        };
        let prompt = Prompt::from_hints(&hints).unwrap().filled_up();
        assert_eq!(prompt.labels, [1.0, 1.0, 0.0, -1.0]);
        assert_eq!(prompt.points[0], [5.5, 5.5]);
        assert!(prompt.points[1] == [4.5, 5.5] || prompt.points[1] == [6.5, 5.5]);
        assert_eq!(prompt.points[2], [19.5, 9.5]);
        let placement = Placement {
            origin: [0.0; 2],
            scale: [2.0; 2],
        };
        let placed = prompt.placed(&placement, (35, 90));
        assert_eq!(placed[..2], [11.0, 11.0]);
        assert_eq!(placed[4..], [35.0, 19.0, 0.0, 0.0]);
    }

    #[test]
    fn without_hints_there_is_no_prompt_and_one_point_is_not_clear() {
        assert_eq!(Prompt::from_hints(&Hints::default()), None);
        let hints = Hints {
            seeds: Some(seeds(&[(4, 5, 255)])),
            ..Hints::default()
        };
        let prompt = Prompt::from_hints(&hints).unwrap();
        assert!(!prompt.filled_up().is_clear());
    }
}
