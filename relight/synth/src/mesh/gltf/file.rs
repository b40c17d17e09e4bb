//! The parts of a glTF file: its JSON, and the bytes of its buffers, which lie within it or in files of its folder.

use std::borrow::Cow;
use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use percent_encoding::percent_decode_str;

use super::document::Document;
use crate::mesh::sidecar_files::by_address;

/// How a binary file begins.
const MAGIC: [u8; 4] = *b"glTF";
/// Length of its header, and of that of each of its parts.
const HEADER: usize = 12;
const PART_HEADER: usize = 8;

/// How the extensions begin that a file may require: those that are read,
const FINE: [&str; 12] = [
    "EXT_texture_webp",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    // those of pictures that are left out,
    "EXT_texture_avif",
    "KHR_texture_basisu",
    "MSFT_texture_dds",
    // and those that change neither the shape nor the plain colour.
    "ADOBE_materials_",
    "EXT_lights_",
    "KHR_animation_",
    "KHR_lights_",
    "KHR_materials_",
    "KHR_xmp",
];

/// A file's JSON and its buffers.
#[derive(Debug)]
pub(super) struct File<'a> {
    pub(super) path: &'a Path,
    pub(super) document: Document,
    /// Each with the reason for which it cannot be used.
    buffers: Vec<Result<Cow<'a, [u8]>, String>>,
}

impl<'a> File<'a> {
    pub(super) fn parsed(path: &'a Path, bytes: &'a [u8]) -> Result<Self, String> {
        let (json, binary) = if bytes.starts_with(&MAGIC) {
            parts(bytes)?
        } else {
            (bytes, None)
        };
        let json = json.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(json);
        let document: Document = serde_json::from_slice(json)
            .map_err(|fault| format!("its JSON is not that of glTF 2.0: {fault}"))?;
        check(&document)?;
        let buffers = document.buffers.iter().enumerate();
        let buffers = buffers.map(|(number, buffer)| {
            let bytes = match &buffer.uri {
                Some(uri) => Cow::Owned(linked(path, uri)?),
                None => Cow::Borrowed(binary.filter(|_| number == 0).ok_or("has no bytes")?),
            };
            let (found, length) = (bytes.len(), buffer.byte_length);
            if found < length {
                return Err(format!("has {found} bytes of {length}"));
            }
            Ok(bytes)
        });
        let buffers = buffers.collect();
        Ok(Self {
            path,
            document,
            buffers,
        })
    }

    /// The bytes of a part of a buffer.
    pub(super) fn view(&self, number: usize) -> Result<&[u8], String> {
        let views = &self.document.buffer_views;
        let view = views
            .get(number)
            .ok_or_else(|| format!("buffer view {number} is named; there are {}", views.len()))?;
        let bytes = match self.buffers.get(view.buffer) {
            Some(Ok(bytes)) => bytes,
            Some(Err(why)) => {
                let compressed = view.extensions.keys().find(|one| one.contains("meshopt"));
                return Err(match compressed {
                    Some(extension) => not_read(extension),
                    None => format!("its buffer {} {why}", view.buffer),
                });
            }
            None => return Err(format!("buffer view {number} has no buffer")),
        };
        let end = view.byte_offset.checked_add(view.byte_length);
        let within = end.and_then(|end| bytes.get(view.byte_offset..end));
        within.ok_or_else(|| format!("buffer view {number} reaches beyond its buffer"))
    }

    /// The bytes of a picture.
    pub(super) fn picture(&self, number: usize) -> Result<Cow<'_, [u8]>, String> {
        let image = self.document.images.get(number);
        let image = image.ok_or_else(|| "is missing".to_owned())?;
        match (image.buffer_view, &image.uri) {
            (Some(view), _) => Ok(Cow::Borrowed(self.view(view)?)),
            (None, Some(uri)) => Ok(Cow::Owned(linked(self.path, uri)?)),
            (None, None) => Err("has neither bytes nor a file".to_owned()),
        }
    }
}

/// An extension is required and not supported.
pub(super) fn not_read(extension: &str) -> String {
    format!("it needs the glTF extension {extension}, which is not supported: save it without")
}

/// The JSON of a binary file and its first buffer.
fn parts(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    let number = |at: usize| {
        let bytes = bytes.get(at..)?.first_chunk()?;
        Some(u32::from_le_bytes(*bytes))
    };
    let cut_off = || "it is cut off".to_owned();
    match number(4).ok_or_else(cut_off)? {
        2 => {}
        version => return Err(format!("it is glTF {version}, and only glTF 2.0 is read")),
    }
    let length = number(8).ok_or_else(cut_off)? as usize;
    if length > bytes.len() || length < HEADER {
        let found = bytes.len();
        return Err(format!("its header states {length} bytes; it has {found}"));
    }
    let (mut json, mut binary) = (None, None);
    let mut at = HEADER;
    while let (Some(size), Some(kind)) = (number(at), number(at.saturating_add(4))) {
        let start = at + PART_HEADER;
        let part = bytes.get(start..start.saturating_add(size as usize));
        let part = part.ok_or_else(cut_off)?;
        match &kind.to_le_bytes() {
            b"JSON" if json.is_none() => json = Some(part),
            b"BIN\0" if binary.is_none() => binary = Some(part),
            _ => {}
        }
        at = start + part.len();
        if at >= length {
            break;
        }
    }
    Ok((json.ok_or_else(|| "it has no JSON".to_owned())?, binary))
}

/// Whether it can be read at all.
fn check(document: &Document) -> Result<(), String> {
    if let Some(version) = &document.asset.version
        && !version.starts_with("2.")
    {
        return Err(format!("it is glTF {version}, and only glTF 2.0 is read"));
    }
    let is_fine = |name: &str| FINE.iter().any(|start| name.starts_with(start));
    let mut required = document.extensions_required.iter();
    match required.find(|name| !is_fine(name)) {
        Some(extension) => Err(not_read(extension)),
        None => Ok(()),
    }
}

/// The target of an address: data within it, or a file in the folder of the mesh.
fn linked(path: &Path, uri: &str) -> Result<Vec<u8>, String> {
    if let Some(data) = uri.strip_prefix("data:") {
        let (kind, text) = data.split_once(',').ok_or("holds no data")?;
        if !kind.ends_with(";base64") {
            return Ok(percent_decode_str(text).collect());
        }
        return STANDARD
            .decode(text)
            .map_err(|fault| format!("holds damaged data: {fault}"));
    }
    let beside = by_address(path, uri)
        .ok_or_else(|| format!("is the file {uri:?}, which is missing in the mesh's folder"))?;
    std::fs::read(&beside)
        .map_err(|fault| format!("is the file {uri:?}, which cannot be read: {fault}"))
}
