//! The overlaps of coplanar faces that a scene has, found by object and place.

use std::collections::BTreeMap;

use glam::DVec3;

use super::facts::SceneFacts;

/// Two objects with coplanar faces that overlap, and the region of the overlap.
#[derive(Clone, Debug)]
pub(super) struct CoplanarOverlap {
    pub objects: [usize; 2],
    /// Whether neither face belongs to a closed body. The face of a body may be hidden
    /// legitimately, by the surface on which the body stands.
    pub are_sheets: bool,
    /// Whether glass touches an opaque object here.
    pub touches_glass: bool,
    /// Whether both faces belong to closed bodies that stand back to back.
    pub is_back_to_back: bool,
    /// Outward normals of the faces of `objects`.
    pub outward: [DVec3; 2],
    pub normal: DVec3,
    /// Region of the overlap: a convex polygon, counter-clockwise about the normal. Empty if both
    /// faces are unbounded.
    pub outline: Vec<DVec3>,
    pub position: DVec3,
    /// Greatest separation of the two faces within the overlap, in metres.
    pub gap: f64,
    pub tolerance: f64,
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
        let (unbounded, bounded): (Vec<usize>, Vec<usize>) = own
            .into_iter()
            .partition(|&index| list[index].outline.is_empty());
        let ends = |index: usize, axis: usize| {
            let along = list[index].outline.iter().map(|corner| corner[axis]);
            along.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
                [low.min(x), high.max(x)]
            })
        };
        let spread = |axis: usize| {
            let all = bounded.iter().map(|&index| ends(index, axis)[0]);
            let [low, high] = all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
                [low.min(x), high.max(x)]
            });
            high - low
        };
        let axis = (0..3)
            .max_by(|&a, &b| spread(a).total_cmp(&spread(b)))
            .unwrap_or(0);
        let mut sorted: Vec<(f64, usize)> = bounded
            .iter()
            .map(|&index| (ends(index, axis)[0], index))
            .collect();
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let extents = bounded.iter().map(|&index| {
            let [low, high] = ends(index, axis);
            high - low
        });
        Self {
            axis,
            longest: extents.fold(0.0, f64::max),
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

    /// Returns the indices of all overlaps of the object.
    fn all(&self) -> impl Iterator<Item = usize> {
        let bounded = self.sorted.iter().map(|(_, index)| *index);
        bounded.chain(self.unbounded.iter().copied())
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
    /// Creates the table of a list of overlaps. `has_all_contacts`: see
    /// [`Self::has_all_contacts`].
    pub fn new(list: Vec<CoplanarOverlap>, has_all_contacts: bool) -> Self {
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
        let mut of_first = self.of.get(&a)?.all();
        of_first.find_map(|index| {
            let overlap = &self.list[index];
            overlap.objects.contains(&b).then_some(overlap.gap)
        })
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
        scene_facts: &SceneFacts<'_>,
        object: usize,
        place: [DVec3; 2],
        direction: DVec3,
    ) -> impl Iterator<Item = usize> {
        self.overlaps_at(object, place)
            .filter(move |(overlap, other, outward)| {
                let visible = scene_facts.objects[*other].visible_normal(*outward);
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
