//! Path tracing (Kajiya, "The Rendering Equation", 1986): at each vertex a path asks one light and goes on in one direction, both
//! drawn by chance, and what both ways find of the same light is combined by multiple importance sampling (Veach, Guibas, "Optimally
//! Combining Sampling Techniques for Monte Carlo Rendering", 1995). In the mean it is right whatever the chances are, but for the
//! paths that are longer than the scene allows.
//!
//! A path's state is numbers alone ([`Walk`]), and what one more segment makes of it does not know who asks.

mod classic;
mod layered;
mod lights;
mod media;
mod mixture;
mod nested;
mod plain;
mod straight;
mod stream;
mod vertex;

use raywright_bvh::{Hit, Interval, Ray, Real, Vector};

pub(crate) use media::Media;
pub(crate) use stream::Stream;

use super::{Kernel, Leg, MAX_CUTOUTS, Tracer};
use crate::interaction::Interaction;
use crate::light::{LightId, Seen};
use crate::material::Sampled;
use crate::prepare::{Alpha, Material};
use crate::sampler::{Address, Purpose, Way, pair};
use crate::settings::{LightSampling, Roulette};

/// From so many segments on a path ends by chance however bright it is, so that one in a white room, of which nothing is ever lost, has an end
/// too: twenty more on average. Paths that are limited end before.
const ENDS_FROM: u32 = 64;

/// Segments that every path may have before chance decides whether it goes on. Before the fourth, chance costs more noise than it saves
/// time in most scenes.
const fn roulette_from(roulette: Roulette) -> u32 {
    match roulette {
        Roulette::Early => 1,
        Roulette::Late => 4,
        Roulette::Off => ENDS_FROM,
    }
}

/// Density of a direction, over solid angle, from which on a lobe counts as a mirror: it is seven times narrower than the sun's disc, which has
/// a 14,700th of a unit, so that of directions drawn towards a light hardly any has a share in what the lobe finds.
const NARROW: f64 = 1e5;

/// Chance to go on from there.
const GOES_ON: f64 = 0.95;

/// Where a path is: all that its next segment depends on.
#[derive(Clone, Copy, Debug)]
struct Walk<R: Real> {
    /// The ray to be traced.
    leg: Leg<R>,
    /// What arrives along it counts so much.
    throughput: R::Vec3,
    /// What the path has brought so far.
    radiance: R::Vec3,
    /// The vertex in the making, for random numbers.
    address: Address,
    way: Way,
    draws: Draws,
    /// Segments traced so far.
    traced: u32,
    /// Surfaces that it passed through because they are absent there.
    cutouts: u32,
    /// Whether it has met a surface.
    hit: bool,
    /// Least density with which it left one, the last one apart: how far it was scattered before.
    spread: f64,
    /// The bodies that it is in.
    media: Media,
    /// Where the ray left, and how.
    left: Left<R>,
    /// The one wavelength, in nanometres, by which a path goes on that was bent apart; none: it is white.
    wavelength: Option<f64>,
}

/// Numbers in [0, 1) that nearly every vertex asks for.
#[derive(Clone, Copy, Debug, Default)]
struct Draws {
    /// Which light it asks, and where on it.
    light: [f32; 4],
    /// Which way the path goes on, by the lobe and a direction of it, and whether.
    scatter: [f32; 4],
}

/// How a ray left its vertex: what it takes to know how else the light at its end could have been found.
#[derive(Clone, Copy, Debug)]
struct Left<R: Real> {
    /// The vertex, and the normal there on the side that the path came from; zero where light comes from both.
    from: R::Vec3,
    normal: R::Vec3,
    /// Density over solid angle of the direction; infinite where no light could have been drawn instead: for rays of the camera, and
    /// of lobes without a density.
    density: f64,
}

/// Share of a technique in what two techniques find, by the densities of both, squared (Veach, Guibas 1995, "power heuristic"). No
/// density is squared by itself, so that none overflows.
#[inline(always)]
fn weight(own: f64, other: f64) -> f64 {
    if own == other {
        return 0.5;
    }
    let ratio = other / own;
    1.0 / (1.0 + ratio * ratio)
}

impl<R: Real, K: Kernel> Tracer<'_, R, K> {
    /// The path of a camera ray before its first segment.
    #[inline(always)]
    fn walk(&self, ray: Ray<R>, address: Address) -> Walk<R> {
        Walk {
            leg: Leg { ray, ..Leg::of_camera(self.scene) },
            throughput: Vector::ONE,
            radiance: Vector::ZERO,
            address,
            way: address.way(),
            draws: Draws::default(),
            traced: 0,
            cutouts: 0,
            hit: false,
            spread: f64::INFINITY,
            media: self.media,
            left: Left { from: ray.origin, normal: ray.direction, density: f64::INFINITY },
            wavelength: None,
        }
    }

    /// What a path asks next.
    #[inline(always)]
    fn ask(&self, walk: &Walk<R>) -> Option<Hit<R>> {
        let min = if walk.traced == 0 { self.camera_min - walk.leg.ahead } else { self.secondary_min };
        self.scene.geometry.closest(&walk.leg.ray, Interval { min, max: R::INFINITY }, &mut ())
    }

    /// What one more segment makes of a path that has met something. Whether it has another ray to be traced.
    #[inline(always)]
    fn met(&mut self, walk: &mut Walk<R>, hit: &Hit<R>, at: &mut Interaction<R>) -> bool {
        at.bend_where_bumpy(self.scene, &walk.leg, hit);
        self.pass_media(walk, at);
        self.keep_first(walk, hit);
        if let Material::Physical(m) = &self.scene.materials[at.material as usize]
            && m.alpha != Alpha::Opaque
        {
            let alpha = m.alpha_at(&self.scene.sources.at(at));
            // A surface that covers a share of what is behind it is there as often.
            let absent = alpha < R::ONE && (alpha <= R::ZERO || R::from_f32(pair(walk.address, Purpose::Coverage)[0]) >= alpha);
            if absent {
                return self.pass(walk, at);
            }
        }
        if self.nests()
            && let Some(beyond) = self.hidden(&walk.media, at)
        {
            walk.media = beyond;
            return self.pass(walk, at);
        }
        walk.hit = true;
        walk.traced += 1;
        self.vertex(walk, hit, at)
    }

    /// Keeps what a camera ray hits first, where layers ask for it.
    #[inline(always)]
    fn keep_first(&mut self, walk: &Walk<R>, hit: &Hit<R>) {
        if self.keeps_first && walk.traced == 0 && walk.cutouts == 0 {
            self.first = Some(self.seen(&walk.leg, hit));
        }
    }

    /// What a ray brings that hit nothing and sees this of the sky, in its share.
    #[inline(always)]
    fn escaped(&mut self, walk: &Walk<R>, seen: &Seen<R>) -> R::Vec3 {
        if let Some(backdrop) = self.scene.backdrop.filter(|_| walk.traced == 0) {
            return backdrop.seen(walk.leg.ray.direction) * self.light_on_ground(&walk.leg, &walk.address);
        }
        let direction = walk.leg.ray.direction;
        let lights = &self.scene.lights;
        if self.is_unaided(walk)
            && let Some(density) = lights.sky_sampler().and_then(|sampler| sampler.small())
        {
            self.counters.unaided += 1;
            self.counters.found += u64::from(lights.density_of_sky(direction, seen.place, 1.0) >= density);
        }
        seen.radiance * self.found(walk, LightId::Sky, |probability| lights.density_of_sky(direction, seen.place, probability))
    }

    /// Whether a path was scattered and then went on as by a mirror: what it meets then, it meets by chance alone.
    #[inline(always)]
    fn is_unaided(&self, walk: &Walk<R>) -> bool {
        walk.spread < NARROW && walk.left.density >= NARROW
    }

    /// Share that a ray has in finding the light that it met, which is drawn with a density by the probability of being asked.
    #[inline(always)]
    fn found(&self, walk: &Walk<R>, light: LightId, drawn: impl FnOnce(f64) -> f64) -> R {
        let Left { from, normal, density } = walk.left;
        if density == f64::INFINITY {
            return R::ONE;
        }
        let lights = &self.scene.lights;
        let sampling = self.scene.sampling_of(light);
        if sampling == LightSampling::Scattering {
            return R::ONE;
        }
        let probability = lights.choice().probability::<R>(light, from, normal);
        let other = if probability > 0.0 { drawn(probability) } else { 0.0 };
        match sampling {
            LightSampling::Lights if other > 0.0 => R::ZERO,
            LightSampling::Lights => R::ONE,
            _ => R::from_f64(weight(density, other)),
        }
    }

    /// Takes a path on through a surface that is not there where it met it.
    fn pass(&self, walk: &mut Walk<R>, at: &Interaction<R>) -> bool {
        walk.cutouts += 1;
        walk.address.bounce += 1;
        let rest = walk.leg.rest;
        let ray = Ray { culls: walk.leg.ray.culls, ..self.leave(at, at.direction, -R::ONE) };
        walk.leg.go_on(&ray, rest);
        walk.cutouts <= MAX_CUTOUTS
    }

    /// Takes a path on in the direction that was drawn at a vertex, unless chance ends it.
    #[inline(always)]
    fn go_on(&mut self, walk: &mut Walk<R>, at: &Interaction<R>, drawn: &Sampled<R>, onward: Onward<R>) -> bool {
        let mut throughput = walk.throughput * drawn.weight;
        if walk.traced >= roulette_from(self.scene.roulette) {
            // Also ends what is no number.
            let most = if walk.traced < ENDS_FROM { R::ONE } else { R::from_f64(GOES_ON) };
            let survives = throughput.max_element().min(most);
            let goes_on = onward.luck < survives;
            if !goes_on {
                return false;
            }
            throughput *= R::ONE / survives;
        }
        if throughput == Vector::ZERO || !throughput.is_finite() {
            return false;
        }
        walk.leg.go_on(&onward.ray, onward.rest);
        walk.throughput = throughput;
        walk.address.bounce += 1;
        // What goes straight on through a wall is still found by lights that were asked before it.
        if !onward.straight {
            let density = if drawn.delta { f64::INFINITY } else { drawn.density.to_f64() };
            walk.spread = walk.spread.min(walk.left.density);
            walk.left = Left { from: at.surface.point, normal: onward.lit, density };
            self.counters.unaided += u64::from(self.is_unaided(walk) && !self.scene.lights.emitters.is_empty());
        }
        if self.scene.tracks_media && onward.through {
            walk.media = self.beyond(&walk.media, at);
        }
        true
    }
}

/// How a path would go on.
struct Onward<R: Real> {
    ray: Ray<R>,
    /// What storing took from its direction.
    rest: R::Vec3,
    /// A number in [0, 1): below what the path counts, it goes on.
    luck: R,
    /// Normal of the side that lights were asked for; zero for both.
    lit: R::Vec3,
    /// Whether it goes through the surface.
    through: bool,
    /// Whether it does so as shadow rays do.
    straight: bool,
}
