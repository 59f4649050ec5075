//! Reproducible images: their bits depend on scene, settings and seed, not on the accelerator, the
//! builder, threads, tiles or the crop. Tested for every built-in scene and for a few imported
//! ones.

use rayon::ThreadPoolBuilder;
use raywright::bvh::{AcceleratorKind, BuildQuality};
use raywright::core::picture::Picture;
use raywright::core::scene::Integrator;
use raywright::core::settings::{Aov, Crop, PrecisionChoice, Sampling};
use raywright::core::{Observer, RenderOutput, RenderStage, Scene, Settings, prepare};
use raywright::io::{Input, LoadOptions, load, presets};

use crate::support::shared;

const SIZE: [u32; 2] = [64, 48];

/// A scene with its name, and a sample count if its own is too slow.
struct BitsScene {
    name: String,
    scene: Scene,
    sampling: Sampling,
    /// Whether a linear scan of its primitives is slow.
    many: bool,
}

impl BitsScene {
    fn new(name: String, input: &Input, spp: Option<u32>) -> Self {
        let scene = load(input, &LoadOptions::default())
            .unwrap_or_else(|e| panic!("{e}"))
            .scene;
        let sampling = Sampling::from_spp(&scene, spp);
        let ready = prepare(
            &scene,
            &Settings {
                size: SIZE,
                ..Settings::from_scene(&scene)
            },
            &(),
        )
        .unwrap_or_else(|e| panic!("{name}: {e}"));
        let many = ready.table_sizes().primitives > 1000 && ready.table_sizes().instances > 0;
        Self {
            name,
            scene,
            sampling,
            many,
        }
    }

    fn render(&self, adjust: impl FnOnce(&mut Settings)) -> Picture {
        let mut settings = Settings::from_scene(&self.scene);
        settings.size = SIZE;
        settings.sampling = self.sampling;
        settings.aovs = vec![Aov::Normal, Aov::Depth, Aov::Object];
        adjust(&mut settings);
        prepare(&self.scene, &settings, &())
            .unwrap_or_else(|e| panic!("{}: {e}", self.name))
            .render(&())
            .picture
    }
}

/// Every preset, with its own pattern or few samples.
fn carried() -> Vec<BitsScene> {
    let few = |scene: &Scene| {
        if scene.render.pattern.is_none() {
            Some(2)
        } else {
            None
        }
    };
    let subject = |preset: presets::Preset| {
        let mut subject = BitsScene::new(
            preset.name.to_owned(),
            &Input::Preset(preset.name.to_owned()),
            None,
        );
        subject.sampling = Sampling::from_spp(&subject.scene, few(&subject.scene));
        subject
    };
    presets::list().into_iter().map(subject).collect()
}

/// Meshes, instances, textures and physical materials, where the shared data are available.
fn imported() -> Vec<BitsScene> {
    let Some(folder) = shared("assets") else {
        return Vec::new();
    };
    let files = [
        "gltf/Duck/Duck.glb",
        "gltf/crafted/cornell/cornell.gltf",
        "gltf/crafted/nested_transforms.glb",
        "obj/crafted/cornell_quads_ngons.obj",
        "obj/crafted/glass_and_mirror.obj",
    ];
    files
        .map(|file| BitsScene::new(file.to_owned(), &Input::Path(folder.join(file)), Some(1)))
        .into()
}

fn subjects() -> Vec<BitsScene> {
    carried().into_iter().chain(imported()).collect()
}

/// Asserts that pictures agree in every bit; otherwise the message names the first difference.
#[track_caller]
fn same(label: &str, a: &Picture, b: &Picture) {
    if let Some(difference) = difference(a, b) {
        panic!("{label}: {difference}");
    }
}

/// First difference of two pictures in a bit, of colour, coverage, shadow or layers.
pub fn difference(a: &Picture, b: &Picture) -> Option<String> {
    let channels = |p: &Picture| {
        let layers = p
            .layers
            .iter()
            .map(|layer| (layer.name.clone(), layer.samples.clone()));
        let colour = (0..3).map(|k| {
            (
                ["R", "G", "B"][k].to_owned(),
                p.rgb.iter().map(|pixel| pixel[k]).collect::<Vec<f32>>(),
            )
        });
        let coverage = [("A", &p.alpha), ("shadow", &p.shadow)]
            .into_iter()
            .filter_map(|(name, samples)| Some((name.to_owned(), samples.clone()?)));
        colour.chain(coverage).chain(layers).collect::<Vec<_>>()
    };
    if a.alpha.is_some() != b.alpha.is_some() || a.shadow.is_some() != b.shadow.is_some() {
        return Some("coverage or shadow in one alone".to_owned());
    }
    if (a.width, a.height, a.layers.len()) != (b.width, b.height, b.layers.len()) {
        return Some("not the same shape".to_owned());
    }
    channels(a)
        .into_iter()
        .zip(channels(b))
        .find_map(|((name, a_samples), (_, b_samples))| {
            let differs: Vec<usize> = (0..a_samples.len())
                .filter(|&i| a_samples[i].to_bits() != b_samples[i].to_bits())
                .collect();
            let &i = differs.first()?;
            let (x, y) = (i as u32 % a.width, i as u32 / a.width);
            let (p, q) = (a_samples[i], b_samples[i]);
            Some(format!(
                "{} samples of {name} differ, the first at ({x}, {y}): {p:?} and {q:?}",
                differs.len()
            ))
        })
}

/// Crops a picture.
pub fn part(whole: &Picture, crop: Crop) -> Picture {
    let rows = (crop.y..crop.y + crop.height)
        .flat_map(|y| (crop.x..crop.x + crop.width).map(move |x| (x, y)));
    let places: Vec<usize> = rows.map(|(x, y)| (y * whole.width + x) as usize).collect();
    let mut cut = Picture {
        width: crop.width,
        height: crop.height,
        ..whole.clone()
    };
    cut.rgb = places.iter().map(|&i| whole.rgb[i]).collect();
    for samples in [&mut cut.alpha, &mut cut.shadow].into_iter().flatten() {
        *samples = places.iter().map(|&i| samples[i]).collect();
    }
    for layer in &mut cut.layers {
        layer.samples = places.iter().map(|&i| layer.samples[i]).collect();
    }
    cut
}

/// Protects: the tree finds exactly the hits of the linear scan, in every precision.
#[test]
fn scan_and_tree() {
    for subject in subjects() {
        for precision in [PrecisionChoice::Robust, PrecisionChoice::Reference] {
            let with = |accelerator| {
                subject.render(|s| {
                    s.precision = precision;
                    s.accelerator = accelerator;
                    // A linear scan of thousands of instances takes minutes where a tree takes a
                    // tenth of a second.
                    if subject.many {
                        s.size = SIZE.map(|edge| edge / 8);
                    }
                })
            };
            let scan = with(AcceleratorKind::Linear);
            let tree = with(AcceleratorKind::default());
            same(
                &format!("{}, {precision:?}: tree and scan", subject.name),
                &tree,
                &scan,
            );
        }
    }
}

/// Protects: trees of every build quality find the same hits.
#[test]
fn t21_build_qualities() {
    for subject in subjects() {
        let first = subject.render(|_| {});
        for quality in BuildQuality::ALL {
            let built = subject.render(|s| s.accelerator = AcceleratorKind::Tree(quality));
            same(&format!("{}: {quality:?}", subject.name), &first, &built);
        }
    }
}

/// Protects: random numbers are addressed by pixel and sample, and sums have a fixed order, for any
/// threads and tiles.
#[test]
fn t21_threads_and_tiles() {
    for subject in subjects() {
        // Once with the scene's own samples, once with more samples than a block of the film holds.
        for (size, sampling) in [(SIZE, subject.sampling), ([24, 18], Sampling::General(17))] {
            let with = |threads, tile_size| {
                let render = || {
                    subject.render(|s| {
                        s.size = size;
                        s.sampling = sampling;
                        s.tile_size = tile_size;
                    })
                };
                ThreadPoolBuilder::new()
                    .num_threads(threads)
                    .build()
                    .expect("a few threads")
                    .install(render)
            };
            let first = with(1, 32);
            for (threads, tile) in [(2, 32), (1, 1), (1, 7), (2, 7), (2, 1000)] {
                let label = format!(
                    "{}, {sampling:?}: {threads} threads, tiles of {tile}",
                    subject.name
                );
                same(&label, &first, &with(threads, tile));
            }
        }
    }
}

/// Protects: a crop equals that part of the whole picture.
#[test]
fn crops() {
    let crops = [
        [0, 0, 64, 48],
        [0, 0, 1, 1],
        [63, 47, 1, 1],
        [17, 5, 31, 40],
        [0, 33, 64, 9],
    ];
    for subject in subjects() {
        for sampling in [subject.sampling, Sampling::General(3)] {
            let whole = subject.render(|s| s.sampling = sampling);
            for [x, y, width, height] in crops {
                let crop = Crop {
                    x,
                    y,
                    width,
                    height,
                };
                let cropped = subject.render(|s| {
                    s.sampling = sampling;
                    s.crop = Some(crop);
                });
                same(
                    &format!("{}, {sampling:?}: {crop:?}", subject.name),
                    &part(&whole, crop),
                    &cropped,
                );
            }
        }
    }
}

/// Protects: the other tests here compare pictures with objects in them, and the comparison detects
/// a single bit.
#[test]
fn the_comparison_sees_one_bit() {
    for subject in subjects() {
        let picture = subject.render(|_| {});
        let shown = picture
            .layer("object.id")
            .is_some_and(|ids| ids.samples.iter().any(|&id| id >= 0.0));
        assert!(shown, "{}: the picture shows no object", subject.name);
        let mut other = picture.clone();
        other.rgb[7][1] = f32::from_bits(other.rgb[7][1].to_bits() ^ 1);
        let seen = difference(&picture, &other).unwrap_or_default();
        assert!(
            seen.starts_with("1 samples of G differ"),
            "{}: a changed bit was not seen: {seen}",
            subject.name
        );
    }
}

/// Protects: previews during a render change no bit of it. Each preview has about twice the samples
/// of the one before and at least one for every pixel; none is the finished picture; a render
/// stopped at a preview gives no further one.
#[test]
fn looks_change_no_bit() {
    let text = r#"{ "format": 1, "sky": { "constant": 1 }, "materials": [{ "name": "m", "model": { "physical": { "roughness": 0.5 } } }],
        "objects": [{ "shape": { "sphere": { "centre": [0, 0, 0], "radius": 1 } }, "material": "m" }] }"#;
    let input = Input::Bytes {
        name: "ball.scene.json".to_owned(),
        bytes: text.into(),
        resolver: None,
    };
    let scene = load(&input, &LoadOptions::default())
        .unwrap_or_else(|e| panic!("{e}"))
        .scene;
    let settings = Settings {
        size: SIZE,
        sampling: Sampling::General(256),
        integrator: Integrator::Path,
        ..Settings::from_scene(&scene)
    };
    let ready = prepare(&scene, &settings, &()).unwrap_or_else(|e| panic!("{e}"));
    let (mut rays, mut bare) = (Vec::new(), 0);
    // A single thread, which takes its tiles in order: with several, the slowest decide how many
    // samples the others add in the meantime.
    let pool = ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("a thread");
    let look = |stage: &RenderStage<'_>| {
        let so_far = RenderOutput::from_film_without_denoising(stage.film());
        rays.push(so_far.counters.camera);
        assert_eq!(*stage.picture(), so_far.picture);
        bare += stage
            .picture()
            .rgb
            .iter()
            .filter(|rgb| **rgb == [0.0; 3])
            .count();
    };
    let found = pool.install(|| ready.render_progressively(&(), look));
    assert!(found.finished && found.picture == ready.render(&()).picture);
    assert_eq!((rays.len(), bare), (7, 0), "{rays:?}");
    let all = found.counters.camera as f64;
    assert!(rays.windows(2).all(|pair| pair[0] < pair[1]), "{rays:?}");
    for (look, &rays) in rays.iter().enumerate() {
        // The first passes take several samples at once.
        let (share, maximum) = (
            f64::from(1 << (7 - look)) * rays as f64 / all,
            if look < 3 { 4.0 } else { 1.6 },
        );
        assert!(
            (1.0..maximum).contains(&share),
            "look {look}: {share} of what it should have"
        );
    }

    /// An observer that stops at once.
    struct StopsAtOnce;
    impl Observer for StopsAtOnce {
        fn is_cancelled(&self) -> bool {
            true
        }
    }
    let mut looks = 0;
    assert!(
        !ready
            .render_progressively(&StopsAtOnce, |_| looks += 1)
            .finished
    );
    assert_eq!(looks, 0);
}

/// Protects: a sketch shows the view of the picture at any size of its pixels: each is about the
/// mean of the pixels it covers, for near, far and moving cameras; with pixels of the picture's
/// size, the sketch equals the picture to the bit.
#[test]
fn sketches_show_the_same_view() {
    let scene = |camera: &str| {
        let text = format!(
            r#"{{ "format": 1, "sky": {{ "gradient": {{ "bottom": [1, 0.2, 0.1], "top": [0.1, 0.2, 1] }} }}, "cameras": [{camera}],
                "materials": [{{ "name": "m", "model": {{ "physical": {{ "base_colour": [0.9, 0.6, 0.1] }} }} }}],
                "objects": [{{ "shape": {{ "sphere": {{ "centre": [0.4, 0.3, 0], "radius": 1 }} }}, "material": "m" }}] }}"#
        );
        let input = Input::Bytes {
            name: "ball.scene.json".to_owned(),
            bytes: text.into(),
            resolver: None,
        };
        load(&input, &LoadOptions::default())
            .unwrap_or_else(|e| panic!("{e}"))
            .scene
    };
    let look = |eye: &str| format!(r#"{{ "look_at": {{ "eye": {eye}, "target": [0, 0, 0] }} }}"#);
    let near = look("[0, 1, 5]");
    let pinhole =
        |fov: f64| format!(r#""projection": {{ "pinhole": {{ "vertical_fov": {fov} }} }}"#);
    let moving = format!(r#", "pose_end": {}, "shutter": [0, 1]"#, look("[1, 1, 5]"));
    for (camera, name) in [
        (
            format!(r#"{{ "pose": {near}, {} }}"#, pinhole(40.0)),
            "near",
        ),
        (
            format!(
                r#"{{ "pose": {}, {} }}"#,
                look("[0, 0, 90000]"),
                pinhole(0.0025)
            ),
            "far",
        ),
        (
            format!(r#"{{ "pose": {near}, {}{moving} }}"#, pinhole(40.0)),
            "moving",
        ),
    ] {
        let scene = scene(&camera);
        let (size, sampling) = ([62, 41], Sampling::General(256));
        let settings = Settings {
            size,
            sampling,
            integrator: Integrator::Path,
            ..Settings::from_scene(&scene)
        };
        let ready = prepare(&scene, &settings, &()).unwrap_or_else(|e| panic!("{name}: {e}"));
        let picture = ready.render(&()).picture;
        assert!(
            ready.render_preview(1, 256, &[], &()).picture == picture,
            "{name}"
        );
        let sketch = ready.render_preview(4, 256, &[], &()).picture;
        assert_eq!([sketch.width, sketch.height], [16, 11]);
        let mut worst = 0.0_f32;
        for (x, y) in (0..10).flat_map(|y| (0..15).map(move |x| (x, y))) {
            let block = (0..16).filter_map(|i| picture.pixel(4 * x + i % 4, 4 * y + i / 4));
            let mean = block.fold([0.0; 3], |sum, pixel| {
                std::array::from_fn(|c| sum[c] + pixel[c] / 16.0)
            });
            let found = sketch.pixel(x, y).expect("a pixel");
            worst = (0..3)
                .map(|c| (found[c] - mean[c]).abs())
                .fold(worst, f32::max);
        }
        assert!(worst < 0.08, "{name}: {worst}");
    }
}
