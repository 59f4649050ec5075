//! Vertex attributes of meshes, interpolated, under every kind of transform, for single and
//! repeated use.

use raywright_core::Settings;
use raywright_core::scene::{Scene, TransformStep};
use raywright_core::settings::Aov;
use serde_json::{Value, json};

use crate::support::{
    EyeAndTarget, classic, expect_pixel, floor, physical, render_scene, scene, settings, sun,
};

/// The point of weights 0.5, 0.3 and 0.2 of the corners (0, 0, 0), (1, 0, 0) and (0, 1, 0).
const POINT: [f64; 3] = [0.3, 0.2, 0.0];

fn view([x, y, z]: [f64; 3]) -> EyeAndTarget {
    [[x, y, z + 2.0], [x, y, z]]
}

/// A triangle facing +z, once for each transform.
fn leaf(extra: Value, model: Value, maps: &[Value]) -> Scene {
    let mut data =
        json!({ "positions": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "indices": [[0, 1, 2]] });
    data.as_object_mut()
        .expect("a table")
        .extend(extra.as_object().expect("a table").clone());
    let objects: Vec<Value> = maps
        .iter()
        .map(|map| json!({ "shape": { "mesh": "leaf" }, "material": "green", "transform": map }))
        .collect();
    scene(
        json!({ "meshes": [{ "name": "leaf", "source": { "inline": data } }], "objects": objects,
        "materials": [{ "name": "green", "model": model }] }),
    )
}

/// Two kinds of storage: used once, and shared with a copy far away.
fn stored(map: Value) -> [Vec<Value>; 2] {
    [
        vec![map.clone()],
        vec![map, json!([{ "translate": [0, 0, -90] }])],
    ]
}

/// Protects: each corner's colour has its own weight, also if the transform mirrors and the
/// triangle is reversed; `vertex_colours` enables them.
#[test]
fn colours_are_interpolated() {
    let colours = || json!({ "colours": [[1, 0, 0, 1], [0, 1, 0, 1], [0, 0, 1, 1]] });
    let unlit = |vertex_colours: bool| {
        physical(
            json!({ "unlit": true, "vertex_colours": vertex_colours, "base_colour": [1, 1, 0.5] }),
        )
    };
    for maps in stored(json!([])) {
        expect_pixel(
            &leaf(colours(), unlit(true), &maps),
            view(POINT),
            [0.5, 0.3, 0.1],
        );
        expect_pixel(
            &leaf(colours(), unlit(false), &maps),
            view(POINT),
            [1.0, 1.0, 0.5],
        );
    }
    for maps in stored(json!([{ "scale": [-1, 1, 1] }])) {
        expect_pixel(
            &leaf(colours(), unlit(true), &maps),
            view([-0.3, 0.2, 0.0]),
            [0.5, 0.3, 0.1],
        );
    }
}

/// Protects: the alpha of vertices acts like a texture's.
#[test]
fn alphas_of_vertices_cover() {
    let colours = json!({ "colours": [[1, 1, 1, 1], [1, 1, 1, 0], [1, 1, 1, 0.5]] });
    let model = physical(
        json!({ "unlit": true, "vertex_colours": true, "alpha": "blend", "opacity": 0.5 }),
    );
    // 0.5 · (0.5 + 0.5 · 0.2).
    expect_pixel(&leaf(colours, model, &[json!([])]), view(POINT), [0.3; 3]);
}

/// Protects: the first set of coordinates is `u` and `v`, mirrored or not; without a set they are
/// barycentric coordinates.
#[test]
fn coordinates_are_interpolated() {
    let show = || json!({ "classic": { "colour": "[u, v, 0]", "ambient": 1 } });
    let uvs = || json!({ "uvs": [[[0, 1], [2, 1], [0, 4]]] });
    for maps in stored(json!([])) {
        // u = 2 · 0.3, v = 1 + 3 · 0.2.
        expect_pixel(&leaf(uvs(), show(), &maps), view(POINT), [0.6, 1.6, 0.0]);
        expect_pixel(
            &leaf(json!({}), show(), &maps),
            view(POINT),
            [0.3, 0.2, 0.0],
        );
    }
    for maps in stored(json!([{ "scale": [-1, 1, 1] }])) {
        expect_pixel(
            &leaf(uvs(), show(), &maps),
            view([-0.3, 0.2, 0.0]),
            [0.6, 1.6, 0.0],
        );
    }
}

fn normal(scene: &Scene, view: EyeAndTarget) -> [f32; 3] {
    let settings = Settings {
        aovs: vec![Aov::Normal],
        ..settings(scene, view)
    };
    let picture = render_scene(scene, &settings).picture;
    ["normal.X", "normal.Y", "normal.Z"]
        .map(|name| picture.layer(name).expect("asked for").samples[0])
}

#[track_caller]
fn has_normal(scene: &Scene, view: EyeAndTarget, [x, y, z]: [f64; 3]) {
    let found = normal(scene, view);
    let length = f64::sqrt(x * x + y * y + z * z);
    let expected = [x / length, y / length, z / length];
    assert!(
        found
            .iter()
            .zip(expected)
            .all(|(&a, b)| (f64::from(a) - b).abs() < 1e-6),
        "{found:?} instead of {expected:?}"
    );
}

/// Protects: normals are interpolated, transformed by the inverse transpose, normalised, and
/// flipped to the viewer.
#[test]
fn normals_are_interpolated() {
    let normals = || json!({ "normals": [[0, 0, 1], [0.8, 0, 0.6], [0, 0.6, 0.8]] });
    let n = [0.24, 0.12, 0.5 + 0.18 + 0.16];
    let matte = || physical(json!({}));
    for maps in stored(json!([])) {
        has_normal(&leaf(normals(), matte(), &maps), view(POINT), n);
        has_normal(
            &leaf(normals(), matte(), &maps),
            [[0.3, 0.2, -2.0], POINT],
            n.map(|x| -x),
        );
        has_normal(
            &leaf(json!({}), matte(), &maps),
            view(POINT),
            [0.0, 0.0, 1.0],
        );
    }
    for maps in stored(json!([{ "scale": [2, 1, 4] }])) {
        has_normal(
            &leaf(normals(), matte(), &maps),
            view([0.6, 0.2, 0.0]),
            [n[0] / 2.0, n[1], n[2] / 4.0],
        );
    }
    for maps in stored(json!([{ "rotate": { "axis": [0, 0, 2], "degrees": 90 } }])) {
        has_normal(
            &leaf(normals(), matte(), &maps),
            view([-0.2, 0.3, 0.0]),
            [-n[1], n[0], n[2]],
        );
    }
}

/// Protects: a shading normal beyond the silhouette is bent until it mirrors the viewer just above
/// the surface, at the same azimuth.
#[test]
fn normals_do_not_turn_away() {
    let normals = json!({ "normals": [[1, 0, 1], [1, 0, 1], [1, 0, 1]] });
    let scene = leaf(normals, physical(json!({})), &[json!([])]);
    // From the left, low: d = (0.96, 0, −0.28) and n·d = 0.68/√2 > 0. The mirror direction is
    // (0.28, 0, −0.96): along x, at height h = −0.96. With m = 0.02 it rises to 0.01 + 0.01²/(0.03
    // − h) = 0.0101.
    let eye = [POINT[0] - 0.96, POINT[1], 0.28];
    let [x, y, z] = normal(&scene, [eye, POINT]).map(f64::from);
    let away = x * 0.96 - z * 0.28;
    let mirrored = [
        0.96 - 2.0 * away * x,
        -2.0 * away * y,
        -0.28 - 2.0 * away * z,
    ];
    assert!(
        mirrored[0] > 0.99 && mirrored[1].abs() < 1e-6 && (mirrored[2] - 0.0101).abs() < 1e-5,
        "{mirrored:?}"
    );
}

/// Protects: objects that share a mesh each cast a shadow or none by their own setting, in any
/// order.
#[test]
fn copies_cast_shadows_of_their_own() {
    let above = |x: f64, casts_shadow: bool| {
        json!({ "shape": { "mesh": "leaf" }, "material": "floor", "casts_shadow": casts_shadow,
            "transform": [{ "rotate": { "axis": [1, 0, 0], "degrees": 90 } }, { "translate": [x - 0.3, 2, -0.2] }] })
    };
    let data = json!({ "positions": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "indices": [[0, 1, 2]] });
    for casts in [[true, true], [true, false], [false, true], [false, false]] {
        let parts = json!({ "lights": [sun([0.0, 1.0, 0.0])], "meshes": [{ "name": "leaf", "source": { "inline": data } }],
            "objects": [above(0.0, casts[0]), above(9.0, casts[1])] });
        let scene = floor(classic(json!({})), parts);
        for (x, casts) in [0.0, 9.0].into_iter().zip(casts) {
            // Below the leaf, viewed from beside it.
            expect_pixel(
                &scene,
                [[x + 3.0, 1.0, 0.0], [x, 0.0, 0.0]],
                if casts { [0.0; 3] } else { [1.0; 3] },
            );
        }
    }
}

/// Protects: a mesh's outside (counter-clockwise) for `side`, also under a mirroring transform and
/// for shared meshes.
#[test]
fn meshes_have_sides() {
    let shown = |side: &str, maps: &[Value], at: EyeAndTarget| {
        let mut scene = leaf(json!({}), physical(json!({ "unlit": true })), maps);
        let side = serde_json::from_value(json!(side)).expect("a side");
        scene
            .objects
            .iter_mut()
            .for_each(|object| object.side = side);
        render_scene(&scene, &settings(&scene, at)).picture.rgb[0][0]
    };
    let below: EyeAndTarget = [[0.3, 0.2, -2.0], POINT];
    for maps in stored(json!([])) {
        assert_eq!(
            (
                shown("outside", &maps, view(POINT)),
                shown("outside", &maps, below)
            ),
            (1.0, 0.0)
        );
        assert_eq!(
            (
                shown("inside", &maps, view(POINT)),
                shown("inside", &maps, below)
            ),
            (0.0, 1.0)
        );
    }
    let mirror = stored(json!([{ "scale": [-1, 1, 1] }]));
    for maps in &mirror {
        assert_eq!(shown("outside", maps, view([-0.3, 0.2, 0.0])), 1.0);
        assert_eq!(
            shown("outside", maps, [[-0.3, 0.2, -2.0], [-0.3, 0.2, 0.0]]),
            0.0
        );
    }
}

/// Protects: an instance is placed by its transform, and a generator's copy by both transforms.
#[test]
fn copies_stand_in_their_places() {
    let mut scene = leaf(
        json!({}),
        physical(json!({ "unlit": true })),
        &[json!([{ "translate": [5, 0, 0] }]), json!([])],
    );
    assert_eq!(
        render_scene(&scene, &settings(&scene, view([5.3, 0.2, 0.0])))
            .picture
            .rgb[0][0],
        1.0
    );
    scene.objects[0]
        .transform
        .insert(0, TransformStep::Scale([2.0; 3]));
    assert_eq!(
        render_scene(&scene, &settings(&scene, view([6.8, 0.1, 0.0])))
            .picture
            .rgb[0][0],
        1.0
    );
    assert_eq!(
        render_scene(&scene, &settings(&scene, view([4.9, 0.1, 0.0])))
            .picture
            .rgb[0][0],
        0.0
    );
}

/// Protects: a mesh with vertices far from zero, used twice, is at its stated position.
#[test]
fn the_extent_of_copies_far_away() {
    use raywright_core::settings::PrecisionChoice;
    let far = json!({ "positions": [[448_200, 0, 0], [448_201, 0, 0], [448_200, 1, 0]] });
    let scene = leaf(
        far,
        classic(json!({})),
        &[json!([]), json!([{ "translate": [0, 0, -90] }])],
    );
    for precision in [PrecisionChoice::Robust, PrecisionChoice::Reference] {
        let bounds = raywright_core::measure_scene_extent(&scene, precision).bounds;
        let found = [bounds.min, bounds.max].map(|corner| corner.to_array());
        assert_eq!(
            found,
            [[448_200.0, 0.0, -90.0], [448_201.0, 1.0, 0.0]],
            "{precision:?}"
        );
    }
}
