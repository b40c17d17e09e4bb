//! The ground truth of the examples: the Blinn-Phong highlight summed over the pixels of a panorama.

use relight_core::image::{Extent, Linear, Planes, Rgb};
use relight_core::light::{Direction, Normals, Panorama};
use relight_core::parallel;

/// The highlight of smoothness `smoothness` and reflectance 1; with `closed`, light from behind the surface is left out.
pub(crate) fn highlight(
    panorama: &Panorama,
    normals: &Normals,
    smoothness: f32,
    closed: bool,
) -> Rgb<Linear> {
    let lights = lights(panorama);
    let alpha = f64::from(smoothness);
    let Extent { width, height } = normals.extent();
    let values = parallel::map(width * height, |at| {
        let [x, y, z] = normals.planes().planes().map(|plane| f64::from(plane[at]));
        let mut sum = [0.0; 3];
        let Some(normal) = Direction::new(x, y, z) else {
            return sum;
        };
        for (towards, half, radiance) in &lights {
            if closed && normal.dot(*towards) <= 0.0 {
                continue;
            }
            let lobe = normal.dot(*half).max(0.0).powf(alpha);
            for (sum, radiance) in sum.iter_mut().zip(radiance) {
                *sum += lobe * radiance;
            }
        }
        sum
    });
    Rgb::new(Planes::from_fn(normals.extent(), |x, y| {
        values[y * width + x].map(|value| value as f32)
    }))
}

/// A panorama as small lights: direction, half vector, radiance times solid angle.
fn lights(panorama: &Panorama) -> Vec<(Direction, Direction, [f64; 3])> {
    let planes = panorama.image().planes();
    let Extent { width, height } = planes.extent();
    let mut lights = Vec::with_capacity(width * height);
    for y in 0..height {
        let area = panorama.solid_angle(y);
        for x in 0..width {
            let towards = panorama.direction(x as f64 + 0.5, y as f64 + 0.5);
            let radiance = planes.pixel(x, y).map(|v| f64::from(v) * area);
            lights.extend(half_vector(towards).map(|half| (towards, half, radiance)));
        }
    }
    lights
}

/// The direction half way to the viewer; none for light from straight behind.
fn half_vector(towards: Direction) -> Option<Direction> {
    let [x, y, z] = towards.components();
    Direction::new(x, y, z + 1.0)
}
