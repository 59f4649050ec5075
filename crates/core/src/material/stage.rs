//! The two stages of a prepared layer: inputs that may vary over the surface, and their values at a
//! point. A layer's fields are listed once for both.

use core::fmt::Debug;

use super::ShadingFrame;
use super::metallic_roughness::MetallicRoughness;
use crate::number::Number;

/// Types of the fields of layers at a stage, by kind.
pub trait LayerStage {
    /// A share, from 0 to 1.
    type Share: Copy + Debug + PartialEq;
    /// A colour whose channels are shares.
    type Tint: Copy + Debug + PartialEq;
    /// A colour without negative channels.
    type Colour: Copy + Debug + PartialEq;
    /// Nanometres, from 0 on.
    type Thickness: Copy + Debug + PartialEq;
    /// The same number everywhere, in f64.
    type Constant: Copy + Debug + PartialEq;
    /// A number for each channel, the same everywhere.
    type Spectrum: Copy + Debug + PartialEq;
    /// A normal other than the surface's.
    type Normal: Copy + Debug + PartialEq;
    /// A frame on the surface.
    type Frame: Copy + Debug + PartialEq;
    /// The metallic-roughness model below the layers.
    type Base: Copy + Debug + PartialEq;
}

/// Values at a point, or at a point for each lane.
impl<N: Number> LayerStage for N {
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

/// Evaluates fields of a stage at a point, or at a point for each lane.
pub trait ReadAt<S: LayerStage, N: Number> {
    /// A share, clamped.
    fn share(&self, input: &S::Share) -> N;
    /// A colour, clamped.
    fn tint(&self, input: &S::Tint) -> N::Vec3;
    /// A colour, clamped below.
    fn colour(&self, input: &S::Colour) -> N::Vec3;
    /// Nanometres, clamped below.
    fn thickness(&self, input: &S::Thickness) -> N;
    /// A constant.
    fn constant(&self, input: &S::Constant) -> N::Exact;
    /// A constant for each channel.
    fn spectrum(&self, input: &S::Spectrum) -> N::Vec3;
    /// A unit normal on the side of the surface's.
    fn normal(&self, input: &S::Normal) -> N::Vec3;
    /// A frame about the surface's normal.
    fn frame(&self, input: &S::Frame) -> ShadingFrame<N>;
}

/// Defines a layer's struct from a list of fields: `field: Kind by reader;`.
macro_rules! layer {
    ($(#[$meta:meta])* $Name:ident $($(#[$of:meta])* $field:ident: $Kind:ident by $read:ident;)*) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct $Name<S: $crate::material::LayerStage> {
            $($(#[$of])* pub $field: S::$Kind,)*
        }

        impl<S: $crate::material::LayerStage> $Name<S> {
            /// Evaluates the fields at a point.
            pub fn at<N: $crate::number::Number>(&self, here: &impl $crate::material::ReadAt<S, N>) -> $Name<N> {
                $Name { $($field: here.$read(&self.$field),)* }
            }
        }
    };
}
pub(super) use layer;
