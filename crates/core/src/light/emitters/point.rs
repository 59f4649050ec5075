//! A point of an emitter as it is shown to the point that it lights.

use glam::DVec3;
use raywright_bvh::{Real, Side, Surface, SurfacePoint, Vector};

/// A point of an emitter as another point sees it.
pub(super) struct Facing {
    /// Unit direction to it.
    pub direction: DVec3,
    pub squared: f64,
    /// Between that direction and the normal of the side that shines; negative behind.
    pub cosine: f64,
}

impl Facing {
    #[inline(always)]
    pub fn new<R: Real>(outwards: f64, from: DVec3, surface: &Surface<R>) -> Self {
        let offset = surface.point.to_f64() - from;
        let squared = offset.length_squared();
        let direction = offset / squared.sqrt();
        let cosine = -direction.dot(surface.normal.to_f64());
        Self {
            direction,
            squared,
            cosine: if outwards == 0.0 {
                cosine.abs()
            } else {
                cosine * outwards
            },
        }
    }
}

/// Which way light leaves a surface, by the sign: out, in, or both.
pub(super) fn outwards(side: Side) -> f64 {
    match side {
        Side::Outside | Side::Culled => 1.0,
        Side::Inside => -1.0,
        Side::Both => 0.0,
    }
}

/// A point of an emitter as it is shown to another point.
pub(super) struct EmitterPoint<R: Real> {
    pub surface: Surface<R>,
    pub direction: DVec3,
    pub density: f64,
    /// Factor of the radiance; zero, or no number, where nothing is sent there.
    pub weight: f64,
}

impl<R: Real> EmitterPoint<R> {
    #[inline(always)]
    pub fn new(
        located: &SurfacePoint,
        outwards: f64,
        from: R::Vec3,
        probability: f64,
        drawn: PointDensity,
    ) -> Self {
        let surface = located.stored::<R>();
        let Facing {
            direction,
            squared,
            cosine,
        } = Facing::new(outwards, from.to_f64(), &surface);
        let (density, weight) = match drawn {
            PointDensity::Even(solid_angle) => {
                let density = probability / solid_angle;
                (density, if cosine > 0.0 { 1.0 / density } else { 0.0 })
            }
            PointDensity::Area(by_area) => {
                // Solid-angle measure: cos/d² over the density by area.
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

    /// Also false for NaN, where the points coincide.
    #[inline(always)]
    pub fn is_some(&self) -> bool {
        (self.weight > 0.0) & (self.weight < f64::INFINITY)
    }
}

/// How densely a point of an emitter is drawn.
#[derive(Clone, Copy, Debug)]
pub(super) enum PointDensity {
    /// Evenly over so many steradians.
    Even(f64),
    /// By area.
    Area(f64),
}
