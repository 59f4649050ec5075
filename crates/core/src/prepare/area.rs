//! Surfaces that light others: emissive objects whose points can be drawn.

use raywright_bvh::shapes::{AnyShape, Placed};
use raywright_bvh::{Precision, Real, Surface, Vec3Of, Vector};

/// All emitters of a scene, drawn in proportion to their power.
#[derive(Clone, Debug)]
pub(crate) struct AreaLights<P: Precision> {
    emitters: Vec<Emitter<P>>,
    /// Running sum of the probabilities; the last entry is exactly 1.
    cumulative: Vec<f64>,
}

/// One emissive shape or triangle.
#[derive(Clone, Debug)]
pub(crate) struct Emitter<P: Precision> {
    pub form: Form<P>,
    pub radiance: Vec3Of<P>,
    /// Whether the inside gives off light too; otherwise only the side the normal points to.
    pub two_sided: bool,
}

/// Geometry of an emitter in the world.
#[derive(Clone, Debug)]
pub(crate) enum Form<P: Precision> {
    Plain(AnyShape<P::Real>),
    Placed(Box<Placed<P>>),
}

/// A drawn point of an emitter, as another point sees it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Drawn<R: Real> {
    pub surface: Surface<R>,
    /// Unit direction to it.
    pub direction: R::Vec3,
    /// Irradiance on a surface that faces it, if nothing is in between, over the probability of having drawn it.
    pub irradiance: R::Vec3,
}

impl<P: Precision> Emitter<P> {
    fn area(&self) -> f64 {
        let area = match &self.form {
            Form::Plain(shape) => shape.area(),
            Form::Placed(placed) => placed.area(),
        };
        area.filter(|a| a.is_finite()).unwrap_or(0.0)
    }
}

impl<P: Precision> AreaLights<P> {
    /// None when nothing of it gives off light.
    pub fn new(mut emitters: Vec<Emitter<P>>) -> Option<Self> {
        let power = |e: &Emitter<P>| {
            let radiance = e.radiance.to_f64();
            (radiance.x + radiance.y + radiance.z) * e.area() * if e.two_sided { 2.0 } else { 1.0 }
        };
        emitters.retain(|e| power(e) > 0.0);
        let powers: Vec<f64> = emitters.iter().map(power).collect();
        let total: f64 = powers.iter().sum();
        let mut sum = 0.0;
        let mut cumulative: Vec<f64> = powers
            .iter()
            .map(|p| {
                sum += p / total;
                sum
            })
            .collect();
        *cumulative.last_mut()? = 1.0;
        Some(Self { emitters, cumulative })
    }

    /// How many shapes and triangles.
    pub fn len(&self) -> usize {
        self.emitters.len()
    }

    /// Draws a point for `pick` and `position` in [0, 1) and shows it to `from`; none where it sends nothing there.
    pub fn draw(&self, from: Vec3Of<P>, pick: f32, position: [f32; 2]) -> Option<Drawn<P::Real>> {
        let pick = f64::from(pick);
        let index = self.cumulative.partition_point(|&c| c <= pick).min(self.emitters.len() - 1);
        let emitter = &self.emitters[index];
        let probability = self.cumulative[index] - if index == 0 { 0.0 } else { self.cumulative[index - 1] };
        let [u, v] = position.map(P::Real::from_f32);
        let (located, density) = match &emitter.form {
            Form::Plain(shape) => shape.sample_area::<P>(u, v)?,
            Form::Placed(placed) => placed.sample_area(u, v)?,
        };
        let surface = located.stored::<P>();
        let offset = surface.point.to_f64() - from.to_f64();
        let squared = offset.length_squared();
        let direction = offset / squared.sqrt();
        let cosine = -direction.dot(surface.normal.to_f64());
        let cosine = if emitter.two_sided { cosine.abs() } else { cosine };
        // Solid-angle measure: cos/d² over the density by area. Also false for NaN, where the points coincide.
        let weight = cosine / (squared * density.to_f64() * probability);
        (weight > 0.0 && weight.is_finite()).then(|| Drawn {
            surface,
            direction: Vector::from_f64(direction),
            irradiance: emitter.radiance * P::Real::from_f64(weight),
        })
    }
}
