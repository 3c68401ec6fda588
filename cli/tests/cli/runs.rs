use std::time::SystemTime;

use super::*;

/// When a file was written.
fn written(folder: &Folder, name: &str) -> SystemTime {
    folder.path(name).metadata().unwrap().modified().unwrap()
}

#[test]
fn several_inputs_go_into_a_folder() {
    let folder = Folder::with_sky();
    folder.done("simulate waves -o other.fits --nside 8 --correlation 30 --seed 2");
    // A new folder, an old one, and one named with a slash for a single input.
    let printed = folder.done("map sky.fits other.fits -o new/maps --window 10");
    assert_eq!(printed.lines().count(), 3, "{printed}");
    let last = printed.lines().last().unwrap();
    assert!(last.starts_with("2 maps in ") && last.ends_with(" a second"), "{last}");
    std::fs::create_dir(folder.path("old")).unwrap();
    folder.done("map sky.fits -o old --window 10");
    folder.done("map other.fits -o slash/ --window 10");
    folder.done("map sky.fits -o alone.fits --window 10");
    for (a, b) in [
        ("new/maps/sky.fits", "alone.fits"),
        ("old/sky.fits", "alone.fits"),
        ("new/maps/other.fits", "slash/other.fits"),
    ] {
        assert_same(&folder.read(a, "EVQ"), &folder.read(b, "EVQ"));
    }
    // The command makes this output and no other, even where the mask is an input too.
    folder.done("map sky.fits other.fits -o 'my maps' --window 10");
    assert_eq!(folder.headers("my maps/other.fits")[0]["COMMAND"], "longan map other.fits -o 'my maps' --window 10");
    folder.write("mask.fits", &map_file(&[1.0; 768], &[]));
    folder.done("map --mask mask.fits other.fits mask.fits -o masked --thresholds 0");
    assert_eq!(
        folder.headers("masked/other.fits")[0]["COMMAND"],
        "longan map --mask mask.fits other.fits -o masked --thresholds 0"
    );
}

#[test]
fn one_bad_input_does_not_stop_the_others() {
    let folder = Folder::with_sky();
    folder.write("bad.fits", b"no map");
    std::fs::copy(folder.path("sky.fits"), folder.path("last.fits")).unwrap();
    let ran = folder.run("map sky.fits bad.fits missing.fits last.fits -o maps");
    assert_eq!(ran.code, Some(1), "{ran:?}");
    let err: Vec<&str> = ran.err.lines().collect();
    let [head, bad, missing] = err[..] else { panic!("{}", ran.err) };
    assert_eq!(head, "longan: 2 of 4 inputs failed, the others are done:");
    assert!(bad.starts_with("  bad.fits: this is a text file"), "{bad}");
    assert!(missing.starts_with("  missing.fits: there is no such file"), "{missing}");
    assert_eq!(std::fs::read_dir(folder.path("maps")).unwrap().count(), 2);
    assert_same(&folder.read("maps/sky.fits", "EVQ"), &folder.read("maps/last.fits", "EVQ"));

    let ran = folder.run("map bad.fits missing.fits -o none");
    assert_eq!(ran.err.lines().next(), Some("longan: 2 of 2 inputs failed:"));
}

#[test]
fn a_run_is_resumed() {
    let folder = Folder::with_sky();
    std::fs::copy(folder.path("sky.fits"), folder.path("more.fits")).unwrap();
    let printed = folder.done("map sky.fits -o maps/ --resume");
    assert!(printed.starts_with("maps/sky.fits: EVQ"), "{printed}");
    let before = written(&folder, "maps/sky.fits");
    let printed = folder.done("map sky.fits more.fits -o maps --resume");
    assert!(printed.starts_with("1 of 2 outputs exist, and stay as they are\nmaps/more.fits: EVQ"), "{printed}");
    assert_eq!(written(&folder, "maps/sky.fits"), before);
    let printed = folder.done("map sky.fits more.fits -o maps --resume");
    assert_eq!(printed, "2 of 2 outputs exist, and stay as they are\n");
    assert_eq!(folder.done("map sky.fits -o maps --resume --quiet"), "");
    folder.done("map sky.fits -o maps --overwrite");
    assert_ne!(written(&folder, "maps/sky.fits"), before);
    // What was in the way of an output is not one.
    std::fs::create_dir(folder.path("maps/third.fits")).unwrap();
    std::fs::copy(folder.path("sky.fits"), folder.path("third.fits")).unwrap();
    folder.refused("map third.fits -o maps --resume", &["maps/third.fits", "folder"]);
}

#[test]
#[cfg(unix)]
fn a_killed_run_is_resumed() {
    let folder = Folder::new();
    // The fourth output is too large.
    for i in 0..5 {
        let nside = if i == 3 { 64 } else { 8 };
        folder.done(&format!("simulate waves -o {i}.fits --nside {nside} --correlation 20"));
    }
    let words = "map 0.fits 1.fits 2.fits 3.fits 4.fits -o maps --window 0 --measure w1,psi3 --jobs 1";
    folder.killed(words, 100_000);
    let finished = ["maps/0.fits", "maps/1.fits", "maps/2.fits"];
    let is_there = |i: usize| folder.path(format!("maps/{i}.fits")).exists();
    assert_eq!([0, 1, 2, 3, 4].map(is_there), [true, true, true, false, false]);
    let times = || finished.map(|name| written(&folder, name));
    let before = times();
    let printed = folder.done(&format!("{words} --resume"));
    assert_eq!(printed.lines().count(), 1 + 2 + 1, "{printed}");
    assert_eq!(times(), before);
    for name in &finished[1..] {
        assert_same(&folder.read(name, "PSI3"), &folder.read("maps/0.fits", "PSI3"));
    }
    assert_eq!(std::fs::read_dir(folder.path("maps")).unwrap().count(), 5);
}

/// Whether this is what a killed run may leave behind.
fn hidden(entry: &std::fs::DirEntry) -> bool {
    entry.file_name().into_string().unwrap().starts_with(".longan-")
}

#[test]
#[cfg(unix)]
fn a_killed_run_leaves_the_old_output() {
    let folder = Folder::new();
    folder.done("simulate waves -o sky.fits --nside 32 --correlation 10");
    let words = "map sky.fits -o out.fits.gz --window 0 --sequence --measure w0,w1,psi2,psi3 --overwrite";
    folder.done(words);
    let size = folder.path("out.fits.gz").metadata().unwrap().len();
    folder.write("out.fits.gz", b"old");
    for round in 0..16 {
        folder.killed(words, size * round / 16);
        assert_eq!(std::fs::read(folder.path("out.fits.gz")).unwrap(), b"old", "killed in round {round}");
        let left = std::fs::read_dir(folder.path("")).unwrap().filter(|e| hidden(e.as_ref().unwrap())).count();
        assert_eq!(left, 1, "only what the last round left is there in round {round}");
    }
    folder.done(words);
    assert_eq!(folder.names(), ["out.fits.gz", "sky.fits"]);
    assert_eq!(folder.path("out.fits.gz").metadata().unwrap().len(), size);
}

/// Ctrl-C, while the output is being written too, leaves nothing behind.
#[test]
#[cfg(unix)]
fn an_interrupted_run_leaves_nothing() {
    let folder = Folder::new();
    folder.done("simulate waves -o sky.fits --nside 64 --correlation 10");
    // Most of the time goes into writing.
    let words = "map sky.fits -o out.fits.gz --window 0 --sequence --measure w0,w1,psi2,psi3";
    let is_writing = || std::fs::read_dir(folder.path("")).unwrap().any(|e| hidden(e.as_ref().unwrap()));
    let mut interrupted = 0;
    while interrupted < 8 {
        let mut child = folder.command(words).stdout(Stdio::null()).spawn().unwrap();
        while !is_writing() && child.try_wait().unwrap().is_none() {
            std::thread::yield_now();
        }
        let killed = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
        let ended = child.wait().unwrap();
        // One that was done before the signal came is no interrupted one.
        let _ = std::fs::remove_file(folder.path("out.fits.gz"));
        assert_eq!(folder.names(), ["sky.fits"], "{killed} {ended}");
        match std::os::unix::process::ExitStatusExt::signal(&ended) {
            Some(signal) => assert_eq!(signal, 2),
            None => assert!(ended.success(), "{ended}"),
        }
        interrupted += usize::from(!ended.success());
    }
}
