//! The hint "did you mean": the known word that is most similar to an unknown word.

/// Returns the candidate that is most similar to a mistyped word; `None` if none is similar. The
/// similarity limit is one edit per three characters, and one edit for shorter words. An edit
/// inserts, removes or replaces a character, or swaps two neighbours. Case does not count, nor does
/// the choice between `-`, `_` and space.
pub fn most_similar_word<'a>(
    wrong: &str,
    candidates: impl IntoIterator<Item = &'a str>,
) -> Option<&'a str> {
    // The time for an edit distance is the product of both lengths, and no mistyped word is longer
    // than this.
    const LONGEST: usize = 64;
    if wrong.len() > LONGEST {
        return None;
    }
    let wrong = normalize_word(wrong);
    let edits = (wrong.chars().count() / 3).max(1);
    candidates
        .into_iter()
        .filter(|candidate| candidate.len() <= LONGEST)
        .map(|candidate| {
            (
                strsim::damerau_levenshtein(&wrong, &normalize_word(candidate)),
                candidate,
            )
        })
        .filter(|(distance, candidate)| *distance <= edits && *distance < candidate.chars().count())
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}

/// Returns a word in lower case with `_` in place of `-` and space.
fn normalize_word(word: &str) -> String {
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
    use super::most_similar_word;

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
            assert_eq!(most_similar_word(wrong, words), Some(right), "{wrong}");
        }
    }

    /// Protects: a word far from every candidate gets no suggestion.
    #[test]
    fn what_is_not_near_gets_no_suggestion() {
        for wrong in ["banana", "x", "", &"radius".repeat(100)] {
            assert_eq!(
                most_similar_word(wrong, ["colour", "radius", "u"]),
                None,
                "{wrong}"
            );
        }
    }
}
