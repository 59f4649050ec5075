//! Path tracing, compared with converged pictures of the path-traced box and of the rows of
//! refracting balls, whose materials are mixtures.

use std::path::Path;

use raywright::core::Scene;
use raywright::core::picture::Picture;
use raywright::core::settings::{Aov, Sampling};
use serde_json::{Value, json};

use super::{keep, read, render_scene};
use crate::support::shared;

/// Loads the scene of a folder: the documented one with every constant, and camera rays equal to
/// the reference's.
fn scene(folder: &Path, published: bool) -> Scene {
    let text = std::fs::read_to_string(folder.join("scene.json")).expect("a scene");
    let data: Value = serde_json::from_str(&text).expect("JSON");
    let number = |value: &Value| value.as_f64().expect("a number");
    let triple = |value: &Value| [0, 1, 2].map(|k| number(&value[k]));
    let (mut materials, mut objects) = (Vec::new(), Vec::new());
    for object in data["objects"].as_array().expect("objects") {
        let m = &object["material"];
        let name = object["name"].as_str().expect("a name");
        let mut mixture = json!({ "specular_chance": m["specularChance"], "specular_colour": m["specularColor"],
            "specular_roughness": m["specularRoughness"] });
        if !m["IOR"].is_null() {
            mixture["ior"] = m["IOR"].clone();
            mixture["refraction_chance"] = m["refractionChance"].clone();
            mixture["refraction_roughness"] = m["refractionRoughness"].clone();
            mixture["absorption"] = m["refractionColor"].clone();
            mixture["published_roulette"] = published.into();
        }
        let stripes = json!({ "expression": "floor(2*fract(p.x))" });
        let colour = if m["albedo_pattern"].is_null() {
            m["albedo"].clone()
        } else {
            stripes["expression"].clone()
        };
        let mut terms = json!({ "colour": colour, "mixture": mixture });
        if m["emissive"] != json!([0, 0, 0]) {
            terms["emission"] = m["emissive"].clone();
        }
        materials.push(json!({ "name": name, "model": { "classic": terms } }));
        let shape = if object["type"] == "sphere" {
            json!({ "sphere": { "centre": object["center"], "radius": object["radius"] } })
        } else {
            let [a, b, d] = [0, 1, 3].map(|k| triple(&object["corners"][k]));
            let edge = |end: [f64; 3]| [0, 1, 2].map(|k| end[k] - a[k]);
            json!({ "quad": { "corner": a, "edge_u": edge(b), "edge_v": edge(d) } })
        };
        objects.push(json!({ "name": name, "shape": shape, "material": name }));
    }
    let camera = &data["camera"];
    let eye = triple(&camera["position"]);
    let back = triple(&camera["forward"]).map(|x| -x);
    serde_json::from_value(json!({
        "format": 1,
        "render": { "size": data["resolution"], "max_depth": data["max_segments"], "integrator": "path" },
        "classic": { "spawn": { "constant": { "offset": data["normal_nudge"], "camera_min": data["min_hit_distance"],
            "secondary_min": data["min_hit_distance"] } } },
        "cameras": [{ "pose": { "axes": { "eye": eye, "right": camera["right"], "up": camera["up"], "back": back } },
            "projection": { "pinhole": { "horizontal_fov": camera["horizontal_fov_degrees"] } } }],
        "sky": { "gradient": { "bottom": data["sky"]["bottom"], "top": data["sky"]["top"] } },
        "materials": materials,
        "objects": objects,
    }))
    .expect("a scene")
}

/// Means over blocks of 8×8 pixels, smaller at the edges, and the standard errors of these means.
fn blocks(samples: impl Fn(usize) -> (f64, f64), [width, height]: [usize; 2]) -> Vec<(f64, f64)> {
    let mut found = Vec::new();
    for y in (0..height).step_by(8) {
        for x in (0..width).step_by(8) {
            let (mut sum, mut variance, mut n) = (0.0, 0.0, 0.0);
            for pixel in (y..(y + 8).min(height))
                .flat_map(|y| (x..(x + 8).min(width)).map(move |x| y * width + x))
            {
                let (value, error) = samples(pixel);
                (sum, variance, n) = (sum + value, variance + error * error, n + 1.0);
            }
            found.push((sum / n, variance.sqrt() / n));
        }
    }
    found
}

/// Compares a picture with one of a folder: 99 % of the blocks within four standard errors of both
/// together, and the mean within 0.5 %.
#[track_caller]
fn hold(folder: &str, file: &str, errors: &str, published: bool) {
    let Some(all) = shared("reference/path") else {
        return;
    };
    let path = all.join(folder);
    let ours = render_scene(&scene(&path, published), |s| {
        s.sampling = Sampling::General(64);
        s.aovs = vec![Aov::StandardError];
    })
    .picture;
    let (theirs, known) = (read(&path.join(file)), read(&path.join(errors)));
    let size = [ours.width as usize, ours.height as usize];
    let layers = ["stderr.R", "stderr.G", "stderr.B"]
        .map(|name| ours.layer(name).expect("errors").samples.clone());
    let (mut off, mut count) = (0, 0);
    let mut means = [[0.0; 2]; 3];
    for k in 0..3 {
        let value = |picture: &Picture, i: usize| f64::from(picture.rgb[i][k]);
        let own = blocks(|i| (value(&ours, i), f64::from(layers[k][i])), size);
        let other = blocks(|i| (value(&theirs, i), value(&known, i)), size);
        for ((a, sa), (b, sb)) in own.iter().zip(&other) {
            off += usize::from((a - b).abs() > 4.0 * (sa * sa + sb * sb).sqrt());
            count += 1;
        }
        means[k] = [&own, &other]
            .map(|list| list.iter().map(|(mean, _)| mean).sum::<f64>() / list.len() as f64);
    }
    let ratios = means.map(|[a, b]| a / b);
    eprintln!(
        "{folder}/{file}: {off} of {count} blocks beyond four standard errors, means in ratio {ratios:.4?}"
    );
    let sound = off * 100 <= count && ratios.iter().all(|ratio| (ratio - 1.0).abs() <= 0.005);
    if !sound {
        let kept = keep(&format!("path {folder} {file}"), &ours, &theirs);
        panic!(
            "{folder}/{file}: {off} of {count} blocks are off, means in ratio {ratios:.4?}; see {}",
            kept.display()
        );
    }
}

/// Protects: a box of matte walls with glossy balls: light sampling for the matte share of a
/// mixture, no light sampling for rays without density, and the path depth.
#[test]
fn the_glossy_box() {
    hold("part2_glossy", "linear.exr", "stderr.exr", false);
}

/// Protects: selection by Fresnel reflectance, refraction and absorption, as a mixture and with the
/// published Russian roulette.
#[test]
fn absorption() {
    hold(
        "part3_absorption",
        "linear_mixture.exr",
        "stderr_mixture.exr",
        false,
    );
    hold("part3_absorption", "linear.exr", "stderr.exr", true);
}

/// Protects: rough reflection and refraction, as a mixture and with the published roulette.
#[test]
fn rough_refraction() {
    hold(
        "part3_rough_refraction",
        "linear_mixture.exr",
        "stderr_mixture.exr",
        false,
    );
    hold("part3_rough_refraction", "linear.exr", "stderr.exr", true);
}
