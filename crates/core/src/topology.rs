//! Connectivity of a mesh's triangles by half edges, and what it says: holes, seams, orientation,
//! parts, volume. Vertices
//! at the same position count as one corner, even if the file lists them separately.

mod stray;

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fmt;
use std::sync::Arc;

use glam::{DAffine3, DVec3};
use rayon::prelude::*;
use raywright_bvh::Aabb;
use serde::Serialize;

use crate::dispatch::measure_scene_extent;
use crate::fault::{count_with_unit, format_decimal};
use crate::generate::all_objects;
use crate::lookup::SceneLookup;
use crate::scene::{MeshData, Scene, VertexPositions};
use crate::settings::PrecisionChoice;
use stray::TriangleFaults;

/// Greatest number of parts of a mesh for which a part inside another is searched.
const MOST_PARTS: usize = 1000;
/// A surface counts as closed apart from its holes if at most one of `FEW` edges is open.
const FEW: usize = 10;
/// Greatest separation of corners on a seam, as a share of the diagonal of the mesh's bounds.
const NEAR: f64 = 1e-4;
/// Least volume of a part that is more than rounding, as a share of the sum of its terms.
const NO_VOLUME: f64 = 1e-10;

/// The number of items, and the first of the items themselves, so that a finding can show their
/// positions.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct CountAndFirst<T = u32> {
    pub count: u64,
    pub some: Vec<T>,
}

/// Greatest number of items that are kept.
const KEPT: usize = 1 << 10;

impl<T> Default for CountAndFirst<T> {
    fn default() -> Self {
        Self {
            count: 0,
            some: Vec::new(),
        }
    }
}

impl<T> CountAndFirst<T> {
    pub fn add_item(&mut self, one: T) {
        self.count += 1;
        if self.some.len() < KEPT {
            self.some.push(one);
        }
    }
}

impl<T> FromIterator<T> for CountAndFirst<T> {
    fn from_iter<I: IntoIterator<Item = T>>(all: I) -> Self {
        let mut tally = Self::default();
        all.into_iter().for_each(|one| tally.add_item(one));
        tally
    }
}

/// Whether the meshes of a scene are closed, with their size and volume.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct SolidSummary {
    /// Number of edges with a single triangle, and number of the holes, rims and slits that they bound.
    pub open_edges: u64,
    /// See `open_edges`.
    pub places: u64,
    /// Number of triangles whose orientation differs from most of their part.
    pub flipped_triangles: u64,
    /// Extent of all bounded shapes along each axis, in units of the file.
    pub size: [f64; 3],
    /// Volume in cubic units, without the volume of bubbles. Overlapping parts count twice.
    pub volume: f64,
}

impl SolidSummary {
    /// Summarises the meshes of all objects. `None` if the scene has no mesh.
    pub fn from_scene(scene: &Scene) -> Option<Self> {
        Self::from_topologies(scene, &find_topologies(scene))
    }

    pub(crate) fn from_topologies(
        scene: &Scene,
        topologies: &BTreeMap<usize, Topology>,
    ) -> Option<Self> {
        let (lookup, mut found) = (SceneLookup::new(scene), Self::default());
        // Copies of a body are measured once.
        let mut bodies: HashMap<BTreeSet<usize>, Self> = HashMap::new();
        let mut add_body = |(place, meshes): (DAffine3, BTreeSet<usize>)| {
            let body = bodies.entry(meshes);
            let body =
                body.or_insert_with_key(|all| Self::from_body((scene, &lookup), all, topologies));
            found.open_edges += body.open_edges;
            found.places += body.places;
            found.flipped_triangles += body.flipped_triangles;
            found.volume += body.volume * place.matrix3.determinant().abs();
        };
        // Objects of different meshes that follow one another in one place are one body: one of
        // several materials has a mesh for each.
        let mut body: Option<(DAffine3, BTreeSet<usize>)> = None;
        for object in all_objects(scene) {
            let mesh = lookup.mesh_index(&object.object.shape);
            let Some(mesh) = mesh.filter(|mesh| topologies.contains_key(mesh)) else {
                continue;
            };
            let place = object.object_to_world();
            let here = body.as_mut().filter(|(of, _)| *of == place);
            if !here.is_some_and(|(_, meshes)| meshes.insert(mesh)) {
                body.replace((place, [mesh].into())).map(&mut add_body);
            }
        }
        body.map(&mut add_body);
        let bounds = measure_scene_extent(scene, PrecisionChoice::Reference).bounds;
        found.size = bounds.extent().to_array();
        (!topologies.is_empty()).then_some(found)
    }

    /// Summarises the meshes of one body in their own space, without its size.
    fn from_body(
        (scene, lookup): (&Scene, &SceneLookup<'_>),
        meshes: &BTreeSet<usize>,
        topologies: &BTreeMap<usize, Topology>,
    ) -> Self {
        let data = meshes.iter();
        let data = data.filter_map(|mesh| lookup.mesh_data(&scene.meshes[*mesh].name));
        let has_cap = data.clone().any(|data| data.is_cap);
        let is_open = meshes
            .iter()
            .any(|mesh| topologies[mesh].open_edges.count > 0);
        let whole = (meshes.len() > 1 && is_open).then(|| Topology::from_mesh(&join_meshes(data)));
        let parts = meshes.iter().map(|mesh| &topologies[mesh]);
        let mut found = Self::default();
        for topology in whole.as_ref().map_or(parts.collect(), |whole| vec![whole]) {
            // Edges of a cap end at other places than those of the cut mesh, along one line.
            if !(has_cap && topology.has_slits_alone) {
                found.open_edges += topology.open_edges.count;
                found.places += topology.open_places;
            }
            found.flipped_triangles += topology.flipped.count;
            found.volume += topology
                .components
                .iter()
                .map(|part| part.volume)
                .sum::<f64>();
        }
        found
    }
}

/// Joins the triangles of meshes in one space.
fn join_meshes<'a>(meshes: impl Iterator<Item = &'a Arc<MeshData>>) -> MeshData {
    let mut whole = MeshData::default();
    for data in meshes {
        if whole.positions.is_empty() {
            whole.positions = VertexPositions::with_origin(data.positions.origin());
        }
        let (first, origin) = (whole.positions.len() as u32, whole.positions.origin());
        let offset = |point: DVec3| (point - origin).as_vec3().to_array();
        whole
            .positions
            .extend_offsets(data.positions.iter().map(offset));
        let corners = data.indices.iter();
        whole
            .indices
            .extend(corners.map(|corners| corners.map(|corner| corner + first)));
    }
    whole
}

/// Returns the connectivity of each mesh that objects show, by the index of the mesh.
pub(crate) fn find_topologies(scene: &Scene) -> BTreeMap<usize, Topology> {
    let lookup = SceneLookup::new(scene);
    let generated = scene.generators.iter().map(|generator| &generator.object);
    let objects = scene.objects.iter().chain(generated);
    let shown: BTreeSet<usize> = objects
        .filter_map(|object| lookup.mesh_index(&object.shape))
        .collect();
    let meshes = shown.into_iter().filter_map(|mesh| {
        let data = lookup.mesh_data(&scene.meshes[mesh].name)?;
        Some((mesh, Topology::from_mesh(data)))
    });
    meshes.collect()
}

impl fmt::Display for SolidSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.open_edges {
            0 => f.write_str("yes")?,
            open => write!(
                f,
                "no, {} in {}",
                count_with_unit(open, "open edges"),
                count_with_unit(self.places, "places")
            )?,
        }
        if self.flipped_triangles > 0 {
            write!(
                f,
                ", {} flipped",
                count_with_unit(self.flipped_triangles, "triangles")
            )?;
        }
        let size = self.size.map(format_decimal).join(" x ");
        write!(f, "; size {size}, volume {}", format_decimal(self.volume))
    }
}

/// A side of a triangle: the triangle, and the ends of the side in its direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HalfEdge {
    pub triangle: u32,
    pub ends: [u32; 2],
}

/// A part of a mesh that hangs together by edges of two triangles.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MeshComponent {
    pub triangles: u64,
    /// First triangle of the part.
    pub first: u32,
    /// Signed volume without spikes, positive if most triangles are oriented outwards, and the sum
    /// of the absolute values of its terms, which bounds the rounding error.
    volume: f64,
    volume_terms: f64,
    bounds: Aabb,
    is_closed: bool,
    /// Numbers of the triangles by orientation, relative to the part's root.
    sides: [u64; 2],
}

impl MeshComponent {
    /// Returns whether the part is closed and oriented outwards (`sign` 1) or inwards (-1). Two
    /// coinciding shells of opposite orientation have no volume beyond rounding, and are neither.
    fn is_oriented(&self, sign: f64) -> bool {
        self.is_closed && sign * self.volume > NO_VOLUME * self.volume_terms
    }

    fn encloses(&self, inner: &Self) -> bool {
        let (outer, inner) = (&self.bounds, &inner.bounds);
        outer.min.cmplt(inner.min).all() && outer.max.cmpgt(inner.max).all()
    }
}

/// A hole with three edges.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TriangularHole {
    pub corners: [u32; 3],
    /// A triangle that borders the hole.
    pub beside: u32,
}

/// Connectivity of a mesh.
#[derive(Clone, Debug, Default)]
pub(crate) struct Topology {
    pub faults: TriangleFaults,
    /// Triangles that repeat an earlier triangle: those with the same orientation, and those with
    /// the opposite one.
    pub duplicates: [CountAndFirst; 2],
    pub edges: u64,
    pub open_edges: CountAndFirst<HalfEdge>,
    /// Number of connected groups of open edges.
    open_places: u64,
    /// Whether no group of open edges bounds an area.
    has_slits_alone: bool,
    /// Greatest separation of the corners of a seam, if merging nearly coincident corners closes
    /// all open edges.
    pub seam: Option<f64>,
    /// The holes, if all have three edges.
    pub holes: CountAndFirst<TriangularHole>,
    pub non_manifold_edges: CountAndFirst<HalfEdge>,
    /// Triangles whose orientation differs from most of their part.
    pub flipped: CountAndFirst,
    pub components: Vec<MeshComponent>,
    /// Index of each triangle's part in `components`. `u32::MAX` for repeated and degenerate
    /// triangles.
    component_of: Vec<u32>,
    /// For each part, whether it is closed and oriented inwards, and no cavity of another part.
    is_inverted: Vec<bool>,
}

impl Topology {
    pub fn from_mesh(data: &MeshData) -> Self {
        let corners = weld_vertices(data);
        let mut topology = Self {
            faults: TriangleFaults::from_mesh(data),
            ..Self::default()
        };
        let kept = topology.mark_duplicates(&data.indices, &corners);
        let (mut sheets, mut open, mut irregular) = (Sheets::new(&kept), Vec::new(), Vec::new());
        let mut inconsistent = CountAndFirst::default();
        for run in sorted_sides(&data.indices, &corners, &kept).chunk_by(|a, b| a.0 == b.0) {
            topology.edges += 1;
            let forwards = run.iter().filter(|(_, side)| side & 1 == 0).count();
            let ends = [(run[0].0 >> 32) as u32, run[0].0 as u32];
            let edge = HalfEdge {
                triangle: run[0].1 >> 1,
                ends: if run[0].1 & 1 == 0 {
                    ends
                } else {
                    [ends[1], ends[0]]
                },
            };
            match run.len() {
                1 => open.push(edge),
                2 => {
                    sheets.join([run[0].1 >> 1, run[1].1 >> 1], forwards != 1);
                    if forwards == 1 {
                        continue;
                    }
                    inconsistent.add_item(edge.triangle);
                }
                // Bodies that touch along an edge have as many triangles each way.
                _ if 2 * forwards == run.len() => continue,
                _ => topology.non_manifold_edges.add_item(edge),
            }
            irregular.extend(run.iter().map(|(_, side)| side >> 1));
        }
        topology.seam = seam_width(data, &open);
        if topology.seam.is_none() && FEW * open.len() <= topology.edges as usize {
            topology.holes = triangular_holes(&open).unwrap_or_default();
        }
        let areas = open_areas(data, &open);
        topology.open_places = areas.len() as u64;
        topology.has_slits_alone = areas.into_iter().all(|[area, of]| area <= NEAR * of);
        topology.open_edges = open.into_iter().collect();
        topology.find_components(data, &kept, &mut sheets);
        for triangle in irregular {
            let part = topology.component_of[triangle as usize];
            topology.components[part as usize].is_closed = false;
        }
        topology.flipped = topology.flipped_triangles(&mut sheets);
        // A band with one side has no triangles that are turned more than others.
        if topology.flipped.count == 0 {
            topology.flipped = inconsistent;
        }
        topology.is_inverted = topology.find_inverted_components();
        topology
    }

    /// Returns whether the mesh is closed and consistently oriented. At each edge, as many
    /// triangles run in one direction as in the other.
    pub fn is_closed(&self) -> bool {
        let faults = self.open_edges.count + self.flipped.count + self.non_manifold_edges.count;
        self.edges > 0 && faults == 0
    }

    /// Returns which triangles are kept. Triangles with coinciding corners and repetitions with the
    /// same orientation are dropped. All repetitions are counted in `duplicates`.
    fn mark_duplicates(&mut self, indices: &[[u32; 3]], corners: &[u32]) -> Vec<bool> {
        let mut sorted: Vec<([u32; 3], bool, u32)> = Vec::with_capacity(indices.len());
        for (i, triangle) in indices.iter().enumerate() {
            let own @ [a, b, c] = triangle.map(|corner| corners[corner as usize]);
            if a == b || b == c || c == a {
                continue;
            }
            let mut ordered = own;
            ordered.sort_unstable();
            let is_even = [own, [b, c, a], [c, a, b]].contains(&ordered);
            sorted.push((ordered, is_even, i as u32));
        }
        sorted.par_sort_unstable();
        let mut kept = vec![false; indices.len()];
        for run in sorted.chunk_by(|a, b| a.0 == b.0) {
            kept[run[0].2 as usize] = true;
            for pair in run.windows(2) {
                let turned = pair[1].1 != pair[0].1;
                self.duplicates[usize::from(turned)].add_item(pair[1].2);
                kept[pair[1].2 as usize] = turned;
            }
        }
        kept
    }

    fn find_components(&mut self, data: &MeshData, kept: &[bool], sheets: &mut Sheets) {
        // A spike has so large a volume that it would decide on the orientation of its whole part.
        let spikes = &self.faults.strays.triangles;
        let is_spike = |i: usize| spikes.binary_search(&(i as u32)).is_ok();
        let offset =
            |corner: u32| DVec3::from(data.positions.offsets()[corner as usize].map(f64::from));
        let plain = (0..data.indices.len()).filter(|&i| kept[i] && !is_spike(i));
        let bounds = plain.fold(Aabb::EMPTY, |bounds, i| {
            bounds.union(Aabb::from_points(data.indices[i].map(offset)))
        });
        // The volume of an open part does not depend on its place.
        let middle = if bounds.is_empty() {
            DVec3::ZERO
        } else {
            0.5 * (bounds.min + bounds.max)
        };
        let mut places: HashMap<u32, u32> = HashMap::new();
        self.component_of = vec![u32::MAX; data.indices.len()];
        for (i, triangle) in data.indices.iter().enumerate().filter(|(i, _)| kept[*i]) {
            let (root, turn) = sheets.root(i as u32);
            let index = *places.entry(root).or_insert_with(|| {
                self.components.push(MeshComponent {
                    triangles: 0,
                    first: i as u32,
                    volume: 0.0,
                    volume_terms: 0.0,
                    bounds: Aabb::EMPTY,
                    is_closed: true,
                    sides: [0; 2],
                });
                self.components.len() as u32 - 1
            });
            self.component_of[i] = index;
            let part = &mut self.components[index as usize];
            part.triangles += 1;
            part.sides[usize::from(turn)] += 1;
            if is_spike(i) {
                continue;
            }
            let corners @ [a, b, c] = triangle.map(|corner| offset(corner) - middle);
            let volume = a.dot(b.cross(c)) / if turn { -6.0 } else { 6.0 };
            part.volume += volume;
            part.volume_terms += volume.abs();
            part.bounds = part.bounds.union(Aabb::from_points(corners));
        }
        // Most triangles decide on the orientation of their part.
        for part in &mut self.components {
            if part.sides[1] > part.sides[0] {
                part.volume = -part.volume;
            }
        }
    }

    /// Returns the triangles whose orientation differs from most of their part. In a tie, returns
    /// those that differ from the part's root.
    fn flipped_triangles(&self, sheets: &mut Sheets) -> CountAndFirst {
        let is_turned = |&triangle: &u32| {
            let part = self.component_of[triangle as usize];
            let (_, turn) = sheets.root(triangle);
            let part = self.components.get(part as usize);
            part.is_some_and(|part| turn == (part.sides[1] <= part.sides[0]) && part.sides[1] > 0)
        };
        let triangles = 0..self.component_of.len() as u32;
        triangles.filter(is_turned).collect()
    }

    /// Returns for each part whether it is closed and oriented inwards. Parts inside an
    /// outward-oriented part are left out: they are cavities.
    fn find_inverted_components(&self) -> Vec<bool> {
        if self.components.len() > MOST_PARTS {
            return Vec::new();
        }
        let parts = self.components.iter();
        let is_inverted = |part: &MeshComponent| {
            let mut outer = self.components.iter();
            part.is_oriented(-1.0) && !outer.any(|outer| outer.volume > 0.0 && outer.encloses(part))
        };
        parts.map(is_inverted).collect()
    }

    /// Returns the parts that are inside out: their number of triangles, and the first of each.
    pub fn inverted_parts(&self) -> CountAndFirst {
        let parts = self.components.iter().zip(&self.is_inverted);
        count_parts(
            parts
                .filter(|(_, inverted)| **inverted)
                .map(|(part, _)| part),
        )
    }

    /// Returns whether a triangle belongs to a part that is inside out, and whether it is flipped.
    /// Of a mesh with more flipped triangles than are kept, all `hidden` triangles count as flipped.
    pub fn orientation_of(&self, triangle: u32, hidden: bool) -> [bool; 2] {
        let part = self.component_of.get(triangle as usize).copied();
        let Some(part) = part.filter(|&part| part != u32::MAX) else {
            return [false; 2];
        };
        let tally = &self.flipped;
        let is_flipped = match tally.count > tally.some.len() as u64 {
            true => hidden,
            false => tally.some.contains(&triangle),
        };
        [
            self.is_inverted.get(part as usize) == Some(&true),
            is_flipped,
        ]
    }

    /// Returns closed parts that lie in the box of another closed part, both oriented outwards. If they
    /// are walls of bubbles, they should be oriented inwards.
    pub fn outward_inner_parts(&self) -> CountAndFirst {
        let all = if self.components.len() > MOST_PARTS {
            &[]
        } else {
            &self.components[..]
        };
        let is_filled = |inner: &&MeshComponent| {
            let is_within = |outer: &MeshComponent| outer.is_oriented(1.0) && outer.encloses(inner);
            inner.is_oriented(1.0) && all.iter().any(is_within)
        };
        count_parts(all.iter().filter(is_filled))
    }
}

fn count_parts<'a>(parts: impl Iterator<Item = &'a MeshComponent>) -> CountAndFirst {
    parts.fold(CountAndFirst::default(), |mut tally, part| {
        tally.count += part.triangles;
        tally.some.push(part.first);
        tally
    })
}

/// Sheets of triangles that hang together by edges of two triangles (union-find). Each triangle has
/// a parent, and is turned against it or not.
struct Sheets {
    parents: Vec<u32>,
    turned: Vec<bool>,
}

impl Sheets {
    fn new(kept: &[bool]) -> Self {
        Self {
            parents: (0..kept.len() as u32).collect(),
            turned: vec![false; kept.len()],
        }
    }

    /// Returns the root of a triangle's sheet, and whether the triangle is turned against it.
    fn root(&mut self, triangle: u32) -> (u32, bool) {
        let (mut index, mut turn) = (triangle as usize, false);
        while self.parents[index] as usize != index {
            let parent = self.parents[index] as usize;
            self.parents[index] = self.parents[parent];
            self.turned[index] ^= self.turned[parent];
            turn ^= self.turned[index];
            index = self.parents[index] as usize;
        }
        (index as u32, turn)
    }

    /// Joins the sheets of two triangles. Returns whether they were apart.
    fn join(&mut self, triangles: [u32; 2], disagree: bool) -> bool {
        let [(a, turn_a), (b, turn_b)] = triangles.map(|triangle| self.root(triangle));
        if a != b {
            self.parents[a.max(b) as usize] = a.min(b);
            self.turned[a.max(b) as usize] = turn_a ^ turn_b ^ disagree;
        }
        a != b
    }
}

/// Returns for each vertex the first vertex at the same position.
fn weld_vertices(data: &MeshData) -> Vec<u32> {
    let offsets = data.positions.offsets();
    // Both zeros are one place.
    let key = |vertex: u32| offsets[vertex as usize].map(|x| (x + 0.0).to_bits());
    let vertices = (0..offsets.len() as u32).into_par_iter();
    let mut order: Vec<([u32; 3], u32)> = vertices.map(|vertex| (key(vertex), vertex)).collect();
    order.par_sort_unstable();
    let mut first = vec![0; offsets.len()];
    for run in order.chunk_by(|a, b| a.0 == b.0) {
        run.iter()
            .for_each(|&(_, vertex)| first[vertex as usize] = run[0].1);
    }
    first
}

/// Returns the sides of the kept triangles, sorted. Each entry holds two values:
/// - The smaller corner in the upper 32 bits, the larger corner in the lower ones.
/// - Twice the triangle's index, plus 1 if the triangle runs from the larger to the smaller corner.
fn sorted_sides(indices: &[[u32; 3]], corners: &[u32], kept: &[bool]) -> Vec<(u64, u32)> {
    let mut sides: Vec<(u64, u32)> = Vec::with_capacity(3 * indices.len());
    for (i, triangle) in indices.iter().enumerate().filter(|(i, _)| kept[*i]) {
        let [a, b, c] = triangle.map(|corner| corners[corner as usize]);
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let key = u64::from(from.min(to)) << 32 | u64::from(from.max(to));
            sides.push((key, 2 * i as u32 + u32::from(from > to)));
        }
    }
    sides.par_sort_unstable();
    sides
}

/// Returns for each connected group of open edges the length of its area vector, and the square of
/// the length of its edges. The vector is zero for edges along one line.
fn open_areas(data: &MeshData, open: &[HalfEdge]) -> Vec<[f64; 2]> {
    let mut first: HashMap<u32, u32> = HashMap::new();
    let mut sheets = Sheets::new(&vec![true; open.len()]);
    for (index, edge) in open.iter().enumerate() {
        for corner in edge.ends {
            let other = *first.entry(corner).or_insert(index as u32);
            sheets.join([other, index as u32], false);
        }
    }
    let mut sums: BTreeMap<u32, (DVec3, f64)> = BTreeMap::new();
    for (index, edge) in open.iter().enumerate() {
        let root = sheets.root(index as u32).0;
        let start = data
            .positions
            .position(open[root as usize].ends[0] as usize);
        let ends = edge
            .ends
            .map(|end| data.positions.position(end as usize) - start);
        let sum = sums.entry(root).or_default();
        sum.0 += 0.5 * ends[0].cross(ends[1]);
        sum.1 += ends[0].distance(ends[1]);
    }
    let areas = sums.into_values();
    areas
        .map(|(area, length)| [area.length(), length * length])
        .collect()
}

/// Returns the holes of open edges, if all have three edges. `None` if there is any other open edge.
fn triangular_holes(open: &[HalfEdge]) -> Option<CountAndFirst<TriangularHole>> {
    let next: HashMap<u32, &HalfEdge> = open.iter().map(|edge| (edge.ends[0], edge)).collect();
    let mut holes = CountAndFirst::default();
    for edge in open.iter().filter(|_| next.len() == open.len()) {
        let second = next.get(&edge.ends[1])?;
        let third = next.get(&second.ends[1])?;
        let corners = [edge, second, third].map(|edge| edge.ends[0]);
        // A triangle by itself has such edges too.
        if third.ends[1] != corners[0] || edge.triangle == second.triangle {
            return None;
        }
        // Each hole has three edges.
        if corners[0] < corners[1].min(corners[2]) {
            let beside = edge.triangle;
            holes.add_item(TriangularHole { corners, beside });
        }
    }
    Some(holes)
}

/// Returns the greatest separation of the corners of a seam: a slit so narrow that the corners on
/// both sides nearly coincide, as rounding or an export leaves them. `None` unless all open edges
/// close when nearly coincident corners are merged.
fn seam_width(data: &MeshData, open: &[HalfEdge]) -> Option<f64> {
    let at = |corner: u32| data.positions.position(corner as usize);
    let bounds = Aabb::from_points(data.positions.iter());
    let reach = NEAR * bounds.extent().length();
    if open.is_empty() || reach == 0.0 || !reach.is_finite() {
        return None;
    }
    let corners: BTreeSet<u32> = open.iter().flat_map(|edge| edge.ends).collect();
    let mut cells: HashMap<[i64; 3], u32> = HashMap::with_capacity(corners.len());
    let mut merged: HashMap<u32, u32> = HashMap::with_capacity(corners.len());
    let mut apart: f64 = 0.0;
    for corner in corners {
        let position = at(corner);
        let cell = ((position - bounds.min) / reach).floor().as_i64vec3();
        let near = (0..27)
            .map(|i| cell + glam::I64Vec3::new(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1))
            .filter_map(|cell| cells.get(&cell.to_array()).copied())
            .map(|other| (at(other).distance(position), other))
            .filter(|(distance, _)| *distance <= reach)
            .min_by(|a, b| a.0.total_cmp(&b.0));
        let (distance, other) = near.unwrap_or((0.0, corner));
        apart = apart.max(distance);
        merged.insert(corner, other);
        if near.is_none() {
            cells.entry(cell.to_array()).or_insert(corner);
        }
    }
    let mut balance: HashMap<[u32; 2], i64> = HashMap::new();
    for edge in open {
        let [from, to] = edge.ends.map(|corner| merged[&corner]);
        if from != to {
            let direction = if from < to { 1 } else { -1 };
            *balance.entry([from.min(to), from.max(to)]).or_insert(0) += direction;
        }
    }
    let is_closed = apart > 0.0 && balance.values().all(|&ways| ways == 0);
    is_closed.then_some(apart)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: a count counts all items and keeps the first ones up to the limit.
    #[test]
    fn a_count_keeps_the_first() {
        for all in [0, 3, KEPT, KEPT + 7] {
            let tally: CountAndFirst<usize> = (0..all).collect();
            assert_eq!(tally.count, all as u64);
            assert_eq!(tally.some, (0..all.min(KEPT)).collect::<Vec<_>>());
        }
    }

    /// Two triangles back to back. The second is shifted by `apart` along x.
    fn pillow(apart: f32) -> MeshData {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.3_f32]];
        let moved = corners.map(|[x, y, z]| [x + apart, y, z]);
        let positions: Vec<[f32; 3]> = corners.into_iter().chain(moved).collect();
        let data = serde_json::json!({ "positions": positions, "indices": [[0, 1, 2], [3, 5, 4]] });
        serde_json::from_value(data).unwrap_or_else(|e| panic!("{e}"))
    }

    /// Protects: edges opened by rounding or by narrow cracks are a seam with the right width. The
    /// wider edges of a hole are no seam.
    #[test]
    fn a_seam_is_no_hole() {
        let value_of = |apart| {
            let topology = Topology::from_mesh(&pillow(apart));
            (topology.open_edges.count, topology.seam)
        };
        let (open, seam) = value_of(1e-6);
        assert_eq!(open, 6);
        assert!(
            seam.is_some_and(|wide| (wide - 1e-6).abs() < 1e-7),
            "{seam:?}"
        );
        assert!(value_of(1e-4).1.is_some());
        assert_eq!(value_of(1e-3), (6, None));
    }
}
