//! Detection of scenes without light, such as many imported models, and a substitute sky for them.

use glam::DVec3;

use super::facts::EffectFacts;
use crate::extent::scene_extent;
use crate::lookup::SceneLookup;
use crate::scene::{Colour, Falloff, Light, LightKind, Scene, Sky};

/// Returns the sky for a scene without light: grey, with radiance 1 at the zenith and 0.4 at the
/// nadir.
pub fn neutral_sky() -> Sky {
    Sky::Gradient {
        bottom: Colour([0.4; 3]),
        top: Colour([1.0; 3]),
        suns: Vec::new(),
    }
}

/// Whether a scene has a sky, a light, an ambient term, or an emissive or unlit surface. A scene
/// without any of these is black; [`neutral_sky`] is a substitute.
pub fn emits_light(scene: &Scene) -> bool {
    let effect_facts = EffectFacts::gather(scene, None);
    [
        effect_facts.sky,
        effect_facts.light,
        effect_facts.ambient,
        effect_facts.emission,
        effect_facts.unlit_material,
    ]
    .iter()
    .any(Option::is_some)
}

/// Total irradiance of the lights below which a scene counts as unlit. At this irradiance, a white
/// surface is darker than a tenth of the display's range.
const DIM: f64 = 0.02;

/// Whether a scene's lights illuminate its objects noticeably. Their total irradiance at the
/// objects, computed from power, range and distance, must be at least 0.02. Below, even a white
/// surface is darker than a tenth of the display's range.
pub fn are_objects_lit_by_lights(scene: &Scene) -> bool {
    let bounds = scene_extent::<f32>(scene, &SceneLookup::new(scene)).bounds;
    let (centre, radius) = match bounds.is_empty() {
        true => (DVec3::ZERO, 1.0),
        false => (
            (bounds.min + bounds.max) * 0.5,
            (bounds.max - bounds.min).length() * 0.5,
        ),
    };
    scene
        .lights
        .iter()
        .map(|light| irradiance_at(light, centre, radius))
        .sum::<f64>()
        >= DIM
}

fn max_channel(colour: [f64; 3]) -> f64 {
    colour.into_iter().fold(0.0, f64::max)
}

/// Returns the irradiance of a light on a model, given by its centre and radius.
fn irradiance_at(light: &Light, centre: DVec3, radius: f64) -> f64 {
    let strength = max_channel(light.colour.0);
    let (position, falloff, range) = match light.kind {
        LightKind::Directional { .. } => return strength,
        LightKind::Point {
            position,
            falloff,
            range,
        }
        | LightKind::Spot {
            position,
            falloff,
            range,
            ..
        } => (DVec3::from(position), falloff, range),
    };
    let away = position.distance(centre);
    if range.is_some_and(|range| range < away - radius) {
        return 0.0;
    }
    match falloff {
        // For a light inside the model, the distance to most surfaces is about half the radius.
        Falloff::InverseSquare => {
            strength
                / (away * away)
                    .max(0.25 * radius * radius)
                    .max(f64::MIN_POSITIVE)
        }
        _ => strength,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{
        ClassicMaterial, ColourInput, Material, MaterialModel, Object, Physical, Shape, SideRule,
    };

    fn scene(model: MaterialModel) -> Scene {
        let shape = Shape::Sphere {
            centre: [0.0; 3],
            radius: 1.0,
        };
        let object = Object {
            name: String::new(),
            shape,
            material: "only".to_owned(),
            side: SideRule::Both,
            face_viewer: true,
            casts_shadow: true,
            transform: Vec::new(),
            transform_end: None,
        };
        let material = Material {
            name: "only".to_owned(),
            model,
        };
        Scene {
            materials: vec![material],
            objects: vec![object],
            ..Scene::default()
        }
    }

    /// Protects: any visible source of light is found; a source that no object shows does not
    /// count.
    #[test]
    fn light_is_found_where_it_is() {
        let dark = scene(MaterialModel::Classic(Box::default()));
        assert!(!emits_light(&dark));
        assert!(emits_light(&Scene {
            sky: Some(neutral_sky()),
            ..dark.clone()
        }));
        let glow = ClassicMaterial {
            emission: Some(ColourInput::default()),
            ..ClassicMaterial::default()
        };
        let glowing = scene(MaterialModel::Classic(Box::new(glow)));
        assert!(emits_light(&glowing));
        assert!(!emits_light(&Scene {
            objects: Vec::new(),
            ..glowing
        }));
        assert!(emits_light(&scene(MaterialModel::Physical(Box::new(
            Physical {
                unlit: true,
                ..Physical::default()
            }
        )))));
        let mut ambient = dark;
        ambient.classic.ambient = Colour([0.0, 0.1, 0.0]);
        assert!(emits_light(&ambient));
    }

    /// A white sheet of edge 2 at the origin, and other parts.
    fn room(parts: serde_json::Value) -> Scene {
        let sheet = serde_json::json!({ "positions": [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]],
            "indices": [[0, 1, 2], [0, 2, 3]] });
        let mut scene = serde_json::json!({ "format": 1,
            "meshes": [{ "name": "sheet", "source": { "inline": sheet } }],
            "materials": [{ "name": "white", "model": { "physical": {} } }],
            "objects": [{ "shape": { "mesh": "sheet" }, "material": "white" }] });
        for (key, value) in parts.as_object().expect("a table") {
            scene[key] = value.clone();
        }
        serde_json::from_value(scene).expect("a scene")
    }

    /// Protects: a light counts only if it reaches the model with some strength, by distance and
    /// range.
    #[test]
    fn lights_count_by_what_they_bring() {
        use serde_json::json;
        let light = |kind: serde_json::Value, colour: f64| {
            room(json!({ "lights": [{ "kind": kind, "colour": colour }] }))
        };
        let point = |z: f64, range: Option<f64>| json!({ "point": { "position": [0, 0, z], "range": range } });
        assert!(
            !are_objects_lit_by_lights(&room(json!({})))
                && !are_objects_lit_by_lights(&Scene::default())
        );
        assert!(are_objects_lit_by_lights(&light(
            json!({ "directional": { "to_light": [0, 0, 1] } }),
            1.0
        )));
        assert!(!are_objects_lit_by_lights(&light(
            json!({ "directional": { "to_light": [0, 0, 1] } }),
            0.001
        )));
        assert!(
            are_objects_lit_by_lights(&light(point(2.0, None), 1.0))
                && !are_objects_lit_by_lights(&light(point(200.0, None), 1.0))
        );
        assert!(
            are_objects_lit_by_lights(&light(point(200.0, None), 1e4))
                && !are_objects_lit_by_lights(&light(point(200.0, Some(150.0)), 1e4))
        );
    }

    /// Protects: a light whose range ends within the model reaches it: the range counts from the
    /// model's near side, not from its centre. The sheet reaches √2 about its centre.
    #[test]
    fn a_range_that_ends_within_the_model_reaches_it() {
        let reaches = |range: f64| {
            let point = serde_json::json!({ "point": { "position": [0, 0, 2], "range": range } });
            are_objects_lit_by_lights(&room(
                serde_json::json!({ "lights": [{ "kind": point, "colour": 1 }] }),
            ))
        };
        let gap = 2.0 - 2.0_f64.sqrt();
        assert_eq!(
            [gap - 0.01, gap + 0.01, 1.0, 1.99, 2.01].map(reaches),
            [false, true, true, true, true]
        );
    }
}
