use std::collections::BTreeMap;
use std::fs::File;
use std::time::SystemTime;

use super::*;

impl Folder {
    /// One with simulated maps `sims/0.fits` and so on.
    pub(super) fn with_sims(count: usize, nside: usize) -> Self {
        let folder = Folder::new();
        std::fs::create_dir(folder.path("sims")).unwrap();
        for i in 0..count {
            folder
                .done(&format!("simulate waves -o sims/{i}.fits --nside {nside} --correlation 10 --seed {i} --quiet"));
        }
        folder
    }

    /// All files of a folder within it, hidden ones too, with what they hold; folders there hold nothing.
    fn files(&self, name: &str) -> BTreeMap<OsString, Vec<u8>> {
        let entries = std::fs::read_dir(self.path(name)).unwrap().map(Result::unwrap);
        entries.map(|e| (e.file_name(), std::fs::read(e.path()).unwrap_or_default())).collect()
    }

    /// The files of `maps` after a run, which are then removed.
    #[track_caller]
    fn maps_of(&self, words: &str) -> BTreeMap<OsString, Vec<u8>> {
        self.done(words);
        let files = self.files("maps");
        std::fs::remove_dir_all(self.path("maps")).unwrap();
        files
    }

    /// When each output in `maps` was written.
    fn written(&self) -> BTreeMap<OsString, SystemTime> {
        let Ok(entries) = std::fs::read_dir(self.path("maps")) else { return BTreeMap::new() };
        let files = entries.map(Result::unwrap).filter(|e| !e.file_name().to_string_lossy().starts_with('.'));
        files.map(|e| (e.file_name(), e.metadata().unwrap().modified().unwrap())).collect()
    }
}

/// The names of the first inputs.
fn sims(count: usize) -> String {
    (0..count).map(|i| format!("sims/{i}.fits")).collect::<Vec<_>>().join(" ")
}

/// The outputs that a run has told of.
fn told(printed: &str) -> usize {
    printed.lines().filter(|line| line.starts_with("maps/")).count()
}

#[test]
fn bytes_do_not_depend_on_jobs_or_threads() {
    let folder = Folder::with_sims(5, 16);
    folder.write("mask.fits", &map_file(&[[1.0; 2000].as_slice(), &[0.0; 1072]].concat(), &[]));
    let options = "--mask mask.fits --measure evq,psi3 --window 8,20";
    let sims = sims(5);
    let one = folder.maps_of(&format!("map {sims} -o maps/ {options} --jobs 1 --threads 1"));
    assert_eq!(one.len(), 5);
    for running in ["", "--jobs 5 --threads 1", "--jobs=2 --threads=3 -v", "--jobs 3 --memory 35M -q --overwrite"] {
        assert!(one == folder.maps_of(&format!("map {running} {sims} -o maps/ {options}")), "{running}");
    }
    // Each by a process of its own.
    for sim in sims.split(' ') {
        folder.done(&format!("map {sim} -qo maps/ {options}"));
    }
    assert!(one == folder.files("maps"), "a process for each");
}

#[test]
fn commands_say_nothing_about_running() {
    let folder = Folder::with_sims(2, 8);
    let words =
        "map sims/0.fits sims/1.fits --jobs 2 -vo maps --threads=2 --memory 1G --window 10 --shard 1/1 --resume";
    folder.done(words);
    assert_eq!(folder.headers("maps/0.fits")[0]["COMMAND"], "longan map sims/0.fits -o maps --window 10");
    // After two hyphens nothing is an option.
    std::fs::rename(folder.path("sims/0.fits"), folder.path("-q")).unwrap();
    folder.done("map -o out.fits --quiet --window 10 -- -q");
    assert_eq!(folder.headers("out.fits")[0]["COMMAND"], "longan map -o out.fits --window 10 -- -q");
}

#[test]
fn shards_make_all_maps_and_none_twice() {
    let folder = Folder::with_sims(7, 8);
    let all = folder.maps_of(&format!("map {} -o maps", sims(7)));
    // The order in which inputs are given does not matter; an output that two shards made would be refused.
    let mut names: Vec<String> = sims(7).split(' ').map(str::to_owned).collect();
    let mut made = Vec::new();
    for shard in 1..=3 {
        names.rotate_left(2);
        names.swap(0, shard);
        made.push(told(&folder.done(&format!("map {} -o maps --shard {shard}/3", names.join(" ")))));
    }
    assert_eq!(made, [3, 2, 2]);
    assert!(folder.files("maps") == all);
    // A shard of nothing.
    let printed = folder.done(&format!("map {} -o maps --shard 8/9", sims(7)));
    assert_eq!(printed, "shard 8/9 has none of the 7 inputs, so there is nothing to do\n");
    // One input goes where it would without shards: into the folder.
    folder.done(&format!("map {} -o other --shard 7/7", sims(7)));
    assert_eq!(folder.files("other").into_keys().collect::<Vec<_>>(), ["6.fits"]);
    for wrong in ["0/3", "4/3", "1", "1/0", "-1/3", "a/b"] {
        folder.misused(&format!("map sims/0.fits -o maps --shard={wrong}"), &["--shard", "I from 1 to N"]);
    }
}

#[test]
#[cfg(unix)]
fn runs_killed_at_any_moment_are_resumed() {
    let folder = Folder::with_sims(0, 8);
    for i in 0..12 {
        let nside = 8 + 4 * i;
        folder.done(&format!("simulate waves -o sims/{i}.fits --nside {nside} --correlation 20 --seed {i} --quiet"));
    }
    let words = format!("map {} -o maps --window 0 --jobs 2", sims(12));
    let expected = folder.maps_of(&words);
    let resumed = format!("{words} --resume");
    let size = |i: usize| expected[&OsString::from(format!("{i}.fits"))].len() as u64;
    for round in 1..9 {
        // Two kills, each at the first output that is larger, the second of a run that goes on.
        for limit in [round / 2, round] {
            let before = folder.written();
            folder.killed(&resumed, size(limit));
            let after = folder.written();
            assert!(before.iter().all(|(name, time)| after[name] == *time), "round {round}");
            for name in after.keys() {
                assert!(std::fs::read(folder.path("maps").join(name)).unwrap() == expected[name], "round {round}");
            }
        }
        let before = folder.written();
        assert!((1..12).contains(&before.len()), "round {round}: {}", before.len());
        let printed = folder.done(&resumed);
        assert_eq!(told(&printed), 12 - before.len(), "{printed}");
        let after = folder.written();
        assert!(before.iter().all(|(name, time)| after[name] == *time), "round {round}");
        // Nothing that the killed left is there either.
        assert!(folder.files("maps") == expected, "round {round}: {:?}", folder.files("maps").keys());
        std::fs::remove_dir_all(folder.path("maps")).unwrap();
    }
}

#[test]
fn what_the_killed_leave_goes_and_what_the_living_have_stays() {
    let folder = Folder::with_sims(2, 8);
    let left = |name: &str| {
        let shared = folder.path(format!("maps/.longan-{name}"));
        std::fs::create_dir_all(shared.join("tmp")).unwrap();
        std::fs::write(shared.join("tmp").join(name), "half").unwrap();
        shared
    };
    // Of an output that is still to be made, and of one that is there.
    let shared = left("0.fits");
    folder.done("map sims/0.fits sims/1.fits -o maps");
    assert!(!shared.exists());
    let shared = left("1.fits");
    folder.done("map sims/0.fits sims/1.fits -o maps --resume");
    assert!(!shared.exists());
    // Of another process that holds the lock.
    let shared = left("0.fits");
    let lock = File::create(shared.join("lock")).unwrap();
    lock.lock_shared().unwrap();
    folder.done("map sims/0.fits -o maps/ --resume");
    folder.done("map sims/0.fits -o maps/ --overwrite");
    assert_eq!(std::fs::read_dir(&shared).unwrap().count(), 2);
    assert_eq!(std::fs::read_to_string(shared.join("tmp/0.fits")).unwrap(), "half");
    drop(lock);
    folder.done("map sims/0.fits -o maps/ --overwrite");
    assert_eq!(folder.files("maps").len(), 2);
}

/// Runs that make the same outputs at the same time.
#[test]
fn a_race_harms_nothing() {
    let folder = Folder::with_sims(6, 16);
    let words = format!("map {} -o maps --resume", sims(6));
    let expected = folder.maps_of(&words);
    for _ in 0..4 {
        let run = || folder.command(&words).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        for runner in [run(), run(), run()] {
            let ended = runner.wait_with_output().unwrap();
            assert!(ended.status.success() && ended.stderr.is_empty(), "{ended:?}");
        }
        assert!(folder.files("maps") == expected);
        std::fs::remove_dir_all(folder.path("maps")).unwrap();
    }
}

#[test]
fn outputs_of_another_analysis_are_not_resumed() {
    let folder = Folder::with_sims(3, 8);
    folder.write("mask.fits", &map_file(&[1.0; 768], &[]));
    std::fs::create_dir(folder.path("others")).unwrap();
    std::fs::copy(folder.path("sims/1.fits"), folder.path("others/0.fits")).unwrap();
    for i in 0..3 {
        folder.done(&format!("regrid sims/{i}.fits -o sims/{i}.nc --quiet"));
    }
    for (output, end) in [("maps", "fits"), ("cubes", "nc")] {
        let inputs: Vec<String> = (0..3).map(|i| format!("sims/{i}.{end}")).collect();
        let (first, inputs) = (&inputs[0], inputs.join(" "));
        folder.done(&format!("map {first} -o {output}/ --mask mask.fits"));
        folder.refused(
            &format!("map {inputs} -o {output} --mask mask.fits --resume --window 7"),
            &[
                &format!("{output}/0.{end}: "),
                &format!("`longan map {first} -o {output}/ --mask mask.fits`"),
                &format!("`longan map {first} -o {output} --mask mask.fits --window 7`"),
                "--overwrite",
            ],
        );
        for other in ["", "--mask sims/2.fits", "--mask mask.fits --float32", "--mask mask.fits --measure w1"] {
            folder.refused(&format!("map {inputs} -o {output} {other} --resume"), &["this was made by"]);
        }
        // The same in other words.
        let same = "--window=6.0 --measure evq -m ./mask.fits --max-masked 0.0625";
        let printed = folder.done(&format!("map {inputs} -o ./{output} --resume {same}"));
        assert!(printed.starts_with("1 of 3 outputs exist"), "{printed}");
    }
    // Another input of the same name, and a file that longan did not make.
    folder.refused("map others/0.fits -o maps/ -m mask.fits --resume", &["map sims/0.fits", "map others/0.fits"]);
    folder.write("maps/2.fits", b"foreign");
    folder.refused("map sims/2.fits -o maps/ -m mask.fits --resume", &["maps/2.fits", "does not say", "remove it"]);
}

#[test]
fn names_beyond_ascii_are_resumed() {
    let folder = Folder::with_sims(1, 8);
    std::fs::rename(folder.path("sims/0.fits"), folder.path("sims/léo's sky.fits")).unwrap();
    folder.write("masque é.fits", &map_file(&[1.0; 768], &[]));
    let words = "map \"sims/léo's sky.fits\" -o maps/ --mask 'masque é.fits' --resume";
    folder.done(words);
    assert_eq!(folder.done(words), "1 of 1 outputs exist, and stay as they are\n");
}

#[test]
fn memory_is_kept_within_bounds() {
    let folder = Folder::with_sims(3, 8);
    folder
        .refused("map sims/0.fits -o out.fits --memory 1M", &["sims/0.fits: ", "--memory allows 1 MB", "needs about"]);
    // Larger maps need more.
    folder
        .refused("map sims/0.fits -o out.fits --memory 1G --nside-out 4096", &["of memory", "--memory allows 1.0 GB"]);
    // One at a time.
    folder.done(&format!("map {} -o maps --jobs 3 --memory 34MB", sims(3)));
    for wrong in ["0G", "4", "-1G", "G", "1X", "nanG", "1e400G"] {
        folder.misused(&format!("map sims/0.fits -o out.fits --memory={wrong}"), &["--memory", "4G"]);
    }
    for wrong in ["0", "1025", "many"] {
        folder.misused(&format!("map sims/0.fits -o out.fits --jobs={wrong}"), &["--jobs"]);
    }
}

#[test]
fn bad_inputs_are_told_in_order() {
    let folder = Folder::with_sims(4, 8);
    folder.write("a.fits", b"no map");
    let words = "map a.fits sims/0.fits b.fits sims/1.fits sims/2.fits c.fits sims/3.fits -o maps --jobs 4";
    let ran = folder.run(words);
    assert_eq!(ran.code, Some(1));
    assert!(ran.out.lines().last().unwrap().starts_with("4 maps in "), "{}", ran.out);
    let lines: Vec<&str> = ran.err.lines().collect();
    assert_eq!(lines[0], "longan: 3 of 7 inputs failed, the others are done:");
    assert_eq!(lines.len(), 4);
    for (line, name) in lines[1..].iter().zip(["a", "b", "c"]) {
        assert!(line.starts_with(&format!("  {name}.fits: ")), "{line}");
    }
    assert_eq!(folder.files("maps").len(), 4);
}
