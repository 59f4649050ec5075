//! Typed data of a glTF file's JSON. No number in the file is trusted.
//!
//! Every index is a `u32`, and its range is checked at each use. Faults in the data, extensions
//! included, are reported with their path in the file. The types of the `gltf` crate are not used,
//! because they
//! - take indices modulo 2³²;
//! - have no animation without a target node (KHR_animation_pointer), and no scene without nodes;
//! - leave half of the extensions as untyped JSON;
//! - store node transforms in single precision, which moves a city in geocentric coordinates by
//!   half a metre.

use serde::Deserialize;

use super::entries::{
    AccessorEntry, AnimationEntry, BufferEntry, BufferViewEntry, CameraEntry, ImageEntry,
    MaterialEntry, MeshEntry, NodeEntry, RootExtensions, SceneEntry, SkinEntry, TextureEntry,
    TextureSampler,
};
use super::json;
use crate::Limits;
use crate::import::{Fault, ImportResult, Warnings, check_available_memory};
use crate::text::strip_byte_order_mark;

/// The supported part of a glTF file.
#[derive(Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Document {
    pub accessors: Vec<AccessorEntry>,
    pub animations: Vec<AnimationEntry>,
    pub asset: AssetVersion,
    pub buffers: Vec<BufferEntry>,
    pub buffer_views: Vec<BufferViewEntry>,
    pub cameras: Vec<CameraEntry>,
    pub extensions: RootExtensions,
    pub extensions_required: Vec<String>,
    pub extensions_used: Vec<String>,
    pub images: Vec<ImageEntry>,
    pub materials: Vec<MaterialEntry>,
    pub meshes: Vec<MeshEntry>,
    pub nodes: Vec<NodeEntry>,
    pub samplers: Vec<TextureSampler>,
    pub scene: Option<u32>,
    pub scenes: Vec<SceneEntry>,
    pub skins: Vec<SkinEntry>,
    pub textures: Vec<TextureEntry>,
}

impl Document {
    /// Names of the extensions that the file declares, and of undeclared extensions that have no
    /// type in this importer.
    pub fn extensions(&self) -> impl Iterator<Item = &String> {
        let of_nodes = self
            .nodes
            .iter()
            .flat_map(|node| node.extensions.others.keys());
        let of_materials = self
            .materials
            .iter()
            .flat_map(|material| material.others.keys());
        self.extensions_used
            .iter()
            .chain(self.extensions.others.keys())
            .chain(of_nodes)
            .chain(of_materials)
    }
}

/// Version of a glTF file.
#[derive(Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct AssetVersion {
    version: Option<String>,
    min_version: Option<String>,
}

/// The version and the required extensions from a glTF file's JSON. They are parsed alone if the
/// whole file cannot be parsed, because a wrong version or a missing extension explains the failure
/// better.
#[derive(Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct DocumentHeader {
    asset: AssetVersion,
    extensions_required: Vec<String>,
}

/// Assumed memory of a parsed JSON value in bytes. An empty node, `{}`, takes about 400 bytes; most
/// other values take far less.
const BYTES_A_VALUE: u64 = 256;

/// Upper bound for the number of values in a JSON text: 1 plus the number of commas and opening
/// brackets outside strings.
fn count_values(text: &[u8]) -> u64 {
    let (mut count, mut rest) = (1, text);
    while let Some(position) = rest
        .iter()
        .position(|byte| matches!(byte, b'"' | b',' | b'[' | b'{'))
    {
        let is_string = rest[position] == b'"';
        rest = &rest[position + 1..];
        if !is_string {
            count += 1;
            continue;
        }
        while let Some(end) = rest.iter().position(|byte| matches!(byte, b'"' | b'\\')) {
            let is_end = rest[end] == b'"';
            rest = rest
                .get(end + if is_end { 1 } else { 2 }..)
                .unwrap_or_default();
            if is_end {
                break;
            }
        }
    }
    count
}

/// Parses the JSON of a glTF file.
///
/// # Errors
/// A fault of kind input for invalid JSON (with path, line and column), another version of glTF, or
/// an unsupported required extension (by name); of kind limit for more values than the limits
/// allow.
pub(super) fn parse(
    text: &[u8],
    limits: &Limits,
    warnings: &mut Warnings,
) -> ImportResult<Document> {
    // RFC 8259, section 8.1: a parser may ignore a byte order mark.
    let text = strip_byte_order_mark(text);
    let maximum = limits.memory_bytes / BYTES_A_VALUE;
    if count_values(text) > maximum {
        return Err(Fault::over_limit(format!(
            "has more than {maximum} JSON values, the most that the memory limit allows; raise the limit with --max-memory"
        )));
    }
    match parse_typed(text, warnings) {
        Ok(document) => Ok(document),
        Err(fault) => {
            check_available_memory(text.len() as u64, limits)?;
            let Some(rewritten) = json::rewrite_json(text) else {
                return Err(fault);
            };
            rewritten
                .warnings()
                .for_each(|warning| warn!(warnings, Format, "{warning}"));
            parse_typed(&rewritten.text, warnings)
        }
    }
}

/// Parses a JSON text as typed data.
fn parse_typed(text: &[u8], warnings: &mut Warnings) -> ImportResult<Document> {
    let mut json = serde_json::Deserializer::from_slice(text);
    // A file of another version, or with an unsupported required extension, need not fit these
    // types. Its version and extensions give a better message.
    let document = match Document::deserialize(&mut json) {
        Ok(document) => document,
        Err(error) => {
            if let Ok(DocumentHeader {
                asset,
                extensions_required,
            }) = serde_json::from_slice(text)
            {
                check_version(&asset, warnings)?;
                super::extensions::check_required_extensions(&extensions_required)?;
            }
            let path = if error.is_data() {
                json::json_path_at(text, error.line(), error.column())
            } else {
                String::new()
            };
            let place = if path.is_empty() {
                path
            } else {
                format!("{path}: ")
            };
            return Err(fault!("{place}is no valid glTF: {error}"));
        }
    };
    json.end()
        .map_err(|error| fault!("is no valid glTF: {error}"))?;
    check_version(&document.asset, warnings)?;
    super::extensions::check_required_extensions(&document.extensions_required)?;
    Ok(document)
}

fn check_version(asset: &AssetVersion, warnings: &mut Warnings) -> ImportResult<()> {
    let version = asset
        .version
        .as_deref()
        .ok_or_else(|| fault!("is no glTF 2.0: asset.version is missing"))?;
    if version.split('.').next() != Some("2") {
        return Err(fault!("is glTF {version}, but only version 2 is supported"));
    }
    match asset.min_version.as_deref() {
        Some(least) if least.split('.').next() != Some("2") => Err(fault!(
            "needs glTF {least}, but only version 2.0 is supported"
        )),
        Some(least) if least != "2.0" => {
            warn!(
                warnings,
                Format, "asset.minVersion is {least}; the file was read as glTF 2.0"
            );
            Ok(())
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(rest: &str) -> ImportResult<Document> {
        let text = format!(r#"{{ "asset": {{ "version": "2.0" }}, {rest} }}"#);
        parse(
            text.as_bytes(),
            &Limits::default(),
            &mut Warnings::default(),
        )
    }

    /// Protects: an index is never taken modulo 2³², in any list, and a fault in the data has its
    /// path.
    #[test]
    fn indices_beyond_32_bits_are_refused() {
        for (rest, path) in [
            (r#""nodes": [{}, { "mesh": 4294967296 }]"#, "nodes[1].mesh"),
            (
                r#""meshes": [{ "primitives": [{ "attributes": { "POSITION": 4294967296 } }] }]"#,
                "meshes[0].primitives[0].attributes",
            ),
            (
                r#""materials": [{}, { "normalTexture": { "index": 4294967296 } }]"#,
                "materials[1].normalTexture.index",
            ),
            (
                r#""materials": [{ "emissiveTexture": { "index": 0, "texCoord": -1 } }]"#,
                "materials[0].emissiveTexture.texCoord",
            ),
            (
                r#""materials": [{ "extensions": { "KHR_materials_sheen": { "sheenColorTexture": { "index": 1e10 } } } }]"#,
                "materials[0].extensions.KHR_materials_sheen.sheenColorTexture.index",
            ),
            (
                r#""materials": [{ "extensions": { "KHR_materials_ior": { "ior": "2" } } }]"#,
                "materials[0].extensions.KHR_materials_ior.ior",
            ),
            (
                r#""cameras": [{ "type": "perspective", "perspective": { "yfov": [] } }]"#,
                "cameras[0].perspective.yfov",
            ),
            (
                r#""extensions": { "KHR_lights_punctual": { "lights": [{ "type": "spot", "color": [1] }] } }"#,
                "extensions.KHR_lights_punctual.lights[0].color",
            ),
            (r#""samplers": [{ "wrapS": "clamp" }]"#, "samplers[0].wrapS"),
            (
                r#""textures": [{ "extensions": { "KHR_texture_basisu": { "source": -1 } } }]"#,
                "textures[0].extensions",
            ),
            (r#""bufferViews": [{ "byteLength": 4 }]"#, "bufferViews[0]"),
            (
                r#""accessors": [{ "count": 1.5, "componentType": 5126, "type": "VEC3" }]"#,
                "accessors[0].count",
            ),
        ] {
            let message = read(rest).expect_err(rest).message;
            assert!(message.starts_with(path), "{message}");
        }
        assert!(read(r#""nodes": [{ "translation": [4294967296, 0, 0] }]"#).is_ok());
        assert!(read(r#""materials": [{ "extensions": { "X": { "attenuationDistance": 10000000000 } } }]"#).is_ok());
    }

    /// Protects: nesting depth and number of values are bounded, text after the value is refused,
    /// and brackets in strings do not count.
    #[test]
    fn depth_and_number_are_bounded() {
        let limits = Limits {
            memory_bytes: 1000 * BYTES_A_VALUE,
            ..Limits::default()
        };
        let deep = [vec![b'['; 100_000], vec![b']'; 100_000]].concat();
        assert!(parse(&deep, &Limits::default(), &mut Warnings::default()).is_err());
        let many = format!("[{}0]", "0,".repeat(2000));
        let fault = parse(many.as_bytes(), &limits, &mut Warnings::default()).unwrap_err();
        assert_eq!(fault.kind, crate::error_kind::ErrorKind::Limit);
        let text = |after: &str| {
            format!(
                r#"{{ "asset": {{ "version": "2.0", "copyright": "{}\"[" }} }}{after}"#,
                "[{,".repeat(2000)
            )
        };
        assert!(parse(text(" ").as_bytes(), &limits, &mut Warnings::default()).is_ok());
        assert!(parse(text(" x").as_bytes(), &limits, &mut Warnings::default()).is_err());
        assert_eq!(count_values(br#"{"a":[1,2,{}],"b,[":"\\","c":0}"#), 8);
    }

    /// Protects: another version or an unsupported required extension is reported as such, not as a
    /// type error.
    #[test]
    fn foreign_files_are_told() {
        let value_of = |text: &str| {
            parse(
                text.as_bytes(),
                &Limits::default(),
                &mut Warnings::default(),
            )
            .unwrap_err()
            .message
        };
        assert!(
            value_of(r#"{ "asset": { "version": "1.0" }, "meshes": { "a": {} } }"#)
                .contains("glTF 1.0")
        );
        let needs =
            r#"{ "asset": { "version": "2.0" }, "extensionsRequired": ["EXT_odd"], "nodes": 3 }"#;
        assert!(value_of(needs).contains("EXT_odd"));
        assert!(
            value_of(r#"{ "asset": { "version": "2.0" }, "nodes": 3 }"#)
                .starts_with("nodes: is no valid glTF")
        );
    }

    /// Protects: the first numbers of a list apply where glTF defines fewer, in the base schema and
    /// in extensions, with one warning of the first path; weights have any length, extras none.
    #[test]
    fn surplus_numbers_are_passed_over() {
        let mut warnings = Warnings::default();
        let text = r#"{ "asset": { "version": "2.0" }, "extras": { "color": [1, 2, 3, 4] },
            "meshes": [{ "primitives": [], "weights": [1, 2, 3, 4, 5] }],
            "nodes": [{}, { "translation": [1, 2, 3, [4, 5]], "scale": [1,2,3,4.0], "rotation": [0, 0, 0, 1, 9],
                "matrix": [1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17] }],
            "materials": [{ "emissiveFactor": [0.5, 0, 0, "x"], "emissiveTexture": { "index": 0,
                "extensions": { "KHR_texture_transform": { "offset": [1, 2, 3], "scale": [4, 5, 6] } } },
                "pbrMetallicRoughness": { "baseColorFactor": [1, 1, 1, 1, 1] } }],
            "extensions": { "KHR_lights_punctual": { "lights": [{ "type": "spot", "color": [1, 0, 0, 1] }] } } }"#;
        let document =
            parse(text.as_bytes(), &Limits::default(), &mut warnings).expect("a document");
        let (node, material) = (&document.nodes[1], &document.materials[0]);
        assert_eq!(node.translation, Some([1.0, 2.0, 3.0]));
        assert_eq!(
            (node.scale, node.rotation),
            (Some([1.0, 2.0, 3.0]), Some([0.0, 0.0, 0.0, 1.0]))
        );
        assert_eq!(node.matrix.as_ref().map(|matrix| matrix[15]), Some(16.0));
        assert_eq!(
            material.numbers[&("", "emissiveFactor")],
            [0.5, 0.0, 0.0, 1.0]
        );
        let texture = &material.textures[&("", "emissiveTexture")];
        let map = texture.extensions.transform.as_ref().expect("a transform");
        assert_eq!((map.offset, map.scale), ([1.0, 2.0], [4.0, 5.0]));
        assert_eq!(document.extensions.lights.lights[0].color, [1.0, 0.0, 0.0]);
        assert_eq!(document.meshes[0].weights.len(), 5);
        let found = warnings.into_warnings("a");
        assert_eq!(found.len(), 1, "{found:?}");
        let message = &found[0].message;
        assert!(
            message.contains("nodes[1].translation: has more numbers")
                && message.contains("one of 9"),
            "{message}"
        );
        let comma = r#""nodes": [{ "translation": [1, 2, 3,] }]"#;
        assert!(
            read(comma).is_err(),
            "a comma before a bracket is no surplus"
        );
        let few = read(r#""nodes": [{ "translation": [1, 2] }]"#).expect_err("two numbers");
        assert!(
            few.message
                .starts_with("nodes[0].translation: is no valid glTF: invalid length 2"),
            "{few:?}"
        );
    }
}
