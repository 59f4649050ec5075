//! Overlapping flat faces of two objects in one plane. Their distances along a ray are equal, so
//! that depth does not determine the visible face.
//!
//! Faces are sorted by plane, and within a plane along an axis. Only faces that overlap on this
//! axis are compared.

use std::collections::BTreeMap;

use glam::DVec3;
use raywright_bvh::Aabb;

use super::cameras::CameraView;
use super::faces::{
    ALL_MESH_FACES, FlatFace, clip_polygon, counter_clockwise_corners, find_flat_faces,
    signed_double_area,
};
use super::facts::{ObjectFacts, SceneFacts, SurfaceKind};
use super::overlap_table::{CoplanarOverlap, OverlapTable};
use super::topology::Topology;
use crate::settings::PrecisionChoice;

/// Two normals are parallel if the length of their cross product, or the difference of their keys,
/// is at most this.
const PARALLEL: f64 = 1e-9;
/// Least separation of distinguishable surfaces, in units of the rounding error.
const ROUNDINGS: f64 = 4.0;
/// Two planes are equal even in double precision if their separation, as a share of the greatest
/// coordinate, is below this.
const ONE_PLANE: f64 = 1e-12;
/// Greatest number of overlaps that are recorded, besides glass that stands on opaque bodies. A pile
/// of sheets has one for each pair of sheets.
const MOST: usize = 4096;
/// Greatest number of overlaps at which glass stands on an opaque body.
const MOST_CONTACTS: usize = 1 << 18;
/// Greatest number of pairs of faces that are compared. N faces that all overlap on the sort axis
/// have N²/2 pairs.
const MOST_PAIRS: usize = 1 << 26;

/// Least separation at which a precision distinguishes two surfaces in the cameras' pictures.
pub(super) struct DepthResolution<'a> {
    pub precision: PrecisionChoice,
    views: &'a [CameraView],
    /// Distance from each camera's eye to the origins of its rays, in metres.
    skipped: Vec<f64>,
}

impl<'a> DepthResolution<'a> {
    pub fn new(precision: PrecisionChoice, views: &'a [CameraView], bounds: &Aabb) -> Self {
        let skipped = |view: &CameraView| match precision {
            PrecisionChoice::Robust => view.eye_to_origin_distance::<f32>(bounds),
            PrecisionChoice::Reference => view.eye_to_origin_distance::<f64>(bounds),
        };
        Self {
            precision,
            views,
            skipped: views.iter().map(skipped).collect(),
        }
    }

    /// Returns the cameras, each with the length of its ray to a position, in metres.
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

    /// Returns the least separation of distinguishable surfaces at a position, in metres. It covers
    /// the rounding of the ray's length and of the position.
    pub fn min_separation_at(&self, position: DVec3) -> f64 {
        let in_view = self
            .ray_lengths(position)
            .filter(|(view, _)| view.project_point(position).is_some());
        let farthest = in_view.map(|(_, length)| length).fold(0.0, f64::max);
        ROUNDINGS * self.unit_roundoff() * (position.abs().max_element() + farthest)
    }
}

/// Finds overlapping coplanar faces of objects with different materials.
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
    let mut search = OverlapSearch {
        scene_facts,
        tolerance,
        found: Vec::new(),
        counts: [0; 2],
        pairs: 0,
        has_all_contacts: true,
    };
    for parallel in all.chunk_by_mut(|a, b| b.plane_key()[0] - a.plane_key()[0] <= PARALLEL) {
        parallel.sort_by(|a, b| a.plane_key()[1].total_cmp(&b.plane_key()[1]));
        for plane in parallel.chunk_by_mut(|a, b| b.plane_key()[1] - a.plane_key()[1] <= tolerance)
        {
            search.search_plane(plane);
        }
    }
    OverlapTable::new(search.found, search.has_all_contacts)
}

/// Search for the overlaps of a scene.
struct OverlapSearch<'a> {
    scene_facts: &'a SceneFacts<'a>,
    tolerance: f64,
    found: Vec<CoplanarOverlap>,
    /// Numbers of the overlaps besides contacts of glass, and of these contacts.
    counts: [usize; 2],
    /// Number of pairs of faces that were compared.
    pairs: usize,
    /// Whether all contacts of glass with opaque bodies were compared.
    has_all_contacts: bool,
}

impl OverlapSearch<'_> {
    /// Compares the faces of a plane that overlap along an axis: the axis of their greatest extent.
    fn search_plane(&mut self, faces: &mut [FlatFace]) {
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
                self.pairs += 1;
                if self.pairs > MOST_PAIRS {
                    self.has_all_contacts = false;
                    return;
                }
                self.add_overlap(other, face);
            }
            open.push(face);
        }
    }

    /// Adds the overlap of two faces, unless the list has enough of its kind.
    fn add_overlap(&mut self, a: &FlatFace, b: &FlatFace) {
        let is_contact = are_back_to_back(a, b);
        let count = self.counts[usize::from(is_contact)];
        let most = if is_contact { MOST_CONTACTS } else { MOST };
        if count >= most {
            self.has_all_contacts &= !is_contact;
            return;
        }
        if let Some(overlap) = overlap_of_faces(self.scene_facts, a, b, self.tolerance) {
            self.counts[usize::from(is_contact)] += 1;
            self.found.push(overlap);
        }
    }
}

/// Returns whether two parallel faces belong to closed bodies on opposite sides of their plane.
fn are_back_to_back(a: &FlatFace, b: &FlatFace) -> bool {
    !a.is_sheet && !b.is_sheet && a.normal.dot(b.normal) < 0.0
}

/// Returns whether rays can hit the two faces from opposite sides only.
fn visible_sides_oppose([own, others]: [&ObjectFacts<'_>; 2], [a, b]: [&FlatFace; 2]) -> bool {
    let visible = [
        own.visible_normal(a.normal),
        others.visible_normal(b.normal),
    ];
    matches!(visible, [Some(m), Some(n)] if m.dot(n) < 0.0)
}

/// Returns whether the bounding boxes of two bounded faces are apart within their plane.
fn are_apart(a: &FlatFace, b: &FlatFace) -> bool {
    // Of parallel faces, the coordinates across the plane differ by rounding alone.
    let across = a.normal.abs().max_position();
    let ends = |face: &FlatFace, axis: usize| {
        let along = face.corners.iter().map(|corner| corner[axis]);
        along.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
            [low.min(x), high.max(x)]
        })
    };
    !a.is_endless
        && !b.is_endless
        && (0..3).filter(|&axis| axis != across).any(|axis| {
            let ([low, high], [from, to]) = (ends(a, axis), ends(b, axis));
            low >= to || from >= high
        })
}

/// Returns the overlap of two coplanar faces. Returns `None` if they do not overlap, share an
/// object or material, can be hit from opposite sides only, or belong to bodies that stand back to
/// back, except glass on an opaque body.
fn overlap_of_faces(
    scene_facts: &SceneFacts<'_>,
    a: &FlatFace,
    b: &FlatFace,
    tolerance: f64,
) -> Option<CoplanarOverlap> {
    let material = |face: &FlatFace| &scene_facts.objects[face.object].object.material;
    let [own, others] = [a, b].map(|face| &scene_facts.objects[face.object]);
    let touches_glass = matches!(
        [own.surface_kind, others.surface_kind],
        [SurfaceKind::Body, SurfaceKind::Opaque] | [SurfaceKind::Opaque, SurfaceKind::Body]
    );
    let is_back_to_back = are_back_to_back(a, b);
    if a.object == b.object
        || material(a) == material(b)
        || is_back_to_back && !touches_glass
        || visible_sides_oppose([own, others], [a, b])
        || a.normal.cross(b.normal).length() > PARALLEL
        || are_apart(a, b)
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
    let [first, second] = if a.object < b.object { [a, b] } else { [b, a] };
    Some(CoplanarOverlap {
        objects: [first.object, second.object],
        outward: [first.normal, second.normal],
        touches_glass,
        is_back_to_back,
        are_sheets: a.is_sheet && b.is_sheet,
        normal,
        outline,
        position,
        gap,
        tolerance,
    })
}
