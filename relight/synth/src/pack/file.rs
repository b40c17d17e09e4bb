//! The file of a packed library: a zip archive of a catalogue in JSON, meshes, pictures as JPEG, and panoramas.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::{Cursor, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rayon::prelude::*;
use relight_core::light::Panorama;
use serde::{Deserialize, Serialize};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

use super::LibraryEntry;
use super::mesh::{MAX_PICTURE_SIDE, PackedMesh, Pictures};
use crate::SynthError;
use crate::mesh::{CREASE, Mesh};
use crate::texture::{PictureKind, TextureImage};

/// The format of the catalogue.
const FORMAT: &str = "relight.library/1";
const CATALOGUE: &str = "catalogue.json";
/// Most bytes of a part of the archive: more are damage.
const MAX_BYTES: u64 = 1 << 25;

/// What a library holds, in the order of its parts.
#[derive(Debug, Default, Serialize, Deserialize)]
struct Catalogue {
    format: String,
    objects: Vec<LibraryEntry>,
    panoramas: Vec<LibraryEntry>,
}

fn mesh_name(number: usize) -> String {
    format!("objects/{number:05}.cbor")
}

fn picture_name(name: &str) -> String {
    format!("pictures/{name}")
}

fn panorama_name(number: usize) -> String {
    format!("panoramas/{number:05}.hdr")
}

/// Parts of a file before they are written: entries with their bytes.
#[derive(Default)]
pub(super) struct Parts {
    pub(super) objects: Vec<(LibraryEntry, Vec<u8>)>,
    pub(super) pictures: Pictures,
    pub(super) panoramas: Vec<(LibraryEntry, Vec<u8>)>,
}

impl Parts {
    /// The bytes of a library's file: the same parts give the same bytes.
    ///
    /// # Errors
    /// In words; does not occur with parts that fit into memory.
    pub(super) fn encode(&self) -> Result<Vec<u8>, String> {
        let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
        let small = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Deflated)
            .compression_level(Some(9));
        let as_it_is = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
        let mut add = |name: &str, options: SimpleFileOptions, bytes: &[u8]| {
            writer
                .start_file(name, options)
                .map_err(|fault| fault.to_string())?;
            writer.write_all(bytes).map_err(|fault| fault.to_string())
        };
        for (number, (_, bytes)) in self.objects.iter().enumerate() {
            add(&mesh_name(number), small, bytes)?;
        }
        for (name, bytes) in &self.pictures {
            add(&picture_name(name), as_it_is, bytes)?;
        }
        for (number, (_, bytes)) in self.panoramas.iter().enumerate() {
            add(&panorama_name(number), small, bytes)?;
        }
        let entries =
            |of: &[(LibraryEntry, Vec<u8>)]| of.iter().map(|(one, _)| one.clone()).collect();
        let catalogue = Catalogue {
            format: FORMAT.to_owned(),
            objects: entries(&self.objects),
            panoramas: entries(&self.panoramas),
        };
        let json = serde_json::to_vec(&catalogue).map_err(|fault| fault.to_string())?;
        add(CATALOGUE, small, &json)?;
        let cursor = writer.finish().map_err(|fault| fault.to_string())?;
        Ok(cursor.into_inner())
    }
}

/// A packed library in memory, whose parts are read in parallel.
pub(crate) struct PackedLibrary {
    path: PathBuf,
    archive: ZipArchive<Cursor<Arc<[u8]>>>,
    catalogue: Catalogue,
}

impl PackedLibrary {
    /// Reads a file.
    ///
    /// # Errors
    /// [`SynthError::Unusable`] if it is damaged.
    pub(crate) fn read(path: &Path) -> Result<Self, SynthError> {
        Self::from_bytes(path, &fs::read(path).map_err(SynthError::read(path))?)
    }

    /// The same from a file's bytes; errors name it as `path`.
    ///
    /// # Errors
    /// [`SynthError::Unusable`] if it is damaged.
    pub(crate) fn from_bytes(path: &Path, bytes: &[u8]) -> Result<Self, SynthError> {
        let archive = ZipArchive::new(Cursor::new(bytes.into()));
        let mut library = Self {
            path: path.to_owned(),
            archive: archive.map_err(|fault| damaged(path, &fault.to_string()))?,
            catalogue: Catalogue::default(),
        };
        let catalogue = library.part(CATALOGUE, |bytes| {
            let catalogue: Catalogue =
                serde_json::from_slice(bytes).map_err(|fault| fault.to_string())?;
            if catalogue.format != FORMAT {
                let found = &catalogue.format;
                return Err(format!(
                    "its format is {found:?}; this version reads {FORMAT:?}"
                ));
            }
            Ok(catalogue)
        });
        library.catalogue = catalogue?;
        Ok(library)
    }

    /// By the names of objects and panoramas, whether they are for validation only.
    pub(crate) fn is_for_validation(&self) -> impl Iterator<Item = (String, bool)> {
        let entries = self
            .catalogue
            .objects
            .iter()
            .chain(&self.catalogue.panoramas);
        entries.map(|entry| (entry.name.clone(), entry.is_for_validation))
    }

    /// Its panoramas by name.
    ///
    /// # Errors
    /// [`SynthError::Unusable`] if one is damaged.
    pub(crate) fn panoramas(&self) -> Result<Vec<(String, Panorama)>, SynthError> {
        let numbered = self.catalogue.panoramas.par_iter().enumerate();
        numbered
            .map(|(number, entry)| {
                let decode = |bytes: &[u8]| {
                    Panorama::from_bytes(Path::new(&entry.name), bytes)
                        .map_err(|fault| fault.to_string())
                };
                Ok((
                    entry.name.clone(),
                    self.part(&panorama_name(number), decode)?,
                ))
            })
            .collect()
    }

    /// Its objects by name.
    ///
    /// # Errors
    /// [`SynthError::Unusable`] if one is damaged.
    pub(crate) fn meshes(&self) -> Result<Vec<(String, Mesh)>, SynthError> {
        let numbered = (0..self.catalogue.objects.len()).into_par_iter();
        let packed = numbered.map(|number| self.part(&mesh_name(number), PackedMesh::decode));
        let packed: Vec<PackedMesh> = packed.collect::<Result<_, _>>()?;
        let wanted: BTreeSet<(String, PictureKind)> =
            packed.iter().flat_map(PackedMesh::pictures).collect();
        let pictures = wanted.into_par_iter().map(|(name, kind)| {
            let decode = |bytes: &[u8]| {
                TextureImage::unpacked(bytes, kind, MAX_PICTURE_SIDE as u32)
                    .map_err(|fault| fault.to_string())
            };
            let image = self.part(&picture_name(&name), decode)?;
            Ok(((name, kind), Arc::new(image)))
        });
        let pictures: BTreeMap<_, Arc<TextureImage>> =
            pictures.collect::<Result<_, SynthError>>()?;
        let named = self.catalogue.objects.par_iter().zip(packed);
        named
            .map(|(entry, packed)| {
                let mesh = packed
                    .unpacked(&pictures)
                    .and_then(|raw| Mesh::new(raw, CREASE));
                let mesh =
                    mesh.map_err(|why| damaged(&self.path, &format!("{}: {why}", entry.name)))?;
                Ok((entry.name.clone(), mesh))
            })
            .collect()
    }

    /// What the bytes of a part hold.
    fn part<T>(
        &self,
        name: &str,
        decode: impl FnOnce(&[u8]) -> Result<T, String>,
    ) -> Result<T, SynthError> {
        let mut bytes = Vec::new();
        let mut archive = self.archive.clone();
        let part = archive.by_name(name).map_err(|fault| fault.to_string());
        let decoded = part.and_then(|part| {
            // What it says of its size may be wrong: it is read piece by piece.
            let read = part.take(MAX_BYTES + 1).read_to_end(&mut bytes);
            read.map_err(|fault| fault.to_string())?;
            if bytes.len() as u64 > MAX_BYTES {
                return Err("it is too large".to_owned());
            }
            decode(&bytes)
        });
        decoded.map_err(|why| damaged(&self.path, &format!("{name}: {why}")))
    }
}

fn damaged(path: &Path, why: &str) -> SynthError {
    let fault = format!(
        "is not a library that can be read: {why}; build it again with relight synth library"
    );
    SynthError::unusable(path, fault)
}
