//! Properties of a prepared scene: memory, tables, effects, and objects that the precision cannot
//! resolve.

use super::{PreparedInPrecision, ReadyScene};
use crate::effects::{EffectReport, RenderSetup};
use crate::fault::{Fault, Subject};
use crate::film::Film;
use crate::memory::MemoryUse;
use crate::prepare::{
    self, LightLeak, LightRays, TableSizes, UnresolvedGap, lost_object, unresolved_object,
};
use crate::scene::{MeshSource, Scene};
use crate::settings::{PrecisionChoice, Settings};

impl ReadyScene {
    /// Returns the radiance of the studio's backdrop at an exposure of 0; `None` if camera rays do
    /// not see a backdrop.
    pub fn studio_backdrop_radiance(&self) -> Option<f64> {
        each!(&self.prepared, prepared => prepared.studio_backdrop)
    }

    /// Sets the exposure in stops at which the studio's backdrop has its radiance.
    pub fn set_backdrop_exposure(&mut self, stops: f64) {
        each!(&mut self.prepared, prepared => prepared.set_backdrop_exposure(stops));
    }

    /// Whether a lamp at the camera lights the scene, because surfaces around the camera keep the
    /// studio's light out.
    pub fn has_headlight(&self) -> bool {
        self.has_headlight
    }

    /// Whether the picture depends on the seed. It does with path tracing, and with samples at
    /// random positions in pixels, on a lens or on area lights.
    pub fn depends_on_seed(&self) -> bool {
        let drawn =
            each!(&self.prepared, p => p.camera.has_lens() || !p.lights.emitters.is_empty());
        drawn || self.is_path_traced() || !self.settings.sampling.is_fixed()
    }

    /// Whether the integrator is the path tracer. Noise is then the largest error of the picture.
    pub fn is_path_traced(&self) -> bool {
        self.is_path_traced
    }

    /// Returns the numbers of shadow rays to the lights in a film of this picture. A light without
    /// any arrival although many rays were traced to it is enclosed, or no random path has reached
    /// the few places that it lights. Zero for pictures that are not path traced. Samples that the
    /// film read from a file do not count.
    pub fn light_rays(&self, film: &Film) -> Vec<LightRays> {
        each!(&self.prepared, p => p.light_rays(film.light_usage()))
    }

    /// Returns the faults of the scene by rounding in the chosen precision: lost and unresolved
    /// objects, closed gaps beside glass, and lamps that shine through opaque objects.
    pub fn faults(&self, scene: &Scene) -> Vec<Fault> {
        let precision = self.settings.precision;
        let subject = |&object: &u32| Subject::from_object_index(scene, object as usize);
        let lost = self.invisible_objects();
        let unresolved = self.first_unresolved_object();
        let unresolved = unresolved.filter(|object| !lost.contains(object));
        let lost = lost.iter().map(subject);
        let lost = lost.map(|subject| lost_object(subject, precision));
        let unresolved = unresolved.iter().map(subject);
        let unresolved = unresolved.map(|subject| unresolved_object(subject, precision));
        let (gaps, leaks) = (self.find_unresolved_gaps(), self.find_light_leaks());
        let gaps = gaps.iter().map(|gap| gap.fault(scene, precision));
        let leaks = leaks.iter().map(|leak| leak.fault(scene, precision));
        lost.chain(unresolved).chain(gaps).chain(leaks).collect()
    }

    /// Returns the pairs of objects between which the chosen precision closes a gap. Only gaps are
    /// found that straight rays through the picture's pixels cross.
    pub(crate) fn find_unresolved_gaps(&self) -> Vec<UnresolvedGap> {
        each!(&self.prepared, p => p.find_unresolved_gaps(self.settings.size))
    }

    /// Returns the lamps whose light passes through an opaque object, because the chosen precision
    /// cannot separate lamp and object. Only leaks onto points that rays through the picture's
    /// pixels hit are found.
    pub(crate) fn find_light_leaks(&self) -> Vec<LightLeak> {
        each!(&self.prepared, p => p.find_light_leaks(self.settings.size))
    }

    /// Returns the memory in use, by its purpose.
    pub fn memory(&self) -> MemoryUse {
        MemoryUse {
            film: self.film_plan().bytes(),
            ..each!(&self.prepared, p => p.memory_use())
        }
    }

    /// Returns the sizes of the tables that effects need. The table of an absent effect has size
    /// zero.
    pub fn table_sizes(&self) -> TableSizes {
        each!(&self.prepared, p => p.table_counts())
    }

    /// Returns the objects that are invisible: all triangles of their mesh collapse when rounded
    /// far from the storage origin. The result lists ascending indices among the scene's objects,
    /// where generated objects come last.
    pub(crate) fn invisible_objects(&self) -> &[u32] {
        each!(&self.prepared, p => &p.collapsed_meshes)
    }

    /// Returns the first object that is too far from the storage origin: the precision cannot
    /// separate points that are a thousandth of the object's size apart. The result is an index
    /// among the scene's objects, where generated objects come last.
    pub(crate) fn first_unresolved_object(&self) -> Option<u32> {
        each!(&self.prepared, p => p.origin.unresolved)
    }

    /// Returns the status of all effects: simulated, absent or left out.
    pub fn effects(&self) -> &EffectReport {
        &self.effects
    }

    /// Returns the settings with which the scene was prepared.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }
}

// Estimate of a render's memory, before preparation.

/// Returns the bytes that preparation and rendering still have to allocate. `needed` is the
/// estimate of the total, of which meshes and images are already in memory. Added are temporary
/// lists for building a tree, about as large as the tree, and a reordered copy of the picture for
/// writing a file.
pub(super) fn bytes_still_to_allocate(needed: &MemoryUse, scene: &Scene) -> u64 {
    let images = scene
        .images
        .iter()
        .filter_map(|image| image.data.as_ref())
        .map(|data| data.byte_size() as u64);
    let meshes = scene.meshes.iter().map(|mesh| match &mesh.source {
        MeshSource::Inline(data) => data.byte_size() as u64,
        MeshSource::File(_) => 0,
    });
    let in_memory = images.sum::<u64>() + meshes.sum::<u64>();
    needed
        .total()
        .saturating_sub(in_memory)
        .saturating_add(needed.geometry)
        .saturating_add(needed.film / 2)
}

/// Estimates the memory that a scene takes, before preparation. The estimate is never below the
/// memory in use after preparation (`ReadyScene::memory`). It is at most twice as large, with
/// three exceptions:
///
/// - three times with the tree of the precision `robust`;
/// - four times where triangles may be split (`build=high`);
/// - five times where triangles and shapes mix.
pub fn estimate_scene_memory(scene: &Scene, settings: &Settings) -> MemoryUse {
    estimate_memory(&RenderSetup::new(scene, settings))
}

/// Estimates the memory of a render in its precision.
pub(super) fn estimate_memory(render_setup: &RenderSetup<'_>) -> MemoryUse {
    match render_setup.settings.precision {
        PrecisionChoice::Robust => prepare::estimate_memory::<f32>(render_setup),
        PrecisionChoice::Reference => prepare::estimate_memory::<f64>(render_setup),
    }
}
