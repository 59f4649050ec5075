//! Orthonormal frame about a shading normal, in which directions are sampled.

use crate::number::{Number, Vector3};

/// An orthonormal frame about a shading normal. It is right-handed (tangent × bitangent = normal)
/// unless a texture appears mirrored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadingFrame<N: Number> {
    /// Unit tangent, perpendicular to the normal.
    pub tangent: N::Vec3,
    /// Unit bitangent, perpendicular to the normal and to the tangent.
    pub bitangent: N::Vec3,
    /// Unit normal.
    pub normal: N::Vec3,
}

impl<N: Number> ShadingFrame<N> {
    /// Creates a frame about a unit normal, with any tangent ("Building an Orthonormal Basis,
    /// Revisited", Duff et al. 2017).
    #[inline(always)]
    pub fn from_normal(normal: N::Vec3) -> Self {
        let n = normal;
        let sign = N::ONE.copysign(n.z());
        let a = -N::ONE / (sign + n.z());
        let b = n.x() * n.y() * a;
        Self {
            tangent: N::Vec3::new(N::ONE + sign * n.x() * n.x() * a, sign * b, -(sign * n.x())),
            bitangent: N::Vec3::new(b, sign + n.y() * n.y() * a, -n.y()),
            normal,
        }
    }

    /// Creates a frame about a unit normal, with the tangent as close as possible to `direction`.
    /// For example, `direction` is that in which a texture's u grows; the bitangent then points up
    /// in the texture.
    ///
    /// `mirrored` flips the bitangent in lanes where the texture appears mirrored from the normal's
    /// side. The tangent of [`Self::from_normal`] replaces a direction that is zero, parallel to
    /// the normal, or whose square overflows or underflows.
    #[inline(always)]
    pub fn from_tangent(normal: N::Vec3, direction: N::Vec3, mirrored: N::Mask) -> Self {
        let across = |v: N::Vec3| v - normal * normal.dot(v);
        let first = across(direction);
        let squared = first.dot(first);
        // Below this threshold, rounding dominates the part of the direction that is perpendicular
        // to the normal.
        let given = squared.greater_than(direction.dot(direction) * N::from_f64(1e-10));
        // After a single projection, a direction nearly along the normal is not yet perpendicular.
        // Two projections suffice (Kahan).
        let tangent = across(first * (N::ONE / squared.sqrt())).normalize();
        let tangent = N::Vec3::select(given, tangent, Self::from_normal(normal).tangent);
        let up = normal.cross(tangent);
        Self {
            tangent,
            bitangent: N::Vec3::select(mirrored, -up, up),
            normal,
        }
    }

    /// Returns the components of a world direction along tangent, bitangent and normal.
    #[inline(always)]
    pub fn to_local(&self, v: N::Vec3) -> N::Vec3 {
        N::Vec3::new(
            self.tangent.dot(v),
            self.bitangent.dot(v),
            self.normal.dot(v),
        )
    }

    /// Returns the world direction with the given components along tangent, bitangent and normal.
    #[inline(always)]
    pub fn to_world(&self, v: N::Vec3) -> N::Vec3 {
        self.tangent * v.x() + self.bitangent * v.y() + self.normal * v.z()
    }
}
