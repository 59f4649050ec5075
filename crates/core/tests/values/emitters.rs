//! Area lights: tiny ones, uniform over their points, and large ones against Lambert's polygon
//! formula.

use core::f64::consts::PI;

use raywright_core::scene::{Scene, TransformStep};
use raywright_core::settings::{PrecisionChoice, Sampling, Settings};
use serde_json::{Value, json};

use crate::support::{
    EyeAndTarget, classic, expect_near, expect_pixel_within, floor, physical, pixel, settings,
};

const AT: EyeAndTarget = [[1.5, 1.0, 0.0], [1.5, 0.0, 0.0]];

fn quad(corner: [f64; 3], edge_u: [f64; 3], edge_v: [f64; 3], material: &str) -> Value {
    json!({ "shape": { "quad": { "corner": corner, "edge_u": edge_u, "edge_v": edge_v } }, "material": material })
}

fn lamp(name: &str, radiance: f64) -> Value {
    json!({ "name": name, "model": { "classic": { "local": 0, "emission": radiance } } })
}

/// A floor of one material under objects that emit a radiance of 10⁶.
fn under(model: Value, objects: &[Value]) -> Scene {
    floor(
        model,
        json!({ "materials": [lamp("lamp", 1e6)], "objects": objects }),
    )
}

/// A downward lamp of area 4·10⁻⁶ at height 2.
fn spark() -> Value {
    quad(
        [-0.001, 2.0, -0.001],
        [0.002, 0.0, 0.0],
        [0.0, 0.0, 0.002],
        "lamp",
    )
}

/// Irradiance of the lamp at (1.5, 0, 0), over π: L · A · 0.8 · 0.8 / 2.5².
const BROUGHT: f64 = 4.0 * 0.64 / 6.25 / PI;

/// Protects: a tiny lamp gives radiance · area · both cosines / distance², times the classic colour
/// over π and its `diffuse`.
#[test]
fn a_spark_lights_by_its_cosines() {
    let model = || classic(json!({ "colour": [1, 0.5, 0], "diffuse": 0.5 }));
    expect_pixel_within(
        &under(model(), &[spark()]),
        AT,
        [0.5 * BROUGHT, 0.25 * BROUGHT, 0.0],
        2e-3,
    );
}

/// Protects: physical surfaces respond to emitters as to delta lights.
#[test]
fn a_spark_lights_physical_surfaces() {
    let found = pixel(
        &under(
            physical(json!({ "base_colour": 0.5, "ior": 1 })),
            &[spark()],
        ),
        &one_ray(),
    );
    expect_near(found, [0.5 * BROUGHT; 3], 2e-3, "Lambert");
}

fn one_ray() -> Settings {
    settings(&Scene::default(), AT)
}

/// Protects: an emitter's sides are respected, whichever of them faces the floor: `edge_u × edge_v`
/// is the outside, down or up.
#[test]
fn a_spark_has_sides() {
    let (wide, long) = ([0.002, 0.0, 0.0], [0.0, 0.0, 0.002]);
    for (side, down, up) in [
        ("outside", 1.0, 0.0),
        ("inside", 0.0, 1.0),
        ("both", 1.0, 1.0),
    ] {
        for (share, [edge_u, edge_v]) in [(down, [wide, long]), (up, [long, wide])] {
            let mut lamp = quad([-0.001, 2.0, -0.001], edge_u, edge_v, "lamp");
            lamp["side"] = json!(side);
            expect_near(
                pixel(&under(classic(json!({})), &[lamp]), &one_ray()),
                [share * BROUGHT; 3],
                2e-3,
                side,
            );
        }
    }
}

/// Protects: a transformed emitter has its area and position, as a shape and as a mesh: twice as
/// wide, twice as long.
#[test]
fn a_scaled_spark_has_its_area() {
    let moved = json!([{ "scale": [2, 1, 2] }, { "translate": [0, 2, 0] }]);
    let mut shape = quad(
        [-0.0005, 0.0, -0.0005],
        [0.001, 0.0, 0.0],
        [0.0, 0.0, 0.001],
        "lamp",
    );
    shape["transform"] = moved.clone();
    expect_near(
        pixel(&under(classic(json!({})), &[shape]), &one_ray()),
        [BROUGHT; 3],
        2e-3,
        "shape",
    );
    let e = 0.0005;
    let mesh = json!({ "name": "plate", "source": { "inline": {
        "positions": [[-e, 0, -e], [e, 0, -e], [e, 0, e], [-e, 0, e]], "indices": [[0, 1, 2], [0, 2, 3]] } } });
    let object = json!({ "shape": { "mesh": "plate" }, "material": "lamp", "side": "outside", "transform": moved });
    let mut scene = floor(
        classic(json!({})),
        json!({ "materials": [lamp("lamp", 1e6)], "objects": [object], "meshes": [mesh] }),
    );
    expect_near(pixel(&scene, &one_ray()), [BROUGHT; 3], 2e-3, "mesh");
    // A mirroring transform keeps the outside outside.
    scene.objects[1]
        .transform
        .push(TransformStep::Scale([-1.0, 1.0, 1.0]));
    expect_near(
        pixel(&scene, &one_ray()),
        [BROUGHT; 3],
        2e-3,
        "mirrored mesh",
    );
}

/// Protects: occluders attenuate an area light too, and shadowless objects do not.
#[test]
fn sparks_cast_shadows() {
    let veil = json!({ "name": "veil", "model": { "classic": { "shadow_transmittance": 0.25 } } });
    let between = quad([0.0, 1.1, -1.0], [2.0, 0.0, 0.0], [0.0, 0.0, 2.0], "veil");
    let mut scene = floor(
        classic(json!({})),
        json!({ "materials": [lamp("lamp", 1e6), veil], "objects": [spark(), between] }),
    );
    expect_near(
        pixel(&scene, &one_ray()),
        [0.25 * BROUGHT; 3],
        2e-3,
        "veiled",
    );
    scene.objects[2].casts_shadow = false;
    expect_near(pixel(&scene, &one_ray()), [BROUGHT; 3], 2e-3, "free");
}

/// Irradiance at the origin of a floor from a polygon of radiance one above it, with its corners in
/// order (Lambert, "Photometria", 1760): half the sum over its edges of the angle of the edge times
/// the height of its plane's unit normal.
fn irradiance(corners: &[[f64; 3]]) -> f64 {
    let unit = |p: [f64; 3]| {
        let length = p.iter().map(|x| x * x).sum::<f64>().sqrt();
        p.map(|x| x / length)
    };
    let edge = |i: usize| {
        let (a, b) = (unit(corners[i]), unit(corners[(i + 1) % corners.len()]));
        let cross = [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ];
        let dot: f64 = (0..3).map(|k| a[k] * b[k]).sum();
        dot.acos() * unit(cross)[1]
    };
    (0.5 * (0..corners.len()).map(edge).sum::<f64>()).abs()
}

fn corners(corner: [f64; 3], u: [f64; 3], v: [f64; 3]) -> [[f64; 3]; 4] {
    let at = |s: f64, t: f64| core::array::from_fn(|i| corner[i] + s * u[i] + t * v[i]);
    [at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)]
}

/// Protects: the choice of a lamp and the point on it are independent, and each lamp is chosen by
/// its share. Two large lamps of different power on both sides of the point, one of them half
/// hidden, would show a dependence.
#[test]
fn large_lamps_add_up() {
    let left = ([-4.0, 2.0, -1.0], [3.5, 0.0, 0.0], [0.0, 0.0, 2.0]);
    let right = ([0.5, 1.0, -1.0], [3.5, 1.0, 0.0], [0.0, 0.0, 2.0]);
    let place = |(corner, u, v): ([f64; 3], [f64; 3], [f64; 3]), material: &str| {
        quad(corner, u, v, material)
    };
    let parts = json!({ "materials": [lamp("dim", 2.0), lamp("bright", 5.0)], "objects": [place(left, "dim"), place(right, "bright")] });
    let scene = floor(classic(json!({})), parts);
    let sum =
        |(corner, u, v): ([f64; 3], [f64; 3], [f64; 3])| irradiance(&corners(corner, u, v)) / PI;
    let average = |scene: &Scene| {
        let view = [[0.0, 0.5, 0.0], [0.0; 3]];
        let many = Settings {
            sampling: Sampling::General(65_536),
            precision: PrecisionChoice::Robust,
            ..settings(scene, view)
        };
        let mut many = many;
        // A pixel so narrow that it shows a point.
        if let Some(raywright_core::scene::Camera {
            projection: raywright_core::scene::Projection::Pinhole(p),
            ..
        }) = &mut many.camera
        {
            p.vertical_fov = Some(0.01);
        }
        pixel(scene, &many)
    };
    let expected = 2.0 * sum(left) + 5.0 * sum(right);
    expect_near(average(&scene), [expected; 3], 1e-2, "both");
    // An opaque wall hides the right lamp: the left one remains, sampled as before.
    let wall = quad(
        [0.2, -1.0, -9.0],
        [0.0, 9.0, 0.0],
        [0.0, 0.0, 18.0],
        "floor",
    );
    let parts = json!({ "materials": [lamp("dim", 2.0), lamp("bright", 5.0)], "objects": [place(left, "dim"), place(right, "bright"), wall] });
    expect_near(
        average(&floor(classic(json!({})), parts)),
        [2.0 * sum(left); 3],
        1e-2,
        "left",
    );
}

/// Protects: a partly transparent lamp of varying emission emits its alpha's share: an alpha of
/// 0.25 gives a quarter, like a uniform lamp hit by paths, for every strategy of light sampling.
#[test]
fn a_varying_lamp_that_is_there_in_part() {
    use crate::paths::{AT as SLANTED, expect_pixels};
    let glowing = |opacity: f64| {
        let model = physical(
            json!({ "base_colour": 0, "ior": 1, "emission": "4 + 0*u", "opacity": opacity, "alpha": "blend" }),
        );
        let disk = json!({ "shape": { "disk": { "centre": [0, 2, 0], "normal": [0, -1, 0], "radius": 1.5 } }, "material": "glow" });
        floor(
            classic(json!({ "colour": 0.6 })),
            json!({ "materials": [{ "name": "glow", "model": model }], "objects": [disk] }),
        )
    };
    for opacity in [1.0, 0.25, 0.5] {
        let expected = 0.6 * opacity * 4.0 * 2.25 / (2.25 + 4.0);
        expect_pixels(
            &glowing(opacity),
            SLANTED,
            2,
            [expected; 3],
            &format!("{opacity} of it"),
        );
    }
}
