//! Facts about a scene that the checks share: its objects with their materials, bounds and surface
//! kinds, its cameras, and what rays hit.

use raywright_bvh::shapes::transform_bounds;
use raywright_bvh::{Geometry, Motion, Shape as _};

use super::cameras::nearest_to_camera;
use super::duplicates::DuplicateObjects;
use super::*;
use crate::affine::affine_from_steps;
use crate::generate::{count_generated_objects, generator_offsets};
use crate::lookup::SceneLookup;
use crate::motion::{object_transforms_at_ends, shutter_opening};
use crate::scene::{AlphaMode, GeneratorKind, Object};
use crate::shape::convert_shape;
use crate::topology::Topology;

/// Greatest number of surfaces that a ray is followed through. A ray that passes as many counts as
/// unblocked.
pub(super) const HITS: usize = 64;

/// How light passes a surface, by its material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum SurfaceKind {
    /// Light is absorbed or reflected.
    Opaque,
    /// The surface bounds a body that light passes through. It has to be closed.
    Body,
    /// Light passes straight through: a thin wall, or a partly transparent (blended) surface.
    Veil,
}

impl SurfaceKind {
    fn from_material(material: &Material) -> Self {
        let is_body = match &material.model {
            MaterialModel::Physical(m) if m.alpha == AlphaMode::Blend => return Self::Veil,
            MaterialModel::Physical(m) if m.may_transmit() && m.thin_walled => return Self::Veil,
            MaterialModel::Physical(m) => m.may_transmit(),
            MaterialModel::Classic(m) => {
                let mixture = m.mixture.as_ref();
                m.transmission.is_some() || mixture.is_some_and(|m| m.refraction_chance > 0.0)
            }
        };
        if is_body { Self::Body } else { Self::Opaque }
    }
}

/// An object of the scene's list, or a generator as a whole.
#[derive(Clone, Copy, Debug)]
pub(super) struct ObjectFacts<'a> {
    /// Index in `SceneFacts::objects`.
    pub index: usize,
    pub object: &'a Object,
    /// The material, with its index in the scene's list.
    pub material: Option<(usize, &'a Material)>,
    surface_kind: SurfaceKind,
    /// Transform from object to world space when the first camera's shutter opens. Of a generator's
    /// copies, the one that is nearest to a camera, and in view if one is, stands for all.
    pub object_to_world: DAffine3,
    /// Offset of that copy; zero for a listed object.
    pub offset: DVec3,
    /// World-space bounding box. `None` if unbounded.
    pub bounds: Option<Aabb>,
    /// The mesh, with its index in the scene's list.
    pub mesh: Option<(usize, &'a MeshData)>,
}

impl ObjectFacts<'_> {
    pub fn subject(&self) -> Subject {
        Subject::Object(self.index)
    }

    /// Returns the centre of the bounding box.
    pub fn centre(&self) -> Option<DVec3> {
        Some(self.bounds?.centre())
    }

    pub fn is_body(&self) -> bool {
        self.surface_kind == SurfaceKind::Body
    }

    pub fn is_opaque(&self) -> bool {
        self.surface_kind == SurfaceKind::Opaque
    }

    /// Returns whether the object is a plane or a cylinder without end.
    pub fn is_endless(&self) -> bool {
        matches!(
            self.object.shape,
            Shape::Plane { .. } | Shape::Cylinder { height: None, .. }
        )
    }

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

    /// Returns whether the material is a physical one.
    pub fn is_physical(&self) -> bool {
        self.material
            .is_some_and(|(_, material)| matches!(material.model, MaterialModel::Physical(_)))
    }

    pub fn emits_light(&self) -> bool {
        self.material.is_some_and(|(_, material)| material.emits())
    }
}

/// A scene with facts that the checks share.
pub(super) struct SceneFacts<'a> {
    pub scene: &'a Scene,
    pub settings: &'a Settings,
    pub lookup: SceneLookup<'a>,
    /// The listed objects, followed by one entry for each generator.
    pub objects: Vec<ObjectFacts<'a>>,
    /// Bounding box of all bounded objects, in metres.
    pub bounds: Aabb,
    /// The cameras that are checked.
    pub views: Vec<CameraView>,
    /// Connectivity of each mesh in use, by the index of the mesh.
    pub topologies: BTreeMap<usize, Topology>,
    pub duplicates: DuplicateObjects,
    /// Number of objects before each generator's first object: listed and generated ones.
    first_generated_indices: Vec<u64>,
}

impl<'a> SceneFacts<'a> {
    /// Collects the facts that need no other facts. Topologies and duplicates are empty.
    pub fn new(scene: &'a Scene, settings: &'a Settings, bounds: Aabb) -> Self {
        let lookup = SceneLookup::new(scene);
        let opening = scene.cameras.first().map_or(0.0, shutter_opening);
        let views = CameraView::list(scene, settings);
        let listed = scene.objects.iter().map(|object| (object, None));
        let generators = scene.generators.iter();
        let generated = generators.map(|generator| (&generator.object, Some(&generator.kind)));
        let mut mesh_bounds = HashMap::new();
        let all = listed.chain(generated).enumerate();
        let objects = all.map(|(index, (object, generator))| {
            let material = lookup.material(&object.material);
            let mesh = lookup.mesh_index(&object.shape);
            let own = object_transforms_at_ends(object).and_then(|ends| Motion::new(ends).ok());
            let own = own.map_or_else(
                || affine_from_steps(&object.transform),
                |motion| motion.map_at(opening),
            );
            let mut facts = ObjectFacts {
                index,
                object,
                material,
                surface_kind: material.map_or(SurfaceKind::Opaque, |(_, material)| {
                    SurfaceKind::from_material(material)
                }),
                object_to_world: own,
                offset: DVec3::ZERO,
                bounds: None,
                mesh: mesh
                    .and_then(|mesh| Some((mesh, &**lookup.mesh_data(&scene.meshes[mesh].name)?))),
            };
            facts.bounds = object_bounds(&facts, own, &mut mesh_bounds);
            if let Some(kind) = generator {
                let centre = facts.centre().unwrap_or(own.translation);
                let copies = generator_offsets(kind).map(|offset| (offset, centre + offset));
                let nearest = nearest_to_camera(&views, copies);
                facts.offset = nearest.map_or(DVec3::ZERO, |(offset, _)| offset);
                facts.object_to_world = DAffine3::from_translation(facts.offset) * own;
                facts.bounds = object_bounds(&facts, facts.object_to_world, &mut mesh_bounds);
            }
            facts
        });
        let objects = objects.collect();
        let mut next = scene.objects.len() as u64;
        let starts = scene.generators.iter().map(|generator| {
            let start = next;
            next = next.saturating_add(count_generated_objects(&generator.kind));
            start
        });
        Self {
            scene,
            settings,
            lookup,
            objects,
            bounds,
            views,
            topologies: BTreeMap::new(),
            duplicates: DuplicateObjects::default(),
            first_generated_indices: starts.collect(),
        }
    }

    /// Returns the index in `objects` of an object, given its index among all objects. There, each
    /// generated object counts singly.
    pub fn facts_index(&self, object: u32) -> usize {
        let (object, listed) = (object as usize, self.scene.objects.len());
        match object < listed {
            true => object,
            false => {
                let starts = &self.first_generated_indices;
                listed + starts.partition_point(|&start| start <= object as u64) - 1
            }
        }
    }

    /// Returns a pair of objects, given their indices among all objects, in the order of the scene.
    pub fn sorted_pair(&self, pair: [usize; 2]) -> [usize; 2] {
        let [a, b] = pair.map(|object| self.facts_index(object as u32));
        [a.min(b), a.max(b)]
    }

    /// Returns the object that a ray hit.
    pub fn object_of_hit<R: Real>(&self, hit: &Hit<R>) -> &ObjectFacts<'a> {
        &self.objects[self.facts_index(hit.outermost_id())]
    }

    pub fn name(&self, subject: Subject) -> String {
        subject.display_name(self.scene)
    }

    pub fn object_name(&self, object: usize) -> String {
        self.name(Subject::Object(object))
    }

    /// Returns the connectivity of an object's mesh.
    pub fn topology(&self, object: &ObjectFacts<'_>) -> Option<&Topology> {
        self.topologies.get(&object.mesh?.0)
    }

    /// Returns the generator of an object, or `None` for a listed object.
    pub fn generator(&self, object: usize) -> Option<&'a GeneratorKind> {
        let generator = object.checked_sub(self.scene.objects.len())?;
        Some(&self.scene.generators[generator].kind)
    }

    /// Returns the meshes in use with the objects that show them, by the index of the mesh.
    pub fn shown_meshes(&self) -> BTreeMap<usize, (&'a MeshData, Vec<&ObjectFacts<'a>>)> {
        let mut shown = BTreeMap::new();
        for object in &self.objects {
            if let Some((mesh, data)) = object.mesh {
                let (_, objects) = shown.entry(mesh).or_insert((data, Vec::new()));
                objects.push(object);
            }
        }
        shown
    }

    /// Returns the materials in use with their indices, each once, in the order of the scene's
    /// list.
    pub fn used_materials(&self) -> BTreeMap<usize, &'a Material> {
        let objects = self.objects.iter();
        objects.filter_map(|object| object.material).collect()
    }

    /// Returns the longest edge of the bounding box of all bounded objects, in metres.
    pub fn largest_extent(&self) -> f64 {
        self.extent().max_element()
    }

    /// Returns the diagonal of the bounding box of all bounded objects, in metres; 0 without any.
    pub fn diagonal(&self) -> f64 {
        self.extent().length()
    }

    fn extent(&self) -> DVec3 {
        match self.bounds.is_empty() {
            true => DVec3::ZERO,
            false => self.bounds.extent(),
        }
    }

    /// Returns the surfaces that each ray in world space hits, as far as the first opaque one.
    pub fn trace(&self, ready: &ReadyScene, rays: Vec<Ray<f64>>) -> Vec<Vec<RayHit>> {
        ready.run_task(&HitTask { facts: self, rays })
    }
}

/// Returns the bounding box of an object under a transform. Returns `None` if it is unbounded,
/// empty or not finite. `meshes` holds the boxes of meshes in their own space.
pub(super) fn object_bounds(
    object: &ObjectFacts<'_>,
    map: DAffine3,
    meshes: &mut HashMap<usize, Aabb>,
) -> Option<Aabb> {
    let bounds = match (object.mesh, &object.object.shape) {
        (Some((mesh, data)), _) => {
            let around = || Aabb::from_points(data.positions.iter());
            let own = meshes.entry(mesh).or_insert_with(around);
            (!own.is_empty()).then(|| transform_bounds(&map, own))
        }
        (None, shape) => match convert_shape::<f64>(shape, map)? {
            (shape, None) => shape.bounds(),
            (shape, Some(map)) => Some(transform_bounds(&map, &shape.bounds()?)),
        },
    };
    bounds.filter(|bounds| bounds.min.is_finite() && bounds.max.is_finite())
}

/// A surface that a ray hits, with its outward normal.
#[derive(Clone, Copy, Debug)]
pub(super) struct RayHit {
    pub object: usize,
    pub distance: f64,
    pub position: DVec3,
    pub normal: DVec3,
}

struct HitTask<'a> {
    facts: &'a SceneFacts<'a>,
    rays: Vec<Ray<f64>>,
}

impl PreparedSceneTask for HitTask<'_> {
    type Output = Vec<Vec<RayHit>>;

    fn run<R: Real>(&self, prepared: &PreparedScene<R>) -> Self::Output {
        let trace = |ray: &Ray<f64>| {
            let ray = stored_ray(prepared, ray.origin, ray.direction).as_camera_ray();
            let mut found = Vec::new();
            for hit in hits_along_ray(&prepared.geometry, &ray, Interval::positive()).take(HITS) {
                let surface = prepared.geometry.surface(&ray, &hit);
                let object = self.facts.object_of_hit(&hit);
                found.push(RayHit {
                    object: object.index,
                    distance: hit.t.to_f64(),
                    position: prepared.to_world(surface.point),
                    normal: surface.normal.to_f64(),
                });
                if object.is_opaque() {
                    break;
                }
            }
            found
        };
        self.rays.par_iter().map(trace).collect()
    }
}

/// Returns a ray in the coordinates of a prepared scene.
pub(super) fn stored_ray<R: Real>(
    prepared: &PreparedScene<R>,
    from: DVec3,
    direction: DVec3,
) -> Ray<R> {
    let [from, direction] = [from - prepared.origin.origin, direction].map(R::Vec3::from_f64);
    Ray::new(from, direction)
}

/// Returns the hits of a ray within a range, by distance. Of several hits at the same distance a
/// single one is returned.
pub(super) fn hits_along_ray<'a, R: Real>(
    geometry: &'a Geometry<R>,
    ray: &'a Ray<R>,
    mut range: Interval<R>,
) -> impl Iterator<Item = Hit<R>> + use<'a, R> {
    core::iter::from_fn(move || {
        let hit = geometry.closest(ray, range, &mut ())?;
        range.min = hit.t;
        Some(hit)
    })
}

/// Returns a pseudorandom number in [0, 1), a function of a seed, an index and a dimension.
pub(super) fn unit_random(seed: u64, index: u64, dimension: u64) -> f64 {
    use crate::hash::splitmix64;
    let index = index.wrapping_mul(0x9e37_79b9);
    let bits = splitmix64(seed ^ splitmix64(index.wrapping_add(splitmix64(dimension))));
    (bits >> 11) as f64 / (1_u64 << 53) as f64
}
