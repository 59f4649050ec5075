//! Paths side by side against paths alone.

use raywright_bvh::{Fast, Real, Reference, Robust, Vector};
use serde_json::json;

use super::super::super::Paths;
use super::*;
use crate::counters::Counters;
use crate::effects::{Effect, EffectSet};
use crate::prepare::{Material, Prepared};
use crate::scene::Scene;
use crate::settings::Settings;

const SIZE: [u32; 2] = [24, 16];

/// Rough surfaces, even and in cells, a mesh with images, beside mirrors, glass, layers, what is there in part, lamps and a sky: all
/// that paths meet, and lights of each kind.
fn everything() -> Scene {
    let ball = |x: f64, y: f64, material: &str| json!({ "shape": { "sphere": { "centre": [x, y, 0], "radius": 0.6 } }, "material": material });
    let physical = |name: &str, terms: serde_json::Value| json!({ "name": name, "model": { "physical": terms } });
    let cells = json!({ "checker": { "even": [0.9, 0.4, 0.1], "odd": [0.1, 0.2, 0.8], "size": 0.3 } });
    let codes: Vec<[f64; 4]> = (0..64).map(|i| [0.4 + 0.003 * f64::from(i), 0.6 - 0.002 * f64::from(i), 0.9, 1.0]).collect();
    let mut scene: Scene = serde_json::from_value(json!({
        "format": 1,
        "cameras": [{ "pose": { "look_at": { "eye": [0, 1.0, 7], "target": [0, 0.4, 0] } },
            "projection": { "pinhole": { "vertical_fov": 40 } } }],
        "sky": { "gradient": { "bottom": [0.2, 0.3, 0.5], "top": [0.6, 0.7, 0.9],
            "suns": [{ "direction": [1, 2, 1], "exponent": 200, "colour": [9, 8, 7], "weight": 1 }] } },
        "lights": [{ "kind": { "point": { "position": [2, 3, 2] } }, "colour": [6, 6, 6] },
            { "kind": { "point": { "position": [-2, 3, 2] } }, "colour": [6, 5, 4], "specular": false }],
        "materials": [
            physical("floor", json!({ "base_colour": cells, "roughness": 0.7 })),
            physical("metal", json!({ "base_colour": [0.9, 0.7, 0.4], "metallic": 1, "roughness": 0.25 })),
            physical("smooth", json!({ "metallic": 1, "roughness": 0 })),
            physical("glass", json!({ "transmission": 1, "roughness": 0, "ior": 1.5 })),
            physical("frosted", json!({ "transmission": 1, "roughness": 0.3 })),
            physical("coated", json!({ "clearcoat": { "factor": 1 }, "roughness": 0.5 })),
            physical("sheet", json!({ "alpha": "blend", "opacity": 0.5 })),
            physical("expressed", json!({ "base_colour": "vec3(abs(n.x), abs(n.y), abs(n.z))", "roughness": 0.6 })),
            physical("lamp", json!({ "emission": [5, 4, 3] })),
            physical("leaf", json!({ "roughness": 0.4,
                "base_colour_texture": { "name": "grain" }, "normal_texture": { "name": "grain" } })),
        ],
        "images": [{ "name": "grain", "path": "" }],
        "textures": [{ "name": "grain", "image": "grain", "colour_space": "linear" }],
        "meshes": [{ "name": "leaf", "source": { "inline": {
            "positions": [[-3, 0, -1.5], [3, 0, -1.5], [3, 3, -2], [-3, 3, -2]], "indices": [[0, 1, 2], [0, 2, 3]],
            "normals": [[-0.3, 0, 1], [0.3, 0, 1], [0.3, 0.3, 1], [-0.3, 0.3, 1]],
            "uvs": [[[0, 0], [3, 0], [3, 3], [0, 3]]] } } }],
        "objects": [
            { "shape": { "plane": { "point": [0, -0.6, 0], "normal": [0, 1, 0] } }, "material": "floor" },
            { "shape": { "mesh": "leaf" }, "material": "leaf" },
            ball(-2.1, 0.0, "metal"), ball(-0.7, 0.0, "smooth"), ball(0.7, 0.0, "glass"), ball(2.1, 0.0, "frosted"),
            ball(-2.1, 1.3, "coated"), ball(-0.7, 1.3, "sheet"), ball(0.7, 1.3, "expressed"), ball(2.1, 1.3, "lamp"),
        ],
    }))
    .expect("a scene");
    let pixels = crate::scene::Pixels::Linear(codes.iter().map(|code| code.map(|c| c as f32)).collect());
    scene.images[0].data = Some(std::sync::Arc::new(crate::scene::ImageData { width: 8, height: 8, pixels }));
    scene
}

/// What the paths of all pixels bring, so many of them side by side, with what they hit first and what was counted.
fn followed<P: Precision>(prepared: &Prepared<P>, depth: u32, together: usize) -> (Vec<[u64; 5]>, Counters) {
    let mut tracer = Tracer::<P, Paths>::new(prepared, depth, true, &());
    let pixels = (0..SIZE[0] * SIZE[1]).map(|i| [i % SIZE[0], i / SIZE[0]]);
    let addresses: Vec<_> =
        pixels.flat_map(|pixel| (0..4).map(move |index| Address { pixel, index, ..Address::default() })).collect();
    let at = |x: u32| P::Real::from_f64(f64::from(x) + 0.5);
    let rays: Vec<_> = addresses.iter().map(|a| prepared.camera.ray(at(a.pixel[0]), at(a.pixel[1]), [0.5; 2])).collect();
    let (mut stream, mut out) = (Stream::default(), Vec::new());
    for (rays, addresses) in rays.chunks(together).zip(addresses.chunks(together)) {
        tracer.follow_all((rays, addresses), 16, &mut stream);
        out.extend((0..rays.len()).map(|place| {
            let Brought { radiance, coverage } = stream.brought(place);
            let [r, g, b] = radiance.to_f64().to_array().map(f64::to_bits);
            let first = stream.first(place).map_or(0, |first| first.distance.to_bits() ^ u64::from(first.object));
            [r, g, b, coverage.to_f64().to_bits(), first]
        }));
    }
    (out, tracer.counters)
}

fn many_or_few<P: Precision>() {
    let scene = everything();
    let settings = Settings { size: SIZE, integrator: crate::scene::Integrator::Path, ..Settings::of(&scene) };
    // Where bodies have priorities, every vertex is shaded by itself.
    let effects = EffectSet::ALL.without(EffectSet::of(&[Effect::NestedMedia]));
    let mut prepared = Prepared::<P>::new(&scene, &settings, effects, &()).expect("it can be prepared");
    assert!(!prepared.tracks_media);
    let plain = |m: &&Material<P::Real>| matches!(m, Material::Physical(m) if m.plain);
    assert_eq!(prepared.materials.iter().filter(plain).count(), 5, "floor, metal, smooth, lamp and leaf");
    let (alone, counters) = followed(&prepared, 7, 1);
    assert!(counters.scatter > 1000 && counters.reflection > 100 && counters.refraction > 100, "{counters:?}");
    for together in [2, 7, 8, 9, 100, usize::MAX] {
        assert_eq!(followed(&prepared, 7, together), (alone.clone(), counters), "{together}");
    }
    let short = followed(&prepared, 2, 100);
    for material in &mut prepared.materials {
        if let Material::Physical(m) = material {
            m.plain = false;
        }
    }
    assert_eq!(followed(&prepared, 7, 100), (alone, counters), "one vertex after the other");
    assert_eq!(followed(&prepared, 2, 100), short, "and of short paths");
}

/// Protects: how many paths go side by side, and whether their vertices are shaded together, changes no bit of what each brings, no
/// first hit and no count.
#[test]
fn paths_bring_what_they_bring_alone() {
    many_or_few::<Robust>();
    many_or_few::<Fast>();
    many_or_few::<Reference>();
}
