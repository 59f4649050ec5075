//! Colours of a native scene that are written as a text, such as `"#e6b219"`, in place of three
//! numbers.

use std::collections::BTreeMap;

use raywright_core::Scene;
use raywright_core::fault::{Fault, FaultKind};
use raywright_core::scene::{Material, MaterialModel};

use super::node::{TextValue, ValueNode};
use crate::colour::parse_colour;

/// Keys of colours whose names do not end in `colour`. All keys that end in `colour` have colours
/// too.
const COLOUR_KEYS: [&str; 9] = [
    "ambient",
    "emission",
    "even",
    "odd",
    "bottom",
    "top",
    "constant",
    "reflected_tint",
    "refracted_tint",
];

/// Replaces colour texts in the syntax tree by three numbers. A text that equals the name of a
/// parameter stays, because it is an expression.
pub(super) fn replace_colour_texts(node: &mut ValueNode, parameters: &BTreeMap<String, f64>) {
    match &mut node.value {
        TextValue::Array(items) => items
            .iter_mut()
            .for_each(|item| replace_colour_texts(item, parameters)),
        TextValue::Table(entries) => {
            for entry in entries {
                let is_colour =
                    entry.key.ends_with("colour") || COLOUR_KEYS.contains(&entry.key.as_str());
                match &entry.node.value {
                    TextValue::Text(text) if is_colour && !parameters.contains_key(text) => {
                        if let Some(colour) = parse_colour(text) {
                            let span = entry.node.span.clone();
                            let channel = |value| ValueNode {
                                span: span.clone(),
                                value: TextValue::Float(value),
                            };
                            entry.node.value = TextValue::Array(colour.map(channel).into());
                        }
                    }
                    _ => replace_colour_texts(&mut entry.node, parameters),
                }
            }
        }
        _ => {}
    }
}

/// Warns about materials whose colours were probably written as codes from 0 to 255.
pub(super) fn warn_colour_codes(file: &str, scene: &Scene) -> Vec<Fault> {
    let warning = |material: &Material| {
        let (key, colour) = match &material.model {
            MaterialModel::Classic(classic) => ("colour", classic.colour.constant()?),
            MaterialModel::Physical(physical) => ("base_colour", physical.base_colour.constant()?),
        };
        let [red, green, blue] = colour.0;
        let is_code = |channel: f64| channel > 2.0 && channel <= 255.0;
        colour.0.iter().any(|&channel| is_code(channel)).then(|| {
            let name = &material.name;
            let message = format!(
                "`{key}` of material `{name}` is [{red}, {green}, {blue}], more than a surface can reflect (1 is white); codes from 0 to 255 are \
                 written \"rgb({red}, {green}, {blue})\""
            );
            FaultKind::ColourCodes.in_file(file, message)
        })
    };
    scene.materials.iter().filter_map(warning).collect()
}
