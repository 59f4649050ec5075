//! A count that keeps its first items, so that a finding can show where they are.

/// Number of items that are kept.
const KEPT: usize = 1 << 10;

/// The number of items, and the first of them.
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
    pub fn add(&mut self, one: T) {
        self.count += 1;
        if self.some.len() < KEPT {
            self.some.push(one);
        }
    }

    pub fn plus(mut self, other: Self) -> Self {
        self.count += other.count;
        let room = KEPT - self.some.len();
        self.some.extend(other.some.into_iter().take(room));
        self
    }

    pub fn of(all: impl Iterator<Item = T>) -> Self {
        let mut tally = Self::default();
        all.for_each(|one| tally.add(one));
        tally
    }
}
