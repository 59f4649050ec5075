//! Shapes with edges, and round shapes that a map makes sharp, each with an independent formula for
//! the side of a point.

use glam::DVec3;
use raywright_bvh::Real;
use raywright_bvh::shapes::{
    AnyShape, Cone, Cuboid, Cylinder, CylinderEnds, Disk, Ellipsoid, Hyperboloid, Paraboloid, Quad,
    Sphere, Torus, Triangle,
};

use super::borders::depth;
use super::support::{CaseRng, to_scalar};

type Height = Box<dyn Fn(DVec3) -> f64 + Sync>;
type Edge = Box<dyn Fn(&mut CaseRng) -> DVec3 + Sync>;

/// A shape; an independent function that is positive outside it (on the outer side of an open
/// shape); and a sampler of points on its edges.
pub struct EdgedShape<R: Real> {
    pub name: &'static str,
    pub shape: AnyShape<R>,
    pub height: Height,
    pub edge: Edge,
    /// Radius of a ball inside the shape; infinite for a shape without an interior.
    pub ball: f64,
}

/// A random point of a circle perpendicular to an axis.
fn rim(rng: &mut CaseRng, centre: DVec3, axis: DVec3, radius: f64) -> DVec3 {
    centre + rng.sample_offset_in_disc(axis.normalize(), 1.0).normalize() * radius
}

fn turned<R: Real>(name: &'static str, axis: DVec3, radii: [f64; 2], ball: f64) -> EdgedShape<R> {
    let base = DVec3::new(0.25, -0.5, 0.125);
    let (b, a) = (to_scalar::<R>(base), to_scalar::<R>(axis));
    let [low, high] = radii.map(R::from_f64);
    let shape = if low == high {
        Cylinder {
            base: b,
            axis: a,
            radius: low,
            ends: CylinderEnds::Capped,
        }
        .into()
    } else {
        Cone {
            base: b,
            axis: a,
            radius: low,
            top_radius: high,
        }
        .into()
    };
    let edge = move |rng: &mut CaseRng| {
        if rng.next_sign() > 0.0 {
            rim(rng, base + axis, axis, radii[1])
        } else {
            rim(rng, base, axis, radii[0])
        }
    };
    let height = Box::new(move |p| -depth(p, base, axis, radii));
    EdgedShape {
        name,
        shape,
        height,
        edge: Box::new(edge),
        ball,
    }
}

/// A random point on the border of a polygon.
fn border(corners: &[DVec3], rng: &mut CaseRng) -> DVec3 {
    let i = (rng.next_bits() % corners.len() as u64) as usize;
    let share = if rng.next_in_unit_interval() < 0.3 {
        0.0
    } else {
        rng.next_in_unit_interval()
    };
    corners[i] + (corners[(i + 1) % corners.len()] - corners[i]) * share
}

fn flat<R: Real>(name: &'static str, corners: &[DVec3]) -> EdgedShape<R> {
    let (a, normal) = (
        corners[0],
        (corners[1] - corners[0]).cross(corners[2] - corners[0]),
    );
    let shape = match *corners {
        [a, b, c] => Triangle {
            vertices: [a, b, c].map(to_scalar::<R>),
        }
        .into(),
        _ => Quad {
            corners: core::array::from_fn(|i| to_scalar::<R>(corners[i])),
        }
        .into(),
    };
    let corners = corners.to_vec();
    EdgedShape {
        name,
        shape,
        height: Box::new(move |p| normal.dot(p - a)),
        edge: Box::new(move |rng| border(&corners, rng)),
        ball: f64::INFINITY,
    }
}

/// The shapes with edges, of about unit size, with numbers exact in f32.
pub fn edged<R: Real>() -> Vec<EdgedShape<R>> {
    let real = R::from_f64;
    let (min, max) = (DVec3::new(-0.75, -0.5, -1.0), DVec3::new(0.5, 1.0, 0.75));
    let corner = DVec3::new(-0.5, -0.25, 0.125);
    let (eu, ev) = (DVec3::new(1.0, 0.25, 0.0), DVec3::new(0.25, 0.75, 0.5));
    let on_box = move |rng: &mut CaseRng| {
        let along = (rng.next_bits() % 3) as usize;
        let mut p = DVec3::from_array(core::array::from_fn(|i| {
            if rng.next_sign() > 0.0 {
                min[i]
            } else {
                max[i]
            }
        }));
        p[along] = if rng.next_in_unit_interval() < 0.3 {
            p[along]
        } else {
            rng.next_uniform(min[along], max[along])
        };
        p
    };
    let centre = DVec3::new(0.25, -0.125, 0.5);
    let slanted = DVec3::new(0.5, 1.0, -0.25);
    vec![
        EdgedShape {
            name: "box",
            shape: Cuboid {
                min: to_scalar::<R>(min),
                max: to_scalar::<R>(max),
            }
            .into(),
            height: Box::new(move |p| (min - p).max(p - max).max_element()),
            edge: Box::new(on_box),
            ball: 0.625,
        },
        turned("cylinder", slanted, [0.5, 0.5], 0.5),
        turned("cone", slanted, [0.75, 0.0], 0.4),
        turned("truncated cone", slanted, [0.25, 0.75], 0.4),
        turned("flat cone", slanted / 64.0, [0.75, 0.0], 1.0 / 128.0),
        turned("needle of a cone", slanted, [1.0 / 256.0, 0.0], 1.0 / 264.0),
        EdgedShape {
            name: "disk",
            shape: Disk {
                centre: to_scalar::<R>(centre),
                normal: to_scalar::<R>(DVec3::Z),
                radius: real(0.75),
            }
            .into(),
            height: Box::new(move |p| p.z - centre.z),
            edge: Box::new(move |rng| rim(rng, centre, DVec3::Z, 0.75)),
            ball: f64::INFINITY,
        },
        flat(
            "quad",
            &[corner, corner + eu, corner + eu + ev, corner + ev],
        ),
        flat("triangle", &[corner, corner + eu, corner + ev]),
        EdgedShape {
            name: "hyperboloid",
            shape: Hyperboloid {
                centre: to_scalar::<R>(centre),
                waist: real(0.5),
                slope: real(0.5),
                half_height: real(0.5),
            }
            .into(),
            height: Box::new(move |p| {
                let q = p - centre;
                q.x * q.x + q.z * q.z - q.y * q.y - 0.25
            }),
            edge: Box::new(move |rng| {
                let end = centre + DVec3::Y * (0.5 * rng.next_sign());
                rim(rng, end, DVec3::Y, 0.5_f64.sqrt())
            }),
            ball: 0.5,
        },
        EdgedShape {
            name: "paraboloid",
            shape: Paraboloid {
                apex: to_scalar::<R>(centre),
                radius: real(0.75),
                height: real(0.75),
            }
            .into(),
            height: Box::new(move |p| {
                let q = p - centre;
                (q.x * q.x + q.z * q.z) / 0.75 - q.y
            }),
            edge: Box::new(move |rng| rim(rng, centre + DVec3::Y * 0.75, DVec3::Y, 0.75)),
            ball: 0.375,
        },
    ]
}

/// The round shapes, which maps can make as sharp as an edge; sampled everywhere instead of at
/// edges.
pub fn round<R: Real>() -> Vec<EdgedShape<R>> {
    let (real, centre) = (R::from_f64, DVec3::new(0.25, -0.125, 0.5));
    let stored_centre = to_scalar::<R>(centre);
    let semi_axes = DVec3::new(0.5, 0.25, 1.0);
    let ring = |p: DVec3| DVec3::new(p.x, 0.0, p.z).normalize() * 0.75;
    vec![
        EdgedShape {
            name: "sphere",
            shape: Sphere {
                centre: stored_centre,
                radius: real(0.75),
            }
            .into(),
            height: Box::new(move |p| p.distance(centre) - 0.75),
            edge: Box::new(move |rng| centre + rng.sample_direction() * 0.75),
            ball: 0.75,
        },
        EdgedShape {
            name: "ellipsoid",
            shape: Ellipsoid {
                centre: stored_centre,
                semi_axes: to_scalar::<R>(semi_axes),
            }
            .into(),
            height: Box::new(move |p| ((p - centre) / semi_axes).length() - 1.0),
            edge: Box::new(move |rng| centre + rng.sample_direction() * semi_axes),
            ball: 0.25,
        },
        EdgedShape {
            name: "torus",
            shape: Torus {
                centre: stored_centre,
                axis: to_scalar::<R>(DVec3::Y),
                major_radius: real(0.75),
                minor_radius: real(0.25),
            }
            .into(),
            height: Box::new(move |p| (p - centre).distance(ring(p - centre)) - 0.25),
            edge: Box::new(move |rng| {
                centre + ring(rng.sample_direction()) + rng.sample_direction() * 0.25
            }),
            ball: 0.25,
        },
        EdgedShape {
            name: "tube",
            shape: Cylinder {
                base: stored_centre,
                axis: to_scalar::<R>(DVec3::Y),
                radius: real(0.5),
                ends: CylinderEnds::Open,
            }
            .into(),
            height: Box::new(move |p| (p - centre).with_y(0.0).length() - 0.5),
            edge: Box::new(move |rng| {
                let along = rng.next_in_unit_interval();
                rim(rng, centre + DVec3::Y * along, DVec3::Y, 0.5)
            }),
            ball: 0.5,
        },
    ]
}
