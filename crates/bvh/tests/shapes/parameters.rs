//! Texture coordinates: their range, and dp/du as the derivative of the point by u.

use glam::{DAffine3, DVec2, DVec3};
use raywright_bvh::shapes::{AnyShape, TransformedShape};
use raywright_bvh::{Interval, PreparedRay, Ray, Side, TextureCoordinates};

use super::gallery::{ShapeRng, gallery};

/// Point, normal and texture coordinates at the first hit of a ray.
struct HitParameters {
    point: DVec3,
    normal: DVec3,
    parameters: TextureCoordinates<f64>,
}

fn found(shape: &TransformedShape<f64>, origin: DVec3, direction: DVec3) -> Option<HitParameters> {
    let prepared_ray = PreparedRay::new(Ray::<f64>::new(origin, direction));
    let hit = shape.intersect(&prepared_ray, Interval::positive(), Side::Both)?;
    let surface_point = shape.locate_surface_point(&prepared_ray, hit);
    Some(HitParameters {
        point: surface_point.point,
        normal: surface_point.normal,
        parameters: shape.texture_coordinates(&prepared_ray, hit),
    })
}

/// A difference of coordinates that may wrap around.
fn around(difference: f64) -> f64 {
    difference - difference.round()
}

fn derivative(name: &str, shape: AnyShape<f64>, map: DAffine3) {
    const STEP: f64 = 1e-6;
    let rng = &mut ShapeRng(9);
    let transformed_shape = TransformedShape::<f64>::new(shape, map).unwrap();
    let (mut hits, mut judged, mut handed) = (0, 0, 0);
    for _ in 0..4000 {
        let direction = rng.direction();
        let origin = rng.cube() * 1.5 - direction * 8.0;
        let Some(at) = found(&transformed_shape, origin, direction) else {
            continue;
        };
        let (u, v, along) = (at.parameters.u, at.parameters.v, at.parameters.dpdu);
        assert!(
            u.is_finite() && v.is_finite() && along.is_finite(),
            "{name}: {:?}",
            at.parameters
        );
        if !matches!(name, "plane" | "infinite cylinder") {
            assert!(
                (0.0..=1.0).contains(&u) && (-1e-12..=1.0 + 1e-12).contains(&v),
                "{name}: u {u} v {v}"
            );
        }
        assert!(
            along.dot(at.normal).abs() <= 1e-9 * along.length(),
            "{name}: {along:?} is not along the surface"
        );
        hits += 1;
        // The foot of the moved point, projected down onto the surface.
        let moved = at.point + along * STEP;
        let Some(next) = found(&transformed_shape, moved + at.normal * 1e-3, -at.normal) else {
            continue;
        };
        // Beyond an edge lies another part of the surface with other coordinates.
        if next.normal.dot(at.normal) < 0.999 || next.point.distance(moved) > 1e-5 * along.length()
        {
            continue;
        }
        judged += 1;
        let (du, dv) = (
            around(next.parameters.u - u) / STEP,
            around(next.parameters.v - v) / STEP,
        );
        assert!(
            (du - 1.0).abs() < 1e-3 && dv.abs() < 1e-3,
            "{name}: u changes by {du}, v by {dv} a unit; {along:?} at {:?}",
            at.point
        );
        // Right is the direction of growing u; rows of an image run down unless mirrored.
        let below = at.point + along.cross(at.normal) * STEP;
        let Some(lower) = found(&transformed_shape, below + at.normal * 1e-3, -at.normal) else {
            continue;
        };
        if lower.normal.dot(at.normal) < 0.999
            || lower.point.distance(below) > 1e-5 * along.length()
        {
            continue;
        }
        let dv = around(lower.parameters.v - v);
        assert!(
            dv != 0.0 && (dv < 0.0) == at.parameters.mirrored,
            "{name}: v changes by {dv}, {:?}",
            at.parameters
        );
        handed += 1;
    }
    assert!(handed * 10 > hits * 9, "{name}: {handed} judged of {hits}");
    assert!(
        hits > 150 && judged * 10 > hits * 9,
        "{name}: {judged} judged of {hits}"
    );
}

/// Protects: dp/du of every shape, plain and mapped: a step along it changes u by the step and v by
/// zero; and the side of it on which v grows, also under a reflection.
#[test]
fn dpdu_is_the_derivative_by_u() {
    let map = DAffine3::from_translation(DVec3::new(0.2, -0.1, 0.3))
        * DAffine3::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 1.0)
        * DAffine3::from_scale(DVec3::new(-0.8, 1.3, 0.6));
    for (name, shape, _) in gallery::<f64>() {
        derivative(name, shape, DAffine3::IDENTITY);
        derivative(name, shape, map);
    }
}

/// Protects: texture coordinates of points that are easy to visualise.
#[test]
fn coordinates_of_known_points() {
    use raywright_bvh::shapes::{Cuboid, Cylinder, Ellipsoid, Quad, Sphere, Torus};
    let sphere: AnyShape<f64> = Sphere {
        centre: DVec3::ZERO,
        radius: 1.0,
    }
    .into();
    let ellipsoid: AnyShape<f64> = Ellipsoid::new(DVec3::ZERO, DVec3::new(2.0, 1.0, 3.0)).into();
    let quad: AnyShape<f64> =
        Quad::new(DVec3::new(-1.0, 0.0, -1.0), DVec3::X * 2.0, DVec3::Z * 2.0).into();
    let cube: AnyShape<f64> = Cuboid::new(DVec3::NEG_ONE, DVec3::ONE).into();
    let can: AnyShape<f64> = Cylinder::new(DVec3::ZERO, DVec3::Y, 1.0, Some(2.0), true).into();
    let pipe: AnyShape<f64> = Cylinder::new(DVec3::ZERO, DVec3::Y, 1.0, None, false).into();
    let ring: AnyShape<f64> = Torus::new(DVec3::ZERO, DVec3::Y, 2.0, 0.5).into();
    let slant = DVec3::new(1.0, 1.0, 0.0).normalize();
    let cases = [
        // From the −x side around +y, and from the top down, like a map on a globe.
        ("sphere", sphere, DVec3::X, Some(0.5), Some(0.5)),
        ("sphere", sphere, DVec3::Z, Some(0.25), Some(0.5)),
        ("sphere", sphere, DVec3::NEG_Z, Some(0.75), Some(0.5)),
        ("sphere", sphere, DVec3::Y, None, Some(0.0)),
        ("sphere", sphere, DVec3::NEG_Y, None, Some(1.0)),
        ("sphere", sphere, slant, Some(0.5), Some(0.25)),
        ("ellipsoid", ellipsoid, DVec3::X, Some(0.5), Some(0.5)),
        ("ellipsoid", ellipsoid, DVec3::Y, None, Some(0.0)),
        ("quad", quad, DVec3::Y, Some(0.5), Some(0.5)),
        ("box", cube, DVec3::X, Some(0.5), Some(0.5)),
        ("cylinder", can, DVec3::Y, None, Some(0.0)),
        // Without ends, v is measured from the base point.
        ("infinite cylinder", pipe, DVec3::X, None, Some(0.0)),
        ("torus", ring, DVec3::X, None, Some(0.5)),
    ];
    for (name, shape, direction, u, v) in cases {
        let transformed_shape = TransformedShape::<f64>::new(shape, DAffine3::IDENTITY).unwrap();
        let at = found(&transformed_shape, direction * 9.0, -direction)
            .unwrap_or_else(|| panic!("{name} missed from {direction:?}"));
        let got = DVec2::new(at.parameters.u, at.parameters.v);
        let expected = DVec2::new(u.unwrap_or(got.x), v.unwrap_or(got.y));
        assert!(
            got.distance(expected) < 1e-9,
            "{name} from {direction:?}: {got:?} for {expected:?}"
        );
    }
    // Off the centre of each face of a box: to the right and down, as seen from outside.
    let transformed_shape = TransformedShape::<f64>::new(cube, DAffine3::IDENTITY).unwrap();
    for (side, right, down) in [
        (DVec3::X, DVec3::NEG_Z, DVec3::NEG_Y),
        (DVec3::NEG_X, DVec3::Z, DVec3::NEG_Y),
        (DVec3::Z, DVec3::X, DVec3::NEG_Y),
        (DVec3::NEG_Z, DVec3::NEG_X, DVec3::NEG_Y),
        (DVec3::Y, DVec3::X, DVec3::Z),
        (DVec3::NEG_Y, DVec3::X, DVec3::NEG_Z),
    ] {
        assert!(right.cross(-down) == side, "not as seen from outside");
        let at = found(
            &transformed_shape,
            side * 5.0 + right * 0.5 + down * 0.25,
            -side,
        )
        .unwrap();
        let got = DVec2::new(at.parameters.u, at.parameters.v);
        assert!(
            got.distance(DVec2::new(0.75, 0.625)) < 1e-9,
            "box, face {side:?}: {got:?}"
        );
    }
}

/// Protects: an image, with rows running down and columns to the right, appears upright and
/// unmirrored on a solid seen from outside with its axis up.
#[test]
fn images_are_upright() {
    use raywright_bvh::shapes::{
        Cone, Cylinder, Ellipsoid, Hyperboloid, Paraboloid, Sphere, Torus,
    };
    const STEP: f64 = 1e-5;
    let bodies: [(&str, AnyShape<f64>); 9] = [
        (
            "sphere",
            Sphere {
                centre: DVec3::ZERO,
                radius: 1.0,
            }
            .into(),
        ),
        (
            "ellipsoid",
            Ellipsoid::new(DVec3::ZERO, DVec3::new(2.0, 1.0, 3.0)).into(),
        ),
        (
            "cylinder",
            Cylinder::new(DVec3::NEG_Y, DVec3::Y, 1.0, Some(2.0), true).into(),
        ),
        (
            "open cylinder",
            Cylinder::new(DVec3::NEG_Y, DVec3::Y, 1.0, Some(2.0), false).into(),
        ),
        (
            "infinite cylinder",
            Cylinder::new(DVec3::NEG_Y, DVec3::Y, 1.0, None, false).into(),
        ),
        (
            "cone",
            Cone::new(DVec3::NEG_Y, DVec3::Y, 1.0, 0.0, 2.0).into(),
        ),
        (
            "hyperboloid",
            Hyperboloid::new(DVec3::ZERO, 0.5, 0.75, 1.0).into(),
        ),
        ("paraboloid", Paraboloid::new(DVec3::NEG_Y, 1.0, 2.0).into()),
        ("torus", Torus::new(DVec3::ZERO, DVec3::Y, 2.0, 0.5).into()),
    ];
    for (name, shape) in bodies {
        let transformed_shape = TransformedShape::<f64>::new(shape, DAffine3::IDENTITY).unwrap();
        for angle in [0.5_f64, 1.5, 2.5, 3.5, 4.5, 5.5] {
            let (out, right) = (
                DVec3::new(angle.cos(), 0.0, angle.sin()),
                DVec3::new(angle.sin(), 0.0, -angle.cos()),
            );
            let at = |aside: f64, down: f64| {
                let from = out * 9.0 + right * aside - DVec3::Y * (0.1 + down);
                let p = found(&transformed_shape, from, -out)
                    .unwrap_or_else(|| panic!("{name} missed"))
                    .parameters;
                DVec2::new(p.u, p.v)
            };
            let (here, aside, below) = (at(0.0, 0.0), at(STEP, 0.0), at(0.0, STEP));
            assert!(
                aside.x - here.x > 0.02 * STEP,
                "{name} at {angle}: u falls to the right"
            );
            assert!(
                below.y - here.y > 0.02 * STEP,
                "{name} at {angle}: v falls downwards"
            );
        }
    }
}
