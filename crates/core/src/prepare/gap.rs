//! Gaps beside surfaces that light passes, narrower than the error bound of a hit: light that
//! leaves the one surface starts beyond the other, so that the gap is not in the picture.

use raywright_bvh::{Interval, Ray, Real, Vector};

use super::{Prepared, Spawn};

/// Rays through the picture that look for gaps, along its width and its height.
const RAYS: [u32; 2] = [32, 18];

/// Surfaces that a ray looks at, whatever they are made of.
const HITS: usize = 16;

/// Two objects that are nearer to each other than the starts of rays on both sides of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosedGap {
    /// The object that light passes, by its place in the scene's list, generated ones behind them.
    pub object: usize,
    /// The object that light starts beyond.
    pub other: usize,
    /// Distance in metres from which on a gap here is seen.
    pub resolved: f64,
}

impl<R: Real> Prepared<R> {
    /// Pairs of objects with such gaps, as far as some hundred straight rays through a picture of
    /// this size find them; each pair once. Starts at a constant offset close gaps by choice, and
    /// none is named.
    pub(crate) fn closed_gaps(&self, [width, height]: [u32; 2]) -> Vec<ClosedGap> {
        let mut gaps: Vec<ClosedGap> = Vec::new();
        if !matches!(self.rules.spawn, Spawn::ErrorBound)
            || self.materials.iter().all(|material| material.is_opaque())
        {
            return gaps;
        }
        let at = |i: u32, of: u32, edge: u32| {
            R::from_f64((f64::from(i) + 0.5) / f64::from(of) * f64::from(edge))
        };
        for i in 0..RAYS[0] * RAYS[1] {
            let (x, y) = (
                at(i % RAYS[0], RAYS[0], width),
                at(i / RAYS[0], RAYS[1], height),
            );
            self.gaps_along(&self.camera.ray(x, y, [0.5; 2]), &mut gaps);
        }
        gaps
    }

    /// Adds what one ray finds on its straight way.
    fn gaps_along(&self, ray: &Ray<R>, gaps: &mut Vec<ClosedGap>) {
        let mut range = Interval::positive();
        for _ in 0..HITS {
            let Some(hit) = self.geometry.closest(ray, range, &mut ()) else {
                return;
            };
            range.min = hit.t;
            let object = hit.outermost();
            if self.materials[self.objects[object as usize].material as usize].is_opaque() {
                continue;
            }
            let surface = self.geometry.surface(ray, &hit);
            let [above, below] = [surface.normal, -surface.normal].map(|side| surface.spawn(side));
            for [from, to] in [[above, below], [below, above]] {
                let Some(other) = self.first_of_others([from, to], ray.time, object) else {
                    continue;
                };
                let gap = ClosedGap {
                    object: object as usize,
                    other: other as usize,
                    resolved: (to - from).length().to_f64(),
                };
                match gaps
                    .iter_mut()
                    .find(|known| (known.object, known.other) == (gap.object, gap.other))
                {
                    Some(known) => known.resolved = known.resolved.max(gap.resolved),
                    None => gaps.push(gap),
                }
            }
        }
    }

    /// The object that is met first between two points, unless it is the one given.
    fn first_of_others(&self, [from, to]: [R::Vec3; 2], time: R, own: u32) -> Option<u32> {
        let across = to - from;
        let length = across.length();
        let range = Interval {
            min: R::ZERO,
            max: length,
        };
        let hit = self.geometry.closest(
            &Ray::new(from, across / length).at_time(time),
            range,
            &mut (),
        )?;
        Some(hit.outermost()).filter(|&object| object != own)
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use crate::scene::Scene;
    use crate::settings::{PrecisionChoice, Settings};

    /// The pairs of a scene of these objects, glass by the name `g`, seen from four metres.
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
                          { "name": "w", "model": { "classic": { "colour": 1 } } }],
            "objects": objects,
        }))
        .unwrap_or_else(|e| panic!("{e}"));
        let ready = crate::prepare(
            &scene,
            &Settings {
                precision,
                ..Settings::of(&scene)
            },
            &(),
        )
        .unwrap_or_else(|e| panic!("{e}"));
        let found = ready.closed_gaps();
        assert!(
            found
                .iter()
                .all(|gap| gap.resolved > 0.0 && gap.resolved < 1e-5),
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

    /// Protects: a shell of glass one step of single precision above a ball is named, with the
    /// ball, in `robust`, where its picture is wrong; in `reference`, which shows the gap, it is
    /// not. So is the same gap below a ball of glass inside a shell.
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

    /// Protects: no gap is named that is there in the picture: a tenth of a millimetre wide, bodies
    /// that touch in a point or cut through each other, nothing but glass, and opaque bodies
    /// however near they are.
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
}
