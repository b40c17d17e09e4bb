//! Numbers in the buffers of a glTF file.

use super::document::Accessor;
use super::file::File;

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
            .ok_or_else(|| format!("it names accessor {number}, and has {}", all.len()))
    }

    /// Whether the items of an accessor stand in the file.
    pub(super) fn has_items(&self, number: usize) -> bool {
        let accessor = self.document.accessors.get(number);
        accessor.is_some_and(|one| one.buffer_view.is_some())
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
        self.of_kind(number, "VEC4")?;
        let all: Vec<[f32; 4]> = self.numbers(number, true)?;
        Ok(all.into_iter().map(|[r, g, b, _]| [r, g, b]).collect())
    }

    /// Numbers of vertices.
    pub(super) fn indices(&self, number: usize) -> Result<Vec<u32>, String> {
        self.of_kind(number, "SCALAR")?;
        let all: Vec<[u32; 1]> = self.items(number, index)?;
        Ok(all.into_flattened())
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

    /// The items of an accessor, each of N numbers.
    fn items<T: Copy + Default, const N: usize>(
        &self,
        number: usize,
        read: impl Fn(u32, &[u8]) -> Option<T>,
    ) -> Result<Vec<[T; N]>, String> {
        let accessor = self.accessor(number)?;
        if accessor.sparse.is_some() {
            return Err(format!(
                "accessor {number} is sparse, which is not supported: save it with all its items"
            ));
        }
        let (kind, count) = (accessor.component_type, accessor.count);
        let size = size(kind).ok_or_else(|| of_another_kind(number))?;
        let view = accessor.buffer_view;
        let view = view.ok_or_else(|| format!("accessor {number} has no buffer view"))?;
        let stride = self.document.buffer_views.get(view);
        let stride = stride.and_then(|view| view.byte_stride).unwrap_or(0);
        let stride = stride.max(size * N);
        // The last item need not be followed by its padding.
        let length = match count.checked_sub(1) {
            Some(before) => stride
                .checked_mul(before)
                .and_then(|all| all.checked_add(size * N)),
            None => Some(0),
        };
        let end = length.and_then(|length| accessor.byte_offset.checked_add(length));
        let bytes = self.view(view)?;
        let bytes = end.and_then(|end| bytes.get(accessor.byte_offset..end));
        let bytes = bytes.ok_or_else(|| format!("accessor {number} reaches beyond its buffer"))?;
        let item = |bytes: &[u8]| {
            let mut values = [T::default(); N];
            for (value, bytes) in values.iter_mut().zip(bytes.chunks(size)) {
                *value = read(kind, bytes).ok_or_else(|| of_another_kind(number))?;
            }
            Ok(values)
        };
        bytes.chunks(stride).map(item).collect()
    }
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
