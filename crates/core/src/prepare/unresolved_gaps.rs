//! Detection of gaps beside transmissive surfaces that are too narrow to be rendered. Where a gap
//! is narrower than the error bound of a hit, a ray that leaves one surface starts beyond the
//! other. The picture then lacks the gap.

use glam::DVec3;
use raywright_bvh::{Hit, Interval, Ray, Real, Vector};

use super::{PreparedScene, PreparedSpawnRule};

/// Numbers of search rays along the width and the height of the picture.
const GRID_RAYS: [u32; 2] = [32, 18];

/// Greatest number of surfaces along a ray that are tested for a gap.
const MAX_HITS: usize = 16;

/// A gap between two objects that is too narrow to be rendered: rays that leave one surface start
/// beyond the other. Of partly transparent surfaces in one place, rays that pass the first pass the
/// others too.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct UnresolvedGap {
    /// Index of the transmissive object in the scene's list of objects; generated objects follow
    /// the listed objects.
    pub object: usize,
    /// Index of the object on the far side of the gap. Rays spawned at `object` start beyond this
    /// object's surface.
    pub other: usize,
    /// Least width in metres that the gap must have here, so that rays resolve it.
    pub resolved_width: f64,
    /// Whether partly transparent surfaces of the two lie in one place. No precision then shows the
    /// second.
    pub is_coincident: bool,
    /// Number of the search rays that find the gap in front of all opaque surfaces.
    pub rays: u32,
    /// World position of the gap, on the first such ray if there is one.
    pub place: DVec3,
}

impl<R: Real> PreparedScene<R> {
    /// Returns the pairs of objects with unresolved gaps, each pair once. They are searched along
    /// 576 straight rays through a picture of the given size. A scene with a constant ray offset
    /// closes gaps on purpose, so the list is then empty.
    pub(crate) fn find_unresolved_gaps(&self, [width, height]: [u32; 2]) -> Vec<UnresolvedGap> {
        let mut gaps: Vec<UnresolvedGap> = Vec::new();
        if !matches!(self.rules.spawn, PreparedSpawnRule::ErrorBound)
            || self.materials.iter().all(|material| material.is_opaque())
        {
            return gaps;
        }
        let at = |i: u32, total: u32, edge: u32| {
            R::from_f64((f64::from(i) + 0.5) / f64::from(total) * f64::from(edge))
        };
        for i in 0..GRID_RAYS[0] * GRID_RAYS[1] {
            let (x, y) = (
                at(i % GRID_RAYS[0], GRID_RAYS[0], width),
                at(i / GRID_RAYS[0], GRID_RAYS[1], height),
            );
            self.find_gaps_along_ray(&self.camera.generate_ray(x, y, [0.5; 2]), &mut gaps);
        }
        gaps
    }

    /// Adds the unresolved gaps along a ray that passes straight through surfaces.
    fn find_gaps_along_ray(&self, ray: &Ray<R>, gaps: &mut Vec<UnresolvedGap>) {
        let (mut range, mut is_seen) = (Interval::positive(), true);
        for _ in 0..MAX_HITS {
            let Some(hit) = self.geometry.closest(ray, range, &mut ()) else {
                return;
            };
            let before = core::mem::replace(&mut range.min, hit.t);
            let object = hit.outermost_id();
            let material = &self.materials[self.objects[object as usize].material as usize];
            if material.is_opaque() {
                is_seen = false;
                continue;
            }
            let surface = self.geometry.surface(ray, &hit);
            let [above, below] =
                [surface.normal, -surface.normal].map(|side| surface.spawn_ray_origin(side));
            let width = (above - below).length();
            let mut others: Vec<(u32, bool)> = [[above, below], [below, above]]
                .into_iter()
                .filter_map(|ends| self.find_first_object_except(ends, ray.time, object))
                .map(|other| (other, false))
                .collect();
            if !material.blocks_straight_rays() {
                // At a distance the width may be less than a step of `t`.
                let zone = Interval {
                    min: before,
                    max: (hit.t + width).next_up(),
                };
                let coincident = self.list_coincident_objects(ray, &hit, zone);
                others.extend(coincident.into_iter().map(|other| (other, true)));
            }
            for (other, is_coincident) in others {
                let gap = UnresolvedGap {
                    object: object as usize,
                    other: other as usize,
                    resolved_width: width.to_f64(),
                    is_coincident,
                    rays: u32::from(is_seen),
                    place: self.to_world(surface.point),
                };
                match gaps
                    .iter_mut()
                    .find(|known| (known.object, known.other) == (gap.object, gap.other))
                {
                    Some(known) => {
                        known.resolved_width = known.resolved_width.max(gap.resolved_width);
                        if known.rays == 0 {
                            known.place = gap.place;
                        }
                        known.rays += gap.rays;
                    }
                    None => gaps.push(gap),
                }
            }
        }
    }

    /// Lists the objects of the other passable surfaces that a ray crosses in `zone`, where it also
    /// hits a surface, in ascending order. A ray that passes that surface passes them too, unseen.
    fn list_coincident_objects(&self, ray: &Ray<R>, hit: &Hit<R>, zone: Interval<R>) -> Vec<u32> {
        let primitive = |hit: &Hit<R>| [hit.instance, hit.object, hit.primitive];
        let mut objects = Vec::new();
        let mut add_other = |found: &Hit<R>| {
            if primitive(found) != primitive(hit) {
                objects.push(found.outermost_id());
            }
            false
        };
        self.geometry.occluded(ray, zone, &mut add_other, &mut ());
        objects.sort_unstable();
        objects
    }

    /// Returns the object of the closest hit between two points; `None` without a hit, or if the
    /// object is `own`.
    fn find_first_object_except(&self, [from, to]: [R::Vec3; 2], time: R, own: u32) -> Option<u32> {
        let across = to - from;
        let length = across.length();
        let range = Interval {
            min: R::ZERO,
            max: length,
        };
        let hit = self.geometry.closest(
            &Ray::new(from, across / length).with_time(time),
            range,
            &mut (),
        )?;
        Some(hit.outermost_id()).filter(|&object| object != own)
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use crate::scene::Scene;
    use crate::settings::{PrecisionChoice, Settings};

    fn mesh(name: &str, indices: &[[u32; 3]]) -> Value {
        let positions = [[-1, 0, 1], [1, 0, 1], [0, 0, -1]];
        json!({ "name": name, "source": { "inline": { "positions": positions, "indices": indices } } })
    }

    /// Closed gaps in a scene of these objects, glass by the name `g`, seen from four metres.
    fn pairs(precision: PrecisionChoice, objects: &[(&str, Value)]) -> Vec<(usize, usize)> {
        let objects: Vec<Value> = objects
            .iter()
            .map(|(material, shape)| json!({ "shape": shape, "material": material }))
            .collect();
        let scene: Scene = serde_json::from_value(json!({
            "format": 1,
            "cameras": [{ "pose": { "look_at": { "eye": [0.2, 1.4, 4], "target": [0, 0, 0] } },
                          "projection": { "pinhole": { "vertical_fov": 40 } } }],
            "materials": [{ "name": "g", "model": { "physical": { "transmission": 1, "roughness": 0 } } },
                          { "name": "v", "model": { "physical": { "alpha": "blend", "opacity": 0.5 } } },
                          { "name": "w", "model": { "classic": { "colour": 1 } } }],
            "meshes": [mesh("once", &[[0, 1, 2]]), mesh("twice", &[[0, 1, 2], [0, 1, 2]])],
            "objects": objects,
        }))
        .unwrap_or_else(|e| panic!("{e}"));
        let ready = crate::prepare(
            &scene,
            &Settings {
                precision,
                ..Settings::from_scene(&scene)
            },
            &(),
        )
        .unwrap_or_else(|e| panic!("{e}"));
        let found = ready.find_unresolved_gaps();
        assert!(
            found
                .iter()
                .all(|gap| gap.resolved_width > 0.0 && gap.resolved_width < 1e-5),
            "{found:?}"
        );
        found.iter().map(|gap| (gap.object, gap.other)).collect()
    }

    fn ball(radius: f64) -> Value {
        json!({ "sphere": { "centre": [0, 0, 0], "radius": radius } })
    }

    fn block(y: [f64; 2]) -> Value {
        json!({ "box": { "min": [-1, y[0], -1], "max": [1, y[1], 1] } })
    }

    /// Protects: a glass shell one step of single precision above a ball is reported with the ball
    /// in `robust`, where the picture is wrong, and not in `reference`, which resolves the gap;
    /// likewise the same gap below a glass ball inside a shell.
    #[test]
    fn gaps_that_are_closed_are_named() {
        let shell = [("g", ball(1.000_000_12)), ("w", ball(1.0))];
        assert_eq!(pairs(PrecisionChoice::Robust, &shell), [(0, 1)]);
        assert_eq!(pairs(PrecisionChoice::Reference, &shell), []);
        assert_eq!(
            pairs(
                PrecisionChoice::Robust,
                &[("w", ball(1.000_000_12)), ("g", ball(1.0))]
            ),
            [(1, 0)]
        );
    }

    /// Protects: resolved gaps are not reported: a tenth of a millimetre wide, bodies that touch in
    /// a point or intersect, glass alone, and opaque bodies however close.
    #[test]
    fn open_gaps_are_not_named() {
        let raised = |y: f64| json!({ "sphere": { "centre": [0, y, 0], "radius": 0.5 } });
        for objects in [
            vec![("g", ball(1.0001)), ("w", ball(1.0))],
            vec![("g", raised(0.5)), ("w", block([-1.0, 0.0]))],
            vec![
                ("g", raised(0.3)),
                ("w", block([-1.0, 0.0])),
                ("g", ball(0.7)),
            ],
            vec![("g", ball(1.0))],
            vec![("w", ball(1.000_000_12)), ("w", ball(1.0))],
            vec![],
        ] {
            assert_eq!(pairs(PrecisionChoice::Robust, &objects), [], "{objects:?}");
        }
    }

    /// Protects: partly transparent quads in one place are reported, each with the first, which a
    /// ray sees alone, and so are instances of a mesh and faces that a mesh holds
    /// twice. Quads that are apart are not.
    #[test]
    fn coincident_passable_surfaces_are_named() {
        let quad = |y: f64| json!({ "quad": { "corner": [-1, y, -1], "edge_u": [2, 0, 0], "edge_v": [0, 0, 2] } });
        for precision in [PrecisionChoice::Robust, PrecisionChoice::Reference] {
            let veils = [
                ("v", quad(0.0)),
                ("w", quad(-0.5)),
                ("v", quad(0.0)),
                ("v", quad(0.0)),
            ];
            assert_eq!(pairs(precision, &veils), [(0, 2), (0, 3)]);
            assert_eq!(
                pairs(precision, &[("v", json!({ "mesh": "twice" }))]),
                [(0, 0)]
            );
            let once = ("v", json!({ "mesh": "once" }));
            assert_eq!(pairs(precision, core::slice::from_ref(&once)), []);
            assert_eq!(pairs(precision, &[once.clone(), once]), [(0, 1)]);
            let apart = [("v", quad(0.0)), ("v", quad(1e-3))];
            assert_eq!(pairs(precision, &apart), []);
        }
    }
}
