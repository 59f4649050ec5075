//! The hard cases of numerics: what is hard about each, and the bound that it is held to. Each is a test, or several, whose name begins with
//! its number.

/// A hard case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HardCase {
    /// A letter and two digits: P primitives, T traversal, S rays that leave surfaces and shading, M sampling, F camera and film.
    pub number: &'static str,
    /// What is hard.
    pub hard: &'static str,
    /// The bound, in words.
    pub bound: &'static str,
    /// What of it this program has no such thing for, and why; none where all of it is held.
    pub left_out: Option<&'static str>,
}

/// One case a line: number, what is hard, bound and what is left out.
const LIST: &str = include_str!("stability/cases.txt");

/// All hard cases in the order of the list.
pub fn hard_cases() -> impl Iterator<Item = HardCase> {
    LIST.lines().map(|line| {
        let mut parts = line.split('|').map(str::trim);
        let mut next = || parts.next().unwrap_or_default();
        let (number, hard, bound) = (next(), next(), next());
        HardCase { number, hard, bound, left_out: parts.next() }
    })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::hard_cases;

    /// Protects: the list is whole: each number once, none missing between a letter's first and last, and each with what is hard and a bound.
    #[test]
    fn the_list_is_whole() {
        let numbers: BTreeSet<_> = hard_cases().map(|case| case.number.to_owned()).collect();
        let letters = [("P", 23), ("T", 21), ("S", 21), ("M", 14), ("F", 10)];
        let wanted = letters.iter().flat_map(|(letter, last)| (1..=*last).map(move |i| format!("{letter}{i:02}")));
        assert_eq!(numbers, wanted.collect());
        assert_eq!(hard_cases().count(), numbers.len());
        assert!(hard_cases().all(|case| !case.hard.is_empty() && !case.bound.is_empty() && case.left_out != Some("")));
    }
}
