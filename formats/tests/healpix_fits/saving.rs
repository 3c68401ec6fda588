//! A file is replaced as a whole or not at all.

use std::fs;
use std::path::Path;

use longan_formats::{Error, ErrorKind, check_writable, save};

use longan_support::skip;

use crate::{is, problem};

fn write_text(text: &'static str) -> impl FnOnce(&Path) -> Result<(), Error> {
    move |path| {
        fs::write(path, text).unwrap();
        Ok(())
    }
}

fn names(folder: &Path) -> Vec<String> {
    fs::read_dir(folder).unwrap().map(|f| f.unwrap().file_name().into_string().unwrap()).collect()
}

#[test]
fn a_finished_file_is_in_its_place() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.png");
    save(&path, false, |temporary| {
        // Writers that go by the name's ending need it.
        assert_eq!(temporary.file_name(), path.file_name());
        assert_ne!(temporary, path);
        write_text("one")(temporary)
    })
    .unwrap();
    assert_eq!(fs::read_to_string(&path).unwrap(), "one");
    assert!(is(&problem(save(&path, false, |_| panic!("nothing to write"))).0, ErrorKind::Exists, "the file exists"));
    save(&path, true, write_text("two")).unwrap();
    assert_eq!(fs::read_to_string(&path).unwrap(), "two");
    assert_eq!(names(folder.path()), ["out.png"]);
}

#[test]
fn a_failure_leaves_the_old_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.fits");
    let fail = |temporary: &Path| {
        fs::write(temporary, "half").unwrap();
        Err(Error::io("write it")(std::io::ErrorKind::NotFound.into()))
    };
    assert!(is(&problem(save(&path, false, fail)).0, ErrorKind::NotFound, "there is no such file"));
    assert_eq!(names(folder.path()), [""; 0]);
    fs::write(&path, "old").unwrap();
    assert!(is(&problem(save(&path, true, fail)).0, ErrorKind::NotFound, "there is no such file"));
    let panicked = std::panic::catch_unwind(|| {
        let _ = save::<Error>(&path, true, |temporary| {
            fs::write(temporary, "half").unwrap();
            std::panic::resume_unwind(Box::new("interrupted"))
        });
    });
    assert!(panicked.is_err());
    assert_eq!(
        (names(folder.path()), fs::read_to_string(&path).unwrap()),
        (vec!["out.fits".to_owned()], "old".to_owned())
    );
    // A writer that writes nothing at all.
    assert!(save::<Error>(&path, true, |_| Ok(())).is_err());
    assert_eq!(fs::read_to_string(&path).unwrap(), "old");
}

#[test]
fn a_killed_process_leaves_the_old_file() {
    const VARIABLE: &str = "LONGAN_TEST_SAVE_AND_ABORT";
    if let Some(path) = std::env::var_os(VARIABLE) {
        let _ = save::<Error>(path.as_ref(), true, |temporary| {
            fs::write(temporary, "half").unwrap();
            std::process::abort()
        });
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.fits");
    fs::write(&path, "old").unwrap();
    let status = std::process::Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "saving::a_killed_process_leaves_the_old_file"])
        .env(VARIABLE, &path)
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::null())
        .status()
        .unwrap();
    assert!(!status.success());
    // It has been writing, elsewhere.
    assert_eq!(names(folder.path()).len(), 2);
    assert_eq!(fs::read_to_string(&path).unwrap(), "old");
}

#[test]
fn a_file_made_meanwhile_is_not_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.fits");
    let result = save(&path, false, |temporary| {
        fs::write(&path, "theirs").unwrap();
        write_text("ours")(temporary)
    });
    assert!(is(&problem(result).0, ErrorKind::Exists, "the file exists"));
    assert_eq!(fs::read_to_string(&path).unwrap(), "theirs");
}

#[test]
fn what_cannot_be_written_is_known_before() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("out.fits");
    assert!(check_writable(&file, false).is_ok());
    assert!(names(folder.path()).is_empty());
    assert!(check_writable(Path::new("in-this-folder.fits"), false).is_ok());
    fs::write(&file, "old").unwrap();
    assert!(check_writable(&file, true).is_ok());
    assert!(is(&problem(check_writable(&file, false)).0, ErrorKind::Exists, "the file exists"));
    assert_eq!(fs::read_to_string(&file).unwrap(), "old");

    let none = folder.path().join("none/out.fits");
    let (error, told) = problem(check_writable(&none, true));
    assert!(is(&error, ErrorKind::NotFound, "the folder") && told.contains("create it first"), "{told}");
    assert!(is(&problem(check_writable(folder.path(), true)).0, ErrorKind::NotAFile, "this is a folder"));
    assert!(is(&problem(check_writable(&folder.path().join("new/"), true)).0, ErrorKind::NotAFile, "this is a folder"));
    assert!(is(&problem(check_writable(Path::new(".."), true)).0, ErrorKind::NotAFile, "this is a folder"));
    assert!(problem(check_writable(Path::new(""), true)).1.contains("name"));
    assert!(check_writable(&file.join("below-a-file"), true).is_err());
    for error in [&none, folder.path()] {
        assert!(save::<Error>(error, true, |_| panic!("nothing to write")).is_err());
    }
}

#[cfg(unix)]
#[test]
fn a_folder_that_may_not_be_written_to() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    fs::set_permissions(folder.path(), fs::Permissions::from_mode(0o555)).unwrap();
    if fs::write(folder.path().join("probe"), "").is_ok() {
        return skip("permissions", "this user may write everywhere, so a locked folder is not tested");
    }
    let (error, told) = problem(check_writable(&folder.path().join("out.fits"), false));
    assert!(is(&error, ErrorKind::Io, "cannot write to its folder"), "{told}");
}

#[cfg(unix)]
#[test]
fn links_devices_and_permissions() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let elsewhere = tempfile::tempdir().unwrap();
    let (link, target) = (folder.path().join("link.fits"), elsewhere.path().join("target.fits"));
    fs::write(&target, "old").unwrap();
    std::os::unix::fs::symlink(&target, &link).unwrap();
    save(&link, true, write_text("new")).unwrap();
    assert!(link.is_symlink());
    assert_eq!(fs::read_to_string(&target).unwrap(), "new");

    // As root, this would replace the device.
    assert!(is(&problem(check_writable(Path::new("/dev/null"), true)).0, ErrorKind::NotAFile, "not a regular file"));

    // A new file is as readable as any other.
    let (saved, plain) = (folder.path().join("saved"), folder.path().join("plain"));
    save(&saved, false, write_text("")).unwrap();
    fs::write(&plain, "").unwrap();
    let mode = |path| fs::metadata(path).unwrap().permissions().mode();
    assert_eq!(mode(&saved), mode(&plain));
}
