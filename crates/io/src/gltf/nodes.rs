//! Node hierarchy: the nodes of a scene and their world transforms, at rest or at a time.

use std::collections::{HashMap, HashSet};

use glam::{DAffine3, DMat3, DQuat, DVec3};

use super::accessor::find_entry;
use super::animation::AnimatedTransform;
use super::document::Document;
use super::entries::NodeEntry;
use crate::import::{Fault, ImportResult, Warnings};

/// A node of the chosen scene, with its world transform and visibility.
#[derive(Clone, Copy, Debug)]
pub(super) struct NodeInstance {
    /// Index in the file.
    pub node: usize,
    /// World transform.
    pub world: DAffine3,
    /// Whether the mesh and the light of the node are visible (KHR_node_visibility).
    pub visible: bool,
}

/// Transforms of all nodes in a file.
#[derive(Debug)]
pub(super) struct NodeTransforms {
    /// Nodes of the chosen scene in the file's order, parents before children. A node with several
    /// parents is listed once for each distinct transform and visibility.
    pub instances: Vec<NodeInstance>,
    /// World transform of each node at its first visit; `None` for unreachable nodes.
    pub world_transforms: Vec<Option<DAffine3>>,
}

/// Largest number of repeated visits of nodes with several parents. A file of a few lines could
/// otherwise require an unbounded number of visits.
const MOST_REPEATED: u64 = 1 << 20;

/// Visits all nodes of a scene with their animated properties, and computes their world transforms.
///
/// # Errors
/// A fault of kind input for an unknown node, a node that is its own ancestor, or a non-finite
/// transform; of kind limit for too many visits of nodes with several parents.
pub(super) fn visit_nodes(
    document: &Document,
    scene: Option<usize>,
    moved: &HashMap<usize, AnimatedTransform>,
    warnings: &mut Warnings,
) -> ImportResult<NodeTransforms> {
    let roots = scene_roots(document, scene, warnings)?;
    let (worlds, open) = (
        vec![None; document.nodes.len()],
        vec![false; document.nodes.len()],
    );
    let shared = find_shared_nodes(document, &roots)
        .into_iter()
        .map(|is_shared| is_shared.then_some(0))
        .collect();
    let mut walk = NodeWalk {
        document,
        animated_nodes: moved,
        world_transforms: worlds,
        is_ancestor: open,
        shared_visits: shared,
        visited: HashSet::new(),
    };
    let instances = walk.traverse(roots, warnings)?;
    let joints = || document.skins.iter().flat_map(|skin| &skin.joints);
    if joints().any(|&joint| walk.world_transforms.get(joint as usize) == Some(&None)) {
        // Joints outside the scene need a transform too.
        let elsewhere = parentless_nodes(document)
            .into_iter()
            .filter(|&root| walk.world_transforms.get(root) == Some(&None))
            .collect();
        walk.traverse(elsewhere, warnings)?;
    }
    Ok(NodeTransforms {
        instances,
        world_transforms: walk.world_transforms,
    })
}

/// Traversal of the node hierarchy. An explicit stack replaces recursion, because the nesting may
/// be as deep as the file is long.
struct NodeWalk<'a> {
    document: &'a Document,
    animated_nodes: &'a HashMap<usize, AnimatedTransform>,
    world_transforms: Vec<Option<DAffine3>>,
    /// By node index: whether the node is the current node or an ancestor of the current node.
    is_ancestor: Vec<bool>,
    /// For each node with several parents, the number of nodes visited in its subtree, itself
    /// included; `None` for all other nodes.
    shared_visits: Vec<Option<u64>>,
    /// Earlier visits of nodes with several parents: node index, bits of the world transform,
    /// visibility. A second visit with the same three values is skipped, because it would add the
    /// same instances.
    visited: HashSet<(usize, [u64; 12], bool)>,
}

/// Step of the traversal.
enum VisitStep {
    /// Enter a node. The values are the index of the node, the world transform of its parent, and
    /// whether its parent is visible.
    Enter(usize, DAffine3, bool),
    /// Leave a node after all its children. The values are the index of the node, and the number of
    /// visits made before the node was entered.
    Leave(usize, u64),
}

impl NodeWalk<'_> {
    /// Visits the nodes below these roots. Returns the visited nodes in the file's order, parents
    /// before children.
    fn traverse(
        &mut self,
        roots: Vec<usize>,
        warnings: &mut Warnings,
    ) -> ImportResult<Vec<NodeInstance>> {
        let (mut out, mut repeated, mut visits) = (Vec::new(), 0_u64, 0_u64);
        // The stack is filled in reverse, so that nodes are visited in the file's order.
        let mut waiting: Vec<VisitStep> = roots
            .into_iter()
            .rev()
            .map(|root| VisitStep::Enter(root, DAffine3::IDENTITY, true))
            .collect();
        while let Some(turn) = waiting.pop() {
            let (index, parent, seen) = match turn {
                VisitStep::Enter(index, parent, seen) => (index, parent, seen),
                VisitStep::Leave(index, before) => {
                    self.is_ancestor[index] = false;
                    self.shared_visits[index] = self.shared_visits[index].map(|_| visits - before);
                    continue;
                }
            };
            let instance = self.enter_node(index, parent, seen, warnings)?;
            let again = self.find_earlier_visit(&instance, warnings);
            // Skipped visits count towards the limit too: a file whose visits double again and
            // again is faulty.
            let new = again.unwrap_or(1);
            repeated = repeated.saturating_add(if self.world_transforms[index].is_some() {
                new
            } else {
                0
            });
            if repeated > MOST_REPEATED {
                return Err(Fault::over_limit(
                    "has several parents, and the hierarchy would repeat more nodes than the limit of 1048576; use EXT_mesh_gpu_instancing for copies",
                )
                .with_place(format_args!("nodes[{index}]")));
            }
            if again.is_some() {
                visits += new;
                self.is_ancestor[index] = false;
                continue;
            }
            self.world_transforms[index].get_or_insert(instance.world);
            out.push(instance);
            waiting.push(VisitStep::Leave(index, visits));
            visits += 1;
            waiting.extend(
                self.document.nodes[index]
                    .children
                    .iter()
                    .rev()
                    .map(|&child| {
                        VisitStep::Enter(child as usize, instance.world, instance.visible)
                    }),
            );
        }
        Ok(out)
    }

    /// Enters a node from its parent, which has the world transform `parent`. Returns the node with
    /// its world transform and its visibility.
    fn enter_node(
        &mut self,
        index: usize,
        parent: DAffine3,
        is_parent_visible: bool,
        warnings: &mut Warnings,
    ) -> ImportResult<NodeInstance> {
        let node = find_entry(&self.document.nodes, "nodes", index)?;
        let place = |fault: Fault| fault.with_place(format_args!("nodes[{index}]"));
        if core::mem::replace(&mut self.is_ancestor[index], true) {
            return Err(place(fault!(
                "is a descendant of itself: the hierarchy of nodes has a cycle"
            )));
        }
        let world =
            parent * local_transform(node, self.animated_nodes.get(&index), index, warnings);
        if !world.is_finite() {
            return Err(place(fault!("its transform is not finite")));
        }
        Ok(NodeInstance {
            node: index,
            world,
            visible: is_parent_visible && node.extensions.visibility.visible,
        })
    }

    /// Looks for an earlier visit of the same node with the same transform and visibility. Returns
    /// the number of nodes that the earlier visit reached; `None` if there was none. Warns about a
    /// node with several parents.
    fn find_earlier_visit(
        &mut self,
        instance: &NodeInstance,
        warnings: &mut Warnings,
    ) -> Option<u64> {
        let index = instance.node;
        let key = (
            index,
            instance.world.to_cols_array().map(f64::to_bits),
            instance.visible,
        );
        let again = self.shared_visits[index].filter(|_| !self.visited.insert(key));
        if again.is_some() {
            warn!(
                warnings,
                Format,
                "nodes[{index}]: is listed more than once with the same transform; the node is shown once"
            );
        } else if self.world_transforms[index].is_some() {
            warn!(
                warnings,
                Format, "nodes[{index}]: has more than one parent and is shown under each parent"
            );
        }
        again
    }
}

/// Returns for each node whether it is listed more than once, as a root or as a child.
fn find_shared_nodes(document: &Document, roots: &[usize]) -> Vec<bool> {
    let (mut listed, mut shared) = (
        vec![false; document.nodes.len()],
        vec![false; document.nodes.len()],
    );
    let children = document
        .nodes
        .iter()
        .flat_map(|node| &node.children)
        .map(|&child| child as usize);
    for index in roots.iter().copied().chain(children) {
        if let (Some(listed), Some(shared)) = (listed.get_mut(index), shared.get_mut(index)) {
            *shared |= core::mem::replace(listed, true);
        }
    }
    shared
}

/// Returns the nodes without a parent.
fn parentless_nodes(document: &Document) -> Vec<usize> {
    let mut is_child = vec![false; document.nodes.len()];
    for &child in document.nodes.iter().flat_map(|node| &node.children) {
        if let Some(flag) = is_child.get_mut(child as usize) {
            *flag = true;
        }
    }
    (0..document.nodes.len())
        .filter(|&i| !is_child[i])
        .collect()
}

/// Returns the root nodes of a scene: of the chosen scene, else of `scene`, else of the first
/// scene, else all nodes without a parent.
fn scene_roots(
    document: &Document,
    requested: Option<usize>,
    warnings: &mut Warnings,
) -> ImportResult<Vec<usize>> {
    if document.scenes.is_empty() && document.scene.is_none() {
        if !document.nodes.is_empty() {
            warn!(
                warnings,
                Choice, "the file has no scene: all nodes without a parent are shown"
            );
        }
        return Ok(parentless_nodes(document));
    }
    let index = requested.unwrap_or(document.scene.unwrap_or(0) as usize);
    let scene = find_entry(&document.scenes, "scenes", index)?;
    if document.scenes.len() > 1 && requested.is_none() {
        warn!(
            warnings,
            Choice,
            "of {} scenes, scenes[{index}] is shown; --scene chooses another",
            document.scenes.len()
        );
    }
    Ok(scene.nodes.iter().map(|&node| node as usize).collect())
}

/// Returns a node's transform relative to its parent.
fn local_transform(
    node: &NodeEntry,
    moved: Option<&AnimatedTransform>,
    index: usize,
    warnings: &mut Warnings,
) -> DAffine3 {
    if let Some(m) = &node.matrix {
        if m[3] != 0.0 || m[7] != 0.0 || m[11] != 0.0 || m[15] != 1.0 {
            warn!(
                warnings,
                Format,
                "nodes[{index}]: the last row of its matrix is not 0 0 0 1; 0 0 0 1 is used"
            );
        }
        let column = |i: usize| DVec3::new(m[4 * i], m[4 * i + 1], m[4 * i + 2]);
        return DAffine3 {
            matrix3: DMat3::from_cols(column(0), column(1), column(2)),
            translation: column(3),
        };
    }
    let turned = moved.and_then(|moved| moved.rotation);
    let moved = |of: fn(&AnimatedTransform) -> Option<[f64; 3]>| moved.and_then(of);
    let quaternion = turned
        .or(node.rotation)
        .map_or(DQuat::IDENTITY, DQuat::from_array);
    let length = quaternion.length();
    let rotation = if length > 0.0 && length.is_finite() {
        quaternion / length
    } else {
        DQuat::IDENTITY
    };
    if (length - 1.0).abs() > 1e-3 {
        warn!(
            warnings,
            Format,
            "nodes[{index}]: its rotation has length {length:.3} instead of 1; the rotation was normalised"
        );
    }
    DAffine3::from_scale_rotation_translation(
        moved(|moved| moved.scale)
            .or(node.scale)
            .map_or(DVec3::ONE, DVec3::from_array),
        rotation,
        moved(|moved| moved.translation)
            .or(node.translation)
            .map_or(DVec3::ZERO, DVec3::from_array),
    )
}
