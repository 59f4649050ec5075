//! Parameters of a scene file: named numbers, with the range in which they make sense.

use core::fmt;

use serde::de::value::MapAccessDeserializer;
use serde::de::{self, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// A named number for expressions. A file states it as a number, or as a table with a range.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Parameter {
    /// Value that expressions read.
    pub value: f64,
    /// Range of sensible values. None: the file states none.
    pub range: Option<ParameterRange>,
}

/// Range of sensible values of a parameter, for sliders and for the check of `--set`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterRange {
    /// Least value.
    pub min: f64,
    /// Greatest value, above the least one.
    pub max: f64,
    /// Step of a slider, above zero. None: a hundredth of the range.
    pub step: Option<f64>,
}

/// The table of a parameter with a range.
#[derive(Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(super) struct ParameterTable {
    /// Value that expressions read.
    value: f64,
    /// Least value that `--set` and sliders allow.
    min: f64,
    /// Greatest value that `--set` and sliders allow.
    max: f64,
    /// Step of the slider. None: a hundredth of the range.
    #[serde(default)]
    step: Option<f64>,
}

impl From<f64> for Parameter {
    fn from(value: f64) -> Self {
        Self { value, range: None }
    }
}

impl Serialize for Parameter {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let value = self.value;
        match self.range {
            None => value.serialize(serializer),
            Some(ParameterRange { min, max, step }) => {
                let table = ParameterTable {
                    value,
                    min,
                    max,
                    step,
                };
                table.serialize(serializer)
            }
        }
    }
}

impl<'de> Deserialize<'de> for Parameter {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ParameterVisitor)
    }
}

struct ParameterVisitor;

impl<'de> Visitor<'de> for ParameterVisitor {
    type Value = Parameter;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number, or a table with value, min and max")
    }

    fn visit_f64<E: de::Error>(self, value: f64) -> Result<Parameter, E> {
        Ok(value.into())
    }

    fn visit_i64<E: de::Error>(self, value: i64) -> Result<Parameter, E> {
        Ok((value as f64).into())
    }

    fn visit_u64<E: de::Error>(self, value: u64) -> Result<Parameter, E> {
        Ok((value as f64).into())
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Parameter, A::Error> {
        let table = ParameterTable::deserialize(MapAccessDeserializer::new(map))?;
        let ParameterTable {
            value,
            min,
            max,
            step,
        } = table;
        let range = Some(ParameterRange { min, max, step });
        Ok(Parameter { value, range })
    }
}
