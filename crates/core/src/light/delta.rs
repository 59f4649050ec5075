//! Delta lights: directional, point and spot lights.

use core::f64::consts::{PI, TAU};

use glam::DVec3;
use raywright_bvh::{Real, Vector};

use super::{LightBounds, LightDensity, LightSample, ShadowRayTarget};
use crate::scene::{Falloff, Light as LightData, LightKind};
use crate::validate::MAX_MAGNITUDE;

/// A directional, point or spot light. Such a light has no size, and no ray can hit it.
#[derive(Clone, Copy, Debug)]
pub struct DeltaLight<R: Real> {
    kind: DeltaLightKind<R>,
    /// Irradiance of a directional light, or intensity of a point or spot light.
    colour: R::Vec3,
    /// Whether the scene's description lets the light cast shadows, even if no object casts any.
    /// Only such lights apply a material's own shadow rule.
    pub has_shadow_rule: bool,
    /// Whether shadow rays are traced to the light.
    pub shadows: bool,
    /// Whether the light makes highlights.
    pub specular: bool,
}

#[derive(Clone, Copy, Debug)]
enum DeltaLightKind<R: Real> {
    Directional {
        to_light: R::Vec3,
    },
    Point {
        position: R::Vec3,
        fade: DistanceFalloff<R>,
    },
    Spot {
        position: R::Vec3,
        direction: R::Vec3,
        fade: DistanceFalloff<R>,
        scale: R,
        offset: R,
    },
}

/// Least difference between the cosines of a spot's inner and outer angle. The difference is below
/// the resolution of `f32`, and `f32` can hold its inverse.
const NARROWEST_EDGE: f64 = 1e-12;

/// Falloff of a point or spot light with distance.
#[derive(Clone, Copy, Debug)]
struct DistanceFalloff<R> {
    inverse_square: bool,
    /// Inverse of the squared range; `None` without a range: powers of large distances would
    /// overflow `f32`.
    inverse_range_2: Option<R>,
}

impl<R: Real> DistanceFalloff<R> {
    fn new(falloff: Falloff, range: Option<f64>) -> Self {
        let inverse_range_2 = range.map(|r| R::from_f64(1.0 / (r * r)));
        Self {
            inverse_square: falloff == Falloff::InverseSquare,
            inverse_range_2,
        }
    }

    fn eval(&self, squared: R) -> R {
        let window = match self.inverse_range_2 {
            None => R::ONE,
            Some(inverse) => {
                // The quotient (distance/range)² is squared, not the fourth power divided: the
                // fourth power of 4.3e9 m overflows `f32`.
                let share = squared * inverse;
                Real::clamp(R::ONE - share * share, R::ZERO, R::ONE)
            }
        };
        if self.inverse_square {
            window / squared
        } else {
            window
        }
    }
}

/// Greatest number of lights without size that are sampled along segments in media. More are chosen
/// by their tree, at scatterings.
pub(crate) const MOST_PLACED: usize = 8;

/// Returns indices of the lights, with the positions of point and spot lights; none if the lights
/// are more than [`MOST_PLACED`].
pub(crate) fn placed_lights<R: Real>(lights: &[DeltaLight<R>]) -> Vec<(u32, Option<DVec3>)> {
    if lights.len() > MOST_PLACED {
        return Vec::new();
    }
    let position = |light: &DeltaLight<R>| light.position().map(|position| position.to_f64());
    (0..).zip(lights.iter().map(position)).collect()
}

impl<R: Real> DeltaLight<R> {
    /// Prepares a light of a scene. `casters`: whether any object of the scene casts shadows;
    /// otherwise no shadow rays are traced.
    pub fn new(light: &LightData, casters: bool) -> Self {
        let v = |t: [f64; 3]| R::Vec3::from_f64(t.into());
        let unit = |t: [f64; 3]| R::Vec3::from_f64(glam::DVec3::from(t).normalize());
        let kind = match light.kind {
            LightKind::Directional { to_light } => DeltaLightKind::Directional {
                to_light: unit(to_light),
            },
            LightKind::Point {
                position,
                falloff,
                range,
            } => DeltaLightKind::Point {
                position: v(position),
                fade: DistanceFalloff::new(falloff, range),
            },
            LightKind::Spot {
                position,
                direction,
                inner_angle,
                outer_angle,
                falloff,
                range,
            } => {
                // The smooth edge of KHR_lights_punctual between both angles; a hard edge for equal
                // angles.
                let (inner, outer) = (
                    libm::cos(inner_angle.to_radians()),
                    libm::cos(outer_angle.to_radians()),
                );
                let scale = 1.0 / (inner - outer).max(NARROWEST_EDGE);
                DeltaLightKind::Spot {
                    position: v(position),
                    direction: unit(direction),
                    fade: DistanceFalloff::new(falloff, range),
                    scale: R::from_f64(scale),
                    offset: R::from_f64(-outer * scale),
                }
            }
        };
        let shadows = light.shadows && casters;
        Self {
            kind,
            colour: v(light.colour.0),
            has_shadow_rule: light.shadows,
            shadows,
            specular: light.specular,
        }
    }

    /// Samples the light from the receiving point `from`; `None` if no light arrives.
    #[inline(always)]
    pub fn sample(&self, from: R::Vec3) -> Option<LightSample<R>> {
        match &self.kind {
            DeltaLightKind::Directional { to_light } => Some(LightSample {
                direction: *to_light,
                arriving: self.colour,
                density: LightDensity::Delta,
                target: ShadowRayTarget::Infinity,
            }),
            DeltaLightKind::Point { position, fade } => {
                self.sample_point_or_spot(from, *position, fade, |_| R::ONE)
            }
            DeltaLightKind::Spot {
                position,
                direction,
                fade,
                scale,
                offset,
            } => self.sample_point_or_spot(from, *position, fade, |l| {
                let edge = Real::clamp(-(l.dot(*direction)) * *scale + *offset, R::ZERO, R::ONE);
                edge * edge
            }),
        }
    }

    #[inline(always)]
    fn sample_point_or_spot(
        &self,
        from: R::Vec3,
        position: R::Vec3,
        fade: &DistanceFalloff<R>,
        cone: impl Fn(R::Vec3) -> R,
    ) -> Option<LightSample<R>> {
        let offset = position - from;
        let distance = offset.length();
        let direction = offset * (R::ONE / distance);
        let strength = fade.eval(distance * distance) * cone(direction);
        // False for NaN too, at the light itself.
        (strength > R::ZERO && strength.is_finite()).then(|| LightSample {
            direction,
            // Close to a strong light the product may overflow `f32` to infinity, and infinity
            // times a black channel is NaN.
            arriving: (self.colour * strength).min(R::Vec3::splat(R::from_f64(MAX_MAGNITUDE))),
            density: LightDensity::Delta,
            target: ShadowRayTarget::Point(position),
        })
    }

    /// Returns the flux of the light, summed over the three channels. The flux of a directional
    /// light is that through a disc of radius `reach`. The flux of a light without falloff is that
    /// through a sphere of radius `reach`.
    pub fn power(&self, reach: f64) -> f64 {
        let spread = match &self.kind {
            DeltaLightKind::Directional { .. } => PI * reach * reach,
            DeltaLightKind::Point { .. } => 2.0 * TAU,
            // Full strength within the inner angle; the squared falloff of the edge up to the outer
            // angle integrates to a third.
            DeltaLightKind::Spot { scale, offset, .. } => {
                let (edge, outer) = (1.0 / scale.to_f64(), -offset.to_f64() / scale.to_f64());
                TAU * ((1.0 - outer - edge).max(0.0) + edge / 3.0)
            }
        };
        self.intensity(reach) * spread
    }

    /// Returns the greatest intensity of a point or spot light, summed over the three channels, and
    /// the irradiance of a directional light. The intensity of a light without falloff is that of
    /// one with falloff that is as bright at the distance `reach`.
    pub fn intensity(&self, reach: f64) -> f64 {
        let colour = self.colour.to_f64();
        let factor = match &self.kind {
            DeltaLightKind::Point { fade, .. } | DeltaLightKind::Spot { fade, .. }
                if !fade.inverse_square =>
            {
                reach * reach
            }
            _ => 1.0,
        };
        (colour.x + colour.y + colour.z) * factor
    }

    /// Returns the position; `None` for a directional light.
    pub fn position(&self) -> Option<R::Vec3> {
        match &self.kind {
            DeltaLightKind::Directional { .. } => None,
            DeltaLightKind::Point { position, .. } | DeltaLightKind::Spot { position, .. } => {
                Some(*position)
            }
        }
    }

    /// Returns the part of a ray within the cone of a spot light: an empty one if the ray misses the
    /// cone, and the whole range for other lights and for cones of a right angle and more.
    pub fn lit_range(&self, origin: DVec3, ray: DVec3, range: [f64; 2]) -> [f64; 2] {
        let DeltaLightKind::Spot {
            position,
            direction,
            scale,
            offset,
            ..
        } = &self.kind
        else {
            return range;
        };
        // Cosine of the outer angle, lowered by what the light's edge may round.
        let cos = -(offset.to_f64() / scale.to_f64()) - 4.0 * R::ROUNDOFF.to_f64();
        if cos <= 0.0 {
            return range;
        }
        let (start, axis) = (origin - position.to_f64(), direction.to_f64());
        let (across, ahead) = (ray.dot(axis), start.dot(axis));
        // (x·axis)² − cos² x² along the ray is a t² + 2 b t + c.
        let a = across * across - cos * cos * ray.length_squared();
        let b = ahead * across - cos * cos * start.dot(ray);
        let c = ahead * ahead - cos * cos * start.length_squared();
        let root = (b * b - a * c).max(0.0).sqrt();
        let q = -(b + root.copysign(b));
        let crossings = [q / a, c / q].map(|t| if t.is_nan() { range[0] } else { t });
        let [near, far] = [
            crossings[0].min(crossings[1]).clamp(range[0], range[1]),
            crossings[0].max(crossings[1]).clamp(range[0], range[1]),
        ];
        // The cone is convex: one of the three parts, if any, lies in it.
        let is_lit = |[from, to]: &[f64; 2]| {
            let x = start + ray * (0.5 * (from + to));
            to > from && x.dot(axis) >= cos * x.length()
        };
        [[range[0], near], [near, far], [far, range[1]]]
            .into_iter()
            .find(is_lit)
            .unwrap_or([range[0]; 2])
    }

    /// Returns the bounds of positions and directions; `None` for a directional light.
    pub fn bounds(&self) -> Option<LightBounds> {
        match &self.kind {
            DeltaLightKind::Directional { .. } => None,
            DeltaLightKind::Point { position, .. } => Some(LightBounds::for_point_light(
                position.to_f64(),
                DVec3::Y,
                PI,
            )),
            DeltaLightKind::Spot {
                position,
                direction,
                scale,
                offset,
                ..
            } => {
                let outer = -offset.to_f64() / scale.to_f64();
                Some(LightBounds::for_point_light(
                    position.to_f64(),
                    direction.to_f64(),
                    libm::acos(outer.clamp(-1.0, 1.0)),
                ))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Colour;
    use glam::Vec3;

    fn light<R: Real>(kind: LightKind, colour: f64) -> DeltaLight<R> {
        let data = LightData {
            name: String::new(),
            kind,
            colour: Colour([colour; 3]),
            shadows: true,
            specular: true,
        };
        DeltaLight::new(&data, true)
    }

    fn point<R: Real>(height: f64, range: Option<f64>, colour: f64) -> DeltaLight<R> {
        light(
            LightKind::Point {
                position: [0.0, height, 0.0],
                falloff: Falloff::InverseSquare,
                range,
            },
            colour,
        )
    }

    /// Protects: light arrives independently of the unit of length, from 1e-15 to 1e15 of it. The
    /// fourth power of a distance of 4.3e9 overflows `f32`; such a light was once dark.
    #[test]
    fn a_light_of_any_size_arrives() {
        fn check_irradiance<R: Real>(tolerance: f64) {
            for exponent in -15..=15 {
                let d = 10.0_f64.powi(exponent);
                let seen = |range: Option<f64>| {
                    let light = point::<R>(d, range, 3.0 * d * d);
                    light
                        .sample(R::Vec3::ZERO)
                        .map_or(0.0, |light_sample| light_sample.arriving.to_f64().x)
                };
                // The window is (1 − (d/range)⁴); by hand, 15/16 at half the range, 1 at a
                // millionth of it, 0 from the range on.
                for (range, share) in [
                    (None, 1.0),
                    (Some(2.0 * d), 0.9375),
                    (Some(1e6 * d), 1.0),
                    (Some(d / 2.0), 0.0),
                ] {
                    let found = seen(range);
                    assert!(
                        (found - 3.0 * share).abs() <= tolerance,
                        "1e{exponent}, range {range:?}: {found}"
                    );
                }
            }
        }
        check_irradiance::<f32>(3e-6);
        check_irradiance::<f64>(1e-14);
    }

    /// Protects: an irradiance that overflows `f32` close to a light stays finite and white.
    #[test]
    fn a_strong_light_close_by_is_finite() {
        let light_sample = point::<f32>(1e-6, None, 1e37)
            .sample(Vec3::ZERO)
            .expect("it shines");
        assert!(
            light_sample.arriving.is_finite() && light_sample.arriving.x >= 1e29,
            "{}",
            light_sample.arriving
        );
        assert!(
            point::<f32>(0.0, None, 1.0).sample(Vec3::ZERO).is_none(),
            "at the light itself"
        );
    }

    /// Protects: a spot with equal or nearly equal angles has a hard edge there, at any width, and
    /// full strength inside.
    #[test]
    fn the_edge_of_a_spot_may_be_hard() {
        fn hard<R: Real>() {
            for outer_angle in [0.5, 1.0, 22.5, 60.0, 90.0_f64] {
                for inner_angle in [outer_angle, 0.999 * outer_angle] {
                    let (falloff, direction) = (Falloff::None, [0.0, -1.0, 0.0]);
                    let kind = LightKind::Spot {
                        position: [0.0; 3],
                        direction,
                        inner_angle,
                        outer_angle,
                        falloff,
                        range: None,
                    };
                    let seen = |degrees: f64| {
                        let angle = degrees.to_radians();
                        let point =
                            R::Vec3::from_f64(DVec3::new(libm::sin(angle), -libm::cos(angle), 0.0));
                        light::<R>(kind.clone(), 1.0)
                            .sample(point)
                            .map_or(0.0, |light_sample| light_sample.arriving.to_f64().x)
                    };
                    assert!(
                        (seen(0.99 * outer_angle) - 1.0).abs() < 1e-6,
                        "{inner_angle} to {outer_angle}: {}",
                        seen(0.99 * outer_angle)
                    );
                    assert!(
                        (seen(0.0) - 1.0).abs() < 1e-6,
                        "{inner_angle} to {outer_angle}: {}",
                        seen(0.0)
                    );
                    assert_eq!(
                        seen(1.01 * outer_angle),
                        0.0,
                        "{inner_angle} to {outer_angle}"
                    );
                }
            }
        }
        hard::<f32>();
        hard::<f64>();
    }

    /// Protects: the edge of a spot has the values by hand: the square of the linear position
    /// between the two cosines.
    #[test]
    fn the_edge_of_a_spot_is_the_square_of_the_way_across() {
        let spot: DeltaLight<f64> = light(
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
            let light_sample = spot
                .sample(DVec3::new((1.0 - cosine * cosine).sqrt(), -cosine, 0.0))
                .expect("inside the cone");
            assert!(
                (light_sample.arriving.x - strength).abs() < 1e-12,
                "{share} of the way: {}",
                light_sample.arriving.x
            );
        }
        assert!(
            spot.sample(DVec3::new(1.0, -0.5, 0.0)).is_none(),
            "outside the cone"
        );
    }
}
