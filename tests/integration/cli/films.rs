//! Renders of several runs: checkpointed and resumed, divided and merged, ended by a budget. The
//! result must have the bits of a single run, and no film file may do harm.

use std::fs;
use std::process::Command;

use raywright::core::picture::Picture;

use crate::support::Sandbox;

/// A lamp, a glass ball, a rough floor and a lens: every use of random numbers, in 70 × 50 pixels,
/// which are six tiles.
const SCENE: &str = r#"
format = 1
render = { size = [70, 50], samples = 6 }
sky.constant = 0.2
[[cameras]]
pose.look_at = { eye = [0, 1, 4], target = [0, 0.6, 0] }
projection.thin_lens = { pinhole = { vertical_fov = 50 }, aperture_radius = 0.1, focus_distance = 3 }
[[materials]]
name = "floor"
model.physical = { base_colour = [0.8, 0.6, 0.4], roughness = 0.4 }
[[materials]]
name = "lamp"
model.physical = { base_colour = 0, emission = [9, 8, 7] }
[[materials]]
name = "glass"
model.physical = { transmission = 1, roughness = 0, ior = 1.5 }
[[objects]]
shape.quad = { corner = [-2, 0, 2], edge_u = [4, 0, 0], edge_v = [0, 0, -4] }
material = "floor"
[[objects]]
shape.disk = { centre = [0, 3, 0], normal = [0, -1, 0], radius = 0.7 }
material = "lamp"
[[objects]]
shape.sphere = { centre = [0.5, 0.5, 0], radius = 0.5 }
material = "glass"
"#;

const LAYERS: &str = "--aov=albedo,normal,position,depth,object,samples,stderr";

pub(super) fn sandbox() -> Sandbox {
    let sandbox = Sandbox::new();
    sandbox.write("room.scene.toml", SCENE);
    sandbox
}

/// Renders the scene with these further flags.
pub(super) fn render(sandbox: &Sandbox, words: &str) -> crate::support::ProgramRun {
    let first = [
        "render",
        "room.scene.toml",
        "--integrator",
        "path",
        "--progress=none",
    ];
    sandbox.run(
        &first
            .into_iter()
            .chain(words.split_whitespace())
            .collect::<Vec<&str>>(),
    )
}

pub(super) fn merge(sandbox: &Sandbox, words: &str) -> crate::support::ProgramRun {
    sandbox.run(
        &["merge"]
            .into_iter()
            .chain(words.split_whitespace())
            .collect::<Vec<&str>>(),
    )
}

/// Bits of colours and layers, by name.
pub(super) fn bits(picture: &Picture) -> Vec<(String, Vec<u32>)> {
    let colour = (
        "colour".to_owned(),
        picture.rgb.iter().flatten().map(|x| x.to_bits()).collect(),
    );
    let layer = |layer: &raywright::core::picture::PictureLayer| {
        (
            layer.name.clone(),
            layer
                .samples
                .iter()
                .map(|x| x.to_bits())
                .collect::<Vec<u32>>(),
        )
    };
    let alpha = picture.alpha.iter().map(|alpha| {
        (
            "coverage".to_owned(),
            alpha.iter().map(|x| x.to_bits()).collect(),
        )
    });
    std::iter::once(colour)
        .chain(alpha)
        .chain(picture.layers.iter().map(layer))
        .collect()
}

#[track_caller]
pub(super) fn same_bits(sandbox: &Sandbox, one: &str, other: &str) {
    let (one_bits, other_bits) = (bits(&sandbox.picture(one)), bits(&sandbox.picture(other)));
    assert_eq!(one_bits.len(), other_bits.len());
    for (a, b) in one_bits.iter().zip(&other_bits) {
        assert!(a == b, "{one} and {other} differ in {}", a.0);
    }
}

/// Protects: a render resumed twice, with more samples each time, other threads and another
/// accelerator, has the bits of a single run, layers and errors included; the resumed file may be
/// the checkpoint.
#[test]
fn more_samples_later_have_the_bits_of_one_run() {
    let sandbox = sandbox();
    render(
        &sandbox,
        &format!("--spp 5 {LAYERS} -o few.exr --checkpoint a.film"),
    )
    .exits_with(0)
    .prints_like("wrote few.exr, a.film (70x50, 5 samples");
    render(
        &sandbox,
        &format!("--spp 21 {LAYERS} -o more.exr --resume a.film --checkpoint a.film --threads 1"),
    )
    .exits_with(0);
    render(
        &sandbox,
        &format!("--spp 90 {LAYERS} -o many.exr --resume a.film --accel linear"),
    )
    .exits_with(0);
    render(&sandbox, &format!("--spp 21 {LAYERS} -o more-once.exr")).exits_with(0);
    render(&sandbox, &format!("--spp 90 {LAYERS} -o many-once.exr")).exits_with(0);
    same_bits(&sandbox, "more.exr", "more-once.exr");
    same_bits(&sandbox, "many.exr", "many-once.exr");
    assert_eq!(
        sandbox
            .names()
            .iter()
            .filter(|name| name.starts_with('.'))
            .count(),
        0,
        "{:?}",
        sandbox.names()
    );
}

/// Protects: parts of a picture, each rendered by its own run, merge to the bits of a single run,
/// in any order and in two steps, and so do parts of a crop. A merge displays them with the
/// original or other settings.
#[test]
fn parts_have_the_bits_of_one_run() {
    let sandbox = sandbox();
    let all = format!("--spp 9 --crop 3,2,66,40 --background transparent --exposure 1 {LAYERS}");
    render(&sandbox, &format!("{all} -o once.exr -o once.png")).exits_with(0);
    for k in 1..=4 {
        render(
            &sandbox,
            &format!("{all} --part {k}/4 --checkpoint {k}.film"),
        )
        .exits_with(0);
    }
    merge(
        &sandbox,
        "3.film 1.film 4.film 2.film -o all.exr -o all.png",
    )
    .exits_with(0)
    .prints_like("wrote all.exr, all.png (4 parts");
    same_bits(&sandbox, "all.exr", "once.exr");
    same_bits(&sandbox, "all.png", "once.png");
    merge(&sandbox, "2.film 4.film --checkpoint even.film").exits_with(0);
    merge(&sandbox, "1.film even.film 3.film -o steps.exr").exits_with(0);
    same_bits(&sandbox, "steps.exr", "once.exr");
    // The union of parts can be resumed by a single run.
    merge(&sandbox, "1.film 3.film even.film --checkpoint whole.film").exits_with(0);
    render(
        &sandbox,
        &format!(
            "{} -o more.exr --resume whole.film",
            all.replace("--spp 9", "--spp 20")
        ),
    )
    .exits_with(0);
    render(
        &sandbox,
        &format!("{} -o more-once.exr", all.replace("--spp 9", "--spp 20")),
    )
    .exits_with(0);
    same_bits(&sandbox, "more.exr", "more-once.exr");
    merge(&sandbox, "whole.film -o dark.png --exposure -3").exits_with(0);
    let sum = |name: &str| sandbox.picture(name).rgb.iter().flatten().sum::<f32>();
    assert!(sum("dark.png") < 0.5 * sum("once.png"));
}

/// Protects: a missing part, a duplicate, a part of another picture and a foreign file are refused
/// by name, without a picture.
#[test]
fn what_is_no_part_is_refused() {
    let sandbox = sandbox();
    for (name, words) in [
        ("1", "--part 1/3"),
        ("2", "--part 2/3"),
        ("3", "--part 3/3"),
        ("seed", "--part 2/3 --seed 1"),
        ("depth", "--max-depth 2"),
        ("rung", "--rung light-sampling=lights"),
    ] {
        render(
            &sandbox,
            &format!(
                "--spp 2 {words} --checkpoint {name}.film {}",
                if words.contains("part") {
                    ""
                } else {
                    "-o x.png"
                }
            ),
        )
        .exits_with(0);
    }
    let before = sandbox.names();
    let missing = merge(&sandbox, "1.film 3.film -o all.png");
    missing
        .exits_with(3)
        .prints_like("error: parts are missing or unfinished: 2 of 6 tiles (");
    merge(&sandbox, "1.film 2.film 1.film 3.film -o all.png")
        .exits_with(3)
        .prints_like("1.film: the part has samples that an earlier part has too");
    merge(&sandbox, "1.film seed.film -o all.png")
        .exits_with(3)
        .prints_like(
            "seed.film: the part belongs to another picture than 1.film: the seed differs",
        );
    merge(&sandbox, "1.film depth.film -o all.png")
        .exits_with(3)
        .prints_like("the maximum depth differs");
    merge(&sandbox, "1.film rung.film -o all.png")
        .exits_with(3)
        .prints_like("the light sampling differs");
    merge(&sandbox, "1.film gone.film -o all.png")
        .exits_with(4)
        .prints_like("cannot read gone.film: no such file or folder");
    merge(&sandbox, "1.film room.scene.toml -o all.png")
        .exits_with(3)
        .prints_like("room.scene.toml: the file is not a film file");
    merge(&sandbox, "1.film -o 1.film").exits_with(2);
    merge(&sandbox, "1.film 2.film --checkpoint 2.film")
        .exits_with(2)
        .prints_like("cannot write 2.film: this run reads it");
    merge(&sandbox, "1.film 2.film").exits_with(2);
    assert_eq!(sandbox.names(), before);
    merge(&sandbox, "1.film 3.film -o some.png --unfinished").exits_with(0);
    assert!(sandbox.picture("some.png").rgb.contains(&[0.0; 3]));
}

/// Protects: a film of another scene, file content or flag, or with more samples than requested, is
/// not resumed, and the message names the difference. Only settings without effect on samples may
/// differ.
#[test]
fn another_picture_is_not_gone_on_from() {
    let sandbox = sandbox();
    render(&sandbox, "--spp 40 --checkpoint a.film -o a.png").exits_with(0);
    let refused = |words: &str, cause: &str| {
        let run = render(&sandbox, &format!("{words} --resume a.film -o b.png"));
        run.exits_with(3).prints_like(&format!(
            "a.film: the film belongs to another picture: the {cause} differs"
        ));
    };
    refused("--spp 80 --seed 7", "seed");
    refused("--spp 80 --eye 0,1,5", "camera");
    refused("--spp 80 --size 71x50", "size");
    refused("--spp 80 --at 1", "scene");
    refused("--spp 80 --env default", "scene");
    refused("--spp 80 --without shadows", "list of effects switched off");
    refused("--spp 80 --aov depth --checkpoint b.film", "list of layers");
    refused("--spp 80 --precision reference", "precision");
    render(&sandbox, "--spp 64 --resume a.film -o b.png")
        .exits_with(2)
        .prints_like(
            "the film has 40 samples a pixel and cannot be continued to 64\nhelp: give --spp 78 or a larger number",
        );
    render(&sandbox, "--spp 20 --resume a.film -o b.png")
        .exits_with(2)
        .prints_like(
            "the film has 40 samples a pixel and cannot be continued to 20\nhelp: give --spp 40 or a larger number",
        );
    sandbox.write("room.scene.toml", SCENE.replace("0.2", "0.3"));
    refused("--spp 80", "scene");
    assert!(!sandbox.names().contains(&"b.png".to_owned()));
    render(&sandbox, "--spp 4 --part 1/2 -o c.png --checkpoint c.film")
        .exits_with(2)
        .prints_like("-o and --part cannot both be given");
    render(&sandbox, "--spp 4 --part 1/2")
        .exits_with(2)
        .prints_like("--part needs --checkpoint, whose file receives the share of the picture");
    render(&sandbox, "--spp 4 --part 1/7 --checkpoint c.film")
        .exits_with(2)
        .prints_like("divides the picture into 7 shares, and the picture has only 6 tiles");
    render(
        &sandbox,
        "--spp 4 --resume a.film --checkpoint room.scene.toml",
    )
    .exits_with(2)
    .prints_like("room.scene.toml: this file exists and is no film");
}

/// Protects: a film that is truncated, changed in any byte or invented gives a message without
/// large allocations: every length, every bit of a header, and random numbers.
#[test]
fn damaged_films_do_no_harm() {
    let sandbox = sandbox();
    render(&sandbox, "--spp 1 --size 4x3 --checkpoint a.film -o a.png").exits_with(0);
    let whole = fs::read(sandbox.path("a.film")).expect("a film");
    let read = |bytes: &[u8]| {
        sandbox.write("b.film", bytes);
        raywright::io::output::read_film(&sandbox.path("b.film"), &raywright::io::Limits::default())
    };
    assert!(read(&whole).is_ok());
    for length in 0..whole.len() {
        assert!(
            read(&whole[..length]).is_err(),
            "{length} of {} bytes",
            whole.len()
        );
    }
    for place in 0..whole.len() {
        for bit in [0, 3, 7] {
            let mut changed = whole.clone();
            changed[place] ^= 1 << bit;
            assert!(read(&changed).is_err(), "bit {bit} of byte {place}");
        }
    }
    assert!(
        read(&[&whole[..], b"\0"].concat())
            .expect_err("too long")
            .to_string()
            .contains(
                "the file continues after the end of the film; copy it again, or render again"
            )
    );
    merge(&sandbox, "b.film -o b.png").exits_with(3);
    // The largest claimed size, in a file of a few hundred bytes.
    let text = String::from_utf8_lossy(&whole[28..]).into_owned();
    let header = &text[..text.rfind('}').expect("a header") + 1];
    for (old, new) in [
        (r#""width":4,"height":3"#, r#""width":65535,"height":65535"#),
        (
            r#""width":4,"height":3"#,
            r#""width":4294967295,"height":4294967295"#,
        ),
        (r#""tile_size":32"#, r#""tile_size":0"#),
        (r#""samples":1"#, r#""samples":4294967295"#),
        (r#""drawn":[1]"#, r#""drawn":[65535]"#),
        (r#""drawn":[1]"#, r#""drawn":[]"#),
        (r#""drawn":[1]"#, r#""drawn":[1,1]"#),
    ] {
        assert!(header.contains(old), "{old} is not in {header}");
        let changed = header.replacen(old, new, 1);
        let bytes = [
            &whole[..20],
            &(changed.len() as u64).to_le_bytes(),
            changed.as_bytes(),
            &[0; 400],
        ]
        .concat();
        let run = (read(&bytes).is_err(), merge(&sandbox, "b.film -o b.png"));
        assert!(
            run.0 && matches!(run.1.code, Some(3 | 5)),
            "{new}: {:?} {}",
            run.1.code,
            run.1.stderr
        );
    }
}

/// Protects: a target error is reached, by the reported interval, with additional samples where
/// needed; threads and accelerator do not change the bits; an end by budget or by the largest
/// sample count is reported.
#[test]
fn an_error_is_reached() {
    let sandbox = sandbox();
    let all = format!("--max-error 0.01 {LAYERS}");
    render(&sandbox, &format!("{all} -o a.exr --stats a.json"))
        .exits_with(0)
        .prints_like(", below the requested 0.01, ");
    let stats: serde_json::Value =
        serde_json::from_slice(&fs::read(sandbox.path("a.json")).expect("a report")).expect("JSON");
    let high = stats["error"]["root_relmse"]["high"]
        .as_f64()
        .expect("an interval");
    assert!(high <= 0.01 && high > 0.005, "{high}");
    let picture = sandbox.picture("a.exr");
    let samples = &picture.layer("samples.N").expect("asked for").samples;
    let (minimum, maximum) = samples
        .iter()
        .fold((f32::MAX, 0.0_f32), |(minimum, maximum), &n| {
            (minimum.min(n), maximum.max(n))
        });
    assert!(
        minimum >= 16.0 && maximum > 1.5 * minimum,
        "{minimum} to {maximum}"
    );
    render(
        &sandbox,
        &format!("{all} -o b.exr --threads 1 --accel linear"),
    )
    .exits_with(0);
    same_bits(&sandbox, "a.exr", "b.exr");
    for (end, file) in [("--spp 40", "c.exr"), ("--budget 1s", "d.exr")] {
        let run = render(&sandbox, &format!("--max-error 0.0001 {end} -o {file}"));
        run.exits_with(6)
            .prints_like("error: the requested error of 0.0001 is not reached");
        assert!(sandbox.path(file).exists());
    }
    render(&sandbox, "--max-error 0.1 --part 1/2 --checkpoint p.film").exits_with(2);
    render(&sandbox, "--max-error 0 -o d.exr").exits_with(2);
}

/// Protects: a render that continued after its target error first seemed reached reports the
/// reason, and the sample count at that time.
#[test]
fn going_on_is_explained() {
    if !crate::support::carried("cornell") {
        return;
    }
    let sandbox = Sandbox::new();
    let run = sandbox.run(&[
        "preset:cornell",
        "-s",
        "12x12",
        "--max-error",
        "0.08",
        "-o",
        "c.png",
    ]);
    run.exits_with(0)
        .prints_like(" samples seemed to reach the error of 0.08, with an estimate of 0.0")
        .prints_like("more samples were therefore taken")
        .prints_like("below the requested 0.08");
}

/// Protects: the film of a render ended by its budget serves as a map of sample counts, from which
/// another render gets the same bits, with adaptive sampling or without; a film of other settings
/// is refused.
#[test]
fn what_a_budget_ended_is_replayed() {
    let sandbox = sandbox();
    for (name, words, code) in [("even", "", 0), ("error", "--max-error 0.0001", 6)] {
        render(
            &sandbox,
            &format!("{words} --budget 1s {LAYERS} -o {name}.exr --checkpoint {name}.film"),
        )
        .exits_with(code);
        render(
            &sandbox,
            &format!("{words} {LAYERS} --replay {name}.film -o {name}-again.exr --threads 1"),
        )
        .exits_with(code);
        same_bits(
            &sandbox,
            &format!("{name}.exr"),
            &format!("{name}-again.exr"),
        );
    }
    render(
        &sandbox,
        &format!("--seed 3 {LAYERS} --replay even.film -o c.exr"),
    )
    .exits_with(3)
    .prints_like("seed");
    render(&sandbox, &format!("{LAYERS} --replay error.film -o d.exr"))
        .exits_with(3)
        .prints_like("maximum error");
}

/// Protects: a budget that is too short still gives every pixel the samples of one pass, with a
/// message, and the film can be resumed to the bits of a single run.
#[test]
fn a_budget_ends_after_a_pass() {
    let sandbox = sandbox();
    // More than a second of work: 65,536 samples of 60,000 pixels.
    let all = "--size 300x200 --aov samples";
    let run = render(
        &sandbox,
        &format!("{all} --budget 1s -o a.exr --checkpoint a.film"),
    );
    run.exits_with(0);
    let taken = sandbox
        .picture("a.exr")
        .layer("samples.N")
        .expect("asked for")
        .samples
        .clone();
    let (minimum, maximum) = taken
        .iter()
        .fold((f32::MAX, 0.0_f32), |(minimum, maximum), &n| {
            (minimum.min(n), maximum.max(n))
        });
    assert!(
        minimum >= 4.0 && maximum < 65_536.0,
        "{minimum} to {maximum}"
    );
    let message = if minimum == maximum {
        format!("{minimum} of 65536 samples")
    } else {
        format!("{minimum} to {maximum} of 65536 samples")
    };
    assert!(run.stderr.contains(&message), "{message}: {}", run.stderr);
    assert!(
        sandbox
            .stored("a.exr")
            .texts
            .iter()
            .any(|(_, text)| text.contains(&format!("taken='{message}'"))),
        "{message}"
    );
    // The fixed pattern of a scene is a single pass.
    let pattern = sandbox.run(&[
        "render",
        "preset:whitted",
        "--size",
        "64x36",
        "--budget",
        "1s",
        "-o",
        "w.png",
    ]);
    pattern.exits_with(0).prints_like("64x36, 4 samples");
}

/// Protects: an interrupted render writes its checkpoint, prints the command to resume, and resumes
/// to the bits of a single run.
#[cfg(unix)]
#[test]
fn an_interrupted_render_goes_on() {
    use std::io::Read;
    use std::process::Stdio;
    let sandbox = sandbox();
    let words = [
        "render",
        "room.scene.toml",
        "--integrator",
        "path",
        "--spp",
        "400",
        "--size",
        "160x120",
        "-o",
        "a.exr",
        "--checkpoint",
        "a.film",
        "--progress=plain",
    ];
    let mut child = sandbox
        .command(&words)
        .stderr(Stdio::piped())
        .spawn()
        .expect("starts");
    let mut stderr = child.stderr.take().expect("piped");
    stderr.read_exact(&mut [0]).expect("a first line");
    assert!(
        Command::new("kill")
            .args(["-INT", &child.id().to_string()])
            .status()
            .expect("kill runs")
            .success()
    );
    let code = child.wait().expect("ends").code();
    let mut text = String::new();
    stderr.read_to_string(&mut text).expect("text");
    assert_eq!(code, Some(130), "{text}");
    assert!(
        text.contains(
            "the unfinished picture is in a.partial.exr, a.film\nhelp: continue with --resume a.film"
        ),
        "{text}"
    );
    let (size, spp) = ("--size 160x120", "--spp 400");
    render(&sandbox, &format!("{size} {spp} -o a.exr --resume a.film")).exits_with(0);
    render(&sandbox, &format!("{size} {spp} -o once.exr")).exits_with(0);
    same_bits(&sandbox, "a.exr", "once.exr");
}

/// Protects: the render farm of docs/farm.md with GNU parallel gives the picture of a single run,
/// where it is installed.
#[test]
fn gnu_parallel_is_a_farm() {
    let installed = Command::new("parallel")
        .arg("--version")
        .output()
        .is_ok_and(|output| output.stdout.starts_with(b"GNU"));
    if !installed {
        eprintln!("skipped: GNU parallel is not installed");
        return;
    }
    let sandbox = sandbox();
    let page =
        fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/farm.md")).expect("the page");
    let (_, rest) = page
        .split_once("<!-- test: parallel -->\n```sh\n")
        .expect("the commands");
    let (commands, _) = rest.split_once("\n```").expect("their end");
    let program = std::path::Path::new(env!("CARGO_BIN_EXE_raywright"));
    let path = format!(
        "{}:{}",
        program.parent().expect("a folder").display(),
        std::env::var("PATH").unwrap_or_default()
    );
    let small = commands.replace("--spp 256", "--spp 9");
    assert_ne!(small, commands);
    let ran = Command::new("sh")
        .args(["-ec", &small])
        .current_dir(sandbox.path("."))
        .env("PATH", path)
        .output()
        .expect("a shell");
    assert!(
        ran.status.success(),
        "{}",
        String::from_utf8_lossy(&ran.stderr)
    );
    sandbox
        .run(&["render", "room.scene.toml", "--spp", "9", "-o", "once.png"])
        .exits_with(0);
    same_bits(&sandbox, "room.png", "once.png");
}

/// Protects: a film that cannot be written costs no picture, of `render` or of `merge`: the picture
/// is written, the failure is reported, and the exit code is that of files. Only the film, which is
/// many times as long as the picture, exceeds the limit on file length.
#[cfg(unix)]
#[test]
fn a_film_that_cannot_be_kept_costs_no_picture() {
    let sandbox = Sandbox::new();
    sandbox.write("room.scene.toml", SCENE);
    let limited = |words: &str| {
        // The system sends a signal to programs that do not ignore it.
        let script = format!("trap '' XFSZ; ulimit -f 64 || exit 77; exec \"$0\" {words}");
        let run = Command::new("sh")
            .args(["-c", &script, env!("CARGO_BIN_EXE_raywright")])
            .current_dir(sandbox.path(""))
            .output();
        run.expect("a shell")
    };
    let fails = |words: &str, picture: &str| {
        let run = limited(words);
        if run.status.code() == Some(77) {
            eprintln!("skipped: the system limits no files");
            return;
        }
        let message = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(4), "{words}: {message}");
        assert!(
            message.contains("error: cannot write a.film")
                && message.contains(&format!("wrote {picture} (")),
            "{words}: {message}"
        );
        assert!(
            sandbox.path(picture).exists() && !sandbox.path("a.film").exists(),
            "{words}: {:?}",
            sandbox.names()
        );
    };
    fails(
        "render room.scene.toml --integrator path --spp 4 --checkpoint a.film -o a.png",
        "a.png",
    );
    let whole = render(&sandbox, "--spp 4 --checkpoint b.film -o b.png");
    whole.exits_with(0);
    assert_eq!(sandbox.picture("a.png").rgb, sandbox.picture("b.png").rgb);
    fails("merge b.film --checkpoint a.film -o c.png", "c.png");
}

/// Protects: a film that does not fit on a full disk is kept beside the scene, as a picture is: of a
/// render, of a part without a picture, and of `merge`. The render goes on from the copy.
#[cfg(target_os = "linux")]
#[test]
fn full_disks_keep_films() {
    let sandbox = sandbox();
    std::os::unix::fs::symlink("/dev/full", sandbox.path("full.film")).expect("a link");
    let kept = |run: &crate::support::ProgramRun, copy: &str| {
        run.exits_with(4)
            .prints_like("error: cannot write full.film: the disk is full")
            .prints_like(&format!("help: the film is kept in {copy}"));
        assert!(sandbox.path(copy).is_file() && sandbox.path("full.film").is_symlink());
    };
    kept(
        &render(&sandbox, "--spp 4 -o a.exr --checkpoint full.film"),
        "full-2.film",
    );
    render(&sandbox, "--spp 8 -o more.exr --resume full-2.film").exits_with(0);
    render(&sandbox, "--spp 8 -o once.exr").exits_with(0);
    same_bits(&sandbox, "more.exr", "once.exr");
    for (part, copy) in [(1, "full-3.film"), (2, "full-4.film")] {
        let words = format!("--spp 4 --part {part}/2 --checkpoint full.film");
        kept(&render(&sandbox, &words), copy);
    }
    let parts = "full-3.film full-4.film";
    kept(
        &merge(
            &sandbox,
            &format!("{parts} --checkpoint full.film -o b.exr"),
        ),
        "full-5.film",
    );
    same_bits(&sandbox, "a.exr", "b.exr");
    merge(&sandbox, "full-5.film -o c.exr").exits_with(0);
    same_bits(&sandbox, "a.exr", "c.exr");
}

/// Protects: `info` shows what a film is, of a whole picture or of a part, by content whatever its
/// name; a damaged film is refused as by other commands.
#[test]
fn films_are_shown() {
    let sandbox = sandbox();
    render(&sandbox, "--spp 16 --checkpoint a.film -o a.png").exits_with(0);
    render(&sandbox, "--spp 16 --part 1/2 --checkpoint part").exits_with(0);
    let table = |name: &str| {
        let run = sandbox.run(&["info", name]);
        run.exits_with(0).text().to_owned()
    };
    let whole = table("a.film");
    for text in [
        "Raywright film",
        "16 to 16 of 16 a pixel; 0 of ",
        "root relMSE",
        "samples=16",
        "scene hash",
    ] {
        assert!(whole.contains(text), "{text}: {whole}");
    }
    let json = |name: &str| -> serde_json::Value {
        let run = sandbox.run(&["info", name, "--json"]);
        serde_json::from_str(run.exits_with(0).text()).expect("JSON")
    };
    let (whole, part) = (json("a.film"), json("part"));
    assert_eq!(whole["film"]["unfinished_tiles"], 0);
    assert!(
        part["film"]["unfinished_tiles"].as_u64() > Some(0),
        "{part}"
    );
    assert_eq!(part["film"]["samples"][0], 0, "{part}");
    for same in ["size", "scene_hash", "seed"] {
        assert_eq!(whole[same], part[same], "{same}");
    }
    let bytes = fs::read(sandbox.path("a.film")).expect("a film");
    sandbox.write("b.film", &bytes[..bytes.len() - 1]);
    sandbox
        .run(&["info", "b.film"])
        .exits_with(3)
        .prints_like("b.film: the film file is truncated");
}
