//! Scenes without any light, which models often are: how to tell, and what to put there.

use glam::DVec3;

use super::facts::Facts;
use crate::affine::affine;
use crate::lookup::Lookup;
use crate::prepare::{any_shape, extent};
use crate::scene::{Colour, Falloff, Light, LightKind, Object, Scene, Shape, Sky};

/// The sky of a scene without any light: neutral, 1 at the zenith and 0.4 at the nadir.
pub fn neutral_sky() -> Sky {
    Sky::Gradient { bottom: Colour([0.4; 3]), top: Colour([1.0; 3]), suns: Vec::new() }
}

/// Whether anything in a scene gives light: without, a picture of it is black, and a neutral sky is what a user wants.
pub fn has_light(scene: &Scene) -> bool {
    let facts = Facts::gather(scene, None);
    [facts.sky, facts.light, facts.ambient, facts.emission, facts.unlit].iter().any(Option::is_some)
}

/// Irradiance below which light counts as none: a white surface under it is darker than a tenth of what displays show.
const DIM: f64 = 0.02;

/// Whether light of a model's own reaches its surfaces: lights by their power and reach and surfaces that glow evenly by theirs,
/// at the distance of the model's size, a sky always. A model that asks for no light, because it shows its colours as they are
/// or glows all over, is lit too. What glows by an image is seen and lights nothing that counts on.
pub fn is_lit(scene: &Scene) -> bool {
    let facts = Facts::gather(scene, None);
    if facts.sky.is_some() || facts.ambient.is_some() || facts.lit.is_none() && facts.unlit.is_some() {
        return true;
    }
    let lookup = Lookup::new(scene);
    let glow = |object: &Object| lookup.material(&object.material).and_then(|(_, material)| material.even_emission());
    if !scene.objects.is_empty() && scene.objects.iter().all(|object| glow(object).is_some()) {
        return true;
    }
    let bounds = extent::<f32>(scene, &lookup).bounds;
    let (centre, radius) = match bounds.is_empty() {
        true => (DVec3::ZERO, 1.0),
        false => ((bounds.min + bounds.max) * 0.5, (bounds.max - bounds.min).length() * 0.5),
    };
    let lights = scene.lights.iter().map(|light| reaching(light, centre, radius));
    let lamps = scene.objects.iter().filter_map(|object| {
        let Colour(radiance) = glow(object)?;
        // Seen under a right angle from as far as the model reaches.
        Some(strongest(radiance) * area(object, &lookup) / (radius * radius).max(f64::MIN_POSITIVE))
    });
    lights.chain(lamps).sum::<f64>() >= DIM
}

fn strongest(colour: [f64; 3]) -> f64 {
    colour.into_iter().fold(0.0, f64::max)
}

/// Irradiance that a light brings about to a model of this place and size.
fn reaching(light: &Light, centre: DVec3, radius: f64) -> f64 {
    let strength = strongest(light.colour.0);
    let (position, falloff, range) = match light.kind {
        LightKind::Directional { .. } => return strength,
        LightKind::Point { position, falloff, range } | LightKind::Spot { position, falloff, range, .. } => {
            (DVec3::from(position), falloff, range)
        }
    };
    let away = position.distance(centre);
    if range.is_some_and(|range| range < away - radius) {
        return 0.0;
    }
    match falloff {
        // One that stands within is as far from most of the model as half its size.
        Falloff::InverseSquare => strength / (away * away).max(0.25 * radius * radius).max(f64::MIN_POSITIVE),
        _ => strength,
    }
}

/// How large an object's surface is, about: a mesh's triangles, of a shape its own or that of a ball around it.
fn area(object: &Object, lookup: &Lookup<'_>) -> f64 {
    let map = affine(&object.transform);
    match &object.shape {
        Shape::Mesh(name) => lookup.mesh_data(name).map_or(0.0, |data| {
            let corner = |i: u32| map.transform_point3(DVec3::from(data.positions[i as usize].map(f64::from)));
            let triangles = data.indices.iter().map(|corners| corners.map(corner));
            triangles.map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length()).sum()
        }),
        shape => {
            let scale = map.matrix3.determinant().abs().cbrt();
            any_shape::<f64>(shape, DVec3::ZERO).and_then(|shape| shape.area()).map_or(0.0, |area| area * scale * scale)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Classic, ColourInput, Material, Model, Object, Physical, Shape, SideRule};

    fn scene(model: Model) -> Scene {
        let shape = Shape::Sphere { centre: [0.0; 3], radius: 1.0 };
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
        let material = Material { name: "only".to_owned(), model };
        Scene { materials: vec![material], objects: vec![object], ..Scene::default() }
    }

    /// What gives light is seen wherever it hides; what only could, because nothing shows it, does not count.
    #[test]
    fn light_is_found_where_it_is() {
        let dark = scene(Model::Classic(Box::default()));
        assert!(!has_light(&dark));
        assert!(has_light(&Scene { sky: Some(neutral_sky()), ..dark.clone() }));
        let glow = Classic { emission: Some(ColourInput::default()), ..Classic::default() };
        let glowing = scene(Model::Classic(Box::new(glow)));
        assert!(has_light(&glowing));
        assert!(!has_light(&Scene { objects: Vec::new(), ..glowing }));
        assert!(has_light(&scene(Model::Physical(Box::new(Physical { unlit: true, ..Physical::default() })))));
        let mut ambient = dark;
        ambient.classic.ambient = Colour([0.0, 0.1, 0.0]);
        assert!(has_light(&ambient));
    }

    /// A white sheet of edge 2 at the origin, and what else there is.
    fn room(parts: serde_json::Value) -> Scene {
        let sheet = |z: f64, size: f64| {
            serde_json::json!({ "positions": [[-size, -size, z], [size, -size, z], [size, size, z], [-size, size, z]],
            "indices": [[0, 1, 2], [0, 2, 3]] })
        };
        let mut scene = serde_json::json!({ "format": 1,
            "meshes": [{ "name": "sheet", "source": { "inline": sheet(0.0, 1.0) } }, { "name": "lamp", "source": { "inline": sheet(1.0, 0.1) } }],
            "materials": [{ "name": "white", "model": { "physical": {} } }, { "name": "glow", "model": { "physical": { "emission": 15 } } },
                { "name": "faint", "model": { "physical": { "emission": 0.1 } } }, { "name": "bare", "model": { "physical": { "unlit": true } } },
                { "name": "sign", "model": { "physical": { "emission": "15*u" } } }],
            "objects": [{ "shape": { "mesh": "sheet" }, "material": "white" }] });
        for (key, value) in parts.as_object().expect("a table") {
            let list = scene[key].as_array().cloned().unwrap_or_default();
            scene[key] = [list, value.as_array().cloned().unwrap_or_default()].concat().into();
        }
        serde_json::from_value(scene).expect("a scene")
    }

    /// Protects: light counts where it reaches the model with some strength, not because it is there: lights by distance and
    /// range, lamps by size; what glows by an image lights nothing, and what asks for no light lacks none.
    #[test]
    fn light_counts_by_what_it_brings() {
        use serde_json::json;
        let light = |kind: serde_json::Value, colour: f64| room(json!({ "lights": [{ "kind": kind, "colour": colour }] }));
        let point = |z: f64, range: Option<f64>| json!({ "point": { "position": [0, 0, z], "range": range } });
        let lamp = |material: &str| room(json!({ "objects": [{ "shape": { "mesh": "lamp" }, "material": material }] }));
        assert!(!is_lit(&room(json!({}))));
        assert!(is_lit(&light(json!({ "directional": { "to_light": [0, 0, 1] } }), 1.0)));
        assert!(!is_lit(&light(json!({ "directional": { "to_light": [0, 0, 1] } }), 0.001)));
        assert!(is_lit(&light(point(2.0, None), 1.0)) && !is_lit(&light(point(200.0, None), 1.0)));
        assert!(is_lit(&light(point(200.0, None), 1e4)) && !is_lit(&light(point(200.0, Some(150.0)), 1e4)));
        assert!(is_lit(&lamp("glow")) && !is_lit(&lamp("faint")) && !is_lit(&lamp("sign")) && !is_lit(&lamp("bare")));
        for (material, lit) in [("glow", true), ("faint", true), ("bare", true), ("sign", false), ("white", false)] {
            let mut alone = room(json!({}));
            alone.objects[0].material = material.to_owned();
            assert_eq!(is_lit(&alone), lit, "{material}");
        }
        assert!(!is_lit(&Scene::default()) && is_lit(&Scene { sky: Some(neutral_sky()), ..Scene::default() }));
    }

    /// Protects: a light whose range ends within the model reaches it: the range counts from the model's near side, and not from its
    /// centre. The sheet reaches √2 about its centre.
    #[test]
    fn a_range_that_ends_within_the_model_reaches_it() {
        let reaches = |range: f64| {
            let point = serde_json::json!({ "point": { "position": [0, 0, 2], "range": range } });
            is_lit(&room(serde_json::json!({ "lights": [{ "kind": point, "colour": 1 }] })))
        };
        let gap = 2.0 - 2.0_f64.sqrt();
        assert_eq!([gap - 0.01, gap + 0.01, 1.0, 1.99, 2.01].map(reaches), [false, true, true, true, true]);
    }
}
