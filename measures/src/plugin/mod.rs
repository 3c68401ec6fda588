//! Measures from libraries that are loaded when the program runs.
//!
//! A plugin is a library with the two functions of [`interface`]; `include/longan_plugin.h` is the same for C, and the
//! crate `longan-plugin` for Rust. What a plugin says of itself is checked before any of it is used (`description`).
//! But a plugin is code that runs with the user's rights: no check keeps it from doing what it likes.

mod description;
pub mod interface;

use std::ffi::{CStr, OsStr, c_char};
use std::fmt::{self, Debug};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use libloading::Library;
use num_complex::Complex64;

use crate::{Measure, MeasureError, Needs, Origin, Window};
use description::Described;
use interface::{
    LONGAN_INTERFACE, LONGAN_MEASURES_MAX, LONGAN_TEXT_SIZE, LonganComplex, LonganDescribe, LonganHandshake,
    LonganWindow, LonganWindows,
};

/// The environment variable with the folders that plugins are loaded from.
pub const PATH_VARIABLE: &str = "LONGAN_PLUGIN_PATH";

/// The version that plugins are told, with its final zero.
const HOST_VERSION: &CStr = match CStr::from_bytes_with_nul(concat!(env!("CARGO_PKG_VERSION"), "\0").as_bytes()) {
    Ok(version) => version,
    Err(_) => panic!("the version has a zero within"),
};

/// Names of the functions that a plugin exports.
const HANDSHAKE: &str = "longan_plugin_handshake";
const DESCRIBE: &str = "longan_plugin";

/// Why a plugin is refused.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{}: {problem}", .path.display().to_string().replace(char::is_control, "\u{fffd}"))]
pub struct PluginError {
    /// Its file, or the folder to find it in.
    pub path: PathBuf,
    /// What is wrong with it.
    pub problem: Problem,
}

/// What is wrong with a plugin.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Problem {
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
    /// A pointer to nothing, or to where its thing cannot lie.
    #[error("the plugin's pointer to {what} is {}", if *null { "null" } else { "not aligned" })]
    Pointer {
        /// What it should point to.
        what: String,
        /// Whether it is null.
        null: bool,
    },
    /// A text that is none.
    #[error("{what} that the plugin gives {fault}")]
    Text {
        /// Which text.
        what: String,
        /// What is wrong with it.
        fault: String,
    },
    /// Two measures of one name.
    #[error("the plugin has two measures '{name}'")]
    Repeated {
        /// The name.
        name: String,
    },
    /// Impossible ranks, or unknown flags.
    #[error("the plugin's measure '{measure}' {fault}")]
    Impossible {
        /// The measure.
        measure: String,
        /// What is impossible.
        fault: String,
    },
}

/// A loaded plugin.
///
/// The library stays loaded as long as the plugin or one of its measures is there.
#[derive(Clone, Debug)]
pub struct Plugin {
    name: String,
    version: String,
    path: PathBuf,
    measures: Vec<PluginMeasure>,
}

/// A measure of a plugin.
#[derive(Clone)]
pub struct PluginMeasure {
    name: String,
    described: Arc<Described>,
    origin: String,
    // Last, since fields are dropped in their order: nothing of a library may be there without it.
    _library: Arc<Library>,
}

impl Plugin {
    /// Loads a plugin. This runs code of the library.
    ///
    /// # Errors
    /// What is wrong with it, with its path.
    pub fn load(path: &Path) -> Result<Self, PluginError> {
        let error = |problem| PluginError { path: path.to_owned(), problem };
        // A name without a folder would be looked for among the system's libraries.
        let absolute = path.canonicalize().map_err(|_| error(Problem::Missing))?;
        if !absolute.is_file() {
            return Err(error(Problem::NotFile));
        }
        let library = open(&absolute).map_err(error)?;
        let (name, version, described) = describe(&library).map_err(error)?;
        let library = Arc::new(library);
        let origin = format!("{name} {version} ({})", path.display());
        let measures = described.into_iter().map(|described| PluginMeasure {
            name: described.name.clone(),
            described: Arc::new(described),
            origin: origin.clone(),
            _library: library.clone(),
        });
        Ok(Plugin { name, version, path: path.to_owned(), measures: measures.collect() })
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its own version.
    pub fn version(&self) -> &str {
        &self.version
    }

    /// The file that it was loaded from.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Its measures.
    pub fn measures(&self) -> &[PluginMeasure] {
        &self.measures
    }
}

/// Whether this can be the name of a plugin, or of a measure in one.
pub fn is_name(name: &str) -> bool {
    description::is_name(name)
}

/// The file name that a library of this name has on this system.
pub fn library_of(name: &str) -> String {
    use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
    format!("{DLL_PREFIX}{name}{DLL_SUFFIX}")
}

/// The libraries in the folders of a list such as that of [`PATH_VARIABLE`], in the order of their names in each.
///
/// Empty parts of the list mean nothing, in particular not the working folder.
///
/// # Errors
/// A folder that cannot be read.
pub fn in_folders(list: &OsStr) -> Result<Vec<PathBuf>, PluginError> {
    let mut libraries = Vec::new();
    for folder in std::env::split_paths(list).filter(|folder| !folder.as_os_str().is_empty()) {
        let error = |e: std::io::Error| PluginError {
            path: folder.clone(),
            problem: Problem::Folder { reason: e.to_string() },
        };
        let entries = std::fs::read_dir(&folder).map_err(error)?;
        let paths = entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>, _>>().map_err(error)?;
        let is_library = |path: &PathBuf| path.extension().is_some_and(|e| e == std::env::consts::DLL_EXTENSION);
        let mut paths: Vec<_> = paths.into_iter().filter(is_library).collect();
        paths.sort();
        libraries.extend(paths);
    }
    Ok(libraries)
}

/// Loads a library, with all that it refers to.
fn open(path: &Path) -> Result<Library, Problem> {
    #[cfg(unix)]
    let library = {
        use libloading::os::unix;
        // SAFETY: code of the library runs, as the user wants; that it is sound is the plugin's duty. What it refers
        // to is looked up now, so that nothing is found missing in the middle of a run.
        unsafe { unix::Library::open(Some(path), unix::RTLD_NOW | unix::RTLD_LOCAL) }.map(Library::from)
    };
    #[cfg(not(unix))]
    // SAFETY: as above.
    let library = unsafe { Library::new(path) };
    library.map_err(|e| {
        let reason = e.to_string();
        let reason = reason.strip_prefix(&format!("{}: ", path.display())).unwrap_or(&reason);
        Problem::NotLibrary { reason: reason.lines().collect::<Vec<_>>().join(" ") }
    })
}

/// What a library says of itself: its name, its version and its measures.
fn describe(library: &Library) -> Result<(String, String, Vec<Described>), Problem> {
    // SAFETY: the interface gives the function of this name this type, in every version.
    let handshake = unsafe { library.get::<LonganHandshake>(HANDSHAKE) };
    let handshake = handshake.map_err(|_| Problem::NoSymbol { symbol: HANDSHAKE })?;
    // SAFETY: the text ends with a zero and lives as long as the program.
    let found = unsafe { handshake(LONGAN_INTERFACE, HOST_VERSION.as_ptr()) };
    if found != LONGAN_INTERFACE {
        return Err(Problem::Interface { found });
    }
    // SAFETY: the interface gives the function of this name this type, in this version.
    let describe = unsafe { library.get::<LonganDescribe>(DESCRIBE) };
    let describe = describe.map_err(|_| Problem::NoSymbol { symbol: DESCRIBE })?;
    let mut message = Message::default();
    // SAFETY: the message has the room that the interface promises.
    let plugin = unsafe { describe(message.as_mut_ptr()) };
    if plugin.is_null() {
        return Err(Problem::Refused { reason: message.text() });
    }
    // SAFETY: the interface says that what is returned is a description that stays as long as the library.
    unsafe { description::read(plugin) }
}

/// Room for a plugin's message about a failure.
struct Message([u8; LONGAN_TEXT_SIZE]);

impl Default for Message {
    fn default() -> Self {
        Message([0; LONGAN_TEXT_SIZE])
    }
}

impl Message {
    fn as_mut_ptr(&mut self) -> *mut c_char {
        self.0.as_mut_ptr().cast()
    }

    /// What was written, on one line.
    fn text(&self) -> String {
        let end = self.0.iter().position(|&byte| byte == 0).unwrap_or(self.0.len());
        match std::str::from_utf8(&self.0[..end]) {
            Ok(text) if text.trim().is_empty() => "it does not say why".to_owned(),
            Ok(text) => text.trim().trim_end_matches('.').replace(char::is_control, " "),
            Err(_) => "its message is not UTF-8".to_owned(),
        }
    }
}

impl PluginMeasure {
    /// The same measure by another name.
    pub(crate) fn renamed(self, name: String) -> Self {
        PluginMeasure { name, ..self }
    }

    fn error(&self, reason: String) -> MeasureError {
        MeasureError { measure: self.name.clone(), reason: format!("{reason}, says the plugin {}", self.origin) }
    }
}

impl Debug for PluginMeasure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("PluginMeasure").field("name", &self.name).field("origin", &self.origin).finish_non_exhaustive()
    }
}

impl Measure for PluginMeasure {
    fn name(&self) -> String {
        self.name.clone()
    }

    fn definition(&self) -> String {
        self.described.definition.clone()
    }

    fn unit(&self) -> &str {
        &self.described.unit
    }

    fn rank(&self) -> u32 {
        self.described.rank
    }

    fn needs(&self) -> Needs {
        self.described.needs.clone()
    }

    /// None where the plugin fails, too: [`evaluate_all`](Self::evaluate_all) says why.
    fn evaluate(&self, window: &Window<'_>) -> Option<f64> {
        let mut value = [f64::NAN];
        self.evaluate_all(&[*window], &mut value).ok()?;
        Some(value[0]).filter(|value| !value.is_nan())
    }

    fn evaluate_all(&self, windows: &[Window<'_>], values: &mut [f64]) -> Result<(), MeasureError> {
        let count = windows.len().min(values.len());
        if count == 0 {
            return Ok(());
        }
        let needs = &self.described.needs;
        let psi = self.described.psi_of(&windows[..count]);
        let given = |value: f64, needed: bool| if needed { value } else { 0.0 };
        let windows: Vec<LonganWindow> = windows[..count]
            .iter()
            .enumerate()
            .map(|(i, window)| LonganWindow {
                colatitude: window.centre.0,
                longitude: window.centre.1,
                masked_fraction: window.masked_fraction,
                area: given(window.area, needs.area),
                length: given(window.length, needs.length),
                curvature: given(window.curvature, needs.curvature),
                // Complex64 has the layout of two numbers, as LonganComplex has.
                psi: psi[i * needs.ranks.len()..].as_ptr().cast::<LonganComplex>(),
                resolution: window.resolution,
            })
            .collect();
        let windows = LonganWindows { count, windows: windows.as_ptr() };
        let values = &mut values[..count];
        values.fill(f64::NAN);
        let mut message = Message::default();
        let Described { evaluate, measure, .. } = &*self.described;
        // SAFETY: the library that has the function and the measure is loaded as long as `self._library` is there; the
        // windows, their moments, the values and the message have the sizes that the interface promises.
        let status = unsafe { evaluate(measure.0, &windows, values.as_mut_ptr(), message.as_mut_ptr()) };
        if status != 0 {
            return Err(self.error(message.text()));
        }
        values.iter_mut().filter(|value| value.is_infinite()).for_each(|value| *value = f64::NAN);
        Ok(())
    }

    fn origin(&self) -> Origin {
        Origin::Plugin(self.origin.clone())
    }
}

impl Described {
    /// The moments that are needed of all windows, one window after the other.
    fn psi_of(&self, windows: &[Window<'_>]) -> Vec<Complex64> {
        let ranks = &self.needs.ranks;
        // The windows of a run have the same ranks, so each is looked for once.
        let place = |rank: &u32| windows[0].ranks.binary_search(rank).ok();
        let places: Vec<Option<usize>> = ranks.iter().map(place).collect();
        let mut psi = Vec::with_capacity(windows.len() * ranks.len());
        for window in windows {
            let same = std::ptr::eq(window.ranks, windows[0].ranks);
            psi.extend(ranks.iter().zip(&places).map(|(&rank, &place)| match place {
                Some(place) if same => window.psi[place],
                _ => window.psi(rank),
            }));
        }
        psi
    }
}
