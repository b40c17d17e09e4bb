//! Numbers in the buffers of a glTF file.

use super::document::{Accessor, SparseItems};
use super::file::File;

/// Most items of numbers that stand nowhere in the file: they are zeros.
const MOST_ZEROS: usize = 20_000_000;

/// Types of the numbers.
const I8: u32 = 5120;
const U8: u32 = 5121;
const I16: u32 = 5122;
const U16: u32 = 5123;
const U32: u32 = 5125;
const F32: u32 = 5126;

impl File<'_> {
    fn accessor(&self, number: usize) -> Result<&Accessor, String> {
        let all = &self.document.accessors;
        all.get(number)
            .ok_or_else(|| format!("it names accessor {number} of {}", all.len()))
    }

    /// Whether the items of an accessor stand in the file.
    pub(super) fn has_items(&self, number: usize) -> bool {
        let accessor = self.document.accessors.get(number);
        accessor.is_some_and(|one| one.buffer_view.is_some() || one.sparse.is_some())
    }

    /// Whether positions may be whole numbers.
    fn is_quantised(&self) -> bool {
        let used = &self.document.extensions_used;
        let names = used.iter().chain(&self.document.extensions_required);
        names
            .into_iter()
            .any(|name| name == "KHR_mesh_quantization")
    }

    /// Vectors of places or directions.
    pub(super) fn vectors(&self, number: usize) -> Result<Vec<[f32; 3]>, String> {
        let accessor = self.of_kind(number, "VEC3")?;
        if accessor.component_type != F32 && !self.is_quantised() {
            return Err(of_another_kind(number));
        }
        self.numbers(number, accessor.normalized)
    }

    /// Texture coordinates: numbers, or parts of the largest whole number.
    pub(super) fn pairs(&self, number: usize) -> Result<Vec<[f32; 2]>, String> {
        let is_normal = self.of_kind(number, "VEC2")?.normalized;
        self.numbers(number, is_normal || !self.is_quantised())
    }

    /// Colours, without their opacity.
    pub(super) fn colours(&self, number: usize) -> Result<Vec<[f32; 3]>, String> {
        if self.of_kind(number, "VEC3").is_ok() {
            return self.numbers(number, true);
        }
        let all = self.weights(number)?.into_iter();
        Ok(all.map(|[r, g, b, _]| [r, g, b]).collect())
    }

    /// Weights of joints.
    pub(super) fn weights(&self, number: usize) -> Result<Vec<[f32; 4]>, String> {
        self.of_kind(number, "VEC4")?;
        self.numbers(number, true)
    }

    pub(super) fn matrices(&self, number: usize) -> Result<Vec<[f32; 16]>, String> {
        if self.of_kind(number, "MAT4")?.component_type != F32 {
            return Err(of_another_kind(number));
        }
        self.numbers(number, false)
    }

    /// Numbers of vertices.
    pub(super) fn indices(&self, number: usize) -> Result<Vec<u32>, String> {
        self.of_kind(number, "SCALAR")?;
        let all: Vec<[u32; 1]> = self.items(number, index)?;
        Ok(all.into_flattened())
    }

    /// Numbers of joints.
    pub(super) fn joints(&self, number: usize) -> Result<Vec<[u32; 4]>, String> {
        self.of_kind(number, "VEC4")?;
        self.items(number, index)
    }

    fn of_kind(&self, number: usize, kind: &str) -> Result<&Accessor, String> {
        let accessor = self.accessor(number)?;
        let is_it = accessor.kind == kind;
        is_it
            .then_some(accessor)
            .ok_or_else(|| of_another_kind(number))
    }

    /// Whole numbers that are parts of their largest have `is_normal`.
    fn numbers<const N: usize>(
        &self,
        number: usize,
        is_normal: bool,
    ) -> Result<Vec<[f32; N]>, String> {
        let whole = |value: f32, largest: f32| {
            if is_normal {
                (value / largest).max(-1.0)
            } else {
                value
            }
        };
        self.items(number, |kind, bytes| match (kind, bytes) {
            (F32, &[a, b, c, d]) => Some(f32::from_le_bytes([a, b, c, d])),
            (U8, &[a]) => Some(whole(f32::from(a), 255.0)),
            (I8, &[a]) => Some(whole(f32::from(a.cast_signed()), 127.0)),
            (U16, &[a, b]) => Some(whole(f32::from(u16::from_le_bytes([a, b])), 65535.0)),
            (I16, &[a, b]) => Some(whole(f32::from(i16::from_le_bytes([a, b])), 32767.0)),
            _ => None,
        })
    }

    /// The items of an accessor, each of N numbers; those that it changes are changed.
    fn items<T: Copy + Default, const N: usize>(
        &self,
        number: usize,
        read: impl Fn(u32, &[u8]) -> Option<T>,
    ) -> Result<Vec<[T; N]>, String> {
        let accessor = self.accessor(number)?;
        let kind = accessor.component_type;
        let size = size(kind).ok_or_else(|| of_another_kind(number))?;
        let item = |bytes: &[u8]| {
            let mut values = [T::default(); N];
            for (value, bytes) in values.iter_mut().zip(bytes.chunks(size)) {
                *value = read(kind, bytes).ok_or_else(|| of_another_kind(number))?;
            }
            Ok(values)
        };
        let beyond = |why: Option<String>| {
            why.unwrap_or_else(|| format!("accessor {number} reaches beyond its buffer"))
        };
        let count = accessor.count;
        let mut all = match accessor.buffer_view {
            Some(view) => {
                let stride = self
                    .document
                    .buffer_views
                    .get(view)
                    .and_then(|view| view.byte_stride);
                let placed = Placed {
                    view,
                    offset: accessor.byte_offset,
                    stride: stride.unwrap_or(size * N).max(size * N),
                };
                let bytes = self.placed(placed, size * N, count).map_err(beyond)?;
                bytes.map(item).collect::<Result<Vec<_>, String>>()?
            }
            None if count > MOST_ZEROS => return Err(beyond(None)),
            None => vec![[T::default(); N]; count],
        };
        let Some(sparse) = &accessor.sparse else {
            return Ok(all);
        };
        let tight = |items: &SparseItems, size: usize| Placed {
            view: items.buffer_view,
            offset: items.byte_offset,
            stride: size,
        };
        let index_kind = sparse.indices.component_type.unwrap_or_default();
        let index_size = self::size(index_kind).ok_or_else(|| of_another_kind(number))?;
        let indices = self.placed(tight(&sparse.indices, index_size), index_size, sparse.count);
        let values = self.placed(tight(&sparse.values, size * N), size * N, sparse.count);
        for (place, bytes) in indices.map_err(beyond)?.zip(values.map_err(beyond)?) {
            let place = index(index_kind, place).ok_or_else(|| of_another_kind(number))?;
            let changed = all.get_mut(place as usize);
            *changed
                .ok_or_else(|| format!("accessor {number} changes item {place} of {count}"))? =
                item(bytes)?;
        }
        Ok(all)
    }

    /// Items of `size` bytes; all of them lie within their buffer. None where they do not.
    fn placed(
        &self,
        at: Placed,
        size: usize,
        count: usize,
    ) -> Result<impl Iterator<Item = &[u8]>, Option<String>> {
        let within = self.view(at.view).map_err(Some)?;
        // The last item need not be followed by its padding.
        let length = at.stride.checked_mul(count.saturating_sub(1));
        let length =
            length.and_then(|length| length.checked_add(size.min(size.saturating_mul(count))));
        let end = length.and_then(|length| at.offset.checked_add(length));
        let bytes = end.and_then(|end| within.get(at.offset..end)).ok_or(None)?;
        Ok(bytes
            .chunks(at.stride)
            .filter_map(move |item| item.get(..size)))
    }
}

/// Where items stand.
#[derive(Clone, Copy)]
struct Placed {
    view: usize,
    offset: usize,
    /// Bytes from one to the next.
    stride: usize,
}

fn size(kind: u32) -> Option<usize> {
    match kind {
        I8 | U8 => Some(1),
        I16 | U16 => Some(2),
        U32 | F32 => Some(4),
        _ => None,
    }
}

fn index(kind: u32, bytes: &[u8]) -> Option<u32> {
    match (kind, bytes) {
        (U8, &[a]) => Some(u32::from(a)),
        (U16, &[a, b]) => Some(u32::from(u16::from_le_bytes([a, b]))),
        (U32, &[a, b, c, d]) => Some(u32::from_le_bytes([a, b, c, d])),
        _ => None,
    }
}

fn of_another_kind(number: usize) -> String {
    format!("accessor {number} holds numbers of another kind")
}
