//! Patterns in space.

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

use super::super::noise::Noise;
use super::super::random::Random;
use super::super::texture::TextureImage;
use super::frame::{Frame, step};
use super::mark::Mark;
use super::palette::Palette;
use super::writing::Writing;

/// The area of a coat of paint. Lengths are in the object's own frame, in which it is about 2 large.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Pattern {
    /// More and less of it, gradually.
    Gradient { noise: Waves, width: f32 },
    /// The cells around random points, each in a colour of the palette.
    Voronoi {
        sites: Vec<Vec3>,
        colours: Vec<Vec3>,
    },
    /// The borders between such cells.
    Borders { sites: Vec<Vec3>, width: f32 },
    /// Islands.
    Blobs {
        noise: Waves,
        threshold: f32,
        width: f32,
    },
    /// Contour lines.
    Lines { noise: Waves, level: f32, half: f32 },
    /// Parallel stripes.
    Stripes {
        across: Vec3,
        phase: f32,
        level: f32,
        width: f32,
    },
    /// Round spots around points of the surface.
    Spots { centres: Vec<Vec3>, radii: Vec<f32> },
    /// One side of a plane.
    Half { normal: Vec3, offset: f32 },
    /// Lines of a script.
    Writing(Writing),
    /// A printed form.
    Mark(Mark),
    /// A picture, thrown onto the object along a direction or laid on by its texture coordinates.
    Picture {
        number: usize,
        frame: Frame,
        laid_on: bool,
        brightness: f32,
    },
}

/// What a pattern is drawn for.
pub(super) struct Canvas<'a> {
    /// Of the object's surface.
    pub(super) points: &'a [Vec3],
    pub(super) palette: &'a Palette,
    /// How many pictures there are to choose from.
    pub(super) pictures: usize,
}

impl Canvas<'_> {
    /// One of the points; any point without them.
    fn point(&self, random: &mut Random) -> Vec3 {
        match self.points.get(random.index(self.points.len())) {
            Some(&point) => point,
            None => random.direction(),
        }
    }

    fn sites(&self, random: &mut Random) -> Vec<Vec3> {
        let count = random.count(4..50);
        (0..count).map(|_| self.point(random)).collect()
    }
}

/// Noise of a frequency.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Waves {
    seed: u64,
    frequency: f32,
}

impl Waves {
    fn draw(random: &mut Random, frequencies: std::ops::Range<f32>) -> Self {
        Self {
            seed: random.seed(),
            frequency: random.log_uniform(frequencies),
        }
    }

    fn noise(&self) -> Noise {
        Noise::new(self.seed, self.frequency)
    }
}

impl Pattern {
    pub(super) fn gradient(random: &mut Random) -> Self {
        Self::Gradient {
            noise: Waves::draw(random, 0.5..1.5),
            width: random.uniform(0.5..1.5),
        }
    }

    pub(super) fn draw(random: &mut Random, canvas: &Canvas<'_>) -> Self {
        let picture_weight = if canvas.pictures > 0 { 0.10 } else { 0.0 };
        let draw = random.weighted::<fn(&mut Random, &Canvas<'_>) -> Self, _>([
            (Self::voronoi, 0.20),
            (Self::borders, 0.13),
            (Self::blobs, 0.18),
            (Self::lines, 0.12),
            (Self::stripes, 0.08),
            (Self::spots, 0.06),
            (Self::half, 0.04),
            (Self::writing, 0.12),
            (Self::picture, picture_weight),
        ]);
        draw(random, canvas)
    }

    fn voronoi(random: &mut Random, canvas: &Canvas<'_>) -> Self {
        let sites = canvas.sites(random);
        let colour = |_: &Vec3| canvas.palette.colours[random.index(canvas.palette.colours.len())];
        let colours = sites.iter().map(colour).collect();
        Self::Voronoi { sites, colours }
    }

    fn borders(random: &mut Random, canvas: &Canvas<'_>) -> Self {
        Self::Borders {
            sites: canvas.sites(random),
            width: random.uniform(0.01..0.1),
        }
    }

    fn blobs(random: &mut Random, _: &Canvas<'_>) -> Self {
        Self::Blobs {
            noise: Waves::draw(random, 1.0..7.0),
            threshold: random.uniform(-0.15..0.3),
            width: random.pick([0.03, 0.06, 0.3]),
        }
    }

    fn lines(random: &mut Random, _: &Canvas<'_>) -> Self {
        Self::Lines {
            noise: Waves::draw(random, 1.0..5.0),
            level: random.normal() * 0.15,
            half: random.uniform(0.03..0.1),
        }
    }

    fn stripes(random: &mut Random, _: &Canvas<'_>) -> Self {
        Self::Stripes {
            across: random.direction() * random.log_uniform(4.0..40.0),
            phase: random.uniform(0.0..std::f32::consts::TAU),
            level: random.uniform(-0.5..0.8),
            width: 0.15,
        }
    }

    fn spots(random: &mut Random, canvas: &Canvas<'_>) -> Self {
        let count = random.count(1..10);
        Self::Spots {
            centres: (0..count).map(|_| canvas.point(random)).collect(),
            radii: (0..count).map(|_| random.uniform(0.03..0.2)).collect(),
        }
    }

    fn half(random: &mut Random, canvas: &Canvas<'_>) -> Self {
        let normal = random.direction();
        Self::Half {
            normal,
            offset: canvas.point(random).dot(normal),
        }
    }

    fn writing(random: &mut Random, canvas: &Canvas<'_>) -> Self {
        let around = canvas.point(random);
        Self::Writing(Writing::draw(random, around))
    }

    fn picture(random: &mut Random, canvas: &Canvas<'_>) -> Self {
        let origin = canvas.point(random);
        let scale = random.uniform(0.8..3.0);
        Self::Picture {
            number: random.index(canvas.pictures),
            frame: Frame::draw(random, origin, scale),
            laid_on: random.chance(0.5),
            brightness: random.uniform(0.7..1.0),
        }
    }

    /// Lays the pattern over the paint in a colour.
    pub(super) fn paint(
        &self,
        colour: Vec3,
        points: &[Vec3],
        texture: Option<&[Vec2]>,
        pictures: &[TextureImage],
        albedo: &mut [Vec3],
    ) {
        if let Self::Picture {
            number,
            frame,
            laid_on,
            brightness,
        } = self
        {
            let Some(picture) = pictures.get(*number) else {
                return;
            };
            let coordinates = texture.filter(|_| *laid_on);
            for (k, value) in albedo.iter_mut().enumerate() {
                let at = coordinates.map_or_else(|| frame.place(points[k]), |list| list[k]);
                *value = picture.at(at) * brightness;
            }
            return;
        }
        for (value, &point) in albedo.iter_mut().zip(points) {
            if let Self::Voronoi { sites, colours } = self {
                *value = colours[nearest(sites, point).0];
            } else {
                *value = value.lerp(colour, self.coverage(point));
            }
        }
    }

    /// How much of the pattern there is at a point, 0..=1.
    fn coverage(&self, point: Vec3) -> f32 {
        match self {
            Self::Gradient { noise, width } => step(noise.noise().at(point), *width),
            Self::Borders { sites, width } => {
                let (_, first, second) = nearest(sites, point);
                step(width - (second.sqrt() - first.sqrt()), 0.02)
            }
            Self::Blobs {
                noise,
                threshold,
                width,
            } => step(noise.noise().at(point) - threshold, *width),
            Self::Lines { noise, level, half } => {
                step(half - (noise.noise().at(point) - level).abs(), 0.04)
            }
            Self::Stripes {
                across,
                phase,
                level,
                width,
            } => step((point.dot(*across) + phase).sin() - level, *width),
            Self::Spots { centres, radii } => {
                let within = centres
                    .iter()
                    .zip(radii)
                    .map(|(centre, radius)| radius - point.distance(*centre));
                step(within.fold(f32::NEG_INFINITY, f32::max), 0.02)
            }
            Self::Half { normal, offset } => step(point.dot(*normal) - offset, 0.02),
            Self::Writing(writing) => writing.coverage(point),
            Self::Mark(mark) => mark.coverage(point),
            Self::Voronoi { .. } | Self::Picture { .. } => 0.0,
        }
    }
}

/// The nearest site, and the squared distances to it and to the second nearest.
fn nearest(sites: &[Vec3], point: Vec3) -> (usize, f32, f32) {
    let (mut place, mut first, mut second) = (0, f32::INFINITY, f32::INFINITY);
    for (k, site) in sites.iter().enumerate() {
        let distance = point.distance_squared(*site);
        if distance < first {
            (place, second, first) = (k, first, distance);
        } else {
            second = second.min(distance);
        }
    }
    (place, first, second)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_and_the_second_nearest_site_are_found() {
        let sites = [Vec3::X, Vec3::ZERO, Vec3::X * 4.0];
        assert_eq!(nearest(&sites, Vec3::X * 3.0), (2, 1.0, 4.0));
        assert_eq!(nearest(&sites[..1], Vec3::ZERO), (0, 1.0, f32::INFINITY));
    }

    #[test]
    fn every_pattern_covers_between_nothing_and_all() {
        let mut random = Random::new(6);
        let points: Vec<Vec3> = (0..500).map(|_| random.direction()).collect();
        let canvas = Canvas {
            points: &points,
            palette: &Palette {
                colours: vec![Vec3::ZERO, Vec3::ONE],
            },
            pictures: 1,
        };
        let mut seen = std::collections::HashSet::new();
        for _ in 0..300 {
            let pattern = Pattern::draw(&mut random, &canvas);
            seen.insert(std::mem::discriminant(&pattern));
            let coverage = points.iter().map(|&point| pattern.coverage(point));
            assert!(
                coverage.clone().all(|part| (0.0..=1.0).contains(&part)),
                "{pattern:?}"
            );
        }
        assert_eq!(seen.len(), 9);
    }
}
