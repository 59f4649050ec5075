//! State shared by the viewer's threads: the current wish, the displayed picture, and the open
//! pages.

use std::collections::VecDeque;
use std::sync::mpsc::SyncSender;
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use serde::Deserialize;

use super::flags::Flag;

/// Requested view of the page.
#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct ViewRequest {
    /// Flags of `render`.
    pub flags: Vec<Flag>,
    /// Name of the displayed layer; empty: colours.
    #[serde(default)]
    pub layer: String,
    /// Whether to render again although nothing changed.
    #[serde(default)]
    pub anew: bool,
}

/// Request of the page to save the picture.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SaveRequest {
    /// File name in the working folder.
    pub name: String,
    /// Whether an existing file may be replaced.
    #[serde(default)]
    pub replace: bool,
}

/// Work done once, between two pieces of a render.
pub enum ViewJob {
    /// Saves the picture; the result is an HTTP status and a message.
    Save(SaveRequest, SyncSender<(u16, String)>),
    /// Measures the costs of effects.
    Measure,
}

/// A picture for the page.
#[derive(Default)]
pub struct ViewFrame {
    pub number: u64,
    pub size: [u32; 2],
    /// Edge of a sketch's pixel, in pixels of the picture.
    pub edge: u32,
    /// Red, green, blue and coverage codes of each pixel.
    pub codes: Vec<u8>,
}

/// See [`SharedState`].
#[derive(Default)]
pub struct SharedView {
    state: Mutex<SharedState>,
    changed: Condvar,
}

/// State behind the lock.
#[derive(Default)]
struct SharedState {
    view_request: ViewRequest,
    /// Number of wishes so far.
    wished: u64,
    jobs: VecDeque<ViewJob>,
    frame: Arc<ViewFrame>,
    /// Status as JSON, and the number of its changes.
    status: Arc<String>,
    reported: u64,
    /// Number of pages that wait for a status, and time of the last request.
    waiting: usize,
    heard: Option<Instant>,
}

/// Largest number of waiting jobs.
const MOST_JOBS: usize = 4;

impl SharedView {
    fn state(&self) -> MutexGuard<'_, SharedState> {
        self.state
            .lock()
            .unwrap_or_else(|poisoned| poisoned.into_inner())
    }

    /// Replaces the current wish; returns the number of the new one.
    pub fn wish(&self, view_request: ViewRequest) -> u64 {
        let mut state = self.state();
        (state.view_request, state.wished) = (view_request, state.wished + 1);
        self.changed.notify_all();
        state.wished
    }

    /// Returns the current wish with its number, if newer than `number`.
    pub fn wish_after(&self, number: u64) -> Option<(u64, ViewRequest)> {
        let state = self.state();
        (state.wished != number).then(|| (state.wished, state.view_request.clone()))
    }

    /// Whether a newer wish or a job is waiting.
    pub fn is_interrupted(&self, wish: u64) -> bool {
        let state = self.state();
        state.wished != wish || !state.jobs.is_empty()
    }

    /// Adds a job; returns false where too many are waiting.
    pub fn add_job(&self, job: ViewJob) -> bool {
        let mut state = self.state();
        let has_room = state.jobs.len() < MOST_JOBS;
        if has_room {
            state.jobs.push_back(job);
            self.changed.notify_all();
        }
        has_room
    }

    /// Removes and returns the next job.
    pub fn take_job(&self) -> Option<ViewJob> {
        self.state().jobs.pop_front()
    }

    /// Waits for a newer wish or a job, up to a time limit.
    pub fn wait_for_work(&self, wish: u64, time: Duration) {
        let is_idle = |state: &mut SharedState| state.wished == wish && state.jobs.is_empty();
        drop(self.changed.wait_timeout_while(self.state(), time, is_idle));
    }

    /// Publishes a picture, if new, and a status. `status` receives the number of the status and of
    /// the picture.
    pub fn show(&self, frame: Option<ViewFrame>, status: impl FnOnce(u64, u64) -> String) {
        let mut state = self.state();
        if let Some(frame) = frame {
            let number = state.frame.number + 1;
            state.frame = Arc::new(ViewFrame { number, ..frame });
        }
        state.reported += 1;
        state.status = Arc::new(status(state.reported, state.frame.number));
        self.changed.notify_all();
    }

    /// The displayed picture.
    pub fn frame(&self) -> Arc<ViewFrame> {
        self.state().frame.clone()
    }

    /// Returns the status once it is newer than number `reported`, or the same one after a time
    /// limit.
    pub fn status_after(&self, reported: u64, time: Duration) -> Arc<String> {
        let mut state = self.state();
        state.waiting += 1;
        let waited = self
            .changed
            .wait_timeout_while(state, time, |state| state.reported == reported);
        let (mut state, _) = waited.unwrap_or_else(|poisoned| poisoned.into_inner());
        state.waiting -= 1;
        state.heard = Some(Instant::now());
        state.status.clone()
    }

    /// Records a request of a page.
    pub fn hear(&self) {
        self.state().heard = Some(Instant::now());
    }

    /// Whether pages existed and none has sent a request for this long.
    pub fn is_abandoned(&self, linger: Duration) -> bool {
        let state = self.state();
        state.waiting == 0 && state.heard.is_some_and(|heard| heard.elapsed() >= linger)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: a program without a page waits for one, and ends after a while without requests.
    #[test]
    fn a_viewer_ends_after_its_pages() {
        let shared = SharedView::default();
        assert!(!shared.is_abandoned(Duration::ZERO));
        shared.hear();
        assert!(
            shared.is_abandoned(Duration::ZERO) && !shared.is_abandoned(Duration::from_secs(60))
        );
    }

    /// Protects: a new status is returned at once, and each wish has a new number even if repeated.
    #[test]
    fn news_come_at_once() {
        let shared = SharedView::default();
        shared.show(None, |reported, _| format!("told {reported}"));
        assert_eq!(
            shared.status_after(0, Duration::from_secs(3600)).as_str(),
            "told 1"
        );
        let [first, second] = [(); 2].map(|()| shared.wish(ViewRequest::default()));
        assert!(first != second && shared.is_interrupted(first) && !shared.is_interrupted(second));
        assert!(shared.wish_after(first).is_some() && shared.wish_after(second).is_none());
    }
}
