//! Denoised pictures: the same bits for every kind of run, an error estimate of their own, and
//! clear errors where denoising is impossible.

use serde_json::Value;

use super::films::{bits, merge, render, same_bits, sandbox};
use crate::support::Sandbox;

/// Names of a picture's layers.
fn layers(sandbox: &Sandbox, name: &str) -> Vec<String> {
    sandbox
        .picture(name)
        .layers
        .into_iter()
        .map(|layer| layer.name)
        .collect()
}

/// Protects: a denoised picture has the same bits from a single run, with other threads, resumed,
/// from merged parts, and from a film afterwards. PNG shows it; EXR keeps the bits of the noisy
/// picture and gains layers.
#[test]
fn denoised_pictures_have_the_bits_of_one_run() {
    let sandbox = sandbox();
    render(
        &sandbox,
        "--spp 16 --denoise -o once.png -o once.exr --checkpoint once.film",
    )
    .exits_with(0)
    .prints_like("denoised (biased), error ")
    .prints_like("(70x50, 16 samples, denoised");
    render(&sandbox, "--spp 16 --denoise --threads 1 -o single.exr").exits_with(0);
    same_bits(&sandbox, "single.exr", "once.exr");
    render(
        &sandbox,
        "--spp 8 --denoise -o few.exr --checkpoint few.film",
    )
    .exits_with(0);
    render(&sandbox, "--spp 16 --denoise -o more.exr --resume few.film").exits_with(0);
    same_bits(&sandbox, "more.exr", "once.exr");
    for k in 1..=2 {
        render(
            &sandbox,
            &format!("--spp 16 --denoise --part {k}/2 --checkpoint {k}.film"),
        )
        .exits_with(0);
    }
    merge(&sandbox, "2.film 1.film -o merged.exr -o merged.png")
        .exits_with(0)
        .prints_like("denoised (biased)");
    same_bits(&sandbox, "merged.exr", "once.exr");
    sandbox
        .run(&["denoise", "once.film", "-o", "after.exr", "-o", "after.png"])
        .exits_with(0)
        .prints_like("wrote after.exr, after.png (denoised");
    for name in ["after", "merged"] {
        same_bits(&sandbox, &format!("{name}.exr"), "once.exr");
        same_bits(&sandbox, &format!("{name}.png"), "once.png");
    }
    let names = [
        "denoised.B",
        "denoised.G",
        "denoised.R",
        "denoised.stderr.B",
        "denoised.stderr.G",
        "denoised.stderr.R",
    ];
    let mut found = layers(&sandbox, "once.exr");
    found.sort();
    assert_eq!(found, names);
    // From 64 samples on, a picture has the same replicates with and without denoising.
    render(&sandbox, "--spp 64 --denoise -o dear.exr -o dear.png").exits_with(0);
    render(&sandbox, "--spp 64 -o plain.exr -o plain.png").exits_with(0);
    assert_eq!(
        bits(&sandbox.picture("dear.exr"))[0],
        bits(&sandbox.picture("plain.exr"))[0]
    );
    assert_ne!(
        bits(&sandbox.picture("dear.png")),
        bits(&sandbox.picture("plain.png"))
    );
}

/// Protects: the error of a denoised picture is in the statistics under the names of the noisy
/// one's, and `--max-error` applies to it.
#[test]
fn denoised_pictures_have_a_claim_of_their_own() {
    let sandbox = sandbox();
    let stats = |words: &str| -> Value {
        render(&sandbox, &format!("{words} -o a.png --stats a.json")).exits_with(0);
        serde_json::from_slice(&std::fs::read(sandbox.path("a.json")).expect("statistics"))
            .expect("JSON")
    };
    let printed = stats("--spp 64 --denoise");
    let (error, denoised) = (&printed["error"], &printed["denoised"]);
    for key in error.as_object().expect("an error").keys() {
        assert!(denoised.get(key).is_some(), "{key}: {denoised}");
    }
    assert!(
        denoised["root_relmse"]["value"].as_f64() < error["root_relmse"]["value"].as_f64(),
        "{printed}"
    );
    assert!(
        denoised["brightened"]
            .as_f64()
            .is_some_and(|light| light.abs() < 0.1),
        "{printed}"
    );
    let samples = |words: &str| stats(words)["samples"].as_u64().expect("samples");
    let (plain, fewer) = (
        samples("--max-error 0.4 --spp 4096"),
        samples("--max-error 0.4 --spp 4096 --denoise"),
    );
    assert!(fewer <= plain, "{fewer} with denoising, {plain} without");
}

/// Protects: a target error that the denoised picture reaches ends the render, although the noisy
/// picture has not reached it.
#[test]
fn denoised_pictures_reach_their_error_first() {
    let sandbox = Sandbox::new();
    let samples = |more: &str| {
        let line = format!(
            "render preset:cornell -s 64x64 --max-error 0.08 -o a.png --stats a.json -q{more}"
        );
        sandbox
            .run(&line.split(' ').collect::<Vec<_>>())
            .exits_with(0);
        let text = std::fs::read(sandbox.path("a.json")).expect("statistics");
        let stats: Value = serde_json::from_slice(&text).expect("JSON");
        stats["samples"].as_u64().expect("samples")
    };
    let (plain, denoised) = (samples(""), samples(" --denoise"));
    assert!(
        denoised < plain,
        "{denoised} with denoising, {plain} without"
    );
}

/// Protects: `denoise` starts no more threads than the machine has processors, with a note.
#[test]
fn denoising_has_a_thread_for_each_processor() {
    let sandbox = sandbox();
    render(&sandbox, "--spp 8 --denoise --checkpoint a.film -o a.png").exits_with(0);
    let line = "denoise a.film --threads 1000 -o b.png";
    sandbox
        .run(&line.split(' ').collect::<Vec<_>>())
        .exits_with(0)
        .prints_like("--threads 1000: the number of threads is ");
}

/// Protects: a crop is denoised as a picture of its own, and uncovered pixels stay transparent and
/// black, with finite values everywhere.
#[test]
fn crops_and_transparent_pictures_are_denoised() {
    let sandbox = sandbox();
    sandbox.write(
        "a.obj",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0.3 0.2 1\nf 1 2 3\nf 1 2 4\nf 1 4 3\nf 2 3 4\n",
    );
    let words = "render a.obj --ground none --background transparent --size 40x30 --spp 16 --denoise -o a.exr -o a.png";
    sandbox
        .run(&words.split(' ').collect::<Vec<_>>())
        .exits_with(0)
        .prints_like("denoised (biased)");
    render(
        &sandbox,
        "--spp 16 --denoise --crop 20,10,33,21 -o crop.exr",
    )
    .exits_with(0)
    .prints_like("(33x21, 16 samples, denoised (biased)");
    for (name, pixels) in [("a.exr", 40 * 30), ("crop.exr", 33 * 21)] {
        let layers: Vec<_> = sandbox
            .picture(name)
            .layers
            .into_iter()
            .filter(|layer| layer.name.starts_with("denoised"))
            .collect();
        assert!(
            layers.iter().all(|layer| layer.samples.len() == pixels
                && layer.samples.iter().all(|x| x.is_finite())),
            "{name}"
        );
        assert_eq!(layers.len(), 6, "{name}");
    }
    let image = image::open(sandbox.path("a.png"))
        .expect("a picture")
        .into_rgba8();
    assert_eq!(
        (image.get_pixel(0, 0).0, image.get_pixel(20, 15).0[3]),
        ([0; 4], 255)
    );
}

/// Protects: a picture stays noisy, to the bit, where denoising would add error: here by one bright
/// sample of a small lamp, which the filter would spread.
#[test]
fn harmful_denoising_is_left_out() {
    let (sandbox, folder) = (sandbox(), env!("CARGO_MANIFEST_DIR"));
    let words = format!(
        "render {folder}/benches/calibration/small-lamp.scene.toml --integrator path --size 96x64 --spp 8"
    );
    let run = |flags: &str| {
        let words = format!("{words} {flags}");
        sandbox
            .run(&words.split(' ').collect::<Vec<_>>())
            .exits_with(0);
    };
    run("--seed 2 --denoise -o left.png");
    run("--seed 2 -o noisy.png");
    same_bits(&sandbox, "left.png", "noisy.png");
    run("--seed 1 --denoise -o denoised.png");
    run("--seed 1 -o other.png");
    let both = ["denoised.png", "other.png"].map(|name| bits(&sandbox.picture(name)));
    assert_ne!(both[0], both[1]);
}

/// Protects: the path-traced picture of a model is denoised, with 16 samples unless flags say how
/// many. It keeps its noise and its 64 samples on request, by Whitted's integrator, and where
/// samples are kept: in EXR files, layers and films. Too few samples stay noisy. Scene files stay as
/// they are, also with models in them.
#[test]
fn models_are_denoised_by_default() {
    let sandbox = sandbox();
    sandbox.write(
        "a.obj",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0.3 0.2 1\nf 1 2 3\nf 1 2 4\nf 1 4 3\nf 2 3 4\n",
    );
    sandbox.write(
        "of.scene.toml",
        "format = 1\n[[models]]\nfile = \"a.obj\"\n",
    );
    let run = |words: &str| {
        let words = format!("render {words} --size 40x30 --ground none");
        sandbox.run(&words.split(' ').collect::<Vec<_>>())
    };
    let [denoised, noisy] = [
        "(40x30, 16 samples, denoised",
        "(40x30, 64 samples, error 0.",
    ];
    for (words, expected) in [
        ("a.obj -o by-default.png", denoised),
        ("a.obj --no-denoise --denoise -o on-request.png", denoised),
        ("a.obj --spp 32 -o b.png", "(40x30, 32 samples, denoised"),
        ("a.obj --rung samples=16 -o b.png", denoised),
        ("a.obj --max-error 1 -o b.png", "denoised"),
        ("a.obj --denoise --no-denoise -o noisy.png", noisy),
        ("a.obj --rung reconstruction=unbiased -o b.png", noisy),
        ("a.obj --checkpoint a.film -o b.png", noisy),
        ("a.obj --aov normal -o b.exr", noisy),
        ("a.obj -o kept.png -o kept.exr", noisy),
        (
            "a.obj --integrator whitted -o b.png",
            "(40x30, 64 samples, ",
        ),
        ("a.obj --spp 4 -o b.png", "(40x30, 4 samples, "),
        ("of.scene.toml -o b.png", noisy),
    ] {
        let run = run(words);
        run.exits_with(0).prints_like(expected);
        let is_denoised = run.stderr.contains("denoised (biased)");
        assert_eq!(is_denoised, expected.contains("denoised"), "{words}");
    }
    same_bits(&sandbox, "by-default.png", "on-request.png");
    same_bits(&sandbox, "noisy.png", "kept.png");
    run("a.obj --quick --no-denoise").exits_with(2);
}

/// Protects: denoised pictures of either integrator have an error estimate.
#[test]
fn denoised_pictures_by_rays_alone_say_their_error() {
    let words = "render preset:whitted --size 33x21 --spp 16 --denoise -o a.png";
    let sandbox = sandbox();
    sandbox
        .run(&words.split(' ').collect::<Vec<_>>())
        .exits_with(0)
        .prints_like("(33x21, 16 samples, denoised (biased), error ");
}

/// Protects: impossible denoising is refused with a reason, before the render where possible; a
/// quick preview is made without it.
#[test]
fn what_can_not_be_denoised_says_why() {
    let sandbox = sandbox();
    render(&sandbox, "--spp 4 --denoise")
        .exits_with(2)
        .prints_like("--denoise needs at least 8 samples a pixel to estimate the noise");
    render(&sandbox, "--denoise --rung reconstruction=unbiased")
        .exits_with(2)
        .prints_like("--denoise");
    render(&sandbox, "--spp 64 -o a.png --checkpoint plain.film").exits_with(0);
    sandbox
        .run(&["denoise", "plain.film", "-o", "b.png"])
        .exits_with(3)
        .prints_like("plain.film: the film has no layer `emission`")
        .prints_like("--denoise");
    render(
        &sandbox,
        "--spp 32 --aov albedo,normal,emission,depth -o a.exr --checkpoint two.film",
    )
    .exits_with(0);
    sandbox
        .run(&["denoise", "two.film", "-o", "b.png"])
        .exits_with(3)
        .prints_like("fewer than four replicates");
    render(&sandbox, "--spp 16 --denoise -o b.png --resume plain.film")
        .exits_with(3)
        .prints_like("the film belongs to another picture");
    assert!(
        !sandbox.names().iter().any(|name| name == "b.png"),
        "{:?}",
        sandbox.names()
    );
    render(
        &sandbox,
        "--spp 64 --aov albedo,normal,emission,depth -o a.exr --checkpoint four.film",
    )
    .exits_with(0);
    sandbox
        .run(&["denoise", "four.film", "-o", "b.png"])
        .exits_with(0);
    render(
        &sandbox,
        "--rung samples=64,reconstruction=denoised -o c.png",
    )
    .exits_with(0)
    .prints_like("denoised (biased)");
    sandbox.write(
        "calm.scene.toml",
        "format = 1\nsky.constant = 0.5\n[render]\npattern = \"corners\"\nsize = [8, 8]\n",
    );
    sandbox
        .run(&["render", "calm.scene.toml", "--denoise"])
        .exits_with(0)
        .prints_like("no sample of this picture is random");
    sandbox
        .run(&["render", "calm.scene.toml", "--quick"])
        .exits_with(0)
        .prints_like("(4x4, 4 samples");
    sandbox
        .run(&["render", "calm.scene.toml", "--quick", "-s", "9x7"])
        .exits_with(0)
        .prints_like("(9x7, 4 samples");
    sandbox
        .run(&["render", "preset:whitted", "--quick", "-s", "0x7"])
        .exits_with(2);
    sandbox.write(
        "bright.scene.toml",
        std::fs::read_to_string(sandbox.path("room.scene.toml"))
            .expect("a scene")
            .replace("samples = 6", "samples = 40"),
    );
    sandbox
        .run(&["render", "bright.scene.toml", "--quick", "--size", "70x50"])
        .exits_with(0)
        .prints_like("(70x50, 8 samples, denoised");
}
