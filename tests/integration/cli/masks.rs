//! Names in untrusted files: no name can control the terminal that displays it.

use serde_json::{Value, json};

use crate::support::{ProgramRun, Sandbox};

/// An escape sequence, a bell, a one-character escape, a deletion, a direction override, line and
/// paragraph separators, invisible characters, and a line that imitates the program's.
const EVIL: &str =
    "n\u{1b}[31m\u{7}\u{9b}2J\u{7f}\u{202e}\u{2028}\u{2029}\u{200b}\u{feff}\r\nwarning: x";

/// A model whose names all contain control characters, without a light.
fn model() -> String {
    let variants = json!({ "KHR_materials_variants": { "variants": [{ "name": EVIL }] } });
    let triangle =
        "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
    let model = json!({ "asset": { "version": "2.0", "generator": EVIL }, "extensionsUsed": ["KHR_materials_variants", EVIL],
        "extensions": variants, "scene": 0,
        "scenes": [{ "name": EVIL, "nodes": [0, 1] }, { "name": EVIL, "nodes": [0] }],
        "nodes": [{ "name": EVIL, "mesh": 0 }, { "name": EVIL, "camera": 0, "translation": [0.3, 0.3, 3.0] }],
        "cameras": [{ "name": EVIL, "type": "perspective", "perspective": { "yfov": 0.7, "znear": 0.1 } }],
        "meshes": [{ "name": EVIL, "primitives": [{ "attributes": { "POSITION": 0 }, "material": 0 }] }],
        "materials": [{ "name": EVIL, "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } },
            "extensions": { format!("KHR_materials_{EVIL}"): { "a": 1 }, "KHR_materials_subsurface": {} } }],
        "animations": [{ "name": EVIL, "channels": [], "samplers": [] }],
        "images": [{ "name": EVIL, "uri": "no%1b%5b31m.png" }], "textures": [{ "name": EVIL, "source": 0 }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0] }],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }], "buffers": [{ "byteLength": 36, "uri": triangle }] });
    model.to_string()
}

/// A scene whose names all contain them, with a lamp that lights nothing.
fn scene() -> String {
    let (up, o) = ([0, 1, 0], [0, 0, 0]);
    let ball = |radius: f64| json!({ "name": EVIL, "shape": { "sphere": { "centre": o, "radius": radius } }, "material": EVIL });
    let scene = json!({ "format": 1, "title": EVIL, "parameters": {},
        "cameras": [{ "name": EVIL, "pose": { "look_at": { "eye": [0, 0, 5], "target": o, "up": up } },
            "projection": { "pinhole": { "vertical_fov": 40 } } }],
        "lights": [{ "name": EVIL, "kind": { "point": { "position": o } }, "colour": 1 }],
        "images": [{ "name": EVIL, "path": "no\u{1b}[31m.png" }], "textures": [{ "name": EVIL, "image": EVIL }],
        "materials": [{ "name": EVIL, "model": { "physical": {} } }], "objects": [ball(1.0), ball(0.5)] });
    scene.to_string()
}

/// Control characters except line breaks and tabs, line separators, direction overrides, and
/// invisible characters.
fn steers(c: char) -> bool {
    c.is_control() && !matches!(c, '\n' | '\t')
        || matches!(c, '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{200b}' | '\u{feff}')
}

#[track_caller]
fn is_harmless(run: &ProgramRun, words: &[&str]) {
    for (from, text) in [
        ("standard output", run.text()),
        ("standard error", run.stderr.as_str()),
    ] {
        let found: Vec<char> = text.chars().filter(|&c| steers(c)).collect();
        assert!(
            found.is_empty(),
            "{words:?}: {found:?} on {from}:\n{}",
            text.escape_debug()
        );
        assert!(
            !text.lines().any(|line| line == "warning: x"),
            "{words:?}: a name makes a line of its own on {from}:\n{text}"
        );
    }
}

/// Protects: no command prints a control character from a name of a model or a scene, in results,
/// warnings, notes or errors; JSON stays valid, with the names unchanged.
#[test]
fn names_do_nothing_to_a_terminal() {
    let sandbox = Sandbox::new();
    let small = ["--size", "4x4", "--spp", "1"];
    sandbox.write("a.gltf", model());
    sandbox.write("a.scene.json", scene());
    let renamed = "b\u{1b}[31m.gltf";
    sandbox.write(renamed, model());
    for file in ["a.gltf", "a.scene.json", renamed] {
        let commands: [&[&str]; 11] = [
            &["info", file],
            &["info", file, "--json"],
            &["explain", file],
            &["explain", file, "--json"],
            &["check", file],
            &[
                "render", file, small[0], small[1], small[2], small[3], "-v", "--stats", "s.json",
                "-o", "a.png",
            ],
            &["render", file, "--camera", "none\u{1b}[31m", "-o", "a.png"],
            &["render", file, "--scene", "none\u{1b}[31m", "-o", "a.png"],
            &["render", file, "--variant", "none\u{1b}[31m", "-o", "a.png"],
            &[
                "accuracy", file, "--size", "4x4", "--budget", "2s", "--rounds", "2",
            ],
            &["bench", file, "--seconds", "0.1", "--repeats", "1"],
        ];
        for words in commands {
            let run = sandbox.run(words);
            assert!(
                matches!(run.code, Some(0 | 2 | 3)),
                "{words:?}: {:?}\n{}",
                run.code,
                run.stderr
            );
            is_harmless(&run, words);
            if words.contains(&"--json") {
                serde_json::from_slice::<Value>(&run.stdout).expect("JSON");
            }
        }
    }
    let printed: Value =
        serde_json::from_slice(&sandbox.run(&["info", "a.scene.json", "--json"]).stdout)
            .expect("JSON");
    assert_eq!(
        (&printed["title"], &printed["cameras"][0]),
        (&json!(EVIL), &json!(EVIL))
    );
    let written = std::fs::read_to_string(sandbox.path("s.json")).expect("a report");
    assert!(
        !written.chars().any(steers) && serde_json::from_str::<Value>(&written).is_ok(),
        "{written}"
    );
}
