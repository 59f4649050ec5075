//! T: trees never cull a hit, by any kernel and in either precision. The cases are the library's.

use glam::DVec3;
use raywright_bvh::Aabb;

use super::support::{Expect, Verdict, expect_all, expect_hard, judge, require};

/// Protects: an axis-aligned ray close inside a face of a box enters the box at any distance.
/// Clamped reciprocals would miss it.
#[test]
fn t01_rays_along_faces() {
    expect_hard(&expect_all("T01", 1.0), "", 0.05);
}

/// Protects: the sign of a zero component of a direction changes no hit.
#[test]
fn t02_zeros_of_all_signs() {
    expect_all("T02", 1.0);
}

/// Protects: no axis-aligned ray passes a lattice of triangles or boxes at a corner, an edge or a
/// midpoint.
#[test]
fn t03_lattices() {
    expect_all("T03", 1.0);
}

/// Protects: directions with components close to zero miss no box.
#[test]
fn t04_tiny_components() {
    expect_all("T04", 0.875);
}

/// Protects: directions of any length miss no box.
#[test]
fn t05_any_length() {
    expect_all("T05", 0.875);
}

/// Protects: a closed mesh is closed at any size.
#[test]
fn t06_any_size() {
    expect_all("T06", 1.0);
}

/// Protects: closed meshes and a ground far from the origin are closed.
#[test]
fn t07_far_away() {
    expect_all("T07", 1.0);
}

/// Protects: boxes of size 1e-6 are hit beside boxes of size 1e6.
#[test]
fn t08_mixed_scales() {
    expect_all("T08", 1.0);
}

/// Protects: padding suffices, and costs rays at most three tenths.
#[test]
fn t10_inflation() {
    expect_all("T10", 1.0);
}

/// Protects: the padding of boxes of any size and position is as measured: no more, which distant
/// rays would pay for, and no less.
#[test]
fn t10_pads_are_as_stated() {
    let outcome = judge("T10 pads", 232, 40_000, |rng| {
        let (centre, half) = (
            rng.sample_point_in_cube() * 10_f64.powf(rng.next_uniform(-6.0, 6.0)),
            rng.sample_point_in_cube().abs() * 10_f64.powf(rng.next_uniform(-6.0, 6.0)),
        );
        let bounds = Aabb::from_points([centre - half, centre + half]);
        let Some(padded) = bounds.to_padded() else {
            return Verdict::Skipped;
        };
        let ulp = f64::from(f32::EPSILON);
        // Four units of the coordinate, of which rounding to f32 may add or remove one half, and
        // one unit of the extent.
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
        require(grown.into_iter().all(is_stated), || {
            format!("{bounds:?} to {padded:?}")
        })
    });
    outcome.expect_right(40_000);
}

/// Protects: nested boxes are hit as by a scan, in a tree that fits the traversal stack.
#[test]
fn t12_nested() {
    expect_all("T12", 1.0);
}

/// Protects: an infinite plane beside a tree changes neither its hits nor its work.
#[test]
fn t14_planes() {
    expect_all("T14", 1.0);
}

/// Protects: trees of zero, one and two shapes, of every build quality.
#[test]
fn t15_few() {
    expect_all("T15", 1.0);
}

/// Protects: a ray enters a box from its face, from an ulp beside it and from inside.
#[test]
fn t16_from_faces() {
    expect_all("T16", 1.0);
}

/// Protects: the ends of an interval are excluded, to the bit, for closest and any hits, by tree
/// and scan.
#[test]
fn t17_interval_ends() {
    expect_all("T17", 0.2);
}

/// Protects: no shape returns a distance outside the interval.
#[test]
fn t19_within_the_interval() {
    expect_all("T19", 0.125);
}

/// Protects: closest and any hits of a tree equal those of a scan, to the bit, with shapes of every
/// kind and ties.
#[test]
fn t20_tree_against_scan() {
    expect_all("T20", 1.0);
}
