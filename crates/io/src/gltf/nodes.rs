//! The node hierarchy: which nodes a scene shows, and where each of them is in the world, at rest or at a time.

use std::collections::HashMap;

use glam::{DAffine3, DMat3, DQuat, DVec3};

use super::animation::Moved;
use super::buffers::absent;
use super::document::{Document, Node};
use crate::import::{Fault, Outcome, Warnings};

/// A node of the scene that is shown.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed {
    /// Its index in the file.
    pub node: usize,
    /// From its own space to the world.
    pub world: DAffine3,
}

/// All nodes of a scene, with what animations say of them, parents before children, each in the file's order.
///
/// Walks with a list of its own, not by recursion: a file may be nested as deep as it is long.
///
/// # Errors
/// A fault of kind input when a node does not exist, is reached twice (a cycle, or two parents), or is not finite.
pub(super) fn placed(
    document: &Document,
    scene: Option<usize>,
    moved: &HashMap<usize, Moved>,
    warnings: &mut Warnings,
) -> Outcome<Vec<Placed>> {
    let nodes = &document.nodes;
    let mut seen = vec![false; nodes.len()];
    let mut out = Vec::new();
    let mut waiting: Vec<(usize, DAffine3)> = Vec::new();
    // Last in, first out: pushed backwards, nodes come out in the file's order.
    waiting.extend(roots(document, scene, warnings)?.into_iter().rev().map(|root| (root, DAffine3::IDENTITY)));
    while let Some((index, parent)) = waiting.pop() {
        let node = nodes.get(index).ok_or_else(|| absent("nodes", index, nodes.len()))?;
        let place = |fault: Fault| fault.at(format_args!("nodes[{index}]"));
        match seen.get_mut(index) {
            Some(true) => return Err(place(Fault::input("is reached twice: the nodes are no tree (a cycle, or two parents)"))),
            Some(flag) => *flag = true,
            None => {}
        }
        let world = parent * local(node, moved.get(&index).copied().unwrap_or_default(), index, warnings);
        if !world.is_finite() {
            return Err(place(Fault::input("its transform is not finite")));
        }
        out.push(Placed { node: index, world });
        waiting.extend(node.children.iter().rev().map(|&child| (child as usize, world)));
    }
    Ok(out)
}

/// The nodes that a scene starts from; where none is asked for, those of `scene`, else of the first scene, else all that have no
/// parent.
fn roots(document: &Document, asked: Option<usize>, warnings: &mut Warnings) -> Outcome<Vec<usize>> {
    if document.scenes.is_empty() && document.scene.is_none() {
        if !document.nodes.is_empty() {
            warnings.add("the file has no scene: all nodes without a parent are shown");
        }
        let mut is_child = vec![false; document.nodes.len()];
        for &child in document.nodes.iter().flat_map(|node| &node.children) {
            if let Some(flag) = is_child.get_mut(child as usize) {
                *flag = true;
            }
        }
        return Ok((0..document.nodes.len()).filter(|&i| is_child.get(i) == Some(&false)).collect());
    }
    let index = asked.unwrap_or(document.scene.unwrap_or(0) as usize);
    let scene = document.scenes.get(index).ok_or_else(|| absent("scenes", index, document.scenes.len()))?;
    if document.scenes.len() > 1 && asked.is_none() {
        warnings.add(format!("of {} scenes, scenes[{index}] is shown; --scene chooses another", document.scenes.len()));
    }
    Ok(scene.nodes.iter().map(|&node| node as usize).collect())
}

/// A node's transform relative to its parent.
fn local(node: &Node, moved: Moved, index: usize, warnings: &mut Warnings) -> DAffine3 {
    if let Some(m) = &node.matrix {
        if m[3] != 0.0 || m[7] != 0.0 || m[11] != 0.0 || m[15] != 1.0 {
            warnings.add(format!("nodes[{index}]: the last row of its matrix is not 0 0 0 1; it was taken as such"));
        }
        let column = |i: usize| DVec3::new(m[4 * i], m[4 * i + 1], m[4 * i + 2]);
        return DAffine3 { matrix3: DMat3::from_cols(column(0), column(1), column(2)), translation: column(3) };
    }
    let quaternion = moved.rotation.or(node.rotation).map_or(DQuat::IDENTITY, DQuat::from_array);
    let length = quaternion.length();
    let rotation = if length > 0.0 && length.is_finite() { quaternion / length } else { DQuat::IDENTITY };
    if (length - 1.0).abs() > 1e-3 {
        warnings.add(format!("nodes[{index}]: its rotation has length {length:.3}; it was taken as a unit quaternion"));
    }
    DAffine3::from_scale_rotation_translation(
        moved.scale.or(node.scale).map_or(DVec3::ONE, DVec3::from_array),
        rotation,
        moved.translation.or(node.translation).map_or(DVec3::ZERO, DVec3::from_array),
    )
}
