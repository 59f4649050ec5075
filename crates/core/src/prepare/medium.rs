//! Prepared media: coefficients for tracking, compiled densities, and the ball of air.

use glam::DVec3;
use raywright_bvh::{Aabb, Real};

use super::error::PrepareError;
use super::inputs::InputCompiler;
use crate::expr::ExprScope;
use crate::scene::{Medium, Scene, Shape};
use crate::texture::PreparedInput;

/// Greatest coefficient per metre, which stands for infinity and fits an `f32`.
pub(super) const MOST_ATTENUATION: f64 = 1e30;

/// A medium that scatters light, or whose density varies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PreparedMedium {
    /// Coefficient of absorption and scattering together, per metre, at the greatest density.
    pub majorant: DVec3,
    /// Scattered share of the attenuated light.
    pub albedo: DVec3,
    /// Mean cosine of the scattering angle.
    pub anisotropy: f64,
    /// Program of the density, and one over the greatest density; `None` for an even medium.
    pub density: Option<(u32, f64)>,
    /// Index of the material of the body; `None` for the air.
    pub material: Option<u32>,
    /// Whether the body is infinite somewhere.
    pub is_unbounded: bool,
}

/// The air: a ball of a medium, in stored coordinates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PreparedAir {
    pub medium: PreparedMedium,
    pub centre: DVec3,
    pub radius: f64,
}

impl PreparedMedium {
    /// Prepares a medium. The compiler's path is that of the medium's owner, `field` the medium's
    /// key in it.
    pub(super) fn new<R: Real>(
        medium: &Medium,
        material: Option<u32>,
        inputs: &mut InputCompiler<'_, R>,
        field: &str,
    ) -> Result<Self, PrepareError> {
        let field = format!("{field}density");
        let density = inputs.compile_weight(&medium.density, ExprScope::Medium, &field)?;
        let (density, factor) = match density {
            PreparedInput::Program(program) => {
                // A density of zero everywhere divides by nothing.
                let most = medium.max_density.max(f64::MIN_POSITIVE);
                (Some((program, 1.0 / most)), medium.max_density)
            }
            constant => (None, constant.constant_number().to_f64()),
        };
        let [absorption, scattering] = medium.coefficients().map(DVec3::from);
        let attenuation = absorption + scattering;
        let share = |k: usize| {
            if scattering[k] > 0.0 {
                scattering[k] / attenuation[k]
            } else {
                0.0
            }
        };
        Ok(Self {
            majorant: (attenuation * factor).min(DVec3::splat(MOST_ATTENUATION)),
            albedo: DVec3::new(share(0), share(1), share(2)),
            anisotropy: medium.anisotropy,
            density,
            material,
            is_unbounded: false,
        })
    }

    /// Whether all channels are attenuated alike.
    #[inline(always)]
    pub fn is_grey(&self) -> bool {
        self.majorant == DVec3::splat(self.majorant.x)
    }

    /// Whether the medium only absorbs.
    pub fn is_dark(&self) -> bool {
        self.albedo == DVec3::ZERO
    }
}

/// Marks the media of bodies that are infinite somewhere.
pub(super) fn mark_unbounded_media(
    media: &mut [PreparedMedium],
    scene: &Scene,
    object_materials: impl Iterator<Item = u32>,
) {
    for (object, material) in scene.objects.iter().zip(object_materials) {
        if matches!(
            object.shape,
            Shape::Plane { .. } | Shape::Cylinder { height: None, .. }
        ) {
            media
                .iter_mut()
                .filter(|medium| medium.material == Some(material))
                .for_each(|medium| medium.is_unbounded = true);
        }
    }
}

impl PreparedAir {
    /// Places the air of a scene. `bounded` is the box of the bounded objects, `origin` the storage
    /// origin.
    pub fn new(medium: PreparedMedium, scene: &Scene, bounded: &Aabb, origin: DVec3) -> Self {
        let (centre, extent) = if bounded.is_empty() {
            (DVec3::ZERO, 1.0)
        } else {
            let centre = 0.5 * (bounded.min + bounded.max);
            (centre, 0.5 * bounded.extent().length())
        };
        let eyes = scene.cameras.iter().map(|camera| camera.pose.eye());
        let farthest = eyes.fold(0.0, |most: f64, eye| {
            most.max((eye - origin - centre).length())
        });
        let own = scene.air.as_ref().and_then(|air| air.radius);
        Self {
            medium,
            centre,
            radius: own.unwrap_or_else(|| (4.0 * extent).max(2.0 * farthest)),
        }
    }

    /// Returns the distances at which a ray enters and leaves the air; the second is not greater
    /// than the first for a ray that misses.
    pub fn intersect(&self, origin: DVec3, direction: DVec3) -> [f64; 2] {
        let to_centre = self.centre - origin;
        let along = to_centre.dot(direction);
        let aside = (to_centre - direction * along).length_squared();
        let half = (self.radius * self.radius - aside).max(0.0).sqrt();
        [along - half, along + half]
    }
}
