//! Every hard case has a test whose name begins with its number.

use std::collections::BTreeSet;

use raywright::stability::hard_cases;

use crate::links::{files, root};

/// Number at the start of a test's name, in the list's notation.
fn number(name: &str) -> Option<String> {
    let (first, rest) = name.split_at_checked(3)?;
    let is_number = first.starts_with(['p', 't', 's', 'm', 'f'])
        && first[1..].bytes().all(|b| b.is_ascii_digit());
    (is_number && rest.starts_with('_')).then(|| first.to_uppercase())
}

/// Names of all tests in a file: the functions after the attribute and any further ones.
fn tests(source: &str) -> impl Iterator<Item = &str> {
    source.split("#[test]\n").skip(1).filter_map(|after| {
        let line = after
            .lines()
            .map(str::trim)
            .find(|line| !line.starts_with(['#', '/']))?;
        line.strip_prefix("fn ")?.split('(').next()
    })
}

/// Protects: each hard case has a test with its number, and each such number is a hard case.
#[test]
fn every_hard_case_is_a_test() {
    let listed: BTreeSet<String> = hard_cases().map(|case| case.number.to_owned()).collect();
    let mut found = BTreeSet::new();
    for path in files()
        .into_iter()
        .filter(|path| path.extension().is_some_and(|ending| ending == "rs"))
    {
        let source = std::fs::read_to_string(root().join(&path)).expect("source is text");
        for name in tests(&source) {
            let Some(number) = number(name) else { continue };
            assert!(
                listed.contains(&number),
                "{}: {name} has a number that is none",
                path.display()
            );
            found.insert(number);
        }
    }
    let missing: Vec<_> = listed.difference(&found).map(String::as_str).collect();
    assert!(missing.is_empty(), "cases without a test: {missing:?}");
}
