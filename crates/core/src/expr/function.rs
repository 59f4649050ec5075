//! The functions of the expression language by name. Parser, messages and documentation share this
//! table.

use super::operation::Operation;

/// Kind of a function, which determines its arguments.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Function {
    /// A function of one argument, applied to each component of a vector.
    Unary(Operation),
    /// Product of an argument and this constant, for each component of a vector.
    MultiplyBy(f64),
    /// A function of two arguments, applied to each component of vectors.
    Binary(Operation),
    /// `atan(x)` or `atan(y, x)`.
    Atan,
    /// A minimum or maximum of two or more arguments, applied to each component of vectors.
    Extremum(Operation),
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
    /// `noise(p)`, `noise(x, y)` or `noise(x, y, z)`. Sums of octaves take the number of octaves as
    /// an additional argument.
    Noise(NoiseKind),
    /// Noise in the plane, `noise2(x, y)`. Sums of octaves take the number of octaves as an
    /// additional argument.
    PlaneNoise(NoiseKind),
}

/// Combination of octaves by a noise function. An octave is gradient noise at one scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum NoiseKind {
    /// A single octave. The function takes no number of octaves.
    One,
    /// Sum of octaves.
    Sum,
    /// Sum of the absolute values of octaves.
    Turbulence,
}

impl NoiseKind {
    /// Returns the operation that evaluates the noise at a point in space, with a number of
    /// octaves.
    pub const fn noise_operation_3d(self, count: u32) -> Operation {
        match self {
            Self::One => Operation::Noise,
            Self::Sum => Operation::Sum(count),
            Self::Turbulence => Operation::Turbulence(count),
        }
    }

    /// Returns the operation that evaluates the noise at a point in the plane, with a number of
    /// octaves.
    pub const fn noise_operation_2d(self, count: u32) -> Operation {
        match self {
            Self::One => Operation::PlaneNoise,
            Self::Sum => Operation::PlaneSum(count),
            Self::Turbulence => Operation::PlaneTurbulence(count),
        }
    }
}

/// All functions in alphabetical order of their names.
pub(super) const FUNCTIONS: &[(&str, Function)] = &[
    ("abs", Function::Unary(Operation::Abs)),
    ("acos", Function::Unary(Operation::Acos)),
    ("asin", Function::Unary(Operation::Asin)),
    ("atan", Function::Atan),
    ("atan2", Function::Binary(Operation::Atan2)),
    ("ceil", Function::Unary(Operation::Ceil)),
    ("checker", Function::Checker),
    ("clamp", Function::Clamp),
    ("cos", Function::Unary(Operation::Cos)),
    ("cross", Function::Cross),
    (
        "degrees",
        Function::MultiplyBy(180.0 / core::f64::consts::PI),
    ),
    ("dot", Function::Dot),
    ("exp", Function::Unary(Operation::Exp)),
    ("fbm", Function::Noise(NoiseKind::Sum)),
    ("fbm2", Function::PlaneNoise(NoiseKind::Sum)),
    ("floor", Function::Unary(Operation::Floor)),
    ("fract", Function::Unary(Operation::Fract)),
    ("if", Function::If),
    ("length", Function::Length),
    ("ln", Function::Unary(Operation::Ln)),
    ("log", Function::Unary(Operation::Ln)),
    ("max", Function::Extremum(Operation::Max)),
    ("min", Function::Extremum(Operation::Min)),
    ("mix", Function::Mix),
    ("mod", Function::Binary(Operation::Modulo)),
    ("noise", Function::Noise(NoiseKind::One)),
    ("noise2", Function::PlaneNoise(NoiseKind::One)),
    ("normalize", Function::Normalize),
    ("pow", Function::Binary(Operation::Power)),
    (
        "radians",
        Function::MultiplyBy(core::f64::consts::PI / 180.0),
    ),
    ("reflect", Function::Reflect),
    ("round", Function::Unary(Operation::Round)),
    ("sign", Function::Unary(Operation::Sign)),
    ("sin", Function::Unary(Operation::Sin)),
    ("smoothstep", Function::Smoothstep),
    ("sqrt", Function::Unary(Operation::Sqrt)),
    ("step", Function::Binary(Operation::Step)),
    ("tan", Function::Unary(Operation::Tan)),
    ("turbulence", Function::Noise(NoiseKind::Turbulence)),
    ("turbulence2", Function::PlaneNoise(NoiseKind::Turbulence)),
    ("vec3", Function::Vector),
];

/// Named constants.
pub(super) const CONSTANTS: &[(&str, f64)] = &[
    ("e", core::f64::consts::E),
    ("pi", core::f64::consts::PI),
    ("tau", core::f64::consts::TAU),
];

/// Iterates over the names of all functions in alphabetical order, for documentation and its tests.
pub fn function_names() -> impl Iterator<Item = &'static str> {
    FUNCTIONS.iter().map(|(name, _)| *name)
}

/// Iterates over the names of all constants.
pub fn constant_names() -> impl Iterator<Item = &'static str> {
    CONSTANTS.iter().map(|(name, _)| *name)
}

/// Returns the function with this name.
pub(super) fn find_function(name: &str) -> Option<Function> {
    FUNCTIONS
        .iter()
        .find(|(known, _)| *known == name)
        .map(|(_, function)| *function)
}

/// Returns the constant with this name.
pub(super) fn find_constant(name: &str) -> Option<f64> {
    CONSTANTS
        .iter()
        .find(|(known, _)| *known == name)
        .map(|(_, value)| *value)
}
