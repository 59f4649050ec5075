//! A cover of all pairs: few rows of values, so that each two values of different axes that go
//! together meet in a row.

use super::axes::{AXES, EXCLUDED, TOGETHER};

/// A value of each axis, by its index.
pub type Choice = Vec<usize>;

/// Number of candidates of which a row is the best.
const CANDIDATES: usize = 12;

/// Whether a value is one of a rule's: those of a prefix, or all but one.
fn is_meant(rule: &str, value: &str) -> bool {
    match rule.strip_prefix('!') {
        Some(other) => value != other,
        None => value.starts_with(rule),
    }
}

/// The pairs of values, by axis and index, with whether they go together and whether a row has
/// them.
struct PairTable {
    first: Vec<usize>,
    values: usize,
    legal: Vec<bool>,
    open: Vec<bool>,
}

impl PairTable {
    fn new() -> Self {
        let first: Vec<usize> = AXES
            .iter()
            .scan(0, |sum, axis| {
                Some(std::mem::replace(sum, *sum + axis.1.len()))
            })
            .collect();
        let values: usize = AXES.iter().map(|axis| axis.1.len()).sum();
        let named: Vec<(&str, &str)> = AXES
            .iter()
            .flat_map(|axis| axis.1.iter().map(|value| (axis.0, value.0)))
            .collect();
        let is_excluded = |a: (&str, &str), b: (&str, &str)| {
            EXCLUDED.iter().any(|[p, q]| {
                [[a, b], [b, a]].iter().any(|[a, b]| {
                    a.0 == p.0 && b.0 == q.0 && is_meant(p.1, a.1) && is_meant(q.1, b.1)
                })
            })
        };
        let pairs = || {
            named
                .iter()
                .flat_map(|&a| named.iter().map(move |&b| (a, b)))
        };
        let legal: Vec<bool> = pairs().map(|(a, b)| !is_excluded(a, b)).collect();
        let open = pairs()
            .zip(&legal)
            .map(|((a, b), &legal)| legal && a.0 != b.0)
            .collect();
        Self {
            first,
            values,
            legal,
            open,
        }
    }

    /// Index of a pair of values, each given by its axis and its index there.
    fn at(&self, a: (usize, usize), b: (usize, usize)) -> usize {
        (self.first[a.0] + a.1) * self.values + self.first[b.0] + b.1
    }

    /// A row with the given values, the other axes in a random order: each takes the value that meets
    /// most partners for the first time. `None` if an axis has no value that goes with the others.
    fn complete(
        &self,
        given: &[(usize, usize)],
        rng: &mut impl FnMut() -> usize,
    ) -> Option<Choice> {
        let mut fixed = given.to_vec();
        let mut axes: Vec<usize> = (0..AXES.len())
            .filter(|&axis| given.iter().all(|own| own.0 != axis))
            .collect();
        while !axes.is_empty() {
            let axis = axes.swap_remove(rng() % axes.len());
            let legal = (0..AXES[axis].1.len()).filter(|&value| {
                fixed
                    .iter()
                    .all(|&other| self.legal[self.at((axis, value), other)])
            });
            let gain = |value: usize| {
                fixed
                    .iter()
                    .filter(|&&other| self.open[self.at((axis, value), other)])
                    .count()
            };
            let best = legal.map(|value| (gain(value), rng(), value)).max()?;
            fixed.push((axis, best.2));
        }
        fixed.sort_unstable();
        Some(fixed.into_iter().map(|own| own.1).collect())
    }

    /// Pairs of a row.
    fn pairs_of(&self, row: &[usize]) -> Vec<usize> {
        let places: Vec<(usize, usize)> = row.iter().copied().enumerate().collect();
        places
            .iter()
            .flat_map(|&a| places.iter().map(move |&b| (a, b)))
            .filter(|(a, b)| a.0 != b.0)
            .map(|(a, b)| self.at(a, b))
            .collect()
    }

    /// The first pair that no row has.
    fn first_open(&self) -> Option<Vec<(usize, usize)>> {
        let place = |value: usize| {
            let axis = self.first.partition_point(|&first| first <= value) - 1;
            (axis, value - self.first[axis])
        };
        let pair = self.open.iter().position(|&open| open)?;
        Some(vec![place(pair / self.values), place(pair % self.values)])
    }
}

/// Index of an axis by its name.
pub fn axis_index(name: &str) -> usize {
    AXES.iter()
        .position(|axis| axis.0 == name)
        .expect("an axis")
}

/// Index of a value of an axis.
pub fn value_index(axis: &str, value: &str) -> usize {
    let values = AXES[axis_index(axis)].1;
    values
        .iter()
        .position(|own| own.0 == value)
        .expect("a value")
}

/// Values by their indices.
fn indices(values: &[(&str, &str)]) -> Vec<(usize, usize)> {
    let index = |&(axis, value): &(&str, &str)| (axis_index(axis), value_index(axis, value));
    values.iter().map(index).collect()
}

/// Rows that have the values of [`TOGETHER`] and cover every pair of values that go together. The
/// same tables give the same rows.
pub fn cover() -> Vec<Choice> {
    let mut table = PairTable::new();
    let mut state = 1_u64;
    let mut rng = move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize
    };
    let mut rows = Vec::new();
    let mut together = TOGETHER.iter().map(|values| indices(values));
    while let Some(given) = together.next().or_else(|| table.first_open()) {
        let candidates = (0..CANDIDATES).filter_map(|_| table.complete(&given, &mut rng));
        let gain = |row: &Choice| {
            table
                .pairs_of(row)
                .into_iter()
                .filter(|&pair| table.open[pair])
                .count()
        };
        let row = candidates.max_by_key(gain).unwrap_or_else(|| {
            let names = given
                .iter()
                .map(|&(axis, value)| (AXES[axis].0, AXES[axis].1[value].0));
            let names: Vec<_> = names.collect();
            panic!(
                "no row has {names:?}: exclude a pair, or give an axis a value that goes with all"
            )
        });
        for pair in table.pairs_of(&row) {
            table.open[pair] = false;
        }
        rows.push(row);
    }
    rows
}

/// Name of a row: its values that are not the plain ones.
pub fn name(row: &[usize]) -> String {
    let named = row.iter().zip(AXES).filter(|(value, _)| **value > 0);
    let values: Vec<String> = named
        .map(|(&value, axis)| format!("{}={}", axis.0, axis.1[value].0))
        .collect();
    values.join(", ")
}

/// Protects: each two values of different axes that go together are together in a row, counted
/// afresh, and no row has two that do not. Each list of values that must meet has a row.
#[test]
fn rows_cover_all_pairs() {
    let (rows, table) = (cover(), PairTable::new());
    let mut seen = vec![false; table.legal.len()];
    for row in &rows {
        assert_eq!(row.len(), AXES.len());
        for pair in table.pairs_of(row) {
            assert!(table.legal[pair], "{}", name(row));
            seen[pair] = true;
        }
    }
    for values in TOGETHER {
        let values = indices(values);
        let has = |row: &Choice| values.iter().all(|&(axis, value)| row[axis] == value);
        assert!(rows.iter().any(has), "{values:?}");
    }
    let missing = seen
        .iter()
        .zip(&table.open)
        .filter(|&(&seen, &open)| open && !seen)
        .count();
    assert_eq!(
        missing,
        0,
        "of {}",
        table.open.iter().filter(|&&open| open).count()
    );
    eprintln!(
        "{} rows cover {} pairs",
        rows.len(),
        seen.iter().filter(|&&seen| seen).count() / 2
    );
}
