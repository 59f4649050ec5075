//! Flat faces of objects, as polygons in world space.

use std::collections::BTreeMap;

use glam::DVec3;

use super::facts::{ObjectFacts, SceneFacts};
use super::topology::Topology;
use crate::motion::shutter_interval;
use crate::scene::Shape;

/// Number of sides of the polygon that approximates a disk.
const SIDES: u32 = 24;
/// Limits on faces of meshes. `MESH_FACES`: greatest number of triangles of a mesh; larger meshes
/// are left out. `ALL_MESH_FACES`: greatest number of triangles of all meshes together.
const MESH_FACES: usize = 64;
pub(super) const ALL_MESH_FACES: usize = 1 << 18;

/// A flat face in world space.
pub(super) struct FlatFace {
    pub object: usize,
    pub normal: DVec3,
    /// Corners in order. A plane, which has no corners, has a single point of the plane instead.
    pub corners: Vec<DVec3>,
    pub is_endless: bool,
    pub is_sheet: bool,
}

impl FlatFace {
    /// Returns two numbers that coplanar faces have in common. The first depends on the direction
    /// of the normal without its sign, the second is the signed distance of the plane from the
    /// origin.
    pub fn plane_key(&self) -> [f64; 2] {
        // Directions that are no multiples of each other have other products with it, but for rare
        // ones.
        let tilt = self.normal.dot(DVec3::new(0.539_134, 0.617_291, 0.573_008));
        [tilt.abs(), self.normal.dot(self.corners[0]) * tilt.signum()]
    }
}

/// Returns the flat faces of an object that rests while the shutter is open. A mesh has none if it has too many triangles.
/// `room` is the number of triangles that may still be added.
pub(super) fn find_flat_faces(
    object: usize,
    scene_facts: &SceneFacts<'_>,
    topologies: &BTreeMap<usize, Topology>,
    room: &mut usize,
) -> Vec<FlatFace> {
    let object_facts = &scene_facts.objects[object];
    let camera = scene_facts.scene.cameras.first();
    let is_open_for_a_time = camera.is_some_and(|camera| shutter_interval(camera).is_some());
    if object_facts.object.transform_end.is_some() && is_open_for_a_time {
        return Vec::new();
    }
    let found = match object_facts.object.shape {
        Shape::Mesh(_) => mesh_faces(object_facts, scene_facts, topologies, room),
        ref shape => shape_faces(shape),
    };
    let turned = object_facts.object_to_world.matrix3.inverse().transpose();
    let in_world = |face: LocalFace| FlatFace {
        object,
        normal: (turned * face.normal).normalize(),
        corners: face
            .corners
            .iter()
            .map(|&corner| object_facts.object_to_world.transform_point3(corner))
            .collect(),
        is_endless: face.is_endless,
        is_sheet: face.is_sheet,
    };
    let is_finite = |face: &FlatFace| {
        face.normal.is_finite() && face.corners.iter().all(|corner| corner.is_finite())
    };
    found.into_iter().map(in_world).filter(is_finite).collect()
}

/// A flat face in object space.
struct LocalFace {
    normal: DVec3,
    corners: Vec<DVec3>,
    is_endless: bool,
    is_sheet: bool,
}

impl LocalFace {
    fn new(normal: DVec3, corners: &[DVec3], is_sheet: bool) -> Self {
        Self {
            normal,
            corners: corners.to_vec(),
            is_endless: false,
            is_sheet,
        }
    }

    fn from_triangle([a, b, c]: [DVec3; 3], is_sheet: bool) -> Self {
        Self::new((b - a).cross(c - a), &[a, b, c], is_sheet)
    }
}

/// Returns the flat faces of a shape other than a mesh.
fn shape_faces(shape: &Shape) -> Vec<LocalFace> {
    let v = DVec3::from_array;
    match *shape {
        Shape::Plane { point, normal } => vec![LocalFace {
            is_endless: true,
            ..LocalFace::new(v(normal), &[v(point)], true)
        }],
        Shape::Disk {
            centre,
            normal,
            radius,
        } => {
            let (x, y) = v(normal).normalize().any_orthonormal_pair();
            let angle = |i: u32| f64::from(i) / f64::from(SIDES) * core::f64::consts::TAU;
            let corner =
                |i: u32| v(centre) + (x * libm::cos(angle(i)) + y * libm::sin(angle(i))) * radius;
            let corners: Vec<DVec3> = (0..SIDES).map(corner).collect();
            vec![LocalFace::new(v(normal), &corners, true)]
        }
        Shape::Quad {
            corner,
            edge_u,
            edge_v,
        } => {
            let (c, a, b) = (v(corner), v(edge_u), v(edge_v));
            let corners = [c, c + a, c + a + b, c + b];
            vec![LocalFace::new(a.cross(b), &corners, true)]
        }
        Shape::Triangle { vertices } => vec![LocalFace::from_triangle(vertices.map(v), true)],
        Shape::Box { min, max } => (0..6).map(|side| box_side(v(min), v(max), side)).collect(),
        _ => Vec::new(),
    }
}

/// Returns a face of a box. The index is twice the axis, plus 1 for the upper face.
fn box_side(min: DVec3, max: DVec3, index: usize) -> LocalFace {
    let ends = [min, max];
    let (axis, end) = (index / 2, index % 2);
    let corner = |i: usize, j: usize| {
        let mut corner = ends[end];
        (corner[(axis + 1) % 3], corner[(axis + 2) % 3]) =
            (ends[i][(axis + 1) % 3], ends[j][(axis + 2) % 3]);
        corner
    };
    let out = DVec3::AXES[axis] * if end == 1 { 1.0 } else { -1.0 };
    let corners = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
    LocalFace::new(out, &corners, false)
}

/// Returns the triangles of a small mesh as faces, and subtracts their number from `room`. Empty if
/// the mesh is too large or no room is left.
fn mesh_faces(
    object_facts: &ObjectFacts<'_>,
    scene_facts: &SceneFacts<'_>,
    topologies: &BTreeMap<usize, Topology>,
    room: &mut usize,
) -> Vec<LocalFace> {
    let Some((mesh, data)) = scene_facts.mesh_of_object(object_facts.object) else {
        return Vec::new();
    };
    if data.indices.len() > MESH_FACES.min(*room) {
        return Vec::new();
    }
    *room -= data.indices.len();
    let is_sheet = topologies.get(&mesh).is_none_or(|t| !t.is_closed());
    let at = |corner: u32| data.positions.position(corner as usize);
    let face = |corners: &[u32; 3]| LocalFace::from_triangle(corners.map(at), is_sheet);
    data.indices.iter().map(face).collect()
}

/// Returns a face's corners, counter-clockwise about a normal.
pub(super) fn counter_clockwise_corners(face: &FlatFace, normal: DVec3) -> Vec<DVec3> {
    let mut corners = face.corners.clone();
    if signed_double_area(&corners, normal) < 0.0 {
        corners.reverse();
    }
    corners
}

/// Returns twice the area of a polygon, negative if it is clockwise about the normal.
pub(super) fn signed_double_area(corners: &[DVec3], normal: DVec3) -> f64 {
    let first = corners.first().copied().unwrap_or_default();
    corners
        .windows(2)
        .map(|pair| (pair[0] - first).cross(pair[1] - first).dot(normal))
        .sum()
}

/// Clips a convex polygon by the edges of another convex polygon ("Reentrant Polygon Clipping",
/// Sutherland, Hodgman 1974).
pub(super) fn clip_polygon(mut corners: Vec<DVec3>, by: &[DVec3], normal: DVec3) -> Vec<DVec3> {
    for (i, &from) in by.iter().enumerate() {
        let inwards = normal.cross(by[(i + 1) % by.len()] - from);
        let inside = |corner: DVec3| inwards.dot(corner - from);
        let mut kept = Vec::with_capacity(corners.len() + 1);
        for (j, &corner) in corners.iter().enumerate() {
            let next = corners[(j + 1) % corners.len()];
            let (here, there) = (inside(corner), inside(next));
            if here >= 0.0 {
                kept.push(corner);
            }
            if (here > 0.0 && there < 0.0) || (here < 0.0 && there > 0.0) {
                kept.push(corner + (next - corner) * (here / (here - there)));
            }
        }
        corners = kept;
    }
    corners
}
