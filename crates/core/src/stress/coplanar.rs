//! Flat surfaces of two objects in one plane, one over the other: which of them is seen there is no
//! matter of distance.
//!
//! Sorted by their planes, and in each plane along an axis, so that of many faces only neighbours
//! are compared.

use std::collections::BTreeMap;

use glam::DVec3;

use super::facts::{SceneFacts, place};
use super::finding::{Code, Finding, Severity};
use super::ray_survey::RaySurvey;
use crate::scene::Shape;

/// Sides of the polygon that stands for a disk.
const SIDES: u32 = 24;
/// Normals that differ by less are parallel.
const PARALLEL: f64 = 1e-9;
/// Share of the greatest coordinate below which two planes are one: what f32 hardly tells apart.
const ONE_PLANE: f64 = 1e-7;
/// Overlaps of which account is kept; a pile of sheets has one for each two.
const MOST: usize = 4096;
/// Pairs of faces that are compared. Faces that all lie beside each other have half the square of
/// their number.
const MOST_PAIRS: usize = 1 << 24;

/// Two objects with a face each in one plane, and where both are.
#[derive(Clone, Debug)]
pub(super) struct Overlap {
    pub objects: [usize; 2],
    /// Whether no body is among them, whose face may be hidden by what it stands on.
    are_sheets: bool,
    normal: DVec3,
    /// Convex, counter-clockwise about the normal; empty where both have no end.
    outline: Vec<DVec3>,
    place: DVec3,
    tolerance: f64,
}

impl Overlap {
    /// Whether a point with this normal, or the opposite one, is where both are.
    fn holds(&self, point: DVec3, normal: DVec3) -> bool {
        let within = |i: usize| {
            let (from, to) = (self.outline[i], self.outline[(i + 1) % self.outline.len()]);
            self.normal.cross(to - from).dot(point - from) >= 0.0
        };
        normal.dot(self.normal).abs() > 0.999
            && (point - self.place).dot(self.normal).abs() <= 16.0 * self.tolerance
            && (0..self.outline.len()).all(within)
    }
}

/// All overlaps of a scene, and those of each object.
#[derive(Clone, Debug, Default)]
pub(super) struct Overlaps {
    list: Vec<Overlap>,
    of: BTreeMap<usize, Vec<usize>>,
    /// Pairs that were compared.
    pairs: usize,
}

impl Overlaps {
    /// The other objects that are where this one is seen.
    pub fn at(&self, object: usize, point: DVec3, normal: DVec3) -> impl Iterator<Item = usize> {
        let own = self
            .of
            .get(&object)
            .into_iter()
            .flatten()
            .map(|&index| &self.list[index]);
        own.filter(move |overlap| overlap.holds(point, normal))
            .map(move |overlap| {
                let [a, b] = overlap.objects;
                if a == object { b } else { a }
            })
    }
}

/// A flat face in the world.
struct Face {
    object: usize,
    normal: DVec3,
    /// Corners in order; of a plane, which has none, a point.
    corners: Vec<DVec3>,
    is_endless: bool,
    is_sheet: bool,
}

impl Face {
    /// Its normal's direction without a sign, and how far along that its plane is.
    fn key(&self) -> [f64; 2] {
        // Directions that are no multiples of each other have other products with it, but for rare
        // ones.
        let tilt = self.normal.dot(DVec3::new(0.539_134, 0.617_291, 0.573_008));
        [tilt.abs(), self.normal.dot(self.corners[0]) * tilt.signum()]
    }
}

/// The flat faces of an object that stands still.
fn faces(object: usize, facts: &SceneFacts<'_>) -> Vec<Face> {
    let own = &facts.objects[object];
    if own.object.transform_end.is_some() {
        return Vec::new();
    }
    let turned = own.map.matrix3.inverse().transpose();
    let face = |normal: DVec3, corners: &[DVec3], is_sheet: bool| {
        let corners = corners
            .iter()
            .map(|&corner| own.map.transform_point3(corner))
            .collect();
        Face {
            object,
            normal: (turned * normal).normalize(),
            corners,
            is_endless: false,
            is_sheet,
        }
    };
    let v = DVec3::from_array;
    let found = match own.object.shape {
        Shape::Plane { point, normal } => vec![Face {
            is_endless: true,
            ..face(v(normal), &[v(point)], true)
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
            vec![face(
                v(normal),
                &(0..SIDES).map(corner).collect::<Vec<_>>(),
                true,
            )]
        }
        Shape::Quad {
            corner,
            edge_u,
            edge_v,
        } => {
            let (c, a, b) = (v(corner), v(edge_u), v(edge_v));
            vec![face(a.cross(b), &[c, c + a, c + a + b, c + b], true)]
        }
        Shape::Triangle { vertices } => {
            let [a, b, c] = vertices.map(v);
            vec![face((b - a).cross(c - a), &[a, b, c], true)]
        }
        Shape::Box { min, max } => {
            let ends = [v(min), v(max)];
            let side = |index: usize| {
                let (axis, end) = (index / 2, index % 2);
                let corner = |i: usize, j: usize| {
                    let mut corner = ends[end];
                    (corner[(axis + 1) % 3], corner[(axis + 2) % 3]) =
                        (ends[i][(axis + 1) % 3], ends[j][(axis + 2) % 3]);
                    corner
                };
                let out = DVec3::AXES[axis] * if end == 1 { 1.0 } else { -1.0 };
                face(
                    out,
                    &[corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)],
                    false,
                )
            };
            (0..6).map(side).collect()
        }
        _ => Vec::new(),
    };
    found
        .into_iter()
        .filter(|face| {
            face.normal.is_finite() && face.corners.iter().all(|corner| corner.is_finite())
        })
        .collect()
}

/// Finds what lies in one plane and overlaps there, of objects of different materials.
pub(super) fn overlaps(facts: &SceneFacts<'_>) -> Overlaps {
    let mut all: Vec<Face> = (0..facts.scene.objects.len())
        .flat_map(|object| faces(object, facts))
        .collect();
    let reach = all
        .iter()
        .flat_map(|face| &face.corners)
        .fold(0.0_f64, |most, corner| most.max(corner.abs().max_element()));
    let tolerance = reach * ONE_PLANE;
    all.sort_by(|a, b| a.key()[0].total_cmp(&b.key()[0]));
    let mut found = Overlaps::default();
    for parallel in all.chunk_by_mut(|a, b| b.key()[0] - a.key()[0] <= PARALLEL) {
        parallel.sort_by(|a, b| a.key()[1].total_cmp(&b.key()[1]));
        for plane in parallel.chunk_by_mut(|a, b| b.key()[1] - a.key()[1] <= tolerance) {
            sweep(facts, plane, tolerance, &mut found);
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
fn sweep(facts: &SceneFacts<'_>, faces: &mut [Face], tolerance: f64, found: &mut Overlaps) {
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
    let ends = |face: &Face| {
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
    let mut open: Vec<&Face> = Vec::new();
    for face in &*faces {
        open.retain(|other| ends(other)[1] > ends(face)[0]);
        for other in &open {
            found.pairs += 1;
            if found.list.len() >= MOST || found.pairs > MOST_PAIRS {
                return;
            }
            found.list.extend(overlap(facts, other, face, tolerance));
        }
        open.push(face);
    }
}

/// What two faces have in common.
fn overlap(facts: &SceneFacts<'_>, a: &Face, b: &Face, tolerance: f64) -> Option<Overlap> {
    let material = |face: &Face| &facts.objects[face.object].object.material;
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
    let is_far = |corner: &DVec3| (*corner - other.corners[0]).dot(other.normal).abs() > tolerance;
    if bounded.corners.iter().any(is_far) {
        return None;
    }
    let normal = bounded.normal;
    let mut outline = counter_clockwise(bounded, normal);
    if !bounded.is_endless && !other.is_endless {
        let whole = area(&outline, normal).min(area(&counter_clockwise(other, normal), normal));
        outline = clipped(outline, &counter_clockwise(other, normal), normal);
        if area(&outline, normal) <= 1e-6 * whole {
            return None;
        }
    }
    let place = outline.iter().sum::<DVec3>() / outline.len() as f64;
    let outline = if bounded.is_endless {
        Vec::new()
    } else {
        outline
    };
    let objects = [a.object.min(b.object), a.object.max(b.object)];
    Some(Overlap {
        objects,
        are_sheets: a.is_sheet && b.is_sheet,
        normal,
        outline,
        place,
        tolerance,
    })
}

/// A face's corners, counter-clockwise about a normal.
fn counter_clockwise(face: &Face, normal: DVec3) -> Vec<DVec3> {
    let mut corners = face.corners.clone();
    if area(&corners, normal) < 0.0 {
        corners.reverse();
    }
    corners
}

/// Twice the area of a polygon, below zero where it is clockwise about the normal.
fn area(corners: &[DVec3], normal: DVec3) -> f64 {
    let first = corners.first().copied().unwrap_or_default();
    corners
        .windows(2)
        .map(|pair| (pair[0] - first).cross(pair[1] - first).dot(normal))
        .sum()
}

/// A convex polygon cut by the edges of another ("Reentrant Polygon Clipping", Sutherland, Hodgman
/// 1974).
fn clipped(mut corners: Vec<DVec3>, by: &[DVec3], normal: DVec3) -> Vec<DVec3> {
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

/// An object that others cover, of which one is named.
struct Covered {
    other: usize,
    others: usize,
    /// Rays that see any of them there, and those of which that is itself.
    rays: [u64; 2],
    place: DVec3,
}

/// What overlaps and is not told by rays that see now the one and now the other: the picture is
/// wrong where all that is to be seen of one of them is where others are seen.
pub(super) fn check(
    facts: &SceneFacts<'_>,
    overlaps: &Overlaps,
    seen: &RaySurvey,
    flickers: impl Fn([usize; 2]) -> bool,
) -> Vec<Finding> {
    let mut pairs: BTreeMap<[usize; 2], &Overlap> = BTreeMap::new();
    for overlap in &overlaps.list {
        pairs.entry(overlap.objects).or_insert(overlap);
    }
    let mut all: BTreeMap<usize, Covered> = BTreeMap::new();
    for ([a, b], overlap) in pairs {
        let [first, second] = [[a, b], [b, a]].map(|pair| RaySurvey::count(&seen.coplanar, &pair));
        let is_seen = first + second >= 3;
        if flickers([a, b]) || !is_seen && !overlap.are_sheets {
            continue;
        }
        let [hidden, other] = if second > first { [a, b] } else { [b, a] };
        let sighting = seen.coplanar.get(&[other, hidden]).filter(|_| is_seen);
        let place = sighting.map_or(overlap.place, |sighting| sighting.place);
        let covered = all.entry(hidden).or_insert(Covered {
            other,
            others: 0,
            rays: [0; 2],
            place,
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
        .map(|(&hidden, covered)| finding(facts, hidden, covered, seen))
        .collect()
}

fn finding(facts: &SceneFacts<'_>, hidden: usize, covered: &Covered, seen: &RaySurvey) -> Finding {
    let named = facts.objects[covered.other].subject.words(facts.scene);
    let others = match covered.others {
        1 => named,
        more => format!("{named} and {} more", more - 1),
    };
    let [rays, own] = covered.rays;
    let is_lost = 20 * own < rays && RaySurvey::count(&seen.first, &hidden) <= own;
    let (severity, why) = if is_lost {
        (
            Severity::PictureWrong,
            format!("it lies in one plane with {others}, which is seen everywhere in its place"),
        )
    } else {
        let why = format!(
            "it lies in one plane with {others} in part: the order of objects or rounding decides what is seen there"
        );
        (Severity::Harmless, why)
    };
    let remedy = "move one of them by a thousandth of its size, or take it away";
    let finding = Finding::new(
        Code::CoplanarSurfaces,
        severity,
        facts.objects[hidden].subject,
        why,
        remedy,
    );
    let counted = if rays > 0 {
        finding.counted(rays, seen.rays, "rays")
    } else {
        finding
    };
    counted.at(place(covered.place))
}
