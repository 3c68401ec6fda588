//! The one place that puts a finished file where it belongs.
//!
//! A file is written in a temporary folder beside its destination and renamed when complete, so that whoever looks
//! sees the old file, or none, or the whole new one. The remains of a killed process are removed by the next that writes
//! the same file. The content of files is left to others.

use std::any::Any;
use std::ffi::OsStr;
use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tempfile::{TempDir, TempPath};

use crate::error::{self, Ask, Error, ErrorKind, Reason};
use crate::text::on_one_line;

/// A destination that cannot be written to.
#[derive(Debug, thiserror::Error)]
enum Problem {
    #[error("the file exists; choose another name, or overwrite it")]
    Exists,
    #[error("the folder {} does not exist; create it first", on_one_line(.folder.display()))]
    NoFolder { folder: PathBuf },
}

impl Reason for Problem {
    fn kind(&self) -> ErrorKind {
        match self {
            Problem::Exists => ErrorKind::Exists,
            Problem::NoFolder { .. } => ErrorKind::NotFound,
        }
    }

    fn ask(&self) -> Option<Ask> {
        matches!(self, Problem::Exists).then_some(Ask::Overwrite)
    }
}

/// Writes a file, all or nothing.
///
/// `write` gets the path of a file to create, which has the final file's name but lies in a temporary folder. The error
/// of `write` may be of any type that an [`Error`] becomes, such as that of an application.
///
/// # Errors
/// Those of [`check_writable`], those of `write`, and the operating system's. An [`Error`] names the file; an error of
/// another type passes as `write` gave it, so that [`Error::with_path`] is left to `write`.
pub fn save<E: From<Error> + 'static>(
    path: &Path,
    overwrite: bool,
    write: impl FnOnce(&Path) -> Result<(), E>,
) -> Result<(), E> {
    let named = |e: Error| E::from(e.with_path(path));
    let to = destination(path, overwrite).map_err(named)?;
    let folder = temporary_folder(&to).map_err(named)?;
    let file = folder.path().join(to.file_name().unwrap_or(OsStr::new("file")));
    write(&file).map_err(|e| of_final_file(e, &file, path))?;
    put(file, &to, overwrite).map_err(named)
}

/// An error of this crate that names the final file, since the temporary one is none of the user's concern. An error of
/// another type is not changed.
fn of_final_file<E: 'static>(mut error: E, temporary: &Path, path: &Path) -> E {
    if let Some(error) = (&mut error as &mut dyn Any).downcast_mut::<Error>() {
        error.rename(temporary, path);
    }
    error
}

/// Whether [`save()`] would be able to write this file, to be asked before a long computation.
///
/// # Errors
/// [`ErrorKind::NotFound`] where the folder does not exist, [`ErrorKind::Io`] where it cannot be written to,
/// [`ErrorKind::NotAFile`] where the path is that of a folder or a device, and [`ErrorKind::Exists`] where the file
/// exists but may not be overwritten. The error names the file.
pub fn check_writable(path: &Path, overwrite: bool) -> Result<(), Error> {
    destination(path, overwrite).and_then(|to| temporary_folder(&to)).map(drop).map_err(|e| e.with_path(path))
}

/// Puts a finished file in its place.
fn put(file: PathBuf, to: &Path, overwrite: bool) -> Result<(), Error> {
    let file = TempPath::try_from_path(file).map_err(Error::io("write it"))?;
    let placed = if overwrite { file.persist(to) } else { file.persist_noclobber(to) };
    placed.map_err(|e| match e.error.kind() {
        io::ErrorKind::AlreadyExists => Problem::Exists.into(),
        _ => Error::io("put it in its place")(e.error),
    })
}

/// The place where the file really goes, once it is clear that it may.
fn destination(path: &Path, overwrite: bool) -> Result<PathBuf, Error> {
    let to = match fs::metadata(path) {
        Ok(old) if old.is_dir() => return Err(error::Problem::Folder.into()),
        Ok(old) if !old.is_file() => return Err(error::Problem::NotRegular.into()),
        Ok(_) if !overwrite => return Err(Problem::Exists.into()),
        // Behind a symbolic link, the file is replaced and not the link.
        Ok(_) => fs::canonicalize(path).map_err(Error::io("follow its link"))?,
        Err(e) if e.kind() == io::ErrorKind::NotFound => path.to_owned(),
        Err(cause) => return Err(error::Problem::Io { action: "write it", cause }.into()),
    };
    if to.file_name().is_none() || path.as_os_str().as_encoded_bytes().ends_with(b"/") {
        return Err(error::Problem::Folder.into());
    }
    let folder = folder_of(&to);
    if !folder.is_dir() {
        return Err(Problem::NoFolder { folder: folder.to_owned() }.into());
    }
    Ok(to)
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// The beginning of names of folders for unfinished files; the name of the file follows.
const PREFIX: &str = ".longan-";

/// Bytes of a file's name that are kept in that of its folder, so that this is not too long; names that begin alike
/// may share one.
const NAME_MAX: usize = 200;

/// The file by whose lock processes know of each other.
const LOCK: &str = "lock";

/// A folder for an unfinished file alone, which goes with all that is in it.
///
/// The folder lies in another that all who write the same output share. Each of them holds the lock there, shared; the system
/// frees it when a process ends, however it ends. So whoever gets it alone knows that what else lies there is nobody's,
/// and removes it. Nothing but tidiness hangs on that: where locks do not work, what killed processes leave stays, and
/// two that write the same output have folders of their own anyway.
struct Temporary(Arc<Place>);

struct Place {
    own: TempDir,
    shared: PathBuf,
    /// The lock, where the file system has such.
    lock: Option<File>,
}

/// The folders that exist.
static TEMPORARY: Mutex<Vec<Arc<Place>>> = Mutex::new(Vec::new());

impl Temporary {
    fn path(&self) -> &Path {
        self.0.own.path()
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        // Locked until all is removed, for a program that is told to end meanwhile.
        let mut folders = folders();
        self.0.clear();
        folders.retain(|place| !Arc::ptr_eq(place, &self.0));
    }
}

impl Place {
    /// Makes a folder for what is to be written to a file.
    fn new(to: &Path) -> io::Result<Self> {
        let shared = shared_folder(to);
        loop {
            match fs::create_dir(&shared) {
                Err(e) if e.kind() != io::ErrorKind::AlreadyExists => return Err(e),
                _ => (),
            }
            let made = Claim::of(&shared).and_then(|claim| {
                let lock = match claim {
                    Claim::Locks(lock) if share(&lock, &shared)? => Some(lock),
                    Claim::NoLocks => None,
                    Claim::Locks(_) | Claim::Gone => return Ok(None),
                };
                Ok(Some(Place { own: tempfile::tempdir_in(&shared)?, shared: shared.clone(), lock }))
            });
            match made {
                Ok(Some(place)) => return Ok(place),
                // Another that was done has removed the folder in between.
                Ok(None) => (),
                Err(e) if e.kind() == io::ErrorKind::NotFound => (),
                Err(e) => return Err(e),
            }
        }
    }

    /// Removes the folder, and the shared one unless others use it.
    fn clear(&self) {
        // Nobody can do more about what stays.
        let _ = fs::remove_dir_all(self.own.path());
        match &self.lock {
            Some(lock) => {
                let _ = lock.unlock();
                if lock.try_lock().is_ok() {
                    remove_shared(&self.shared);
                }
            }
            None => drop(fs::remove_dir(&self.shared)),
        }
    }
}

/// The outcome of taking a shared folder's lock.
enum Claim {
    /// The lock, had alone or not at all.
    Locks(File),
    /// The file system has no locks.
    NoLocks,
    /// The folder was removed meanwhile.
    Gone,
}

impl Claim {
    /// Takes the lock of a shared folder and, if nobody else has it, removes what was left there.
    fn of(shared: &Path) -> io::Result<Self> {
        let path = shared.join(LOCK);
        let lock = File::options().create(true).truncate(false).write(true).open(&path)?;
        match lock.try_lock() {
            Ok(()) if !is_at(&lock, &path) => return Ok(Claim::Gone),
            Ok(()) => {
                for entry in fs::read_dir(shared)?.flatten().filter(|entry| entry.file_name() != LOCK) {
                    // What cannot be removed is in nobody's way.
                    let _ = fs::remove_dir_all(entry.path());
                }
            }
            Err(TryLockError::WouldBlock) => (),
            Err(TryLockError::Error(_)) => {
                let _ = fs::remove_file(&path);
                return Ok(Claim::NoLocks);
            }
        }
        Ok(Claim::Locks(lock))
    }
}

/// Holds a shared folder's lock among others from now on, unless the folder was removed.
fn share(lock: &File, shared: &Path) -> io::Result<bool> {
    lock.unlock()?;
    // Whoever has it alone has it for no longer than it takes to remove files.
    lock.lock_shared()?;
    Ok(is_at(lock, &shared.join(LOCK)))
}

/// Whether an open file is the one at a path, rather than one that was removed there.
fn is_at(file: &File, path: &Path) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        matches!((file.metadata(), fs::metadata(path)), (Ok(a), Ok(b)) if (a.dev(), a.ino()) == (b.dev(), b.ino()))
    }
    // There an open file is not removed.
    #[cfg(not(unix))]
    {
        let _ = file;
        path.exists()
    }
}

/// Removes a shared folder in which nothing but the lock is, which the caller has alone. What another process puts there
/// once the lock is gone stays.
fn remove_shared(shared: &Path) {
    let _ = fs::remove_file(shared.join(LOCK));
    let _ = fs::remove_dir(shared);
}

/// The folder that all share who write a file.
fn shared_folder(to: &Path) -> PathBuf {
    let name = to.file_name().unwrap_or_default().to_string_lossy();
    let end = (0..=name.len().min(NAME_MAX)).rev().find(|&end| name.is_char_boundary(end)).unwrap_or(0);
    folder_of(to).join(format!("{PREFIX}{}", &name[..end]))
}

/// Removes the remains that killed processes have left beside this file. Files that are being written now stay.
pub fn tidy(path: &Path) {
    let to = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let shared = shared_folder(&to);
    if shared.is_dir()
        && let Ok(Claim::Locks(lock)) = Claim::of(&shared)
        && lock.try_lock().is_ok()
    {
        remove_shared(&shared);
    }
}

fn folders() -> MutexGuard<'static, Vec<Arc<Place>>> {
    TEMPORARY.lock().unwrap_or_else(PoisonError::into_inner)
}

fn temporary_folder(to: &Path) -> Result<Temporary, Error> {
    let mut folders = folders();
    // Without the temporary folder's own name, which tells a user nothing.
    let refused = |cause: io::Error| error::Problem::Io { action: "write to its folder", cause: cause.kind().into() };
    let place = Place::new(to).map_err(refused)?;
    let place = Arc::new(place);
    folders.push(place.clone());
    Ok(Temporary(place))
}

/// Removes all unfinished files. For a program that is about to end early: no file can be saved from then on.
pub fn abandon() {
    let folders = folders();
    folders.iter().for_each(|place| place.clear());
    // Kept locked, so that no other folder is made.
    std::mem::forget(folders);
}
