//! Rays aimed from a camera at shared edges and corners of meshes. A watertight mesh lets none of
//! them pass: each must hit a surface at the distance of the target or nearer.

use std::collections::BTreeMap;

use glam::DVec3;
use rayon::prelude::*;
use raywright_bvh::{Interval, Ray, Real, Vector};

use super::RayDeadline;
use super::facts::{SceneFacts, unit_random};
use super::fans::TriangleFan;
use super::finding::CheckRun;
use super::topology::{SharedEdge, Topology};
use crate::dispatch::PreparedSceneTask;
use crate::generate::{PlacedObject, objects_relative_to};
use crate::prepare::PreparedScene;
use crate::scene::{MeshData, SideRule};

/// Limits on the work for each camera:
/// - `RAYS`: number of rays.
/// - `OBJECTS`: greatest number of objects at which rays are aimed, approximately.
/// - `BLOCK`: number of rays between two checks of the time limit.
const RAYS: u64 = 40_000;
const OBJECTS: usize = 1000;
const BLOCK: u64 = 4096;

/// Limits on the triangles beside a target. A ray is aimed at the target only if all of them are
/// within these limits:
/// - `SLANT`: least cosine between the ray and the triangle's normal.
/// - `ROOM`: least width of the triangle as seen along the ray, in multiples of the ray's rounding
///   error.
const SLANT: f64 = 0.05;
const ROOM: f64 = 1024.0;

/// Result of the rays aimed at edges and corners.
#[derive(Clone, Debug, Default)]
pub(crate) struct AimedRayResult {
    pub sent: u64,
    pub planned: u64,
    /// Number of rays that passed, and the world position of the first target that a ray passed.
    /// The key is the object's index in `SceneFacts::objects`.
    pub leaks: BTreeMap<usize, (u64, DVec3)>,
}

impl AimedRayResult {
    pub fn to_check_run(&self) -> CheckRun {
        CheckRun {
            name: "rays aimed at edges and corners",
            looked_at: self.sent,
            unit: "rays",
            planned: self.planned,
        }
    }
}

/// A mesh as placed by an object, with its targets.
struct MeshInstance<'a> {
    object: usize,
    data: &'a MeshData,
    shared: &'a [SharedEdge],
    fans: &'a [TriangleFan],
    placed_object: PlacedObject<'a>,
}

/// Task that traces rays at edges and corners of the scene's meshes.
pub(super) struct AimedRayTask<'a> {
    pub scene_facts: &'a SceneFacts<'a>,
    pub topologies: &'a BTreeMap<usize, Topology>,
    pub seed: u64,
    pub deadline: &'a RayDeadline<'a>,
}

impl PreparedSceneTask for AimedRayTask<'_> {
    type Output = AimedRayResult;

    /// Traces the rays from the middle of the camera's lens.
    fn run<R: Real>(&self, prepared: &PreparedScene<R>) -> AimedRayResult {
        trace_aimed_rays(
            prepared,
            &select_target_meshes(prepared, self.scene_facts, self.topologies),
            self.seed,
            self.deadline,
        )
    }
}

fn trace_aimed_rays<R: Real>(
    prepared: &PreparedScene<R>,
    targets: &[MeshInstance<'_>],
    seed: u64,
    deadline: &RayDeadline<'_>,
) -> AimedRayResult {
    let mut found = AimedRayResult {
        planned: if targets.is_empty() { 0 } else { RAYS },
        ..AimedRayResult::default()
    };
    let half = prepared.camera.generate_ray(R::ZERO, R::ZERO, [0.5; 2]);
    let eye = half.origin.to_f64();
    while found.sent < found.planned && (found.sent == 0 || !deadline.has_passed()) {
        let until = (found.sent + BLOCK).min(found.planned);
        let leak = |index: u64| {
            let target = &targets[(index % targets.len() as u64) as usize];
            find_leak_point(prepared, target, eye, [seed, index])
                .map(|position| (target.object, position))
        };
        let leaks: Vec<_> = (found.sent..until)
            .into_par_iter()
            .filter_map(leak)
            .collect();
        for (object, position) in leaks {
            found
                .leaks
                .entry(object)
                .or_insert((0, prepared.to_world(R::Vec3::from_f64(position))))
                .0 += 1;
        }
        found.sent = until;
    }
    found
}

fn select_target_meshes<'a, R: Real>(
    prepared: &PreparedScene<R>,
    scene_facts: &SceneFacts<'a>,
    topologies: &'a BTreeMap<usize, Topology>,
) -> Vec<MeshInstance<'a>> {
    let all: Vec<MeshInstance<'a>> = objects_relative_to(scene_facts.scene, prepared.origin.origin)
        .enumerate()
        .filter(|(_, placed_object)| {
            matches!(placed_object.object.side, SideRule::Both | SideRule::Culled)
                && placed_object.object_to_world_at_ends().is_none()
        })
        .filter_map(|(index, placed_object)| {
            let (mesh, data) = scene_facts.mesh_of_object(placed_object.object)?;
            let Topology {
                shared_edges: shared,
                fans,
                ..
            } = topologies.get(&mesh)?;
            let object = scene_facts.facts_index(index as u32);
            (!shared.is_empty()).then_some(MeshInstance {
                object,
                data,
                shared,
                fans,
                placed_object,
            })
        })
        .collect();
    let every = (all.len() / OBJECTS).max(1);
    all.into_iter().step_by(every).collect()
}

/// A target on an edge or at a corner, with its adjacent triangles. For each triangle: the cosine
/// between its normal and the ray, and the distance in metres by which a ray must err to miss it.
struct EdgePoint {
    point: DVec3,
    faces: Vec<[f64; 2]>,
}

impl MeshInstance<'_> {
    /// Returns a random target on an edge or at a corner, relative to the origin of stored
    /// coordinates.
    fn sample_edge_point(&self, eye: DVec3, number: impl Fn(u64) -> f64) -> Option<EdgePoint> {
        let map = self.placed_object.object_to_world();
        let at = |corner: u32| map.transform_point3(self.data.positions.position(corner as usize));
        let pick = |count: usize| (number(0) * count as f64) as usize;
        if number(2) < 0.5 && !self.fans.is_empty() {
            let fan = &self.fans[pick(self.fans.len())];
            let point = at(fan.corner);
            let direction = (point - eye).normalize();
            let face = |&[b, c]: &[u32; 2]| {
                let [b, c] = [at(b) - point, at(c) - point];
                let normal = b.cross(c);
                [
                    normal.normalize_or_zero().dot(direction),
                    normal.length() / (c - b).length(),
                ]
            };
            return Some(EdgePoint {
                point,
                faces: fan.across.iter().map(face).collect(),
            });
        }
        let edge = self.shared.get(pick(self.shared.len()))?;
        let ([a, b], across) = (edge.ends.map(at), edge.across.map(at));
        let point = a + (b - a) * (0.1 + 0.8 * number(1));
        let (along, direction) = ((b - a).normalize_or_zero(), (point - eye).normalize());
        // One triangle lies to the left of the edge and the other to its right.
        let face = |(corner, sign): (DVec3, f64)| {
            let beside = corner - a;
            let height = beside - along * beside.dot(along);
            [
                sign * along.cross(height).normalize_or_zero().dot(direction),
                height.length().min((b - a).length()),
            ]
        };
        Some(EdgePoint {
            point,
            faces: [(across[0], 1.0), (across[1], -1.0)].map(face).into(),
        })
    }
}

/// Returns the target if a ray aimed at it goes through the surface without a hit. Returns `None` if
/// the ray hits a surface, or if the ray's own rounding may explain the miss.
fn find_leak_point<R: Real>(
    prepared: &PreparedScene<R>,
    target: &MeshInstance<'_>,
    eye: DVec3,
    [seed, index]: [u64; 2],
) -> Option<DVec3> {
    let EdgePoint { point, faces } =
        target.sample_edge_point(eye, |selected| unit_random(seed, index, 32 + selected))?;
    let (distance, side) = (point.distance(eye), faces.first()?[0]);
    let rounding =
        R::ROUNDOFF.to_f64() * (distance + point.abs().max_element() + eye.abs().max_element());
    let is_clear = |&[slant, width]: &[f64; 2]| {
        slant * side > 0.0 && slant.abs() > SLANT && width * slant.abs() > ROOM * rounding
    };
    if !faces.iter().all(is_clear) {
        return None;
    }
    let ray = Ray::new(
        R::Vec3::from_f64(eye),
        R::Vec3::from_f64((point - eye) / distance),
    );
    let hit = prepared
        .geometry
        .closest(&ray, Interval::positive(), &mut ());
    let farthest = distance * (1.0 + 1e-6) + ROOM * rounding / SLANT;
    hit.is_none_or(|hit| hit.t.to_f64() > farthest)
        .then_some(point)
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;
    use crate::scene::Scene;
    use crate::settings::Settings;

    /// A scene with a ball of triangles, of which only the first `triangles` are kept.
    fn globe(triangles: usize) -> Scene {
        const SIDES: usize = 24;
        let at = |row: usize, column: usize| -> [f64; 3] {
            let [a, b] = [(row, SIDES), (2 * column, SIDES)]
                .map(|(i, total)| core::f64::consts::PI * i as f64 / total as f64);
            [
                libm::sin(a) * libm::cos(b),
                libm::cos(a),
                libm::sin(a) * libm::sin(b),
            ]
        };
        let place = |row: usize, column: usize| row * SIDES + column % SIDES;
        let positions: Vec<[f64; 3]> = (0..=SIDES)
            .flat_map(|row| (0..SIDES).map(move |column| at(row, column)))
            .collect();
        let cell = |(row, column)| {
            let [a, b, c, d] = [
                place(row, column),
                place(row, column + 1),
                place(row + 1, column + 1),
                place(row + 1, column),
            ];
            [[a, b, c], [a, c, d]]
        };
        let indices: Vec<[usize; 3]> = (0..SIDES)
            .flat_map(|row| (0..SIDES).map(move |column| (row, column)))
            .flat_map(cell)
            .take(triangles)
            .collect();
        let scene: Value = json!({
            "format": 1,
            "cameras": [{ "pose": { "look_at": { "eye": [1, 2, 5], "target": [0, 0, 0] } }, "projection": { "pinhole": { "vertical_fov": 40 } } }],
            "materials": [{ "name": "paint", "model": { "physical": {} } }],
            "meshes": [{ "name": "globe", "source": { "inline": { "positions": positions, "indices": indices } } }],
            "objects": [{ "shape": { "mesh": "globe" }, "material": "paint" }],
        });
        serde_json::from_value(scene).unwrap_or_else(|e| panic!("{e}"))
    }

    /// Protects: aimed rays pass no edge of a complete mesh. They pass many edges when half of the
    /// mesh is missing. Both hold in each precision.
    #[test]
    fn leaks_are_found() {
        let whole = globe(usize::MAX);
        let scene_facts = SceneFacts::new(
            &whole,
            crate::dispatch::measure_scene_extent(&whole, Default::default()).bounds,
        );
        let topologies = super::super::meshes::mesh_topologies(&scene_facts);
        let deadline = RayDeadline {
            observer: &(),
            end: None,
        };
        for precision in [
            crate::settings::PrecisionChoice::Robust,
            crate::settings::PrecisionChoice::Reference,
        ] {
            let leaks = |scene: &Scene| {
                let settings = Settings {
                    precision,
                    ..Settings::from_scene(scene)
                };
                let ready = crate::prepare(scene, &settings, &()).unwrap_or_else(|e| panic!("{e}"));
                let rays = ready.run_task(&AimedRayTask {
                    scene_facts: &scene_facts,
                    topologies: &topologies,
                    seed: 7,
                    deadline: &deadline,
                });
                assert_eq!(rays.sent, rays.planned);
                rays.leaks.values().map(|(count, _)| *count).sum::<u64>()
            };
            assert_eq!(leaks(&whole), 0);
            let some = leaks(&globe(576));
            assert!(some > 1000, "{some}");
        }
    }
}
