//! Samples at the corners of pixels, which neighbouring pixels share.

use core::ops::Range;

use raywright_bvh::Real;

use super::output::FirstHitSums;
use super::sample_stream::{SampleBatch, SampleStream};
use super::tile_job::{TileJob, quantise_coverage_and_shadow};
use crate::film::{BlockAccumulator, PixelSums, ReplicateBuffer, SampleAccumulator};
use crate::integrator::{FirstHit, LightTransport};

impl<'t, R: Real, T: LightTransport<'t, R>> TileJob<'_, R, T> {
    /// Computes the tile's pixels as the means of samples at their four corners. Returns the number
    /// of dropped samples, and of samples that hit a surface.
    pub(super) fn average_corner_samples<B: BlockAccumulator<R>>(
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
                // A loop: a closure for `map` would be called, not inlined.
                let mut entered = [false; 4];
                for (entered, &(radiance, shares)) in entered
                    .iter_mut()
                    .zip([&bottom[0], &bottom[1], &top[0], &top[1]])
                {
                    *entered = pixel.add_sample(radiance, shares);
                }
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

    /// Traces a sample at each corner of the tile's pixels. A corner is traced once, although up to
    /// four pixels share it. Returns radiance and coverage of the samples. If layers need them, the
    /// first hits and the directly visible radiance are returned too.
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
}
