//! Vertices on common surfaces in columns: what is a number of one vertex stands beside that of the next, as lanes take them.

use raywright_bvh::Real;

use super::PathState;
use super::mis::MisStrategy;
use crate::interaction::Interaction;
use crate::light::{Column, LANES, SurfaceLanes, Vec3Column, put};
use crate::material::MetallicRoughness;
use crate::settings::Roulette;

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
    pub base: Vec3Column<R>,
    /// Metallic, roughness, and the dielectric's reflectance at normal and at grazing incidence; not of matte surfaces.
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
            base: none,
            terms: [none[0]; 4],
            gain: none[0],
            throughput: none,
            numbers: [none[0]; 4],
            most_survival: none[0],
            strategy: [MisStrategy::Value; LANES],
        }
    }

    /// Adds a vertex.
    #[inline(always)]
    pub fn push(
        &mut self,
        place: u32,
        (path, at): (&PathState<R>, &Interaction<R>),
        (model, gain): (&MetallicRoughness<R>, R),
        roulette: Roulette,
    ) {
        let lane = self.len;
        self.len += 1;
        self.place[lane] = place;
        self.surface.put(lane, &at.surface);
        put::<R>(&mut self.geometric, lane, if at.outside { at.surface.normal } else { -at.surface.normal });
        put::<R>(&mut self.normal, lane, at.normal);
        put::<R>(&mut self.direction, lane, at.direction);
        put::<R>(&mut self.base, lane, model.base);
        let terms = [model.metallic, model.roughness, model.dielectric, model.grazing];
        for (column, term) in self.terms.iter_mut().zip(terms) {
            column[lane] = term;
        }
        self.gain[lane] = gain;
        put::<R>(&mut self.throughput, lane, path.throughput);
        for (column, number) in self.numbers.iter_mut().zip(path.draws.scatter) {
            column[lane] = R::from_f32(number);
        }
        self.most_survival[lane] = path.most_survival(roulette);
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

    /// Lanes with room for a vertex, and their place in the list.
    #[inline(always)]
    pub fn open(&mut self) -> (&mut VertexLanes<R>, usize) {
        if self.used == 0 || self.lanes[self.used - 1].is_full() {
            if self.used == self.lanes.len() {
                self.lanes.push(VertexLanes::new());
            }
            self.lanes[self.used].len = 0;
            self.used += 1;
        }
        let last = self.used - 1;
        (&mut self.lanes[last], last)
    }

    pub fn lanes(&mut self) -> &mut [VertexLanes<R>] {
        &mut self.lanes[..self.used]
    }
}
