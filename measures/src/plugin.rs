//! Measures from libraries that are loaded when the program runs.
//!
//! A plugin is a library with the two functions of [`interface`]; `include/longan_plugin.h` is the same for C, and the
//! crate `longan-plugin` for Rust. A plugin's description of itself is checked before any of it is used (`description`).
//! But a plugin is code that runs with the user's rights: no check keeps it from doing what it likes.

mod description;
pub mod interface;
mod measure;
mod problem;

use std::ffi::{CStr, OsStr};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use libloading::Library;

use crate::PluginOrigin;
use description::Described;
use interface::{LONGAN_INTERFACE, LonganDescribe, LonganHandshake};
use measure::Message;
pub use measure::PluginMeasure;
use problem::Problem;
pub use problem::{PluginError, PluginErrorKind};

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

impl Plugin {
    /// Loads a plugin. This runs code of the library.
    ///
    /// # Errors
    /// The reason why the plugin is refused, with its path.
    pub fn load(path: &Path) -> Result<Self, PluginError> {
        let error = |problem| PluginError::new(path, problem);
        // A name without a folder would be looked for among the system's libraries.
        let absolute = path.canonicalize().map_err(|_| error(Problem::Missing))?;
        if !absolute.is_file() {
            return Err(error(Problem::NotFile));
        }
        let library = open(&absolute).map_err(error)?;
        let (name, version, described) = describe(&library).map_err(error)?;
        let library = Arc::new(library);
        let origin = PluginOrigin { name: name.clone(), version: version.clone(), path: path.to_owned() };
        let measures = described.into_iter().map(|described| PluginMeasure {
            name: described.name.clone(),
            described: Arc::new(described),
            origin: origin.clone(),
            _library: library.clone(),
        });
        Ok(Plugin { name, version, path: path.to_owned(), measures: measures.collect() })
    }

    /// The name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The plugin's own version.
    pub fn version(&self) -> &str {
        &self.version
    }

    /// The file that the plugin was loaded from.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The measures.
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
        let error = |e: std::io::Error| PluginError::new(&folder, Problem::Folder { reason: e.to_string() });
        let entries = std::fs::read_dir(&folder).map_err(error)?;
        let paths = entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>, _>>().map_err(error)?;
        let is_library = |path: &PathBuf| path.extension().is_some_and(|e| e == std::env::consts::DLL_EXTENSION);
        let mut paths: Vec<_> = paths.into_iter().filter(is_library).collect();
        paths.sort();
        libraries.extend(paths);
    }
    Ok(libraries)
}

/// Loads a library, with all libraries that it refers to.
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

/// The description that a library gives of itself: name, version and measures.
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
