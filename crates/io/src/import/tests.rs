//! Tests of the shared parts of the importers.

use super::*;

/// Protects: names are unique, so that no reference to a mesh is ambiguous.
#[test]
fn names_are_unique_even_against_numbered_wishes() {
    let mut names = UniqueNames::default();
    let made: Vec<_> = ["a", "a", "a (1)", "a", ""]
        .iter()
        .map(|wish| names.make_unique(wish))
        .collect();
    let distinct: HashSet<_> = made.iter().collect();
    assert_eq!(distinct.len(), made.len(), "{made:?}");
    assert_eq!(made[0], "a");
}

/// Protects: repeated warnings appear once, and a file with a million faults prints no million
/// lines.
#[test]
fn warnings_are_said_once_and_capped() {
    let mut warnings = Warnings::default();
    for i in 0..1000 {
        warn!(warnings, Format, "w{}", i % 500);
    }
    assert_eq!(warnings.into_warnings("f").len(), Warnings::MOST + 1);
    let mut warnings = Warnings::default();
    ["a", "b", "a", "b", "b"]
        .into_iter()
        .for_each(|message| warnings.add(fault::FaultKind::Format, message));
    let messages: Vec<_> = warnings
        .into_warnings("f")
        .into_iter()
        .map(|warning| warning.message)
        .collect();
    assert_eq!(messages, ["f: a", "f: b"]);
}

/// Protects: reservations add up, even when a product overflows.
#[test]
fn budget_refuses_what_exceeds_it() {
    let mut budget = DecodeBudget::new(&Limits {
        memory_bytes: 100,
        triangles: 3,
        ..Limits::default()
    });
    assert!(budget.reserve_memory(10, 2).is_ok());
    assert_eq!(
        budget
            .reserve_memory(usize::MAX, usize::MAX)
            .unwrap_err()
            .kind,
        ErrorKind::Limit
    );
    assert!(budget.reserve_triangles(4).is_err());
    assert!(budget.reserve_triangles(3).is_ok());
    assert!(budget.reserve_memory(45, 1).is_err());
    assert!(budget.reserve_memory(44, 1).is_ok());
}

/// Protects: a name in a hostile file neither fills the terminal nor controls it.
#[test]
fn shown_text_is_short_and_clean() {
    assert_eq!(sanitise_text("a\x1b[31m\nb"), "a\u{fffd}[31m\u{fffd}b");
    assert_eq!(sanitise_text(&"x".repeat(100_000)).chars().count(), 101);
}

/// Protects: a message says `1 joint`, but `0 joints` and `2 joints`.
#[test]
fn counts_agree_with_their_nouns() {
    let counts = [0, 1, 2].map(|count| format_count(count, "joint"));
    assert_eq!(counts, ["0 joints", "1 joint", "2 joints"]);
}

/// Protects: of warnings that differ only in their place, three are listed, and the others are
/// counted; the same warning twice counts once.
#[test]
fn equal_warnings_are_listed_once() {
    let mut warnings = Warnings::default();
    for i in (0..49).chain(0..49) {
        warnings.add(fault::FaultKind::Format, format!("materials[{i}]: is odd"));
        warnings.add(
            fault::FaultKind::Format,
            format!("materials[{i}]: has {i} layers"),
        );
    }
    let listed = warnings.into_warnings("f");
    let odd: Vec<&str> = (listed.iter().map(|warning| warning.message.as_str()))
        .filter(|message| message.ends_with("is odd"))
        .collect();
    assert_eq!(
        odd,
        [
            "f: materials[0]: is odd",
            "f: materials[1]: is odd",
            "f: materials[2] and 46 others: is odd"
        ]
    );
    assert_eq!(listed.len(), 3 + 49);
}
