//! The cone under which a ball is seen, drawn evenly over its solid angle ("Monte Carlo Techniques
//! for Direct Lighting Calculations", Shirley, Wang, Zimmerman 1996).

use core::f64::consts::TAU;

use glam::DVec3;

/// The directions from a point outside a ball that meet it.
#[derive(Clone, Copy, Debug)]
pub struct DirectionCone {
    axis: DVec3,
    distance: f64,
    radius: f64,
    /// 1 − cos θ of the half-angle θ, which keeps its digits where the ball is small: as sin²θ /
    /// (1 + cos θ), that is 2·sin²(θ/2).
    height: f64,
}

impl DirectionCone {
    /// The ball as `from` sees it; none from within it or on it, where all or half of the
    /// directions meet it.
    pub fn new(centre: DVec3, radius: f64, from: DVec3) -> Option<Self> {
        let across = centre - from;
        let distance = across.length();
        // Also false for NaN.
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

    /// In steradians.
    pub fn solid_angle(&self) -> f64 {
        TAU * self.height
    }

    /// The outward unit normal of the ball where a direction meets it first, for two numbers in [0,
    /// 1): directions are drawn evenly over the solid angle.
    pub fn normal(&self, [u, v]: [f64; 2]) -> DVec3 {
        let (height, turn) = (u * self.height, v * TAU);
        let sine2 = height * (2.0 - height);
        // In units of the radius: how far the ray passes from the centre, and how far before that
        // place it enters. The normal's digits then do not depend on the distance.
        let ratio = self.distance / self.radius;
        let past2 = (ratio * ratio * sine2).min(1.0);
        let (past, entry) = (past2.sqrt(), (1.0 - past2).sqrt());
        let (cosine, sine) = (1.0 - height, sine2.sqrt());
        let (along, beside) = (-past * sine - entry * cosine, past * cosine - entry * sine);
        let ((x, y), (sin, cos)) = (self.axis.any_orthonormal_pair(), libm::sincos(turn));
        self.axis * along + (x * cos + y * sin) * beside
    }
}
