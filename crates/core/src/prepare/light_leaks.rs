//! Detection of what rays do not resolve. Light leaks: a lamp lies so close behind an opaque surface
//! that shadow rays do not resolve the gap, and its light shines through the surface. Gaps beside
//! transmissive surfaces: a ray that leaves one surface starts beyond the other, and the picture
//! lacks the gap.

use glam::DVec3;
use raywright_bvh::{Hit, Interval, Ray, Real, Surface, Vector};

use super::{PreparedScene, PreparedSpawnRule};
use crate::light::{LightId, ShadowRayTarget};

/// Numbers of search rays along the width and the height of the picture. For leaks, lights are
/// sampled at the first hit of each ray.
const GRID_RAYS: [u32; 2] = [32, 18];

/// Greatest number of lights that are sampled at a hit. If a scene has more lights, each hit
/// continues in the list of lights where the previous hit ended.
const LIGHTS_PER_HIT: usize = 8;

/// Greatest number of surfaces that are tested in front of a lamp.
const MAX_LAMP_HITS: usize = 4;

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
    pub(crate) fn find_light_leaks(&self, size: [u32; 2]) -> Vec<LightLeak> {
        let mut leaks = Vec::new();
        let lights: Vec<LightId> = self
            .lights
            .light_ids()
            .filter(|&light| light != LightId::Sky)
            .collect();
        if lights.is_empty() || !matches!(self.rules.spawn, PreparedSpawnRule::ErrorBound) {
            return leaks;
        }
        for (i, ray) in (0..).zip(self.search_rays(size)) {
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

    /// Returns the search rays through a picture of the given size, row by row.
    fn search_rays(&self, [width, height]: [u32; 2]) -> impl Iterator<Item = Ray<R>> + '_ {
        let at = |i: u32, total: u32, edge: u32| {
            R::from_f64((f64::from(i) + 0.5) / f64::from(total) * f64::from(edge))
        };
        let [columns, rows] = GRID_RAYS;
        (0..columns * rows).map(move |i| {
            let (x, y) = (
                at(i % columns, columns, width),
                at(i / columns, rows, height),
            );
            self.camera.generate_ray(x, y, [0.5; 2])
        })
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
        for _ in 0..MAX_LAMP_HITS {
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

/// Greatest number of surfaces along a ray that are tested for a gap.
const MAX_GAP_HITS: usize = 16;

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
    pub(crate) fn find_unresolved_gaps(&self, size: [u32; 2]) -> Vec<UnresolvedGap> {
        let mut gaps: Vec<UnresolvedGap> = Vec::new();
        if !matches!(self.rules.spawn, PreparedSpawnRule::ErrorBound)
            || self.materials.iter().all(|material| material.is_opaque())
        {
            return gaps;
        }
        self.search_rays(size)
            .for_each(|ray| self.find_gaps_along_ray(&ray, &mut gaps));
        gaps
    }

    /// Adds the unresolved gaps along a ray that passes straight through surfaces.
    fn find_gaps_along_ray(&self, ray: &Ray<R>, gaps: &mut Vec<UnresolvedGap>) {
        let (mut range, mut is_seen) = (Interval::positive(), true);
        for _ in 0..MAX_GAP_HITS {
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

#[cfg(test)]
mod unresolved_gaps_tests {
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
