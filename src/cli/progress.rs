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
        self.0.set_position((share * STEPS) as u64);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
