use relight_core::image::{Linear, Rgb};
use relight_core::reader::{TruthLayout, TruthSet};

use crate::test_turns::{SIDE, SOLVED, ball, even_environment, known, mask, off, read};
use crate::{TurnError, TurnLabels, solve_turn};

#[test]
fn without_observable_normals_or_confident_pixels_there_are_no_labels() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("labels");
    let even = read(&ball(), &even_environment());
    let of_even = solve_turn(&even.curves, &known(&even_environment())).unwrap();
    let labels = TurnLabels {
        turn: &even,
        solution: &of_even,
        least_confidence: 0.0,
    };
    assert!(matches!(labels.write(&out), Err(TurnError::NotObservable)));
    let (turn, solution) = &*SOLVED;
    let labels = TurnLabels {
        turn,
        solution,
        least_confidence: 1.0,
    };
    let refused = labels.write(&out);
    assert!(matches!(refused, Err(TurnError::NotConfident { .. })));
    assert!(!out.exists());
}

#[test]
fn labels_of_a_turn_are_read_as_samples_with_truth() {
    let surface = ball();
    let (turn, solution) = &*SOLVED;
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("labels");
    let labels = TurnLabels {
        turn,
        solution,
        least_confidence: 0.5,
    };
    assert_eq!(labels.write(&out).unwrap(), 3);
    let set = TruthSet::open(&out, TruthLayout::Synth).unwrap();
    assert_eq!(set.names().len(), 3);
    let sample = set.load(1).unwrap();
    let confident = sample.normals.unwrap();
    let confident = confident.completed(
        &mask(&surface)
            .plane(0)
            .iter()
            .map(|&m| m >= 0.5)
            .collect::<Vec<_>>(),
    );
    assert!(off(&surface, &confident) < 1.0);
    let at = |image: &Rgb<Linear>| image.planes().pixel(SIDE / 2, SIDE / 3)[1];
    let (image, diffuse) = (sample.image.unwrap(), sample.diffuse.unwrap());
    assert!((at(&image) - at(&diffuse)).abs() < 0.005);
    assert!(at(&sample.highlight.unwrap()) < 0.005);
}
