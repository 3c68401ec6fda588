//! Progress of long work, on a terminal only.

use indicatif::{ProgressBar, ProgressStyle};

/// Steps that the bar distinguishes.
const STEPS: f64 = 1000.0;

/// A bar on standard error, hidden where that is no terminal or where `quiet`.
pub(crate) struct Progress(ProgressBar);

impl Progress {
    /// Starts a bar with a label.
    pub(crate) fn new(label: String, quiet: bool) -> Self {
        let bar = if quiet { ProgressBar::hidden() } else { ProgressBar::new(STEPS as u64) };
        let style = ProgressStyle::with_template("[{bar:30}] {percent:>3}% {eta:>3} left  {wide_msg}");
        Progress(bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar())).with_message(label))
    }

    /// Shows the share done, from 0 to 1.
    pub(crate) fn set(&self, share: f64) {
        give_back();
        self.0.set_position((share * STEPS) as u64);
    }
}

/// Returns to the system what finished windows took. GNU's allocator would keep it until the end, when the whole output
/// needs the room.
fn give_back() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: the function only releases pages that nothing is allocated in; it may be called at any time.
    unsafe {
        libc::malloc_trim(0);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
