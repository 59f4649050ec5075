//! Three unit directions across each other about a shading normal, in which directions are drawn.

use crate::number::{Number, Vector3};

/// A right-handed frame: tangent × bitangent = normal.
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
    /// Any frame about a unit normal ("Building an Orthonormal Basis, Revisited", Duff et al. 2017).
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

    /// A direction by its components along the three.
    #[inline(always)]
    pub fn to_local(&self, v: N::Vec3) -> N::Vec3 {
        N::Vec3::new(self.tangent.dot(v), self.bitangent.dot(v), self.normal.dot(v))
    }

    /// The direction that has these components.
    #[inline(always)]
    pub fn to_world(&self, v: N::Vec3) -> N::Vec3 {
        self.tangent * v.x() + self.bitangent * v.y() + self.normal * v.z()
    }
}
