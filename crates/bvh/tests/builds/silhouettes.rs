//! Grazing rays, which would miss an unpadded box by rounding of the slab test although they hit
//! the primitive.

use glam::DVec3;
use raywright_bvh::shapes::{AnyShape, Disk, Sphere};
use raywright_bvh::{AcceleratorKind, Geometry, Interval, PrimitiveSet, Ray, Visibility};

use super::families::ArrangementRng;

/// Unit spheres and disks in a row, enough for a tree.
fn scene(kind: AcceleratorKind, offset: DVec3) -> Geometry<f64> {
    let mut group = PrimitiveSet::<f64>::default();
    for i in 0..20 {
        let centre = offset + DVec3::X * (4.0 * f64::from(i));
        group
            .add_sphere(
                Sphere {
                    centre,
                    radius: 1.0,
                },
                Visibility::default(),
            )
            .unwrap();
        let disk = Disk::new(centre + DVec3::Y * 3.0, DVec3::Y, 1.0);
        group
            .add_shape(AnyShape::Disk(disk), Visibility::default())
            .unwrap();
    }
    Geometry::new(group, kind)
}

/// Protects: boxes are padded enough. In f64 a ray within 10⁻⁹ of a silhouette hits the shape; f32
/// boxes rounded to nearest without padding end up to 6·10⁻⁸ of a coordinate short of it.
#[test]
fn rays_along_silhouettes_are_not_culled() {
    for offset in [
        DVec3::ZERO,
        DVec3::new(0.1, 0.7, 0.3),
        DVec3::new(-1000.1, 2000.3, 77.7),
    ] {
        let scan = scene(AcceleratorKind::Linear, offset);
        let tree = scene(AcceleratorKind::default(), offset);
        let (rng, mut hit_count) = (&mut ArrangementRng(11), 0);
        for i in 0..20_000 {
            let centre = offset + DVec3::X * (4.0 * f64::from(i % 20));
            // Towards the extreme point of a sphere along an axis, and perpendicular to that axis.
            let axis = i / 20 % 3;
            let out = DVec3::AXES[axis as usize] * if i / 60 % 2 == 0 { 1.0 } else { -1.0 };
            let across = DVec3::AXES[(axis as usize + 1) % 3];
            let touched = centre + out * (1.0 + 1e-9 * f64::from(rng.unit() * 2.0 - 1.0));
            let ray = Ray::new(touched - across * f64::from(1.0 + rng.unit()), across);
            let expected = scan.closest(&ray, Interval::positive(), &mut ());
            hit_count += u32::from(expected.is_some());
            assert_eq!(
                tree.closest(&ray, Interval::positive(), &mut ()),
                expected,
                "{ray:?}"
            );
        }
        assert!(
            (5000..19_000).contains(&hit_count),
            "{hit_count} rays met something"
        );
    }
}
