//! Inputs of materials as in a scene file: numbers, colours, and values that are evaluated at each
//! hit.

mod read;

use serde::{Deserialize, Serialize};

use super::Triple;

pub(super) use read::deserialize_early;

/// Linear Rec. 709 red, green and blue. A single number in a file stands for all three channels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[serde(transparent)]
pub struct Colour(pub Triple);

impl Colour {
    /// One in every channel.
    pub const WHITE: Self = Self([1.0; 3]);
    /// Zero in every channel.
    pub const BLACK: Self = Self([0.0; 3]);
}

/// A factor of a material: a number, or an expression that is evaluated at each hit.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum ScalarFactor {
    /// A constant.
    Number(f64),
    /// Text of an expression whose value is a number; [`crate::expr`] lists its variables.
    Expression(String),
}

impl Default for ScalarFactor {
    fn default() -> Self {
        Self::Number(1.0)
    }
}

/// A checkerboard of two colours in square cells of world x and z. The colour is `even` where
/// ⌊x/size⌋ + ⌊z/size⌋ is even.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Checker {
    /// Colour of cells whose indices ⌊x/size⌋ and ⌊z/size⌋ have an even sum.
    pub even: Colour,
    /// Colour of cells whose indices ⌊x/size⌋ and ⌊z/size⌋ have an odd sum.
    pub odd: Colour,
    /// Edge of a cell in world units.
    #[serde(default = "default_cell_size")]
    pub size: f64,
}

fn default_cell_size() -> f64 {
    1.0
}

/// Value of a material or sky that may vary: a constant, an expression, an image texture or a
/// checkerboard. `T` is the type of a constant: a number or a colour.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Input<T> {
    /// A constant.
    Constant(T),
    /// Text of an expression that is evaluated at each hit. For a colour, a number means grey.
    Expression(String),
    /// An image texture: `{ texture = { name = "…" } }`.
    Texture(TextureInput),
    /// A checkerboard in world x and z: `{ checker = { even, odd } }`. An input that is a number
    /// uses the red channel of the colours.
    Checker(CheckerInput),
}

/// An [`Input`] whose value is a colour.
pub type ColourInput = Input<Colour>;

/// An [`Input`] whose value is a number.
pub type NumberInput = Input<f64>;

/// Type of a constant in an [`Input`]: a number or a colour.
pub trait InputValue: Copy + PartialEq + Serialize + 'static {
    /// Description of the accepted values, for messages.
    const EXPECTED: &'static str;
    /// Creates a value from a single number in a file.
    fn from_number(number: f64) -> Self;
    /// Creates a value from three numbers in a file; `None` if the type is a number.
    fn from_colour(colour: Colour) -> Option<Self>;
    /// Converts to a colour; a number becomes grey.
    fn to_colour(self) -> Colour;
}

impl InputValue for f64 {
    const EXPECTED: &'static str =
        "a number, an expression in quotes, { texture = … } or { checker = … }";
    fn from_number(number: f64) -> Self {
        number
    }
    fn from_colour(_: Colour) -> Option<Self> {
        None
    }
    fn to_colour(self) -> Colour {
        Colour([self; 3])
    }
}

impl InputValue for Colour {
    const EXPECTED: &'static str =
        "[red, green, blue], a number, an expression in quotes, { texture = … } or { checker = … }";
    fn from_number(number: f64) -> Self {
        Self([number; 3])
    }
    fn from_colour(colour: Colour) -> Option<Self> {
        Some(colour)
    }
    fn to_colour(self) -> Colour {
        self
    }
}

/// A use of a named texture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct TextureRef {
    /// Name of the texture.
    pub name: String,
    /// Index of the mesh's set of texture coordinates. Set 0 of a mesh without texture coordinates
    /// has the barycentric weights of each triangle's second and third corner. Any other set that
    /// the mesh lacks reads (0, 0). Shapes have a single set, 0.
    #[serde(default)]
    pub uv_set: u32,
    /// Affine map of the texture coordinates, as the rows of a 2×3 matrix. None: the coordinates
    /// are unchanged.
    #[serde(default)]
    pub uv_transform: Option<[[f64; 3]; 2]>,
    /// Expressions for the coordinates u and v, evaluated at each hit. None: the surface's own
    /// texture coordinates.
    #[serde(default)]
    pub uv: Option<[ScalarFactor; 2]>,
    /// Factor on the texel's colour.
    #[serde(default = "default_white")]
    pub factor: Colour,
    /// The channel to read. None: red for a number, all channels for a colour.
    #[serde(default)]
    pub channel: Option<Channel>,
}

/// A channel of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Channel {
    /// The first channel.
    Red = 0,
    /// The second channel.
    Green = 1,
    /// The third channel.
    Blue = 2,
    /// Coverage (opacity). The texture use's `factor` does not apply to it.
    Alpha = 3,
}

pub(super) fn default_white() -> Colour {
    Colour::WHITE
}

/// Image texture as the value of an [`Input`]. In a file it is the table `{ texture = … }`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TextureInput {
    /// The texture use.
    pub texture: TextureRef,
}

/// Checkerboard as the value of an [`Input`]. In a file it is the table `{ checker = … }`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CheckerInput {
    /// The two colours and the cell size.
    pub checker: Checker,
}

impl<T: InputValue> Default for Input<T> {
    /// Creates the constant 1, or white.
    fn default() -> Self {
        Self::Constant(T::from_number(1.0))
    }
}

impl<T: InputValue> From<T> for Input<T> {
    fn from(value: T) -> Self {
        Self::Constant(value)
    }
}

impl<T: InputValue> Input<T> {
    /// Returns the value of a constant; `None` for an input that varies.
    pub fn constant(&self) -> Option<T> {
        if let Self::Constant(value) = self {
            Some(*value)
        } else {
            None
        }
    }
}
