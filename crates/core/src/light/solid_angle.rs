//! Shapes whose directions can be drawn evenly over the solid angle under which they are seen.

use glam::DVec3;
use raywright_bvh::shapes::{AnyShape, Sphere};
use raywright_bvh::{Real, Side, SurfacePoint, Vector};

use super::{Cone, Polygon};

/// A shape as a point sees all of it.
#[expect(clippy::large_enum_variant, reason = "made for one sample, on the stack")]
pub(super) enum Whole<R: Real> {
    Ball(Sphere<R>, Cone),
    Polygon(Polygon),
}

impl<R: Real> Whole<R> {
    /// None for shapes and places where points are drawn by area.
    pub fn new(shape: &AnyShape<R>, side: Side, from: DVec3) -> Option<Self> {
        match shape {
            // A ball that only shines inwards is seen through its near side.
            AnyShape::Sphere(_) if side == Side::Inside => None,
            AnyShape::Sphere(ball) => {
                let cone = Cone::new(ball.centre.to_f64(), ball.radius.to_f64(), from)?;
                Some(Self::Ball(*ball, cone))
            }
            AnyShape::Triangle(triangle) => Polygon::new(triangle.vertices.map(Vector::to_f64), None, from).map(Self::Polygon),
            AnyShape::Quad(quad) => {
                let [a, b, c, d] = quad.corners.map(Vector::to_f64);
                Polygon::new([a, b, c], Some(d), from).map(Self::Polygon)
            }
            _ => None,
        }
    }

    /// In steradians.
    pub fn solid_angle(&self) -> f64 {
        match self {
            Self::Ball(_, cone) => cone.solid_angle(),
            Self::Polygon(polygon) => polygon.solid_angle(),
        }
    }

    /// A point of the shape, for two numbers in [0, 1); none where rounding leaves none.
    pub fn draw(&self, shape: &AnyShape<R>, position: [f32; 2]) -> Option<SurfacePoint> {
        let position = position.map(f64::from);
        match self {
            Self::Ball(ball, cone) => Some(ball.at(cone.normal(position))),
            Self::Polygon(polygon) => {
                // Normal and bound are the same all over a flat shape.
                let (anywhere, _) = shape.sample_area(R::from_f64(0.5), R::from_f64(0.5))?;
                Some(SurfacePoint::new(Vector::from_f64(polygon.point(position)?), anywhere.normal, anywhere.error))
            }
        }
    }
}
