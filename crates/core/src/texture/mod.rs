//! Inputs of materials (constants, expressions, images) and the filtering of images. The module
//! depends on the interaction, but not on materials, lights or preparation.

mod material_input;
pub(crate) mod mipmap;
mod sampler;

pub(crate) use material_input::{
    F64Programs, InputProduct, InputTables, NormalMapInput, PreparedInput, ShadingContext,
    TextureBinding,
};
pub(crate) use sampler::{TexelDecoder, TexelFootprint, TextureSampler, decode_srgb};
