//! The functions of the language, by name: one table for the parser, the messages and the documentation.

use super::semantics::{Binary, Noise, Unary};

/// How a name followed by arguments is understood.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Function {
    /// One argument, a vector componentwise.
    Unary(Unary),
    /// One argument times a constant, a vector componentwise.
    Times(f64),
    /// Two arguments, vectors componentwise.
    Binary(Binary),
    /// `atan(x)` or `atan(y, x)`.
    Atan,
    /// Two or more arguments, vectors componentwise.
    Extremum(Binary),
    /// `clamp(x, low, high)`.
    Clamp,
    /// `mix(a, b, t)`: a at t = 0, b at t = 1.
    Mix,
    /// `smoothstep(low, high, x)`.
    Smoothstep,
    /// `if(condition, then, else)`.
    If,
    /// `vec3(x, y, z)` or `vec3(x)`.
    Vector,
    /// `dot(a, b)`.
    Dot,
    /// `cross(a, b)`.
    Cross,
    /// `length(v)`.
    Length,
    /// `normalize(v)`.
    Normalize,
    /// `reflect(d, n)` with a unit n.
    Reflect,
    /// `checker(x, y)` or `checker(x, y, z)`: 0 or 1.
    Checker,
    /// `noise(p)`, `noise(x, y)` or `noise(x, y, z)`; sums have the count of octaves as one more argument.
    Noise(Octaves),
    /// The same in the plane only: `noise2(x, y)`.
    PlaneNoise(Octaves),
}

/// What a noise function makes of the count of octaves that it is called with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Octaves {
    /// Takes no count.
    One,
    Sum,
    Turbulence,
}

impl Octaves {
    /// The operation for this count of octaves.
    pub const fn noise(self, count: u32) -> Noise {
        match self {
            Self::One => Noise::Single,
            Self::Sum => Noise::Sum(count),
            Self::Turbulence => Noise::Turbulence(count),
        }
    }
}

/// Every function, alphabetically.
pub(super) const FUNCTIONS: &[(&str, Function)] = &[
    ("abs", Function::Unary(Unary::Abs)),
    ("acos", Function::Unary(Unary::Acos)),
    ("asin", Function::Unary(Unary::Asin)),
    ("atan", Function::Atan),
    ("atan2", Function::Binary(Binary::Atan2)),
    ("ceil", Function::Unary(Unary::Ceil)),
    ("checker", Function::Checker),
    ("clamp", Function::Clamp),
    ("cos", Function::Unary(Unary::Cos)),
    ("cross", Function::Cross),
    ("degrees", Function::Times(180.0 / core::f64::consts::PI)),
    ("dot", Function::Dot),
    ("exp", Function::Unary(Unary::Exp)),
    ("fbm", Function::Noise(Octaves::Sum)),
    ("fbm2", Function::PlaneNoise(Octaves::Sum)),
    ("floor", Function::Unary(Unary::Floor)),
    ("fract", Function::Unary(Unary::Fract)),
    ("if", Function::If),
    ("length", Function::Length),
    ("ln", Function::Unary(Unary::Ln)),
    ("log", Function::Unary(Unary::Ln)),
    ("max", Function::Extremum(Binary::Max)),
    ("min", Function::Extremum(Binary::Min)),
    ("mix", Function::Mix),
    ("mod", Function::Binary(Binary::Modulo)),
    ("noise", Function::Noise(Octaves::One)),
    ("noise2", Function::PlaneNoise(Octaves::One)),
    ("normalize", Function::Normalize),
    ("pow", Function::Binary(Binary::Power)),
    ("radians", Function::Times(core::f64::consts::PI / 180.0)),
    ("reflect", Function::Reflect),
    ("round", Function::Unary(Unary::Round)),
    ("sign", Function::Unary(Unary::Sign)),
    ("sin", Function::Unary(Unary::Sin)),
    ("smoothstep", Function::Smoothstep),
    ("sqrt", Function::Unary(Unary::Sqrt)),
    ("step", Function::Binary(Binary::Step)),
    ("tan", Function::Unary(Unary::Tan)),
    ("turbulence", Function::Noise(Octaves::Turbulence)),
    ("turbulence2", Function::PlaneNoise(Octaves::Turbulence)),
    ("vec3", Function::Vector),
];

/// Named numbers.
pub(super) const CONSTANTS: &[(&str, f64)] =
    &[("e", core::f64::consts::E), ("pi", core::f64::consts::PI), ("tau", core::f64::consts::TAU)];

/// Names of all functions, alphabetically: for documentation and its tests.
pub fn function_names() -> impl Iterator<Item = &'static str> {
    FUNCTIONS.iter().map(|(name, _)| *name)
}

/// Names of all constants.
pub fn constant_names() -> impl Iterator<Item = &'static str> {
    CONSTANTS.iter().map(|(name, _)| *name)
}

/// The function of this name.
pub(super) fn function(name: &str) -> Option<Function> {
    FUNCTIONS.iter().find(|(known, _)| *known == name).map(|(_, function)| *function)
}

/// The constant of this name.
pub(super) fn constant(name: &str) -> Option<f64> {
    CONSTANTS.iter().find(|(known, _)| *known == name).map(|(_, value)| *value)
}
