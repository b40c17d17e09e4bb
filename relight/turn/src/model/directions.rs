//! Vectors and directions.

use std::f64::consts::PI;

/// Least cosine between the normal of a visible surface and the direction to the viewer. Numerical.
pub(crate) const MIN_FACING: f64 = 0.02;

/// Where the viewer's direction is reflected to.
pub(crate) fn reflected([x, y, z]: [f64; 3]) -> [f64; 3] {
    [2.0 * z * x, 2.0 * z * y, 2.0 * z * z - 1.0]
}

/// Directions of a half sphere around the viewer, by a spiral.
pub(crate) fn half_sphere(count: usize) -> impl Iterator<Item = [f64; 3]> {
    let golden = PI * (3.0 - 5.0_f64.sqrt());
    (0..count).map(move |at| {
        let z = 1.0 - (1.0 - MIN_FACING) * (at as f64 + 0.5) / count as f64;
        let (sin, cos) = (golden * at as f64).sin_cos();
        let radius = (1.0 - z * z).sqrt();
        [radius * cos, radius * sin, z]
    })
}

/// Two directions at right angles to a normal and to each other.
pub(crate) fn tangents(normal: [f64; 3]) -> [[f64; 3]; 2] {
    let helper = if normal[2].abs() < 0.9 {
        [0.0, 0.0, 1.0]
    } else {
        [1.0, 0.0, 0.0]
    };
    let u = unit(cross(helper, normal));
    [u, cross(normal, u)]
}

pub(crate) fn tilted(normal: [f64; 3], [u, v]: [[f64; 3]; 2], [a, b]: [f64; 2]) -> [f64; 3] {
    unit([0, 1, 2].map(|i| normal[i] + a * u[i] + b * v[i]))
}

pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// The vector at length 1; towards the viewer where it has none.
pub(crate) fn unit(v: [f64; 3]) -> [f64; 3] {
    let length = dot(v, v).sqrt();
    if length > 1e-12 {
        v.map(|c| c / length)
    } else {
        [0.0, 0.0, 1.0]
    }
}
