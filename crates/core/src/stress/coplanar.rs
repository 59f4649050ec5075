//! Flat surfaces of two objects in one plane, one over the other: which of them is seen there is no
//! matter of distance.
//!
//! Sorted by their planes, and in each plane along an axis, so that of many faces only neighbours
//! are compared.

use std::collections::BTreeMap;

use glam::DVec3;
use raywright_bvh::Aabb;

use super::cameras::CameraView;
use super::faces::{
    ALL_MESH_FACES, FlatFace, clip_polygon, counter_clockwise_corners, find_flat_faces,
    signed_double_area,
};
use super::facts::SceneFacts;
use super::topology::Topology;
use crate::settings::PrecisionChoice;

/// Normals that differ by less are parallel.
const PARALLEL: f64 = 1e-9;
/// How many roundings apart surfaces have to be to be told apart.
const ROUNDINGS: f64 = 4.0;
/// Share of the greatest coordinate below which two planes are one in doubles too.
const ONE_PLANE: f64 = 1e-12;
/// Overlaps of which account is kept; a pile of sheets has one for each two.
const MOST: usize = 4096;
/// Pairs of faces that are compared. Faces that all lie beside each other have half the square of
/// their number.
const MOST_PAIRS: usize = 1 << 24;

/// Two objects with a face each in one plane, and where both are.
#[derive(Clone, Debug)]
pub(super) struct CoplanarOverlap {
    pub objects: [usize; 2],
    /// Whether no body is among them, whose face may be hidden by what it stands on.
    pub are_sheets: bool,
    normal: DVec3,
    /// Convex, counter-clockwise about the normal; empty where both have no end.
    outline: Vec<DVec3>,
    pub position: DVec3,
    /// How far apart they are there at most, in metres.
    pub gap: f64,
    tolerance: f64,
}

/// What a precision tells apart in the pictures of some cameras.
pub(super) struct DepthResolution<'a> {
    pub precision: PrecisionChoice,
    views: &'a [CameraView],
    /// How far in front of each camera's eye its rays start, in metres.
    skipped: Vec<f64>,
}

impl<'a> DepthResolution<'a> {
    pub fn new(precision: PrecisionChoice, views: &'a [CameraView], bounds: &Aabb) -> Self {
        let skipped = |view: &CameraView| match precision {
            PrecisionChoice::Robust => view.skipped_distance::<f32>(bounds),
            PrecisionChoice::Reference => view.skipped_distance::<f64>(bounds),
        };
        Self {
            precision,
            views,
            skipped: views.iter().map(skipped).collect(),
        }
    }

    /// The cameras, each with the length of a ray of it to a place, in metres.
    fn ray_lengths(&self, position: DVec3) -> impl Iterator<Item = (&CameraView, f64)> {
        let length = move |(view, skipped): (&'a CameraView, &f64)| {
            (view, (view.distance_from_eye(position) - skipped).abs())
        };
        self.views.iter().zip(&self.skipped).map(length)
    }

    fn unit_roundoff(&self) -> f64 {
        0.5 * match self.precision {
            PrecisionChoice::Robust => f64::from(f32::EPSILON),
            PrecisionChoice::Reference => f64::EPSILON,
        }
    }

    /// How far surfaces have to be apart at a place, in metres: a ray's way there is rounded, and
    /// so is the place itself.
    pub fn min_separation_at(&self, position: DVec3) -> f64 {
        let in_view = self
            .ray_lengths(position)
            .filter(|(view, _)| view.project_point(position).is_some());
        let farthest = in_view.map(|(_, length)| length).fold(0.0, f64::max);
        ROUNDINGS * self.unit_roundoff() * (position.abs().max_element() + farthest)
    }
}

impl CoplanarOverlap {
    /// Whether a point with this normal, or the opposite one, is where both are.
    fn contains_surface_point(&self, point: DVec3, normal: DVec3) -> bool {
        let within = |i: usize| {
            let (from, to) = (self.outline[i], self.outline[(i + 1) % self.outline.len()]);
            self.normal.cross(to - from).dot(point - from) >= 0.0
        };
        normal.dot(self.normal).abs() > 0.999
            && (point - self.position).dot(self.normal).abs() <= 16.0 * self.tolerance
            && (0..self.outline.len()).all(within)
    }
}

/// All overlaps of a scene, and those of each object.
#[derive(Clone, Debug, Default)]
pub(super) struct OverlapTable {
    pub list: Vec<CoplanarOverlap>,
    of: BTreeMap<usize, Vec<usize>>,
    /// Pairs that were compared.
    pairs: usize,
}

impl OverlapTable {
    /// The other objects that are where this one is seen.
    pub fn overlapping_objects(
        &self,
        object: usize,
        point: DVec3,
        normal: DVec3,
    ) -> impl Iterator<Item = usize> {
        let own = self
            .of
            .get(&object)
            .into_iter()
            .flatten()
            .map(|&index| &self.list[index]);
        own.filter(move |overlap| overlap.contains_surface_point(point, normal))
            .map(move |overlap| {
                let [a, b] = overlap.objects;
                if a == object { b } else { a }
            })
    }
}

/// Finds what lies in one plane and overlaps there, of objects of different materials.
pub(super) fn find_overlaps(
    scene_facts: &SceneFacts<'_>,
    topologies: &BTreeMap<usize, Topology>,
    resolution: &DepthResolution<'_>,
) -> OverlapTable {
    let mut room = ALL_MESH_FACES;
    let mut all: Vec<FlatFace> = (0..scene_facts.scene.objects.len())
        .flat_map(|object| find_flat_faces(object, scene_facts, topologies, &mut room))
        .collect();
    let reach = all
        .iter()
        .flat_map(|face| &face.corners)
        .fold(0.0_f64, |maximum, corner| {
            maximum.max(corner.abs().max_element())
        });
    let way = resolution
        .ray_lengths(DVec3::ZERO)
        .map(|(_, length)| length)
        .fold(reach, f64::max);
    let tolerance = (reach * ONE_PLANE).max(ROUNDINGS * resolution.unit_roundoff() * way);
    all.sort_by(|a, b| a.plane_key()[0].total_cmp(&b.plane_key()[0]));
    let mut found = OverlapTable::default();
    for parallel in all.chunk_by_mut(|a, b| b.plane_key()[0] - a.plane_key()[0] <= PARALLEL) {
        parallel.sort_by(|a, b| a.plane_key()[1].total_cmp(&b.plane_key()[1]));
        for plane in parallel.chunk_by_mut(|a, b| b.plane_key()[1] - a.plane_key()[1] <= tolerance)
        {
            find_overlaps_in_plane(scene_facts, plane, tolerance, &mut found);
        }
    }
    for (index, overlap) in found.list.iter().enumerate() {
        for object in overlap.objects {
            found.of.entry(object).or_default().push(index);
        }
    }
    found
}

/// Compares the faces of a plane that are beside each other along the axis in which they reach
/// furthest.
fn find_overlaps_in_plane(
    scene_facts: &SceneFacts<'_>,
    faces: &mut [FlatFace],
    tolerance: f64,
    found: &mut OverlapTable,
) {
    let reach = |axis: usize| {
        let along = faces
            .iter()
            .flat_map(|face| &face.corners)
            .map(|corner| corner[axis]);
        let [low, high] = along.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
            [low.min(x), high.max(x)]
        });
        high - low
    };
    let axis = (0..3)
        .max_by(|&a, &b| reach(a).total_cmp(&reach(b)))
        .unwrap_or(0);
    let ends = |face: &FlatFace| {
        let along = face.corners.iter().map(|corner| corner[axis]);
        let ends = along.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
            [low.min(x), high.max(x)]
        });
        if face.is_endless {
            [f64::NEG_INFINITY, f64::INFINITY]
        } else {
            ends
        }
    };
    faces.sort_by(|a, b| ends(a)[0].total_cmp(&ends(b)[0]));
    let mut open: Vec<&FlatFace> = Vec::new();
    for face in &*faces {
        open.retain(|other| ends(other)[1] > ends(face)[0]);
        for other in &open {
            found.pairs += 1;
            if found.list.len() >= MOST || found.pairs > MOST_PAIRS {
                return;
            }
            found
                .list
                .extend(overlap_of_faces(scene_facts, other, face, tolerance));
        }
        open.push(face);
    }
}

/// What two faces have in common.
fn overlap_of_faces(
    scene_facts: &SceneFacts<'_>,
    a: &FlatFace,
    b: &FlatFace,
    tolerance: f64,
) -> Option<CoplanarOverlap> {
    let material = |face: &FlatFace| &scene_facts.objects[face.object].object.material;
    // Bodies back to back touch.
    let touch = !a.is_sheet && !b.is_sheet && a.normal.dot(b.normal) < 0.0;
    if a.object == b.object
        || material(a) == material(b)
        || touch
        || a.normal.cross(b.normal).length() > PARALLEL
    {
        return None;
    }
    let (bounded, other) = if a.is_endless { (b, a) } else { (a, b) };
    let apart = |corner: &DVec3| (*corner - other.corners[0]).dot(other.normal).abs();
    if bounded
        .corners
        .iter()
        .any(|corner| apart(corner) > tolerance)
    {
        return None;
    }
    let normal = bounded.normal;
    let mut outline = counter_clockwise_corners(bounded, normal);
    if !bounded.is_endless && !other.is_endless {
        let whole = signed_double_area(&outline, normal).min(signed_double_area(
            &counter_clockwise_corners(other, normal),
            normal,
        ));
        outline = clip_polygon(outline, &counter_clockwise_corners(other, normal), normal);
        if signed_double_area(&outline, normal) <= 1e-6 * whole {
            return None;
        }
    }
    let position = outline.iter().sum::<DVec3>() / outline.len() as f64;
    // What rounding makes of corners is no gap.
    let reach = outline.iter().fold(0.0_f64, |maximum, corner| {
        maximum.max(corner.abs().max_element())
    });
    let gap = outline.iter().map(apart).fold(0.0, f64::max);
    let gap = if gap > ONE_PLANE * reach { gap } else { 0.0 };
    let outline = if bounded.is_endless {
        Vec::new()
    } else {
        outline
    };
    let objects = [a.object.min(b.object), a.object.max(b.object)];
    Some(CoplanarOverlap {
        objects,
        are_sheets: a.is_sheet && b.is_sheet,
        normal,
        outline,
        position,
        gap,
        tolerance,
    })
}
