//! What the threads of the viewer have in common: what is wished for, what is shown, and who looks
//! on.

use std::collections::VecDeque;
use std::sync::mpsc::SyncSender;
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use serde::Deserialize;

use super::flags::Flag;

/// What the page wants to see.
#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Wish {
    /// The flags of `render`.
    pub flags: Vec<Flag>,
    /// What of the picture; empty: its colours.
    #[serde(default)]
    pub layer: String,
    /// Whether it is to be rendered anew though nothing changed.
    #[serde(default)]
    pub anew: bool,
}

/// A file that the page wants written.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SaveWish {
    /// Its name in the working folder.
    pub name: String,
    /// Whether what has that name may be replaced.
    #[serde(default)]
    pub replace: bool,
}

/// Something that is done once, between two steps of a render.
pub enum Job {
    /// Writes the picture; the answer is a status of HTTP and what to say.
    Save(SaveWish, SyncSender<(u16, String)>),
    /// Measures what effects cost.
    Measure,
}

/// A picture as the page shows it.
#[derive(Default)]
pub struct Frame {
    pub number: u64,
    pub size: [u32; 2],
    /// Pixels of the picture along an edge of one here.
    pub edge: u32,
    /// Red, green, blue and coverage of each pixel.
    pub codes: Vec<u8>,
}

/// See [`State`].
#[derive(Default)]
pub struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

/// What there is at a moment.
#[derive(Default)]
struct State {
    wish: Wish,
    /// Counts wishes.
    wished: u64,
    jobs: VecDeque<Job>,
    frame: Arc<Frame>,
    /// What is said besides, as JSON, and how often it changed.
    status: Arc<String>,
    told: u64,
    /// Pages that wait for news, and when the last one was heard of.
    waiting: usize,
    heard: Option<Instant>,
}

/// Things that are yet to be done at most.
const MOST_JOBS: usize = 4;

impl Shared {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state
            .lock()
            .unwrap_or_else(|poisoned| poisoned.into_inner())
    }

    /// Takes the place of what was wished for; the wish's number.
    pub fn wish(&self, wish: Wish) -> u64 {
        let mut state = self.state();
        (state.wish, state.wished) = (wish, state.wished + 1);
        self.changed.notify_all();
        state.wished
    }

    /// The last wish, if it is not this one.
    pub fn wish_after(&self, number: u64) -> Option<(u64, Wish)> {
        let state = self.state();
        (state.wished != number).then(|| (state.wished, state.wish.clone()))
    }

    /// Whether there is another wish by now, or something else to do.
    pub fn is_interrupted(&self, wish: u64) -> bool {
        let state = self.state();
        state.wished != wish || !state.jobs.is_empty()
    }

    /// Adds something to do; false where too much is waiting.
    pub fn add_job(&self, job: Job) -> bool {
        let mut state = self.state();
        let has_room = state.jobs.len() < MOST_JOBS;
        if has_room {
            state.jobs.push_back(job);
            self.changed.notify_all();
        }
        has_room
    }

    /// What is to be done next.
    pub fn take_job(&self) -> Option<Job> {
        self.state().jobs.pop_front()
    }

    /// Waits for something to do, or for a while.
    pub fn wait_for_work(&self, wish: u64, time: Duration) {
        let is_idle = |state: &mut State| state.wished == wish && state.jobs.is_empty();
        drop(self.changed.wait_timeout_while(self.state(), time, is_idle));
    }

    /// Shows a picture, where there is a new one, and says something.
    /// What is said is told how often that was, and the number of the picture.
    pub fn show(&self, frame: Option<Frame>, status: impl FnOnce(u64, u64) -> String) {
        let mut state = self.state();
        if let Some(frame) = frame {
            let number = state.frame.number + 1;
            state.frame = Arc::new(Frame { number, ..frame });
        }
        state.told += 1;
        state.status = Arc::new(status(state.told, state.frame.number));
        self.changed.notify_all();
    }

    /// The picture that is shown.
    pub fn frame(&self) -> Arc<Frame> {
        self.state().frame.clone()
    }

    /// What is said, once it is not what was told before; the same again after a while.
    pub fn status_after(&self, told: u64, time: Duration) -> Arc<String> {
        let mut state = self.state();
        state.waiting += 1;
        let waited = self
            .changed
            .wait_timeout_while(state, time, |state| state.told == told);
        let (mut state, _) = waited.unwrap_or_else(|poisoned| poisoned.into_inner());
        state.waiting -= 1;
        state.heard = Some(Instant::now());
        state.status.clone()
    }

    /// A page was heard of.
    pub fn hear(&self) {
        self.state().heard = Some(Instant::now());
    }

    /// Whether there were pages, and none was heard of for so long.
    pub fn is_abandoned(&self, linger: Duration) -> bool {
        let state = self.state();
        state.waiting == 0 && state.heard.is_some_and(|heard| heard.elapsed() >= linger)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: a program without a page waits for one, and ends a while after the last one was
    /// heard of.
    #[test]
    fn a_viewer_ends_after_its_pages() {
        let shared = Shared::default();
        assert!(!shared.is_abandoned(Duration::ZERO));
        shared.hear();
        assert!(
            shared.is_abandoned(Duration::ZERO) && !shared.is_abandoned(Duration::from_secs(60))
        );
    }

    /// Protects: what has not been told comes at once, and each wish has a number of its own though
    /// it is the same.
    #[test]
    fn news_come_at_once() {
        let shared = Shared::default();
        shared.show(None, |told, _| format!("told {told}"));
        assert_eq!(
            shared.status_after(0, Duration::from_secs(3600)).as_str(),
            "told 1"
        );
        let [first, second] = [(); 2].map(|()| shared.wish(Wish::default()));
        assert!(first != second && shared.is_interrupted(first) && !shared.is_interrupted(second));
        assert!(shared.wish_after(first).is_some() && shared.wish_after(second).is_none());
    }
}
