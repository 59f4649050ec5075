//! Damaged files by the thousand: every truncation of small files, random flips, and false numbers.
//! No file may panic, and every file that still loads must be a valid scene.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use crate::built;
use crate::shared::{assets, check_sound, try_load};

/// A pseudo-random generator (xorshift; Marsaglia 2003), with the same damage in every run.
struct DamageRng(u64);

impl DamageRng {
    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % n.max(1) as u64) as usize
    }
}

/// A copy of a file's folder, in which the file is replaced repeatedly.
struct Victim {
    _folder: tempfile::TempDir,
    path: PathBuf,
    bytes: Vec<u8>,
}

impl Victim {
    fn of(source: &Path) -> Self {
        let folder = tempfile::tempdir().unwrap();
        for entry in std::fs::read_dir(source.parent().unwrap()).unwrap() {
            let entry = entry.unwrap().path();
            if entry.is_file() && std::fs::metadata(&entry).unwrap().len() < 2_000_000 {
                std::fs::copy(&entry, folder.path().join(entry.file_name().unwrap())).unwrap();
            }
        }
        let path = folder.path().join(source.file_name().unwrap());
        Self {
            _folder: folder,
            path,
            bytes: std::fs::read(source).unwrap(),
        }
    }

    /// Loads the file with other bytes; returns whether it loads.
    fn survives(&self, bytes: &[u8], label: &str) -> bool {
        replace(&self.path, bytes);
        let outcome = catch_unwind(AssertUnwindSafe(|| match try_load(&self.path) {
            Ok(loaded) => {
                check_sound(&loaded, &self.path);
                true
            }
            Err(error) => {
                assert!(!error.to_string().is_empty());
                false
            }
        }));
        outcome.unwrap_or_else(|_| panic!("{}: {label}", self.path.display()))
    }
}

/// Rewrites a file. The old file is removed first: file systems flush a file that is truncated and
/// rewritten, which takes milliseconds.
fn replace(path: &Path, bytes: &[u8]) {
    std::fs::remove_file(path).unwrap();
    std::fs::write(path, bytes).unwrap();
}

/// Adjusts the lengths in a GLB's headers to a truncated file, so that the damage gets past the
/// container.
fn with_fitting_lengths(mut bytes: Vec<u8>) -> Vec<u8> {
    let length = bytes.len() as u32;
    if bytes.starts_with(b"glTF") && length >= 20 {
        bytes[8..12].copy_from_slice(&length.to_le_bytes());
        let json = u32::from_le_bytes(bytes[12..16].try_into().unwrap());
        if json > length - 20 {
            bytes[12..16].copy_from_slice(&(length - 20).to_le_bytes());
        } else if json + 28 <= length {
            let position = 20 + json as usize;
            bytes[position..position + 4].copy_from_slice(&(length - 28 - json).to_le_bytes());
        }
    }
    bytes
}

const SMALL: [&str; 6] = [
    "malformed/control_good.glb",
    "gltf/crafted/quantized.glb",
    "gltf/crafted/sparse_positions.glb",
    "gltf/crafted/lights_punctual.glb",
    "gltf/SimpleSparseAccessor/SimpleSparseAccessor.gltf",
    "gltf/Cameras/Cameras.gltf",
];

/// Models generated here, and the shared ones with these names if available.
fn victims(endings: &[&str], names: &[&str]) -> Vec<Victim> {
    let folder = tempfile::tempdir().unwrap();
    let made = built::models(folder.path()).into_iter().filter(|path| {
        path.extension()
            .is_some_and(|e| endings.iter().any(|&k| e == k))
    });
    made.chain(names.iter().filter_map(|name| assets(name)))
        .map(|path| Victim::of(&path))
        .collect()
}

/// Protects: a model truncated at any length causes no panic.
#[test]
fn truncated_models_do_no_harm() {
    for victim in victims(&["gltf", "glb"], &SMALL) {
        for end in 0..victim.bytes.len() {
            victim.survives(&victim.bytes[..end], &format!("{end} bytes"));
            victim.survives(
                &with_fitting_lengths(victim.bytes[..end].to_vec()),
                &format!("{end} bytes, lengths fitted"),
            );
        }
        assert!(victim.survives(&victim.bytes, "whole"));
    }
}

/// Protects: one to four random changed bytes cause no panic.
#[test]
fn flipped_models_do_no_harm() {
    let (mut survivors, mut tried) = (0, 0);
    let names = [
        &SMALL[..],
        &[
            "gltf/crafted/image_formats.glb",
            "gltf/crafted/index_types.glb",
        ],
    ]
    .concat();
    for victim in victims(&["gltf", "glb"], &names) {
        let mut rng = DamageRng(0x9e37_79b9_7f4a_7c15);
        for round in 0..1500 {
            let mut bytes = victim.bytes.clone();
            for _ in 0..=rng.below(4) {
                let position = rng.below(bytes.len());
                bytes[position] = rng.below(256) as u8;
            }
            survivors += usize::from(victim.survives(&bytes, &format!("round {round}")));
            tried += 1;
        }
    }
    assert!(
        100 * survivors > tried,
        "damage that nothing survives tests nothing: {survivors} of {tried}"
    );
}

/// Protects: numbers in the JSON replaced by other valid numbers cause no panic: huge, negative,
/// fractional, off by one.
#[test]
fn lying_numbers_do_no_harm() {
    const LIES: [&str; 12] = [
        "0",
        "1",
        "-1",
        "2",
        "255",
        "65535",
        "4294967295",
        "4294967296",
        "18446744073709551615",
        "1e30",
        "0.5",
        "-1e-30",
    ];
    for victim in victims(&["gltf", "glb"], &SMALL) {
        let (start, end) = match victim.bytes.starts_with(b"glTF") {
            true => (
                20,
                20 + u32::from_le_bytes(victim.bytes[12..16].try_into().unwrap()) as usize,
            ),
            false => (0, victim.bytes.len()),
        };
        let json = std::str::from_utf8(&victim.bytes[start..end]).unwrap();
        for (position, number) in numbers(json) {
            for lie in LIES {
                let text = [&json[..position], lie, &json[position + number.len()..]].concat();
                let bytes = match start {
                    0 => text.clone().into_bytes(),
                    _ => {
                        let mut bytes = [
                            &victim.bytes[..12],
                            &(text.len() as u32).to_le_bytes(),
                            b"JSON",
                            text.as_bytes(),
                        ]
                        .concat();
                        bytes.extend(&victim.bytes[end..]);
                        let length = bytes.len() as u32;
                        bytes[8..12].copy_from_slice(&length.to_le_bytes());
                        bytes
                    }
                };
                victim.survives(&bytes, &format!("{number} at {position} replaced by {lie}"));
            }
        }
    }
}

/// Positions and texts of the numbers outside of strings.
fn numbers(json: &str) -> Vec<(usize, &str)> {
    let mut out = Vec::new();
    let (mut quoted, mut begun) = (false, None);
    for (i, c) in json.char_indices() {
        let part = !quoted
            && (c.is_ascii_digit() || "+-.eE".contains(c))
            && (begun.is_some() || c.is_ascii_digit() || c == '-');
        match (part, begun) {
            (true, None) => begun = Some(i),
            (false, Some(start)) => {
                out.push((start, &json[start..i]));
                begun = None;
            }
            _ => {}
        }
        quoted ^= c == '"';
    }
    out
}

/// Protects: STL and PLY of all kinds cause no panic when truncated at any length or with changed
/// bytes, most of them in text.
#[test]
fn damaged_meshes_do_no_harm() {
    let folder = tempfile::tempdir().unwrap();
    let (mut survivors, mut tried) = (0, 0);
    for victim in crate::written::models(folder.path())
        .iter()
        .map(|path| Victim::of(path))
    {
        for end in 0..victim.bytes.len() {
            victim.survives(&victim.bytes[..end], &format!("{end} bytes"));
        }
        assert!(victim.survives(&victim.bytes, "whole"));
        let mut rng = DamageRng(0x9e37_79b9_7f4a_7c15);
        for round in 0..1500 {
            let mut bytes = victim.bytes.clone();
            for _ in 0..=rng.below(4) {
                let position = rng.below(bytes.len());
                bytes[position] = if rng.below(2) == 0 {
                    rng.below(256) as u8
                } else {
                    b"0123456789-. \nfe"[rng.below(16)]
                };
            }
            survivors += usize::from(victim.survives(&bytes, &format!("round {round}")));
            tried += 1;
        }
    }
    assert!(
        100 * survivors > tried,
        "damage that nothing survives tests nothing: {survivors} of {tried}"
    );
}

/// Protects: OBJ and MTL text causes no panic when truncated or changed as the models are.
#[test]
fn damaged_text_does_no_harm() {
    let names = [
        "obj/crafted/glass_and_mirror.obj",
        "obj/crafted/negative_indices.obj",
        "obj/tinyobj/cube-vertexcol.obj",
    ];
    for victim in victims(&["obj"], &names) {
        for end in 0..victim.bytes.len() {
            victim.survives(&victim.bytes[..end], &format!("{end} bytes"));
        }
        let mut rng = DamageRng(0x2545_f491_4f6c_dd1d);
        for round in 0..2000 {
            let mut bytes = victim.bytes.clone();
            for _ in 0..=rng.below(4) {
                let position = rng.below(bytes.len());
                bytes[position] = b"0123456789-/. \nfvse#\\\xff"[rng.below(22)];
            }
            victim.survives(&bytes, &format!("round {round}"));
        }
    }
    for name in [
        "obj/crafted/glass_and_mirror.mtl",
        "obj/tinyobj/texture-options-issue-85.mtl",
        "obj/tinyobj/pbr-mat-ext.mtl",
    ] {
        let Some(path) = assets(name) else { return };
        let library = Victim::of(&path);
        let model = library.path.with_extension("obj");
        for end in 0..library.bytes.len() {
            replace(&library.path, &library.bytes[..end]);
            let loaded = try_load(&model).unwrap_or_else(|e| panic!("{end} bytes: {e}"));
            check_sound(&loaded, &model);
        }
    }
}
