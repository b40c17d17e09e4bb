//! The file of a packed library: a zip archive of a catalogue in JSON, meshes, pictures as JPEG, and panoramas.

use std::collections::BTreeMap;
use std::io::{Cursor, Read, Write};
use std::path::Path;
use std::sync::Arc;

use rayon::prelude::*;
use relight_core::light::Panorama;
use serde::{Deserialize, Serialize};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

use super::LibraryEntry;
use super::codec::{PackedMesh, PackedPanorama, decode_mesh, decode_panorama};
use crate::SynthError;
use crate::mesh::{CREASE, Mesh};
use crate::texture::{PictureKind, TextureImage};

/// The format of the catalogue.
const FORMAT: &str = "relight.library/1";
const CATALOGUE: &str = "catalogue.json";
/// Longest side of the pictures.
pub(super) const MAX_PICTURE_SIDE: usize = 256;
/// Most bytes of a part of the archive: more are damage.
const MAX_BYTES: u64 = 1 << 25;

/// All that a library holds but the meshes, pictures and panoramas themselves.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Catalogue {
    format: String,
    pub(super) objects: Vec<PackedObject>,
    /// What the values of each picture are.
    pictures: Vec<IsColours>,
    pub(super) panoramas: Vec<PackedEntry<PackedPanorama>>,
}

/// Whether a picture's values are colours; else they are data.
type IsColours = bool;
pub(super) type PackedObject = PackedEntry<PackedMesh>;

/// An object or panorama, and what its bytes are.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct PackedEntry<T> {
    #[serde(flatten)]
    pub(super) entry: LibraryEntry,
    pub(super) content: T,
}

/// The part of a packed library to draw from.
#[derive(Debug, Default)]
pub(crate) struct LibraryContents {
    pub(crate) meshes: Vec<(String, Mesh)>,
    pub(crate) panoramas: Vec<(String, Panorama)>,
    /// By name, whether it is for validation only.
    pub(crate) is_for_validation: BTreeMap<String, bool>,
}

fn mesh_name(number: usize) -> String {
    format!("objects/{number:05}.mesh")
}

fn picture_name(number: usize) -> String {
    format!("pictures/{number:05}.jpg")
}

fn panorama_name(number: usize) -> String {
    format!("panoramas/{number:05}.rgbe")
}

/// Parts of a file before they are written.
pub(super) struct Parts {
    pub(super) objects: Vec<(PackedObject, Vec<u8>)>,
    pub(super) pictures: Vec<(PictureKind, Vec<u8>)>,
    pub(super) panoramas: Vec<(PackedEntry<PackedPanorama>, Vec<u8>)>,
}

/// The bytes of a library's file: the same parts give the same bytes.
///
/// # Errors
/// In words; does not occur with parts that fit into memory.
pub(super) fn encode(parts: Parts) -> Result<Vec<u8>, String> {
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
    let mut catalogue = Catalogue {
        format: FORMAT.to_owned(),
        ..Catalogue::default()
    };
    for (number, (object, bytes)) in parts.objects.into_iter().enumerate() {
        add(&mesh_name(number), small, &bytes)?;
        catalogue.objects.push(object);
    }
    for (number, (kind, bytes)) in parts.pictures.into_iter().enumerate() {
        add(&picture_name(number), as_it_is, &bytes)?;
        catalogue.pictures.push(kind == PictureKind::Colours);
    }
    for (number, (panorama, bytes)) in parts.panoramas.into_iter().enumerate() {
        add(&panorama_name(number), small, &bytes)?;
        catalogue.panoramas.push(panorama);
    }
    let json = serde_json::to_vec(&catalogue).map_err(|fault| fault.to_string())?;
    add(CATALOGUE, small, &json)?;
    let cursor = writer.finish().map_err(|fault| fault.to_string())?;
    Ok(cursor.into_inner())
}

/// What a reader wants of a library.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LibraryFilter {
    pub(crate) meshes: bool,
    pub(crate) panoramas: bool,
}

impl LibraryFilter {
    pub(crate) const ALL: Self = Self {
        meshes: true,
        panoramas: true,
    };
}

/// Reads a library from its bytes; errors name it as `path`.
///
/// # Errors
/// [`SynthError::Unusable`] if it is damaged.
pub(crate) fn read(
    path: &Path,
    bytes: &[u8],
    wanted: LibraryFilter,
) -> Result<LibraryContents, SynthError> {
    contents(bytes, wanted).map_err(|why| {
        let fault = format!(
            "is not a library that can be read: {why}; build it again with relight synth library"
        );
        SynthError::unusable(path, fault)
    })
}

fn contents(bytes: &[u8], wanted: LibraryFilter) -> Result<LibraryContents, String> {
    let archive = Archive::open(bytes)?;
    let catalogue: Catalogue = serde_json::from_slice(&archive.part(CATALOGUE)?)
        .map_err(|fault| format!("its catalogue is damaged: {fault}"))?;
    if catalogue.format != FORMAT {
        return Err(format!(
            "its format is {:?}; this version reads {FORMAT:?}",
            catalogue.format
        ));
    }
    let mut contents = LibraryContents::default();
    if wanted.meshes {
        contents.meshes = meshes(&archive, &catalogue)?;
        let marks = catalogue.objects.iter().map(|one| mark(&one.entry));
        contents.is_for_validation.extend(marks);
    }
    if wanted.panoramas {
        let named = catalogue.panoramas.par_iter().enumerate();
        contents.panoramas = named
            .map(|(number, one)| {
                let bytes = archive.part(&panorama_name(number))?;
                let panorama = decode_panorama(one.content, &bytes);
                let panorama = panorama.map_err(|why| named_fault(&one.entry, &why))?;
                Ok((one.entry.name.clone(), panorama))
            })
            .collect::<Result<_, String>>()?;
        let marks = catalogue.panoramas.iter().map(|one| mark(&one.entry));
        contents.is_for_validation.extend(marks);
    }
    Ok(contents)
}

fn mark(entry: &LibraryEntry) -> (String, bool) {
    (entry.name.clone(), entry.is_for_validation)
}

fn named_fault(entry: &LibraryEntry, why: &str) -> String {
    format!("{}: {why}", entry.name)
}

fn meshes(archive: &Archive<'_>, catalogue: &Catalogue) -> Result<Vec<(String, Mesh)>, String> {
    let numbered = catalogue.pictures.par_iter().enumerate();
    let pictures: Vec<(Arc<TextureImage>, PictureKind)> = numbered
        .map(|(number, &is_colours)| {
            let kind = if is_colours {
                PictureKind::Colours
            } else {
                PictureKind::Numbers
            };
            let bytes = archive.part(&picture_name(number))?;
            let image = TextureImage::unpacked(&bytes, kind, MAX_PICTURE_SIDE as u32);
            let image = image.map_err(|fault| format!("picture {number}: {fault}"))?;
            Ok((Arc::new(image), kind))
        })
        .collect::<Result<_, String>>()?;
    let picture = |number: usize, kind: PictureKind| {
        let found = pictures.get(number).filter(|(_, own)| *own == kind);
        let found = found.ok_or_else(|| format!("it names picture {number}, which is missing"));
        found.map(|(image, _)| Arc::clone(image))
    };
    let numbered = catalogue.objects.par_iter().enumerate();
    numbered
        .map(|(number, one)| {
            let bytes = archive.part(&mesh_name(number))?;
            let mesh =
                decode_mesh(&one.content, &bytes, picture).and_then(|raw| Mesh::new(raw, CREASE));
            let mesh = mesh.map_err(|why| named_fault(&one.entry, &why))?;
            Ok((one.entry.name.clone(), mesh))
        })
        .collect()
}

/// A zip archive in memory, whose parts are read in parallel.
struct Archive<'a>(ZipArchive<Cursor<&'a [u8]>>);

impl<'a> Archive<'a> {
    fn open(bytes: &'a [u8]) -> Result<Self, String> {
        let archive = ZipArchive::new(Cursor::new(bytes));
        archive.map(Self).map_err(|fault| fault.to_string())
    }

    fn part(&self, name: &str) -> Result<Vec<u8>, String> {
        let mut archive = self.0.clone();
        let part = archive.by_name(name);
        let part = part.map_err(|fault| format!("{name}: {fault}"))?;
        let mut bytes = Vec::new();
        // What it says of its size may be wrong: it is read piece by piece.
        let read = part.take(MAX_BYTES + 1).read_to_end(&mut bytes);
        read.map_err(|fault| format!("{name}: {fault}"))?;
        if bytes.len() as u64 > MAX_BYTES {
            return Err(format!("{name} is too large"));
        }
        Ok(bytes)
    }
}
