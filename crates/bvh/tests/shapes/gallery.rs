//! One of each shape, with an implicit function of its surface.

use glam::{DAffine3, DVec3};
use raywright_bvh::shapes::{
    AnyShape, Cone, Cuboid, Cylinder, Disk, Ellipsoid, Hyperboloid, Paraboloid, Plane, Quad,
    Sphere, Torus, Triangle,
};
use raywright_bvh::{Real, Vector};

use crate::split_mix::step;

/// A small seeded generator (SplitMix64), so that a failure can be repeated.
pub struct ShapeRng(pub u64);

impl ShapeRng {
    pub fn unit(&mut self) -> f64 {
        (step(&mut self.0) >> 11) as f64 / (1_u64 << 53) as f64
    }
    pub fn direction(&mut self) -> DVec3 {
        let (z, a) = (
            self.unit() * 2.0 - 1.0,
            self.unit() * core::f64::consts::TAU,
        );
        let ring = (1.0 - z * z).sqrt();
        DVec3::new(ring * a.cos(), ring * a.sin(), z)
    }
    /// Uniform in the cube [−1, 1]³.
    pub fn cube(&mut self) -> DVec3 {
        DVec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }
}

/// A surface as the zeros of `value` within `clip`. `value` is positive outside, with a slope of
/// about one.
pub struct Oracle {
    pub value: Box<dyn Fn(DVec3) -> f64 + Sync>,
    pub clip: Box<dyn Fn(DVec3) -> bool + Sync>,
}

impl Oracle {
    fn solid(value: impl Fn(DVec3) -> f64 + Sync + 'static) -> Self {
        Self::clipped(value, |_| true)
    }
    fn clipped(
        value: impl Fn(DVec3) -> f64 + Sync + 'static,
        clip: impl Fn(DVec3) -> bool + Sync + 'static,
    ) -> Self {
        Self {
            value: Box::new(value),
            clip: Box::new(clip),
        }
    }
    /// The oracle of the image under a map.
    pub fn under(self, map: DAffine3) -> Self {
        let (back, Self { value, clip }) = (map.inverse(), self);
        Self {
            value: Box::new(move |p| value(back.transform_point3(p))),
            clip: Box::new(move |p| clip(back.transform_point3(p))),
        }
    }
}

/// Name, shape and oracle. All lie within 3.5 of the origin.
pub fn gallery<R: Real>() -> Vec<(&'static str, AnyShape<R>, Oracle)> {
    let c = DVec3::new(0.25, -0.5, 0.125);
    let axis = DVec3::new(0.6, 1.0, -0.3);
    let n = axis.normalize();
    let v = |p: DVec3| R::Vec3::from_f64(p);
    let split = move |p: DVec3| {
        let q = p - c;
        let along = q.dot(n);
        (along, (q - n * along).length())
    };
    let (corner, eu, ev) = (
        DVec3::new(-1.0, -0.5, 0.25),
        DVec3::new(1.5, 0.5, 0.0),
        DVec3::new(0.25, 0.75, 1.0),
    );
    let flat = eu.cross(ev).normalize();
    let coordinates = move |p: DVec3| {
        let q = p - corner;
        let w = eu.cross(ev) / eu.cross(ev).length_squared();
        (q.cross(ev).dot(w), eu.cross(q).dot(w))
    };
    let semi = DVec3::new(1.5, 0.5, 1.0);
    vec![
        (
            "sphere",
            Sphere {
                centre: v(c),
                radius: R::from_f64(1.25),
            }
            .into(),
            Oracle::solid(move |p| (p - c).length() - 1.25),
        ),
        (
            "plane",
            Plane::new(v(c), v(n)).into(),
            Oracle::solid(move |p| (p - c).dot(n)),
        ),
        (
            "disk",
            Disk::new(c, axis, 1.5).into(),
            Oracle::clipped(move |p| (p - c).dot(n), move |p| (p - c).length() <= 1.5),
        ),
        (
            "quad",
            Quad::new(corner, eu, ev).into(),
            Oracle::clipped(
                move |p| (p - corner).dot(flat),
                move |p| {
                    let (u, v) = coordinates(p);
                    u.min(v) >= 0.0 && u.max(v) <= 1.0
                },
            ),
        ),
        (
            "triangle",
            Triangle {
                vertices: [v(corner), v(corner + eu), v(corner + ev)],
            }
            .into(),
            Oracle::clipped(
                move |p| (p - corner).dot(flat),
                move |p| {
                    let (u, v) = coordinates(p);
                    u.min(v) >= 0.0 && u + v <= 1.0
                },
            ),
        ),
        (
            "box",
            Cuboid::new(c - semi, c + semi).into(),
            Oracle::solid(move |p| ((p - c).abs() - semi).max_element()),
        ),
        (
            "infinite cylinder",
            Cylinder::new(c, axis, 0.75, None, false).into(),
            Oracle::solid(move |p| split(p).1 - 0.75),
        ),
        (
            "open cylinder",
            Cylinder::new(c, axis, 0.75, Some(2.0), false).into(),
            Oracle::clipped(
                move |p| split(p).1 - 0.75,
                move |p| (0.0..=2.0).contains(&split(p).0),
            ),
        ),
        (
            "capped cylinder",
            Cylinder::new(c, axis, 0.75, Some(2.0), true).into(),
            Oracle::solid(move |p| {
                let (along, out) = split(p);
                (out - 0.75).max((along - 1.0).abs() - 1.0)
            }),
        ),
        (
            "cone",
            Cone::new(c, axis, 1.0, 0.0, 2.0).into(),
            Oracle::solid(move |p| {
                let (along, out) = split(p);
                (out - (1.0 - along * 0.5)).max(-along)
            }),
        ),
        (
            "truncated cone",
            Cone::new(c, axis, 0.5, 1.0, 1.5).into(),
            Oracle::solid(move |p| {
                let (along, out) = split(p);
                (out - (0.5 + along / 3.0)).max((along - 0.75).abs() - 0.75)
            }),
        ),
        (
            "cone of even width",
            Cone::new(c, axis, 0.75, 0.75, 1.5).into(),
            Oracle::solid(move |p| {
                let (along, out) = split(p);
                (out - 0.75).max((along - 0.75).abs() - 0.75)
            }),
        ),
        (
            "ellipsoid",
            Ellipsoid::new(c, semi).into(),
            Oracle::solid(move |p| ((p - c) / semi).length() - 1.0),
        ),
        (
            "hyperboloid",
            Hyperboloid::new(c, 0.5, 0.75, 1.25).into(),
            Oracle::clipped(
                move |p| {
                    let q = p - c;
                    (q.x * q.x + q.z * q.z).sqrt() - 0.5 * (1.0 + (q.y / 0.75).powi(2)).sqrt()
                },
                move |p| (p.y - c.y).abs() <= 1.25,
            ),
        ),
        (
            "paraboloid",
            Paraboloid::new(c, 1.0, 1.5).into(),
            Oracle::clipped(
                move |p| {
                    let q = p - c;
                    (q.x * q.x + q.z * q.z) * 1.5 - q.y
                },
                move |p| p.y - c.y <= 1.5,
            ),
        ),
        (
            "torus",
            Torus::new(c, axis, 1.25, 0.375).into(),
            Oracle::solid(move |p| {
                let (along, out) = split(p);
                ((out - 1.25).powi(2) + along * along).sqrt() - 0.375
            }),
        ),
    ]
}
