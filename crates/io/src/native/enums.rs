//! Deserialization of enums. The value of an enum is a word, or a table whose only key is the word.

use serde::Deserializer;
use serde::de::value::StrDeserializer;
use serde::de::{DeserializeSeed, EnumAccess, IntoDeserializer, VariantAccess, Visitor};

use super::de::ValueReader;
use super::failure::{PathStep, ReadFailure, did_you_mean};
use super::node::{TextValue, ValueNode};

/// An enum's variant as written: the word, and the content of its table.
pub(crate) struct VariantReader<'a> {
    reader: ValueReader<'a>,
    word: &'a str,
    /// Content of the variant's table; `None` if the variant is written as a word alone.
    content: Option<&'a ValueNode>,
}

impl<'a> VariantReader<'a> {
    pub fn from_value(
        reader: ValueReader<'a>,
        variants: &'static [&'static str],
    ) -> Result<Self, ReadFailure> {
        let list = || variants.join(", ");
        let (word, span, content) = match &reader.node.value {
            TextValue::Text(word) => (word, &reader.node.span, None),
            TextValue::Table(entries) => match entries.as_slice() {
                [entry] => (&entry.key, &entry.key_span, Some(&entry.node)),
                [_, second, ..] => {
                    let message = format!(
                        "{reader} must have exactly one key, which names its kind, not {} keys",
                        entries.len()
                    );
                    return Err(ReadFailure::new(message)
                        .with_span(second.key_span.clone())
                        .with_label("one key too many"));
                }
                [] => return Err(reader.type_failure(&format!("one of {}", list()))),
            },
            _ => return Err(reader.type_failure(&format!("one of {}", list()))),
        };
        if !variants.contains(&word.as_str()) {
            let failure =
                ReadFailure::new(format!("{reader} cannot be `{word}`")).with_span(span.clone());
            return Err(failure.with_hint(did_you_mean(word, variants, "it can be")));
        }
        Ok(Self {
            reader,
            word,
            content,
        })
    }

    /// Returns a reader of the content of the variant's table, or a failure that shows the required
    /// syntax.
    fn read_variant_content(&self, keys: &[&str]) -> Result<ValueReader<'a>, ReadFailure> {
        match self.content {
            Some(node) => Ok(ValueReader {
                node,
                name: self.word,
                index: None,
                ..self.reader
            }),
            None => {
                let (name, word) = (self.reader.name, self.word);
                let failure = ReadFailure::new(format!("`{word}` needs a value"))
                    .with_span(self.reader.node.span.clone());
                let hint = format!("write `{name} = {{ {word} = … }}`");
                Err(failure.with_hint(if keys.is_empty() {
                    hint
                } else {
                    format!("{hint} with {}", keys.join(", "))
                }))
            }
        }
    }

    fn add_variant_to_path<T>(&self, result: Result<T, ReadFailure>) -> Result<T, ReadFailure> {
        result.map_err(|failure| failure.with_step(PathStep::Key(self.word.to_owned())))
    }
}

impl<'a> EnumAccess<'a> for VariantReader<'a> {
    type Error = ReadFailure;
    type Variant = Self;

    fn variant_seed<V: DeserializeSeed<'a>>(
        self,
        seed: V,
    ) -> Result<(V::Value, Self), ReadFailure> {
        let name: StrDeserializer<'_, ReadFailure> = self.word.into_deserializer();
        Ok((seed.deserialize(name)?, self))
    }
}

impl<'a> VariantAccess<'a> for VariantReader<'a> {
    type Error = ReadFailure;

    fn unit_variant(self) -> Result<(), ReadFailure> {
        match self.content {
            None => Ok(()),
            Some(node) => {
                let (name, word) = (self.reader.name, self.word);
                let failure = ReadFailure::new(format!("`{word}` takes no value"))
                    .with_span(node.span.clone());
                Err(failure.with_hint(format!("write `{name} = \"{word}\"`")))
            }
        }
    }

    fn newtype_variant_seed<T: DeserializeSeed<'a>>(
        self,
        seed: T,
    ) -> Result<T::Value, ReadFailure> {
        let result = self
            .read_variant_content(&[])
            .and_then(|content| seed.deserialize(content));
        self.add_variant_to_path(result)
    }

    fn tuple_variant<V: Visitor<'a>>(
        self,
        length: usize,
        visitor: V,
    ) -> Result<V::Value, ReadFailure> {
        let result = self
            .read_variant_content(&[])
            .and_then(|content| content.deserialize_tuple(length, visitor));
        self.add_variant_to_path(result)
    }

    fn struct_variant<V: Visitor<'a>>(
        self,
        keys: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, ReadFailure> {
        let result = self
            .read_variant_content(keys)
            .and_then(|content| content.read_struct(keys, visitor));
        self.add_variant_to_path(result)
    }
}
