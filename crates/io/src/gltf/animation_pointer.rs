//! Animation of properties by JSON pointers (KHR_animation_pointer). The values at a time are
//! written into the file's JSON, which is then parsed again.
//!
//! Pointers refer to properties of the file, not of the imported scene. Because the JSON itself
//! changes, no property needs animation code of its own. A warning names each unsupported property
//! and each property that changes no picture. [`animation`](super::animation) handles transforms
//! and weights of nodes, even if pointers animate them.

use std::collections::HashSet;

use serde_json::{Map, Number, Value};

use super::accessor::{AccessorReader, find_entry};
use super::document::{self, Document};
use super::entries::AnimationChannel;
use super::extensions::{CORE, MaterialProperty, find_property};
use super::json;
use super::keyframes::KeyframeReader;
use crate::Limits;
use crate::import::{DecodeBudget, Fault, ImportResult, Warnings, sanitise_text};
use crate::text::strip_byte_order_mark;

/// Type of an animated property.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum PropertyType {
    /// A boolean.
    Switch,
    /// A number, or a list of this number of numbers.
    Numbers(usize),
    /// A list of numbers of any length.
    List,
}

/// Returns the type of the property that a JSON pointer refers to; `None` for an unsupported
/// property. The pointer is given without its first slash.
pub(super) fn property_type(pointer: &str) -> Option<PropertyType> {
    let parts: Vec<&str> = pointer.split('/').collect();
    let length = match parts[..] {
        ["nodes", _, "extensions", "KHR_node_visibility", "visible"] => {
            return Some(PropertyType::Switch);
        }
        ["meshes", _, "weights"] => return Some(PropertyType::List),
        ["cameras", _, "perspective", "yfov" | "aspectRatio"]
        | ["cameras", _, "orthographic", "xmag" | "ymag"] => 1,
        [
            "extensions",
            "KHR_lights_punctual",
            "lights",
            _,
            ref light @ ..,
        ] => match light {
            ["color"] => 3,
            ["intensity" | "range"] | ["spot", "innerConeAngle" | "outerConeAngle"] => 1,
            _ => return None,
        },
        ["materials", _, ref material @ ..] => material_property_length(material)?,
        _ => return None,
    };
    Some(PropertyType::Numbers(length))
}

/// Returns the number of numbers of a material's property, which is given by its path.
fn material_property_length(path: &[&str]) -> Option<usize> {
    match *path {
        [.., texture, "extensions", "KHR_texture_transform", key] => {
            let length = match key {
                "offset" | "scale" => 2,
                "rotation" => 1,
                _ => return None,
            };
            texture.ends_with("Texture").then_some(length)
        }
        [ref object @ .., texture, "scale"] => {
            let (_, property) = find_property(material_object(object)?, texture)?;
            matches!(property, MaterialProperty::NormalMap(..)).then_some(1)
        }
        [ref object @ .., key] => {
            let (_, property) = find_property(material_object(object)?, key)?;
            Some(property.length()).filter(|length| *length > 0)
        }
        [] => None,
    }
}

/// Returns the name of the object of a material at this path.
fn material_object<'p>(path: &[&'p str]) -> Option<&'p str> {
    match *path {
        [] => Some(""),
        [CORE] => Some(CORE),
        ["extensions", name] => Some(name),
        _ => None,
    }
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
    let mut file = file.map_err(|error| fault!("is no valid glTF: {error}"))?;
    for (pointer, value) in values {
        match find_json_property(&mut file, &pointer) {
            Some((holder, key)) => drop(holder.insert(key.to_owned(), value)),
            None => warn!(
                warnings,
                Animation,
                "animations of `{}` are ignored: the file has no such property",
                sanitise_text(&pointer)
            ),
        }
    }
    document::parse(file.to_string().as_bytes(), limits, warnings).map(Some)
}

/// Evaluates all properties that are animated by pointers at a time in seconds. Returns the pointer
/// of each property, and the property's value.
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
            let Some(kind) = pointer.strip_prefix('/').and_then(property_type) else {
                warn!(
                    warnings,
                    Animation,
                    "animations of `{}` are not supported and are ignored",
                    sanitise_text(pointer)
                );
                continue;
            };
            if !known.insert(pointer) {
                warn!(
                    warnings,
                    Choice,
                    "several animations change `{}`: the first animation in the file is used",
                    sanitise_text(pointer)
                );
                continue;
            }
            let sampler = find_entry(&animation.samplers, "samplers", channel.sampler as usize)
                .map_err(place)?;
            let arity = match kind {
                PropertyType::Numbers(length) => length,
                PropertyType::Switch | PropertyType::List => 1,
            };
            let numbers = if kind == PropertyType::List {
                keys.interpolate_weights(sampler, time)
            } else {
                let vector = keys.interpolate_vector::<4>(sampler, time, arity);
                vector.map(|vector| vector[..arity].to_vec())
            };
            found.push((
                pointer.to_owned(),
                to_json(kind, &numbers.map_err(place)?).map_err(place)?,
            ));
        }
    }
    Ok(found)
}

/// Converts the interpolated numbers of a property to a JSON value of the property's type.
fn to_json(kind: PropertyType, numbers: &[f64]) -> ImportResult<Value> {
    let number = |&number: &f64| {
        let number = Number::from_f64(number)
            .ok_or_else(|| fault!("the animated value {number} is not finite"))?;
        Ok(Value::Number(number))
    };
    match (kind, numbers) {
        (PropertyType::Switch, [on]) => Ok(Value::Bool(*on != 0.0)),
        (PropertyType::Numbers(1), [one]) => number(one),
        _ => numbers
            .iter()
            .map(number)
            .collect::<ImportResult<Vec<_>>>()
            .map(Value::Array),
    }
}

/// Finds the JSON object that holds a property, and the property's key. Creates a missing object of
/// the metallic-roughness model, the only object with supported properties that a file may omit.
fn find_json_property<'v, 'p>(
    file: &'v mut Value,
    pointer: &'p str,
) -> Option<(&'v mut Map<String, Value>, &'p str)> {
    let (path, key) = pointer.rsplit_once('/')?;
    if let Some((material, CORE)) = path.rsplit_once('/') {
        let material = file.pointer_mut(material)?.as_object_mut()?;
        material.entry(CORE).or_insert_with(|| Map::new().into());
    }
    Some((file.pointer_mut(path)?.as_object_mut()?, key))
}

/// Returns the JSON pointer of an animation channel; `None` for a channel that animates a node
/// without a pointer.
fn channel_pointer(channel: &AnimationChannel) -> Option<&str> {
    let extension = channel.target.extensions.pointer.as_ref();
    extension
        .filter(|_| channel.target.path == "pointer")
        .map(|extension| extension.pointer.as_str())
}
