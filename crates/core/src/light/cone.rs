//! The cone of directions to a sphere, sampled uniformly by solid angle ("Monte Carlo Techniques
//! for Direct Lighting Calculations", Shirley, Wang, Zimmerman 1996).

use core::f64::consts::TAU;

use glam::DVec3;

/// The directions from a point outside a sphere that hit it.
#[derive(Clone, Copy, Debug)]
pub struct DirectionCone {
    axis: DVec3,
    distance: f64,
    radius: f64,
    /// 1 − cos θ of the half-angle θ, computed as sin²θ / (1 + cos θ) = 2·sin²(θ/2), which keeps
    /// its digits for small spheres.
    height: f64,
}

impl DirectionCone {
    /// The cone of a sphere seen from `from`. Returns `None` from inside or on the sphere, where
    /// all or half of the directions hit it.
    pub fn new(centre: DVec3, radius: f64, from: DVec3) -> Option<Self> {
        let across = centre - from;
        let distance = across.length();
        // False for NaN too.
        (distance > radius && radius > 0.0).then(|| {
            let share = radius / distance;
            let sine2 = share * share;
            let cosine = ((1.0 - share) * (1.0 + share)).sqrt();
            Self {
                axis: across / distance,
                distance,
                radius,
                height: sine2 / (1.0 + cosine),
            }
        })
    }

    /// Solid angle in steradians.
    pub fn solid_angle(&self) -> f64 {
        TAU * self.height
    }

    /// Samples a direction uniformly by solid angle for two numbers in [0, 1), and returns the
    /// sphere's outward unit normal at its first hit.
    pub fn normal(&self, [u, v]: [f64; 2]) -> DVec3 {
        let (height, turn) = (u * self.height, v * TAU);
        let sine2 = height * (2.0 - height);
        // In units of the radius: the distance of the ray from the centre, and the distance from
        // its closest approach back to the entry. The normal's digits then do not depend on the
        // distance.
        let ratio = self.distance / self.radius;
        let past2 = (ratio * ratio * sine2).min(1.0);
        let (past, entry) = (past2.sqrt(), (1.0 - past2).sqrt());
        let (cosine, sine) = (1.0 - height, sine2.sqrt());
        let (along, beside) = (-past * sine - entry * cosine, past * cosine - entry * sine);
        let ((x, y), (sin, cos)) = (self.axis.any_orthonormal_pair(), libm::sincos(turn));
        self.axis * along + (x * cos + y * sin) * beside
    }
}
