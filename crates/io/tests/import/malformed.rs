//! Malformed and hostile files: a result for each, in time, without a panic.

use std::path::Path;
use std::time::{Duration, Instant};

use raywright_io::ErrorKind;

use crate::shared::{assets, check_sound, files_below, try_load};

/// Loads a file, checks the invariants of every result, and returns the message of a refusal.
fn verdict(path: &Path) -> Result<(), String> {
    let start = Instant::now();
    let result = try_load(path);
    assert!(
        start.elapsed() < Duration::from_secs(10),
        "{}: {:?}",
        path.display(),
        start.elapsed()
    );
    match result {
        Ok(loaded) => {
            check_sound(&loaded, path);
            Ok(())
        }
        Err(error) => {
            let text = error.to_string();
            let name = path.file_name().unwrap().to_str().unwrap();
            assert!(text.contains(name), "{text} does not name {name}");
            assert!(text.lines().count() <= 3 && text.len() < 1000, "{text}");
            assert_ne!(error.kind(), ErrorKind::Usage, "{text}");
            Err(text)
        }
    }
}

fn expectations(folder: &Path) -> serde_json::Map<String, serde_json::Value> {
    let text = std::fs::read(folder.join("EXPECT.json")).unwrap();
    serde_json::from_slice(&text).unwrap()
}

/// Protects: malformed files have the results that the collection prescribes.
#[test]
fn malformed_files_get_their_verdict() {
    let Some(folder) = assets("malformed") else {
        return;
    };
    for (file, expected) in expectations(&folder) {
        if file.ends_with(".mtl") || file.ends_with(".obj") {
            continue;
        }
        let got = verdict(&folder.join(&file));
        match expected["expect"].as_str().unwrap() {
            // The list is older than the rule that a broken texture refuses no model.
            "error" if file == "images/png_truncated.glb" => assert_eq!(got, Ok(()), "{file}"),
            "error" => assert!(got.is_err(), "{file} must be refused: {}", expected["why"]),
            "ok" => assert_eq!(got, Ok(()), "{file}"),
            _ => {}
        }
    }
}

/// Protects: messages name the cause of a refusal.
#[test]
fn messages_name_the_cause() {
    let Some(folder) = assets("malformed") else {
        return;
    };
    for (file, words) in [
        (
            "accessors/accessor_past_view.gltf",
            "300 elements reach beyond bufferViews[0]",
        ),
        ("accessors/huge_count_no_view.gltf", "2000000000 elements"),
        (
            "accessors/index_out_of_range.gltf",
            "vertex 60000 does not exist, the primitive has 3 vertices",
        ),
        ("glb/missing_bin_chunk.glb", "the file has no binary chunk"),
        ("glb/truncated_half.glb", "is a truncated GLB file"),
        ("glb/version_1.glb", "version 1"),
        ("images/png_60000x60000_header.glb", "60000 x 60000"),
        ("json/invalid_json.gltf", "line 1"),
        (
            "json/mesh_index_out_of_range.gltf",
            "meshes[99] does not exist",
        ),
        ("nodes/child_out_of_range.gltf", "nodes[50] does not exist"),
        (
            "nodes/cycle_two_nodes.gltf",
            "the hierarchy of nodes has a cycle",
        ),
        ("uris/bad_base64.gltf", "base64"),
        ("uris/missing_file.gltf", "does_not_exist.bin"),
        ("uris/percent_not_utf8.gltf", "UTF-8"),
        (
            "uris/traversal_etc_passwd.gltf",
            "lies outside the scene's folder, and only files in that folder are read",
        ),
    ] {
        let message = verdict(&folder.join(file)).expect_err(file);
        assert!(
            message.contains(words),
            "{file}: no \"{words}\" in {message}"
        );
    }
}

/// Protects: the validator's own test files cause no panic, and files without an error are not
/// refused.
#[test]
fn validator_files_do_no_harm() {
    let Some(folder) = assets("malformed/khronos-validator") else {
        return;
    };
    let expected = expectations(&folder);
    for path in files_below(&folder) {
        let name = path
            .strip_prefix(&folder)
            .unwrap()
            .to_str()
            .unwrap()
            .to_owned();
        let Some(entry) = expected.get(&name) else {
            continue;
        };
        let got = verdict(&path);
        // The file's buffer is a placeholder that is used nevertheless.
        if entry["errors"] == 0 && name != "root/unused_objects.gltf" {
            assert_eq!(got, Ok(()), "{name} is valid");
        }
    }
}
