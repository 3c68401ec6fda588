//! Libraries from C sources, made by the machine's compiler.

use std::path::{Path, PathBuf};
use std::process::Command;

/// The folder of the C header.
pub const INCLUDE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../measures/include");

/// A shared library from a source, `include` being the header's folder.
///
/// # Panics
/// Where there is no compiler, or it warns.
pub fn library(folder: &Path, name: &str, source: &Path, include: &str, flags: &[String]) -> PathBuf {
    let out = folder.join(format!("{name}{}", std::env::consts::DLL_SUFFIX));
    let mut command = Command::new(std::env::var_os("CC").unwrap_or("cc".into()));
    command.args(["-std=c11", "-O2", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC", "-I", include]);
    let made = command.args(flags).arg(source).arg("-o").arg(&out).arg("-lm").output().expect("a C compiler, cc");
    assert!(made.status.success(), "cc {flags:?}: {}", String::from_utf8_lossy(&made.stderr));
    out
}
