//! Operations of the expression language. Each node of the graph and each instruction of a program
//! holds an operation. The module [`run`](super::run) defines the results.

/// An operation on one to four operands, called a, b, c and d. Operands are numbers unless the text
/// says vector.
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
