//! Facts about a scene that the checks share: its objects with their materials, bounds and surface
//! kinds.

use std::collections::BTreeMap;

use glam::{DAffine3, DVec3};
use raywright_bvh::shapes::transform_bounds;
use raywright_bvh::{Aabb, Motion, Shape as _};

use super::finding::FindingSubject;
use crate::affine::affine_from_steps;
use crate::generate::{count_generated_objects, generator_offsets};
use crate::lookup::SceneLookup;
use crate::motion::{object_transforms_at_ends, shutter_opening};
use crate::scene::{AlphaMode, Material, MaterialModel, MeshData, Object, Scene, Shape, SideRule};
use crate::shape::convert_shape;

/// How light passes a surface, by its material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SurfaceKind {
    /// Light is absorbed or reflected.
    Opaque,
    /// The surface bounds a body that light passes through. It has to be closed.
    Body,
    /// Light passes straight through: a thin wall, or a partly transparent (blended) surface.
    Veil,
}

impl SurfaceKind {
    fn from_material(material: &Material) -> Self {
        match &material.model {
            MaterialModel::Physical(m) if m.alpha == AlphaMode::Blend => Self::Veil,
            MaterialModel::Physical(m) if m.may_transmit() => {
                if m.thin_walled {
                    Self::Veil
                } else {
                    Self::Body
                }
            }
            MaterialModel::Physical(_) => Self::Opaque,
            MaterialModel::Classic(m) => {
                let refracts = m
                    .mixture
                    .as_ref()
                    .is_some_and(|mixture| mixture.refraction_chance > 0.0);
                if m.transmission.is_some() || refracts {
                    Self::Body
                } else {
                    Self::Opaque
                }
            }
        }
    }
}

/// An object of the scene's list, or a generator as a whole.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ObjectFacts<'a> {
    pub object: &'a Object,
    pub subject: FindingSubject,
    /// The material, with its index in the scene's list.
    pub material: Option<(usize, &'a Material)>,
    pub surface_kind: SurfaceKind,
    /// Transform from object to world space when the first camera's shutter opens; for a generator,
    /// that of its first object.
    pub object_to_world: DAffine3,
    /// World-space bounding box of the object, or of a generator's first object. `None` if
    /// unbounded.
    pub bounds: Option<Aabb>,
}

impl ObjectFacts<'_> {
    /// Returns whether camera rays hit only one side of the surface.
    pub fn hides_back_faces(&self) -> bool {
        self.object.side != SideRule::Both
    }

    /// Returns whether the surface is blended, so that a share of the light passes straight
    /// through. Two blended surfaces in one place hide more than one. Two coinciding glass
    /// boundaries or thin walls do not: rays hit only one of them.
    pub fn is_blended(&self) -> bool {
        self.material.is_some_and(|(_, material)| {
            matches!(&material.model, MaterialModel::Physical(m) if m.alpha == AlphaMode::Blend)
        })
    }

    /// Returns the direction to which the side of a face points that camera rays hit. `None` if they
    /// hit both sides. `outward` is the outward normal of the face.
    pub fn visible_normal(&self, outward: DVec3) -> Option<DVec3> {
        match self.object.side {
            SideRule::Both => None,
            SideRule::Outside | SideRule::Culled => Some(outward),
            SideRule::Inside => Some(-outward),
        }
    }

    pub fn emits_light(&self) -> bool {
        self.material.is_some_and(|(_, material)| material.emits())
    }
}

/// A scene with facts that the checks share.
pub(crate) struct SceneFacts<'a> {
    pub scene: &'a Scene,
    pub lookup: SceneLookup<'a>,
    /// The listed objects, followed by one entry for each generator.
    pub objects: Vec<ObjectFacts<'a>>,
    /// Bounding box of all bounded objects, in metres.
    pub bounds: Aabb,
    /// Number of objects before each generator's first object: listed and generated ones.
    first_generated_indices: Vec<u64>,
}

impl<'a> SceneFacts<'a> {
    pub fn new(scene: &'a Scene, bounds: Aabb) -> Self {
        let lookup = SceneLookup::new(scene);
        let listed = scene.objects.iter().map(|object| (object, DVec3::ZERO));
        let generated = scene.generators.iter().map(|generator| {
            let first = generator_offsets(&generator.kind).next();
            (&generator.object, first.unwrap_or_default())
        });
        let mut meshes = BTreeMap::new();
        let opening = scene.cameras.first().map_or(0.0, shutter_opening);
        let mut object_facts = |(index, (object, position)): (usize, (&'a Object, DVec3))| {
            let material = lookup.material(&object.material);
            let matter = material.map_or(SurfaceKind::Opaque, |(_, material)| {
                SurfaceKind::from_material(material)
            });
            let map = DAffine3::from_translation(position) * transform_at(object, opening);
            ObjectFacts {
                object,
                subject: FindingSubject::Object(index),
                material,
                surface_kind: matter,
                object_to_world: map,
                bounds: object_bounds(&lookup, &mut meshes, object, map),
            }
        };
        let objects = listed
            .chain(generated)
            .enumerate()
            .map(&mut object_facts)
            .collect();
        let mut next = scene.objects.len() as u64;
        let start = |kind| {
            let start = next;
            next = next.saturating_add(count_generated_objects(kind));
            start
        };
        let starts = scene
            .generators
            .iter()
            .map(|generator| &generator.kind)
            .map(start)
            .collect();
        Self {
            scene,
            lookup,
            objects,
            bounds,
            first_generated_indices: starts,
        }
    }

    /// Returns the index in `objects` of an object, given its index among all objects. There, each
    /// generated object counts singly.
    pub fn facts_index(&self, object: u32) -> usize {
        let (object, listed) = (object as usize, self.scene.objects.len());
        if object < listed {
            object
        } else {
            listed
                + self
                    .first_generated_indices
                    .partition_point(|&start| start <= object as u64)
                - 1
        }
    }

    /// Returns the mesh of an object, with its index in the scene's list of meshes.
    pub fn mesh_of_object(&self, object: &Object) -> Option<(usize, &'a MeshData)> {
        let Shape::Mesh(name) = &object.shape else {
            return None;
        };
        Some((
            self.lookup.meshes.index_of(name)?,
            self.lookup.mesh_data(name)?,
        ))
    }

    /// Returns the meshes in use with the objects that show them, by the index of the mesh.
    pub fn shown_meshes(&self) -> BTreeMap<usize, (&'a MeshData, Vec<&ObjectFacts<'a>>)> {
        let mut shown: BTreeMap<usize, (&MeshData, Vec<&ObjectFacts<'_>>)> = BTreeMap::new();
        for object_facts in &self.objects {
            if let Some((mesh, data)) = self.mesh_of_object(object_facts.object) {
                shown
                    .entry(mesh)
                    .or_insert_with(|| (data, Vec::new()))
                    .1
                    .push(object_facts);
            }
        }
        shown
    }

    /// Returns the materials in use with their indices, each once, in the order of the scene's
    /// list.
    pub fn used_materials(&self) -> Vec<(usize, &'a Material)> {
        let mut used: Vec<(usize, &Material)> = self
            .objects
            .iter()
            .filter_map(|object_facts| object_facts.material)
            .collect();
        used.sort_by_key(|(index, _)| *index);
        used.dedup_by_key(|(index, _)| *index);
        used
    }

    /// Returns whether the scene has neither objects nor generators.
    pub fn is_empty(&self) -> bool {
        self.objects.is_empty()
    }

    /// Returns the longest edge of the bounding box of all bounded objects, in metres.
    pub fn largest_extent(&self) -> f64 {
        largest_extent(&self.bounds)
    }

    /// Returns the diagonal of the bounding box of all bounded objects, in metres; 0 without any.
    pub fn bounds_diagonal(&self) -> f64 {
        if self.bounds.is_empty() {
            0.0
        } else {
            self.bounds.extent().length()
        }
    }
}

/// Returns the longest edge of a box; 0 for an empty box.
pub(super) fn largest_extent(bounds: &Aabb) -> f64 {
    if bounds.is_empty() {
        0.0
    } else {
        bounds.extent().max_element()
    }
}

/// Returns an object's transform at a time in [0, 1].
fn transform_at(object: &Object, time: f64) -> DAffine3 {
    let motion = object_transforms_at_ends(object).and_then(|ends| Motion::new(ends).ok());
    match motion {
        Some(motion) => motion.map_at(time),
        None => affine_from_steps(&object.transform),
    }
}

/// Returns the bounding box of an object under a transform. Returns `None` if it is unbounded,
/// empty or not finite.
pub(super) fn object_bounds<'a>(
    lookup: &SceneLookup<'a>,
    meshes: &mut BTreeMap<&'a str, Aabb>,
    object: &'a Object,
    map: DAffine3,
) -> Option<Aabb> {
    let bounds = match &object.shape {
        Shape::Mesh(name) => {
            let data = lookup.mesh_data(name)?;
            let around = || Aabb::from_points(data.positions.iter());
            let own_bounds = meshes.entry(name.as_str()).or_insert_with(around);
            (!own_bounds.is_empty()).then(|| transform_bounds(&map, own_bounds))
        }
        shape => match convert_shape::<f64>(shape, map)? {
            (shape, None) => shape.bounds(),
            (shape, Some(map)) => Some(transform_bounds(&map, &shape.bounds()?)),
        },
    };
    bounds.filter(|bounds| bounds.min.is_finite() && bounds.max.is_finite())
}

/// Returns a position as an array, or `None` if it is not finite.
pub(super) fn finite_point(point: DVec3) -> Option<[f64; 3]> {
    point.is_finite().then(|| point.to_array())
}

/// Returns a pseudorandom number in [0, 1), a function of a seed, an index and a dimension.
pub(super) fn unit_random(seed: u64, index: u64, selected: u64) -> f64 {
    let bits = crate::hash::splitmix64(
        seed ^ crate::hash::splitmix64(
            index
                .wrapping_mul(0x9e37_79b9)
                .wrapping_add(crate::hash::splitmix64(selected)),
        ),
    );
    (bits >> 11) as f64 / (1_u64 << 53) as f64
}
