//! Iteration over array elements and table entries, in the form that serde requires.

use serde::de::{DeserializeSeed, IntoDeserializer, MapAccess, SeqAccess};

use super::de::ValueReader;
use super::failure::{PathStep, ReadFailure};
use super::node::{TableEntry, TextValue, ValueNode};

/// Elements of an array.
pub(super) struct ArrayItems<'a> {
    reader: ValueReader<'a>,
    items: std::slice::Iter<'a, ValueNode>,
    next: usize,
}

impl<'a> SeqAccess<'a> for ArrayItems<'a> {
    type Error = ReadFailure;

    fn next_element_seed<T: DeserializeSeed<'a>>(
        &mut self,
        seed: T,
    ) -> Result<Option<T::Value>, ReadFailure> {
        let Some(node) = self.items.next() else {
            return Ok(None);
        };
        let index = self.next;
        self.next += 1;
        let reader = ValueReader {
            node,
            index: Some(index),
            ..self.reader
        };
        seed.deserialize(reader)
            .map(Some)
            .map_err(|failure| failure.with_step(PathStep::Index(index)))
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.items.len())
    }
}

impl<'a> ArrayItems<'a> {
    pub fn new(reader: ValueReader<'a>, items: &'a [ValueNode]) -> Self {
        Self {
            reader,
            items: items.iter(),
            next: 0,
        }
    }
}

/// Entries of a table.
pub(super) struct TableEntries<'a> {
    reader: ValueReader<'a>,
    entries: std::slice::Iter<'a, TableEntry>,
    /// Keys to read; other keys are skipped. `None` reads all keys.
    keys: Option<&'static [&'static str]>,
    value: Option<&'a TableEntry>,
}

impl<'a> TableEntries<'a> {
    /// Iterates over all entries, or over the entries with the given keys.
    pub fn new(
        reader: ValueReader<'a>,
        entries: &'a [TableEntry],
        keys: Option<&'static [&'static str]>,
    ) -> Self {
        Self {
            reader,
            entries: entries.iter(),
            keys,
            value: None,
        }
    }
}

impl<'a> TableEntries<'a> {
    /// Returns the next entry that is to be read; entries with other keys or the value `null` are
    /// skipped.
    fn next_entry(&mut self) -> Option<&'a TableEntry> {
        let keys = self.keys;
        let requested = |entry: &&TableEntry| {
            keys.is_none_or(|keys| keys.contains(&entry.key.as_str()))
                && entry.node.value != TextValue::Null
        };
        self.value = self.entries.by_ref().find(requested);
        self.value
    }

    /// Returns the entry whose key was read most recently, and a reader of its value.
    fn take_current_entry(&mut self) -> Result<(&'a TableEntry, ValueReader<'a>), ReadFailure> {
        let entry = self
            .value
            .take()
            .ok_or_else(|| ReadFailure::new("a value without its key"))?;
        Ok((entry, self.reader.enter_table_entry(entry)))
    }
}

/// Adds a key to the path of a failure.
fn add_key_to_path(failure: ReadFailure, entry: &TableEntry) -> ReadFailure {
    failure.with_step(PathStep::Key(entry.key.clone()))
}

/// Each method is short, because it is compiled once for every type of value.
impl<'a> MapAccess<'a> for TableEntries<'a> {
    type Error = ReadFailure;

    fn next_key_seed<K: DeserializeSeed<'a>>(
        &mut self,
        seed: K,
    ) -> Result<Option<K::Value>, ReadFailure> {
        self.next_entry()
            .map(|entry| seed.deserialize(entry.key.as_str().into_deserializer()))
            .transpose()
    }

    fn next_value_seed<V: DeserializeSeed<'a>>(
        &mut self,
        seed: V,
    ) -> Result<V::Value, ReadFailure> {
        let (entry, reader) = self.take_current_entry()?;
        seed.deserialize(reader)
            .map_err(|failure| add_key_to_path(failure, entry))
    }
}
