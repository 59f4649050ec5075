//! Hard shadows of area lights: a single shadow ray to the centre of a light decides on all of its
//! light.

use raywright_bvh::shapes::{AnyShape, Cylinder, CylinderEnds};
use raywright_bvh::{Real, Vector};

use super::{EmitterShape, Emitters};
use crate::light::{LightSample, ShadowRayTarget};

impl<R: Real> Emitters<R> {
    /// Redirects a light sample to the centre of its emitter: to the centre of the emitter's
    /// bounds, or to a point of a triangle, because the centre of a triangle's bounds may lie off
    /// the triangle. If the receiving point is inside the bounds of a closed shape, the sample
    /// stays as it is. Returns `None` if the sampled point is on the far side of a closed shape:
    /// the shape hides that point, but a shadow ray ignores hits of its own target. Other
    /// self-shadowing of a torus is ignored.
    pub fn redirect_to_centre(
        &self,
        index: u32,
        light_sample: LightSample<R>,
        from: R::Vec3,
    ) -> Option<LightSample<R>> {
        let (shape, plain) = match &self.list.emitters[index as usize].shape {
            EmitterShape::Plain(shape) => (shape, true),
            EmitterShape::Transformed(placed) => (
                self.list.transformed_shapes[*placed as usize].shape(),
                false,
            ),
        };
        let (Some(space), eye) = (
            self.bounds(index).map(|bounds| bounds.bounding_box),
            from.to_f64(),
        ) else {
            return Some(light_sample);
        };
        if is_closed(shape) {
            if eye.cmpge(space.min).all() && eye.cmple(space.max).all() {
                return Some(light_sample);
            }
            if let ShadowRayTarget::Surface(surface) = &light_sample.target
                && surface.normal.dot(light_sample.direction) >= R::ZERO
            {
                return None;
            }
        }
        let half = R::from_f64(0.5);
        let middle = match shape {
            AnyShape::Triangle(_) if plain => shape
                .sample_area(half, half)
                .map(|(surface_point, _)| surface_point.to_scalar::<R>().point.to_f64()),
            _ => None,
        };
        let middle = middle.unwrap_or_else(|| space.centre());
        let direction = (middle - eye).try_normalize()?;
        let target = ShadowRayTarget::EmitterCentre {
            point: Vector::from_f64(middle),
            emitter: index,
        };
        Some(LightSample {
            direction: Vector::from_f64(direction),
            target,
            ..light_sample
        })
    }
}

/// Whether a shape is closed, so that the outside of its surface is invisible from inside.
fn is_closed<R: Real>(shape: &AnyShape<R>) -> bool {
    matches!(
        shape,
        AnyShape::Sphere(_)
            | AnyShape::Cuboid(_)
            | AnyShape::Cylinder(Cylinder {
                ends: CylinderEnds::Capped,
                ..
            })
            | AnyShape::Cone(_)
            | AnyShape::Ellipsoid(_)
            | AnyShape::Torus(_)
    )
}
