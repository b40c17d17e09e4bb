//! Pictures of an object in light that stands or turns, at its place in its photograph.

use std::f32::consts::PI;

use super::{InsertError, MaterialChange, PanoramaView, RelightableObject, exposure_between};
use relight_core::image::{Linear, Planes, Rgb, check_extent};
use relight_core::light::{Direction, Panorama, Rotation, ShLight};

/// What stands behind a relit object.
#[derive(Debug, Clone)]
pub enum Backdrop {
    /// What its photograph shows there.
    Photo,
    /// One colour, linear.
    Even([f32; 3]),
    /// The panorama that lights it, seen by a camera that does not turn with the light.
    Panorama(PanoramaView, Panorama),
}

/// An object of a photograph, and the light in which it is to be shown. All that does not depend on the light's angle is
/// computed once, so that nothing flickers while it turns.
#[derive(Debug)]
pub struct RelightingSequence<'a> {
    photo: &'a Rgb<Linear>,
    relightable: &'a RelightableObject,
    /// In the subject's units.
    light: ShLight,
    backdrop: Backdrop,
    exposure: f32,
}

impl<'a> RelightingSequence<'a> {
    /// The object in this light, times `exposure`. The light is brought to the strength of the photograph's own:
    /// [`exposure_between`]. A panorama behind it is as bright as a white diffuse surface in its light would be.
    ///
    /// # Errors
    /// If the photograph is not the subject's.
    pub fn new(
        photo: &'a Rgb<Linear>,
        relightable: &'a RelightableObject,
        light: &ShLight,
        backdrop: Backdrop,
        exposure: f32,
    ) -> Result<Self, InsertError> {
        check_extent("photograph", photo.planes().extent(), relightable.photo)?;
        let scale = exposure_between(&relightable.light, light);
        Ok(Self {
            photo,
            relightable,
            light: light.clone().tinted([f64::from(scale); 3]),
            backdrop: match backdrop {
                Backdrop::Panorama(view, panorama) => {
                    let planes = panorama.image().planes().clone();
                    let radiance = planes.map(|v| v.max(0.0) * exposure * scale * PI);
                    Backdrop::Panorama(view, Panorama::new(Rgb::new(radiance))?)
                }
                Backdrop::Even(colour) => Backdrop::Even(colour.map(|v| v * exposure)),
                Backdrop::Photo => Backdrop::Photo,
            },
            exposure,
        })
    }

    /// The picture after the light has turned about the vertical by so many radians, from the viewer to the right.
    ///
    /// # Errors
    /// As [`RelightableObject::relit`].
    pub fn picture(&self, turn: f64) -> Result<Rgb<Linear>, InsertError> {
        let turned = self.turned(turn);
        let relit = self
            .relightable
            .relit(&turned, &MaterialChange::default())?;
        let colours = relit.map(|v| v * self.exposure);
        Ok(match self.background(turn) {
            None => self.relightable.in_place(self.photo, &colours),
            Some(background) => self.relightable.before(&background, &colours),
        })
    }

    fn turned(&self, turn: f64) -> ShLight {
        // Not even rounding is to change light that does not turn.
        if turn == 0.0 {
            return self.light.clone();
        }
        self.light.rotated(&Rotation::about(Direction::UP, turn))
    }

    fn background(&self, turn: f64) -> Option<Rgb<Linear>> {
        match &self.backdrop {
            Backdrop::Photo => None,
            Backdrop::Even(colour) => Some(Rgb::new(Planes::filled(
                self.photo.planes().extent(),
                *colour,
            ))),
            Backdrop::Panorama(view, panorama) => Some(view.picture(panorama, turn)),
        }
    }
}
