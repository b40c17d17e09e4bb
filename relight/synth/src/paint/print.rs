//! Print, as on packages, books, tools and toys: labels, lines of glyphs, logos, bar codes, and large letters. Dark and
//! neutral mostly, on white and on coloured grounds: what a network takes for shadow that has never seen any.

use glam::{Vec2, Vec3};

use super::super::random::Random;
use super::frame::Frame;
use super::mark::{Form, Mark};
use super::palette::Inks;
use super::pattern::Pattern;
use super::writing::Writing;

/// A colour, and where it is printed.
type Print = (Vec3, Pattern);

/// The print on an object.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Design {
    /// A label with lines of glyphs on it.
    Label,
    /// Lines of glyphs on the ground itself.
    Glyphs,
    /// A filled form, alone or with a line of glyphs below.
    Logo,
    /// A bar code on a label.
    Code,
    /// A few letters as large as the object.
    Letters,
    /// Checks.
    Checks,
}

impl Design {
    fn draw(random: &mut Random) -> Self {
        random.weighted([
            (Self::Label, 0.3),
            (Self::Glyphs, 0.2),
            (Self::Logo, 0.2),
            (Self::Letters, 0.15),
            (Self::Code, 0.08),
            (Self::Checks, 0.07),
        ])
    }
}

/// Print on a ground: one to three designs.
pub(super) fn draw(random: &mut Random, points: &[Vec3], inks: &Inks) -> Vec<Print> {
    let designs = random.weighted([(1, 0.4), (2, 0.4), (3, 0.2)]);
    let mut coats = Vec::new();
    for _ in 0..designs {
        let around = match points.get(random.index(points.len())) {
            Some(&point) => point,
            None => random.direction(),
        };
        let design = Design::draw(random);
        let scale = match design {
            Design::Letters => random.uniform(0.35..0.7),
            _ => random.uniform(0.15..0.5),
        };
        let frame = Frame::along_surface(random, points, around, scale);
        print(random, design, &frame, inks, &mut coats);
    }
    coats
}

fn print(random: &mut Random, design: Design, frame: &Frame, inks: &Inks, coats: &mut Vec<Print>) {
    let half = Vec2::new(1.0, random.uniform(0.4..1.0));
    let corner = random.pick([0.0, 0.08, 0.3]) * half.y;
    let label = Form::Label { half, corner };
    match design {
        Design::Label => {
            coats.push(mark(frame, label, inks.label));
            if random.chance(0.4) {
                let width = random.uniform(0.04..0.12);
                let border = Form::Border {
                    half,
                    corner,
                    width,
                };
                coats.push(mark(frame, border, inks.ink));
            }
            coats.push(glyphs(random, frame, half * 0.85, inks.ink));
        }
        Design::Glyphs => coats.push(glyphs(random, frame, half, inks.ink)),
        Design::Logo => {
            let form = match random.index(4) {
                0 => Form::Disc,
                1 => Form::Ring {
                    width: random.uniform(0.15..0.5),
                },
                2 => Form::Label { half, corner },
                _ => Form::Star {
                    points: random.count(3..9) as u32,
                    depth: random.uniform(0.0..0.6),
                },
            };
            coats.push(mark(frame, form, inks.ink));
            if random.chance(0.5) {
                let below = frame.shifted(Vec2::new(0.0, -1.5), 1.0);
                coats.push(glyphs(random, &below, Vec2::new(1.1, 0.3), inks.ink));
            }
        }
        Design::Code => {
            coats.push(mark(frame, label, inks.label));
            let bars = Form::Bars {
                seed: random.seed(),
                half: half * Vec2::new(0.85, 0.75),
            };
            coats.push(mark(frame, bars, inks.ink));
        }
        Design::Letters => coats.push(glyphs(random, frame, Vec2::new(1.4, 0.8), inks.ink)),
        Design::Checks => {
            let cells = random.count(3..10) as u32;
            let half = Vec2::splat(random.uniform(0.8..2.0));
            coats.push(mark(frame, Form::Checks { half, cells }, inks.ink));
        }
    }
}

fn mark(frame: &Frame, form: Form, colour: Vec3) -> Print {
    let frame = *frame;
    (colour, Pattern::Mark(Mark { frame, form }))
}

/// Lines of glyphs that fill a rectangle.
fn glyphs(random: &mut Random, frame: &Frame, half: Vec2, colour: Vec3) -> Print {
    let lines = random.count(1..5);
    let pattern = Pattern::Writing(Writing::filling(random, frame, half, lines as u32));
    (colour, pattern)
}
