//! The binary data of a glTF file: buffers from the container, from files beside it, or from the
//! JSON itself, and views of them.

use std::borrow::Cow;
use std::collections::HashMap;

use super::document::Document;
use super::entries::Buffer;
use crate::folder::Folder;
use crate::import::{Budget, Fault, Outcome};
use crate::uri;

/// All buffers of a file, each cut to the length that the JSON gives it.
pub(super) struct Buffers<'a> {
    /// None where a buffer has no data: a placeholder that only an extension fills. Using one is an
    /// error, having one is not.
    data: Vec<Option<Cow<'a, [u8]>>>,
    /// What compressed views stand for, by index.
    views: HashMap<usize, Vec<u8>>,
    /// What accessors of compressed primitives stand for, packed, by index.
    accessors: HashMap<usize, Vec<u8>>,
}

impl<'a> Buffers<'a> {
    /// Loads every buffer.
    ///
    /// # Errors
    /// A fault of kind input when one is missing, refused or shorter than the JSON says.
    pub fn load(
        document: &Document,
        binary: Option<&'a [u8]>,
        folder: &Folder,
        budget: &mut Budget,
    ) -> Outcome<Self> {
        let mut data = Vec::new();
        for (i, buffer) in document.buffers.iter().enumerate() {
            let bytes = load_one(buffer, i, binary, folder)
                .map_err(|fault| fault.at(format_args!("buffers[{i}]")))?;
            if let Some(Cow::Owned(bytes)) = &bytes {
                budget.memory(bytes.len(), 1)?;
            }
            data.push(bytes);
        }
        Ok(Self {
            data,
            views: HashMap::new(),
            accessors: HashMap::new(),
        })
    }

    /// The bytes of a buffer view, and the stride it prescribes.
    ///
    /// # Errors
    /// A fault of kind input when the view or its buffer does not exist, or when it reaches beyond
    /// the buffer.
    pub fn view(&self, document: &Document, index: usize) -> Outcome<(&[u8], Option<usize>)> {
        let place = |fault: Fault| fault.at(format_args!("bufferViews[{index}]"));
        let view = document
            .buffer_views
            .get(index)
            .ok_or_else(|| absent("bufferViews", index, document.buffer_views.len()))?;
        let stride = view.byte_stride;
        if let Some(bytes) = self.views.get(&index) {
            return Ok((bytes, stride));
        }
        self.bytes(view.buffer as usize, view.byte_offset, view.byte_length)
            .map(|bytes| (bytes, stride))
            .map_err(place)
    }

    /// A part of a buffer.
    ///
    /// # Errors
    /// A fault of kind input when the buffer does not exist, or when the part reaches beyond it.
    pub fn bytes(&self, buffer: usize, start: u64, length: u64) -> Outcome<&[u8]> {
        let data = self
            .data
            .get(buffer)
            .ok_or_else(|| absent("buffers", buffer, self.data.len()))?;
        let missing = || {
            Fault::input(format!(
                "buffers[{buffer}] has no uri, and the file no binary chunk for it"
            ))
        };
        let data = data.as_ref().ok_or_else(missing)?;
        let end = start.checked_add(length);
        let range = usize::try_from(start)
            .ok()
            .zip(end.and_then(|end| usize::try_from(end).ok()));
        range.and_then(|(start, end)| data.get(start..end)).ok_or_else(|| {
            let have = data.len();
            Fault::input(format!("{length} bytes from byte {start} reach beyond buffers[{buffer}], which has {have}"))
        })
    }

    /// Puts decoded bytes in the place of a view's.
    pub fn replace_view(&mut self, index: usize, bytes: Vec<u8>) {
        self.views.insert(index, bytes);
    }

    /// Puts packed elements in the place of an accessor's.
    pub fn fill_accessor(&mut self, index: usize, bytes: Vec<u8>) {
        self.accessors.insert(index, bytes);
    }

    /// The packed elements of an accessor that were decoded, if it has such.
    pub fn accessor(&self, index: usize) -> Option<&[u8]> {
        self.accessors.get(&index).map(Vec::as_slice)
    }
}

/// An index that points at nothing.
pub(super) fn absent(list: &str, index: usize, length: usize) -> Fault {
    Fault::input(format!(
        "{list}[{index}] does not exist, the file has {length} of them"
    ))
}

fn load_one<'a>(
    buffer: &Buffer,
    index: usize,
    binary: Option<&'a [u8]>,
    folder: &Folder,
) -> Outcome<Option<Cow<'a, [u8]>>> {
    let length = usize::try_from(buffer.byte_length).unwrap_or(usize::MAX);
    let short = |have: usize| {
        Fault::input(format!(
            "has {length} bytes by its byteLength, but only {have} are there"
        ))
    };
    match (&buffer.uri, binary) {
        (Some(uri), _) => {
            let mut bytes = uri::read(folder, uri)?;
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
