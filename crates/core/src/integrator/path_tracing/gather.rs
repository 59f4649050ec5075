//! What surfaces are made of where paths met them: those vertices are put into queues by kind, done
//! with what only needs the point itself. Common surfaces, rough and opaque without layers, are by
//! far the most of real models.

use core::f64::consts::PI;

use raywright_bvh::{Hit, Real};

use super::classic::matte;
use super::general::GeneralSurfaces;
use super::respond::perturbed_normals;
use super::vertices::{LitSides, VertexList};
use super::{PathState, PathTracer};
use crate::interaction::Interaction;
use crate::light::{LANES, put};
use crate::material::{MetallicRoughness, NormalMap};
use crate::prepare::Material;
use crate::sampler::{Purpose, pair};
use crate::scene::AlphaMode;
use crate::texture::Bump;

/// Vertices by what answers at them: common surfaces that reflect nothing, other common ones, and
/// all others. Kept, so that its lists are made once.
#[derive(Default)]
pub(super) struct VertexQueues<R: Real> {
    pub matte: VertexList<R>,
    pub glossy: VertexList<R>,
    pub general: VertexList<R>,
    pub surfaces: GeneralSurfaces<R>,
    /// Normals that images bend, with the places of their vertices among the glossy ones.
    bent: Vec<(usize, NormalMap<R>)>,
}

impl<R: Real> VertexQueues<R> {
    pub fn clear(&mut self) {
        self.matte.clear();
        self.glossy.clear();
        self.general.clear();
        self.surfaces.clear();
        self.bent.clear();
    }

    /// Bends the normals of those common surfaces on which images do.
    pub fn bend_normals(&mut self, met: &mut [Interaction<R>]) {
        let vertices = self.glossy.lanes();
        for these in self.bent.chunks(LANES) {
            let normals = perturbed_normals(|lane| &these[lane.min(these.len() - 1)].1);
            for (&(vertex, _), normal) in these.iter().zip(normals) {
                let (vertices, lane) = (&mut vertices[vertex / LANES], vertex % LANES);
                put::<R>(&mut vertices.normal, lane, normal);
                met[vertices.place[lane] as usize].normal = normal;
            }
        }
    }
}

/// A common surface where a path met it: what it is made of, its factor on lights without size, and
/// what bends its normal.
type CommonSurface<'a, R> = (MetallicRoughness<R>, R, Option<&'a Bump<R>>);

impl<R: Real> PathTracer<'_, R> {
    /// Puts what a path met among the vertices. Whether the path has another ray, now or from
    /// there.
    #[inline(always)]
    pub(super) fn gather(
        &mut self,
        place: u32,
        (path, hit, at): (&mut PathState<R>, &Hit<R>, &mut Interaction<R>),
        vertices: &mut VertexQueues<R>,
    ) -> bool {
        let scene = self.scene;
        let material = &scene.materials[at.material as usize];
        let common = if path.traced - path.matched + 1 < self.max_depth {
            self.common(material, at)
        } else {
            None
        };
        if common.is_none() {
            at.perturb_where_bumpy(scene, &path.leg, hit);
        }
        self.pass_media(path, at);
        self.keep_first(path, hit);
        if common.is_none()
            && let Some(goes_on) = self.pass_by(path, at)
        {
            return goes_on;
        }
        path.hit = true;
        path.traced += 1;
        if path.traced == 1
            && let Some(edge) = scene.edge_at(&path.leg, hit, at)
        {
            self.draw_edge(path, edge);
            return false;
        }
        if material.glows() {
            self.emits(path, hit, at, material.emission_at(&scene.sources.at(at)));
        }
        let Some((mut model, gain, bump)) = common else {
            return self.gather_other(place, (path, hit, at), vertices);
        };
        // What a matte surface diffuses knows no index.
        if self.nests() && matches!(material, Material::Physical(_)) {
            self.immersed(path, at, &scene.sources.at(at), &mut model);
        }
        // Normals are bent among the glossy ones.
        let list = if model.is_matte() && bump.is_none() {
            &mut vertices.matte
        } else {
            &mut vertices.glossy
        };
        if let Some(bump) = bump {
            vertices
                .bent
                .push((list.len(), at.normal_map(bump, scene, &path.leg, hit)));
        }
        let lanes = list.open();
        let lane = lanes.push(
            place,
            (path, at),
            (at.normal, LitSides::One, gain),
            scene.roulette,
        );
        lanes.put_model(lane, &model);
        true
    }

    /// The common surface of a material; none where it is another.
    #[inline(always)]
    fn common<'a>(
        &self,
        material: &'a Material<R>,
        at: &Interaction<R>,
    ) -> Option<CommonSurface<'a, R>> {
        let here = self.scene.sources.at(at);
        let surface = match material {
            Material::Physical(m) if m.plain => (m.model_at(&here), R::ONE, m.bump.as_ref()),
            // A light without size says how bright it makes a white classic surface that faces it,
            // not what falls on it.
            Material::Classic(m) if m.matte => (matte(m, &here), R::from_f64(PI), None),
            _ => return None,
        };
        surface.0.is_rough().then_some(surface)
    }

    /// Takes a path on through a surface that is none where it met it, or that it passes unchanged.
    /// Whether it goes on; none where it met a surface.
    #[inline]
    fn pass_by(&mut self, path: &mut PathState<R>, at: &Interaction<R>) -> Option<bool> {
        if let Material::Physical(m) = &self.scene.materials[at.material as usize]
            && m.alpha != AlphaMode::Opaque
        {
            let alpha = m.alpha_at(&self.scene.sources.at(at));
            // A surface that covers a share of what is behind it is there as often.
            let absent = alpha < R::ONE
                && (alpha <= R::ZERO
                    || R::from_f32(pair(path.address, Purpose::Coverage)[0]) >= alpha);
            if absent {
                return Some(self.pass(path, at));
            }
        }
        if self.nests()
            && let Some(beyond) = self.hidden(&path.media, at)
        {
            path.media = beyond;
            return Some(self.pass(path, at));
        }
        let tint = self.matched(path, at)?;
        Some(self.pass_matched(path, at, tint))
    }

    /// Puts a vertex on a surface that is not common among the others, unless it ends its path.
    fn gather_other(
        &mut self,
        place: u32,
        (path, hit, at): (&mut PathState<R>, &Hit<R>, &Interaction<R>),
        vertices: &mut VertexQueues<R>,
    ) -> bool {
        if let Material::Physical(m) = &self.scene.materials[at.material as usize]
            && m.unlit
        {
            let shown = path.throughput * m.base_at(&self.scene.sources.at(at));
            path.radiance += shown;
            self.see(path.traced == 1, shown);
            return false;
        }
        !self.is_at_limit(path)
            && self.gather_general(
                place,
                (path, hit, at),
                (&mut vertices.general, &mut vertices.surfaces),
            )
    }
}
