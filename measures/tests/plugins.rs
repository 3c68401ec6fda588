//! Plugins, good and broken ones, compiled from C.

use longan_support::compile;

use std::path::{Path, PathBuf};

use longan_measures::plugin::interface::*;
use longan_measures::plugin::{Plugin, PluginErrorKind, in_folders};
use longan_measures::{Catalogue, Measure, MeasureError, Needs, Origin, Quantity, Weight, Window, find, testing};
use num_complex::Complex64;
use tempfile::TempDir;

/// A folder for libraries.
struct Libraries(TempDir);

impl Libraries {
    fn new() -> Self {
        Libraries(tempfile::tempdir().unwrap())
    }

    /// The plugin of `plugin.c`, with these definitions.
    fn library(&self, name: &str, defined: &[&str]) -> PathBuf {
        let flags: Vec<String> = defined.iter().map(|d| format!("-D{d}")).collect();
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/plugins/plugin.c");
        compile::library(self.0.path(), name, &source, compile::INCLUDE, &flags)
    }

    fn plugin(&self, name: &str, defined: &[&str]) -> Plugin {
        Plugin::load(&self.library(name, defined)).unwrap_or_else(|e| panic!("{e}"))
    }

    #[track_caller]
    fn refused(&self, path: &Path, parts: &[&str]) -> PluginErrorKind {
        let error = Plugin::load(path).map(|plugin| panic!("{plugin:?}")).unwrap_err();
        assert_eq!(error.path(), path);
        let sentence = error.to_string();
        assert!(sentence.starts_with(&path.display().to_string()), "{sentence}");
        assert!(!sentence.contains('\n') && !sentence.ends_with('.'), "{sentence}");
        assert!(parts.iter().all(|part| sentence.contains(part)), "no {parts:?} in: {sentence}");
        error.kind()
    }
}

const PSI: [Complex64; 3] = [Complex64::new(0.3, -0.4), Complex64::new(5.0, 7.0), Complex64::new(-0.25, 0.125)];

fn window() -> Window<'static> {
    Window {
        centre: (60.0, 30.0),
        masked_fraction: 0.25,
        area: 0.5,
        length: 2.0,
        curvature: -1.0,
        psi0: 2.0,
        ranks: &[2, 3, 4],
        psi: &PSI,
        resolution: 1e-12,
    }
}

#[test]
fn a_plugin_gets_what_it_needs_and_nothing_else() {
    let libraries = Libraries::new();
    let plain = libraries.plugin("plain", &[]);
    assert_eq!((plain.name(), plain.version()), ("plugin", "1.0"));
    let [all, length] = plain.measures() else { panic!("{plain:?}") };
    assert_eq!([all.name(), length.name()], ["all", "length"]);
    assert_eq!((all.unit(), all.rank(), all.definition().as_str()), ("rad", 2, "the sum of all that a window has"));
    assert_eq!(all.needs(), Needs { ranks: vec![0, 2, 4], ..Needs::default() });
    let Origin::Plugin(origin) = all.origin() else { panic!() };
    assert!(origin.to_string().starts_with("plugin 1.0 (") && origin.path == plain.path(), "{origin}");
    // The moments weighted as in plugin.c: ψ_0 once, ψ_2 twice, ψ_4 three times.
    let psi = 2.0 + 2.0 * (0.3 - 0.8) + 3.0 * (-0.25 + 0.25);
    assert_eq!(all.evaluate(&window()), Some(90.25 + psi));
    assert_eq!(length.evaluate(&window()), Some(2.0));

    let needy = libraries.plugin("needy", &["NEEDS=7", "RANKS_COUNT=0", "RANKS_POINTER=NULL", "WEIGHT=2", "RANK=0"]);
    let needs = Needs { area: true, length: true, curvature: true, weight: Some(Weight::Curvature), ranks: vec![] };
    assert_eq!(needy.measures()[0].needs(), needs);
    assert_eq!(needy.measures()[0].evaluate(&window()), Some(90.25 + 1.5));

    for plugin in [&plain, &needy] {
        plugin.measures().iter().for_each(|measure| testing::check(measure));
    }
}

#[test]
fn the_example_in_c_is_the_built_in_bit_for_bit() {
    let libraries = Libraries::new();
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/plugin-c/axis_ratio.c");
    let path =
        compile::library(libraries.0.path(), "axis_ratio", &source, compile::INCLUDE, &["-Wpedantic".to_owned()]);
    let plugin = Plugin::load(&path).unwrap();
    let [axis_ratio, quotient] = plugin.measures() else { panic!("{plugin:?}") };
    testing::check(quotient);
    let evq = find("evq").unwrap();
    let psi: Vec<[Complex64; 1]> =
        (0..1000).map(|i| [Complex64::from_polar(f64::from(i) / 700.0, f64::from(i * i))]).collect();
    let windows: Vec<Window<'_>> =
        psi.iter().map(|psi| Window { psi0: 1.1, ranks: &[2], psi, ..Window::default() }).collect();
    let values = |measure: &dyn Measure| {
        let mut values = vec![0.0; windows.len()];
        measure.evaluate_all(&windows, &mut values).unwrap();
        values
    };
    let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&values(quotient)), bits(&values(&evq)));
    for (ratio, evq) in values(axis_ratio).iter().zip(values(&evq)) {
        // With one eigenvalue 0, EVQ has no value.
        assert!((ratio * evq - 1.0).abs() < 1e-12 || evq.is_nan() && *ratio == 0.0, "{ratio} {evq}");
    }
    // Its own failure.
    let error = axis_ratio.evaluate_all(&[Window { psi0: -3.0, ..windows[0] }], &mut [0.0]).unwrap_err().to_string();
    assert!(error.contains("'axis-ratio' failed: a contour of negative length at colatitude 0"), "{error}");
}

#[test]
fn values_that_are_no_numbers_are_undefined() {
    let plugin = Libraries::new().plugin("odd", &["ODD"]);
    let mut values = [5.0; 6];
    plugin.measures()[0].evaluate_all(&[window(); 6], &mut values).unwrap();
    let defined: Vec<usize> = (0..6).filter(|i| !values[*i].is_nan()).collect();
    assert_eq!(defined, [1, 4]);
}

#[test]
fn failures_have_a_text() {
    let libraries = Libraries::new();
    for (name, message, part) in [
        ("plain", r#"REFUSAL="the moon is in the way.""#, "'all' failed: the moon is in the way, says the plugin"),
        ("mute", r#"REFUSAL="""#, "it does not say why"),
        ("lines", r#"REFUSAL="one\ntwo""#, "one two"),
        ("bytes", r#"REFUSAL="\xff\xfe""#, "its message is not UTF-8"),
    ] {
        let plugin = libraries.plugin(name, &["FAILURE=3", message]);
        let MeasureError { measure, reason } = plugin.measures()[0].evaluate_all(&[window()], &mut [0.0]).unwrap_err();
        let sentence = MeasureError { measure, reason }.to_string();
        assert!(sentence.contains(part) && !sentence.contains('\n'), "{sentence}");
        assert!(plugin.measures()[0].evaluate(&window()).is_none());
    }
    // As long as there is room, and without an end.
    let long = format!("REFUSAL=\"{}\"", "y".repeat(1100));
    let plugin = libraries.plugin("long", &["FAILURE=1", &long]);
    let error = plugin.measures()[0].evaluate_all(&[window()], &mut [0.0]).unwrap_err();
    assert!(error.reason.starts_with(&"y".repeat(1024)), "{error}");
}

#[test]
fn broken_plugins_are_refused_in_one_sentence() {
    let libraries = Libraries::new();
    let too_long = format!("MEASURE=\"{}\"", "a".repeat(61));
    let cases: &[(&[&str], &[&str])] = &[
        (&["HANDSHAKE=other"], &["no plugin of longan", "'longan_plugin_handshake'"]),
        (&["DESCRIBE=other"], &["no plugin of longan", "'longan_plugin'"]),
        (&["DESCRIPTION=NULL"], &["cannot start: it does not say why"]),
        (&["DESCRIPTION=NULL", r#"REFUSAL="no licence found.""#], &["cannot start: no licence found"]),
        (&["DESCRIPTION=NULL", r#"REFUSAL="\xc3\x28""#], &["its message is not UTF-8"]),
        (&["DESCRIPTION=(const LonganPlugin*)((const char*)&plugin+1)"], &["its description is not aligned"]),
        (&["PLUGIN_SIZE=0"], &["LonganPlugin has 0 bytes, and here it has 48"]),
        (&["PLUGIN_SIZE=4096"], &["LonganPlugin has 4096 bytes"]),
        (&["MEASURE_SIZE=8"], &["LonganMeasure has 8 bytes"]),
        (&["OWN_SIZE=8"], &["a LonganMeasure has 8 bytes"]),
        (&["WINDOW_SIZE=8"], &["LonganWindow has 8 bytes"]),
        (&["WINDOWS_SIZE=8"], &["LonganWindows has 8 bytes"]),
        (&["COUNT=0"], &["0 measures", "between 1 and 256"]),
        (&["COUNT=4000000000u"], &["4000000000 measures"]),
        (&["COUNT=3"], &["a LonganMeasure has 0 bytes"]),
        (&["MEASURES=NULL"], &["pointer to its measures is null"]),
        (&["MEASURES=(const LonganMeasure*)((const char*)measures+2)"], &["pointer to its measures is not aligned"]),
        (&["NAME=NULL"], &["pointer to its name is null"]),
        (&["NAME=\"\""], &["its name that the plugin gives is empty"]),
        (&["NAME=\"My Plugin\""], &["'My Plugin'", "lower-case"]),
        (&["NAME=\"longan\""], &["which means longan itself"]),
        (&["NAME=\"\\xff\""], &["its name", "is not UTF-8"]),
        (&["NAME=endless"], &["its name", "does not end within 1024 bytes"]),
        (&["VERSION=NULL"], &["its version is null"]),
        (&["VERSION=\"1\\n2\""], &["its version", "control character, \\n"]),
        (&["MEASURE=NULL"], &["the name of measure 1 is null"]),
        (&["MEASURE=\"a:b\""], &["'a:b'", "lower-case"]),
        (&["MEASURE=\"2d\""], &["'2d'"]),
        (&[&too_long], &["up to 60"]),
        (&["MEASURE=\"length\""], &["two measures 'length'"]),
        (&["DEFINITION=NULL"], &["the definition of 'all' is null"]),
        (&["DEFINITION=\"\""], &["the definition of 'all'", "is empty"]),
        (&["DEFINITION=\"a\\nb\""], &["the definition of 'all'", "control character"]),
        (&["DEFINITION=endless"], &["the definition of 'all'", "1024"]),
        (&["UNIT=NULL"], &["the unit of 'all' is null"]),
        (&["UNIT=\"\\xc2\\xb0\""], &["the unit of 'all'", "not ASCII"]),
        (&["EVALUATE=NULL"], &["the function of 'all' is null"]),
        (&["RANKS_POINTER=NULL"], &["the ranks of 'all' is null"]),
        (&["RANKS_POINTER=(const uint32_t*)((const char*)ranks+1)"], &["the ranks of 'all' is not aligned"]),
        (&["RANKS_COUNT=5000"], &["5000 ranks"]),
        (&["RANKS=2,0"], &["the rank 0 after 2", "ascend"]),
        (&["RANKS=2,2"], &["the rank 2 after 2"]),
        (&["RANKS=1001"], &["the rank 1001", "between 0 and 1000"]),
        (&["RANK=4000000000u"], &["the rank 4000000000"]),
        (&["NEEDS=8"], &["needs 0x8"]),
        (&["WEIGHT=3"], &["weight 3"]),
        (&["QUANTITY=0"], &["measure 'all' does not state its quantity"]),
        (&["QUANTITY=11"], &["measure 'all' has the quantity 11", "between 1 and 10"]),
        (&["SYMMETRY=2"], &["'all' has the symmetry 2", "only an angle"]),
        (&["QUANTITY=7", "UNIT=\"deg\""], &["'all' is an angle of the symmetry 0", "between 1 and 1000"]),
        (&["QUANTITY=7", "UNIT=\"deg\"", "SYMMETRY=1001"], &["angle of the symmetry 1001"]),
        (&["QUANTITY=7", "SYMMETRY=2"], &["'all' is an angle in 'rad'", "in 'deg'"]),
    ];
    for (i, (defined, parts)) in cases.iter().enumerate() {
        libraries.refused(&libraries.library(&format!("broken{i}"), defined), parts);
    }
}

#[test]
fn plugins_of_other_versions_are_to_be_built_anew() {
    let libraries = Libraries::new();
    for version in [0, 1, 2, LONGAN_INTERFACE + 1] {
        let plugin = libraries.library(&format!("version{version}"), &[&format!("INTERFACE={version}")]);
        let found = format!("version {version} of the plugin interface");
        let here = format!("longan has version {LONGAN_INTERFACE}");
        let kind =
            libraries.refused(&plugin, &[&found, &here, "build it anew with the header or crate of this longan"]);
        assert_eq!(kind, PluginErrorKind::Outdated);
    }
}

#[test]
fn plugins_state_their_quantities() {
    let libraries = Libraries::new();
    let quantities = [
        (LONGAN_QUANTITY_AREA, Quantity::Area),
        (LONGAN_QUANTITY_LENGTH, Quantity::Length),
        (LONGAN_QUANTITY_CURVATURE, Quantity::Curvature),
        (LONGAN_QUANTITY_MOMENT, Quantity::Moment),
        (LONGAN_QUANTITY_COUNT, Quantity::Count),
        (LONGAN_QUANTITY_RATIO, Quantity::Ratio),
        (LONGAN_QUANTITY_ANGLE, Quantity::Angle { symmetry: 3 }),
        (LONGAN_QUANTITY_DEVIATION, Quantity::Deviation),
        (LONGAN_QUANTITY_PERCENTILE, Quantity::Percentile),
        (LONGAN_QUANTITY_NUMBER, Quantity::Number),
    ];
    for (number, quantity) in quantities {
        let stated = [format!("QUANTITY={number}"), format!("SYMMETRY={}", quantity.symmetry().unwrap_or(0))];
        let mut defined: Vec<&str> = stated.iter().map(String::as_str).collect();
        defined.extend(quantity.symmetry().map(|_| "UNIT=\"deg\""));
        let plugin = libraries.plugin(&format!("quantity{number}"), &defined);
        assert_eq!(plugin.measures()[0].quantity(), quantity);
        let is_relative = matches!(quantity, Quantity::Ratio | Quantity::Angle { .. });
        assert_eq!(plugin.measures()[0].is_relative(), is_relative, "{quantity}");
    }
}

#[test]
fn files_that_are_no_libraries_are_refused() {
    let libraries = Libraries::new();
    let file = |name: &str, bytes: &[u8]| {
        let path = libraries.0.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    };
    let whole = std::fs::read(libraries.library("whole", &[])).unwrap();
    libraries.refused(&file("empty.so", b""), &["not a library"]);
    libraries.refused(&file("text.so", b"no library at all, but a text\n"), &["not a library"]);
    libraries.refused(&file("cut.so", &whole[..200]), &["not a library"]);
    let kind = libraries.refused(&libraries.0.path().join("missing.so"), &["no such file"]);
    assert_eq!(kind, PluginErrorKind::Unreadable);
    libraries.refused(libraries.0.path(), &["not a file"]);
    // A name alone is not looked for among the system's libraries.
    libraries.refused(Path::new("libm.so.6"), &["no such file"]);
}

#[test]
fn names_that_others_have_too_need_the_plugin() {
    let libraries = Libraries::new();
    let one = libraries.plugin("one", &["NAME=\"one\"", "MEASURE=\"evq\""]);
    let two = libraries.plugin("two", &["NAME=\"two\""]);
    let other = libraries.plugin("other", &["NAME=\"two\""]);
    let clash = Catalogue::new(vec![two.clone(), other]).unwrap_err().to_string();
    assert!(clash.contains("same name, 'two'") && clash.contains("load one of them only"), "{clash}");

    let catalogue = Catalogue::new(vec![one, two]).unwrap();
    let found = |name: &str| {
        let measure = catalogue.find(name).map_err(|e| e.to_string())?;
        Ok::<_, String>((measure.name(), measure.column(), measure.origin() == Origin::Program))
    };
    let both = |name: &str, column: &str, built_in| Ok((name.to_owned(), column.to_owned(), built_in));
    assert_eq!(found("all"), both("all", "ALL", false));
    assert_eq!(found("two:all"), both("all", "ALL", false));
    assert_eq!(found("one:evq"), both("one:evq", "ONE_EVQ", false));
    assert_eq!(found("longan:evq"), both("evq", "EVQ", true));
    assert_eq!(found("two:length"), both("two:length", "TWO_LENGTH", false));
    assert!(found("evq").unwrap_err().contains("choose 'longan:evq' or 'one:evq'"));
    assert!(found("length").unwrap_err().contains("choose 'one:length' or 'two:length'"));
    assert!(found("two:lenth").unwrap_err().contains("did you mean 'two:length'"));
    assert!(found("three:all").is_err() && found("one:all").is_err() && found("one:").is_err());
}

#[test]
fn folders_are_searched_but_never_the_working_one() {
    let libraries = Libraries::new();
    let (first, second) = (libraries.library("a", &[]), libraries.library("b", &[]));
    std::fs::write(libraries.0.path().join("notes.txt"), "none").unwrap();
    let list = |folders: &[&Path]| in_folders(&std::env::join_paths(folders).unwrap());
    assert_eq!(list(&[libraries.0.path()]).unwrap(), [first.clone(), second.clone()]);
    assert_eq!(list(&[Path::new(""), libraries.0.path(), Path::new("")]).unwrap(), [first, second]);
    assert!(in_folders("".as_ref()).unwrap().is_empty());
    let error = list(&[Path::new("/no/such/folder")]).unwrap_err().to_string();
    assert!(error.contains("/no/such/folder") && error.contains("LONGAN_PLUGIN_PATH"), "{error}");
}

/// The library goes with the last object that needs it, in whichever order they are dropped.
#[cfg(unix)]
#[test]
fn a_library_is_unloaded_last() {
    let libraries = Libraries::new();
    let sign = libraries.0.path().join("unloaded");
    let defined = format!("UNLOADED=\"{}\"", sign.display());
    let load = || libraries.plugin("signs", &[&defined]);

    let plugin = load();
    let measure = plugin.measures()[0].clone();
    drop(plugin);
    assert!(!sign.exists() && measure.evaluate(&window()).is_some());
    drop(measure);
    assert!(sign.exists());
    std::fs::remove_file(&sign).unwrap();

    let catalogue = Catalogue::new(vec![load()]).unwrap();
    let (one, other) = (catalogue.find("all").unwrap(), catalogue.find("plugin:length").unwrap());
    drop(one);
    drop(catalogue);
    // In another thread than it was loaded in.
    std::thread::spawn(move || assert_eq!(other.evaluate(&window()), Some(2.0))).join().unwrap();
    assert!(sign.exists());
    std::fs::remove_file(&sign).unwrap();

    // A refused one is not kept.
    let path = libraries.library("refused", &[&defined, "COUNT=0"]);
    assert!(Plugin::load(&path).is_err() && sign.exists());
}

#[test]
fn many_threads_use_and_load_it_at_the_same_time() {
    let libraries = Libraries::new();
    let path = libraries.library("shared", &[]);
    let plugin = Plugin::load(&path).unwrap();
    let expected = plugin.measures()[0].evaluate(&window()).unwrap();
    std::thread::scope(|scope| {
        for i in 0..8 {
            let (plugin, path) = (&plugin, &path);
            scope.spawn(move || {
                let windows = vec![window(); 1 + 37 * i];
                for _ in 0..200 {
                    let mut values = vec![0.0; windows.len()];
                    plugin.measures()[0].evaluate_all(&windows, &mut values).unwrap();
                    assert!(values.iter().all(|value| *value == expected));
                }
                let again = Plugin::load(path).unwrap();
                assert_eq!(again.measures()[0].evaluate(&window()), Some(expected));
            });
        }
    });
}
