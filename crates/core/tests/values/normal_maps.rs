//! Normal maps on meshes with and without tangents, on shapes, from both sides and under mirroring
//! transforms, against Lambert's law about a normal by hand.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DMat3, DVec3};
use raywright_core::effects::{Effect, EffectSet, EffectStatus, assess_effects};
use raywright_core::scene::{ImageData, PixelData, Scene};
use raywright_core::settings::Aov;
use raywright_core::{estimate_scene_memory, prepare};
use serde_json::{Value, json};

use crate::support::{EyeAndTarget, Surface, expect_pixel, physical, pixel, scene, settings, sun};

/// The image's normal everywhere: right, up in the image and outwards. It leans less than 45°, so
/// that a perpendicular view is mirrored above the surface.
const TEXEL: DVec3 = DVec3::new(0.36, -0.48, 0.8);
/// Direction of the light, perpendicular to no axis.
const LIGHT: DVec3 = DVec3::new(0.36, 0.48, 0.8);

/// A matte material with the normal map, and further terms.
fn bumpy(more: Value) -> Value {
    let mut terms = json!({ "base_colour": 0.5, "ior": 1, "normal_texture": { "name": "bump" } });
    terms
        .as_object_mut()
        .expect("a table")
        .extend(more.as_object().expect("a table").clone());
    physical(terms)
}

fn lit(object: Value, data: Value, material: Value, light: DVec3) -> Scene {
    let mut scene = scene(json!({
        "meshes": [{ "name": "leaf", "source": { "inline": data } }], "images": [{ "name": "bump", "path": "bump.exr" }],
        "textures": [{ "name": "bump", "image": "bump", "colour_space": "linear" }], "objects": [object],
        "materials": [{ "name": "paint", "model": material }], "lights": [sun(light.to_array())],
    }));
    let code = TEXEL * 0.5 + 0.5;
    let pixels = PixelData::Linear(vec![[code.x as f32, code.y as f32, code.z as f32, 1.0]]);
    scene.images[0].data = Some(Arc::new(ImageData {
        width: 1,
        height: 1,
        pixels,
    }));
    scene
}

/// The triangle 0, 3x, 3y with these coordinates.
fn leaf(uvs: Value) -> Value {
    json!({ "positions": [[0, 0, 0], [3, 0, 0], [0, 3, 0]], "indices": [[0, 1, 2]], "uvs": [uvs] })
}

/// u = x/3, v = 1 − y/3: right is x, up is y.
fn upright() -> Value {
    leaf(json!([[0, 1], [1, 1], [0, 0]]))
}

fn shown(steps: Value) -> Value {
    json!({ "shape": { "mesh": "leaf" }, "material": "paint", "transform": steps })
}

const ONTO: EyeAndTarget = [[0.5, 0.5, 4.0], [0.5, 0.5, 0.0]];
const FROM_BEHIND: EyeAndTarget = [[0.5, 0.5, -4.0], [0.5, 0.5, 0.0]];

/// Radiance of a matte surface of albedo 0.5 with this normal towards `v`.
fn lambert(normal: DVec3, light: DVec3, v: DVec3) -> [f64; 3] {
    Surface::dielectric(0.5, 1.0, 0.0)
        .sends([normal.normalize(), light, v], false)
        .map(|x| x / PI)
}

/// The perturbed normal for a frame of right, up and normal.
fn perturbed_normal([right, up, normal]: [DVec3; 3]) -> DVec3 {
    DMat3::from_cols(right, up, normal) * TEXEL
}

/// Protects: on a mesh the normal map follows the texture coordinates, upright and mirrored, scaled
/// and switched off; from behind its hills are valleys; the mesh's own tangents take precedence
/// over generated ones; a rotated transform of coordinates rotates the image.
#[test]
fn images_lie_along_coordinates() {
    let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z];
    let plain = |data: Value, more: Value| lit(shown(json!([])), data, bumpy(more), LIGHT);
    expect_pixel(
        &plain(upright(), json!({})),
        ONTO,
        lambert(perturbed_normal([x, y, z]), LIGHT, z),
    );
    expect_pixel(
        &plain(upright(), json!({ "normal_scale": 0.5 })),
        ONTO,
        lambert(TEXEL * DVec3::new(0.5, 0.5, 1.0), LIGHT, z),
    );
    expect_pixel(
        &plain(upright(), json!({ "normal_scale": 0 })),
        ONTO,
        lambert(z, LIGHT, z),
    );
    // u = 1 − x/3, and u = y/3, v = x/3.
    expect_pixel(
        &plain(leaf(json!([[1, 1], [0, 1], [1, 0]])), json!({})),
        ONTO,
        lambert(perturbed_normal([-x, y, z]), LIGHT, z),
    );
    expect_pixel(
        &plain(leaf(json!([[0, 0], [0, 1], [1, 0]])), json!({})),
        ONTO,
        lambert(perturbed_normal([y, -x, z]), LIGHT, z),
    );
    // The same surface from behind: its normal is opposite.
    let below = LIGHT * DVec3::new(1.0, 1.0, -1.0);
    let behind = lit(shown(json!([])), upright(), bumpy(json!({})), below);
    expect_pixel(
        &behind,
        FROM_BEHIND,
        lambert(-perturbed_normal([x, y, z]), below, -z),
    );
    let mut own = upright();
    (own["normals"], own["tangents"]) = (
        json!([[0, 0, 1], [0, 0, 1], [0, 0, 1]]),
        json!([[0, 1, 0, -1], [0, 1, 0, -1], [0, 1, 0, -1]]),
    );
    expect_pixel(
        &plain(own, json!({})),
        ONTO,
        lambert(perturbed_normal([y, x, z]), LIGHT, z),
    );
    // u' = v, v' = −u: right in the image is where v grows, up where u does.
    let turned =
        json!({ "normal_texture": { "name": "bump", "uv_transform": [[0, 1, 0], [-1, 0, 0]] } });
    expect_pixel(
        &plain(upright(), turned),
        ONTO,
        lambert(perturbed_normal([-y, x, z]), LIGHT, z),
    );
    // A set of coordinates other than the first.
    let mut sets = upright();
    sets["uvs"] = json!([[[0, 0], [0, 0], [0, 0]], [[0, 1], [1, 1], [0, 0]]]);
    let second = json!({ "normal_texture": { "name": "bump", "uv_set": 1 } });
    expect_pixel(
        &plain(sets, second),
        ONTO,
        lambert(perturbed_normal([x, y, z]), LIGHT, z),
    );
}

/// Protects: object transforms carry the normal map along, mirrored and sheared, for single meshes
/// and for instances of one mesh.
#[test]
fn images_go_with_their_objects() {
    let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z];
    let mirrored = || shown(json!([{ "scale": [-1, 1, 1] }, { "translate": [2, 0, 0] }]));
    let alone = lit(mirrored(), upright(), bumpy(json!({})), LIGHT);
    expect_pixel(
        &alone,
        [[1.5, 0.5, 4.0], [1.5, 0.5, 0.0]],
        lambert(perturbed_normal([-x, y, z]), LIGHT, z),
    );
    let mut both = lit(mirrored(), upright(), bumpy(json!({})), LIGHT);
    both.objects.push(
        serde_json::from_value(shown(json!([{ "translate": [5, 0, 0] }]))).expect("an object"),
    );
    expect_pixel(
        &both,
        [[1.5, 0.5, 4.0], [1.5, 0.5, 0.0]],
        lambert(perturbed_normal([-x, y, z]), LIGHT, z),
    );
    expect_pixel(
        &both,
        [[5.5, 0.5, 4.0], [5.5, 0.5, 0.0]],
        lambert(perturbed_normal([x, y, z]), LIGHT, z),
    );
    // Sheared, x goes to (1, 1, 0)/√2; up is perpendicular to it.
    let sheared = shown(json!([{ "matrix": [[1, 0, 0, 0], [1, 1, 0, 0], [0, 0, 1, 0]] }]));
    let [right, up] = [
        DVec3::new(1.0, 1.0, 0.0).normalize(),
        DVec3::new(-1.0, 1.0, 0.0).normalize(),
    ];
    expect_pixel(
        &lit(sheared, upright(), bumpy(json!({})), LIGHT),
        [[0.5, 1.0, 4.0], [0.5, 1.0, 0.0]],
        lambert(perturbed_normal([right, up, z]), LIGHT, z),
    );
}

/// Protects: shapes have their own frames: on a sphere right is east and up north, from inside and
/// from outside.
#[test]
fn images_on_shapes() {
    let ball =
        json!({ "shape": { "sphere": { "centre": [0, 0, 0], "radius": 1 } }, "material": "paint" });
    let n = DVec3::new(0.48, 0.6, 0.64);
    let east = DVec3::new(n.z, 0.0, -n.x).normalize();
    let normal = perturbed_normal([east, n.cross(east), n]);
    let data = leaf(json!([[0, 0], [0, 0], [0, 0]]));
    // Not along the normal, where right and up would not matter.
    let light = (n + east * 0.5 + n.cross(east) * 0.2).normalize();
    expect_pixel(
        &lit(ball.clone(), data.clone(), bumpy(json!({})), light),
        [(n * 3.0).to_array(), n.to_array()],
        lambert(normal, light, n),
    );
    // From inside, lit from inside: without shadow rays.
    let mut inside = lit(ball, data, bumpy(json!({})), -light);
    inside.lights[0].shadows = false;
    expect_pixel(
        &inside,
        [[0.0; 3], n.to_array()],
        lambert(-normal, -light, -n),
    );
}

/// Protects: tangents equal those of the bakers' library: equal over flat parts, averaged over
/// curved ones, separate where coordinates have a seam; independent of the size and the position of
/// the mesh.
#[test]
fn tangents_do_not_depend_on_size() {
    let roof = |size: f64, away: f64| {
        let positions = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 1.0],
            [0.0, 1.0, 0.0],
            [-1.0, 0.0, 1.0],
        ];
        let place = |p: [f64; 3]| [(p[0] + away) * size, p[1] * size, p[2] * size];
        json!({ "positions": positions.map(place), "indices": [[0, 1, 2], [0, 2, 3]],
            "normals": [[0, 0, 1], [-1, 0, 1], [0, 0, 1], [1, 0, 1]], "uvs": [[[0.5, 1], [1, 1], [0.5, 0], [0, 1]]] })
    };
    let at = |size: f64, away: f64| -> [f64; 3] {
        let scene = lit(shown(json!([])), roof(size, away), bumpy(json!({})), LIGHT);
        let [x, y] = [(0.25 + away) * size, 0.25 * size];
        pixel(&scene, &settings(&scene, [[x, y, 4.0 * size], [x, y, 0.0]]))
    };
    let one = at(1.0, 0.0);
    assert!(one[0] > 0.0);
    for (size, away) in [
        (1e-6, 0.0),
        (1e9, 0.0),
        (1e9, 64.0),
        (1e-6, 64.0),
        (1e13, 0.0),
    ] {
        let other = at(size, away);
        assert!(
            (other[0] / one[0] - 1.0).abs() < 1e-4,
            "{size} {away}: {other:?}, not {one:?}"
        );
    }
}

/// Protects: degenerate coordinates and normals leave the surface smooth or arbitrarily bent, and
/// never a picture with holes: no area, all at one point, the largest numbers, triangles without an
/// area, no coordinates at all.
#[test]
fn odd_meshes_have_normals() {
    let odd = [
        json!([[0, 0], [0, 0], [0, 0]]),
        json!([[0, 0], [1, 1], [2, 2]]),
        json!([[-3e38, 3e38], [3e38, 3e38], [3e38, -3e38]]),
        json!([[1e-45, 0], [0, 1e-45], [0, 0]]),
    ];
    let mut meshes: Vec<Value> = odd.into_iter().map(leaf).collect();
    let mut flat = upright();
    flat["indices"] = json!([[0, 1, 2], [0, 0, 0], [0, 1, 1], [2, 1, 0]]);
    meshes.push(flat);
    for data in meshes {
        let scene = lit(shown(json!([])), data.clone(), bumpy(json!({})), LIGHT);
        let found = pixel(&scene, &settings(&scene, ONTO));
        assert!(
            found
                .iter()
                .all(|c| c.is_finite() && (0.0..1.0).contains(c)),
            "{data}: {found:?}"
        );
    }
}

/// Protects: the effect is detected if a normal map affects light, can be switched off to the bits
/// of a scene without it, and its memory is estimated; the layer of normals shows perturbed
/// normals.
#[test]
fn the_effect_of_normal_maps() {
    let value_of = |more: Value| lit(shown(json!([])), upright(), bumpy(more), LIGHT);
    let status =
        |scene: &Scene| assess_effects(scene, &settings(scene, ONTO)).status(Effect::NormalMaps);
    assert_eq!(status(&value_of(json!({}))), EffectStatus::Simulated);
    for more in [
        json!({ "normal_scale": 0 }),
        json!({ "unlit": true }),
        json!({ "normal_texture": null }),
    ] {
        assert_eq!(
            status(&value_of(more.clone())),
            EffectStatus::Absent,
            "{more}"
        );
    }
    let (scene, bare) = (
        value_of(json!({})),
        value_of(json!({ "normal_texture": null })),
    );
    let mut off = settings(&scene, ONTO);
    off.without = EffectSet::from_effects(&[Effect::NormalMaps]);
    assert_eq!(pixel(&scene, &off), pixel(&bare, &settings(&bare, ONTO)));
    let mut layered = settings(&scene, ONTO);
    layered.aovs = vec![Aov::Normal];
    let ready = prepare(&scene, &layered, &()).unwrap_or_else(|e| panic!("{e}"));
    let (planned, there) = (estimate_scene_memory(&scene, &layered), ready.memory());
    assert!(
        planned.meshes == there.meshes && there.meshes > 48,
        "{planned:?} {there:?}"
    );
    let picture = ready.render(&()).picture;
    let normal = DVec3::from([0, 1, 2].map(|axis| f64::from(picture.layers[axis].samples[0])));
    assert!(normal.distance(TEXEL) < 1e-6, "{normal:?}");
}
