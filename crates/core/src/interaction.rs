//! Interaction of a ray with a surface: the data about a hit that materials, lights and spawned
//! rays need.

use raywright_bvh::{Real, Surface, Vector};

use crate::expr::VariableValues;
use crate::scene::MOST_UV_SETS;
use crate::texture::TexelFootprint;

/// Interaction of a ray with a surface at a hit. Derived values are computed on demand:
/// [`Self::expression_inputs`] for an expression, [`Self::mirrored_direction`] for a reflection,
/// [`Self::shading_frame`] for anisotropy.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Interaction<R: Real> {
    /// Surface geometry: point, bound on the point's error, outward normal. Spawned rays start from
    /// this geometry.
    pub surface: Surface<R>,
    /// Unit shading normal. It is interpolated if the mesh has normals. It is turned to the side of
    /// the ray if the object is marked `face_viewer`.
    pub normal: R::Vec3,
    /// Whether the ray hit the outside, the side of the outward normal.
    pub outside: bool,
    /// Unit direction of the ray, towards the surface.
    pub direction: R::Vec3,
    /// Origin of the ray, in world space.
    pub origin: R::Vec3,
    /// Distance from the ray's origin to the hit.
    pub distance: R,
    /// Time of the ray. Spawned rays and shadow rays have the same time.
    pub time: R,
    /// Texture coordinates, by the index of their set. Only the sets that the material reads are
    /// filled.
    pub uv: [[R; 2]; MOST_UV_SETS],
    /// Width of the ray's footprint in texture coordinates, by the index of their set. The
    /// footprint is a square whose edge is the width of the ray cone. Zero if no texture needs it.
    pub footprint: [R; MOST_UV_SETS],
    /// Footprint in texels, if already computed for one of the material's textures, and the index
    /// of the first texture binding with this footprint.
    pub texel_footprint: Option<(u32, TexelFootprint<R>)>,
    /// Interpolated vertex colour with alpha; white where the mesh has none.
    pub colour: [R; 4],
    pub object: u32,
    pub material: u32,
}

/// Interpolates a vertex attribute by barycentric weights. The result is clamped to the range of
/// the three corners. So equal attributes stay equal everywhere, and rounding does not take an
/// alpha below the cutoff of a mask that it equals.
#[inline(always)]
pub(crate) fn interpolate_vertex_attribute<R: Real>([a, b, c]: [R; 3], [wa, wb, wc]: [R; 3]) -> R {
    let (minimum, maximum) = (Real::min(Real::min(a, b), c), Real::max(Real::max(a, b), c));
    Real::clamp(a * wa + b * wb + c * wc, minimum, maximum)
}

/// Variables of an expression that depend on a light. They have the values for the light whose
/// contribution is evaluated.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightVariableValues<R: Real> {
    /// Unit direction towards the light.
    pub direction: R::Vec3,
    /// Fraction of the light that arrives, 0 to 1, by the scene's shadow rule.
    pub share: R,
    /// Distance to the object that blocks the light; infinite if none does.
    pub occluder: R,
}

impl<R: Real> Default for LightVariableValues<R> {
    /// Returns the inputs for light that arrives unblocked and has no direction.
    #[inline(always)]
    fn default() -> Self {
        Self {
            direction: Vector::ZERO,
            share: R::ONE,
            occluder: R::INFINITY,
        }
    }
}

impl<R: Real> Interaction<R> {
    /// Placeholder whose fields are set before they are read.
    pub const PLACEHOLDER: Self = Self {
        surface: Surface {
            point: <R::Vec3 as Vector<R>>::ZERO,
            above: <R::Vec3 as Vector<R>>::ZERO,
            below: <R::Vec3 as Vector<R>>::ZERO,
            error: R::ZERO,
            normal: <R::Vec3 as Vector<R>>::ZERO,
        },
        normal: <R::Vec3 as Vector<R>>::ZERO,
        outside: false,
        direction: <R::Vec3 as Vector<R>>::ZERO,
        origin: <R::Vec3 as Vector<R>>::ZERO,
        distance: R::ZERO,
        time: R::ZERO,
        uv: [[R::ZERO; 2]; MOST_UV_SETS],
        footprint: [R::ZERO; MOST_UV_SETS],
        texel_footprint: None,
        colour: [R::ONE; 4],
        object: 0,
        material: 0,
    };

    /// Returns the ray's direction, mirrored at the shading normal.
    #[inline(always)]
    pub fn mirrored_direction(&self) -> R::Vec3 {
        self.direction - self.normal * (R::from_f64(2.0) * self.direction.dot(self.normal))
    }

    /// Returns the values of an expression's variables at this point. `light_inputs` has the values
    /// for a light.
    #[inline(always)]
    pub fn expression_inputs(&self, light_inputs: &LightVariableValues<R>) -> VariableValues<R> {
        VariableValues {
            p: self.surface.point,
            n: self.normal,
            d: self.direction,
            r: self.mirrored_direction(),
            l: light_inputs.direction,
            o: self.origin,
            u: self.uv[0][0],
            v: self.uv[0][1],
            distance: self.distance,
            occluder_distance: light_inputs.occluder,
            shadow: light_inputs.share,
        }
    }
}
