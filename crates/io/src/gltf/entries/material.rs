//! Entries of a glTF file for appearance: materials with their extensions, textures, samplers,
//! images.

use std::collections::BTreeMap;

use serde::de::{DeserializeSeed, Error, IgnoredAny, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};
use serde_json::Value;

use super::super::extensions::{CORE, MaterialObject, find_material_object, find_property};

required_entries! {
    /// Reference of a material to a texture.
    TextureInfo {
        index: u32,
        #[serde(default)]
        tex_coord: u32,
        /// Scale of a normal map's x and y.
        #[serde(default = "default_scale")]
        scale: f32,
        #[serde(default)]
        extensions: TextureInfoExtensions,
    }
}

fn default_scale() -> f32 {
    1.0
}

entries! {
    /// Supported extensions of a texture reference.
    TextureInfoExtensions {
        #[serde(rename = "KHR_texture_transform")]
        transform: Option<TextureTransform>,
    }

    /// Transform of texture coordinates; the rotation is in radians.
    TextureTransform {
        offset: [f32; 2],
        rotation: f32,
        scale: [f32; 2] = [1.0; 2],
        tex_coord: Option<u32>,
    }
}

/// A material: the numbers and textures that the file states, by names of object and property in
/// the [table](super::super::extensions).
#[derive(Debug, Default)]
pub(in crate::gltf) struct MaterialEntry {
    pub name: Option<String>,
    pub alpha_mode: Option<String>,
    pub double_sided: bool,
    pub has_occlusion_map: bool,
    pub numbers: BTreeMap<PropertyName, [f64; 4]>,
    pub textures: BTreeMap<PropertyName, TextureInfo>,
    /// Names of the extensions in the table.
    pub extensions: Vec<&'static str>,
    /// Data of unsupported extensions, by name.
    pub others: BTreeMap<String, Value>,
}

/// Names of an object of a material and of a property of this object.
type PropertyName = (&'static str, &'static str);

impl<'de> Deserialize<'de> for MaterialEntry {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let mut entry = Self::default();
        ObjectReader("", &mut entry).deserialize(deserializer)?;
        Ok(entry)
    }
}

/// Key of the object that contains a material's extensions.
const EXTENSIONS: &str = "extensions";

/// Reads the object with this name into a material, because `serde(flatten)` would lose the path of
/// a fault.
struct ObjectReader<'m>(&'static str, &'m mut MaterialEntry);

impl<'de> DeserializeSeed<'de> for ObjectReader<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for ObjectReader<'_> {
    type Value = ();

    fn expecting(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("an object of a material")
    }

    fn visit_unit<E>(self) -> Result<(), E> {
        Ok(())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        let Self(object, out) = self;
        while let Some(key) = map.next_key::<String>()? {
            if let Some((key, property)) = find_property(object, &key) {
                let name = (object, *key);
                let is_repeated = match property.length() {
                    0 => (map.next_value::<Option<_>>()?)
                        .and_then(|texture| out.textures.insert(name, texture))
                        .is_some(),
                    length => read_numbers(&mut map, length)?
                        .and_then(|numbers| out.numbers.insert(name, numbers))
                        .is_some(),
                };
                if is_repeated {
                    return Err(A::Error::duplicate_field(key));
                }
                continue;
            }
            match (object, key.as_str()) {
                ("", "name") => out.name = map.next_value()?,
                ("", "alphaMode") => out.alpha_mode = map.next_value()?,
                ("", "doubleSided") => out.double_sided = map.next_value()?,
                ("", "occlusionTexture") => {
                    out.has_occlusion_map = map.next_value::<Option<TextureInfo>>()?.is_some();
                }
                ("", CORE) => map.next_value_seed(ObjectReader(CORE, out))?,
                ("", EXTENSIONS) => map.next_value_seed(ObjectReader(EXTENSIONS, out))?,
                (EXTENSIONS, name) => match find_material_object(name) {
                    Some(MaterialObject { name, .. }) => {
                        out.extensions.push(name);
                        map.next_value_seed(ObjectReader(name, out))?;
                    }
                    None => drop(out.others.insert(key, map.next_value()?)),
                },
                _ => drop(map.next_value::<IgnoredAny>()?),
            }
        }
        Ok(())
    }
}

/// Reads a number, or a list of three or four numbers; missing numbers become 1.
fn read_numbers<'de, A: MapAccess<'de>>(
    map: &mut A,
    length: usize,
) -> Result<Option<[f64; 4]>, A::Error> {
    Ok(match length {
        1 => map.next_value::<Option<_>>()?.map(|x| [x, 1.0, 1.0, 1.0]),
        3 => map
            .next_value::<Option<[_; 3]>>()?
            .map(|[r, g, b]| [r, g, b, 1.0]),
        _ => map.next_value()?,
    })
}

entries! {
    /// A texture sampler, with the OpenGL codes of the specification; `None` leaves the choice to the
    /// importer.
    TextureSampler {
        mag_filter: Option<u32>,
        wrap_s: Option<u32>,
        wrap_t: Option<u32>,
    }

    /// An image: in another file, embedded in the JSON, or in a buffer view.
    ImageEntry {
        buffer_view: Option<u32>,
        name: Option<String>,
        uri: Option<String>,
    }

    /// A texture: an image with a sampler.
    TextureEntry {
        name: Option<String>,
        sampler: Option<u32>,
        source: Option<u32>,
        extensions: TextureExtensions,
    }
}

impl TextureEntry {
    /// Image indices in order of preference: images of extensions before the fallback.
    pub fn image_sources(&self) -> impl Iterator<Item = u32> {
        let TextureExtensions { webp, basis } = &self.extensions;
        [webp.source, basis.source, self.source]
            .into_iter()
            .flatten()
    }
}

entries! {
    /// Images of a texture in WebP and Basis Universal, each from an extension.
    TextureExtensions {
        #[serde(rename = "EXT_texture_webp")]
        webp: TextureSource,
        #[serde(rename = "KHR_texture_basisu")]
        basis: TextureSource,
    }

    /// Reference of a texture extension to an image.
    TextureSource {
        source: Option<u32>,
    }
}
