//! Inputs that are either a number, a colour, or something evaluated at each hit.

use core::fmt;
use core::marker::PhantomData;

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

/// A number or a colour that may vary over a surface.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Input<T> {
    /// The same everywhere.
    Constant(T),
    /// Text of an expression of the hit; where a colour is wanted, a number means grey.
    Expression(String),
    /// An image texture: `{ texture = { name = "…" } }`.
    Texture(TextureInput),
    /// A checkerboard in world x and z: `{ checker = { even, odd } }`; of a number, its red parts.
    Checker(CheckerInput),
}

/// A colour that may vary over a surface.
pub type ColourInput = Input<Colour>;

/// A number that may vary over a surface.
pub type NumberInput = Input<f64>;

/// What an [`Input`] is of: a number or a colour.
pub trait Value: Copy + PartialEq + JsonSchema + Serialize + 'static {
    /// Name in the schema.
    const NAME: &'static str;
    /// What may be written, for messages.
    const EXPECTED: &'static str;
    /// What is written as one number.
    fn of_number(number: f64) -> Self;
    /// What is written as three numbers; none where one is wanted.
    fn of_colour(colour: Colour) -> Option<Self>;
    /// As a colour; a number is grey.
    fn colour(self) -> Colour;
}

impl Value for f64 {
    const NAME: &'static str = "NumberInput";
    const EXPECTED: &'static str = "a number, an expression in quotes, { texture = … } or { checker = … }";
    fn of_number(number: f64) -> Self {
        number
    }
    fn of_colour(_: Colour) -> Option<Self> {
        None
    }
    fn colour(self) -> Colour {
        Colour([self; 3])
    }
}

impl Value for Colour {
    const NAME: &'static str = "ColourInput";
    const EXPECTED: &'static str = "[red, green, blue], a number, an expression in quotes, { texture = … } or { checker = … }";
    fn of_number(number: f64) -> Self {
        Self([number; 3])
    }
    fn of_colour(colour: Colour) -> Option<Self> {
        Some(colour)
    }
    fn colour(self) -> Colour {
        self
    }
}

/// What may be asked of any input, whatever it is of, and of an image that multiplies one.
pub trait Varying {
    /// The use of a texture, and the key under which it is; empty where it is the input itself.
    fn texture(&self) -> Option<(&'static str, &TextureRef)>;
    /// The text of an expression, and whether it must be a number.
    fn expression(&self) -> Option<(&str, bool)>;
    /// The checkerboard.
    fn checker(&self) -> Option<&Checker>;
    /// Turns an image into its factor, a checkerboard into the mean of its colours.
    fn flatten(&mut self, images: bool, checkers: bool);
}

impl<T: Value> Varying for Input<T> {
    fn texture(&self) -> Option<(&'static str, &TextureRef)> {
        if let Self::Texture(input) = self { Some(("texture", &input.texture)) } else { None }
    }
    fn expression(&self) -> Option<(&str, bool)> {
        if let Self::Expression(text) = self { Some((text, T::of_colour(Colour::BLACK).is_none())) } else { None }
    }
    fn checker(&self) -> Option<&Checker> {
        if let Self::Checker(input) = self { Some(&input.checker) } else { None }
    }
    fn flatten(&mut self, images: bool, checkers: bool) {
        let colour = match self {
            Self::Texture(input) if images => input.texture.factor,
            Self::Checker(CheckerInput { checker }) if checkers => {
                Colour(core::array::from_fn(|i| 0.5 * (checker.even.0[i] + checker.odd.0[i])))
            }
            _ => return,
        };
        *self = Self::Constant(T::of_colour(colour).unwrap_or_else(|| T::of_number(colour.0[0])));
    }
}

impl Varying for Option<TextureRef> {
    fn texture(&self) -> Option<(&'static str, &TextureRef)> {
        self.as_ref().map(|texture| ("", texture))
    }
    fn expression(&self) -> Option<(&str, bool)> {
        None
    }
    fn checker(&self) -> Option<&Checker> {
        None
    }
    fn flatten(&mut self, images: bool, _: bool) {
        if images {
            *self = None;
        }
    }
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

impl<T: Value> Default for Input<T> {
    /// One, or white.
    fn default() -> Self {
        Self::Constant(T::of_number(1.0))
    }
}

impl<T: Value> From<T> for Input<T> {
    fn from(value: T) -> Self {
        Self::Constant(value)
    }
}

impl<T: Value> Input<T> {
    /// The value, where it is the same everywhere.
    pub fn constant(&self) -> Option<T> {
        if let Self::Constant(value) = self { Some(*value) } else { None }
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
pub(super) fn early<'de, T: Value, D: Deserializer<'de>>(deserializer: D) -> Result<Input<T>, D::Error> {
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
