//! Bent shading normals: mirror directions lie above the surface, bending is continuous, and other
//! normals stay unchanged.

use super::super::{Bsdf, Lobe, ShadingFrame, ensure_reflection_above};
use super::numbers;
use glam::DVec3;

const UP: DVec3 = DVec3::Z;

/// A direction by its cosine to the surface's normal and its azimuth in turns.
fn direction_at(height: f64, turn: f64) -> DVec3 {
    let across = (1.0 - height * height).max(0.0).sqrt();
    DVec3::new(
        across * libm::cos(core::f64::consts::TAU * turn),
        across * libm::sin(core::f64::consts::TAU * turn),
        height,
    )
}

/// The bent normal, and the height of its mirror direction.
fn reflected(n: DVec3, wo: DVec3) -> (DVec3, f64) {
    let perturbed = ensure_reflection_above::<f64>(n, UP, true, -wo);
    (
        perturbed,
        (perturbed * (2.0 * perturbed.dot(wo)) - wo).dot(UP),
    )
}

/// Protects: for any normal and view, the bent normal is unit, faces the viewer and mirrors the
/// viewer above the surface. A normal that clearly mirrors above the surface keeps its bits, and so
/// does the geometric normal always. From inside the same holds.
#[test]
fn s08_what_is_mirrored_is_above_the_surface() {
    let (mut kept, mut curved) = (0, 0);
    for i in 0..20_000 {
        let ([a, b, c], [d, ..]) = (numbers(2 * i), numbers(2 * i + 1));
        let (n, wo) = (
            direction_at(2.0 * a - 1.0, b),
            direction_at(1e-4 + (1.0 - 1e-4) * c * c, d),
        );
        let before = (n * (2.0 * n.dot(wo)) - wo).dot(UP);
        let (found, height) = reflected(n, wo);
        assert!(
            (found.length() - 1.0).abs() < 1e-12 && found.dot(wo) > 0.0 && found.dot(UP) > 0.0,
            "{n}, {wo}: {found}"
        );
        assert!(height > 0.0, "{n}, {wo}: mirrored to {height}");
        if before >= 0.02 && n.dot(UP) > 0.0 {
            assert_eq!(found, n);
            kept += 1;
        } else {
            curved += 1;
        }
        assert_eq!(reflected(UP, wo).0, UP);
        assert_eq!(ensure_reflection_above::<f64>(n, -UP, false, -wo), found);
    }
    assert!(kept > 3_000 && curved > 3_000, "{kept} kept, {curved} bent");
}

/// Protects: normals that turn from the geometric normal past the horizon to its back are bent
/// without a step, and without a kink until they face away; the last ones equal the geometric
/// normal.
#[test]
fn normals_bend_smoothly() {
    const STEPS: usize = 40_000;
    for (height, turn) in [(0.9, 0.1), (0.6, 0.0), (0.3, 0.25), (0.1, 0.5), (0.05, 0.4)] {
        let wo = direction_at(height, 0.0);
        let at = |k: usize| {
            let angle = core::f64::consts::PI * k as f64 / STEPS as f64;
            reflected(direction_at(libm::cos(angle), turn), wo).0
        };
        let path: Vec<DVec3> = (0..STEPS).map(at).collect();
        for k in 1..STEPS {
            let step = path[k].distance(path[k - 1]) * STEPS as f64;
            assert!(
                step < 400.0,
                "a step of {step} at {k}, viewed at {height}, turn {turn}"
            );
        }
        for k in 1..STEPS / 2 - 1 {
            let kink = (path[k + 1] - path[k] * 2.0 + path[k - 1]).length() * STEPS as f64;
            assert!(
                kink < 0.5,
                "a kink of {kink} at {k}, viewed at {height}, turn {turn}"
            );
        }
        assert!(path[STEPS - 1].distance(UP) < 1e-3, "{}", path[STEPS - 1]);
    }
}

/// Protects: a nearly smooth mirror with a normal that would mirror the viewer far below the
/// surface reflects nearly all of its light above it, so that no dark rings appear.
#[test]
fn bent_mirrors_stay_bright() {
    const COUNT: u64 = 4_000;
    for (height, tilt) in [(1.0, 0.6), (0.8, 0.5), (0.6, 0.2), (0.3, 0.1)] {
        let wo = direction_at(height, 0.5);
        let n = ensure_reflection_above::<f64>(direction_at(tilt, 0.03), UP, true, -wo);
        let bsdf = Bsdf::<f64>::new(n).with_lobe(Lobe::Rough {
            f0: DVec3::ONE,
            f90: DVec3::ONE,
            roughness: 0.05,
        });
        let frame = ShadingFrame::from_normal(n);
        let drawn = (0..COUNT).map(|i| bsdf.sample(&frame, wo, numbers(i)));
        let above: f64 = drawn
            .filter(|sampled| sampled.direction.dot(UP) > 0.0)
            .map(|sampled| sampled.weight.x)
            .sum();
        assert!(
            above > 0.9 * COUNT as f64,
            "{} viewed at {height}, tilted to {tilt}",
            above / COUNT as f64
        );
    }
}
