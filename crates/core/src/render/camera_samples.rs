//! Addresses and camera rays of a tile's samples.

use raywright_bvh::{Ray, Real};

use super::sample_stream::SampleBatch;
use super::tile_job::TileJob;
use crate::integrator::{LightTransport, PACKET};
use crate::sampler::{SampleAddress, SamplePurpose, SampleSequence, sample_2d, sample_4d_batch};
use crate::settings::Settings;

impl<'t, R: Real, T: LightTransport<'t, R>> TileJob<'_, R, T> {
    /// Returns the address of a sample of a pixel.
    pub(super) fn sample_address(&self, x: u32, y: u32, index: u32) -> SampleAddress {
        let Settings {
            seed,
            frame,
            sampler,
            ..
        } = *self.settings;
        let (net, index) = self.plan.net_and_index(self.replicate, index);
        SampleAddress {
            seed,
            frame,
            sampler,
            pixel: [x, y],
            replicate: net,
            index,
            ..SampleAddress::default()
        }
    }

    /// Generates at most `maximum` samples, starting with sample `index` of a pixel. Then come
    /// samples of the next pixels in its row and, for path tracing, of the next rows.
    pub(super) fn generate_samples(
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
            let indices =
                (from..until).map(|index| self.plan.net_and_index(self.replicate, index).1);
            addresses.extend(
                indices
                    .clone()
                    .map(|index| SampleAddress { index, ..first }),
            );
            if by_chance {
                // A replicate has no more samples than a sequence has points.
                let sequence = SampleSequence::from_address(first, SamplePurpose::Pixel);
                sequences.extend(indices.map(|index| (sequence, index)));
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

    /// Generates the camera ray of a sample. `u` and `v` are its position in pixels, relative to the
    /// upper left corner of the sample's pixel. Both are 0 to 1 for the box filter; wider filters
    /// reach beyond the pixel.
    #[inline(always)]
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
}
