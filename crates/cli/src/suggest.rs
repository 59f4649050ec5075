//! "Did you mean": the message for a name that does not exist.

/// Says that there is no such thing, which one was probably meant, and which there are.
pub fn unknown(what: &str, name: &str, known: &[&str]) -> String {
    let nearest = known
        .iter()
        .map(|candidate| (strsim::damerau_levenshtein(&name.to_lowercase(), &candidate.to_lowercase()), candidate))
        .min()
        .filter(|&(distance, candidate)| distance <= 1.max(candidate.chars().count() / 3));
    let mut message = format!("there is no {what} `{name}`");
    if let Some((_, candidate)) = nearest {
        message += &format!("; did you mean `{candidate}`?");
    }
    if !known.is_empty() {
        message += &format!("\n  known: {}", known.join(", "));
    }
    message
}

#[cfg(test)]
mod tests {
    use super::unknown;

    /// A slip of the finger is recognised; something else altogether is not guessed at.
    #[test]
    fn only_near_names_are_suggested() {
        let known = ["whitted", "noise", "shapes"];
        assert_eq!(
            unknown("preset", "Witted", &known),
            "there is no preset `Witted`; did you mean `whitted`?\n  known: whitted, noise, shapes"
        );
        assert_eq!(unknown("preset", "cornell", &known), "there is no preset `cornell`\n  known: whitted, noise, shapes");
        assert_eq!(unknown("camera", "front", &[]), "there is no camera `front`");
    }
}
