//! Interfaces for scripts: results for many files, JSON of documented layouts, progress in JSON,
//! hashes, and comparisons that account for noise.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;

use raywright::core::display::Display;
use raywright::core::picture::Picture;
use raywright::io::output::{PictureMetadata, write_picture};
use serde_json::Value;

use super::films::{render, sandbox as room};
use crate::support::{ProgramRun, Sandbox};

const GOOD: &str = "format = 1\nsky.constant = 1\n[[materials]]\nname = \"m\"\nmodel.classic = {}\n\
    [[objects]]\nmaterial = \"m\"\nshape.sphere = { centre = [0, 0, 0], radius = 1 }\n";

fn json(run: &ProgramRun) -> Value {
    serde_json::from_str(run.text()).expect("JSON")
}

/// Protects: each of many files gets its result, for people and for scripts, and the first faulty
/// one decides the exit code; warnings are errors on request, and an empty scene gives a warning.
#[test]
fn many_files_are_checked() {
    let sandbox = Sandbox::new();
    sandbox.write("good.scene.toml", GOOD);
    sandbox.write("empty.scene.toml", "format = 1\n");
    sandbox.write("bad.scene.toml", "format = 1\nobjcts = []\n");
    let nothing = "empty.scene.toml: there is nothing to see: the scene has no object";
    let both = ["check", "good.scene.toml", "empty.scene.toml"];
    let run = sandbox.run(&both);
    run.exits_with(0)
        .prints(&format!("warning: {nothing} [nothing-seen]"));
    assert_eq!(
        run.text(),
        "good.scene.toml: ok\nempty.scene.toml: ok, 1 warning\n"
    );
    sandbox.run(&[&both[..], &["--deny-warnings"]].concat())
        .exits_with(3)
        .prints_like("error: empty.scene.toml: 1 warning, and --deny-warnings allows none; correct the file, or permit a warning by its code: --allow CODE\nerror: 1 of 2 files have problems");
    let all = [
        "check",
        "good.scene.toml",
        "gone.glb",
        "bad.scene.toml",
        "empty.scene.toml",
    ];
    sandbox
        .run(&all)
        .exits_with(4)
        .prints_like("unknown key `objcts`")
        .prints_like("error: 2 of 4 files have problems");
    let run = sandbox.run(&[&all[..], &["--json", "--deny-warnings"]].concat());
    run.exits_with(4);
    let report = json(&run);
    let of = |key: &str| {
        report["files"]
            .as_array()
            .expect("a list")
            .iter()
            .map(|file| file[key].clone())
            .collect::<Vec<Value>>()
    };
    assert_eq!(of("code"), [0, 4, 3, 3].map(Value::from));
    assert_eq!(of("ok"), [true, false, false, false].map(Value::from));
    assert_eq!(
        of("warnings")[3],
        serde_json::json!([{ "code": "nothing-seen", "severity": "picture-wrong", "message": nothing }])
    );
    sandbox
        .run(&[&both[..], &["--deny-warnings", "--allow", "nothing-seen"]].concat())
        .exits_with(0);
    sandbox
        .run(&[&both[..], &["--deny-warnings", "--allow", "nothing"]].concat())
        .exits_with(2)
        .prints_like("no warning has this code");
    // An animation shown at rest is no problem of a picture.
    sandbox.write("model.gltf", super::models::model());
    sandbox
        .run(&["check", "model.gltf", "--deny-warnings"])
        .exits_with(0)
        .prints_like("note: model.gltf: ")
        .prints_like("[at-rest]");
    assert_eq!(
        sandbox.run(&["check", "model.gltf"]).text(),
        "model.gltf: ok, 2 notes\n"
    );
    assert!(
        of("error")[2]
            .as_str()
            .is_some_and(|error| error.starts_with("unknown key `objcts`")),
        "{report}"
    );
}

/// Keys that are always present, and optional keys.
type JsonKeys = [BTreeSet<String>; 2];

/// Description of a kind of JSON in docs/machines.md: its version, its keys, and the keys of nested
/// objects by path.
struct JsonLayout {
    version: u64,
    keys: JsonKeys,
    within: BTreeMap<String, JsonKeys>,
}

impl JsonLayout {
    /// Row of a nested object: by its path, or by its last key anywhere.
    fn within(&self, at: &str) -> Option<(&String, &JsonKeys)> {
        let last = at.rsplit_once('.').map_or(at, |(_, last)| last);
        self.within
            .get_key_value(at)
            .or_else(|| self.within.get_key_value(&format!("*.{last}")))
    }
}

/// Names in code marks in a table cell.
fn names(cell: &str) -> impl Iterator<Item = String> {
    cell.split('`').skip(1).step_by(2).map(str::to_owned)
}

/// Keys of a cell, where those in brackets are optional.
fn keys(cell: &str) -> JsonKeys {
    let (always, sometimes) = cell.split_once(" [").unwrap_or((cell, ""));
    [always, sometimes].map(|cell| names(cell).collect())
}

fn documented(from: &str) -> JsonLayout {
    let page = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/machines.md"))
        .expect("the page");
    let rows = page
        .lines()
        .filter(|line| line.starts_with(&format!("| `{from}` |")))
        .map(|line| line.split('|').collect::<Vec<_>>());
    let mut rows = rows.map(|cells| (cells[2].to_owned(), cells[3].to_owned()));
    let (version, own) = rows.next().unwrap_or_else(|| panic!("no row of {from}"));
    let mut within = BTreeMap::new();
    for (places, cell) in rows {
        names(&places).for_each(|place| {
            assert!(
                within.insert(place.clone(), keys(&cell)).is_none(),
                "{from}: {place} twice"
            )
        });
    }
    let mut own = keys(&own);
    own[0].insert("format".to_owned());
    JsonLayout {
        version: version.trim().parse().expect("a version"),
        keys: own,
        within,
    }
}

/// Every object of a JSON value with its path: `a.b[].c`.
fn objects<'a>(at: &str, found: &'a Value, all: &mut Vec<(String, &'a Value)>) {
    match found {
        Value::Array(list) => list
            .iter()
            .for_each(|one| objects(&format!("{at}[]"), one, all)),
        Value::Object(keys) => {
            all.push((at.to_owned(), found));
            let dot = if at.is_empty() { "" } else { "." };
            keys.iter()
                .for_each(|(key, value)| objects(&format!("{at}{dot}{key}"), value, all));
        }
        _ => {}
    }
}

/// Asserts that a JSON value matches the page; returns the paths of its objects.
#[track_caller]
fn has_the_documented_keys(from: &str, found: &Value) -> BTreeSet<String> {
    let layout = documented(from);
    assert_eq!(found["format"], layout.version, "{from}");
    let mut all = Vec::new();
    objects("", found, &mut all);
    for (at, object) in &all {
        let known = if at.is_empty() {
            Some(&layout.keys)
        } else {
            layout.within(at).map(|(_, keys)| keys)
        };
        let [always, sometimes] =
            known.unwrap_or_else(|| panic!("{from}: `{at}` is not documented"));
        let keys: BTreeSet<String> = object
            .as_object()
            .expect("an object")
            .keys()
            .cloned()
            .collect();
        let missing: Vec<_> = always.difference(&keys).collect();
        let unknown: Vec<_> = keys
            .iter()
            .filter(|key| !always.contains(*key) && !sometimes.contains(*key))
            .collect();
        assert!(
            missing.is_empty() && unknown.is_empty(),
            "{from}, {at}: missing {missing:?}, not documented {unknown:?}"
        );
    }
    all.into_iter()
        .filter_map(|(at, _)| Some(layout.within(&at)?.0.clone()))
        .collect()
}

/// A lamp over a floor, path traced, so that every figure exists.
const LAMP: &str = r#"format = 1
parameters = { brightness = { value = 5, min = 0, max = 9 } }
render = { size = [24, 18], samples = 32, integrator = "path" }
cameras = [{ pose.look_at = { eye = [0, 1, 5], target = [0, 0, 0] }, projection.pinhole = { vertical_fov = 40 } }]
sky.constant = 0.2
materials = [{ name = "m", model.classic = {} }, { name = "l", model.classic = { emission = 5 } }]
objects = [{ shape.plane = { point = [0, -1, 0], normal = [0, 1, 0] }, material = "m" },
  { shape.sphere = { centre = [0, 2, 0], radius = 0.5 }, material = "l" }]
"#;

/// Protects: every JSON has exactly the keys documented on its page, in every nested object, and
/// the version; every documented object occurs.
#[test]
fn layouts_are_those_of_the_page() {
    let sandbox = Sandbox::new();
    sandbox.write("good.scene.toml", GOOD);
    sandbox.write("lamp.scene.toml", LAMP);
    sandbox.write(
        "many.scene.toml",
        LAMP.replace("samples = 32", "samples = 256"),
    );
    sandbox.write(
        "twice.scene.toml",
        LAMP.replace("objects = [", "objects = [{ shape.sphere = { centre = [0, 2, 0], radius = 0.5 }, material = \"m\" }, "),
    );
    sandbox.write("model.gltf", super::models::model());
    let words = |line: &str| sandbox.run(&line.split(' ').collect::<Vec<_>>());
    words("render lamp.scene.toml --denoise --aov stderr -q -o a.exr --stats s.json").exits_with(0);
    words("render lamp.scene.toml --aov stderr --seed 2 -q -o b.exr --checkpoint b.film")
        .exits_with(0);
    words("render lamp.scene.toml --background transparent --crop 2,2,16,12 -q -o c.exr")
        .exits_with(0);
    let stats = fs::read_to_string(sandbox.path("s.json")).expect("a report");
    let mut seen = has_the_documented_keys(
        "render --stats",
        &serde_json::from_str(&stats).expect("JSON"),
    );
    let complete = |from: &str, seen: &BTreeSet<String>| {
        // One of several objects with the same keys is enough, because not every scene has each of
        // them. Whether tree and scan cross over depends on measured times.
        let within = documented(from).within;
        let is_seen = |keys: &JsonKeys| seen.iter().any(|at| within.get(at) == Some(keys));
        let is_timed = |at: &str| at == "generated[].crossover";
        let unseen: Vec<_> = within
            .iter()
            .filter(|(at, keys)| !is_seen(keys) && !is_timed(at))
            .map(|(at, _)| at)
            .collect();
        assert!(unseen.is_empty(), "{from}: nothing is at {unseen:?}");
    };
    words("render model.gltf -s 8x8 --spp 4 -q -o d.png --stats u.json").exits_with(0);
    let stats = fs::read_to_string(sandbox.path("u.json")).expect("a report");
    seen.extend(has_the_documented_keys(
        "render --stats",
        &serde_json::from_str(&stats).expect("JSON"),
    ));
    complete("render --stats", &seen);
    for (from, lines) in [
        (
            "check --json",
            &["check good.scene.toml model.gltf --json"][..],
        ),
        (
            "info --json",
            &["info lamp.scene.toml --json", "info model.gltf --json"],
        ),
        (
            "info PICTURE --json",
            &[
                "info a.exr --json",
                "info c.exr --json",
                "info b.film --json",
            ],
        ),
        (
            "explain --json",
            &[
                "explain good.scene.toml --json",
                "explain lamp.scene.toml --json --measure",
            ],
        ),
        (
            "bench --json",
            &[
                "bench --max-n 100 --repeats 2 --seconds 0.01 --json -q",
                "bench good.scene.toml --repeats 1 --seconds 0.01 --json -q",
            ],
        ),
        (
            "stress --json",
            &[
                "stress twice.scene.toml --json -q",
                "stress model.gltf --json -q",
            ],
        ),
        (
            "accuracy --json",
            &[
                "accuracy lamp.scene.toml --budget 3min --size 48x36 --rounds 2 --json -q",
                "accuracy many.scene.toml --budget 3min --size 48x36 --rounds 2 --json -q",
            ],
        ),
        (
            "compare --json",
            &[
                "compare a.exr b.exr --json",
                "compare a.exr b.exr --noise --json",
                "compare c.exr c.exr --json",
            ],
        ),
    ] {
        let mut seen = BTreeSet::new();
        for line in lines {
            let run = words(line);
            assert!(matches!(run.code, Some(0 | 1)), "{line}: {}", run.stderr);
            seen.extend(has_the_documented_keys(from, &json(&run)));
        }
        complete(from, &seen);
    }
}

/// Protects: JSON progress has at least a line after each picture, with the current sample counts
/// and the error of the statistics; it changes no bit.
#[test]
fn progress_is_told_in_json() {
    let sandbox = room();
    let words =
        "render room.scene.toml --integrator path --spp 64 -o a.exr --stats s.json --progress json";
    let run = sandbox.run(&words.split(' ').collect::<Vec<_>>());
    run.exits_with(0);
    let lines: Vec<Value> = run
        .stderr
        .lines()
        .filter(|line| line.starts_with('{'))
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect();
    let last = lines.last().expect("a line");
    for line in &lines {
        has_the_documented_keys("render --progress json", line);
    }
    assert_eq!(
        (&last["samples"], &last["of"]),
        (&Value::from(vec![64, 64]), &64.into())
    );
    assert_eq!(
        (&last["picture"], &last["pictures"], &last["seconds_left"]),
        (&1.into(), &1.into(), &0.0.into())
    );
    let stats: Value =
        serde_json::from_slice(&fs::read(sandbox.path("s.json")).expect("a report")).expect("JSON");
    assert_eq!(last["error"], stats["error"]);
    render(&sandbox, "--spp 64 -o b.exr").exits_with(0);
    assert!(sandbox.picture("a.exr").rgb == sandbox.picture("b.exr").rgb);
}

/// Protects: the hash depends on the pixels alone, one line per file; without metadata equal pixels
/// are equal files, from any command.
#[test]
fn equal_pixels_have_equal_hashes_and_files() {
    let sandbox = room();
    let hash = |words: &str| {
        let run = render(&sandbox, &format!("--hash --spp 2 {words}"));
        run.exits_with(0);
        let lines: Vec<_> = run
            .text()
            .lines()
            .map(|line| line.split_once("  ").expect("two columns"))
            .collect();
        let hash = lines[0].0;
        assert!(
            hash.len() == 64 && hash.bytes().all(|byte| byte.is_ascii_hexdigit()),
            "{hash}"
        );
        assert!(lines.iter().all(|line| line.0 == hash), "{lines:?}");
        (
            hash.to_owned(),
            lines
                .iter()
                .map(|line| line.1.to_owned())
                .collect::<Vec<_>>(),
        )
    };
    let (one, names) = hash("-o a.png -o a.exr --no-metadata --threads 1");
    assert_eq!(names, ["a.png", "a.exr"]);
    assert_eq!(
        hash("-o b.png -o b.exr --no-metadata --accel linear").0,
        one
    );
    assert_ne!(hash("-o c.png -o c.exr --seed 5").0, one);
    let file = |name: &str| fs::read(sandbox.path(name)).expect("a file");
    assert!(file("a.png") == file("b.png") && file("a.exr") == file("b.exr"));
    assert!(sandbox.stored("a.png").texts.is_empty() && sandbox.stored("a.exr").texts.is_empty());
    assert!(!sandbox.stored("c.png").texts.is_empty());
    let several = render(&sandbox, "--hash --spp 2 --views front,top -o v%d.png");
    assert_eq!(several.exits_with(0).text().lines().count(), 2);
    render(&sandbox, "--hash --spp 2 -o -")
        .exits_with(2)
        .prints_like("-o - and --hash both write to standard output");
}

/// Protects: pictures that differ by noise pass, with noise from layers or a film; larger
/// differences fail, with their position; pictures without noise data are refused.
#[test]
fn comparisons_know_noise() {
    let sandbox = room();
    render(
        &sandbox,
        "--spp 64 --aov stderr --seed 1 -o a.exr --checkpoint a.film",
    )
    .exits_with(0);
    render(&sandbox, "--spp 64 --aov stderr --seed 2 -o b.exr -o b.png").exits_with(0);
    let compare = |line: &str| {
        sandbox.run(&[&["compare"], &line.split(' ').collect::<Vec<_>>()[..]].concat())
    };
    for line in [
        "a.exr b.exr --noise",
        "b.exr a.film --noise",
        "a.film a.exr --noise",
    ] {
        let run = compare(line);
        run.exits_with(0).prints("");
        assert!(
            run.text()
                .contains("noise      no difference beyond the noise (expected false alarms: in 1 of 100 comparisons)\n"),
            "{}",
            run.text()
        );
    }
    let mut biased: Picture = sandbox.picture("a.exr");
    for (i, pixel) in (0..).zip(&mut biased.rgb) {
        if i % 70 < 32 && i / 70 >= 18 {
            *pixel = pixel.map(|channel| channel * 1.1);
        }
    }
    write_picture(
        &sandbox.path("c.exr"),
        &biased,
        Display::PLAIN,
        &PictureMetadata::default(),
    )
    .expect("a picture");
    let run = compare("c.exr b.exr --noise --level 0.05 --json");
    run.exits_with(1)
        .prints_like("error: c.exr differs from b.exr: noise: ")
        .prints_like("; the clearest difference is in the block at ");
    let report = json(&run);
    has_the_documented_keys("compare --json", &report);
    let clearest = &report["noise"]["clearest"];
    assert!(
        clearest["x"].as_u64() < Some(32) && clearest["share"].as_f64() > Some(0.03),
        "{report}"
    );
    compare("a.exr b.png --noise")
        .exits_with(3)
        .prints_like("b.png: --noise compares radiance");
    render(&sandbox, "--spp 64 -o d.exr").exits_with(0);
    compare("d.exr d.exr --noise")
        .exits_with(3)
        .prints_like("neither picture has standard errors");
    compare("a.exr b.exr --level 0.1").exits_with(2);
}
