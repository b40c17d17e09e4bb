//! The contact sheet: input and results, side by side.

use relight_core::image::{ColourSpace, Extent, Linear, Planes, Rgb, Srgb};
use relight_core::light::{Normals, ShLight};
use relight_core::render::{DiffuseForm, DiffuseLayer, Surface, exposure_for};
use relight_photo::files::bright;

use crate::error::TurnError;
use crate::fit::solution::TurnSolution;
use crate::observe::curves::TurnCurves;
use crate::observe::reading::ReadTurn;

/// Height of its pictures, pixels. By convention.
const TILE: usize = 256;
/// Pictures in a row. By convention.
const COLUMNS: usize = 4;

/// One sheet: a frame, normals, albedo and shading; confidence, and a ball in the light.
pub(crate) fn contact_sheet(
    turn: &ReadTurn,
    solution: &TurnSolution,
    (surface, light): (&Surface, &ShLight),
) -> Result<Planes<3>, TurnError> {
    let curves = &turn.curves;
    let lit = |planes: &Planes<3>| {
        let white = bright(planes, &turn.mask);
        let shown = planes
            .clone()
            .map(|v| Srgb::from_linear((v / white).clamp(0.0, 1.0)));
        shown.resized(tile(curves))
    };
    let plain = |planes: &Planes<3>| planes.resized(tile(curves));
    let picture = turn.first.first().map(|first| lit(first.planes()));
    let shading = solution.shading(curves);
    let ball = DiffuseLayer::new(light, DiffuseForm::Irradiance);
    let exposure = exposure_for(light);
    let side = tile(curves).height;
    let ball = ball.shading(&Normals::sphere(side)).into_planes();
    let ball = Rgb::<Linear>::new(ball.map(|value| value * exposure));
    let mut ball_tile = Planes::zeros(tile(curves));
    let ball = ball.encode::<Srgb>();
    for y in 0..side {
        for x in 0..side.min(tile(curves).width) {
            ball_tile.set_pixel(x, y, ball.planes().pixel(x, y));
        }
    }
    let tiles = [
        picture.unwrap_or_else(|| Planes::zeros(tile(curves))),
        plain(&surface.normals().to_colours()),
        lit(solution.albedo(curves).planes()),
        lit(shading.planes()),
        plain(&solution.confidence(curves).in_colour()),
        ball_tile,
    ];
    Ok(Planes::sheet(&tiles, COLUMNS)?)
}

/// The size of the sheet's pictures: the frame's shape, `tile` high.
fn tile(curves: &TurnCurves) -> Extent {
    let Extent { width, height } = curves.extent();
    Extent::new((TILE * width / height.max(1)).clamp(1, 8 * TILE), TILE)
}
