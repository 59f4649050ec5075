//! Computes the picture of a film: colours, coverage, layers and standard errors from the sums.

use serde::{Deserialize, Serialize};

use super::{Film, ReplicateStats};
use crate::picture::{LINE_RADIANCES, Picture, PictureLayer};
use crate::settings::Aov;

impl Film {
    /// Returns the variance of a pixel's samples about their mean, per channel: the variance of a
    /// sample, not of the mean. `None` without random sampling, or with fewer than two samples.
    pub fn pixel_variance(&self, x: u32, y: u32) -> Option<[f64; 3]> {
        if x >= self.plan.crop.width || y >= self.plan.crop.height {
            return None;
        }
        let pixel = y as usize * self.plan.crop.width as usize + x as usize;
        let within = self.spread.get(pixel)?.map(|s| f64::from(s) * f64::from(s));
        let means = self.stats_of_groups(1).replicate_deviations(pixel);
        (means.samples >= 2.0).then(|| {
            core::array::from_fn(|i| {
                (within[i] + means.squared_deviations[i]) / (means.samples - 1.0)
            })
        })
    }

    /// Returns the standard error of each pixel's mean, as in the layer `stderr`, with the degrees
    /// of freedom: one less than the number of replicates. `None` with fewer than two replicates.
    pub fn standard_errors(&self) -> Option<(Vec<[f32; 3]>, u32)> {
        let freedom = (self.plan.replicates / self.plan.replicates_per_net())
            .checked_sub(1)
            .filter(|freedom| *freedom > 0 && self.plan.random)?;
        Some((self.standard_errors_or_unknown(), freedom))
    }

    /// Returns the standard errors of all pixels; −1, for unknown, in a picture in which no sample
    /// found light.
    pub(super) fn standard_errors_or_unknown(&self) -> Vec<[f32; 3]> {
        if self.is_black_despite_lights() {
            return vec![[-1.0; 3]; self.plan.pixel_count()];
        }
        self.replicate_stats()
            .standard_errors(self.plan.pixel_count(), self.plan.crop.width as usize)
    }

    /// Returns the statistics over the film's nets, which are independent.
    pub(super) fn replicate_stats(&self) -> ReplicateStats<'_> {
        self.stats_of_groups(self.plan.replicates_per_net())
    }

    /// Returns the statistics over groups of `count` replicates each.
    pub(super) fn stats_of_groups(&self, count: u32) -> ReplicateStats<'_> {
        let groups = self.buffers.chunks(count as usize);
        ReplicateStats::new(
            groups.map(|group| group.iter().flatten().collect()),
            self.plan.adaptive,
        )
    }

    /// Returns a picture of the means of all pixels, without coverage and layers. The backdrop
    /// behind a ground is included.
    pub(crate) fn mean_colours(&self) -> Picture {
        let (plan, planes) = (&self.plan, self.replicate_stats());
        let mut picture = Picture {
            window: plan.data_window(),
            ..Picture::new(plan.crop.width, plan.crop.height)
        };
        for (pixel, colour) in picture.rgb.iter_mut().enumerate() {
            *colour = planes.mean(pixel).0.map(|c| c as f32);
        }
        picture
    }

    /// Returns the picture of the samples so far. A pixel without its full number of samples has
    /// the mean of those present; it is black without any.
    pub fn picture(&self) -> Picture {
        let (plan, planes) = (&self.plan, self.replicate_stats());
        let all = 0..plan.pixel_count();
        let mut picture = self.mean_colours();
        self.finish_picture(&mut picture);
        let mut layers: Vec<(&str, Vec<f32>)> = Vec::new();
        for (k, (aov, names)) in plan
            .layers
            .mean
            .iter()
            .enumerate()
            .filter(|(_, (aov, _))| plan.shows_layer(*aov))
        {
            let mean = |i: usize| {
                all.clone()
                    .map(|pixel| self.layer_mean(k, *aov, i, pixel))
                    .collect()
            };
            layers.extend(names.iter().enumerate().map(|(i, &name)| (name, mean(i))));
        }
        for (k, (_, name)) in plan
            .layers
            .centre
            .iter()
            .enumerate()
            .filter(|(_, (aov, _))| plan.shows_layer(*aov))
        {
            layers.push((
                name,
                self.centre_layers
                    .get(k)
                    .cloned()
                    .unwrap_or_else(|| vec![0.0; plan.pixel_count()]),
            ));
        }
        if plan.layers.samples {
            layers.push((
                "samples.N",
                all.clone()
                    .map(|pixel| planes.mean(pixel).1 as f32)
                    .collect(),
            ));
        }
        if plan.layers.standard_error {
            let errors = if plan.random {
                self.standard_errors_or_unknown()
            } else {
                vec![[0.0; 3]; plan.pixel_count()]
            };
            let named = ["stderr.R", "stderr.G", "stderr.B"].into_iter().enumerate();
            layers.extend(
                named.map(|(i, name)| (name, errors.iter().map(|error| error[i]).collect())),
            );
        }
        picture.layers = layers
            .into_iter()
            .map(|(name, samples)| PictureLayer {
                name: name.to_owned(),
                samples,
            })
            .collect();
        picture
    }

    /// Completes a picture of the film's colours by its coverage and its feature edges.
    pub(crate) fn finish_picture(&self, picture: &mut Picture) {
        if self.plan.alpha {
            self.subtract_backdrop(picture);
        }
        let lines = self
            .centre_layer(Aov::Edges)
            .filter(|_| self.plan.draws_lines);
        for (pixel, &edge) in (0..).zip(lines.into_iter().flatten()) {
            let (share, radiance) = (edge.abs(), LINE_RADIANCES[usize::from(edge < 0.0)] as f32);
            let rgb: &mut [f32; 3] = &mut picture.rgb[pixel];
            *rgb = rgb.map(|channel| channel + share * (radiance - channel));
            if let Some(alpha) = &mut picture.alpha {
                alpha[pixel] += share * (1.0 - alpha[pixel]);
            }
            if let Some(shadow) = &mut picture.shadow {
                shadow[pixel] *= 1.0 - share;
            }
        }
    }

    /// Returns a layer of pixel-centre rays, if the film has it.
    pub(crate) fn centre_layer(&self, aov: Aov) -> Option<&[f32]> {
        let mut layers = self.plan.layers.centre.iter();
        let index = layers.position(|(layer, _)| *layer == aov)?;
        self.centre_layers.get(index).map(Vec::as_slice)
    }

    /// Returns a layer of means over the samples, if the film has it.
    pub(crate) fn mean_layer(&self, aov: Aov) -> Option<Vec<[f32; 3]>> {
        let mut layers = self.plan.layers.mean.iter();
        let index = layers.position(|(layer, _)| *layer == aov)?;
        let value = |pixel| core::array::from_fn(|i| self.layer_mean(index, aov, i, pixel));
        Some((0..self.plan.pixel_count()).map(value).collect())
    }

    /// Adds the coverage to a picture of the film's colours, and subtracts the backdrop behind a
    /// ground. A pixel of ground alone has no colour; its shadow is computed from the picture's
    /// colour, so that denoising applies to the shadow too.
    fn subtract_backdrop(&self, picture: &mut Picture) {
        let (planes, all) = (self.replicate_stats(), 0..self.plan.pixel_count());
        let mut alpha: Vec<f32> = all
            .clone()
            .map(|pixel| planes.coverage(pixel) as f32)
            .collect();
        if let Some(backdrop) = self.plan.backdrop {
            let shadow = |pixel: usize| {
                let (rgb, covered) = (&mut picture.rgb[pixel], planes.coverage(pixel));
                let seen = rgb.iter().map(|&channel| f64::from(channel)).sum::<f64>() / 3.0;
                let is_drawn = planes.mean(pixel).1 > 0.0;
                let clear = if covered > 0.0 {
                    1.0 - covered - planes.shadow_coverage(pixel)
                } else {
                    seen / backdrop
                }
                .clamp(0.0, 1.0);
                *rgb = rgb.map(|channel| {
                    if covered > 0.0 {
                        (f64::from(channel) - backdrop * clear).max(0.0) as f32
                    } else {
                        0.0
                    }
                });
                if is_drawn {
                    (1.0 - covered - clear).max(0.0) as f32
                } else {
                    0.0
                }
            };
            let shadow: Vec<f32> = all.map(shadow).collect();
            alpha
                .iter_mut()
                .zip(&shadow)
                .for_each(|(alpha, shadow)| *alpha += shadow);
            picture.shadow = Some(shadow);
        }
        picture.alpha = Some(alpha);
    }

    /// Returns the mean of a layer over a pixel's samples, in one channel; replicates are weighted
    /// by their numbers of samples.
    fn layer_mean(&self, layer: usize, aov: Aov, channel: usize, pixel: usize) -> f32 {
        let (mut sum, mut count) = (0.0, 0.0);
        let tile = self.plan.tile_of_pixel(pixel);
        for (replicate, buffer) in (0..).zip(&self.buffers) {
            let Some(buffer) = buffer else { continue };
            let n = match aov {
                Aov::Position => f64::from(buffer.first_hits[pixel]),
                Aov::Emission => f64::from(buffer.samples[pixel]),
                _ => f64::from(self.samples_drawn(tile, replicate)),
            };
            let mean = (buffer.layers[layer][pixel][channel] / f64::max(n, 1.0)) as f32;
            sum += n * f64::from(mean);
            count += n;
        }
        (sum / f64::max(count, 1.0)) as f32
    }
}

// Layers of a film, by the source of their values.

/// Layers of a film by the source of their values, with their channel names in files.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "Vec<Aov>", into = "Vec<Aov>")]
pub(crate) struct FilmLayers {
    pub(super) asked: Vec<Aov>,
    /// Means over the first hits of all samples.
    pub mean: Vec<(Aov, [&'static str; 3])>,
    /// Values at the first hit of the pixel-centre ray, or of a grid of such rays.
    pub centre: Vec<(Aov, &'static str)>,
    /// Whether the film has the layer of sample counts, computed from the pixel's sums.
    pub samples: bool,
    /// Whether the film has the layer of standard errors, computed from the pixel's sums.
    pub standard_error: bool,
}

impl From<FilmLayers> for Vec<Aov> {
    fn from(layers: FilmLayers) -> Self {
        layers.asked
    }
}

impl From<Vec<Aov>> for FilmLayers {
    fn from(requested: Vec<Aov>) -> Self {
        let mut mean = Vec::new();
        let mut centre = Vec::new();
        for &aov in &requested {
            match aov {
                Aov::Albedo => mean.push((aov, ["albedo.R", "albedo.G", "albedo.B"])),
                Aov::Normal => mean.push((aov, ["normal.X", "normal.Y", "normal.Z"])),
                Aov::Position => mean.push((aov, ["position.X", "position.Y", "position.Z"])),
                Aov::Emission => mean.push((aov, ["emission.R", "emission.G", "emission.B"])),
                Aov::Depth => centre.push((aov, "depth.Z")),
                Aov::Object => centre.push((aov, "object.id")),
                Aov::Material => centre.push((aov, "material.id")),
                Aov::Edges => centre.push((aov, "edges.V")),
                Aov::Samples | Aov::StandardError => {}
            }
        }
        let has = |aov| requested.contains(&aov);
        Self {
            mean,
            centre,
            samples: has(Aov::Samples),
            standard_error: has(Aov::StandardError),
            asked: requested,
        }
    }
}
