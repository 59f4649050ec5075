//! Flat surfaces of two objects in one plane, one over the other: which of them is seen there is no
//! matter of distance.
//!
//! Sorted by their planes, and in each plane along an axis, so that of many faces only neighbours
//! are compared.

use std::collections::BTreeMap;

use glam::DVec3;

use super::cameras::CameraView;
use super::faces::{
    ALL_MESH_FACES, FlatFace, clip_polygon, counter_clockwise_corners, find_flat_faces,
    signed_double_area,
};
use super::facts::{SceneFacts, finite_point};
use super::finding::{
    FindingCode, Severity, StressFinding, metres, round_up_to_digit, with_metres,
};
use super::ray_survey::RaySurvey;
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
    are_sheets: bool,
    normal: DVec3,
    /// Convex, counter-clockwise about the normal; empty where both have no end.
    outline: Vec<DVec3>,
    position: DVec3,
    /// How far apart they are there at most, in metres.
    gap: f64,
    tolerance: f64,
}

/// What a precision tells apart in the pictures of some cameras.
pub(super) struct DepthResolution<'a> {
    pub precision: PrecisionChoice,
    pub views: &'a [CameraView],
}

impl DepthResolution<'_> {
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
            .views
            .iter()
            .filter(|view| view.project_point(position).is_some());
        let farthest = in_view
            .map(|view| view.distance_from_eye(position))
            .fold(0.0, f64::max);
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
    list: Vec<CoplanarOverlap>,
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
        .views
        .iter()
        .map(|view| view.distance_from_eye(DVec3::ZERO))
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

/// An object that others cover, of which one is named.
struct CoveredObject {
    other: usize,
    others: usize,
    /// Rays that see any of them there, and those of which that is itself.
    rays: [u64; 2],
    position: DVec3,
    gap: f64,
    /// Whether each is seen here and there.
    flickers: bool,
}

/// What overlaps and is not told by rays that see now the one and now the other: the picture is
/// wrong where all that is to be seen of one of them is where others are seen, and where rounding
/// decides from ray to ray.
pub(super) fn check_overlaps(
    scene_facts: &SceneFacts<'_>,
    overlaps: &OverlapTable,
    survey: &RaySurvey,
    resolution: &DepthResolution<'_>,
    is_told: impl Fn([usize; 2]) -> bool,
) -> Vec<StressFinding> {
    let mut pairs: BTreeMap<[usize; 2], &CoplanarOverlap> = BTreeMap::new();
    for overlap in &overlaps.list {
        pairs.entry(overlap.objects).or_insert(overlap);
    }
    let mut all: BTreeMap<(bool, usize), CoveredObject> = BTreeMap::new();
    for ([a, b], overlap) in pairs {
        let [first, second] =
            [[a, b], [b, a]].map(|pair| RaySurvey::sighting_count(&survey.coplanar, &pair));
        let is_seen = first + second >= 3;
        let flickers = first + second >= 10 && 20 * first.min(second) >= first + second;
        let is_apart = overlap.gap > resolution.min_separation_at(overlap.position) && !flickers;
        if is_told([a, b]) || is_apart || !is_seen && !overlap.are_sheets {
            continue;
        }
        let [hidden, other] = if second > first { [a, b] } else { [b, a] };
        let sighting = survey.coplanar.get(&[other, hidden]).filter(|_| is_seen);
        let position = sighting.map_or(overlap.position, |sighting| sighting.position);
        let covered = all.entry((flickers, hidden)).or_insert(CoveredObject {
            other,
            others: 0,
            rays: [0; 2],
            position,
            gap: overlap.gap,
            flickers,
        });
        if is_seen {
            (covered.rays[0], covered.rays[1]) = (
                covered.rays[0] + first + second,
                covered.rays[1] + first.min(second),
            );
        }
        covered.others += 1;
    }
    all.iter()
        .map(|(&(_, hidden), covered)| {
            overlap_finding(scene_facts, hidden, covered, survey, resolution)
        })
        .collect()
}

fn overlap_finding(
    scene_facts: &SceneFacts<'_>,
    hidden: usize,
    covered: &CoveredObject,
    survey: &RaySurvey,
    resolution: &DepthResolution<'_>,
) -> StressFinding {
    let named = scene_facts.objects[covered.other]
        .subject
        .display_name(scene_facts.scene);
    let others = match covered.others {
        1 => named,
        more => format!("{named} and {} more", more - 1),
    };
    let [rays, own] = covered.rays;
    let is_lost = 20 * own < rays && RaySurvey::sighting_count(&survey.first, &hidden) <= own;
    let minimum = resolution.min_separation_at(covered.position);
    let lies = match covered.gap {
        0.0 => format!("it lies in one plane with {others}"),
        gap => format!(
            "it lies {} from {others}, and surfaces less than {} apart cannot be told apart there for certain",
            metres(gap),
            with_metres(&round_up_to_digit(minimum))
        ),
    };
    let elsewhere = RaySurvey::sighting_count(&survey.first, &hidden).saturating_sub(own);
    let (code, severity) = match (covered.flickers, is_lost) {
        (true, _) => (FindingCode::FlickeringSurfaces, Severity::PictureWrong),
        (_, true) => (FindingCode::CoplanarSurfaces, Severity::PictureWrong),
        _ => (FindingCode::CoplanarSurfaces, Severity::Harmless),
    };
    let end = match (covered.flickers, is_lost, rays) {
        (true, ..) => format!(
            ": rounding decides from ray to ray which of them is seen ({own} of {rays} rays see this one)"
        ),
        (_, true, _) => format!(
            ", which {} of {rays} rays see in its place, and none sees it elsewhere",
            rays - own
        ),
        (.., 0) => "; no ray of the cameras has met that place".to_owned(),
        _ => format!(
            "; it is seen nevertheless: {own} of the {rays} rays that hit both show this one there, and {elsewhere} rays show it elsewhere"
        ),
    };
    let remedy = match severity {
        Severity::Harmless => format!(
            "nothing, unless this one is meant to be seen there: then {}",
            separation_remedy(minimum, covered.gap, resolution.precision)
        ),
        _ => separation_remedy(minimum, covered.gap, resolution.precision),
    };
    let subject = scene_facts.objects[hidden].subject;
    let finding = StressFinding::new(code, severity, subject, lies + &end, remedy);
    let counted_finding = if rays > 0 {
        finding.with_count(rays, survey.rays, "rays", "of the cameras met that place")
    } else {
        finding
    };
    counted_finding.with_place(finite_point(covered.position))
}

/// Returns the remedy for two surfaces with this gap between them, where `minimum` is the least
/// distance at which surfaces are told apart, both in metres.
pub(super) fn separation_remedy(minimum: f64, gap: f64, precision: PrecisionChoice) -> String {
    let exact = match precision {
        PrecisionChoice::Robust if gap > 0.0 => ", or add --precision reference",
        _ => "",
    };
    let least = with_metres(&round_up_to_digit(minimum));
    format!("move one of them by {least} or more, or remove it{exact}")
}
