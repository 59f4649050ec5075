//! Hard shadows of area lights: a single shadow ray to the light's centre determines the visibility
//! of the whole light.

use raywright_bvh::shapes::{AnyShape, Cylinder, CylinderEnds};
use raywright_bvh::{Real, Vector};

use super::{EmitterShape, Emitters};
use crate::light::{LightSample, ShadowRayTarget};

impl<R: Real> Emitters<R> {
    /// Redirects a light sample to the centre of its emitter. For a triangle, this is a point of
    /// the triangle; for other shapes, it is the centre of the bounds, which may lie off the shape.
    ///
    /// - The receiving point lies inside the bounds of a closed shape: the sample is returned
    ///   unchanged.
    /// - The sampled point lies on the far side of a closed shape: returns `None`. The shape hides
    ///   this point, but the shadow ray ignores hits of its own emitter.
    ///
    /// A torus may also shadow itself in other ways; these are ignored.
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

/// Whether a shape is closed: the outside of its surface is then invisible from inside.
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
