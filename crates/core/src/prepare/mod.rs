//! Preparation: a validated scene and settings become what an integrator walks. It may fail, allocate, sort and decide;
//! rendering may do none of these.

mod collapse;
mod emitters;
mod estimate;
mod extent;
mod gap;
mod geometry;
mod input;
mod material;
mod pyramid;
mod shape;
mod shut;
mod studio;
mod tangents;
pub(crate) mod texture;
mod uses;

use std::sync::Arc;

use raywright_bvh::{Geometry, GeometryError, Occlusion, Real, Vector};

use crate::camera::{Camera, Cone};
use crate::effects::{Effect, EffectSet};
use crate::expr::ExprError;
use crate::framing::{FIELD_OF_VIEW, Silhouette};
use crate::light::{DeltaLight, EmitterList, Emitters, Irradiance, LightId, LightUsage, Lights, Strategy, prepare_sky};
use crate::lookup::Lookup;
use crate::memory::Memory;
use crate::motion::{simulated_camera, simulated_scene};
use crate::observer::Observer;
use crate::scene::{
    self, ClassicRules, DepthLimit, ImageData, Integrator, MeshData, OffsetDirection, Scene, ShadowRule, Sky, SpawnRule, Studio,
};
use crate::settings::{AreaShadows, Background, LightSampling, Microfacets, Roulette, Settings, SettingsError};
use crate::validate::Problem;

pub(crate) use collapse::collapsed;
pub(crate) use estimate::estimate;
pub use extent::Extent;
pub(crate) use extent::extent;
pub use gap::ClosedGap;
use geometry::Facet;
pub(crate) use geometry::{MeshUse, ObjectRecord, build as build_geometry};
pub(crate) use input::{Here, Input, Sources};
pub(crate) use material::{Alpha, Boundary, Bump, Classic, Index, Layered, Material, Mixture, Passage, Physical, Specular};
pub(crate) use shape::any_shape;
pub use shut::ShutAway;
use studio::{Backdrop, Ground};
pub(crate) use tangents::Corners;
pub(crate) use texture::Place;

/// Why a scene could not be prepared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PrepareError {
    /// No picture can be made with these settings.
    #[error(transparent)]
    Settings(SettingsError),
    /// A primitive was refused.
    #[error("objects[{object}]: {source}")]
    Geometry {
        /// Index of the object.
        object: usize,
        /// Why.
        source: GeometryError,
    },
    /// Nothing is left of shapes once their coordinates are stored in this precision's numbers.
    #[error("{}", problems.iter().map(|p| format!("{}: {}", p.path, p.message)).collect::<Vec<_>>().join("; "))]
    Collapsed {
        /// What [`collapsed`](crate::dispatch::collapsed) says of the scene: at least one.
        problems: Vec<Problem>,
    },
    /// A name that nothing has; validation reports it with its place.
    #[error("{path}: there is no {kind} named `{name}`")]
    Missing {
        /// Where it is used.
        path: String,
        /// What was looked for.
        kind: &'static str,
        /// The name.
        name: String,
    },
    /// An expression of the hit that does not compile.
    #[error("{path}: {source}")]
    Expression {
        /// Where it stands.
        path: String,
        /// Why.
        source: ExprError,
    },
    /// The observer stopped it.
    #[error("preparation was stopped")]
    Cancelled,
    /// The picture, geometry and textures would take more than the memory allowed; nothing was built.
    #[error("rendering needs about {} bytes, but at most {allowed} are allowed", needed.total())]
    Memory {
        /// Estimate.
        needed: Memory,
        /// Limit in bytes.
        allowed: u64,
    },
    /// The system does not give the memory that the picture, geometry and textures take; nothing was built.
    #[error("rendering needs about {} bytes, and the system does not give as much", needed.total())]
    OutOfMemory {
        /// Estimate.
        needed: Memory,
    },
}

/// Where spawned rays start, in the precision's scalar.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Spawn<R: Real> {
    ErrorBound,
    Constant { offset: R, along_ray: bool, camera_min: R, secondary_min: R, shadow_min: R },
}

/// The classic model's rules in the precision's scalar.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rules<R: Real> {
    pub spawn: Spawn<R>,
    pub first_occluder_decides: bool,
    /// Infinite where the scene sets none.
    pub shadow_max_distance: R,
    pub local_only_at_limit: bool,
}

impl<R: Real> Rules<R> {
    fn new(rules: &ClassicRules) -> Self {
        let spawn = match rules.spawn {
            SpawnRule::ErrorBound => Spawn::ErrorBound,
            SpawnRule::Constant(c) => Spawn::Constant {
                offset: R::from_f64(c.offset),
                along_ray: c.along == OffsetDirection::Ray,
                camera_min: R::from_f64(c.camera_min),
                secondary_min: R::from_f64(c.secondary_min),
                shadow_min: R::from_f64(c.shadow_min),
            },
        };
        Self {
            spawn,
            first_occluder_decides: rules.shadow == ShadowRule::FirstInOrder,
            shadow_max_distance: R::from_f64(rules.shadow_max_distance.unwrap_or(f64::INFINITY)),
            local_only_at_limit: rules.depth_limit == DepthLimit::LocalOnly,
        }
    }
}

/// A scene as an integrator walks it: flat arrays that refer to each other by index, with no pointer, closure or trait object for
/// each object, material or primitive. What it shares with the scene, meshes and images, lies in tables too, one pointer for
/// each buffer, so that nothing is copied and every array can be read as it is.
#[derive(Clone, Debug)]
pub struct Prepared<R: Real> {
    pub(crate) geometry: Geometry<R>,
    /// The meshes that objects show.
    pub(crate) meshes: Vec<Arc<MeshData>>,
    /// By index of the scene's objects, generated ones last.
    pub(crate) objects: Vec<ObjectRecord<R>>,
    /// Tangents made for meshes whose normals an image bends.
    pub(crate) tangents: Vec<Corners>,
    pub(crate) materials: Vec<Material<R>>,
    /// What the materials' inputs refer to.
    pub(crate) sources: Sources<R>,
    /// Lights, emissive surfaces and the sky; no table holds what no surface would answer to.
    pub lights: Lights<R>,
    /// What camera rays see that hit nothing; none: the sky.
    pub(crate) backdrop: Option<Backdrop<R>>,
    /// What the backdrop is dimmed by; none where no studio has one.
    pub(crate) ground: Option<Ground<R>>,
    /// Radiance of a studio's backdrop, once it is decided.
    studio_backdrop: Option<f64>,
    /// The sky's cosine-weighted average; none where no material asks for it.
    pub(crate) irradiance: Option<Irradiance<R>>,
    pub(crate) camera: Camera<R>,
    /// How wide its rays are, by which textures are filtered; none where no texture asks.
    pub(crate) cone: Option<Cone<R>>,
    pub(crate) rules: Rules<R>,
    /// Whether some material absorbs what passes through it.
    pub(crate) absorbs: bool,
    /// Which body light is in where several overlap, by material; empty where all bodies are alike.
    pub(crate) priorities: Vec<u32>,
    /// Whether paths keep track of the bodies that they are in.
    pub(crate) tracks_media: bool,
    /// Whether light asked for may arrive straight through surfaces, so that shadow rays meet them in order.
    pub(crate) lets_straight: bool,
    /// What lies over, under and in materials that have such.
    pub(crate) layers: Vec<Layered<R>>,
    /// How a path tracer finds light with a size.
    light_sampling: LightSampling,
    /// Whether it is the middle of a lamp that has to be seen.
    pub(crate) hard_shadows: bool,
    /// When chance may end a path.
    pub(crate) roulette: Roulette,
    /// What the brightest channel of a sample is brought down to; none: nothing is.
    pub(crate) clamp: Option<R>,
    /// Whether rough surfaces give back what their facets send to each other.
    pub(crate) compensates: bool,
    pub(crate) veil: R::Vec3,
    /// Objects of whose mesh storing leaves nothing, ascending.
    pub(crate) lost: Vec<u32>,
    /// Bytes of geometry and accelerators, shared geometry counted once.
    geometry_bytes: usize,
}

/// How much was built of what.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tables {
    /// Primitives of the scene's own set, an instance counting as one.
    pub primitives: usize,
    /// Those without bounds.
    pub unbounded: usize,
    /// Those that are instances.
    pub instances: usize,
    /// Light sources besides the sky and surfaces.
    pub lights: usize,
    /// Emissive shapes and triangles that light others.
    pub emitters: usize,
    /// Materials that something shows.
    pub materials: usize,
    /// Those of them that are layered.
    pub layered: usize,
    /// Whether the sky's cosine-weighted average was computed.
    pub irradiance: bool,
    /// Bytes of decoded images.
    pub texture_bytes: usize,
}

impl<R: Real> Prepared<R> {
    /// Prepares a scene for the effects that are simulated: the others' tables stay empty. Its materials are prepared when an
    /// object uses them, so an unused one costs nothing.
    ///
    /// # Errors
    /// What validation would have reported with a place, and what only the geometry can know.
    pub fn new(scene: &Scene, settings: &Settings, simulated: EffectSet, observer: &dyn Observer) -> Result<Self, PrepareError> {
        go_on(observer)?;
        let whole = scene;
        let scene = &*simulated_scene(whole, settings.camera.as_ref(), simulated);
        if let Some((i, model)) = scene.models.iter().enumerate().next() {
            // The loader takes models out of the list; whoever made the scene otherwise has to.
            return Err(PrepareError::Missing {
                path: format!("models[{i}].file"),
                kind: "loaded model",
                name: model.file.clone(),
            });
        }
        let names = names(scene);
        let lookup = Lookup::new(scene);
        let shown = geometry::materials(scene, &lookup)?;
        let mut used = vec![false; scene.materials.len()];
        shown.iter().for_each(|&material| used[material as usize] = true);
        let paths = settings.integrator == Integrator::Path;
        let mut context = material::Context { layers: Vec::new(), paths, without: settings.without, fresnel: settings.fresnel };
        let mut inputs = input::Compiler::new(&names, &lookup);
        let mut materials = Vec::with_capacity(scene.materials.len());
        for (index, material) in scene.materials.iter().enumerate() {
            go_on(observer)?;
            let first = inputs.sources.textures.len() as u32;
            materials.push(if used[index] {
                material::prepare(material, index, scene, &mut inputs, &mut context)?
            } else {
                Material::Unused
            });
            inputs.sources.of_materials.push(first..inputs.sources.textures.len() as u32);
        }
        material::tables(&context.layers).prepare();
        settings.filter.draws();
        let hard_shadows = settings.area_shadows == AreaShadows::Hard;
        let facets = facets(scene, (&materials, &context.layers), &inputs.sources, (paths, hard_shadows));
        let mut built = geometry::build_with::<R>(scene, &lookup, settings.accelerator, (&shown, &facets), observer)?;
        go_on(observer)?;
        let tangents = tangents::make(scene, &mut built, observer)?;
        let aspect = f64::from(settings.size[0]) / f64::from(settings.size[1]);
        // The view that shows everything shows it wherever it goes, also where it stands in the picture.
        let framed = || {
            let silhouette = Silhouette::of(whole);
            silhouette.frame(silhouette.front(), FIELD_OF_VIEW, aspect)
        };
        let view = simulated_camera(settings.camera.clone().unwrap_or_else(framed), simulated);
        let studio = studio_of(scene);
        let lit_by = studio.map(|studio| crate::studio::lights(&studio, &view));
        let sky = prepare_sky::<R>(lit_by.as_ref().or(scene.sky.as_ref()), &lookup, &names)?;
        let lit = simulated.has(Effect::DirectLight) || simulated.has(Effect::Highlights);
        let casters = simulated.has(Effect::Shadows);
        let irradiance = (simulated.has(Effect::SkyLight) && !paths && !sky.is_black()).then(|| Irradiance::new(&sky));
        let wanted = emitters::Wanted {
            even: simulated.has(Effect::SoftShadows),
            varied: paths && simulated.has(Effect::TexturedEmitters),
            read: paths,
        };
        let emitters = if wanted.even || wanted.varied {
            emitters::emitters::<R>(scene, &lookup, (&materials, &inputs.sources), wanted, observer)?
        } else {
            EmitterList::default()
        };
        // A light that shows on nothing is not built: no loop turns for it.
        let delta = if lit { scene.lights.iter().map(|l| DeltaLight::new(l, casters)).collect() } else { Vec::new() };
        let mut lights = Lights::new(delta, Emitters::new(emitters), sky, &built.geometry.bounded_part());
        if paths {
            lights.emitters.strategy = Strategy::SolidAngle;
            if simulated.has(Effect::SkyLight) {
                lights.prepare_sky();
                if settings.light_sampling == LightSampling::Both {
                    lights.draw_excess_of_sky();
                }
            }
            lights.prepare_choice();
        }
        let backdrop = match settings.background {
            Background::Environment => None,
            Background::Transparent => Some(Backdrop::Plain(Vector::ZERO)),
            Background::Colour(c) => Some(Backdrop::Plain(Vector::from_f64(c.into()))),
        };
        let camera = Camera::towards(&view, settings.size, &built.geometry.bounded_part());
        let absorbs = simulated.has(Effect::Absorption) && materials.iter().any(Material::absorbs);
        let priorities = if paths && simulated.has(Effect::NestedMedia) { priorities(scene) } else { Vec::new() };
        let mut prepared = Self {
            geometry_bytes: built.geometry.bytes(),
            geometry: built.geometry,
            meshes: built.meshes,
            objects: built.objects,
            lost: built.lost,
            absorbs,
            tracks_media: absorbs || !priorities.is_empty(),
            lets_straight: paths && (!priorities.is_empty() || materials.iter().any(Material::is_wall)),
            priorities,
            tangents,
            materials,
            cone: (!inputs.sources.pyramids.is_empty()).then(|| camera.cone()),
            sources: inputs.sources,
            lights,
            backdrop,
            ground: None,
            studio_backdrop: None,
            irradiance,
            camera,
            rules: Rules::new(&scene.classic),
            layers: context.layers,
            light_sampling: settings.light_sampling,
            hard_shadows,
            roulette: settings.roulette,
            clamp: settings.clamp.map(R::from_f64),
            compensates: settings.microfacets == Microfacets::Compensated,
            veil: Vector::from_f64(scene.render.veil.0.into()),
        };
        if let Some(studio) = &studio {
            prepared.furnish(studio, &view, settings, simulated);
        }
        Ok(prepared)
    }

    /// Takes another camera that calls for the same effects, as if the scene had been prepared for it: what goes with the camera is made
    /// anew, and nothing else. A camera whose shutter is open for a time is none of these.
    pub(crate) fn turn_to(&mut self, scene: &Scene, settings: &Settings, view: &scene::Camera, simulated: EffectSet) {
        let view = simulated_camera(view.clone(), simulated);
        self.camera = Camera::towards(&view, settings.size, &self.geometry.bounded_part());
        self.cone = self.cone.is_some().then(|| self.camera.cone());
        let Some(studio) = studio_of(scene) else { return };
        let lit_by = crate::studio::lights(&studio, &view);
        // A gradient with suns refers to nothing.
        let Ok(sky) = prepare_sky::<R>(Some(&lit_by), &Lookup::new(scene), &names(scene)) else { return };
        self.irradiance = self.irradiance.is_some().then(|| Irradiance::new(&sky));
        self.lights.sky = sky;
        if self.lights.sky_sampler().is_some() {
            self.lights.prepare_sky();
            if settings.light_sampling == LightSampling::Both {
                self.lights.draw_excess_of_sky();
            }
            self.lights.prepare_choice();
        }
        self.furnish(&studio, &view, settings, simulated);
    }

    /// How a path tracer finds a light with a size. Lamps of which the middle alone counts are asked, since a path that meets one by chance
    /// does not know what the middle sees.
    #[inline(always)]
    pub(crate) fn sampling_of(&self, light: LightId) -> LightSampling {
        match light {
            LightId::Emitter(i) if self.casts_hard(i) && self.light_sampling == LightSampling::Both => LightSampling::Lights,
            _ => self.light_sampling,
        }
    }

    /// Whether a lamp's shadows are hard. Where its light varies it is read where a shadow ray meets it, which has to be a point that was
    /// drawn.
    #[inline(always)]
    pub(crate) fn casts_hard(&self, emitter: u32) -> bool {
        self.hard_shadows && !self.lights.emitters.varies(emitter)
    }

    /// What it takes, without the film.
    pub(crate) fn memory(&self) -> Memory {
        let tables = size_of_val(self.objects.as_slice())
            + size_of_val(self.materials.as_slice())
            + size_of_val(self.layers.as_slice())
            + size_of_val(self.priorities.as_slice())
            + size_of_val(self.sources.textures.as_slice())
            + size_of_val(self.sources.of_materials.as_slice())
            + size_of_val(self.lights.delta.as_slice());
        let choice = self.lights.choice().bytes();
        // Only what chooses among lights counts what became of them.
        let counted = if self.lights.choice().is_empty() { 0 } else { self.lights.delta.len() + self.lights.emitters.len() };
        let tangents = self.tangents.iter().map(|corners| size_of_val(corners.as_slice()) as u64).sum::<u64>();
        Memory {
            geometry: self.geometry_bytes as u64,
            meshes: self.meshes.iter().map(|mesh| mesh.bytes() as u64).sum::<u64>() + tangents,
            tables: tables as u64 + choice + self.lights.emitters.bytes() + LightUsage::bytes_of(counted as u64),
            textures: self.texture_bytes() as u64 + self.lights.sky.bytes(),
            film: 0,
        }
    }

    /// Bytes of the images that materials and sky show, each counted once, with their mip maps.
    fn texture_bytes(&self) -> usize {
        let sky = self.lights.sky.image().filter(|&sky| !self.sources.images.iter().any(|image| Arc::ptr_eq(image, sky)));
        let pyramids = self.sources.pyramids.iter().flatten();
        self.sources.images.iter().chain(sky).map(|image| image.bytes()).sum::<usize>()
            + pyramids.map(ImageData::bytes).sum::<usize>()
    }

    /// Sizes of the tables that effects need; an absent effect's are empty.
    pub fn tables(&self) -> Tables {
        Tables {
            primitives: self.geometry.len(),
            unbounded: self.geometry.unbounded_count(),
            instances: self.geometry.instance_count(),
            lights: self.lights.delta.len(),
            emitters: self.lights.emitters.lit(),
            materials: self.materials.iter().filter(|m| !matches!(m, Material::Unused)).count(),
            layered: self.layers.len(),
            irradiance: self.irradiance.is_some(),
            texture_bytes: self.texture_bytes(),
        }
    }
}

/// The studio that a scene stands in.
fn studio_of(scene: &Scene) -> Option<Studio> {
    if let Some(Sky::Studio(studio)) = &scene.sky { Some(*studio) } else { None }
}

/// The priority of each material's body.
fn priorities(scene: &Scene) -> Vec<u32> {
    let of = |material: &scene::Material| if let scene::Model::Physical(m) = &material.model { m.priority } else { 0 };
    scene.materials.iter().map(of).collect()
}

/// What geometry asks of each material. An occluder that lets nothing through needs no question, unless somewhere more is
/// asked than whether light arrives: which occluder is the first, or how far away the nearest is.
fn facets<R: Real>(
    scene: &Scene,
    (materials, layers): (&[Material<R>], &[Layered<R>]),
    sources: &Sources<R>,
    (paths, hard): (bool, bool),
) -> Vec<Facet> {
    let asks = scene.classic.shadow == ShadowRule::FirstInOrder || materials.iter().any(Material::asks_how_far);
    let facet = |(material, data): (&Material<R>, &scene::Material)| {
        let coordinates = material.reads_coordinates(sources, layers);
        let sets = data.uv_sets().into_iter().filter(|&set| (set as usize) < scene::MOST_UV_SETS);
        let solid = if paths { material.covers() } else { material.is_opaque() && !asks };
        Facet {
            // A ray to a lamp's middle passes the lamp itself.
            occlusion: if solid && !(hard && material.glows()) { Occlusion::Opaque } else { Occlusion::Ask },
            // A path tracer asks whose light it is: that of surfaces and of the sky passes nothing that rays meet.
            without_shadow: if paths { Occlusion::Ask } else { Occlusion::None },
            coordinates,
            bumpy: material.is_bumpy(layers),
            sets: sets.fold(u8::from(coordinates), |bits, set| bits | 1 << set),
        }
    };
    materials.iter().zip(&scene.materials).map(facet).collect()
}

/// Asks the observer whether preparation should end here.
fn go_on(observer: &dyn Observer) -> Result<(), PrepareError> {
    if observer.cancelled() { Err(PrepareError::Cancelled) } else { Ok(()) }
}

/// Time and parameters, as expressions see them.
pub(crate) fn names(scene: &Scene) -> std::collections::BTreeMap<String, f64> {
    let mut names = scene.parameters.clone();
    names.insert("t".to_owned(), scene.t);
    names
}

#[cfg(test)]
mod tests;
