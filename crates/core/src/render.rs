//! Rendering: parallel over tiles, sequential over the pixels and samples of a tile. No ray
//! allocates memory or takes a lock.

mod first_hits;
mod lookahead;
mod queue;
mod stage;

use core::marker::PhantomData;
use core::ops::Range;
use std::borrow::Cow;
use std::sync::{Mutex, MutexGuard};

use raywright_bvh::{Ray, Real};

use self::first_hits::FirstHitSums;
use self::lookahead::{SampleBatch, SampleLookahead};
use self::queue::{NextUnit, UnitQueue};
pub use self::stage::RenderStage;
use crate::camera::PreparedCamera;
use crate::counters::Counters;
use crate::denoise::{DenoiseError, DenoiseOutput, denoise};
use crate::film::{
    BlockAccumulator, Film, FilmPart, FilmPlan, MomentSums, PixelSums, PlainSums, ReplicateBuffer,
    SampleAccumulator, TileUpdate, Uncertainty, parts,
};
use crate::filter::FilterSampler;
use crate::integrator::{FirstHit, LightTransport, PACKET, PathResult};
use crate::observer::Observer;
use crate::picture::Picture;
use crate::prepare::Prepared;
use crate::sampler::{Purpose, SampleAddress, Sequence, fours, pair};
use crate::scene::Pattern;
use crate::settings::{Aov, Crop, Sampling, Settings};

/// Result of a render: the picture with its counters.
#[derive(Clone, Debug)]
pub struct RenderOutput {
    /// The picture; of an unfinished render, the mean of the samples so far, black without any.
    pub picture: Picture,
    /// The denoised picture, or the reason why denoising failed; `None` if it was not requested.
    pub denoised: Option<Result<DenoiseOutput, DenoiseError>>,
    /// Counters of rays and samples.
    pub counters: Counters,
    /// Number of pixels that lack samples because the observer stopped the render.
    pub unfinished: u64,
    /// Whether no pixel lacks samples.
    pub finished: bool,
}

impl RenderOutput {
    /// Returns the picture of a film so far, denoised where requested.
    pub fn from_film(film: &Film, observer: &dyn Observer) -> Self {
        let denoised = film.is_to_be_denoised().then(|| denoise(film, observer));
        Self {
            denoised,
            ..Self::noisy(film)
        }
    }

    /// Returns the picture of a film so far, without denoising.
    pub fn noisy(film: &Film) -> Self {
        Self::with_picture(film, film.picture())
    }

    /// Returns the result for a film whose picture is already computed.
    fn with_picture(film: &Film, picture: Picture) -> Self {
        let unfinished = film.unfinished();
        Self {
            picture,
            denoised: None,
            counters: film.counters(),
            unfinished,
            finished: unfinished == 0,
        }
    }

    /// Returns the denoised picture with its error estimate, if any.
    pub fn denoised(&self) -> Option<&DenoiseOutput> {
        self.denoised.as_ref()?.as_ref().ok()
    }

    /// Returns the estimated error of the film's picture before denoising, if known.
    pub fn noisy_error(&self, film: &Film) -> Option<Uncertainty> {
        match self.denoised() {
            Some(denoised) => denoised.noisy,
            None => film.uncertainty(),
        }
    }

    /// Returns the denoised picture, or the sampled picture if none is denoised.
    pub fn shown_picture(&self) -> &Picture {
        self.denoised()
            .map_or(&self.picture, |denoised| &denoised.picture)
    }

    /// Returns the same result with its pictures composited over a background colour, without
    /// coverage.
    #[must_use]
    pub fn over(&self, colour: [f64; 3]) -> Self {
        let over = |denoised: &DenoiseOutput| DenoiseOutput {
            picture: denoised.picture.over(colour),
            ..denoised.clone()
        };
        let denoised = self
            .denoised
            .as_ref()
            .map(|denoised| denoised.as_ref().map(over).map_err(|error| *error));
        Self {
            picture: self.picture.over(colour),
            denoised,
            ..self.clone()
        }
    }

    /// Returns the sampled picture with its own layers and those of the denoised picture.
    pub fn all_layers(&self) -> Cow<'_, Picture> {
        let Some(denoised) = self.denoised() else {
            return Cow::Borrowed(&self.picture);
        };
        let mut all = self.picture.clone();
        all.layers.extend(denoised.layers());
        Cow::Owned(all)
    }
}

/// Renders the samples of `part` that the film lacks, on the current thread pool. Passes over the
/// picture each add some samples of one replicate, so that a stopped render has nearly equal
/// numbers of samples everywhere.
pub(crate) fn render<'a, R: Real, T: LightTransport<'a, R>>(
    (scene, camera): (&'a Prepared<R>, &PreparedCamera<R>),
    settings: &Settings,
    film: &mut Film,
    part: &FilmPart,
    observer: &'a dyn Observer,
) {
    let (plan, filter_sampler) = (film.plan().clone(), settings.filter.draws());
    let queue = Mutex::new(UnitQueue::new(film, part));
    // A separate closure: in the loop's condition, the lock would be held until the work is done.
    let exchange = |finished: Option<TileUpdate>| lock(&queue).exchange(finished, observer);
    let work = || {
        let mut finished = None;
        let mut tracer = T::new(
            scene,
            settings.max_depth,
            !plan.layers.mean.is_empty(),
            observer,
        );
        while !observer.is_cancelled()
            && let Some(next) = exchange(finished.take())
        {
            let NextUnit {
                tile,
                replicate,
                samples,
                start,
            } = next;
            let area = plan.tile(tile);
            let job = UnitJob::<R, T> {
                camera,
                settings,
                plan: &plan,
                filter_sampler: &filter_sampler,
                area,
                tile,
                replicate,
                samples,
                observer,
                transport: PhantomData,
            };
            let Some(tile_update) = job.run(&start, &mut tracer) else {
                break;
            };
            finished = Some(tile_update);
        }
        lock(&queue).end(finished, &tracer.into_light_usage(), observer);
    };
    // Each thread takes the next unit of work from the queue, so that units are finished nearly in
    // order and no thread waits for another. Not a broadcast, which ends only after every thread of
    // the pool has taken part: a caller's pool may have other work.
    rayon::scope(|scope| (0..rayon::current_num_threads()).for_each(|_| scope.spawn(|_| work())));
}

fn lock<'a, T>(mutex: &'a Mutex<T>) -> MutexGuard<'a, T> {
    mutex
        .lock()
        .unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// Returns the coverage and the shadow of a sample, in the integer units of the film's sums.
#[inline(always)]
fn shares<R: Real>(path_result: &PathResult<R>) -> [u32; 2] {
    [parts(path_result.coverage), parts(path_result.shadow)]
}

/// A unit of work: a range of samples of one tile in one replicate.
struct UnitJob<'a, R: Real, T> {
    camera: &'a PreparedCamera<R>,
    settings: &'a Settings,
    plan: &'a FilmPlan,
    filter_sampler: &'a FilterSampler,
    /// Rectangle of the tile, relative to the crop.
    area: Crop,
    tile: u32,
    replicate: u32,
    samples: Range<u32>,
    observer: &'a dyn Observer,
    transport: PhantomData<T>,
}

impl<'t, R: Real, T: LightTransport<'t, R>> UnitJob<'_, R, T> {
    /// Renders the unit; `None` if the observer stopped the render before the unit's end.
    fn run(&self, start: &ReplicateBuffer, tracer: &mut T) -> Option<TileUpdate> {
        match self.plan.random {
            true => self.gather::<MomentSums>(start, tracer),
            false => self.gather::<PlainSums<R>>(start, tracer),
        }
    }

    fn gather<B: BlockAccumulator<R>>(
        &self,
        start: &ReplicateBuffer,
        tracer: &mut T,
    ) -> Option<TileUpdate> {
        let pixels = self.area.width as usize * self.area.height as usize;
        let mut buffer = ReplicateBuffer::with_room(self.plan, pixels);
        let mut spread = Vec::with_capacity(if self.plan.random { pixels } else { 0 });
        let (mut dropped, hit_count);
        let mut finish = |buffer: &mut ReplicateBuffer, pixel: PixelSums| {
            buffer.push(self.plan, &pixel, self.samples.end);
            if self.plan.random {
                spread.push(pixel.spread);
            }
        };
        match self.settings.sampling {
            Sampling::Pattern(Pattern::Corners) => {
                (dropped, hit_count) = self.corners::<B>(tracer, &mut buffer, finish)
            }
            Sampling::Pattern(Pattern::Centre) | Sampling::General(_) => {
                dropped = 0;
                let mut firsts = FirstHitSums::new(self.plan);
                let (mut pixel, mut ahead) = (
                    SampleAccumulator::<R, B>::default(),
                    SampleLookahead::default(),
                );
                let mut position = 0;
                for y in self.rows() {
                    // Checked once a row: a tile of many samples may take seconds.
                    if self.observer.is_cancelled() {
                        return None;
                    }
                    for x in self.columns() {
                        if self.samples.start > 0 {
                            pixel.resume(
                                start.pixel(position, self.samples.start),
                                self.samples.start,
                            );
                            firsts.resume(start, position);
                        }
                        position += 1;
                        for index in self.samples.clone() {
                            let make = |maximum, samples: &mut SampleBatch<_>| {
                                self.make_samples([x, y], index, maximum, samples)
                            };
                            let Some(path_result) = ahead.next(tracer, make) else {
                                break;
                            };
                            let entered = pixel.add(path_result.radiance, shares(&path_result));
                            dropped += u64::from(!entered);
                            firsts.add(|| ahead.first(), entered);
                        }
                        finish(&mut buffer, pixel.finish());
                        firsts.push(&mut buffer);
                    }
                }
                hit_count = pixel.hits;
            }
        }
        let centre = if self.replicate == 0 && self.samples.start == 0 {
            self.centre_layers(tracer)
        } else {
            Vec::new()
        };
        if tracer.is_stopped() {
            return None;
        }
        let mut counters: Counters = tracer.take_counters();
        let entered =
            |buffer: &ReplicateBuffer| buffer.samples.iter().map(|&n| u64::from(n)).sum::<u64>();
        counters.samples = entered(&buffer) - entered(start);
        counters.dropped = dropped;
        counters.hits = hit_count;
        Some(TileUpdate {
            tile: self.tile,
            replicate: self.replicate,
            drawn: self.samples.end,
            buffer,
            spread,
            centre,
            counters,
        })
    }

    /// Returns the range of the tile's pixel rows in the whole picture.
    fn rows(&self) -> Range<u32> {
        let first = self.plan.crop.y + self.area.y;
        first..first + self.area.height
    }

    /// Returns the range of the tile's pixel columns in the whole picture.
    fn columns(&self) -> Range<u32> {
        let first = self.plan.crop.x + self.area.x;
        first..first + self.area.width
    }

    /// Computes the tile's pixels as the means of samples at their four corners. Returns the number
    /// of dropped samples, and of samples that hit a surface.
    fn corners<B: BlockAccumulator<R>>(
        &self,
        tracer: &mut T,
        buffer: &mut ReplicateBuffer,
        mut finish: impl FnMut(&mut ReplicateBuffer, PixelSums),
    ) -> (u64, u64) {
        let (lattice, hits) = self.lattice(tracer);
        let row = self.area.width as usize + 1;
        let mut dropped = 0;
        let mut firsts = FirstHitSums::new(self.plan);
        let mut pixel = SampleAccumulator::<R, B>::default();
        for (y, upper) in lattice
            .chunks_exact(row)
            .take(self.area.height as usize)
            .enumerate()
        {
            let lower = &lattice[(y + 1) * row..][..row];
            for (x, (top, bottom)) in upper.windows(2).zip(lower.windows(2)).enumerate() {
                let entered = [&bottom[0], &bottom[1], &top[0], &top[1]]
                    .map(|&(radiance, shares)| pixel.add(radiance, shares));
                dropped += entered.iter().filter(|entered| !**entered).count() as u64;
                finish(buffer, pixel.finish());
                if !hits.is_empty() {
                    let top = y * row + x;
                    for (position, entered) in [top + row, top + row + 1, top, top + 1]
                        .into_iter()
                        .zip(entered)
                    {
                        firsts.add(|| (hits[position].0.as_ref(), hits[position].1), entered);
                    }
                    firsts.push(buffer);
                }
            }
        }
        (dropped, pixel.hits)
    }

    /// Traces the corners of the tile's pixels, each once for the up to four pixels that share it,
    /// and returns their radiance and coverage. If layers need them, also returns the first hits
    /// and the directly visible radiance.
    #[expect(clippy::type_complexity, reason = "two lists for one caller")]
    fn lattice(
        &self,
        tracer: &mut T,
    ) -> (Vec<(R::Vec3, [u32; 2])>, Vec<(Option<FirstHit>, [f64; 3])>) {
        // Corners are one more than pixels in each direction.
        let inclusive = |range: Range<u32>| range.start..range.end + 1;
        let (columns, rows) = (inclusive(self.columns()), inclusive(self.rows()));
        let count = columns.len() * rows.len();
        let requested = !self.plan.layers.mean.is_empty();
        let (mut corners, mut hits) = (
            Vec::with_capacity(count),
            Vec::with_capacity(if requested { count } else { 0 }),
        );
        let mut ahead = SampleLookahead::default();
        for y in rows {
            for x in columns.clone() {
                let at = |v: u32| R::from_f64(f64::from(v));
                let make = |maximum, samples: &mut SampleBatch<_>| {
                    samples.addresses.extend(
                        (x..columns.end)
                            .take(maximum)
                            .map(|x| self.address(x, y, 0)),
                    );
                    samples.rays.extend(
                        (x..columns.end)
                            .take(maximum)
                            .map(|x| self.camera.generate_ray(at(x), at(y), [0.5; 2])),
                    );
                };
                let Some(path_result) = ahead.next(tracer, make) else {
                    break;
                };
                corners.push((path_result.radiance, shares(&path_result)));
                if requested {
                    let (first, direct) = ahead.first();
                    hits.push((first.copied(), direct));
                }
            }
        }
        (corners, hits)
    }

    fn address(&self, x: u32, y: u32, index: u32) -> SampleAddress {
        let Settings {
            seed,
            frame,
            sampler,
            ..
        } = *self.settings;
        SampleAddress {
            seed,
            frame,
            sampler,
            pixel: [x, y],
            replicate: self.replicate,
            index,
            ..SampleAddress::default()
        }
    }

    /// Generates at most `maximum` samples, starting with sample `index` of a pixel: those of this
    /// pixel, then of the next pixels in its row; for path tracing also of the next rows.
    fn make_samples(
        &self,
        [x, y]: [u32; 2],
        index: u32,
        maximum: usize,
        samples: &mut SampleBatch<R>,
    ) {
        // A packet holds camera rays of a single row with a common origin.
        let end = if T::BATCH > PACKET {
            self.rows().end
        } else {
            y + 1
        };
        let pixels = (y..end).flat_map(|row| {
            (if row == y { x } else { self.columns().start }..self.columns().end)
                .map(move |x| [x, row])
        });
        let by_chance = !self.settings.sampling.is_fixed();
        let SampleBatch {
            addresses,
            rays,
            sequences,
            places,
        } = samples;
        for pixel in pixels {
            let from = if pixel == [x, y] {
                index
            } else {
                self.samples.start
            };
            let until = self
                .samples
                .end
                .min(from.saturating_add((maximum - addresses.len()) as u32));
            let first = self.address(pixel[0], pixel[1], 0);
            addresses.extend((from..until).map(|index| SampleAddress { index, ..first }));
            if by_chance {
                // A replicate has no more samples than a sequence has points.
                let sequence = Sequence::of(first, Purpose::Pixel);
                sequences.extend((from..until).map(|index| (sequence, index)));
            }
            if addresses.len() == maximum {
                break;
            }
        }
        if by_chance {
            fours(sequences.iter().copied(), places);
            rays.extend(
                addresses
                    .iter()
                    .zip(&*places)
                    .map(|(&address, &[u, v, ..])| {
                        let [u, v] = [u, v].map(|number| self.filter_sampler.sample(number));
                        self.sample_ray(address, [u, v])
                    }),
            );
        } else {
            rays.extend(
                addresses
                    .iter()
                    .map(|&address| self.sample_ray(address, [0.5; 2])),
            );
        }
    }

    /// Generates the camera ray of a sample through a position in its pixel, from 0 to 1 for the
    /// box filter; wider filters reach beyond the pixel.
    #[inline]
    fn sample_ray(&self, address: SampleAddress, [u, v]: [f32; 2]) -> Ray<R> {
        let [x, y] = address.pixel;
        let camera = self.camera;
        let lens = if camera.has_lens() {
            pair(address, Purpose::Lens)
        } else {
            [0.5; 2]
        };
        let share = if camera.has_shutter() {
            pair(address, Purpose::Time)[0]
        } else {
            0.0
        };
        let at = |v: u32, offset: f32| R::from_f64(f64::from(v)) + R::from_f32(offset);
        camera.ray_during(at(x, u), at(y, v), lens, share)
    }

    /// Traces rays through the pixel centres, for the layers of first hits that need them, and
    /// returns these layers.
    fn centre_layers(&self, tracer: &mut T) -> Vec<Vec<f32>> {
        let layers = &self.plan.layers.centre;
        let mut buffers = vec![Vec::new(); layers.len()];
        if layers.is_empty() {
            return buffers;
        }
        for (x, y) in self
            .rows()
            .flat_map(|y| self.columns().map(move |x| (x, y)))
        {
            let at = |v: u32| R::from_f64(f64::from(v) + 0.5);
            let first = tracer.first_hit(self.camera.ray_during(at(x), at(y), [0.5; 2], 0.0));
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
