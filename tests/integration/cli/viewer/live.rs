//! Status of the page during a render, and its picture.

use serde_json::{Value, json};

use super::{SCENE, Viewer, hash_of};
use crate::support::Sandbox;

/// Protects: the finished picture is that of the displayed command, to the bit, after any sequence
/// of rotations, switches and settings; another view gives another picture, and the return gives
/// the first.
#[test]
fn what_is_seen_is_a_command() {
    let sandbox = Sandbox::new();
    sandbox.write("a room.scene.toml", SCENE);
    let viewer = Viewer::start(
        &sandbox,
        &["a room.scene.toml", "--spp", "32", "--set", "height=0.1"],
    );
    let of = |status: &Value| {
        status["progress"]["hash"]
            .as_str()
            .unwrap_or_else(|| panic!("{status}"))
            .to_owned()
    };
    let own = json!([["spp", "32"], ["set", "height=0.1"]]);
    let first = viewer.finished(&own);
    assert_eq!(
        first["command"],
        "raywright render 'a room.scene.toml' --spp 32 --set height=0.1"
    );
    let mut hashes = vec![of(&first)];
    let turned = json!(["eye", "-2,1.5,2.5"]);
    for (added, message) in [
        (
            json!([["eye", "-2,1.5,2.5"], ["target", "0,0.4,0"]]),
            "new camera",
        ),
        (json!([["view", "iso"], ["zoom", "1.3"]]), "new camera"),
        (json!([["camera", "other"]]), "new camera"),
        (json!([["denoise", null], turned]), "prepared"),
        (
            json!([["without", "soft-shadows,shadows"], turned]),
            "prepared",
        ),
        (json!([["max-depth", "2"]]), "prepared"),
        (json!([["at", "1.5"]]), "loaded"),
        (json!([["set", "height=0.7"]]), "loaded"),
        (json!([["max-error", "0.3"], ["spp", "64"]]), "loaded"),
    ] {
        let flags = [
            own.as_array().expect("flags").clone(),
            added.as_array().expect("flags").clone(),
        ]
        .concat();
        let status = viewer.finished(&Value::from(flags));
        assert_eq!(status["failure"], Value::Null, "{status}");
        assert!(
            status["message"]
                .as_str()
                .is_some_and(|text| text.contains(message)),
            "{message}: {}",
            status["message"]
        );
        assert_eq!(
            of(&status),
            hash_of(&sandbox, status["command"].as_str().expect("a command")),
            "{}",
            status["command"]
        );
        hashes.push(of(&status));
    }
    let back = viewer.finished(&own);
    assert_eq!(of(&back), hashes[0]);
    assert_eq!(
        of(&back),
        hash_of(&sandbox, back["command"].as_str().expect("a command"))
    );
    let count = hashes.len();
    hashes.sort();
    hashes.dedup();
    assert_eq!(hashes.len(), count, "each is another picture");
}

/// Protects: a first picture with larger pixels precedes the render; the error's interval is
/// reported at each doubling of the samples and converges; exposure and layers are displayed anew
/// without further samples.
#[test]
fn the_interval_closes() {
    let sandbox = Sandbox::new();
    sandbox.write("room.scene.toml", SCENE);
    let viewer = Viewer::start(&sandbox, &["room.scene.toml", "--spp", "1024"]);
    let status = viewer.until("the end", |status| status["phase"] == "done");
    let history: Vec<Vec<f64>> =
        serde_json::from_value(status["progress"]["history"].clone()).expect("stages");
    assert!(history.len() >= 4, "{history:?}");
    let width = |stage: &Vec<f64>| stage[4] - stage[3];
    assert!(
        history
            .iter()
            .all(|stage| stage[3] <= stage[2] && stage[2] <= stage[4]),
        "{history:?}"
    );
    assert!(
        history
            .windows(2)
            .all(|pair| pair[0][0] <= pair[1][0] && pair[0][1] < pair[1][1]),
        "{history:?}"
    );
    let last: Vec<f64> = history[history.len() - 4..].iter().map(width).collect();
    assert!(
        last[3] < last[1] && last[2] < last[0] && 2.0 * last[3] < width(&history[0]),
        "{last:?}"
    );
    let hash = &status["progress"]["hash"];
    let pictures: Vec<Vec<u8>> = [
        ("", "0"),
        ("", "2"),
        ("normal", "0"),
        ("stderr", "0"),
        ("object", "0"),
    ]
    .into_iter()
    .map(|(layer, stops)| {
        let wish = viewer
            .post(
                "request",
                &json!({ "flags": [["spp", "1024"], ["exposure", stops]], "layer": layer }),
            )
            .json();
        let shown = viewer.until("the layer", |status| {
            status["request"] == wish["request"] && status["phase"] == "done"
        });
        assert_eq!(&shown["progress"]["hash"], hash, "it is not rendered anew");
        assert_eq!(shown["progress"]["history"], status["progress"]["history"]);
        std::thread::sleep(std::time::Duration::from_millis(700));
        viewer.get("picture").body
    })
    .collect();
    for (i, picture) in pictures.iter().enumerate() {
        assert_eq!(picture.len(), 64 * 48 * 4, "picture {i}");
        assert!(
            pictures[..i].iter().all(|other| other != picture),
            "picture {i} is one of those before"
        );
    }
}

/// Protects: what is shown while the camera moves is filtered where the finished picture is: a first
/// sketch has a fraction of its noise, and no claim.
#[test]
fn sketches_are_filtered() {
    let sandbox = Sandbox::new();
    sandbox.write("room.scene.toml", SCENE);
    let viewer = Viewer::start(&sandbox, &["room.scene.toml", "--spp", "2048"]);
    let sketch = |flags: &Value| loop {
        let wish = viewer.post("request", &json!({ "flags": flags })).json()["request"].clone();
        let status = viewer.until("a sketch", |status| {
            status["request"] == wish && status["phase"] == "rendering"
        });
        let answer = viewer.get("picture");
        let own = format!("X-Picture: {} 64 48 1\r\n", status["picture"]);
        // A later picture may have replaced the sketch.
        if answer.head.contains(own.trim_end()) && status["progress"]["samples"][1] == 0 {
            assert_eq!(status["progress"]["error"], Value::Null);
            break answer.body;
        }
        viewer.post("request", &json!({ "flags": [["view", "iso"]] }));
    };
    let view = |more: Value| {
        json!([
            ["spp", "2048"],
            ["eye", "1,2,3"],
            ["target", "0,0.5,0"],
            more
        ])
    };
    let [noisy, filtered] =
        ["no-denoise", "denoise"].map(|flag| sketch(&view(json!([flag, null]))));
    viewer.finished(&view(json!(["denoise", null])));
    let truth = viewer.get("picture").body;
    let error = |picture: &[u8]| -> f64 {
        let apart = picture
            .iter()
            .zip(&truth)
            .map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2));
        apart.sum()
    };
    let [before, after] = [&noisy, &filtered].map(|picture| error(picture));
    assert!(after < 0.4 * before, "{after} of {before}");
}

/// Protects: the page is open while a large model is read, and shows the stage; its picture follows.
/// A model that cannot be read ends the program, with the reason.
#[test]
fn the_page_comes_before_the_scene() {
    let sandbox = Sandbox::new();
    let mut text = String::new();
    const EDGE: usize = 500;
    for i in 0..EDGE * EDGE {
        let (x, y) = (i % EDGE, i / EDGE);
        text += &format!("v {x} {} {y}\n", (x * y) % 7);
        if x > 0 && y > 0 {
            text += &format!(
                "f {} {} {}\nf {} {} {}\n",
                i - EDGE,
                i - EDGE + 1,
                i + 1,
                i - EDGE,
                i + 1,
                i
            );
        }
    }
    sandbox.write("terrain.obj", text);
    let viewer = Viewer::start(&sandbox, &["terrain.obj", "--spp", "1", "--size", "64x48"]);
    assert_eq!(viewer.get("").status, 200);
    let status = viewer.get("status?after=0").json();
    if status["phase"] == "loading" {
        let message = status["message"].as_str().expect("a stage");
        assert!(
            message.starts_with("reading the scene") || message.starts_with("building the tree"),
            "{message}"
        );
        for flag in [["spp", "1"], ["size", "64x48"]] {
            let flags = status["flags"].as_array().expect("flags");
            assert!(flags.contains(&json!(flag)), "{flags:?}");
        }
    } else {
        eprintln!("skipped: this machine has read the scene already");
    }
    viewer.until("the picture", |status| status["phase"] == "done");
    sandbox.write("bad.obj", "f 1 2 3\n");
    let run = sandbox.run(&["view", "bad.obj", "--no-open"]);
    run.exits_with(3).prints_like("bad.obj");
    assert!(run.stdout.is_empty());
}

/// Protects: a scene changed on disk is rendered again from the current camera; an error of the
/// file is shown with its position over the last picture, and disappears once the file is valid.
#[test]
fn changes_on_disk_are_seen() {
    let sandbox = Sandbox::new();
    sandbox.write("room.scene.toml", SCENE);
    let viewer = Viewer::start(&sandbox, &["room.scene.toml", "--watch", "--spp", "8"]);
    let flags = json!([["spp", "8"], ["eye", "1,2,3"], ["target", "0,0,0"]]);
    let first = viewer.finished(&flags);
    sandbox.write(
        "room.scene.toml",
        SCENE.replace("radius = 0.5", "radius = 0.55"),
    );
    let second = viewer.until("the change", |status| {
        status["phase"] == "done"
            && status["progress"]["hash"] != first["progress"]["hash"]
            && status["progress"]["hash"] != Value::Null
    });
    assert_eq!(second["flags"], flags);
    assert_eq!(
        second["progress"]["hash"],
        hash_of(&sandbox, second["command"].as_str().expect("a command"))
    );
    sandbox.write(
        "room.scene.toml",
        SCENE.replace("radius = 0.5", "radios = 0.5"),
    );
    let wrong = viewer.until("the mistake", |status| status["failure"] != Value::Null);
    let message = wrong["failure"].as_str().expect("a message");
    assert!(
        message.contains("radios") && message.contains("room.scene.toml:25"),
        "{message}"
    );
    assert_eq!(
        viewer.get("picture").body.len(),
        64 * 48 * 4,
        "the last picture stays"
    );
    sandbox.write("room.scene.toml", SCENE);
    let right = viewer.until("the first picture", |status| status["phase"] == "done");
    assert_eq!(right["progress"]["hash"], first["progress"]["hash"]);
}

/// Protects: a program whose last page was closed ends by itself, with success; a program without
/// any page waits.
#[test]
fn closing_ends_the_program() {
    let sandbox = Sandbox::new();
    sandbox.write("room.scene.toml", SCENE);
    let mut viewer = Viewer::start(
        &sandbox,
        &["room.scene.toml", "--spp", "4", "--linger", "1s"],
    );
    std::thread::sleep(std::time::Duration::from_millis(1500));
    assert!(
        viewer.child.try_wait().expect("a child").is_none(),
        "no page was open yet"
    );
    assert_eq!(viewer.get("status?after=0").status, 200);
    assert!(viewer.end().success());
    assert_eq!(sandbox.names(), ["room.scene.toml"]);
}
