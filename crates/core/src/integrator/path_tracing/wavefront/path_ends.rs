//! Ends of paths: radiance of the sky or the backdrop behind a path without a hit, and the result
//! of each path.

use raywright_bvh::{Real, Vector};

use super::Wavefront;
use crate::integrator::path_tracing::{PathState, PathTracer};
use crate::integrator::{PathResult, PathResults};

impl<R: Real> PathTracer<'_, R> {
    /// Ends the paths without a hit: adds the radiance of the sky or, for camera rays, of the
    /// backdrop in front of the sky.
    pub(super) fn end_escaped_paths(
        &mut self,
        Wavefront {
            paths,
            escaped,
            sky_samples,
            ..
        }: &mut Wavefront<R>,
        directs: &mut [R::Vec3],
    ) {
        let backdrop = self.scene.backdrop;
        let backdrop_of = |path: &PathState<R>| backdrop.filter(|_| path.segments_traced == 0);
        sky_samples.clear();
        let path = |&index: &u32| &paths[index as usize];
        let under_sky = escaped
            .iter()
            .map(path)
            .filter(|path| backdrop_of(path).is_none());
        self.scene.lights.sky.eval_rays(
            under_sky.map(|path| (path.segment.start_point(), path.segment.ray.direction)),
            sky_samples,
        );
        let before_backdrop = escaped
            .iter()
            .map(path)
            .filter(|path| backdrop_of(path).is_some());
        let (mut seen, mut on_ground) = (
            sky_samples.iter(),
            self.trace_ground_visibility(before_backdrop).into_iter(),
        );
        for index in escaped.drain(..) {
            let path = &mut paths[index as usize];
            let radiance = match backdrop_of(path) {
                Some(backdrop) => {
                    let light = on_ground.next().unwrap_or(R::ONE);
                    path.shadow = R::ONE - light;
                    backdrop.radiance(path.segment.ray.direction) * light
                }
                None => seen.next().map_or(Vector::ZERO, |sky_sample| {
                    self.weighted_sky_radiance(path, sky_sample)
                }),
            };
            let arriving = path.throughput * radiance;
            path.radiance += arriving;
            if path.segments_traced == 0
                && let Some(direct) = directs.get_mut(index as usize)
            {
                *direct += arriving;
            }
        }
    }

    /// Returns the results of the paths. Clamps their radiance and adds the scene's veil, a
    /// constant radiance, if the scene has these settings.
    pub(super) fn collect_results(
        &self,
        wave: &Wavefront<R>,
        PathResults {
            paths: results,
            direct: directs,
            ..
        }: &mut PathResults<R>,
    ) {
        let share = |path: &PathState<R>| {
            self.scene
                .clamp
                .map(|maximum| radiance_clamp_factor::<R>(path.radiance, maximum))
        };
        for (direct, path) in directs.iter_mut().zip(&wave.paths) {
            *direct = *direct * share(path).unwrap_or(R::ONE) + self.scene.veil;
        }
        results.extend(wave.paths.iter().map(|path| {
            let radiance =
                share(path).map_or(path.radiance, |share| path.radiance * share) + self.scene.veil;
            let (coverage, shadow) = if path.has_hit {
                (R::ONE, R::ZERO)
            } else {
                (R::ZERO, path.shadow)
            };
            PathResult {
                radiance,
                coverage,
                shadow,
            }
        }));
    }
}

/// Returns the factor that reduces the brightest channel of a radiance to `maximum`; 1 if it is
/// below.
fn radiance_clamp_factor<R: Real>(radiance: R::Vec3, maximum: R) -> R {
    let brightest = radiance.max_element();
    if brightest > maximum {
        maximum / brightest
    } else {
        R::ONE
    }
}
