//! Random scenes of every kind of primitive: every accelerator gives the hits of the scan, bit for
//! bit.

use glam::{DAffine3, DMat3, DVec3};
use raywright_bvh::shapes::{
    AnyShape, Cone, Cuboid, Cylinder, Disk, Ellipsoid, Hyperboloid, Paraboloid, Plane, Quad,
    Sphere, Torus, Triangle,
};
use raywright_bvh::{
    AcceleratorKind, BuildQuality, Geometry, Interval, Occlusion, PrimitiveSet, Ray, Real, Vector,
    Visibility,
};

use super::families::ArrangementRng;

impl ArrangementRng {
    /// Uniform below a limit.
    pub fn below(&mut self, limit: usize) -> usize {
        (self.unit() * limit as f32) as usize
    }
    fn uniform(&mut self, minimum: f64, maximum: f64) -> f64 {
        minimum + (maximum - minimum) * f64::from(self.unit())
    }
    /// Uniform in the cube [−half, half]³.
    pub fn in_cube(&mut self, half: f64) -> DVec3 {
        self.point().as_dvec3() * half
    }
}

/// Number of kinds of shape.
pub const SHAPES: usize = 13;

/// Whether shapes of a kind have no bounds.
pub fn is_unbounded(kind: usize) -> bool {
    [1, 6].contains(&kind)
}

/// A shape of about a unit, anywhere in the cube [−half, half]³.
pub fn shape<R: Real>(rng: &mut ArrangementRng, kind: usize, half: f64) -> AnyShape<R> {
    let v = |p: DVec3| R::Vec3::from_f64(p);
    let c = rng.in_cube(half);
    let axis = rng.in_cube(1.0) + DVec3::Y * 1e-3;
    let (a, b) = (rng.uniform(0.2, 1.5), rng.uniform(0.05, 0.19));
    match kind {
        0 => AnyShape::Sphere(Sphere {
            centre: v(c),
            radius: R::from_f64(a),
        }),
        1 => AnyShape::Plane(Plane::new(v(c * 2.0), v(axis.normalize()))),
        2 => AnyShape::Disk(Disk::new(c, axis, a)),
        3 => AnyShape::Quad(Quad::new(c, axis, rng.in_cube(1.0) + DVec3::X)),
        4 => AnyShape::Cuboid(Cuboid::new(c, c + DVec3::new(a, b, 2.0 * a))),
        5 => AnyShape::Cylinder(Cylinder::new(c, axis, b, Some(a), a > 0.8)),
        6 => AnyShape::Cylinder(Cylinder::new(c, axis, b, None, false)),
        7 => AnyShape::Cone(Cone::new(c, axis, a, b, 1.0)),
        8 => AnyShape::Ellipsoid(Ellipsoid::new(c, DVec3::new(a, b, 1.0))),
        9 => AnyShape::Hyperboloid(Hyperboloid::new(c, b, a, 1.0)),
        10 => AnyShape::Paraboloid(Paraboloid::new(c, a, 1.0)),
        11 => AnyShape::Torus(Torus::new(c, axis, a, b)),
        _ => AnyShape::Triangle(Triangle::new([c, c + axis, c + rng.in_cube(2.0)].map(v))),
    }
}

/// A random rotation, shear and reflection, sometimes strongly flattened.
pub fn map(rng: &mut ArrangementRng) -> DAffine3 {
    let turn = DMat3::from_axis_angle(
        (rng.in_cube(1.0) + DVec3::Y * 1e-3).normalize(),
        rng.uniform(0.0, 6.0),
    );
    let flat = if rng.below(3) == 0 {
        1e-3
    } else {
        rng.uniform(0.3, 2.0)
    };
    let mirror = if rng.below(2) == 0 { 1.0 } else { -1.0 };
    let shear = DMat3::from_cols(
        DVec3::X,
        DVec3::new(rng.uniform(-1.0, 1.0), 1.0, 0.0),
        DVec3::Z,
    );
    let matrix = turn * DMat3::from_diagonal(DVec3::new(1.0, flat, mirror)) * shear;
    DAffine3 {
        matrix3: matrix,
        translation: rng.in_cube(3.0),
    }
}

fn visibility(rng: &mut ArrangementRng) -> Visibility {
    let occlusion = [
        Occlusion::None,
        Occlusion::Filtered,
        Occlusion::Filtered,
        Occlusion::Filtered,
    ][rng.below(4)];
    Visibility {
        occlusion,
        ..Visibility::default()
    }
}

/// The same scene for the same seed: shapes of every kind, unmapped, mapped and duplicated, and
/// instances of a mesh.
fn scene<R: Real>(seed: u64, kind: AcceleratorKind) -> Geometry<R> {
    let rng = &mut ArrangementRng(seed);
    let mut mesh = PrimitiveSet::<R>::default();
    for i in 0..30 {
        // Objects of one and of two triangles in turn.
        let mut corners = || match shape::<R>(rng, SHAPES - 1, 5.0) {
            AnyShape::Triangle(triangle) => triangle.vertices,
            _ => unreachable!("the last shape is a triangle"),
        };
        let count = 1 + i % 2;
        mesh.add_mesh((0..count).map(|_| corners()), Visibility::default())
            .unwrap();
    }
    let mut group = PrimitiveSet::default();
    let mesh = group.add_part(Geometry::new(mesh, kind)).unwrap();
    for i in 0..10 + rng.below(150) {
        // Only a few unbounded shapes, so that the others are hit too.
        let unbounded = i % 50 == 0;
        let (all, own_visibility) = (rng.below(SHAPES), visibility(rng));
        let index = if is_unbounded(all) && !unbounded {
            0
        } else {
            all
        };
        let shape = shape::<R>(rng, index, 5.0);
        match rng.below(5) {
            0 => group.add_transformed_shape(shape, map(rng), own_visibility),
            1 => group.add_instance(mesh, map(rng), own_visibility),
            2 => group
                .add_shape(shape, own_visibility)
                .and_then(|_| group.add_shape(shape, own_visibility)),
            _ => group.add_shape(shape, own_visibility),
        }
        .unwrap();
    }
    Geometry::new(group, kind)
}

/// All hits that an any-hit query passes to its filter, sorted.
pub fn offered<R: Real>(
    geometry: &Geometry<R>,
    ray: &Ray<R>,
    range: Interval<R>,
) -> Vec<([u32; 3], u32, u64)> {
    let mut all = Vec::new();
    geometry.occluded(
        ray,
        range,
        &mut |hit| {
            all.push((hit.tie_order(), hit.instance, hit.t.to_f64().to_bits()));
            false
        },
        &mut (),
    );
    all.sort_unstable();
    all
}

fn everything_agrees<R: Real>(name: &str) {
    const SCENES: u64 = 24;
    const RAYS: usize = 250;
    let v = |p: DVec3| R::Vec3::from_f64(p);
    let mut hit_count = 0;
    for seed in 0..SCENES {
        let scan = scene::<R>(seed, AcceleratorKind::Linear);
        let trees = BuildQuality::ALL.into_iter().map(AcceleratorKind::Tree);
        let others: Vec<_> = trees.map(|kind| (kind, scene::<R>(seed, kind))).collect();
        let rng = &mut ArrangementRng(seed ^ 0x5eed);
        for _ in 0..RAYS {
            let ray = Ray::<R>::new(
                v(rng.in_cube(9.0)),
                v((rng.in_cube(1.0) + DVec3::Y * 1e-3).normalize()),
            );
            let far = if rng.below(2) == 0 {
                f64::INFINITY
            } else {
                rng.uniform(1.0, 12.0)
            };
            let range = Interval {
                min: R::from_f64(0.0),
                max: R::from_f64(far),
            };
            let (closest, all) = (
                scan.closest(&ray, range, &mut ()),
                offered(&scan, &ray, range),
            );
            hit_count += usize::from(closest.is_some());
            for (kind, other) in &others {
                let message = format!("{name}, {kind:?}, seed {seed}, {ray:?}, {range:?}");
                assert_eq!(other.closest(&ray, range, &mut ()), closest, "{message}");
                assert_eq!(offered(other, &ray, range), all, "{message}");
            }
        }
    }
    assert!(
        hit_count > RAYS * SCENES as usize / 6,
        "{hit_count} rays met something"
    );
}

/// Name of a precision, and its check.
type PrecisionCase = (&'static str, fn(&str));

/// Precisions with this guarantee: a further precision needs only an entry here.
const PRECISIONS: [PrecisionCase; 2] = [
    ("robust", everything_agrees::<f32>),
    ("reference", everything_agrees::<f64>),
];

/// Protects: hits do not depend on the accelerator, for closest hits and for all hits passed to an
/// any-hit filter, with shapes of every kind, rotated, sheared, reflected and flattened, and with
/// instances.
#[test]
fn every_structure_returns_the_same_hits() {
    PRECISIONS.iter().for_each(|(name, agrees)| agrees(name));
}
