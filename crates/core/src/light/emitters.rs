//! Surfaces that light others: emissive objects whose points are drawn, and found again where a ray meets them.

mod cells;
mod lanes;
mod list;
mod middle;

use core::f64::consts::PI;
use core::ops::Range;

use glam::DVec3;
use raywright_bvh::shapes::{AnyShape, Sphere};
use raywright_bvh::{Real, Shape, Side, Surface, SurfacePoint, Vector};

use super::cdf::{pick, push_shares, share};
use super::lanes::{Aim, LANES, LightLanes};
use super::polygon::PolygonSample;
use super::{Bounds, ChosenLight, Cone, Density, LightId, LightSample, Target};

use cells::unfolded;
pub(super) use lanes::EmitterLanes;
use list::{Emitter, Form};
pub use list::{EmitterList, Glow};

/// How points of a surface are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Strategy {
    /// By area: any surface, from anywhere.
    #[default]
    Area,
    /// Over the solid angle under which it is seen, where that is known (balls from outside, triangles, quads), by area elsewhere: without the
    /// noise that unequal distances and slants bring.
    SolidAngle,
}

/// A point of an emitter as another point sees it.
struct Facing {
    /// Unit direction to it.
    direction: DVec3,
    squared: f64,
    /// Between that direction and the normal of the side that shines; negative behind.
    cosine: f64,
}

impl Facing {
    #[inline(always)]
    fn new<R: Real>(outwards: f64, from: DVec3, surface: &Surface<R>) -> Self {
        let offset = surface.point.to_f64() - from;
        let squared = offset.length_squared();
        let direction = offset / squared.sqrt();
        let cosine = -direction.dot(surface.normal.to_f64());
        Self { direction, squared, cosine: if outwards == 0.0 { cosine.abs() } else { cosine * outwards } }
    }
}

/// Which way light leaves a surface, by the sign: out, in, or both.
fn outwards(side: Side) -> f64 {
    match side {
        Side::Outside | Side::Culled => 1.0,
        Side::Inside => -1.0,
        Side::Both => 0.0,
    }
}

/// A point of an emitter as it is shown to another point.
struct Shown<R: Real> {
    surface: Surface<R>,
    direction: DVec3,
    density: f64,
    /// Factor of the radiance; zero, or no number, where nothing is sent there.
    weight: f64,
}

impl<R: Real> Shown<R> {
    #[inline(always)]
    fn new(located: &SurfacePoint, outwards: f64, from: R::Vec3, probability: f64, drawn: PointDensity) -> Self {
        let surface = located.stored::<R>();
        let Facing { direction, squared, cosine } = Facing::new(outwards, from.to_f64(), &surface);
        let (density, weight) = match drawn {
            PointDensity::Even(solid_angle) => {
                let density = probability / solid_angle;
                (density, if cosine > 0.0 { 1.0 / density } else { 0.0 })
            }
            PointDensity::Area(by_area) => {
                // Solid-angle measure: cos/d² over the density by area.
                let over = squared * by_area * probability;
                (over / cosine, cosine / over)
            }
        };
        Self { surface, direction, density, weight }
    }

    /// Also false for NaN, where the points coincide.
    #[inline(always)]
    fn is_some(&self) -> bool {
        (self.weight > 0.0) & (self.weight < f64::INFINITY)
    }
}

/// An emitter that was chosen with a probability, the point that is lit, and two numbers in [0, 1) by which a point of it is drawn.
#[derive(Clone, Copy, Debug)]
struct EmitterQuery<R: Real> {
    pub emitter: u32,
    pub from: R::Vec3,
    pub position: [f32; 2],
    pub probability: f64,
}

/// How densely a point of an emitter is drawn.
#[derive(Clone, Copy, Debug)]
enum PointDensity {
    /// Evenly over so many steradians.
    Even(f64),
    /// By area.
    Area(f64),
}

/// A ball and the cone under which it is seen; none from within, and of what is no ball.
fn ball<R: Real>(emitter: &Emitter<R>, from: DVec3) -> Option<(Sphere<R>, Cone)> {
    match &emitter.form {
        // A ball that only shines inwards is seen through its near side.
        Form::Plain(AnyShape::Sphere(ball)) if emitter.side != Side::Inside => {
            Some((*ball, Cone::new(ball.centre.to_f64(), ball.radius.to_f64(), from)?))
        }
        _ => None,
    }
}

/// Where light leaves an emitter, and along what ray it is seen.
#[derive(Clone, Copy, Debug)]
pub struct Exit<R: Real> {
    /// The point.
    pub surface: Surface<R>,
    /// Its texture coordinates, for emission that varies; an even one reads none.
    pub uv: [R; 2],
    /// Unit direction of the ray that met it.
    pub direction: R::Vec3,
}

/// All emitters of a scene, drawn in proportion to their power.
#[derive(Clone, Debug)]
pub struct Emitters<R: Real> {
    /// One after the other by object and primitive, so that a hit finds its own; those without power too.
    list: EmitterList<R>,
    /// Running sum of the probabilities, 1 from the last emitter that has power; empty where none has.
    cumulative: Vec<f64>,
    /// Those that have power.
    lit: usize,
    /// How points are drawn.
    pub strategy: Strategy,
}

impl<R: Real> Emitters<R> {
    /// From what preparation found; empty when nothing of it gives off light.
    pub fn new(list: EmitterList<R>) -> Self {
        let powers: Vec<f64> = list.emitters.iter().map(Emitter::power).collect();
        let lit = powers.iter().filter(|&&power| power > 0.0).count();
        if lit == 0 {
            return Self { list: EmitterList::default(), cumulative: Vec::new(), lit, strategy: Strategy::default() };
        }
        let mut cumulative = Vec::with_capacity(powers.len());
        push_shares(&mut cumulative, &powers);
        Self { list, cumulative, lit, strategy: Strategy::default() }
    }

    /// How many shapes and triangles, those without power included.
    pub fn len(&self) -> usize {
        self.list.emitters.len()
    }

    /// How many shapes and triangles have power.
    pub fn lit(&self) -> usize {
        self.lit
    }

    /// Whether nothing gives off light.
    pub fn is_empty(&self) -> bool {
        self.cumulative.is_empty()
    }

    /// The emitter that is a primitive of an object: a triangle of its mesh, or 0 for a shape. None where the object does not
    /// light others.
    pub fn of(&self, object: u32, primitive: u32) -> Option<u32> {
        let start = *self.list.first.get(object as usize)?;
        let end = self.list.first.get(object as usize + 1).map_or(self.len() as u32, |&end| end);
        start.checked_add(primitive).filter(|&index| index < end)
    }

    /// The emitters of each object that has any.
    pub fn objects(&self) -> impl Iterator<Item = (usize, Range<u32>)> {
        let starts = self.list.first.iter().copied();
        let ends = starts.clone().skip(1).chain([self.len() as u32]);
        starts.zip(ends).map(|(start, end)| start..end).enumerate().filter(|(_, emitters)| !emitters.is_empty())
    }

    /// The emitter for a pair of numbers in [0, 1), and the probability of drawing it; none where there is none. Both numbers,
    /// because one of f32 has steps of 2⁻²³: of a million emitters the faint ones would be drawn always or never.
    pub fn choose(&self, [coarse, fine]: [f32; 2]) -> Option<(u32, f64)> {
        const STEP: f64 = 1.0 / (1 << 23) as f64;
        if self.is_empty() {
            return None;
        }
        let (index, probability, _) = pick(&self.cumulative, f64::from(coarse) + f64::from(fine) * STEP);
        Some((index as u32, probability))
    }

    /// The probability with which [`Emitters::choose`] draws an emitter.
    pub fn probability(&self, index: u32) -> f64 {
        share(&self.cumulative, index as usize)
    }

    /// Bytes of the tables.
    pub(crate) fn bytes(&self) -> u64 {
        let list = &self.list;
        EmitterList::<R>::bytes_of(self.len() as u64, list.placed.len() as u64, list.first.len() as u64, [0; 2])
            + list.cells.bytes()
    }

    /// Emitters that need a map of their own.
    #[cfg(test)]
    pub(crate) fn under_maps(&self) -> usize {
        self.list.placed.len()
    }

    /// Draws a point of an emitter that was chosen with a probability and shows it to `from`; none where it sends nothing there.
    pub fn sample(&self, index: u32, from: R::Vec3, position: [f32; 2], probability: f64) -> Option<LightSample<R>> {
        let query = EmitterQuery { emitter: index, from, position, probability };
        let (emitter, from, position) = (&self.list.emitters[index as usize], from.to_f64(), position.map(f64::from));
        if !self.is_even(emitter) {
            return self.by_area(&query);
        }
        if let Some(polygon) = emitter.polygon() {
            return self.on_polygon(&query, polygon.draw(from, position));
        }
        match ball(emitter, from) {
            Some((ball, cone)) => self.shown(&query, &ball.at(cone.normal(position)), PointDensity::Even(cone.solid_angle())),
            None => self.by_area(&query),
        }
    }

    /// [`Self::sample`] of those emitters that are among the lights that points chose: polygons together, and before what else is put into
    /// lanes. `waiting`: a place for them.
    pub(super) fn sample_lanes(&self, chosen: &[Option<ChosenLight<R>>], waiting: &mut EmitterLanes<R>, out: &mut LightLanes<R>) {
        let (mut flat, mut any) = ([false; LANES], false);
        for (lane, chosen) in chosen.iter().enumerate().take(LANES) {
            if let Some(ChosenLight { light: LightId::Emitter(emitter), probability, from, position }) = chosen {
                let emitter = &self.list.emitters[*emitter as usize];
                if self.is_even(emitter)
                    && let Some(polygon) = emitter.polygon()
                {
                    waiting.put(lane, (&polygon, emitter), *from, *position, *probability);
                    (flat[lane], any) = (true, true);
                }
            }
        }
        let sends = if any { waiting.draw(out) } else { [None; LANES] };
        for (lane, chosen) in chosen.iter().enumerate().take(LANES) {
            let &Some(ChosenLight { light: LightId::Emitter(emitter), probability, from, position }) = chosen else { continue };
            let sample = match sends[lane].filter(|_| flat[lane]) {
                Some(true) => {
                    out.aim[lane] = Aim::Surface;
                    continue;
                }
                Some(false) => None,
                // Small ones are drawn by area.
                None if flat[lane] => self.by_area(&EmitterQuery { emitter, from, position, probability }),
                None => self.sample(emitter, from, position, probability),
            };
            sample.iter().for_each(|sample| out.put(lane, sample));
        }
    }

    /// Shows a point of a polygon that was drawn over its solid angle; drawn by area where there is none.
    #[inline]
    fn on_polygon(&self, query: &EmitterQuery<R>, sample: Option<PolygonSample>) -> Option<LightSample<R>> {
        let Some(PolygonSample { solid_angle, point }) = sample else { return self.by_area(query) };
        let plane = self.list.emitters[query.emitter as usize].plane?;
        self.shown(query, &SurfacePoint::new(point?, plane.normal, plane.error), PointDensity::Even(solid_angle))
    }

    /// Draws a point by area, or where the emitter is bright.
    fn by_area(&self, query: &EmitterQuery<R>) -> Option<LightSample<R>> {
        let emitter = &self.list.emitters[query.emitter as usize];
        let position = query.position.map(f64::from);
        let (place, denser) = match emitter.cells {
            Some(cells) => self.list.cells.place(cells, position),
            None => (position, 1.0),
        };
        let [u, v] = place.map(R::from_f64);
        let (located, by_area) = match &emitter.form {
            Form::Plain(shape) => shape.sample_area(u, v)?,
            Form::Placed(placed) => self.list.placed[*placed as usize].sample_area(u, v)?,
        };
        self.shown(query, &located, PointDensity::Area(by_area.to_f64() * denser))
    }

    /// What a point receives of an emitter from where it was drawn.
    #[inline(always)]
    fn shown(&self, query: &EmitterQuery<R>, located: &SurfacePoint, drawn: PointDensity) -> Option<LightSample<R>> {
        let &EmitterQuery { emitter, from, probability, .. } = query;
        let emitter = &self.list.emitters[emitter as usize];
        let shown = Shown::new(located, outwards(emitter.side), from, probability, drawn);
        shown.is_some().then(|| LightSample {
            direction: Vector::from_f64(shown.direction),
            arriving: emitter.shown_radiance() * R::from_f64(shown.weight),
            density: Density::SolidAngle(shown.density),
            target: Target::Surface(shown.surface),
        })
    }

    /// Whether what an emitter gives off is not the same everywhere: [`Emitters::sample`] then says what arrives of a radiance of one.
    pub fn varies(&self, index: u32) -> bool {
        self.list.emitters[index as usize].varies
    }

    /// The density over solid angle with which [`Emitters::sample`] draws a point of an emitter that a ray from `from` met.
    pub fn density(&self, index: u32, from: R::Vec3, surface: &Surface<R>, probability: f64) -> f64 {
        let (emitter, from) = (&self.list.emitters[index as usize], from.to_f64());
        let facing = Facing::new(outwards(emitter.side), from, surface);
        // Also false for NaN, where the points coincide.
        let seen = facing.cosine > 0.0;
        if !seen {
            return 0.0;
        }
        if let Some(solid_angle) = self.solid_angle(emitter, from) {
            return probability / solid_angle;
        }
        let point = SurfacePoint::new(surface.point.to_f64(), surface.normal.to_f64(), surface.error.to_f64());
        let by_area = match &emitter.form {
            Form::Plain(shape) => shape.density(&point),
            Form::Placed(placed) => self.list.placed[*placed as usize].density_at(&point),
        };
        let denser = match (&emitter.form, emitter.cells) {
            (Form::Plain(AnyShape::Triangle(triangle)), Some(cells)) => {
                self.list.cells.density(cells, unfolded(triangle.vertices.map(Vector::to_f64), surface.point.to_f64()))
            }
            _ => 1.0,
        };
        by_area.map_or(0.0, |by_area| facing.squared * (by_area.to_f64() * denser) * probability / facing.cosine)
    }

    /// Whether directions are drawn evenly over an emitter's solid angle, where that is known.
    #[inline(always)]
    fn is_even(&self, emitter: &Emitter<R>) -> bool {
        // Of what a ray may pass, points on the far side are drawn too; what is bright in parts is drawn there.
        self.strategy == Strategy::SolidAngle && !emitter.passable && emitter.cells.is_none()
    }

    /// The steradians over which directions to an emitter are drawn evenly; none where they are not.
    #[inline]
    fn solid_angle(&self, emitter: &Emitter<R>, from: DVec3) -> Option<f64> {
        if !self.is_even(emitter) {
            return None;
        }
        match emitter.polygon() {
            Some(polygon) => polygon.solid_angle(from),
            None => ball(emitter, from).map(|(_, cone)| cone.solid_angle()),
        }
    }

    /// Radiance that leaves an emitter where a ray met it; zero on a side that gives off none.
    pub fn radiance(&self, index: u32, exit: &Exit<R>) -> R::Vec3 {
        let emitter = &self.list.emitters[index as usize];
        let from_outside = exit.direction.dot(exit.surface.normal) < R::ZERO;
        if emitter.side.accepts(from_outside) { emitter.radiance } else { Vector::ZERO }
    }

    /// Flux of the three channels of an emitter, summed.
    pub fn power(&self, index: u32) -> f64 {
        PI * self.list.emitters[index as usize].power()
    }

    /// Where an emitter is and which way it shines; none for one without end, which lights nothing.
    pub fn bounds(&self, index: u32) -> Option<Bounds> {
        let emitter = &self.list.emitters[index as usize];
        let half = R::from_f64(0.5);
        let (space, shape, drawn) = match &emitter.form {
            Form::Plain(shape) => (shape.bounds()?, shape, shape.sample_area(half, half)),
            Form::Placed(i) => {
                let placed = &self.list.placed[*i as usize];
                (placed.bounds()?, placed.shape(), placed.sample_area(half, half))
            }
        };
        let flat = matches!(shape, AnyShape::Disk(_) | AnyShape::Quad(_) | AnyShape::Triangle(_));
        let normal = drawn.map(|(anywhere, _)| anywhere.normal.to_f64()).filter(|n| flat && n.is_finite());
        Some(match (normal, emitter.side) {
            (Some(normal), Side::Outside) => Bounds::flat(space, normal),
            (Some(normal), Side::Inside) => Bounds::flat(space, -normal),
            _ => Bounds::round(space),
        })
    }
}

#[cfg(test)]
mod tests;
