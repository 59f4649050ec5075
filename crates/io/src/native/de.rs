//! Serde deserializer of the syntax tree. The deserializer evaluates expressions and gives every
//! failure its position in the text. The structs of the scene therefore need no code for
//! expressions or positions.
//!
//! A failure does not hide later failures. Unknown keys, unknown words and malformed numbers are
//! recorded and replaced by a valid value, so that one pass over the tree finds all of them. If any
//! failure was recorded, the result is discarded.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fmt;

use raywright_core::expr;
use serde::Deserializer;
use serde::de::value::StrDeserializer;
use serde::de::{
    self, DeserializeSeed, EnumAccess, IntoDeserializer, MapAccess, SeqAccess, VariantAccess,
    Visitor,
};

use super::failure::{PathStep, ReadFailure, did_you_mean};
use super::node::{TableEntry, TextValue, ValueNode};

/// State of one pass over the syntax tree, shared by the deserializers of all its values.
pub(crate) struct ReadContext<'a> {
    /// The whole text of the scene.
    pub text: &'a str,
    /// Variables of expressions: `t` and the parameters.
    pub variables: &'a BTreeMap<String, f64>,
    /// Failures recorded so far.
    pub failures: RefCell<Vec<ReadFailure>>,
}

impl ReadContext<'_> {
    pub fn record_failure(&self, failure: ReadFailure) {
        self.failures.borrow_mut().push(failure);
    }
}

/// Deserializer of a value, with the value's name for messages.
#[derive(Clone, Copy)]
pub(crate) struct ValueReader<'a> {
    pub node: &'a ValueNode,
    pub context: &'a ReadContext<'a>,
    /// Key of the value, or key of the array that contains the value; empty at the root.
    pub name: &'a str,
    /// Index of the value, if the value is an element of the array `name`.
    pub index: Option<usize>,
}

impl fmt::Display for ValueReader<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.index {
            _ if self.name.is_empty() => f.write_str("the scene"),
            Some(index) => write!(f, "`{}[{index}]`", self.name),
            None => write!(f, "`{}`", self.name),
        }
    }
}

impl<'a> ValueReader<'a> {
    pub fn from_root(node: &'a ValueNode, context: &'a ReadContext<'a>) -> Self {
        Self {
            node,
            context,
            name: "",
            index: None,
        }
    }

    pub fn enter_table_entry(self, entry: &'a TableEntry) -> Self {
        Self {
            node: &entry.node,
            name: &entry.key,
            index: None,
            ..self
        }
    }

    /// Creates the failure for a value of the wrong type: "`radius` must be a number, not an
    /// array". `requested` describes the required type.
    pub fn type_failure(&self, requested: &str) -> ReadFailure {
        self.value_failure(requested, self.node.describe_type())
    }

    /// Creates the failure for a value that is not as `requested`, in words, but as `found`.
    fn value_failure(&self, requested: impl fmt::Display, found: impl fmt::Display) -> ReadFailure {
        ReadFailure::new(format!("{self} must be {requested}, not {found}"))
            .with_span(self.node.span.clone())
    }

    /// Sets the position of a failure that has none to the position of this value, and puts the
    /// name of the value before the message.
    pub fn with_location<T>(&self, result: Result<T, ReadFailure>) -> Result<T, ReadFailure> {
        result.map_err(|failure| self.locate_failure(failure))
    }

    /// Sets the position and the name in a failure that has no position. The function is separate
    /// from [`Self::with_location`], which is compiled for every type of value.
    fn locate_failure(&self, mut failure: ReadFailure) -> ReadFailure {
        if failure.span.is_none() {
            let key = failure.key.as_deref().and_then(|key| self.node.entry(key));
            failure.span =
                Some(key.map_or_else(|| self.node.span.clone(), |entry| entry.key_span.clone()));
            failure.message = format!("{self}: {}", failure.message);
        }
        failure
    }

    /// Returns the value's text. If the value is no text, the failure is recorded, and an empty
    /// text is returned.
    fn read_text(&self) -> &'a str {
        match &self.node.value {
            TextValue::Text(text) => text,
            _ => {
                self.context
                    .record_failure(self.type_failure("text in quotes"));
                ""
            }
        }
    }

    fn read_array(&self) -> Result<&'a [ValueNode], ReadFailure> {
        match &self.node.value {
            TextValue::Array(items) => Ok(items),
            _ => Err(self.type_failure("an array")),
        }
    }

    fn read_table(&self) -> Result<&'a [TableEntry], ReadFailure> {
        match &self.node.value {
            TextValue::Table(entries) => Ok(entries),
            _ => Err(self.type_failure("a table with keys")),
        }
    }

    /// Reads a table as a struct: unknown keys are recorded and skipped.
    pub fn read_struct<V: Visitor<'a>>(
        self,
        keys: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, ReadFailure> {
        let entries = self.check_keys(keys)?;
        self.with_location(visitor.visit_map(TableEntries::new(self, entries, Some(keys))))
    }

    /// Returns the entries of a table, and records a failure for each key that is not in `keys`.
    /// The function is separate from [`Self::read_struct`], which is compiled for every struct.
    fn check_keys(&self, keys: &[&str]) -> Result<&'a [TableEntry], ReadFailure> {
        let entries = self
            .read_table()
            .map_err(|failure| self.explain_header_brackets(failure))?;
        for entry in entries
            .iter()
            .filter(|entry| !keys.contains(&entry.key.as_str()))
        {
            let place = if self.name.is_empty() {
                "a scene".to_owned()
            } else {
                self.to_string()
            };
            let failure = ReadFailure::new(format!("unknown key `{}`", entry.key))
                .with_span(entry.key_span.clone());
            let hint = did_you_mean(&entry.key, keys, "allowed keys");
            self.context.record_failure(
                failure
                    .with_label(format!("not a key of {place}"))
                    .with_hint(hint),
            );
        }
        Ok(entries)
    }

    /// Adds advice to the failure if the brackets of a TOML header are wrong: double brackets for a
    /// single table, or single brackets for a list of tables.
    fn explain_header_brackets(&self, failure: ReadFailure) -> ReadFailure {
        let header = self
            .context
            .text
            .get(self.node.span.clone())
            .unwrap_or_default();
        let name = self.name;
        match (&self.node.value, header.as_bytes()) {
            (TextValue::Array(_), [b'[', b'[', ..]) if self.index.is_none() => failure.with_hint(
                format!("`{name}` is a single table: write `[{name}]` with single brackets"),
            ),
            (TextValue::Table(_), [b'[', ..]) => failure.with_hint(format!(
                "`{name}` is a list: write `[[{name}]]` with double brackets"
            )),
            _ => failure,
        }
    }
}

macro_rules! whole_numbers {
    ($($method:ident $visit:ident $type:ty),*) => {$(
        fn $method<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, ReadFailure> {
            let value = self.evaluate_integer(i128::from(<$type>::MIN), i128::from(<$type>::MAX));
            self.with_location(visitor.$visit(<$type>::try_from(value).unwrap_or(1)))
        }
    )*};
}

impl<'a> Deserializer<'a> for ValueReader<'a> {
    type Error = ReadFailure;

    whole_numbers!(
        deserialize_i8 visit_i8 i8, deserialize_i16 visit_i16 i16, deserialize_i32 visit_i32 i32, deserialize_i64 visit_i64 i64,
        deserialize_u8 visit_u8 u8, deserialize_u16 visit_u16 u16, deserialize_u32 visit_u32 u32, deserialize_u64 visit_u64 u64
    );

    fn deserialize_any<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, ReadFailure> {
        let result = match &self.node.value {
            TextValue::Null => visitor.visit_unit(),
            TextValue::Boolean(value) => visitor.visit_bool(*value),
            TextValue::Integer(value) => visitor.visit_i64(*value),
            TextValue::Unsigned(value) => visitor.visit_u64(*value),
            TextValue::Float(value) => visitor.visit_f64(*value),
            TextValue::Text(text) => visitor.visit_borrowed_str(text),
            TextValue::Date => Err(de::Error::invalid_type(
                de::Unexpected::Other("a date"),
                &visitor,
            )),
            TextValue::Array(items) => visitor.visit_seq(ArrayItems::new(self, items)),
            TextValue::Table(entries) => visitor.visit_map(TableEntries::new(self, entries, None)),
        };
        self.with_location(result)
    }

    fn deserialize_f64<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, ReadFailure> {
        self.with_location(visitor.visit_f64(self.evaluate_number()))
    }

    fn deserialize_f32<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, ReadFailure> {
        self.deserialize_f64(visitor)
    }

    fn deserialize_bool<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, ReadFailure> {
        let value = if let TextValue::Boolean(value) = self.node.value {
            value
        } else {
            self.context
                .record_failure(self.type_failure("true or false"));
            false
        };
        self.with_location(visitor.visit_bool(value))
    }

    fn deserialize_str<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, ReadFailure> {
        self.with_location(visitor.visit_borrowed_str(self.read_text()))
    }

    fn deserialize_string<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, ReadFailure> {
        self.deserialize_str(visitor)
    }

    fn deserialize_identifier<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, ReadFailure> {
        self.deserialize_str(visitor)
    }

    fn deserialize_option<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, ReadFailure> {
        if self.node.value == TextValue::Null {
            visitor.visit_none()
        } else {
            visitor.visit_some(self)
        }
    }

    /// Reads a type that wraps another type, such as a colour or an input of a material:
    /// - A colour may be a single number, and therefore an expression.
    /// - An `EarlyInput` that evaluates to a number is read as this number.
    /// - All other inputs keep the text of their expression, which is evaluated at each hit point.
    fn deserialize_newtype_struct<V: Visitor<'a>>(
        self,
        name: &'static str,
        visitor: V,
    ) -> Result<V::Value, ReadFailure> {
        match (name, &self.node.value) {
            ("Colour", TextValue::Text(_)) => self.deserialize_f64(visitor),
            ("Colour", _) => self.deserialize_any(visitor),
            ("EarlyInput", TextValue::Text(text)) => {
                match expr::evaluate(text, self.context.variables) {
                    Ok(number) => self.with_location(visitor.visit_f64(number)),
                    Err(_) => self.deserialize_any(visitor),
                }
            }
            _ => visitor.visit_newtype_struct(self),
        }
    }

    fn deserialize_seq<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, ReadFailure> {
        let items = self
            .read_array()
            .map_err(|failure| self.explain_header_brackets(failure))?;
        self.with_location(visitor.visit_seq(ArrayItems::new(self, items)))
    }

    fn deserialize_tuple<V: Visitor<'a>>(
        self,
        length: usize,
        visitor: V,
    ) -> Result<V::Value, ReadFailure> {
        let failure = |found: &dyn fmt::Display| {
            self.value_failure(format_args!("an array of {length} values"), found)
        };
        let TextValue::Array(items) = &self.node.value else {
            return Err(failure(&self.node.describe_type()));
        };
        if items.len() != length {
            return Err(failure(&format_args!("of {}", items.len())));
        }
        self.deserialize_seq(visitor)
    }

    fn deserialize_map<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, ReadFailure> {
        let entries = self.read_table()?;
        self.with_location(visitor.visit_map(TableEntries::new(self, entries, None)))
    }

    fn deserialize_struct<V: Visitor<'a>>(
        self,
        _: &'static str,
        keys: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, ReadFailure> {
        self.read_struct(keys, visitor)
    }

    fn deserialize_enum<V: Visitor<'a>>(
        self,
        _: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, ReadFailure> {
        let variant = VariantReader::from_value(self, variants)?;
        self.with_location(visitor.visit_enum(variant))
    }

    fn deserialize_ignored_any<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, ReadFailure> {
        visitor.visit_unit()
    }

    serde::forward_to_deserialize_any! { <V: Visitor<'a>> i128 u128 char bytes byte_buf unit unit_struct tuple_struct }
}

// Evaluation of numbers, which a scene may write as expressions.

impl ValueReader<'_> {
    /// Evaluates the value as a number. If this fails, the failure is recorded, and 1 is returned.
    pub fn evaluate_number(&self) -> f64 {
        match &self.node.value {
            TextValue::Integer(value) => *value as f64,
            TextValue::Unsigned(value) => *value as f64,
            TextValue::Float(value) => *value,
            TextValue::Text(source) => expr::evaluate(source, self.context.variables)
                .unwrap_or_else(|error| {
                    self.context.record_failure(self.expression_failure(error));
                    1.0
                }),
            _ => {
                self.context
                    .record_failure(self.type_failure("a number, or an expression in quotes"));
                1.0
            }
        }
    }

    /// Creates the failure for an error in the value's expression, at the position of the error.
    fn expression_failure(&self, error: expr::ExprError) -> ReadFailure {
        let span = self.node.span_of_text_part(self.context.text, &error.span);
        let message = format!("in the expression of {self}: {}", error.message);
        let mut failure = ReadFailure::new(message).with_span(span);
        failure.hint = error.hint;
        failure
    }

    /// Evaluates the value as a whole number from `least` to `greatest`. If this fails, the failure
    /// is recorded, and 1 is returned.
    fn evaluate_integer(&self, least: i128, greatest: i128) -> i128 {
        let value = match &self.node.value {
            TextValue::Integer(value) => i128::from(*value),
            TextValue::Unsigned(value) => i128::from(*value),
            _ => {
                let value = self.evaluate_number();
                // A cast of a float to an integer saturates. A number out of range therefore stays
                // out of range, and is refused below.
                if value.fract() != 0.0 || !value.is_finite() {
                    self.context
                        .record_failure(self.value_failure("a whole number", value));
                    return 1;
                }
                value as i128
            }
        };
        if (least..=greatest).contains(&value) {
            return value;
        }
        self.context.record_failure(self.value_failure(
            format_args!("a whole number from {least} to {greatest}"),
            value,
        ));
        1
    }
}

// Iteration over array elements and table entries, in the form that serde requires.

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

// Deserialization of enums. The value of an enum is a word, or a table whose only key is the word.

/// An enum's variant as written: the word, and the content of its table.
struct VariantReader<'a> {
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
        let wrong_type = || reader.type_failure(&format!("one of {}", variants.join(", ")));
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
                [] => return Err(wrong_type()),
            },
            _ => return Err(wrong_type()),
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
