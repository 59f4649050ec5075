//! Products of inputs, and the inputs of normal maps.

use raywright_bvh::Real;

use super::material_input::{PreparedInput, ShadingContext};

/// Product of an input and an image from a separate key of the file, such as `roughness` and
/// `register_roughness_texture`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct InputProduct<R: Real> {
    pub input: PreparedInput<R>,
    pub image: Option<PreparedInput<R>>,
}

impl<R: Real> InputProduct<R> {
    /// Evaluates the product as a number.
    #[inline(always)]
    pub fn eval_number(&self, context: &ShadingContext<'_, R>) -> R {
        let own = self.input.eval_number(context);
        if let Some(image) = &self.image {
            own * image.eval_number(context)
        } else {
            own
        }
    }

    /// Multiplies a colour by the product.
    #[inline(always)]
    pub fn multiply_colour(&self, context: &ShadingContext<'_, R>, colour: R::Vec3) -> R::Vec3 {
        let own = colour * self.input.eval_colour(context);
        if let Some(image) = &self.image {
            own * image.eval_colour(context)
        } else {
            own
        }
    }

    /// Returns the product's value, or `None` if the input or the image varies.
    pub fn constant_value(&self) -> Option<R::Vec3> {
        match (self.input, self.image) {
            (PreparedInput::Constant(value), None) => Some(value),
            _ => None,
        }
    }
}

/// A normal map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct NormalMapInput<R: Real> {
    pub image: PreparedInput<R>,
    /// Factor on the tangential components of the image's normal.
    pub scale: R,
}
