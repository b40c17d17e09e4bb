//! A relief with the object's outline. Knows nothing of files.

use relight_core::captured_object::CapturedObject;
use relight_core::image::{Extent, ImageError, Planes};
use relight_core::light::Normals;

use super::heights::integrated;

/// Triangles with the place of each corner on the picture.
#[derive(Debug, Clone, PartialEq)]
pub struct ObjectMesh {
    /// Places: x to the right, y up, z to the viewer; the middle of the picture is the origin, its longer side is 1.
    pub positions: Vec<[f32; 3]>,
    /// Places on the picture, from its left upper corner, 0 to 1.
    pub texture: Vec<[f32; 2]>,
    /// Three corners a triangle, counter-clockwise as the viewer sees them.
    pub triangles: Vec<[u32; 3]>,
}

impl ObjectMesh {
    /// The integrated normals of an object, with so many vertices on the longer side of the picture, at least 2.
    ///
    /// # Errors
    /// If the object is nowhere.
    pub fn from_object(object: &CapturedObject, vertices: usize) -> Result<Self, ImageError> {
        if object.alpha().plane(0).iter().all(|&alpha| alpha < 0.5) {
            let fault = "the object covers no pixel by half or more: there is nothing to export";
            return Err(ImageError::Other(fault.to_owned()));
        }
        Ok(grid_mesh(object, vertices.max(2)))
    }
}

/// How long the sides of a picture are, the longer one being 1.
fn sides(extent: Extent) -> [f32; 2] {
    let longest = extent.width.max(extent.height).max(1) as f32;
    [
        extent.width as f32 / longest,
        extent.height as f32 / longest,
    ]
}

/// A place on the picture as a place of the mesh.
fn place([u, v]: [f32; 2], [width, height]: [f32; 2], z: f32) -> [f32; 3] {
    [(u - 0.5) * width, (0.5 - v) * height, z]
}

/// A vertex stands in the middle of each cell of a grid. A square of four is there where one of them is on the object:
/// the alpha of the colours cuts the outline out of it.
fn grid_mesh(object: &CapturedObject, side: usize) -> ObjectMesh {
    let picture = object.extent();
    let longest = picture.width.max(picture.height);
    let scale = (side as f64 / longest as f64).min(1.0);
    let cells = |pixels: usize| ((pixels as f64 * scale).round() as usize).max(2);
    let grid = Extent::new(cells(picture.width), cells(picture.height));
    let alpha = object.alpha().resized(grid);
    let inside: Vec<bool> = alpha.plane(0).iter().map(|&alpha| alpha >= 0.5).collect();
    let normals = Normals::new(object.surface().normals().planes().resized(grid));
    let normals = normals.completed(&inside);

    let mut triangles: Vec<[u32; 3]> = Vec::new();
    for row in 1..grid.height {
        for column in 1..grid.width {
            let at = row * grid.width + column;
            let corners = [at - grid.width - 1, at - grid.width, at - 1, at];
            if corners.iter().any(|&at| inside[at]) {
                let [a, b, c, d] = corners.map(|at| at as u32);
                triangles.extend([[a, c, b], [b, c, d]]);
            }
        }
    }
    let mut used = vec![false; grid.pixels()];
    for &corner in triangles.as_flattened() {
        used[corner as usize] = true;
    }
    let heights = extended(grid, integrated(&normals, &inside), &inside, &used);

    let sides = sides(picture);
    let pixel = sides[0] / grid.width as f32;
    let mut numbers = vec![0_u32; grid.pixels()];
    let (mut positions, mut texture) = (Vec::new(), Vec::new());
    for at in (0..grid.pixels()).filter(|&at| used[at]) {
        numbers[at] = positions.len() as u32;
        let uv = [
            ((at % grid.width) as f32 + 0.5) / grid.width as f32,
            ((at / grid.width) as f32 + 0.5) / grid.height as f32,
        ];
        positions.push(place(uv, sides, heights[at] * pixel));
        texture.push(uv);
    }
    for corner in triangles.as_flattened_mut() {
        *corner = numbers[*corner as usize];
    }
    ObjectMesh {
        positions,
        texture,
        triangles,
    }
}

/// Heights, with those of the neighbours inside, in the mean, for cells that are used and not inside.
fn extended(grid: Extent, mut heights: Vec<f32>, inside: &[bool], used: &[bool]) -> Vec<f32> {
    let found = heights.clone();
    for (at, around) in around(grid).enumerate() {
        if used[at] && !inside[at] {
            let near: Vec<f32> = around
                .filter(|&other| inside[other])
                .map(|other| found[other])
                .collect();
            heights[at] = near.iter().sum::<f32>() / near.len().max(1) as f32;
        }
    }
    heights
}

/// For each cell, itself and the up to eight around it.
fn around(grid: Extent) -> impl Iterator<Item = impl Iterator<Item = usize>> {
    (0..grid.pixels()).map(move |at| {
        let (column, row) = (at % grid.width, at / grid.width);
        let rows = row.saturating_sub(1)..(row + 2).min(grid.height);
        let columns = column.saturating_sub(1)..(column + 2).min(grid.width);
        rows.flat_map(move |row| columns.clone().map(move |column| row * grid.width + column))
    })
}

/// Colours with those of the nearest pixels inside for so many pixels beyond the outline, so that no black is mixed in where
/// a renderer takes the mean of neighbours.
pub(crate) fn bled(mut colours: Planes<3>, alpha: &Planes<1>, pixels: usize) -> Planes<3> {
    let grid = colours.extent();
    let mut known: Vec<bool> = alpha.plane(0).iter().map(|&alpha| alpha >= 0.5).collect();
    for _ in 0..pixels {
        let before = (colours.clone(), known.clone());
        for (at, around) in around(grid).enumerate() {
            let near: Vec<usize> = around.filter(|&other| before.1[other]).collect();
            if known[at] || near.is_empty() {
                continue;
            }
            for (to, from) in colours.planes_mut().into_iter().zip(before.0.planes()) {
                to[at] = near.iter().map(|&at| from[at]).sum::<f32>() / near.len() as f32;
            }
            known[at] = true;
        }
    }
    colours
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight_core::image::Rgb;
    use relight_core::render::Surface;

    fn ball(side: usize) -> CapturedObject {
        let normals = Normals::sphere(side);
        let extent = normals.extent();
        let alpha = Planes::from_fn(extent, |x, y| {
            [f32::from(u8::from(normals.planes().pixel(x, y)[2] > 0.0))]
        });
        let albedo = Rgb::new(Planes::filled(extent, [0.5; 3]));
        let surface = Surface::new(normals, albedo, None).unwrap();
        CapturedObject::new("ball", surface, alpha.clone(), alpha).unwrap()
    }

    #[test]
    fn a_ball_becomes_a_dome_whose_triangles_face_the_viewer() {
        let mesh = ObjectMesh::from_object(&ball(120), 60).unwrap();
        let highest = mesh.positions.iter().map(|p| p[2]).fold(0.0, f32::max);
        // The ground is the rim's mean, which on 60 vertices is 0.06 to 0.09 high.
        assert!((0.41..=0.45).contains(&highest), "{highest}");
        for corners in &mesh.triangles {
            let [a, b, c] = corners.map(|corner| mesh.positions[corner as usize]);
            let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            assert!(area > 0.0);
        }
        // Its corners are not there: the outline is the ball's.
        assert!(mesh.positions.iter().all(|p| p[0].hypot(p[1]) < 0.54));
    }

    #[test]
    fn nothing_has_no_mesh() {
        let whole = ball(8);
        let none = Planes::zeros(whole.extent());
        let empty = CapturedObject::new("none", whole.surface().clone(), none.clone(), none);
        let error = ObjectMesh::from_object(&empty.unwrap(), 8).unwrap_err();
        assert!(error.to_string().contains("covers no pixel"), "{error}");
    }
}
