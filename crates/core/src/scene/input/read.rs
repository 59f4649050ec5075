//! Deserialisation of inputs from a file.

use core::fmt;
use core::marker::PhantomData;

use serde::de::{self, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

use super::{CheckerInput, Colour, Input, InputValue, ScalarFactor, TextureInput, Triple};

/// A number that the loader's deserializer may also read from a string, as an expression. Every
/// other deserializer refuses a string.
struct EvaluatedNumber(f64);

impl<'de> Deserialize<'de> for EvaluatedNumber {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        f64::deserialize(deserializer).map(Self)
    }
}

/// Reads a sequence of exactly three numbers.
fn read_triple<'de, A: SeqAccess<'de>>(
    mut seq: A,
    what: &dyn de::Expected,
) -> Result<Triple, A::Error> {
    let mut out = [0.0; 3];
    for (i, slot) in out.iter_mut().enumerate() {
        *slot = seq
            .next_element::<EvaluatedNumber>()?
            .ok_or_else(|| de::Error::invalid_length(i, what))?
            .0;
    }
    if seq.next_element::<de::IgnoredAny>()?.is_some() {
        return Err(de::Error::invalid_length(4, what));
    }
    Ok(out)
}

struct ColourVisitor;

impl<'de> Visitor<'de> for ColourVisitor {
    type Value = Colour;
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a colour: [red, green, blue] or one number for grey")
    }
    fn visit_f64<E: de::Error>(self, v: f64) -> Result<Colour, E> {
        Ok(Colour([v; 3]))
    }
    fn visit_i64<E: de::Error>(self, v: i64) -> Result<Colour, E> {
        Ok(Colour([v as f64; 3]))
    }
    fn visit_u64<E: de::Error>(self, v: u64) -> Result<Colour, E> {
        Ok(Colour([v as f64; 3]))
    }
    fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<Colour, A::Error> {
        read_triple(seq, &self).map(Colour)
    }
    fn visit_newtype_struct<D: Deserializer<'de>>(
        self,
        deserializer: D,
    ) -> Result<Colour, D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Deserialize<'de> for Colour {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        // By the name `Colour`, the loader knows that a string in this place is an expression that
        // it evaluates once, and not an input.
        deserializer.deserialize_newtype_struct("Colour", ColourVisitor)
    }
}

struct WeightVisitor;

impl<'de> Visitor<'de> for WeightVisitor {
    type Value = ScalarFactor;
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number, or an expression in quotes")
    }
    fn visit_f64<E: de::Error>(self, v: f64) -> Result<ScalarFactor, E> {
        Ok(ScalarFactor::Number(v))
    }
    fn visit_i64<E: de::Error>(self, v: i64) -> Result<ScalarFactor, E> {
        Ok(ScalarFactor::Number(v as f64))
    }
    fn visit_u64<E: de::Error>(self, v: u64) -> Result<ScalarFactor, E> {
        Ok(ScalarFactor::Number(v as f64))
    }
    fn visit_str<E: de::Error>(self, v: &str) -> Result<ScalarFactor, E> {
        Ok(ScalarFactor::Expression(v.to_owned()))
    }
}

impl<'de> Deserialize<'de> for ScalarFactor {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(WeightVisitor)
    }
}

struct InputVisitor<T>(PhantomData<T>);

impl<'de, T: InputValue> Visitor<'de> for InputVisitor<T> {
    type Value = Input<T>;
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(T::EXPECTED)
    }
    fn visit_f64<E: de::Error>(self, v: f64) -> Result<Input<T>, E> {
        Ok(Input::Constant(T::from_number(v)))
    }
    fn visit_i64<E: de::Error>(self, v: i64) -> Result<Input<T>, E> {
        self.visit_f64(v as f64)
    }
    fn visit_u64<E: de::Error>(self, v: u64) -> Result<Input<T>, E> {
        self.visit_f64(v as f64)
    }
    fn visit_str<E: de::Error>(self, v: &str) -> Result<Input<T>, E> {
        Ok(Input::Expression(v.to_owned()))
    }
    fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<Input<T>, A::Error> {
        let colour = Colour(read_triple(seq, &self)?);
        T::from_colour(colour)
            .map(Input::Constant)
            .ok_or_else(|| de::Error::invalid_type(de::Unexpected::Seq, &self))
    }
    fn visit_newtype_struct<D: Deserializer<'de>>(
        self,
        deserializer: D,
    ) -> Result<Input<T>, D::Error> {
        deserializer.deserialize_any(self)
    }
    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Input<T>, A::Error> {
        const KEYS: &[&str] = &["texture", "checker"];
        let key: String = map
            .next_key()?
            .ok_or_else(|| de::Error::invalid_length(0, &self))?;
        let input = match key.as_str() {
            "texture" => Input::Texture(TextureInput {
                texture: map.next_value()?,
            }),
            "checker" => Input::Checker(CheckerInput {
                checker: map.next_value()?,
            }),
            other => return Err(de::Error::unknown_field(other, KEYS)),
        };
        match map.next_key::<String>()? {
            Some(extra) => Err(de::Error::custom(format!(
                "an input has a single key, but this input has `{key}` and `{extra}`: remove one of the two"
            ))),
            None => Ok(input),
        }
    }
}

impl<'de, T: InputValue> Deserialize<'de> for Input<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(InputVisitor(PhantomData))
    }
}

/// Reads an input. If its expression depends on no variable of the hit, the loader evaluates it
/// once. So values such as a roughness or an emission are known before rendering. The loader
/// recognises these inputs by the name `EarlyInput`.
pub(in crate::scene) fn deserialize_early<'de, T: InputValue, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Input<T>, D::Error> {
    deserializer.deserialize_newtype_struct("EarlyInput", InputVisitor(PhantomData))
}
