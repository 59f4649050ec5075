//! Interaction of a ray with a surface: the data at a hit that materials, lights and spawned rays
//! read.

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
    /// Unit shading normal: interpolated if the mesh has normals, and turned towards the viewer if
    /// the object's rule of sides requires it.
    pub normal: R::Vec3,
    /// Whether the ray arrived against the outward normal.
    pub outside: bool,
    /// Unit direction of the ray, towards the surface.
    pub direction: R::Vec3,
    /// Beginning of the ray, in world space.
    pub origin: R::Vec3,
    /// Distance from the beginning of the ray.
    pub distance: R,
    /// Time of the ray; spawned rays and shadow rays have the same time.
    pub time: R,
    /// Texture coordinates by set; only the sets that the material reads are filled.
    pub uv: [[R; 2]; MOST_UV_SETS],
    /// Width of the ray's footprint in texture coordinates, by set: the edge of a square with the
    /// width of the ray cone. Zero if no texture needs it.
    pub footprint: [R; MOST_UV_SETS],
    /// Texel footprint of the material's textures, if already computed, with the index of the first
    /// texture binding that has this footprint.
    pub texel_footprint: Option<(u32, TexelFootprint<R>)>,
    /// Interpolated vertex colour with alpha; white where the mesh has none.
    pub colour: [R; 4],
    pub object: u32,
    pub material: u32,
}

/// Interpolates a vertex attribute by barycentric weights. The result is clamped to the range of
/// the corners: equal attributes stay equal everywhere, and an alpha equal to a mask's cutoff is
/// not rounded below it.
#[inline(always)]
pub(crate) fn interpolate_vertex_attribute<R: Real>([a, b, c]: [R; 3], [wa, wb, wc]: [R; 3]) -> R {
    let (minimum, maximum) = (Real::min(Real::min(a, b), c), Real::max(Real::max(a, b), c));
    Real::clamp(a * wa + b * wb + c * wc, minimum, maximum)
}

/// Variables of an expression that depend on a light: those of the light whose contribution is
/// evaluated.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightInputs<R: Real> {
    /// Unit direction towards the light.
    pub direction: R::Vec3,
    /// Share of the light that arrives, 0 to 1.
    pub share: R,
    /// Distance of the occluder; infinite without an occluder.
    pub occluder: R,
}

impl<R: Real> Default for LightInputs<R> {
    /// Returns the inputs of unoccluded light without a direction.
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
    /// Placeholder, whose fields are set before use.
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

    /// Returns the values of an expression's variables at this point, for a given light.
    #[inline(always)]
    pub fn expression_inputs(&self, light_inputs: &LightInputs<R>) -> VariableValues<R> {
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
