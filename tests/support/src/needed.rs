//! Things that some tests need and not every machine has. `LONGAN_REQUIRE` names those whose lack is a failure, such as
//! `LONGAN_REQUIRE=shared,healpy,xarray,cdo,fitsverify`; for lack of another, a test is skipped and says so.

use std::io::Write;
use std::path::PathBuf;
use std::process::Command;

/// Says that a test is skipped for lack of something, past the test runner's capture.
///
/// # Panics
/// Where `LONGAN_REQUIRE` names what is lacking.
pub fn skip(lacking: &str, why: &str) {
    let required = std::env::var("LONGAN_REQUIRE").unwrap_or_default();
    assert!(!required.split(',').any(|name| name.trim() == lacking), "LONGAN_REQUIRE names {lacking}, but {why}");
    let _ = writeln!(std::io::stderr(), "skipped: {why}");
}

/// `found`, or nothing and a word about it.
fn needed<T>(name: &str, found: Option<T>, why: &str) -> Option<T> {
    if found.is_none() {
        skip(name, why);
    }
    found
}

/// Whether a program runs and succeeds.
fn succeeds(program: &str, arguments: &[&str]) -> bool {
    Command::new(program).args(arguments).output().is_ok_and(|output| output.status.success())
}

/// `shared`: the folder of data and references that `LONGAN_SHARED` names.
pub fn shared() -> Option<PathBuf> {
    needed("shared", std::env::var_os("LONGAN_SHARED").map(PathBuf::from), "LONGAN_SHARED names no folder of data")
}

/// `healpy`, `xarray`: the interpreter that `LONGAN_PYTHON` names, else `python3`, with what the tests use beside these.
pub fn python_with(module: &str) -> Option<String> {
    let python = std::env::var("LONGAN_PYTHON").unwrap_or("python3".to_owned());
    let imports = match module {
        "healpy" => "import astropy, healpy",
        _ => "import netCDF4, xarray",
    };
    let has = succeeds(&python, &["-c", imports]);
    needed(module, has.then_some(python), &format!("there is no Python with {module}"))
}

/// `cdo`: the climate data operators.
pub fn cdo() -> Option<&'static str> {
    needed("cdo", succeeds("cdo", &["--version"]).then_some("cdo"), "cdo is not installed")
}

/// `fitsverify`: the checker of FITS files.
pub fn fitsverify() -> Option<&'static str> {
    // It fails without a file.
    let found = Command::new("fitsverify").output().is_ok();
    needed("fitsverify", found.then_some("fitsverify"), "fitsverify is not installed")
}
