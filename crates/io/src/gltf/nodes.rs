//! The node hierarchy: which nodes a scene shows, and where each of them is in the world, at rest
//! or at a time.

use std::collections::{HashMap, HashSet};

use glam::{DAffine3, DMat3, DQuat, DVec3};

use super::animation::Moved;
use super::buffers::absent;
use super::document::Document;
use super::entries::Node;
use crate::import::{Fault, Outcome, Warnings};
use crate::warning::WarningCode;

/// A node of the scene that is shown.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed {
    /// Its index in the file.
    pub node: usize,
    /// From its own space to the world.
    pub world: DAffine3,
    /// Whether what it carries is seen (KHR_node_visibility), cameras apart.
    pub visible: bool,
}

/// Where all nodes of a file are.
#[derive(Debug)]
pub(super) struct Places {
    /// The nodes of the scene that is shown, parents before children, each in the file's order. A
    /// node of several parents is there under each that puts it elsewhere.
    pub shown: Vec<Placed>,
    /// From each node's own space to the world, where it is first met; none for nodes that nothing
    /// leads to.
    pub worlds: Vec<Option<DAffine3>>,
}

/// How often nodes may be shown again under further parents: what a file of a few lines could
/// otherwise ask for has no end.
const MOST_REPEATED: u64 = 1 << 20;

/// All nodes of a scene, with what animations say of them.
///
/// # Errors
/// A fault of kind input when a node does not exist, is its own ancestor or is not finite; of kind
/// limit when nodes of several parents are shown too often.
pub(super) fn places(
    document: &Document,
    scene: Option<usize>,
    moved: &HashMap<usize, Moved>,
    warnings: &mut Warnings,
) -> Outcome<Places> {
    let roots = roots(document, scene, warnings)?;
    let (worlds, open) = (
        vec![None; document.nodes.len()],
        vec![false; document.nodes.len()],
    );
    let shared = shared(document, &roots)
        .into_iter()
        .map(|is_shared| is_shared.then_some(0))
        .collect();
    let mut walk = Walk {
        document,
        moved,
        worlds,
        open,
        shared,
        met: HashSet::new(),
    };
    let shown = walk.down(roots, warnings)?;
    let joints = || document.skins.iter().flat_map(|skin| &skin.joints);
    if joints().any(|&joint| walk.worlds.get(joint as usize) == Some(&None)) {
        // Joints beside the scene are somewhere, too.
        let elsewhere = orphans(document)
            .into_iter()
            .filter(|&root| walk.worlds.get(root) == Some(&None))
            .collect();
        walk.down(elsewhere, warnings)?;
    }
    Ok(Places {
        shown,
        worlds: walk.worlds,
    })
}

/// A walk through the hierarchy, with a list of its own and not by recursion: a file may be nested
/// as deep as it is long.
struct Walk<'a> {
    document: &'a Document,
    moved: &'a HashMap<usize, Moved>,
    worlds: Vec<Option<DAffine3>>,
    /// Whether a node is on the way to the one at hand.
    open: Vec<bool>,
    /// Of nodes that are listed more than once, how many visits they and what is below them take.
    shared: Vec<Option<u64>>,
    /// Where those were met, and whether they are seen there: at the same place there is nothing
    /// new to show.
    met: HashSet<(usize, [u64; 12], bool)>,
}

/// What is to be done next.
enum Turn {
    /// To come to a node from what its parent makes of space, and from whether that is seen.
    Enter(usize, DAffine3, bool),
    /// To leave a node after its children, with the visits before it.
    Leave(usize, u64),
}

impl Walk<'_> {
    fn down(&mut self, roots: Vec<usize>, warnings: &mut Warnings) -> Outcome<Vec<Placed>> {
        let nodes = &self.document.nodes;
        let (mut out, mut repeated, mut visits) = (Vec::new(), 0_u64, 0_u64);
        // Last in, first out: pushed backwards, nodes come out in the file's order.
        let mut waiting: Vec<Turn> = roots
            .into_iter()
            .rev()
            .map(|root| Turn::Enter(root, DAffine3::IDENTITY, true))
            .collect();
        while let Some(turn) = waiting.pop() {
            let (index, parent, seen) = match turn {
                Turn::Enter(index, parent, seen) => (index, parent, seen),
                Turn::Leave(index, before) => {
                    self.open[index] = false;
                    self.shared[index] = self.shared[index].map(|_| visits - before);
                    continue;
                }
            };
            let node = nodes
                .get(index)
                .ok_or_else(|| absent("nodes", index, nodes.len()))?;
            let place = |fault: Fault| fault.at(format_args!("nodes[{index}]"));
            if core::mem::replace(&mut self.open[index], true) {
                return Err(place(Fault::input(
                    "is reached from itself: its children form a cycle",
                )));
            }
            let world = parent * local(node, self.moved.get(&index), index, warnings);
            if !world.is_finite() {
                return Err(place(Fault::input("its transform is not finite")));
            }
            let visible = seen && node.extensions.visibility.visible;
            let key = (index, world.to_cols_array().map(f64::to_bits), visible);
            let again = self.shared[index].filter(|_| !self.met.insert(key));
            if again.is_some() {
                warnings.add(
                    WarningCode::Format,
                    format!("nodes[{index}]: is listed again where it is shown already; it is shown once"),
                );
            } else if self.worlds[index].is_some() {
                warnings.add(
                    WarningCode::Format,
                    format!("nodes[{index}]: has more than one parent and is shown under each"),
                );
            }
            // What is left out counts as what is shown: doubled again and again it is a mistake,
            // whatever it would show.
            let new = again.unwrap_or(1);
            repeated = repeated.saturating_add(if self.worlds[index].is_some() { new } else { 0 });
            if repeated > MOST_REPEATED {
                return Err(place(Fault::limit(
                    "has several parents, and nodes would be shown over and over again",
                )));
            }
            if again.is_some() {
                visits += new;
                self.open[index] = false;
                continue;
            }
            self.worlds[index].get_or_insert(world);
            out.push(Placed {
                node: index,
                world,
                visible,
            });
            waiting.push(Turn::Leave(index, visits));
            visits += 1;
            waiting.extend(
                node.children
                    .iter()
                    .rev()
                    .map(|&child| Turn::Enter(child as usize, world, visible)),
            );
        }
        Ok(out)
    }
}

/// Which nodes are listed more than once, as roots or as children.
fn shared(document: &Document, roots: &[usize]) -> Vec<bool> {
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

/// The nodes that are nobody's child.
fn orphans(document: &Document) -> Vec<usize> {
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

/// The nodes that a scene starts from; where none is asked for, those of `scene`, else of the first
/// scene, else all that have no parent.
fn roots(
    document: &Document,
    asked: Option<usize>,
    warnings: &mut Warnings,
) -> Outcome<Vec<usize>> {
    if document.scenes.is_empty() && document.scene.is_none() {
        if !document.nodes.is_empty() {
            warnings.add(
                WarningCode::Choice,
                "the file has no scene: all nodes without a parent are shown",
            );
        }
        return Ok(orphans(document));
    }
    let index = asked.unwrap_or(document.scene.unwrap_or(0) as usize);
    let scene = document
        .scenes
        .get(index)
        .ok_or_else(|| absent("scenes", index, document.scenes.len()))?;
    if document.scenes.len() > 1 && asked.is_none() {
        warnings.add(
            WarningCode::Choice,
            format!(
                "of {} scenes, scenes[{index}] is shown; --scene chooses another",
                document.scenes.len()
            ),
        );
    }
    Ok(scene.nodes.iter().map(|&node| node as usize).collect())
}

/// A node's transform relative to its parent.
fn local(node: &Node, moved: Option<&Moved>, index: usize, warnings: &mut Warnings) -> DAffine3 {
    if let Some(m) = &node.matrix {
        if m[3] != 0.0 || m[7] != 0.0 || m[11] != 0.0 || m[15] != 1.0 {
            warnings.add(
                WarningCode::Format,
                format!("nodes[{index}]: the last row of its matrix is not 0 0 0 1; it was taken as such"),
            );
        }
        let column = |i: usize| DVec3::new(m[4 * i], m[4 * i + 1], m[4 * i + 2]);
        return DAffine3 {
            matrix3: DMat3::from_cols(column(0), column(1), column(2)),
            translation: column(3),
        };
    }
    let turned = moved.and_then(|moved| moved.rotation);
    let moved = |of: fn(&Moved) -> Option<[f64; 3]>| moved.and_then(of);
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
        warnings.add(
            WarningCode::Format,
            format!("nodes[{index}]: its rotation has length {length:.3}; it was taken as a unit quaternion"),
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
