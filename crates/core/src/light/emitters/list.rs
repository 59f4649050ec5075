//! The tables of emitters, as preparation fills them.

use glam::DVec3;
use raywright_bvh::shapes::{AnyShape, Quad, TransformedShape, Triangle};
use raywright_bvh::{Real, Side, Vector};

use super::cells::{CellTable, Cells, bytes_of};
use crate::light::Polygon;

/// Geometry of an emitter in the world.
#[derive(Clone, Copy, Debug)]
pub(in crate::light) enum EmitterShape<R: Real> {
    Plain(AnyShape<R>),
    /// Under a map: its place in the list of those.
    Placed(u32),
}

/// What is the same all over a flat emitter.
#[derive(Clone, Copy, Debug)]
pub(in crate::light) struct EmitterPlane {
    /// Outwards, unit.
    pub normal: DVec3,
    /// Bound on how far points may be off.
    pub error: f64,
}

impl EmitterPlane {
    /// Of triangles and quads.
    fn of<R: Real>(shape: &AnyShape<R>) -> Option<Self> {
        let half = R::from_f64(0.5);
        let flat = matches!(shape, AnyShape::Triangle(_) | AnyShape::Quad(_));
        let (anywhere, _) = flat.then(|| shape.sample_area(half, half))??;
        Some(Self {
            normal: anywhere.normal,
            error: anywhere.error,
        })
    }
}

/// One emissive shape or triangle.
#[derive(Clone, Copy, Debug)]
pub(in crate::light) struct Emitter<R: Real> {
    pub form: EmitterShape<R>,
    /// What it gives off; the mean of it where that varies.
    pub radiance: R::Vec3,
    /// Whether it varies, so that it is known only where a ray meets it.
    pub varies: bool,
    /// Whether a ray may pass it.
    pub passable: bool,
    /// Which sides give off light: those that can be seen.
    pub side: Side,
    /// Area of the surface in the world; zero where it has none that points could be drawn from.
    pub area: f64,
    /// Where on a triangle points are drawn; none: everywhere alike.
    pub cells: Option<Cells>,
    /// The plane of a triangle or quad that is under no map.
    pub plane: Option<EmitterPlane>,
    /// Whether it is the second half of the quad before it, which has its light.
    pub is_second: bool,
}

impl<R: Real> Emitter<R> {
    /// Sum of what it gives off in all directions, up to a factor that all emitters share.
    pub fn power(&self) -> f64 {
        let radiance = self.radiance.to_f64();
        (radiance.x + radiance.y + radiance.z)
            * self.area
            * if self.side == Side::Both { 2.0 } else { 1.0 }
    }
}

impl<R: Real> Emitter<R> {
    /// What its points are shown with: what it gives off, or one where that is known only when a
    /// ray meets it.
    #[inline(always)]
    pub fn shown_radiance(&self) -> R::Vec3 {
        if self.varies {
            R::Vec3::ONE
        } else {
            self.radiance
        }
    }

    /// The polygon that it is, if it is one and has a plane.
    #[inline(always)]
    pub fn polygon(&self) -> Option<Polygon> {
        self.plane?;
        // One by one: an array's map is not always inlined.
        match &self.form {
            EmitterShape::Plain(AnyShape::Triangle(Triangle {
                vertices: [a, b, c],
            })) => Some(Polygon::triangle([a.to_f64(), b.to_f64(), c.to_f64()])),
            EmitterShape::Plain(AnyShape::Quad(Quad {
                corners: [a, b, c, d],
            })) => Some(Polygon::quad([
                a.to_f64(),
                b.to_f64(),
                c.to_f64(),
                d.to_f64(),
            ])),
            _ => None,
        }
    }
}

/// What an emitter gives off.
#[derive(Clone, Copy, Debug)]
pub struct EmissionEstimate<R: Real> {
    /// Radiance; the mean of it where it varies, by which it is asked as often as it is worth.
    pub radiance: R::Vec3,
    /// Whether it varies.
    pub varies: bool,
    /// Whether a ray may pass it, so that what is behind its first point is seen too.
    pub passable: bool,
}

impl<R: Real> EmissionEstimate<R> {
    /// The same radiance everywhere.
    pub fn even(radiance: R::Vec3) -> Self {
        Self {
            radiance,
            varies: false,
            passable: false,
        }
    }

    /// The mean of what was found in places that are even over a surface; `passable`: whether a ray
    /// may pass it.
    pub fn varied(found: &[R::Vec3], passable: bool) -> Self {
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

/// Emitters as preparation finds them, object by object.
#[derive(Clone, Debug, Default)]
pub struct EmitterList<R: Real> {
    pub(super) emitters: Vec<Emitter<R>>,
    pub(super) placed: Vec<TransformedShape<R>>,
    pub(super) first: Vec<u32>,
    pub(super) cells: CellTable,
}

impl<R: Real> EmitterList<R> {
    /// Makes room for so many triangles whose emission varies, of so many cells each way.
    pub fn reserve_cells(&mut self, triangles: u64, across: u64) {
        self.cells.reserve(triangles, across);
    }

    /// What is added from here on belongs to the next object, in the order of the scene's objects.
    pub fn next_object(&mut self) {
        self.first.push(self.emitters.len() as u32);
    }

    /// Bytes of so many emitters, some of them under maps and some triangles with so many cells
    /// each way, of a scene of so many objects, with the sums by which they are drawn.
    pub(crate) fn bytes_of(
        emitters: u64,
        placed: u64,
        objects: u64,
        [triangles, across]: [u64; 2],
    ) -> u64 {
        if emitters == 0 {
            return 0;
        }
        let each = [
            (emitters, size_of::<Emitter<R>>() + size_of::<f64>()),
            (placed, size_of::<TransformedShape<R>>()),
            (objects, size_of::<u32>()),
        ];
        let tables = each.into_iter().fold(0_u64, |sum, (count, bytes)| {
            sum.saturating_add(count.saturating_mul(bytes as u64))
        });
        tables.saturating_add(bytes_of(triangles, across))
    }

    /// Adds a shape, or the next triangle of a mesh. `area`: where the caller knows it.
    pub fn plain(
        &mut self,
        shape: AnyShape<R>,
        glow: EmissionEstimate<R>,
        side: Side,
        area: Option<f64>,
    ) -> f64 {
        let EmissionEstimate {
            radiance,
            varies,
            passable,
        } = glow;
        let area = area.unwrap_or_else(|| finite(shape.area()));
        let plane = EmitterPlane::of(&shape);
        self.emitters.push(Emitter {
            form: EmitterShape::Plain(shape),
            radiance,
            varies,
            passable,
            side,
            area,
            cells: None,
            plane,
            is_second: false,
        });
        area
    }

    /// Adds the next two triangles of a mesh, which are the halves of a quad and give off the same
    /// everywhere: one light, drawn from as a whole.
    pub fn halves(&mut self, quad: Quad<R>, radiance: R::Vec3, side: Side) {
        self.plain(
            AnyShape::Quad(quad),
            EmissionEstimate::even(radiance),
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

    /// Adds the next triangle of a mesh whose emission varies, from what it gives off in the
    /// middles of cells of the square that is folded onto it, row by row, so many each way.
    pub fn varied(
        &mut self,
        triangle: Triangle<R>,
        found: &[R::Vec3],
        passable: bool,
        side: Side,
        across: usize,
    ) {
        self.plain(
            AnyShape::Triangle(triangle),
            EmissionEstimate::varied(found, passable),
            side,
            None,
        );
        let brightness = |radiance: &R::Vec3| radiance.to_f64().element_sum();
        let cells = self
            .cells
            .push(across, &found.iter().map(brightness).collect::<Vec<_>>());
        if let Some(emitter) = self.emitters.last_mut() {
            emitter.cells = cells;
        }
    }

    /// Adds a shape under a map.
    pub fn placed(
        &mut self,
        placed: TransformedShape<R>,
        glow: EmissionEstimate<R>,
        side: Side,
        area: Option<f64>,
    ) -> f64 {
        let EmissionEstimate {
            radiance,
            varies,
            passable,
        } = glow;
        let area = area.unwrap_or_else(|| finite(placed.area()));
        let form = EmitterShape::Placed(self.placed.len() as u32);
        self.placed.push(placed);
        self.emitters.push(Emitter {
            form,
            radiance,
            varies,
            passable,
            side,
            area,
            cells: None,
            plane: None,
            is_second: false,
        });
        area
    }
}

/// An area that points can be drawn from.
fn finite(area: Option<f64>) -> f64 {
    area.filter(|a| a.is_finite()).unwrap_or(0.0)
}
