//! Lights as several points see them, in columns: what is a number of one point stands beside that
//! of the next.

use raywright_bvh::{Real, Surface, Vector};

use super::{Density, LightSample, Target};

/// Points that are lit together.
pub(crate) const LANES: usize = 8;

/// A number of each point.
pub(crate) type Column<T> = [T; LANES];
/// A vector of each point.
pub(crate) type Vec3Column<R> = [Column<R>; 3];

/// A vector of one point.
#[inline(always)]
pub(crate) fn vector<R: Real>(column: &Vec3Column<R>, lane: usize) -> R::Vec3 {
    Vector::new(column[0][lane], column[1][lane], column[2][lane])
}

/// Puts a vector of one point in its place.
#[inline(always)]
pub(crate) fn put<R: Real>(column: &mut Vec3Column<R>, lane: usize, v: R::Vec3) {
    (column[0][lane], column[1][lane], column[2][lane]) = (v.x(), v.y(), v.z());
}

/// Surfaces.
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
    pub fn put(&mut self, lane: usize, surface: &Surface<R>) {
        put::<R>(&mut self.point, lane, surface.point);
        put::<R>(&mut self.above, lane, surface.above);
        put::<R>(&mut self.below, lane, surface.below);
        put::<R>(&mut self.normal, lane, surface.normal);
        self.error[lane] = surface.error;
    }

    #[inline(always)]
    pub fn lane(&self, lane: usize) -> Surface<R> {
        Surface {
            point: vector::<R>(&self.point, lane),
            above: vector::<R>(&self.above, lane),
            below: vector::<R>(&self.below, lane),
            normal: vector::<R>(&self.normal, lane),
            error: self.error[lane],
        }
    }
}

/// What a shadow ray aims at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TargetKind {
    /// There is no light.
    Nothing,
    /// The surface in its column.
    Surface,
    /// What is infinitely far.
    Infinity,
    /// What stands in the column of targets.
    Target,
}

/// What [`LightSample`] says, of each point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightLanes<R: Real> {
    pub direction: Vec3Column<R>,
    pub arriving: Vec3Column<R>,
    /// Zero of a light without size.
    pub density: Column<f64>,
    pub aim: Column<TargetKind>,
    pub surface: SurfaceLanes<R>,
    target: Column<Target<R>>,
}

impl<R: Real> LightLanes<R> {
    pub fn new() -> Self {
        let none = [[R::ZERO; LANES]; 3];
        Self {
            direction: none,
            arriving: none,
            density: [0.0; LANES],
            aim: [TargetKind::Nothing; LANES],
            surface: SurfaceLanes::new(),
            target: [Target::Infinity; LANES],
        }
    }

    /// Says what one point sees.
    #[inline(always)]
    pub fn put(&mut self, lane: usize, sample: &LightSample<R>) {
        put::<R>(&mut self.direction, lane, sample.direction);
        put::<R>(&mut self.arriving, lane, sample.arriving);
        self.density[lane] = match sample.density {
            Density::Delta => 0.0,
            Density::SolidAngle(density) => density,
        };
        self.aim[lane] = match &sample.target {
            Target::Surface(surface) => {
                self.surface.put(lane, surface);
                TargetKind::Surface
            }
            Target::Infinity => TargetKind::Infinity,
            target => {
                self.target[lane] = *target;
                TargetKind::Target
            }
        };
    }

    /// Whether one point sees a light without size.
    #[inline(always)]
    pub fn is_sizeless(&self, lane: usize) -> bool {
        self.density[lane] == 0.0
    }

    /// How densely the light of one point was drawn.
    #[inline(always)]
    pub fn density_of(&self, lane: usize) -> Density {
        if self.is_sizeless(lane) {
            Density::Delta
        } else {
            Density::SolidAngle(self.density[lane])
        }
    }

    /// What one point sees, where it sees a light.
    #[inline(always)]
    pub fn lane(&self, lane: usize) -> LightSample<R> {
        LightSample {
            direction: vector::<R>(&self.direction, lane),
            arriving: vector::<R>(&self.arriving, lane),
            density: self.density_of(lane),
            target: match self.aim[lane] {
                TargetKind::Surface => Target::Surface(self.surface.lane(lane)),
                TargetKind::Infinity | TargetKind::Nothing => Target::Infinity,
                TargetKind::Target => self.target[lane],
            },
        }
    }
}
