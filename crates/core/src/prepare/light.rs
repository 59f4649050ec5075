//! Lights, prepared: where they are seen from a point and how bright.

use raywright_bvh::{Real, Vector};

use crate::scene::{Falloff, Light as LightData, LightKind};

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
    /// One over the range to the fourth power; zero without a range.
    inverse_range_4: R,
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
        let inverse_range_4 = R::from_f64(range.map_or(0.0, |r| 1.0 / (r * r * r * r)));
        Self { inverse_square: falloff == Falloff::InverseSquare, inverse_range_4 }
    }

    fn at(&self, squared: R) -> R {
        let window = Real::clamp(R::ONE - squared * squared * self.inverse_range_4, R::ZERO, R::ONE);
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
            colour: self.colour * strength,
        })
    }
}
