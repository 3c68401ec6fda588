//! The error of this crate: its kind, the file it is about, one sentence, and the choice that mends it.
//!
//! A sentence stands beside the code that meets the problem, in a small private enum that implements [`Reason`]. Here
//! are only the problems that several files of the crate meet. No sentence names an option of a program: a program says
//! in its own words how the choice named by [`Error::ask`] is made.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use crate::text::on_one_line;

/// A problem with a file of maps, or with what was asked of it.
///
/// The text is one sentence with the value met, its place and mostly a remedy, after the path of the file where that is
/// known. HDUs are counted from 0, the primary one. There is no `source`, since the sentence says it all.
#[derive(Debug)]
pub struct Error {
    kind: ErrorKind,
    path: Option<PathBuf>,
    problem: Box<dyn std::error::Error + Send + Sync>,
    ask: Option<Ask>,
    found: Option<String>,
}

/// The kind of a problem, for callers that act on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ErrorKind {
    /// There is no such file or folder.
    NotFound,
    /// The path names a folder, a pipe or a device where a file is needed.
    NotAFile,
    /// The file exists and must not be replaced.
    Exists,
    /// The operating system refused.
    Io,
    /// The file is of no format that is read.
    Unrecognised,
    /// A library refuses to read the file.
    Unreadable,
    /// A library refuses to write the file.
    Unwritable,
    /// The file ends before its data.
    Truncated,
    /// Bytes, a header or metadata are damaged.
    Corrupt,
    /// An entry of the file has an impossible value, or contradicts another entry.
    Invalid,
    /// The file does not say something that is needed.
    Incomplete,
    /// The file holds no map.
    NoMap,
    /// The field has no values.
    NoValues,
    /// The field holds something other than numbers.
    NotNumbers,
    /// The file is sound, but of a sort that is not read.
    Unsupported,
    /// Several things could be meant, so that a choice is needed.
    Ambiguous,
    /// The file does not have what was asked for by name or number.
    Unknown,
    /// A number asked for is outside of its range.
    OutOfRange,
    /// The file cannot be read in the way asked for: it has no HDUs, no dimensions, or one resolution only.
    NotApplicable,
    /// There is not enough memory.
    NoMemory,
    /// The caller's input contradicts itself or the format: a column of another length than the grid, a keyword that
    /// FITS does not have, two places along one dimension.
    InvalidInput,
    /// The grid, the points or the surface of the file cannot become a map; [`Error::problem`] is a
    /// [`longan_grid::Error`].
    Grid,
}

/// The choice of the caller that mends a problem.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Ask {
    /// The field to read ([`Selection::field`](crate::Selection::field)).
    Variable,
    /// The HDU to read ([`Selection::hdu`](crate::Selection::hdu)).
    Hdu,
    /// A place along a dimension ([`Selection::at`](crate::Selection::at)).
    Place {
        /// The dimension, where one is at fault.
        dimension: Option<String>,
        /// A place along it that mends the problem, where one is known, such as `#0`.
        place: Option<String>,
    },
    /// The Nside to bring the field to ([`Selection::nside`](crate::Selection::nside)).
    Nside,
    /// The centre from which points or a surface are seen.
    Centre,
    /// Both an Nside and the reach of points.
    Reach,
    /// The centre of a surface, or that its outermost layer counts where it is folded.
    Folds,
    /// Whether an existing file is replaced.
    Overwrite,
}

/// The use that is made of a file when a library refuses.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Use {
    /// With the advice by which a file is checked.
    Reading(&'static str),
    Writing,
}

impl Use {
    /// The end of the sentence.
    pub(crate) fn remedy(self) -> &'static str {
        match self {
            Use::Reading(check) => check,
            Use::Writing => "check the space and the permissions there",
        }
    }

    /// The kind of a refusal.
    pub(crate) fn kind(self) -> ErrorKind {
        match self {
            Use::Reading(_) => ErrorKind::Unreadable,
            Use::Writing => ErrorKind::Unwritable,
        }
    }
}

/// A problem in one sentence, as a part of this crate knows it.
pub(crate) trait Reason: std::error::Error + Send + Sync + 'static {
    /// The kind of the problem.
    fn kind(&self) -> ErrorKind;

    /// The choice that mends it, if there is one.
    fn ask(&self) -> Option<Ask> {
        None
    }

    /// The reason why a field is no map, in words that follow "is"; nothing where the field is not at fault.
    fn found(&self) -> Option<String> {
        None
    }
}

impl<R: Reason> From<R> for Error {
    fn from(reason: R) -> Self {
        let (kind, ask, found) = (reason.kind(), reason.ask(), reason.found());
        Error { kind, path: None, problem: Box::new(reason), ask, found }
    }
}

impl From<longan_grid::Error> for Error {
    fn from(error: longan_grid::Error) -> Self {
        use longan_grid::Error as Grid;
        let (kind, ask) = match error {
            Grid::Memory { .. } => (ErrorKind::NoMemory, None),
            Grid::Nside { .. } => (ErrorKind::OutOfRange, Some(Ask::Nside)),
            Grid::Setting { .. } => (ErrorKind::OutOfRange, None),
            Grid::NotNested { .. } | Grid::GridSize { .. } => (ErrorKind::Unsupported, None),
            Grid::NoPoints => (ErrorKind::NoValues, None),
            Grid::OnePlace => (ErrorKind::Incomplete, Some(Ask::Reach)),
            Grid::AtCentre { .. } => (ErrorKind::Grid, Some(Ask::Centre)),
            Grid::Crossings { .. } => (ErrorKind::Grid, Some(Ask::Folds)),
            _ => (ErrorKind::Grid, None),
        };
        Error { kind, path: None, problem: Box::new(error), ask, found: None }
    }
}

impl Error {
    /// The kind of the problem.
    pub fn kind(&self) -> ErrorKind {
        self.kind
    }

    /// The file with the problem, as it was named; nothing where no file is involved or its name is not known yet.
    pub fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    /// The choice of the caller that mends the problem, if there is one.
    pub fn ask(&self) -> Option<&Ask> {
        self.ask.as_ref()
    }

    /// The sentence without the path. A problem of the grid can be downcast to [`longan_grid::Error`].
    pub fn problem(&self) -> &(dyn std::error::Error + Send + Sync + 'static) {
        &*self.problem
    }

    /// The reason why the field that was read is no map, in words that follow "is", such as `text`; nothing where the
    /// field is not at fault.
    pub fn found(&self) -> Option<&str> {
        self.found.as_deref()
    }

    /// The same error with the name of its file, unless that is known.
    #[must_use]
    pub fn with_path(mut self, path: &Path) -> Self {
        self.path.get_or_insert_with(|| path.to_owned());
        self
    }

    /// Names the file `to` where `from` is named, or no file.
    pub(crate) fn rename(&mut self, from: &Path, to: &Path) {
        if self.path.as_deref().is_none_or(|path| path == from) {
            self.path = Some(to.to_owned());
        }
    }

    /// For `map_err`: the operating system's refusal of an action, such as "open it".
    pub fn io(action: &'static str) -> impl Fn(io::Error) -> Self {
        move |cause| match cause.kind() {
            io::ErrorKind::NotFound => Problem::Missing.into(),
            _ => Problem::Io { action, cause }.into(),
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.path {
            Some(path) => write!(f, "{}: {}", on_one_line(path.display()), self.problem),
            None => self.problem.fmt(f),
        }
    }
}

impl std::error::Error for Error {}

/// Problems that several files of this crate meet.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Problem {
    #[error("cannot {action}: {cause}")]
    Io { action: &'static str, cause: io::Error },
    #[error("there is no such file; check the name and the folder")]
    Missing,
    #[error("this is a folder, but neither a file nor a Zarr store; name a file in it")]
    Folder,
    #[error("this is not a regular file but a pipe or a device; save the data to a file first")]
    NotRegular,
    #[error("cannot {action}: the file ends before it; fetch it again")]
    CutShort { action: String },
    #[error("column '{column}' has {found} values but Nside {nside} has {expected} pixels")]
    ColumnLength { column: String, found: usize, nside: usize, expected: usize },
}

impl Reason for Problem {
    fn kind(&self) -> ErrorKind {
        match self {
            Problem::Io { .. } => ErrorKind::Io,
            Problem::Missing => ErrorKind::NotFound,
            Problem::Folder | Problem::NotRegular => ErrorKind::NotAFile,
            Problem::CutShort { .. } => ErrorKind::Truncated,
            Problem::ColumnLength { .. } => ErrorKind::InvalidInput,
        }
    }
}
