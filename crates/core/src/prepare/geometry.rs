//! Objects become primitives: shapes as they are, meshes used once as triangles of the scene's own set, meshes used more
//! often as instances of one shared geometry, generators as the objects they stand for.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3};
use raywright_bvh::shapes::{
    AnyShape, Cone, Cuboid, Cylinder, Disk, Ellipsoid, Hyperboloid, Paraboloid, Plane, Quad, Sphere, Torus, Triangle,
};
use raywright_bvh::{AcceleratorKind, Geometry, Group, Precision, Real, Side, Vec3Of, Vector, Visibility};

use super::uses::Uses;
use super::{PrepareError, go_on};
use crate::generate::{Shown, all};
use crate::lookup::Lookup;
use crate::observer::Observer;
use crate::scene::{MeshData, Object, Scene, Shape, SideRule, Triple};
use crate::validate::collapses;

/// What shading needs of an object.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ObjectRecord<R: Real> {
    pub material: u32,
    pub face_viewer: bool,
    /// Whether the material reads the texture coordinates of a shape.
    pub coordinates: bool,
    pub mesh: Option<MeshUse<R>>,
}

/// How an object shows its mesh.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MeshUse<R: Real> {
    /// Its place in the table of meshes.
    pub mesh: u32,
    /// Id of its first triangle in the scene's own set; zero for an instance, whose triangles count from zero.
    pub first: u32,
    /// Columns of the inverse transpose: object normals to world normals, not normalised.
    pub normals: [R::Vec3; 3],
    /// The triangles were turned over because the transform mirrors.
    pub flipped: bool,
    /// Sets of texture coordinates besides the first that the material reads, a bit each: none for most, and then none is
    /// interpolated.
    pub further_sets: u8,
}

pub(crate) struct Built<P: Precision> {
    pub geometry: Geometry<P>,
    /// The meshes that objects show, each once; the scene's own, because arrays are not copied.
    pub meshes: Vec<Arc<MeshData>>,
    pub objects: Vec<ObjectRecord<P::Real>>,
    pub object_of: Vec<u32>,
    pub bytes: usize,
}

pub(super) fn side_of(rule: SideRule) -> Side {
    match rule {
        SideRule::Both => Side::Both,
        SideRule::Outside => Side::Outside,
        SideRule::Inside => Side::Inside,
    }
}

fn visibility(object: &Object) -> Visibility {
    Visibility { side: side_of(object.side), casts_shadow: object.casts_shadow }
}

/// Objects between two questions to the observer, or this many times 64 triangles: milliseconds of work.
pub(super) const BLOCK: usize = 1 << 10;

/// Builds everything that can be hit.
pub(crate) fn build<P: Precision>(
    scene: &Scene,
    lookup: &Lookup<'_>,
    kind: AcceleratorKind,
    observer: &dyn Observer,
) -> Result<Built<P>, PrepareError> {
    let mut builder = Builder::<P>::new(scene, lookup, kind, observer);
    for (index, shown) in all(scene).enumerate() {
        if index.is_multiple_of(BLOCK) {
            go_on(observer)?;
        }
        let (material, _) = lookup.material(&shown.object.material).ok_or_else(|| PrepareError::Missing {
            path: format!("objects[{index}].material"),
            kind: "material",
            name: shown.object.material.clone(),
        })?;
        builder.add(index, &shown, material as u32)?;
    }
    go_on(observer)?;
    let geometry = Geometry::new(builder.group, kind);
    let bytes = geometry.bytes() + builder.instanced.values().sum::<usize>();
    Ok(Built { geometry, meshes: builder.meshes, objects: builder.records, object_of: builder.object_of, bytes })
}

struct Builder<'a, P: Precision> {
    kind: AcceleratorKind,
    lookup: &'a Lookup<'a>,
    uses: Uses<'a>,
    group: Group<P>,
    shared: HashMap<(&'a str, SideRule), Arc<Geometry<P>>>,
    /// Bytes of each geometry that instances show, by its address: what is there, not what was meant to be shared.
    instanced: HashMap<*const Geometry<P>, usize>,
    meshes: Vec<Arc<MeshData>>,
    /// Where each mesh is in the table of meshes.
    places: HashMap<&'a str, u32>,
    records: Vec<ObjectRecord<P::Real>>,
    object_of: Vec<u32>,
    observer: &'a dyn Observer,
}

impl<'a, P: Precision> Builder<'a, P> {
    fn new(scene: &'a Scene, lookup: &'a Lookup<'a>, kind: AcceleratorKind, observer: &'a dyn Observer) -> Self {
        Self {
            kind,
            lookup,
            uses: Uses::of(scene),
            group: Group::default(),
            shared: HashMap::new(),
            instanced: HashMap::new(),
            meshes: Vec::new(),
            places: HashMap::new(),
            records: Vec::new(),
            object_of: Vec::new(),
            observer,
        }
    }

    fn add(&mut self, index: usize, shown: &Shown<'a>, material: u32) -> Result<(), PrepareError> {
        let object = shown.object;
        let mesh = match &object.shape {
            Shape::Mesh(name) => Some(self.mesh(index, shown, name)?),
            shape => {
                self.shape(index, shape, shown)?;
                None
            }
        };
        self.object_of.resize(self.group.len(), index as u32);
        self.records.push(ObjectRecord { material, face_viewer: object.face_viewer, coordinates: false, mesh });
        Ok(())
    }

    fn mesh(&mut self, index: usize, shown: &Shown<'a>, name: &'a str) -> Result<MeshUse<P::Real>, PrepareError> {
        let missing =
            || PrepareError::Missing { path: format!("objects[{index}].shape.mesh"), kind: "mesh", name: name.to_owned() };
        let data = self.lookup.mesh_data(name).ok_or_else(missing)?;
        let mesh = *self.places.entry(name).or_insert_with(|| {
            self.meshes.push(Arc::clone(data));
            self.meshes.len() as u32 - 1
        });
        let refused = |source| PrepareError::Geometry { object: index, source };
        let (object, map) = (shown.object, shown.map());
        let mut first = self.group.len() as u32;
        let mut flipped = false;
        let key = (name, object.side);
        if self.uses.share(name, object.side) {
            let shared = match self.shared.get(&key) {
                Some(shared) => Arc::clone(shared),
                None => {
                    let mut group = Group::default();
                    let shown = Visibility { casts_shadow: true, ..visibility(object) };
                    triangles(&mut group, index, data, None, shown, self.observer)?;
                    go_on(self.observer)?;
                    let shared = Arc::new(Geometry::new(group, self.kind));
                    self.shared.insert(key, Arc::clone(&shared));
                    shared
                }
            };
            self.instanced.entry(Arc::as_ptr(&shared)).or_insert_with(|| shared.bytes());
            self.group.instance(shared, map, visibility(object)).map_err(refused)?;
            first = 0;
        } else {
            flipped = map.matrix3.determinant() < 0.0;
            triangles(&mut self.group, index, data, Some((map, flipped)), visibility(object), self.observer)?;
        }
        let inverse_transpose = map.matrix3.inverse().transpose();
        let columns = [inverse_transpose.x_axis, inverse_transpose.y_axis, inverse_transpose.z_axis];
        Ok(MeshUse { mesh, first, normals: columns.map(Vector::from_f64), flipped, further_sets: 0 })
    }
}

/// Adds the triangles of an object's mesh, mapped where a map is given; a mirroring map turns them over so that outside stays
/// outside.
///
/// # Errors
/// Triangles that the geometry refuses, and [`PrepareError::Cancelled`].
pub(super) fn triangles<P: Precision>(
    group: &mut Group<P>,
    object: usize,
    data: &MeshData,
    map: Option<(DAffine3, bool)>,
    visibility: Visibility,
    observer: &dyn Observer,
) -> Result<(), PrepareError> {
    let position = |i: u32| -> Vec3Of<P> {
        let p = DVec3::from(data.positions[i as usize].map(f64::from));
        Vector::from_f64(map.map_or(p, |(m, _)| m.transform_point3(p)))
    };
    let refused = |source| PrepareError::Geometry { object, source };
    for block in data.indices.chunks(64 * BLOCK) {
        go_on(observer)?;
        for &[a, b, c] in block {
            let (b, c) = if map.is_some_and(|(_, flipped)| flipped) { (c, b) } else { (b, c) };
            group.triangle([position(a), position(b), position(c)], visibility).map_err(refused)?;
        }
    }
    Ok(())
}

impl<P: Precision> Builder<'_, P> {
    /// Adds a shape. A pure translation is taken into the shape's own numbers where that is exact in f64, so that what a
    /// generator scatters costs no transform.
    ///
    /// # Errors
    /// A shape of which storing leaves nothing, or that the geometry refuses.
    fn shape(&mut self, index: usize, shape: &Shape, shown: &Shown<'_>) -> Result<(), PrepareError> {
        let (map, visibility) = (shown.map(), visibility(shown.object));
        let moved_only = map.matrix3 == DMat3::IDENTITY;
        let offset = if moved_only { map.translation } else { DVec3::ZERO };
        if collapses(shape, offset, |x| P::Real::from_f64(x).to_f64()) {
            return Err(PrepareError::Collapsed { object: index });
        }
        let Some(shape) = any_shape(shape, offset) else { return Ok(()) };
        let added = if moved_only { self.group.shape(shape, visibility) } else { self.group.placed(shape, map, visibility) };
        added.map(drop).map_err(|source| PrepareError::Geometry { object: index, source })
    }
}

/// A shape of the scene, moved by an offset, in a precision's scalar; none for a mesh, which is many.
pub(super) fn any_shape<R: Real>(shape: &Shape, offset: DVec3) -> Option<AnyShape<R>> {
    let at = |p: Triple| DVec3::from(p) + offset;
    let v = |p: Triple| DVec3::from(p);
    Some(match *shape {
        Shape::Sphere { centre, radius } => {
            AnyShape::Sphere(Sphere { centre: Vector::from_f64(at(centre)), radius: R::from_f64(radius) })
        }
        Shape::Plane { point, normal } => {
            AnyShape::Plane(Plane::new(Vector::from_f64(at(point)), Vector::from_f64(v(normal).normalize())))
        }
        Shape::Disk { centre, normal, radius } => AnyShape::Disk(Disk::new(at(centre), v(normal), radius)),
        Shape::Quad { corner, edge_u, edge_v } => AnyShape::Quad(Quad::new(at(corner), v(edge_u), v(edge_v))),
        Shape::Box { min, max } => AnyShape::Cuboid(Cuboid::new(at(min), at(max))),
        Shape::Cylinder { base, axis, radius, height, caps } => {
            AnyShape::Cylinder(Cylinder::new(at(base), v(axis), radius, height, caps))
        }
        Shape::Cone { base, axis, radius, top_radius, height } => {
            AnyShape::Cone(Cone::new(at(base), v(axis), radius, top_radius, height))
        }
        Shape::Ellipsoid { centre, semi_axes } => AnyShape::Ellipsoid(Ellipsoid::new(at(centre), v(semi_axes))),
        Shape::Hyperboloid { centre, waist_radius, c, half_height } => {
            AnyShape::Hyperboloid(Hyperboloid::new(at(centre), waist_radius, c, half_height))
        }
        Shape::Paraboloid { apex, radius, height } => AnyShape::Paraboloid(Paraboloid::new(at(apex), radius, height)),
        Shape::Torus { centre, axis, major_radius, minor_radius } => {
            AnyShape::Torus(Torus::new(at(centre), v(axis), major_radius, minor_radius))
        }
        Shape::Triangle { vertices } => AnyShape::Triangle(Triangle::new(vertices.map(|p| Vector::from_f64(at(p))))),
        Shape::Mesh(_) => return None,
    })
}

#[cfg(test)]
pub(super) mod tests;
