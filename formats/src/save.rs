//! The one place that puts a finished file where it belongs.
//!
//! A file is written in a temporary folder beside its destination and renamed when complete, so that whoever looks
//! sees the old file, or none, or the whole new one. What is written is left to others.

use std::ffi::OsStr;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::{TempDir, TempPath};

use crate::Error;

/// Writes a file, all or nothing.
///
/// `write` gets the path of a file to create, which has the final file's name but lies in a temporary folder.
///
/// # Errors
/// [`Error::File`] around those of [`check_writable`], those of `write`, and the operating system's.
pub fn save(path: &Path, overwrite: bool, write: impl FnOnce(&Path) -> Result<(), Error>) -> Result<(), Error> {
    place(path, overwrite, write).map_err(|e| e.of(path))
}

/// Whether [`save()`] would be able to write this file, to be asked before a long computation.
///
/// # Errors
/// [`Error::File`], which names the file, where its folder does not exist or cannot be written to, where it is a
/// folder or a device, and where it exists but may not be overwritten.
pub fn check_writable(path: &Path, overwrite: bool) -> Result<(), Error> {
    destination(path, overwrite).and_then(|to| temporary_folder(&to)).map(drop).map_err(|e| e.of(path))
}

fn place(path: &Path, overwrite: bool, write: impl FnOnce(&Path) -> Result<(), Error>) -> Result<(), Error> {
    let to = destination(path, overwrite)?;
    let folder = temporary_folder(&to)?;
    let file = folder.path().join(to.file_name().unwrap_or(OsStr::new("file")));
    write(&file).map_err(|e| match e {
        // The temporary file is none of the user's concern.
        Error::File { path, problem } if path == file => *problem,
        e => e,
    })?;
    let file = TempPath::try_from_path(file).map_err(Error::io("write it"))?;
    let placed = if overwrite { file.persist(&to) } else { file.persist_noclobber(&to) };
    placed.map_err(|e| match e.error.kind() {
        io::ErrorKind::AlreadyExists => Error::Exists,
        _ => Error::io("put it in its place")(e.error),
    })
}

/// Where the file really goes, once it is clear that it may.
fn destination(path: &Path, overwrite: bool) -> Result<PathBuf, Error> {
    let to = match fs::metadata(path) {
        Ok(old) if old.is_dir() => return Err(Error::Folder),
        Ok(old) if !old.is_file() => return Err(Error::NotRegular),
        Ok(_) if !overwrite => return Err(Error::Exists),
        // Behind a symbolic link, the file is replaced and not the link.
        Ok(_) => fs::canonicalize(path).map_err(Error::io("follow its link"))?,
        Err(e) if e.kind() == io::ErrorKind::NotFound => path.to_owned(),
        Err(cause) => return Err(Error::Io { action: "write it", cause }),
    };
    if to.file_name().is_none() || path.as_os_str().as_encoded_bytes().ends_with(b"/") {
        return Err(Error::Folder);
    }
    let folder = folder_of(&to);
    if !folder.is_dir() {
        return Err(Error::NoFolder { folder: folder.to_owned() });
    }
    Ok(to)
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// A folder for unfinished files, which goes with all that is in it.
struct Temporary(TempDir);

/// The folders that exist.
static TEMPORARY: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

impl Temporary {
    fn path(&self) -> &Path {
        self.0.path()
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        folders().retain(|folder| folder != self.0.path());
    }
}

fn folders() -> MutexGuard<'static, Vec<PathBuf>> {
    TEMPORARY.lock().unwrap_or_else(PoisonError::into_inner)
}

fn temporary_folder(to: &Path) -> Result<Temporary, Error> {
    let mut folders = folders();
    let made = tempfile::Builder::new().prefix(".longan-").tempdir_in(folder_of(to));
    // Without the temporary folder's own name, which tells a user nothing.
    let made = made.map_err(|cause| Error::Io { action: "write to its folder", cause: cause.kind().into() })?;
    folders.push(made.path().to_owned());
    Ok(Temporary(made))
}

/// Removes all unfinished files. For a program that is about to end early: no file can be saved from then on.
pub fn abandon() {
    let folders = folders();
    for folder in folders.iter() {
        // Nobody is left to be told.
        let _ = fs::remove_dir_all(folder);
    }
    // Kept locked, so that no other folder is made.
    std::mem::forget(folders);
}
