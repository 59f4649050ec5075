//! The instructions that a program runs over a file of registers.
//!
//! On the processors that we measured, an indirect jump costs as much as several operations, and an indirect call twice
//! that. So a program is few, wide steps: a product and a sum, or a comparison and a choice, are one step. Constants and
//! what is read of the hit are registers like any other and cost no step.

use super::semantics::{Binary, Unary};

/// What a step does to its operands a, b, c, d: numbers, or vectors where it says so. Products and sums round on their own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Opcode {
    Add,
    Subtract,
    Multiply,
    Divide,
    Min,
    Max,
    /// a b + c
    MultiplyAdd,
    /// a b − c
    MultiplySubtract,
    /// a + b c
    AddProduct,
    /// a − b c
    SubtractProduct,
    /// c − a b
    ScaledFrom,
    /// b − a
    SubtractFrom,
    /// min(max(a, b), c)
    Clamp,
    /// a to the whole power
    Power,
    /// max(a, b) to the whole power
    LobePower,
    Negate,
    SquareRoot,
    Absolute,
    Floor,
    Fraction,
    /// Parity of ⌊a⌋ + ⌊b⌋, as 0 or 1.
    Checker,
    /// From b at a = 0 to c at a = 1.
    Mix,
    /// The cubic step of a between b and c.
    Smoothstep,
    /// b where a is true, else c.
    Select,
    /// c where a < b, else d.
    SelectLess,
    /// The number a.
    Copy,
    /// The vector a.
    CopyVector,
    /// The vector (a, b, c).
    Compose,
    /// The vector (a, a, a).
    Splat,
    /// Sum of vectors.
    AddVectors,
    /// Difference of vectors.
    SubtractVectors,
    /// Componentwise product of vectors.
    MultiplyVectors,
    /// Vector a times b.
    Scale,
    /// Vector b times a.
    ScaleBy,
    /// Vector a divided by b.
    Shrink,
    /// Vector a plus vector b times c.
    AddScaledVector,
    /// Vector b plus vector c times a.
    ScaledAdd,
    /// Vector a plus b c in every component.
    AddGrey,
    /// Vector c plus a b in every component.
    GreyAdd,
    /// From vector b at a = 0 to vector c at a = 1.
    MixVectors,
    /// Vector b where a is true, else vector c.
    SelectVectors,
    /// Vector c where a < b, else vector d.
    SelectVectorsLess,
    /// Vector c where ⌊a⌋ + ⌊b⌋ is even, else vector d.
    CheckerVectors,
    /// Product of vectors.
    Dot,
    /// The product of vectors a and b, times c, plus d.
    DotMultiplyAdd,
    Length,
    Normalize,
    /// One of those that take long: [`Step::rare`].
    Rare,
}

/// Operations that take so long that how they are called does not matter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Rare {
    /// Not a rare step: nothing.
    None,
    /// 1 / a to the whole power
    ReciprocalPower,
    /// Any other function of one number.
    Unary(Unary),
    /// Any other function of two numbers.
    Binary(Binary),
    /// Any other operation in each component of two vectors.
    Vectors(Binary),
    Cross,
    /// Noise at the point a of space.
    SpaceNoise,
    /// Its sum over so many octaves.
    SpaceSum,
    /// The sum of its absolute values.
    SpaceTurbulence,
    /// Noise at the point (a, b) of a plane.
    PlaneNoise,
    PlaneSum,
    PlaneTurbulence,
}

/// One instruction. A register is a number's place in the file; a vector's is that of its x, at the start of a row of four.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    pub opcode: Opcode,
    /// Which one, for [`Opcode::Rare`]; apart from the opcode, so that both are plain indices.
    pub rare: Rare,
    /// The first operand is the result of the step before.
    pub chained: bool,
    /// Where the result goes.
    pub to: u8,
    pub from: [u8; 4],
    /// The whole power, or the count of octaves.
    pub whole: u32,
}

impl Opcode {
    /// The first operand is a vector.
    const fn starts_with_vector(self) -> bool {
        matches!(
            self,
            Self::CopyVector
                | Self::AddVectors
                | Self::SubtractVectors
                | Self::MultiplyVectors
                | Self::Scale
                | Self::Shrink
                | Self::AddScaledVector
                | Self::AddGrey
                | Self::Dot
                | Self::DotMultiplyAdd
                | Self::Length
                | Self::Normalize
        )
    }

    /// The same operation with another operand in front, and the places of its operands in this one's.
    const fn turned(self) -> &'static [(Self, [usize; 4])] {
        match self {
            Self::Add => &[(Self::Add, [1, 0, 2, 3])],
            Self::Multiply => &[(Self::Multiply, [1, 0, 2, 3])],
            Self::AddVectors => &[(Self::AddVectors, [1, 0, 2, 3])],
            Self::MultiplyVectors => &[(Self::MultiplyVectors, [1, 0, 2, 3])],
            Self::Dot => &[(Self::Dot, [1, 0, 2, 3])],
            Self::DotMultiplyAdd => &[(Self::DotMultiplyAdd, [1, 0, 2, 3])],
            Self::Subtract => &[(Self::SubtractFrom, [1, 0, 2, 3])],
            Self::MultiplyAdd => &[(Self::MultiplyAdd, [1, 0, 2, 3]), (Self::AddProduct, [2, 0, 1, 3])],
            Self::MultiplySubtract => &[(Self::MultiplySubtract, [1, 0, 2, 3])],
            Self::SubtractProduct => &[(Self::ScaledFrom, [1, 2, 0, 3]), (Self::ScaledFrom, [2, 1, 0, 3])],
            Self::Scale => &[(Self::ScaleBy, [1, 0, 2, 3])],
            Self::AddScaledVector => &[(Self::ScaledAdd, [2, 0, 1, 3])],
            Self::AddGrey => &[(Self::GreyAdd, [1, 2, 0, 3]), (Self::GreyAdd, [2, 1, 0, 3])],
            _ => &[],
        }
    }
}

impl Step {
    /// This step with the result of the step before as its first operand, if it can be.
    pub fn chain(self, before: Option<(&Step, bool)>) -> Self {
        let Some((before, is_vector)) = before else { return self };
        let mut forms = vec![(self.opcode, [0, 1, 2, 3])];
        forms.extend_from_slice(self.opcode.turned());
        for (opcode, order) in forms {
            if self.from[order[0]] == before.to && opcode.starts_with_vector() == is_vector {
                return Self { opcode, from: order.map(|place| self.from[place]), chained: true, ..self };
            }
        }
        self
    }
}
