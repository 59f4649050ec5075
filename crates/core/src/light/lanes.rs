//! Light samples for several receiving points, in columns (structure of arrays).

use raywright_bvh::{Real, Surface, Vector};

use super::{Density, LightSample, LightTarget};

/// Number of points whose lights are sampled together.
pub(crate) const LANES: usize = 8;

/// A scalar for each lane.
pub(crate) type Column<T> = [T; LANES];
/// A vector for each lane, by component.
pub(crate) type Vec3Column<R> = [Column<R>; 3];

/// Returns the vector in a lane.
#[inline(always)]
pub(crate) fn lane_vector<R: Real>(column: &Vec3Column<R>, lane: usize) -> R::Vec3 {
    Vector::new(column[0][lane], column[1][lane], column[2][lane])
}

/// Sets the vector in a lane.
#[inline(always)]
pub(crate) fn set_lane<R: Real>(column: &mut Vec3Column<R>, lane: usize, v: R::Vec3) {
    (column[0][lane], column[1][lane], column[2][lane]) = (v.x(), v.y(), v.z());
}

/// Surface geometry of several points, in columns.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfaceLanes<R: Real> {
    point: Vec3Column<R>,
    above: Vec3Column<R>,
    below: Vec3Column<R>,
    normal: Vec3Column<R>,
    error: Column<R>,
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

    #[inline(always)]
    pub fn set_lane(&mut self, lane: usize, surface: &Surface<R>) {
        set_lane::<R>(&mut self.point, lane, surface.point);
        set_lane::<R>(&mut self.above, lane, surface.above);
        set_lane::<R>(&mut self.below, lane, surface.below);
        set_lane::<R>(&mut self.normal, lane, surface.normal);
        self.error[lane] = surface.error;
    }

    #[inline(always)]
    pub fn lane(&self, lane: usize) -> Surface<R> {
        Surface {
            point: lane_vector::<R>(&self.point, lane),
            above: lane_vector::<R>(&self.above, lane),
            below: lane_vector::<R>(&self.below, lane),
            normal: lane_vector::<R>(&self.normal, lane),
            error: self.error[lane],
        }
    }
}

/// Kind of a shadow ray's target, by the column that holds the target.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LightTargetKind {
    /// No light.
    Nothing,
    /// The surface point in the column of surfaces.
    Surface,
    /// Infinity.
    Infinity,
    /// The target in the column of other targets.
    Target,
}

/// A [`LightSample`] for each lane, in columns.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightLanes<R: Real> {
    pub direction: Vec3Column<R>,
    pub arriving: Vec3Column<R>,
    /// Density by solid angle; zero for a delta light.
    pub density: Column<f64>,
    pub target_kinds: Column<LightTargetKind>,
    pub surface: SurfaceLanes<R>,
    target: Column<LightTarget<R>>,
}

impl<R: Real> LightLanes<R> {
    pub fn new() -> Self {
        let none = [[R::ZERO; LANES]; 3];
        Self {
            direction: none,
            arriving: none,
            density: [0.0; LANES],
            target_kinds: [LightTargetKind::Nothing; LANES],
            surface: SurfaceLanes::new(),
            target: [LightTarget::Infinity; LANES],
        }
    }

    /// Sets the light sample in a lane.
    #[inline(always)]
    pub fn set_lane(&mut self, lane: usize, sample: &LightSample<R>) {
        set_lane::<R>(&mut self.direction, lane, sample.direction);
        set_lane::<R>(&mut self.arriving, lane, sample.arriving);
        self.density[lane] = match sample.density {
            Density::Delta => 0.0,
            Density::SolidAngle(density) => density,
        };
        self.target_kinds[lane] = match &sample.target {
            LightTarget::Surface(surface) => {
                self.surface.set_lane(lane, surface);
                LightTargetKind::Surface
            }
            LightTarget::Infinity => LightTargetKind::Infinity,
            target => {
                self.target[lane] = *target;
                LightTargetKind::Target
            }
        };
    }

    /// Whether the sample in a lane is that of a delta light.
    #[inline(always)]
    pub fn is_sizeless(&self, lane: usize) -> bool {
        self.density[lane] == 0.0
    }

    /// Returns the sampling density of the light in a lane.
    #[inline(always)]
    pub fn density_of(&self, lane: usize) -> Density {
        if self.is_sizeless(lane) {
            Density::Delta
        } else {
            Density::SolidAngle(self.density[lane])
        }
    }

    /// Returns the light sample in a lane that has a light.
    #[inline(always)]
    pub fn lane(&self, lane: usize) -> LightSample<R> {
        LightSample {
            direction: lane_vector::<R>(&self.direction, lane),
            arriving: lane_vector::<R>(&self.arriving, lane),
            density: self.density_of(lane),
            target: match self.target_kinds[lane] {
                LightTargetKind::Surface => LightTarget::Surface(self.surface.lane(lane)),
                LightTargetKind::Infinity | LightTargetKind::Nothing => LightTarget::Infinity,
                LightTargetKind::Target => self.target[lane],
            },
        }
    }
}
