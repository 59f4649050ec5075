//! The preset of noise and procedural materials against the shader that it comes from.

use raywright::core::settings::{Aov, PrecisionChoice};

use super::{carried, hold_stable, object_ids, read, reference, render, stable_mask};

/// Folder, time, pointer, size.
const VIEWS: [(&str, f64, [f64; 2], [u32; 2]); 2] =
    [("t6_480x270", 6.0, [0.5, 0.5], [480, 270]), ("t20_240x180", 20.0, [0.45, 0.6], [240, 180])];

/// Protects: gradient noise and its sums inside expressions of surfaces, weights, shadows and sky, and every constant of
/// the preset.
fn views(precision: PrecisionChoice) {
    let Some(folder) = reference("noise").filter(|_| carried("noise")) else { return };
    for (name, t, [x, y], size) in VIEWS {
        let folder = folder.join(name);
        let stable = stable_mask(&folder);
        let ours = render("noise", t, &[("mouse_x", x), ("mouse_y", y)], |s| {
            s.size = size;
            s.precision = precision;
            s.aovs = vec![Aov::Object];
        })
        .picture;
        for file in ["color.exr", "color_f64.exr"] {
            hold_stable(&format!("noise {name} {file}"), &ours, &read(&folder.join(file)), &stable, 0.0005);
        }
        let (ours, theirs) = (object_ids(&ours, "object.id"), object_ids(&read(&folder.join("aov.exr")), "object"));
        let wrong = (0..ours.len()).filter(|&i| stable[i] && ours[i] != theirs[i]).count();
        assert_eq!(wrong, 0, "{name}: stable pixels that see another object");
    }
}

#[test]
fn both_views_robust() {
    views(PrecisionChoice::Robust);
}

#[test]
fn both_views_reference() {
    views(PrecisionChoice::Reference);
}
