//! Lights, prepared: where they are seen from a point and how bright.

use raywright_bvh::{Real, Vector};

use crate::scene::{Falloff, Light as LightData, LightKind};
use crate::validate::GREATEST;

/// A light source that is not a surface.
#[derive(Clone, Debug)]
pub(crate) struct Light<R: Real> {
    kind: Kind<R>,
    pub colour: R::Vec3,
    /// Whether the scene lets something dim it: then a material's own shadow rule counts.
    pub dimmed: bool,
    /// Whether a ray must ask what is in between.
    pub shadows: bool,
    pub specular: bool,
}

#[derive(Clone, Debug)]
enum Kind<R: Real> {
    Directional { to_light: R::Vec3 },
    Point { position: R::Vec3, fade: Fade<R> },
    Spot { position: R::Vec3, direction: R::Vec3, fade: Fade<R>, scale: R, offset: R },
}

/// How a light weakens with distance.
#[derive(Clone, Debug)]
struct Fade<R> {
    inverse_square: bool,
    /// One over the square of the range; none without a range, where nothing is asked of the distance that f32 might not hold.
    inverse_range_2: Option<R>,
}

/// A light seen from a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen<R: Real> {
    /// Unit direction to it.
    pub direction: R::Vec3,
    /// Where it is; none for directional light.
    pub position: Option<R::Vec3>,
    /// What arrives if nothing is in between.
    pub colour: R::Vec3,
}

impl<R: Real> Fade<R> {
    fn new(falloff: Falloff, range: Option<f64>) -> Self {
        let inverse_range_2 = range.map(|r| R::from_f64(1.0 / (r * r)));
        Self { inverse_square: falloff == Falloff::InverseSquare, inverse_range_2 }
    }

    fn at(&self, squared: R) -> R {
        let window = match self.inverse_range_2 {
            None => R::ONE,
            Some(inverse) => {
                // (d/range)² before it is squared: the fourth power of a distance of 4.3e9 m is beyond f32.
                let share = squared * inverse;
                Real::clamp(R::ONE - share * share, R::ZERO, R::ONE)
            }
        };
        if self.inverse_square { window / squared } else { window }
    }
}

impl<R: Real> Light<R> {
    /// `casters`: whether anything in the scene casts shadows; without it no ray asks.
    pub fn new(light: &LightData, casters: bool) -> Self {
        let v = |t: [f64; 3]| R::Vec3::from_f64(t.into());
        let unit = |t: [f64; 3]| R::Vec3::from_f64(glam::DVec3::from(t).normalize());
        let kind = match light.kind {
            LightKind::Directional { to_light } => Kind::Directional { to_light: unit(to_light) },
            LightKind::Point { position, falloff, range } => {
                Kind::Point { position: v(position), fade: Fade::new(falloff, range) }
            }
            LightKind::Spot { position, direction, inner_angle, outer_angle, falloff, range } => {
                // The smooth edge of KHR_lights_punctual.
                let (inner, outer) = (libm::cos(inner_angle.to_radians()), libm::cos(outer_angle.to_radians()));
                let scale = 1.0 / (inner - outer).max(1e-3);
                Kind::Spot {
                    position: v(position),
                    direction: unit(direction),
                    fade: Fade::new(falloff, range),
                    scale: R::from_f64(scale),
                    offset: R::from_f64(-outer * scale),
                }
            }
        };
        let shadows = light.shadows && casters;
        Self { kind, colour: v(light.colour.0), dimmed: light.shadows, shadows, specular: light.specular }
    }

    /// The light as a point sees it; none where nothing of it arrives.
    #[inline(always)]
    pub fn seen_from(&self, point: R::Vec3) -> Option<Seen<R>> {
        match &self.kind {
            Kind::Directional { to_light } => Some(Seen { direction: *to_light, position: None, colour: self.colour }),
            Kind::Point { position, fade } => self.local(point, *position, fade, |_| R::ONE),
            Kind::Spot { position, direction, fade, scale, offset } => self.local(point, *position, fade, |l| {
                let edge = Real::clamp(-(l.dot(*direction)) * *scale + *offset, R::ZERO, R::ONE);
                edge * edge
            }),
        }
    }

    fn local(&self, point: R::Vec3, position: R::Vec3, fade: &Fade<R>, cone: impl Fn(R::Vec3) -> R) -> Option<Seen<R>> {
        let offset = position - point;
        let distance = offset.length();
        let direction = offset * (R::ONE / distance);
        let strength = fade.at(distance * distance) * cone(direction);
        // Also false for NaN, at the light itself.
        (strength > R::ZERO && strength.is_finite()).then(|| Seen {
            direction,
            position: Some(position),
            // Close to a strong light the product may leave f32, and infinity times a black channel is no number.
            colour: (self.colour * strength).min(R::Vec3::splat(R::from_f64(GREATEST))),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Colour;
    use glam::{DVec3, Vec3};

    fn light<R: Real>(kind: LightKind, colour: f64) -> Light<R> {
        let data = LightData { name: String::new(), kind, colour: Colour([colour; 3]), shadows: true, specular: true };
        Light::new(&data, true)
    }

    fn point<R: Real>(height: f64, range: Option<f64>, colour: f64) -> Light<R> {
        light(LightKind::Point { position: [0.0, height, 0.0], falloff: Falloff::InverseSquare, range }, colour)
    }

    /// Protects: what arrives from a light does not depend on the unit that lengths are measured in, from 1e-15 to 1e15 of it.
    /// The fourth power of a distance of 4.3e9 is beyond f32, and such a light was dark.
    #[test]
    fn a_light_of_any_size_arrives() {
        fn arrives<R: Real>(tolerance: f64) {
            for exponent in -15..=15 {
                let d = 10.0_f64.powi(exponent);
                let seen = |range: Option<f64>| {
                    let light = point::<R>(d, range, 3.0 * d * d);
                    light.seen_from(R::Vec3::ZERO).map_or(0.0, |seen| seen.colour.to_f64().x)
                };
                // A window is (1 − (d/range)⁴): by hand, 15/16 at half the range, 1 at a millionth, 0 from the range on.
                for (range, share) in [(None, 1.0), (Some(2.0 * d), 0.9375), (Some(1e6 * d), 1.0), (Some(d / 2.0), 0.0)] {
                    let found = seen(range);
                    assert!((found - 3.0 * share).abs() <= tolerance, "1e{exponent}, range {range:?}: {found}");
                }
            }
        }
        arrives::<f32>(3e-6);
        arrives::<f64>(1e-14);
    }

    /// Protects: what is beyond f32 so close to a light stays a number, and white.
    #[test]
    fn a_strong_light_close_by_is_finite() {
        let seen = point::<f32>(1e-6, None, 1e37).seen_from(Vec3::ZERO).expect("it shines");
        assert!(seen.colour.is_finite() && seen.colour.x >= 1e29, "{}", seen.colour);
        assert!(point::<f32>(0.0, None, 1.0).seen_from(Vec3::ZERO).is_none(), "at the light itself");
    }

    /// Protects: the edge of a spot, against values by hand: the square of the share of the way between the cosines.
    #[test]
    fn the_edge_of_a_spot_is_the_square_of_the_way_across() {
        let spot: Light<f64> = light(
            LightKind::Spot {
                position: [0.0; 3],
                direction: [0.0, -1.0, 0.0],
                inner_angle: 30.0,
                outer_angle: 60.0,
                falloff: Falloff::None,
                range: None,
            },
            1.0,
        );
        let (inner, outer) = (0.75_f64.sqrt(), 0.5);
        for (share, strength) in [(1.0, 1.0), (0.75, 0.5625), (0.5, 0.25), (0.1, 0.01)] {
            let cosine = outer + (inner - outer) * share;
            let seen = spot.seen_from(DVec3::new((1.0 - cosine * cosine).sqrt(), -cosine, 0.0)).expect("inside the cone");
            assert!((seen.colour.x - strength).abs() < 1e-12, "{share} of the way: {}", seen.colour.x);
        }
        assert!(spot.seen_from(DVec3::new(1.0, -0.5, 0.0)).is_none(), "outside the cone");
    }
}
