//! The preset of the round textured room against the shader that it comes from.

use raywright::core::settings::{Aov, PrecisionChoice};

use super::{carried, hold_stable, object_ids, read, reference, render, stable_mask};

/// Folder, parameter, and the place of our objects in the reference's order: column and wall change places in its second set.
const SETS: [(&str, f64, [f32; 6]); 2] =
    [("set_a", 0.0, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]), ("set_b", 1.0, [0.0, 1.0, 3.0, 2.0, 4.0, 5.0])];

/// Protects: near and far roots by side, texture coordinates by expression, weights by the angle of view, unshadowed
/// highlights, rays without offset, and the local colour at the end of the only bounce.
fn sets(precision: PrecisionChoice) {
    let Some(folder) = reference("kinderpainter").filter(|_| carried("kinderpainter")) else { return };
    for (name, b, order) in SETS {
        let folder = folder.join(name);
        let stable = stable_mask(&folder);
        let ours = render("kinderpainter", 0.0, &[("b", b)], |s| {
            s.precision = precision;
            s.aovs = vec![Aov::Object];
        })
        .picture;
        for file in ["color.exr", "color_f64.exr"] {
            hold_stable(&format!("kinderpainter {name} {file}"), &ours, &read(&folder.join(file)), &stable, 0.0002);
        }
        let (ours, theirs) = (object_ids(&ours, "object.id"), object_ids(&read(&folder.join("aov.exr")), "object"));
        let wrong = (0..ours.len()).filter(|&i| stable[i] && order.get(ours[i] as usize) != Some(&theirs[i])).count();
        assert_eq!(wrong, 0, "{name}: stable pixels that see another object");
    }
}

#[test]
fn both_sets_robust() {
    sets(PrecisionChoice::Robust);
}

#[test]
fn both_sets_reference() {
    sets(PrecisionChoice::Reference);
}
