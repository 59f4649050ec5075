//! Wavefront path tracing: many paths at a time, stage by stage, one segment of all paths before
//! the next. Memory requests of one path overlap with the computation of others, and rays, sky and
//! surfaces each have the caches to themselves. No path's bits depend on the other paths.

use raywright_bvh::{Hit, Interval, Real, Vector, widest};

use super::super::{CameraRays, FirstHits, PACKET, PathResult, PathResults};
use super::gather::VertexQueues;
use super::light::AskedLights;
use super::respond::{Answers, Respond};
use super::scatter::Onward;
use super::shade::ShadedLanes;
use super::vertices::{Bounce, VertexLanes};
use super::{PathState, PathTracer, VertexSamples};
use crate::interaction::Interaction;
use crate::light::{Column, LANES, LightLanes, SkySample};
use crate::sampler::{Purpose, Sequence, fours};

/// State of a batch of paths; kept to reuse the memory of the lists.
#[derive(Default)]
pub(super) struct Wavefront<R: Real> {
    paths: Vec<PathState<R>>,
    /// Indices of the active paths.
    going: Vec<u32>,
    /// Hits of the active paths, in their order.
    hits: Vec<Option<Hit<R>>>,
    /// Sky samples of the escaped paths.
    seen: Vec<SkySample<R>>,
    /// Interactions of the other paths, and spare entries.
    met: Vec<Interaction<R>>,
    sequences: Vec<(Sequence, u32)>,
    draws: Vec<[f32; 4]>,
    vertices: VertexQueues<R>,
    /// Sampled lights of the vertices of one kind.
    asked: AskedLights<R>,
    /// Whether each active path survives.
    goes: Vec<bool>,
    first_hits: FirstHits<R>,
}

impl<R: Real> PathTracer<'_, R> {
    /// Traces the paths of camera rays to their ends.
    pub(super) fn follow(
        &mut self,
        rays: CameraRays<'_, R>,
        wave: &mut Wavefront<R>,
        results: &mut PathResults<R>,
    ) {
        self.start(rays, wave);
        if self.keeps_first {
            results.first_hits.resize(rays.rays.len(), None);
            results.direct.resize(rays.rays.len(), Vector::ZERO);
        }
        while !wave.going.is_empty() {
            self.escape(wave, &mut results.direct);
            self.locate(wave);
            self.draw(wave);
            self.evaluate(wave, results);
            self.shade(wave);
            compact(wave);
            self.intersect(wave);
        }
        self.finish(wave, results);
    }

    /// Starts the paths of camera rays and finds their first hits: rays of a common origin are
    /// intersected as packets.
    fn start(
        &mut self,
        CameraRays { rays, addresses }: CameraRays<'_, R>,
        wave: &mut Wavefront<R>,
    ) {
        let Wavefront {
            paths,
            going,
            hits,
            first_hits,
            ..
        } = wave;
        self.counters.camera += rays.len() as u64;
        paths.clear();
        paths.extend(
            rays.iter()
                .zip(addresses)
                .map(|(&ray, &address)| self.camera_path(ray, address)),
        );
        going.clear();
        going.extend(0..rays.len() as u32);
        hits.clear();
        for (rays, paths) in rays.chunks(PACKET).zip(paths.chunks(PACKET)) {
            first_hits.intersect(self.scene, rays);
            hits.extend(
                paths
                    .iter()
                    .enumerate()
                    .map(|(i, path)| first_hits.get(i).copied().unwrap_or_else(|| self.hit(path))),
            );
        }
    }

    /// Traces the rays of the active paths.
    fn intersect(
        &self,
        Wavefront {
            paths, going, hits, ..
        }: &mut Wavefront<R>,
    ) {
        hits.clear();
        hits.extend(going.iter().map(|&place| self.hit(&paths[place as usize])));
    }

    /// The hit of a path's ray.
    #[inline(always)]
    fn hit(&self, path: &PathState<R>) -> Option<Hit<R>> {
        let min = if path.traced == 0 {
            self.least.camera - path.leg.ahead
        } else {
            self.least.secondary
        };
        self.scene.geometry.closest(
            &path.leg.ray,
            Interval {
                min,
                max: R::INFINITY,
            },
            &mut (),
        )
    }

    /// Ends the paths without a hit, with the radiance of the sky or of the backdrop before it.
    fn escape(
        &mut self,
        Wavefront {
            paths,
            going,
            hits,
            seen,
            ..
        }: &mut Wavefront<R>,
        directs: &mut [R::Vec3],
    ) {
        let escaped = || {
            going
                .iter()
                .zip(&*hits)
                .filter(|(_, hit)| hit.is_none())
                .map(|(&place, _)| place as usize)
        };
        let backdrop = self.scene.backdrop;
        let backdrop_of = |path: &PathState<R>| backdrop.filter(|_| path.traced == 0);
        seen.clear();
        let under_sky = escaped()
            .map(|place| &paths[place])
            .filter(|path| backdrop_of(path).is_none());
        self.scene.lights.sky.look(
            under_sky.map(|path| (path.leg.start(), path.leg.ray.direction)),
            seen,
        );
        let before_backdrop = escaped()
            .map(|place| &paths[place])
            .filter(|path| backdrop_of(path).is_some());
        let (mut seen, mut on_ground) = (
            seen.iter(),
            self.light_on_ground(before_backdrop).into_iter(),
        );
        for place in escaped() {
            let path = &mut paths[place];
            let radiance = match backdrop_of(path) {
                Some(backdrop) => {
                    let light = on_ground.next().unwrap_or(R::ONE);
                    path.shadow = R::ONE - light;
                    backdrop.seen(path.leg.ray.direction) * light
                }
                None => seen
                    .next()
                    .map_or(Vector::ZERO, |seen| self.escaped(path, seen)),
            };
            let brought = path.throughput * radiance;
            path.radiance += brought;
            if path.traced == 0
                && let Some(direct) = directs.get_mut(place)
            {
                *direct += brought;
            }
        }
        let mut hit = hits.iter();
        going.retain(|_| hit.next().is_some_and(Option::is_some));
        hits.retain(Option::is_some);
    }

    /// Computes points, frames and coordinates of hits; their texels are prefetched before any is
    /// read.
    fn locate(
        &self,
        Wavefront {
            paths,
            going,
            hits,
            met,
            ..
        }: &mut Wavefront<R>,
    ) {
        if met.len() < going.len() {
            met.resize(going.len(), Interaction::NOWHERE);
        }
        let hits = hits.iter().flatten();
        let rays = going.iter().map(|&place| &paths[place as usize].leg.ray);
        self.scene
            .geometry
            .surfaces(rays.zip(hits.clone()), |k, surface| {
                met[k].surface = surface
            });
        for ((&place, hit), at) in going.iter().zip(hits).zip(met) {
            let leg = &paths[place as usize].leg;
            at.begin_located(self.scene, &leg.ray, hit);
            at.finish(self.scene, leg, hit);
            self.scene.sources.prefetch(at);
        }
    }

    /// Computes the random numbers that nearly every vertex needs.
    fn draw(
        &self,
        Wavefront {
            paths,
            going,
            sequences,
            draws,
            ..
        }: &mut Wavefront<R>,
    ) {
        let asks_lights = !self.scene.lights.choice().is_empty();
        sequences.clear();
        draws.clear();
        for &place in &*going {
            let PathState { address, way, .. } = &paths[place as usize];
            sequences.push((
                Sequence::on(*way, *address, Purpose::Scatter),
                address.index,
            ));
            if asks_lights {
                sequences.push((Sequence::on(*way, *address, Purpose::Light), address.index));
            }
        }
        fours(sequences.iter().copied(), draws);
        for (&place, draws) in going
            .iter()
            .zip(draws.chunks_exact(if asks_lights { 2 } else { 1 }))
        {
            // Directions matter most: they get the first two dimensions of a point, which are the
            // best stratified.
            let [u, v, luck, lobe] = draws[0];
            paths[place as usize].draws = VertexSamples {
                scatter: [lobe, u, v, luck],
                light: draws.get(1).copied().unwrap_or_default(),
            };
        }
    }

    /// Evaluates materials, adds emission, and puts vertices into queues by kind.
    fn evaluate(&mut self, wave: &mut Wavefront<R>, results: &mut PathResults<R>) {
        let Wavefront {
            paths,
            going,
            hits,
            met,
            vertices,
            goes,
            ..
        } = wave;
        vertices.clear();
        goes.clear();
        for (k, (&place, at)) in going.iter().zip(&mut *met).enumerate() {
            let (path, Some(hit)) = (&mut paths[place as usize], &hits[k]) else {
                continue;
            };
            goes.push(self.gather(k as u32, (path, hit, at), vertices));
            if self.keeps_first {
                let (first, direct) = (
                    &mut results.first_hits[place as usize],
                    &mut results.direct[place as usize],
                );
                *first = self.first.take().or(*first);
                *direct += core::mem::replace(&mut self.direct, Vector::ZERO);
            }
        }
    }

    /// Shades the vertices, kind by kind.
    fn shade(
        &mut self,
        Wavefront {
            paths,
            going,
            hits,
            met,
            vertices,
            asked,
            goes,
            ..
        }: &mut Wavefront<R>,
    ) {
        vertices.bend_normals(met);
        let (mut bounce, compensated) = (
            Bounce {
                paths,
                going,
                met,
                hits,
            },
            self.scene.compensates,
        );
        let VertexQueues {
            matte,
            glossy,
            general,
            surfaces,
            ..
        } = vertices;
        self.shade_each(
            &mut bounce,
            (matte.lanes(), asked),
            goes,
            |_, _, _, (vertices, lights), _| {
                widest(Respond::<R, true> {
                    vertices,
                    lights,
                    compensated,
                })
            },
        );
        self.shade_each(
            &mut bounce,
            (glossy.lanes(), asked),
            goes,
            |_, _, _, (vertices, lights), _| {
                widest(Respond::<R, false> {
                    vertices,
                    lights,
                    compensated,
                })
            },
        );
        self.shade_each(
            &mut bounce,
            (general.lanes(), asked),
            goes,
            |tracer, bounce, before, lanes, onward| {
                tracer.answer_general(bounce, (surfaces, before), lanes, onward)
            },
        );
    }

    /// Shades vertices of one kind and continues their paths. `answer` returns the responses of a
    /// batch to its lights, given the number of vertices before it; it sets the properties of
    /// scattered rays that differ from rough opaque surfaces.
    fn shade_each(
        &mut self,
        bounce: &mut Bounce<'_, R>,
        (vertices, asked): (&mut [VertexLanes<R>], &mut AskedLights<R>),
        goes: &mut [bool],
        answer: impl Fn(
            &Self,
            &Bounce<'_, R>,
            usize,
            (&VertexLanes<R>, &LightLanes<R>),
            &mut Column<Onward<R>>,
        ) -> Answers<R>,
    ) {
        self.sample_lights(bounce, vertices, asked);
        let mut onward = [Onward::REFLECTED; LANES];
        for (group, (vertices, (chosen, lights))) in vertices.iter().zip(asked.lanes()).enumerate()
        {
            let answers = answer(self, bounce, group * LANES, (vertices, lights), &mut onward);
            let shaded = ShadedLanes::of(
                vertices,
                lights,
                &answers,
                self.scene.rules.shadow_max_distance,
            );
            for lane in 0..vertices.len {
                let place = vertices.place[lane] as usize;
                if let Some(chosen) = chosen[lane].as_ref().filter(|_| shaded.lit.is_lit[lane]) {
                    self.add_light(bounce, (vertices, lane), (chosen, lights), &shaded);
                }
                if shaded.next.goes_on[lane] {
                    self.send_on(
                        bounce,
                        (vertices, lane),
                        (&answers, &shaded.next),
                        &onward[lane],
                    );
                } else {
                    if shaded.next.overflows[lane] {
                        bounce.paths[bounce.going[place] as usize].radiance =
                            Vector::splat(R::INFINITY);
                    }
                    goes[place] = false;
                }
            }
        }
    }

    /// Results of the paths, clamped and veiled as the scene requires.
    fn finish(
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
                .map(|most| clamping::<R>(path.radiance, most))
        };
        for (direct, path) in directs.iter_mut().zip(&wave.paths) {
            *direct = *direct * share(path).unwrap_or(R::ONE) + self.scene.veil;
        }
        results.extend(wave.paths.iter().map(|path| {
            let radiance =
                share(path).map_or(path.radiance, |share| path.radiance * share) + self.scene.veil;
            let (coverage, shadow) = if path.hit {
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

/// Keeps the surviving paths.
fn compact<R: Real>(Wavefront { going, goes, .. }: &mut Wavefront<R>) {
    let mut goes_on = goes.iter();
    going.retain(|_| goes_on.next() == Some(&true));
}

/// Factor that clamps a radiance's brightest channel to a limit.
fn clamping<R: Real>(radiance: R::Vec3, most: R) -> R {
    let brightest = radiance.max_element();
    if brightest > most {
        most / brightest
    } else {
        R::ONE
    }
}

#[cfg(test)]
mod tests;
