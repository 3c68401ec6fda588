//! Progress of long work, on a terminal only.

use std::cell::Cell;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle, WeakProgressBar};

/// Steps that the bar distinguishes in each part.
const STEPS: f64 = 1000.0;

/// The bar that was begun last, so that whoever prints a line can clear it meanwhile.
static LAST: Mutex<Option<WeakProgressBar>> = Mutex::new(None);

/// A bar on standard error, hidden where that is no terminal or where `quiet`.
pub(crate) struct Progress {
    bar: ProgressBar,
    /// Number of parts, where they are counted.
    parts: Option<usize>,
    done: AtomicUsize,
    start: Instant,
}

/// A part of work that others are done beside.
pub(crate) struct Part<'a> {
    of: &'a Progress,
    position: Cell<u64>,
}

impl Progress {
    /// Starts a bar with a label.
    pub(crate) fn new(label: String, quiet: bool) -> Self {
        let progress = Progress::with_length(1, None, quiet);
        progress.bar.set_message(label);
        progress
    }

    /// Starts a bar of several parts, which it counts.
    pub(crate) fn of_parts(parts: usize, quiet: bool) -> Self {
        Progress::with_length(parts, Some(parts), quiet)
    }

    fn with_length(length: usize, parts: Option<usize>, quiet: bool) -> Self {
        let bar = if quiet { ProgressBar::hidden() } else { ProgressBar::new(length as u64 * STEPS as u64) };
        let style = ProgressStyle::with_template("[{bar:30}] {percent:>3}% {eta:>3} left  {wide_msg}");
        let bar = bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        *LAST.lock().unwrap_or_else(PoisonError::into_inner) = Some(bar.downgrade());
        Progress { bar, parts, done: AtomicUsize::new(0), start: Instant::now() }
    }

    /// Shows the share done, from 0 to 1.
    pub(crate) fn set(&self, share: f64) {
        give_back();
        self.bar.set_position((share * STEPS) as u64);
    }

    /// Begins a part, which is done when it is dropped.
    pub(crate) fn part(&self) -> Part<'_> {
        Part { of: self, position: Cell::new(0) }
    }

    /// Does something else on the terminal, such as printing a line.
    pub(crate) fn aside<R>(&self, what: impl FnOnce() -> R) -> R {
        self.bar.suspend(what)
    }
}

/// Does something else on the terminal, whatever bar is on it; not within [`Progress::aside`].
pub(crate) fn beside<R>(what: impl FnOnce() -> R) -> R {
    let last = LAST.lock().unwrap_or_else(PoisonError::into_inner).as_ref().and_then(WeakProgressBar::upgrade);
    match last {
        Some(bar) => bar.suspend(what),
        None => what(),
    }
}

impl Part<'_> {
    /// Shows the share done, from 0 to 1.
    pub(crate) fn set(&self, share: f64) {
        give_back();
        let position = (share * STEPS) as u64;
        self.of.bar.inc(position.saturating_sub(self.position.replace(position)));
    }
}

impl Drop for Part<'_> {
    fn drop(&mut self) {
        self.of.bar.inc((STEPS as u64).saturating_sub(self.position.get()));
        let done = 1 + self.of.done.fetch_add(1, Ordering::Relaxed);
        if let Some(parts) = self.of.parts {
            self.of.bar.set_message(format!("{done} of {parts}, {}", rate(done, self.of.start.elapsed())));
        }
    }
}

/// How many are done in a time, in words.
pub(crate) fn rate(done: usize, time: Duration) -> String {
    let per_second = done as f64 / time.as_secs_f64().max(f64::EPSILON);
    let (rate, unit) = match per_second {
        1.0.. => (per_second, "second"),
        rate if 60.0 * rate >= 1.0 => (60.0 * rate, "minute"),
        rate => (3600.0 * rate, "hour"),
    };
    format!("{rate:.1} a {unit}")
}

/// Returns to the system what finished windows took. GNU's allocator would keep it until the end, when the whole output
/// needs the room.
pub(crate) fn give_back() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: the function only releases pages that nothing is allocated in; it may be called at any time.
    unsafe {
        libc::malloc_trim(0);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
