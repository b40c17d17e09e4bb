//! Reading the files of a sample.

use std::io;
use std::path::Path;

use super::TruthSample;
use super::layout::{Entry, NormalFile, Part, Role, TruthLayout};
use crate::data::SampleFault;
use crate::data::error::check_extent;
use crate::image::{ImageError, Linear, Planes, Rgb, read_planes};
use crate::light::{Normals, YDown, YUp};

pub(super) fn sample(entry: &Entry, layout: TruthLayout) -> Result<TruthSample, SampleFault> {
    let parts = Parts { entry, layout };
    let mask = parts.binary(Role::Mask)?;
    let mask = mask.ok_or_else(|| SampleFault::Missing {
        part: "mask".to_owned(),
    })?;
    let sample = TruthSample {
        name: entry.name.clone(),
        image: parts.colour(Role::Image)?,
        diffuse: parts.colour(Role::Diffuse)?,
        normals: parts.normals()?,
        albedo: parts.colour(Role::Albedo)?,
        shading: parts.colour(Role::Shading)?,
        highlight: parts.colour(Role::Highlight)?,
        light: None,
        mask,
    };
    check_extents(&sample)?;
    Ok(sample)
}

struct Parts<'a> {
    entry: &'a Entry,
    layout: TruthLayout,
}

impl Parts<'_> {
    fn colour(&self, role: Role) -> Result<Option<Rgb<Linear>>, SampleFault> {
        let transfer = self.layout.transfer(role);
        self.read(role, |path| Rgb::read(path, transfer))
    }

    fn normals(&self) -> Result<Option<Normals<YUp>>, SampleFault> {
        let file = self.layout.normal_file();
        let normals = self.read(Role::Normals, |path| read_normals(path, file))?;
        match (normals, self.binary(Role::NormalsValid)?) {
            (Some(normals), Some(valid)) => only_where(&normals, &valid).map(Some),
            (normals, _) => Ok(normals),
        }
    }

    /// 1 where the file is at least half white.
    fn binary(&self, role: Role) -> Result<Option<Planes<1>>, SampleFault> {
        self.read(role, |path| {
            let (planes, _) = read_planes(path)?;
            let extent = planes.extent();
            let [plane, _, _] = planes.into_planes();
            let plane = Planes::from_planes(extent, [plane])?;
            Ok(plane.map(|value| f32::from(u8::from(value >= 0.5))))
        })
    }

    /// What `read` makes of the file of this role; none where the sample may lack it and does.
    fn read<T>(
        &self,
        role: Role,
        read: impl Fn(&Path) -> Result<T, ImageError>,
    ) -> Result<Option<T>, SampleFault> {
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

fn read_normals(path: &Path, file: NormalFile) -> Result<Normals<YUp>, ImageError> {
    Ok(match file {
        NormalFile::YUp => Normals::<YUp>::read(path)?,
        NormalFile::YDown => Normals::<YDown>::read(path)?.flipped(),
        NormalFile::RedDownGreenRight => {
            let (colours, _) = read_planes(path)?;
            let extent = colours.extent();
            let [down, right, viewer] = colours.into_planes();
            let colours = Planes::from_planes(extent, [right, down, viewer])?;
            Normals::<YDown>::from_colours(colours).flipped()
        }
    })
}

/// The normals without those where `valid` is 0.
fn only_where(normals: &Normals<YUp>, valid: &Planes<1>) -> Result<Normals<YUp>, SampleFault> {
    check_extent("map of valid normals", valid.extent(), normals.extent())?;
    let mut planes = normals.planes().clone();
    for plane in planes.planes_mut() {
        for (value, valid) in plane.iter_mut().zip(valid.plane(0)) {
            *value *= valid;
        }
    }
    Ok(Normals::new(planes))
}

fn check_extents(sample: &TruthSample) -> Result<(), SampleFault> {
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
