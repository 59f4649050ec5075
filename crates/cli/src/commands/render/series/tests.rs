//! Tests of a run of several pictures: scenes read once, and the files named at the end.

use clap::Parser;

use super::*;
use crate::args::{Arguments, Command};

/// Protects: scenes loaded before their turn, because outputs could overwrite their files, are
/// loaded once: the picture shows the loaded content even if the file is gone.
#[test]
fn scenes_are_read_once() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    for name in ["a.obj", "b.obj"] {
        std::fs::write(at(name), "v 0 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\n").expect("a file");
    }
    let words = [
        "raywright",
        "render",
        &at("a.obj"),
        &at("b.obj"),
        "-s",
        "4x4",
        "--spp",
        "1",
        "-o",
        &at("%d.png"),
    ];
    let Ok(Arguments {
        command: Some(Command::Render(args)),
        ..
    }) = Arguments::try_parse_from(words)
    else {
        panic!("a right command line")
    };
    std::fs::write(at("0.png"), "old").expect("a file");
    let task = RenderTask::new(*args).expect("nothing is wrong with it");
    let session = Session::open(None, console::Verbosity::Quiet).expect("threads");
    let mut series = PictureSeries::start(&task, session).expect("nothing in the way");
    std::fs::remove_file(at("b.obj")).expect("a file");
    series.render_all_scenes().expect("pictures");
    assert!(series.summary.failed_exits.is_empty() && std::path::Path::new(&at("1.png")).exists());
}

/// Protects: the files of many pictures are listed as first to last for each output, those of a
/// single picture by name, and an empty list is empty.
#[test]
fn files_are_told_by_the_first_and_the_last_of_a_kind() {
    let describe = |names: &[&[&str]]| {
        format_file_ranges(
            &names
                .iter()
                .map(|names| names.iter().map(|&name| name.to_owned()).collect())
                .collect::<Vec<_>>(),
        )
        .join(", ")
    };
    assert_eq!(
        describe(&[
            &["a-0.png", "b-0.exr"],
            &["a-1.png", "b-1.exr"],
            &["a-2.png", "b-2.exr"]
        ]),
        "a-0.png to a-2.png, b-0.exr to b-2.exr"
    );
    assert_eq!(describe(&[&["w.png", "t-0000.png"]]), "w.png, t-0000.png");
    assert_eq!(
        (describe(&[]), describe(&[&[], &[]])),
        (String::new(), String::new())
    );
}
