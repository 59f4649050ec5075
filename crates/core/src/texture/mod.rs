//! Inputs of materials (constants, expressions, images) and the filtering of images. The module
//! depends on the interaction, but not on materials, lights or preparation.

mod input;
pub(crate) mod pyramid;
mod sampler;

pub(crate) use input::{
    Bump, FarPrograms, InputProduct, PreparedInput, ShadingContext, TextureBinding, TextureTables,
};
pub(crate) use sampler::{Sampler, TexelCodes, TexelFootprint, decoded};
