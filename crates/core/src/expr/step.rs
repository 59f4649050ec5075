//! The instructions that a program runs over a file of registers.
//!
//! On the processors that we measured, an indirect jump costs as much as all the rest of a step, and an indirect call more.
//! So a program is few, wide steps, and the one that formulas mostly are made of, a sum with a product, is told apart by a
//! comparison; only the others jump. Constants and what is read of the hit are registers like any other and cost no step.

use super::semantics::{Binary, Unary};

/// What a step does to its operands a, b, c, d: numbers, or vectors where it says so. Products and sums round on their own,
/// from the left. What a formula lacks of a sum with a product is filled with constants that change no bit: factors of 1
/// and a summand of −0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Opcode {
    /// a / b
    Divide,
    Min,
    Max,
    /// min(max(a, b), c)
    Clamp,
    /// a to the whole power
    Power,
    /// max(a, b) to the whole power
    LobePower,
    Sine,
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
    /// Length of a vector.
    Length,
    /// Length of vector a minus vector b.
    Distance,
    /// The product of vectors a and b, times c, plus d.
    DotSum,
    /// Vector a times b, plus vector c.
    VectorSum,
    /// A number that takes long: [`Step::rare`].
    RareNumber,
    /// The vector (a, b, c).
    Compose,
    /// Componentwise product of vectors.
    MultiplyVectors,
    /// Vector a divided by b.
    Shrink,
    /// Vector a plus b c in every component.
    AddGrey,
    /// From vector b at a = 0 to vector c at a = 1.
    MixVectors,
    /// Vector b where a is true, else vector c.
    SelectVectors,
    /// Vector c where a < b, else vector d.
    SelectVectorsLess,
    /// Vector c where ⌊a⌋ + ⌊b⌋ is even, else vector d.
    CheckerVectors,
    Normalize,
    /// A vector that takes long: [`Step::rare`].
    RareVector,
}

/// Operations that take so long that how they are called does not matter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Rare {
    /// Not a rare step: zero.
    None,
    /// 1 / a to the whole power
    ReciprocalPower,
    /// Any other function of one number.
    Unary(Unary),
    /// Any other function of two numbers.
    Binary(Binary),
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
    Cross,
    /// Any other operation in each component of two vectors.
    Vectors(Binary),
}

/// One instruction. A register is a number's place in the file; a vector's is that of its x, at the start of a row of four.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    /// a b c + d of numbers, and no [`Step::opcode`]; apart from it, so that the two are decided one after the other.
    pub is_sum: bool,
    pub opcode: Opcode,
    /// Which one, for [`Opcode::RareNumber`] and [`Opcode::RareVector`].
    pub rare: Rare,
    /// Where the result goes.
    pub to: u8,
    pub from: [u8; 4],
    /// The whole power, or the count of octaves.
    pub whole: u32,
    /// Of the power: see [`vanishing`](super::semantics::vanishing).
    pub limit: f32,
}
