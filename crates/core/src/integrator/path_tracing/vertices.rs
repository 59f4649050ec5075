//! Vertices in columns: what is a number of one vertex stands beside that of the next, as lanes
//! take them.

use raywright_bvh::{Hit, Real};

use super::PathState;
use crate::interaction::Interaction;
use crate::light::{Column, LANES, SurfaceLanes, Vec3Column, put};
use crate::material::MetallicRoughness;
use crate::settings::Roulette;

/// A segment of many paths.
pub(super) struct Bounce<'a, R: Real> {
    pub paths: &'a mut [PathState<R>],
    /// Those that met something, by their places.
    pub going: &'a [u32],
    /// What they met, in their order, and as which hits.
    pub met: &'a mut [Interaction<R>],
    pub hits: &'a [Option<Hit<R>>],
}

impl<R: Real> Bounce<'_, R> {
    /// The path that comes to a vertex, and what it met there.
    #[inline(always)]
    pub fn of(&self, place: u32) -> (&PathState<R>, &Interaction<R>) {
        (
            &self.paths[self.going[place as usize] as usize],
            &self.met[place as usize],
        )
    }
}

/// Which lights a surface answers to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LitSides {
    /// None that could be drawn.
    None,
    /// Those on the side of its normal.
    One,
    /// Those on either side, of which some shine through it.
    Both,
}

/// What a light asks of a surface.
#[derive(Clone, Copy, Debug)]
pub(super) enum MisStrategy {
    /// What it sends back.
    Value,
    /// The same of a light without size, of which only some make highlights.
    Delta { shines: bool },
    /// What it sends back, and how densely it would have drawn the direction to the light.
    Weighed,
}

impl MisStrategy {
    /// Whether what is diffused alone answers it.
    pub fn is_dull(&self) -> bool {
        matches!(self, Self::Delta { shines: false })
    }
}

/// Some vertices, and the paths that come to them.
#[derive(Clone, Copy, Debug)]
pub(super) struct VertexLanes<R: Real> {
    /// How many there are.
    pub len: usize,
    /// Their places among the paths that met something.
    pub place: Column<u32>,
    pub surface: SurfaceLanes<R>,
    /// The surface's own normal on the side that the path came from.
    pub geometric: Vec3Column<R>,
    pub normal: Vec3Column<R>,
    /// Unit direction towards the surface.
    pub direction: Vec3Column<R>,
    pub sides: Column<LitSides>,
    /// Of common surfaces: what they reflect, and metallic, roughness, and the dielectric's
    /// reflectance at normal and at grazing incidence, these not of matte ones.
    pub base: Vec3Column<R>,
    pub terms: [Column<R>; 4],
    /// Factor on lights without size, whose unit is not the same to both families of materials.
    pub gain: Column<R>,
    pub throughput: Vec3Column<R>,
    /// Numbers in [0, 1) for the lobe, the direction, and whether the path goes on.
    pub numbers: [Column<R>; 4],
    /// The greatest chance of a path to go on; infinite of one that chance may not end.
    pub most_survival: Column<R>,
    /// What the light that is asked asks of the surface.
    pub strategy: Column<MisStrategy>,
}

impl<R: Real> VertexLanes<R> {
    pub fn new() -> Self {
        let none = [[R::ZERO; LANES]; 3];
        Self {
            len: 0,
            place: [0; LANES],
            surface: SurfaceLanes::new(),
            geometric: none,
            normal: none,
            direction: none,
            sides: [LitSides::One; LANES],
            base: none,
            terms: [none[0]; 4],
            gain: none[0],
            throughput: none,
            numbers: [none[0]; 4],
            most_survival: none[0],
            strategy: [MisStrategy::Value; LANES],
        }
    }

    /// Adds a vertex on a surface with a normal, and returns its lane.
    #[inline(always)]
    pub fn push(
        &mut self,
        place: u32,
        (path, at): (&PathState<R>, &Interaction<R>),
        (normal, sides, gain): (R::Vec3, LitSides, R),
        roulette: Roulette,
    ) -> usize {
        let lane = self.len;
        self.len += 1;
        self.place[lane] = place;
        self.surface.put(lane, &at.surface);
        put::<R>(
            &mut self.geometric,
            lane,
            if at.outside {
                at.surface.normal
            } else {
                -at.surface.normal
            },
        );
        put::<R>(&mut self.normal, lane, normal);
        put::<R>(&mut self.direction, lane, at.direction);
        self.sides[lane] = sides;
        self.gain[lane] = gain;
        put::<R>(&mut self.throughput, lane, path.throughput);
        for (column, number) in self.numbers.iter_mut().zip(path.draws.scatter) {
            column[lane] = R::from_f32(number);
        }
        self.most_survival[lane] = path.most_survival(roulette);
        lane
    }

    /// Says what the common surface of a lane is made of.
    #[inline(always)]
    pub fn put_model(&mut self, lane: usize, model: &MetallicRoughness<R>) {
        put::<R>(&mut self.base, lane, model.base);
        let terms = [
            model.metallic,
            model.roughness,
            model.dielectric,
            model.grazing,
        ];
        for (column, term) in self.terms.iter_mut().zip(terms) {
            column[lane] = term;
        }
    }

    #[inline(always)]
    pub fn is_full(&self) -> bool {
        self.len == LANES
    }
}

/// Any number of vertices; kept, so that its list is made once.
#[derive(Clone, Debug, Default)]
pub(super) struct VertexList<R: Real> {
    lanes: Vec<VertexLanes<R>>,
    used: usize,
}

impl<R: Real> VertexList<R> {
    pub fn clear(&mut self) {
        self.used = 0;
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.used
            .checked_sub(1)
            .map_or(0, |last| last * LANES + self.lanes[last].len)
    }

    /// Lanes with room for a vertex.
    #[inline(always)]
    pub fn open(&mut self) -> &mut VertexLanes<R> {
        if self.used == 0 || self.lanes[self.used - 1].is_full() {
            if self.used == self.lanes.len() {
                self.lanes.push(VertexLanes::new());
            }
            self.lanes[self.used].len = 0;
            self.used += 1;
        }
        &mut self.lanes[self.used - 1]
    }

    pub fn lanes(&mut self) -> &mut [VertexLanes<R>] {
        &mut self.lanes[..self.used]
    }
}
