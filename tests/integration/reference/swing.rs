//! The swinging sphere, and the hyperboloid with its ellipsoid, compared with closed forms and with
//! the original programs.

use raywright::core::picture::Picture;
use raywright::core::settings::{Aov, PrecisionChoice};

use super::{object_ids, read, render};
use crate::support::{carried, shared};

/// Pixels whose 3×3 neighbours show the same object.
fn interior(ids: &[f32], width: u32, height: u32) -> Vec<bool> {
    let (w, h) = (width as usize, height as usize);
    let same = |i: usize| {
        let (x, y) = (i % w, i / w);
        let rows = y.saturating_sub(1)..=(y + 1).min(h - 1);
        rows.flat_map(|y| (x.saturating_sub(1)..=(x + 1).min(w - 1)).map(move |x| y * w + x))
            .all(|k| ids[k] == ids[i])
    };
    (0..ids.len()).map(same).collect()
}

/// Asserts that interiors agree in colour, and that every pixel shows an object that the reference
/// shows there or in a neighbouring pixel.
fn check(label: &str, ours: &Picture, theirs: &Picture, ids: &[f32]) {
    let inside = interior(ids, ours.width, ours.height);
    let mut worst = 0.0_f32;
    for i in (0..inside.len()).filter(|&i| inside[i]) {
        worst = (0..3)
            .map(|k| (ours.rgb[i][k] - theirs.rgb[i][k]).abs())
            .fold(worst, |a, b| if b > a || b.is_nan() { b } else { a });
    }
    let seen = object_ids(ours, "object.id");
    let wrong = (0..seen.len())
        .filter(|&i| seen[i] != ids[i])
        .collect::<Vec<_>>();
    eprintln!(
        "{label}: interiors within {worst:.1e}, {} of {} pixels show another object",
        wrong.len(),
        seen.len()
    );
    assert!(
        worst <= 1e-3,
        "{label}: a pixel inside an object is off by {worst}"
    );
    let far = wrong.iter().filter(|&&i| inside[i]).count();
    assert_eq!(
        far, 0,
        "{label}: pixels show another object and are more than one pixel from a silhouette"
    );
}

/// Object of each pixel by the reference's distance: −1 is a miss, for a single object.
fn hits(aov: &Picture) -> Vec<f32> {
    object_ids(aov, "t")
        .into_iter()
        .map(|t| if t < 0.0 { -1.0 } else { 0.0 })
        .collect()
}

/// Protects: a centre by expressions of the time, a field of view by focal length, and a parameter
/// that switches light.
fn pendulum(precision: PrecisionChoice) {
    let Some(folder) = shared("reference/swing").filter(|_| carried("pendulum")) else {
        return;
    };
    for (name, t) in [("t0p6_256x256", 0.6), ("t4p0_256x256", 4.0)] {
        let folder = folder.join(name);
        let ids = hits(&read(&folder.join("aov.exr")));
        for (file, flat) in [("lit.exr", 0.0), ("flat.exr", 1.0)] {
            let ours = render("pendulum", t, &[("flat", flat)], |s| {
                s.precision = precision;
                s.aovs = vec![Aov::Object];
            });
            check(
                &format!("pendulum {name} {file}"),
                &ours.picture,
                &read(&folder.join(file)),
                &ids,
            );
        }
    }
}

/// Protects: roots, clipping and normals of the hyperboloid and the ellipsoid, on both sides.
fn quadrics(precision: PrecisionChoice) {
    let Some(folder) = shared("reference/swing/quadrics_256x240").filter(|_| carried("quadrics"))
    else {
        return;
    };
    let ids = object_ids(&read(&folder.join("aov.exr")), "object");
    let ours = render("quadrics", 0.0, &[], |s| {
        s.precision = precision;
        s.aovs = vec![Aov::Object];
    });
    for file in ["color_analytic.exr", "color_marched.exr"] {
        check(
            &format!("quadrics {file}"),
            &ours.picture,
            &read(&folder.join(file)),
            &ids,
        );
    }
}

/// Protects: the swinging sphere has the original program's position at each time, in `robust`.
#[test]
fn pendulum_robust() {
    pendulum(PrecisionChoice::Robust);
}

/// Protects: the same in `reference`.
#[test]
fn pendulum_reference() {
    pendulum(PrecisionChoice::Reference);
}

/// Protects: hyperboloid and ellipsoid equal the original program's picture, in `robust`.
#[test]
fn quadrics_robust() {
    quadrics(PrecisionChoice::Robust);
}

/// Protects: the same in `reference`.
#[test]
fn quadrics_reference() {
    quadrics(PrecisionChoice::Reference);
}
