//! Three unit directions across each other about a shading normal, in which directions are drawn.

use crate::number::{Number, Vector3};

/// Three unit directions across each other. Right-handed (tangent × bitangent = normal), or
/// left-handed where an image laid over the surface is seen mirrored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame<N: Number> {
    /// Unit, across the normal.
    pub tangent: N::Vec3,
    /// Unit, across both.
    pub bitangent: N::Vec3,
    /// Unit.
    pub normal: N::Vec3,
}

impl<N: Number> Frame<N> {
    /// Any frame about a unit normal ("Building an Orthonormal Basis, Revisited", Duff et al.
    /// 2017).
    #[inline(always)]
    pub fn about(normal: N::Vec3) -> Self {
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

    /// The frame about a unit normal whose tangent goes along a direction as far as it can, as that
    /// in which an image's columns follow each other; the bitangent is then up in the image, which
    /// the side of the normal may see mirrored. Any frame where the direction is zero, along the
    /// normal, or too long or short to be squared.
    #[inline(always)]
    pub fn along(normal: N::Vec3, direction: N::Vec3, mirrored: N::Mask) -> Self {
        let across = |v: N::Vec3| v - normal * normal.dot(v);
        let first = across(direction);
        let squared = first.dot(first);
        // Below this, rounding has a say in what is left of the direction.
        let given = squared.above(direction.dot(direction) * N::from_f64(1e-10));
        // What was nearly along the normal still leans after one subtraction; twice is enough
        // (Kahan).
        let tangent = across(first * (N::ONE / squared.sqrt())).normalize();
        let tangent = N::Vec3::select(given, tangent, Self::about(normal).tangent);
        let up = normal.cross(tangent);
        Self {
            tangent,
            bitangent: N::Vec3::select(mirrored, -up, up),
            normal,
        }
    }

    /// A direction by its components along the three.
    #[inline(always)]
    pub fn to_local(&self, v: N::Vec3) -> N::Vec3 {
        N::Vec3::new(
            self.tangent.dot(v),
            self.bitangent.dot(v),
            self.normal.dot(v),
        )
    }

    /// The direction that has these components.
    #[inline(always)]
    pub fn to_world(&self, v: N::Vec3) -> N::Vec3 {
        self.tangent * v.x() + self.bitangent * v.y() + self.normal * v.z()
    }
}
