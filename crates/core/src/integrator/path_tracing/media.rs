//! Media along a path: the stack of bodies that contain the current point, and their absorption.

use raywright_bvh::{Interval, Real, Vector};

use super::super::PathSegment;
use super::{PathState, PathTracer};
use crate::interaction::Interaction;

/// Greatest number of nested media; media entered beyond this number are ignored.
pub(crate) const MAX_MEDIA: usize = 7;

/// Greatest number of surfaces that the search for the media around the camera crosses.
const MOST_CROSSINGS: u32 = 64;

/// Stack of the media that a path has entered and not left. The medium entered last is on top. A
/// medium is identified by the index of its material.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct MediumStack {
    inside: [u32; MAX_MEDIA],
    count: u32,
}

impl MediumStack {
    /// Returns the stack on the far side of a boundary of `material`. Hit from `outside`, the
    /// boundary puts the material on top. Hit from inside, it removes the topmost entry of the
    /// material.
    pub fn cross_boundary(mut self, material: u32, outside: bool) -> Self {
        let count = self.count as usize;
        if outside {
            self.insert(count, material);
        } else if let Some(index) = self.last_index_of(material) {
            self.inside.copy_within(index + 1..count, index);
            self.count -= 1;
        }
        self
    }

    /// Inserts a medium at `index`, counted from the bottom. The media from that index on move up.
    fn insert(&mut self, index: usize, material: u32) {
        if (self.count as usize) < MAX_MEDIA {
            self.inside
                .copy_within(index..self.count as usize, index + 1);
            self.inside[index] = material;
            self.count += 1;
        }
    }

    /// Whether the stack contains the medium of a material.
    pub fn contains(&self, material: u32) -> bool {
        self.last_index_of(material).is_some()
    }

    fn last_index_of(&self, material: u32) -> Option<usize> {
        self.inside[..self.count as usize]
            .iter()
            .rposition(|&m| m == material)
    }

    /// Returns the medium of the greatest priority; among equals, the medium entered last. With an
    /// empty list, all priorities are equal.
    fn highest_priority(&self, priorities: &[u32]) -> Option<u32> {
        let inside = self.inside[..self.count as usize].iter().copied();
        if priorities.is_empty() {
            inside.last()
        } else {
            inside.max_by_key(|&material| priorities[material as usize])
        }
    }
}

impl<R: Real> PathTracer<'_, R> {
    /// Returns the media around the camera, the innermost on top. A ray from the camera leaves each
    /// of these media more often than it enters that medium.
    pub(super) fn find_camera_media(&self) -> MediumStack {
        let (scene, mut entered, mut around) =
            (self.scene, MediumStack::default(), MediumStack::default());
        let mut segment =
            PathSegment::from_ray(scene.camera.generate_ray(R::ZERO, R::ZERO, [0.5; 2]));
        if scene.camera.eye_to_origin_distance() != R::ZERO {
            return around;
        }
        for _ in 0..MOST_CROSSINGS {
            let range = Interval {
                min: self.min_distances.secondary,
                max: R::INFINITY,
            };
            let Some(hit) = scene.geometry.closest(&segment.ray, range, &mut ()) else {
                break;
            };
            let interaction = Interaction::from_hit(scene, &segment, &hit);
            let material = &scene.materials[interaction.material as usize];
            let context = scene.texture_tables.shading_context(&interaction);
            let is_boundary = material.absorption().is_some()
                || (self.has_nested_dielectrics() || scene.scatters)
                    && self.is_glass_boundary(interaction.material);
            if is_boundary && material.alpha_at(&context) > R::ZERO || material.is_open() {
                if interaction.outside || entered.contains(interaction.material) {
                    entered = entered.cross_boundary(interaction.material, interaction.outside);
                } else {
                    around.insert(0, interaction.material);
                }
            }
            segment.advance_to_ray(&self.scene.spawn_straight_ray(&interaction), Vector::ZERO);
        }
        around
    }

    /// Returns the media on the far side of a surface. A thin wall changes nothing.
    #[inline]
    pub(super) fn media_beyond_surface(
        &self,
        media: &MediumStack,
        interaction: &Interaction<R>,
    ) -> MediumStack {
        let bounds = self.scene.materials[interaction.material as usize].is_solid_boundary();
        if bounds {
            media.cross_boundary(interaction.material, interaction.outside)
        } else {
            *media
        }
    }

    /// Returns the effective medium among overlapping media: the medium of the greatest priority.
    /// `None` outside all media.
    #[inline]
    pub(super) fn effective_medium(&self, media: &MediumStack) -> Option<u32> {
        media.highest_priority(&self.scene.priorities)
    }

    /// Multiplies the path's throughput by the transmittance of the medium along the segment to a
    /// hit.
    #[inline(always)]
    pub(super) fn attenuate_by_media(&self, path: &mut PathState<R>, interaction: &Interaction<R>) {
        if self.scene.absorbs {
            // A hit from inside implies a body around the path, even if no hit recorded the entry.
            // A body whose surface is absent is not there.
            let around = self.effective_medium(&path.media).or_else(|| {
                (!interaction.outside && !self.is_absent(path, interaction))
                    .then_some(interaction.material)
            });
            path.throughput *= self.single_medium_transmittance(around, interaction.distance);
        }
    }

    /// Returns the transmittance of the effective medium along a part of an unoccluded shadow ray,
    /// given its start, direction and length. A medium either scatters or absorbs evenly.
    pub(super) fn media_transmittance(
        &mut self,
        path: &PathState<R>,
        media: &MediumStack,
        segment: (R::Vec3, R::Vec3, R),
    ) -> R::Vec3 {
        self.even_transmittance(media, segment.2)
            * self.scattering_transmittance(path, media, segment)
    }

    /// Returns the transmittance of the effective medium over a distance, if it only absorbs.
    pub(super) fn even_transmittance(&self, media: &MediumStack, distance: R) -> R::Vec3 {
        self.single_medium_transmittance(
            self.effective_medium(media).filter(|_| self.scene.absorbs),
            distance,
        )
    }

    /// Returns the transmittance of a medium over a distance in metres; 1 without a medium.
    fn single_medium_transmittance(&self, body: Option<u32>, distance: R) -> R::Vec3 {
        let absorption =
            body.and_then(|material| self.scene.materials[material as usize].absorption());
        absorption.map_or(Vector::ONE, |absorption| {
            beer_lambert::<R>(absorption, distance)
        })
    }
}

/// Returns the transmittance exp(−a·d) for the absorption a per metre and the distance d in metres
/// (Beer and Lambert).
fn beer_lambert<R: Real>(absorption: R::Vec3, distance: R) -> R::Vec3 {
    // A zero distance absorbs nothing even for infinite absorption, and zero absorption nothing
    // even over an infinite distance.
    let share = |a: R| {
        if distance > R::ZERO && a > R::ZERO {
            Real::exp(-(a * distance))
        } else {
            R::ONE
        }
    };
    R::Vec3::new(
        share(absorption.x()),
        share(absorption.y()),
        share(absorption.z()),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DVec3, Vec3};

    /// Protects: transmittance lies in [0, 1] from no to full absorption, and is exact to a few
    /// units of rounding.
    #[test]
    fn s21_transmittance() {
        let endless = f64::INFINITY;
        let finite = [(0.0, 5.0), (1e-8, 1.0), (1e3, 1.0), (3.0, 0.25), (0.0, 1e9)];
        let infinite = [
            (endless, 0.0),
            (endless, 1.0),
            (0.0, endless),
            (-0.0, endless),
            (1e-8, endless),
            (endless, endless),
        ];
        for (a, d) in finite.into_iter().chain(infinite) {
            let (single, double) = (
                beer_lambert::<f32>(Vec3::splat(a as f32), d as f32).x,
                beer_lambert::<f64>(DVec3::splat(a), d).x,
            );
            let expected = if d == 0.0 || a == 0.0 {
                1.0
            } else {
                (-a * d).exp()
            };
            assert!(
                (double - expected).abs() <= 1e-15 && (f64::from(single) - expected).abs() <= 1e-6,
                "{a} · {d}: {single} {double}"
            );
        }
    }

    /// Protects: media are left in any order, and leaving one that was never entered changes
    /// nothing.
    #[test]
    fn bodies_in_bodies() {
        let media = MediumStack::default()
            .cross_boundary(7, true)
            .cross_boundary(3, true)
            .cross_boundary(9, true);
        assert_eq!(
            (
                media.highest_priority(&[]),
                media.cross_boundary(3, false).highest_priority(&[]),
                media.cross_boundary(9, false).highest_priority(&[])
            ),
            (Some(9), Some(9), Some(3))
        );
        assert_eq!(
            media
                .cross_boundary(3, false)
                .cross_boundary(9, false)
                .highest_priority(&[]),
            Some(7)
        );
        assert_eq!(
            media.cross_boundary(4, false).highest_priority(&[]),
            Some(9)
        );
        assert_eq!(
            (
                MediumStack::default()
                    .cross_boundary(1, false)
                    .highest_priority(&[]),
                MediumStack::default().highest_priority(&[])
            ),
            (None, None)
        );
        assert_eq!(
            (0..9)
                .fold(MediumStack::default(), |media, m| media
                    .cross_boundary(m, true))
                .highest_priority(&[]),
            Some(6)
        );
    }
}
