use relight_core::image::Planes;
use relight_photo::files::{FrameTiming, MovieReader};

use crate::tests::{SIDE, SOLVED, ball, elevation, environment, metal_ball, read, solved};
use crate::{MaterialKind, ReadTurn, SolvedTurn, TurnFiles, solve_in_light};

/// The frames of the video that is written of a turn, as planes of sRGB.
fn film_of(solved: &SolvedTurn, out: &std::path::Path) -> Vec<Planes<3>> {
    let files = TurnFiles {
        solved,
        light_source: None,
        has_movie: true,
    };
    files.write(out).unwrap();
    let mut movie = MovieReader::open(&out.join("relit.mp4"), FrameTiming::Each).unwrap();
    let mut frames = Vec::new();
    while let Some(frame) = movie.frame().unwrap() {
        frames.push(frame.planes().clone());
    }
    frames
}

/// The mean of a part of the ball's columns.
fn columns(frame: &Planes<3>, columns: std::ops::Range<usize>) -> f32 {
    let rows = SIDE / 3..2 * SIDE / 3;
    let count = (columns.len() * rows.len()) as f32;
    let all = rows.flat_map(|y| columns.clone().map(move |x| (x, y)));
    all.map(|(x, y)| frame.pixel(x, y)[1]).sum::<f32>() / count
}

#[test]
fn the_film_shows_the_object_while_a_lamp_goes_around_it() {
    let run = std::process::Command::new("ffmpeg")
        .arg("-version")
        .output();
    if run.is_err() {
        relit_test_support::say_skipped("the program ffmpeg is not installed");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let (surface, light, curves) = metal_ball();
    let metal = ReadTurn {
        curves,
        ..read(&surface, &light)
    };
    let of_metal = solve_in_light(&metal.curves, &light, elevation(), MaterialKind::Metal);
    let diffuse = solved(read(&ball(), &environment()), SOLVED.1.clone());
    for (name, solved) in [("diffuse", diffuse), ("metal", solved(metal, of_metal))] {
        let frames = film_of(&solved, &folder.path().join(name));
        assert_eq!(frames.len(), 90);
        let [left, right] = [2..SIDE / 3, 2 * SIDE / 3..SIDE - 2];
        let derivatives =
            |frame: &Planes<3>| columns(frame, right.clone()) - columns(frame, left.clone());
        let most = frames.iter().map(derivatives).fold(f32::MIN, f32::max);
        let least = frames.iter().map(derivatives).fold(f32::MAX, f32::min);
        assert!(most > 0.02 && least < -0.02, "{name}: {least} to {most}");
        let middle = |frame: &Planes<3>| columns(frame, SIDE / 3..2 * SIDE / 3);
        assert!(
            frames.iter().map(middle).fold(f32::MIN, f32::max) > 0.2,
            "{name}"
        );
    }
}
