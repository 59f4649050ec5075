//! Choosing by weight: a running sum of probabilities that is exactly 1 at its end, and in which what has no weight takes no room.

/// Appends the running sum of the weights' shares and returns their total; what is not above zero counts as nothing. Where
/// nothing has weight only the last entry is 1, so that whoever looks finds the end.
pub(super) fn push_shares(cumulative: &mut Vec<f64>, weights: &[f64]) -> f64 {
    let total: f64 = weights.iter().filter(|&&w| w > 0.0).sum();
    let last = weights.iter().rposition(|&w| w > 0.0).unwrap_or_else(|| weights.len().saturating_sub(1));
    let mut sum = 0.0;
    for (i, &weight) in weights.iter().enumerate() {
        if weight > 0.0 {
            sum += weight / total;
        }
        // Rounding may take the sum past one, and must not leave what lies beyond the last weight to those without.
        let share: f64 = if i < last { sum } else { 1.0 };
        cumulative.push(share.min(1.0));
    }
    total
}

/// The share of an entry.
pub(super) fn share<T: Copy + Into<f64>>(cumulative: &[T], index: usize) -> f64 {
    let before = if index == 0 { 0.0 } else { cumulative[index - 1].into() };
    cumulative[index].into() - before
}

/// The entry at a number in [0, 1), its share, and how far into it the number lies, in [0, 1).
pub(super) fn pick<T: Copy + Into<f64>>(cumulative: &[T], at: f64) -> (usize, f64, f64) {
    let at = at.min(1.0_f64.next_down());
    let index = cumulative.partition_point(|&c| c.into() <= at);
    let share = share(cumulative, index);
    let before = cumulative[index].into() - share;
    (index, share, ((at - before) / share).clamp(0.0, 1.0_f64.next_down()))
}
