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
use self::lookahead::{SampleBatch, SampleStream};
use self::queue::{WorkQueue, WorkUnit};
pub use self::stage::RenderStage;
use crate::camera::PreparedCamera;
use crate::counters::Counters;
use crate::denoise::{DenoiseError, DenoiseOutput, denoise};
use crate::film::{
    BlockAccumulator, Film, FilmPart, FilmPlan, MomentAccumulator, PixelSums, ReplicateBuffer,
    SampleAccumulator, SumAccumulator, TileUpdate, Uncertainty, quantise_coverage,
};
use crate::filter::FilterSampler;
use crate::integrator::{FirstHit, LightTransport, PACKET, PathResult};
use crate::observer::Observer;
use crate::picture::Picture;
use crate::prepare::PreparedScene;
use crate::sampler::{SampleAddress, SamplePurpose, SampleSequence, sample_2d, sample_4d_batch};
use crate::scene::SamplePattern;
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
    /// Whether every pixel has all its samples.
    pub finished: bool,
}

impl RenderOutput {
    /// Returns the picture of a film so far, denoised where requested.
    pub fn from_film(film: &Film, observer: &dyn Observer) -> Self {
        let denoised = film.is_to_be_denoised().then(|| denoise(film, observer));
        Self {
            denoised,
            ..Self::from_film_without_denoising(film)
        }
    }

    /// Returns the picture of a film so far, without denoising.
    pub fn from_film_without_denoising(film: &Film) -> Self {
        Self::with_picture(film, film.picture())
    }

    /// Returns the result for a film whose picture is already computed.
    fn with_picture(film: &Film, picture: Picture) -> Self {
        let unfinished = film.unfinished_pixels();
        Self {
            picture,
            denoised: None,
            counters: film.counters(),
            unfinished,
            finished: unfinished == 0,
        }
    }

    /// Returns the denoised picture with its error estimate, if any.
    pub fn denoise_output(&self) -> Option<&DenoiseOutput> {
        self.denoised.as_ref()?.as_ref().ok()
    }

    /// Returns the estimated error of the film's picture before denoising, if known.
    pub fn error_before_denoising(&self, film: &Film) -> Option<Uncertainty> {
        match self.denoise_output() {
            Some(denoised) => denoised.noisy_error,
            None => film.estimate_uncertainty(),
        }
    }

    /// Returns the denoised picture, or the sampled picture if none is denoised.
    pub fn final_picture(&self) -> &Picture {
        self.denoise_output()
            .map_or(&self.picture, |denoised| &denoised.picture)
    }

    /// Returns the same result with its pictures composited over a background colour, without
    /// coverage.
    #[must_use]
    pub fn composite_over(&self, colour: [f64; 3]) -> Self {
        let over = |denoised: &DenoiseOutput| DenoiseOutput {
            picture: denoised.picture.composite_over(colour),
            ..denoised.clone()
        };
        let denoised = self
            .denoised
            .as_ref()
            .map(|denoised| denoised.as_ref().map(over).map_err(|error| *error));
        Self {
            picture: self.picture.composite_over(colour),
            denoised,
            ..self.clone()
        }
    }

    /// Returns the sampled picture with its own layers and those of the denoised picture.
    pub fn picture_with_all_layers(&self) -> Cow<'_, Picture> {
        let Some(denoised) = self.denoise_output() else {
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
    (scene, camera): (&'a PreparedScene<R>, &PreparedCamera<R>),
    settings: &Settings,
    film: &mut Film,
    part: &FilmPart,
    observer: &'a dyn Observer,
) {
    let (plan, filter_sampler) = (film.plan().clone(), settings.filter.sampler());
    let queue = Mutex::new(WorkQueue::new(film, part));
    // A separate closure: in the loop's condition, the lock would be held until the work is done.
    let exchange = |finished: Option<TileUpdate>| {
        lock_ignoring_poison(&queue).exchange_unit(finished, observer)
    };
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
            let WorkUnit {
                tile,
                replicate,
                samples,
                start,
            } = next;
            let area = plan.tile_rect(tile);
            let job = TileJob::<R, T> {
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
        lock_ignoring_poison(&queue).finish_worker(finished, &tracer.into_light_usage(), observer);
    };
    // Each thread takes the next unit of work from the queue, so that units are finished nearly in
    // order and no thread waits for another. Not a broadcast, which ends only after every thread of
    // the pool has taken part: a caller's pool may have other work.
    rayon::scope(|scope| (0..rayon::current_num_threads()).for_each(|_| scope.spawn(|_| work())));
}

fn lock_ignoring_poison<'a, T>(mutex: &'a Mutex<T>) -> MutexGuard<'a, T> {
    mutex
        .lock()
        .unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// Returns the coverage and the shadow of a sample, as whole numbers from 0 to 65536, which the
/// film sums.
#[inline(always)]
fn quantise_coverage_and_shadow<R: Real>(path_result: &PathResult<R>) -> [u32; 2] {
    [
        quantise_coverage(path_result.coverage),
        quantise_coverage(path_result.shadow),
    ]
}

/// A unit of work: a range of samples of one tile in one replicate.
struct TileJob<'a, R: Real, T> {
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

impl<'t, R: Real, T: LightTransport<'t, R>> TileJob<'_, R, T> {
    /// Renders the unit of work; `None` if the observer stopped the render before the unit's end.
    fn run(&self, start: &ReplicateBuffer, tracer: &mut T) -> Option<TileUpdate> {
        match self.plan.random {
            true => self.accumulate_pixels::<MomentAccumulator>(start, tracer),
            false => self.accumulate_pixels::<SumAccumulator<R>>(start, tracer),
        }
    }

    fn accumulate_pixels<B: BlockAccumulator<R>>(
        &self,
        start: &ReplicateBuffer,
        tracer: &mut T,
    ) -> Option<TileUpdate> {
        let pixels = self.area.width as usize * self.area.height as usize;
        let mut buffer = ReplicateBuffer::with_capacity(self.plan, pixels);
        let mut spread = Vec::with_capacity(if self.plan.random { pixels } else { 0 });
        let (mut dropped, hit_count);
        let mut finish = |buffer: &mut ReplicateBuffer, pixel: PixelSums| {
            buffer.push_pixel(self.plan, &pixel, self.samples.end);
            if self.plan.random {
                spread.push(pixel.spread);
            }
        };
        match self.settings.sampling {
            Sampling::Pattern(SamplePattern::Corners) => {
                (dropped, hit_count) = self.average_corner_samples::<B>(tracer, &mut buffer, finish)
            }
            Sampling::Pattern(SamplePattern::Centre) | Sampling::General(_) => {
                dropped = 0;
                let mut firsts = FirstHitSums::new(self.plan);
                let (mut pixel, mut ahead) = (
                    SampleAccumulator::<R, B>::default(),
                    SampleStream::default(),
                );
                let mut position = 0;
                for y in self.pixel_rows() {
                    // Checked once a row: a tile of many samples may take seconds.
                    if self.observer.is_cancelled() {
                        return None;
                    }
                    for x in self.pixel_columns() {
                        if self.samples.start > 0 {
                            pixel.resume_pixel(
                                start.pixel_sums(position, self.samples.start),
                                self.samples.start,
                            );
                            firsts.resume_pixel(start, position);
                        }
                        position += 1;
                        for index in self.samples.clone() {
                            let make = |maximum, samples: &mut SampleBatch<_>| {
                                self.generate_samples([x, y], index, maximum, samples)
                            };
                            let Some(path_result) = ahead.next_result(tracer, make) else {
                                break;
                            };
                            let entered = pixel.add_sample(
                                path_result.radiance,
                                quantise_coverage_and_shadow(&path_result),
                            );
                            dropped += u64::from(!entered);
                            firsts.add_sample(|| ahead.first_hit_and_emission(), entered);
                        }
                        finish(&mut buffer, pixel.finish_pixel());
                        firsts.push_pixel(&mut buffer);
                    }
                }
                hit_count = pixel.hits;
            }
        }
        let centre = if self.replicate == 0 && self.samples.start == 0 {
            self.trace_centre_layers(tracer)
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
    fn pixel_rows(&self) -> Range<u32> {
        let first = self.plan.crop.y + self.area.y;
        first..first + self.area.height
    }

    /// Returns the range of the tile's pixel columns in the whole picture.
    fn pixel_columns(&self) -> Range<u32> {
        let first = self.plan.crop.x + self.area.x;
        first..first + self.area.width
    }

    /// Computes the tile's pixels as the means of samples at their four corners. Returns the number
    /// of dropped samples, and of samples that hit a surface.
    fn average_corner_samples<B: BlockAccumulator<R>>(
        &self,
        tracer: &mut T,
        buffer: &mut ReplicateBuffer,
        mut finish: impl FnMut(&mut ReplicateBuffer, PixelSums),
    ) -> (u64, u64) {
        let (lattice, hits) = self.trace_corners(tracer);
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
                    .map(|&(radiance, shares)| pixel.add_sample(radiance, shares));
                dropped += entered.iter().filter(|entered| !**entered).count() as u64;
                finish(buffer, pixel.finish_pixel());
                if !hits.is_empty() {
                    let top = y * row + x;
                    for (position, entered) in [top + row, top + row + 1, top, top + 1]
                        .into_iter()
                        .zip(entered)
                    {
                        firsts
                            .add_sample(|| (hits[position].0.as_ref(), hits[position].1), entered);
                    }
                    firsts.push_pixel(buffer);
                }
            }
        }
        (dropped, pixel.hits)
    }

    /// Traces the corners of the tile's pixels, each once for the up to four pixels that share it,
    /// and returns their radiance and coverage. If layers need them, also returns the first hits
    /// and the directly visible radiance.
    #[expect(clippy::type_complexity, reason = "two lists for one caller")]
    fn trace_corners(
        &self,
        tracer: &mut T,
    ) -> (Vec<(R::Vec3, [u32; 2])>, Vec<(Option<FirstHit>, [f64; 3])>) {
        // Corners are one more than pixels in each direction.
        let inclusive = |range: Range<u32>| range.start..range.end + 1;
        let (columns, rows) = (
            inclusive(self.pixel_columns()),
            inclusive(self.pixel_rows()),
        );
        let count = columns.len() * rows.len();
        let requested = !self.plan.layers.mean.is_empty();
        let (mut corners, mut hits) = (
            Vec::with_capacity(count),
            Vec::with_capacity(if requested { count } else { 0 }),
        );
        let mut ahead = SampleStream::default();
        for y in rows {
            for x in columns.clone() {
                let at = |v: u32| R::from_f64(f64::from(v));
                let make = |maximum, samples: &mut SampleBatch<_>| {
                    samples.addresses.extend(
                        (x..columns.end)
                            .take(maximum)
                            .map(|x| self.sample_address(x, y, 0)),
                    );
                    samples.rays.extend(
                        (x..columns.end)
                            .take(maximum)
                            .map(|x| self.camera.generate_ray(at(x), at(y), [0.5; 2])),
                    );
                };
                let Some(path_result) = ahead.next_result(tracer, make) else {
                    break;
                };
                corners.push((
                    path_result.radiance,
                    quantise_coverage_and_shadow(&path_result),
                ));
                if requested {
                    let (first, direct) = ahead.first_hit_and_emission();
                    hits.push((first.copied(), direct));
                }
            }
        }
        (corners, hits)
    }

    fn sample_address(&self, x: u32, y: u32, index: u32) -> SampleAddress {
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
    fn generate_samples(
        &self,
        [x, y]: [u32; 2],
        index: u32,
        maximum: usize,
        samples: &mut SampleBatch<R>,
    ) {
        // A packet holds camera rays of a single row with a common origin.
        let end = if T::MAX_BATCH > PACKET {
            self.pixel_rows().end
        } else {
            y + 1
        };
        let pixels = (y..end).flat_map(|row| {
            (if row == y {
                x
            } else {
                self.pixel_columns().start
            }..self.pixel_columns().end)
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
            let first = self.sample_address(pixel[0], pixel[1], 0);
            addresses.extend((from..until).map(|index| SampleAddress { index, ..first }));
            if by_chance {
                // A replicate has no more samples than a sequence has points.
                let sequence = SampleSequence::from_address(first, SamplePurpose::Pixel);
                sequences.extend((from..until).map(|index| (sequence, index)));
            }
            if addresses.len() == maximum {
                break;
            }
        }
        if by_chance {
            sample_4d_batch(sequences.iter().copied(), places);
            rays.extend(
                addresses
                    .iter()
                    .zip(&*places)
                    .map(|(&address, &[u, v, ..])| {
                        let [u, v] = [u, v].map(|number| self.filter_sampler.sample(number));
                        self.generate_camera_ray(address, [u, v])
                    }),
            );
        } else {
            rays.extend(
                addresses
                    .iter()
                    .map(|&address| self.generate_camera_ray(address, [0.5; 2])),
            );
        }
    }

    /// Generates the camera ray of a sample through a position in its pixel, from 0 to 1 for the
    /// box filter; wider filters reach beyond the pixel.
    #[inline]
    fn generate_camera_ray(&self, address: SampleAddress, [u, v]: [f32; 2]) -> Ray<R> {
        let [x, y] = address.pixel;
        let camera = self.camera;
        let lens = if camera.has_lens() {
            sample_2d(address, SamplePurpose::Lens)
        } else {
            [0.5; 2]
        };
        let share = if camera.has_shutter() {
            sample_2d(address, SamplePurpose::Time)[0]
        } else {
            0.0
        };
        let at = |v: u32, offset: f32| R::from_f64(f64::from(v)) + R::from_f32(offset);
        camera.generate_timed_ray(at(x, u), at(y, v), lens, share)
    }

    /// Traces rays through the pixel centres, for the layers of first hits that need them, and
    /// returns these layers.
    fn trace_centre_layers(&self, tracer: &mut T) -> Vec<Vec<f32>> {
        let layers = &self.plan.layers.centre;
        let mut buffers = vec![Vec::new(); layers.len()];
        if layers.is_empty() {
            return buffers;
        }
        for (x, y) in self
            .pixel_rows()
            .flat_map(|y| self.pixel_columns().map(move |x| (x, y)))
        {
            let at = |v: u32| R::from_f64(f64::from(v) + 0.5);
            let first =
                tracer.trace_first_hit(self.camera.generate_timed_ray(at(x), at(y), [0.5; 2], 0.0));
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
