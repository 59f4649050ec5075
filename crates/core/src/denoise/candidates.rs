//! Candidates: the changes of a pixel's colour that denoising may apply, fully or in part. They are
//! filtered reflected light, filtered directly visible emission, and dimmed fireflies.

use core::array::from_fn;

use super::features::{distance_feature, surface_features};
use super::filter::{
    FAR_OFFSETS, FilterOutput, FilterWorkspace, NEAR_OFFSETS, filter_non_local_means,
};
use super::guide::FilterGuide;
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
/// times the brightest pixel of the half's other replicate within the reach, plus a small offset.
/// With a reach of 1, light that few samples find is dimmed too much.
const FIREFLY_FACTOR: f32 = 1.2;
const FIREFLY_OFFSET: f32 = 0.02;
const FIREFLY_REACH: usize = 2;

/// Inverse tolerances of the two filter passes: squared differences of 2 and of 2.25 variances
/// beyond the noise.
const FIRST_PASS: f32 = 1.0 / 2.0;
const SECOND_PASS: f32 = 1.0 / (1.5 * 1.5);

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
const MARGIN: usize = GUIDE_REACH + 3 + 2 + FIREFLY_REACH;

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
    /// Difference of the radiance of both halves.
    difference: ColourPlanes,
}

impl WindowReplicates {
    /// Reads the planes of a window from the film's four replicates.
    fn from_replicates(four: &FourReplicates<'_>, window: Window, width: usize) -> Self {
        let all = || -> [ColourPlanes; REPLICATE_COUNT] {
            from_fn(|_| black_planes([window.width, window.height]))
        };
        let mut depth = PixelPlane::zero(window.width, window.height);
        let [light, emission, albedo, normal] = [(); 4].map(|()| all());
        let mut tile = Self {
            light,
            emission,
            albedo,
            normal,
            distance: (depth.clone(), depth.clone()),
            difference: black_planes([window.width, window.height]),
        };
        for i in 0..window.pixel_count() {
            let pixel = (window.y + i / window.width) * width + window.x + i % window.width;
            let (radiance, emission, [albedo, normal]) = (
                four.radiance(pixel),
                four.emission(pixel),
                four.albedo_and_normal(pixel),
            );
            for channel in 0..3 {
                let [a, b, c, d] = radiance.map(|value| value[channel]);
                tile.difference[channel].values[i] = ((a + b - c - d) / 2.0) as f32;
                for r in 0..REPLICATE_COUNT {
                    tile.light[r][channel].values[i] =
                        (radiance[r][channel] - emission[r][channel]) as f32;
                    tile.emission[r][channel].values[i] = emission[r][channel] as f32;
                    tile.albedo[r][channel].values[i] = albedo[r][channel] as f32;
                    tile.normal[r][channel].values[i] = normal[r][channel] as f32;
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
            for half in [[0, 1], [2, 3]] {
                tile.filter_half(half, (core, window, size), &mut workspace, &mut out);
            }
        }
        for (row, out) in out.chunks_exact(core.width).enumerate() {
            pixels[row * width + x..][..core.width].copy_from_slice(out);
        }
    }
}

/// A filtered half of a window.
struct FilteredHalf {
    /// Indices of its two replicates among the four of the window.
    replicates: [usize; 2],
    /// Light of the replicates with dimmed fireflies.
    targets: [ColourPlanes; 2],
    /// Albedo of the half, increased so that it is never zero. Light is divided by it before the
    /// filter.
    floor: ColourPlanes,
    /// `targets` divided by `floor`.
    divided: [ColourPlanes; 2],
    /// Filtered light, still divided by `floor`.
    light: FilterOutput,
    /// Filtered emission; `None` if the emission has no noise.
    emission: Option<FilterOutput>,
}

impl WindowReplicates {
    /// Filters two replicates, one half of the film, by weights computed from themselves. Adds the
    /// changes to the candidates `out` of the tile `core`.
    fn filter_half(
        &self,
        replicates: [usize; 2],
        (core, window, size): (Window, Window, [usize; 2]),
        workspace: &mut FilterWorkspace,
        out: &mut [PixelCandidates],
    ) {
        let places = [GUIDE_REACH, 0].map(|reach| core.grow(reach, size).relative_to(window));
        // Each replicate is limited by the other one.
        let limits = replicates.map(|r| brightest_channel(&self.light[r]));
        let targets = [0, 1].map(|k| dim_fireflies(&self.light[replicates[k]], &limits[1 - k]));
        let [albedo, normal] =
            [&self.albedo, &self.normal].map(|layer| replicates.map(|r| &layer[r]));
        let floor = mean_colour(albedo)
            .map(|plane| PixelPlane::map_planes([&plane], |[a]| a + LEAST_ALBEDO));
        let divided = targets
            .each_ref()
            .map(|of| from_fn(|i| PixelPlane::map_planes([&of[i], &floor[i]], |[a, b]| a / b)));
        let features = surface_features(albedo, normal, &self.distance, false);
        let light = run_both_filter_passes(divided.each_ref(), &features, places, workspace);
        let emission = self.has_noisy_emission().then(|| {
            let features = surface_features(albedo, normal, &self.distance, true);
            let targets = replicates.map(|r| &self.emission[r]);
            run_both_filter_passes(targets, &features, places, workspace)
        });
        let half = FilteredHalf {
            replicates,
            targets,
            floor,
            divided,
            light,
            emission,
        };
        self.add_candidates(&half, places[1], window.width, out);
    }

    /// Adds the changes of a filtered half to the candidates `out` of the tile `core`. `width` is
    /// the width of the window in pixels.
    fn add_candidates(
        &self,
        half: &FilteredHalf,
        core: Window,
        width: usize,
        out: &mut [PixelCandidates],
    ) {
        let light = &half.light;
        for (index, out) in out.iter_mut().enumerate() {
            let position = (core.y + index / core.width) * width + core.x + index % core.width;
            for (k, replicate) in half.replicates.into_iter().enumerate() {
                for i in 0..3 {
                    let (dim, floor, own) = (
                        half.targets[k][i].values[position],
                        half.floor[i].values[position],
                        light.own_weights.values[position],
                    );
                    let mean = light.means[k][i].values[position];
                    let own = if own < MAX_OWN_WEIGHT { own } else { 0.0 };
                    let without =
                        (mean - own * half.divided[k][i].values[position]) / (1.0 - own) * floor;
                    let seen = self.emission[replicate][i].values[position];
                    let filtered_emission = half
                        .emission
                        .as_ref()
                        .map_or(seen, |emission| emission.means[k][i].values[position]);
                    let added = [
                        mean * floor - dim,
                        filtered_emission - seen,
                        dim - self.light[replicate][i].values[position],
                    ];
                    out.base_colour[i] += (without + filtered_emission) / REPLICATE_COUNT as f32;
                    // The other half is away from the mean of both by half of the difference.
                    let apart = self.difference[i].values[position] / 2.0;
                    let apart = if replicate < 2 { apart } else { -apart };
                    for ((sum, term), added) in
                        out.changes.iter_mut().zip(&mut out.error_terms).zip(added)
                    {
                        sum[i] += added / REPLICATE_COUNT as f32;
                        term[i] += added * apart / REPLICATE_COUNT as f32;
                    }
                }
            }
        }
    }
}

/// Returns a picture of light in which fireflies are dimmed. The limit of a pixel is
/// [`FIREFLY_FACTOR`] times the maximum of `limit` within [`FIREFLY_REACH`], plus
/// [`FIREFLY_OFFSET`]. A colour whose brightest channel exceeds the limit is scaled down to it.
fn dim_fireflies(light: &ColourPlanes, limit: &PixelPlane) -> ColourPlanes {
    let share = PixelPlane::map_planes(
        [&brightest_channel(light), &limit.max_filter(FIREFLY_REACH)],
        |[own, near]| ((FIREFLY_FACTOR * near.max(0.0) + FIREFLY_OFFSET) / own.max(1e-9)).min(1.0),
    );
    from_fn(|i| PixelPlane::map_planes([&light[i], &share], |[of, share]| of * share))
}

/// Runs both filter passes over the replicates of a half. The first pass filters each replicate by
/// the other one. The second pass filters both by the mean of the first pass. `places` holds the
/// windows that each pass computes.
fn run_both_filter_passes(
    replicates: [&ColourPlanes; 2],
    features: &[(PixelPlane, PixelPlane)],
    places: [Window; 2],
    workspace: &mut FilterWorkspace,
) -> FilterOutput {
    let noise = smooth_variance(&variance_of_mean(replicates));
    let of_one = PixelPlane::map_planes([&noise], |[v]| 2.0 * v);
    let inverse_noise = PixelPlane::map_planes([&noise], |[v]| 1.0 / (v + 1e-8));
    let [one, other] = [0, 1].map(|k| {
        let first = FilterGuide {
            colour: replicates[1 - k],
            variance: &of_one,
            noise: &noise,
            inverse_noise: &inverse_noise,
            features,
            inverse_tolerance: FIRST_PASS,
        };
        let [mean, _] = filter_non_local_means(
            &first,
            [replicates[k]; 2],
            places[0],
            &NEAR_OFFSETS,
            workspace,
        )
        .means;
        mean
    });
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
        inverse_tolerance: SECOND_PASS,
    };
    filter_non_local_means(&second, replicates, places[1], &FAR_OFFSETS, workspace)
}
