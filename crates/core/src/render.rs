//! Rendering: tiles over threads, samples over pixels. Nothing here allocates or locks per ray.

mod ahead;

use core::cell::Cell;
use core::marker::PhantomData;
use core::ops::Range;
use core::sync::atomic::{AtomicUsize, Ordering};
use std::sync::Mutex;

use raywright_bvh::{Precision, Ray, Real, Vec3Of};

use self::ahead::Ahead;
use crate::counters::Counters;
use crate::film::{Block, Film, Gather, Moments, Part, Plain, Plan, Plane, Sums, Unit};
use crate::integrator::{FirstHit, Kernel, Tracer};
use crate::observer::Observer;
use crate::picture::Picture;
use crate::prepare::Prepared;
use crate::sampler::{Address, Purpose, Sequence, pair};
use crate::scene::Pattern;
use crate::settings::{Aov, Crop, Sampling, Settings};

/// A picture with what it took.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// The picture; where it was not finished, the mean of the samples so far, black without any.
    pub picture: Picture,
    /// Rays and samples.
    pub counters: Counters,
    /// Pixels that lack samples because the observer stopped the render.
    pub unfinished: u64,
    /// Whether there are no such pixels.
    pub finished: bool,
}

/// Renders what `part` names and the film lacks on the current thread pool: one replicate after the other, so that a render
/// that is stopped has something everywhere.
pub(crate) fn render<P: Precision, K: Kernel>(
    scene: &Prepared<P>,
    settings: &Settings,
    film: &mut Film,
    part: &Part,
    observer: &dyn Observer,
) {
    let plan = film.plan().clone();
    let replicates = part.replicates.start..part.replicates.end.min(plan.replicates);
    let tiles = part.tiles.start..part.tiles.end.min(plan.tiles());
    let mut units: Vec<(u32, u32)> = replicates.flat_map(|r| tiles.clone().map(move |tile| (tile, r))).collect();
    units.retain(|&(tile, replicate)| !film.has(tile, replicate));
    let pixels = |area: Crop| u64::from(area.width) * u64::from(area.height);
    let total = units.iter().map(|&(tile, _)| pixels(plan.tile(tile))).sum();
    let (next, film) = (AtomicUsize::new(0), Mutex::new((film, 0_u64)));
    let work = || {
        while !observer.cancelled()
            && let Some(&(tile, replicate)) = units.get(next.fetch_add(1, Ordering::Relaxed))
        {
            let area = plan.tile(tile);
            let job = UnitJob::<P, K> { scene, settings, plan: &plan, area, tile, replicate, observer, kernel: PhantomData };
            let Some(unit) = job.run() else { break };
            // One lock a tile.
            let mut film = film.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
            film.0.put(&unit);
            film.1 += pixels(area);
            observer.progress(film.1, total);
        }
    };
    // Each thread takes the next one, so that they are finished nearly in order and none waits for another. Not a broadcast,
    // which ends only when every thread of the pool has taken part: a caller's pool may have other things to do.
    rayon::scope(|scope| (0..rayon::current_num_threads()).for_each(|_| scope.spawn(|_| work())));
}

/// The work of one tile in one replicate.
struct UnitJob<'a, P: Precision, K: Kernel> {
    scene: &'a Prepared<P>,
    settings: &'a Settings,
    plan: &'a Plan,
    /// In film coordinates, relative to the crop.
    area: Crop,
    tile: u32,
    replicate: u32,
    observer: &'a dyn Observer,
    kernel: PhantomData<K>,
}

/// Sums of the layers that come from first hits, for one pixel.
struct FirstHits<'a> {
    plan: &'a Plan,
    sums: Vec<[f64; 3]>,
    hits: u16,
}

impl<'a> FirstHits<'a> {
    fn new(plan: &'a Plan) -> Self {
        Self { plan, sums: vec![[0.0; 3]; plan.layers.mean.len()], hits: 0 }
    }

    #[inline(always)]
    fn add(&mut self, first: Option<&FirstHit>) {
        if !self.sums.is_empty() {
            self.sum(first);
        }
    }

    fn sum(&mut self, first: Option<&FirstHit>) {
        let Some(first) = first else { return };
        self.hits += 1;
        for (sum, (aov, _)) in self.sums.iter_mut().zip(&self.plan.layers.mean) {
            let value = match aov {
                Aov::Albedo => first.albedo,
                Aov::Normal => first.normal,
                _ => first.position,
            };
            *sum = core::array::from_fn(|i| sum[i] + value[i]);
        }
    }

    /// Hands the means of the pixel over and starts the next one.
    #[inline(always)]
    fn push(&mut self, plane: &mut Plane, samples: u32) {
        if !self.sums.is_empty() {
            self.mean(plane, samples);
        }
    }

    fn mean(&mut self, plane: &mut Plane, samples: u32) {
        for (k, (sum, (aov, _))) in self.sums.iter_mut().zip(&self.plan.layers.mean).enumerate() {
            let n = f64::from(if *aov == Aov::Position { u32::from(self.hits) } else { samples }).max(1.0);
            plane.layers[k].push(core::mem::take(sum).map(|s| (s / n) as f32));
        }
        if self.plan.counts_first_hits() {
            plane.first_hits.push(self.hits);
        }
        self.hits = 0;
    }
}

impl<P: Precision, K: Kernel> UnitJob<'_, P, K> {
    /// None where the observer stopped it halfway.
    fn run(&self) -> Option<Unit> {
        match self.plan.random {
            true => self.gather::<Moments>(),
            false => self.gather::<Plain<P::Real>>(),
        }
    }

    fn gather<B: Block<P::Real>>(&self) -> Option<Unit> {
        let pixels = self.area.width as usize * self.area.height as usize;
        let keeps_first = !self.plan.layers.mean.is_empty();
        let mut tracer = Tracer::<P, K>::new(self.scene, self.settings.max_depth, keeps_first, self.observer);
        let mut plane = Plane::with_room(self.plan, pixels);
        let mut spread = Vec::with_capacity(if self.plan.random { pixels } else { 0 });
        let (mut dropped, met) = (0, Cell::new(0_u64));
        let mut finish = |plane: &mut Plane, pixel: Sums| {
            met.set(met.get() + u64::from(pixel.hits));
            plane.push(self.plan, &pixel);
            if self.plan.random {
                spread.push(pixel.spread);
            }
        };
        match self.settings.sampling {
            Sampling::Pattern(Pattern::Corners) => dropped += self.corners::<B>(&mut tracer, &mut plane, finish),
            Sampling::Pattern(Pattern::Centre) | Sampling::General(_) => {
                let samples = self.plan.samples_of(self.replicate);
                let mut firsts = FirstHits::new(self.plan);
                let (mut pixel, mut ahead) = (Gather::<P::Real, B>::default(), Ahead::default());
                for y in self.rows() {
                    // A tile of many samples may take seconds.
                    if self.observer.cancelled() {
                        return None;
                    }
                    for x in self.columns() {
                        for index in 0..samples {
                            let Some(ray) = ahead.next(&tracer, self.sample_rays([x, y], index, 0..samples)) else { break };
                            let brought = tracer.camera_ray(ray, self.address(x, y, index));
                            dropped += u64::from(!pixel.add(brought.radiance, brought.hit));
                            firsts.add(tracer.first());
                        }
                        finish(&mut plane, pixel.finish());
                        firsts.push(&mut plane, samples);
                    }
                }
            }
        }
        let centre = if self.replicate == 0 { self.centre_layers(&mut tracer) } else { Vec::new() };
        if tracer.is_stopped() {
            return None;
        }
        let mut counters: Counters = tracer.counters;
        counters.samples = plane.samples.iter().map(|&n| u64::from(n)).sum();
        counters.dropped = dropped;
        counters.met = met.get();
        Some(Unit { tile: self.tile, replicate: self.replicate, plane, spread, centre, counters })
    }

    /// Rows of the whole picture that the tile lies in.
    fn rows(&self) -> Range<u32> {
        let first = self.plan.crop.y + self.area.y;
        first..first + self.area.height
    }

    /// Columns of the whole picture that the tile lies in.
    fn columns(&self) -> Range<u32> {
        let first = self.plan.crop.x + self.area.x;
        first..first + self.area.width
    }

    /// Pixels that are the means of their corners; how many samples were dropped.
    fn corners<B: Block<P::Real>>(
        &self,
        tracer: &mut Tracer<'_, P, K>,
        plane: &mut Plane,
        mut finish: impl FnMut(&mut Plane, Sums),
    ) -> u64 {
        let (lattice, hits) = self.lattice(tracer);
        let row = self.area.width as usize + 1;
        let mut dropped = 0;
        let mut firsts = FirstHits::new(self.plan);
        let mut pixel = Gather::<P::Real, B>::default();
        for (y, upper) in lattice.chunks_exact(row).take(self.area.height as usize).enumerate() {
            let lower = &lattice[(y + 1) * row..][..row];
            for (x, (top, bottom)) in upper.windows(2).zip(lower.windows(2)).enumerate() {
                for &(radiance, hit) in [&bottom[0], &bottom[1], &top[0], &top[1]] {
                    dropped += u64::from(!pixel.add(radiance, hit));
                }
                finish(plane, pixel.finish());
                if !hits.is_empty() {
                    let top = y * row + x;
                    [top + row, top + row + 1, top, top + 1].into_iter().for_each(|at| firsts.add(hits[at].as_ref()));
                    firsts.push(plane, 4);
                }
            }
        }
        dropped
    }

    /// Radiance at the corners of the tile's pixels, each traced once for the up to four pixels that share it, and their first
    /// hits where layers ask for them.
    #[expect(clippy::type_complexity, reason = "two lists for one caller")]
    fn lattice(&self, tracer: &mut Tracer<'_, P, K>) -> (Vec<(Vec3Of<P>, bool)>, Vec<Option<FirstHit>>) {
        // One more each way than there are pixels.
        let inclusive = |range: Range<u32>| range.start..range.end + 1;
        let (columns, rows) = (inclusive(self.columns()), inclusive(self.rows()));
        let count = columns.len() * rows.len();
        let asked = !self.plan.layers.mean.is_empty();
        let (mut corners, mut hits) = (Vec::with_capacity(count), Vec::with_capacity(if asked { count } else { 0 }));
        let mut ahead = Ahead::default();
        for y in rows {
            for x in columns.clone() {
                let at = |v: u32| P::Real::from_f64(f64::from(v));
                let rays = (x..columns.end).map(|x| self.scene.camera.ray(at(x), at(y), [0.5; 2]));
                let Some(ray) = ahead.next(tracer, rays) else { break };
                let brought = tracer.camera_ray(ray, self.address(x, y, 0));
                corners.push((brought.radiance, brought.hit));
                if asked {
                    hits.push(tracer.first().copied());
                }
            }
        }
        (corners, hits)
    }

    fn address(&self, x: u32, y: u32, index: u32) -> Address {
        let Settings { seed, frame, .. } = *self.settings;
        Address { seed, frame, pixel: [x, y], replicate: self.replicate, index, ..Address::default() }
    }

    /// The camera rays of a row from one sample of a pixel on: those of this pixel, then of the next ones.
    fn sample_rays(&self, [x, y]: [u32; 2], index: u32, samples: Range<u32>) -> impl Iterator<Item = Ray<P::Real>> + '_ {
        (x..self.columns().end).flat_map(move |column| {
            // A replicate has no more samples than a sequence has points.
            let places = (!self.settings.sampling.is_fixed()).then(|| Sequence::of(self.address(column, y, 0), Purpose::Pixel));
            let from = if column == x { index } else { samples.start };
            (from..samples.end).map(move |index| self.sample_ray([column, y], index, places))
        })
    }

    /// The camera ray of one sample of a pixel: at its place, or in the middle.
    #[inline]
    fn sample_ray(&self, [x, y]: [u32; 2], index: u32, places: Option<Sequence>) -> Ray<P::Real> {
        let address = self.address(x, y, index);
        let [u, v] = places.map_or([0.5; 2], |places| places.pair(index));
        let camera = &self.scene.camera;
        let lens = if camera.has_lens() { pair(address, Purpose::Lens) } else { [0.5; 2] };
        let share = if camera.has_shutter() { pair(address, Purpose::Time)[0] } else { 0.0 };
        let at = |v: u32, offset: f32| P::Real::from_f64(f64::from(v)) + P::Real::from_f32(offset);
        camera.ray_during(at(x, u), at(y, v), lens, share)
    }

    /// The layers that show what the rays through the middles of pixels hit first. Those rays are traced for them alone.
    fn centre_layers(&self, tracer: &mut Tracer<'_, P, K>) -> Vec<Vec<f32>> {
        let layers = &self.plan.layers.centre;
        let mut buffers = vec![Vec::new(); layers.len()];
        if layers.is_empty() {
            return buffers;
        }
        for (x, y) in self.rows().flat_map(|y| self.columns().map(move |x| (x, y))) {
            let at = |v: u32| P::Real::from_f64(f64::from(v) + 0.5);
            let first = tracer.first_hit(self.scene.camera.ray_during(at(x), at(y), [0.5; 2], 0.0));
            for (buffer, (aov, _)) in buffers.iter_mut().zip(layers) {
                buffer.push(first.as_ref().map_or(-1.0, |f| match aov {
                    Aov::Depth => f.distance as f32,
                    Aov::Object => f.object as f32,
                    _ => f.material as f32,
                }));
            }
        }
        buffers
    }
}
