//! Iteration over array elements and table entries, for serde.

use serde::de::{DeserializeSeed, IntoDeserializer, MapAccess, SeqAccess};

use super::de::Reader;
use super::failure::{Failure, Step};
use super::node::{Entry, Node, Value};

/// Elements of an array.
pub(super) struct Items<'a> {
    reader: Reader<'a>,
    items: std::slice::Iter<'a, Node>,
    next: usize,
}

impl<'a> SeqAccess<'a> for Items<'a> {
    type Error = Failure;

    fn next_element_seed<T: DeserializeSeed<'a>>(
        &mut self,
        seed: T,
    ) -> Result<Option<T::Value>, Failure> {
        let Some(node) = self.items.next() else {
            return Ok(None);
        };
        let index = self.next;
        self.next += 1;
        let reader = Reader {
            node,
            index: Some(index),
            ..self.reader
        };
        seed.deserialize(reader)
            .map(Some)
            .map_err(|failure| failure.under(Step::Index(index)))
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.items.len())
    }
}

impl<'a> Items<'a> {
    pub fn new(reader: Reader<'a>, items: &'a [Node]) -> Self {
        Self {
            reader,
            items: items.iter(),
            next: 0,
        }
    }
}

/// Entries of a table.
pub(super) struct Entries<'a> {
    reader: Reader<'a>,
    entries: std::slice::Iter<'a, Entry>,
    /// Keys to read, others are skipped; `None`: all are read.
    keys: Option<&'static [&'static str]>,
    value: Option<&'a Entry>,
}

impl<'a> Entries<'a> {
    /// Iterates over all entries, or those with the given keys.
    pub fn new(
        reader: Reader<'a>,
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
        let wanted = |entry: &&Entry| {
            keys.is_none_or(|keys| keys.contains(&entry.key.as_str()))
                && entry.node.value != Value::Null
        };
        self.value = self.entries.by_ref().find(wanted);
        self.value
    }

    /// Returns the entry whose key was read last.
    fn current(&mut self) -> Result<(&'a Entry, Reader<'a>), Failure> {
        let entry = self
            .value
            .take()
            .ok_or_else(|| Failure::new("a value without its key"))?;
        Ok((entry, self.reader.inside(entry)))
    }
}

/// Adds a key to the path of a failure.
fn at_key(failure: Failure, entry: &Entry) -> Failure {
    failure.under(Step::Key(entry.key.clone()))
}

/// Kept short, because both methods are compiled for every type of value.
impl<'a> MapAccess<'a> for Entries<'a> {
    type Error = Failure;

    fn next_key_seed<K: DeserializeSeed<'a>>(
        &mut self,
        seed: K,
    ) -> Result<Option<K::Value>, Failure> {
        self.advance()
            .map(|entry| seed.deserialize(entry.key.as_str().into_deserializer()))
            .transpose()
    }

    fn next_value_seed<V: DeserializeSeed<'a>>(&mut self, seed: V) -> Result<V::Value, Failure> {
        let (entry, reader) = self.current()?;
        seed.deserialize(reader)
            .map_err(|failure| at_key(failure, entry))
    }
}
