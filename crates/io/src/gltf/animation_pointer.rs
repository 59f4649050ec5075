//! Animation of properties by JSON pointers (KHR_animation_pointer). The values at a time are
//! written into the file's JSON, which is then parsed again.
//!
//! Pointers refer to properties of the file, not of the imported scene. Because the JSON itself
//! changes, no property needs animation code of its own. A warning names each unsupported property
//! and each property that changes no picture. [`animation`](super::animation) handles transforms
//! and weights of nodes, even if pointers animate them.

use std::collections::HashSet;

use serde_json::{Map, Number, Value};

use super::accessor::AccessorReader;
use super::document::{self, Document};
use super::entries::AnimationChannel;
use super::json;
use super::keyframes::{KeyframeReader, find_sampler};
use crate::Limits;
use crate::import::{DecodeBudget, Fault, ImportResult, Warnings, sanitise_text};
use crate::text::strip_byte_order_mark;
use crate::warning::WarningCode;

/// Type of an animated property.
#[derive(Clone, Copy, Debug, PartialEq)]
enum PropertyType {
    /// A boolean.
    Switch,
    Number,
    /// A vector with this number of components.
    Vector(usize),
    /// A list of numbers of any length.
    List,
}

/// JSON pointers of the supported properties, with `*` in place of an index.
const PROPERTIES: [&str; 17] = [
    "nodes/*/extensions/KHR_node_visibility/visible",
    "meshes/*/weights",
    "cameras/*/perspective/yfov",
    "cameras/*/perspective/aspectRatio",
    "cameras/*/orthographic/xmag",
    "cameras/*/orthographic/ymag",
    "extensions/KHR_lights_punctual/lights/*/color",
    "extensions/KHR_lights_punctual/lights/*/intensity",
    "extensions/KHR_lights_punctual/lights/*/range",
    "extensions/KHR_lights_punctual/lights/*/spot/innerConeAngle",
    "extensions/KHR_lights_punctual/lights/*/spot/outerConeAngle",
    "materials/*/alphaCutoff",
    "materials/*/emissiveFactor",
    "materials/*/normalTexture/scale",
    "materials/*/pbrMetallicRoughness/baseColorFactor",
    "materials/*/pbrMetallicRoughness/metallicFactor",
    "materials/*/pbrMetallicRoughness/roughnessFactor",
];

/// Supported properties of material extensions; each pointer starts with
/// `materials/*/extensions/KHR_materials_`.
const LAYER_PROPERTIES: [&str; 22] = [
    "anisotropy/anisotropyStrength",
    "anisotropy/anisotropyRotation",
    "clearcoat/clearcoatFactor",
    "clearcoat/clearcoatRoughnessFactor",
    "clearcoat/clearcoatNormalTexture/scale",
    "diffuse_transmission/diffuseTransmissionFactor",
    "diffuse_transmission/diffuseTransmissionColorFactor",
    "dispersion/dispersion",
    "emissive_strength/emissiveStrength",
    "ior/ior",
    "iridescence/iridescenceFactor",
    "iridescence/iridescenceIor",
    "iridescence/iridescenceThicknessMinimum",
    "iridescence/iridescenceThicknessMaximum",
    "sheen/sheenColorFactor",
    "sheen/sheenRoughnessFactor",
    "specular/specularFactor",
    "specular/specularColorFactor",
    "transmission/transmissionFactor",
    "volume/thicknessFactor",
    "volume/attenuationDistance",
    "volume/attenuationColor",
];

/// Returns the type of the property that a JSON pointer refers to; `None` for an unsupported
/// property. The pointer is given without its first slash.
fn property_type(pointer: &str) -> Option<PropertyType> {
    let part = |part: &str| {
        if part.bytes().all(|byte| byte.is_ascii_digit()) {
            "*".to_owned()
        } else {
            part.to_owned()
        }
    };
    let general = pointer.split('/').map(part).collect::<Vec<_>>().join("/");
    let is_layer = general
        .strip_prefix("materials/*/extensions/KHR_materials_")
        .is_some_and(|name| LAYER_PROPERTIES.contains(&name));
    let is_transform = general
        .rsplit_once("/extensions/KHR_texture_transform/")
        .is_some_and(|(texture, name)| {
            ["offset", "rotation", "scale"].contains(&name)
                && texture.starts_with("materials/*/")
                && texture.ends_with("Texture")
        });
    let mut keys = general.rsplit('/');
    let (key, object) = (keys.next()?, keys.next());
    (PROPERTIES.contains(&general.as_str()) || is_layer || is_transform).then(|| match key {
        "visible" => PropertyType::Switch,
        "weights" => PropertyType::List,
        _ => json::list_length(key, object).map_or(PropertyType::Number, PropertyType::Vector),
    })
}

/// Returns the node index and the property (`translation`, `rotation`, `scale` or `weights`) that
/// an animation channel's pointer refers to; `None` for a channel with another target.
pub(super) fn parse_node_pointer(channel: &AnimationChannel) -> Option<(u32, &str)> {
    let mut parts = channel_pointer(channel)?
        .strip_prefix("/nodes/")?
        .split('/');
    let (index, path) = (parts.next()?.parse().ok()?, parts.next()?);
    let known =
        ["translation", "rotation", "scale", "weights"].contains(&path) && parts.next().is_none();
    known.then_some((index, path))
}

/// Sets all properties that pointers animate to their values at a time in seconds, and parses the
/// file again. Returns `None` if no animation uses pointers.
///
/// # Errors
///
/// A fault of kind input for a sampler whose keys do not fit its channel, and for a file that is
/// invalid at this time; of kind limit beyond the limits.
pub(super) fn apply_animation_pointers(
    time: f64,
    text: &[u8],
    reader: &AccessorReader<'_>,
    limits: &Limits,
    budget: &mut DecodeBudget,
    warnings: &mut Warnings,
) -> ImportResult<Option<Document>> {
    let values = evaluate_animation_pointers(time, reader, warnings)?;
    if values.is_empty() {
        return Ok(None);
    }
    // Parsed JSON takes about thirty times the memory of its text.
    budget.reserve_memory(text.len(), 32)?;
    let text = strip_byte_order_mark(text);
    let again = |error| {
        json::rewrite_json(text).map_or(Err(error), |rewritten| {
            serde_json::from_slice(&rewritten.text)
        })
    };
    let file: Result<Value, _> = serde_json::from_slice(text).or_else(again);
    let mut file =
        file.map_err(|error| Fault::invalid_input(format!("is no valid glTF: {error}")))?;
    for (pointer, value) in values {
        match find_json_property(&mut file, &pointer) {
            Some((holder, key)) => drop(holder.insert(key.to_owned(), value)),
            None => warnings.add(
                WarningCode::Animation,
                format!(
                    "animations of `/{}` are ignored: the file has no such property",
                    sanitise_text(&pointer)
                ),
            ),
        }
    }
    document::parse(file.to_string().as_bytes(), limits, warnings).map(Some)
}

/// Evaluates all properties that are animated by pointers at a time in seconds. Returns the pointer
/// of each property, without its first slash, and the property's value.
fn evaluate_animation_pointers(
    time: f64,
    reader: &AccessorReader<'_>,
    warnings: &mut Warnings,
) -> ImportResult<Vec<(String, Value)>> {
    let (mut keys, mut known, mut found) =
        (KeyframeReader::new(reader), HashSet::new(), Vec::new());
    for (i, animation) in reader.document.animations.iter().enumerate() {
        for (j, channel) in animation.channels.iter().enumerate() {
            let Some(pointer) =
                channel_pointer(channel).filter(|_| parse_node_pointer(channel).is_none())
            else {
                continue;
            };
            let place =
                |fault: Fault| fault.with_place(format_args!("animations[{i}].channels[{j}]"));
            let path = pointer.strip_prefix('/').unwrap_or(pointer);
            let Some(kind) = property_type(path) else {
                warnings.add(
                    WarningCode::Animation,
                    format!(
                        "animations of `{}` are not supported and are ignored",
                        sanitise_text(pointer)
                    ),
                );
                continue;
            };
            if !known.insert(path) {
                warnings.add(
                    WarningCode::Choice,
                    format!(
                        "several animations change `{}`: the first animation in the file is used",
                        sanitise_text(pointer)
                    ),
                );
                continue;
            }
            let sampler = find_sampler(animation, channel.sampler).map_err(place)?;
            let numbers = match kind {
                PropertyType::Switch | PropertyType::Number => {
                    keys.interpolate_vector::<1>(sampler, time).map(Vec::from)
                }
                PropertyType::Vector(2) => {
                    keys.interpolate_vector::<2>(sampler, time).map(Vec::from)
                }
                PropertyType::Vector(3) => {
                    keys.interpolate_vector::<3>(sampler, time).map(Vec::from)
                }
                PropertyType::Vector(_) => {
                    keys.interpolate_vector::<4>(sampler, time).map(Vec::from)
                }
                PropertyType::List => keys.interpolate_weights(sampler, time),
            };
            found.push((
                path.to_owned(),
                to_json(kind, &numbers.map_err(place)?).map_err(place)?,
            ));
        }
    }
    Ok(found)
}

/// Converts the interpolated numbers of a property to a JSON value of the property's type.
fn to_json(kind: PropertyType, numbers: &[f64]) -> ImportResult<Value> {
    let number = |&number: &f64| {
        let number = Number::from_f64(number).ok_or_else(|| {
            Fault::invalid_input(format!("the animated value {number} is not finite"))
        })?;
        Ok(Value::Number(number))
    };
    match (kind, numbers) {
        (PropertyType::Switch, [on]) => Ok(Value::Bool(*on != 0.0)),
        (PropertyType::Number, [one]) => number(one),
        _ => numbers
            .iter()
            .map(number)
            .collect::<ImportResult<Vec<_>>>()
            .map(Value::Array),
    }
}

/// Finds the JSON object that holds a property, and the property's key. Creates a missing
/// `pbrMetallicRoughness` object.
fn find_json_property<'v, 'p>(
    file: &'v mut Value,
    pointer: &'p str,
) -> Option<(&'v mut Map<String, Value>, &'p str)> {
    let (path, key) = pointer.rsplit_once('/')?;
    let mut at = file;
    for part in path.split('/') {
        at = match at {
            Value::Array(list) => list.get_mut(part.parse::<usize>().ok()?)?,
            Value::Object(map) => {
                // This is the only object with supported properties that a file may omit as a
                // whole.
                if part == "pbrMetallicRoughness" && !map.contains_key(part) {
                    map.insert(part.to_owned(), Value::Object(Map::new()));
                }
                map.get_mut(part)?
            }
            _ => return None,
        };
    }
    at.as_object_mut().map(|holder| (holder, key))
}

/// Returns the JSON pointer of an animation channel; `None` for a channel that animates a node
/// without a pointer.
fn channel_pointer(channel: &AnimationChannel) -> Option<&str> {
    let extension = channel.target.extensions.pointer.as_ref();
    extension
        .filter(|_| channel.target.path == "pointer")
        .map(|extension| extension.pointer.as_str())
}
