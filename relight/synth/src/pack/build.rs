//! A library out of folders and archives.

use std::collections::{BTreeMap, HashMap};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::Vec3;
use rayon::prelude::*;
use relight_core::image::Extent;
use relight_core::light::Panorama;
use relit_data::durable::write_whole;
use relit_data::shard::Digest;

use super::candidates::{Candidate, Candidates};
use super::codec::{PackedPanorama, decode_mesh, encode_panorama};
use super::file::{PackedEntry, Parts, encode};
use super::prepare::{EXCLUDED, PreparedObject, REPEATED, Reason, UNREADABLE};
use super::table::{Row, write_table};
use super::{LibraryEntry, UNKNOWN};
use crate::SynthError;
use crate::library::SkippedFile;
use crate::mesh::{CREASE, Mesh};
use crate::texture::{PictureKind, TextureImage};

/// Largest size of panoramas: larger ones are made smaller.
const MAX_PANORAMA: Extent = Extent::new(512, 256);
/// The size at which two panoramas are compared, and how far they may be apart, in parts of their own variance.
const THUMBNAIL: Extent = Extent::new(32, 16);
const ALIKE: f32 = 0.02;

/// Folders and archives that a library is built from.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct LibrarySources {
    /// With `.obj`, `.gltf`, `.glb` and `.sh3f`, also in folders within them; or such archives themselves.
    pub meshes: Vec<PathBuf>,
    /// With `.hdr` and `.exr`, also in folders within them.
    pub panoramas: Vec<PathBuf>,
}

/// The contents of a library, and what was left out.
#[derive(Debug, Clone, Default)]
pub struct LibrarySummary {
    /// Its objects.
    pub objects: Vec<LibraryEntry>,
    /// Its panoramas.
    pub panoramas: Vec<LibraryEntry>,
    /// How many objects and panoramas are left out, by the reason.
    pub left_out: BTreeMap<String, usize>,
    /// Files that cannot be read, and missing parts of used objects, such as pictures.
    pub faults: Vec<SkippedFile>,
    /// Of the file.
    pub bytes: usize,
}

impl LibrarySummary {
    /// The origins whose licence is unknown.
    pub fn without_licence(&self) -> Vec<&str> {
        let entries = self.objects.iter().chain(&self.panoramas);
        let unknown = entries.filter(|entry| entry.licence == UNKNOWN);
        let mut origins: Vec<&str> = unknown.map(|entry| entry.origin.as_str()).collect();
        origins.sort_unstable();
        origins.dedup();
        origins
    }
}

/// Builds a library and writes it to `out`, with its table as `.csv` in the same folder. What cannot be read is left
/// out. `progress` is called with the number of files, and then once a file.
///
/// # Errors
/// If a folder is not there or holds nothing, if no object or no panorama is left of those that were asked for, or
/// where a file cannot be written.
pub fn build_library(
    sources: &LibrarySources,
    out: &Path,
    progress: &(dyn Fn(Option<usize>) + Sync),
) -> Result<LibrarySummary, SynthError> {
    let objects = Candidates::objects(&sources.meshes)?;
    let panoramas = Candidates::panoramas(&sources.panoramas)?;
    progress(Some(objects.all.len() + panoramas.all.len()));
    let mut building = Building::default();
    building.add_objects(&objects.all, progress);
    building.add_panoramas(&panoramas.all, progress);
    let asked = [&sources.meshes, &sources.panoramas].map(|folders| !folders.is_empty());
    let found = [building.objects.is_empty(), building.panoramas.is_empty()];
    if asked == [false; 2] || (asked[0] && found[0]) || (asked[1] && found[1]) {
        let fault = "no object, or no panorama, is left for the library: give other folders";
        return Err(SynthError::Refused(fault.to_owned()));
    }
    let (parts, mut summary, rows) = building.finish();
    let bytes = encode(parts).map_err(SynthError::Refused)?;
    summary.bytes = bytes.len();
    write_whole(out, &bytes).map_err(SynthError::write(out))?;
    write_table(out, &rows)?;
    Ok(summary)
}

/// What a library is made of so far.
#[derive(Default)]
struct Building {
    objects: Vec<(LibraryEntry, PreparedObject)>,
    panoramas: Vec<(LibraryEntry, PackedPanorama, Vec<u8>)>,
    summary: LibrarySummary,
    rows: Vec<Row>,
}

impl Building {
    fn add_objects(&mut self, all: &[Candidate], progress: &(dyn Fn(Option<usize>) + Sync)) {
        let read = all.par_iter().map(|candidate| {
            let prepared = PreparedObject::read(candidate).and_then(PreparedObject::checked);
            progress(None);
            prepared
        });
        let mut shapes: HashMap<Digest, String> = HashMap::new();
        for (candidate, prepared) in all.iter().zip(read.collect::<Vec<_>>()) {
            let prepared = prepared.and_then(|one| match shapes.get(&one.digest) {
                Some(name) => Err(Reason::new(REPEATED, name)),
                None => Ok(one),
            });
            let prepared = match prepared {
                Ok(prepared) => prepared,
                Err(reason) => {
                    self.leave_out("object", candidate, &reason);
                    continue;
                }
            };
            let entry = &candidate.entry;
            shapes.insert(prepared.digest, entry.name.clone());
            self.rows.push(Row {
                triangles: prepared.mesh.triangles,
                note: prepared.missing.join("; "),
                ..Row::new("object", entry)
            });
            let faults = prepared.missing.iter().map(|what| SkippedFile {
                path: PathBuf::from(&entry.name),
                what: what.clone(),
            });
            self.summary.faults.extend(faults);
            self.objects.push((entry.clone(), prepared));
        }
    }

    fn add_panoramas(&mut self, all: &[Candidate], progress: &(dyn Fn(Option<usize>) + Sync)) {
        let read = all.par_iter().map(|candidate| {
            let panorama = small_panorama(candidate);
            progress(None);
            panorama
        });
        let mut thumbnails: Vec<(String, Vec<f32>)> = Vec::new();
        for (candidate, panorama) in all.iter().zip(read.collect::<Vec<_>>()) {
            let entry = &candidate.entry;
            let small = panorama.and_then(|panorama| {
                let thumbnail = thumbnail(&panorama);
                let mut others = thumbnails.iter();
                match others.find(|(_, other)| are_alike(other, &thumbnail)) {
                    Some((name, _)) => Err(Reason::new(REPEATED, name)),
                    None => Ok((panorama, thumbnail)),
                }
            });
            match small {
                Ok((panorama, thumbnail)) => {
                    thumbnails.push((entry.name.clone(), thumbnail));
                    let (packed, bytes) = encode_panorama(&panorama);
                    self.rows.push(Row::new("panorama", entry));
                    self.panoramas.push((entry.clone(), packed, bytes));
                }
                Err(reason) => self.leave_out("panorama", candidate, &reason),
            }
        }
    }

    fn leave_out(&mut self, what: &'static str, candidate: &Candidate, reason: &Reason) {
        if reason.kind == REPEATED && candidate.entry.is_for_validation {
            self.keep_apart(&reason.detail);
        }
        let kind = format!("{what}s: {}", reason.kind);
        *self.summary.left_out.entry(kind).or_default() += 1;
        if reason.kind == UNREADABLE {
            self.summary.faults.push(SkippedFile {
                path: PathBuf::from(&candidate.entry.name),
                what: format!("is left out: {}", reason.detail),
            });
        }
        self.rows.push(Row {
            is_left_out: true,
            note: reason.to_string(),
            ..Row::new(what, &candidate.entry)
        });
    }

    /// Nothing is learned from what is kept apart under another name.
    fn keep_apart(&mut self, name: &str) {
        let objects = self.objects.iter_mut().map(|(entry, _)| entry);
        let panoramas = self.panoramas.iter_mut().map(|(entry, ..)| entry);
        let rows = self.rows.iter_mut().map(|row| &mut row.entry);
        let mut all = objects.chain(panoramas).chain(rows);
        while let Some(entry) = all.find(|entry| entry.name == name) {
            entry.is_for_validation = true;
        }
    }

    /// Numbers the pictures. Each is kept once.
    fn finish(mut self) -> (Parts, LibrarySummary, Vec<Row>) {
        let mut parts = Parts {
            objects: Vec::new(),
            pictures: Vec::new(),
            panoramas: Vec::new(),
        };
        let mut numbers: HashMap<(PictureKind, Digest), usize> = HashMap::new();
        for (entry, mut prepared) in self.objects {
            self.summary.objects.push(entry.clone());
            let own = prepared.pictures.into_iter().map(|(kind, bytes)| {
                let key = (kind, Digest::hash(&bytes));
                *numbers.entry(key).or_insert_with(|| {
                    parts.pictures.push((kind, bytes));
                    parts.pictures.len() - 1
                })
            });
            let own: Vec<usize> = own.collect();
            for material in &mut prepared.mesh.materials {
                let pictures = [&mut material.picture, &mut material.factors];
                for picture in pictures.into_iter().flatten() {
                    picture.number = own.get(picture.number).copied().unwrap_or(usize::MAX);
                }
            }
            let object = PackedEntry {
                entry,
                content: prepared.mesh,
            };
            parts.objects.push((object, prepared.bytes));
        }
        for (entry, content, bytes) in self.panoramas {
            self.summary.panoramas.push(entry.clone());
            parts
                .panoramas
                .push((PackedEntry { entry, content }, bytes));
        }
        (parts, self.summary, self.rows)
    }
}

impl PreparedObject {
    /// The same where a surface is read from it again.
    fn checked(self) -> Result<Self, Reason> {
        let grey = |_, _| {
            let grey = TextureImage::from_fn(1, 1, |_, _| Vec3::splat(0.5));
            Ok(Arc::new(grey))
        };
        decode_mesh(&self.mesh, &self.bytes, grey)
            .and_then(|raw| Mesh::new(raw, CREASE))
            .map_err(Reason::unreadable)?;
        Ok(self)
    }
}

/// The panorama of a file, made small.
fn small_panorama(candidate: &Candidate) -> Result<Panorama, Reason> {
    if let Some(why) = &candidate.leave_out {
        return Err(Reason::new(EXCLUDED, why));
    }
    let panorama =
        Panorama::read(&candidate.path).map_err(|fault| Reason::unreadable(fault.to_string()))?;
    let rows = panorama.extent().height;
    let planes = panorama.image().planes();
    let is_black = |rows: Range<usize>| {
        let width = panorama.extent().width;
        let pixels = rows.flat_map(|y| (0..width).map(move |x| (x, y)));
        pixels
            .into_iter()
            .all(|(x, y)| planes.pixel(x, y).into_iter().all(|value| value <= 0.0))
    };
    // What was not photographed is black.
    if is_black(0..rows.div_ceil(8)) || is_black(rows - rows.div_ceil(8)..rows) {
        let why = "its upper or lower end is black: it does not show everything around";
        return Err(Reason::unreadable(why));
    }
    let is_large = panorama.extent().width > MAX_PANORAMA.width;
    Ok(if is_large {
        panorama.resized(MAX_PANORAMA)
    } else {
        panorama
    })
}

/// A panorama in few pixels, in the logarithm, without its mean.
fn thumbnail(panorama: &Panorama) -> Vec<f32> {
    let small = panorama.resized(THUMBNAIL);
    let levels = small.image().planes().planes().into_iter().flatten();
    let mut levels: Vec<f32> = levels.map(|level| level.max(1e-6).ln()).collect();
    let mean = levels.iter().sum::<f32>() / levels.len() as f32;
    levels.iter_mut().for_each(|level| *level -= mean);
    levels
}

fn are_alike(one: &[f32], other: &[f32]) -> bool {
    let square =
        |values: &mut dyn Iterator<Item = f32>| values.map(|value| value * value).sum::<f32>();
    let apart = square(&mut one.iter().zip(other).map(|(a, b)| a - b));
    apart < ALIKE * square(&mut one.iter().copied())
}
