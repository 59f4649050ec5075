//! The functions of the expression language by name, and the operations that they stand for. Parser,
//! messages and documentation share the table of functions.

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
pub(super) const FUNCTIONS: &[(&str, Function)] = {
    use Function::*;
    &[
        ("abs", Unary(Operation::Abs)),
        ("acos", Unary(Operation::Acos)),
        ("asin", Unary(Operation::Asin)),
        ("atan", Atan),
        ("atan2", Binary(Operation::Atan2)),
        ("ceil", Unary(Operation::Ceil)),
        ("checker", Checker),
        ("clamp", Clamp),
        ("cos", Unary(Operation::Cos)),
        ("cross", Cross),
        ("degrees", MultiplyBy(180.0 / core::f64::consts::PI)),
        ("dot", Dot),
        ("exp", Unary(Operation::Exp)),
        ("fbm", Noise(NoiseKind::Sum)),
        ("fbm2", PlaneNoise(NoiseKind::Sum)),
        ("floor", Unary(Operation::Floor)),
        ("fract", Unary(Operation::Fract)),
        ("if", If),
        ("length", Length),
        ("ln", Unary(Operation::Ln)),
        ("log", Unary(Operation::Ln)),
        ("max", Extremum(Operation::Max)),
        ("min", Extremum(Operation::Min)),
        ("mix", Mix),
        ("mod", Binary(Operation::Modulo)),
        ("noise", Noise(NoiseKind::One)),
        ("noise2", PlaneNoise(NoiseKind::One)),
        ("normalize", Normalize),
        ("pow", Binary(Operation::Power)),
        ("radians", MultiplyBy(core::f64::consts::PI / 180.0)),
        ("reflect", Reflect),
        ("round", Unary(Operation::Round)),
        ("sign", Unary(Operation::Sign)),
        ("sin", Unary(Operation::Sin)),
        ("smoothstep", Smoothstep),
        ("sqrt", Unary(Operation::Sqrt)),
        ("step", Binary(Operation::Step)),
        ("tan", Unary(Operation::Tan)),
        ("turbulence", Noise(NoiseKind::Turbulence)),
        ("turbulence2", PlaneNoise(NoiseKind::Turbulence)),
        ("vec3", Vector),
    ]
};

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

/// An operation on one to four operands, called a, b, c and d. Operands are numbers unless the text
/// says vector. Each node of the graph and each instruction of a program holds an operation. The
/// module [`run`](super::run) defines the results.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Operation {
    Negate,
    Not,
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Exp,
    Ln,
    Sqrt,
    Abs,
    Sign,
    Floor,
    Ceil,
    Fract,
    Round,
    Add,
    Subtract,
    Multiply,
    Divide,
    /// Remainder a − b ⌊a/b⌋, as `mod` in GLSL. It is zero or lies between zero and b, so it has
    /// the sign of b.
    Modulo,
    Power,
    /// The number a to the power of the stored whole exponent. Where the magnitude of a is below b,
    /// the result is zero; b is the [`underflow_limit_of_power`](super::semantics::underflow_limit_of_power) of the
    /// exponent.
    WholePower(u32),
    Min,
    Max,
    Atan2,
    /// 0 where b is below a, else 1.
    Step,
    /// Parity of ⌊a⌋ + ⌊b⌋: 0 or 1.
    Checker,
    Less,
    LessOrEqual,
    Greater,
    GreaterOrEqual,
    Equal,
    NotEqual,
    And,
    Or,
    /// a·b·c + d, computed as a single step: the most frequent form in formulas.
    ProductSum,
    /// Interpolation from a at c = 0 to b at c = 1.
    Mix,
    /// Cubic step from 0 at c = a to 1 at c = b.
    Smoothstep,
    /// b where a is true, else c.
    Select,
    /// Dot product of vectors.
    Dot,
    /// Length of a vector.
    Length,
    /// Gradient noise at a point in space.
    Noise,
    /// Sum of this number of octaves of noise.
    Sum(u32),
    /// Sum of the absolute values of this number of octaves of noise.
    Turbulence(u32),
    /// Gradient noise at the point (a, b) in the plane.
    PlaneNoise,
    PlaneSum(u32),
    PlaneTurbulence(u32),

    /// The vector (a, b, c). This operation and all following operations yield vectors; all
    /// preceding operations yield numbers.
    Compose,
    /// Componentwise sum of vectors.
    AddVectors,
    SubtractVectors,
    MultiplyVectors,
    DivideVectors,
    MinVectors,
    MaxVectors,
    /// A vector times a number.
    Scale,
    /// A vector divided by a number.
    DivideByNumber,
    /// Interpolation from vector a at c = 0 to vector b at c = 1.
    MixVectors,
    /// Vector b where the number a is true, else vector c.
    SelectVectors,
    Cross,
    Normalize,
}

impl Operation {
    /// Whether the result is a vector; `false` for a number.
    pub const fn is_vector(self) -> bool {
        use Operation::{
            AddVectors, Compose, Cross, DivideVectors, MaxVectors, MinVectors, MixVectors,
            MultiplyVectors,
        };
        use Operation::{DivideByNumber, Normalize, Scale, SelectVectors, SubtractVectors};
        matches!(
            self,
            Compose
                | AddVectors
                | SubtractVectors
                | MultiplyVectors
                | DivideVectors
                | MinVectors
                | MaxVectors
        ) || matches!(
            self,
            Scale | DivideByNumber | MixVectors | SelectVectors | Cross | Normalize
        )
    }

    /// Returns the operation on vectors that applies this operation to each component.
    pub const fn vector_operation(self) -> Option<Self> {
        match self {
            Self::Add => Some(Self::AddVectors),
            Self::Subtract => Some(Self::SubtractVectors),
            Self::Multiply => Some(Self::MultiplyVectors),
            Self::Divide => Some(Self::DivideVectors),
            Self::Min => Some(Self::MinVectors),
            Self::Max => Some(Self::MaxVectors),
            _ => None,
        }
    }

    /// Whether the operation requires two numbers, not vectors. All these operations yield 0 or 1.
    pub const fn requires_numbers(self) -> bool {
        use Operation::{
            And, Checker, Equal, Greater, GreaterOrEqual, Less, LessOrEqual, NotEqual, Or,
        };
        matches!(
            self,
            Less | LessOrEqual | Greater | GreaterOrEqual | Equal | NotEqual | And | Or | Checker
        )
    }

    /// Whether the result is 0 or 1 for all operands.
    pub const fn yields_truth_value(self) -> bool {
        self.requires_numbers() || matches!(self, Self::Not | Self::Step)
    }
}
