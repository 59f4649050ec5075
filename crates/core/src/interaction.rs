//! A ray meets a surface: the one record of it that materials, lights and spawned rays read.

use raywright_bvh::{Real, Surface, Vector};

use crate::expr::Inputs;
use crate::scene::MOST_UV_SETS;
use crate::texture::Place;

/// A point where a ray met a surface. What only some readers want is made from it when they ask:
/// [`Self::inputs`] where an expression is evaluated, [`Self::mirrored`] where something reflects,
/// [`Self::frame`] where directions are drawn.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Interaction<R: Real> {
    /// The geometric frame: point, how far it may be off, normal outwards. Spawned rays start from
    /// it.
    pub surface: Surface<R>,
    /// The shading frame's axis: unit, interpolated where the mesh has normals, and on the viewer's
    /// side where the object says so.
    pub normal: R::Vec3,
    /// Whether the ray arrived against the outward normal.
    pub outside: bool,
    /// Unit direction of the ray, towards the surface.
    pub direction: R::Vec3,
    /// Where the ray began.
    pub origin: R::Vec3,
    /// How far away that is.
    pub distance: R,
    /// The ray's time, at which rays to lights leave too.
    pub time: R,
    /// Texture coordinates by set, as far as the material reads them.
    pub uv: [[R; 2]; MOST_UV_SETS],
    /// Side of the square of texture coordinates that the ray covers as wide as it is, by set; zero
    /// where no texture asks.
    pub footprint: [R; MOST_UV_SETS],
    /// Where its textures lie in their images, and the first use that lies there, where that is
    /// known already.
    pub lies: Option<(u32, Place<R>)>,
    /// Colour of the mesh's vertices with alpha; white where there is none.
    pub colour: [R; 4],
    pub object: u32,
    pub material: u32,
}

/// What the corners of a triangle carry, by their weights at a point of it. Rounding never leads
/// beyond the corners: where all carry the same it is that everywhere, and an alpha at a mask's
/// cutoff stays there.
#[inline(always)]
pub(crate) fn interpolate<R: Real>([a, b, c]: [R; 3], [wa, wb, wc]: [R; 3]) -> R {
    let (least, most) = (Real::min(Real::min(a, b), c), Real::max(Real::max(a, b), c));
    Real::clamp(a * wa + b * wb + c * wc, least, most)
}

/// What an expression may ask of the light that is weighed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Beam<R: Real> {
    /// Unit direction to the light.
    pub direction: R::Vec3,
    /// Share of it that arrives.
    pub share: R,
    /// Distance of what hides it; infinite where nothing does.
    pub occluder: R,
}

impl<R: Real> Default for Beam<R> {
    /// No light yet, and nothing in its way.
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
    /// To be filled.
    pub const NOWHERE: Self = Self {
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
        lies: None,
        colour: [R::ONE; 4],
        object: 0,
        material: 0,
    };

    /// The ray's direction mirrored at the shading normal.
    #[inline(always)]
    pub fn mirrored(&self) -> R::Vec3 {
        self.direction - self.normal * (R::from_f64(2.0) * self.direction.dot(self.normal))
    }

    /// What an expression sees here, of a light too.
    #[inline(always)]
    pub fn inputs(&self, beam: &Beam<R>) -> Inputs<R> {
        Inputs {
            p: self.surface.point,
            n: self.normal,
            d: self.direction,
            r: self.mirrored(),
            l: beam.direction,
            o: self.origin,
            u: self.uv[0][0],
            v: self.uv[0][1],
            distance: self.distance,
            occluder_distance: beam.occluder,
            shadow: beam.share,
        }
    }
}
