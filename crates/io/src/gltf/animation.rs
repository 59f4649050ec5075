//! Node animation: interpolated translations, rotations, scales and weights at a time (glTF 2.0,
//! section 3.11 and appendix C).
//!
//! If the user chooses no animation, all animations of a file are played together. If two
//! animations change the same property, the first in the file is used: a file with a walk and a run
//! shows the walk.

use std::collections::HashMap;

use super::accessor::AccessorReader;
use super::animation_pointer;
use super::buffers::missing_index_fault;
use super::document::Document;
use super::keyframes::{KeyframeReader, find_sampler};
use crate::import::{Fault, ImportResult, Warnings, sanitise_text};
use crate::warning::WarningCode;

/// Animated transform and morph weights of a node; `None` for a property that is not animated.
#[derive(Clone, Debug, Default)]
pub(super) struct AnimatedTransform {
    pub translation: Option<[f64; 3]>,
    pub rotation: Option<[f64; 4]>,
    pub scale: Option<[f64; 3]>,
    /// Weights of the morph targets of the node's mesh.
    pub weights: Option<Vec<f64>>,
}

/// Evaluates the animated properties of all nodes at a time in seconds. Returns the properties by
/// node index.
///
/// # Errors
/// A fault of kind input for a channel without a target, or a sampler whose keys do not fit its
/// channel.
pub(super) fn evaluate_animations(
    time: f64,
    document: &Document,
    reader: &AccessorReader<'_>,
    warnings: &mut Warnings,
) -> ImportResult<HashMap<usize, AnimatedTransform>> {
    let (mut animated_nodes, mut keys) = (
        HashMap::<usize, AnimatedTransform>::new(),
        KeyframeReader::new(reader),
    );
    if document.animations.is_empty() {
        warnings.add(
            WarningCode::Choice,
            "the file has no animation, so that the time (--at) has no effect",
        );
    }
    for (i, animation) in document.animations.iter().enumerate() {
        for (j, channel) in animation.channels.iter().enumerate() {
            let place =
                |fault: Fault| fault.with_place(format_args!("animations[{i}].channels[{j}]"));
            // Channels that animate other objects than nodes are skipped here.
            let named = || {
                channel
                    .target
                    .node
                    .map(|node| (node, channel.target.path.as_str()))
            };
            let Some((index, path)) = animation_pointer::parse_node_pointer(channel)
                .or_else(named)
                .filter(|(_, path)| *path != "pointer")
            else {
                continue;
            };
            let index = index as usize;
            let list = &document.nodes;
            let node = list
                .get(index)
                .ok_or_else(|| place(missing_index_fault("nodes", index, list.len())))?;
            if node.matrix.is_some() && path != "weights" {
                warnings.add(
                    WarningCode::Animation,
                    format!(
                        "nodes[{index}]: its animations are ignored, because it has a matrix in place of translation, rotation and scale"
                    ),
                );
                continue;
            }
            let sampler = find_sampler(animation, channel.sampler).map_err(place)?;
            let node = animated_nodes.entry(index).or_default();
            match path {
                "translation" if node.translation.is_none() => {
                    node.translation = Some(keys.interpolate_vector(sampler, time).map_err(place)?);
                }
                "rotation" if node.rotation.is_none() => {
                    node.rotation = Some(keys.interpolate_rotation(sampler, time).map_err(place)?)
                }
                "scale" if node.scale.is_none() => {
                    node.scale = Some(keys.interpolate_vector(sampler, time).map_err(place)?)
                }
                "weights" if node.weights.is_none() => {
                    node.weights = Some(keys.interpolate_weights(sampler, time).map_err(place)?)
                }
                "translation" | "rotation" | "scale" | "weights" => {
                    warnings.add(
                        WarningCode::Choice,
                        "several animations move the same node: the first animation in the file is used",
                    );
                }
                other => warnings.add(
                    WarningCode::Animation,
                    format!(
                        "animations of `{}` are not supported and are ignored",
                        sanitise_text(other)
                    ),
                ),
            }
        }
    }
    Ok(animated_nodes)
}
