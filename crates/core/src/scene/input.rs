//! Inputs that are either a number, a colour, or something evaluated at each hit.

use core::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{self, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use super::Triple;
use super::material::TextureRef;
use crate::expr::{Scope, constant_names, function_names};

/// Linear Rec. 709 red, green, blue. A single number in a file means the same in all three.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[serde(transparent)]
pub struct Colour(pub Triple);

impl Colour {
    /// One in every channel.
    pub const WHITE: Self = Self([1.0; 3]);
    /// Zero in every channel.
    pub const BLACK: Self = Self([0.0; 3]);
}

/// A scalar factor: a number, or an expression of the hit evaluated each time it is needed.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Weight {
    /// The same everywhere.
    Number(f64),
    /// Text of an expression with a scalar value; variables are those of [`crate::expr`].
    Expression(String),
}

impl Default for Weight {
    fn default() -> Self {
        Self::Number(1.0)
    }
}

/// Two colours in unit cells of the plane spanned by two world axes: the first where the sum of the floors is even.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Checker {
    /// Colour of cells whose indices have an even sum.
    pub even: Colour,
    /// Colour of the other cells.
    pub odd: Colour,
    /// Edge of a cell in world units.
    #[serde(default = "one")]
    pub size: f64,
}

fn one() -> f64 {
    1.0
}

/// A colour that may vary over a surface.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum ColourInput {
    /// The same everywhere: `[r, g, b]` or a number.
    Constant(Colour),
    /// Text of an expression with a vector value (a scalar one means grey).
    Expression(String),
    /// An image texture: `{ texture = "name" }`.
    Texture(TextureInput),
    /// A checkerboard in world x and z: `{ checker = { even, odd } }`.
    Checker(CheckerInput),
}

/// The table form of a texture input.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TextureInput {
    /// Which texture, with a factor.
    pub texture: TextureRef,
}

/// The table form of a checker input.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CheckerInput {
    /// The two colours and the cell size.
    pub checker: Checker,
}

impl Default for ColourInput {
    fn default() -> Self {
        Self::Constant(Colour::WHITE)
    }
}

impl From<Colour> for ColourInput {
    fn from(colour: Colour) -> Self {
        Self::Constant(colour)
    }
}

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

struct ColourInputVisitor;

impl<'de> Visitor<'de> for ColourInputVisitor {
    type Value = ColourInput;
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("[red, green, blue], a number, an expression in quotes, { texture = … } or { checker = … }")
    }
    fn visit_f64<E: de::Error>(self, v: f64) -> Result<ColourInput, E> {
        ColourVisitor.visit_f64(v).map(ColourInput::Constant)
    }
    fn visit_i64<E: de::Error>(self, v: i64) -> Result<ColourInput, E> {
        ColourVisitor.visit_i64(v).map(ColourInput::Constant)
    }
    fn visit_u64<E: de::Error>(self, v: u64) -> Result<ColourInput, E> {
        ColourVisitor.visit_u64(v).map(ColourInput::Constant)
    }
    fn visit_str<E: de::Error>(self, v: &str) -> Result<ColourInput, E> {
        Ok(ColourInput::Expression(v.to_owned()))
    }
    fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<ColourInput, A::Error> {
        triple(seq, &self).map(|v| ColourInput::Constant(Colour(v)))
    }
    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<ColourInput, A::Error> {
        const KEYS: &[&str] = &["texture", "checker"];
        let key: String = map.next_key()?.ok_or_else(|| de::Error::invalid_length(0, &self))?;
        let input = match key.as_str() {
            "texture" => ColourInput::Texture(TextureInput { texture: map.next_value()? }),
            "checker" => ColourInput::Checker(CheckerInput { checker: map.next_value()? }),
            other => return Err(de::Error::unknown_field(other, KEYS)),
        };
        match map.next_key::<String>()? {
            Some(extra) => Err(de::Error::custom(format!("a colour input has one key, `{key}`; `{extra}` is one too many"))),
            None => Ok(input),
        }
    }
}

impl<'de> Deserialize<'de> for ColourInput {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ColourInputVisitor)
    }
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

impl JsonSchema for ColourInput {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "ColourInput".into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let colour = generator.subschema_for::<Colour>();
        let texture = generator.subschema_for::<TextureRef>();
        let checker = generator.subschema_for::<Checker>();
        json_schema!({
            "description": "A colour, the text of an expression evaluated at each hit, a texture or a checkerboard.",
            "anyOf": [
                colour,
                { "description": language(Scope::Surface), "type": "string" },
                { "type": "object", "properties": { "texture": texture }, "required": ["texture"], "additionalProperties": false },
                { "type": "object", "properties": { "checker": checker }, "required": ["checker"], "additionalProperties": false }
            ]
        })
    }
}
