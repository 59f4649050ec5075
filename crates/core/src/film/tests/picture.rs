//! Results from the sums: errors, layers, counters and memory.

use super::{layers, ready, rendered, scene, settings};
use crate::film::estimate::ReplicateStats;
use crate::film::{Film, ReplicateBuffer};
use crate::hash::splitmix64;
use crate::metrics::student_factor_95;
use crate::scene::{Integrator, SamplePattern, Scene};
use crate::settings::{Aov, Background, Sampling, Settings};
use crate::{RenderOutput, prepare};

fn render(scene: &Scene, settings: &Settings) -> RenderOutput {
    prepare(scene, settings, &())
        .unwrap_or_else(|e| panic!("{e}"))
        .render(&())
}

/// Buffers of one pixel with these sums and counts.
fn planes(of: &[(f64, u16)]) -> Vec<ReplicateBuffer> {
    of.iter()
        .map(|&(sum, n)| ReplicateBuffer {
            sums: vec![[sum; 3]],
            samples: vec![n],
            ..ReplicateBuffer::default()
        })
        .collect()
}

fn error(of: &[(f64, u16)]) -> f32 {
    let buffers = planes(of);
    ReplicateStats::new(buffers.iter().map(|buffer| vec![buffer]), false).standard_errors(1, 1)[0]
        [0]
}

/// Protects: the standard error of replicates, by hand. Means 1, 2, 3, 4 of equal weight: variance
/// 5/3, over four. Means 1 of three samples and 5 of one: mean 2, (3·1 + 1·9) / (4·1) = 3. A
/// replicate without samples does not count.
#[test]
fn standard_errors_by_hand() {
    assert_eq!(
        error(&[(5.0, 5), (10.0, 5), (15.0, 5), (20.0, 5)]),
        (5.0_f64 / 12.0).sqrt() as f32
    );
    assert_eq!(error(&[(3.0, 3), (5.0, 1)]), 3.0_f32.sqrt());
    assert_eq!(error(&[(3.0, 3), (0.0, 0), (5.0, 1)]), 3.0_f32.sqrt());
    assert_eq!(error(&[(2.0, 2), (3.0, 3)]), 0.0);
    assert_eq!(
        (error(&[(2.0, 2)]), error(&[(2.0, 2), (0.0, 0)]), error(&[])),
        (-1.0, -1.0, -1.0)
    );
}

/// Protects: a pixel with a tiny estimate gets at least a ninth of the mean variance per sample of
/// the pixel and its neighbours, and zero is not claimed where a neighbour found light. Nine pixels
/// of four replicates, of which the middle one found none and the others 4 in one replicate, a
/// variance of 1 each, have a mean of 8/9. A pixel without lit neighbours is compared with the
/// whole picture, unless it is empty. A pixel noisier than its neighbours keeps its estimate, a
/// neighbour without a second replicate does not count, and a neighbour with twice the samples has
/// twice the variance per sample.
#[test]
fn no_error_is_far_below_the_neighbours() {
    let errors_of = |width: usize,
                     pixels: &[[f64; 4]],
                     covered: Vec<u32>,
                     samples: &dyn Fn(usize, usize) -> u16| {
        let plane = |replicate: usize| {
            let each = pixels.iter().enumerate();
            let counts: Vec<u16> = (0..pixels.len())
                .map(|pixel| samples(pixel, replicate))
                .collect();
            let sums = each
                .map(|(pixel, means)| [means[replicate] * f64::from(counts[pixel]); 3])
                .collect();
            ReplicateBuffer {
                sums,
                samples: counts,
                ..ReplicateBuffer::default()
            }
        };
        let mut buffers: Vec<ReplicateBuffer> = (0..4).map(plane).collect();
        buffers
            .iter_mut()
            .for_each(|buffer| buffer.covered.clone_from(&covered));
        let errors = ReplicateStats::new(buffers.iter().map(|buffer| vec![buffer]), false)
            .standard_errors(pixels.len(), width);
        errors
            .iter()
            .map(|error| f64::from(error[1]))
            .collect::<Vec<f64>>()
    };
    let errors = |width: usize, pixels: &[[f64; 4]], samples: &dyn Fn(usize, usize) -> u16| {
        errors_of(width, pixels, Vec::new(), samples)
    };
    const LEAST: f64 = 0.117_282;
    let (dark, lit) = ([0.0; 4], [0.0, 0.0, 4.0, 0.0]);
    let mut nine = [lit; 9];
    nine[4] = dark;
    let found = errors(3, &nine, &|_, _| 2);
    assert!(
        (found[4] - (LEAST * 8.0 / 9.0).sqrt()).abs() < 1e-6,
        "{found:?}"
    );
    assert!((found[0] - 1.0).abs() < 1e-6 && errors(3, &[dark; 9], &|_, _| 2) == [0.0; 9]);
    let row = errors(4, &[dark, dark, dark, lit], &|_, _| 2);
    assert!(
        (row[1] - (LEAST / 4.0).sqrt()).abs() < 1e-6 && (row[3] - 1.0).abs() < 1e-6,
        "{row:?}"
    );
    assert!((row[0] - (LEAST / 4.0).sqrt()).abs() < 1e-6, "{row:?}");
    let row = errors_of(4, &[dark, dark, dark, lit], vec![0, 0, 0, 1], &|_, _| 2);
    assert_eq!(row[0], 0.0, "nothing is there");
    // Constant light of its own is no noise.
    assert_eq!(
        errors(4, &[[3.0; 4], [3.0; 4], [3.0; 4], lit], &|_, _| 2)[0],
        0.0
    );
    // A neighbour with a single replicate gives no information, and its own error is unknown.
    let row = errors(3, &[lit, dark, lit], &|pixel, replicate| {
        if pixel == 0 && replicate > 0 { 0 } else { 2 }
    });
    assert!(
        row[0] == -1.0 && (row[1] - (LEAST / 2.0).sqrt()).abs() < 1e-6,
        "{row:?}"
    );
    let row = errors(2, &[dark, lit], &|pixel, _| if pixel == 0 { 2 } else { 4 });
    assert!(
        (row[0] - (LEAST * 2.0 / 2.0).sqrt()).abs() < 1e-6,
        "{row:?}"
    );
}

/// Protects: a channel in which neither a pixel nor its neighbours found light is compared with the
/// whole picture, also where another channel has light. Of four pixels of constant red, whose last
/// has green 4 in one replicate of four, the first claims the least share of a quarter of that
/// variance in green, and zero in red and blue.
#[test]
fn channels_are_held_against_the_picture_one_by_one() {
    let plane = |replicate: usize| {
        let green = |pixel: usize| {
            if (pixel, replicate) == (3, 2) {
                8.0
            } else {
                0.0
            }
        };
        let sums = (0..4).map(|pixel| [6.0, green(pixel), 0.0]).collect();
        ReplicateBuffer {
            sums,
            samples: vec![2; 4],
            ..ReplicateBuffer::default()
        }
    };
    let buffers: Vec<ReplicateBuffer> = (0..4).map(plane).collect();
    let [red, green, blue] = ReplicateStats::new(buffers.iter().map(|buffer| vec![buffer]), false)
        .standard_errors(4, 4)[0]
        .map(f64::from);
    assert!(
        [red, blue] == [0.0; 2] && (green - (0.117_282_f64 / 4.0).sqrt()).abs() < 1e-6,
        "{red} {green} {blue}"
    );
}

/// Protects: where light is rare, pixel intervals contain at least 93 of 100 truths, while those of
/// replicates alone contain 27 and 47. In these films each of 64 samples has the same small chance
/// to find light, so that most pixels found none.
#[test]
fn errors_of_pixels_hold_rare_light() {
    const SIDE: usize = 40;
    let share = |address: u64| {
        (splitmix64(splitmix64(address) ^ 0x5EED) >> 11) as f64 / (1_u64 << 53) as f64
    };
    for chance in [0.005, 0.01] {
        let mut held = 0;
        let plane = |replicate: usize| {
            let lit = |pixel: usize| {
                let address = |index: usize| {
                    (((pixel * 4 + replicate) * 16 + index) as u64 + (chance * 1e6) as u64) << 20
                };
                (0..16)
                    .filter(|&index| share(address(index)) < chance)
                    .count() as f64
            };
            let sums = (0..SIDE * SIDE).map(|pixel| [lit(pixel); 3]).collect();
            ReplicateBuffer {
                sums,
                samples: vec![16; SIDE * SIDE],
                ..ReplicateBuffer::default()
            }
        };
        let buffers: Vec<ReplicateBuffer> = (0..4).map(plane).collect();
        let replicate_stats = ReplicateStats::new(buffers.iter().map(|buffer| vec![buffer]), false);
        for (pixel, error) in replicate_stats
            .standard_errors(SIDE * SIDE, SIDE)
            .into_iter()
            .enumerate()
        {
            let off = (replicate_stats.mean(pixel).0[0] - chance).abs();
            held += usize::from(off <= student_factor_95(3) * f64::from(error[0]));
        }
        let share = held as f64 / (SIDE * SIDE) as f64;
        assert!(share >= 0.93, "{chance}: {share}");
    }
}

/// Protects: standard errors have one degree of freedom less than the film has replicates, and are
/// unknown with one replicate.
#[test]
fn errors_have_a_freedom_less_than_replicates() {
    for (replicates, expected) in [(1, None), (2, Some(1)), (4, Some(3)), (8, Some(7))] {
        let settings = Settings {
            replicates: Some(replicates),
            ..settings(8)
        };
        let film = rendered(&ready(&settings));
        let found = film.standard_errors().map(|(_, freedom)| freedom);
        assert_eq!(found, expected, "{replicates} replicates");
    }
}

/// Protects: the error is zero without random sampling, −1 where unknown, and estimated from eight
/// samples on.
#[test]
fn errors_say_what_they_are() {
    let mut still = scene();
    still.objects.retain(|object| object.material != "lamp");
    still.lights.push(
        serde_json::from_str(
            r#"{ "kind": { "directional": { "to_light": [0, 1, 0] } }, "colour": 1 }"#,
        )
        .expect("a light"),
    );
    still.cameras[0].projection =
        serde_json::from_str(r#"{ "pinhole": { "vertical_fov": 50 } }"#).expect("a pinhole");
    let errors = |scene: &Scene, sampling| {
        let settings = Settings {
            sampling,
            size: [11, 7],
            aovs: vec![Aov::StandardError],
            integrator: Integrator::Whitted,
            ..Settings::from_scene(scene)
        };
        let picture = render(scene, &settings).picture;
        picture
            .layer("stderr.G")
            .expect("asked for")
            .samples
            .clone()
    };
    for pattern in [SamplePattern::Centre, SamplePattern::Corners] {
        assert!(
            errors(&still, Sampling::Pattern(pattern))
                .iter()
                .all(|&e| e == 0.0),
            "{pattern:?}"
        );
        assert!(
            errors(&scene(), Sampling::Pattern(pattern))
                .iter()
                .all(|&e| e == -1.0),
            "{pattern:?} under a lamp"
        );
    }
    for samples in [1, 2, 7] {
        assert!(
            errors(&scene(), Sampling::General(samples))
                .iter()
                .all(|&e| e == -1.0),
            "{samples} samples"
        );
    }
    for samples in [8, 9, 64, 65] {
        let found = errors(&scene(), Sampling::General(samples));
        assert!(
            found.iter().all(|&e| e >= 0.0) && found.iter().any(|&e| e > 0.0),
            "{samples} samples"
        );
    }
}

/// Protects: the film's variance is that of the samples, within and between replicates. For an
/// emissive checker seen from far, whose samples are 0 or 1, it is n·p·(1 − p)/(n − 1) with the
/// picture's mean p.
#[test]
fn m13_the_variance_is_that_of_the_samples() {
    let text = r#"{ "format": 1,
        "cameras": [{ "pose": { "look_at": { "eye": [0, 0, 9], "target": [0, 0, 0] } }, "projection": { "orthographic": { "height": 70 } } }],
        "materials": [{ "name": "m", "model": { "classic": { "local": 0, "emission": { "checker": { "even": 1, "odd": 0 } } } } }],
        "objects": [{ "shape": { "plane": { "point": [0, 0, 0], "normal": [0, 0, 1] } }, "material": "m" }] }"#;
    let scene: Scene =
        serde_json::from_str(text).unwrap_or_else(|e| panic!("the scene is right: {e}"));
    for samples in [2_u16, 6, 64, 250] {
        let settings = Settings {
            size: [11, 7],
            sampling: Sampling::General(u32::from(samples)),
            ..Settings::from_scene(&scene)
        };
        let ready = prepare(&scene, &settings, &()).unwrap_or_else(|e| panic!("{e}"));
        let (film, n) = (rendered(&ready), f64::from(samples));
        for (pixel, colour) in film.picture().rgb.iter().enumerate() {
            let p = (f64::from(colour[0]) * n).round() / n;
            let expected = n * p * (1.0 - p) / (n - 1.0);
            let found = film
                .pixel_variance(pixel as u32 % 11, pixel as u32 / 11)
                .expect("at least two samples")[0];
            assert!(
                (found - expected).abs() <= 1e-6 * expected,
                "{samples} samples: {found} instead of {expected}"
            );
        }
        assert_eq!(film.pixel_variance(11, 0), None);
    }
}

/// Protects: layers come from the picture's own camera rays. Surfaces that emit the layer's values,
/// under a black sky, make a picture equal to the layer, for any samples and lens, and no
/// additional ray is traced. Only the pixel-centre layers take one ray per pixel, which is counted.
#[test]
fn layers_show_what_the_camera_rays_of_the_picture_hit() {
    let mut scene = scene();
    scene
        .objects
        .retain(|object| object.material == "floor" || object.material == "lamp");
    scene.materials.truncate(2);
    for (material, colour) in scene
        .materials
        .iter_mut()
        .zip(["[0.5, 0.25, 1]", "[1, 0.5, 0.125]"])
    {
        let text = format!(
            r#"{{ "classic": {{ "local": 0, "colour": {colour}, "emission": {colour} }} }}"#
        );
        material.model = serde_json::from_str(&text).unwrap_or_else(|e| panic!("{e}"));
    }
    for sampling in [
        Sampling::General(7),
        Sampling::Pattern(SamplePattern::Centre),
        Sampling::Pattern(SamplePattern::Corners),
    ] {
        let with = |aovs| {
            render(
                &scene,
                &Settings {
                    sampling,
                    aovs,
                    ..settings(7)
                },
            )
        };
        let (bare, shown) = (with(Vec::new()), with(vec![Aov::Albedo]));
        assert_eq!(bare.counters, shown.counters, "{sampling:?}");
        for (i, name) in ["albedo.R", "albedo.G", "albedo.B"].into_iter().enumerate() {
            let colour: Vec<f32> = shown.picture.rgb.iter().map(|pixel| pixel[i]).collect();
            let close = colour
                .iter()
                .zip(&shown.picture.layer(name).expect("asked for").samples)
                .all(|(a, b)| (a - b).abs() < 1e-6);
            assert!(close, "{sampling:?}: {name} is not the picture");
            assert!(colour.iter().any(|&c| c > 0.0) && colour.contains(&0.0));
        }
        let centres = with(vec![Aov::Depth, Aov::Object]);
        assert_eq!(
            centres.counters.camera,
            bare.counters.camera + 77,
            "{sampling:?}"
        );
    }
}

/// Protects: layers show the first hit, not its reflection or the view through it.
#[test]
fn layers_do_not_depend_on_how_far_paths_go() {
    let aovs = vec![Aov::Albedo, Aov::Normal, Aov::Position];
    let with = |max_depth| {
        render(
            &scene(),
            &Settings {
                max_depth,
                aovs: aovs.clone(),
                ..settings(7)
            },
        )
    };
    let (short, long) = (with(1), with(8));
    assert!(
        short.counters.refraction == 0
            && long.counters.refraction > 0
            && short.picture.rgb != long.picture.rgb
    );
    assert!(short.picture.layers == long.picture.layers);
}

/// Protects: the memory estimate equals the memory that film and picture take in the end.
#[test]
fn memory_estimate_equals_allocation() {
    let check = |settings: &Settings, expected: Option<u64>| {
        let ready = ready(settings);
        let film: Film = rendered(&ready);
        let picture = film.picture();
        let pixels = picture.pixel_count() as u64;
        let layers = picture.layers.len() as u64 + u64::from(picture.alpha.is_some());
        let denoised = if settings.denoise {
            crate::denoise::requirements::BYTES_A_PIXEL
        } else {
            0
        };
        assert_eq!(
            ready.memory().film,
            film.bytes() + pixels * (12 + 4 * layers + denoised),
            "{settings:?}"
        );
        assert!(
            expected.is_none_or(|a_pixel| ready.memory().film == a_pixel * pixels),
            "{} bytes",
            ready.memory().film
        );
    };
    check(&settings(64), Some(128));
    check(
        &Settings {
            denoise: true,
            replicates: None,
            ..settings(16)
        },
        None,
    );
    check(&settings(1), None);
    check(
        &Settings {
            aovs: layers(),
            background: Background::Transparent,
            ..settings(6)
        },
        None,
    );
    check(
        &Settings {
            aovs: vec![Aov::Position],
            replicates: Some(8),
            ..settings(64)
        },
        None,
    );
    check(
        &Settings {
            sampling: Sampling::Pattern(SamplePattern::Corners),
            aovs: vec![Aov::Albedo, Aov::Depth],
            ..settings(4)
        },
        None,
    );
}

/// Protects: the emission layer equals a path-traced picture of camera rays alone, also through
/// sheets of partial coverage. With a clamp and a veil it is still a part of the colour. Under
/// Whitted's integrator it shows lamp and sky, and no lit surface.
#[test]
fn emission_is_what_camera_rays_see() {
    let channel = |rendered: &RenderOutput, i: usize| {
        rendered
            .picture
            .layer(["emission.R", "emission.G", "emission.B"][i])
            .expect("asked for")
            .samples
            .clone()
    };
    let mut scene = scene();
    scene.sky = Some(crate::scene::Sky::Constant(crate::scene::Colour([
        0.1, 0.2, 0.3,
    ])));
    let with = |settings: Settings| {
        render(
            &scene,
            &Settings {
                aovs: vec![Aov::Emission],
                ..settings
            },
        )
    };
    let paths = |max_depth| Settings {
        max_depth,
        integrator: Integrator::Path,
        ..settings(20)
    };
    let (alone, all) = (with(paths(1)), with(paths(8)));
    for i in 0..3 {
        let lit = all
            .picture
            .rgb
            .iter()
            .zip(channel(&all, i))
            .filter(|(rgb, of)| rgb[i] > 1.1 * of)
            .count();
        assert!(lit > 20, "most pixels are lit");
        for (rgb, of) in alone.picture.rgb.iter().zip(channel(&all, i)) {
            assert!((rgb[i] - of).abs() <= 1e-6 * of, "{} and {of}", rgb[i]);
        }
    }
    scene.render.veil = crate::scene::Colour([0.05; 3]);
    let with = |settings: Settings| {
        render(
            &scene,
            &Settings {
                aovs: vec![Aov::Emission],
                ..settings
            },
        )
    };
    for found in [
        with(Settings {
            clamp: Some(0.5),
            ..paths(8)
        }),
        with(Settings {
            integrator: Integrator::Whitted,
            ..settings(20)
        }),
    ] {
        for (k, (rgb, of)) in found.picture.rgb.iter().zip(channel(&found, 0)).enumerate() {
            assert!(
                of >= 0.05 - 1e-6 && of <= rgb[0] + 1e-6,
                "pixel {k}: {of} of {}",
                rgb[0]
            );
        }
    }
    let whitted = with(Settings {
        integrator: Integrator::Whitted,
        ..settings(20)
    });
    let seen = channel(&whitted, 0);
    assert!(
        seen.iter().any(|&of| of > 0.1) && seen.contains(&0.05),
        "sky, and floor without a lamp: {seen:?}"
    );
}

/// Protects: a picture to be denoised takes the same samples from 64 on, in four replicates from
/// eight on, and shows no layer that was not requested.
#[test]
fn denoising_is_asked_of_the_same_picture() {
    let with = |samples, denoise| {
        let settings = Settings {
            denoise,
            replicates: None,
            aovs: vec![Aov::Depth],
            ..settings(samples)
        };
        (
            render(&scene(), &settings).picture,
            ready(&settings).new_film("").full_part().replicates.end,
        )
    };
    let ((plain, four), (denoised, also)) = (with(64, false), with(64, true));
    assert_eq!((plain, four), (denoised, also));
    assert_eq!([7, 8, 16].map(|samples| with(samples, true).1), [1, 4, 4]);
    assert_eq!(with(16, true).0.layers.len(), 1);
}

/// A half-transparent mirror sheet in the plane of a lamp that emits to both sides, between a floor
/// and a ceiling that mirror each other in it. `floor` and `ceiling` are their colours, `sheet` is
/// the sheet's material.
fn between_mirrored_rooms(floor: f64, ceiling: f64, sheet: &str) -> Scene {
    let text = format!(
        r#"{{ "format": 1,
        "cameras": [{{ "pose": {{ "look_at": {{ "eye": [0, 1, 3], "target": [0, 0, 0] }} }}, "projection": {{ "pinhole": {{ "vertical_fov": 20 }} }} }}],
        "materials": [{{ "name": "floor", "model": {{ "classic": {{ "colour": {floor} }} }} }},
                      {{ "name": "ceiling", "model": {{ "classic": {{ "colour": {ceiling} }} }} }},
                      {{ "name": "lamp", "model": {{ "classic": {{ "local": 0, "emission": 9 }} }} }},
                      {{ "name": "sheet", "model": {{ "physical": {sheet} }} }}],
        "objects": [{{ "shape": {{ "plane": {{ "point": [0, -2, 0], "normal": [0, 1, 0] }} }}, "material": "floor" }},
                    {{ "shape": {{ "plane": {{ "point": [0, 2, 0], "normal": [0, -1, 0] }} }}, "material": "ceiling" }},
                    {{ "shape": {{ "disk": {{ "centre": [0, 0, -7], "normal": [0, 1, 0], "radius": 1 }} }}, "material": "lamp" }},
                    {{ "shape": {{ "quad": {{ "corner": [-2, 0, 2], "edge_u": [4, 0, 0], "edge_v": [0, 0, -4] }} }}, "material": "sheet" }}] }}"#
    );
    serde_json::from_str(&text).unwrap_or_else(|e| panic!("the scene is right: {e}"))
}

fn one_sample(scene: &Scene) -> Vec<[f32; 3]> {
    render(
        scene,
        &Settings {
            size: [16, 8],
            sampling: Sampling::General(1),
            integrator: Integrator::Whitted,
            ..Settings::from_scene(scene)
        },
    )
    .picture
    .rgb
}

/// Protects: two branches of one path share no random numbers. Seen in the mirror and through the
/// sheet, floor and ceiling coincide, so with shared numbers both would be lit from the same points
/// of the lamp and be equal in every pixel.
#[test]
fn branches_of_a_path_draw_different_numbers() {
    let sheet = r#"{ "alpha": "blend", "opacity": 0.5, "metallic": 1, "roughness": 0 }"#;
    let below = one_sample(&between_mirrored_rooms(1.0, 0.0, sheet));
    let above = one_sample(&between_mirrored_rooms(0.0, 1.0, sheet));
    let pairs: Vec<(f32, f32)> = below
        .iter()
        .zip(&above)
        .map(|(a, b)| (a[0], b[0]))
        .filter(|(a, b)| *a > 0.0 && *b > 0.0)
        .collect();
    assert!(pairs.len() > 60, "{} of 128 pixels show both", pairs.len());
    let alike = pairs
        .iter()
        .filter(|(a, b)| (a / b - 1.0).abs() < 1e-3)
        .count();
    assert!(
        alike < 12,
        "{alike} of {} pixels are lit alike from both sides",
        pairs.len()
    );
    // The means are equal, so that the pixels above could have been equal.
    let (a, b) = pairs.iter().fold((0.0, 0.0), |(a, b), pair| {
        (a + f64::from(pair.0), b + f64::from(pair.1))
    });
    assert!((a / b - 1.0).abs() < 0.1, "{a} and {b}");
}

/// Protects: random numbers of one branch shift none elsewhere. A black floor that samples the
/// lamp, seen through a half-transparent sheet, reflects nothing; the sheet is lit from the same
/// points of the lamp whether or not the floor samples it, or exists.
#[test]
fn further_draws_shift_no_others() {
    let sheet = r#"{ "alpha": "blend", "opacity": 0.5, "metallic": 0, "roughness": 1 }"#;
    let mut asking = between_mirrored_rooms(0.0, 0.0, sheet);
    // Above the sheet, so that it is lit.
    asking.objects[2].shape = serde_json::from_str(
        r#"{ "disk": { "centre": [0, 1.5, 0], "normal": [0, 1, 0], "radius": 1 } }"#,
    )
    .expect("a disk");
    let mut silent = asking.clone();
    silent.materials[0].model =
        serde_json::from_str(r#"{ "classic": { "local": 0 } }"#).expect("a material");
    let mut absent = asking.clone();
    absent.objects.remove(0);
    let pictures = [asking, silent, absent].map(|scene| one_sample(&scene));
    assert!(pictures[0].iter().filter(|pixel| pixel[0] > 0.0).count() > 100);
    assert!(pictures[0] == pictures[1], "the floor's own draws");
    assert!(pictures[0] == pictures[2], "the floor itself");
}
