//! Orthonormal frame about a shading normal, in which directions are sampled.

use crate::number::{Number, Vector3};

/// An orthonormal frame. Right-handed (tangent × bitangent = normal), or left-handed where a
/// texture appears mirrored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadingFrame<N: Number> {
    /// Unit, perpendicular to the normal.
    pub tangent: N::Vec3,
    /// Unit, perpendicular to both.
    pub bitangent: N::Vec3,
    /// Unit.
    pub normal: N::Vec3,
}

impl<N: Number> ShadingFrame<N> {
    /// Any frame about a unit normal ("Building an Orthonormal Basis, Revisited", Duff et al.
    /// 2017).
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

    /// The frame about a unit normal with its tangent as close as possible to a direction, such as
    /// the direction of a texture's columns. The bitangent is then up in the texture; `mirrored`
    /// flips it where the normal's side sees the texture mirrored. Falls back to
    /// [`Self::from_normal`] if the direction is zero, along the normal, or too long or short to be
    /// squared.
    #[inline(always)]
    pub fn from_tangent(normal: N::Vec3, direction: N::Vec3, mirrored: N::Mask) -> Self {
        let across = |v: N::Vec3| v - normal * normal.dot(v);
        let first = across(direction);
        let squared = first.dot(first);
        // Below this threshold, rounding dominates the remainder of the direction.
        let given = squared.greater_than(direction.dot(direction) * N::from_f64(1e-10));
        // A direction nearly along the normal still leans after one projection; two suffice
        // (Kahan).
        let tangent = across(first * (N::ONE / squared.sqrt())).normalize();
        let tangent = N::Vec3::select(given, tangent, Self::from_normal(normal).tangent);
        let up = normal.cross(tangent);
        Self {
            tangent,
            bitangent: N::Vec3::select(mirrored, -up, up),
            normal,
        }
    }

    /// Components of a direction along tangent, bitangent and normal.
    #[inline(always)]
    pub fn to_local(&self, v: N::Vec3) -> N::Vec3 {
        N::Vec3::new(
            self.tangent.dot(v),
            self.bitangent.dot(v),
            self.normal.dot(v),
        )
    }

    /// Direction of these components.
    #[inline(always)]
    pub fn to_world(&self, v: N::Vec3) -> N::Vec3 {
        self.tangent * v.x() + self.bitangent * v.y() + self.normal * v.z()
    }
}
