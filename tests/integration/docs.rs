//! The page of the scene format is complete, and its examples work.

use std::collections::BTreeSet;
use std::path::Path;

use raywright::core::expr::{Variable, constant_names, function_names};
use raywright::core::scene::SCHEMA;
use raywright::io::Limits;
use raywright::io::output::read_picture;
use serde_json::Value;

use crate::support::Sandbox;

fn page() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/scene-format.md");
    std::fs::read_to_string(path).expect("the page lies beside the code")
}

/// Returns the fenced blocks of a page in a language, in order.
fn blocks<'a>(page: &'a str, language: &str) -> Vec<&'a str> {
    let opening = format!("```{language}\n");
    page.split(opening.as_str())
        .skip(1)
        .map(|rest| rest.split("```").next().unwrap_or_default())
        .collect()
}

/// Returns the words in code marks, which the page explains. Words only in examples do not count.
fn explained(page: &str) -> BTreeSet<&str> {
    let outside = page.split("```").step_by(2);
    let spans = outside.flat_map(|text| text.split('`').skip(1).step_by(2));
    spans
        .flat_map(|span| span.split(|c: char| !(c.is_alphanumeric() || matches!(c, '_' | '-'))))
        .collect()
}

/// Collects property names and constant words of a schema.
fn words(schema: &Value, found: &mut BTreeSet<String>) {
    match schema {
        Value::Array(items) => items.iter().for_each(|item| words(item, found)),
        Value::Object(members) => {
            for (key, member) in members {
                match (key.as_str(), member) {
                    ("properties", Value::Object(properties)) => {
                        found.extend(properties.keys().cloned());
                        properties
                            .values()
                            .for_each(|property| words(property, found));
                    }
                    ("const", Value::String(word)) => _ = found.insert(word.clone()),
                    ("enum", Value::Array(list)) => {
                        found.extend(list.iter().filter_map(Value::as_str).map(str::to_owned))
                    }
                    ("default" | "description", _) => {}
                    _ => words(member, found),
                }
            }
        }
        _ => {}
    }
}

/// Protects: every name known to the expression compiler is explained on the page, a function as a
/// call.
#[test]
fn every_name_of_an_expression_is_explained() {
    let page = page();
    for name in function_names() {
        assert!(
            page.contains(&format!("`{name}(")),
            "the page does not explain the function `{name}`"
        );
    }
    let known = explained(&page);
    for name in Variable::ALL
        .map(Variable::name)
        .into_iter()
        .chain(constant_names())
    {
        assert!(known.contains(name), "the page does not explain `{name}`");
    }
}

/// Protects: every key and every word of the format, shapes included, is on the page.
#[test]
fn every_word_of_the_format_is_explained() {
    let schema: Value = serde_json::from_str(SCHEMA).expect("the schema is JSON");
    let mut expected = BTreeSet::new();
    words(&schema, &mut expected);
    assert!(
        expected.contains("hyperboloid") && expected.len() > 150,
        "{} words were found",
        expected.len()
    );
    let page = page();
    let known = explained(&page);
    let missing: Vec<_> = expected
        .iter()
        .filter(|word| !known.contains(word.as_str()) && *word != "2.2")
        .collect();
    assert!(missing.is_empty(), "the page does not explain {missing:?}");
}

/// Protects: the example of the page renders a picture with objects, and each further block can be
/// added to it.
#[test]
fn the_examples_work() {
    let page = page();
    let [example, additions @ ..] = &blocks(&page, "toml")[..] else {
        panic!("the page has an example")
    };
    let sandbox = Sandbox::new();
    sandbox.write("beads.scene.toml", example);
    sandbox
        .run(&["render", "beads.scene.toml", "--size", "32x18", "-q"])
        .exits_with(0)
        .prints("");
    let picture = sandbox.picture("beads.png");
    let brightness: BTreeSet<u32> = picture
        .rgb
        .iter()
        .map(|pixel| (pixel[1] * 20.0) as u32)
        .collect();
    assert!(
        brightness.len() > 8,
        "the picture shows next to nothing: {brightness:?}"
    );
    sandbox
        .run(&[
            "check",
            "beads.scene.toml",
            "--set",
            "radius=0.4",
            "--at",
            "3",
        ])
        .exits_with(0);

    sandbox.write("crate.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    std::fs::copy(sandbox.path("beads.png"), sandbox.path("planks.png")).expect("a picture");
    assert!(additions.len() >= 4, "{} additions", additions.len());
    for addition in additions {
        sandbox.write("more.scene.toml", format!("{example}\n{addition}"));
        let run = sandbox.run(&["check", "more.scene.toml"]);
        assert_eq!(
            (run.exits_with(0).text(), run.stderr.as_str()),
            ("more.scene.toml: ok\n", ""),
            "{addition}"
        );
    }
}

/// Protects: pictures in the docs come from commands that every reader can run: these name presets
/// and files, and no private folder.
#[test]
fn pictures_are_by_commands_for_everyone() {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    let mut reported = 0;
    for entry in std::fs::read_dir(docs).expect("a folder") {
        let path = entry.expect("readable").path();
        if path.extension().is_some_and(|ending| ending == "png") {
            let texts = read_picture(&path, &Limits::default())
                .expect("a picture")
                .texts;
            let command = texts
                .iter()
                .find(|(name, _)| name.to_lowercase().ends_with("command"))
                .map(|(_, text)| text.as_str());
            let words: Vec<&str> = command.unwrap_or_default().split(' ').collect();
            assert!(
                !words
                    .iter()
                    .any(|word| word.starts_with(['/', '~']) || word.contains(":\\")),
                "{}: {words:?}",
                path.display()
            );
            reported += usize::from(words.len() > 1);
        }
    }
    assert!(reported >= 5, "{reported} pictures say how they were made");
}

/// Protects: each test of the workspace has a first line with its purpose, so that a reader can
/// check it.
#[test]
fn every_test_says_what_it_protects() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut open = ["crates", "src", "tests"]
        .map(|name| root.join(name))
        .to_vec();
    let (mut tests, mut untold) = (0, Vec::new());
    while let Some(folder) = open.pop() {
        for path in std::fs::read_dir(folder)
            .expect("a folder")
            .map(|entry| entry.expect("readable").path())
        {
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|ending| ending == "rs") {
                let text = std::fs::read_to_string(&path).expect("readable");
                let lines: Vec<&str> = text.lines().map(str::trim).collect();
                for at in (0..lines.len()).filter(|&at| lines[at] == "#[test]") {
                    let before = lines[..at]
                        .iter()
                        .rev()
                        .take_while(|line| line.starts_with("///") || line.starts_with("#["));
                    tests += 1;
                    if !before.into_iter().any(|line| line.contains("Protects")) {
                        untold.push(format!("{}:{}", path.display(), at + 1));
                    }
                }
            }
        }
    }
    assert!(
        untold.is_empty() && tests > 1000,
        "{} of {tests} tests: {untold:#?}",
        untold.len()
    );
}
