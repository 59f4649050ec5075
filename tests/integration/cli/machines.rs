//! What scripts rely on: verdicts on many files, JSON of documented layouts, progress in JSON, hashes, and comparisons that know noise.

use std::collections::BTreeSet;
use std::fs;

use raywright::core::picture::Picture;
use raywright::io::output::{Metadata, write_exr};
use serde_json::Value;

use super::films::{desk as room, render};
use crate::support::{Desk, Run};

const GOOD: &str = "format = 1\nsky.constant = 1\n[[materials]]\nname = \"m\"\nmodel.classic = {}\n\
    [[objects]]\nmaterial = \"m\"\nshape.sphere = { centre = [0, 0, 0], radius = 1 }\n";

fn json(run: &Run) -> Value {
    serde_json::from_str(run.text()).expect("JSON")
}

/// Protects: each of many files gets its verdict, for people and for scripts, and the first wrong one decides the exit code; warnings are
/// errors on request, and a scene with nothing in it is warned of.
#[test]
fn many_files_are_checked() {
    let desk = Desk::new();
    desk.write("good.scene.toml", GOOD);
    desk.write("empty.scene.toml", "format = 1\n");
    desk.write("bad.scene.toml", "format = 1\nobjcts = []\n");
    let nothing = "empty.scene.toml: there is nothing to see: it has no object";
    let both = ["check", "good.scene.toml", "empty.scene.toml"];
    let run = desk.run(&both);
    run.exits_with(0).says(&format!("warning: {nothing}"));
    assert_eq!(run.text(), "good.scene.toml: ok\nempty.scene.toml: ok, 1 warning\n");
    desk.run(&[&both[..], &["--deny-warnings"]].concat())
        .exits_with(3)
        .says_like("error: empty.scene.toml: 1 warning, and --deny-warnings allows none\nerror: 1 of 2 files are not right");
    let all = ["check", "good.scene.toml", "gone.glb", "bad.scene.toml", "empty.scene.toml"];
    desk.run(&all).exits_with(4).says_like("unknown key `objcts`").says_like("error: 2 of 4 files are not right");
    let run = desk.run(&[&all[..], &["--json", "--deny-warnings"]].concat());
    run.exits_with(4);
    let report = json(&run);
    let of = |key: &str| report["files"].as_array().expect("a list").iter().map(|file| file[key].clone()).collect::<Vec<Value>>();
    assert_eq!(of("code"), [0, 4, 3, 3].map(Value::from));
    assert_eq!(of("ok"), [true, false, false, false].map(Value::from));
    assert_eq!(of("warnings")[3], Value::from(vec![nothing]));
    assert!(of("error")[2].as_str().is_some_and(|error| error.contains("unknown key `objcts`")), "{report}");
}

/// The keys that docs/machines.md lists of what a command prints: those that are always there, and those in brackets.
fn documented(from: &str) -> [BTreeSet<String>; 2] {
    let page = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/machines.md")).expect("the page");
    let row = page.lines().find(|line| line.starts_with(&format!("| `{from}` |"))).unwrap_or_else(|| panic!("no row of {from}"));
    let keys = row.split('|').nth(3).expect("three columns");
    let (always, sometimes) = keys.split_once('[').unwrap_or((keys, ""));
    [always, sometimes].map(|keys| keys.split('`').skip(1).step_by(2).map(str::to_owned).collect())
}

#[track_caller]
fn has_the_documented_keys(from: &str, found: &Value) {
    let [mut always, sometimes] = documented(from);
    always.insert("format".to_owned());
    assert_eq!(found["format"], 1, "{from}");
    let keys: BTreeSet<String> = found.as_object().expect("an object").keys().cloned().collect();
    let missing: Vec<_> = always.difference(&keys).collect();
    let unknown: Vec<_> = keys.iter().filter(|key| !always.contains(*key) && !sometimes.contains(*key)).collect();
    assert!(missing.is_empty() && unknown.is_empty(), "{from}: missing {missing:?}, not documented {unknown:?}");
}

/// Protects: every JSON has the keys that its page documents, no more and no fewer, and a version.
#[test]
fn layouts_are_those_of_the_page() {
    let desk = Desk::new();
    desk.write("good.scene.toml", GOOD);
    let words = |line: &str| desk.run(&line.split(' ').collect::<Vec<_>>());
    for (from, line) in [
        ("check --json", "check good.scene.toml --json"),
        ("info --json", "info good.scene.toml --json"),
        ("explain --json", "explain good.scene.toml --json"),
        ("bench --json", "bench good.scene.toml --repeats 1 --seconds 0.01 --json -q"),
        ("accuracy --json", "accuracy good.scene.toml --budget 1s --size 8x8 --json -q"),
    ] {
        let run = words(line);
        run.exits_with(0);
        has_the_documented_keys(from, &json(&run));
    }
    words("render good.scene.toml -s 8x8 --spp 4 -q -o a.exr --stats s.json").exits_with(0);
    let stats = fs::read_to_string(desk.path("s.json")).expect("a report");
    has_the_documented_keys("render --stats", &serde_json::from_str(&stats).expect("JSON"));
    has_the_documented_keys("compare --json", &json(&words("compare a.exr a.exr --json")));
}

/// Protects: progress in JSON is a line after each picture at least, with the samples that there are and the error that the statistics have; it
/// changes no bit.
#[test]
fn progress_is_told_in_json() {
    let desk = room();
    let words = "render room.scene.toml --integrator path --spp 64 -o a.exr --stats s.json --progress json";
    let run = desk.run(&words.split(' ').collect::<Vec<_>>());
    run.exits_with(0);
    let lines: Vec<Value> =
        run.stderr.lines().filter(|line| line.starts_with('{')).map(|line| serde_json::from_str(line).expect("JSON")).collect();
    let last = lines.last().expect("a line");
    lines.iter().for_each(|line| has_the_documented_keys("render --progress json", line));
    assert_eq!((&last["samples"], &last["of"]), (&Value::from(vec![64, 64]), &64.into()));
    assert_eq!((&last["picture"], &last["pictures"], &last["seconds_left"]), (&1.into(), &1.into(), &0.0.into()));
    let stats: Value = serde_json::from_slice(&fs::read(desk.path("s.json")).expect("a report")).expect("JSON");
    assert_eq!(last["error"], stats["error"]);
    render(&desk, "--spp 64 -o b.exr").exits_with(0);
    assert!(desk.picture("a.exr").rgb == desk.picture("b.exr").rgb);
}

/// Protects: the hash is that of the pixels alone, one line a picture; without metadata equal pixels are equal files, whatever made them.
#[test]
fn equal_pixels_have_equal_hashes_and_files() {
    let desk = room();
    let hash = |words: &str| {
        let run = render(&desk, &format!("--hash --spp 2 {words}"));
        run.exits_with(0);
        let (hash, name) = run.text().split_once("  ").expect("two columns");
        assert!(hash.len() == 64 && hash.bytes().all(|byte| byte.is_ascii_hexdigit()), "{hash}");
        (hash.to_owned(), name.trim_end().to_owned())
    };
    let (one, name) = hash("-o a.png -o a.exr --no-metadata --threads 1");
    assert_eq!(name, "a.png");
    assert_eq!(hash("-o b.png -o b.exr --no-metadata --accel linear").0, one);
    assert_ne!(hash("-o c.png -o c.exr --seed 5").0, one);
    let file = |name: &str| fs::read(desk.path(name)).expect("a file");
    assert!(file("a.png") == file("b.png") && file("a.exr") == file("b.exr"));
    assert!(desk.stored("a.png").texts.is_empty() && desk.stored("a.exr").texts.is_empty());
    assert!(!desk.stored("c.png").texts.is_empty());
    let several = render(&desk, "--hash --spp 2 --views front,top -o v%d.png");
    assert_eq!(several.exits_with(0).text().lines().count(), 2);
    render(&desk, "--hash --spp 2 -o -").exits_with(2).says_like("-o - and --hash both write to standard output");
}

/// Protects: pictures that differ by noise pass, by their layers or a film, and those that differ by more do not, which is said with its place;
/// what tells no noise is refused.
#[test]
fn comparisons_know_noise() {
    let desk = room();
    render(&desk, "--spp 64 --aov stderr --seed 1 -o a.exr --checkpoint a.film").exits_with(0);
    render(&desk, "--spp 64 --aov stderr --seed 2 -o b.exr -o b.png").exits_with(0);
    let compare = |line: &str| desk.run(&[&["compare"], &line.split(' ').collect::<Vec<_>>()[..]].concat());
    for line in ["a.exr b.exr --noise", "b.exr a.film --noise", "a.film a.exr --noise"] {
        let run = compare(line);
        run.exits_with(0).says("");
        assert!(run.text().contains("noise      nothing beyond it (a false alarm in 1 of 100 comparisons)\n"), "{}", run.text());
    }
    let mut biased: Picture = desk.picture("a.exr");
    for (i, pixel) in (0..).zip(&mut biased.rgb) {
        if i % 70 < 32 && i / 70 >= 18 {
            *pixel = pixel.map(|channel| channel * 1.1);
        }
    }
    write_exr(&desk.path("c.exr"), &biased, &Metadata::default()).expect("a picture");
    let run = compare("c.exr b.exr --noise --level 0.05 --json");
    run.exits_with(1).says_like("error: c.exr differs from b.exr: noise: ").says_like("; the clearest at ");
    let report = json(&run);
    has_the_documented_keys("compare --json", &report);
    let clearest = &report["noise"]["clearest"];
    assert!(clearest["x"].as_u64() < Some(32) && clearest["share"].as_f64() > Some(0.03), "{report}");
    compare("a.exr b.png --noise").exits_with(3).says_like("b.png: --noise is about radiance");
    render(&desk, "--spp 64 -o d.exr").exits_with(0);
    compare("d.exr d.exr --noise").exits_with(3).says_like("neither says how much noise it has");
    compare("a.exr b.exr --level 0.1").exits_with(2);
}
