//! Binary data of a glTF file: buffers from the container, from other files or from the JSON
//! itself, and buffer views.

use std::borrow::Cow;
use std::collections::HashMap;

use super::document::Document;
use super::entries::BufferEntry;
use crate::folder::Folder;
use crate::import::{DecodeBudget, FaultPlace, ImportResult};
use crate::uri;

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
