//! Properties of a prepared scene: memory, tables, effects, and objects that the precision cannot
//! resolve.

use super::{PreparedInPrecision, ReadyScene};
use crate::effects::EffectReport;
use crate::film::Film;
use crate::memory::MemoryUse;
use crate::prepare::{LightLeak, TableCounts, UnreachedLight, UnresolvedGap};
use crate::settings::Settings;

impl ReadyScene {
    /// Returns the radiance of the studio's backdrop; `None` if camera rays do not see a backdrop.
    pub fn backdrop_radiance(&self) -> Option<f64> {
        each!(&self.prepared, prepared => prepared.studio_backdrop)
    }

    /// Whether the picture depends on the seed: by samples at random positions in their pixels, on
    /// a lens or on area lights, or by path tracing.
    pub fn is_random(&self) -> bool {
        let drawn =
            each!(&self.prepared, p => p.camera.has_lens() || !p.lights.emitters.is_empty());
        drawn || self.is_path_traced() || !self.settings.sampling.is_fixed()
    }

    /// Whether the integrator is the path tracer, so that noise is the picture's largest error.
    pub fn is_path_traced(&self) -> bool {
        self.is_path_traced
    }

    /// Returns the lights that contributed nothing to a film of this picture although many shadow
    /// rays were traced to them. Such a light is enclosed, or no random path has reached its few
    /// unoccluded positions. Empty for pictures that are not path traced. Samples that the film
    /// read from a file do not count.
    pub fn find_unreached_lights(&self, film: &Film) -> Vec<UnreachedLight> {
        each!(&self.prepared, p => p.find_unreached_lights(film.light_usage()))
    }

    /// Returns the pairs of objects between which this precision closes a gap. Only gaps crossed by
    /// straight rays through the picture's pixels are found.
    pub fn find_closed_gaps(&self) -> Vec<UnresolvedGap> {
        each!(&self.prepared, p => p.find_unresolved_gaps(self.settings.size))
    }

    /// Returns the lamps whose light passes through an opaque object because this precision cannot
    /// separate the lamp from the object. Only leaks onto points hit by rays through the picture's
    /// pixels are found.
    pub fn find_light_leaks(&self) -> Vec<LightLeak> {
        each!(&self.prepared, p => p.find_light_leaks(self.settings.size))
    }

    /// Returns the memory in use, by its purpose.
    pub fn memory(&self) -> MemoryUse {
        MemoryUse {
            film: self.film_plan().bytes(),
            ..each!(&self.prepared, p => p.memory_use())
        }
    }

    /// Returns the sizes of the tables that effects need; zero for the table of an absent effect.
    pub fn table_sizes(&self) -> TableCounts {
        each!(&self.prepared, p => p.table_counts())
    }

    /// Returns the objects that are invisible because all triangles of their mesh collapse when
    /// rounded far from the storage origin: ascending indices among the scene's objects, generated
    /// objects last.
    pub fn invisible_objects(&self) -> &[u32] {
        each!(&self.prepared, p => &p.collapsed_meshes)
    }

    /// Returns the first object so far from the storage origin that the precision cannot separate
    /// points a thousandth of the object's size apart: an index among the scene's objects,
    /// generated objects last.
    pub fn first_unresolved_object(&self) -> Option<u32> {
        each!(&self.prepared, p => p.origin.unresolved)
    }

    /// Returns the report of all effects: simulated, absent, or left out.
    pub fn effects(&self) -> &EffectReport {
        &self.effects
    }

    /// Returns the settings of the preparation.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }
}
