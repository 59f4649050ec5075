//! Serde deserializer of the syntax tree. The deserializer evaluates expressions and gives every
//! failure its position in the text. The structs of the scene therefore need no code for
//! expressions or positions.
//!
//! A failure does not hide later failures. Unknown keys, unknown words and malformed numbers are
//! recorded and replaced by a valid value, so that one pass over the tree finds all of them. If any
//! failure was recorded, the result is discarded.

mod numbers;

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fmt;

use raywright_core::expr;
use serde::Deserializer;
use serde::de::{self, Visitor};

use super::access::{ArrayItems, TableEntries};
use super::enums::VariantReader;
use super::failure::{ReadFailure, did_you_mean};
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
        let message = format!(
            "{self} must be {requested}, not {}",
            self.node.describe_type()
        );
        ReadFailure::new(message).with_span(self.node.span.clone())
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
        let items = match &self.node.value {
            TextValue::Array(items) => items,
            _ => return Err(self.type_failure(&format!("an array of {length} values"))),
        };
        if items.len() != length {
            let message = format!(
                "{self} must be an array of {length} values, not of {}",
                items.len()
            );
            return Err(ReadFailure::new(message).with_span(self.node.span.clone()));
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
