//! Deformation of a mesh before its node's transform: morph targets by their weights, then skins by
//! their joints (glTF 2.0, sections 3.7.2.2 and 3.7.3).

use std::collections::HashMap;
use std::rc::Rc;

use glam::{DAffine3, DMat3, DVec3, DVec4};

use super::GltfImport;
use super::accessor::{Accessor, find_entry};
use super::entries::{NodeEntry, PrimitiveEntry};
use super::nodes::NodeInstance;
use super::vertices::VertexSelection;
use crate::import::{Fault, FaultPlace, ImportResult, format_count};

/// Largest number of vertex displacements by morph targets and joints in a file. Without a limit, a
/// few lines of JSON could take unbounded time.
const MOST_MOVES: u64 = 1 << 30;

/// Deformation of a node's mesh.
#[derive(Clone, Debug, Default)]
pub(super) struct MeshDeformation {
    /// Weights of the morph targets; empty if all are zero.
    pub weights: Vec<f64>,
    /// Skin whose joints map vertices to world space; `None`: vertices are mapped by the node's
    /// transform.
    pub skin: Option<Rc<SkinTransforms>>,
    /// Whether faces are reversed, because the node's transform is a reflection. This holds even
    /// for a skinned mesh, whose vertices the node's transform does not move (glTF 2.0, section
    /// 3.7.4, "Instantiation").
    pub mirrored: bool,
}

/// Key of a deformation: the bits of the weights, the index of the skin, and whether faces are
/// reversed.
pub(super) type DeformationKey = (Vec<u64>, Option<usize>, bool);

impl MeshDeformation {
    /// Returns a key that is equal for equal deformations.
    pub fn deformation_key(&self) -> DeformationKey {
        (
            self.weights.iter().map(|weight| weight.to_bits()).collect(),
            self.skin.as_ref().map(|skin| skin.index),
            self.mirrored,
        )
    }

    /// Whether the mesh is undeformed.
    pub fn is_identity(&self) -> bool {
        self.weights.is_empty() && self.skin.is_none()
    }
}

/// A skin at the chosen time: the transforms of its joints.
#[derive(Clone, Debug)]
pub(super) struct SkinTransforms {
    /// Index in the file.
    index: usize,
    /// Origin of the skinned meshes in world space. Vertices are stored relative to this origin,
    /// because single precision is too coarse far from the origin of the world.
    pub origin: DVec3,
    /// Transform of each joint, from mesh space to world space relative to `origin`.
    joints: Vec<DAffine3>,
}

/// Positions and directions of a primitive's vertices, which morph targets and joints change in
/// place.
#[derive(Default)]
pub(super) struct DeformingMesh {
    pub positions: Vec<DVec3>,
    /// Normals; empty if the mesh has none.
    pub normals: Vec<DVec3>,
}

impl GltfImport<'_> {
    /// Returns the deformation of a node's mesh.
    pub(super) fn node_deformation(
        &mut self,
        instance: &NodeInstance,
        node: &NodeEntry,
    ) -> ImportResult<MeshDeformation> {
        let mesh = node
            .mesh
            .and_then(|mesh| self.document.meshes.get(mesh as usize));
        let own = || mesh.map(|mesh| mesh.weights.clone());
        let animated = self
            .animated_nodes
            .get(&instance.node)
            .and_then(|moved| moved.weights.clone());
        let mut weights = animated
            .or_else(|| node.weights.clone())
            .or_else(own)
            .unwrap_or_default();
        if let Some(weight) = weights.iter().find(|weight| !weight.is_finite()) {
            return Err(fault!("the morph target weight {weight} is not finite"));
        }
        if weights.iter().all(|&weight| weight == 0.0) {
            weights.clear();
        }
        let skin = node
            .skin
            .map(|skin| self.skin_transforms(skin as usize))
            .transpose()?;
        let mirrored = skin.is_some() && instance.world.matrix3.determinant() < 0.0;
        Ok(MeshDeformation {
            weights,
            skin,
            mirrored,
        })
    }

    /// Returns a skin with its joint transforms, computed on first use.
    fn skin_transforms(&mut self, index: usize) -> ImportResult<Rc<SkinTransforms>> {
        if let Some(known) = self.skins.get(&index) {
            return Ok(Rc::clone(known));
        }
        let skin = self
            .compute_skin_transforms(index)
            .with_place(format_args!("skins[{index}]"))?;
        Ok(Rc::clone(self.skins.entry(index).or_insert(Rc::new(skin))))
    }

    fn compute_skin_transforms(&mut self, index: usize) -> ImportResult<SkinTransforms> {
        let skin = find_entry(&self.document.skins, "skins", index)?;
        let binds = skin
            .inverse_bind_matrices
            .map(|accessor| self.reader.open(accessor as usize))
            .transpose()?;
        if let Some(binds) = &binds
            && (binds.element_arity() != 16 || binds.count() < skin.joints.len())
        {
            let (count, joints) = (binds.count(), skin.joints.len());
            return Err(fault!(
                "has {}, but {count} inverseBindMatrices of {}; each joint needs one matrix of 16 numbers",
                format_count(joints, "joint"),
                format_count(binds.element_arity(), "number")
            ));
        }
        self.budget
            .reserve_memory(skin.joints.len(), size_of::<DAffine3>())?;
        let mut joints = Vec::with_capacity(skin.joints.len());
        for (i, &joint) in skin.joints.iter().enumerate() {
            let node = joint as usize;
            // A joint in a cycle outside every scene has no transform; the identity is used.
            let world =
                find_entry(&self.world_transforms, "nodes", node)?.unwrap_or(DAffine3::IDENTITY);
            let bind = binds.as_ref().map_or(DAffine3::IDENTITY, |binds| {
                affine_from_columns(binds.read_vector(i))
            });
            joints.push((world, world * bind));
        }
        let origin = joints
            .first()
            .map_or(DVec3::ZERO, |(world, _)| world.translation);
        let about = |(_, mut joint): (DAffine3, DAffine3)| {
            joint.translation -= origin;
            joint
        };
        let joints: Vec<DAffine3> = joints.into_iter().map(about).collect();
        match joints.iter().position(|joint| !joint.is_finite()) {
            Some(i) => Err(fault!("the matrix of joints[{i}] is not finite")),
            None => Ok(SkinTransforms {
                index,
                origin,
                joints,
            }),
        }
    }

    /// Deforms the selected vertices of a primitive: morph targets first, then the skin. `count` is
    /// the number of vertices in the file.
    pub(super) fn deform_vertices(
        &mut self,
        primitive: &PrimitiveEntry,
        pose: &MeshDeformation,
        vertices: &VertexSelection,
        count: usize,
        deforming: &mut DeformingMesh,
    ) -> ImportResult<()> {
        for (name, list) in [
            ("POSITION", &mut deforming.positions),
            ("NORMAL", &mut deforming.normals),
        ] {
            if !list.is_empty() {
                let add = |i: usize, step: DVec4| list[i] += step.truncate();
                self.add_morph_offsets(primitive, pose, (name, &[3]), vertices, count, add)?;
            }
        }
        match &pose.skin {
            Some(skin) => self.apply_skin(primitive, skin, vertices, count, deforming),
            None => Ok(()),
        }
    }

    /// Adds `count` to the number of vertex displacements so far. A file beyond the limit is
    /// refused.
    fn count_displaced_vertices(&mut self, count: usize) -> ImportResult<()> {
        self.vertex_moves += count as u64;
        if self.vertex_moves > MOST_MOVES {
            return Err(Fault::over_limit(format!(
                "the morph targets and skins of the file displace more vertices than the limit of {MOST_MOVES}; use fewer vertices, targets or skinned nodes"
            )));
        }
        Ok(())
    }

    /// Calls `add` with each vertex and its offset of each morph target, multiplied by the target's
    /// weight, for the attribute with this name and its permitted numbers of components.
    pub(super) fn add_morph_offsets(
        &mut self,
        primitive: &PrimitiveEntry,
        pose: &MeshDeformation,
        (name, arities): (&str, &[usize]),
        vertices: &VertexSelection,
        count: usize,
        mut add: impl FnMut(usize, DVec4),
    ) -> ImportResult<()> {
        for (i, (target, &weight)) in primitive.targets.iter().zip(&pose.weights).enumerate() {
            let Some(&index) = target.get(name).filter(|_| weight != 0.0) else {
                continue;
            };
            let place = |fault: Fault| fault.with_place(format_args!("targets[{i}]: {name}"));
            self.count_displaced_vertices(vertices.len())
                .map_err(place)?;
            let mut steps = self.reader.open(index as usize).map_err(place)?;
            if !arities.contains(&steps.element_arity()) || steps.count() != count {
                let (n, m) = (steps.count(), steps.element_arity());
                let arity = arities.iter().max().unwrap_or(&0);
                return Err(place(fault!(
                    "has {n} elements of {m} numbers, but the mesh has {count} vertices with {arity} numbers each"
                )));
            }
            if name.starts_with("COLOR_") {
                steps.mark_as_normalised();
            }
            for (i, vertex) in vertices.iter().enumerate() {
                add(
                    i,
                    DVec4::from(steps.read_vector::<4>(vertex).map(f64::from)) * weight,
                );
            }
        }
        Ok(())
    }

    /// Transforms positions and normals by the weighted joints of a skin.
    fn apply_skin(
        &mut self,
        primitive: &PrimitiveEntry,
        skin: &SkinTransforms,
        vertices: &VertexSelection,
        count: usize,
        deforming: &mut DeformingMesh,
    ) -> ImportResult<()> {
        let mut sets = Vec::new();
        for set in 0_u32.. {
            let joints = self.open_attribute(primitive, &format!("JOINTS_{set}"), &[4])?;
            let weights = self.open_attribute(primitive, &format!("WEIGHTS_{set}"), &[4])?;
            let (Some(joints), Some(weights)) = (joints, weights) else {
                break;
            };
            if !joints.is_unsigned() || [joints.count(), weights.count()] != [count; 2] {
                let (n, m) = (joints.count(), weights.count());
                return Err(fault!(
                    "JOINTS_{set} has {n} elements and WEIGHTS_{set} has {m}, but the mesh has {count} vertices"
                ));
            }
            sets.push((joints, weights));
        }
        if sets.is_empty() {
            return Err(fault!("is skinned, but has no JOINTS_0 and WEIGHTS_0"));
        }
        self.count_displaced_vertices(deforming.positions.len().saturating_mul(4 * sets.len()))?;
        for (i, vertex) in vertices.iter().enumerate() {
            let map = skin.blend_joints(&sets, vertex)?;
            if let Some(position) = deforming.positions.get_mut(i) {
                *position = map.transform_point3(*position);
            }
            if let Some(normal) = deforming.normals.get_mut(i) {
                *normal = (cofactor_matrix(&map.matrix3) * *normal).normalize_or_zero();
            }
        }
        Ok(())
    }
}

impl SkinTransforms {
    /// Returns the weighted mean of a vertex's joint transforms. The weights are divided by their
    /// sum, which differs from 1 by rounding. If all weights are zero, the vertex's first joint has
    /// the weight 1.
    fn blend_joints(
        &self,
        sets: &[(Accessor<'_>, Accessor<'_>)],
        vertex: usize,
    ) -> ImportResult<DAffine3> {
        let (mut sum, mut total) = (
            DAffine3 {
                matrix3: DMat3::ZERO,
                translation: DVec3::ZERO,
            },
            0.0,
        );
        let joint = |index: u32| {
            let list = &self.joints;
            list.get(index as usize).ok_or_else(|| {
                fault!(
                    "JOINTS: joint {index} does not exist, the skin has {}",
                    format_count(list.len(), "joint")
                )
            })
        };
        for (joints, weights) in sets {
            for (index, weight) in joints
                .read_indices::<4>(vertex)
                .into_iter()
                .zip(weights.read_vector::<4>(vertex))
            {
                let weight = f64::from(weight);
                if weight == 0.0 || !weight.is_finite() {
                    continue;
                }
                let joint = joint(index)?;
                sum = DAffine3 {
                    matrix3: sum.matrix3 + joint.matrix3 * weight,
                    translation: sum.translation + joint.translation * weight,
                };
                total += weight;
            }
        }
        let first = || {
            sets.first()
                .map_or(0, |(joints, _)| joints.read_indices::<4>(vertex)[0])
        };
        if total == 0.0 {
            return joint(first()).copied();
        }
        Ok(DAffine3 {
            matrix3: sum.matrix3 * total.recip(),
            translation: sum.translation / total,
        })
    }
}

/// Returns a function that adds a vertex's offset to its value in a list.
pub(super) fn offset_values<const N: usize>(
    values: &mut [[f32; N]],
) -> impl FnMut(usize, DVec4) + '_ {
    move |vertex, step| {
        for (value, step) in values[vertex].iter_mut().zip(step.to_array()) {
            *value = (f64::from(*value) + step) as f32;
        }
    }
}

/// Converts a column-major matrix, whose last row is assumed to be 0 0 0 1.
fn affine_from_columns(m: [f32; 16]) -> DAffine3 {
    let column = |i: usize| DVec3::new(m[i].into(), m[i + 1].into(), m[i + 2].into());
    DAffine3 {
        matrix3: DMat3::from_cols(column(0), column(4), column(8)),
        translation: column(12),
    }
}

/// Returns the cofactor matrix, which transforms normals: the inverse transpose times the
/// determinant. The cofactor matrix exists for singular transforms too.
fn cofactor_matrix(m: &DMat3) -> DMat3 {
    DMat3::from_cols(
        m.y_axis.cross(m.z_axis),
        m.z_axis.cross(m.x_axis),
        m.x_axis.cross(m.y_axis),
    )
}

fn read_dvec3(accessor: &Accessor<'_>, element: usize) -> DVec3 {
    DVec3::from(accessor.read_vector::<3>(element).map(f64::from))
}

/// Reads the vectors of the selected vertices in double precision.
pub(super) fn read_dvec3_list(accessor: &Accessor<'_>, vertices: &VertexSelection) -> Vec<DVec3> {
    vertices.iter().map(|v| read_dvec3(accessor, v)).collect()
}

/// Skins by index in the file.
pub(super) type SkinsByIndex = HashMap<usize, Rc<SkinTransforms>>;
