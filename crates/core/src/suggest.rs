//! "Did you mean": the known word that is nearest to an unknown one.

/// Returns the candidate that a mistyped word most likely stands for, if any is near enough: at
/// most one edit per three characters. A swap of neighbours is one edit; case and the choice of
/// `-`, `_` or space do not count.
pub fn closest<'a>(wrong: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    // The edit distance costs the product of both lengths, and no mistyped word is this long.
    const LONGEST: usize = 64;
    if wrong.len() > LONGEST {
        return None;
    }
    let wrong = plain(wrong);
    let edits = (wrong.chars().count() / 3).max(1);
    candidates
        .into_iter()
        .filter(|candidate| candidate.len() <= LONGEST)
        .map(|candidate| {
            (
                strsim::damerau_levenshtein(&wrong, &plain(candidate)),
                candidate,
            )
        })
        .filter(|(distance, candidate)| *distance <= edits && *distance < candidate.chars().count())
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}

fn plain(word: &str) -> String {
    word.chars()
        .map(|c| {
            if matches!(c, '-' | ' ') {
                '_'
            } else {
                c.to_ascii_lowercase()
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::closest;

    /// Protects: typing errors and other spellings find their word.
    #[test]
    fn typing_errors_and_other_spellings_find_their_word() {
        let words = ["colour", "centre", "radius", "vertical_fov", "u"];
        for (wrong, right) in [
            ("color", "colour"),
            ("center", "centre"),
            ("Radius", "radius"),
            ("RADIUS", "radius"),
            ("vertical-fov", "vertical_fov"),
        ] {
            assert_eq!(closest(wrong, words), Some(right), "{wrong}");
        }
    }

    /// Protects: a word far from every candidate gets no suggestion.
    #[test]
    fn what_is_not_near_gets_no_suggestion() {
        for wrong in ["banana", "x", "", &"radius".repeat(100)] {
            assert_eq!(closest(wrong, ["colour", "radius", "u"]), None, "{wrong}");
        }
    }
}
