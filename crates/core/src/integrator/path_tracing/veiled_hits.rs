//! First hits of camera rays through media, for layers of the picture and the denoiser.
//!
//! A path that scatters in fog never reaches the surface behind. If layers took the paths' own hits,
//! they would be as noisy as chance is: fog, or the surface, sample by sample. So the surface
//! straight behind the media is recorded, with its albedo and normal in the share that is
//! visible, and the albedo of the media in the rest.

use glam::DVec3;
use raywright_bvh::{Hit, Real};

use super::super::{FirstHit, MOST_PASSAGES};
use super::scattering::beer_lambert;
use super::{PathState, PathTracer};
use crate::interaction::Interaction;
use crate::prepare::{PreparedMedium, RaySegment};

/// Points at which the density of a segment is evaluated.
const DENSITY_POINTS: u32 = 16;

impl<R: Real> PathTracer<'_, R> {
    /// Returns the first hits of the camera rays of paths in a scene with scattering media. `None`
    /// for the sky.
    pub(super) fn find_veiled_hits(
        &mut self,
        paths: &[PathState<R>],
        (active, hits): (&[u32], &[Hit<R>]),
        first_hits: &mut [Option<FirstHit>],
    ) {
        for (&index, &hit) in active.iter().zip(hits) {
            first_hits[index as usize] = self.find_veiled_hit(paths[index as usize], hit);
        }
    }

    fn find_veiled_hit(&mut self, mut view: PathState<R>, mut hit: Hit<R>) -> Option<FirstHit> {
        let (mut visible, mut albedo) = (1.0, DVec3::ZERO);
        for _ in 0..=MOST_PASSAGES {
            if let Some((medium, segment)) = self.segment_medium(&mut view, Some(&hit)) {
                let passed = self.mean_transmittance(medium, segment);
                albedo += medium.albedo * (visible * (1.0 - passed));
                visible *= passed;
            }
            let interaction = Interaction::from_hit(self.scene, &view.segment, &hit);
            if !self.scene.is_open_boundary(&hit) && !self.is_absent(&view, &interaction) {
                let first = FirstHit::new(self.scene, &view.segment, &hit);
                return Some(FirstHit {
                    albedo: (DVec3::from(first.albedo) * visible + albedo).to_array(),
                    normal: (DVec3::from(first.normal) * visible).to_array(),
                    ..first
                });
            }
            if self.scene.is_open_boundary(&hit) {
                view.media = self.media_beyond_surface(&view.media, &interaction);
            }
            if !self.pass_through_surface(&mut view, &interaction) {
                break;
            }
            hit = self.intersect_path_ray(&view)?;
        }
        None
    }

    /// Returns the transmittance of a medium along a segment, the mean of the channels. Without
    /// chance: the density is evaluated at fixed points.
    fn mean_transmittance(&mut self, medium: &PreparedMedium, segment: RaySegment) -> f64 {
        let [from, to] = segment.range;
        let step = (to - from) / f64::from(DENSITY_POINTS);
        let density = match medium.density {
            None => 1.0,
            Some(_) => {
                let at = |i: u32| segment.at(from + (f64::from(i) + 0.5) * step);
                let sum: f64 = (0..DENSITY_POINTS)
                    .map(|i| self.relative_density(medium, at(i)))
                    .sum();
                sum / f64::from(DENSITY_POINTS)
            }
        };
        let passed = beer_lambert(medium.majorant * density, to - from);
        passed.element_sum() / 3.0
    }
}
