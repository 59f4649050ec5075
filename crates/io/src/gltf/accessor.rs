//! Bounds-checked accessors of glTF: all component types, strided and tightly packed, normalised,
//! sparse, and without a buffer view.
//!
//! All checks happen when an accessor is opened; reading an element cannot fail. No alignment is
//! required.

use std::borrow::Cow;
use std::cell::Cell;
use std::collections::HashMap;

use super::document::Document;
use super::entries::{BufferEntry, SparseEntry};
use crate::folder::Folder;
use crate::import::{DecodeBudget, Fault, FaultPlace, ImportResult, sanitise_text};
use crate::uri;

/// Type of an accessor's components.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ComponentType {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl ComponentType {
    /// Returns the type of a `componentType` code.
    ///
    /// # Errors
    /// A fault of kind input for an unknown code.
    pub fn from_code(code: u32) -> ImportResult<Self> {
        Ok(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => {
                return Err(fault!("has the unknown componentType {code}"));
            }
        })
    }

    /// Size in bytes.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// Whether the type is allowed for indices.
    fn is_unsigned(self) -> bool {
        matches!(self, Self::U8 | Self::U16 | Self::U32)
    }
}

/// Returns the number of components of an element type, such as 3 for `VEC3`.
///
/// # Errors
/// A fault of kind input for an unknown type, and for matrices with padded columns, which no
/// supported property uses.
pub(super) fn element_arity(kind: &str) -> ImportResult<usize> {
    Ok(match kind {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" => 4,
        "MAT4" => 16,
        "MAT2" | "MAT3" => {
            return Err(fault!(
                "has the matrix type {kind}; of the matrix types, only MAT4 is supported"
            ));
        }
        _ => {
            return Err(fault!("has the unknown type {}", sanitise_text(kind)));
        }
    })
}

/// Opens the accessors of a file.
pub(super) struct AccessorReader<'a> {
    pub document: &'a Document,
    pub buffers: &'a Buffers<'a>,
    /// Largest size of an accessor in bytes.
    pub memory_bytes: u64,
    /// Number of bytes that may still be given to accessors without data, whose elements are zeros.
    pub zero_bytes_left: Cell<u64>,
}

/// Largest total size of all accessors without data, in bytes. Without a limit, a few bytes of JSON
/// could fill the memory.
pub(super) const MAX_ZERO_BYTES: u64 = 256 << 20;

/// An opened accessor, whose ranges and indices are checked.
#[derive(Debug)]
pub(super) struct Accessor<'a> {
    count: usize,
    arity: usize,
    component: ComponentType,
    normalised: bool,
    /// Bytes from the first element to the end of the last; empty if all elements are zero.
    bytes: &'a [u8],
    stride: usize,
    /// Elements replaced by a sparse accessor, by ascending index.
    patches: Vec<(u32, &'a [u8])>,
}

impl<'a> AccessorReader<'a> {
    /// Opens an accessor and checks all its ranges and indices.
    ///
    /// # Errors
    /// A fault of kind input that names the accessor; of kind limit beyond the memory limit.
    pub fn open(&self, index: usize) -> ImportResult<Accessor<'a>> {
        self.open_accessor(index)
            .with_place(format_args!("accessors[{index}]"))
    }

    fn open_accessor(&self, index: usize) -> ImportResult<Accessor<'a>> {
        let accessor = find_entry(&self.document.accessors, "accessors", index)?;
        let component = ComponentType::from_code(accessor.component_type)?;
        let arity = element_arity(&accessor.kind)?;
        let size = component.size() * arity;
        let count = usize::try_from(accessor.count).unwrap_or(usize::MAX);
        if (count as u64).saturating_mul(size as u64) > self.memory_bytes {
            return Err(Fault::over_limit(format!(
                "has {count} elements of {size} bytes, more than the memory limit of {} MiB; raise the limit with --max-memory",
                self.memory_bytes >> 20
            )));
        }
        let (bytes, stride) = match accessor.buffer_view {
            _ if let Some(decoded) = self.buffers.decoded_accessor(index) => (decoded, size),
            Some(view) => self.slice_view(view, accessor.byte_offset, count, size)?,
            None => (self.reserve_zeros(count, size)?, size),
        };
        let patches = match &accessor.sparse {
            Some(sparse) => self.read_sparse(sparse, count, size).with_place("sparse")?,
            None => Vec::new(),
        };
        Ok(Accessor {
            count,
            arity,
            component,
            normalised: accessor.normalized,
            bytes,
            stride,
            patches,
        })
    }

    /// Reserves `count` zero elements of `size` bytes each for an accessor without data. Returns an
    /// empty slice, which stands for the zeros.
    fn reserve_zeros(&self, count: usize, size: usize) -> ImportResult<&'a [u8]> {
        let left = self
            .zero_bytes_left
            .get()
            .checked_sub((count as u64).saturating_mul(size as u64));
        self.zero_bytes_left.set(left.ok_or_else(|| {
            Fault::over_limit(format!(
                "has {count} elements without data, which are read as zeros; the zeros of all accessors of the file exceed the limit of 256 MiB"
            ))
        })?);
        Ok(&[])
    }

    /// Returns `count` elements of a buffer view, from byte `offset` on: their bytes, and the
    /// distance in bytes between the starts of two elements (the stride).
    fn slice_view(
        &self,
        view: u32,
        offset: u64,
        count: usize,
        size: usize,
    ) -> ImportResult<(&'a [u8], usize)> {
        let (bytes, stride) = self.buffers.view_bytes(self.document, view as usize)?;
        let stride = stride.unwrap_or(size);
        if stride < size {
            return Err(fault!(
                "has a stride of {stride} bytes, less than its elements of {size} bytes"
            ));
        }
        let beyond = || {
            fault!(
                "{count} elements reach beyond bufferViews[{view}], which has {} bytes",
                bytes.len()
            )
        };
        let start = usize::try_from(offset).map_err(|_| beyond())?;
        let length = match count {
            0 => 0,
            n => (n - 1)
                .checked_mul(stride)
                .and_then(|last| last.checked_add(size))
                .ok_or_else(beyond)?,
        };
        let end = start.checked_add(length).ok_or_else(beyond)?;
        Ok((bytes.get(start..end).ok_or_else(beyond)?, stride))
    }

    /// Reads the elements that a sparse accessor replaces, each with its index, sorted by index.
    fn read_sparse(
        &self,
        sparse: &SparseEntry,
        count: usize,
        size: usize,
    ) -> ImportResult<Vec<(u32, &'a [u8])>> {
        let replaced = usize::try_from(sparse.count).unwrap_or(usize::MAX);
        if replaced > count {
            return Err(fault!(
                "replaces {replaced} elements, but the accessor has only {count}"
            ));
        }
        let component =
            ComponentType::from_code(sparse.indices.component_type).with_place("indices")?;
        if !component.is_unsigned() {
            return Err(fault!(
                "indices: the component type is not an unsigned integer"
            ));
        }
        let (indices, index_stride) = self.slice_view(
            sparse.indices.buffer_view,
            sparse.indices.byte_offset,
            replaced,
            component.size(),
        )?;
        let (values, value_stride) = self.slice_view(
            sparse.values.buffer_view,
            sparse.values.byte_offset,
            replaced,
            size,
        )?;
        let mut patches = Vec::with_capacity(replaced);
        for (index, value) in indices
            .chunks(index_stride)
            .zip(values.chunks(value_stride))
        {
            let index = read_unsigned(component, index);
            if index as usize >= count {
                return Err(fault!(
                    "replaces element {index}, but the accessor has only {count} elements"
                ));
            }
            patches.push((index, value));
        }
        // The specification requires strictly increasing indices. Of repeated indices, the last
        // applies.
        patches.sort_by_key(|&(index, _)| index);
        Ok(patches)
    }
}

impl Accessor<'_> {
    /// Number of elements.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Number of components per element.
    pub fn element_arity(&self) -> usize {
        self.arity
    }

    /// Whether the components are allowed as indices.
    pub fn is_unsigned(&self) -> bool {
        self.component.is_unsigned()
    }

    /// Treats integer components as normalised, even if the file does not mark the accessor as
    /// normalised.
    pub fn mark_as_normalised(&mut self) {
        self.normalised = true;
    }

    /// Returns an element as floats; components beyond the element's own are zero. Normalised
    /// integers become fractions of the largest value of their type (glTF 2.0, section 3.11).
    pub fn read_vector<const N: usize>(&self, element: usize) -> [f32; N] {
        let bytes = self.element_bytes(element);
        let size = self.component.size();
        let mut out = [0.0; N];
        for (i, slot) in out.iter_mut().enumerate().take(self.arity) {
            *slot = self.read_component(bytes.get(i * size..).unwrap_or_default());
        }
        out
    }

    /// Returns an element as an index; only for unsigned components.
    pub fn read_index(&self, element: usize) -> u32 {
        read_unsigned(self.component, self.element_bytes(element))
    }

    /// Returns an element as several indices; only for unsigned components.
    pub fn read_indices<const N: usize>(&self, element: usize) -> [u32; N] {
        let (bytes, size) = (self.element_bytes(element), self.component.size());
        core::array::from_fn(|i| {
            read_unsigned(self.component, bytes.get(i * size..).unwrap_or_default())
        })
    }

    fn element_bytes(&self, element: usize) -> &[u8] {
        let after = self
            .patches
            .partition_point(|&(index, _)| index as usize <= element);
        match after.checked_sub(1).and_then(|i| self.patches.get(i)) {
            Some(&(index, value)) if index as usize == element => value,
            _ => self.bytes.get(element * self.stride..).unwrap_or_default(),
        }
    }

    fn read_component(&self, bytes: &[u8]) -> f32 {
        // The quotient is computed in f64 and then rounded. For 8-bit and 16-bit integers, a
        // division in f32 would give the same result; but f32 cannot represent every u32.
        let (value, largest) = match self.component {
            ComponentType::F32 => return f32::from_le_bytes(first_bytes(bytes)),
            ComponentType::I8 => (
                f64::from(i8::from_le_bytes(first_bytes(bytes))),
                f64::from(i8::MAX),
            ),
            ComponentType::U8 => (
                f64::from(u8::from_le_bytes(first_bytes(bytes))),
                f64::from(u8::MAX),
            ),
            ComponentType::I16 => (
                f64::from(i16::from_le_bytes(first_bytes(bytes))),
                f64::from(i16::MAX),
            ),
            ComponentType::U16 => (
                f64::from(u16::from_le_bytes(first_bytes(bytes))),
                f64::from(u16::MAX),
            ),
            ComponentType::U32 => (
                f64::from(u32::from_le_bytes(first_bytes(bytes))),
                f64::from(u32::MAX),
            ),
        };
        (if self.normalised {
            (value / largest).max(-1.0)
        } else {
            value
        }) as f32
    }
}

/// Returns the first `N` bytes, padded with zeros.
fn first_bytes<const N: usize>(bytes: &[u8]) -> [u8; N] {
    bytes.first_chunk::<N>().copied().unwrap_or([0; N])
}

/// Reads a little-endian unsigned number of 1, 2 or 4 bytes.
fn read_unsigned(component: ComponentType, bytes: &[u8]) -> u32 {
    match component.size() {
        1 => u32::from(u8::from_le_bytes(first_bytes(bytes))),
        2 => u32::from(u16::from_le_bytes(first_bytes(bytes))),
        _ => u32::from_le_bytes(first_bytes(bytes)),
    }
}

// Binary data of a glTF file: buffers from the container, from other files or from the JSON
// itself, and buffer views.

/// All buffers of a file, each truncated to its length in the JSON.
pub(super) struct Buffers<'a> {
    /// Contents of each buffer; `None` for a buffer without data, which only an extension may use.
    /// Reading such a buffer is an error.
    data: Vec<Option<Cow<'a, [u8]>>>,
    /// Decompressed contents of compressed buffer views, by index of the view.
    views: HashMap<usize, Vec<u8>>,
    /// Decompressed elements of accessors whose primitives are compressed, tightly packed, by index
    /// of the accessor.
    accessors: HashMap<usize, Vec<u8>>,
}

impl<'a> Buffers<'a> {
    /// Loads every buffer.
    ///
    /// # Errors
    /// A fault of kind input for a missing, refused or short buffer.
    pub fn load(
        document: &Document,
        binary: Option<&'a [u8]>,
        folder: &Folder,
        budget: &mut DecodeBudget,
    ) -> ImportResult<Self> {
        let mut data = Vec::new();
        for (i, buffer) in document.buffers.iter().enumerate() {
            let bytes =
                load_buffer(buffer, i, binary, folder).with_place(format_args!("buffers[{i}]"))?;
            if let Some(Cow::Owned(bytes)) = &bytes {
                budget.reserve_memory(bytes.len(), 1)?;
            }
            data.push(bytes);
        }
        Ok(Self {
            data,
            views: HashMap::new(),
            accessors: HashMap::new(),
        })
    }

    /// Returns the bytes of a buffer view and, if the file states it, the distance in bytes between
    /// the view's elements (the stride).
    ///
    /// # Errors
    ///
    /// A fault of kind input for an unknown view or buffer, or a view beyond its buffer.
    pub fn view_bytes(
        &self,
        document: &Document,
        index: usize,
    ) -> ImportResult<(&[u8], Option<usize>)> {
        let view = find_entry(&document.buffer_views, "bufferViews", index)?;
        let stride = view.byte_stride;
        if let Some(bytes) = self.views.get(&index) {
            return Ok((bytes, stride));
        }
        self.buffer_range(view.buffer as usize, view.byte_offset, view.byte_length)
            .map(|bytes| (bytes, stride))
            .with_place(format_args!("bufferViews[{index}]"))
    }

    /// Returns `length` bytes of a buffer from byte `start` on.
    ///
    /// # Errors
    /// A fault of kind input for an unknown buffer, or for bytes beyond the end of the buffer.
    pub fn buffer_range(&self, buffer: usize, start: u64, length: u64) -> ImportResult<&[u8]> {
        let data = find_entry(&self.data, "buffers", buffer)?;
        let missing = || {
            fault!("buffers[{buffer}] has no uri, and the file has no binary chunk for this buffer")
        };
        let data = data.as_ref().ok_or_else(missing)?;
        let end = start.checked_add(length);
        let range = usize::try_from(start)
            .ok()
            .zip(end.and_then(|end| usize::try_from(end).ok()));
        range.and_then(|(start, end)| data.get(start..end)).ok_or_else(|| {
            let have = data.len();
            fault!("{length} bytes from byte {start} reach beyond buffers[{buffer}], which has {have} bytes")
        })
    }

    /// Replaces the bytes of a compressed buffer view by the decoded bytes.
    pub fn set_decoded_view(&mut self, index: usize, bytes: Vec<u8>) {
        self.views.insert(index, bytes);
    }

    /// Sets the decompressed elements of an accessor, tightly packed.
    pub fn set_decoded_accessor(&mut self, index: usize, bytes: Vec<u8>) {
        self.accessors.insert(index, bytes);
    }

    /// Returns the decompressed elements of an accessor; `None` if the accessor's data is not
    /// compressed.
    pub fn decoded_accessor(&self, index: usize) -> Option<&[u8]> {
        self.accessors.get(&index).map(Vec::as_slice)
    }
}

/// Returns the entry with this index in a list of the file, which has this name.
///
/// # Errors
/// A fault of kind input for an index beyond the end of the list.
pub(super) fn find_entry<'l, T>(list: &'l [T], name: &str, index: usize) -> ImportResult<&'l T> {
    let missing = || {
        fault!(
            "{name}[{index}] does not exist: the file has {} {name}",
            list.len()
        )
    };
    list.get(index).ok_or_else(missing)
}

fn load_buffer<'a>(
    buffer: &BufferEntry,
    index: usize,
    binary: Option<&'a [u8]>,
    folder: &Folder,
) -> ImportResult<Option<Cow<'a, [u8]>>> {
    let length = usize::try_from(buffer.byte_length).unwrap_or(usize::MAX);
    let short = |have: usize| {
        fault!("its byteLength is {length} bytes, but the data have only {have} bytes")
    };
    match (&buffer.uri, binary) {
        (Some(uri), _) => {
            let mut bytes = uri::read_reference(folder, uri)?;
            if bytes.len() < length {
                return Err(short(bytes.len()));
            }
            bytes.truncate(length);
            Ok(Some(Cow::Owned(bytes)))
        }
        (None, Some(chunk)) if index == 0 => match chunk.get(..length) {
            Some(bytes) => Ok(Some(Cow::Borrowed(bytes))),
            None => Err(short(chunk.len())),
        },
        (None, _) => Ok(None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: both the least value of a normalised signed integer and the next one mean −1 (glTF
    /// 2.0, section 3.11); without normalisation they are themselves.
    #[test]
    fn the_least_fraction_is_minus_one() {
        let bytes = [0x80, 0x81, 0x7f];
        let mut accessor = Accessor {
            count: 1,
            arity: 3,
            component: ComponentType::I8,
            normalised: true,
            bytes: &bytes,
            stride: 3,
            patches: Vec::new(),
        };
        assert_eq!(accessor.read_vector::<3>(0), [-1.0, -1.0, 1.0]);
        accessor.normalised = false;
        assert_eq!(accessor.read_vector::<3>(0), [-128.0, -127.0, 127.0]);
    }
}
