//! Models of Khronos' asset generator, compared with its own pictures.
//!
//! Those come from a rasteriser in an unknown studio, so that shades are not compared. Three
//! measures are: *coverage*, the shares of pixels where both show the model and where both show the
//! studio behind it (visibility, culling, alpha, topology, transforms); *pattern*, the correlation
//! of the colours on the model (images, their wrapping, sets and transforms, vertex colours);
//! *tint*, the distance of the mean chromaticities (factors, emission). The studio is reconstructed
//! from the pictures, which show it wherever no model is. For models that reflect or transmit it,
//! only coverage is compared.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use raywright::core::Scene;
use raywright::core::display::curve::decode_transfer;
use raywright::core::picture::Picture;
use raywright::core::scene::TransferCurve;
use raywright::io::{EnvironmentOptions, EnvironmentSource, Input, LoadOptions, load};
use serde_json::Value;

use super::{looking, picture};
use crate::support::shared;

/// Pixels per side: the samples have four times as many.
const SIZE: usize = 100;
/// Vertical field of view of the pictures, 0.8 radians: a sheet of one metre is 364 of 400 pixels
/// wide from 1.3 metres.
const FIELD_OF_VIEW: f64 = 45.837;

/// A model with both pictures.
struct PicturePair {
    name: String,
    camera: String,
    ours: Picture,
    /// Linear, by pixel.
    theirs: Vec<[f32; 3]>,
}

/// Models with a sample picture, from the manifest.
fn pairs(folder: &Path) -> Vec<PicturePair> {
    let text = std::fs::read(folder.join("Manifest.json")).expect("a manifest");
    let groups: Vec<Value> = serde_json::from_slice(&text).expect("JSON");
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    let mut pairs = Vec::new();
    for group in &groups {
        for model in group["models"].as_array().into_iter().flatten() {
            let here = folder.join(text(&group["folder"]));
            let file: PathBuf = here.join(text(&model["fileName"]));
            let sample = text(&model["sampleImageName"]);
            let sample = here
                .join("SampleImages")
                .join(sample.rsplit('/').next().unwrap_or_default());
            if !(file.is_file() && sample.is_file()) {
                continue;
            }
            let eye: [f64; 3] =
                serde_json::from_value(model["camera"]["translation"].clone()).expect("a camera");
            let view = looking(eye, [0.0; 3], FIELD_OF_VIEW);
            let ours = picture(&evenly_lit(&file), Some(view), [SIZE as u32; 2], 16);
            let name = text(&model["fileName"]).replace(".gltf", "");
            pairs.push(PicturePair {
                name,
                camera: format!("{eye:?}"),
                ours,
                theirs: sampled(&sample),
            });
        }
    }
    pairs
}

/// A model's scene under the neutral sky, whose shading differs least from the samples'.
fn evenly_lit(path: &Path) -> Scene {
    let environment = EnvironmentOptions {
        source: Some(EnvironmentSource::Default),
        ..EnvironmentOptions::default()
    };
    let options = LoadOptions {
        environment,
        ..LoadOptions::default()
    };
    load(&Input::Path(path.to_owned()), &options)
        .unwrap_or_else(|e| panic!("{e}"))
        .scene
}

/// Loads a sample in linear light at the size of the test.
fn sampled(path: &Path) -> Vec<[f32; 3]> {
    let image = image::open(path).expect("a sample").into_rgb8();
    assert_eq!(
        image.dimensions(),
        (4 * SIZE as u32, 4 * SIZE as u32),
        "{}",
        path.display()
    );
    let linear = |code: u8| decode_transfer(TransferCurve::Srgb, f64::from(code) / 255.0) as f32;
    let block = |i: usize| {
        let (x, y) = (4 * (i % SIZE) as u32, 4 * (i / SIZE) as u32);
        let mut sum = [0.0_f32; 3];
        for (dx, dy) in (0..16).map(|k| (k % 4, k / 4)) {
            let texel = image.get_pixel(x + dx, y + dy).0;
            (0..3).for_each(|c| sum[c] += linear(texel[c]) / 16.0);
        }
        sum
    };
    (0..SIZE * SIZE).map(block).collect()
}

/// Approximate display values of linear light, so that differences count as visible.
fn seen(pixel: [f32; 3]) -> [f32; 3] {
    pixel.map(|x| x.clamp(0.0, 1.0).sqrt())
}

/// The studio for each camera, where some sample shows it: the median of those samples.
fn studio_colours<'a>(pairs: impl Iterator<Item = &'a PicturePair>) -> Vec<Option<[f32; 3]>> {
    let pairs: Vec<&PicturePair> = pairs.collect();
    let bare = |pair: &PicturePair, i: usize| around(i).all(|j| alpha(&pair.ours, j) == 0.0);
    let pixel = |i: usize| {
        let shown: Vec<[f32; 3]> = pairs
            .iter()
            .filter(|pair| bare(pair, i))
            .map(|pair| seen(pair.theirs[i]))
            .collect();
        let median = |c: usize| {
            let mut list: Vec<f32> = shown.iter().map(|p| p[c]).collect();
            list.sort_by(f32::total_cmp);
            list.get(list.len() / 2).copied()
        };
        Some([median(0)?, median(1)?, median(2)?])
    };
    (0..SIZE * SIZE).map(pixel).collect()
}

fn alpha(picture: &Picture, i: usize) -> f32 {
    picture.alpha.as_ref().map_or(1.0, |alpha| alpha[i])
}

/// A pixel and its neighbours.
fn around(i: usize) -> impl Iterator<Item = usize> {
    let (x, y) = ((i % SIZE) as isize, (i / SIZE) as isize);
    let inside = |v: isize| (0..SIZE as isize).contains(&v);
    let all = (-1..=1).flat_map(move |dy| (-1..=1).map(move |dx| (x + dx, y + dy)));
    all.filter(move |&(x, y)| inside(x) && inside(y))
        .map(|(x, y)| y as usize * SIZE + x as usize)
}

/// Agreement of two pictures; `None` where no pixels are comparable.
#[derive(Clone, Copy, Debug)]
struct Agreement {
    /// Share of the pixels without the model where the sample shows the studio.
    bare: f64,
    /// Share of the pixels with the model where the sample does not show the studio; a model as
    /// grey as the wall looks like it.
    shown: f64,
    pattern: Option<f64>,
    tint: Option<f64>,
}

fn agreement(pair: &PicturePair, ours: &Picture, studio: &[Option<[f32; 3]>]) -> Agreement {
    let theirs = &pair.theirs;
    let differs =
        |i: usize, back: [f32; 3]| (0..3).any(|c| (seen(theirs[i])[c] - back[c]).abs() > 0.08);
    // Programs differ at edges.
    let share = |ours_shows: &dyn Fn(usize) -> bool, expected: bool| {
        let places = (0..SIZE * SIZE).filter(|&i| around(i).all(ours_shows));
        let told: Vec<bool> = places
            .filter_map(|i| Some(differs(i, studio[i]?) == expected))
            .collect();
        if told.is_empty() {
            1.0
        } else {
            told.iter().filter(|told| **told).count() as f64 / told.len() as f64
        }
    };
    // The assets' images have lost the colours of transparent texels; opaque materials show these
    // black.
    let lost = |i: usize| ours.rgb[i].iter().all(|x| *x < 0.01);
    let inside = (0..SIZE * SIZE).filter(|&i| around(i).all(|j| alpha(ours, j) > 0.99 && !lost(j)));
    let inside: Vec<usize> = if reflects(&pair.name) {
        Vec::new()
    } else {
        inside.collect()
    };
    let enough = inside.len() > 100;
    Agreement {
        bare: share(&|j| alpha(ours, j) == 0.0, false),
        shown: if veils(&pair.name) {
            1.0
        } else {
            share(&|j| alpha(ours, j) > 0.99, true)
        },
        pattern: if enough {
            correlation(&inside, &ours.rgb, theirs)
        } else {
            None
        },
        tint: enough.then(|| tint(&inside, &ours.rgb, theirs)),
    }
}

/// Whether the studio is visible through a model.
fn veils(name: &str) -> bool {
    name.starts_with("Material_AlphaBlend")
}

/// Whether a model's colours are those of the studio: metals, and transparent models.
fn reflects(name: &str) -> bool {
    veils(name)
        || ["04", "06"]
            .iter()
            .any(|n| *name == format!("Material_MetallicRoughness_{n}"))
}

/// Correlation over the channels of both pictures at some pixels; `None` if the test's picture has
/// almost no pattern.
fn correlation(places: &[usize], ours: &[[f32; 3]], theirs: &[[f32; 3]]) -> Option<f64> {
    let (mut ab, mut aa, mut bb) = (0.0, 0.0, 0.0);
    for c in 0..3 {
        let values = |list: &[[f32; 3]]| {
            places
                .iter()
                .map(|&i| f64::from(seen(list[i])[c]))
                .collect::<Vec<_>>()
        };
        let (a, b) = (values(ours), values(theirs));
        let mean = |list: &[f64]| list.iter().sum::<f64>() / list.len() as f64;
        let (ma, mb) = (mean(&a), mean(&b));
        for (x, y) in a.iter().zip(&b) {
            (ab, aa, bb) = (
                ab + (x - ma) * (y - mb),
                aa + (x - ma).powi(2),
                bb + (y - mb).powi(2),
            );
        }
    }
    let spread = (aa / (3 * places.len()) as f64).sqrt();
    (spread > 0.03).then(|| ab / (aa * bb).sqrt().max(1e-12))
}

/// Distance of the mean chromaticities, in shares of red, green and blue.
fn tint(places: &[usize], ours: &[[f32; 3]], theirs: &[[f32; 3]]) -> f64 {
    let shares = |list: &[[f32; 3]]| {
        let sum = places.iter().fold([0.0; 3], |sum, &i| {
            core::array::from_fn(|c| sum[c] + f64::from(list[i][c]))
        });
        let whole: f64 = sum.iter().sum();
        sum.map(|x| x / whole.max(1e-12))
    };
    let (a, b) = (shares(ours), shares(theirs));
    (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f64::max)
}

fn mirrored(picture: &Picture) -> Picture {
    let flip = |i: usize| i / SIZE * SIZE + (SIZE - 1 - i % SIZE);
    let rgb = (0..SIZE * SIZE).map(|i| picture.rgb[flip(i)]).collect();
    let alpha = picture
        .alpha
        .as_ref()
        .map(|alpha| (0..SIZE * SIZE).map(|i| alpha[flip(i)]).collect());
    Picture {
        rgb,
        alpha,
        ..picture.clone()
    }
}

/// Protects: each model of the asset generator agrees with its sample as far as they are
/// comparable; as a check of the measure, the mirrored picture of a patterned model fails.
#[test]
fn generated_models_look_like_their_samples() {
    let Some(folder) = shared("assets/gltf/AssetGenerator") else {
        return;
    };
    let pairs = pairs(&folder);
    let mut studios = BTreeMap::new();
    for pair in &pairs {
        studios.entry(&pair.camera).or_insert_with(|| {
            studio_colours(pairs.iter().filter(|other| other.camera == pair.camera))
        });
    }
    let (mut wrong, mut told) = (Vec::new(), 0);
    for pair in &pairs {
        let studio = &studios[&pair.camera];
        let as_is = agreement(pair, &pair.ours, studio);
        let flipped = agreement(pair, &mirrored(&pair.ours), studio);
        let text = |value: Option<f64>| value.map_or("-".to_owned(), |x| format!("{x:.3}"));
        eprintln!(
            "{:30} bare {:.3} shown {:.3} pattern {:>6} (mirrored {:>6}) tint {:>5}",
            pair.name,
            as_is.bare,
            as_is.shown,
            text(as_is.pattern),
            text(flipped.pattern),
            text(as_is.tint)
        );
        if !fits(&as_is) {
            wrong.push(&pair.name);
        }
        told += u32::from(as_is.pattern.is_some() && !fits(&flipped));
    }
    assert!(wrong.is_empty(), "{wrong:?}");
    let patterned = pairs.len();
    assert!(
        told > 20,
        "the measure tells {told} of {patterned} from their mirror images"
    );
}

fn fits(agreement: &Agreement) -> bool {
    let Agreement {
        bare,
        shown,
        pattern,
        tint,
    } = *agreement;
    // The samples have palettes of at most 256 colours, which shifts some of the studio's colours,
    // and tints.
    bare > 0.92 && shown > 0.75 && pattern.is_none_or(|x| x > 0.8) && tint.is_none_or(|x| x < 0.12)
}
