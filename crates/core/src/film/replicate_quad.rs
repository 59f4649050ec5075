//! The replicates of a film as four of each pixel, with what its layers say of them: what a
//! denoiser reads.

use super::{Film, ReplicateBuffer};
use crate::denoise::demand::FOUR;
use crate::settings::Aov;

/// Radiance beyond which nothing is a picture any more; its square is still a number of f32.
pub(crate) const BRIGHTEST: f64 = 1e15;

/// What is missing in a film.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum QuadError {
    /// A layer.
    Layer(Aov),
    /// Replicates of some pixels.
    Replicates,
}

/// The four replicates of a film's pixels. Where a film has more, every fourth one is of the same.
pub(crate) struct ReplicateQuad<'a> {
    film: &'a Film,
    planes: Vec<&'a ReplicateBuffer>,
    emission: usize,
    albedo: usize,
    normal: usize,
    depth: usize,
}

/// Finite, and no brighter than a picture can be.
fn clamp_to_picture(number: f64) -> f64 {
    if number.is_nan() {
        0.0
    } else {
        number.clamp(-BRIGHTEST, BRIGHTEST)
    }
}

impl Film {
    /// Its replicates as four, if there are as many and all layers.
    pub(crate) fn replicate_quad(&self) -> Result<ReplicateQuad<'_>, QuadError> {
        let layers = &self.plan.layers;
        let mean = |aov| {
            layers
                .mean
                .iter()
                .position(|(layer, _)| *layer == aov)
                .ok_or(QuadError::Layer(aov))
        };
        let (emission, albedo, normal) =
            (mean(Aov::Emission)?, mean(Aov::Albedo)?, mean(Aov::Normal)?);
        let depth = layers
            .centre
            .iter()
            .position(|(layer, _)| *layer == Aov::Depth)
            .ok_or(QuadError::Layer(Aov::Depth))?;
        let planes: Vec<&ReplicateBuffer> = self.planes.iter().flatten().collect();
        let each = || {
            (0..self.plan.tiles())
                .flat_map(|tile| (0..self.plan.replicates).map(move |r| (tile, r)))
        };
        if planes.len() < FOUR || each().any(|(tile, replicate)| self.drawn(tile, replicate) == 0) {
            return Err(QuadError::Replicates);
        }
        Ok(ReplicateQuad {
            film: self,
            planes,
            emission,
            albedo,
            normal,
            depth,
        })
    }
}

impl ReplicateQuad<'_> {
    /// Means of a pixel in each of the four, by sums and how many are in them. One of which nothing
    /// is there has the mean of the others.
    #[inline]
    fn means(&self, sums: impl Fn(usize, &ReplicateBuffer) -> ([f64; 3], f64)) -> [[f64; 3]; FOUR] {
        let (mut total, mut count) = ([[0.0; 3]; FOUR], [0.0; FOUR]);
        for (replicate, plane) in self.planes.iter().enumerate() {
            let (sum, n) = sums(replicate, plane);
            (0..3).for_each(|i| total[replicate % FOUR][i] += sum[i]);
            count[replicate % FOUR] += n;
        }
        if count.iter().all(|&count| count > 0.0) {
            return core::array::from_fn(|r| {
                core::array::from_fn(|i| clamp_to_picture(total[r][i] / count[r]))
            });
        }
        let all = count.iter().sum::<f64>().max(1.0);
        let mean: [f64; 3] =
            core::array::from_fn(|i| total.iter().map(|sum| sum[i]).sum::<f64>() / all);
        core::array::from_fn(|r| {
            if count[r] > 0.0 {
                total[r].map(|sum| clamp_to_picture(sum / count[r]))
            } else {
                mean.map(clamp_to_picture)
            }
        })
    }

    /// Radiance.
    pub fn radiance(&self, pixel: usize) -> [[f64; 3]; FOUR] {
        self.means(|_, plane| (plane.total(pixel), f64::from(plane.samples[pixel])))
    }

    /// What camera rays saw without light from elsewhere.
    pub fn emission(&self, pixel: usize) -> [[f64; 3]; FOUR] {
        self.means(|_, plane| {
            (
                plane.layers[self.emission][pixel],
                f64::from(plane.samples[pixel]),
            )
        })
    }

    /// Base colour and normal of what was hit first.
    pub fn surface(&self, pixel: usize) -> [[[f64; 3]; FOUR]; 2] {
        let tile = self.film.plan.tile_of(pixel);
        let drawn = |replicate: usize| f64::from(self.film.drawn(tile, replicate as u32));
        [self.albedo, self.normal].map(|layer| {
            self.means(|replicate, plane| (plane.layers[layer][pixel], drawn(replicate)))
        })
    }

    /// How far it is; less than zero where nothing was hit.
    pub fn depth(&self, pixel: usize) -> f32 {
        self.film.centre[self.depth][pixel]
    }
}
