//! Shared parts of the importers: failures inside a file, warnings, unique names, and a budget of
//! memory.

use std::collections::HashSet;
use std::fmt;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::atomic::{AtomicU64, Ordering};

use raywright_core::memory::{can_allocate, remaining_heap_bytes};
use raywright_core::validate::validate;
use raywright_core::{Observer, Scene, fault};

use crate::error_kind::ErrorKind;
use crate::folder::ReadError;
use crate::{Error, Limits, format_bytes};

/// Creates a [`Fault`] for wrong content, from a format string.
macro_rules! fault {
    ($($message:tt)*) => {
        $crate::import::Fault::invalid_input(format!($($message)*))
    };
}

/// Adds a warning with a code to a list of [`Warnings`], from a format string.
macro_rules! warn {
    ($warnings:expr, $code:ident, $($message:tt)*) => {
        $warnings.add(raywright_core::fault::FaultKind::$code, format!($($message)*))
    };
}

/// File name extensions of model files, for messages.
pub(crate) const MODELS: &str = ".stl, .ply, .obj, .gltf and .glb";

/// Formats a count with its noun, such as `1 joint` or `2 joints`.
pub(crate) fn format_count(count: usize, noun: &str) -> String {
    let ending = if count == 1 { "" } else { "s" };
    format!("{count} {noun}{ending}")
}

/// A failure inside a file; [`Fault::into_error`] adds the file's name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Fault {
    pub kind: ErrorKind,
    pub message: String,
}

/// Result of an importer's step.
pub(crate) type ImportResult<T> = Result<T, Fault>;

/// A scene from a model file, with the warnings of its import.
pub(crate) type ImportedScene = (Scene, Vec<fault::Fault>);

impl Fault {
    /// Creates a fault for wrong content.
    pub fn invalid_input(message: impl Into<String>) -> Self {
        Self::with_kind(ErrorKind::Input, message)
    }

    /// Creates a fault for content beyond the limits.
    pub fn over_limit(message: impl Into<String>) -> Self {
        Self::with_kind(ErrorKind::Limit, message)
    }

    /// Creates a fault of a kind. [`ErrorKind::Usage`]: the user chose a scene, variant or animation
    /// that the file does not have.
    pub fn with_kind(kind: ErrorKind, message: impl Into<String>) -> Self {
        let message = message.into();
        Self { kind, message }
    }

    /// Prefixes the message with the position of the fault in the file.
    pub fn with_place(mut self, place: impl fmt::Display) -> Self {
        self.message = format!("{place}: {}", self.message);
        self
    }

    /// Converts the fault to an error about a file.
    pub fn into_error(self, file: impl fmt::Display) -> Error {
        Error::with_kind(self.kind, format!("{file}: {}", self.message))
    }
}

/// Adds a position in the file to the fault of a result.
pub(crate) trait FaultPlace {
    /// Prefixes the message of a fault with its position in the file.
    fn with_place(self, place: impl fmt::Display) -> Self;
}

impl<T> FaultPlace for ImportResult<T> {
    fn with_place(self, place: impl fmt::Display) -> Self {
        self.map_err(|fault| fault.with_place(place))
    }
}

impl From<ReadError> for Fault {
    fn from(error: ReadError) -> Self {
        let kind = match error {
            ReadError::TooLarge(_) => ErrorKind::Limit,
            ReadError::Refused(_) | ReadError::Unreadable(_) => ErrorKind::Input,
        };
        Self::with_kind(kind, error.to_string())
    }
}

/// Returns a fault of kind input as `Ok(Err(reason))`. The caller can then leave out a broken
/// picture and continue the import.
///
/// # Errors
///
/// A fault of any other kind.
pub(crate) fn catch_invalid_input<T>(outcome: ImportResult<T>) -> ImportResult<Result<T, String>> {
    match outcome {
        Ok(value) => Ok(Ok(value)),
        Err(Fault {
            kind: ErrorKind::Input,
            message,
        }) => Ok(Err(message)),
        Err(fault) => Err(fault),
    }
}

/// Validates an imported scene, and returns the valid scene.
///
/// # Errors
/// A fault of kind input with the first problem.
pub(crate) fn validate_scene(scene: Scene) -> ImportResult<Scene> {
    match validate(&scene).first() {
        None => Ok(scene),
        Some(problem) => Err(fault!(
            "{} of the imported scene: {}",
            problem.path,
            problem.message
        )),
    }
}

/// Formats text of a file for messages: on one line and of bounded length.
pub(crate) fn sanitise_text(text: &str) -> String {
    const MOST: usize = 100;
    let clean = |c: char| if c.is_control() { '\u{fffd}' } else { c };
    let more = text.chars().nth(MOST).map(|_| '…');
    text.chars().take(MOST).map(clean).chain(more).collect()
}

/// Formats a number of a file for messages; very large and very small numbers have an exponent.
pub(crate) fn format_number(value: f64) -> String {
    if value == 0.0 || (1e-6..1e6).contains(&value.abs()) {
        value.to_string()
    } else {
        format!("{value:e}")
    }
}

/// List of different warnings, at most [`Self::MOST`]. Further warnings are counted, but not kept.
#[derive(Debug, Default)]
pub(crate) struct Warnings {
    list: Vec<ListedWarning>,
    left_out: usize,
    /// Hashes of all messages so far.
    known: HashSet<u64>,
}

/// A warning of the list, which may also stand for warnings about other places.
#[derive(Debug)]
struct ListedWarning {
    kind: fault::FaultKind,
    /// Place in the file, such as `materials[3]`; empty without one.
    place: String,
    text: String,
    /// Number of further places with the same text.
    more: usize,
}

impl Warnings {
    const MOST: usize = 100;
    /// Number of places that are listed of those with the same text; the others are counted.
    const MOST_PLACES: usize = 3;

    /// Adds a warning, unless there was one with the same message. If the list is full, or has
    /// enough warnings with this text, the warning is only counted.
    pub fn add(&mut self, kind: fault::FaultKind, message: impl Into<String>) {
        let message = message.into();
        let mut hasher = DefaultHasher::new();
        message.hash(&mut hasher);
        if !self.known.insert(hasher.finish()) {
            return;
        }
        let (place, text) = match message.split_once("]: ") {
            Some((place, text)) => (format!("{place}]"), text.to_owned()),
            None => (String::new(), message),
        };
        let is_equal = |i: &usize| !place.is_empty() && self.list[*i].text == text;
        let equal: Vec<usize> = (0..self.list.len()).filter(is_equal).collect();
        match equal.last() {
            Some(&last) if equal.len() == Self::MOST_PLACES => self.list[last].more += 1,
            _ if self.list.len() < Self::MOST => self.list.push(ListedWarning {
                kind,
                place,
                text,
                more: 0,
            }),
            _ => self.left_out += 1,
        }
    }

    /// Adds a warning that triangles with non-finite corners were left out. `place` is the start of
    /// the message, with a separator at its end.
    pub fn add_dropped(&mut self, place: &str, triangles: usize) {
        let left_out = match triangles {
            0 => return,
            1 => "1 triangle with vertices that are not finite was left out".to_owned(),
            more => format!("{more} triangles with vertices that are not finite were left out"),
        };
        self.add(fault::FaultKind::Geometry, format!("{place}{left_out}"));
    }

    /// Clamps a number of a file to a range, with a warning if the number is outside.
    pub fn clamp_with_warning(
        &mut self,
        value: f64,
        [minimum, maximum]: [f64; 2],
        place: &str,
        label: &str,
    ) -> f64 {
        if (minimum..=maximum).contains(&value) {
            return value;
        }
        let clamped = if value.is_nan() {
            minimum
        } else {
            value.clamp(minimum, maximum)
        };
        let [message, least, most, taken] = [value, minimum, maximum, clamped].map(format_number);
        self.add(
            fault::FaultKind::Range,
            format!("{place}: {label} {message} is outside {least} to {most}; {taken} is used"),
        );
        clamped
    }

    /// Returns the warnings about a file. Omitted warnings are counted in a final warning.
    pub fn into_warnings(mut self, file: impl fmt::Display) -> Vec<fault::Fault> {
        if self.left_out > 0 {
            let rest = format!(
                "{} more warnings about the file are not shown",
                self.left_out
            );
            self.list.push(ListedWarning {
                kind: fault::FaultKind::More,
                place: String::new(),
                text: rest,
                more: 0,
            });
        }
        let message = |listed: &ListedWarning| match (listed.place.as_str(), listed.more) {
            ("", _) => listed.text.clone(),
            (place, 0) => format!("{place}: {}", listed.text),
            (place, more) => format!("{place} and {more} others: {}", listed.text),
        };
        let list = self.list.iter();
        list.map(|listed| listed.kind.in_file(&file, message(listed)))
            .collect()
    }
}

/// Generates unique names: the requested name or, if that name is taken, the name followed by a
/// number.
#[derive(Debug, Default)]
pub(crate) struct UniqueNames {
    taken: HashSet<String>,
    counter: usize,
}

impl UniqueNames {
    /// Returns the requested name or, if that name is taken, the name followed by a number.
    pub fn make_unique(&mut self, wish: &str) -> String {
        let wish = if wish.is_empty() { "unnamed" } else { wish };
        let mut name = wish.to_owned();
        while !self.taken.insert(name.clone()) {
            // A single counter for all names: a million meshes of one name must not need a million
            // attempts each.
            self.counter += 1;
            name = format!("{wish} ({})", self.counter);
        }
        name
    }
}

/// Size in bytes from which an allocation is checked against the system's memory. A system without
/// room for a smaller allocation has no room for the program at all.
const CHECKED_BYTES: u64 = 1 << 20;

/// Checks that the memory limit leaves `bytes` bytes, and that the system can provide them. Called
/// before the allocation.
///
/// # Errors
///
/// A fault of kind limit if there is less memory.
pub(crate) fn check_available_memory(bytes: u64, limits: &Limits) -> ImportResult<()> {
    if bytes < CHECKED_BYTES {
        return Ok(());
    }
    let reason = if bytes > remaining_heap_bytes() {
        format!(
            "is left of the limit of {}; raise the limit with --max-memory",
            format_bytes(limits.memory_bytes)
        )
    } else if can_allocate(bytes) {
        return Ok(());
    } else {
        "the system has available; close other programs".to_owned()
    };
    Err(Fault::over_limit(format!(
        "needs {} of memory, more than {reason}, or use a smaller file",
        format_bytes(bytes)
    )))
}

/// Memory in bytes, triangles and objects that an import may still use.
#[derive(Debug)]
pub(crate) struct DecodeBudget {
    limits: Limits,
    bytes: u64,
    triangles: u64,
    objects: u64,
}

impl DecodeBudget {
    /// Creates the budget of a new import, equal to the limits.
    pub fn new(limits: &Limits) -> Self {
        Self {
            limits: *limits,
            bytes: limits.memory_bytes,
            triangles: limits.triangles,
            objects: limits.objects,
        }
    }

    /// Reserves the memory of `count` items of `bytes_each` bytes. Called before the allocation.
    ///
    /// # Errors
    ///
    /// A fault of kind limit when the budget is exceeded.
    pub fn reserve_memory(&mut self, count: usize, bytes_each: usize) -> ImportResult<()> {
        let bytes = (count as u64).saturating_mul(bytes_each as u64);
        let total = self.limits.memory_bytes;
        self.bytes = self.bytes.checked_sub(bytes).ok_or_else(|| {
            Fault::over_limit(format!(
                "needs more memory than the limit of {}: a further {} do not fit; raise the limit with --max-memory",
                format_bytes(total),
                format_bytes(bytes)
            ))
        })?;
        check_available_memory(bytes, &self.limits)
    }

    /// Reserves `count` triangles and the memory of their indices.
    ///
    /// # Errors
    /// A fault of kind limit when the budget is exceeded.
    pub fn reserve_triangles(&mut self, count: usize) -> ImportResult<()> {
        let total = self.limits.triangles;
        self.triangles = self.triangles.checked_sub(count as u64).ok_or_else(|| {
            Fault::over_limit(format!(
                "has more triangles than the limit of {total}; simplify its meshes"
            ))
        })?;
        self.reserve_memory(count, size_of::<[u32; 3]>())
    }

    /// Reserves one object.
    ///
    /// # Errors
    /// A fault of kind limit for too many objects.
    pub fn reserve_object(&mut self) -> ImportResult<()> {
        let total = self.limits.objects;
        self.objects = self.objects.checked_sub(1).ok_or_else(|| {
            Fault::over_limit(format!(
                "has more objects than the limit of {total}; merge or remove objects"
            ))
        })?;
        // 128 bytes are assumed for the names of the object.
        self.reserve_memory(1, size_of::<raywright_core::scene::Object>() + 128)
    }
}

// Progress of a long import, reported to an observer.

/// Planned and finished work of an import. The unit is a vertex or an index of a mesh. Any thread
/// may report.
pub(crate) struct ImportProgress<'a> {
    observer: &'a dyn Observer,
    total: u64,
    done: AtomicU64,
}

impl<'a> ImportProgress<'a> {
    /// Work of decoding an image, as the number of vertices that take about the same time.
    pub const IMAGE_COST: u64 = 1 << 20;

    /// Creates a progress report, with a planned work of zero.
    pub fn new(observer: &'a dyn Observer) -> Self {
        Self {
            observer,
            total: 0,
            done: AtomicU64::new(0),
        }
    }

    /// Sets the planned work, in vertices and indices.
    pub fn set_total(&mut self, total: u64) {
        self.total = total;
    }

    /// Adds finished work, in vertices and indices, and reports the progress to the observer.
    pub fn report_done(&self, amount: u64) {
        let before = self.done.fetch_add(amount, Ordering::Relaxed);
        // The finished work may exceed the planned work, which counts a mesh with several
        // deformations once.
        self.observer
            .progress(before.saturating_add(amount).min(self.total), self.total);
    }
}

#[cfg(test)]
mod tests;
