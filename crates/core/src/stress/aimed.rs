//! Rays that are aimed from the camera at edges between triangles, all of which must meet something no farther away.

use std::collections::BTreeMap;

use glam::DVec3;
use rayon::prelude::*;
use raywright_bvh::{Interval, Ray, Real, Vector};

use super::Deadline;
use super::facts::{SceneFacts, unit};
use super::finding::CheckRun;
use super::topology::{SharedEdge, Topology};
use crate::generate::{PlacedObject, all_about};
use crate::prepare::Prepared;
use crate::scene::{MeshData, SideRule};

/// Rays in all, objects that they are aimed at, and rays between two looks at the clock.
const RAYS: u64 = 40_000;
const OBJECTS: usize = 1000;
const BLOCK: u64 = 4096;

/// Sine of the angle at which a triangle is seen below which its edges are not aimed at, and how many times the rounding of a ray's way its height has to be.
const SLANT: f64 = 0.05;
const ROOM: f64 = 1024.0;

/// What aimed rays found.
#[derive(Clone, Debug, Default)]
pub(crate) struct AimedRays {
    pub sent: u64,
    pub planned: u64,
    /// Rays that passed, by the facts of their object, and where the first did.
    pub leaks: BTreeMap<usize, (u64, DVec3)>,
}

impl AimedRays {
    pub fn run(&self) -> CheckRun {
        CheckRun { name: "rays aimed at edges", looked_at: self.sent, unit: "rays", planned: self.planned }
    }
}

/// A mesh in its place.
struct Target<'a> {
    object: usize,
    data: &'a MeshData,
    shared: &'a [SharedEdge],
    shown: PlacedObject<'a>,
}

/// The meshes that rays are aimed at.
pub(crate) struct EdgeAim<'a> {
    pub facts: &'a SceneFacts<'a>,
    pub topologies: &'a BTreeMap<usize, Topology>,
}

impl EdgeAim<'_> {
    /// Sends the rays from the middle of the camera.
    pub fn send<R: Real>(&self, prepared: &Prepared<R>, seed: u64, deadline: &Deadline<'_>) -> AimedRays {
        aim(prepared, &targets(prepared, self.facts, self.topologies), seed, deadline)
    }
}

fn aim<R: Real>(prepared: &Prepared<R>, targets: &[Target<'_>], seed: u64, deadline: &Deadline<'_>) -> AimedRays {
    let mut found = AimedRays { planned: if targets.is_empty() { 0 } else { RAYS }, ..AimedRays::default() };
    let half = prepared.camera.ray(R::ZERO, R::ZERO, [0.5; 2]);
    let eye = half.origin.to_f64();
    while found.sent < found.planned && (found.sent == 0 || !deadline.is_over()) {
        let until = (found.sent + BLOCK).min(found.planned);
        let leak = |index: u64| {
            let target = &targets[(index % targets.len() as u64) as usize];
            leak(prepared, target, eye, [seed, index]).map(|place| (target.object, place))
        };
        let leaks: Vec<_> = (found.sent..until).into_par_iter().filter_map(leak).collect();
        for (object, place) in leaks {
            found.leaks.entry(object).or_insert((0, prepared.in_world(R::Vec3::from_f64(place)))).0 += 1;
        }
        found.sent = until;
    }
    found
}

fn targets<'a, R: Real>(
    prepared: &Prepared<R>,
    facts: &SceneFacts<'a>,
    topologies: &'a BTreeMap<usize, Topology>,
) -> Vec<Target<'a>> {
    let all: Vec<Target<'a>> = all_about(facts.scene, prepared.origin.origin)
        .enumerate()
        .filter(|(_, shown)| matches!(shown.object.side, SideRule::Both | SideRule::Culled) && shown.ends().is_none())
        .filter_map(|(index, shown)| {
            let (mesh, data) = facts.mesh(shown.object)?;
            let shared = &topologies.get(&mesh)?.shared;
            let object = facts.index_of(index as u32);
            (!shared.is_empty()).then_some(Target { object, data, shared, shown })
        })
        .collect();
    let every = (all.len() / OBJECTS).max(1);
    all.into_iter().step_by(every).collect()
}

/// The place at which a ray passes an edge that it is aimed at; none where it meets something, or where rounding may lead it past both triangles.
fn leak<R: Real>(prepared: &Prepared<R>, target: &Target<'_>, eye: DVec3, [seed, index]: [u64; 2]) -> Option<DVec3> {
    let number = |which: u64| unit(seed, index, 32 + which);
    let edge = target.shared[(number(0) * target.shared.len() as f64) as usize];
    let map = target.shown.map();
    let at = |corner: u32| map.transform_point3(target.data.positions.at(corner as usize));
    let ([a, b], across) = (edge.ends.map(at), edge.across.map(at));
    let point = a + (b - a) * (0.1 + 0.8 * number(1));
    let way = point - eye;
    let (distance, along) = (way.length(), (b - a).normalize_or_zero());
    let direction = way / distance;
    let slants = across.map(|corner| {
        let beside = corner - a;
        let height = beside - along * beside.dot(along);
        (along.cross(height).normalize_or_zero().dot(direction), height.length())
    });
    // One triangle lies to the left of the edge and the other to its right, so that they face the same way where the signs differ.
    let is_faced = slants[0].0 * slants[1].0 < 0.0 && slants.iter().all(|(slant, _)| slant.abs() > SLANT);
    let rounding = R::ROUNDOFF.to_f64() * (distance + point.abs().max_element() + eye.abs().max_element());
    let has_room =
        slants.iter().all(|(slant, height)| height * slant.abs() > ROOM * rounding) && (b - a).length() > ROOM * rounding;
    if !is_faced || !has_room {
        return None;
    }
    let ray = Ray::new(R::Vec3::from_f64(eye), R::Vec3::from_f64(direction));
    let hit = prepared.geometry.closest(&ray, Interval::positive(), &mut ());
    let farthest = distance * (1.0 + 1e-6) + ROOM * rounding / SLANT;
    hit.is_none_or(|hit| hit.t.to_f64() > farthest).then_some(point)
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;
    use crate::scene::Scene;
    use crate::settings::Settings;

    /// A ball of triangles with so many of them.
    fn globe(triangles: usize) -> Scene {
        const SIDES: usize = 24;
        let at = |row: usize, column: usize| -> [f64; 3] {
            let [a, b] = [(row, SIDES), (2 * column, SIDES)].map(|(i, of)| core::f64::consts::PI * i as f64 / of as f64);
            [libm::sin(a) * libm::cos(b), libm::cos(a), libm::sin(a) * libm::sin(b)]
        };
        let place = |row: usize, column: usize| row * SIDES + column % SIDES;
        let positions: Vec<[f64; 3]> = (0..=SIDES).flat_map(|row| (0..SIDES).map(move |column| at(row, column))).collect();
        let cell = |(row, column)| {
            let [a, b, c, d] = [place(row, column), place(row, column + 1), place(row + 1, column + 1), place(row + 1, column)];
            [[a, b, c], [a, c, d]]
        };
        let indices: Vec<[usize; 3]> =
            (0..SIDES).flat_map(|row| (0..SIDES).map(move |column| (row, column))).flat_map(cell).take(triangles).collect();
        let scene: Value = json!({
            "format": 1,
            "cameras": [{ "pose": { "look_at": { "eye": [1, 2, 5], "target": [0, 0, 0] } }, "projection": { "pinhole": { "vertical_fov": 40 } } }],
            "materials": [{ "name": "paint", "model": { "physical": {} } }],
            "meshes": [{ "name": "globe", "source": { "inline": { "positions": positions, "indices": indices } } }],
            "objects": [{ "shape": { "mesh": "globe" }, "material": "paint" }],
        });
        serde_json::from_value(scene).unwrap_or_else(|e| panic!("{e}"))
    }

    /// Protects: of a mesh that is there no aimed ray passes an edge, and of one of which a half is missing many do, in each precision.
    #[test]
    fn leaks_are_found() {
        let whole = globe(usize::MAX);
        let facts = SceneFacts::new(&whole, crate::dispatch::extent(&whole, Default::default()).bounds);
        let topologies = super::super::meshes::topologies(&facts);
        let deadline = Deadline { observer: &(), end: None };
        for precision in [crate::settings::PrecisionChoice::Robust, crate::settings::PrecisionChoice::Reference] {
            let leaks = |scene: &Scene| {
                let settings = Settings { precision, ..Settings::of(scene) };
                let ready = crate::prepare(scene, &settings, &()).unwrap_or_else(|e| panic!("{e}"));
                let rays = ready.aim_at_edges(&EdgeAim { facts: &facts, topologies: &topologies }, 7, &deadline);
                assert_eq!(rays.sent, rays.planned);
                rays.leaks.values().map(|(count, _)| *count).sum::<u64>()
            };
            assert_eq!(leaks(&whole), 0);
            let some = leaks(&globe(576));
            assert!(some > 1000, "{some}");
        }
    }
}
