//! Glass behind glass, which needs longer paths than a single body.

use super::*;

/// The faultless scene with panes of glass before its ball and block.
fn behind_panes(count: u32, material: &str, max_depth: u32) -> Scene {
    let panes = (0..count).map(|index| {
        let near = 1.5 + 0.4 * f64::from(index);
        let shape = json!({ "box": { "min": [-2.5, -1.5, near], "max": [2.5, 1.5, near + 0.05] } });
        object("pane", shape, material)
    });
    let objects = [
        object("ball", ball([-1.2, 0.0, 0.0], 1.0), "paint"),
        object(
            "block",
            json!({ "box": { "min": [0.3, -1, -0.5], "max": [1.3, 0.4, 0.5] } }),
            "other",
        ),
    ];
    let thin = json!({ "transmission": 1, "roughness": 0, "thin_walled": true });
    let objects: Vec<Value> = objects.into_iter().chain(panes).collect();
    let mut scene = scene(&json!({
        "objects": objects,
        "materials": [paint("paint", json!({ "base_colour": 0.6 })), paint("other", json!({ "base_colour": [0.2, 0.5, 0.6] })),
                      paint("glass", json!({ "transmission": 1, "roughness": 0 })), paint("thin", thin)],
    }));
    scene.render.max_depth = max_depth;
    scene
}

/// Protects: panes that need more segments than paths have are reported, for solid and for thin
/// glass, with a depth at which hardly any light is lost. One pane and one ball are not.
#[test]
fn glass_deeper_than_the_paths() {
    for (count, material) in [(4, "glass"), (4, "thin")] {
        let shallow = behind_panes(count, material, 8);
        let finding = alone(&shallow, FaultKind::DepthBelowGlass, PictureWrong);
        assert!(
            finding.message.contains("at most 8 segments"),
            "{finding:?}"
        );
        let words = finding
            .remedy
            .split("--max-depth ")
            .nth(1)
            .unwrap_or_default();
        let advised = words.split(|c: char| !c.is_ascii_digit()).next();
        let advised: u32 = advised.and_then(|number| number.parse().ok()).unwrap_or(0);
        assert!(advised > 8, "{finding:?}");
        let deep = behind_panes(count, material, advised);
        assert_eq!(listed(&summarise_findings(&deep).findings), [], "{advised}");
    }
    let one = behind_panes(1, "glass", 8);
    assert_eq!(listed(&summarise_findings(&one).findings), []);
    let glass = object("globe", ball([0.0; 3], 1.2), "glass");
    let mut globe = scene(
        &json!({ "objects": [glass, object("ball", ball([-1.2, 0.0, -3.0], 1.0), "paint")] }),
    );
    assert_eq!(listed(&summarise_findings(&globe).findings), []);
    globe.render.max_depth = 3;
    expect_finding(&globe, FaultKind::DepthBelowGlass, PictureWrong, &[]);
}

/// Protects: light that only reflections lose at the depth limit is not blamed on glass. Two pieces
/// of a closed white room see the same.
#[test]
fn reflections_are_not_blamed_on_glass() {
    let room = json!({ "box": { "min": [-4, -3, -4], "max": [4, 3, 8] } });
    let lit = json!({
        "sky": null,
        "objects": [object("room", room, "white"), object("globe", ball([0.0, 0.5, 1.0], 0.6), "glass"),
                    object("lamp", quad([-2.0, 2.9, -2.0], [4.0, 0.0, 0.0], [0.0, 0.0, 4.0]), "lamp")],
        "materials": [paint("white", json!({ "base_colour": 0.9 })), paint("glass", json!({ "transmission": 1, "roughness": 0 })),
                      paint("lamp", json!({ "base_colour": 0, "emission": 4 }))],
        "render": { "size": [96, 54], "samples": 8, "integrator": "path", "max_depth": 8 },
    });
    let found = summarise_findings(&scene(&lit)).findings;
    let is_deep = |found: &Fault| found.kind == FaultKind::DepthBelowGlass;
    assert!(!found.iter().any(is_deep), "{:?}", listed(&found));
}

/// Protects: the second camera's picture has the scene's own depth, whatever depths the first one
/// was measured with.
#[test]
fn each_camera_has_the_depth_of_the_scene() {
    let mut views = behind_panes(4, "glass", 8);
    let mut behind = views.cameras[0].clone();
    let pose = json!({ "look_at": { "eye": [0.5, 0.2, 2.6], "target": [0.5, 0.2, 4] } });
    behind.pose = serde_json::from_value(pose).expect("a pose");
    let first = core::mem::replace(&mut views.cameras[0], behind);
    let alone = summarise_findings(&views);
    views.cameras.push(first);
    let both = summarise_findings(&views);
    let is_deep = |found: &Fault| found.kind == FaultKind::DepthBelowGlass;
    assert!(
        !alone.findings.iter().any(is_deep),
        "{:?}",
        listed(&alone.findings)
    );
    assert!(
        both.findings.iter().any(is_deep),
        "{:?}",
        listed(&both.findings)
    );
}
