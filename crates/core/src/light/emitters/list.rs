//! Tables of emitters, filled while a scene is prepared.

use glam::DVec3;
use raywright_bvh::shapes::{AnyShape, Quad, TransformedShape, Triangle};
use raywright_bvh::{Real, Side, TriangleSlot, Vector};

use super::emission_cells::{EmissionCellTable, TriangleCells, estimate_cell_bytes};
use crate::light::Polygon;

/// World-space geometry of an emitter.
#[derive(Clone, Copy, Debug)]
pub(in crate::light) enum EmitterShape<R: Real> {
    Plain(AnyShape<R>),
    /// A shape with a transform: its index in the list of transformed shapes.
    Transformed(u32),
}

/// Plane of a flat emitter.
#[derive(Clone, Copy, Debug)]
pub(in crate::light) struct EmitterPlane {
    /// Outward unit normal.
    pub normal: DVec3,
    /// Bound on the rounding error of points in the plane.
    pub error: f64,
}

impl EmitterPlane {
    /// Returns the plane of a triangle or quad; `None` for other shapes.
    fn from_shape<R: Real>(shape: &AnyShape<R>) -> Option<Self> {
        let half = R::from_f64(0.5);
        let flat = matches!(shape, AnyShape::Triangle(_) | AnyShape::Quad(_));
        let (anywhere, _) = flat.then(|| shape.sample_area(half, half))??;
        Some(Self {
            normal: anywhere.normal,
            error: anywhere.error,
        })
    }
}

/// An emitter: an emissive shape, or an emissive triangle or quad of a mesh.
#[derive(Clone, Copy, Debug)]
pub(in crate::light) struct Emitter<R: Real> {
    pub shape: EmitterShape<R>,
    /// Emitted radiance, or its mean over a surface of varying emission.
    pub radiance: R::Vec3,
    /// Whether the emission varies over the surface and must be evaluated at the hit.
    pub varies: bool,
    /// Whether a ray may pass through the surface.
    pub passable: bool,
    /// Sides that emit, limited to visible sides.
    pub side: Side,
    /// Area of the surface in the world; zero if its points cannot be sampled.
    pub area: f64,
    /// Sampling cells of a triangle with varying emission; `None` for uniform sampling.
    pub cells: Option<TriangleCells>,
    /// The plane of an untransformed triangle or quad.
    pub plane: Option<EmitterPlane>,
    /// Whether this triangle is the second half of a quad. The preceding entry then is the emitter
    /// of the whole quad.
    pub is_second: bool,
}

impl<R: Real> Emitter<R> {
    /// Returns the emitted flux divided by π.
    pub fn power(&self) -> f64 {
        let radiance = self.radiance.to_f64();
        (radiance.x + radiance.y + radiance.z)
            * self.area
            * if self.side == Side::Both { 2.0 } else { 1.0 }
    }
}

impl<R: Real> Emitter<R> {
    /// Returns the radiance that light sampling assumes: the emitted radiance, or 1 if the emission
    /// must be evaluated at the hit.
    #[inline(always)]
    pub fn assumed_radiance(&self) -> R::Vec3 {
        if self.varies {
            R::Vec3::ONE
        } else {
            self.radiance
        }
    }

    /// Returns the polygon of an untransformed triangle or quad; `None` for other emitters.
    #[inline(always)]
    pub fn light_polygon(&self) -> Option<Polygon> {
        self.plane?;
        // Component by component: `map` of an array is not always inlined.
        match &self.shape {
            EmitterShape::Plain(AnyShape::Triangle(Triangle {
                vertices: [a, b, c],
            })) => Some(Polygon::from_triangle([a.to_f64(), b.to_f64(), c.to_f64()])),
            EmitterShape::Plain(AnyShape::Quad(Quad {
                corners: [a, b, c, d],
            })) => Some(Polygon::from_quad([
                a.to_f64(),
                b.to_f64(),
                c.to_f64(),
                d.to_f64(),
            ])),
            _ => None,
        }
    }
}

/// Estimate of an emitter's radiance. Emitters are chosen in proportion to this estimate.
#[derive(Clone, Copy, Debug)]
pub struct EmissionEstimate<R: Real> {
    /// Emitted radiance, or its mean over a surface of varying emission.
    pub radiance: R::Vec3,
    /// Whether the emission varies over the surface.
    pub varies: bool,
    /// Whether a ray may pass through the surface. Surface points behind the ray's first hit then
    /// contribute too.
    pub passable: bool,
}

impl<R: Real> EmissionEstimate<R> {
    /// Returns the estimate for uniform emission.
    pub fn from_uniform_emission(radiance: R::Vec3) -> Self {
        Self {
            radiance,
            varies: false,
            passable: false,
        }
    }

    /// Returns the estimate for varying emission: the mean of the radiances `found` at points
    /// spread uniformly over the surface. `passable`: whether a ray may pass through the surface.
    pub fn from_emission_samples(found: &[R::Vec3], passable: bool) -> Self {
        let sum = found
            .iter()
            .fold(R::Vec3::ZERO, |sum, &radiance| sum + radiance);
        Self {
            radiance: sum * R::from_f64(1.0 / found.len() as f64),
            varies: true,
            passable,
        }
    }
}

/// List of a scene's emitters (emissive shapes and triangles), object by object.
#[derive(Clone, Debug, Default)]
pub struct EmitterList<R: Real> {
    pub(super) emitters: Vec<Emitter<R>>,
    pub(super) transformed_shapes: Vec<TransformedShape<R>>,
    /// Index of the first emitter of each object.
    pub(super) first_emitters: Vec<u32>,
    pub(super) cells: EmissionCellTable,
}

impl<R: Real> EmitterList<R> {
    /// Reserves memory for `triangles` triangles of varying emission, with `across` cells along
    /// each side.
    pub fn reserve_cells(&mut self, triangles: u64, across: u64) {
        self.cells.reserve(triangles, across);
    }

    /// Begins the next object, in the order of the scene's objects. Emitters added from now on
    /// belong to this object.
    pub fn begin_object(&mut self) {
        self.first_emitters.push(self.emitters.len() as u32);
    }

    /// Returns the size of all tables in bytes. Cumulative distributions and the emitters' triangles
    /// in the accelerator are included.
    ///
    /// The arguments are the numbers of emitters, of transformed shapes, of objects, and of triangles
    /// whose emission varies. Each of these triangles has a grid of `across` by `across` cells.
    pub(crate) fn estimate_bytes(
        emitters: u64,
        placed: u64,
        objects: u64,
        [triangles, across]: [u64; 2],
    ) -> u64 {
        if emitters == 0 {
            return 0;
        }
        let each = [
            (
                emitters,
                size_of::<Emitter<R>>() + size_of::<f64>() + size_of::<[TriangleSlot; 2]>(),
            ),
            (placed, size_of::<TransformedShape<R>>()),
            (objects, size_of::<u32>()),
        ];
        let tables = each.into_iter().fold(0_u64, |sum, (count, bytes)| {
            sum.saturating_add(count.saturating_mul(bytes as u64))
        });
        tables.saturating_add(estimate_cell_bytes(triangles, across))
    }

    /// Adds a shape or the next triangle of a mesh, without sampling cells. Returns the area.
    /// `area` holds the area if it is already known.
    pub fn add_shape(
        &mut self,
        shape: AnyShape<R>,
        emission: EmissionEstimate<R>,
        side: Side,
        area: Option<f64>,
    ) -> f64 {
        let area = area.unwrap_or_else(|| finite_or_zero(shape.area()));
        let plane = EmitterPlane::from_shape(&shape);
        self.push_emitter((EmitterShape::Plain(shape), plane), emission, side, area)
    }

    fn push_emitter(
        &mut self,
        (shape, plane): (EmitterShape<R>, Option<EmitterPlane>),
        emission: EmissionEstimate<R>,
        side: Side,
        area: f64,
    ) -> f64 {
        self.emitters.push(Emitter {
            shape,
            radiance: emission.radiance,
            varies: emission.varies,
            passable: emission.passable,
            side,
            area,
            cells: None,
            plane,
            is_second: false,
        });
        area
    }

    /// Adds the next two triangles of a mesh as one emitter: the halves of a quad of uniform
    /// emission.
    pub fn add_quad_halves(&mut self, quad: Quad<R>, radiance: R::Vec3, side: Side) {
        self.add_shape(
            AnyShape::Quad(quad),
            EmissionEstimate::from_uniform_emission(radiance),
            side,
            None,
        );
        if let Some(&first) = self.emitters.last() {
            self.emitters.push(Emitter {
                area: 0.0,
                is_second: true,
                ..first
            });
        }
    }

    /// Adds the next triangle of a mesh, with varying emission. `found` holds the radiance in the
    /// middle of each sampling cell, row by row, with `across` cells in a row.
    pub fn add_varying_triangle(
        &mut self,
        triangle: Triangle<R>,
        found: &[R::Vec3],
        passable: bool,
        side: Side,
        across: usize,
    ) {
        self.add_shape(
            AnyShape::Triangle(triangle),
            EmissionEstimate::from_emission_samples(found, passable),
            side,
            None,
        );
        let brightness = |radiance: &R::Vec3| radiance.to_f64().element_sum();
        let cells = self
            .cells
            .push_triangle_cells(across, &found.iter().map(brightness).collect::<Vec<_>>());
        if let Some(emitter) = self.emitters.last_mut() {
            emitter.cells = cells;
        }
    }

    /// Adds a transformed shape and returns its area.
    pub fn add_transformed_shape(
        &mut self,
        transformed_shape: TransformedShape<R>,
        emission: EmissionEstimate<R>,
        side: Side,
        area: Option<f64>,
    ) -> f64 {
        let area = area.unwrap_or_else(|| finite_or_zero(transformed_shape.area()));
        let form = EmitterShape::Transformed(self.transformed_shapes.len() as u32);
        self.transformed_shapes.push(transformed_shape);
        self.push_emitter((form, None), emission, side, area)
    }
}

/// Returns a finite area unchanged; zero for an infinite or unknown area.
fn finite_or_zero(area: Option<f64>) -> f64 {
    area.filter(|a| a.is_finite()).unwrap_or(0.0)
}
