use crate::test_turns::{SIDE, ball, environment, frame, mask, off, solve};
use crate::{CurveBuilder, TurnMaps};

#[test]
fn shadows_and_highlights_of_some_frames_are_left_out_and_shadows_shown() {
    let (surface, light) = (ball(), environment());
    let extent = surface.extent();
    let mut builder = CurveBuilder::new(extent, mask(&surface).plane(0)).unwrap();
    for k in 0..90 {
        let angle = f64::from(k) * 4.0;
        let mut image = frame(&surface, &light, angle).into_planes();
        for y in 0..SIDE {
            for x in 0..SIDE {
                // The shadow of a pole goes from the left to the right, and a spot of light back.
                let factor = match k {
                    20..40 if (k - 20) / 2 == x as u32 / 4 => 0.5,
                    60..72 if (71 - k) / 2 == x as u32 / 4 => 1.5,
                    _ => 1.0,
                };
                let value = image.pixel(x, y);
                image.set_pixel(x, y, value.map(|v| v * factor));
            }
        }
        builder.push(angle, extent, image.planes()).unwrap();
    }
    let curves = builder.finish().unwrap();
    let found = solve(&curves, &light);
    let off = off(&surface, &found.normals(&curves));
    assert!(off < 2.0, "{off}");
    let maps = TurnMaps::new(&curves, &found);
    let middle = maps.shadow.pixel(SIDE / 2, SIDE / 2)[0];
    // Two of 90 frames, half of their light.
    assert!((0.005..0.02).contains(&middle), "{middle}");
    let darkest = maps
        .over_angle
        .iter()
        .max_by(|a, b| a.shadow.total_cmp(&b.shadow))
        .unwrap();
    assert!((80.0..130.0).contains(&darkest.angle_deg), "{darkest:?}");
}
