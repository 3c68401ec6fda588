//! Records of the files that a result was made of: which file it was, and in which state.
//!
//! What to do about a file that has changed is left to the callers.

use std::fs::File;
use std::io;
use std::path::{Path, absolute};
use std::time::{SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use walkdir::WalkDir;

use crate::error::Error;
use crate::registry::is_store;

/// A file that a result was made of, in the state in which it was.
///
/// Serde writes it with these names; two records are equal where the file is the same and has not changed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct InputRecord {
    /// What the file was for.
    pub role: Role,
    /// The absolute path, behind symbolic links.
    pub path: String,
    /// The size in bytes; of a folder, such as a Zarr store, that of all files in it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size: Option<u64>,
    /// The time of the last change in seconds since 1970, UTC, with nine decimals; of a folder the latest in it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub changed: Option<String>,
    /// The SHA-256 of the content, of a plugin, in place of size and time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sha256: Option<String>,
}

/// What a file was for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// The field that was measured.
    Map,
    /// The mask.
    Mask,
    /// The library of a measure.
    Plugin,
}

impl InputRecord {
    /// The record of a file or a folder of data, by size and time.
    ///
    /// # Errors
    /// Where it, or a part of a folder, cannot be looked at. The error names it.
    pub fn of_data(role: Role, path: &Path) -> Result<Self, Error> {
        let (mut size, mut changed) = (0, UNIX_EPOCH);
        // Of folders only stores are looked into: others are no data, and may be large.
        let depth = if is_store(path) { usize::MAX } else { 0 };
        for entry in WalkDir::new(path).follow_links(true).max_depth(depth) {
            let metadata = entry.and_then(|entry| entry.metadata());
            let metadata = metadata.map_err(|e| failed("look at it", path)(e.into()))?;
            // The time of a folder tells of files that are gone, or have come with a time of their own.
            changed = changed.max(metadata.modified().map_err(failed("look at it", path))?);
            size += if metadata.is_file() { metadata.len() } else { 0 };
        }
        Ok(InputRecord {
            role,
            path: whole_path(path),
            size: Some(size),
            changed: Some(seconds(changed)),
            sha256: None,
        })
    }

    /// The record of a library with measures, by its content.
    ///
    /// # Errors
    /// Where it cannot be read. The error names it.
    pub fn of_plugin(path: &Path) -> Result<Self, Error> {
        let mut digest = Sha256::new();
        let read = File::open(path).and_then(|mut file| io::copy(&mut file, &mut digest));
        read.map_err(failed("read it", path))?;
        let sha256 = digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect();
        let path = whole_path(path);
        Ok(InputRecord { role: Role::Plugin, path, size: None, changed: None, sha256: Some(sha256) })
    }
}

/// An error of the operating system that names a file.
fn failed(action: &'static str, path: &Path) -> impl Fn(io::Error) -> Error {
    move |cause| Error::io(action)(cause).with_path(path)
}

/// The absolute path of a file, behind links where it is there.
fn whole_path(path: &Path) -> String {
    let whole = path.canonicalize().or_else(|_| absolute(path));
    whole.as_deref().unwrap_or(path).to_string_lossy().into_owned()
}

/// A time in seconds since 1970.
fn seconds(time: SystemTime) -> String {
    match time.duration_since(UNIX_EPOCH) {
        Ok(since) => format!("{}.{:09}", since.as_secs(), since.subsec_nanos()),
        Err(before) => format!("-{}.{:09}", before.duration().as_secs(), before.duration().subsec_nanos()),
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::time::Duration;

    use super::*;

    #[test]
    fn whatever_happens_to_a_file_shows() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        let record = || InputRecord::of_data(Role::Map, &path).unwrap();
        let at = |seconds| {
            let time = UNIX_EPOCH + Duration::from_secs(seconds);
            File::options().write(true).open(&path).unwrap().set_modified(time).unwrap();
        };
        fs::write(&path, "1234").unwrap();
        at(1_000_000_000);
        let first = record();
        assert_eq!((first.size, first.changed.as_deref()), (Some(4), Some("1000000000.000000000")));
        assert_eq!(record(), first);
        // Replaced by an older one, and by a longer one of the same time.
        at(900_000_000);
        assert_ne!(record(), first);
        fs::write(&path, "12345").unwrap();
        at(1_000_000_000);
        assert_ne!(record(), first);
        let copy = folder.path().join("b");
        fs::copy(&path, &copy).unwrap();
        assert_ne!(InputRecord::of_data(Role::Map, &copy).unwrap().path, first.path);
        let gone = InputRecord::of_data(Role::Map, &folder.path().join("c")).unwrap_err();
        assert_eq!(gone.kind(), crate::ErrorKind::NotFound);
    }

    #[test]
    fn whatever_happens_in_a_folder_shows() {
        let folder = tempfile::tempdir().unwrap();
        let store = folder.path().join("a.zarr");
        fs::create_dir_all(store.join("z/c")).unwrap();
        fs::write(store.join("zarr.json"), "").unwrap();
        let chunk = store.join("z/c/0");
        let old = |path: &Path| {
            File::options().read(true).open(path).unwrap().set_modified(UNIX_EPOCH + Duration::from_secs(1)).unwrap();
        };
        fs::write(&chunk, "1234").unwrap();
        let places = ["zarr.json", "z/c/0", "z/c", "z", ""].map(|place| store.join(place));
        let all_old = || places.iter().for_each(|path| old(path));
        all_old();
        let record = || InputRecord::of_data(Role::Map, &store).unwrap();
        let first = record();
        assert_eq!((first.size, first.changed.as_deref()), (Some(4), Some("1.000000000")));
        fs::write(&chunk, "5678").unwrap();
        assert_ne!(record(), first);
        all_old();
        assert_eq!(record(), first);
        // A chunk from elsewhere, with its own old time.
        fs::write(folder.path().join("other"), "5678").unwrap();
        old(&folder.path().join("other"));
        fs::rename(folder.path().join("other"), &chunk).unwrap();
        assert_ne!(record(), first);
    }

    #[test]
    fn plugins_are_known_by_their_content() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lib");
        fs::write(&path, "abc").unwrap();
        let first = InputRecord::of_plugin(&path).unwrap();
        // The example of FIPS 180-2.
        let expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(first.sha256.as_deref(), Some(expected));
        fs::write(&path, "abd").unwrap();
        assert_ne!(InputRecord::of_plugin(&path).unwrap(), first);
        fs::write(&path, "abc").unwrap();
        assert_eq!(InputRecord::of_plugin(&path).unwrap(), first);
    }
}
