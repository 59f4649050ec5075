//! Collects the built-in scenes and assets: all files in `scenes/` at build time. A new file there
//! is a new preset, and a deleted file removes its preset; no code names any of them.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::{env, fs, io};

fn main() -> io::Result<()> {
    // A package contains a copy where a checkout has a symbolic link, which is a plain file on
    // systems without links.
    let manifest = PathBuf::from(env::var("CARGO_MANIFEST_DIR").map_err(io::Error::other)?);
    let inside = manifest.join("scenes");
    let scenes = if inside.is_dir() {
        inside.canonicalize()?
    } else {
        manifest.join("../../scenes")
    };
    // Cargo scans the whole folder, so that added and deleted files count as changes.
    println!("cargo::rerun-if-changed={}", scenes.display());
    println!("cargo::rerun-if-changed=build.rs");
    let mut code = String::from(
        "/// Name and text of every preset, by name.\npub(crate) const PRESETS: &[(&str, &str)] = &[\n",
    );
    for (name, path) in files(&scenes, ".scene.toml")? {
        writeln!(code, "    ({name:?}, include_str!({path:?})),").map_err(io::Error::other)?;
    }
    code.push_str("];\n\n/// Name and bytes of every asset, by name.\npub(crate) const ASSETS: &[(&str, &[u8])] = &[\n");
    for (name, path) in files(&scenes.join("assets"), "")? {
        writeln!(code, "    ({name:?}, include_bytes!({path:?})),").map_err(io::Error::other)?;
    }
    code.push_str("];\n");
    fs::write(
        Path::new(&env::var("OUT_DIR").map_err(io::Error::other)?).join("embedded.rs"),
        code,
    )
}

/// Lists the files of a folder with this extension, by name: each name without the extension, and
/// its path. Empty for a missing folder.
fn files(folder: &Path, ending: &str) -> io::Result<Vec<(String, PathBuf)>> {
    let Ok(entries) = fs::read_dir(folder) else {
        return Ok(Vec::new());
    };
    let mut found = Vec::new();
    for entry in entries {
        let path = entry?.path().canonicalize()?;
        let name = path
            .file_name()
            .and_then(|name| name.to_str())
            .unwrap_or_default();
        if let Some(stem) = name
            .strip_suffix(ending)
            .filter(|stem| !stem.is_empty() && path.is_file())
        {
            found.push((stem.to_owned(), path.clone()));
        }
    }
    found.sort();
    Ok(found)
}
