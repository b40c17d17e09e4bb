//! Printed forms on a plane: rectangles, discs, stars, bars, checks.

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

use super::super::random::{mix, unit_of};
use super::frame::{Frame, step};

/// Width of an edge of print, object units: sharper than any other pattern's, as print is.
const EDGE: f32 = 0.012;
/// Modules of a bar code.
const BARS: u32 = 40;

/// A filled shape on a plane.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Mark {
    pub(super) frame: Frame,
    pub(super) form: Form,
}

/// Its form. Lengths are in units of its frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Form {
    /// A rectangle with rounded corners.
    Label {
        half: Vec2,
        corner: f32,
    },
    /// The border of such a rectangle.
    Border {
        half: Vec2,
        corner: f32,
        width: f32,
    },
    Disc,
    Ring {
        width: f32,
    },
    /// A star, or a polygon where `depth` is 0.
    Star {
        points: u32,
        depth: f32,
    },
    /// Parallel bars of random widths.
    Bars {
        seed: u64,
        half: Vec2,
    },
    /// Squares in two colours.
    Checks {
        half: Vec2,
        cells: u32,
    },
}

impl Mark {
    /// Its coverage at a point, 0..=1. `unit` of the frame in object units makes the edge as sharp for all
    /// sizes.
    pub(super) fn coverage(&self, point: Vec3) -> f32 {
        let inside = self.form.depth(self.frame.place(point));
        step(inside, EDGE / self.frame.unit())
    }
}

impl Form {
    /// How far inside the form a place is; negative outside.
    fn depth(self, at: Vec2) -> f32 {
        match self {
            Self::Label { half, corner } => rectangle(at, half, corner),
            Self::Border {
                half,
                corner,
                width,
            } => {
                let depth = rectangle(at, half, corner);
                depth.min(width - depth)
            }
            Self::Disc => 1.0 - at.length(),
            Self::Ring { width } => (1.0 - at.length()).min(at.length() - 1.0 + width),
            Self::Star { points, depth } => star(at, points, depth),
            Self::Bars { seed, half } => {
                let within = rectangle(at, half, 0.0);
                let module = (at.x / half.x + 1.0) * 0.5 * BARS as f32;
                let place = module.floor().clamp(0.0, BARS as f32 - 1.0);
                let is_dark = |k: f32| unit_of(mix(seed ^ k as u64)) < 0.5;
                let width = 2.0 * half.x / BARS as f32;
                let to_edge = (module - place).min(place + 1.0 - module) * width;
                within.min(if is_dark(place) { to_edge } else { -to_edge })
            }
            Self::Checks { half, cells } => {
                let within = rectangle(at, half, 0.0);
                let cell = (at / half + 1.0) * 0.5 * cells as f32;
                let inner = cell - cell.floor() - 0.5;
                let side = 2.0 * half / cells as f32;
                let to_edge = ((Vec2::splat(0.5) - inner.abs()) * side).min_element();
                let is_dark = (cell.x.floor() + cell.y.floor()).rem_euclid(2.0) < 1.0;
                within.min(if is_dark { to_edge } else { -to_edge })
            }
        }
    }
}

fn rectangle(at: Vec2, half: Vec2, corner: f32) -> f32 {
    let beyond = at.abs() - half + corner;
    corner - beyond.max(Vec2::ZERO).length() - beyond.max_element().min(0.0)
}

fn star(at: Vec2, points: u32, depth: f32) -> f32 {
    let sector = std::f32::consts::TAU / points.max(3) as f32;
    let angle = at.to_angle().rem_euclid(sector) - sector / 2.0;
    let part = (angle.abs() / (sector / 2.0)).min(1.0);
    // Between a valley and a tip the edge is straight enough.
    (1.0 - depth) + depth * part - at.length()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forms_are_where_they_say_they_are() {
        let half = Vec2::new(1.0, 0.5);
        let inside = |form: Form, x: f32, y: f32| form.depth(Vec2::new(x, y)) > 0.0;
        let label = Form::Label { half, corner: 0.2 };
        assert!(inside(label, 0.9, 0.0) && inside(label, 0.0, 0.45));
        assert!(!inside(label, 0.99, 0.49) && !inside(label, 1.1, 0.0));
        let border = Form::Border {
            half,
            corner: 0.0,
            width: 0.1,
        };
        assert!(inside(border, 0.95, 0.0) && !inside(border, 0.5, 0.0));
        assert!(inside(Form::Ring { width: 0.3 }, 0.8, 0.0));
        assert!(!inside(Form::Ring { width: 0.3 }, 0.5, 0.0));
        let star = Form::Star {
            points: 5,
            depth: 0.5,
        };
        assert!(inside(star, 0.1, 0.1) && !inside(star, 1.1, 0.0));
        let checks = Form::Checks {
            half: Vec2::ONE,
            cells: 2,
        };
        assert!(inside(checks, -0.5, -0.5) && inside(checks, 0.5, 0.5));
        assert!(!inside(checks, -0.5, 0.5) && !inside(checks, 1.5, 1.5));
    }

    #[test]
    fn a_bar_code_has_dark_and_light_bars() {
        let bars = Form::Bars {
            seed: 3,
            half: Vec2::ONE,
        };
        let middles = (0..BARS).map(|k| (k as f32 + 0.5) / BARS as f32 * 2.0 - 1.0);
        let dark = middles.filter(|&x| bars.depth(Vec2::new(x, 0.0)) > 0.0);
        assert!((8..32).contains(&dark.count()));
    }
}
