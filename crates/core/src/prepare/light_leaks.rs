//! Detection of light leaks. A lamp lies so close behind an opaque surface that shadow rays do not
//! resolve the gap, and its light shines through the surface.

use raywright_bvh::{Interval, Ray, Real, Surface, Vector};

use super::{PreparedScene, PreparedSpawnRule};
use crate::light::{LightId, ShadowRayTarget};

/// Numbers of camera rays along the width and the height of the picture. At the first hit of each
/// ray, lights are sampled.
const GRID_RAYS: [u32; 2] = [32, 18];

/// Greatest number of lights that are sampled at a hit. If a scene has more lights, each hit
/// continues in the list of lights where the previous hit ended.
const LIGHTS_PER_HIT: usize = 8;

/// Greatest number of surfaces that are tested in front of a lamp.
const MAX_HITS: usize = 4;

/// Index of a lamp in the scene: of a delta light or of an emissive object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LampRef {
    /// A delta light, by its index in the scene's list of lights.
    Light(usize),
    /// An emissive object, by its index in the scene's list of objects; generated objects follow
    /// the listed objects.
    Object(usize),
}

/// An error of the picture: a lamp shines through an opaque object, because the gap between them is
/// narrower than shadow rays resolve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LightLeak {
    /// Lamp whose light leaks.
    pub lamp: LampRef,
    /// Index of the opaque object in the scene's list of objects; generated objects follow the
    /// listed objects.
    pub cover: usize,
    /// Least distance in metres between lamp and object at which the object blocks the light.
    pub resolved_distance: f64,
}

impl<R: Real> PreparedScene<R> {
    /// Returns the light leaks onto the first hits of 576 camera rays through a picture of the
    /// given size. Each pair of lamp and object is listed once. At most eight shadow rays start at
    /// each hit. A scene with a constant ray offset lets light through on purpose, so the list is
    /// then empty.
    pub(crate) fn find_light_leaks(&self, [width, height]: [u32; 2]) -> Vec<LightLeak> {
        let mut leaks = Vec::new();
        let lights: Vec<LightId> = self
            .lights
            .light_ids()
            .filter(|&light| light != LightId::Sky)
            .collect();
        if lights.is_empty() || !matches!(self.rules.spawn, PreparedSpawnRule::ErrorBound) {
            return leaks;
        }
        let at = |i: u32, total: u32, edge: u32| {
            R::from_f64((f64::from(i) + 0.5) / f64::from(total) * f64::from(edge))
        };
        for i in 0..GRID_RAYS[0] * GRID_RAYS[1] {
            let (x, y) = (
                at(i % GRID_RAYS[0], GRID_RAYS[0], width),
                at(i / GRID_RAYS[0], GRID_RAYS[1], height),
            );
            let ray = self.camera.generate_ray(x, y, [0.5; 2]);
            let Some(hit) = self.geometry.closest(&ray, Interval::positive(), &mut ()) else {
                continue;
            };
            let from = self.geometry.surface(&ray, &hit);
            // Only light on the viewer's side reaches an opaque surface's hit.
            let opaque = self.is_object_opaque(hit.outermost_id());
            let seen = from.normal.dot(ray.direction) < R::ZERO;
            let faces =
                |direction: R::Vec3| !opaque || (from.normal.dot(direction) > R::ZERO) == seen;
            for k in 0..LIGHTS_PER_HIT.min(lights.len()) {
                let light = lights[(i as usize * LIGHTS_PER_HIT + k) % lights.len()];
                leaks.extend(self.find_light_leak(
                    &from,
                    light,
                    quasirandom_point(i),
                    ray.time,
                    faces,
                ));
            }
        }
        merge_light_leaks(leaks)
    }

    /// Whether the material of an object is opaque.
    fn is_object_opaque(&self, object: u32) -> bool {
        self.materials[self.objects[object as usize].material as usize].is_opaque()
    }

    /// Returns the light leak through which light from a sampled point reaches the surface point
    /// `from`; `None` if the light arrives rightly or not at all. `place` holds two random numbers
    /// in [0, 1) that select the point of the light. `faces` returns whether light from a direction
    /// falls on the visible side of the surface.
    fn find_light_leak(
        &self,
        from: &Surface<R>,
        light: LightId,
        place: [f32; 2],
        time: R,
        faces: impl Fn(R::Vec3) -> bool,
    ) -> Option<LightLeak> {
        let sample = self
            .lights
            .sample(light, from.point, place, 1.0)
            .filter(|sample| faces(sample.direction))?;
        let (ray, range, start) = match &sample.target {
            ShadowRayTarget::Surface(lamp) => {
                let (ray, range) = from.spawn_ray_to_surface(lamp)?;
                (ray, range, lamp.spawn_ray_origin(sample.direction))
            }
            ShadowRayTarget::Point(point) => {
                let (ray, range) = from.spawn_ray_to_point(*point)?;
                (ray, range, *point)
            }
            ShadowRayTarget::Infinity | ShadowRayTarget::EmitterCentre { .. } => return None,
        };
        let shadowed = self.geometry.occluded(
            &ray.with_time(time),
            range,
            &mut |hit| self.is_object_opaque(hit.outermost_id()),
            &mut (),
        );
        if shadowed {
            return None;
        }
        // The surfaces between the lamp's point and the end of the shadow ray are searched by a ray
        // from the lamp, where distances are small and precise.
        let end = ray.origin.to_f64() + ray.direction.to_f64() * range.max.to_f64();
        let rounding = 4.0 * R::ROUNDOFF.to_f64() * range.max.to_f64();
        let resolved = 2.0 * ((start.to_f64() - end).length() + rounding);
        let range = Interval {
            min: R::ZERO,
            max: R::from_f64(resolved),
        };
        let (own, cover) = self.find_opaque_object_before_lamp(
            light,
            &Ray::new(start, -sample.direction).with_time(time),
            range,
        )?;
        let lamp = match light {
            LightId::Delta(index) => LampRef::Light(index as usize),
            LightId::Emitter(_) | LightId::Sky => LampRef::Object(own? as usize),
        };
        Some(LightLeak {
            lamp,
            cover: cover as usize,
            resolved_distance: resolved,
        })
    }

    /// Follows a ray that starts just behind a lamp. Returns the first other opaque object after
    /// the lamp, and before it the lamp's own object if the ray hits that.
    fn find_opaque_object_before_lamp(
        &self,
        light: LightId,
        ray: &Ray<R>,
        mut range: Interval<R>,
    ) -> Option<(Option<u32>, u32)> {
        let mut own = None;
        for _ in 0..MAX_HITS {
            let hit = self.geometry.closest(ray, range, &mut ())?;
            range.min = hit.t;
            let object = hit.outermost_id();
            let is_lamp = self
                .lights
                .emitters
                .emitter_index_of(object, hit.primitive)
                .map(LightId::Emitter)
                == Some(light);
            if is_lamp {
                own = Some(object);
            } else if (own.is_some() || matches!(light, LightId::Delta(_)))
                && own != Some(object)
                && self.is_object_opaque(object)
            {
                return Some((own, object));
            }
        }
        None
    }
}

/// Returns the `i`-th point in [0, 1)² of a low-discrepancy sequence (Roberts, "The Unreasonable
/// Effectiveness of Quasirandom Sequences", 2018).
fn quasirandom_point(i: u32) -> [f32; 2] {
    [0.754_877_666_246_692_8, 0.569_840_290_998_053_3]
        .map(|step: f64| ((0.5 + step * f64::from(i)).fract() as f32).min(0.999_999))
}

/// Merges the leaks of the same lamp and object to a single leak. Its distance is the greatest of
/// theirs.
fn merge_light_leaks(mut leaks: Vec<LightLeak>) -> Vec<LightLeak> {
    let key = |leak: &LightLeak| match leak.lamp {
        LampRef::Light(index) => (0, index, leak.cover),
        LampRef::Object(index) => (1, index, leak.cover),
    };
    leaks.sort_by(|a, b| {
        key(a)
            .cmp(&key(b))
            .then(b.resolved_distance.total_cmp(&a.resolved_distance))
    });
    leaks.dedup_by_key(|leak| key(leak));
    leaks
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::{LampRef, LightLeak};
    use crate::scene::Scene;
    use crate::settings::{PrecisionChoice, Settings};

    /// Light on the floor, and the leaks, for a lamp at this height above it and a cover.
    fn light_and_leaks(
        precision: PrecisionChoice,
        height: f64,
        parts: Value,
    ) -> (f64, Vec<LightLeak>) {
        let mut scene = json!({
            "format": 1,
            "render": { "integrator": "path", "max_depth": 3, "samples": 4, "size": [8, 8] },
            "cameras": [{ "pose": { "look_at": { "eye": [0.5 * height, 0.5 * height, 0.4 * height], "target": [0, 0, 0] } },
                          "projection": { "pinhole": { "vertical_fov": 40 } } }],
            "materials": [{ "name": "floor", "model": { "classic": { "colour": 0.6 } } },
                          { "name": "black", "model": { "classic": { "colour": 0 } } },
                          { "name": "classic", "model": { "classic": { "local": 0, "emission": 4 } } },
                          { "name": "physical", "model": { "physical": { "base_colour": 0, "specular": 0, "emission": 4 } } }],
            "objects": [],
        });
        for (key, value) in parts.as_object().expect("parts") {
            scene[key] = value.clone();
        }
        let floor = json!({ "shape": { "plane": { "point": [0, 0, 0], "normal": [0, 1, 0] } }, "material": "floor" });
        scene["objects"].as_array_mut().expect("a list").push(floor);
        let scene: Scene = serde_json::from_value(scene).unwrap_or_else(|e| panic!("{e}"));
        let settings = Settings {
            precision,
            ..Settings::from_scene(&scene)
        };
        let ready = crate::prepare(&scene, &settings, &()).unwrap_or_else(|e| panic!("{e}"));
        let picture = ready.render(&()).picture;
        let sum = picture.rgb.iter().map(|pixel| f64::from(pixel[0])).sum();
        (sum, ready.find_light_leaks())
    }

    fn quad(y: f64, r: f64) -> Value {
        json!({ "quad": { "corner": [-r, y, -r], "edge_u": [2.0 * r, 0, 0], "edge_v": [0, 0, 2.0 * r] } })
    }

    fn disk(y: f64, r: f64) -> Value {
        json!({ "disk": { "centre": [0, y, 0], "normal": [0, -1, 0], "radius": r } })
    }

    fn mesh(name: &str, y: f64, r: f64) -> Value {
        let positions = [[-r, y, -r], [r, y, -r], [r, y, r], [-r, y, r]];
        json!({ "name": name, "source": { "inline": { "positions": positions, "indices": [[0, 1, 2], [0, 2, 3]] } } })
    }

    /// Pairs of lamps and covers, with their meshes: the lamp at a height, the cover by the gap
    /// below or around it.
    fn pairs(height: f64, gap: f64) -> Vec<Value> {
        let r = 0.25 * height;
        let below = height - gap;
        let covers = [
            quad(below, 3.0 * r),
            json!({ "box": { "min": [-3.0 * r, below - r, -3.0 * r], "max": [3.0 * r, below, 3.0 * r] } }),
            disk(below, 3.0 * r),
            json!({ "mesh": "cover" }),
        ];
        let lamps = [
            quad(height, r),
            disk(height, r),
            json!({ "mesh": "lamp" }),
            json!({ "sphere": { "centre": [0, height + r, 0], "radius": r } }),
        ];
        let point = json!([{ "kind": { "point": { "position": [0, height, 0], "falloff": "none" } }, "colour": 4 }]);
        let meshes = json!([mesh("lamp", height, r), mesh("cover", below, 3.0 * r)]);
        let cover = |shape: &Value| json!({ "shape": shape, "material": "black" });
        let mut pairs = Vec::new();
        for shape in &covers {
            for material in ["classic", "physical"] {
                let lamp = |lamp: &Value| json!({ "objects": [cover(shape), { "shape": lamp, "material": material }], "meshes": meshes });
                pairs.extend(lamps.iter().map(lamp));
            }
            pairs.push(json!({ "objects": [cover(shape)], "meshes": meshes, "lights": point }));
        }
        let ball =
            |radius: f64| json!({ "sphere": { "centre": [0, height, 0], "radius": radius } });
        pairs.push(json!({ "objects": [cover(&ball(r + gap)), { "shape": ball(r), "material": "classic" }] }));
        pairs.push(json!({ "objects": [cover(&ball(gap))], "lights": point }));
        pairs
    }

    /// Protects: if light passes an opaque cover, its lamp and the cover are reported, at every
    /// scale, for covers and lamps of every kind and both emissive models. From the stated distance
    /// on, the surface behind the cover is dark and no leak is reported; nor is any under
    /// `reference`.
    #[test]
    fn what_shines_through_a_cover_is_named() {
        let (mut lit, mut dark) = (0, 0);
        for height in [1e-3, 1.0, 1e4, 1e6] {
            for steps in [1.0, 2.0, 4.0, 8.0, 16.0, 64.0] {
                let gap = height * steps / f64::from(1 << 23);
                for (i, parts) in pairs(height, gap).into_iter().enumerate() {
                    let (light, leaks) =
                        light_and_leaks(PrecisionChoice::Robust, height, parts.clone());
                    let label = || {
                        format!("{steps} steps at {height}, pair {i}: {light}, {leaks:?}\n{parts}")
                    };
                    let by = if parts.get("lights").is_some() {
                        LampRef::Light(0)
                    } else {
                        LampRef::Object(1)
                    };
                    assert!(
                        leaks.iter().all(|leak| leak.lamp == by
                            && leak.cover == 0
                            && leak.resolved_distance > gap * 0.9),
                        "{}",
                        label()
                    );
                    assert!(light == 0.0 || leaks.len() == 1, "{}", label());
                    assert!(steps < 64.0 || light == 0.0, "{}", label());
                    (lit, dark) = (lit + u32::from(light > 0.0), dark + u32::from(light == 0.0));
                    if steps == 4.0 {
                        assert_eq!(
                            light_and_leaks(PrecisionChoice::Reference, height, parts.clone()),
                            (0.0, vec![]),
                            "{}",
                            label()
                        );
                    }
                }
            }
        }
        assert!(lit > 50 && dark > 50, "{lit} lit, {dark} dark");
    }

    /// Protects: lamps without a leak are not reported: flush with a ceiling or just below it, on a
    /// floor, beside a cover, without one, behind glass or behind a shadowless object.
    #[test]
    fn lamps_without_a_leak_are_not_reported() {
        let lamp = |y: f64| json!({ "shape": quad(y, 0.25), "material": "classic" });
        let black = |shape: Value| json!({ "shape": shape, "material": "black" });
        let glass = json!([{ "name": "g", "model": { "physical": { "transmission": 1, "roughness": 0 } } },
                           { "name": "floor", "model": { "classic": { "colour": 0.6 } } },
                           { "name": "classic", "model": { "classic": { "local": 0, "emission": 4 } } }]);
        let standing = json!({ "shape": { "box": { "min": [-0.1, 1e-8, -0.1], "max": [0.1, 0.2, 0.1] } }, "material": "classic" });
        for parts in [
            json!({ "objects": [black(quad(1.0, 2.0)), lamp(1.0)] }),
            json!({ "objects": [black(quad(1.000_000_2, 2.0)), lamp(1.0)] }),
            json!({ "objects": [standing] }),
            json!({ "objects": [lamp(1.0)] }),
            json!({ "objects": [{ "shape": quad(0.999_999_8, 2.0), "material": "g" }, lamp(1.0)], "materials": glass }),
            json!({}),
        ] {
            let (_, leaks) = light_and_leaks(PrecisionChoice::Robust, 1.0, parts.clone());
            assert_eq!(leaks, [], "{parts}");
        }
    }
}
