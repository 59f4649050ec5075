//! Enum values: a word, or a table whose only key is the word.

use serde::Deserializer;
use serde::de::value::StrDeserializer;
use serde::de::{DeserializeSeed, EnumAccess, IntoDeserializer, VariantAccess, Visitor};

use super::de::Reader;
use super::failure::{Failure, Step, did_you_mean};
use super::node::{Node, Value};

/// The variant that a value names.
pub(crate) struct Variant<'a> {
    reader: Reader<'a>,
    word: &'a str,
    /// Content of the table under the word; `None`: the word alone.
    content: Option<&'a Node>,
}

impl<'a> Variant<'a> {
    pub fn of(reader: Reader<'a>, variants: &'static [&'static str]) -> Result<Self, Failure> {
        let list = || variants.join(", ");
        let (word, span, content) = match &reader.node.value {
            Value::Text(word) => (word, &reader.node.span, None),
            Value::Table(entries) => match entries.as_slice() {
                [entry] => (&entry.key, &entry.key_span, Some(&entry.node)),
                [_, second, ..] => {
                    let message = format!(
                        "{reader} must have exactly one key that says which kind it is, not {}",
                        entries.len()
                    );
                    return Err(Failure::new(message)
                        .at(second.key_span.clone())
                        .labelled("one key too many"));
                }
                [] => return Err(reader.wrong(&format!("one of {}", list()))),
            },
            _ => return Err(reader.wrong(&format!("one of {}", list()))),
        };
        if !variants.contains(&word.as_str()) {
            let failure = Failure::new(format!("{reader} cannot be `{word}`")).at(span.clone());
            return Err(failure.with_hint(did_you_mean(word, variants, "it can be")));
        }
        Ok(Self {
            reader,
            word,
            content,
        })
    }

    /// Returns the content under the word, or a failure that shows the syntax.
    fn content(&self, keys: &[&str]) -> Result<Reader<'a>, Failure> {
        match self.content {
            Some(node) => Ok(Reader {
                node,
                name: self.word,
                index: None,
                ..self.reader
            }),
            None => {
                let (name, word) = (self.reader.name, self.word);
                let failure = Failure::new(format!("`{word}` needs a value")).at(self
                    .reader
                    .node
                    .span
                    .clone());
                let hint = format!("write `{name} = {{ {word} = … }}`");
                Err(failure.with_hint(if keys.is_empty() {
                    hint
                } else {
                    format!("{hint} with {}", keys.join(", "))
                }))
            }
        }
    }

    fn under<T>(&self, result: Result<T, Failure>) -> Result<T, Failure> {
        result.map_err(|failure| failure.under(Step::Key(self.word.to_owned())))
    }
}

impl<'a> EnumAccess<'a> for Variant<'a> {
    type Error = Failure;
    type Variant = Self;

    fn variant_seed<V: DeserializeSeed<'a>>(self, seed: V) -> Result<(V::Value, Self), Failure> {
        let name: StrDeserializer<'_, Failure> = self.word.into_deserializer();
        Ok((seed.deserialize(name)?, self))
    }
}

impl<'a> VariantAccess<'a> for Variant<'a> {
    type Error = Failure;

    fn unit_variant(self) -> Result<(), Failure> {
        match self.content {
            None => Ok(()),
            Some(node) => {
                let (name, word) = (self.reader.name, self.word);
                let failure =
                    Failure::new(format!("`{word}` has no value of its own")).at(node.span.clone());
                Err(failure.with_hint(format!("write `{name} = \"{word}\"`")))
            }
        }
    }

    fn newtype_variant_seed<T: DeserializeSeed<'a>>(self, seed: T) -> Result<T::Value, Failure> {
        let result = self
            .content(&[])
            .and_then(|content| seed.deserialize(content));
        self.under(result)
    }

    fn tuple_variant<V: Visitor<'a>>(self, length: usize, visitor: V) -> Result<V::Value, Failure> {
        let result = self
            .content(&[])
            .and_then(|content| content.deserialize_tuple(length, visitor));
        self.under(result)
    }

    fn struct_variant<V: Visitor<'a>>(
        self,
        keys: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Failure> {
        let result = self
            .content(keys)
            .and_then(|content| content.read_struct(keys, visitor));
        self.under(result)
    }
}
