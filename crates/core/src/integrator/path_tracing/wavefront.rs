//! Many paths at a time, each segment of all of them before the next one of any: what one asks of memory is on its way while others
//! compute, and rays, sky and surfaces each have the caches to themselves. No path's bits depend on which others it goes with.

use raywright_bvh::{Hit, Real, Vector};

use super::super::{CameraRays, FirstHits, General, PACKET, PathResult, PathResults};
use super::plain::{Bounce, Plain};
use super::{Draws, PathState, PathTracer};
use crate::interaction::Interaction;
use crate::light::Seen;
use crate::sampler::{Purpose, Sequence, fours};

/// Paths on their way together; kept by who has many, so that its lists are made once.
pub(crate) struct Wavefront<R: Real> {
    paths: Vec<PathState<R>>,
    /// What those that go on hit, in their order.
    hits: Vec<Option<Hit<R>>>,
    /// Those that have a ray to be traced, by their places.
    going: Vec<u32>,
    /// What those that met nothing see of the sky.
    seen: Vec<Seen<R>>,
    /// What the others met.
    met: Vec<Interaction<R>>,
    draws: Vec<[f32; 4]>,
    plains: Vec<Plain<R>>,
    /// Which of them go on.
    goes: Vec<bool>,
    together: FirstHits<R>,
}

impl<R: Real> Default for Wavefront<R> {
    fn default() -> Self {
        Self {
            paths: Vec::new(),
            hits: Vec::new(),
            going: Vec::new(),
            seen: Vec::new(),
            met: Vec::new(),
            draws: Vec::new(),
            plains: Vec::new(),
            goes: Vec::new(),
            together: FirstHits::default(),
        }
    }
}

impl<R: Real> PathTracer<'_, R> {
    /// Follows the paths of camera rays to their ends.
    pub(super) fn follow(
        &mut self,
        CameraRays { rays, addresses }: CameraRays<'_, R>,
        wavefront: &mut Wavefront<R>,
        PathResults { paths: results, first_hits: firsts, direct: directs }: &mut PathResults<R>,
    ) {
        let Wavefront { paths, hits, going, seen, met, draws, plains, goes, together: found } = wavefront;
        paths.clear();
        paths.extend(rays.iter().zip(addresses).map(|(&ray, &address)| self.camera_path(ray, address)));
        self.counters.camera += rays.len() as u64;
        going.clear();
        going.extend(0..rays.len() as u32);
        hits.clear();
        for (rays, paths) in rays.chunks(PACKET).zip(paths.chunks(PACKET)) {
            found.intersect(self.scene, rays);
            hits.extend(paths.iter().enumerate().map(|(i, path)| found.get(i).copied().unwrap_or_else(|| self.intersect(path))));
        }
        if self.keeps_first {
            firsts.resize(rays.len(), None);
            directs.resize(rays.len(), Vector::ZERO);
        }
        while !going.is_empty() {
            self.escape(paths, going, hits, (seen, directs));
            // What the surfaces read is asked for before any of it is waited for.
            met.clear();
            for (&place, hit) in going.iter().zip(&*hits) {
                let (leg, Some(hit)) = (&paths[place as usize].leg, hit) else { continue };
                met.push(Interaction::begun(self.scene, leg, hit));
                let Some(at) = met.last_mut() else { continue };
                at.finish::<General>(self.scene, leg, hit);
                self.scene.sources.prefetch(at);
            }
            self.draw(paths, going, draws);
            plains.clear();
            goes.clear();
            for (k, (&place, at)) in going.iter().zip(&mut *met).enumerate() {
                let (path, Some(hit)) = (&mut paths[place as usize], &hits[k]) else { continue };
                let plain = self.plain(k as u32, path, hit, at);
                goes.push(plain.is_some() || self.met(path, hit, at));
                plains.extend(plain);
                if self.keeps_first {
                    let place = place as usize;
                    firsts[place] = self.first.take().or(firsts[place]);
                    directs[place] += core::mem::replace(&mut self.direct, Vector::ZERO);
                }
            }
            self.plains(Bounce { paths, going, hits, met }, plains, |k| goes[k as usize] = false);
            let mut goes_on = goes.iter();
            going.retain(|_| goes_on.next() == Some(&true));
            hits.clear();
            hits.extend(going.iter().map(|&place| self.intersect(&paths[place as usize])));
        }
        for (direct, path) in directs.iter_mut().zip(&*paths) {
            let share = self.scene.clamp.map_or(R::ONE, |most| clamping::<R>(path.radiance, most));
            *direct = *direct * share + self.scene.veil;
        }
        results.extend(paths.iter().map(|path| {
            let share = self.scene.clamp.map(|most| clamping::<R>(path.radiance, most));
            let radiance = share.map_or(path.radiance, |share| path.radiance * share) + self.scene.veil;
            PathResult { radiance, coverage: if path.hit { R::ONE } else { R::ZERO } }
        }));
    }

    /// Makes the numbers that the vertices of these paths ask for.
    fn draw(&self, paths: &mut [PathState<R>], going: &[u32], draws: &mut Vec<[f32; 4]>) {
        let purposes: &[Purpose] =
            if self.scene.lights.choice().is_empty() { &[Purpose::Scatter] } else { &[Purpose::Scatter, Purpose::Light] };
        draws.clear();
        let sequences = going.iter().flat_map(|&place| {
            let PathState { address, way, .. } = paths[place as usize];
            purposes.iter().map(move |&purpose| (Sequence::on(way, address, purpose), address.index))
        });
        fours(sequences, draws);
        for (&place, draws) in going.iter().zip(draws.chunks_exact(purposes.len())) {
            // Directions are what matters most: they have the first two dimensions of a point, which are the evenest together.
            let [u, v, luck, lobe] = draws[0];
            paths[place as usize].draws = Draws { scatter: [lobe, u, v, luck], light: draws.get(1).copied().unwrap_or_default() };
        }
    }

    /// Ends the paths that hit nothing.
    fn escape(
        &mut self,
        paths: &mut [PathState<R>],
        going: &mut Vec<u32>,
        hits: &mut Vec<Option<Hit<R>>>,
        (seen, directs): (&mut Vec<Seen<R>>, &mut [R::Vec3]),
    ) {
        let escaped = || going.iter().zip(&*hits).filter(|(_, hit)| hit.is_none()).map(|(&place, _)| place as usize);
        seen.clear();
        let legs = escaped().map(|place| &paths[place].leg);
        self.scene.lights.sky.look(legs.map(|leg| (leg.start(), leg.ray.direction)), seen);
        for (place, seen) in escaped().zip(&*seen) {
            let path = &mut paths[place];
            let brought = path.throughput * self.escaped(path, seen);
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
}

/// The share of a radiance whose brightest channel is not above a limit.
fn clamping<R: Real>(radiance: R::Vec3, most: R) -> R {
    let brightest = radiance.max_element();
    if brightest > most { most / brightest } else { R::ONE }
}

#[cfg(test)]
mod tests;
