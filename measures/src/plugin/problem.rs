//! Why plugins are refused.

use std::path::{Path, PathBuf};

use super::PATH_VARIABLE;
use super::interface::{LONGAN_INTERFACE, LONGAN_MEASURES_MAX};

/// The refusal of a plugin: one sentence, which names its file.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{}: {problem}", .path.display().to_string().replace(char::is_control, "\u{fffd}"))]
pub struct PluginError {
    path: PathBuf,
    problem: Problem,
}

/// The kinds of reasons for which plugins are refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PluginErrorKind {
    /// There is no such file or folder, or it cannot be read.
    Unreadable,
    /// The file is not a library for this machine, or no plugin.
    NotPlugin,
    /// The plugin was built with another version of the interface.
    Outdated,
    /// The plugin itself gives up.
    Refused,
    /// The plugin's description of itself is wrong.
    Invalid,
}

impl PluginError {
    pub(super) fn new(path: &Path, problem: Problem) -> Self {
        PluginError { path: path.to_owned(), problem }
    }

    /// The plugin's file, or the folder to find plugins in.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The kind of the reason.
    pub fn kind(&self) -> PluginErrorKind {
        match self.problem {
            Problem::Missing | Problem::NotFile | Problem::Folder { .. } => PluginErrorKind::Unreadable,
            Problem::NotLibrary { .. } | Problem::NoSymbol { .. } => PluginErrorKind::NotPlugin,
            Problem::Interface { .. } | Problem::Size { .. } => PluginErrorKind::Outdated,
            Problem::Refused { .. } => PluginErrorKind::Refused,
            Problem::Count { .. }
            | Problem::Pointer { .. }
            | Problem::Text { .. }
            | Problem::Repeated { .. }
            | Problem::Impossible { .. } => PluginErrorKind::Invalid,
        }
    }
}

/// The reasons, with their sentences.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum Problem {
    /// No file.
    #[error("there is no such file; name a plugin's library")]
    Missing,
    /// A folder or a device.
    #[error("this is not a file; name a plugin's library")]
    NotFile,
    /// A folder that cannot be read.
    #[error("this folder of {PATH_VARIABLE} cannot be read ({reason}); remove it from there")]
    Folder {
        /// The system's reason.
        reason: String,
    },
    /// Not for this system's loader.
    #[error("this is not a library that can be loaded here ({reason}); build it as one for this machine")]
    NotLibrary {
        /// The loader's reason.
        reason: String,
    },
    /// A library of another kind.
    #[error("this library is no plugin of longan, since it lacks the function '{symbol}'; name another")]
    NoSymbol {
        /// The function.
        symbol: &'static str,
    },
    /// Another version of the interface.
    #[error(
        "the plugin has version {found} of the plugin interface, and longan has version {LONGAN_INTERFACE}; build it anew with the header or crate of this longan"
    )]
    Interface {
        /// The plugin's version.
        found: u32,
    },
    /// The plugin itself gives up.
    #[error("the plugin cannot start: {reason}")]
    Refused {
        /// The plugin's reason.
        reason: String,
    },
    /// Other sizes than the header's.
    #[error(
        "the plugin says that {what} has {found} bytes, and here it has {expected}; build it anew with the header or crate of this longan"
    )]
    Size {
        /// The structure.
        what: &'static str,
        /// The plugin's size.
        found: u32,
        /// The size here.
        expected: usize,
    },
    /// No or too many measures.
    #[error("the plugin says that it has {found} measures, which is not between 1 and {LONGAN_MEASURES_MAX}")]
    Count {
        /// The plugin's number.
        found: u32,
    },
    /// A pointer that is null or misaligned.
    #[error("the plugin's pointer to {what} is {}", if *null { "null" } else { "not aligned" })]
    Pointer {
        /// The thing that it should point to.
        what: String,
        /// Whether it is null.
        null: bool,
    },
    /// A text of a wrong form.
    #[error("{what} that the plugin gives {fault}")]
    Text {
        /// The text's name.
        what: String,
        /// The fault, as a predicate.
        fault: String,
    },
    /// Two measures of one name.
    #[error("the plugin has two measures '{name}'")]
    Repeated {
        /// The name.
        name: String,
    },
    /// Impossible ranks, or values that the interface does not have.
    #[error("the plugin's measure '{measure}' {fault}")]
    Impossible {
        /// The measure.
        measure: String,
        /// The fault, as a predicate.
        fault: String,
    },
}
