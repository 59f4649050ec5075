//! Mangles files and loads what comes out, for as long as it is told: no file may make the library panic or take long.
//!
//! `cargo run --release -p raywright-io --example mangle -- FOLDER gltf|obj|scene|picture SECONDS [SEED]` takes the files of that
//! kind below the folder in turn and changes bits, numbers and lengths of each at random. What the loader lets through is also
//! prepared and rendered, small. A file that panics or takes more than five seconds of the processor stays behind under the name that is printed, and
//! the exit code is 1. Equal seeds mangle alike.
#![expect(clippy::print_stdout, reason = "a program that reports what it did")]

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use raywright_core::settings::Sampling;
use raywright_core::{Settings, prepare};
use raywright_io::{Input, Limits, LoadOptions, load};

/// Random numbers that depend on the seed alone (Steele, Lea, Flood, "Fast Splittable Pseudorandom Number Generators", 2014).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// Below a bound; zero where there is nothing below it.
    fn below(&mut self, bound: usize) -> usize {
        (self.next() % bound.max(1) as u64) as usize
    }
}

/// Numbers that break what counts, adds and divides.
const NUMBERS: [&str; 12] =
    ["0", "-1", "1", "255", "65536", "2147483648", "4294967295", "4294967296", "1e38", "1e308", "-0.0", "18446744073709551615"];

/// Changes some of a file's bytes.
fn mangle(bytes: &mut Vec<u8>, random: &mut Random) {
    for _ in 0..=random.below(4) {
        let (at, length) = (random.below(bytes.len()), 1 + random.below(16));
        let end = (at + length).min(bytes.len());
        match random.below(8) {
            0 | 1 if !bytes.is_empty() => bytes[at] ^= 1 << random.below(8),
            2 if !bytes.is_empty() => bytes[at] = [0, 0xff, 0x7f, 0x80][random.below(4)],
            3 => drop(bytes.drain(at..end)),
            4 => bytes.truncate(at),
            5 => {
                let copy = bytes[at..end].to_vec();
                let to = random.below(bytes.len());
                bytes.splice(to..to, copy);
            }
            _ => number(bytes, at, random),
        }
    }
}

/// Puts another number in the place of the next one that is written in digits.
fn number(bytes: &mut Vec<u8>, from: usize, random: &mut Random) {
    let Some(start) = bytes.iter().skip(from).position(u8::is_ascii_digit).map(|i| from + i) else { return };
    let length = bytes[start..].iter().take_while(|b| b.is_ascii_digit() || **b == b'.').count();
    bytes.splice(start..start + length, NUMBERS[random.below(NUMBERS.len())].bytes());
}

/// Loads a file and, if it may be rendered, renders a few pixels of it.
fn swallow(path: &Path) {
    let limits = Limits { memory_bytes: 256 << 20, image_pixels: 1 << 22, ..Limits::default() };
    let Ok(loaded) = load(&Input::Path(path.to_owned()), &LoadOptions { limits, ..LoadOptions::default() }) else { return };
    let scene = loaded.scene;
    let settings = Settings { size: [4, 3], sampling: Sampling::resolve(&scene, Some(1)), max_depth: 3, ..Settings::of(&scene) };
    if let Ok(ready) = prepare(&scene, &Settings { max_memory: Some(256 << 20), ..settings }, &()) {
        ready.render(&());
    }
}

/// Files of a kind below a folder, in order.
fn corpus(folder: &Path, endings: &[&str]) -> Vec<PathBuf> {
    let (mut found, mut open) = (Vec::new(), vec![folder.to_owned()]);
    while let Some(next) = open.pop() {
        for entry in std::fs::read_dir(next).into_iter().flatten().flatten() {
            let path = entry.path();
            let name = path.to_string_lossy().to_lowercase();
            if path.is_dir() {
                open.push(path);
            } else if endings.iter().any(|ending| name.ends_with(ending)) {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// Seconds that all threads of this process have spent on a processor, so that what else a machine does counts for nothing; where
/// the system does not tell, those since the start.
fn busy(start: Instant) -> f64 {
    const TICKS: f64 = 100.0;
    let told = std::fs::read_to_string("/proc/self/stat").ok();
    // After the name of the program in brackets, times are the twelfth and the thirteenth word.
    let after = told.as_deref().and_then(|text| text.rsplit(')').next());
    let times = after
        .map(|rest| rest.split_whitespace().skip(11).take(2).filter_map(|word| word.parse::<f64>().ok()).collect::<Vec<_>>());
    match times.as_deref() {
        Some([user, system]) => (user + system) / TICKS,
        _ => start.elapsed().as_secs_f64(),
    }
}

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [folder, kind, seconds, rest @ ..] = words.as_slice() else {
        println!("mangle FOLDER gltf|obj|scene|picture SECONDS [SEED]");
        std::process::exit(2);
    };
    let endings: &[&str] = match kind.as_str() {
        "gltf" => &[".gltf", ".glb"],
        "obj" => &[".obj", ".mtl"],
        "scene" => &[".scene.toml", ".scene.json"],
        _ => &[".png", ".jpg", ".jpeg", ".webp", ".ktx2", ".hdr", ".exr"],
    };
    let (files, seconds) = (corpus(Path::new(folder), endings), seconds.parse().unwrap_or(60.0));
    let seed: u64 = rest.first().and_then(|word| word.parse().ok()).unwrap_or(1);
    let here = std::env::temp_dir().join(format!("mangle-{kind}-{seed}-{}", std::process::id()));
    std::fs::create_dir_all(&here).expect("a folder for mangled files");
    let start = Instant::now();
    let (mut rounds, mut wrong) = (0_u64, 0);
    while !files.is_empty() && start.elapsed() < Duration::from_secs_f64(seconds) {
        let mut random = Random(seed.wrapping_add(rounds.wrapping_mul(0x5851_f42d_4c95_7f2d)));
        let file = &files[random.below(files.len())];
        // What it names lies beside it.
        let folder = here.join("files");
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir_all(&folder).expect("a folder for one file");
        for entry in file.parent().and_then(|parent| std::fs::read_dir(parent).ok()).into_iter().flatten().flatten() {
            if entry.path().is_file() && entry.metadata().is_ok_and(|data| data.len() < 1 << 22) {
                let _ = std::fs::copy(entry.path(), folder.join(entry.file_name()));
            }
        }
        let mut bytes = std::fs::read(file).unwrap_or_default();
        mangle(&mut bytes, &mut random);
        let mut path = folder.join(file.file_name().expect("a file"));
        let _ = std::fs::remove_file(&path);
        std::fs::write(&path, &bytes).expect("a mangled file");
        if endings.contains(&".mtl") && path.extension().is_some_and(|ending| ending == "mtl") {
            path = path.with_extension("obj");
        } else if endings.contains(&".png") {
            let scene = format!(
                "format = 1\nsky.constant = 1\nimages = [{{ name = 'a', path = '{}' }}]\ntextures = [{{ name = 'a', image = 'a' }}]\n\
                materials = [{{ name = 'm', model.physical.base_colour_texture.name = 'a' }}]\n\
                objects = [{{ shape.sphere = {{ centre = [0, 0, 0], radius = 1 }}, material = 'm' }}]\n",
                path.file_name().map(|name| name.to_string_lossy()).unwrap_or_default()
            );
            path = folder.join("mangled.scene.toml");
            std::fs::write(&path, scene).expect("a scene");
        }
        let begun = busy(start);
        let sound = std::panic::catch_unwind(|| swallow(&path)).is_ok();
        let spent = busy(start) - begun;
        if !sound || spent > 5.0 {
            wrong += 1;
            let kept = here.join(format!("{}-{rounds}", if sound { "slow" } else { "panic" }));
            let _ = std::fs::rename(&folder, &kept);
            println!("{}: {} ({spent:.1} s)", kept.display(), file.display());
        }
        rounds += 1;
    }
    println!(
        "{rounds} files of {} kinds in {:.0} s, {:.0} s on a processor, {wrong} wrong",
        files.len(),
        start.elapsed().as_secs_f64(),
        busy(start)
    );
    std::process::exit(i32::from(wrong > 0));
}
