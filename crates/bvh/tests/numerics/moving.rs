//! Surface points of a moving instance lie within the error bound of their exact positions.

use glam::{DAffine3, DVec3};
use raywright_bvh::{
    AcceleratorKind, Geometry, Interval, PrimitiveSet, Ray, Real, Vector, Visibility,
};

use super::support::{Expect, Verdict, format_ray_bits, judge, to_scalar, within};

/// Units per metre of the ends of the motion.
const UNIT: f64 = 4_294_967_296.0;
/// Units of time in the whole motion.
const TIMES: i128 = 1 << 24;

/// A sheet that rises from a million metres below and passes the origin, hit within a metre of it.
/// Its exact height then is a 128-bit integer.
fn passing<R: Real>() {
    judge(
        &format!(
            "a sheet that passes the origin in {}",
            std::any::type_name::<R>()
        ),
        77,
        20_000,
        |rng| {
            let time = 1 + i128::from(rng.next_bits() % (TIMES as u64 - 1));
            let from = -i128::from(rng.next_bits() >> 12);
            let to = -from * (TIMES - time) / time + i128::from(rng.next_bits() % UNIT as u64);
            if to >= 1 << 53 {
                return Verdict::Skipped;
            }
            let height = (from * (TIMES - time) + to * time) as f64 / (UNIT * TIMES as f64);
            let end = |z: i128| DAffine3::from_translation(DVec3::Z * (z as f64 / UNIT));
            let (mut sheet, mut group) =
                (PrimitiveSet::<R>::default(), PrimitiveSet::<R>::default());
            let corners = [
                DVec3::new(-2.0, -2.0, 0.0),
                DVec3::new(2.0, -2.0, 0.0),
                DVec3::new(0.0, 3.0, 0.0),
            ];
            sheet
                .add_triangle(corners.map(to_scalar::<R>), Visibility::default())
                .expect("a triangle");
            let sheet = group
                .add_part(Geometry::new(sheet, AcceleratorKind::Linear))
                .expect("no instances");
            group
                .add_moving_instance(sheet, [end(from), end(to)], Visibility::default())
                .expect("an invertible way");
            let geometry = Geometry::new(group, AcceleratorKind::Linear);
            let origin = DVec3::new(
                rng.next_uniform(-0.5, 0.5),
                rng.next_uniform(-0.5, 0.5),
                height + rng.next_uniform(0.5, 2.0),
            );
            let ray = Ray::new(to_scalar::<R>(origin), to_scalar::<R>(DVec3::NEG_Z))
                .with_time(R::from_f64(time as f64 / TIMES as f64));
            let Some(hit) = geometry.closest(&ray, Interval::positive(), &mut ()) else {
                return Verdict::Wrong(format!("no hit{}", format_ray_bits::<R>(&ray)));
            };
            let (surface_point, surface) = (
                geometry.surface_point(&ray, &hit),
                geometry.surface(&ray, &hit),
            );
            let bound = surface_point.error.to_f64();
            // A bound that included the whole distance of the motion would hold trivially.
            if bound > 1e-13 {
                return Verdict::Wrong(format!(
                    "{bound} is no bound{}",
                    format_ray_bits::<R>(&ray)
                ));
            }
            let stored = (surface.point.to_f64().z - height).abs() / surface.error.to_f64();
            let off = (surface_point.point.to_f64().z - height).abs() / bound;
            within(off.max(stored), 1.0, || {
                format!("beyond the stated bound{}", format_ray_bits::<R>(&ray))
            })
        },
    )
    .expect_right(8000);
}

/// Protects: the error bound of a point on a moving instance, including digits of the ends that
/// cancel in its position.
#[test]
fn error_bounds_hold_during_motion() {
    passing::<f32>();
    passing::<f64>();
}

/// Protects: a mesh's own normal under a rotating and stretching instance is mapped by the map at
/// the ray's time, as for a still instance under that map.
#[test]
fn mesh_normals_turn_with_moving_instances() {
    let ends = [
        DAffine3::IDENTITY,
        DAffine3::from_rotation_x(0.9) * DAffine3::from_scale(DVec3::new(1.0, 3.0, 0.5)),
    ];
    let actual = |map: [DAffine3; 2], time: f64| {
        let (mut sheet, mut group) = (
            PrimitiveSet::<f64>::default(),
            PrimitiveSet::<f64>::default(),
        );
        let corners = [
            DVec3::new(-9.0, -9.0, 0.0),
            DVec3::new(9.0, -9.0, 0.0),
            DVec3::new(0.0, 9.0, 0.0),
        ];
        sheet
            .add_triangle(corners, Visibility::default())
            .expect("a triangle");
        let sheet = group
            .add_part(Geometry::new(sheet, AcceleratorKind::Linear))
            .expect("no instances");
        group
            .add_moving_instance(sheet, map, Visibility::default())
            .expect("an invertible way");
        let geometry = Geometry::new(group, AcceleratorKind::Linear);
        let ray = Ray::new(DVec3::new(0.1, -0.2, 5.0), DVec3::NEG_Z).with_time(time);
        let hit = geometry
            .closest(&ray, Interval::positive(), &mut ())
            .expect("the sheet is wide");
        geometry
            .normal_to_world(&ray, &hit, DVec3::new(0.1, 0.2, 1.0))
            .normalize()
    };
    for time in [0.0, 0.25, 0.5, 0.75, 1.0] {
        let between = ends[0].matrix3 * (1.0 - time) + ends[1].matrix3 * time;
        let still = DAffine3::from_mat3(between);
        let (moving, standing) = (actual(ends, time), actual([still; 2], 0.0));
        // A normal is mapped by the inverse transpose.
        let expected = (between.inverse().transpose() * DVec3::new(0.1, 0.2, 1.0)).normalize();
        assert!(
            (moving - expected).length() < 1e-12 && (standing - expected).length() < 1e-12,
            "{time}: {moving}, {standing}"
        );
    }
}
