//! P19–P22: slivers, rays in a triangle's plane, and closed meshes that must not leak.

use glam::DVec3;
use raywright_bvh::Real;
use raywright_bvh::shapes::Triangle;

use super::support::{
    CaseRng, Expect, Verdict, create_ray_towards, expect_all, expect_hard, format_ray_bits, judge,
    nearest_hit, require, round_to_f32, to_scalar, ulp,
};

fn triangle<R: Real>(corners: [DVec3; 3]) -> Triangle<R> {
    Triangle::new(corners.map(to_scalar::<R>))
}

/// Protects: triangles of zero area are never hit, not even along their line; slivers are hit only
/// at a distance between those of their corners.
#[test]
fn p19_slivers() {
    judge("P19 no area", 50, 400_000, |rng| {
        // Integers: exactly collinear at any scale.
        let whole = |rng: &mut CaseRng| (rng.sample_point_in_cube() * 64.0).round();
        let (a, step) = (whole(rng), whole(rng));
        let corners = match rng.next_bits() % 3 {
            0 => [a, a + step, a + step * 2.0],
            1 => [a, a, a + step],
            _ => [a, a + step, a],
        };
        let scale = 2_f64.powi((rng.next_bits() % 40) as i32 - 20);
        let corners = corners.map(|c| c * scale);
        let target = corners[0] + (corners[2] - corners[0]) * rng.next_in_unit_interval();
        let target = if rng.next_sign() > 0.0 {
            target
        } else {
            corners[1]
        };
        let ray = create_ray_towards::<f32>(
            whole(rng) * (2.0 * scale) + DVec3::splat(200.0 * scale),
            target,
        );
        let got = nearest_hit::<f32>(&triangle::<f32>(corners), &ray);
        require(got.is_none(), || {
            format!("{got:?}{} {corners:?}", format_ray_bits(&ray))
        })
    })
    .expect_right(400_000);
    judge("P19 sliver", 51, 400_000, |rng| {
        let (a, along) = (rng.sample_point_in_cube(), rng.sample_direction());
        let side = rng.sample_offset_in_disc(along, 1.0).normalize() * 1e-6;
        // Edges 1, 1 and 1e-6, or 1, 1 and 1e-3 with the same height over the longest.
        let corners = [a, a + along, a + along * rng.choose(&[0.0, 1e-3]) + side].map(round_to_f32);
        let target = corners[0] + (corners[1] - corners[0]) * rng.next_in_unit_interval();
        let ray = create_ray_towards::<f32>(
            target + rng.sample_direction() * rng.next_uniform(0.5, 5.0),
            target,
        );
        let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let Some(h) = nearest_hit::<f32>(&triangle::<f32>(corners), &ray) else {
            return Verdict::Skipped;
        };
        let ts = corners.map(|c| (c - o).dot(d) / d.length_squared());
        let (low, high) = (
            ts.iter().copied().fold(f64::INFINITY, f64::min),
            ts.iter().copied().fold(0.0, f64::max),
        );
        let (t, room) = (f64::from(h.t), ulp(high));
        require(low - room <= t && t <= high + room, || {
            format!("t {t} not in {low}..{high}{}", format_ray_bits(&ray))
        })
    })
    .expect_right(50_000);
}

/// Protects: hits of a thin distant triangle by rays nearly in its plane lie in the triangle's box.
#[test]
fn p20_nearly_parallel_rays() {
    expect_all("P20", 1.0 / 12.0);
}

/// Protects: no ray leaves a closed mesh through an edge or a corner, in f64 neither, where products
/// are not exact any more.
#[test]
fn p21_no_leaks() {
    expect_hard(&expect_all("P21", 1.0), "Corner", 0.01);
}

/// Protects: the same with all triangles flipped, or every second.
#[test]
fn p22_no_leaks_in_either_winding() {
    expect_all("P22", 1.0);
}
