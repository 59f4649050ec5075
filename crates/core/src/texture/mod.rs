//! What varies over a surface: inputs that are constants, expressions or images, and how images are
//! read. It knows where a ray hit, and nothing of materials, lights or how any of it is prepared.

mod input;
pub(crate) mod pyramid;
mod sampler;

pub(crate) use input::{Bump, FarPrograms, Input, Product, ShadingContext, Sources, TextureUse};
pub(crate) use sampler::{Codes, Place, Sampler, decoded};
