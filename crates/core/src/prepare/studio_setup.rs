//! Adds the backdrop and the ground of a studio to a prepared scene. The brightness of the backdrop
//! depends on the objects. The shadow on the ground depends on the studio's lights.

use core::f64::consts::PI;

use glam::DVec3;
use raywright_bvh::{Interval, Ray, Real, Vector};

use super::prepared_scene::PreparedScene;
use super::studio::{Backdrop, StudioGround};
use crate::camera::{direction_from_angles, eye_and_axes};
use crate::display::curve::{encode_transfer, luminance};
use crate::effects::{Effect, EffectSet};
use crate::integrator::PathSegment;
use crate::interaction::Interaction;
use crate::light::{ShadowRayTarget, SkyRadiance, SphereGrid};
use crate::motion::{pose_at, shutter_opening};
use crate::scene::{Camera, Studio, TransferCurve};
use crate::settings::{Background, Settings};
use crate::storage_origin::camera_relative_to;

impl<R: Real> StudioGround<R> {
    /// Creates the ground below a scene, lit by a sky. `None` if the scene has no objects or
    /// unbounded ones, or if no light comes from above.
    fn build_below_scene(scene: &PreparedScene<R>, sky: &SkyRadiance<R>) -> Option<Self> {
        const SIZE: [usize; 2] = [64, 32];
        let bounds = scene.geometry.bounded_primitives_box();
        if bounds.is_empty() || scene.geometry.unbounded_count() > 0 {
            return None;
        }
        let arriving = |column: usize, row: usize| {
            let turn = 2.0 * PI * ((column as f64 + 0.5) / SIZE[0] as f64 - 0.5);
            let height = libm::cos(PI * (row as f64 + 0.5) / SIZE[1] as f64);
            let ring = (1.0 - height * height).sqrt();
            let direction = DVec3::new(ring * libm::cos(turn), height, ring * libm::sin(turn));
            let radiance = sky
                .radiance(R::Vec3::ZERO, R::Vec3::from_f64(direction))
                .to_f64();
            (radiance.x + radiance.y + radiance.z) * height.max(0.0)
        };
        let light = SphereGrid::new(SIZE[0], SIZE[1], 0.0, arriving)?;
        // Seen from ten scene diagonals away, the objects rise at most a tenth of a radian above
        // the horizon and block less than a hundredth of the light.
        let reach = 10.0 * bounds.extent().length();
        let centre = DVec3::new(bounds.centre().x, bounds.min.y, bounds.centre().z);
        Some(Self {
            height: R::from_f64(bounds.min.y),
            centre: R::Vec3::from_f64(centre),
            shadow_radius: R::from_f64(reach),
            direction_sampler: light,
        })
    }
}

/// Display brightness, 0 to 1, above which surfaces count as bright. It lies halfway between the
/// display codes of the dark and of the light backdrop.
const BRIGHT: f64 = 0.48;
/// Least alpha of surfaces that determine the backdrop, and of those that do if no others exist.
const LEAST_ALPHAS: [f64; 2] = [0.5, 0.02];
/// Approximate radiance of a white surface that a studio lights.
const LIT: f64 = 0.7;

impl<R: Real> PreparedScene<R> {
    /// Adds a studio's backdrop and ground for a camera. The brightness of the backdrop is computed
    /// for the first camera and kept for later cameras.
    pub(super) fn add_studio(
        &mut self,
        studio: &Studio,
        camera: &Camera,
        settings: &Settings,
        simulated: EffectSet,
    ) {
        self.ground = if simulated.has(Effect::GroundShadow) {
            StudioGround::build_below_scene(self, &self.lights.sky)
        } else {
            None
        };
        if settings.background == Background::Transparent {
            if self.ground.is_some() {
                self.backdrop = Some(Backdrop::Constant(Vector::splat(R::from_f64(
                    settings.radiance_behind_ground(),
                ))));
            }
            return;
        }
        let radiance = studio.backdrop.or(self.studio_backdrop).unwrap_or_else(|| {
            let is_bright = LEAST_ALPHAS
                .into_iter()
                .find_map(|least_alpha| self.median_object_brightness(least_alpha))
                .is_none_or(|brightness| brightness > BRIGHT);
            if is_bright {
                Studio::DARK_BACKDROP
            } else {
                Studio::LIGHT_BACKDROP
            }
        });
        self.studio_backdrop = Some(radiance);
        self.backdrop = Some(Backdrop::from_studio(
            radiance * self.backdrop_factor,
            camera,
        ));
    }

    /// Sets the exposure in stops at which the backdrop of a studio has its radiance.
    pub(crate) fn set_backdrop_exposure(&mut self, stops: f64) {
        let factor = libm::exp2(-stops);
        if let Some(backdrop) = self
            .backdrop
            .as_mut()
            .filter(|_| self.studio_backdrop.is_some())
        {
            backdrop.scale(R::from_f64(factor / self.backdrop_factor));
        }
        self.backdrop_factor = factor;
    }

    /// Whether surfaces keep the light of a studio from a camera: they block at least 15 of 16
    /// directions.
    pub(crate) fn encloses_camera(&self, camera: &Camera) -> bool {
        const DIRECTIONS: u32 = 256;
        let view = camera_relative_to(self.origin.origin, camera);
        let (eye, _) = eye_and_axes(&pose_at(&view, shutter_opening(&view)));
        let is_open = |i: &u32| {
            // The golden spiral covers the sphere evenly.
            let height = 1.0 - f64::from(2 * i + 1) / f64::from(DIRECTIONS);
            let turn = f64::from(*i) * PI * (3.0 - 5.0_f64.sqrt());
            let ring = (1.0 - height * height).sqrt();
            let direction = DVec3::new(ring * libm::cos(turn), height, ring * libm::sin(turn));
            let ray = Ray::new(Vector::from_f64(eye), Vector::from_f64(direction));
            let range = Interval {
                min: R::ZERO,
                max: R::INFINITY,
            };
            let target = ShadowRayTarget::Infinity;
            self.trace_shadow((&ray, range), &target, false).share > R::ZERO
        };
        (0..DIRECTIONS).filter(is_open).count() * 16 <= DIRECTIONS as usize
    }

    /// Returns the median display brightness, 0 to 1, of the surfaces of at least this alpha that
    /// parallel rays from six fixed directions hit; `None` if no ray hits. It does not depend on the
    /// camera, so the backdrop is the same from all sides.
    fn median_object_brightness(&self, least_alpha: f64) -> Option<f64> {
        const EDGE: u16 = 16;
        let bounds = self.geometry.bounded_primitives_box();
        if bounds.is_empty() {
            return None;
        }
        let (centre, radius) = (bounds.centre(), 0.5 * bounds.extent().length());
        let mut found = Vec::new();
        for (azimuth, elevation) in [
            (0.0, 10.0),
            (45.0, 30.0),
            (-45.0, 30.0),
            (180.0, 10.0),
            (135.0, 30.0),
            (-135.0, 30.0),
        ] {
            let back = direction_from_angles(f64::to_radians(azimuth), f64::to_radians(elevation));
            let right = direction_from_angles(f64::to_radians(azimuth + 90.0), 0.0);
            let up = back.cross(right);
            let at = |i: u16| radius * ((2.0 * f64::from(i) + 1.0) / f64::from(EDGE) - 1.0);
            for place in 0..EDGE * EDGE {
                let origin = centre
                    + back * (2.0 * radius)
                    + right * at(place % EDGE)
                    + up * at(place / EDGE);
                let ray =
                    Ray::new(Vector::from_f64(origin), Vector::from_f64(-back)).as_camera_ray();
                found.extend(self.brightness_along_ray(&ray, least_alpha));
            }
        }
        found.sort_by(f64::total_cmp);
        found.get(found.len() / 2).copied()
    }

    /// Returns the display brightness, 0 to 1, of a surface along a ray: the first whose alpha is
    /// at least `least_alpha`. `None` if the ray hits no such surface.
    fn brightness_along_ray(&self, ray: &Ray<R>, least_alpha: f64) -> Option<f64> {
        const CUTOUTS: usize = 16;
        let mut min = R::ZERO;
        for _ in 0..CUTOUTS {
            let hit = self.geometry.closest(
                ray,
                Interval {
                    min,
                    max: R::INFINITY,
                },
                &mut (),
            )?;
            let interaction = Interaction::from_hit(self, &PathSegment::from_ray(*ray), &hit);
            let context = self.texture_tables.shading_context(&interaction);
            let material = &self.materials[interaction.material as usize];
            if material.alpha_at(&context) >= R::from_f64(least_alpha) {
                let colour = material.base_colour_at(&context);
                let light = colour.to_f64() * LIT + material.emission_at(&context).to_f64();
                // The luminance is taken of the sRGB-encoded colour, because a saturated colour
                // looks brighter than its linear luminance.
                return Some(luminance(light.to_array().map(|channel| {
                    encode_transfer(TransferCurve::Srgb, channel.clamp(0.0, 1.0))
                })));
            }
            min = hit.t * R::from_f64(1.0 + 1e-5);
        }
        None
    }
}

#[cfg(test)]
mod tests;
