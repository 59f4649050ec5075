//! Triangle meshes, images and textures.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::Positions;

/// Sets of texture coordinates that a mesh may have.
pub const MOST_UV_SETS: usize = 8;

/// A named triangle mesh.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Mesh {
    /// Unique name that objects refer to.
    pub name: String,
    /// Where its triangles are.
    pub source: MeshSource,
    /// What of a glTF or GLB file is meant; none: its default scene at rest.
    #[serde(default)]
    pub model: Option<ModelPart>,
}

/// What of a model file a mesh is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct ModelPart {
    /// Name of one of its scenes or, where no name fits, its index; none: the file's default.
    pub scene: Option<String>,
    /// Seconds after the beginning of its animations; none: at rest.
    pub time: Option<f64>,
}

/// Where a mesh's triangles are. The loader replaces files by their data.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum MeshSource {
    /// In the scene itself.
    Inline(Arc<MeshData>),
    /// In an OBJ, glTF or GLB file, path relative to the scene's folder; all of its triangles as
    /// one mesh.
    File(String),
}

/// The arrays of a mesh. Transforms are applied in doubles.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct MeshData {
    /// Vertex positions in the mesh's own space.
    pub positions: Positions,
    /// Three vertex indices a triangle; counter-clockwise seen from outside.
    pub indices: Vec<[u32; 3]>,
    /// Shading normals a vertex; empty: flat facets.
    pub normals: Vec<[f32; 3]>,
    /// The way in which u of a normal map grows, a vertex, and on which side the image is up:
    /// bitangent = w·(normal × tangent), w being 1 or −1 (as in glTF 2.0, section 3.7.2.1); empty:
    /// made where a material has a normal map.
    pub tangents: Vec<[f32; 4]>,
    /// Sets of texture coordinates a vertex (v = 0 is the image's top row); empty: none.
    pub uvs: Vec<Vec<[f32; 2]>>,
    /// Linear colours a vertex with alpha; empty: white.
    pub colours: Vec<[f32; 4]>,
    /// Whether it is the cap of a section: its triangles are none of a file's, and none of their
    /// edges is drawn.
    #[serde(skip)]
    #[cfg_attr(test, schemars(skip))]
    pub is_cap: bool,
}

impl MeshData {
    /// Bytes that the arrays take.
    pub fn bytes(&self) -> usize {
        size_of_val(self.positions.offsets())
            + size_of_val(self.indices.as_slice())
            + size_of_val(self.normals.as_slice())
            + size_of_val(self.tangents.as_slice())
            + size_of_val(self.colours.as_slice())
            + self
                .uvs
                .iter()
                .map(|set| size_of_val(set.as_slice()))
                .sum::<usize>()
    }
}

/// A named image file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Image {
    /// Unique name that textures refer to.
    pub name: String,
    /// Path relative to the scene's folder, or `embedded:NAME` for what the program carries.
    pub path: String,
    /// Decoded pixels; filled in by the loader, none when the file could not be had (a warning, and
    /// the factor alone counts).
    #[serde(skip)]
    #[cfg_attr(test, schemars(skip))]
    pub data: Option<Arc<ImageData>>,
    /// Channels of texels that were infinite or no numbers in its file, in place of which the
    /// loader has put what light can be.
    #[serde(skip)]
    #[cfg_attr(test, schemars(skip))]
    pub mended: u64,
}

/// Decoded pixels, first row = top.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageData {
    /// Columns, above zero.
    pub width: u32,
    /// Rows, above zero.
    pub height: u32,
    /// Red, green, blue, alpha, row by row.
    pub pixels: Pixels,
}

impl ImageData {
    /// Bytes that the pixels take.
    pub fn bytes(&self) -> usize {
        match &self.pixels {
            Pixels::Codes(pixels) => size_of_val(pixels.as_slice()),
            Pixels::Linear(pixels) => size_of_val(pixels.as_slice()),
        }
    }
}

/// Storage of pixels.
#[derive(Clone, Debug, PartialEq)]
pub enum Pixels {
    /// Codes 0 to 255, four a pixel.
    Codes(Vec<[u8; 4]>),
    /// Linear values, four a pixel.
    Linear(Vec<[f32; 4]>),
}

/// A named texture: an image with how it is read.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Texture {
    /// Unique name that materials refer to.
    pub name: String,
    /// Name of the image.
    pub image: String,
    /// How 8-bit codes become numbers.
    #[serde(default)]
    pub colour_space: ColourSpace,
    /// How texels are combined.
    #[serde(default)]
    pub filter: Filter,
    /// Outside 0..1 horizontally.
    #[serde(default)]
    pub wrap_u: Wrap,
    /// Outside 0..1 vertically.
    #[serde(default)]
    pub wrap_v: Wrap,
}

/// How 8-bit codes become numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum ColourSpace {
    /// Decoded by the sRGB curve (IEC 61966-2-1).
    #[default]
    Srgb,
    /// Code / 255.
    Linear,
}

/// How texels are combined. Texel centres lie at half-integers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Filter {
    /// The nearest texel.
    Nearest,
    /// Weighted mean of four.
    #[default]
    Bilinear,
    /// Weighted mean of four in each of two smaller images, whose texels are as wide as a pixel is
    /// there.
    Mipmaps,
}

/// What lies outside 0..1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Wrap {
    /// The image again.
    #[default]
    Repeat,
    /// The image mirrored, in turns.
    MirroredRepeat,
    /// The border texel.
    Clamp,
}
