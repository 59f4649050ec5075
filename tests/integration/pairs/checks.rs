//! The table of checks: what must be equal for every scene of the net.

use std::sync::atomic::{AtomicU32, Ordering};

use rayon::ThreadPool;
use raywright::bvh::{AcceleratorKind, BuildQuality};
use raywright::core::display::Display;
use raywright::core::effects::{Effect, EffectSet};
use raywright::core::film::Film;
use raywright::core::generate::expand_generators;
use raywright::core::picture::Picture;
use raywright::core::scene::{Integrator, Mesh, MeshSource, Shape, TransformStep};
use raywright::core::settings::{Aov, Background, Crop, PrecisionChoice, Sampling};
use raywright::core::{
    Observer, ReadyScene, RenderOutput, Scene, Settings, affine_from_steps, prepare,
};
use raywright::io::Limits;
use raywright::io::output::{
    PictureMetadata, StoredFilm, read_film, read_picture, write_film, write_picture,
};
use serde_json::Value;

use super::axes::{AXES, even_colour};
use super::cover::{Choice, axis_index, value_index};
use super::sketch::{COLOUR, Colouring, Sketch};
use crate::bits::{difference, part};
use crate::support::Sandbox;

/// What a check finds: nothing, or a difference.
pub type Finding = Option<String>;

/// A check: its name and its test of a case.
pub type Check = (&'static str, fn(&Case<'_>) -> Finding);

/// The checks. Each compares with the picture of one thread.
pub const CHECKS: &[Check] = &[
    ("the scan", |case| {
        case.differs(|s| s.accelerator = AcceleratorKind::Linear)
    }),
    ("a build quality", |case| {
        let quality = BuildQuality::ALL[case.turn(BuildQuality::ALL.len())];
        case.differs(|s| s.accelerator = AcceleratorKind::Tree(quality))
    }),
    ("two renders at once by seven threads", |case| {
        let tile_size = if case.is_adaptive() {
            case.settings.tile_size
        } else {
            2
        };
        let settings = Settings {
            tile_size,
            ..case.settings.clone()
        };
        let (a, b) = case.seven.install(|| {
            let ready = case.ready_for(&settings);
            rayon::join(|| ready.render(&()), || ready.render(&()))
        });
        case.differs_from(&a).or_else(|| case.differs_from(&b))
    }),
    ("a crop", |case| {
        if case.is_adaptive() || case.settings.crop.is_some() {
            return None;
        }
        let crop = Crop {
            x: 3,
            y: 2,
            width: 7,
            height: 5,
        };
        let cropped = case.picture(|s| s.crop = Some(crop));
        let mut inside = part(&case.whole, crop);
        inside.window = cropped.window;
        difference(&without_errors(inside), &without_errors(cropped))
    }),
    // Parts of an adaptive render end with their round, and are continued together.
    ("merged parts", |case| {
        let ready = case.ready(|_| ());
        // Thirds of the tiles, each in two ranges of replicates.
        let share = |index: u32| {
            let mut film = ready.new_film("pairs");
            let whole = film.full_part();
            let (middle, end) = (whole.replicates.end.div_ceil(2), whole.replicates.end);
            let mut part = whole.split_into_nth_subset(index / 2, 3);
            part.replicates = [0..middle, middle..end][index as usize % 2].clone();
            ready
                .render_part(&mut film, &part, &())
                .map_err(|e| e.to_string())?;
            Ok(case.stored(film))
        };
        let parts: Result<Vec<Film>, String> = [5, 0, 4, 3, 1, 2].into_iter().map(share).collect();
        let merged = parts.and_then(|parts| {
            let mut film = Film::merge(&parts).map_err(|e| e.to_string())?;
            let whole = film.full_part();
            if case.is_adaptive() {
                let continued = ready.render_part(&mut film, &whole, &());
                continued.map_err(|e| e.to_string())?;
            }
            Ok(film)
        });
        merged.map_or_else(Some, |film| case.differs_from_film(&film))
    }),
    ("a stopped render", |case| {
        let ready = case.ready(|_| ());
        let mut film = ready.new_film("pairs");
        let whole = film.full_part();
        // An adaptive render is stopped in its first round and in its second, of eight units each.
        for units in [3, 9, u32::MAX] {
            let earlier = case.stored(film);
            let header = earlier.header();
            film = ready.new_film("pairs");
            if let Err(error) = film.continue_from(earlier) {
                return Some(error.to_string());
            }
            // The samples drawn, and those that the present round lacks.
            if film.header() != header {
                return Some("another header".to_owned());
            }
            let stop = StopAfter(AtomicU32::new(units));
            if let Err(error) = case
                .one
                .install(|| ready.render_part(&mut film, &whole, &stop))
            {
                return Some(error.to_string());
            }
        }
        case.differs_from_film(&film)
    }),
    ("more samples", |case| {
        let Sampling::General(all @ 9..) = case.settings.sampling else {
            return None;
        };
        if case.is_adaptive() {
            return None;
        }
        let fewer = case.ready(|s| (s.sampling, s.replicates) = (Sampling::General(8), Some(2)));
        let ready = case.ready(|s| (s.sampling, s.replicates) = (Sampling::General(all), Some(2)));
        let mut earlier = fewer.new_film("pairs");
        let (whole, mut film) = (earlier.full_part(), ready.new_film("pairs"));
        let continued = fewer
            .render_part(&mut earlier, &whole, &())
            .and_then(|()| film.continue_from(case.stored(earlier)))
            .and_then(|()| ready.render_part(&mut film, &whole, &()));
        match continued {
            Ok(()) => difference(&ready.render(&()).picture, &film.picture()),
            Err(error) => Some(error.to_string()),
        }
    }),
    ("no layers, and one alone", |case| {
        if case.is_adaptive() {
            return None;
        }
        let aovs = &case.settings.aovs;
        let alone = aovs.get(case.turn(aovs.len().max(1))).copied();
        let lists = [Some(Vec::new()), alone.map(|aov| vec![aov])];
        lists.into_iter().flatten().find_map(|aovs| {
            let found = case.output(|s| s.aovs = aovs);
            [
                (&case.whole, &found.picture),
                (case.output.final_picture(), found.final_picture()),
            ]
            .into_iter()
            .find_map(|(expected, found)| {
                let mut expected = expected.clone();
                expected
                    .layers
                    .retain(|layer| found.layer(&layer.name).is_some());
                difference(&without_errors(expected), &without_errors(found.clone()))
            })
        })
    }),
    ("a camera that is replaced", |case| {
        let other: Scene = Case::altered(&case.scene, |scene| {
            scene["cameras"][0]["pose"] = serde_json::json!({ "orbit": { "target": [0, 0, 0], "distance": 3, "azimuth": 70, "elevation": 10 } });
            scene["cameras"][0]["pose_end"] = Value::Null;
        });
        let mut ready = case.ready(|s| s.camera = other.cameras.first().cloned());
        let camera = case.settings.camera.clone()?;
        if !ready.replace_camera(&case.scene, &camera) {
            return None;
        }
        case.differs_from(&case.one.install(|| ready.render(&())))
    }),
    ("previews", |case| {
        let samples = case.settings.sampling.samples_per_pixel();
        if case.is_adaptive()
            || case.settings.denoise
            || case.settings.replicates.is_some()
            || case.settings.sampling == CORNERS
        {
            return None;
        }
        let ready = case.ready(|_| ());
        let preview = ready
            .render_preview(1, samples, &case.settings.aovs, &())
            .picture;
        let staged = case
            .one
            .install(|| ready.render_progressively(&(), |_| ()))
            .picture;
        difference(&case.whole, &preview).or_else(|| difference(&case.whole, &staged))
    }),
    ("a picture file", |case| {
        let (folder, path) = (Sandbox::new(), "picture.exr");
        let written = write_picture(
            &folder.path(path),
            &case.whole,
            Display::from_render(&case.scene.render),
            &PictureMetadata::default(),
        );
        if let Err(error) = written {
            return Some(error.to_string());
        }
        match read_picture(&folder.path(path), &Limits::default()) {
            Ok(stored) => {
                // The file keeps the shadow of a ground as coverage.
                let expected = Picture {
                    shadow: None,
                    ..case.whole.clone()
                };
                difference(&expected, &in_order_of(&expected, stored.picture))
            }
            Err(error) => Some(error.to_string()),
        }
    }),
    ("lost samples", |case| {
        let counters = case.output.counters;
        let lost = counters.faults().next().is_some();
        lost.then(|| format!("{counters:?}"))
    }),
    ("the other precision", |case| {
        if case.is_adaptive() {
            return None;
        }
        // Within glass, bounces without end make another path of any rounding.
        let [robust, reference] =
            [PrecisionChoice::Robust, PrecisionChoice::Reference].map(|precision| {
                case.picture(|s| (s.precision, s.max_depth) = (precision, s.max_depth.min(4)))
            });
        apart(&robust, &reference, 0.15)
    }),
    // A studio's ground and backdrop follow all that a body passes.
    ("a motion that is held", |case| {
        if case.is_adaptive() || case.has_ground() {
            return None;
        }
        let camera = case.settings.camera.clone()?;
        let [open, close] = camera.shutter?;
        let middle = 0.5 * (open + close);
        let held =
            case.picture(|s| s.camera = Some(with_shutter(&camera, Some([middle, middle + 1e-9]))));
        let still = case.still_at(middle);
        let off = case
            .settings
            .without
            .or(EffectSet::from_effects(&[Effect::Motion]));
        let opened = case.picture(|s| s.without = off);
        // A body that moves is not sampled as a lamp.
        let is_lamp = case.choice[axis_index("glow")] > 0 && !case.sketch().end.is_empty();
        let random = !case.settings.sampling.is_fixed()
            && !case.settings.without.has(Effect::Motion)
            && !is_lamp;
        apart(&case.still_at(open), &opened, 0.1)
            .map(|found| format!("without motion: {found}"))
            .or_else(|| random.then(|| apart(&still, &held, 0.1)).flatten())
    }),
    ("clay", |case| {
        if !case.sketch().options.clay || case.is_blended_clay() {
            return None;
        }
        let other = Colouring::Input(serde_json::json!([0.1, 0.9, 0.2]));
        difference(&case.with_colouring(other), &case.whole)
    }),
    ("forms of a colour", |case| {
        let form = case.sketch().colouring;
        let even = even_colour(&form, COLOUR);
        // The cap of a section has the colour of its body, but not the texture.
        if even == form
            || case.is_adaptive()
            || case.is_blended_clay()
            || case.sketch().options.section.is_some()
        {
            return None;
        }
        apart(
            &case.with_colouring(Colouring::Input(COLOUR.to_vec().into())),
            &case.with_colouring(even),
            0.1,
        )
    }),
    ("copies of a mesh", |case| {
        // In a crowd of lamps rounding decides which of two lamps of equal light comes first.
        let has_many_lamps =
            case.choice[axis_index("glow")] > 0 && case.sketch().generator.is_some();
        if case.scene.meshes.is_empty() || case.is_adaptive() || has_many_lamps {
            return None;
        }
        let mut scene = case.scene.clone();
        (scene.objects, scene.generators) = (expand_generators(&scene), Vec::new());
        let meshes = scene.meshes.clone();
        for (i, object) in scene.objects.iter_mut().enumerate() {
            if let Shape::Mesh(name) = &mut object.shape {
                let mut copy = meshes.iter().find(|mesh| mesh.name == *name)?.clone();
                copy.name = format!("{name} {i}");
                name.clone_from(&copy.name);
                scene.meshes.push(copy);
            }
        }
        let copies = case.one.install(|| Case::render(&scene, &case.settings));
        apart(&case.whole, &copies.picture, 0.1)
    }),
    ("first hits by either integrator", |case| {
        let kept = [
            Aov::Albedo,
            Aov::Normal,
            Aov::Position,
            Aov::Depth,
            Aov::Object,
            Aov::Material,
        ];
        // Blended surfaces are passed by chance or in part.
        let is_blended = serde_json::to_string(&case.scene.materials)
            .expect("plain data")
            .contains("blend\"");
        if case.is_adaptive() || is_blended {
            return None;
        }
        let [mut paths, mut rays] = [Integrator::Path, Integrator::Whitted].map(|integrator| {
            case.picture(|s| {
                (s.integrator, s.aovs, s.denoise) = (integrator, kept.to_vec(), false);
                // Rays of Whitted's integrator divide.
                s.max_depth = 1;
            })
        });
        paths.rgb.fill([0.0; 3]);
        rays.rgb.fill([0.0; 3]);
        // Whitted's rules show no ground.
        if case.has_ground() {
            (paths.alpha, rays.alpha) = (None, None);
        }
        apart(&paths, &rays, 0.1)
    }),
    ("covered pixels", |case| {
        if case.is_adaptive() || case.has_ground() {
            return None;
        }
        let [sky, clear] = [Background::Environment, Background::Transparent]
            .map(|background| case.picture(|s| (s.background, s.aovs) = (background, Vec::new())));
        let alpha = clear.alpha.as_ref()?;
        let covered = (0..alpha.len()).filter(|&i| alpha[i] == 1.0);
        let other = covered.filter(|&i| sky.rgb[i] != clear.rgb[i]).count();
        (other > 0).then(|| format!("{other} covered pixels depend on the background"))
    }),
    ("a transform of a texture's coordinates", |case| {
        let Colouring::Texture(texture, own) = case.sketch().colouring else {
            return None;
        };
        let [row0, row1] =
            serde_json::from_value::<[[f64; 3]; 2]>(own["uv_transform"].clone()).ok()?;
        // These depend on the coordinates themselves.
        let mut choice = case.with("shape", "smooth mesh");
        for axis in ["layer", "bumps", "alpha", "glow"] {
            choice[axis_index(axis)] = 0;
        }
        let mut mapped = sketch(&choice);
        mapped.colouring = Colouring::Texture(texture, serde_json::json!({}));
        let uvs = &mut mapped.parts["meshes"][0]["source"]["inline"]["uvs"][0];
        for uv in uvs.as_array_mut().expect("coordinates") {
            let [u, v] = [0, 1].map(|i| uv[i].as_f64().expect("a number"));
            let map = |row: [f64; 3]| row[0] * u + row[1] * v + row[2];
            *uv = serde_json::json!([map(row0), map(row1)]);
        }
        case.sketches_differ(sketch(&choice), mapped)
    }),
    ("a transform of a mesh's corners", |case| {
        let mut choice = case.with("shape", "flat mesh");
        for axis in ["count", "motion", "loading"] {
            choice[axis_index(axis)] = 0;
        }
        let (placed, mut baked) = (sketch(&choice), sketch(&choice));
        let steps: Vec<TransformStep> = std::mem::take(&mut baked.steps)
            .into_iter()
            .map(|step| serde_json::from_value(step).expect("a step"))
            .collect();
        let map = affine_from_steps(&steps);
        // Only scenes with edges, whose widths depend on all of this. A mirrored mesh is turned
        // inside out.
        if !case.settings.wireframe || steps.is_empty() || map.matrix3.determinant() < 0.0 {
            return None;
        }
        let corners = &mut baked.parts["meshes"][0]["source"]["inline"]["positions"];
        for corner in corners.as_array_mut().expect("corners") {
            let place = serde_json::from_value::<[f64; 3]>(corner.take()).expect("a corner");
            *corner = serde_json::json!(map.transform_point3(place.into()).to_array());
        }
        case.sketches_differ(placed, baked)
    }),
    ("colours and alpha of vertices", |case| {
        if case.sketch().colouring != Colouring::Vertices || case.is_adaptive() {
            return None;
        }
        let choice = case.with("shape", "smooth mesh");
        let [mut vertices, mut even] = [sketch(&choice), sketch(&choice)];
        let [r, g, b] = COLOUR;
        let mesh = &mut vertices.parts["meshes"][0]["source"]["inline"];
        mesh["colours"] = vec![[r, g, b, 0.6]; 4].into();
        even.colouring = Colouring::Input(COLOUR.to_vec().into());
        if let Some(opacity) = even.model.get("opacity") {
            let opacity = opacity.to_string().replace('"', "");
            even.model["opacity"] = format!("0.6 * ({opacity})").into();
        }
        case.sketches_differ(vertices, even)
    }),
    ("one round of adaptive sampling", |case| {
        if !case.is_adaptive() {
            return None;
        }
        // Four samples in each of four replicates, unless the estimate of the error is doubtful.
        let round = case.output(|s| s.max_error = Some(1e9));
        let plain = case.output(|s| {
            (s.max_error, s.sampling, s.replicates) = (None, Sampling::General(16), Some(4));
        });
        let is_one = round.counters.samples == plain.counters.samples;
        is_one
            .then(|| apart(&round.picture, &plain.picture, 0.0))
            .flatten()
    }),
    ("a section's cap without edges", |case| {
        if !case.settings.wireframe || case.sketch().options.section.is_none() {
            return None;
        }
        let mut choice = case.with("shape", "flat mesh");
        // Only meshes that are listed and do not move are cut.
        for axis in ["count", "motion"] {
            choice[axis_index(axis)] = 0;
        }
        let (mut scene, settings) = sketch(&choice).finish().ok()?;
        let caps: Vec<_> = scene.meshes.iter().filter(|mesh| is_cap(mesh)).collect();
        let names: Vec<String> = caps.iter().map(|mesh| mesh.name.clone()).collect();
        let is_kept = |shape: &Shape| matches!(shape, Shape::Mesh(mesh) if names.contains(mesh));
        scene.objects.retain(|object| is_kept(&object.shape));
        let plain = Settings {
            wireframe: false,
            ..settings.clone()
        };
        let [with, without] = [settings, plain]
            .map(|settings| case.one.install(|| Case::render(&scene, &settings)).picture);
        difference(&without, &with)
    }),
    ("the sky from within a body that is not there", |case| {
        if case.choice[axis_index("alpha")] == 0 {
            return None;
        }
        let mut choice = case.with("camera", "within");
        choice[axis_index("floor")] = value_index("floor", "no");
        // A sphere around the camera, and paths.
        for axis in [
            "shape",
            "count",
            "transform",
            "motion",
            "side",
            "integrator",
        ] {
            choice[axis_index(axis)] = 0;
        }
        for axis in ["inside", "glow", "rules", "loading", "ending"] {
            choice[axis_index(axis)] = 0;
        }
        // A studio lights what has no light, and stands on what there is.
        if ["no", "studio"]
            .map(|sky| value_index("sky", sky))
            .contains(&case.choice[axis_index("sky")])
        {
            choice[axis_index("sky")] = 0;
        }
        let (mut clear, mut empty) = (sketch(&choice), sketch(&choice));
        clear.fields(serde_json::json!({ "opacity": 0 }));
        (empty.copies, empty.generator) = (Vec::new(), None);
        let [clear, empty] = [clear, empty].map(|mut sketch| {
            sketch.settings(|t| (t.aovs, t.max_depth) = (Vec::new(), 1));
            sketch
        });
        case.sketches_differ(clear, empty)
    }),
    ("light through a body that is not there", |case| {
        if case.choice[axis_index("alpha")] == 0 {
            return None;
        }
        // Light that the body sends, rules by which the first occluder decides, caps of a section
        // and a studio's ground do not depend on its opacity.
        let mut choice = case.with("floor", "no");
        for axis in ["glow", "rules", "loading", "ending", "camera", "crop"] {
            choice[axis_index(axis)] = 0;
        }
        if case.choice[axis_index("sky")] == value_index("sky", "studio") {
            choice[axis_index("sky")] = 0;
        }
        // Only light on its way to a floor passes the body: paths that pass surfaces have other
        // random numbers.
        let below = |mut sketch: Sketch| {
            sketch.floor(serde_json::json!({ "quad": { "corner": [-3, -4, 3], "edge_u": [6, 0, 0], "edge_v": [0, 0, -6] } }), serde_json::json!([]));
            let shutter = sketch.camera["shutter"].take();
            sketch.camera = serde_json::json!({
                "pose": { "look_at": { "eye": [0.3, -2.5, 0.5], "target": [0, -4, 0] } },
                "projection": { "pinhole": { "vertical_fov": 70 } }, "shutter": shutter,
            });
            sketch.settings(|t| (t.aovs, t.max_depth) = (Vec::new(), 2));
            sketch
        };
        let (mut clear, mut empty) = (sketch(&choice), sketch(&choice));
        clear.fields(serde_json::json!({ "opacity": 0 }));
        (empty.copies, empty.generator) = (Vec::new(), None);
        case.sketches_differ(below(clear), below(empty))
    }),
];

const CORNERS: Sampling = Sampling::Pattern(raywright::core::scene::SamplePattern::Corners);

/// A scene of the net, its picture by one thread, and pools.
pub struct Case<'a> {
    choice: &'a Choice,
    scene: Scene,
    settings: Settings,
    /// The render by one thread, and its picture before denoising.
    output: RenderOutput,
    whole: Picture,
    one: &'a ThreadPool,
    seven: &'a ThreadPool,
}

impl<'a> Case<'a> {
    /// Loads and renders a scene.
    pub fn new(choice: &'a Choice, [one, seven]: [&'a ThreadPool; 2]) -> Result<Self, String> {
        let (scene, settings) = sketch(choice).finish()?;
        let output = one.install(|| Self::render(&scene, &settings));
        Ok(Self {
            choice,
            scene,
            settings,
            whole: output.picture.clone(),
            output,
            one,
            seven,
        })
    }

    fn render(scene: &Scene, settings: &Settings) -> RenderOutput {
        let ready = prepare(scene, settings, &()).unwrap_or_else(|e| panic!("{e}"));
        ready.render(&())
    }

    /// A number below `count` that depends on the row alone: which of the values of a check that
    /// renders for each value is tried.
    fn turn(&self, count: usize) -> usize {
        let sum: usize = self
            .choice
            .iter()
            .zip(1..)
            .map(|(value, k)| value * k)
            .sum();
        sum % count
    }

    /// The row with another value of an axis.
    fn with(&self, axis: &str, value: &str) -> Choice {
        let mut choice = self.choice.clone();
        choice[axis_index(axis)] = value_index(axis, value);
        choice
    }

    fn sketch(&self) -> Sketch {
        sketch(self.choice)
    }

    fn ready_for(&self, settings: &Settings) -> ReadyScene {
        prepare(&self.scene, settings, &()).unwrap_or_else(|e| panic!("{e}"))
    }

    fn ready(&self, change: impl FnOnce(&mut Settings)) -> ReadyScene {
        let mut settings = self.settings.clone();
        change(&mut settings);
        self.one.install(|| self.ready_for(&settings))
    }

    /// The render with other settings.
    fn output(&self, change: impl FnOnce(&mut Settings)) -> RenderOutput {
        let mut settings = self.settings.clone();
        change(&mut settings);
        self.one.install(|| Self::render(&self.scene, &settings))
    }

    /// The picture with other settings.
    fn picture(&self, change: impl FnOnce(&mut Settings)) -> Picture {
        self.output(change).picture
    }

    fn differs(&self, change: impl FnOnce(&mut Settings)) -> Finding {
        self.differs_from(&self.output(change))
    }

    /// Difference from another render in a bit, before denoising or after.
    fn differs_from(&self, other: &RenderOutput) -> Finding {
        difference(&self.whole, &other.picture)
            .or_else(|| difference(self.output.final_picture(), other.final_picture()))
    }

    fn differs_from_film(&self, film: &Film) -> Finding {
        self.differs_from(&RenderOutput::from_film(film, &()))
    }

    /// Difference of the pictures of two scenes, up to rounding.
    fn sketches_differ(&self, a: Sketch, b: Sketch) -> Finding {
        let [a, b] = [a, b].map(|sketch| self.picture_of(sketch));
        apart(&a, &b, 0.1)
    }

    fn picture_of(&self, sketch: Sketch) -> Picture {
        let (scene, settings) = sketch.finish().unwrap_or_else(|e| panic!("{e}"));
        self.one.install(|| Self::render(&scene, &settings)).picture
    }

    fn is_adaptive(&self) -> bool {
        self.settings.max_error.is_some()
    }

    /// Whether clay turns a blended body into a mask where its colour is a texture, and makes it
    /// opaque otherwise.
    fn is_blended_clay(&self) -> bool {
        self.sketch().options.clay
            && self.choice[axis_index("alpha")] == value_index("alpha", "blend")
    }

    fn has_ground(&self) -> bool {
        self.whole.shadow.is_some()
            || matches!(self.scene.sky, Some(raywright::core::scene::Sky::Studio(_)))
    }

    /// A film as it is read from its file.
    fn stored(&self, film: Film) -> Film {
        let (folder, metadata) = (Sandbox::new(), PictureMetadata::default());
        let display = Display::from_render(&self.scene.render);
        let path = folder.path("film");
        write_film(
            &path,
            &mut StoredFilm {
                film,
                metadata,
                display,
            },
        )
        .unwrap_or_else(|e| panic!("{e}"));
        read_film(&path, &Limits::default())
            .unwrap_or_else(|e| panic!("{e}"))
            .film
    }

    /// The scene with changes of its JSON; images and meshes keep their data.
    fn altered(scene: &Scene, change: impl FnOnce(&mut Value)) -> Scene {
        let mut value = serde_json::to_value(&scene.cameras).expect("plain data");
        let mut all = serde_json::json!({ "cameras": value.take() });
        change(&mut all);
        Scene {
            cameras: serde_json::from_value(all["cameras"].take()).expect("cameras"),
            ..scene.clone()
        }
    }

    /// The picture of the scene as it stands at a time, without motion.
    fn still_at(&self, time: f64) -> Picture {
        let mut scene = self.scene.clone();
        let generated = scene.generators.iter_mut().map(|own| &mut own.object);
        for object in scene.objects.iter_mut().chain(generated) {
            if let Some(end) = object.transform_end.take() {
                let ends = [
                    affine_from_steps(&object.transform),
                    affine_from_steps(&end),
                ];
                let [a, b] = ends.map(|map| map.to_cols_array());
                let m: Vec<f64> = (0..12).map(|i| a[i] + (b[i] - a[i]) * time).collect();
                let rows = [0, 1, 2].map(|i| [m[i], m[i + 3], m[i + 6], m[i + 9]]);
                object.transform = vec![TransformStep::Matrix(rows)];
            }
        }
        let scene = Self::altered(&scene, |value| {
            let end = value["cameras"][0]["pose_end"].take();
            if !end.is_null() {
                value["cameras"][0]["pose"] = between(&value["cameras"][0]["pose"], &end, time);
            }
            value["cameras"][0]["shutter"] = Value::Null;
        });
        let settings = Settings {
            camera: scene.cameras.first().cloned(),
            ..self.settings.clone()
        };
        self.one.install(|| Self::render(&scene, &settings)).picture
    }

    /// The picture with another form of the body's colour.
    fn with_colouring(&self, colouring: Colouring) -> Picture {
        let mut sketch = self.sketch();
        sketch.colouring = colouring;
        self.picture_of(sketch)
    }
}

/// The sketch of a choice.
pub fn sketch(choice: &Choice) -> Sketch {
    let mut sketch = Sketch::new();
    for (&value, axis) in choice.iter().zip(AXES) {
        axis.1[value].1(&mut sketch);
    }
    sketch
}

/// Whether a mesh is the cap of a section.
fn is_cap(mesh: &Mesh) -> bool {
    matches!(&mesh.source, MeshSource::Inline(data) if data.is_cap)
}

fn with_shutter(
    camera: &raywright::core::scene::Camera,
    shutter: Option<[f64; 2]>,
) -> raywright::core::scene::Camera {
    raywright::core::scene::Camera {
        shutter,
        ..camera.clone()
    }
}

/// Two poses of one kind, number by number at a time between them.
fn between(a: &Value, b: &Value, time: f64) -> Value {
    match (a, b) {
        (Value::Number(p), Value::Number(q)) => {
            let [p, q] = [p, q].map(|number| number.as_f64().expect("a number"));
            (p + (q - p) * time).into()
        }
        (Value::Array(p), Value::Array(q)) => {
            p.iter().zip(q).map(|(p, q)| between(p, q, time)).collect()
        }
        (Value::Object(p), Value::Object(q)) => Value::Object(
            p.iter()
                .map(|(key, p)| (key.clone(), between(p, &q[key], time)))
                .collect(),
        ),
        _ => a.clone(),
    }
}

/// A picture with its layers in the order of another's.
fn in_order_of(other: &Picture, mut picture: Picture) -> Picture {
    let place = |name: &str| other.layers.iter().position(|layer| layer.name == name);
    picture.layers.sort_by_key(|layer| place(&layer.name));
    picture
}

/// Finding if more than a share of the pixels differ by a thousandth or more: where paths are the
/// same but for rounding, few take another turn. Estimates of errors are left out.
fn apart(a: &Picture, b: &Picture, share: f64) -> Finding {
    if a.rgb.len() != b.rgb.len() || a.layers.len() != b.layers.len() {
        return Some("other sizes or layers".to_owned());
    }
    let close = |p: f32, q: f32| (p - q).abs() <= 1e-3 * (p.abs() + q.abs()) + 1e-3;
    let layers: Vec<_> = (a.layers.iter())
        .filter(|layer| !layer.name.starts_with("stderr"))
        .map(|layer| (layer, b.layer(&layer.name)))
        .collect();
    let alpha = |picture: &Picture, i: usize| picture.alpha.as_ref().map_or(1.0, |alpha| alpha[i]);
    let first = |i: usize| {
        let colour = (0..3).find(|&c| !close(a.rgb[i][c], b.rgb[i][c]));
        colour
            .map(|c| ("colour", a.rgb[i][c], b.rgb[i][c]))
            .or_else(|| {
                (!close(alpha(a, i), alpha(b, i))).then(|| ("alpha", alpha(a, i), alpha(b, i)))
            })
            .or_else(|| {
                layers.iter().find_map(|(p, q)| {
                    let (p, name, q) = (p.samples[i], p.name.as_str(), (*q)?.samples[i]);
                    (!close(p, q)).then_some((name, p, q))
                })
            })
            .map(|found| (i, found))
    };
    let found: Vec<_> = (0..a.rgb.len()).filter_map(first).collect();
    let is_far = found.len() as f64 > share * a.rgb.len() as f64;
    is_far.then(|| {
        format!(
            "{} of {} pixels differ, first {:?}",
            found.len(),
            a.rgb.len(),
            found[0]
        )
    })
}

/// A picture without the estimates of its errors, which depend on neighbours and other layers.
fn without_errors(mut picture: Picture) -> Picture {
    picture
        .layers
        .retain(|layer| !layer.name.starts_with("stderr"));
    picture
}

/// Stops after so many units of work.
struct StopAfter(AtomicU32);

impl Observer for StopAfter {
    fn progress(&self, _: u64, _: u64) {
        let _ = self
            .0
            .fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| {
                left.checked_sub(1)
            });
    }
    fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed) == 0
    }
}
