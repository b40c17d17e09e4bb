use crate::observe::curves::CurveBuilder;
use crate::tests::{SOLVED, albedo_off, ball, environment, frame, mask, off, solve};

#[test]
fn steps_of_the_exposure_are_found_and_taken_out() {
    let (surface, light) = (ball(), environment());
    let extent = surface.extent();
    let mut builder = CurveBuilder::new(extent, mask(&surface).plane(0)).unwrap();
    for k in 0..180 {
        let angle = f64::from(k) * 2.0;
        let exposure = if (51..120).contains(&k) { 0.8 } else { 1.0 };
        let image = frame(&surface, &light, angle).into_planes();
        builder
            .push(angle, extent, image.map(|v| exposure * v).planes())
            .unwrap();
    }
    let curves = builder.finish().unwrap();
    let [down, up] = curves.exposure_steps() else {
        panic!("{:?}", curves.exposure_steps());
    };
    assert_eq!((down.angle_deg, up.angle_deg), (102.0, 240.0));
    assert!((down.factor - 0.8).abs() < 0.01, "{down:?}");
    assert!((up.factor - 1.25).abs() < 0.015, "{up:?}");
    let found = solve(&curves, &light);
    let off = off(&surface, &found.normals(&curves));
    assert!(off < 0.5, "{off}");
    assert!(albedo_off(&surface, &found.albedo(&curves), 1.0) < 0.02);
    assert!(SOLVED.0.curves.exposure_steps().is_empty());
}

#[test]
fn missing_frames_of_a_coarse_turn_are_no_steps_of_the_exposure() {
    let surface = ball();
    let extent = surface.extent();
    // Strong light from one side, of which the frames show much from one to the next.
    let mut light = environment();
    for at in [1, 3] {
        light.coefficients_mut()[at] = [0.55; 3];
    }
    let missing = [3, 10, 11, 24, 31, 43, 44, 58, 66, 67, 80];
    let steps = |factor: f32| {
        let mut builder = CurveBuilder::new(extent, mask(&surface).plane(0)).unwrap();
        for k in (0..90).filter(|k| !missing.contains(k)) {
            let angle = 4.0 * f64::from(k);
            let exposure = if (20..70).contains(&k) { factor } else { 1.0 };
            let image = frame(&surface, &light, angle).into_planes();
            builder
                .push(angle, extent, image.map(|v| exposure * v).planes())
                .unwrap();
        }
        let curves = builder.finish().unwrap();
        curves
            .exposure_steps()
            .iter()
            .map(|step| step.angle_deg)
            .collect::<Vec<_>>()
    };
    assert_eq!(steps(1.0), [0.0; 0]);
    assert_eq!(steps(0.8), [80.0, 280.0]);
}
