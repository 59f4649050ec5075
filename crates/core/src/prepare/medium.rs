//! Prepared media: coefficients for tracking, compiled densities, and the ball of air.

use core::cmp::Ordering;

use glam::{DVec3, I64Vec3};
use raywright_bvh::{Aabb, Real, Vector};

use super::context::PrepareContext;
use super::error::PrepareError;
use super::inputs::InputCompiler;
use crate::expr::ExprScope;
use crate::extent::visit_object_boxes;
use crate::light::Lights;
use crate::scene::{Medium, ScalarFactor, Scene};
use crate::texture::{InputTables, PreparedInput};

/// Greatest coefficient per metre, which stands for infinity and fits an `f32`.
pub(super) const MOST_ATTENUATION: f64 = 1e30;

/// Relative excess of a density over a maximum that rounding explains.
pub(crate) const ROUNDING: f64 = 1e-5;

/// Number of cells along each side of a box in which a density is bounded.
const CELLS: i64 = 16;

/// Greatest number of media whose densities are bounded in cells, which takes some ten milliseconds
/// each.
const MOST_BOUNDED: usize = 16;

/// Greatest number of pairs of a body and a light that are compared.
const MOST_PAIRS: usize = 1 << 20;

/// A medium that scatters light, or whose density varies.
#[derive(Clone, Debug)]
pub(crate) struct PreparedMedium {
    /// Coefficient of absorption and scattering together, per metre, at the greatest density.
    pub majorant: DVec3,
    /// Scattered share of the attenuated light.
    pub albedo: DVec3,
    /// Mean cosine of the scattering angle.
    pub anisotropy: f64,
    /// Program of the density, and one over the greatest density; `None` for an even medium.
    pub density: Option<(u32, f64)>,
    /// Index of the material of the body; `None` for the air.
    pub material: Option<u32>,
    /// Whether the body is infinite somewhere.
    pub is_unbounded: bool,
    /// Whether a surface parts the body from all lights of a size.
    pub is_sealed: bool,
    /// Bounds of a density that varies; `None` without any but 0 and 1.
    cells: Option<DensityCells>,
}

/// Least and greatest values of a density in the cells of a box, relative to the greatest.
#[derive(Clone, Debug)]
struct DensityCells {
    corner: DVec3,
    per_metre: DVec3,
    bounds: Vec<[f64; 2]>,
}

/// Part of a ray: between two distances from its origin, in stored coordinates.
#[derive(Clone, Copy)]
pub(crate) struct RaySegment {
    pub origin: DVec3,
    pub direction: DVec3,
    pub range: [f64; 2],
}

impl RaySegment {
    pub fn new<R: Real>(origin: R::Vec3, direction: R::Vec3, range: [f64; 2]) -> Self {
        Self {
            origin: origin.to_f64(),
            direction: direction.to_f64(),
            range,
        }
    }

    /// Returns the point at a distance.
    pub fn at(&self, t: f64) -> DVec3 {
        self.origin + self.direction * t
    }
}

/// The air: a ball of a medium, in stored coordinates.
#[derive(Clone, Debug)]
pub(crate) struct PreparedAir {
    pub medium: PreparedMedium,
    pub centre: DVec3,
    pub radius: f64,
}

impl PreparedMedium {
    /// Prepares a medium. The compiler's path is that of the medium's owner, `field` the medium's
    /// key in it.
    pub(super) fn new<R: Real>(
        medium: &Medium,
        material: Option<u32>,
        inputs: &mut InputCompiler<'_, R>,
        field: &str,
    ) -> Result<Self, PrepareError> {
        let field = format!("{field}density");
        let density = inputs.compile_weight(&medium.density, ExprScope::Medium, &field)?;
        let (density, factor) = match density {
            PreparedInput::Program(program) => {
                // A density of zero everywhere divides by nothing.
                let most = medium.max_density.max(f64::MIN_POSITIVE);
                (Some((program, 1.0 / most)), medium.max_density)
            }
            constant => (None, constant.constant_number().to_f64()),
        };
        let [absorption, scattering] = medium.coefficients().map(DVec3::from);
        let attenuation = absorption + scattering;
        Ok(Self {
            majorant: (attenuation * factor).min(DVec3::splat(MOST_ATTENUATION)),
            albedo: DVec3::select(
                scattering.cmpgt(DVec3::ZERO),
                scattering / attenuation,
                DVec3::ZERO,
            ),
            anisotropy: medium.anisotropy,
            density,
            material,
            is_unbounded: false,
            is_sealed: false,
            cells: None,
        })
    }

    /// Greatest number of bytes of a medium with its cells.
    pub(super) fn most_bytes(medium: &Medium) -> u64 {
        let cells = match medium.density {
            ScalarFactor::Number(_) => 0,
            _ => size_of::<[f64; 2]>() * (CELLS * CELLS * CELLS) as usize,
        };
        (size_of::<Self>() + cells) as u64
    }

    /// Bytes of the cells.
    pub(super) fn cell_bytes(&self) -> usize {
        let cells = self.cells.as_ref();
        cells.map_or(0, |cells| size_of_val(cells.bounds.as_slice()))
    }

    /// Bounds the density, if it varies, in the cells of a box around the medium.
    pub fn bound_density<R: Real>(&mut self, tables: &InputTables<R>, around: Aabb) {
        let Some((program, per_most)) = self.density else {
            return;
        };
        let side = around.extent() / CELLS as f64;
        if self.is_unbounded || !(side.min_element() > 0.0 && side.is_finite()) {
            return;
        }
        let cell = |i: i64| {
            let place = I64Vec3::new(i % CELLS, i / CELLS % CELLS, i / (CELLS * CELLS));
            let least = around.min + side * place.as_dvec3();
            let found = tables.bounds_in_box(program, [least, least + side]);
            let [least, greatest] = found.map(|density| density * per_most);
            // A cell out of range is evaluated, so that its values are found.
            if least > 1.0 || greatest <= 0.0 && least < 0.0 || least.is_nan() || greatest.is_nan()
            {
                [0.0, 1.0]
            } else {
                let (below, above) = (least * (1.0 - ROUNDING), greatest * (1.0 + ROUNDING));
                [below.clamp(0.0, 1.0), above.clamp(0.0, 1.0)]
            }
        };
        self.cells = Some(DensityCells {
            corner: around.min,
            per_metre: side.recip(),
            bounds: (0..CELLS * CELLS * CELLS).map(cell).collect(),
        });
    }

    /// Returns the parts of a ray between two distances, in order: the end of each, and bounds of
    /// the density there, relative to the greatest.
    pub fn parts_along(
        &self,
        RaySegment {
            origin,
            direction,
            range: [from, to],
        }: RaySegment,
    ) -> impl Iterator<Item = (f64, [f64; 2])> {
        let whole = [if self.density.is_some() { 0.0 } else { 1.0 }, 1.0];
        let mut cells = self.cells.as_ref();
        let (mut t, mut cell, mut ends, mut across) =
            (from, I64Vec3::ZERO, DVec3::ZERO, DVec3::ZERO);
        if let Some(DensityCells {
            corner, per_metre, ..
        }) = cells
        {
            let (start, slope) = ((origin - *corner) * *per_metre, direction * *per_metre);
            let first = start + slope * from;
            cell = first.floor().as_i64vec3();
            // Rounding may start a segment beside the box.
            cell = cell.clamp(I64Vec3::ZERO, I64Vec3::splat(CELLS - 1));
            if (first - cell.as_dvec3() - 0.5).abs().max_element() > 0.5 + ROUNDING {
                cells = None;
            }
            let ahead =
                cell.as_dvec3() + DVec3::select(slope.cmpgt(DVec3::ZERO), DVec3::ONE, DVec3::ZERO);
            across = slope.recip();
            let is_crossed = DVec3::splat(f64::INFINITY).cmpgt(across.abs());
            ends = DVec3::select(is_crossed, (ahead - start) * across, DVec3::INFINITY);
        }
        core::iter::from_fn(move || {
            // A segment of unknown length has none either.
            if t.partial_cmp(&to) != Some(Ordering::Less) {
                return None;
            }
            let Some(DensityCells { bounds, .. }) = cells else {
                t = to;
                return Some((to, whole));
            };
            let index = (cell.z * CELLS + cell.y) * CELLS + cell.x;
            let axis = ends.min_position();
            t = ends[axis].max(t).min(to);
            ends[axis] += across[axis].abs();
            cell[axis] += if across[axis] > 0.0 { 1 } else { -1 };
            if !(0..CELLS).contains(&cell[axis]) {
                cells = None;
            }
            Some((t, bounds[index as usize]))
        })
    }

    /// Whether all channels are attenuated alike.
    #[inline(always)]
    pub fn is_grey(&self) -> bool {
        self.majorant == DVec3::splat(self.majorant.x)
    }

    /// Whether the medium only absorbs.
    pub fn is_dark(&self) -> bool {
        self.albedo == DVec3::ZERO
    }
}

/// Completes the media of bodies by what depends on their objects: whether they are infinite
/// somewhere, what parts them from the lights, and the bounds of their densities.
pub(super) fn measure_bodies<R: Real>(
    media: &mut [PreparedMedium],
    context: &PrepareContext<'_>,
    object_media: &[Option<u32>],
    (tables, lights): (&InputTables<R>, &Lights<R>),
    is_open: impl Fn(u32) -> bool,
) {
    let mut boxes = vec![Aabb::EMPTY; media.len()];
    let scene = (context.scene, context.lookup, context.origin.origin);
    let medium_of = |object: usize| object_media.get(object).copied().flatten();
    visit_object_boxes::<R>(
        scene,
        |object| medium_of(object).is_some(),
        |object, bounds| {
            let medium = medium_of(object).unwrap_or_default() as usize;
            match bounds {
                Some(bounds) => boxes[medium] = boxes[medium].union(bounds),
                None => media[medium].is_unbounded = true,
            }
        },
    );
    let are_few = media.len() <= MOST_BOUNDED;
    let lamps = || lights.light_ids().filter_map(|light| lights.bounds(light));
    let are_compared = media.len().saturating_mul(lamps().count()) <= MOST_PAIRS;
    for (medium, around) in media.iter_mut().zip(boxes) {
        let is_inside =
            |bounds: Aabb| (bounds.min.cmple(around.max) & bounds.max.cmpge(around.min)).all();
        medium.is_sealed = medium.material.is_some_and(|material| !is_open(material))
            && !medium.is_unbounded
            && are_compared
            && !lamps().any(|lamp| is_inside(lamp.bounding_box));
        if are_few {
            medium.bound_density(tables, around);
        }
    }
}

impl PreparedAir {
    /// Places the air of a scene. `bounded` is the box of the bounded objects, `origin` the storage
    /// origin.
    pub fn new<R: Real>(
        mut medium: PreparedMedium,
        tables: &InputTables<R>,
        scene: &Scene,
        (bounded, origin): (&Aabb, DVec3),
    ) -> Self {
        let (centre, extent) = if bounded.is_empty() {
            (DVec3::ZERO, 1.0)
        } else {
            let centre = 0.5 * (bounded.min + bounded.max);
            (centre, 0.5 * bounded.extent().length())
        };
        let eyes = scene.cameras.iter().map(|camera| camera.pose.eye());
        let farthest = eyes.fold(0.0, |most: f64, eye| {
            most.max((eye - origin - centre).length())
        });
        let own = scene.air.as_ref().and_then(|air| air.radius);
        let radius = own.unwrap_or_else(|| (4.0 * extent).max(2.0 * farthest));
        let (min, max) = (centre - radius, centre + radius);
        medium.bound_density(tables, Aabb { min, max });
        Self {
            medium,
            centre,
            radius,
        }
    }

    /// Returns the part of a segment that lies in the air.
    pub fn intersect(&self, segment: RaySegment) -> Option<RaySegment> {
        let to_centre = self.centre - segment.origin;
        let along = to_centre.dot(segment.direction);
        let aside = (to_centre - segment.direction * along).length_squared();
        let half = (self.radius * self.radius - aside).max(0.0).sqrt();
        let [from, to] = segment.range;
        let range = [from.max(along - half), to.min(along + half)];
        (range[0] < range[1]).then_some(RaySegment { range, ..segment })
    }
}
