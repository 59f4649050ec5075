//! State shared by the viewer's threads: the page's current request, the displayed picture, and the
//! open pages.

use std::collections::VecDeque;
use std::sync::mpsc::SyncSender;
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use serde::Deserialize;
use serde_json::Value;

use crate::args::Flag;

/// View that the page requests: flags and a layer.
#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct ViewRequest {
    /// Flags of `render`.
    pub flags: Vec<Flag>,
    /// Name of the displayed layer; empty for the picture's colours.
    #[serde(default)]
    pub layer: String,
    /// Whether to render again although no flag changed.
    #[serde(default)]
    pub anew: bool,
}

/// Request of the page to save the picture.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SaveRequest {
    /// File name in the working folder.
    pub name: String,
    /// Whether an existing file of this name may be replaced.
    #[serde(default)]
    pub replace: bool,
}

/// A job of the computing thread, done between two slices of a render.
pub enum ViewJob {
    /// Saves the picture, and sends an HTTP status and a message to the thread that serves the
    /// page.
    Save(SaveRequest, SyncSender<(u16, String)>),
    /// Measures the time that each effect costs.
    Measure,
}

/// A picture for the page, as 8-bit codes.
#[derive(Default)]
pub struct ViewFrame {
    /// Number of the picture, which rises with each new picture.
    pub number: u64,
    /// Width and height of this picture in its own pixels.
    pub size: [u32; 2],
    /// Edge of each pixel, in pixels of the final picture; above 1 in coarse previews.
    pub edge: u32,
    /// Red, green, blue and coverage codes of each pixel.
    pub codes: Vec<u8>,
}

/// State shared by the computing thread and the serving threads, behind a lock, with a signal for
/// changes.
#[derive(Default)]
pub struct SharedView {
    state: Mutex<SharedState>,
    /// Signal for a change of the state.
    changed: Condvar,
}

/// State of the viewer behind the lock of [`SharedView`].
#[derive(Default)]
struct SharedState {
    /// The page's current request.
    view_request: ViewRequest,
    /// Number of requests of the page so far; the current request has this number.
    request_count: u64,
    /// Jobs of the page that wait for the computing thread.
    jobs: VecDeque<ViewJob>,
    /// The displayed picture.
    frame: Arc<ViewFrame>,
    /// Status of the viewer.
    status: Value,
    /// Number of the status, which rises with each change.
    status_number: u64,
    /// Number of HTTP requests that wait for a new status.
    waiting_pages: usize,
    /// Time of the last HTTP request of any page; `None` before the first.
    last_page_request: Option<Instant>,
}

/// Largest number of waiting jobs.
const MOST_JOBS: usize = 4;

impl SharedView {
    fn lock_state(&self) -> MutexGuard<'_, SharedState> {
        self.state
            .lock()
            .unwrap_or_else(|poisoned| poisoned.into_inner())
    }

    /// Replaces the page's current request. Returns the number of the new request.
    pub fn submit_request(&self, view_request: ViewRequest) -> u64 {
        let mut state = self.lock_state();
        (state.view_request, state.request_count) = (view_request, state.request_count + 1);
        self.changed.notify_all();
        state.request_count
    }

    /// Returns the page's current request and its number; `None` if the caller has this request
    /// already, because its number equals `number`.
    pub fn request_newer_than(&self, number: u64) -> Option<(u64, ViewRequest)> {
        let state = self.lock_state();
        (state.request_count != number).then(|| (state.request_count, state.view_request.clone()))
    }

    /// Whether a job, or a request with a number above `wish`, is waiting.
    pub fn has_newer_work(&self, wish: u64) -> bool {
        let state = self.lock_state();
        state.request_count != wish || !state.jobs.is_empty()
    }

    /// Adds a job for the computing thread. Returns false, without adding it, if too many jobs are
    /// waiting.
    pub fn add_job(&self, job: ViewJob) -> bool {
        let mut state = self.lock_state();
        let has_room = state.jobs.len() < MOST_JOBS;
        if has_room {
            state.jobs.push_back(job);
            self.changed.notify_all();
        }
        has_room
    }

    /// Removes and returns the job that has waited longest.
    pub fn take_job(&self) -> Option<ViewJob> {
        self.lock_state().jobs.pop_front()
    }

    /// Blocks until a job or a request with a number above `wish` arrives, at most for `time`.
    pub fn wait_for_work(&self, wish: u64, time: Duration) {
        let is_idle =
            |state: &mut SharedState| state.request_count == wish && state.jobs.is_empty();
        drop(
            self.changed
                .wait_timeout_while(self.lock_state(), time, is_idle),
        );
    }

    /// Publishes a new picture, if any, and a new status, to which its number and the picture's are
    /// added.
    pub fn publish_frame_and_status(&self, frame: Option<ViewFrame>, status: Value) {
        let mut state = self.lock_state();
        if let Some(frame) = frame {
            let number = state.frame.number + 1;
            state.frame = Arc::new(ViewFrame { number, ..frame });
        }
        state.status = status;
        state.status["picture"] = state.frame.number.into();
        self.renew_status(&mut state);
    }

    /// Publishes a stage of loading a scene, for a request with this number.
    pub fn publish_stage(&self, request: u64, stage: &str) {
        let mut state = self.lock_state();
        for (name, value) in [
            ("request", request.into()),
            ("phase", "loading".into()),
            ("message", stage.into()),
            ("failure", Value::Null),
        ] {
            state.status[name] = value;
        }
        self.renew_status(&mut state);
    }

    fn renew_status(&self, state: &mut SharedState) {
        state.status_number += 1;
        state.status["number"] = state.status_number.into();
        self.changed.notify_all();
    }

    /// Returns the displayed picture.
    pub fn current_frame(&self) -> Arc<ViewFrame> {
        self.lock_state().frame.clone()
    }

    /// Returns the status as soon as its number differs from `reported`, the number that the page
    /// has; after `time`, the unchanged status.
    pub fn wait_for_newer_status(&self, reported: u64, time: Duration) -> String {
        let mut state = self.lock_state();
        state.waiting_pages += 1;
        let waited = self
            .changed
            .wait_timeout_while(state, time, |state| state.status_number == reported);
        let (mut state, _) = waited.unwrap_or_else(|poisoned| poisoned.into_inner());
        state.waiting_pages -= 1;
        state.last_page_request = Some(Instant::now());
        state.status.to_string()
    }

    /// Records the time of an HTTP request of a page.
    pub fn record_page_request(&self) {
        self.lock_state().last_page_request = Some(Instant::now());
    }

    /// Whether a page was open and no page has sent an HTTP request for the time `linger`.
    pub fn is_abandoned(&self, linger: Duration) -> bool {
        let state = self.lock_state();
        state.waiting_pages == 0
            && state
                .last_page_request
                .is_some_and(|heard| heard.elapsed() >= linger)
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    /// Protects: the program waits without limit for its first page, and ends a while after the
    /// last request of a page.
    #[test]
    fn a_viewer_ends_after_its_pages() {
        let shared = SharedView::default();
        assert!(!shared.is_abandoned(Duration::ZERO));
        shared.record_page_request();
        assert!(
            shared.is_abandoned(Duration::ZERO) && !shared.is_abandoned(Duration::from_secs(60))
        );
    }

    /// Protects: a new status is returned at once, a stage of loading keeps the rest of the status,
    /// and each request of the page has a new number even if repeated.
    #[test]
    fn news_come_at_once() {
        let shared = SharedView::default();
        let ask = |reported| -> serde_json::Value {
            let status = shared.wait_for_newer_status(reported, Duration::from_secs(3600));
            serde_json::from_str(&status).expect("JSON")
        };
        shared.publish_frame_and_status(None, json!({ "phase": "rendering", "size": 7 }));
        assert_eq!(
            ask(0),
            json!({ "number": 1, "phase": "rendering", "picture": 0, "size": 7 })
        );
        shared.publish_stage(3, "reading");
        assert_eq!(
            ask(1),
            json!({ "failure": null, "message": "reading", "number": 2, "phase": "loading", "picture": 0, "request": 3, "size": 7 })
        );
        let [first, second] = [(); 2].map(|()| shared.submit_request(ViewRequest::default()));
        assert!(first != second && shared.has_newer_work(first) && !shared.has_newer_work(second));
        assert!(
            shared.request_newer_than(first).is_some()
                && shared.request_newer_than(second).is_none()
        );
    }
}
