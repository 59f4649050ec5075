//! The one place where run-time choices become types: precision and integrator.

use core::sync::atomic::{AtomicBool, Ordering};

use raywright_bvh::Real;

use crate::effects::{EffectReport, EffectSet, RenderSetup};
use crate::extent::{self, Extent};
use crate::film::{Aim, Film, Part, PartError, Plan};
use crate::integrator::{PathTracer, WhittedTracer};
use crate::lookup::Lookup;
use crate::memory::{Memory, is_available};
use crate::observer::Observer;
use crate::prepare::{self, ClosedGap, LightLeak, PrepareError, Prepared, ShutAway, Tables};
use crate::render::{RenderStage, Rendered, render};
use crate::scene::{Camera, Integrator, MeshSource, Pattern, Scene};
use crate::settings::{Aov, Crop, PrecisionChoice, Sampling, Settings};
use crate::validate::Problem;

/// Edge of a sketch's tiles: it has few pixels, and each thread is to have some of them.
const SKETCH_TILE: u32 = 16;

/// A scene prepared for one set of settings, ready to render.
pub struct Ready {
    inner: AnyPrepared,
    follows_paths: bool,
    settings: Settings,
    effects: EffectReport,
}

enum AnyPrepared {
    Robust(Box<Prepared<f32>>),
    Reference(Box<Prepared<f64>>),
}

/// Evaluates an expression for whichever precision was prepared.
macro_rules! each {
    ($ready:expr, $prepared:ident => $value:expr) => {
        match $ready {
            AnyPrepared::Robust($prepared) => $value,
            AnyPrepared::Reference($prepared) => $value,
        }
    };
}

/// Work with a prepared scene of whichever precision.
pub(crate) trait PreparedWork {
    /// What comes of it.
    type Output;

    /// Does it.
    fn run<R: Real>(&self, prepared: &Prepared<R>) -> Self::Output;
}

/// Prepares a validated scene on the current thread pool: what it calls for is found first, and
/// then built.
///
/// # Errors
/// See [`PrepareError`].
pub fn prepare(
    scene: &Scene,
    settings: &Settings,
    observer: &dyn Observer,
) -> Result<Ready, PrepareError> {
    settings.check().map_err(PrepareError::Settings)?;
    let setup = RenderSetup::new(scene, settings);
    let simulated = setup.effects.simulated();
    let needed = reckon(&setup);
    if let Some(allowed) = settings
        .max_memory
        .filter(|&allowed| needed.total() > allowed)
    {
        return Err(PrepareError::Memory { needed, allowed });
    }
    if !is_available(yet_to_take(&needed, scene)) {
        return Err(PrepareError::OutOfMemory { needed });
    }
    let inner = AnyPrepared::new(&setup.scene, &setup.settings, simulated, observer)?;
    let follows_paths = setup.integrator() == Integrator::Path;
    Ok(Ready {
        inner,
        follows_paths,
        settings: settings.clone(),
        effects: setup.effects,
    })
}

/// What of it is not taken yet: meshes and images are there with the scene. A tree is built beside
/// lists of about its size, and a picture is brought into its file's order beside the film.
fn yet_to_take(needed: &Memory, scene: &Scene) -> u64 {
    let images = scene
        .images
        .iter()
        .filter_map(|image| image.data.as_ref())
        .map(|data| data.bytes() as u64);
    let meshes = scene.meshes.iter().map(|mesh| match &mesh.source {
        MeshSource::Inline(data) => data.bytes() as u64,
        MeshSource::File(_) => 0,
    });
    let there = images.sum::<u64>() + meshes.sum::<u64>();
    needed
        .total()
        .saturating_sub(there)
        .saturating_add(needed.geometry)
        .saturating_add(needed.film / 2)
}

/// What memory a scene will take: at least what [`Ready::memory`] says once it is prepared, and at
/// most twice of it, three times with the tree of `robust`, five where triangles and shapes mix,
/// four times as much where triangles may be split (`build=high`).
pub fn estimate(scene: &Scene, settings: &Settings) -> Memory {
    reckon(&RenderSetup::new(scene, settings))
}

fn reckon(setup: &RenderSetup<'_>) -> Memory {
    match setup.settings.precision {
        PrecisionChoice::Robust => prepare::estimate::<f32>(setup),
        PrecisionChoice::Reference => prepare::estimate::<f64>(setup),
    }
}

/// Where a scene is, as a precision stores it, from its data alone: nothing is built.
pub fn extent(scene: &Scene, precision: PrecisionChoice) -> Extent {
    let lookup = Lookup::new(scene);
    match precision {
        PrecisionChoice::Robust => extent::extent::<f32>(scene, &lookup),
        PrecisionChoice::Reference => extent::extent::<f64>(scene, &lookup),
    }
}

/// What of a scene a precision can't show, because nothing is left of it once its coordinates are
/// stored: preparing would be refused with the same problems. Every listed object and the first one
/// of every generator, at most a hundred.
pub fn collapsed(scene: &Scene, precision: PrecisionChoice) -> Vec<Problem> {
    match precision {
        PrecisionChoice::Robust => prepare::collapsed::<f32>(scene),
        PrecisionChoice::Reference => prepare::collapsed::<f64>(scene),
    }
}

impl AnyPrepared {
    fn new(
        scene: &Scene,
        settings: &Settings,
        simulated: EffectSet,
        observer: &dyn Observer,
    ) -> Result<Self, PrepareError> {
        Ok(match settings.precision {
            PrecisionChoice::Robust => Self::Robust(Box::new(Prepared::new(
                scene, settings, simulated, observer,
            )?)),
            PrecisionChoice::Reference => Self::Reference(Box::new(Prepared::new(
                scene, settings, simulated, observer,
            )?)),
        })
    }
}

/// Ends a render once a 2ᵏ-th of its samples are there, and some of each pixel.
struct Stage<'a> {
    observer: &'a dyn Observer,
    halving: u32,
    is_over: AtomicBool,
}

impl Observer for Stage<'_> {
    fn progress(&self, done: u64, total: u64) {
        self.observer.progress(done, total);
        self.is_over
            .store(done >= total >> self.halving, Ordering::Relaxed);
    }

    fn cancelled(&self) -> bool {
        self.observer.cancelled()
    }

    fn has_enough(&self, everywhere: bool) -> bool {
        self.observer.has_enough(everywhere) || everywhere && self.is_over.load(Ordering::Relaxed)
    }
}

impl Ready {
    /// Takes another camera: as if the scene, which has to be the one it was made from, had been
    /// prepared for it, to the bit, without building again what no camera changes. False, and
    /// nothing changed, where that would be another picture altogether: with a shutter, other
    /// effects, or effects switched off.
    pub fn turn_to(&mut self, scene: &Scene, camera: &Camera) -> bool {
        let settings = Settings {
            camera: Some(camera.clone()),
            ..self.settings.clone()
        };
        let RenderSetup {
            settings: prepared,
            effects,
            ..
        } = RenderSetup::new(scene, &settings);
        let has_shutter = |settings: &Settings| {
            settings
                .camera
                .as_ref()
                .is_some_and(|camera| camera.shutter.is_some())
        };
        let simulated = effects.simulated();
        let differs = simulated != self.effects.simulated() || !settings.without.is_empty();
        if differs || has_shutter(&settings) || has_shutter(&self.settings) {
            return false;
        }
        let is_turned = each!(&mut self.inner, p => p.turn_to(scene, &prepared, camera, simulated));
        if is_turned {
            (self.settings, self.effects) = (settings, effects);
        }
        is_turned
    }

    /// Renders the picture on the current thread pool.
    pub fn render(&self, observer: &dyn Observer) -> Rendered {
        let mut film = self.film("");
        let whole = film.whole();
        self.render_rounds(&mut film, &whole, observer);
        Rendered::of(&film, observer)
    }

    /// As [`Self::render`]; `look` sees pixels, samples and error each time that there are about
    /// twice as many samples as before, the last time excepted: a first look at a 128th of them.
    /// The bits of the result are those of [`Self::render`].
    pub fn render_showing(
        &self,
        observer: &dyn Observer,
        mut look: impl FnMut(&RenderStage<'_>),
    ) -> Rendered {
        let mut film = self.film("");
        let whole = film.whole();
        for halving in (1..=7).rev() {
            let stage = Stage {
                observer,
                halving,
                is_over: AtomicBool::new(false),
            };
            self.render_units(&mut film, &whole, &stage);
            if !stage.is_over.into_inner() || observer.cancelled() || film.lacking(&whole) == 0 {
                break;
            }
            look(&RenderStage::of(&film));
        }
        self.render_rounds(&mut film, &whole, observer);
        Rendered::of(&film, observer)
    }

    /// A film as by other settings, and what of it is rendered into it; they may differ from its
    /// own in crop, seed, samples, sampler, replicates, tiles and denoising, for which nothing of
    /// the scene is prepared.
    pub(crate) fn expose_as(&self, settings: &Settings, observer: &dyn Observer) -> Film {
        debug_assert_eq!(
            self.settings.sampling.is_fixed(),
            settings.sampling.is_fixed(),
            "patterns call for other effects"
        );
        let mut film = Film::new(
            "",
            settings,
            Plan::new(settings, self.is_by_chance(), self.has_ground()),
        );
        let whole = film.whole();
        each!(&self.inner, prepared => self.with_integrator((prepared, &prepared.camera), settings, (&mut film, &whole), observer));
        film
    }

    /// A quick look at the picture in pixels of its own, `edge` times as wide and as high as the
    /// picture's and counted from the same corner, so that the last ones may reach beyond it; with
    /// so many samples each, a pattern's middle one alone, and such layers. It takes a share of the
    /// picture's time, whatever that is to be, and nothing is prepared for it.
    pub fn sketch(
        &self,
        edge: u32,
        samples: u32,
        layers: &[Aov],
        observer: &dyn Observer,
    ) -> Rendered {
        let edge = edge.max(1);
        let of = |pixels: u32| pixels.div_ceil(edge);
        let settings = Settings {
            size: self.settings.size.map(of),
            crop: self.settings.crop.map(|crop| {
                let [x, y] = [crop.x, crop.y].map(|start| start / edge);
                Crop {
                    x,
                    y,
                    width: of(crop.x + crop.width) - x,
                    height: of(crop.y + crop.height) - y,
                }
            }),
            sampling: match self.settings.sampling {
                Sampling::Pattern(_) => Sampling::Pattern(Pattern::Centre),
                Sampling::General(most) => Sampling::General(samples.clamp(1, most)),
            },
            aovs: layers.to_vec(),
            max_error: None,
            denoise: false,
            replicates: None,
            tile_size: SKETCH_TILE,
            ..self.settings.clone()
        };
        let mut film = Film::new(
            "",
            &settings,
            Plan::new(&settings, self.is_by_chance(), self.has_ground()),
        );
        let whole = film.whole();
        each!(&self.inner, prepared => {
            let camera = prepared.camera.with_larger_pixels(edge);
            self.with_integrator((prepared, &camera), &settings, (&mut film, &whole), observer);
        });
        Rendered::noisy(&film)
    }

    /// A film with nothing on it yet, to be rendered part by part. `scene` is whatever tells scenes
    /// apart, such as a hash of their files: parts of different scenes do not merge.
    pub fn film(&self, scene: &str) -> Film {
        Film::new(scene, &self.settings, self.plan())
    }

    /// Renders what `part` names and the film lacks on the current thread pool, in passes over it;
    /// what the picture does not have is left out. Where the observer stops it, the film keeps what
    /// is finished, and a further call goes on from there.
    ///
    /// # Errors
    /// [`PartError::Foreign`] for the film of another picture.
    pub fn render_part(
        &self,
        film: &mut Film,
        part: &Part,
        observer: &dyn Observer,
    ) -> Result<(), PartError> {
        if let Some(what) = self.film(film.scene()).difference(film) {
            return Err(PartError::Foreign { part: 0, what });
        }
        self.render_rounds(film, part, observer);
        Ok(())
    }

    /// Until nothing lacks: where samples go where the error is, each round decides how many there
    /// are to be in the next one. That takes all tiles, so a part of them ends with the round.
    fn render_rounds(&self, film: &mut Film, part: &Part, observer: &dyn Observer) {
        loop {
            self.render_units(film, part, observer);
            let aimed = self
                .settings
                .max_error
                .filter(|_| film.lacking(&film.whole()) == 0);
            if aimed.is_none_or(|error| film.aim(error, observer) != Aim::Further) {
                return;
            }
        }
    }

    fn render_units(&self, film: &mut Film, part: &Part, observer: &dyn Observer) {
        each!(&self.inner, prepared => self.with_integrator((prepared, &prepared.camera), &self.settings, (film, part), observer));
    }

    fn with_integrator<R: Real>(
        &self,
        prepared: (&Prepared<R>, &crate::camera::Camera<R>),
        settings: &Settings,
        (film, part): (&mut Film, &Part),
        observer: &dyn Observer,
    ) {
        if self.follows_paths {
            render::<R, PathTracer<'_, R>>(prepared, settings, film, part, observer);
        } else {
            render::<R, WhittedTracer<'_, R>>(prepared, settings, film, part, observer);
        }
    }

    /// Radiance of the studio's backdrop that camera rays see; none where they see none.
    pub fn backdrop(&self) -> Option<f64> {
        each!(&self.inner, prepared => prepared.studio_backdrop)
    }

    /// How the picture is divided.
    fn plan(&self) -> Plan {
        Plan::new(&self.settings, self.is_by_chance(), self.has_ground())
    }

    fn has_ground(&self) -> bool {
        each!(&self.inner, prepared => prepared.ground.is_some())
    }

    /// Whether another seed would give another picture: where samples lie anywhere in their pixel
    /// or draw points of a lens or of lights, or follow paths.
    pub fn is_by_chance(&self) -> bool {
        let drawn = each!(&self.inner, p => p.camera.has_lens() || !p.lights.emitters.is_empty());
        drawn || self.follows_paths() || !self.settings.sampling.is_fixed()
    }

    /// Whether light is followed by chance over all surfaces, so that its error is what a picture
    /// has most of.
    pub fn follows_paths(&self) -> bool {
        self.follows_paths
    }

    /// Lights of which nothing has been seen in what was rendered into a film of this picture,
    /// though many rays were sent to them: they are shut away, or so placed that chance has not
    /// found the way. Of pictures whose light is followed by chance over all surfaces; else none.
    /// What a film has from a file does not count.
    pub fn shut_away(&self, film: &Film) -> Vec<ShutAway> {
        each!(&self.inner, p => p.shut_away(film.usage()))
    }

    /// Pairs of objects with a gap between them that this precision closes, as far as straight rays
    /// through the picture find them.
    pub fn closed_gaps(&self) -> Vec<ClosedGap> {
        each!(&self.inner, p => p.closed_gaps(self.settings.size))
    }

    /// Lamps that shine through an opaque object which this precision does not tell apart from
    /// them, as far as rays through the picture find what they light.
    pub fn light_leaks(&self) -> Vec<LightLeak> {
        each!(&self.inner, p => p.light_leaks(self.settings.size))
    }

    /// Does some work with what was prepared, in its precision.
    pub(crate) fn work<W: PreparedWork>(&self, work: &W) -> W::Output {
        each!(&self.inner, p => work.run(p))
    }

    /// What is held in memory.
    pub fn memory(&self) -> Memory {
        Memory {
            film: self.plan().bytes(),
            ..each!(&self.inner, p => p.memory())
        }
    }

    /// Sizes of the tables that effects need; an absent effect's are empty.
    pub fn tables(&self) -> Tables {
        each!(&self.inner, p => p.tables())
    }

    /// Objects that nothing can be seen of, ascending: so far from the origin that all triangles of
    /// their mesh collapse where coordinates are stored. By index of the scene's objects, generated
    /// ones last.
    pub fn lost(&self) -> &[u32] {
        each!(&self.inner, p => &p.lost)
    }

    /// The first object of which the precision can't tell points a thousandth of its size apart, so
    /// far away is it from what coordinates are counted from. By index of the scene's objects,
    /// generated ones last.
    pub fn unresolved(&self) -> Option<u32> {
        each!(&self.inner, p => p.origin.unresolved)
    }

    /// What is simulated, absent and left out.
    pub fn effects(&self) -> &EffectReport {
        &self.effects
    }

    /// The settings it was prepared for.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }
}
