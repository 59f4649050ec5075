//! A count that also keeps its first items, so that a finding can show their positions.

/// Greatest number of items that are kept.
const KEPT: usize = 1 << 10;

/// The number of items, and the first of the items themselves.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct CountAndFirst<T = u32> {
    pub count: u64,
    pub some: Vec<T>,
}

impl<T> Default for CountAndFirst<T> {
    fn default() -> Self {
        Self {
            count: 0,
            some: Vec::new(),
        }
    }
}

impl<T> CountAndFirst<T> {
    pub fn add_item(&mut self, one: T) {
        self.count += 1;
        if self.some.len() < KEPT {
            self.some.push(one);
        }
    }

    pub fn merge(mut self, other: Self) -> Self {
        self.count += other.count;
        let room = KEPT - self.some.len();
        self.some.extend(other.some.into_iter().take(room));
        self
    }

    pub fn from_items(all: impl Iterator<Item = T>) -> Self {
        let mut tally = Self::default();
        all.for_each(|one| tally.add_item(one));
        tally
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: a merged count counts the items of both. It keeps the first items of both, in
    /// order, up to the limit.
    #[test]
    fn a_sum_counts_all_and_keeps_the_first() {
        for (left, right) in [
            (0, 0),
            (0, 3),
            (3, 0),
            (KEPT - 1, 5),
            (KEPT + 7, 5),
            (2, KEPT + 9),
        ] {
            let [first, second] = [0..left, left..left + right].map(CountAndFirst::from_items);
            let sum = first.merge(second);
            let all = left + right;
            assert_eq!(sum.count, all as u64, "{left} and {right}");
            let kept = left.min(KEPT) + right.min(KEPT - left.min(KEPT));
            assert_eq!(
                sum.some,
                (0..kept).collect::<Vec<_>>(),
                "{left} and {right}"
            );
        }
    }
}
