//! The field types of a material layer. Before a hit, a layer's fields are inputs that may vary
//! over the surface; at a hit, they are numbers. A macro defines a layer's struct for both cases.

use core::fmt::Debug;

use super::ShadingFrame;
use super::metallic_roughness::MetallicRoughness;
use crate::number::Number;

/// Types of the fields of a layer. Before a hit, the fields are inputs, such as textures. At a hit,
/// they are numbers. One generic struct serves both stages.
pub trait LayerFieldTypes {
    /// A number from 0 to 1.
    type Share: Copy + Debug + PartialEq;
    /// A colour with channels from 0 to 1.
    type Tint: Copy + Debug + PartialEq;
    /// A colour whose channels are at least 0.
    type Colour: Copy + Debug + PartialEq;
    /// A length in nanometres, at least 0.
    type Thickness: Copy + Debug + PartialEq;
    /// A number in `f64` that is constant over the surface.
    type Constant: Copy + Debug + PartialEq;
    /// A number for each channel, constant over the surface.
    type Spectrum: Copy + Debug + PartialEq;
    /// Normal of the layer itself, which may differ from the surface's normal.
    type Normal: Copy + Debug + PartialEq;
    /// Frame about the surface's normal with a given tangent.
    type Frame: Copy + Debug + PartialEq;
    /// The metallic-roughness model below the layers.
    type Base: Copy + Debug + PartialEq;
}

/// The field types at a hit: numbers, each with a value per lane.
impl<N: Number> LayerFieldTypes for N {
    type Share = N;
    type Tint = N::Vec3;
    type Colour = N::Vec3;
    type Thickness = N;
    type Constant = N::Exact;
    type Spectrum = N::Vec3;
    type Normal = N::Vec3;
    type Frame = ShadingFrame<N>;
    type Base = MetallicRoughness<N>;
}

/// Evaluator of a layer's fields: converts the inputs of type `S` to numbers `N` at a hit, or at
/// the hits of all SIMD lanes.
pub trait LayerFieldEvaluator<S: LayerFieldTypes, N: Number> {
    /// Evaluates a number, clamped to 0..1.
    fn eval_unit_number(&self, input: &S::Share) -> N;
    /// Evaluates a colour, clamped to 0..1.
    fn eval_tint(&self, input: &S::Tint) -> N::Vec3;
    /// Evaluates a colour, at least 0.
    fn eval_colour(&self, input: &S::Colour) -> N::Vec3;
    /// Evaluates a length in nanometres, at least 0.
    fn eval_thickness(&self, input: &S::Thickness) -> N;
    /// Returns a constant.
    fn eval_constant(&self, input: &S::Constant) -> N::Exact;
    /// Returns a constant colour or spectrum by channel.
    fn eval_spectrum(&self, input: &S::Spectrum) -> N::Vec3;
    /// Evaluates a unit normal, on the same side as the surface's normal.
    fn eval_normal(&self, input: &S::Normal) -> N::Vec3;
    /// Evaluates a frame about the surface's normal.
    fn eval_frame(&self, input: &S::Frame) -> ShadingFrame<N>;
}

/// Defines the struct of a layer from a list of fields `name: Kind by method;`. `method` is the
/// method of [`LayerFieldEvaluator`] that evaluates the field.
macro_rules! layer {
    ($(#[$meta:meta])* $Name:ident $($(#[$of:meta])* $field:ident: $Kind:ident by $read:ident;)*) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct $Name<S: $crate::material::LayerFieldTypes> {
            $($(#[$of])* pub $field: S::$Kind,)*
        }

        impl<S: $crate::material::LayerFieldTypes> $Name<S> {
            /// Returns the layer with its fields evaluated at a hit.
            pub fn at<N: $crate::number::Number>(&self, here: &impl $crate::material::LayerFieldEvaluator<S, N>) -> $Name<N> {
                $Name { $($field: here.$read(&self.$field),)* }
            }
        }
    };
}
pub(super) use layer;
