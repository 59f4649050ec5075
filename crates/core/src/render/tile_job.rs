//! Job of a thread: the samples of one tile, accumulated pixel by pixel.

use core::marker::PhantomData;
use core::ops::Range;

use raywright_bvh::Real;

use super::output::FirstHitSums;
use super::sample_stream::{SampleBatch, SampleStream};
use crate::camera::PreparedCamera;
use crate::counters::Counters;
use crate::film::{
    BlockAccumulator, FilmPlan, MomentAccumulator, PixelSums, ReplicateBuffer, SampleAccumulator,
    SumAccumulator, TileUpdate, quantise_coverage,
};
use crate::filter::FilterSampler;
use crate::integrator::{LightTransport, PathResult};
use crate::observer::Observer;
use crate::scene::SamplePattern;
use crate::settings::{Aov, Crop, Sampling, Settings};

/// Job of a thread: a range of samples of one tile in one replicate (independent part of the
/// samples).
pub(super) struct TileJob<'a, R: Real, T> {
    pub camera: &'a PreparedCamera<R>,
    pub settings: &'a Settings,
    pub plan: &'a FilmPlan,
    pub filter_sampler: &'a FilterSampler,
    /// Rectangle of the tile, relative to the crop.
    pub area: Crop,
    pub tile: u32,
    pub replicate: u32,
    pub samples: Range<u32>,
    pub observer: &'a dyn Observer,
    pub transport: PhantomData<T>,
}

impl<'t, R: Real, T: LightTransport<'t, R>> TileJob<'_, R, T> {
    /// Renders the job. `None` if the observer stopped the render before its end.
    pub fn run(&self, start: &ReplicateBuffer, tracer: &mut T) -> Option<TileUpdate> {
        match self.plan.random {
            true => self.accumulate_pixels::<MomentAccumulator>(start, tracer),
            false => self.accumulate_pixels::<SumAccumulator<R>>(start, tracer),
        }
    }

    /// Renders the job with `B`, the kind of accumulator for blocks of samples.
    fn accumulate_pixels<B: BlockAccumulator<R>>(
        &self,
        start: &ReplicateBuffer,
        tracer: &mut T,
    ) -> Option<TileUpdate> {
        let pixels = self.area.width as usize * self.area.height as usize;
        let mut buffer = ReplicateBuffer::with_capacity(self.plan, pixels);
        let mut spread = Vec::with_capacity(if self.plan.random { pixels } else { 0 });
        let finish = |buffer: &mut ReplicateBuffer, pixel: PixelSums| {
            buffer.push_pixel(self.plan, &pixel, self.samples.end);
            if self.plan.random {
                spread.push(pixel.spread);
            }
        };
        let (dropped, hit_count) = match self.settings.sampling {
            Sampling::Pattern(SamplePattern::Corners) => {
                self.average_corner_samples::<B>(tracer, &mut buffer, finish)
            }
            Sampling::Pattern(SamplePattern::Centre) | Sampling::General(_) => {
                self.average_pixel_samples::<B>(start, tracer, &mut buffer, finish)?
            }
        };
        let centre = if self.replicate == 0 && self.samples.start == 0 {
            self.trace_centre_layers(tracer)?
        } else {
            Vec::new()
        };
        if tracer.is_cancelled() {
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

    /// Computes the tile's pixels as means of their samples, where `start` holds the sums of
    /// earlier samples. Returns the number of dropped samples and the number of samples that hit a
    /// surface. `None` if the observer stops the render.
    #[inline(always)]
    fn average_pixel_samples<B: BlockAccumulator<R>>(
        &self,
        start: &ReplicateBuffer,
        tracer: &mut T,
        buffer: &mut ReplicateBuffer,
        mut finish: impl FnMut(&mut ReplicateBuffer, PixelSums),
    ) -> Option<(u64, u64)> {
        let mut dropped = 0;
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
                finish(buffer, pixel.finish_pixel());
                firsts.push_pixel(buffer);
            }
        }
        Some((dropped, pixel.hits))
    }

    /// Returns the range of the tile's pixel rows in the whole picture.
    pub fn pixel_rows(&self) -> Range<u32> {
        let first = self.plan.crop.y + self.area.y;
        first..first + self.area.height
    }

    /// Returns the range of the tile's pixel columns in the whole picture.
    pub fn pixel_columns(&self) -> Range<u32> {
        let first = self.plan.crop.x + self.area.x;
        first..first + self.area.width
    }

    /// Traces rays through the pixel centres. Returns the layers of first hits that need such rays.
    /// `None` if the observer stops the render.
    fn trace_centre_layers(&self, tracer: &mut T) -> Option<Vec<Vec<f32>>> {
        let layers = &self.plan.layers.centre;
        let mut buffers = vec![Vec::new(); layers.len()];
        if let Some(edges) = layers.iter().position(|(aov, _)| *aov == Aov::Edges) {
            buffers[edges] = self.trace_feature_edges(tracer)?;
        }
        if layers.iter().all(|(aov, _)| *aov == Aov::Edges) {
            return Some(buffers);
        }
        for (x, y) in self
            .pixel_rows()
            .flat_map(|y| self.pixel_columns().map(move |x| (x, y)))
        {
            let at = |v: u32| R::from_f64(f64::from(v) + 0.5);
            let first =
                tracer.trace_first_hit(self.camera.generate_timed_ray(at(x), at(y), [0.5; 2], 0.0));
            let values = buffers.iter_mut().zip(layers);
            for (buffer, (aov, _)) in values.filter(|(_, (aov, _))| *aov != Aov::Edges) {
                buffer.push(first.as_ref().map_or(-1.0, |f| match aov {
                    Aov::Depth => f.distance as f32,
                    Aov::Object => f.object as f32,
                    _ => f.material as f32,
                }));
            }
        }
        Some(buffers)
    }
}

/// Returns the coverage and the shadow of a sample, as whole numbers from 0 to 65536, which the
/// film sums.
#[inline(always)]
pub(super) fn quantise_coverage_and_shadow<R: Real>(path_result: &PathResult<R>) -> [u32; 2] {
    [
        quantise_coverage(path_result.coverage),
        quantise_coverage(path_result.shadow),
    ]
}
