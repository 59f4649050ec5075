//! Light from emissive surfaces, compared with closed forms.

use raywright::core::picture::Picture;
use raywright::core::prepare;
use raywright::core::scene::{Scene, Shape, SideRule};
use raywright::core::settings::{Sampling, Settings};
use serde_json::json;

/// A close view of a white floor, under a round lamp of radius 1 and radiance 10 at height 2 that
/// shines down.
fn scene(occluder_radius: Option<f64>, lamp: &str) -> Scene {
    sided_scene(occluder_radius, lamp, "outside")
}

fn sided_scene(occluder_radius: Option<f64>, lamp: &str, side: &str) -> Scene {
    let occluder = occluder_radius.map_or(String::new(), |radius| {
        format!(r#", {{ "shape": {{ "disk": {{ "centre": [0, 1, 0], "normal": [0, 1, 0], "radius": {radius} }} }}, "material": "floor" }}"#)
    });
    let text = format!(
        r#"{{ "format": 1,
        "cameras": [{{ "pose": {{ "look_at": {{ "eye": [0.01, 0.3, 0], "target": [0, 0, 0] }} }},
                      "projection": {{ "pinhole": {{ "vertical_fov": 0.5 }} }} }}],
        "materials": [{{ "name": "floor", "model": {{ "classic": {{}} }} }},
                      {{ "name": "lamp", "model": {{ "classic": {{ "local": 0, "emission": 10 }} }} }}],
        "objects": [{{ "shape": {{ "quad": {{ "corner": [-4, 0, 4], "edge_u": [8, 0, 0], "edge_v": [0, 0, -8] }} }}, "material": "floor" }},
                    {{ "shape": {lamp}, "material": "lamp", "side": "{side}" }}{occluder}] }}"#
    );
    serde_json::from_str(&text).expect("the scene is right")
}

const DISK: &str = r#"{ "disk": { "centre": [0, 2, 0], "normal": [0, -1, 0], "radius": 1 } }"#;

fn mean(scene: &Scene) -> f64 {
    let settings = Settings {
        size: [8, 8],
        sampling: Sampling::General(256),
        ..Settings::from_scene(scene)
    };
    let picture: Picture = prepare(scene, &settings, &())
        .unwrap_or_else(|e| panic!("{e}"))
        .render(&())
        .picture;
    picture.rgb.iter().map(|p| f64::from(p[0])).sum::<f64>() / 64.0
}

/// Protects: solid-angle measure, density by area and the π of a Lambert surface. Below the centre
/// of a disk of radiance L the irradiance is π·L·r²/(r² + h²), so that a white surface has the
/// radiance L·r²/(r² + h²).
#[test]
fn a_disk_lights_the_floor_by_its_form_factor() {
    let found = mean(&scene(None, DISK));
    assert!((found - 2.0).abs() < 0.02, "{found} instead of 2");
}

/// Protects: a lamp of varying emission that moves lights the floor from where it is. Light is not
/// sampled at the place where it was at time 0.
#[test]
fn a_moving_lamp_shines_from_where_it_is() {
    let mut moving = serde_json::to_value(scene(None, DISK)).expect("plain data");
    moving["render"]["integrator"] = "path".into();
    moving["cameras"][0]["shutter"] = json!([0.9999, 1]);
    moving["materials"][1]["model"]["classic"]["emission"] = "10 + 0*p.x".into();
    moving["objects"][1]["transform"] = json!([{ "translate": [3, 0, 0] }]);
    moving["objects"][1]["transform_end"] = json!([]);
    let found = mean(&serde_json::from_value(moving).expect("the scene is right"));
    assert!((found - 2.0).abs() < 0.1, "{found} instead of 2");
}

/// Protects: an occluder casts a shadow with the right penumbra. An occluder of half the lamp's
/// radius at half its height covers the lamp exactly; one of a quarter covers the inner half of the
/// lamp's radius.
#[test]
fn an_occluder_takes_its_part() {
    assert_eq!(mean(&scene(Some(0.51), DISK)), 0.0);
    let found = mean(&scene(Some(0.25), DISK));
    let covered = 10.0 * 0.25 / (0.25 + 4.0);
    assert!(
        (found - (2.0 - covered)).abs() < 0.02,
        "{found} instead of {}",
        2.0 - covered
    );
}

/// Protects: a one-sided lamp that faces away lights nothing, and a sphere lights as the disk of
/// the same solid angle: L·sin².
#[test]
fn sides_and_spheres() {
    let away = DISK.replace("-1, 0]", "1, 0]");
    assert_eq!(mean(&scene(None, &away)), 0.0);
    let found = mean(&scene(
        None,
        r#"{ "sphere": { "centre": [0, 2, 0], "radius": 0.5 } }"#,
    ));
    let expected = 10.0 * 0.25 / 4.0;
    assert!(
        (found - expected).abs() < 0.02,
        "{found} instead of {expected}"
    );
}

/// Protects: a surface emits on its visible sides. From outside, a glowing sphere is a disk of
/// L·sin² for either wall, the outside of the near one or the inside of the far one; from within,
/// its inside fills the sky: L.
#[test]
fn each_side_lights_whom_it_faces() {
    let ball = r#"{ "sphere": { "centre": [0, 2, 0], "radius": 0.5 } }"#;
    let room = r#"{ "sphere": { "centre": [0, 0, 0], "radius": 9 } }"#;
    let cap = 10.0 * 0.25 / 4.0;
    for (side, outside, within) in [
        ("outside", cap, 0.0),
        ("culled", cap, 0.0),
        ("inside", cap, 10.0),
        ("both", cap, 10.0),
    ] {
        let found = mean(&sided_scene(None, ball, side));
        assert!(
            (found - outside).abs() < 0.02,
            "{side}, seen from outside: {found} instead of {outside}"
        );
        let found = mean(&sided_scene(None, room, side));
        assert!(
            (found - within).abs() < 0.05,
            "{side}, seen from within: {found} instead of {within}"
        );
    }
}

/// Protects: the camera sees only the outside of culled surfaces, and light meets both sides. A
/// disk above the floor, with its back to the floor, blocks the lamp's light; so does a disk right
/// before the camera, which looks through its back at the dark floor.
#[test]
fn the_camera_looks_through_backs_that_stop_light() {
    let mut scene = scene(Some(0.51), DISK);
    scene.objects[2].side = SideRule::Culled;
    assert_eq!(mean(&scene), 0.0);
    scene.objects[2].shape = Shape::Disk {
        centre: [0.0, 0.1, 0.0],
        normal: [0.0, -1.0, 0.0],
        radius: 0.2,
    };
    assert_eq!(mean(&scene), 0.0);
    scene.objects[2].side = SideRule::Both;
    assert!(mean(&scene) > 1.0);
}

/// Protects: no light of a lamp passes an opaque cover a few steps of single precision before it,
/// for quads, balls, boxes, disks and meshes as lamps; without the cover the lamp lights the floor.
#[test]
fn a_lamp_a_hair_behind_a_cover_is_dark() {
    let corners = |y: f64, r: f64| {
        format!("[[-{r}, {y}, -{r}], [{r}, {y}, -{r}], [{r}, {y}, {r}], [-{r}, {y}, {r}]]")
    };
    let quad = |y: f64, r: f64| {
        format!(
            r#"{{ "quad": {{ "corner": [-{r}, {y}, -{r}], "edge_u": [{s}, 0, 0], "edge_v": [0, 0, {s}] }} }}"#,
            s = 2.0 * r
        )
    };
    for (height, gap) in [
        (1.0, 1e-6),
        (1.0, 5e-7),
        (1e-3, 5e-10),
        (1e4, 4e-3),
        (1e6, 0.25),
    ] {
        let r = height;
        let lamps = [
            quad(height, r),
            format!(
                r#"{{ "disk": {{ "centre": [0, {height}, 0], "normal": [0, -1, 0], "radius": {r} }} }}"#
            ),
            format!(
                r#"{{ "box": {{ "min": [-{r}, {height}, -{r}], "max": [{r}, {}, {r}] }} }}"#,
                height + r
            ),
            format!(
                r#"{{ "sphere": {{ "centre": [0, {}, 0], "radius": {r} }} }}"#,
                height + r
            ),
            r#"{ "mesh": "lamp" }"#.to_owned(),
        ];
        for lamp in lamps {
            let of = |cover: &str, integrator: &str| -> Scene {
                let text = format!(
                    r#"{{ "format": 1, "render": {{ "integrator": "{integrator}", "max_depth": 3 }},
                    "cameras": [{{ "pose": {{ "look_at": {{ "eye": [{r}, {e}, {r}], "target": [{near}, 0, 0] }} }},
                                   "projection": {{ "pinhole": {{ "vertical_fov": 1 }} }} }}],
                    "materials": [{{ "name": "floor", "model": {{ "classic": {{ "colour": 0.6 }} }} }},
                                  {{ "name": "black", "model": {{ "classic": {{ "colour": 0 }} }} }},
                                  {{ "name": "lamp", "model": {{ "classic": {{ "local": 0, "emission": 4 }} }} }}],
                    "meshes": [{{ "name": "lamp", "source": {{ "inline": {{ "positions": {mesh}, "indices": [[0, 1, 2], [0, 2, 3]] }} }} }}],
                    "objects": [{{ "shape": {{ "plane": {{ "point": [0, 0, 0], "normal": [0, 1, 0] }} }}, "material": "floor" }},
                                {{ "shape": {lamp}, "material": "lamp" }}{cover}] }}"#,
                    e = 0.5 * height,
                    near = 0.01 * height,
                    mesh = corners(height, r),
                );
                serde_json::from_str(&text).unwrap_or_else(|e| panic!("{e}"))
            };
            let cover = format!(
                r#", {{ "shape": {}, "material": "black" }}"#,
                quad(height - gap, 3.0 * r)
            );
            for integrator in ["path", "whitted"] {
                assert!(mean(&of("", integrator)) > 0.1, "{lamp}: dark by itself");
                assert_eq!(
                    mean(&of(&cover, integrator)),
                    0.0,
                    "{lamp} {gap} behind its cover, {integrator}"
                );
            }
        }
    }
}
