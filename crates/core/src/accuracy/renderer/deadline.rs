//! End of a render before its time: the deadline, and the reason why a render has no result.

use std::time::Instant;

use crate::observer::Observer;
use crate::prepare::PrepareError;

/// Function that returns the current instant. Tests use a clock that advances with each call.
pub(in crate::accuracy) type ClockFunction<'a> = &'a (dyn Fn() -> Instant + Sync);

/// Reason why a render has no result.
#[derive(Debug)]
pub(in crate::accuracy) enum UnfinishedRender {
    /// The time ran out, or the observer stopped the render.
    Interrupted,
    /// The scene cannot be prepared.
    Failed(PrepareError),
}

impl UnfinishedRender {
    /// Converts the reason to an error, for a measurement that cannot continue without the render.
    pub fn into_error(self) -> PrepareError {
        match self {
            Self::Interrupted => PrepareError::Cancelled,
            Self::Failed(error) => error,
        }
    }

    /// Converts a render that was stopped, or whose time ran out, to `None`; other errors stay.
    pub fn none_if_interrupted<T>(result: Result<T, Self>) -> Result<Option<T>, PrepareError> {
        match result {
            Ok(value) => Ok(Some(value)),
            Err(Self::Interrupted) => Ok(None),
            Err(Self::Failed(error)) => Err(error),
        }
    }
}

/// Observer that stops a render at a deadline, or when the caller's observer stops it.
pub(super) struct DeadlineObserver<'a> {
    pub observer: &'a dyn Observer,
    pub now: ClockFunction<'a>,
    /// The deadline.
    pub end: Instant,
}

impl Observer for DeadlineObserver<'_> {
    fn is_cancelled(&self) -> bool {
        self.observer.is_cancelled() || (self.now)() >= self.end
    }
}
