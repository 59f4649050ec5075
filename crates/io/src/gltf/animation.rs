//! Node animation: interpolated translations, rotations, scales and weights at a time (glTF 2.0,
//! section 3.11 and appendix C).
//!
//! If the user chooses no animation, all animations of a file are played together. If two
//! animations change the same property, the first in the file is used: a file with a walk and a run
//! shows the walk.

use std::collections::HashMap;

use super::accessor::{AccessorReader, find_entry};
use super::animation_pointer;
use super::document::Document;
use super::entries::{AnimationChannel, AnimationEntry};
use super::keyframes::KeyframeReader;
use crate::import::{FaultPlace, ImportResult, Warnings, sanitise_text};

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
    if document.animations.is_empty() {
        warn!(
            warnings,
            Choice, "the file has no animation, so that the time (--at) has no effect"
        );
    }
    let mut animator = NodeAnimator {
        time,
        document,
        keys: KeyframeReader::new(reader),
        animated_nodes: HashMap::new(),
        warnings,
    };
    for (i, animation) in document.animations.iter().enumerate() {
        for (j, channel) in animation.channels.iter().enumerate() {
            animator
                .apply_channel(animation, channel)
                .with_place(format_args!("animations[{i}].channels[{j}]"))?;
        }
    }
    Ok(animator.animated_nodes)
}

/// Returns the index of the node that a channel animates, and the name of the animated property;
/// `None` for a channel that animates another object.
fn animated_node_property(channel: &AnimationChannel) -> Option<(usize, &str)> {
    let target = &channel.target;
    animation_pointer::parse_node_pointer(channel)
        .or_else(|| target.node.map(|node| (node, target.path.as_str())))
        .filter(|(_, path)| *path != "pointer")
        .map(|(node, path)| (node as usize, path))
}

/// Evaluation of channels at a time. The animated properties of nodes are collected.
struct NodeAnimator<'a, 'w> {
    /// Time in seconds.
    time: f64,
    document: &'a Document,
    keys: KeyframeReader<'a>,
    /// Animated properties, by node index.
    animated_nodes: HashMap<usize, AnimatedTransform>,
    warnings: &'w mut Warnings,
}

impl NodeAnimator<'_, '_> {
    /// Evaluates a channel that animates a node, and records the value of the property. A property
    /// that has a value already keeps it, with a warning.
    fn apply_channel(
        &mut self,
        animation: &AnimationEntry,
        channel: &AnimationChannel,
    ) -> ImportResult<()> {
        let Some((index, path)) = animated_node_property(channel) else {
            return Ok(());
        };
        let node = find_entry(&self.document.nodes, "nodes", index)?;
        if node.matrix.is_some() && path != "weights" {
            warn!(
                self.warnings,
                Animation,
                "nodes[{index}]: its animations are ignored, because it has a matrix in place of translation, rotation and scale"
            );
            return Ok(());
        }
        let sampler = find_entry(&animation.samplers, "samplers", channel.sampler as usize)?;
        let (keys, time) = (&mut self.keys, self.time);
        let node = self.animated_nodes.entry(index).or_default();
        match path {
            "translation" if node.translation.is_none() => {
                node.translation = Some(keys.interpolate_vector(sampler, time, 3)?);
            }
            "rotation" if node.rotation.is_none() => {
                node.rotation = Some(keys.interpolate_rotation(sampler, time)?);
            }
            "scale" if node.scale.is_none() => {
                node.scale = Some(keys.interpolate_vector(sampler, time, 3)?);
            }
            "weights" if node.weights.is_none() => {
                node.weights = Some(keys.interpolate_weights(sampler, time)?);
            }
            "translation" | "rotation" | "scale" | "weights" => {
                warn!(
                    self.warnings,
                    Choice,
                    "several animations move the same node: the first animation in the file is used"
                );
            }
            other => warn!(
                self.warnings,
                Animation,
                "animations of `{}` are not supported and are ignored",
                sanitise_text(other)
            ),
        }
        Ok(())
    }
}
