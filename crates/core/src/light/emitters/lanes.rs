//! Flat emitters of which points are drawn over their solid angles, several at a time.

use raywright_bvh::{Loops, Real, SurfacePoint, Vector};

use super::list::Emitter;
use super::{EmitterQuery, PointDensity, Shown, outwards};
use crate::light::lanes::{Column, LANES, LightLanes, Vec3Column, put, vector};
use crate::light::polygon::{Polygon, PolygonLanes};

/// Emitters and the points that see them, in columns.
pub(super) struct EmitterLanes<R: Real> {
    polygons: PolygonLanes<LANES>,
    from: Vec3Column<R>,
    normal: Vec3Column<f64>,
    error: Column<f64>,
    outwards: Column<f64>,
    radiance: Vec3Column<R>,
    probability: Column<f64>,
}

impl<R: Real> EmitterLanes<R> {
    pub fn new() -> Self {
        let (none, zero) = ([[R::ZERO; LANES]; 3], [0.0; LANES]);
        Self {
            polygons: PolygonLanes::new(),
            from: none,
            normal: [zero; 3],
            error: zero,
            outwards: zero,
            radiance: none,
            probability: zero,
        }
    }

    /// Puts an emitter with a plane and the point that sees it in a lane.
    #[inline(always)]
    pub fn put(&mut self, lane: usize, polygon: &Polygon, emitter: &Emitter<R>, query: &EmitterQuery<R>) {
        self.polygons.put(lane, polygon, query.from.to_f64(), query.position.map(f64::from));
        put::<R>(&mut self.from, lane, query.from);
        if let Some(plane) = &emitter.plane {
            put::<f64>(&mut self.normal, lane, plane.normal);
            self.error[lane] = plane.error;
        }
        self.outwards[lane] = outwards(emitter.side);
        put::<R>(&mut self.radiance, lane, emitter.shown_radiance());
        self.probability[lane] = query.probability;
    }
}

/// Draws a point of each of them and shows it. What comes of it: whether it sends something; none: it is seen as too small.
pub(super) struct DrawEmitters<'a, R: Real> {
    pub emitters: &'a EmitterLanes<R>,
    pub out: &'a mut LightLanes<R>,
}

impl<R: Real> Loops for DrawEmitters<'_, R> {
    type Output = Column<Option<bool>>;
    #[inline(always)]
    fn run(self) -> Self::Output {
        let Self { emitters, out } = self;
        let drawn = emitters.polygons.draw();
        let mut some = [false; LANES];
        for lane in 0..LANES {
            let located = SurfacePoint::new(drawn.at(lane), vector::<f64>(&emitters.normal, lane), emitters.error[lane]);
            let (from, density) = (vector::<R>(&emitters.from, lane), PointDensity::Even(drawn.solid_angle[lane]));
            let shown = Shown::<R>::new(&located, emitters.outwards[lane], from, emitters.probability[lane], density);
            out.surface.put(lane, &shown.surface);
            put::<R>(&mut out.direction, lane, Vector::from_f64(shown.direction));
            put::<R>(&mut out.arriving, lane, vector::<R>(&emitters.radiance, lane) * R::from_f64(shown.weight));
            out.density[lane] = shown.density;
            some[lane] = shown.is_some() & drawn.is_some(lane);
        }
        core::array::from_fn(|lane| drawn.is_wide(lane).then_some(some[lane]))
    }
}
