//! Scaling of load times: for each kind of item that a scene may contain many times, the time to
//! read and check its file, and to explain and prepare it, for 10³, 10⁴ and 10⁵ items.
//! `tests/integration/many.rs` checks that the time stays linear.
//!
//! `cargo bench --bench loading -- sheet [SIDE]` loads a generated GLB file of 2·SIDE² triangles
//! (five million) beside the necessary minimum, reading its bytes and building its tree, and prints
//! the memory; `-- model FILE` times a whole run over a model beside decoding its largest image.
#![expect(clippy::print_stdout, reason = "the table is this program's result")]

#[path = "support/many.rs"]
mod many;
#[path = "support/sheet.rs"]
mod sheet;

use std::path::Path;
use std::process::Command;
use std::time::Instant;

use raywright::bvh::{AcceleratorKind, Geometry, PrimitiveSet, Visibility};
use raywright::core::bench::clock::process_seconds;
use raywright::core::scene::MeshSource;

use raywright::core::effects::assess_effects;
use raywright::core::{Settings, prepare};
use raywright::io::{Input, LoadOptions, load};

use many::{FAMILIES, SceneFamily};

const ROUNDS: usize = 3;
const SIZES: [usize; 3] = [1_000, 10_000, 100_000];

fn main() {
    // `cargo test` and a listing of the benches do not measure.
    if std::env::args().any(|argument| ["--test", "--list"].contains(&argument.as_str())) {
        return;
    }
    let words: Vec<String> = std::env::args()
        .skip(1)
        .filter(|word| !word.starts_with("--"))
        .collect();
    match words.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["sheet", ref rest @ ..] => {
            return sheet_beside_its_tree(
                rest.first()
                    .and_then(|side| side.parse().ok())
                    .unwrap_or(1581),
            );
        }
        ["model", file] => return run_beside_an_image(Path::new(file)),
        ["decode", file] => return drop(decoded(&std::fs::read(file).expect("a file"))),
        _ => {}
    }
    println!(
        "seconds to load + explain and prepare, the least of {ROUNDS}; exponent from {} to {}",
        SIZES[0], SIZES[2]
    );
    for family in &FAMILIES {
        let times = SIZES.map(|n| least(family, n));
        let exponent = (times[2].iter().sum::<f64>() / times[0].iter().sum::<f64>()).log10() / 2.0;
        let cells = times.map(|[load, rest]| format!("{load:.3} + {rest:.3}"));
        println!(
            "| {:40} | {} | {exponent:.2} |",
            family.0,
            cells.join(" | ")
        );
    }
}

/// The least times of several rounds: to load, and for the rest.
fn least((label, write): &SceneFamily, n: usize) -> [f64; 2] {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let files = write(n);
    for (name, contents) in &files {
        std::fs::write(folder.path().join(name), contents).expect("the folder can be written to");
    }
    let path = folder.path().join(files[0].0);
    let round = || {
        let start = Instant::now();
        let loaded = load(&Input::Path(path.clone()), &LoadOptions::default())
            .unwrap_or_else(|e| panic!("{label}: {e}"));
        let load = start.elapsed().as_secs_f64();
        let start = Instant::now();
        let settings = Settings {
            size: [8, 8],
            ..Settings::from_scene(&loaded.scene)
        };
        let report = assess_effects(&loaded.scene, &settings);
        let ready =
            prepare(&loaded.scene, &settings, &()).unwrap_or_else(|e| panic!("{label}: {e}"));
        let rest = start.elapsed().as_secs_f64();
        drop((report, ready));
        [load, rest]
    };
    (0..ROUNDS)
        .map(|_| round())
        .fold([f64::INFINITY; 2], |least, times| {
            [least[0].min(times[0]), least[1].min(times[1])]
        })
}

/// Peak resident memory in bytes, from Linux; zero elsewhere.
fn peak_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))
        .unwrap_or_default();
    line.trim()
        .trim_end_matches(" kB")
        .parse::<u64>()
        .unwrap_or_default()
        * 1024
}

/// CPU seconds of all threads for some work, and its result.
fn timed<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let start = process_seconds();
    let made = work();
    (process_seconds() - start, made)
}

/// Import and preparation of a large file, beside the unavoidable part of both: in CPU seconds, in
/// turns, since machines are shared.
fn sheet_beside_its_tree(side: u32) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("sheet.glb");
    sheet::write(&path, side).expect("the file can be written");
    let (mut ratios, mut peak) = (Vec::new(), 0);
    println!(
        "{} triangles, {} bytes",
        2 * u64::from(side).pow(2),
        path.metadata().map_or(0, |data| data.len())
    );
    for _ in 0..ROUNDS {
        let (import, loaded) = timed(|| {
            load(&Input::Path(path.clone()), &LoadOptions::default())
                .unwrap_or_else(|e| panic!("{e}"))
        });
        let settings = Settings {
            size: [8, 8],
            ..Settings::from_scene(&loaded.scene)
        };
        let (preparation, ready) =
            timed(|| prepare(&loaded.scene, &settings, &()).unwrap_or_else(|e| panic!("{e}")));
        let MeshSource::Inline(data) = &loaded.scene.meshes[0].source else {
            panic!("inline")
        };
        let whole = ready.memory().total();
        // Only in the first round has the process done nothing else.
        if peak == 0 {
            peak = peak_bytes();
            println!(
                "peak {:.2} of the scene's {:.0} MB",
                peak as f64 / whole as f64,
                whole as f64 / 1e6
            );
        }
        drop(ready);
        let mut group = PrimitiveSet::<f32>::default();
        let corner = |i: u32| data.positions.position(i as usize).as_vec3();
        group
            .add_mesh(
                data.indices.iter().map(|triangle| triangle.map(corner)),
                Visibility::default(),
            )
            .expect("triangles");
        let (tree, geometry) = timed(|| Geometry::new(group, AcceleratorKind::default()));
        drop((geometry, loaded));
        let (reading, bytes) = timed(|| std::fs::read(&path).expect("the file"));
        drop(bytes);
        let ratio = (import + preparation) / (reading + tree);
        println!(
            "import {import:.2} s + preparation {preparation:.2} s; reading {reading:.2} s + tree {tree:.2} s; ratio {ratio:.2}"
        );
        ratios.push(ratio);
    }
    ratios.sort_by(f64::total_cmp);
    println!(
        "median ratio {:.2}, {:.2} to {:.2}",
        ratios[ROUNDS / 2],
        ratios[0],
        ratios[ROUNDS - 1]
    );
}

fn decoded(file: &[u8]) -> Vec<u8> {
    image::load_from_memory(file)
        .expect("an image")
        .into_rgba8()
        .into_vec()
}

/// Milliseconds of a process from start to end.
fn run(command: &mut Command) -> f64 {
    let start = Instant::now();
    let status = command.status().expect("it starts");
    let seconds = start.elapsed().as_secs_f64();
    assert!(status.success());
    1e3 * seconds
}

/// The program from its start until a model is prepared, beside a process that only decodes the
/// model's largest image, in turns. A new process touches all of its memory for the first time,
/// which takes longer than the work. Repeated decoding within one process is timed too.
fn run_beside_an_image(path: &Path) {
    const ROUNDS: usize = 40;
    let loaded = load(&Input::Path(path.to_owned()), &LoadOptions::default())
        .unwrap_or_else(|e| panic!("{e}"));
    let images = loaded
        .scene
        .images
        .iter()
        .filter_map(|image| image.data.as_ref());
    let largest = images
        .max_by_key(|data| data.byte_size())
        .expect("a model with an image");
    let raywright::core::scene::PixelData::Codes(codes) = &largest.pixels else {
        panic!("an image of eight bits")
    };
    let file = largest_image(path, [largest.width, largest.height]);
    assert_eq!(decoded(&file).len(), 4 * codes.len());
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (image, path) = (
        folder.path().join("image"),
        path.canonicalize().expect("a file"),
    );
    std::fs::write(&image, &file).expect("the folder can be written to");
    let own = std::env::current_exe().expect("a program");
    let mut rows: [Vec<f64>; 5] = Default::default();
    for _ in 0..ROUNDS {
        let start = Instant::now();
        let pixels = decoded(&file);
        let warm = 1e3 * start.elapsed().as_secs_f64();
        drop(pixels);
        let process = run(Command::new(&own).arg("decode").arg(&image));
        let mut render = Command::new(env!("CARGO_BIN_EXE_raywright"));
        render
            .args([
                "render",
                "-q",
                "--size",
                "1x1",
                "--spp",
                "1",
                "-o",
                "pixel.png",
            ])
            .arg(&path)
            .current_dir(folder.path());
        let whole = run(&mut render);
        // A separate run, since the time to write the statistics comes after preparation and would
        // be included.
        run(render.args(["--stats", "run.json"]));
        let stats = std::fs::read(folder.path().join("run.json")).expect("statistics");
        let stats: serde_json::Value = serde_json::from_slice(&stats).expect("JSON");
        let of = |stage: &str| 1e3 * stats["seconds"][stage].as_f64().expect("seconds");
        let prepared = whole - of("render") - of("write");
        let found = [
            warm,
            of("load") + of("prepare"),
            process,
            prepared,
            prepared / process,
        ];
        rows.iter_mut()
            .zip(found)
            .for_each(|(row, value)| row.push(value));
    }
    rows.iter_mut().for_each(|row| row.sort_by(f64::total_cmp));
    let told = rows.map(|row| {
        format!(
            "{:.2} ({:.2} to {:.2})",
            row[ROUNDS / 2],
            row[ROUNDS / 4],
            row[3 * ROUNDS / 4]
        )
    });
    println!("median of {ROUNDS} (quartiles), milliseconds");
    println!("decoding the image again and again   {}", told[0]);
    println!("loading and preparing                {}", told[1]);
    println!("a process that decodes the image     {}", told[2]);
    println!("the program until it is prepared     {}", told[3]);
    println!("of the last two, one by the other    {}", told[4]);
}

/// The bytes of the image of the given size in a GLB file, found by its signature, since this bench
/// has no glTF reader.
fn largest_image(path: &Path, size: [u32; 2]) -> Vec<u8> {
    let bytes = std::fs::read(path).expect("a file");
    let starts = (0..bytes.len()).filter(|&at| {
        bytes[at..].starts_with(b"\x89PNG") || bytes[at..].starts_with(b"\xff\xd8\xff")
    });
    let decodes = |at: &usize| {
        let reader = image::ImageReader::new(std::io::Cursor::new(&bytes[*at..]))
            .with_guessed_format()
            .ok();
        reader.and_then(|reader| reader.into_dimensions().ok()) == Some((size[0], size[1]))
    };
    let start = starts
        .into_iter()
        .find(decodes)
        .expect("a PNG or JPEG in the file");
    bytes[start..].to_vec()
}
