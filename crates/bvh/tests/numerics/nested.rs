//! Ray origins on transformed shapes inside transformed instances lie on the side to which the ray
//! leaves, under the rounding of both maps.

use glam::{DAffine3, DVec3};
use raywright_bvh::shapes::{AnyShape, Ellipsoid, Sphere};
use raywright_bvh::{AcceleratorKind, Geometry, Interval, PrimitiveSet, Real, Vector, Visibility};

use super::sharp::{back, flattening, is_thin};
use super::support::{
    CaseOutcome, CaseRng, Expect, Verdict, create_ray_towards, format_ray_bits, judge, require,
    to_scalar,
};

/// A sphere of radius 1, or an ellipsoid of at least that thickness, around the origin.
fn round<R: Real>(semi_axes: DVec3) -> AnyShape<R> {
    if semi_axes == DVec3::ONE {
        Sphere {
            centre: Vector::ZERO,
            radius: R::ONE,
        }
        .into()
    } else {
        Ellipsoid {
            centre: Vector::ZERO,
            semi_axes: to_scalar::<R>(semi_axes),
        }
        .into()
    }
}

/// Rays to both sides from hits of the shape, whose own map flattens by `own` and whose instance
/// flattens by `outer`.
fn starts<R: Real>(semi_axes: DVec3, own: f64, outer: f64) -> CaseOutcome {
    let label = format!(
        "starts on {semi_axes}, flattened by {own:e} and {outer:e}, in {}",
        std::any::type_name::<R>()
    );
    judge(&label, 431, 10_000, |rng: &mut CaseRng| {
        // Without a translation, so that the first map leaves all rounding to the second.
        let inner = DAffine3 {
            translation: DVec3::ZERO,
            ..flattening(rng, own)
        };
        let outside = flattening(rng, outer);
        let (mut part, mut group) = (PrimitiveSet::<R>::default(), PrimitiveSet::<R>::default());
        part.add_transformed_shape(round::<R>(semi_axes), inner, Visibility::default())
            .expect("an invertible map");
        let part = group
            .add_part(Geometry::new(part, AcceleratorKind::Linear))
            .expect("no instances in it");
        group
            .add_instance(part, outside, Visibility::default())
            .expect("an invertible map");
        let geometry = Geometry::new(group, AcceleratorKind::Linear);
        let target = (outside * inner).transform_point3(rng.sample_direction() * semi_axes);
        let ray = create_ray_towards::<R>(
            target + rng.sample_direction() * rng.choose(&[0.5, 3.0, 30.0]),
            target,
        );
        let Some(hit) = geometry.closest(&ray, Interval::positive(), &mut ()) else {
            return Verdict::Skipped;
        };
        let surface = geometry.surface(&ray, &hit);
        // Each map bounds the drift through all three axes by itself, so both together may count up
        // to √3 times as much drift as a single map.
        if is_thin::<R>(0.5, own * outer, surface.point.to_f64(), hit.t.to_f64()) {
            return Verdict::Skipped;
        }
        let height =
            |start: DVec3| (back(inner, back(outside, start)) / semi_axes).length_squared() - 1.0;
        let normal = surface.normal.to_f64();
        let above = [normal, -normal]
            .map(|direction| height(surface.spawn_ray_origin(to_scalar::<R>(direction)).to_f64()));
        require(above[0] > 0.0 && above[1] < 0.0, || {
            format!(
                "{above:?} {surface:?} {inner:?} {outside:?}{}",
                format_ray_bits::<R>(&ray)
            )
        })
    })
}

/// Protects: a ray origin on a curved surface under two maps lies on the side to which the ray
/// leaves, whichever map flattens: the magnification of a world-space rounding is the product of
/// both.
#[test]
fn starts_under_two_maps_are_on_the_right_side() {
    fn check<R: Real>() {
        for semi_axes in [DVec3::ONE, DVec3::new(1.0, 2.0, 1.5)] {
            for (own, outer) in [
                (1.0, 1e-3),
                (1e-3, 1.0),
                (1.0, 1e-4),
                (0.03, 0.03),
                (0.5, 1e-3),
            ] {
                starts::<R>(semi_axes, own, outer).expect_right(2000);
            }
        }
    }
    check::<f32>();
    check::<f64>();
}
