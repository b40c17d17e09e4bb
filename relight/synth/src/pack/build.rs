//! A library out of folders and archives.

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use relit_data::durable::write_whole;
use relit_data::shard::Digest;

use super::candidates::{Candidate, Candidates};
use super::file::Parts;
use super::panorama;
use super::prepare::{PreparedObject, REPEATED, Reason, UNREADABLE};
use super::table::{Row, write_table};
use super::{LibraryEntry, UNKNOWN};
use crate::SynthError;
use crate::library::SkippedFile;

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
    let Building {
        parts,
        rows,
        mut summary,
    } = building;
    let found = [parts.objects.is_empty(), parts.panoramas.is_empty()];
    if asked == [false; 2] || (asked[0] && found[0]) || (asked[1] && found[1]) {
        let fault = "no object, or no panorama, is left for the library: give other folders";
        return Err(SynthError::Refused(fault.to_owned()));
    }
    let bytes = parts.encode().map_err(SynthError::Refused)?;
    let entries =
        |of: Vec<(LibraryEntry, Vec<u8>)>| of.into_iter().map(|(entry, _)| entry).collect();
    summary.objects = entries(parts.objects);
    summary.panoramas = entries(parts.panoramas);
    summary.bytes = bytes.len();
    write_whole(out, &bytes).map_err(SynthError::write(out))?;
    write_table(out, &rows)?;
    Ok(summary)
}

/// What a library is made of so far.
#[derive(Default)]
struct Building {
    parts: Parts,
    summary: LibrarySummary,
    rows: Vec<Row>,
}

impl Building {
    fn add_objects(&mut self, all: &[Candidate], progress: &(dyn Fn(Option<usize>) + Sync)) {
        let read = all.par_iter().map(|candidate| {
            let prepared = PreparedObject::read(candidate);
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
                triangles: prepared.triangles,
                note: prepared.missing.join("; "),
                ..Row::new("object", entry)
            });
            let faults = prepared.missing.iter().map(|what| SkippedFile {
                path: PathBuf::from(&entry.name),
                what: what.clone(),
            });
            self.summary.faults.extend(faults);
            self.parts.pictures.extend(prepared.pictures);
            self.parts.objects.push((entry.clone(), prepared.mesh));
        }
    }

    fn add_panoramas(&mut self, all: &[Candidate], progress: &(dyn Fn(Option<usize>) + Sync)) {
        let read = all.par_iter().map(|candidate| {
            let panorama = panorama::read(candidate);
            progress(None);
            panorama
        });
        let mut thumbnails: Vec<(String, Vec<f32>)> = Vec::new();
        for (candidate, panorama) in all.iter().zip(read.collect::<Vec<_>>()) {
            let entry = &candidate.entry;
            let small = panorama.and_then(|panorama| {
                let thumbnail = panorama::thumbnail(&panorama);
                let mut others = thumbnails.iter();
                match others.find(|(_, other)| panorama::are_alike(other, &thumbnail)) {
                    Some((name, _)) => Err(Reason::new(REPEATED, name)),
                    None => Ok((panorama::encode(&panorama)?, thumbnail)),
                }
            });
            match small {
                Ok((bytes, thumbnail)) => {
                    thumbnails.push((entry.name.clone(), thumbnail));
                    self.rows.push(Row::new("panorama", entry));
                    self.parts.panoramas.push((entry.clone(), bytes));
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
        let Parts {
            objects, panoramas, ..
        } = &mut self.parts;
        let entries = objects.iter_mut().chain(panoramas).map(|(entry, _)| entry);
        let mut all = entries.chain(self.rows.iter_mut().map(|row| &mut row.entry));
        while let Some(entry) = all.find(|entry| entry.name == name) {
            entry.is_for_validation = true;
        }
    }
}
