//! Candidates: the changes of a pixel's colour that denoising may apply, fully or in part. They are
//! filtered reflected light, filtered directly visible emission, and dimmed fireflies.

use core::array::from_fn;

use super::features::{distance_feature, surface_features};
use super::filter::{
    FAR_OFFSETS, FilterOutput, FilterWorkspace, NEAR_OFFSETS, filter_non_local_means,
};
use super::guide::{FilterGuide, FilterTolerance};
use super::plane::{
    ColourPlanes, PixelPlane, Window, black_planes, brightest_channel, mean_colour,
    smooth_variance, variance_of_mean,
};
use super::{FourReplicates, PixelCandidates, REPLICATE_COUNT, TILE};
use crate::observer::Observer;

/// Offset added to the albedo before reflected light is divided by it, because surfaces with a
/// black base colour reflect light too.
const LEAST_ALBEDO: f32 = 0.1;

/// Limit of a pixel's brightness, beyond which it is dimmed as a firefly. The limit is this factor
/// times the brightest nearby pixel in other replicates, plus a small offset.
const FIREFLY_FACTOR: f32 = 1.2;
const FIREFLY_OFFSET: f32 = 0.02;

/// Tolerances of the two filter passes: differences of 1 and of 1.5 standard deviations beyond the
/// noise. The first pass may leave more noise, because its result only guides the second.
const FIRST_PASS: FilterTolerance = FilterTolerance {
    inverse_tolerance: 1.0,
    own_share: 0.0,
};
const SECOND_PASS: FilterTolerance = FilterTolerance {
    inverse_tolerance: 1.0 / (1.5 * 1.5),
    own_share: 0.5,
};

/// Variance of the noise in the second pass's guide, as a factor on the squared colour: the noise
/// counts as 4 % of the colour.
const GUIDE_NOISE_SHARE: f32 = 0.04 * 0.04;

/// Largest weight of a pixel in its own filtered value, 0 to 1, with which the pixel is removed
/// from that value for the leave-one-out colour. With a larger weight the value stays.
const MAX_OWN_WEIGHT: f32 = 0.9;

/// Distances in pixels within which inputs affect a filtered pixel: the second pass with its
/// compared patches; also the variance of the second guide; also the first pass with the variances
/// of dimmed fireflies.
const SECOND_REACH: usize = 5;
const GUIDE_REACH: usize = SECOND_REACH + 2;
const MARGIN: usize = GUIDE_REACH + 3 + 2 + 1;

/// Inputs of the filter in a window of the picture: light and surface features of all four
/// replicates.
struct WindowReplicates {
    /// Reflected light, directly visible emission, albedo and normal of each replicate.
    light: [ColourPlanes; REPLICATE_COUNT],
    emission: [ColourPlanes; REPLICATE_COUNT],
    albedo: [ColourPlanes; REPLICATE_COUNT],
    normal: [ColourPlanes; REPLICATE_COUNT],
    /// Feature of the surface distance, and the inverse of its tolerated squared difference.
    distance: (PixelPlane, PixelPlane),
    /// Noise of each replicate: difference of its radiance from the mean of all four.
    noise: [ColourPlanes; REPLICATE_COUNT],
}

impl WindowReplicates {
    /// Reads the planes of a window from the film's four replicates.
    fn from_replicates(four: &FourReplicates<'_>, window: Window, width: usize) -> Self {
        let all = || -> [ColourPlanes; REPLICATE_COUNT] {
            from_fn(|_| black_planes([window.width, window.height]))
        };
        let mut depth = PixelPlane::zero(window.width, window.height);
        let [light, emission, albedo, normal, noise] = [(); 5].map(|()| all());
        let mut tile = Self {
            light,
            emission,
            albedo,
            normal,
            distance: (depth.clone(), depth.clone()),
            noise,
        };
        for i in 0..window.pixel_count() {
            let pixel = (window.y + i / window.width) * width + window.x + i % window.width;
            let (radiance, emission, [albedo, normal]) = (
                four.radiance(pixel),
                four.emission(pixel),
                four.albedo_and_normal(pixel),
            );
            for channel in 0..3 {
                let mean = radiance.iter().map(|value| value[channel]).sum::<f64>()
                    / REPLICATE_COUNT as f64;
                for r in 0..REPLICATE_COUNT {
                    tile.light[r][channel].values[i] =
                        (radiance[r][channel] - emission[r][channel]) as f32;
                    tile.emission[r][channel].values[i] = emission[r][channel] as f32;
                    tile.albedo[r][channel].values[i] = albedo[r][channel] as f32;
                    tile.normal[r][channel].values[i] = normal[r][channel] as f32;
                    tile.noise[r][channel].values[i] = (radiance[r][channel] - mean) as f32;
                }
            }
            depth.values[i] = four.depth(pixel);
        }
        tile.distance = distance_feature(&depth);
        tile
    }

    /// Whether reflected light is black in every replicate and pixel of the window.
    fn has_no_reflected_light(&self) -> bool {
        let planes = self.light.iter().flatten();
        planes.flat_map(|plane| &plane.values).all(|of| *of == 0.0)
    }

    /// Sets the pixels of a window without reflected light to their emission, with no candidate
    /// change. The emission must be free of noise.
    fn copy_emission(&self, part: Window, out: &mut [PixelCandidates]) {
        let width = self.emission[0][0].width;
        for (index, out) in out.iter_mut().enumerate() {
            let position = (part.y + index / part.width) * width + part.x + index % part.width;
            for of in &self.emission {
                (0..3).for_each(|i| {
                    out.base_colour[i] += of[i].values[position] / REPLICATE_COUNT as f32
                });
            }
        }
    }

    /// Whether directly visible emission is noisy: in some pixel of the window, replicates differ.
    fn has_noisy_emission(&self) -> bool {
        let [first, others @ ..] = &self.emission;
        others
            .iter()
            .any(|other| first.iter().zip(other).any(|(a, b)| a.values != b.values))
    }
}

/// Computes the candidates of a band of rows, tile by tile. `top` is the band's first row in the
/// picture.
pub(super) fn compute_candidates_of_rows(
    four: &FourReplicates<'_>,
    size: [usize; 2],
    top: usize,
    pixels: &mut [PixelCandidates],
    observer: &dyn Observer,
) {
    let [width, _] = size;
    let height = pixels.len() / width;
    let mut workspace = FilterWorkspace::default();
    for x in (0..width).step_by(TILE[0]) {
        if observer.is_cancelled() {
            return;
        }
        let core = Window {
            x,
            y: top,
            width: TILE[0].min(width - x),
            height,
        };
        let window = core.grow(MARGIN, size);
        let tile = WindowReplicates::from_replicates(four, window, width);
        let mut out = vec![PixelCandidates::default(); core.pixel_count()];
        if tile.has_no_reflected_light() && !tile.has_noisy_emission() {
            tile.copy_emission(core.relative_to(window), &mut out);
        } else {
            for [filtered, by] in [[[0, 1], [2, 3]], [[2, 3], [0, 1]]] {
                tile.filter_pair_by_opposite_pair(
                    (filtered, by),
                    (core, window, size),
                    &mut workspace,
                    &mut out,
                );
            }
        }
        for (row, out) in out.chunks_exact(core.width).enumerate() {
            pixels[row * width + x..][..core.width].copy_from_slice(out);
        }
    }
}

/// Two filtered replicates of a window.
struct FilteredPair {
    /// Indices of these two among the four replicates of the window.
    filtered: [usize; 2],
    /// Light of the replicates with dimmed fireflies.
    targets: [ColourPlanes; 2],
    /// Albedo of the replicates, increased so that it is never zero. Light is divided by it before
    /// the filter.
    floors: [ColourPlanes; 2],
    /// `targets` divided by `floors`.
    divided: [ColourPlanes; 2],
    /// Filtered light, still divided by `floors`.
    light: FilterOutput,
    /// Filtered emission; `None` if the emission has no noise.
    emission: Option<FilterOutput>,
}

impl WindowReplicates {
    /// Filters two replicates, with indices `filtered`, by weights computed from the two replicates
    /// `by`. Adds the changes to the candidates `out` of the tile `core`.
    fn filter_pair_by_opposite_pair(
        &self,
        (filtered, by): ([usize; 2], [usize; 2]),
        (core, window, size): (Window, Window, [usize; 2]),
        workspace: &mut FilterWorkspace,
        out: &mut [PixelCandidates],
    ) {
        let places = [GUIDE_REACH, 0].map(|reach| core.grow(reach, size).relative_to(window));
        let [one, other] = by;
        // Each replicate of `by` is limited by its partner, and the filtered replicates by both of
        // `by`.
        let limits = by.map(|r| brightest_channel(&self.light[r]));
        let guides = [0, 1].map(|k: usize| dim_fireflies(&self.light[by[k]], &limits[1 - k]));
        let limit = PixelPlane::map_planes(
            [
                &brightest_channel(&guides[0]),
                &brightest_channel(&guides[1]),
            ],
            |[a, b]| a.max(b),
        );
        let targets = filtered.map(|r| dim_fireflies(&self.light[r], &limit));
        let albedo = [&self.albedo[one], &self.albedo[other]];
        let normal = [&self.normal[one], &self.normal[other]];
        let floor = mean_colour(albedo)
            .map(|plane| PixelPlane::map_planes([&plane], |[a]| a + LEAST_ALBEDO));
        let floors = filtered.map(|r| {
            from_fn(|i| {
                PixelPlane::map_planes(
                    [&self.albedo[r][i], &albedo[0][i], &albedo[1][i]],
                    |[a, b, c]| (a + b + c) / 3.0 + LEAST_ALBEDO,
                )
            })
        });
        let over = |of: &ColourPlanes, floor: &ColourPlanes| -> ColourPlanes {
            from_fn(|i| PixelPlane::map_planes([&of[i], &floor[i]], |[a, b]| a / b))
        };
        let guides = guides.each_ref().map(|guide| over(guide, &floor));
        let divided: [ColourPlanes; 2] = from_fn(|k| over(&targets[k], &floors[k]));
        let of_light = surface_features(albedo, normal, &self.distance, false);
        let light = run_both_filter_passes(
            guides.each_ref(),
            divided.each_ref(),
            &of_light,
            places,
            workspace,
        );
        let emission = self.has_noisy_emission().then(|| {
            let of_emission = surface_features(albedo, normal, &self.distance, true);
            let targets = filtered.map(|r| &self.emission[r]);
            run_both_filter_passes(
                [&self.emission[one], &self.emission[other]],
                targets,
                &of_emission,
                places,
                workspace,
            )
        });
        let pair = FilteredPair {
            filtered,
            targets,
            floors,
            divided,
            light,
            emission,
        };
        self.add_candidates(&pair, places[1], window.width, out);
    }

    /// Adds the changes of a filtered pair of replicates to the candidates `out` of the tile
    /// `core`. `width` is the width of the window in pixels.
    fn add_candidates(
        &self,
        pair: &FilteredPair,
        core: Window,
        width: usize,
        out: &mut [PixelCandidates],
    ) {
        let (light, filtered) = (&pair.light, pair.filtered);
        for (index, out) in out.iter_mut().enumerate() {
            let position = (core.y + index / core.width) * width + core.x + index % core.width;
            for k in 0..2 {
                let partner = filtered[1 - k];
                for i in 0..3 {
                    let (dim, floor, own) = (
                        pair.targets[k][i].values[position],
                        pair.floors[k][i].values[position],
                        light.own_weights.values[position],
                    );
                    let mean = light.means[k][i].values[position];
                    let own = if own < MAX_OWN_WEIGHT { own } else { 0.0 };
                    let without =
                        (mean - own * pair.divided[k][i].values[position]) / (1.0 - own) * floor;
                    let seen = self.emission[filtered[k]][i].values[position];
                    let filtered_emission = pair
                        .emission
                        .as_ref()
                        .map_or(seen, |emission| emission.means[k][i].values[position]);
                    let added = [
                        mean * floor - dim,
                        filtered_emission - seen,
                        dim - self.light[filtered[k]][i].values[position],
                    ];
                    out.base_colour[i] += (without + filtered_emission) / REPLICATE_COUNT as f32;
                    let noise = self.noise[partner][i].values[position];
                    for ((sum, apart), added) in
                        out.changes.iter_mut().zip(&mut out.error_terms).zip(added)
                    {
                        sum[i] += added / REPLICATE_COUNT as f32;
                        apart[i] -= added * noise / REPLICATE_COUNT as f32;
                    }
                }
            }
        }
    }
}

/// Returns a picture of light in which fireflies are dimmed. The limit of a pixel is
/// [`FIREFLY_FACTOR`] times the maximum of `limit` over three by three pixels, plus
/// [`FIREFLY_OFFSET`]. A colour whose brightest channel exceeds the limit is scaled down to it.
fn dim_fireflies(light: &ColourPlanes, limit: &PixelPlane) -> ColourPlanes {
    let share = PixelPlane::map_planes(
        [&brightest_channel(light), &limit.max_filter()],
        |[own, near]| ((FIREFLY_FACTOR * near.max(0.0) + FIREFLY_OFFSET) / own.max(1e-9)).min(1.0),
    );
    from_fn(|i| PixelPlane::map_planes([&light[i], &share], |[of, share]| of * share))
}

/// Runs both filter passes. The first pass filters the guides by themselves; the second filters the
/// targets by the result of the first. `places` holds the windows that each pass computes.
fn run_both_filter_passes(
    guides: [&ColourPlanes; 2],
    targets: [&ColourPlanes; 2],
    features: &[(PixelPlane, PixelPlane)],
    places: [Window; 2],
    workspace: &mut FilterWorkspace,
) -> FilterOutput {
    let colour = mean_colour(guides);
    let noise = smooth_variance(&variance_of_mean(guides));
    let inverse_noise = PixelPlane::map_planes([&noise], |[v]| 1.0 / (v + 1e-8));
    let first = FilterGuide {
        colour: &colour,
        variance: &noise,
        noise: &noise,
        inverse_noise: &inverse_noise,
        features,
        strictness: FIRST_PASS,
    };
    let [one, other] =
        filter_non_local_means(&first, guides, places[0], &NEAR_OFFSETS, workspace).means;
    let colour = mean_colour([&one, &other]);
    let own = smooth_variance(&variance_of_mean([&one, &other]));
    let unsure = PixelPlane::map_planes(
        [&own, &colour[0], &colour[1], &colour[2]],
        |[v, r, g, b]| v + GUIDE_NOISE_SHARE * (r * r + g * g + b * b) + 1e-7,
    );
    let second = FilterGuide {
        colour: &colour,
        variance: &unsure,
        noise: &noise,
        inverse_noise: &inverse_noise,
        features,
        strictness: SECOND_PASS,
    };
    filter_non_local_means(&second, targets, places[1], &FAR_OFFSETS, workspace)
}
