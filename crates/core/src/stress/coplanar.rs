//! Overlapping flat faces of two objects in one plane. Their distances along a ray are equal, so
//! that depth does not determine the visible face.
//!
//! Faces are sorted by plane, and within a plane along an axis. Only faces that overlap on this
//! axis are compared.

use super::faces::{FlatFace, clip_polygon, shape_faces, signed_double_area};
use super::views::ROUNDINGS;
use super::*;
use crate::motion::shutter_interval;
use crate::topology::Topology;

/// Two normals are parallel if the length of their cross product, or the difference of their keys,
/// is at most this.
const PARALLEL: f64 = 1e-9;
/// Two planes are equal even in double precision if their separation, as a share of the greatest
/// coordinate, is below this.
const ONE_PLANE: f64 = 1e-12;
/// Greatest number of overlaps that are recorded, besides glass that stands on opaque bodies (a pile
/// of sheets has one for each pair of sheets), and greatest number of the latter.
const MOST: [usize; 2] = [4096, 1 << 18];
/// Greatest number of pairs of faces that are compared. N faces that all overlap on the sort axis
/// have N²/2 pairs.
const MOST_PAIRS: usize = 1 << 26;
/// Greatest number of triangles of a mesh whose faces are compared, and of all meshes together.
const MESH_FACES: usize = 64;
const ALL_MESH_FACES: usize = 1 << 18;

impl SceneFacts<'_> {
    /// Finds overlapping coplanar faces of objects with different materials.
    pub fn find_overlaps(&self) -> OverlapTable {
        let mut all = self.flat_faces();
        let corners = all.iter().flat_map(|face| &face.corners);
        let reach = corners.fold(0.0_f64, |most, corner| most.max(corner.abs().max_element()));
        let way = reach.max(self.longest_ray(DVec3::ZERO, false));
        let tolerance = (reach * ONE_PLANE).max(ROUNDINGS * self.unit_roundoff() * way);
        let mut search = OverlapSearch {
            facts: self,
            tolerance,
            found: Vec::new(),
            counts: [0; 2],
            pairs: 0,
            has_all_contacts: true,
        };
        all.sort_by(|a, b| a.plane_key()[0].total_cmp(&b.plane_key()[0]));
        for parallel in all.chunk_by_mut(|a, b| b.plane_key()[0] - a.plane_key()[0] <= PARALLEL) {
            parallel.sort_by(|a, b| a.plane_key()[1].total_cmp(&b.plane_key()[1]));
            let is_one =
                |a: &FlatFace, b: &FlatFace| b.plane_key()[1] - a.plane_key()[1] <= tolerance;
            for plane in parallel.chunk_by_mut(is_one) {
                search.search_plane(plane);
            }
        }
        OverlapTable::new(search.found, search.has_all_contacts)
    }

    /// Returns the flat faces of the listed objects that rest while the shutter is open. Meshes of
    /// many triangles have none.
    fn flat_faces(&self) -> Vec<FlatFace> {
        let camera = self.scene.cameras.first();
        let is_open_for_a_time = camera.is_some_and(|camera| shutter_interval(camera).is_some());
        let mut room = ALL_MESH_FACES;
        let listed = self.objects.iter().take(self.scene.objects.len());
        let resting = listed.filter(|o| o.object.transform_end.is_none() || !is_open_for_a_time);
        let faces = resting.flat_map(|object| {
            let faces = match object.mesh {
                Some((_, data)) if data.indices.len() > MESH_FACES.min(room) => Vec::new(),
                Some((_, data)) => {
                    room -= data.indices.len();
                    let topology = self.topology(object);
                    let is_sheet = !topology.is_some_and(Topology::is_closed);
                    let at = |corner: u32| data.positions.position(corner as usize);
                    let triangles = data.indices.iter();
                    triangles
                        .map(|corners| FlatFace::from_triangle(corners.map(at), is_sheet))
                        .collect()
                }
                None => shape_faces(&object.object.shape),
            };
            faces.into_iter().filter_map(|face| face.place(object))
        });
        faces.collect()
    }
}

/// Search for the overlaps of a scene.
struct OverlapSearch<'a> {
    facts: &'a SceneFacts<'a>,
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
        let corners = faces.iter().flat_map(|face| face.corners.iter().copied());
        let axis = Aabb::from_points(corners).extent().max_position();
        faces.sort_by(|a, b| a.bounds.min[axis].total_cmp(&b.bounds.min[axis]));
        let mut open: Vec<&FlatFace> = Vec::new();
        for face in &*faces {
            open.retain(|other| other.bounds.max[axis] > face.bounds.min[axis]);
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
        let kind = usize::from(a.is_back_to_back(b));
        if self.counts[kind] >= MOST[kind] {
            self.has_all_contacts &= kind == 0;
        } else if let Some(overlap) = self.overlap(a, b) {
            self.counts[kind] += 1;
            self.found.push(overlap);
        }
    }

    /// Returns the overlap of two coplanar faces. Returns `None` if they do not overlap, share an
    /// object or material, can be hit from opposite sides only, or belong to bodies that stand back
    /// to back, except glass on an opaque body.
    fn overlap(&self, a: &FlatFace, b: &FlatFace) -> Option<CoplanarOverlap> {
        let [own, others] = [a, b].map(|face| &self.facts.objects[face.object]);
        let touches_glass =
            own.is_body() && others.is_opaque() || own.is_opaque() && others.is_body();
        let is_back_to_back = a.is_back_to_back(b);
        let visible = own
            .visible_normal(a.normal)
            .zip(others.visible_normal(b.normal));
        if a.object == b.object
            || own.object.material == others.object.material
            || is_back_to_back && !touches_glass
            || visible.is_some_and(|(m, n)| m.dot(n) < 0.0)
            || a.normal.cross(b.normal).length() > PARALLEL
            || a.is_apart(b)
        {
            return None;
        }
        let (bounded, other) = if a.is_endless { (b, a) } else { (a, b) };
        let normal = bounded.normal;
        let apart = |corner: &DVec3| (*corner - other.corners[0]).dot(other.normal).abs();
        if bounded
            .corners
            .iter()
            .any(|corner| apart(corner) > self.tolerance)
        {
            return None;
        }
        let mut outline = bounded.outline(normal);
        if !bounded.is_endless && !other.is_endless {
            let clip = other.outline(normal);
            let [own, others] =
                [&outline, &clip].map(|corners| signed_double_area(corners, normal));
            outline = clip_polygon(outline, &clip, normal);
            if signed_double_area(&outline, normal) <= 1e-6 * own.min(others) {
                return None;
            }
        }
        let position = outline.iter().sum::<DVec3>() / outline.len() as f64;
        // What rounding makes of corners is no gap.
        let corners = outline.iter();
        let reach = corners.fold(0.0_f64, |most, corner| most.max(corner.abs().max_element()));
        let gap = outline.iter().map(apart).fold(0.0, f64::max);
        let [first, second] = if a.object < b.object { [a, b] } else { [b, a] };
        Some(CoplanarOverlap {
            objects: [first.object, second.object],
            outward: [first.normal, second.normal],
            touches_glass,
            is_back_to_back,
            are_sheets: a.is_sheet && b.is_sheet,
            normal,
            bounds: Aabb::from_points(outline.iter().copied()),
            outline: if bounded.is_endless {
                Vec::new()
            } else {
                outline
            },
            position,
            gap: if gap > ONE_PLANE * reach { gap } else { 0.0 },
            tolerance: self.tolerance,
        })
    }
}

/// Two objects with coplanar faces that overlap, and the region of the overlap.
#[derive(Clone, Debug)]
pub(super) struct CoplanarOverlap {
    pub objects: [usize; 2],
    /// Whether neither face belongs to a closed body. The face of a body may be hidden
    /// legitimately, by the surface on which the body stands.
    pub are_sheets: bool,
    /// Whether glass touches an opaque object here.
    touches_glass: bool,
    /// Whether both faces belong to closed bodies that stand back to back.
    pub is_back_to_back: bool,
    /// Outward normals of the faces of `objects`.
    outward: [DVec3; 2],
    normal: DVec3,
    /// Region of the overlap: a convex polygon, counter-clockwise about the normal. Empty if both
    /// faces are unbounded.
    outline: Vec<DVec3>,
    bounds: Aabb,
    pub position: DVec3,
    /// Greatest separation of the two faces within the overlap, in metres.
    pub gap: f64,
    tolerance: f64,
}

impl CoplanarOverlap {
    /// Returns whether a surface point lies in the overlap. `normal` may point to either side.
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

/// The overlaps of an object, sorted along the axis on which they extend farthest.
#[derive(Clone, Debug, Default)]
struct ObjectOverlaps {
    axis: usize,
    /// The low end of each bounded overlap on the axis, and its index.
    sorted: Vec<(f64, usize)>,
    /// Greatest extent of a bounded overlap on the axis.
    longest: f64,
    /// Indices of the unbounded overlaps.
    unbounded: Vec<usize>,
}

impl ObjectOverlaps {
    fn new(list: &[CoplanarOverlap], own: Vec<usize>) -> Self {
        let is_unbounded = |&index: &usize| list[index].outline.is_empty();
        let (unbounded, bounded): (Vec<usize>, Vec<usize>) =
            own.into_iter().partition(is_unbounded);
        let boxes = || bounded.iter().map(|&index| &list[index].bounds);
        let axis = Aabb::from_points(boxes().map(|b| b.min))
            .extent()
            .max_position();
        let ends = bounded
            .iter()
            .map(|&index| (list[index].bounds.min[axis], index));
        let mut sorted: Vec<(f64, usize)> = ends.collect();
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        Self {
            axis,
            longest: boxes().map(|b| b.extent()[axis]).fold(0.0, f64::max),
            sorted,
            unbounded,
        }
    }

    /// Returns the indices of the overlaps that may contain a point.
    fn candidates_at(&self, point: DVec3) -> impl Iterator<Item = usize> {
        let x = point[self.axis];
        let from = self
            .sorted
            .partition_point(|(low, _)| *low < x - self.longest);
        let near = self.sorted[from..]
            .iter()
            .take_while(move |(low, _)| *low <= x);
        near.map(|(_, index)| *index)
            .chain(self.unbounded.iter().copied())
    }
}

/// All overlaps of a scene, indexed by object.
#[derive(Clone, Debug, Default)]
pub(super) struct OverlapTable {
    pub list: Vec<CoplanarOverlap>,
    /// Whether the list has all places where glass touches an opaque body.
    pub has_all_contacts: bool,
    of: BTreeMap<usize, ObjectOverlaps>,
}

impl OverlapTable {
    fn new(list: Vec<CoplanarOverlap>, has_all_contacts: bool) -> Self {
        let mut of: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (index, overlap) in list.iter().enumerate() {
            for object in overlap.objects {
                of.entry(object).or_default().push(index);
            }
        }
        let of = of.into_iter();
        let of = of.map(|(object, own)| (object, ObjectOverlaps::new(&list, own)));
        Self {
            of: of.collect(),
            list,
            has_all_contacts,
        }
    }

    /// Returns the separation of two objects where they overlap, in metres.
    pub fn gap_between(&self, [a, b]: [usize; 2]) -> Option<f64> {
        let pair = [a.min(b), a.max(b)];
        let overlap = self.list.iter().find(|overlap| overlap.objects == pair)?;
        Some(overlap.gap)
    }

    /// Returns the overlaps of `object` at a point of its surface. For each: the other object, and
    /// the outward normal of that object's face.
    fn overlaps_at(
        &self,
        object: usize,
        [point, normal]: [DVec3; 2],
    ) -> impl Iterator<Item = (&CoplanarOverlap, usize, DVec3)> {
        let own = self.of.get(&object);
        own.into_iter()
            .flat_map(move |own| own.candidates_at(point))
            .map(|index| &self.list[index])
            .filter(move |overlap| overlap.contains_surface_point(point, normal))
            .map(move |overlap| {
                let other = usize::from(overlap.objects[0] == object);
                (overlap, overlap.objects[other], overlap.outward[other])
            })
    }

    /// Returns the other objects that a ray could hit in place of `object`, at a point of its
    /// surface. A ray hits no face from its hidden side.
    pub fn overlapping_objects(
        &self,
        facts: &SceneFacts<'_>,
        object: usize,
        place: [DVec3; 2],
        direction: DVec3,
    ) -> impl Iterator<Item = usize> {
        self.overlaps_at(object, place)
            .filter(move |(overlap, other, outward)| {
                let visible = facts.objects[*other].visible_normal(*outward);
                !overlap.is_back_to_back && visible.is_none_or(|side| side.dot(direction) < 0.0)
            })
            .map(|(_, other, _)| other)
    }

    /// Returns the objects that touch `object` at a point of its surface, if one of the two is
    /// glass and the other is opaque. For each: the outward normal of its face.
    pub fn glass_contacts(
        &self,
        object: usize,
        place: [DVec3; 2],
    ) -> impl Iterator<Item = (usize, DVec3)> {
        self.overlaps_at(object, place)
            .filter(|(overlap, ..)| overlap.touches_glass)
            .map(|(_, other, outward)| (other, outward))
    }
}
