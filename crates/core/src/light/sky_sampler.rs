//! Importance sampling of the sky's directions by radiance.

use core::f64::consts::{FRAC_1_PI, PI, TAU};

use glam::DVec3;
use raywright_bvh::{Real, Vector};

use super::cdf::{push_cdf, sample_index};
use super::grid::PolarDirection;
use super::sky::{EquirectMap, GradientSky, SkyKind};
use super::sky_lobe::{self, SkyLobe};
use super::{LightDensity, LightSample, ShadowRayTarget, SkyRadiance, SphereGrid};

/// Fraction of an image's mean radiance that light sampling leaves to BSDF sampling.
///
/// - Fraction 1: a seventh more noise under skies that are slightly brighter on one side.
/// - Fraction 0.5: three quarters more noise on surfaces lit by a small sun.
/// - Fraction 0.75: in each of seven skies, at most a twelfth more noise than the better of these
///   fractions.
const EVEN: f64 = 0.75;

/// Mean sampling density per steradian from which on the bright part of a sky counts as small. Such
/// a part covers at most a tenth of a steradian, less than a hundredth of the sphere.
const SMALL: f64 = 10.0;

/// Sampler of directions to the sky, in proportion to the sky's radiance.
#[derive(Clone, Debug)]
pub struct SkySampler {
    form: SkySamplerKind,
    flux: f64,
    /// Sampling density per steradian from which on a direction belongs to a small bright part of
    /// the sky, see [`Self::bright_region_density`].
    small_part_density: Option<f64>,
}

#[derive(Clone, Debug)]
enum SkySamplerKind {
    /// Uniform over the sphere, for an expression: its bright directions are unknown.
    Uniform,
    /// A sum of lobes in closed form, each chosen in proportion to its flux.
    Lobes {
        lobes: Vec<SkyLobe>,
        shares: Vec<f64>,
    },
    /// An image, sampled by cells.
    Grid(SphereGrid),
}

fn sum_channels<R: Real>(colour: R::Vec3) -> f64 {
    let c = colour.to_f64();
    (c.x + c.y + c.z).max(0.0)
}

impl SkySampler {
    /// Builds the sampler of a sky; `None` for a black sky.
    pub fn new<R: Real>(sky: &SkyRadiance<R>) -> Option<Self> {
        let linear = |bottom, top| (SkyLobe::Linear { bottom, top }, TAU * (bottom + top));
        let sampler = match &sky.kind {
            SkyKind::Black => None,
            SkyKind::Constant(c) => {
                Self::from_lobes([linear(sum_channels::<R>(*c), sum_channels::<R>(*c))])
            }
            SkyKind::Gradient(GradientSky { bottom, top, suns }) => {
                let suns = suns.iter().map(|sun| {
                    let (axis, exponent) = (sun.direction.to_f64().normalize(), sun.exponent);
                    (
                        SkyLobe::Power { axis, exponent },
                        sum_channels::<R>(sun.colour) * TAU / (f64::from(exponent) + 1.0),
                    )
                });
                Self::from_lobes(
                    core::iter::once(linear(sum_channels::<R>(*bottom), sum_channels::<R>(*top)))
                        .chain(suns),
                )
            }
            SkyKind::Expression(..) => Some(Self {
                form: SkySamplerKind::Uniform,
                flux: integrate_flux(sky),
                small_part_density: None,
            }),
            SkyKind::Map(map) => {
                let grid = build_image_grid(map, |radiance| radiance)?;
                Some(Self {
                    flux: grid.flux(),
                    form: SkySamplerKind::Grid(grid),
                    small_part_density: None,
                })
            }
        };
        sampler.map(|sampler| sampler.detect_small_bright_region(sky))
    }

    /// Restricts sampling to the excess of the sky over its uniform part: the suns without the
    /// gradient, or the radiance of texels above 0.75 times the mean. Without such an excess,
    /// the sampler is returned unchanged.
    ///
    /// Valid only if multiple importance sampling adds BSDF sampling, which samples uniform light
    /// better ("MIS Compensation: Optimizing Sampling Techniques in Multiple Importance Sampling",
    /// Karlík et al. 2019).
    #[must_use]
    pub fn into_bright_excess_sampler<R: Real>(self, sky: &SkyRadiance<R>) -> Self {
        let excess = match (&self.form, &sky.kind) {
            (SkySamplerKind::Lobes { lobes, shares }, _) => {
                let fluxes = lobes.iter().enumerate().map(|(i, lobe)| match lobe {
                    SkyLobe::Linear { .. } => 0.0,
                    SkyLobe::Power { .. } => super::cdf::entry_probability(shares, i),
                });
                Self::from_lobes(lobes.iter().copied().zip(fluxes))
            }
            (SkySamplerKind::Grid(whole), SkyKind::Map(map)) => {
                let even = EVEN * 0.25 * FRAC_1_PI * whole.flux();
                let excess = build_image_grid(map, |radiance| (radiance - even).max(0.0));
                excess.map(|grid| Self {
                    flux: grid.flux(),
                    form: SkySamplerKind::Grid(grid),
                    small_part_density: None,
                })
            }
            _ => None,
        };
        match excess {
            // The choice among lights needs the flux of the whole sky.
            Some(excess) => Self {
                flux: self.flux,
                ..excess.detect_small_bright_region(sky)
            },
            None => self,
        }
    }

    /// Whether the sky has no bright part: its radiance is constant, or a gradient without suns.
    pub fn is_even(&self) -> bool {
        let is_linear = |lobe: &SkyLobe| matches!(lobe, SkyLobe::Linear { .. });
        matches!(&self.form, SkySamplerKind::Lobes { lobes, .. } if lobes.iter().all(is_linear))
    }

    fn from_lobes(lobes: impl IntoIterator<Item = (SkyLobe, f64)>) -> Option<Self> {
        let (lobes, fluxes): (Vec<SkyLobe>, Vec<f64>) = lobes.into_iter().unzip();
        let mut shares = Vec::new();
        let flux = push_cdf(&mut shares, &fluxes);
        (flux > 0.0).then_some(Self {
            form: SkySamplerKind::Lobes { lobes, shares },
            flux,
            small_part_density: None,
        })
    }

    /// Detects a small bright part of the sky by the mean density ∫p² of sampled directions, where
    /// p is the sampling density. This mean measures how concentrated the light is. It thereby
    /// measures the noise of paths that hit the bright part by chance.
    fn detect_small_bright_region<R: Real>(self, sky: &SkyRadiance<R>) -> Self {
        const SIDE: u16 = 16;
        let middle = |i: u16| (f32::from(i) + 0.5) / f32::from(SIDE);
        let drawn = (0..SIDE * SIDE)
            .map(|i| self.sample_direction::<R>([middle(i % SIDE), middle(i / SIDE)]));
        let mean = drawn
            .map(|direction| self.density::<R>(direction, sky.image_coordinates(direction)))
            .sum::<f64>()
            / f64::from(SIDE * SIDE);
        Self {
            small_part_density: (mean >= SMALL).then_some(0.5 * mean),
            ..self
        }
    }

    /// Returns the sampling density per steradian from which on a direction belongs to a small
    /// bright part of the sky. `None` if the sky has no such part.
    #[inline(always)]
    pub fn bright_region_density(&self) -> Option<f64> {
        self.small_part_density
    }

    /// Returns the integral of the whole sky's radiance over the sphere, summed over the three
    /// channels. The whole sky counts even if only its excess is sampled.
    pub fn flux(&self) -> f64 {
        self.flux
    }

    /// Samples the sky for the receiving point `from`, by two uniform numbers in [0, 1).
    /// `probability` is that of choosing the sky. `None` if the sampled direction is black.
    pub fn sample<R: Real>(
        &self,
        sky: &SkyRadiance<R>,
        from: R::Vec3,
        position: [f32; 2],
        probability: f64,
    ) -> Option<LightSample<R>> {
        let direction = self.sample_direction::<R>(position);
        let place = sky.image_coordinates(direction);
        sky_light_sample(
            direction,
            sky.radiance_at(from, direction, place),
            self.density::<R>(direction, place) * probability,
        )
    }

    /// Samples a unit direction by two uniform numbers in [0, 1).
    pub fn sample_direction<R: Real>(&self, position: [f32; 2]) -> R::Vec3 {
        R::Vec3::from_f64(self.sample_direction_f64(position.map(f64::from)))
    }

    /// Samples many directions in order, as [`Self::sample_direction`] does. Faster than single
    /// calls.
    pub fn sample_directions<R: Real>(
        &self,
        positions: impl Iterator<Item = [f32; 2]>,
    ) -> Vec<R::Vec3> {
        let (lobes, shares) = match &self.form {
            SkySamplerKind::Uniform => {
                return positions.map(|at| self.sample_direction::<R>(at)).collect();
            }
            SkySamplerKind::Grid(grid) => {
                let most = positions.size_hint().1.unwrap_or(0);
                let mut directions = Vec::with_capacity(most);
                grid.sample_directions(positions.map(|at| at.map(f64::from)), |direction| {
                    directions.push(R::Vec3::from_f64(direction));
                });
                return directions;
            }
            SkySamplerKind::Lobes { lobes, shares } => (lobes, shares),
        };
        let mut directions = Vec::new();
        let chosen = positions.map(|position| {
            let [u, v] = position.map(f64::from);
            let (index, _, rest) = sample_index(shares, u);
            (&lobes[index], [rest, v])
        });
        sky_lobe::sample_directions(chosen, &mut directions);
        directions.into_iter().map(R::Vec3::from_f64).collect()
    }

    fn sample_direction_f64(&self, [u, v]: [f64; 2]) -> DVec3 {
        match &self.form {
            SkySamplerKind::Uniform => PolarDirection::at_height(2.0 * u - 1.0, v).to_direction(),
            SkySamplerKind::Grid(grid) => grid.sample_direction([u, v]),
            SkySamplerKind::Lobes { lobes, shares } => {
                let (index, _, rest) = sample_index(shares, u);
                lobes[index].sample_direction([rest, v])
            }
        }
    }

    /// Returns the density by solid angle with which a direction is sampled. `place` holds the
    /// direction's image coordinates, see [`SkyRadiance::image_coordinates`].
    pub fn density<R: Real>(&self, direction: R::Vec3, place: [R; 2]) -> f64 {
        match &self.form {
            SkySamplerKind::Uniform => 0.25 * FRAC_1_PI,
            SkySamplerKind::Grid(grid) => grid.density(place.map(Real::to_f64)),
            SkySamplerKind::Lobes { lobes, shares } => {
                let drawn = lobes
                    .iter()
                    .enumerate()
                    .map(|(i, lobe)| (super::cdf::entry_probability(shares, i), lobe));
                // Lobes of zero probability add nothing.
                drawn
                    .filter(|&(share, _)| share > 0.0)
                    .map(|(share, lobe)| share * lobe.density(direction.to_f64()))
                    .sum()
            }
        }
    }
}

/// Returns the light sample of a direction of the sky with this radiance and sampling density.
/// `None` if no light arrives.
#[inline]
pub(super) fn sky_light_sample<R: Real>(
    direction: R::Vec3,
    radiance: R::Vec3,
    density: f64,
) -> Option<LightSample<R>> {
    let arriving = radiance * R::from_f64(1.0 / density);
    (density > 0.0 && arriving.is_finite() && arriving.max_element() > R::ZERO).then_some(
        LightSample {
            direction,
            arriving,
            density: LightDensity::SolidAngle(density),
            target: ShadowRayTarget::Infinity,
        },
    )
}

/// Returns the integral of a sky's radiance over the sphere, summed over the three channels.
/// Midpoint rule with cells of equal solid angle.
fn integrate_flux<R: Real>(sky: &SkyRadiance<R>) -> f64 {
    const ROWS: u32 = 32;
    const COLUMNS: u32 = 64;
    let at = |i: u32, n: u32| (f64::from(i) + 0.5) / f64::from(n);
    let cells = (0..ROWS)
        .flat_map(|row| (0..COLUMNS).map(move |column| (at(row, ROWS), at(column, COLUMNS))));
    let direction = |(u, v)| PolarDirection::at_height(2.0 * u - 1.0, v).to_direction();
    let seen = cells.map(|place| R::Vec3::from_f64(direction(place)));
    let total: f64 = seen
        .map(|d| sum_channels::<R>(sky.radiance(R::Vec3::ZERO, d)))
        .filter(|x| x.is_finite())
        .sum();
    total * 4.0 * PI / f64::from(ROWS * COLUMNS)
}

/// Builds the sampling grid of an image, with its texels as cells. `drawn` maps a cell's mean
/// radiance to its sampling weight.
///
/// Radiance is interpolated between texel centres. A cell's mean therefore includes an eighth of
/// each neighbouring texel along both axes. A black texel beside a bright texel has a density above
/// zero.
fn build_image_grid<R: Real>(
    map: &EquirectMap<R>,
    drawn: impl Fn(f64) -> f64,
) -> Option<SphereGrid> {
    let (width, height) = (map.image.width as usize, map.image.height as usize);
    let texels: Vec<f64> = (0..width * height)
        .map(|i| sum_channels::<R>(map.texel(i % width, i / width) * map.strength))
        .collect();
    let blended = |before: f64, at: f64, after: f64| 0.125 * (before + after) + 0.75 * at;
    let across = |x: usize, y: usize| {
        let at = |x: usize| texels[y * width + x % width];
        blended(at(x + width - 1), at(x), at(x + 1))
    };
    SphereGrid::new(width, height, map.turn.to_f64(), |x, y| {
        drawn(blended(
            across(x, y.saturating_sub(1)),
            across(x, y),
            across(x, (y + 1).min(height - 1)),
        ))
    })
}
