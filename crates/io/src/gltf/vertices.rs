//! Selection of the vertices that a primitive's triangles use.

use rayon::iter::{IndexedParallelIterator, IntoParallelIterator, ParallelIterator};

/// Least number of elements that a thread processes; smaller lists are not divided further.
const ELEMENTS_PER_THREAD: usize = 1 << 14;

/// Vertices of the file that a primitive uses.
pub(super) enum VertexSelection {
    /// All vertices; the value is their number.
    All(usize),
    /// The vertices with these indices, in ascending order.
    Some(Vec<u32>),
}

impl VertexSelection {
    pub fn len(&self) -> usize {
        match self {
            Self::All(count) => *count,
            Self::Some(list) => list.len(),
        }
    }

    /// Calls `value_of` with the file index of each selected vertex. Returns the results in
    /// ascending order of the indices.
    pub fn map_selected_vertices<T: Send>(&self, value_of: impl Fn(usize) -> T + Sync) -> Vec<T> {
        match self {
            Self::All(count) => map_in_parallel(*count, value_of),
            Self::Some(list) => map_in_parallel(list.len(), |i| value_of(list[i] as usize)),
        }
    }

    /// Iterates over the indices of the selected vertices in the file.
    pub fn iter(&self) -> Box<dyn Iterator<Item = usize> + '_> {
        match self {
            Self::All(count) => Box::new(0..*count),
            Self::Some(list) => Box::new(list.iter().map(|&i| i as usize)),
        }
    }
}

/// Selects the vertices that a primitive's triangles use, and renumbers the triangles' corners to
/// match. Only the used part of a vertex list shared by several primitives is then copied. All
/// `count` vertices are selected if the triangles have at least `count` corners.
pub(super) fn select_used_vertices(
    corners: Vec<[u32; 3]>,
    count: usize,
) -> (VertexSelection, Vec<[u32; 3]>) {
    if corners.len().saturating_mul(3) >= count {
        return (VertexSelection::All(count), corners);
    }
    let mut used = corners.as_flattened().to_vec();
    used.sort_unstable();
    used.dedup();
    // Every index of a corner occurs in `used`.
    let place = |i: &u32| used.partition_point(|u| u < i) as u32;
    let indices = corners
        .iter()
        .map(|[a, b, c]| [place(a), place(b), place(c)])
        .collect();
    (VertexSelection::Some(used), indices)
}

/// Calls `value_of` with each number from 0 to `count` − 1, and returns the results in order. For
/// many elements, the calls run in parallel on the current thread pool.
pub(super) fn map_in_parallel<T: Send>(
    count: usize,
    value_of: impl Fn(usize) -> T + Sync,
) -> Vec<T> {
    if count < 2 * ELEMENTS_PER_THREAD {
        return (0..count).map(value_of).collect();
    }
    (0..count)
        .into_par_iter()
        .with_min_len(ELEMENTS_PER_THREAD)
        .map(&value_of)
        .collect()
}
