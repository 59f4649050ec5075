//! Four replicates of each pixel, with their layers: the input of the denoiser.

use super::{Film, ReplicateBuffer};
use crate::denoise::requirements::REPLICATE_COUNT;
use crate::settings::Aov;

/// Greatest usable radiance of a picture. Its square is finite in `f32`.
pub(crate) const BRIGHTEST: f64 = 1e15;

/// Reason why a film cannot be denoised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FourReplicatesError {
    /// This layer is missing.
    Layer(Aov),
    /// Some tiles have fewer than four replicates with samples.
    Replicates,
}

/// Four replicates of each pixel. Replicate r of the film is merged into replicate r mod 4.
pub(crate) struct FourReplicates<'a> {
    film: &'a Film,
    buffers: Vec<&'a ReplicateBuffer>,
    /// Index of the emission in the film's layers of means.
    emission: usize,
    /// Index of the base colour in the film's layers of means.
    albedo: usize,
    /// Index of the normal in the film's layers of means.
    normal: usize,
    /// Index of the depth in the film's layers of pixel-centre rays.
    depth: usize,
}

/// Clamps a number to ±[`BRIGHTEST`]. Returns zero for NaN.
fn clamp_to_usable_range(number: f64) -> f64 {
    if number.is_nan() {
        0.0
    } else {
        number.clamp(-BRIGHTEST, BRIGHTEST)
    }
}

impl Film {
    /// Returns the film's replicates, merged into four. Fails if the film has fewer than four
    /// replicates, if a tile has no samples in a replicate, or if a layer needed by the denoiser is
    /// missing.
    pub(crate) fn merge_into_four_replicates(
        &self,
    ) -> Result<FourReplicates<'_>, FourReplicatesError> {
        let layers = &self.plan.layers;
        let mean = |aov| {
            layers
                .mean
                .iter()
                .position(|(layer, _)| *layer == aov)
                .ok_or(FourReplicatesError::Layer(aov))
        };
        let (emission, albedo, normal) =
            (mean(Aov::Emission)?, mean(Aov::Albedo)?, mean(Aov::Normal)?);
        let depth = layers
            .centre
            .iter()
            .position(|(layer, _)| *layer == Aov::Depth)
            .ok_or(FourReplicatesError::Layer(Aov::Depth))?;
        let buffers: Vec<&ReplicateBuffer> = self.buffers.iter().flatten().collect();
        let each = || {
            (0..self.plan.tile_count())
                .flat_map(|tile| (0..self.plan.replicates).map(move |r| (tile, r)))
        };
        if buffers.len() < REPLICATE_COUNT
            || each().any(|(tile, replicate)| self.samples_drawn(tile, replicate) == 0)
        {
            return Err(FourReplicatesError::Replicates);
        }
        Ok(FourReplicates {
            film: self,
            buffers,
            emission,
            albedo,
            normal,
            depth,
        })
    }
}

impl FourReplicates<'_> {
    /// Returns a pixel's mean in each of the four replicates. `sums` returns the pixel's sum and
    /// its number of samples in a buffer. A replicate without samples receives the mean of the
    /// other replicates.
    #[inline]
    fn replicate_means(
        &self,
        sums: impl Fn(usize, &ReplicateBuffer) -> ([f64; 3], f64),
    ) -> [[f64; 3]; REPLICATE_COUNT] {
        let (mut total, mut count) = ([[0.0; 3]; REPLICATE_COUNT], [0.0; REPLICATE_COUNT]);
        for (replicate, buffer) in self.buffers.iter().enumerate() {
            let (sum, n) = sums(replicate, buffer);
            (0..3).for_each(|i| total[replicate % REPLICATE_COUNT][i] += sum[i]);
            count[replicate % REPLICATE_COUNT] += n;
        }
        if count.iter().all(|&count| count > 0.0) {
            return core::array::from_fn(|r| {
                core::array::from_fn(|i| clamp_to_usable_range(total[r][i] / count[r]))
            });
        }
        let all = count.iter().sum::<f64>().max(1.0);
        let mean: [f64; 3] =
            core::array::from_fn(|i| total.iter().map(|sum| sum[i]).sum::<f64>() / all);
        core::array::from_fn(|r| {
            if count[r] > 0.0 {
                total[r].map(|sum| clamp_to_usable_range(sum / count[r]))
            } else {
                mean.map(clamp_to_usable_range)
            }
        })
    }

    /// Returns a pixel's mean radiance in each of the four replicates.
    pub fn radiance(&self, pixel: usize) -> [[f64; 3]; REPLICATE_COUNT] {
        self.replicate_means(|_, buffer| {
            (buffer.pixel_total(pixel), f64::from(buffer.samples[pixel]))
        })
    }

    /// Returns the mean emission that the camera sees directly in a pixel, in each of the four
    /// replicates.
    pub fn emission(&self, pixel: usize) -> [[f64; 3]; REPLICATE_COUNT] {
        self.replicate_means(|_, buffer| {
            (
                buffer.layers[self.emission][pixel],
                f64::from(buffer.samples[pixel]),
            )
        })
    }

    /// Returns a pixel's mean base colour and mean normal at first hits, each in the four
    /// replicates.
    pub fn albedo_and_normal(&self, pixel: usize) -> [[[f64; 3]; REPLICATE_COUNT]; 2] {
        let tile = self.film.plan.tile_of_pixel(pixel);
        let drawn = |replicate: usize| f64::from(self.film.samples_drawn(tile, replicate as u32));
        [self.albedo, self.normal].map(|layer| {
            self.replicate_means(|replicate, buffer| {
                (buffer.layers[layer][pixel], drawn(replicate))
            })
        })
    }

    /// Returns the distance to the first hit of the camera ray through the pixel's centre; negative
    /// without a hit.
    pub fn depth(&self, pixel: usize) -> f32 {
        self.film.centre_layers[self.depth][pixel]
    }
}
