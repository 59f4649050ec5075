//! Textures of a glTF file: images located once and decoded in parallel, samplers, and transforms
//! of texture coordinates (KHR_texture_transform).

use std::borrow::Cow;

use raywright_core::scene::{
    Colour, ColourSpace, Image as SceneImage, Texture as SceneTexture, TextureFilter, TextureRef,
    WrapMode,
};
use raywright_core::validate::MAX_COORDINATE;

use super::GltfImport;
use super::accessor::find_entry;
use super::entries::{ImageEntry, TextureEntry, TextureInfo, TextureSampler, TextureTransform};
use super::extensions::TextureRole;
use crate::import::{Fault, FaultPlace, ImportResult, catch_invalid_input};
use crate::{image_file, uri};

/// Largest number of texture coordinate sets; the specification requires two.
pub(super) const MOST_UV_SETS: u32 = raywright_core::scene::MOST_UV_SETS as u32;

impl<'a> GltfImport<'a> {
    /// Returns a material's texture reference; `None` without a texture. If the image is
    /// unreadable, a warning is added and `None` is returned.
    pub(super) fn convert_texture_ref(
        &mut self,
        info: Option<&TextureInfo>,
        used_as: TextureRole,
    ) -> ImportResult<Option<TextureRef>> {
        let Some(info) = info else { return Ok(None) };
        let index = info.index as usize;
        let name = match catch_invalid_input(self.convert_texture(index, used_as))? {
            Ok(name) => name,
            Err(reason) => {
                warn!(self.warnings, Picture, "{reason}; the texture is left out");
                None
            }
        };
        let Some(name) = name else { return Ok(None) };
        let transform = info.extensions.transform.as_ref();
        let uv_set = transform
            .and_then(|t| t.tex_coord)
            .unwrap_or(info.tex_coord);
        if uv_set >= MOST_UV_SETS {
            warn!(
                self.warnings,
                NoTextureCoordinates,
                "textures[{index}]: uses TEXCOORD_{uv_set}, but only sets below {MOST_UV_SETS} are supported; the texture is left out"
            );
            return Ok(None);
        }
        let rows = transform.map(uv_transform_rows);
        let (usable, within) = rows.map_or((None, true), |rows| {
            (
                Some(rows),
                rows.as_flattened()
                    .iter()
                    .all(|x| x.abs() <= MAX_COORDINATE),
            )
        });
        if !within {
            warn!(
                self.warnings,
                Range,
                "textures[{index}]: a KHR_texture_transform has numbers beyond ±1e15, the largest coordinate, and is ignored"
            );
        }
        Ok(Some(TextureRef {
            name,
            uv_set,
            uv_transform: usable.filter(|_| within),
            uv: None,
            factor: Colour::WHITE,
            channel: match used_as {
                TextureRole::Single(channel) => Some(channel),
                _ => None,
            },
        }))
    }

    /// Returns the name of the scene's texture for a texture of the file, created on first use;
    /// `None` without a readable image.
    fn convert_texture(
        &mut self,
        index: usize,
        used_as: TextureRole,
    ) -> ImportResult<Option<String>> {
        let key = (index, used_as == TextureRole::Color);
        if let Some(known) = self.textures.get(&key) {
            return Ok(known.clone());
        }
        let source = find_entry(&self.document.textures, "textures", index)?;
        let place = |fault: Fault| fault.with_place(format_args!("textures[{index}]"));
        let sampler = self.texture_sampler(source).map_err(place)?;
        let mut image = None;
        for index in source.image_sources() {
            image = self.convert_image(index as usize).map_err(place)?;
            if image.is_some() {
                break;
            }
        }
        if source.image_sources().next().is_none() {
            warn!(
                self.warnings,
                Picture, "textures[{index}]: has no supported image; the texture is left out"
            );
        }
        let name = image.map(|image| {
            let wish = source
                .name
                .as_deref()
                .filter(|name| !name.is_empty())
                .unwrap_or(&image);
            let name = self.names.textures.make_unique(wish);
            self.scene.textures.push(SceneTexture {
                name: name.clone(),
                image,
                colour_space: if used_as == TextureRole::Color {
                    ColourSpace::Srgb
                } else {
                    ColourSpace::Linear
                },
                filter: convert_filter(sampler),
                wrap_u: convert_wrap(sampler.wrap_s),
                wrap_v: convert_wrap(sampler.wrap_t),
            });
            name
        });
        self.textures.insert(key, name.clone());
        Ok(name)
    }

    fn texture_sampler(&self, texture: &TextureEntry) -> ImportResult<&'a TextureSampler> {
        const NONE: &TextureSampler = &TextureSampler {
            mag_filter: None,
            wrap_s: None,
            wrap_t: None,
        };
        match texture.sampler {
            Some(index) => find_entry(&self.document.samplers, "samplers", index as usize),
            None => Ok(NONE),
        }
    }

    /// Returns the name of the scene's image for an image of the file, and queues the encoded bytes
    /// for decoding. Returns `None`, and adds a warning, if the image is unreadable, its header is
    /// invalid, or its format is unsupported.
    fn convert_image(&mut self, index: usize) -> ImportResult<Option<String>> {
        if let Some(known) = self.images.get(&index) {
            return Ok(known.clone());
        }
        let source = find_entry(&self.document.images, "images", index)?;
        let accepted = self.read_image_bytes(source).and_then(|bytes| {
            image_file::reserve_picture_memory(&bytes, self.limits, &mut self.budget)?;
            Ok(bytes)
        });
        let name = match catch_invalid_input(accepted.with_place(format_args!("images[{index}]")))?
        {
            Ok(bytes) => {
                let file = self
                    .file
                    .file_name()
                    .map(|name| name.to_string_lossy().into_owned())
                    .unwrap_or_default();
                let path = source
                    .uri
                    .clone()
                    .filter(|uri| !uri::is_data_uri(uri))
                    .unwrap_or_else(|| format!("{file}#images[{index}]"));
                let name = self.names.images.make_unique(
                    source
                        .name
                        .as_deref()
                        .filter(|name| !name.is_empty())
                        .unwrap_or(&path),
                );
                self.image_queue.add_image(
                    self.scene.images.len(),
                    format!("images[{index}]"),
                    bytes,
                );
                self.scene.images.push(SceneImage {
                    name: name.clone(),
                    path,
                    data: None,
                    mended: 0,
                });
                Some(name)
            }
            Err(reason) => {
                warn!(self.warnings, Picture, "{reason}; the texture is left out");
                None
            }
        };
        self.images.insert(index, name.clone());
        Ok(name)
    }

    /// Returns the encoded bytes of an image, from a buffer view or a URI.
    fn read_image_bytes(&self, source: &ImageEntry) -> ImportResult<Cow<'a, [u8]>> {
        if let Some(view) = source.buffer_view {
            return self
                .reader
                .buffers
                .view_bytes(self.document, view as usize)
                .map(|(bytes, _)| bytes.into());
        }
        let uri = source
            .uri
            .as_ref()
            .ok_or_else(|| fault!("has neither uri nor bufferView"))?;
        uri::read_reference(self.folder, uri).map(Cow::from)
    }
}

/// Returns the filter of a texture from the sampler's magnification filter; bilinear if the sampler
/// states none. The sampler's minification filter is ignored. It selects mip maps, which average a
/// texture over a pixel for renderers with a single sample per pixel; here, many samples per pixel
/// compute this average. A setting of the renderer offers mip maps for renders with few samples.
fn convert_filter(sampler: &TextureSampler) -> TextureFilter {
    const NEAREST: u32 = 9728;
    if sampler.mag_filter == Some(NEAREST) {
        TextureFilter::Nearest
    } else {
        TextureFilter::Bilinear
    }
}

fn convert_wrap(mode: Option<u32>) -> WrapMode {
    match mode {
        Some(33071) => WrapMode::Clamp,
        Some(33648) => WrapMode::MirroredRepeat,
        _ => WrapMode::Repeat,
    }
}

/// Returns the first two rows of the matrix offset · rotation · scale of KHR_texture_transform. A
/// positive rotation is counter-clockwise in the image, whose v axis points down.
fn uv_transform_rows(transform: &TextureTransform) -> [[f64; 3]; 2] {
    let [ox, oy] = transform.offset.map(f64::from);
    let [sx, sy] = transform.scale.map(f64::from);
    let angle = f64::from(transform.rotation);
    let (sin, cos) = (libm::sin(angle), libm::cos(angle));
    [[cos * sx, sin * sy, ox], [-sin * sx, cos * sy, oy]]
}
