//! Solid-angle sampling of several flat emitters in SIMD lanes.

use raywright_bvh::{Real, SimdTask, SurfacePoint, Vector, run_widest};

use super::emitter_point::{EmitterPoint, PointDensity, side_sign};
use super::list::Emitter;
use crate::light::lanes::{
    LANES, LaneColumn, LightSampleLanes, ReceivingPointLanes, SurfaceLanes, Vec3Column,
    get_lane_vector, set_lane_vector,
};
use crate::light::polygon::{Polygon, PolygonLanes};

/// Flat emitters, one in each SIMD lane, as a structure of arrays.
pub(in crate::light) struct EmitterLanes<R: Real> {
    /// Index of each emitter; `None` for an unused lane.
    indices: LaneColumn<Option<u32>>,
    polygons: PolygonLanes<LANES>,
    normal: Vec3Column<f64>,
    error: LaneColumn<f64>,
    outwards: LaneColumn<f64>,
    radiance: Vec3Column<R>,
}

impl<R: Real> EmitterLanes<R> {
    pub fn new() -> Self {
        let zero = [0.0; LANES];
        Self {
            indices: [None; LANES],
            polygons: PolygonLanes::new(),
            normal: [zero; 3],
            error: zero,
            outwards: zero,
            radiance: [[R::ZERO; LANES]; 3],
        }
    }

    /// Whether a lane holds the emitter `index`.
    #[inline(always)]
    pub fn has_polygon(&self, lane: usize, index: u32) -> bool {
        self.indices[lane] == Some(index)
    }

    /// Sets the emitter in a lane: its index, polygon and other properties.
    #[inline(always)]
    pub fn set_polygon(
        &mut self,
        lane: usize,
        index: u32,
        polygon: &Polygon,
        emitter: &Emitter<R>,
    ) {
        self.indices[lane] = Some(index);
        self.polygons.set_polygon(lane, polygon);
        if let Some(plane) = &emitter.plane {
            set_lane_vector::<f64>(&mut self.normal, lane, plane.normal);
            self.error[lane] = plane.error;
        }
        self.outwards[lane] = side_sign(emitter.side);
        set_lane_vector::<R>(&mut self.radiance, lane, emitter.assumed_radiance());
    }

    /// Samples a point of each emitter by solid angle, for the receiving point in the same lane.
    /// `probabilities` are those of choosing the emitters. Returns for each lane whether its sample
    /// contributes, or `None` if the emitter's solid angle is too small for this technique.
    #[inline]
    pub fn sample(
        &mut self,
        points: &ReceivingPointLanes<'_, R>,
        probabilities: &LaneColumn<f64>,
        out: &mut LightSampleLanes<R>,
    ) -> LaneColumn<Option<bool>> {
        for lane in 0..LANES {
            let (from, position) = points.get_lane(lane);
            self.polygons
                .set_point(lane, from.to_f64(), position.map(f64::from));
        }
        let drawn = run_widest(EmitterSampleTask {
            emitters: self,
            points,
            probabilities,
        });
        (out.surface, out.direction, out.arriving, out.density) = (
            drawn.surface,
            drawn.direction,
            drawn.arriving,
            drawn.density,
        );
        drawn.contributes
    }
}

struct EmitterSampleTask<'a, R: Real> {
    emitters: &'a EmitterLanes<R>,
    points: &'a ReceivingPointLanes<'a, R>,
    probabilities: &'a LaneColumn<f64>,
}

/// Light samples of emitters, in the layout of [`LightSampleLanes`].
struct EmitterSamples<R: Real> {
    surface: SurfaceLanes<R>,
    direction: Vec3Column<R>,
    arriving: Vec3Column<R>,
    density: LaneColumn<f64>,
    contributes: LaneColumn<Option<bool>>,
}

impl<R: Real> SimdTask for EmitterSampleTask<'_, R> {
    type Output = EmitterSamples<R>;
    #[inline(always)]
    fn run(self) -> Self::Output {
        let Self {
            emitters,
            points,
            probabilities,
        } = self;
        let drawn = emitters.polygons.sample();
        // Separate arrays, which the compiler knows not to alias the inputs.
        let (mut surface, mut direction, mut arriving) = (
            SurfaceLanes::new(),
            [[R::ZERO; LANES]; 3],
            [[R::ZERO; LANES]; 3],
        );
        let (mut density, mut weight) = ([0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            let surface_point = SurfacePoint::new(
                drawn.point_unchecked(lane),
                get_lane_vector::<f64>(&emitters.normal, lane),
                emitters.error[lane],
            );
            let (from, even) = (
                get_lane_vector::<R>(points.point, lane),
                PointDensity::SolidAngle(drawn.solid_angle[lane]),
            );
            let emitter_point = EmitterPoint::<R>::new(
                &surface_point,
                emitters.outwards[lane],
                from,
                probabilities[lane],
                even,
            );
            surface.set_lane(lane, &emitter_point.surface);
            set_lane_vector::<R>(
                &mut direction,
                lane,
                Vector::from_f64(emitter_point.direction),
            );
            set_lane_vector::<R>(
                &mut arriving,
                lane,
                get_lane_vector::<R>(&emitters.radiance, lane) * R::from_f64(emitter_point.weight),
            );
            density[lane] = emitter_point.density;
            weight[lane] = emitter_point.weight;
        }
        let is_some = |lane: usize| {
            (weight[lane] > 0.0) & (weight[lane] < f64::INFINITY) & drawn.has_point(lane)
        };
        let sends = core::array::from_fn(|lane| drawn.is_large_enough(lane).then(|| is_some(lane)));
        EmitterSamples {
            surface,
            direction,
            arriving,
            density,
            contributes: sends,
        }
    }
}
