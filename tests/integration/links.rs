//! Links, chapter names and file names in the pages refer to existing targets.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};

/// Root of the repository.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// All files of the repository, relative to its root, without hidden folders and build output.
pub fn files() -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![root().to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).expect("a folder") {
            let path = entry.expect("readable").path();
            let name = path
                .file_name()
                .map(|name| name.to_string_lossy().into_owned())
                .unwrap_or_default();
            if path.is_dir() {
                if !name.starts_with('.') && name != "target" {
                    folders.push(path);
                }
            } else {
                found.push(
                    path.strip_prefix(root())
                        .expect("below the root")
                        .to_path_buf(),
                );
            }
        }
    }
    found.sort();
    found
}

/// Pages of the repository, with their text outside fenced blocks.
fn pages() -> BTreeMap<PathBuf, String> {
    let pages: BTreeMap<_, _> = files()
        .into_iter()
        .filter(|path| path.extension().is_some_and(|ending| ending == "md"))
        .map(|path| {
            let text = std::fs::read_to_string(root().join(&path)).expect("a page is text");
            (path, text.split("```").step_by(2).collect())
        })
        .collect();
    assert!(pages.len() > 8, "{} pages", pages.len());
    pages
}

/// Chapter titles of a page.
fn titles(text: &str) -> impl Iterator<Item = &str> {
    text.lines()
        .filter(|line| line.starts_with('#'))
        .map(|line| line.trim_start_matches('#').trim())
}

/// Anchor of a title on a forge: lower case, spaces as hyphens, no other punctuation.
fn anchor(title: &str) -> String {
    let kept = title
        .to_lowercase()
        .chars()
        .filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'))
        .collect::<String>();
    kept.replace(' ', "-")
}

/// Resolves `.` and `..` in a path relative to the page's folder.
fn resolved(page: &Path, target: &str) -> PathBuf {
    let mut path = page.parent().map(Path::to_path_buf).unwrap_or_default();
    for part in Path::new(target).components() {
        match part {
            Component::ParentDir => _ = path.pop(),
            Component::Normal(part) => path.push(part),
            Component::CurDir | Component::RootDir | Component::Prefix(_) => {}
        }
    }
    path
}

/// Texts between each `opening` and the next `closing`.
fn between<'a>(text: &'a str, opening: &'a str, closing: char) -> impl Iterator<Item = &'a str> {
    text.split(opening)
        .skip(1)
        .filter_map(move |rest| rest.split_once(closing))
        .map(|(inside, _)| inside)
}

/// Protects: every link between pages leads to an existing file and chapter.
#[test]
fn links_lead_somewhere() {
    let (pages, mut broken, mut followed) = (pages(), Vec::new(), 0);
    for (page, text) in &pages {
        for link in between(text, "](", ')').filter(|link| !link.contains("://")) {
            let (file, chapter) = link
                .split_once('#')
                .map_or((link, None), |(file, chapter)| (file, Some(chapter)));
            let target = if file.is_empty() {
                page.clone()
            } else {
                resolved(page, file)
            };
            let there = match chapter {
                None => root().join(&target).exists(),
                Some(chapter) => pages
                    .get(&target)
                    .is_some_and(|text| titles(text).any(|title| anchor(title) == chapter)),
            };
            if !there {
                broken.push(format!("{}: {link}", page.display()));
            }
            followed += 1;
        }
    }
    assert!(
        broken.is_empty() && followed > 60,
        "of {followed} links these lead nowhere: {broken:#?}"
    );
}

/// Protects: a chapter named by its title, as in README, "Using it", exists in that page.
#[test]
fn chapters_that_are_named_are_there() {
    let pages = pages();
    for (page, text) in &pages {
        for named in ["README", "ARCHITECTURE", "CONTRIBUTING", "CHANGELOG"] {
            let there = &pages[Path::new(&format!("{named}.md"))];
            for chapter in between(text, &format!("{named}, \""), '"') {
                assert!(
                    titles(there).any(|title| title == chapter),
                    "{}: {named} has no chapter \"{chapter}\"",
                    page.display()
                );
            }
        }
    }
}

/// Protects: a source file named in code marks exists. The changelog and the records of runs are
/// left out, because they may name files of the past.
#[test]
fn files_that_are_named_are_there() {
    let files = files();
    let names: BTreeSet<String> = files
        .iter()
        .map(|path| format!("/{}", path.to_string_lossy().replace('\\', "/")))
        .collect();
    let (mut missing, mut looked_up) = (Vec::new(), 0);
    for (page, text) in pages() {
        if page == Path::new("CHANGELOG.md") || page.starts_with("benches/runs") {
            continue;
        }
        for name in text
            .split('`')
            .skip(1)
            .step_by(2)
            .filter(|name| !name.contains(char::is_whitespace))
        {
            if [".rs", ".md", ".py", ".svg"]
                .iter()
                .any(|ending| name.ends_with(ending))
            {
                looked_up += 1;
                if !names
                    .iter()
                    .any(|path| path.ends_with(&format!("/{}", name.trim_start_matches("../"))))
                {
                    missing.push(format!("{}: `{name}`", page.display()));
                }
            }
        }
    }
    assert!(
        missing.is_empty() && looked_up > 40,
        "of {looked_up} names these are of no file: {missing:#?}"
    );
}
