//! The geometry buffer: the surface at each pixel, independent of light.

use glam::{Affine3A, DVec4, Mat3, Vec2, Vec3, Vec4};

use super::raster::{NOTHING, Projected, Triangle, Weights, nearest_triangles};
use crate::mesh::{Mesh, SurfaceSample, blended};
use crate::view::Projection;
use relight_core::image::{Extent, Planes};
use relight_core::light::Normals;

/// How far above the surface rays of light start: the object is about 1 large.
const LIFT: f32 = 1e-3;

/// The visible surface of an object, pixel by pixel: made once, for any albedo and any light.
/// Only covered pixels are kept, row by row from the upper left; all lists run along them, in the viewer's frame unless told
/// otherwise.
#[derive(Debug, Clone)]
pub struct GBuffer {
    /// Width and height of the picture, pixels.
    pub size: u32,
    /// The covered pixels, ascending: row times size plus column.
    pub pixels: Vec<u32>,
    /// Where the surface is.
    pub(crate) points: Vec<Vec3>,
    /// Unit normals; they never face away from the eye.
    pub normals: Vec<Vec3>,
    /// Unit vectors to the eye.
    pub towards_eye: Vec<Vec3>,
    /// Where rays of light start: a little above the surface, and lifted where facets are flatter than the normals say
    /// (Hanika, "Hacking the Shadow Terminator", 2021).
    pub(crate) ray_starts: Vec<Vec3>,
    /// Where the surface is in the mesh's own frame, within the unit sphere: patterns stick to it.
    pub object_points: Vec<Vec3>,
    /// Texture coordinates, where the mesh has them.
    pub(crate) texture: Option<Vec<Vec2>>,
    /// `None` for a mesh whose file does not have it.
    own: Vec<SurfaceSample>,
    /// Takes the gradient of a height, in the mesh's own frame and unit, into the viewer's frame.
    pub(crate) gradient_map: Mat3,
}

impl GBuffer {
    /// Looks at a mesh that `placement` moves into the viewer's frame, in a square picture of `size`
    /// pixels.
    pub(crate) fn render(
        mesh: &Mesh,
        placement: Affine3A,
        projection: Projection,
        size: u32,
    ) -> Self {
        let posed = Posed::new(mesh, placement, projection, size);
        let seen = nearest_triangles(size, &posed.projected, &mesh.triangles);
        let covered = (0_u32..)
            .zip(&seen)
            .filter(|(_, triangle)| **triangle != NOTHING);
        let count = covered.clone().count();
        let list = || Vec::with_capacity(count);
        let mut buffer = Self {
            size,
            pixels: Vec::with_capacity(count),
            points: list(),
            normals: list(),
            towards_eye: list(),
            ray_starts: list(),
            object_points: list(),
            texture: mesh.texture().map(|_| Vec::with_capacity(count)),
            own: Vec::new(),
            gradient_map: without_scale(posed.normal_map),
        };
        for (pixel, &triangle) in covered {
            let (column, row) = (pixel % size, pixel / size);
            if posed.resolve(triangle, column, row, &mut buffer) {
                buffer.pixels.push(pixel);
            }
        }
        buffer
    }

    /// Number of covered pixels.
    pub fn len(&self) -> usize {
        self.pixels.len()
    }

    /// Whether nothing is seen.
    pub fn is_empty(&self) -> bool {
        self.pixels.is_empty()
    }

    /// The surface's look from the mesh's own file, if it has one.
    pub(crate) fn own_surface(&self) -> Option<&[SurfaceSample]> {
        let own = &self.own;
        (own.len() == self.len() && !own.is_empty()).then_some(own)
    }

    /// A full picture with these values at the covered pixels and `empty` elsewhere.
    pub(crate) fn spread<T: Copy>(&self, values: &[T], empty: T) -> Vec<T> {
        let mut picture = vec![empty; self.size as usize * self.size as usize];
        for (&pixel, &value) in self.pixels.iter().zip(values) {
            picture[pixel as usize] = value;
        }
        picture
    }

    /// A picture with these colours at the covered pixels and 0 elsewhere.
    pub fn planes(&self, values: &[Vec3]) -> Planes<3> {
        let (side, values) = (self.size as usize, self.spread(values, Vec3::ZERO));
        Planes::from_fn(Extent::new(side, side), |x, y| {
            values[y * side + x].to_array()
        })
    }

    /// 1 at the covered pixels, 0 elsewhere.
    pub fn mask(&self) -> Planes<1> {
        let side = self.size as usize;
        let covered = self.spread(&vec![[1.0]; self.len()], [0.0]);
        Planes::from_fn(Extent::new(side, side), |x, y| covered[y * side + x])
    }

    /// These normals as a map.
    pub fn normal_map(&self, normals: &[Vec3]) -> Normals {
        Normals::new(self.planes(normals))
    }

    /// For each covered pixel, the mean of `values` over the covered pixels around it: a square of
    /// `radius` pixels to each side, twice over.
    pub(crate) fn blurred(&self, values: &[Vec3], radius: u32) -> Vec<Vec3> {
        let weighted: Vec<Vec4> = values.iter().map(|value| value.extend(1.0)).collect();
        let mut picture = self.spread(&weighted, Vec4::ZERO);
        let (side, radius) = (self.size as usize, radius as usize);
        for _ in 0..2 {
            picture = transposed_means(&picture, side, radius);
            picture = transposed_means(&picture, side, radius);
        }
        let at = |&pixel: &u32| {
            let sum = picture[pixel as usize];
            sum.truncate() / sum.w.max(f32::MIN_POSITIVE)
        };
        self.pixels.iter().map(at).collect()
    }
}

/// The running means along the rows of a square picture, as the columns of the result.
fn transposed_means(picture: &[Vec4], side: usize, radius: usize) -> Vec<Vec4> {
    let mut result = vec![Vec4::ZERO; picture.len()];
    for (row, values) in picture.chunks_exact(side.max(1)).enumerate() {
        // Sums in f64: what is taken away again leaves nothing behind.
        let mut sum = DVec4::ZERO;
        for entering in 0..side + radius {
            if let Some(value) = values.get(entering) {
                sum += value.as_dvec4();
            }
            if entering > 2 * radius {
                sum -= values[entering - 2 * radius - 1].as_dvec4();
            }
            if entering >= radius {
                let mean = sum / (2 * radius + 1) as f64;
                result[(entering - radius) * side + row] = mean.as_vec4();
            }
        }
    }
    result
}

/// A mesh in its place before the camera.
struct Posed<'a> {
    mesh: &'a Mesh,
    positions: Vec<Vec3>,
    projected: Vec<Projected>,
    normal_map: Mat3,
    projection: Projection,
}

impl<'a> Posed<'a> {
    fn new(mesh: &'a Mesh, placement: Affine3A, projection: Projection, size: u32) -> Self {
        let moved = mesh
            .positions
            .iter()
            .map(|&p| placement.transform_point3(p));
        let positions: Vec<Vec3> = moved.collect();
        let half = size as f32 / 2.0;
        let project = |&point: &Vec3| {
            let (place, magnification) = projection.project(point);
            let nearness = match projection {
                Projection::Orthographic => point.z,
                Projection::Perspective { .. } => magnification,
            };
            let place = Vec2::new(place.x + 1.0, 1.0 - place.y) * half;
            Projected { place, nearness }
        };
        let projected = positions.iter().map(project).collect();
        Self {
            mesh,
            positions,
            projected,
            normal_map: Mat3::from(placement.matrix3).inverse().transpose(),
            projection,
        }
    }

    /// Adds the surface of a triangle at a pixel; false if the pixel is missed by rounding.
    fn resolve(&self, number: u32, column: u32, row: u32, surface: &mut GBuffer) -> bool {
        let corners = self.mesh.triangles[number as usize];
        let inside = Triangle::new(corners, &self.projected)
            .and_then(|triangle| triangle.weights(column as usize, row as usize));
        let Some(inside) = inside else { return false };
        let weights = self.in_space(corners, inside);
        let places = corners.map(|vertex| self.positions[vertex as usize]);
        let point = blend(weights, places);
        let towards_eye = self.projection.towards_eye(point);
        let facet = (places[1] - places[0]).cross(places[2] - places[0]);
        let facet = facet.normalize_or(towards_eye);
        // A sheet seen from behind shows its back.
        let side = if facet.dot(towards_eye) < 0.0 {
            -1.0
        } else {
            1.0
        };
        let normals = self.mesh.normals[number as usize]
            .map(|normal| (self.normal_map * normal).normalize_or(facet * side) * side);
        let normal = blend(weights, normals).normalize_or(facet * side);
        surface.points.push(point);
        surface.normals.push(turned_to(normal, towards_eye));
        surface.towards_eye.push(towards_eye);
        let lifted = lift(point, weights, places, normals);
        surface.ray_starts.push(lifted + facet * side * LIFT);
        let own = corners.map(|vertex| self.mesh.positions[vertex as usize]);
        surface.object_points.push(blend(weights, own));
        if let (Some(list), Some(coordinates)) = (&mut surface.texture, self.mesh.texture()) {
            list.push(blended(coordinates[number as usize], weights));
        }
        let own = self.mesh.own_surface(number as usize, weights);
        surface.own.extend(own);
        true
    }

    /// Weights in space for weights in the picture.
    fn in_space(&self, corners: [u32; 3], weights: Weights) -> Weights {
        if self.projection == Projection::Orthographic {
            return weights;
        }
        let scaled = [0, 1, 2].map(|k| weights[k] * self.projected[corners[k] as usize].nearness);
        let sum = scaled.iter().sum::<f32>();
        scaled.map(|part| part / sum)
    }
}

fn blend(weights: Weights, values: [Vec3; 3]) -> Vec3 {
    values[0] * weights[0] + values[1] * weights[1] + values[2] * weights[2]
}

/// A linear map without the factor by which it enlarges.
fn without_scale(map: Mat3) -> Mat3 {
    let scale = map.determinant().abs().cbrt();
    if scale > 0.0 {
        map * scale.recip()
    } else {
        map
    }
}

/// The normal, or where it faces away from the eye, the nearest one that does not.
pub(crate) fn turned_to(normal: Vec3, towards_eye: Vec3) -> Vec3 {
    let facing = normal.dot(towards_eye);
    if facing >= 0.0 {
        return normal;
    }
    (normal - towards_eye * facing).normalize_or(towards_eye)
}

/// The point, moved out of the dents that flat facets make in a round surface.
fn lift(point: Vec3, weights: Weights, places: [Vec3; 3], normals: [Vec3; 3]) -> Vec3 {
    let lifted = [0, 1, 2].map(|k| {
        let below = (point - places[k]).dot(normals[k]).min(0.0);
        point - normals[k] * below
    });
    blend(weights, lifted)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::ShapeKind;
    use crate::view::Pose;

    fn ball(projection: Projection, size: u32) -> GBuffer {
        let mesh = ShapeKind::Sphere.build(0);
        let placement = Pose::upright(0.3, 0.4, 0.8).place(&mesh, projection);
        GBuffer::render(&mesh, placement, projection, size)
    }

    #[test]
    fn a_ball_covers_its_disc_and_has_the_normals_of_a_sphere() {
        let size = 128;
        let buffer = ball(Projection::Orthographic, size);
        let area = buffer.len() as f32 / (size * size) as f32 * 4.0;
        assert!(
            (area / (std::f32::consts::PI * 0.64) - 1.0).abs() < 0.01,
            "{area}"
        );
        for (&pixel, normal) in buffer.pixels.iter().zip(&buffer.normals) {
            let x = ((pixel % size) as f32 + 0.5) / 64.0 - 1.0;
            let y = 1.0 - ((pixel / size) as f32 + 0.5) / 64.0;
            let truth = Vec3::new(x, y, (0.64 - x * x - y * y).max(0.0).sqrt()) / 0.8;
            assert!(normal.distance(truth) < 0.06, "{normal} at {x}, {y}");
            if truth.z > 0.3 {
                assert!(normal.distance(truth) < 0.004, "{normal} for {truth}");
            }
        }
    }

    #[test]
    fn perspective_sees_points_along_rays_through_the_eye() {
        let distance = 3.0;
        let buffer = ball(Projection::Perspective { distance }, 64);
        for ((&pixel, point), to_eye) in buffer
            .pixels
            .iter()
            .zip(&buffer.points)
            .zip(&buffer.towards_eye)
        {
            let x = ((pixel % 64) as f32 + 0.5) / 32.0 - 1.0;
            let y = 1.0 - ((pixel / 64) as f32 + 0.5) / 32.0;
            let ray = Vec3::new(x, y, -distance).normalize();
            assert!(ray.dot(-*to_eye) > 0.99999);
            let along = (*point - Vec3::Z * distance).normalize();
            assert!(along.dot(ray) > 0.99999, "{point}");
        }
    }

    #[test]
    fn the_object_s_own_points_turn_with_it() {
        let buffer = ball(Projection::Orthographic, 32);
        let turn = Pose::upright(0.3, 0.4, 0.8).turn;
        for (point, own) in buffer.points.iter().zip(&buffer.object_points) {
            assert!((turn * *own * 0.8).distance(*point) < 1e-3);
        }
    }

    #[test]
    fn a_sheet_from_behind_shows_normals_that_face_the_viewer() {
        let mesh = ShapeKind::Plane.build(0);
        let placement = Pose::upright(0.0, 2.5, 0.9).place(&mesh, Projection::Orthographic);
        let buffer = GBuffer::render(&mesh, placement, Projection::Orthographic, 32);
        assert!(!buffer.is_empty());
        assert!(buffer.normals.iter().all(|normal| normal.z > 0.5));
        let lifts = buffer.ray_starts.iter().zip(&buffer.points);
        assert!(lifts.clone().all(|(start, point)| start.z > point.z));
    }

    #[test]
    fn values_are_spread_over_the_picture_where_the_object_is() {
        let buffer = ball(Projection::Orthographic, 16);
        let picture = buffer.spread(&vec![7_u8; buffer.len()], 1);
        assert_eq!(picture.len(), 256);
        assert_eq!((picture[0], picture[8 * 16 + 8]), (1, 7));
        let normals = buffer.normal_map(&buffer.normals);
        let mask = buffer.mask();
        assert_eq!((mask.pixel(0, 0), mask.pixel(8, 8)), ([0.0], [1.0]));
        assert_eq!(normals.planes().pixel(0, 0), [0.0; 3]);
        assert!(normals.planes().pixel(8, 8)[2] > 0.9);
    }

    #[test]
    fn a_blur_takes_the_mean_of_what_is_covered() {
        let buffer = ball(Projection::Orthographic, 32);
        let even = buffer.blurred(&vec![Vec3::new(3.0, 0.5, 0.0); buffer.len()], 3);
        for value in &even {
            assert!(value.distance(Vec3::new(3.0, 0.5, 0.0)) < 1e-5, "{value}");
        }
        let mut point = vec![Vec3::ZERO; buffer.len()];
        let middle = buffer
            .pixels
            .iter()
            .position(|&p| p == 16 * 32 + 16)
            .unwrap();
        point[middle] = Vec3::ONE;
        let blurred = buffer.blurred(&point, 2);
        let sum: f32 = blurred.iter().map(|value| value.x).sum();
        assert!((sum - 1.0).abs() < 1e-4, "{sum}");
        // Two squares of five: a pyramid of 25 / 625 at its top.
        assert!(
            (blurred[middle].x - 0.04).abs() < 1e-5,
            "{}",
            blurred[middle].x
        );
    }
}
