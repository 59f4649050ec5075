//! T: trees that cull nothing that is hit, by every kernel and in both precisions. The cases are
//! the library's.

use glam::DVec3;
use raywright_bvh::Aabb;

use super::support::{Expect, Verdict, expect_all, judge};

/// Protects: a ray along an axis close inside a face of a box enters it, however far away.
/// Reciprocals that are clamped lose it.
#[test]
fn t01_rays_along_faces() {
    let textbook = expect_all("T01", 400_000)
        .into_iter()
        .find_map(|measurement| measurement.textbook)
        .expect("of the textbook");
    assert!(
        textbook.wrong_share() > 0.05,
        "T01: only {} wrong",
        textbook.wrong_share()
    );
}

/// Protects: the sign of a zero in a direction changes no hit.
#[test]
fn t02_zeros_of_all_signs() {
    expect_all("T02", 40_000);
}

/// Protects: no ray along an axis passes a lattice of triangles or boxes at its corners, its edges
/// or its middles.
#[test]
fn t03_lattices() {
    expect_all("T03", 54_756);
}

/// Protects: directions along an axis but for next to nothing, and of any length, lose no box.
#[test]
fn t04_tiny_components() {
    expect_all("T04", 70_000);
}

/// Protects: directions of any length lose no box.
#[test]
fn t05_any_length() {
    expect_all("T05", 70_000);
}

/// Protects: a closed mesh is closed at any size.
#[test]
fn t06_any_size() {
    expect_all("T06", 1_000_000);
}

/// Protects: closed meshes and a ground far from the origin are closed.
#[test]
fn t07_far_away() {
    expect_all("T07", 1_400_000);
}

/// Protects: boxes of a millionth are met beside boxes of a million.
#[test]
fn t08_mixed_scales() {
    expect_all("T08", 40_000);
}

/// Protects: padding is enough, and costs rays no more than three tenths.
#[test]
fn t10_inflation() {
    expect_all("T10", 400_000);
}

/// Protects: no box of any size and place is padded by more than was measured to be enough, which
/// rays far out would pay for, nor by less.
#[test]
fn t10_pads_are_as_stated() {
    let outcome = judge("T10 pads", 232, 40_000, |random| {
        let (centre, half) = (
            random.cube() * 10_f64.powf(random.between(-6.0, 6.0)),
            random.cube().abs() * 10_f64.powf(random.between(-6.0, 6.0)),
        );
        let bounds = Aabb::from_points([centre - half, centre + half]);
        let Some(padded) = bounds.padded() else {
            return Verdict::Skip;
        };
        let ulp = f64::from(f32::EPSILON);
        // Four units of the coordinate, of which rounding to f32 may take or add half a one, and
        // one of the extent.
        let pad = |v: DVec3, units: f64, extents: f64| {
            (v.abs() * units + extents * bounds.extent().max_element()) * ulp
        };
        let grown = [
            (bounds.min, bounds.min - padded.min.as_dvec3()),
            (bounds.max, padded.max.as_dvec3() - bounds.max),
        ];
        let is_stated = |(v, grown): (DVec3, DVec3)| {
            grown.cmpge(pad(v, 3.4, 0.99)).all()
                && grown
                    .cmple(pad(v, 4.6, 1.01) + f64::from(f32::MIN_POSITIVE) * 2.0)
                    .all()
        };
        Verdict::holds(grown.into_iter().all(is_stated), || {
            format!("{bounds:?} to {padded:?}")
        })
    });
    outcome.expect_right(40_000);
}

/// Protects: boxes within boxes are met as by a scan, and lie in a tree no deeper than a traversal
/// has a stack for.
#[test]
fn t12_nested() {
    expect_all("T12", 40_000);
}

/// Protects: a plane without end changes neither the hits of a tree beside it nor its work.
#[test]
fn t14_planes() {
    expect_all("T14", 40_000);
}

/// Protects: trees of nothing, one shape and two, of every quality.
#[test]
fn t15_few() {
    expect_all("T15", 40_000);
}

/// Protects: a box is entered from its face, an ulp beside it and from within.
#[test]
fn t16_from_faces() {
    expect_all("T16", 200_000);
}

/// Protects: the ends of an interval are excluded, to the bit, by nearest hit and any hit, tree and
/// scan.
#[test]
fn t17_interval_ends() {
    expect_all("T17", 20_000);
}

/// Protects: no shape says a distance beyond the interval that it was asked for.
#[test]
fn t19_within_the_interval() {
    expect_all("T19", 50_000);
}

/// Protects: nearest hit and any hit of a tree are those of a scan, to the bit, with shapes of
/// every kind and ties.
#[test]
fn t20_tree_against_scan() {
    expect_all("T20", 2_000_000);
}
