//! Tests of readable files in a scene's folder, and of their part in the hash.

use super::{Folder, ReadError};

fn scene_folder() -> tempfile::TempDir {
    let outer = tempfile::tempdir().expect("a temporary folder");
    std::fs::create_dir(outer.path().join("scene")).expect("a folder");
    std::fs::write(outer.path().join("secret.txt"), "secret").expect("a file");
    std::fs::write(outer.path().join("scene/own.txt"), "own").expect("a file");
    outer
}

/// Protects: a file beside the scene is read and contributes to the hash.
#[test]
fn a_file_beside_the_scene_is_read_and_counts_towards_the_hash() {
    let outer = scene_folder();
    let folder =
        Folder::parent_of(&outer.path().join("scene/x.toml"), 3).expect("the folder exists");
    let before = folder.take_hash();
    assert_eq!(folder.read("./own.txt"), Ok(b"own".to_vec()));
    let after = folder.take_hash();
    assert_ne!(after, before);
    assert_eq!(after.to_string().len(), 64);
}

/// Protects: the hash depends on which file held the bytes: two exchanged files give another scene.
#[test]
fn names_count_towards_the_hash() {
    let outer = scene_folder();
    std::fs::write(outer.path().join("scene/twin.txt"), "own").expect("a file");
    let hash = |name: &str| {
        let folder =
            Folder::parent_of(&outer.path().join("scene/x.toml"), 3).expect("the folder exists");
        folder.read(name).expect("a file");
        folder.take_hash()
    };
    assert_eq!(hash("own.txt"), hash("own.txt"));
    assert_ne!(hash("own.txt"), hash("twin.txt"));
}

/// Protects: every file read or named is recorded, also through the folders of such files, and so
/// are missing and outside files: no picture of the scene may replace any of them.
#[test]
fn what_is_read_and_named_is_remembered() {
    use crate::output::OutputPath;
    let outer = scene_folder();
    std::fs::create_dir(outer.path().join("scene/sub")).expect("a folder");
    std::fs::write(outer.path().join("scene/sub/a.txt"), "a").expect("a file");
    let folder =
        Folder::parent_of(&outer.path().join("scene/x.toml"), 3).expect("the folder exists");
    folder.read("own.txt").expect("a file");
    let beside = folder.folder_of_reference("sub/a.txt").expect("a file");
    beside.read("a.txt").expect("a file");
    assert!(beside.read("none.txt").is_err() && folder.read("../secret.txt").is_err());
    let inputs = folder.inputs();
    let held = |name: &str| {
        let place = OutputPath::resolve(&outer.path().join("scene").join(name)).expect("a place");
        inputs.find_overwritten_input(&place).is_some()
    };
    for name in ["own.txt", "sub/a.txt", "sub/none.txt", "../secret.txt"] {
        assert!(held(name), "{name}");
    }
    assert!(!held("none.txt") && !held("sub/own.txt"));
    // Missing files that may appear later count; refused ones do not.
    assert_eq!(inputs.files().count(), 3);
}

/// Protects: a file over the limit is not read.
#[test]
fn a_file_over_the_limit_is_not_read() {
    let outer = scene_folder();
    let folder =
        Folder::parent_of(&outer.path().join("scene/x.toml"), 2).expect("the folder exists");
    assert!(matches!(
        folder.read("own.txt"),
        Err(ReadError::TooLarge(_))
    ));
}

/// Protects: nothing outside the folder is read.
#[test]
fn nothing_outside_the_folder_is_read() {
    let outer = scene_folder();
    let folder =
        Folder::parent_of(&outer.path().join("scene/x.toml"), 1000).expect("the folder exists");
    let absolute = outer.path().join("secret.txt").display().to_string();
    let wrong = [
        "../secret.txt",
        "a/../../secret.txt",
        "..\\secret.txt",
        "C:secret.txt",
        "\\\\server\\secret.txt",
        "file:own.txt",
        "file:///etc/passwd",
        "http://host/own.txt",
        "data:,x",
        "ftp://host/x",
        "",
        "own\0.txt",
        ".",
        absolute.as_str(),
    ];
    for reference in wrong {
        assert!(
            matches!(folder.read(reference), Err(ReadError::Refused(_))),
            "{reference:?} was followed"
        );
    }
}

/// Protects: a path that turns back inside the folder stays inside, even past a missing folder or a
/// link; on request other files are read too, but never URLs or special files.
#[cfg(unix)]
#[test]
fn ways_inside_and_ways_out() {
    let outer = scene_folder();
    let place = outer.path().join("scene/x.toml");
    std::os::unix::fs::symlink("/", outer.path().join("scene/root")).expect("a link");
    let folder = Folder::parent_of(&place, 1000).expect("the folder exists");
    for reference in ["none/../own.txt", "./a/b/../../own.txt", "root/../own.txt"] {
        assert_eq!(folder.read(reference), Ok(b"own".to_vec()), "{reference}");
    }
    for reference in ["a/../../scene/own.txt", "..", "a\\..\\own.txt"] {
        assert!(
            matches!(folder.read(reference), Err(ReadError::Refused(_))),
            "{reference} was followed"
        );
    }
    let open = Folder::parent_of(&place, 1000)
        .expect("the folder exists")
        .with_outside_access(true);
    let secret = outer.path().join("secret.txt").display().to_string();
    for reference in [
        "../secret.txt",
        &secret,
        &format!("file://{secret}"),
        &format!("root{secret}"),
    ] {
        assert_eq!(open.read(reference), Ok(b"secret".to_vec()), "{reference}");
    }
    assert_eq!(
        open.folder_of_reference("own.txt")
            .expect("a folder")
            .read("../secret.txt"),
        Ok(b"secret".to_vec())
    );
    for reference in ["http://host/own.txt", "/dev/zero", "file:///dev/null", ".."] {
        assert!(
            matches!(open.read(reference), Err(ReadError::Refused(_))),
            "{reference} was followed"
        );
    }
}

/// Protects: a link that leads outside the folder is not followed.
#[cfg(unix)]
#[test]
fn a_link_that_leads_out_of_the_folder_is_not_followed() {
    let outer = scene_folder();
    std::os::unix::fs::symlink("../secret.txt", outer.path().join("scene/link.txt"))
        .expect("a link");
    std::os::unix::fs::symlink("..", outer.path().join("scene/up")).expect("a link");
    let folder =
        Folder::parent_of(&outer.path().join("scene/x.toml"), 1000).expect("the folder exists");
    for reference in ["link.txt", "up/secret.txt"] {
        assert!(
            matches!(folder.read(reference), Err(ReadError::Refused(_))),
            "{reference} was followed"
        );
    }
}

/// Protects: a pipe is refused without opening it, which would block.
#[cfg(unix)]
#[test]
fn a_pipe_is_refused_without_waiting() {
    let outer = scene_folder();
    let made = std::process::Command::new("mkfifo")
        .arg(outer.path().join("scene/pipe"))
        .status();
    if made.is_ok_and(|status| status.success()) {
        let folder =
            Folder::parent_of(&outer.path().join("scene/x.toml"), 1000).expect("the folder exists");
        assert!(matches!(folder.read("pipe"), Err(ReadError::Refused(_))));
    }
}

/// Protects: a preset reads no file.
#[test]
fn a_preset_reads_no_file() {
    assert!(matches!(
        Folder::for_built_in_scene(1000).read("own.txt"),
        Err(ReadError::Refused(_))
    ));
}

/// Protects: the hash separates its pieces, so that no other sequence of pieces has the same hash.
#[test]
fn a_hash_knows_where_things_end() {
    let hash = |parts: &[&[u8]]| {
        let folder = Folder::for_built_in_scene(100);
        parts.iter().for_each(|part| folder.add_to_hash(part));
        folder.take_hash()
    };
    assert_eq!(hash(&[b"ab", b"c"]), hash(&[b"ab", b"c"]));
    let hashes = [
        hash(&[b"ab", b"c"]),
        hash(&[b"a", b"bc"]),
        hash(&[b"abc"]),
        hash(&[b"abc", b""]),
    ];
    assert!(
        (0..4).all(|i| (0..i).all(|j| hashes[i] != hashes[j])),
        "{hashes:?}"
    );
}

/// Protects: a name in another letter case finds its file, in folders too, but never an ambiguous
/// or outside one, nor through a link to the outside; an exact match takes precedence.
#[test]
fn names_in_another_case_are_found() {
    let outer = scene_folder();
    let scene = outer.path().join("scene");
    std::fs::create_dir(scene.join("Maps")).expect("a folder");
    for (name, text) in [("Maps/Wood Ü.PNG", "1"), ("two.txt", "2"), ("Two.txt", "3")] {
        std::fs::write(scene.join(name), text).expect("a file");
    }
    if std::fs::read_dir(&scene).expect("a folder").count() < 4 {
        return; // this file system ignores case
    }
    let folder = Folder::parent_of(&scene.join("x.toml"), 10).expect("the folder exists");
    assert_eq!(folder.read("maps/wood ü.png"), Ok(b"1".to_vec()));
    assert_eq!(folder.read("two.txt"), Ok(b"2".to_vec()));
    assert!(matches!(
        folder.read("TWO.txt"),
        Err(ReadError::Unreadable(_))
    ));
    assert!(matches!(
        folder.read("../SECRET.txt"),
        Err(ReadError::Refused(_))
    ));
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("../secret.txt", scene.join("Link.txt")).expect("a link");
        assert!(matches!(
            folder.read("link.txt"),
            Err(ReadError::Refused(_))
        ));
    }
}

/// Protects: a pointer of Git LFS and a server's page are named as such under any file's name, from
/// disk, a pipe and a resolver; other texts are read.
#[test]
fn placeholders_are_named() {
    const LFS: &[u8] = b"version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 9\n";
    let pages: [&[u8]; 4] = [
        b"\xef\xbb\xbf\r\n <!DOCTYPE HTML><title>404</title>",
        b"<html lang=\"en\">",
        b"<?xml version=\"1.0\"?>\n<!DOCTYPE html PUBLIC>",
        b"<!-- saved -->\n<HTML>",
    ];
    let outer = scene_folder();
    let read = |bytes: &[u8]| {
        std::fs::write(outer.path().join("scene/a.bin"), bytes).expect("a file");
        let scene = outer.path().join("scene/x.toml");
        let disk = Folder::parent_of(&scene, 1 << 20).expect("the folder exists");
        let owned = bytes.to_vec();
        let resolver = super::Resolver::new(move |_| Ok(owned.clone()));
        let archive = Folder::from_resolver(Some(&resolver), 1 << 20);
        let found = disk.read("a.bin");
        assert_eq!(archive.read("a.bin"), found);
        let piped = crate::Input::from_reader("pipe", bytes, &crate::Limits::default());
        assert_eq!(piped.is_ok(), found.is_ok());
        found
    };
    let message = |bytes: &[u8]| read(bytes).expect_err("a placeholder").to_string();
    assert!(message(LFS).starts_with("cannot read `a.bin`: ") && message(LFS).contains("Git LFS"));
    for page in pages {
        assert!(message(page).contains("HTML page"), "{page:?}");
    }
    for other in [
        b"".as_slice(),
        b"version 1",
        b"<?xml ?><svg/>",
        b"<!-- -->",
        b"solid <html>",
    ] {
        assert_eq!(read(other), Ok(other.to_vec()));
    }
}
