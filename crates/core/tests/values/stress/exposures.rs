//! Exposures and materials that show a single colour.

use super::*;

/// Protects: a picture that is shown as white or as black everywhere is reported, with an exposure
/// that shows it. A white sky of radiance 1, and an object that is dark beside a light one, are not.
#[test]
fn exposures_that_show_nothing() {
    let of = |exposure: f64, sky: f64| {
        let mut scene = scene(&json!({ "sky": { "constant": sky } }));
        scene.render.exposure = exposure;
        scene
    };
    for (exposure, sky, colour) in [
        (12.0, 0.5, "white"),
        (0.0, 1e3, "white"),
        (-12.0, 0.5, "black"),
        (0.0, 1e-4, "black"),
        (0.0, 1e-7, "black"),
        (0.0, 0.004, "black"),
        (0.0, 1e6, "white"),
    ] {
        let finding = alone(&of(exposure, sky), FindingCode::BadExposure, PictureWrong);
        assert!(finding.reason.contains(colour), "{finding:?}");
        let words = finding
            .remedy
            .split("--exposure ")
            .nth(1)
            .unwrap_or_default();
        let advised = words
            .split([',', ' '])
            .next()
            .and_then(|number| number.parse().ok());
        let advised: f64 = advised.unwrap_or_else(|| panic!("{finding:?}"));
        assert_eq!(listed(&summarise_findings(&of(advised, sky)).findings), []);
        // It shows surfaces as medium grey.
        assert!(
            (0.05..0.5).contains(&(0.4 * sky * advised.exp2())),
            "{finding:?}"
        );
        let direction = if colour == "white" {
            "darker"
        } else {
            "brighter"
        };
        assert!(finding.remedy.contains(direction), "{finding:?}");
    }
    assert_eq!(listed(&summarise_findings(&of(0.0, 1.0)).findings), []);
    // A wall of light less than a stop above white fills the picture.
    let wall = scene(&json!({
        "materials": [paint("wall", json!({ "base_colour": 0, "emission": 3.5 }))],
        "objects": [object("wall", quad([-9.0, -9.0, 0.0], [18.0, 0.0, 0.0], [0.0, 18.0, 0.0]), "wall")],
    }));
    let found = summarise_findings(&wall).findings;
    let mut codes = found.iter().map(|finding| finding.code);
    assert!(
        !codes.any(|code| code == FindingCode::BadExposure),
        "{found:?}"
    );
}

/// Protects: white surfaces are reported before a black background too, with the factor for their
/// light, and without an exposure that no scene may set. A white lamp alone is meant to be white.
#[test]
fn white_surfaces_before_black() {
    let of = |colour: f64| {
        let light = json!({ "kind": { "point": { "position": [2, 4, 6] } }, "colour": colour });
        scene(&json!({ "sky": null, "lights": [light] }))
    };
    let finding = alone(&of(1e6), FindingCode::BadExposure, PictureWrong);
    assert!(finding.reason.contains("surfaces in view"), "{finding:?}");
    assert!(finding.remedy.contains("--exposure -"), "{finding:?}");
    let finding = alone(&of(1e30), FindingCode::BadExposure, PictureWrong);
    assert!(
        finding.remedy.starts_with("make the lights about")
            && finding.remedy.ends_with("times darker"),
        "{finding:?}"
    );
    assert_eq!(listed(&summarise_findings(&of(30.0)).findings), []);
    let lamp = scene(&json!({
        "materials": [paint("lamp", json!({ "base_colour": 0, "emission": 9 }))], "sky": null,
        "objects": [object("ball", ball([0.0; 3], 1.0), "lamp")],
    }));
    assert_eq!(listed(&summarise_findings(&lamp).findings), []);
}

/// Protects: bodies that absorb all light of every colour within a share of their thickness are
/// reported. Coloured glass of the same distance is not, and neither is a body of that thickness.
#[test]
fn bodies_that_look_black() {
    let of = |colour: Value, distance: f64| {
        let terms = json!({ "transmission": 1, "roughness": 0, "attenuation_colour": colour, "attenuation_distance": distance });
        scene(&json!({ "materials": [paint("paint", terms), paint("other", json!({}))] }))
    };
    let black = json!([0.1, 0.9, 0.9]);
    let finding = alone(
        &of(black.clone(), 1e-3),
        FindingCode::AbsorptionOutOfScale,
        Harmless,
    );
    assert!(finding.reason.contains("every colour"), "{finding:?}");
    assert_eq!(
        listed(&summarise_findings(&of(json!([0.1, 1.0, 0.9]), 1e-3)).findings),
        []
    );
    assert_eq!(
        listed(&summarise_findings(&of(black.clone(), 0.3)).findings),
        []
    );
    let clear = of(black, 5e3);
    let finding = alone(&clear, FindingCode::AbsorptionOutOfScale, Harmless);
    assert!(finding.reason.contains("look clear"), "{finding:?}");
}
