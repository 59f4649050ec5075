//! Triangle meshes, images and textures as in a scene file.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::VertexPositions;

/// Greatest number of sets of texture coordinates of a mesh.
pub const MOST_UV_SETS: usize = 8;

/// A named triangle mesh.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Mesh {
    /// Unique name that objects refer to.
    pub name: String,
    /// Source of the triangles.
    pub source: MeshSource,
    /// Part of a glTF or GLB file that the mesh shows. None: the file's default scene at rest.
    #[serde(default)]
    pub model: Option<ModelSelection>,
}

/// The part of a glTF or GLB file that a mesh shows.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct ModelSelection {
    /// Name of a scene of the file; if no scene has this name, its index. None: the file's default
    /// scene.
    pub scene: Option<String>,
    /// Seconds after the start of the file's animations. None: at rest.
    pub time: Option<f64>,
}

/// Source of a mesh's triangles. The loader replaces files by their data.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum MeshSource {
    /// Arrays in the scene file itself.
    Inline(Arc<MeshData>),
    /// Path of an OBJ, glTF or GLB file, relative to the scene's folder. All triangles of the file
    /// become a single mesh.
    File(String),
}

/// The arrays of a mesh: vertices with their attributes, and triangles.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
#[doc(alias = "TriangleMesh")]
pub struct MeshData {
    /// Vertex positions in the mesh's own space.
    pub positions: VertexPositions,
    /// Three vertex indices for each triangle, counter-clockwise as seen from outside.
    pub indices: Vec<[u32; 3]>,
    /// Shading normal for each vertex. Empty: the facets are flat.
    pub normals: Vec<[f32; 3]>,
    /// Tangent for each vertex, as in glTF 2.0, section 3.7.2.1. It is the direction in which a
    /// normal map's u grows, followed by the sign w (1 or −1) of the bitangent w·(normal ×
    /// tangent). Empty: tangents are computed if a material has a normal map.
    pub tangents: Vec<[f32; 4]>,
    /// Sets of texture coordinates, each with u and v for each vertex; v = 0 is the image's top
    /// row. Empty: no texture coordinates.
    pub uvs: Vec<Vec<[f32; 2]>>,
    /// Linear red, green, blue and alpha for each vertex. Empty: white.
    pub colours: Vec<[f32; 4]>,
    /// Whether the mesh is the cap that closes a cut through the scene. The triangles of a cap come
    /// from no file, and their edges are not drawn.
    #[serde(skip)]
    #[cfg_attr(test, schemars(skip))]
    pub is_cap: bool,
}

impl MeshData {
    /// Returns the size of the arrays in bytes.
    pub fn byte_size(&self) -> usize {
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
    /// Path relative to the scene's folder, or `embedded:NAME` for an image built into the program.
    pub path: String,
    /// Decoded pixels, which the loader fills in. `None` if the file could not be read: the loader
    /// warns, and textures have the colour of their factor.
    #[serde(skip)]
    #[cfg_attr(test, schemars(skip))]
    pub data: Option<Arc<ImageData>>,
    /// Number of channels of pixels that were infinite or NaN in the file. The loader replaced them
    /// by valid values.
    #[serde(skip)]
    #[cfg_attr(test, schemars(skip))]
    pub mended: u64,
}

/// Decoded pixels of an image, from the top row down.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageData {
    /// Width in pixels, above zero.
    pub width: u32,
    /// Height in pixels, above zero.
    pub height: u32,
    /// Red, green, blue and alpha of each pixel, row by row.
    pub pixels: PixelData,
}

impl ImageData {
    /// Returns the size of the pixels in bytes.
    pub fn byte_size(&self) -> usize {
        match &self.pixels {
            PixelData::Codes(pixels) => size_of_val(pixels.as_slice()),
            PixelData::Linear(pixels) => size_of_val(pixels.as_slice()),
        }
    }
}

/// Pixels of an image in their stored format.
#[derive(Clone, Debug, PartialEq)]
pub enum PixelData {
    /// Four codes from 0 to 255 per pixel.
    Codes(Vec<[u8; 4]>),
    /// Four linear values per pixel.
    Linear(Vec<[f32; 4]>),
}

/// A named texture: an image with its colour space, filter and wrap modes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Texture {
    /// Unique name that materials refer to.
    pub name: String,
    /// Name of the image.
    pub image: String,
    /// Conversion of 8-bit codes to numbers.
    #[serde(default)]
    pub colour_space: ColourSpace,
    /// Interpolation between texels.
    #[serde(default)]
    pub filter: TextureFilter,
    /// Wrap mode of u outside 0..1, horizontally.
    #[serde(default)]
    pub wrap_u: WrapMode,
    /// Wrap mode of v outside 0..1, vertically.
    #[serde(default)]
    pub wrap_v: WrapMode,
}

/// Conversion of 8-bit codes to numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum ColourSpace {
    /// Decoded by the sRGB curve (IEC 61966-2-1).
    #[default]
    Srgb,
    /// The value is the code over 255.
    Linear,
}

/// Interpolation between texels. Texel centres lie at half-integers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum TextureFilter {
    /// The nearest texel.
    Nearest,
    /// Weighted mean of four texels.
    #[default]
    Bilinear,
    /// Weighted mean of four texels in each of two mipmap levels. Their texels are next wider and
    /// next narrower than the pixel's footprint on the surface.
    Mipmaps,
}

/// Treatment of texture coordinates outside 0..1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum WrapMode {
    /// Repeats the image.
    #[default]
    Repeat,
    /// Repeats the image and mirrors every second copy.
    MirroredRepeat,
    /// Repeats the border texel.
    Clamp,
}
