//! The command line that this program was started with, and the part of it that makes an output.

use std::collections::HashSet;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// The arguments; the first is the program's name.
static ARGUMENTS: OnceLock<Vec<OsString>> = OnceLock::new();

/// Keeps the arguments of the program, which runs once in a process.
pub(crate) fn keep(arguments: Vec<OsString>) -> &'static [OsString] {
    ARGUMENTS.get_or_init(|| arguments)
}

/// Options that say how a program runs, and nothing about what it makes.
const RUNNING: [&str; 4] = ["--resume", "--overwrite", "--quiet", "--verbose"];

/// Those of them that have a value.
const RUNNING_WITH_VALUE: [&str; 4] = ["--jobs", "--memory", "--shard", "--threads"];

/// Those of them that are letters, which may stand before another.
const RUNNING_LETTERS: [char; 2] = ['q', 'v'];

/// The command that makes an output of this input: as given, without the other inputs and without options that do not
/// matter to what is made.
pub(crate) fn command(inputs: &[PathBuf], input: &Path) -> String {
    let others: HashSet<_> = inputs.iter().filter(|i| *i != input).map(|i| i.as_os_str()).collect();
    let mut arguments = ARGUMENTS.get().into_iter().flatten().skip(1);
    let mut words: Vec<String> = Vec::new();
    let mut only_inputs = false;
    while let Some(argument) = arguments.next() {
        let mut word = argument.to_string_lossy().into_owned();
        // A mask may be an input too.
        let is_mask = words.last().is_some_and(|last| ["-m", "--mask"].contains(&last.as_str()));
        if others.contains(argument.as_os_str()) && !is_mask {
            continue;
        }
        only_inputs |= word == "--";
        if !only_inputs {
            let name = word.split_once('=').map_or(word.as_str(), |(name, _)| name);
            if RUNNING.contains(&name) {
                continue;
            }
            if RUNNING_WITH_VALUE.contains(&name) {
                if name == word {
                    arguments.next();
                }
                continue;
            }
            if let Some(letters) = word.strip_prefix('-').filter(|letters| letters.starts_with(RUNNING_LETTERS)) {
                let rest = letters.trim_start_matches(RUNNING_LETTERS);
                if rest.is_empty() {
                    continue;
                }
                word = format!("-{rest}");
            }
        }
        words.push(word);
    }
    let quoted = shlex::try_join(words.iter().map(String::as_str)).unwrap_or_else(|_| words.join(" "));
    format!("longan {quoted}")
}
