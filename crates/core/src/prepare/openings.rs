//! Finds where the sky can be seen from, before the first sample, for the sampling of the sky
//! through openings ([`Openings`]).
//!
//! All random numbers come from a fixed generator: the table depends on the scene alone, not on
//! camera, seed, threads, tiles or parts of a picture.

use core::f64::consts::{PI, TAU};

use glam::DVec3;
use rayon::prelude::*;
use raywright_bvh::{Interval, Ray, Real, Surface, Vector};

use super::prepared_scene::PreparedScene;
use crate::hash::splitmix64;
use crate::integrator::PathSegment;
use crate::interaction::Interaction;
use crate::light::{BINS, CellGrid, LightId, Openings, ShadowRayTarget, SkyBins, smooth_bins};

/// Walks that look whether the scene has openings at all, and directions that each of their
/// vertices looks into: by the cosine, and by the sky's own density.
const PROBE_WALKS: u64 = 256;
const PROBE_DIRECTIONS: u64 = 8;
const PROBE_SKY_DIRECTIONS: u64 = 2;
/// Walks that find the cells of a scene with openings.
const WALKS: u64 = 4096;
/// Greatest number of vertices of a walk.
const MOST_VERTICES: u64 = 6;
/// Points of a cell from which rays look for the sky: in the first pass, where the sky is hidden in
/// part, and for bright bins. A sun that shines on a part of a cell must not be missed: the points
/// that it reaches would have more noise than without a table.
const POINTS: [usize; 3] = [2, 4, 16];
/// Share of the sky's flux from which on a bin is bright: a few times that of an even sky.
const BRIGHT: f64 = 5.0 / BINS as f64;
/// Greatest ratio of the second moment of a sample by the table to that by the sky's own density
/// with which a cell gets a table. A sample by the table costs up to twice as much, since most of
/// its directions need a shadow ray.
const WORTH: f64 = 0.25;
/// Least share of such cells among those that see the sky with which the scene gets a table.
const LEAST_SHARE: f64 = 0.25;
/// A vertex of the probe that sees this share of the sky's directions or more needs no table. The
/// probe goes on to the cells if half of the vertices see less: fields, groves and objects on a
/// floor have three in ten.
const OPEN: f64 = 0.5;
const LEAST_HIDDEN: f64 = 0.5;
/// Times that all other lights must outshine the sky, by the rough measure of the probe, for the
/// search to end with it.
const OUTSHINES: f64 = 4.0;
/// Greatest number of cells with a table, two kilobytes each.
const MOST_CELLS: usize = 2048;

/// A point of a walk, on the side of a surface from which it was reached.
struct Vertex<R: Real> {
    surface: Surface<R>,
    normal: DVec3,
}

/// What rays find of the sky from a cell.
enum CellSky {
    /// No light arrives.
    Dark,
    /// The sky's own density suits the cell.
    Open,
    /// Light from each bin, in a part of the sky that its own density seldom meets.
    Narrow(Vec<f64>),
}

/// Share of the light of each neighbour that is added to a cell's.
const NEIGHBOURS: f64 = 0.25;

/// Returns the light of each cell that sees a narrow part of the sky or looks dark, with a share of that of its
/// neighbours: where a window is small, the few rays of a cell may all miss it.
fn light_with_neighbours(grid: &CellGrid, cells: &[(usize, CellSky)]) -> Vec<(usize, Vec<f64>)> {
    let mut light_of: Vec<Option<&[f64]>> = vec![None; grid.len()];
    for (cell, sky) in cells {
        if let CellSky::Narrow(light) = sky {
            light_of[*cell] = Some(light);
        }
    }
    let sum = |(cell, sky): &(usize, CellSky)| {
        let mut sum = match sky {
            CellSky::Open => return None,
            CellSky::Dark => vec![0.0; BINS],
            CellSky::Narrow(light) => light.clone(),
        };
        for light in grid.neighbours(*cell).filter_map(|other| light_of[other]) {
            for (sum, light) in sum.iter_mut().zip(light) {
                *sum += NEIGHBOURS * light;
            }
        }
        sum.iter().any(|&light| light > 0.0).then_some((*cell, sum))
    };
    cells.iter().filter_map(sum).collect()
}

/// A uniform random number in [0, 1): number `index` of stream `stream`.
fn random_number(stream: u64, index: u64) -> f64 {
    (splitmix64(splitmix64(stream) ^ index) >> 11) as f64 / (1_u64 << 53) as f64
}

/// Maps two uniform numbers to a direction around a unit normal, with a density in proportion to
/// the cosine.
fn cosine_direction(normal: DVec3, [u, v]: [f64; 2]) -> DVec3 {
    let (tangent, bitangent) = normal.any_orthonormal_pair();
    let (ring, turn) = (u.sqrt(), TAU * v);
    let flat = tangent * libm::cos(turn) + bitangent * libm::sin(turn);
    (flat * ring + normal * (1.0 - u).sqrt()).normalize()
}

impl<R: Real> PreparedScene<R> {
    /// Returns the table of the scene's openings; `None` if it has none.
    pub(super) fn find_openings(&self) -> Option<Openings> {
        let grid = CellGrid::new(&self.geometry.bounded_primitives_box())?;
        if !self.needs_search_for_openings() {
            return None;
        }
        let sky = SkyBins::new(&self.lights.sky);
        let own = sky.sampling_shares::<R>(self.lights.sky_sampler()?);
        let cells: Vec<(usize, CellSky)> = self
            .points_by_cell(&grid)
            .into_par_iter()
            .map(|(cell, points)| {
                let look = |count| self.look_for_sky((&sky, &own, count), cell, &points);
                let sky = match look(POINTS[0]) {
                    CellSky::Narrow(_) => look(POINTS[1]),
                    sky => sky,
                };
                (cell, sky)
            })
            .collect();
        let count = |is: fn(&CellSky) -> bool| cells.iter().filter(|(_, sky)| is(sky)).count();
        let narrow = count(|sky| matches!(sky, CellSky::Narrow(_)));
        let lit = count(|sky| !matches!(sky, CellSky::Dark));
        if narrow == 0 || (narrow as f64) < LEAST_SHARE * lit as f64 {
            return None;
        }
        let mut tables = light_with_neighbours(&grid, &cells);
        if self.lamps_outshine(&tables) {
            return None;
        }
        tables.truncate(MOST_CELLS);
        Some(Openings::new(grid, sky, &tables))
    }

    /// Whether all other lights give the cells more light than the sky: their noise decides.
    fn lamps_outshine(&self, cells: &[(usize, Vec<f64>)]) -> bool {
        let arriving: f64 = cells.iter().flat_map(|(_, light)| light).sum();
        // The neighbouring bins and cells have added about as much again, twice.
        let [sky, lamps] = self.light_power();
        lamps > sky * 0.25 * arriving / cells.len() as f64
    }

    /// Returns the power of the sky and that of all other lights, whose light is taken as even over
    /// the scene.
    fn light_power(&self) -> [f64; 2] {
        let (mut sky, mut lamps) = (0.0, 0.0);
        for light in self.lights.light_ids() {
            let is_sky = light == LightId::Sky;
            *(if is_sky { &mut sky } else { &mut lamps }) += self.lights.power(light);
        }
        [sky, lamps]
    }

    /// Whether most of the sky is hidden from half of the surfaces that see it, and the other lights
    /// do not clearly outshine what is left of it, by a few walks.
    fn needs_search_for_openings(&self) -> bool {
        let walks = (0..PROBE_WALKS).into_par_iter().flat_map_iter(|walk| {
            let vertices = self.walk_through_scene(walk);
            vertices.into_iter().map(move |vertex| (walk, vertex))
        });
        let found: Vec<[f64; 2]> = walks
            .map(|(walk, vertex)| self.probe_sky(walk, &vertex))
            .collect();
        let seeing = found.iter().filter(|[share, _]| *share > 0.0);
        let hidden = seeing.clone().filter(|[share, _]| *share < OPEN).count();
        let arriving = found.iter().map(|[_, light]| light).sum::<f64>() / found.len() as f64;
        let [sky, lamps] = self.light_power();
        hidden as f64 > LEAST_HIDDEN * seeing.count() as f64 && lamps <= OUTSHINES * sky * arriving
    }

    /// Returns the share of the sky's directions that a vertex sees, and the irradiance that arrives
    /// from them over the sky's flux: the sum of two estimates, as each misses a part of some skies.
    fn probe_sky(&self, walk: u64, vertex: &Vertex<R>) -> [f64; 2] {
        let (Vertex { surface, normal }, sky) = (vertex, &self.lights.sky);
        let Some(sampler) = self.lights.sky_sampler() else {
            return [0.0; 2];
        };
        let numbers = |k: u64| [0, 1].map(|i| random_number(walk, 1000 + 2 * k + i));
        let radiance = |direction: R::Vec3| {
            let found = sky.radiance(R::Vec3::ZERO, direction);
            found.to_f64().element_sum() / sampler.flux()
        };
        let (mut share, mut light) = (0.0, 0.0);
        for k in 0..PROBE_DIRECTIONS {
            let direction = cosine_direction(*normal, numbers(k));
            let seen = self.sky_transmittance(surface, direction) / PROBE_DIRECTIONS as f64;
            share += seen;
            light += PI * seen * radiance(R::Vec3::from_f64(direction));
        }
        for k in 0..PROBE_SKY_DIRECTIONS {
            let position = numbers(PROBE_DIRECTIONS + k).map(|number| number as f32);
            let direction = sampler.sample_direction::<R>(position);
            let density = sampler.density::<R>(direction, sky.image_coordinates(direction));
            let cosine = direction.to_f64().dot(*normal);
            if cosine > 0.0 && density > 0.0 {
                let seen = self.sky_transmittance(surface, direction.to_f64());
                light +=
                    cosine * seen * radiance(direction) / (density * PROBE_SKY_DIRECTIONS as f64);
            }
        }
        [share, light]
    }

    /// Returns the first points of each cell that walks reach, in the order of the cells.
    fn points_by_cell(&self, grid: &CellGrid) -> Vec<(usize, Vec<Vertex<R>>)> {
        let walks: Vec<Vec<Vertex<R>>> = (0..WALKS)
            .into_par_iter()
            .map(|walk| self.walk_through_scene(walk))
            .collect();
        let mut cells: Vec<Vec<Vertex<R>>> = Vec::new();
        cells.resize_with(grid.len(), Vec::new);
        for vertex in walks.into_iter().flatten() {
            let cell = grid.cell_index(vertex.surface.point.to_f64(), vertex.normal);
            if let Some(points) = cell.map(|cell| &mut cells[cell])
                && points.len() < POINTS[2]
            {
                points.push(vertex);
            }
        }
        let cells = cells.into_iter().enumerate();
        cells.filter(|(_, points)| !points.is_empty()).collect()
    }

    /// Returns the vertices of a walk that starts at a random point of the scene's bounds in a
    /// random direction, and leaves each surface diffusely.
    fn walk_through_scene(&self, walk: u64) -> Vec<Vertex<R>> {
        let number = |index: u64| random_number(walk, index);
        let bounds = self.geometry.bounded_primitives_box();
        let share = DVec3::new(number(0), number(1), number(2));
        let height = 1.0 - 2.0 * number(3);
        let (ring, turn) = ((1.0 - height * height).sqrt(), TAU * number(4));
        let direction = DVec3::new(ring * libm::cos(turn), height, ring * libm::sin(turn));
        let mut segment = PathSegment::from_ray(Ray::new(
            R::Vec3::from_f64(bounds.min + bounds.extent() * share),
            R::Vec3::from_f64(direction),
        ));
        let mut vertices = Vec::new();
        for vertex in 0..MOST_VERTICES {
            let range = Interval {
                min: R::ZERO,
                max: R::INFINITY,
            };
            let Some(hit) = self.geometry.closest(&segment.ray, range, &mut ()) else {
                break;
            };
            let interaction = Interaction::from_hit(self, &segment, &hit);
            let normal = interaction.normal.to_f64().normalize_or_zero();
            if normal == DVec3::ZERO {
                break;
            }
            let facing = normal.dot(segment.ray.direction.to_f64());
            let normal = if facing > 0.0 { -normal } else { normal };
            let numbers = [0, 1].map(|i| number(5 + 2 * vertex + i));
            let direction = R::Vec3::from_f64(cosine_direction(normal, numbers));
            let surface = interaction.surface;
            let origin = surface.spawn_ray_origin(direction);
            segment = PathSegment::from_ray(Ray::new(origin, direction));
            vertices.push(Vertex { surface, normal });
        }
        vertices
    }

    /// Looks for the sky from a cell by rays through each bin: from the cell's first `count`
    /// points, from all its points through a bright bin. A table is worth it by the second moment
    /// of a sample, beside that by the sky's own density. Both go together with the density of a
    /// diffuse surface, as in multiple importance sampling.
    fn look_for_sky(
        &self,
        (sky, own, count): (&SkyBins, &[f64], usize),
        cell: usize,
        points: &[Vertex<R>],
    ) -> CellSky {
        let mut light = vec![0.0; BINS];
        // Squares of the light, and densities of the diffuse surface.
        let (mut squares, mut scattered) = (vec![0.0; BINS], vec![0.0; BINS]);
        for (bin, &flux) in sky
            .flux()
            .iter()
            .enumerate()
            .filter(|(_, flux)| **flux > 0.0)
        {
            let count = if flux < BRIGHT { count } else { POINTS[2] };
            let used = &points[..count.min(points.len())];
            let share = 1.0 / used.len() as f64;
            for (k, point) in used.iter().enumerate() {
                let stream = WALKS + (cell * POINTS[2] + k) as u64;
                let number = |i: u64| random_number(stream, 2 * bin as u64 + i);
                let place = sky.sample_direction(bin, [number(0), number(1)]);
                let direction = place.to_direction();
                let cosine = direction.dot(point.normal);
                if cosine > 0.0 {
                    let arriving =
                        flux * cosine * self.sky_transmittance(&point.surface, direction);
                    light[bin] += arriving * share;
                    squares[bin] += arriving * arriving * share;
                    // A bin covers 4π/BINS, and the density of a direction is the cosine over π.
                    scattered[bin] += 4.0 * cosine * share / BINS as f64;
                }
            }
        }
        let light = smooth_bins(&light);
        let all: f64 = light.iter().sum();
        let moment = |density: &dyn Fn(usize) -> f64| -> f64 {
            let lit = (0..BINS).filter(|&bin| squares[bin] > 0.0);
            lit.map(|bin| squares[bin] / (density(bin) + scattered[bin]))
                .sum()
        };
        let before = moment(&|bin| own[bin]);
        let table = moment(&|bin| Openings::mix(own[bin], light[bin] / all));
        if before == 0.0 {
            CellSky::Dark
        } else if table < WORTH * before {
            CellSky::Narrow(light)
        } else {
            CellSky::Open
        }
    }

    /// Returns the share of the sky's light from a direction that reaches a surface, 0 to 1. Thin
    /// walls let all of it through.
    fn sky_transmittance(&self, surface: &Surface<R>, direction: DVec3) -> f64 {
        const MOST_WALLS: usize = 8;
        let direction = R::Vec3::from_f64(direction);
        let range = Interval {
            min: R::ZERO,
            max: R::INFINITY,
        };
        let mut ray = Ray::new(surface.spawn_ray_origin(direction), direction);
        for _ in 0..MOST_WALLS {
            let target = ShadowRayTarget::Infinity;
            let share = self
                .trace_shadow((&ray, range), &target, false)
                .share
                .to_f64();
            if share > 0.0 || !self.transmits_straight {
                return share.clamp(0.0, 1.0);
            }
            let Some(hit) = self.geometry.closest(&ray, range, &mut ()) else {
                return 1.0;
            };
            let interaction = Interaction::from_hit(self, &PathSegment::from_ray(ray), &hit);
            if !self.materials[interaction.material as usize].is_thin_wall() {
                return 0.0;
            }
            ray = Ray::new(interaction.surface.spawn_ray_origin(direction), direction);
        }
        0.0
    }
}

#[cfg(test)]
mod tests;
