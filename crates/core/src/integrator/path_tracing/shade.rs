//! What becomes of several vertices: what they send back of the lights that they ask, and the rays that leave them, step by
//! step, each step of all of them. Each has the bits that it would have alone.

use raywright_bvh::{Loops, Ray, Real, Vector};

use super::light::weight;
use super::respond::{Answer, Answers};
use super::roulette::{is_number, is_some, survive};
use super::vertices::{LitSides, MisStrategy, VertexLanes};
use crate::light::{Column, LANES, LightLanes, TargetKind, Vec3Column, put, vector};

/// What becomes of vertices.
#[derive(Clone, Copy)]
pub(super) struct ShadedLanes<R: Real> {
    /// Whether anything is sent back of a light where nothing is in between, whether that shines through the surface, and what.
    pub is_lit: Column<bool>,
    pub is_through: Column<bool>,
    pub sent: Vec3Column<R>,
    /// The ray to what it aims at where that is a surface or infinitely far, and its length; not above zero where nothing is in between.
    pub start: Vec3Column<R>,
    pub towards: Vec3Column<R>,
    pub length: Column<R>,
    /// Whether the path goes on, and how.
    pub goes_on: Column<bool>,
    /// Whether it ends because what it carries is no number.
    pub overflows: Column<bool>,
    pub origin: Vec3Column<R>,
    pub direction: Vec3Column<R>,
    pub throughput: Vec3Column<R>,
    pub density: Column<R>,
}

/// Shades vertices.
pub(super) struct Shade<'a, R: Real, A: Answer<R>> {
    pub vertices: &'a VertexLanes<R>,
    pub lights: &'a LightLanes<R>,
    /// What they answer with.
    pub answer: &'a A,
    /// As far as a shadow of a light without size that is infinitely far reaches.
    pub reach: R,
}

impl<R: Real, A: Answer<R>> Loops for Shade<'_, R, A> {
    type Output = ShadedLanes<R>;
    #[inline(always)]
    fn run(self) -> ShadedLanes<R> {
        let none = [[R::ZERO; LANES]; 3];
        let answers = self.answer.answers(self.vertices, self.lights);
        let mut out = ShadedLanes {
            is_lit: [false; LANES],
            is_through: [false; LANES],
            sent: none,
            start: none,
            towards: none,
            length: none[0],
            goes_on: [false; LANES],
            overflows: [false; LANES],
            origin: none,
            direction: answers.direction,
            throughput: none,
            density: answers.density,
        };
        self.light(&answers, &mut out);
        self.aim(&mut out);
        self.leave(&answers, &mut out);
        out
    }
}

impl<R: Real, A: Answer<R>> Shade<'_, R, A> {
    /// What is sent back of the lights where nothing is in between.
    #[inline(always)]
    fn light(&self, answers: &Answers<R>, out: &mut ShadedLanes<R>) {
        let (v, lights) = (self.vertices, self.lights);
        let mut weighed = [false; LANES];
        let mut dull = [false; LANES];
        let mut sizeless = [false; LANES];
        let mut seen = [false; LANES];
        for lane in 0..LANES {
            weighed[lane] = matches!(v.strategy[lane], MisStrategy::Weighed);
            dull[lane] = v.strategy[lane].is_dull();
            sizeless[lane] = matches!(v.strategy[lane], MisStrategy::Delta { .. });
            seen[lane] = lights.aim[lane] != TargetKind::Nothing;
        }
        for lane in 0..LANES {
            let (towards, zero) = (vector::<R>(&lights.direction, lane), R::ZERO);
            let facing = vector::<R>(&v.normal, lane).dot(towards);
            // Above the shading normal's horizon and the surface's own, or below both of what lets light through. Only what is given back answers
            // to lights that make no highlights.
            let below = vector::<R>(&v.geometric, lane).dot(towards) < zero;
            let above = (facing > zero) & !below;
            let through = (v.sides[lane] == LitSides::Both) & (facing < zero) & below & !dull[lane];
            let (value, diffuse) = (vector::<R>(&answers.value, lane), vector::<R>(&answers.diffuse, lane));
            let value = if dull[lane] { diffuse } else { value };
            let both = R::from_f64(weight(lights.density[lane], answers.light_density[lane].to_f64()));
            let share = if sizeless[lane] { v.gain[lane] } else { R::ONE };
            let share = if weighed[lane] { both } else { share };
            let sent = vector::<R>(&lights.arriving, lane) * value * (Real::abs(facing) * share);
            out.is_lit[lane] = seen[lane] & (above | through) & is_some::<R>(sent);
            out.is_through[lane] = through;
            put::<R>(&mut out.sent, lane, sent);
        }
    }

    /// Rays to the lights.
    #[inline(always)]
    fn aim(&self, out: &mut ShadedLanes<R>) {
        let (v, lights) = (self.vertices, self.lights);
        if (0..LANES).fold(false, |some, lane| some | (lights.aim[lane] == TargetKind::Surface)) {
            for lane in 0..LANES {
                let (ray, length) = v.surface.lane(lane).way_to_surface(&lights.surface.lane(lane));
                put::<R>(&mut out.start, lane, ray.origin);
                put::<R>(&mut out.towards, lane, ray.direction);
                out.length[lane] = length;
            }
        }
        if (0..LANES).fold(false, |some, lane| some | (lights.aim[lane] == TargetKind::Infinity)) {
            for lane in 0..LANES {
                let far = lights.aim[lane] == TargetKind::Infinity;
                let direction = vector::<R>(&lights.direction, lane);
                let start = v.surface.lane(lane).spawn(direction);
                let length = if lights.density[lane] == 0.0 { self.reach } else { R::INFINITY };
                let [before, towards] = [&out.start, &out.towards].map(|column| vector::<R>(column, lane));
                put::<R>(&mut out.start, lane, if far { start } else { before });
                put::<R>(&mut out.towards, lane, if far { direction } else { towards });
                out.length[lane] = if far { length } else { out.length[lane] };
            }
        }
    }

    /// Rays that go on in the directions that were drawn.
    #[inline(always)]
    fn leave(&self, answers: &Answers<R>, out: &mut ShadedLanes<R>) {
        let v = self.vertices;
        for lane in 0..LANES {
            let direction = vector::<R>(&answers.direction, lane);
            let throughput = vector::<R>(&v.throughput, lane) * vector::<R>(&answers.weight, lane);
            out.overflows[lane] = answers.some[lane] & !is_number::<R>(throughput);
            let (throughput, goes_on) = survive(throughput, v.most_survival[lane], v.numbers[3][lane]);
            out.goes_on[lane] = answers.some[lane] & goes_on;
            put::<R>(&mut out.throughput, lane, throughput);
            put::<R>(&mut out.origin, lane, v.surface.lane(lane).spawn(direction));
        }
    }
}

impl<R: Real> ShadedLanes<R> {
    /// The ray of a path that goes on.
    #[inline(always)]
    pub fn ray(&self, lane: usize) -> Ray<R> {
        Ray::new(vector::<R>(&self.origin, lane), vector::<R>(&self.direction, lane))
    }
}

#[cfg(test)]
mod tests;
