//! Iteration over array elements and table entries, for serde.

use serde::de::{DeserializeSeed, IntoDeserializer, MapAccess, SeqAccess};

use super::de::ValueReader;
use super::failure::{PathStep, ReadFailure};
use super::node::{Entry, Value, ValueNode};

/// Elements of an array.
pub(super) struct Items<'a> {
    reader: ValueReader<'a>,
    items: std::slice::Iter<'a, ValueNode>,
    next: usize,
}

impl<'a> SeqAccess<'a> for Items<'a> {
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
            .map_err(|failure| failure.under(PathStep::Index(index)))
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.items.len())
    }
}

impl<'a> Items<'a> {
    pub fn new(reader: ValueReader<'a>, items: &'a [ValueNode]) -> Self {
        Self {
            reader,
            items: items.iter(),
            next: 0,
        }
    }
}

/// Entries of a table.
pub(super) struct Entries<'a> {
    reader: ValueReader<'a>,
    entries: std::slice::Iter<'a, Entry>,
    /// Keys to read; other keys are skipped. `None` reads all keys.
    keys: Option<&'static [&'static str]>,
    value: Option<&'a Entry>,
}

impl<'a> Entries<'a> {
    /// Iterates over all entries, or over the entries with the given keys.
    pub fn new(
        reader: ValueReader<'a>,
        entries: &'a [Entry],
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

impl<'a> Entries<'a> {
    /// Returns the next entry to read.
    fn advance(&mut self) -> Option<&'a Entry> {
        let keys = self.keys;
        let requested = |entry: &&Entry| {
            keys.is_none_or(|keys| keys.contains(&entry.key.as_str()))
                && entry.node.value != Value::Null
        };
        self.value = self.entries.by_ref().find(requested);
        self.value
    }

    /// Takes the entry whose key was read last, with a reader of its value.
    fn current(&mut self) -> Result<(&'a Entry, ValueReader<'a>), ReadFailure> {
        let entry = self
            .value
            .take()
            .ok_or_else(|| ReadFailure::new("a value without its key"))?;
        Ok((entry, self.reader.inside(entry)))
    }
}

/// Adds a key to the path of a failure.
fn at_key(failure: ReadFailure, entry: &Entry) -> ReadFailure {
    failure.under(PathStep::Key(entry.key.clone()))
}

/// The methods are short, because each is compiled for every type of value.
impl<'a> MapAccess<'a> for Entries<'a> {
    type Error = ReadFailure;

    fn next_key_seed<K: DeserializeSeed<'a>>(
        &mut self,
        seed: K,
    ) -> Result<Option<K::Value>, ReadFailure> {
        self.advance()
            .map(|entry| seed.deserialize(entry.key.as_str().into_deserializer()))
            .transpose()
    }

    fn next_value_seed<V: DeserializeSeed<'a>>(
        &mut self,
        seed: V,
    ) -> Result<V::Value, ReadFailure> {
        let (entry, reader) = self.current()?;
        seed.deserialize(reader)
            .map_err(|failure| at_key(failure, entry))
    }
}
