//! Stack of paths that wait until their side branches end.

use raywright_bvh::Real;

use super::WhittedTracer;
use super::state::WhittedState;

/// Number of side branches between checks for cancellation.
const DIVISIONS: u32 = 4096;

impl<R: Real> WhittedTracer<'_, R> {
    /// Pushes a path onto the stack of waiting paths, and continues with its side branch. Not
    /// inlined: most paths never branch.
    #[inline(never)]
    pub(super) fn defer_path(&mut self, path: &mut WhittedState<R>, side_branch: WhittedState<R>) {
        self.divisions = self.divisions.wrapping_add(1);
        if self.divisions.is_multiple_of(DIVISIONS) && self.observer.is_cancelled() {
            self.stopped = true;
        }
        if self.stopped {
            self.waiting_paths.clear();
            path.remaining_segments = 0;
        } else {
            self.waiting_paths
                .push(core::mem::replace(path, side_branch));
        }
    }

    /// Replaces an ended path by the path that waits for it, if any. Returns whether a path
    /// continues.
    #[inline(always)]
    pub(super) fn resume_waiting_path(&mut self, path: &mut WhittedState<R>) -> bool {
        !self.waiting_paths.is_empty() && self.pop_waiting_path(path)
    }

    /// Adds an ended path to the path that waits for it, and continues the first waiting path that
    /// has segments left. Returns whether a path continues.
    #[inline(never)]
    fn pop_waiting_path(&mut self, path: &mut WhittedState<R>) -> bool {
        while let Some(before) = self.waiting_paths.pop() {
            let state = core::mem::replace(path, before);
            path.radiance += state.radiance;
            path.coverage += state.coverage;
            path.passages = state.passages;
            // The waiting path may itself have no segments left.
            if path.remaining_segments > 0 {
                return true;
            }
        }
        false
    }
}
