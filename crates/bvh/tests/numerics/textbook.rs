//! What the tree of `fast` may lose of the hits that its own triangles report: hits that lie beside their box, and no others.

use glam::DVec3;
use raywright_bvh::shapes::Triangle;
use raywright_bvh::{AcceleratorKind, Fast, Geometry, Group, Interval, Probe, Shape, Side, Visibility};

use super::support::{Outcome, Verdict, judge, stored, towards};

/// Cells of the grid in either direction.
const CELLS: u32 = 16;

/// Corners of a bumpy sheet of edge 2 about the origin, row by row.
fn corner(i: u32, j: u32) -> DVec3 {
    let at = |k: u32| 2.0 * f64::from(k) / f64::from(CELLS) - 1.0;
    DVec3::new(at(i), 0.05 * f64::from((i * 7 + j * 13) % 5), at(j))
}

fn sheet() -> Vec<Triangle<f32>> {
    let cells = (0..CELLS).flat_map(|i| (0..CELLS).map(move |j| (i, j)));
    let halves = cells.flat_map(|(i, j)| {
        let [a, b, c, d] = [corner(i, j), corner(i, j + 1), corner(i + 1, j + 1), corner(i + 1, j)];
        [[a, b, c], [a, c, d]]
    });
    halves.map(|corners| Triangle::new(corners.map(stored::<Fast>))).collect()
}

/// Rays towards corners of the sheet from so many of its sizes away: of those that hit a triangle by its own test, none may pass
/// the geometry.
fn lost(kind: AcceleratorKind, away: f64) -> Outcome {
    let triangles = sheet();
    let mut group = Group::<Fast>::default();
    for triangle in &triangles {
        group.shape((*triangle).into(), Visibility::default()).expect("finite corners");
    }
    let geometry = Geometry::new(group, kind);
    judge(&format!("{kind:?} from {away} sizes away"), 902, 20_000, |random| {
        let [i, j] = [0; 2].map(|_| (random.bits() % u64::from(CELLS + 1)) as u32);
        let target = corner(i, j);
        let mut way = random.direction();
        // Not edge-on, where the textbook's determinant is noise.
        way.y = way.y.signum() * (0.3 + way.y.abs());
        let ray = towards::<Fast>(target + way.normalize() * (2.0 * away), target);
        let probe = Probe::<Fast>::new(ray);
        let meets = |triangle: &Triangle<f32>| triangle.intersect(&probe, Interval::positive(), Side::Both).is_some();
        if !triangles.iter().any(meets) {
            return Verdict::Skip;
        }
        Verdict::holds(geometry.closest(&ray, Interval::positive(), &mut ()).is_some(), || "lost".to_owned())
    })
}

/// Protects: rounding does not take hits from `fast` that its triangles report: boxes are left no sooner than the rounding of a slab
/// distance allows, from near and far. A scan and a tree that lose the same would look right beside each other.
#[test]
fn boxes_lose_no_hits_of_the_textbook_test() {
    for kind in [AcceleratorKind::Linear, AcceleratorKind::default()] {
        for away in [1.0, 10.0, 100.0, 1e3, 1e4] {
            let lost = lost(kind, away);
            eprintln!("{}: {} of {} lost", lost.case, lost.wrong, lost.judged);
            assert!(lost.judged > 5_000 && lost.wrong_share() < 1e-3, "{}: {} of {}", lost.case, lost.wrong, lost.judged);
        }
    }
}
