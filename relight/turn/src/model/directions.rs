//! Vectors and directions.

/// Least cosine between the normal of a visible surface and the direction to the viewer. Numerical.
pub(crate) const MIN_FACING: f64 = 0.02;

/// Where the viewer's direction is reflected to.
pub(crate) fn reflected([x, y, z]: [f64; 3]) -> [f64; 3] {
    [2.0 * z * x, 2.0 * z * y, 2.0 * z * z - 1.0]
}

pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
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
