use crate::tests::{SOLVED, ball, elevation, environment};
use crate::{MaterialKind, TableFrame, fit_turn_light};

#[test]
fn the_light_of_a_known_surface_is_found_as_it_is() {
    let (surface, light) = (ball(), environment());
    let frame = TableFrame::new(elevation());
    let found = fit_turn_light(&SOLVED.0.curves, &surface, MaterialKind::Diffuse, &frame).unwrap();
    let largest = 1.1;
    for (a, b) in found.coefficients().iter().zip(light.coefficients()) {
        for (a, b) in a.iter().zip(b) {
            assert!((a - b).abs() < 0.01 * largest, "{a} {b}");
        }
    }
}
