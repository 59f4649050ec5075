//! Animation of properties by JSON pointers (KHR_animation_pointer). The values at a time are
//! written into the file's JSON, which is then parsed again.
//!
//! Pointers refer to properties of the file, not of the imported scene. With changed JSON, every
//! supported property can be animated without code of its own. Unsupported properties, and those
//! that change no picture, are named in a warning. Transforms and weights of nodes are handled by
//! [`animation`](super::animation), animated by pointers or not.

use std::collections::HashSet;

use serde_json::{Map, Number, Value};

use super::accessor::AccessorReader;
use super::document::{self, Document};
use super::entries::Channel;
use super::json;
use super::keys::{KeyReader, sampler};
use crate::Limits;
use crate::import::{DecodeBudget, Fault, Outcome, Warnings, printable};
use crate::text::without_mark;
use crate::warning::WarningCode;

/// Type of an animated property.
#[derive(Clone, Copy, Debug, PartialEq)]
enum TargetKind {
    /// A boolean.
    Switch,
    Number,
    /// A vector of this many numbers.
    Vector(usize),
    /// A list of any length.
    List,
}

/// Pointers of supported properties, with `*` for an index.
const PROPERTIES: [(&str, TargetKind); 17] = [
    (
        "nodes/*/extensions/KHR_node_visibility/visible",
        TargetKind::Switch,
    ),
    ("meshes/*/weights", TargetKind::List),
    ("cameras/*/perspective/yfov", TargetKind::Number),
    ("cameras/*/perspective/aspectRatio", TargetKind::Number),
    ("cameras/*/orthographic/xmag", TargetKind::Number),
    ("cameras/*/orthographic/ymag", TargetKind::Number),
    (
        "extensions/KHR_lights_punctual/lights/*/color",
        TargetKind::Vector(3),
    ),
    (
        "extensions/KHR_lights_punctual/lights/*/intensity",
        TargetKind::Number,
    ),
    (
        "extensions/KHR_lights_punctual/lights/*/range",
        TargetKind::Number,
    ),
    (
        "extensions/KHR_lights_punctual/lights/*/spot/innerConeAngle",
        TargetKind::Number,
    ),
    (
        "extensions/KHR_lights_punctual/lights/*/spot/outerConeAngle",
        TargetKind::Number,
    ),
    ("materials/*/alphaCutoff", TargetKind::Number),
    ("materials/*/emissiveFactor", TargetKind::Vector(3)),
    ("materials/*/normalTexture/scale", TargetKind::Number),
    (
        "materials/*/pbrMetallicRoughness/baseColorFactor",
        TargetKind::Vector(4),
    ),
    (
        "materials/*/pbrMetallicRoughness/metallicFactor",
        TargetKind::Number,
    ),
    (
        "materials/*/pbrMetallicRoughness/roughnessFactor",
        TargetKind::Number,
    ),
];

/// Supported properties of material extensions; each pointer starts with
/// `materials/*/extensions/KHR_materials_`.
const LAYERS: [(&str, TargetKind); 22] = [
    ("anisotropy/anisotropyStrength", TargetKind::Number),
    ("anisotropy/anisotropyRotation", TargetKind::Number),
    ("clearcoat/clearcoatFactor", TargetKind::Number),
    ("clearcoat/clearcoatRoughnessFactor", TargetKind::Number),
    ("clearcoat/clearcoatNormalTexture/scale", TargetKind::Number),
    (
        "diffuse_transmission/diffuseTransmissionFactor",
        TargetKind::Number,
    ),
    (
        "diffuse_transmission/diffuseTransmissionColorFactor",
        TargetKind::Vector(3),
    ),
    ("dispersion/dispersion", TargetKind::Number),
    ("emissive_strength/emissiveStrength", TargetKind::Number),
    ("ior/ior", TargetKind::Number),
    ("iridescence/iridescenceFactor", TargetKind::Number),
    ("iridescence/iridescenceIor", TargetKind::Number),
    (
        "iridescence/iridescenceThicknessMinimum",
        TargetKind::Number,
    ),
    (
        "iridescence/iridescenceThicknessMaximum",
        TargetKind::Number,
    ),
    ("sheen/sheenColorFactor", TargetKind::Vector(3)),
    ("sheen/sheenRoughnessFactor", TargetKind::Number),
    ("specular/specularFactor", TargetKind::Number),
    ("specular/specularColorFactor", TargetKind::Vector(3)),
    ("transmission/transmissionFactor", TargetKind::Number),
    ("volume/thicknessFactor", TargetKind::Number),
    ("volume/attenuationDistance", TargetKind::Number),
    ("volume/attenuationColor", TargetKind::Vector(3)),
];

/// Supported properties of a texture reference, after `extensions/KHR_texture_transform/`.
const TRANSFORM: [(&str, TargetKind); 3] = [
    ("offset", TargetKind::Vector(2)),
    ("rotation", TargetKind::Number),
    ("scale", TargetKind::Vector(2)),
];

/// Type of the property that a pointer refers to; `None` if unsupported. The pointer is given
/// without its first slash.
fn kind(pointer: &str) -> Option<TargetKind> {
    let part = |part: &str| {
        if part.bytes().all(|byte| byte.is_ascii_digit()) {
            "*".to_owned()
        } else {
            part.to_owned()
        }
    };
    let general = pointer.split('/').map(part).collect::<Vec<_>>().join("/");
    let value_of = |list: &[(&str, TargetKind)], name: &str| {
        list.iter()
            .find(|(known, _)| *known == name)
            .map(|(_, kind)| *kind)
    };
    let layer = || {
        value_of(
            &LAYERS,
            general.strip_prefix("materials/*/extensions/KHR_materials_")?,
        )
    };
    let transform = || {
        let (texture, name) = general.rsplit_once("/extensions/KHR_texture_transform/")?;
        value_of(&TRANSFORM, name)
            .filter(|_| texture.starts_with("materials/*/") && texture.ends_with("Texture"))
    };
    value_of(&PROPERTIES, &general)
        .or_else(layer)
        .or_else(transform)
}

/// Node index and property (`translation`, `rotation`, `scale` or `weights`) of a channel whose
/// pointer leads to such a property; `None` for any other channel.
pub(super) fn node(channel: &Channel) -> Option<(u32, &str)> {
    let mut parts = pointer(channel)?.strip_prefix("/nodes/")?.split('/');
    let (index, path) = (parts.next()?.parse().ok()?, parts.next()?);
    let known =
        ["translation", "rotation", "scale", "weights"].contains(&path) && parts.next().is_none();
    known.then_some((index, path))
}

/// Parses the file again with the animated properties at a time in seconds. Returns `None` if no
/// animation uses pointers.
///
/// # Errors
/// A fault of kind input for a sampler whose keys do not fit its channel, and for a file that is
/// invalid at this time; of kind limit beyond the limits.
pub(super) fn at(
    time: f64,
    text: &[u8],
    reader: &AccessorReader<'_>,
    limits: &Limits,
    budget: &mut DecodeBudget,
    warnings: &mut Warnings,
) -> Outcome<Option<Document>> {
    let values = values(time, reader, warnings)?;
    if values.is_empty() {
        return Ok(None);
    }
    // Parsed JSON takes about thirty times the memory of its text.
    budget.memory(text.len(), 32)?;
    let text = without_mark(text);
    let again = |error| {
        json::rewritten(text).map_or(Err(error), |rewritten| {
            serde_json::from_slice(&rewritten.text)
        })
    };
    let file: Result<Value, _> = serde_json::from_slice(text).or_else(again);
    let mut file = file.map_err(|error| Fault::input(format!("is no valid glTF: {error}")))?;
    for (pointer, value) in values {
        match slot(&mut file, &pointer) {
            Some((holder, key)) => drop(holder.insert(key.to_owned(), value)),
            None => warnings.add(
                WarningCode::Animation,
                format!(
                    "animations of `/{}` are ignored: there is no such property",
                    printable(&pointer)
                ),
            ),
        }
    }
    document::parse(file.to_string().as_bytes(), limits, warnings).map(Some)
}

/// Returns the pointers of all animated properties, without their first slash, and the values at a
/// time in seconds.
fn values(
    time: f64,
    reader: &AccessorReader<'_>,
    warnings: &mut Warnings,
) -> Outcome<Vec<(String, Value)>> {
    let (mut keys, mut known, mut found) = (KeyReader::new(reader), HashSet::new(), Vec::new());
    for (i, animation) in reader.document.animations.iter().enumerate() {
        for (j, channel) in animation.channels.iter().enumerate() {
            let Some(pointer) = pointer(channel).filter(|_| node(channel).is_none()) else {
                continue;
            };
            let place =
                |fault: Fault| fault.with_place(format_args!("animations[{i}].channels[{j}]"));
            let path = pointer.strip_prefix('/').unwrap_or(pointer);
            let Some(kind) = kind(path) else {
                warnings.add(
                    WarningCode::Animation,
                    format!("animations of `{}` are ignored", printable(pointer)),
                );
                continue;
            };
            if !known.insert(path) {
                warnings.add(
                    WarningCode::Choice,
                    format!(
                        "several animations move `{}`: the first in the file is shown",
                        printable(pointer)
                    ),
                );
                continue;
            }
            let sampler = sampler(animation, channel.sampler).map_err(place)?;
            let numbers = match kind {
                TargetKind::Switch | TargetKind::Number => {
                    keys.vector::<1>(sampler, time).map(Vec::from)
                }
                TargetKind::Vector(2) => keys.vector::<2>(sampler, time).map(Vec::from),
                TargetKind::Vector(3) => keys.vector::<3>(sampler, time).map(Vec::from),
                TargetKind::Vector(_) => keys.vector::<4>(sampler, time).map(Vec::from),
                TargetKind::List => keys.weights(sampler, time),
            };
            found.push((
                path.to_owned(),
                value(kind, &numbers.map_err(place)?).map_err(place)?,
            ));
        }
    }
    Ok(found)
}

/// Converts interpolated numbers to a JSON value of a property's type.
fn value(kind: TargetKind, numbers: &[f64]) -> Outcome<Value> {
    let number = |&number: &f64| {
        let number = Number::from_f64(number)
            .ok_or_else(|| Fault::input(format!("a value of {number} makes no sense")))?;
        Ok(Value::Number(number))
    };
    match (kind, numbers) {
        (TargetKind::Switch, [on]) => Ok(Value::Bool(*on != 0.0)),
        (TargetKind::Number, [one]) => number(one),
        _ => numbers
            .iter()
            .map(number)
            .collect::<Outcome<Vec<_>>>()
            .map(Value::Array),
    }
}

/// Finds the JSON object that holds a property, and the property's key. Creates a missing
/// `pbrMetallicRoughness` object.
fn slot<'v, 'p>(
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

/// Returns the pointer of a channel; `None` for an ordinary target.
fn pointer(channel: &Channel) -> Option<&str> {
    let extension = channel.target.extensions.pointer.as_ref();
    extension
        .filter(|_| channel.target.path == "pointer")
        .map(|extension| extension.pointer.as_str())
}
