//! Fuzzer of the loaders: mangles files and loads the results, for a given time. No file may make
//! the library panic or take long.
//!
//! `cargo run --release -p raywright-io --example mangle -- FOLDER.. gltf|obj|stl|ply|scene|picture
//! SECONDS [SEED]` takes the files of that kind below the folders, cheapest so far first, and
//! changes random bits, numbers, lines and lengths, or the values of their JSON. Every fourth file
//! that loads is also prepared and rendered at a small size. The run lasts this many seconds of
//! *CPU time*, over all threads. A file that panics or takes more than five such seconds is kept
//! under the printed name, and the exit code is 1; a file that ends the whole process is in the
//! folder named at the start. A mangled file depends on seed, place in the list and round. Set
//! `TMPDIR` to a folder in memory.
#![expect(clippy::print_stdout, reason = "a program that reports what it did")]

mod bytes;
mod glb;
mod random;
mod sandbox_folder;
mod tree;

use std::path::{Path, PathBuf};
use std::time::Instant;

use raywright_core::settings::Sampling;
use raywright_core::{Settings, prepare};
use raywright_io::{Input, Limits, LoadOptions, load};
use serde_json::Value;

use random::MangleRng;
use sandbox_folder::MangleFolder;
use tree::Pool;

/// Largest CPU seconds of a file.
const SLOW: f64 = 5.0;

/// CPU seconds between reports.
const EVERY: f64 = 60.0;

/// A kind of file: its name, the extensions of the mangled files, and pairs of extensions for files
/// that are loaded through a companion file.
type FileKind = (
    &'static str,
    &'static [&'static str],
    &'static [(&'static str, &'static str)],
);

const KINDS: [FileKind; 6] = [
    ("gltf", &[".gltf", ".glb", ".bin"], &[("bin", "gltf")]),
    ("obj", &[".obj", ".mtl"], &[("mtl", "obj")]),
    ("stl", &[".stl"], &[]),
    ("ply", &[".ply"], &[]),
    ("scene", &[".scene.toml", ".scene.json"], &[]),
    (
        "picture",
        &[".png", ".jpg", ".jpeg", ".webp", ".ktx2", ".hdr", ".exr"],
        &[],
    ),
];

/// A file of the corpus.
struct Seed {
    path: PathBuf,
    bytes: Vec<u8>,
    /// Its values, for JSON, GLB or TOML.
    tree: Option<Value>,
    /// CPU seconds spent on it.
    spent: f64,
    rounds: u64,
}

/// Parses a JSON, GLB or TOML file.
fn tree_of(name: &str, bytes: &[u8]) -> Option<Value> {
    if name.ends_with(".toml") {
        return tree::of_toml(std::str::from_utf8(bytes).ok()?);
    }
    serde_json::from_slice(glb::parts(bytes).map_or(bytes, |(json, _)| json)).ok()
}

/// Lists the files of a kind below some folders, in order, without those above four megabytes,
/// which would take all the time.
fn corpus(folders: &[String], endings: &[&str]) -> Vec<Seed> {
    let (mut found, mut open): (Vec<PathBuf>, Vec<PathBuf>) =
        (Vec::new(), folders.iter().map(PathBuf::from).collect());
    while let Some(next) = open.pop() {
        for path in std::fs::read_dir(next)
            .into_iter()
            .flatten()
            .flatten()
            .map(|entry| entry.path())
        {
            let name = path.to_string_lossy().to_lowercase();
            if path.is_dir() {
                open.push(path);
            } else if endings.iter().any(|ending| name.ends_with(ending)) {
                found.push(path);
            }
        }
    }
    found.sort();
    let seed = |path: PathBuf| {
        let bytes = std::fs::read(&path)
            .ok()
            .filter(|bytes| bytes.len() < 1 << 22)?;
        Some(Seed {
            tree: tree_of(&path.to_string_lossy(), &bytes),
            path,
            bytes,
            spent: 0.0,
            rounds: 0,
        })
    };
    found.into_iter().filter_map(seed).collect()
}

/// Returns the bytes of a mangled file, and its extension if changed.
fn mangled(seed: &Seed, pool: &Pool, rng: &mut MangleRng) -> (Vec<u8>, Option<&'static str>) {
    let name = seed.path.to_string_lossy().to_lowercase();
    let mut bytes = seed.bytes.clone();
    if let Some(mut tree) = seed.tree.clone().filter(|_| rng.below(4) > 0) {
        tree::mangle(&mut tree, pool, rng);
        let json = tree.to_string().into_bytes();
        let Some((_, rest)) = glb::parts(&seed.bytes) else {
            return (json, name.ends_with(".toml").then_some("json"));
        };
        let mut rest = rest.to_vec();
        if rng.below(3) == 0 && rest.len() > 8 {
            let mut data = rest.split_off(8);
            bytes::mangle(&mut data, rng);
            rest.append(&mut data);
        }
        bytes = glb::container(json, &rest);
        if rng.below(8) == 0 {
            glb::break_length(&mut bytes, rng);
        }
        return (bytes, None);
    }
    match name.rsplit('.').next() {
        Some("obj" | "mtl" | "stl" | "ply" | "toml") if rng.below(2) == 0 => {
            bytes::mangle_lines(&mut bytes, rng)
        }
        _ => bytes::mangle(&mut bytes, rng),
    }
    if name.ends_with(".png") && rng.below(4) > 0 {
        bytes::mend_png(&mut bytes);
    }
    (bytes, None)
}

/// Loads a file and, if requested and possible, renders a few pixels. Returns whether it loads.
fn swallow(path: &Path, renders: bool) -> bool {
    let limits = Limits {
        memory_bytes: 256 << 20,
        image_pixels: 1 << 22,
        ..Limits::default()
    };
    let Ok(loaded) = load(
        &Input::Path(path.to_owned()),
        &LoadOptions {
            limits,
            ..LoadOptions::default()
        },
    ) else {
        return false;
    };
    if !renders {
        return true;
    }
    let scene = loaded.scene;
    let settings = Settings {
        size: [4, 3],
        sampling: Sampling::from_spp(&scene, Some(1)),
        max_depth: 3,
        ..Settings::from_scene(&scene)
    };
    if let Ok(ready) = prepare(
        &scene,
        &Settings {
            max_memory: Some(256 << 20),
            ..settings
        },
        &(),
    ) {
        ready.render(&());
    }
    true
}

/// Path to load for a written file: the file itself, or its companion.
fn entrance(path: &Path, (kind, _, named): &FileKind) -> PathBuf {
    let ending = path
        .extension()
        .map(|ending| ending.to_string_lossy().to_lowercase())
        .unwrap_or_default();
    if let Some((_, by)) = named.iter().find(|(label, _)| *label == ending) {
        return path.with_extension(by);
    }
    if *kind != "picture" {
        return path.to_owned();
    }
    let name = path
        .file_name()
        .map(|name| name.to_string_lossy())
        .unwrap_or_default();
    let scene = match ending.as_str() {
        "hdr" | "exr" => format!(
            "format = 1\nimages = [{{ name = 'a', path = '{name}' }}]\nsky.image.name = 'a'\n"
        ),
        _ => format!(
            "format = 1\nsky.constant = 1\nimages = [{{ name = 'a', path = '{name}' }}]\ntextures = [{{ name = 'a', image = 'a' }}]\n\
            materials = [{{ name = 'm', model.physical.base_colour_texture.name = 'a' }}]\n\
            objects = [{{ shape.sphere = {{ centre = [0, 0, 0], radius = 1 }}, material = 'm' }}]\n"
        ),
    };
    let path = path.with_file_name("mangled.scene.toml");
    std::fs::write(&path, scene).expect("a scene");
    path
}

/// Reads a figure of this process from `/proc/self`, if the system has it.
fn told(file: &str, figure: impl Fn(&str) -> Option<f64>) -> Option<f64> {
    std::fs::read_to_string(Path::new("/proc/self").join(file))
        .ok()
        .and_then(|text| figure(&text))
}

/// CPU seconds of all threads of this process, independent of other programs; wall-clock seconds
/// since the start where the system does not report them.
fn busy(start: Instant) -> f64 {
    const TICKS: f64 = 100.0;
    // After the program's name in brackets, the times are the twelfth and the thirteenth word.
    let ticks = |text: &str| {
        let words = text.rsplit(')').next()?.split_whitespace().skip(11).take(2);
        words
            .map(|word| word.parse::<f64>().ok())
            .sum::<Option<f64>>()
    };
    told("stat", ticks).map_or_else(|| start.elapsed().as_secs_f64(), |ticks| ticks / TICKS)
}

/// State of a run.
struct MangleRun {
    kind: &'static FileKind,
    number: u64,
    seeds: Vec<Seed>,
    pool: Pool,
    sandbox: MangleFolder,
    start: Instant,
    rounds: u64,
    loaded: u64,
    wrong: u64,
}

impl MangleRun {
    /// Mangles and loads the cheapest file so far; returns false without any file.
    fn round(&mut self) -> bool {
        let by_cost =
            |a: &(usize, &mut Seed), b: &(usize, &mut Seed)| a.1.spent.total_cmp(&b.1.spent);
        let Some((index, seed)) = self.seeds.iter_mut().enumerate().min_by(by_cost) else {
            return false;
        };
        let (bytes, ending) = mangled(
            seed,
            &self.pool,
            &mut MangleRng::new(self.number, index, seed.rounds),
        );
        let folder = self.sandbox.folder(&seed.path);
        let own = folder.join(seed.path.file_name().expect("a file"));
        let path = ending.map_or(own.clone(), |ending| own.with_extension(ending));
        std::fs::write(&path, &bytes).expect("a mangled file");
        let (begun, before) = (Instant::now(), busy(self.start));
        let renders = seed.rounds % 4 == 0;
        let outcome = std::panic::catch_unwind(|| swallow(&entrance(&path, self.kind), renders));
        let spent = busy(self.start) - before;
        // Clock ticks are too coarse for a small file.
        seed.spent += begun.elapsed().as_secs_f64();
        if outcome.is_err() || spent > SLOW {
            self.wrong += 1;
            let kept = format!(
                "{}-{index}-{}",
                if outcome.is_ok() { "slow" } else { "panic" },
                seed.rounds
            );
            let kept = self.sandbox.keep(&folder, &kept);
            println!("{}: {} ({spent:.1} s)", kept.display(), seed.path.display());
        }
        seed.rounds += 1;
        self.rounds += 1;
        self.loaded += u64::from(outcome.unwrap_or(false));
        std::fs::write(&own, &seed.bytes).expect("the file as it was");
        true
    }

    /// Prints the progress.
    fn report(&self) {
        let high = |text: &str| {
            text.lines().find_map(|line| {
                line.strip_prefix("VmHWM:")?
                    .trim()
                    .trim_end_matches(" kB")
                    .parse()
                    .ok()
            })
        };
        println!(
            "{} mangled files of {} kinds, {} of which load, in {:.0} s on a processor ({:.0} s by the clock), {:.0} MB at most, {} wrong",
            self.rounds,
            self.seeds.len(),
            self.loaded,
            busy(self.start),
            self.start.elapsed().as_secs_f64(),
            told("status", high).unwrap_or(0.0) / 1000.0,
            self.wrong
        );
    }
}

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let place = words
        .iter()
        .position(|word| KINDS.iter().any(|kind| kind.0 == word));
    let Some((folders, rest)) = place
        .filter(|&index| index > 0)
        .map(|index| words.split_at(index))
    else {
        println!("mangle FOLDER.. gltf|obj|stl|ply|scene|picture SECONDS [SEED]");
        std::process::exit(2);
    };
    let kind = KINDS
        .iter()
        .find(|kind| kind.0 == rest[0])
        .expect("a kind that was found");
    let seconds: f64 = rest
        .get(1)
        .and_then(|word| word.parse().ok())
        .unwrap_or(60.0);
    let number: u64 = rest.get(2).and_then(|word| word.parse().ok()).unwrap_or(1);
    let seeds = corpus(folders, kind.1);
    let mut pool = Pool::default();
    seeds
        .iter()
        .filter_map(|seed| seed.tree.as_ref())
        .for_each(|tree| pool.add(tree));
    let sandbox = MangleFolder::new(&format!(
        "mangle-{}-{number}-{}",
        kind.0,
        std::process::id()
    ));
    println!(
        "{} files to mangle, in {}",
        seeds.len(),
        sandbox.here().display()
    );
    let mut run = MangleRun {
        kind,
        number,
        seeds,
        pool,
        sandbox,
        start: Instant::now(),
        rounds: 0,
        loaded: 0,
        wrong: 0,
    };
    let mut reported = EVERY;
    while busy(run.start) < seconds && run.round() {
        if busy(run.start) >= reported {
            run.report();
            reported += EVERY;
        }
    }
    run.report();
    run.sandbox.clear();
    std::process::exit(i32::from(run.wrong > 0));
}
