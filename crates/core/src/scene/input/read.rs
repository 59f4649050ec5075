//! How inputs are written in a file, for serde and for the JSON Schema.

use core::fmt;
use core::marker::PhantomData;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{self, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

use super::{Checker, CheckerInput, Colour, Input, TextureInput, TextureRef, Triple, Value, Weight};
use crate::expr::{Scope, constant_names, function_names};

/// A number that may be written as text: the loader's deserializer evaluates the text, any other format refuses it.
struct Number(f64);

impl<'de> Deserialize<'de> for Number {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        f64::deserialize(deserializer).map(Self)
    }
}

fn triple<'de, A: SeqAccess<'de>>(mut seq: A, what: &dyn de::Expected) -> Result<Triple, A::Error> {
    let mut out = [0.0; 3];
    for (i, slot) in out.iter_mut().enumerate() {
        *slot = seq.next_element::<Number>()?.ok_or_else(|| de::Error::invalid_length(i, what))?.0;
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
        triple(seq, &self).map(Colour)
    }
    fn visit_newtype_struct<D: Deserializer<'de>>(self, deserializer: D) -> Result<Colour, D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Deserialize<'de> for Colour {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        // The name tells the loader that a text here is the expression of a number, evaluated once, and no input of the hit.
        deserializer.deserialize_newtype_struct("Colour", ColourVisitor)
    }
}

struct WeightVisitor;

impl<'de> Visitor<'de> for WeightVisitor {
    type Value = Weight;
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number, or an expression of the hit in quotes")
    }
    fn visit_f64<E: de::Error>(self, v: f64) -> Result<Weight, E> {
        Ok(Weight::Number(v))
    }
    fn visit_i64<E: de::Error>(self, v: i64) -> Result<Weight, E> {
        Ok(Weight::Number(v as f64))
    }
    fn visit_u64<E: de::Error>(self, v: u64) -> Result<Weight, E> {
        Ok(Weight::Number(v as f64))
    }
    fn visit_str<E: de::Error>(self, v: &str) -> Result<Weight, E> {
        Ok(Weight::Expression(v.to_owned()))
    }
}

impl<'de> Deserialize<'de> for Weight {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(WeightVisitor)
    }
}

struct InputVisitor<T>(PhantomData<T>);

impl<'de, T: Value> Visitor<'de> for InputVisitor<T> {
    type Value = Input<T>;
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(T::EXPECTED)
    }
    fn visit_f64<E: de::Error>(self, v: f64) -> Result<Input<T>, E> {
        Ok(Input::Constant(T::of_number(v)))
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
        let colour = Colour(triple(seq, &self)?);
        T::of_colour(colour).map(Input::Constant).ok_or_else(|| de::Error::invalid_type(de::Unexpected::Seq, &self))
    }
    fn visit_newtype_struct<D: Deserializer<'de>>(self, deserializer: D) -> Result<Input<T>, D::Error> {
        deserializer.deserialize_any(self)
    }
    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Input<T>, A::Error> {
        const KEYS: &[&str] = &["texture", "checker"];
        let key: String = map.next_key()?.ok_or_else(|| de::Error::invalid_length(0, &self))?;
        let input = match key.as_str() {
            "texture" => Input::Texture(TextureInput { texture: map.next_value()? }),
            "checker" => Input::Checker(CheckerInput { checker: map.next_value()? }),
            other => return Err(de::Error::unknown_field(other, KEYS)),
        };
        match map.next_key::<String>()? {
            Some(extra) => Err(de::Error::custom(format!("an input has one key, `{key}`; `{extra}` is one too many"))),
            None => Ok(input),
        }
    }
}

impl<'de, T: Value> Deserialize<'de> for Input<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(InputVisitor(PhantomData))
    }
}

/// An input whose text is a number of the scene, evaluated once, wherever it asks nothing of the hit: then it is known before
/// anything is rendered how smooth a surface is, or what light it gives off. The name tells the loader so.
pub(in crate::scene) fn early<'de, T: Value, D: Deserializer<'de>>(deserializer: D) -> Result<Input<T>, D::Error> {
    deserializer.deserialize_newtype_struct("EarlyInput", InputVisitor(PhantomData))
}

impl JsonSchema for Colour {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Colour".into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let (one, three) = (generator.subschema_for::<f64>(), generator.subschema_for::<Triple>());
        json_schema!({ "description": "Linear red, green, blue; one number means grey.", "anyOf": [one, three] })
    }
}

/// What an expression may name, for whoever writes one with nothing but the schema at hand.
fn language(scope: Scope) -> String {
    let list = |names: &mut dyn Iterator<Item = &'static str>| names.collect::<Vec<_>>().join(", ");
    let place = match scope {
        Scope::Light => ", of which the light's (l, shadow, occluder_distance) exist only where a light is weighed",
        _ => "; in the sky only d and o",
    };
    format!(
        "Vectors are [x, y, z]. Variables: {}{place}. Constants: t, the parameters, {}. Functions: {}. What each means: \
         docs/scene-format.md, in the source of the program.",
        list(&mut scope.variables().iter().map(|variable| variable.name())),
        list(&mut constant_names()),
        list(&mut function_names()),
    )
}

impl JsonSchema for Weight {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Weight".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let description =
            format!("A number, or the text of an expression that is a number at each hit. {}", language(Scope::Light));
        json_schema!({ "description": description, "type": ["number", "string"] })
    }
}

impl<T: Value> JsonSchema for Input<T> {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        T::NAME.into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let constant = generator.subschema_for::<T>();
        let texture = generator.subschema_for::<TextureRef>();
        let checker = generator.subschema_for::<Checker>();
        json_schema!({
            "description": "A constant, the text of an expression evaluated at each hit, a texture or a checkerboard.",
            "anyOf": [
                constant,
                { "description": language(Scope::Surface), "type": "string" },
                { "type": "object", "properties": { "texture": texture }, "required": ["texture"], "additionalProperties": false },
                { "type": "object", "properties": { "checker": checker }, "required": ["checker"], "additionalProperties": false }
            ]
        })
    }
}
