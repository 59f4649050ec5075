//! Sampled points of emitters: densities and weights, as seen from the receiving point.

use glam::DVec3;
use raywright_bvh::{Real, Side, Surface, SurfacePoint, Vector};

/// Direction, squared distance and cosine of an emitter's point, seen from the receiving point.
pub(super) struct EmitterDirection {
    /// Unit direction to the emitter's point.
    pub direction: DVec3,
    pub squared_distance: f64,
    /// Cosine between the direction back to the receiving point and the normal of the emissive
    /// side; negative behind the emitter.
    pub cosine: f64,
}

impl EmitterDirection {
    #[inline(always)]
    pub fn new<R: Real>(outwards: f64, from: DVec3, surface: &Surface<R>) -> Self {
        let offset = surface.point.to_f64() - from;
        let squared = offset.length_squared();
        let direction = offset / squared.sqrt();
        let cosine = -direction.dot(surface.normal.to_f64());
        Self {
            direction,
            squared_distance: squared,
            cosine: if outwards == 0.0 {
                cosine.abs()
            } else {
                cosine * outwards
            },
        }
    }
}

/// Returns the emissive side as a sign: 1 for the outside, −1 for the inside, 0 for both sides.
pub(super) fn side_sign(side: Side) -> f64 {
    match side {
        Side::Outside | Side::Culled => 1.0,
        Side::Inside => -1.0,
        Side::Both => 0.0,
    }
}

/// A sampled point of an emitter, with its density by solid angle and its weight.
pub(super) struct EmitterPoint<R: Real> {
    pub surface: Surface<R>,
    pub direction: DVec3,
    pub density: f64,
    /// Factor on the emitted radiance: one over the density. Zero, negative or NaN if the point
    /// does not contribute.
    pub weight: f64,
}

impl<R: Real> EmitterPoint<R> {
    #[inline(always)]
    pub fn new(
        surface_point: &SurfacePoint,
        outwards: f64,
        from: R::Vec3,
        probability: f64,
        drawn: PointDensity,
    ) -> Self {
        let surface = surface_point.to_scalar::<R>();
        let EmitterDirection {
            direction,
            squared_distance: squared,
            cosine,
        } = EmitterDirection::new(outwards, from.to_f64(), &surface);
        let (density, weight) = match drawn {
            PointDensity::SolidAngle(solid_angle) => {
                let density = probability / solid_angle;
                (density, if cosine > 0.0 { 1.0 / density } else { 0.0 })
            }
            PointDensity::Area(by_area) => {
                // The density by area, converted to solid angle by the factor d²/cos.
                let over = squared * by_area * probability;
                (over / cosine, cosine / over)
            }
        };
        Self {
            surface,
            direction,
            density,
            weight,
        }
    }

    /// Whether the point contributes. False for NaN, which occurs if receiving point and emitter's
    /// point coincide.
    #[inline(always)]
    pub fn contributes(&self) -> bool {
        (self.weight > 0.0) & (self.weight < f64::INFINITY)
    }
}

/// Density with which a point of an emitter is sampled.
#[derive(Clone, Copy, Debug)]
pub(super) enum PointDensity {
    /// Uniform over this solid angle in steradians.
    SolidAngle(f64),
    /// Density by area, per square metre.
    Area(f64),
}
