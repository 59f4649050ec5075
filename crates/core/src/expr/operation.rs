//! The operations of the language, one by one: nodes of the graph that a source becomes, and steps
//! of the program that the graph becomes. What each computes is in [`run`](super::run).

/// An operation on one to four operands a, b, c, d: numbers, or vectors where it says so.
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
    /// a − b ⌊a/b⌋: the sign of the divisor, as in GLSL, and nearer to zero than it.
    Modulo,
    Power,
    /// a to this power, where it is not zero: b is the limit [below
    /// which](super::semantics::vanishing) it is.
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
    /// a b c + d: a sum with a product, which formulas are mostly made of, in one step.
    ProductSum,
    /// From a at c = 0 to b at c = 1.
    Mix,
    /// The cubic step of c between a and b.
    Smoothstep,
    /// b where a is true, else c.
    Select,
    /// Scalar product of vectors.
    Dot,
    /// Length of a vector.
    Length,
    /// Gradient noise at a point of space.
    Noise,
    /// So many octaves of it.
    Sum(u32),
    /// The absolute values of so many octaves of it.
    Turbulence(u32),
    /// Gradient noise at the point (a, b) of a plane.
    PlaneNoise,
    PlaneSum(u32),
    PlaneTurbulence(u32),

    /// The vector (a, b, c). This and all below are vectors; everything above is a number.
    Compose,
    /// Vectors, in each component; so the next five.
    AddVectors,
    SubtractVectors,
    MultiplyVectors,
    DivideVectors,
    MinVectors,
    MaxVectors,
    /// A vector times a number.
    Scale,
    /// A vector divided by a number.
    Shrink,
    /// From vector a at c = 0 to vector b at c = 1.
    MixVectors,
    /// Vector b where the number a is true, else vector c.
    SelectVectors,
    Cross,
    Normalize,
}

impl Operation {
    /// Yields a vector; `false` for a number.
    pub const fn is_vector(self) -> bool {
        use Operation::{
            AddVectors, Compose, Cross, DivideVectors, MaxVectors, MinVectors, MixVectors,
            MultiplyVectors,
        };
        use Operation::{Normalize, Scale, SelectVectors, Shrink, SubtractVectors};
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
            Scale | Shrink | MixVectors | SelectVectors | Cross | Normalize
        )
    }

    /// The operation on vectors that does this one in each component at once.
    pub const fn on_vectors(self) -> Option<Self> {
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

    /// A truth value, 0 or 1, of two numbers that must not be vectors.
    pub const fn is_of_numbers_only(self) -> bool {
        use Operation::{
            And, Checker, Equal, Greater, GreaterOrEqual, Less, LessOrEqual, NotEqual, Or,
        };
        matches!(
            self,
            Less | LessOrEqual | Greater | GreaterOrEqual | Equal | NotEqual | And | Or | Checker
        )
    }

    /// Is 0 or 1, whatever the operands.
    pub const fn is_truth(self) -> bool {
        self.is_of_numbers_only() || matches!(self, Self::Not | Self::Step)
    }
}
