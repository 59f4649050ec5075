//! Light samples for several receiving points, as structures of arrays.

use raywright_bvh::{Real, Surface, TriangleSurfaceLanes, Vector};

use super::{LightDensity, LightId, LightSample, ShadowRayTarget};

/// Number of receiving points whose lights are sampled together.
pub(crate) const LANES: usize = 8;

/// One value for each SIMD lane.
pub(crate) type LaneColumn<T> = [T; LANES];
/// One vector for each SIMD lane, stored by component.
pub(crate) type Vec3Column<R> = [LaneColumn<R>; 3];

/// Returns the vector in a SIMD lane.
#[inline(always)]
pub(crate) fn get_lane_vector<R: Real>(column: &Vec3Column<R>, lane: usize) -> R::Vec3 {
    Vector::new(column[0][lane], column[1][lane], column[2][lane])
}

/// Sets the vector in a SIMD lane.
#[inline(always)]
pub(crate) fn set_lane_vector<R: Real>(column: &mut Vec3Column<R>, lane: usize, v: R::Vec3) {
    (column[0][lane], column[1][lane], column[2][lane]) = (v.x(), v.y(), v.z());
}

/// Points for each of which a light is chosen and sampled, as a structure of arrays.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ReceivingPointLanes<'a, R: Real> {
    pub point: &'a Vec3Column<R>,
    /// Unit normals of the sides that receive light.
    pub normal: &'a Vec3Column<R>,
    /// Whether both sides receive light.
    pub is_two_sided: LaneColumn<bool>,
    /// Uniform numbers in [0, 1): coarse and fine number for the choice of a light, see
    /// [`LightSampler::sample`](super::LightSampler::sample), and two numbers for a point on the
    /// light.
    pub numbers: &'a [LaneColumn<f32>; 4],
}

impl<R: Real> ReceivingPointLanes<'_, R> {
    /// Returns the normal in a lane; zero if both sides receive light.
    #[inline(always)]
    pub fn normal(&self, lane: usize) -> R::Vec3 {
        if self.is_two_sided[lane] {
            Vector::ZERO
        } else {
            get_lane_vector::<R>(self.normal, lane)
        }
    }

    /// Returns the point in a lane, and the two numbers for a point on its light.
    #[inline(always)]
    pub fn get_lane(&self, lane: usize) -> (R::Vec3, [f32; 2]) {
        (
            get_lane_vector::<R>(self.point, lane),
            [self.numbers[2][lane], self.numbers[3][lane]],
        )
    }
}

/// The lights chosen for `N` points, with the probabilities of the choices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LightChoices<const N: usize> {
    /// The light of each point; `None` without a point, or if no light contributes there.
    pub lights: [Option<LightId>; N],
    /// Probability of each choice; unspecified without a light.
    pub probabilities: [f64; N],
}

impl<const N: usize> LightChoices<N> {
    pub const NONE: Self = Self {
        lights: [None; N],
        probabilities: [1.0; N],
    };
}

/// Surface geometry of several points, as a structure of arrays.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfaceLanes<R: Real> {
    pub point: Vec3Column<R>,
    pub above: Vec3Column<R>,
    pub below: Vec3Column<R>,
    pub normal: Vec3Column<R>,
    pub error: LaneColumn<R>,
}

impl<R: Real> SurfaceLanes<R> {
    pub fn new() -> Self {
        let none = [[R::ZERO; LANES]; 3];
        Self {
            point: none,
            above: none,
            below: none,
            normal: none,
            error: none[0],
        }
    }

    /// Sets all lanes to the surfaces of triangles.
    #[inline(always)]
    pub fn set_triangles(&mut self, surfaces: &TriangleSurfaceLanes<R>) {
        (self.point, self.above, self.below) = (surfaces.point, surfaces.point, surfaces.point);
        (self.normal, self.error) = (surfaces.normal, surfaces.error);
    }

    #[inline(always)]
    pub fn set_lane(&mut self, lane: usize, surface: &Surface<R>) {
        set_lane_vector::<R>(&mut self.point, lane, surface.point);
        set_lane_vector::<R>(&mut self.above, lane, surface.above);
        set_lane_vector::<R>(&mut self.below, lane, surface.below);
        set_lane_vector::<R>(&mut self.normal, lane, surface.normal);
        self.error[lane] = surface.error;
    }

    #[inline(always)]
    pub fn get_lane(&self, lane: usize) -> Surface<R> {
        Surface {
            point: get_lane_vector::<R>(&self.point, lane),
            above: get_lane_vector::<R>(&self.above, lane),
            below: get_lane_vector::<R>(&self.below, lane),
            normal: get_lane_vector::<R>(&self.normal, lane),
            error: self.error[lane],
        }
    }
}

/// Kind of a shadow ray's target. The kind also selects the field of [`LightSampleLanes`] that
/// holds the target.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ShadowRayTargetKind {
    /// No target, because no light was sampled.
    Nothing,
    /// A surface point, held in `surface`.
    Surface,
    /// Infinity, which needs no field.
    Infinity,
    /// Any other target, held in `target`.
    Stored,
}

/// A [`LightSample`] for each SIMD lane, as a structure of arrays.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightSampleLanes<R: Real> {
    pub direction: Vec3Column<R>,
    pub arriving: Vec3Column<R>,
    /// Density by solid angle; zero for a delta light.
    pub density: LaneColumn<f64>,
    pub target_kinds: LaneColumn<ShadowRayTargetKind>,
    pub surface: SurfaceLanes<R>,
    target: LaneColumn<ShadowRayTarget<R>>,
}

impl<R: Real> LightSampleLanes<R> {
    pub fn new() -> Self {
        let none = [[R::ZERO; LANES]; 3];
        Self {
            direction: none,
            arriving: none,
            density: [0.0; LANES],
            target_kinds: [ShadowRayTargetKind::Nothing; LANES],
            surface: SurfaceLanes::new(),
            target: [ShadowRayTarget::Infinity; LANES],
        }
    }

    /// Sets the light sample in a lane.
    #[inline(always)]
    pub fn set_lane(&mut self, lane: usize, sample: &LightSample<R>) {
        set_lane_vector::<R>(&mut self.direction, lane, sample.direction);
        set_lane_vector::<R>(&mut self.arriving, lane, sample.arriving);
        self.density[lane] = match sample.density {
            LightDensity::Delta => 0.0,
            LightDensity::SolidAngle(density) => density,
        };
        self.target_kinds[lane] = match &sample.target {
            ShadowRayTarget::Surface(surface) => {
                self.surface.set_lane(lane, surface);
                ShadowRayTargetKind::Surface
            }
            ShadowRayTarget::Infinity => ShadowRayTargetKind::Infinity,
            target => {
                self.target[lane] = *target;
                ShadowRayTargetKind::Stored
            }
        };
    }

    /// Whether the sample in a lane is that of a delta light.
    #[inline(always)]
    pub fn is_delta(&self, lane: usize) -> bool {
        self.density[lane] == 0.0
    }

    /// Returns the density with which the light in a lane was sampled.
    #[inline(always)]
    pub fn lane_density(&self, lane: usize) -> LightDensity {
        if self.is_delta(lane) {
            LightDensity::Delta
        } else {
            LightDensity::SolidAngle(self.density[lane])
        }
    }

    /// Returns the light sample in a lane; the lane must have a light.
    #[inline(always)]
    pub fn get_lane(&self, lane: usize) -> LightSample<R> {
        LightSample {
            direction: get_lane_vector::<R>(&self.direction, lane),
            arriving: get_lane_vector::<R>(&self.arriving, lane),
            density: self.lane_density(lane),
            target: match self.target_kinds[lane] {
                ShadowRayTargetKind::Surface => {
                    ShadowRayTarget::Surface(self.surface.get_lane(lane))
                }
                ShadowRayTargetKind::Infinity | ShadowRayTargetKind::Nothing => {
                    ShadowRayTarget::Infinity
                }
                ShadowRayTargetKind::Stored => self.target[lane],
            },
        }
    }
}
