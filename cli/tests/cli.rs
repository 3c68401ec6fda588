//! The program as users meet it: each test runs the binary in a folder of its own.

/// Data against simulations.
mod compare;
/// Every family of files, from end to end.
mod families;
/// Pixels finer than the grid, or than points lie.
mod finer;
/// Measures as formulas.
mod formulas;
/// `longan graph`.
mod graph;
/// Fields on grids of latitude and longitude, made by hand.
mod gridded;
/// Many maps at a time, in parts, and in spite of kills.
mod many_maps;
/// `longan map` on one input.
mod map;
/// What does not go together, and what is hardly meant.
mod mismatch;
/// Names that are hard to handle, the streams that the program prints to, and its help.
mod names_and_streams;
/// `longan plot`.
mod plot;
/// Measures from libraries, and `longan plugin`.
mod plugins;
/// Quantities of columns, in files and in what is made of them.
mod quantities;
/// What is refused, and in which words.
mod refusals;
/// `totals`, `info`, `measures`, `simulate` and `demo`.
mod reports;
/// Several inputs, runs that go on where another ended, and runs that are killed.
mod runs;
/// Results that are no longer what would be made.
mod stale;
/// Fields with steps in time, and files of them.
mod steps;

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use longan::Map;
use longan_formats::{self as formats, Field, Selection};
use tempfile::TempDir;

pub(crate) use gridded::Layout;
use longan_support::bytes::{Col, col, f64s, file};
use longan_support::{bytes, compile, difference};

/// A folder in which the program runs.
pub(crate) struct Folder(TempDir);

/// How a run ended.
#[derive(Debug)]
pub(crate) struct Ran {
    pub(crate) code: Option<i32>,
    pub(crate) out: String,
    pub(crate) err: String,
}

impl Folder {
    /// An empty one.
    pub(crate) fn new() -> Self {
        Folder(tempfile::tempdir().unwrap())
    }

    /// One with the map `sky.fits` of a Gaussian field, Nside 16, RING.
    fn with_sky() -> Self {
        let folder = Self::new();
        folder.done("simulate waves -o sky.fits --nside 16 --correlation 15");
        folder
    }

    pub(crate) fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, bytes: &[u8]) {
        std::fs::write(self.path(name), bytes).unwrap();
    }

    /// Names of all that is in it, hidden files too.
    fn names(&self) -> Vec<OsString> {
        let mut names: Vec<_> = std::fs::read_dir(self.0.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
        names.sort();
        names
    }

    /// The path of the folder.
    fn root(&self) -> &Path {
        self.0.path()
    }

    /// The program, in this folder, with words as a shell would split them.
    fn command(&self, words: &str) -> Command {
        self.command_of(&shlex::split(words).expect("quotes that match"))
    }

    fn command_of(&self, words: &[impl AsRef<std::ffi::OsStr>]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_longan"));
        command.args(words).current_dir(self.0.path()).stdin(Stdio::null());
        command.env_remove("LONGAN_PLUGIN_PATH");
        command
    }

    fn run(&self, words: &str) -> Ran {
        ran(self.command(words))
    }

    /// Runs until the system kills it, for it writes a file beyond so many bytes.
    #[cfg(unix)]
    #[track_caller]
    fn killed(&self, words: &str, bytes: u64) {
        let mut command = Command::new("sh");
        command.args(["-c", "ulimit -c 0; ulimit -f $0; exec \"$@\"", &(bytes / 512).to_string()]);
        command.arg(env!("CARGO_BIN_EXE_longan")).args(shlex::split(words).expect("quotes that match"));
        let ended = command.current_dir(self.root()).stdin(Stdio::null()).stdout(Stdio::null()).status().unwrap();
        let signal = std::os::unix::process::ExitStatusExt::signal(&ended);
        // Its number is that of Linux and macOS.
        assert_eq!(signal, Some(25), "longan {words}: {ended}, and not by SIGXFSZ");
    }

    /// Runs without any complaint; what was printed.
    #[track_caller]
    pub(crate) fn done(&self, words: &str) -> String {
        let ran = self.run(words);
        assert!(ran.code == Some(0) && ran.err.is_empty(), "longan {words}: {ran:?}");
        ran.out
    }

    /// Refuses in one sentence that has all of `parts`, and leaves the folder as it was.
    #[track_caller]
    fn refused(&self, words: &str, parts: &[&str]) {
        let before = self.names();
        let ran = self.run(words);
        assert_eq!(ran.code, Some(1), "longan {words}: {ran:?}");
        let sentence = ran.err.strip_prefix("longan: ").and_then(|e| e.strip_suffix('\n')).unwrap_or("");
        assert!(!sentence.is_empty() && !sentence.contains('\n') && !sentence.ends_with('.'), "{words}: {}", ran.err);
        for part in parts {
            assert!(sentence.contains(part), "longan {words}: no '{part}' in '{sentence}'");
        }
        assert_eq!(self.names(), before, "longan {words}: files left over");
    }

    /// Refuses the arguments themselves, in words that have all of `parts`, and leaves the folder as it was.
    #[track_caller]
    fn misused(&self, words: &str, parts: &[&str]) {
        let before = self.names();
        let ran = self.run(words);
        assert!(ran.code == Some(2) && ran.err.starts_with("error: ") && ran.out.is_empty(), "longan {words}: {ran:?}");
        for part in parts {
            assert!(ran.err.contains(part), "longan {words}: no '{part}' in '{}'", ran.err);
        }
        assert_eq!(self.names(), before, "longan {words}: files left over");
    }

    /// One field of a file.
    #[track_caller]
    pub(crate) fn read(&self, name: impl AsRef<Path>, field: &str) -> Map {
        self.read_hdu(name, field, None)
    }

    #[track_caller]
    pub(crate) fn read_hdu(&self, name: impl AsRef<Path>, field: &str, hdu: Option<usize>) -> Map {
        let selection = Selection { field: Some(field.parse::<Field>().unwrap()), hdu, ..Selection::default() };
        formats::read(&self.path(name), &selection).unwrap()
    }

    /// The keywords of a file's tables, with texts unquoted.
    fn headers(&self, name: &str) -> Vec<BTreeMap<String, String>> {
        headers(&std::fs::read(self.path(name)).unwrap())
    }
}

/// Frees a NetCDF file that was just written here from HDF5's lock on it, which lasts a while longer where another test
/// starts a program at this moment: that inherits the open file.
fn unlock(path: &Path) {
    let bytes = std::fs::read(path).unwrap();
    std::fs::remove_file(path).unwrap();
    std::fs::write(path, bytes).unwrap();
}

fn ran(mut command: Command) -> Ran {
    let output = command.output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    Ran { code: output.status.code(), out: text(output.stdout), err: text(output.stderr) }
}

/// The keywords of all tables. The primary HDU holds no data.
fn headers(fits: &[u8]) -> Vec<BTreeMap<String, String>> {
    let mut headers = Vec::new();
    let mut at = 0;
    while at < fits.len() {
        let mut header = BTreeMap::new();
        let mut last = String::new();
        for card in fits[at..].chunks(80) {
            at += 80;
            let card = std::str::from_utf8(card).unwrap();
            if card.starts_with("END ") {
                break;
            }
            let separator = if card.starts_with("CONTINUE") { "CONTINUE" } else { "= " };
            let Some((key, value)) = card.split_once(separator) else { continue };
            let value = match value.trim().strip_prefix('\'') {
                Some(text) => text.rsplit_once('\'').unwrap().0.replace("''", "'").trim_end().to_owned(),
                None => value.split('/').next().unwrap().trim().to_owned(),
            };
            if card.starts_with("CONTINUE") {
                let begun: &mut String = header.get_mut(&last).unwrap();
                assert_eq!(begun.pop(), Some('&'));
                begun.push_str(&value);
            } else {
                last = key.trim().to_owned();
                header.insert(last.clone(), value);
            }
        }
        let side = |key: &str| header.get(key).map_or(0, |n| n.parse::<usize>().unwrap());
        at = at.next_multiple_of(2880) + (side("NAXIS1") * side("NAXIS2")).next_multiple_of(2880);
        headers.push(header);
    }
    headers.remove(0);
    headers
}

/// A file of one column of doubles, with keywords.
fn map_file(values: &[f64], keys: &[(&str, &str)]) -> Vec<u8> {
    file(values.len(), &[column("T", values)], keys)
}

fn column<'a>(name: &'a str, values: &[f64]) -> Col<'a> {
    col(name, "D", f64s(values))
}

#[track_caller]
fn assert_same(a: &Map, b: &Map) {
    assert_eq!(difference(a.values(), b.values()), 0.0);
}
