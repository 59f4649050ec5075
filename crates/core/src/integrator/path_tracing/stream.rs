//! Many paths at a time, each segment of all of them before the next one of any: what one asks of memory is on its way while others
//! compute, and rays, sky and surfaces each have the caches to themselves. No path's bits depend on which others it goes with.

use raywright_bvh::{Hit, Ray, Real, Vector};

use super::super::{Brought, FirstHit, FirstHits, Kernel, Tracer, clamping};
use super::plain::{Plain, Round};
use super::{Draws, Walk};
use crate::interaction::Interaction;
use crate::light::Seen;
use crate::sampler::{Address, Purpose, Sequence, fours};

/// Paths on their way together; kept by who has many, so that its lists are made once.
pub(crate) struct Stream<R: Real> {
    walks: Vec<Walk<R>>,
    /// What those that go on hit, in their order.
    hits: Vec<Option<Hit<R>>>,
    /// Those that have a ray to be traced, by their places.
    going: Vec<u32>,
    /// What their camera rays hit first, and saw without light from elsewhere, where that is kept.
    firsts: Vec<Option<FirstHit>>,
    directs: Vec<R::Vec3>,
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

impl<R: Real> Default for Stream<R> {
    fn default() -> Self {
        Self {
            walks: Vec::new(),
            hits: Vec::new(),
            going: Vec::new(),
            firsts: Vec::new(),
            directs: Vec::new(),
            seen: Vec::new(),
            met: Vec::new(),
            draws: Vec::new(),
            plains: Vec::new(),
            goes: Vec::new(),
            together: FirstHits::default(),
        }
    }
}

impl<R: Real> Stream<R> {
    /// What the path of a camera ray brought, by its place among those that were followed.
    #[inline(always)]
    pub fn brought(&self, place: usize) -> Brought<R> {
        let walk = &self.walks[place];
        Brought { radiance: walk.radiance, coverage: if walk.hit { R::ONE } else { R::ZERO } }
    }

    /// What it hit first, none for the sky, and what it saw without light from elsewhere; nothing where that is not kept.
    pub fn first(&self, place: usize) -> (Option<&FirstHit>, R::Vec3) {
        let direct = self.directs.get(place).copied().unwrap_or(Vector::ZERO);
        (self.firsts.get(place).and_then(Option::as_ref), direct)
    }
}

impl<R: Real, K: Kernel> Tracer<'_, R, K> {
    /// Follows the paths of camera rays to their ends. `together`: so many of them, one after the other, are asked at once what they hit
    /// first.
    pub fn follow_all(&mut self, (rays, addresses): (&[Ray<R>], &[Address]), together: usize, stream: &mut Stream<R>) {
        let Stream { walks, hits, going, firsts, directs, seen, met, draws, plains, goes, together: found } = stream;
        walks.clear();
        walks.extend(rays.iter().zip(addresses).map(|(&ray, &address)| self.walk(ray, address)));
        self.counters.camera += rays.len() as u64;
        going.clear();
        going.extend(0..rays.len() as u32);
        hits.clear();
        for (rays, walks) in rays.chunks(together).zip(walks.chunks(together)) {
            self.meet(rays, found);
            hits.extend(walks.iter().enumerate().map(|(i, walk)| found.get(i).copied().unwrap_or_else(|| self.ask(walk))));
        }
        firsts.clear();
        directs.clear();
        if self.keeps_first {
            firsts.resize(rays.len(), None);
            directs.resize(rays.len(), Vector::ZERO);
        }
        while !going.is_empty() {
            self.escape(walks, going, hits, (seen, directs));
            // What the surfaces read is asked for before any of it is waited for.
            met.clear();
            for (&place, hit) in going.iter().zip(&*hits) {
                let (leg, Some(hit)) = (&walks[place as usize].leg, hit) else { continue };
                met.push(Interaction::begun(self.scene, leg, hit));
                let Some(at) = met.last_mut() else { continue };
                at.finish::<K>(self.scene, leg, hit);
                self.scene.sources.prefetch(at);
            }
            self.draw(walks, going, draws);
            plains.clear();
            goes.clear();
            for (k, (&place, at)) in going.iter().zip(&mut *met).enumerate() {
                let (walk, Some(hit)) = (&mut walks[place as usize], &hits[k]) else { continue };
                let plain = self.plain(k as u32, walk, hit, at);
                goes.push(plain.is_some() || self.met(walk, hit, at));
                plains.extend(plain);
                if self.keeps_first {
                    let place = place as usize;
                    firsts[place] = self.first.take().or(firsts[place]);
                    directs[place] += core::mem::replace(&mut self.direct, Vector::ZERO);
                }
            }
            self.plains(Round { walks, going, hits, met }, plains, |k| goes[k as usize] = false);
            let mut goes_on = goes.iter();
            going.retain(|_| goes_on.next() == Some(&true));
            hits.clear();
            hits.extend(going.iter().map(|&place| self.ask(&walks[place as usize])));
        }
        for (direct, walk) in directs.iter_mut().zip(&*walks) {
            let share = self.scene.clamp.map_or(R::ONE, |most| clamping::<R>(walk.radiance, most));
            *direct = *direct * share + self.scene.veil;
        }
        for walk in walks {
            let share = self.scene.clamp.map(|most| clamping::<R>(walk.radiance, most));
            walk.radiance = share.map_or(walk.radiance, |share| walk.radiance * share) + self.scene.veil;
        }
    }

    /// Makes the numbers that the vertices of these paths ask for.
    fn draw(&self, walks: &mut [Walk<R>], going: &[u32], draws: &mut Vec<[f32; 4]>) {
        let purposes: &[Purpose] =
            if self.scene.lights.choice().is_empty() { &[Purpose::Scatter] } else { &[Purpose::Scatter, Purpose::Light] };
        draws.clear();
        let sequences = going.iter().flat_map(|&place| {
            let Walk { address, way, .. } = walks[place as usize];
            purposes.iter().map(move |&purpose| (Sequence::on(way, address, purpose), address.index))
        });
        fours(sequences, draws);
        for (&place, draws) in going.iter().zip(draws.chunks_exact(purposes.len())) {
            // Directions are what matters most: they have the first two dimensions of a point, which are the evenest together.
            let [u, v, luck, lobe] = draws[0];
            walks[place as usize].draws = Draws { scatter: [lobe, u, v, luck], light: draws.get(1).copied().unwrap_or_default() };
        }
    }

    /// Ends the paths that hit nothing.
    fn escape(
        &mut self,
        walks: &mut [Walk<R>],
        going: &mut Vec<u32>,
        hits: &mut Vec<Option<Hit<R>>>,
        (seen, directs): (&mut Vec<Seen<R>>, &mut [R::Vec3]),
    ) {
        let escaped = || going.iter().zip(&*hits).filter(|(_, hit)| hit.is_none()).map(|(&place, _)| place as usize);
        seen.clear();
        let legs = escaped().map(|place| &walks[place].leg);
        self.scene.lights.sky.look(legs.map(|leg| (leg.start(), leg.ray.direction)), seen);
        for (place, seen) in escaped().zip(&*seen) {
            let walk = &mut walks[place];
            let brought = walk.throughput * self.escaped(walk, seen);
            walk.radiance += brought;
            if walk.traced == 0
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

#[cfg(test)]
mod tests;
