//! Import cycles between files: such modules cannot be read, moved or tested one by one, because
//! each uses definitions of the other.

use std::collections::BTreeMap;
use std::fs::read_to_string;
use std::path::Path;

/// Files by module path, which starts with the crate's name.
type Modules = BTreeMap<Vec<String>, String>;

/// Number of accepted cycles, each a single idea in several files.
const MOST: usize = 2;

/// Reads the modules below a folder; `path` is the path of the folder's module.
fn read(folder: &Path, path: &[String], modules: &mut Modules) {
    for entry in folder.read_dir().unwrap().map(Result::unwrap) {
        let (place, name) = (entry.path(), entry.file_name().into_string().unwrap());
        let below = |name: &str| {
            path.iter()
                .cloned()
                .chain([name.to_owned()])
                .collect::<Vec<_>>()
        };
        if place.is_dir() {
            read(&place, &below(&name), modules);
        } else if let Some(name) = name.strip_suffix(".rs") {
            let own = if ["lib", "main", "mod"].contains(&name) {
                path.to_vec()
            } else {
                below(name)
            };
            modules.insert(own, read_to_string(&place).unwrap());
        }
    }
}

/// Returns the lines of a file without its tests, and the names of its test modules.
fn without_tests(text: &str) -> (Vec<&str>, Vec<String>) {
    let (mut kept, mut tests, mut lines) = (Vec::new(), Vec::new(), text.lines());
    while let Some(line) = lines.next() {
        if !(line.trim_start().starts_with("#[cfg(") && line.contains("test")) {
            kept.push(line);
            continue;
        }
        let Some(item) = lines
            .by_ref()
            .find(|line| !line.trim_start().starts_with("#["))
        else {
            break;
        };
        let indent = &item[..item.len() - item.trim_start().len()];
        tests.extend(
            item.trim_end()
                .strip_suffix(';')
                .and_then(|item| item.split_once("mod "))
                .map(|(_, name)| name.to_owned()),
        );
        if !item.ends_with([';', '}']) {
            lines.by_ref().find(|line| {
                line.strip_prefix(indent)
                    .is_some_and(|rest| rest.starts_with('}'))
            });
        }
    }
    (kept, tests)
}

/// Expands a tree of imports to paths.
fn paths(tree: &str) -> Vec<String> {
    let tree = tree.trim();
    let Some((before, list)) = tree.strip_suffix('}').and_then(|tree| tree.split_once('{')) else {
        return vec![tree.split(" as ").next().unwrap_or(tree).replace(' ', "")];
    };
    let (mut depth, mut parts) = (0, vec![String::new()]);
    for c in list.chars() {
        depth += i32::from(c == '{') - i32::from(c == '}');
        if c == ',' && depth == 0 {
            parts.push(String::new())
        } else {
            parts.last_mut().unwrap().push(c)
        }
    }
    let parts = parts.iter().filter(|part| !part.trim().is_empty());
    parts
        .flat_map(|part| paths(part))
        .map(|path| format!("{}{path}", before.replace(' ', "")))
        .collect()
}

/// An import: its whole path, whether it is re-exported, and whether it counts, as imports by
/// `crate` or `super` do.
struct Import {
    path: Vec<String>,
    is_public: bool,
    counts: bool,
}

/// Returns the imports of a module from its own crate.
fn imports(own: &[String], lines: &[&str], modules: &Modules) -> Vec<Import> {
    let code: Vec<_> = lines
        .iter()
        .map(|line| line.split("//").next().unwrap_or(""))
        .collect();
    let code = code.join("\n");
    let mut found = Vec::new();
    for statement in code.split(';') {
        let Some(start) = statement
            .rfind("use ")
            .filter(|&at| at == 0 || statement[..at].ends_with(['\n', ' ']))
        else {
            continue;
        };
        let line = statement[..start].rsplit('\n').next().unwrap_or("").trim();
        if !(line.is_empty() || line.starts_with("pub")) {
            continue;
        }
        for path in paths(
            &statement[start + 4..]
                .split_whitespace()
                .collect::<Vec<_>>()
                .join(" "),
        ) {
            let mut words = path.split("::").peekable();
            let first = *words.peek().unwrap();
            let mut path = match first {
                "crate" => own[..1].to_vec(),
                _ => own.to_vec(),
            };
            while words.next_if(|&word| word == "super").is_some() {
                path.pop();
            }
            words.next_if(|&word| word == "crate" || word == "self");
            path.extend(
                words
                    .filter(|&word| word != "*" && word != "self")
                    .map(str::to_owned),
            );
            if ["crate", "super", "self"].contains(&first)
                || modules.contains_key(&path[..=own.len().min(path.len() - 1)])
            {
                found.push(Import {
                    path,
                    is_public: !line.is_empty(),
                    counts: ["crate", "super"].contains(&first),
                });
            }
        }
    }
    found
}

/// Returns the module that defines an item, through re-exports.
fn home(
    path: &[String],
    modules: &Modules,
    handed_on: &BTreeMap<Vec<String>, Vec<String>>,
) -> Option<Vec<String>> {
    if modules.contains_key(path) {
        return Some(path.to_vec());
    }
    let module = (1..path.len())
        .rev()
        .map(|count| &path[..count])
        .find(|path| modules.contains_key(*path))?;
    match handed_on.get(&path[..=module.len()]) {
        Some(to) if to != path => home(
            &[to, &path[module.len() + 1..]].concat(),
            modules,
            handed_on,
        ),
        _ => Some(module.to_vec()),
    }
}

/// Groups of modules that reach one another, of two or more.
fn circles(uses: &BTreeMap<Vec<String>, Vec<Vec<String>>>) -> Vec<Vec<String>> {
    let reached = |from: &Vec<String>| {
        let (mut seen, mut waiting) = (std::collections::BTreeSet::new(), uses[from].clone());
        while let Some(next) = waiting.pop() {
            if seen.insert(next.clone()) {
                waiting.extend(uses[&next].iter().cloned());
            }
        }
        seen
    };
    let reach: BTreeMap<_, _> = uses
        .keys()
        .map(|module| (module, reached(module)))
        .collect();
    let mut found: Vec<Vec<String>> = Vec::new();
    for module in uses.keys().filter(|module| reach[module].contains(*module)) {
        let circle: Vec<_> = reach[module]
            .iter()
            .filter(|other| reach[other].contains(module))
            .map(|path| path.join("::"))
            .collect();
        if !found.contains(&circle) {
            found.push(circle);
        }
    }
    found
}

/// Protects: files can be read one by one: import cycles by `crate` or `super` are limited to the
/// accepted few. Test modules are left out.
#[test]
fn few_files_import_from_one_another() {
    let mut modules = Modules::new();
    for name in ["bvh", "core", "io", "cli"] {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("crates")
            .join(name)
            .join("src");
        read(&folder, &[name.to_owned()], &mut modules);
    }
    let texts: Vec<_> = modules
        .iter()
        .map(|(path, text)| (path.clone(), without_tests(text)))
        .collect();
    let tests: Vec<Vec<String>> = texts
        .iter()
        .flat_map(|(path, (_, tests))| {
            tests
                .iter()
                .map(move |test| path.iter().cloned().chain([test.clone()]).collect())
        })
        .collect();
    let is_test = |path: &[String]| tests.iter().any(|test| path.starts_with(test));
    let found: BTreeMap<_, _> = texts
        .iter()
        .filter(|(path, _)| !is_test(path))
        .map(|(path, (lines, _))| (path.clone(), imports(path, lines, &modules)))
        .collect();
    let handed_on = found
        .iter()
        .flat_map(|(path, imports)| {
            imports
                .iter()
                .filter(|import| import.is_public)
                .map(move |import| (path, &import.path))
        })
        .map(|(path, to)| (path.iter().chain(to.last()).cloned().collect(), to.clone()))
        .collect();
    let others = |path: &Vec<String>, imports: &[Import]| {
        let homes = imports
            .iter()
            .filter(|import| import.counts)
            .filter_map(|import| home(&import.path, &modules, &handed_on));
        homes
            .filter(|home| home != path && found.contains_key(home))
            .collect::<Vec<_>>()
    };
    let uses: BTreeMap<_, _> = found
        .iter()
        .map(|(path, imports)| (path.clone(), others(path, imports)))
        .collect();
    assert!(
        uses.values().map(Vec::len).sum::<usize>() > 1000,
        "imports are read"
    );
    let circles = circles(&uses);
    let messages: Vec<_> = circles
        .iter()
        .map(|circle| format!("{} files: {}", circle.len(), circle.join(", ")))
        .collect();
    assert!(
        circles.len() <= MOST,
        "{} circles of files:\n{}",
        circles.len(),
        messages.join("\n")
    );
}
