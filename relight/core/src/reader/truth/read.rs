//! Reading the files of a sample.

use std::fs;
use std::io;
use std::path::Path;

use serde::Deserialize;

use super::TruthSample;
use super::layout::{Entry, Part, Role, TruthLayout};
use crate::files::read_planes;
use crate::image::{ImageError, Linear, Planes, Rgb, check_extent};
use crate::light::{Normals, ShLight};
use crate::reader::ReadError;
use relit_data::text;

pub(super) fn sample(entry: &Entry, layout: TruthLayout) -> Result<TruthSample, ReadError> {
    let parts = Parts { entry, layout };
    let whites = parts.whites()?;
    let image = parts.colour(Role::Image, 1.0)?;
    let albedo = parts.colour(Role::Albedo, 1.0)?;
    let shading = parts.colour(Role::Shading, whites.shading)?;
    let mask = parts.binary(Role::Mask)?;
    let mask = mask.ok_or_else(|| ReadError::missing("mask"))?;
    let diffuse = match parts.colour(Role::Diffuse, 1.0)? {
        Some(diffuse) => Some(diffuse),
        None => product(albedo.as_ref(), shading.as_ref())?,
    };
    let sample = TruthSample {
        name: entry.name.clone(),
        image,
        diffuse,
        normals: parts.normals()?,
        albedo,
        shading,
        highlight: parts.colour(Role::Highlight, whites.highlight)?,
        light: parts.light()?,
        mask,
    };
    check_extents(&sample)?;
    Ok(sample)
}

/// What the largest values of files stand for.
#[derive(Deserialize)]
struct Whites {
    shading: f32,
    highlight: f32,
}

struct Parts<'a> {
    entry: &'a Entry,
    layout: TruthLayout,
}

impl Parts<'_> {
    /// The image in a file whose largest value stands for `white`.
    fn colour(&self, role: Role, white: f32) -> Result<Option<Rgb<Linear>>, ReadError> {
        let transfer = self.layout.transfer(role);
        let image = self.read(role, |path| Rgb::<Linear>::read(path, transfer))?;
        let scaled = |image: Rgb<Linear>| image.into_planes().map(|value| value * white);
        Ok(image.map(|image| Rgb::new(scaled(image))))
    }

    fn whites(&self) -> Result<Whites, ReadError> {
        #[derive(Deserialize)]
        struct Description {
            white: Whites,
        }
        let Some(path) = self.path(Role::Whites) else {
            return Ok(Whites {
                shading: 1.0,
                highlight: 1.0,
            });
        };
        let bytes = fs::read(path).map_err(ReadError::read(path))?;
        let parsed: Result<Description, _> = serde_json::from_slice(text::unmarked(&bytes));
        Ok(parsed.map_err(ReadError::numbers(path))?.white)
    }

    fn light(&self) -> Result<Option<ShLight>, ReadError> {
        let Some(path) = self.path(Role::Light) else {
            return Ok(None);
        };
        let text = text::read(path).map_err(ReadError::read(path))?;
        text.parse().map(Some).map_err(ReadError::numbers(path))
    }

    fn path(&self, role: Role) -> Option<&Path> {
        let part = self.entry.parts.iter().find(|part| part.role == role);
        part.map(|part| part.path.as_path())
    }

    fn normals(&self) -> Result<Option<Normals>, ReadError> {
        let normals = self.read(Role::Normals, |path| match self.layout {
            TruthLayout::Janner => read_turned_normals(path),
            _ => Normals::read(path),
        })?;
        match (normals, self.binary(Role::NormalsValid)?) {
            (Some(normals), Some(valid)) => only_where(&normals, &valid).map(Some),
            (normals, _) => Ok(normals),
        }
    }

    /// 1 where the file is at least half white.
    fn binary(&self, role: Role) -> Result<Option<Planes<1>>, ReadError> {
        self.read(role, |path| {
            let (planes, _) = read_planes(path)?;
            let extent = planes.extent();
            let [plane, _, _] = planes.into_planes();
            let plane = Planes::from_planes(extent, [plane])?;
            Ok(plane.map(|value| f32::from(u8::from(value >= 0.5))))
        })
    }

    /// The result of `read` on the file of this role; `None` if the file is optional and missing.
    fn read<T>(
        &self,
        role: Role,
        read: impl Fn(&Path) -> Result<T, ImageError>,
    ) -> Result<Option<T>, ReadError> {
        let Some(Part { path, required, .. }) =
            self.entry.parts.iter().find(|part| part.role == role)
        else {
            return Ok(None);
        };
        match read(path) {
            Ok(found) => Ok(Some(found)),
            Err(ImageError::Open { source, .. })
                if !required && source.kind() == io::ErrorKind::NotFound =>
            {
                Ok(None)
            }
            Err(error) => Err(error.into()),
        }
    }
}

/// Albedo times shading.
fn product(
    albedo: Option<&Rgb<Linear>>,
    shading: Option<&Rgb<Linear>>,
) -> Result<Option<Rgb<Linear>>, ReadError> {
    let (Some(albedo), Some(shading)) = (albedo, shading) else {
        return Ok(None);
    };
    let mut planes = albedo.planes().clone();
    check_extent("shading", shading.planes().extent(), planes.extent())?;
    for (plane, shading) in planes
        .planes_mut()
        .into_iter()
        .zip(shading.planes().planes())
    {
        for (value, shading) in plane.iter_mut().zip(shading) {
            *value *= shading;
        }
    }
    Ok(Some(Rgb::new(planes)))
}

/// Normals whose red is y down and whose green is x.
fn read_turned_normals(path: &Path) -> Result<Normals, ImageError> {
    let (colours, _) = read_planes(path)?;
    let extent = colours.extent();
    let [down, right, viewer] = colours.into_planes();
    let colours = Planes::from_planes(extent, [right, down, viewer])?;
    Ok(Normals::from_colours(colours).flipped())
}

/// The normals without those where `valid` is 0.
fn only_where(normals: &Normals, valid: &Planes<1>) -> Result<Normals, ReadError> {
    check_extent("map of valid normals", valid.extent(), normals.extent())?;
    let planes = normals.planes().clone();
    Ok(Normals::new(
        planes.zip(valid, |value, valid| value * valid),
    ))
}

fn check_extents(sample: &TruthSample) -> Result<(), ReadError> {
    let size = |image: &Option<Rgb<Linear>>| image.as_ref().map(|rgb| rgb.planes().extent());
    let parts = [
        ("image", size(&sample.image)),
        ("image without highlights", size(&sample.diffuse)),
        ("albedo", size(&sample.albedo)),
        ("shading", size(&sample.shading)),
        ("highlight", size(&sample.highlight)),
        ("normal map", sample.normals.as_ref().map(Normals::extent)),
    ];
    for (part, extent) in parts {
        if let Some(extent) = extent {
            check_extent(part, extent, sample.extent())?;
        }
    }
    Ok(())
}
