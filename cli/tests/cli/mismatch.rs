use super::*;

/// A wave of Nside 8 about 0 with a standard deviation of some `scale`, different for each `phase`.
fn wave(scale: f64, phase: f64) -> Vec<f64> {
    let grid = longan::Healpix::new(8).unwrap();
    let value = |pixel| {
        let (theta, phi) = grid.centre(pixel);
        scale * ((3.0 * phi + phase).sin() * theta.sin().powi(3) + (5.0 * theta + 2.0 * phase).cos())
    };
    (0..grid.pixels()).map(value).collect()
}

/// Files of Nside 8: skies in galactic and ecliptic coordinates and in none, and masks of half the sphere.
fn with_systems() -> Folder {
    let folder = Folder::new();
    for (name, system) in [("g", Some("'G'")), ("e", Some("'E'")), ("c", Some("'CEL'")), ("none", None)] {
        let keys: Vec<(&str, &str)> = system.map(|system| ("COORDSYS", system)).into_iter().collect();
        let half: Vec<f64> = (0..768).map(|pixel| f64::from(pixel < 384)).collect();
        folder.write(&format!("{name}.fits"), &map_file(&wave(1.0, name.len() as f64), &keys));
        folder.write(&format!("mask_{name}.fits"), &map_file(&half, &keys));
    }
    folder
}

/// Runs with exactly one warning, which has all of `parts`; what was printed.
#[track_caller]
fn warned(folder: &Folder, words: &str, parts: &[&str]) -> String {
    let ran = folder.run(words);
    assert_eq!(ran.code, Some(0), "longan {words}: {ran:?}");
    assert!(ran.err.starts_with("warning: ") && ran.err.lines().count() == 1, "longan {words}: {}", ran.err);
    for part in parts {
        assert!(ran.err.contains(part), "longan {words}: no '{part}' in '{}'", ran.err);
    }
    ran.out
}

#[test]
fn map_and_mask_in_different_coordinates_are_refused() {
    let folder = with_systems();
    let parts = ["g.fits", "galactic", "mask_e.fits", "ecliptic", "--ignore-coordsys"];
    for words in [
        "map g.fits -o out.fits",
        "totals g.fits",
        "graph g.fits -o out.csv",
        "regrid g.fits -o out.fits",
        "plot g.fits -o out.png",
    ] {
        folder.refused(&format!("{words} --mask mask_e.fits"), &parts);
    }
    folder.refused("totals c.fits --mask mask_g.fits", &["celestial", "galactic"]);
    // What says nothing mismatches nothing, and one may insist.
    let expected = folder.done("totals g.fits --mask mask_g.fits");
    for options in ["--mask mask_none.fits", "--mask mask_e.fits --ignore-coordsys"] {
        assert_eq!(folder.done(&format!("totals g.fits {options}")), expected);
    }
    folder.done("totals none.fits --mask mask_e.fits");
    folder.done("plot g.fits -o out.png --contour none.fits --contour-threshold 0");
    folder.refused(
        "plot g.fits -o other.png --contour e.fits --contour-threshold 0",
        &["g.fits: ", "e.fits", "galactic", "ecliptic", "--ignore-coordsys"],
    );
    // Of many maps those that match are done, and none anew when the others are insisted on.
    let words = "map none.fits g.fits -o maps/ --mask mask_e.fits";
    let ran = folder.run(words);
    assert!(ran.code == Some(1) && ran.err.contains("1 of 2 inputs failed"), "{ran:?}");
    let printed = folder.done(&format!("{words} --resume --ignore-coordsys"));
    assert!(printed.starts_with("1 of 2 outputs exist"), "{printed}");
}

#[test]
fn inputs_in_different_coordinates_are_refused() {
    let folder = with_systems();
    let parts = ["g.fits is in galactic", "e.fits is in ecliptic", "--ignore-coordsys"];
    folder.refused("graph g.fits none.fits e.fits -o out.csv", &parts);
    folder.refused("graph g.fits -o out.csv --ensemble none.fits e.fits", &parts);
    folder.run("graph g.fits -o out.csv --ensemble none.fits e.fits --ignore-coordsys --quiet");
    folder.done("map g.fits none.fits e.fits -o maps/ --window 20 --nside-out 4");
    let compare = "compare maps/g.fits maps/none.fits maps/e.fits -o out.fits";
    folder.refused(compare, &parts);
    folder.done(&format!("{compare} --ignore-coordsys"));
    let work = "compare g.fits none.fits e.fits -o work.fits --work work --window 20 --nside-out 4";
    folder.refused(work, &parts);
    folder.done(&format!("{work} --ignore-coordsys"));
    assert_same(&folder.read("work.fits", "EVQ_SIGMA"), &folder.read("out.fits", "EVQ_SIGMA"));
}

#[test]
fn thresholds_in_the_unit_of_another_map_are_refused() {
    let folder = Folder::new();
    let units = [("micro", "'uK'", 100.0), ("mu", "'muK'", 90.0), ("cmb", "'K_CMB'", 1e-4), ("kelvin", "'K'", 1e-4)];
    for (name, unit, scale) in units {
        folder.write(&format!("{name}.fits"), &map_file(&wave(scale, scale), &[("TUNIT1", unit)]));
    }
    folder.write("none.fits", &map_file(&wave(80.0, 2.0), &[]));
    let parts = ["uK in micro.fits", "K_CMB in cmb.fits", "--threshold-unit sigma"];
    let options = "--thresholds -100:100:5";
    folder.refused(&format!("graph micro.fits mu.fits cmb.fits -o out.csv {options}"), &parts);
    folder.refused(&format!("graph micro.fits -o out.csv --ensemble mu.fits cmb.fits {options}"), &parts);
    folder.refused(&format!("map micro.fits mu.fits cmb.fits -o maps/ {options}"), &parts);
    folder.refused(&format!("compare micro.fits mu.fits cmb.fits -o out.fits --work work {options}"), &parts);
    // Spellings of one unit, no unit, and standard deviations.
    folder.done(&format!("map micro.fits mu.fits none.fits -o maps/ {options}"));
    folder.done("graph cmb.fits kelvin.fits -o kelvin.csv --thresholds -1e-4:1e-4:5");
    folder.done("graph micro.fits cmb.fits -o sigma.csv");
    // Minkowski maps say in which unit their thresholds are.
    folder.done("map cmb.fits -o cmb_map.fits --thresholds -1e-4,0,1e-4");
    folder.run("map cmb.fits -o cmb_map.fits --overwrite --thresholds -100:100:5 --quiet");
    folder.refused(
        "compare maps/micro.fits maps/mu.fits cmb_map.fits -o out.fits",
        &["maps/micro.fits has thresholds in the unit uK", "cmb_map.fits has thresholds in the unit K_CMB"],
    );
    folder.done("compare maps/micro.fits maps/mu.fits maps/none.fits -o out.fits");
}

#[test]
fn stokes_parameters_are_warned_of() {
    let folder = Folder::new();
    let columns = [
        column("TEMPERATURE", &wave(1.0, 0.0)),
        column("Q_POLARISATION", &wave(1.0, 1.0)),
        column("STOKES U", &wave(1.0, 2.0)),
    ];
    folder.write("tqu.fits", &file(768, &columns, &[]));
    let parts = ["tqu.fits", "Stokes parameter", "coordinate system", "E and B"];
    warned(&folder, "map tqu.fits -o q.fits --field Q_POLARISATION", &parts);
    warned(&folder, "totals tqu.fits --field 2", &parts);
    warned(&folder, "graph tqu.fits -o q.csv --field q-polarisation", &parts);
    folder.done("map tqu.fits -o t.fits --field TEMPERATURE");
    assert_eq!(folder.run("totals tqu.fits --field 2 --quiet").err, "");
    // Wind is no Stokes parameter.
    Layout::of(15.0).write(&folder.path("wind.nc"), |_, latitude, longitude| latitude + (longitude / 57.0).sin());
    folder.done("regrid wind.nc -o u.fits");
    folder.done("totals wind.nc");
}

#[test]
fn thresholds_that_are_hardly_meant_are_warned_of() {
    let folder = Folder::new();
    folder.write("sky.fits", &map_file(&wave(100.0, 0.0), &[("TUNIT1", "'uK'")]));
    folder.write("other.fits", &map_file(&wave(100.0, 1.0), &[("TUNIT1", "'uK'")]));
    let narrow = ["sky.fits: the thresholds -3 to 3", "uK", "standard deviations (sigma ", "--threshold-unit sigma"];
    warned(&folder, "map sky.fits -o out.fits --thresholds -3:3:13", &narrow);
    warned(&folder, "totals sky.fits --thresholds -3:3:13", &narrow);
    warned(&folder, "graph sky.fits -o out.csv --thresholds -3:3:13", &narrow);
    let missed = ["sky.fits: ", "no contour", "values from -", "--threshold-unit sigma"];
    warned(&folder, "map sky.fits -o missed.fits --thresholds 300:900:3", &missed);
    warned(&folder, "totals sky.fits --thresholds=-900", &missed);
    warned(&folder, "totals sky.fits --thresholds 20,30 --threshold-unit sigma", &["no contour", "within that range"]);
    // Once in a run.
    warned(&folder, "map sky.fits other.fits -o maps/ --jobs 1 --thresholds -3:3:13", &["sky.fits", "first such map"]);
    for meant in ["-300:300:13", "0", "-3:3:13 --threshold-unit sigma", "0,0.1 --threshold-unit sigma"] {
        folder.done(&format!("totals sky.fits --thresholds {meant}"));
    }
}

#[test]
fn masks_of_another_nside_are_brought_to_the_map() {
    let folder = Folder::new();
    folder.write("sky.fits", &map_file(&wave(1.0, 0.0), &[]));
    let coarse: Vec<f64> = (0..12).map(|pixel| f64::from(pixel % 2)).collect();
    let fine = longan::Healpix::new(16).unwrap();
    // A band askew; of what lies outside a third is missing, not 0.
    let value = |pixel: usize| {
        let (theta, phi) = fine.centre(pixel);
        match (theta.cos() + 0.7 * theta.sin() * phi.cos()).abs() < 0.5 {
            true => 1.0,
            false if pixel.is_multiple_of(3) => longan_grid::UNSEEN,
            false => 0.0,
        }
    };
    folder.write("coarse.fits", &map_file(&coarse, &[("NSIDE", "1")]));
    folder.write("fine.fits", &map_file(&(0..3072).map(value).collect::<Vec<_>>(), &[]));
    for (mask, nside) in [("coarse", 1), ("fine", 16)] {
        let read = |name: &str| folder.read(name, "T");
        let expected = read(&format!("{mask}.fits")).as_mask_on(longan::Healpix::new(8).unwrap()).unwrap();
        let says = format!("{mask}.fits: the mask has Nside {nside} and the map Nside 8");
        let words = format!("regrid sky.fits -o {mask}_out.fits --mask {mask}.fits");
        let printed = warned(&folder, &words, &[&says, if nside < 8 { "value at its centre" } else { "mean" }]);
        let masked = read(&format!("{mask}_out.fits"));
        for (pixel, value) in masked.values().iter().enumerate() {
            assert_eq!(value.is_nan(), expected.values()[pixel].is_nan() || expected.values()[pixel] < 0.9, "{pixel}");
        }
        assert!(printed.contains("pixels masked"), "{printed}");
        warned(&folder, &format!("totals sky.fits --mask {mask}.fits"), &[&says]);
    }
    // At the mask's edge the share counts.
    let count = |threshold: &str| {
        let words =
            format!("regrid sky.fits -o count.fits --overwrite --mask fine.fits --mask-threshold {threshold} --quiet");
        folder.done(&words);
        folder.read("count.fits", "T").values().iter().filter(|value| value.is_nan()).count()
    };
    assert!(count("0.01") < count("0.5") && count("0.5") < count("1"));
}

/// A folder with `data` and `sims/1` to `sims/3` of Nside 8, in which a mask of the northern cap is known as `mask.fits`.
fn with_skies() -> Folder {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("sims")).unwrap();
    folder.write("data.fits", &map_file(&wave(1.0, 0.0), &[("TUNIT1", "'uK'"), ("COORDSYS", "'G'")]));
    for i in 1..=3 {
        let sky = map_file(&wave(1.0, f64::from(i)), &[("TUNIT1", "'uK'"), ("COORDSYS", "'G'")]);
        folder.write(&format!("sims/{i}.fits"), &sky);
    }
    let cap: Vec<f64> = (0..768).map(|pixel| f64::from(pixel >= 200)).collect();
    folder.write("mask.fits", &map_file(&cap, &[]));
    folder
}

const SIMS: &str = "sims/1.fits sims/2.fits sims/3.fits";

#[test]
fn several_windows_and_thresholds_of_a_file_are_compared() {
    let folder = with_skies();
    let options = "--window 20,35.5 --thresholds -0.5,0.5 --sequence --measure evq,w1 --nside-out 4 --mask mask.fits";
    folder.done(&format!("map data.fits {SIMS} -o maps/ {options} --max-masked 0.1 --mask-threshold 0.8"));
    folder.done(&format!("map data.fits -o data.nc {options} --max-masked 0.1 --mask-threshold 0.8"));
    let sims = "maps/1.fits maps/2.fits maps/3.fits";
    folder.done(&format!("compare maps/data.fits {sims} -o out.fits"));
    let names: Vec<String> = formats::describe(&folder.path("out.fits")).unwrap().tables[0]
        .fields
        .iter()
        .map(|field| field.name.clone())
        .filter(|name| name.ends_with("_SIGMA"))
        .collect();
    let blocks = [("20", 1), ("20", 2), ("35_5", 1), ("35_5", 2)];
    let expected = blocks.iter().flat_map(|(window, threshold)| {
        ["EVQ", "W1"].map(|measure| format!("{measure}_WINDOW_{window}_THRESHOLD_{threshold}_SIGMA"))
    });
    assert_eq!(names, expected.collect::<Vec<_>>());
    // Each is what --hdu gives by itself, and the same from NetCDF.
    folder.done(&format!("compare data.nc {sims} -o netcdf.fits"));
    for (hdu, (window, threshold)) in (1..).zip(blocks) {
        let out = format!("hdu{hdu}.fits");
        folder.done(&format!("compare maps/data.fits {sims} -o {out} --hdu {hdu}"));
        for measure in ["EVQ", "W1"] {
            let alone = folder.read(&out, &format!("{measure}_SIGMA"));
            let block = format!("{measure}_WINDOW_{window}_THRESHOLD_{threshold}_SIGMA");
            assert_same(&folder.read("out.fits", &block), &alone);
            assert_same(&folder.read("netcdf.fits", &block), &alone);
        }
    }
    // The header says of what it is.
    for file in ["out.fits", "netcdf.fits"] {
        let header = &folder.headers(file)[0];
        for (key, value) in [
            ("MASKFILE", "mask.fits"),
            ("MASKTHR", "0.8"),
            ("MAXMASK", "0.1"),
            ("WINDOW", "20, 35.5"),
            ("THRUNIT", "value"),
            ("NTHRESH", "2"),
            ("THR1", "-0.5"),
            ("THR2", "0.5"),
        ] {
            assert_eq!(header[key], value, "{file} {key}");
        }
    }
    // One measure in all its blocks, one block, and two for a plot.
    folder.done(&format!("compare maps/data.fits {sims} -o evq.fits --measure evq"));
    assert_eq!(folder.headers("evq.fits")[0]["MEASURE4"], "EVQ_WINDOW_35_5_THRESHOLD_2");
    folder.done(&format!("compare maps/data.fits {sims} -o one.fits --measure w1-window-20-threshold-2"));
    assert_eq!(folder.headers("one.fits")[0]["TFIELDS"], "6");
    let scatter = format!("compare maps/data.fits {sims} -o plot.fits --scatter 0,-60");
    folder.refused(&format!("{scatter} evq,w1"), &["'evq' could be any of EVQ_WINDOW_20_THRESHOLD_1", "name one"]);
    folder.done(&format!("{scatter} evq_window_20_threshold_1,W1-window-20-threshold-1"));
    // On the way it is the same.
    folder.done(&format!(
        "compare data.fits {SIMS} -o work.fits --work work {options} --max-masked 0.1 --mask-threshold 0.8"
    ));
    for name in names {
        assert_same(&folder.read("work.fits", &name), &folder.read("out.fits", &name));
    }
    // Blocks are compared with their own.
    let others = options.replace("-0.5,0.5", "-0.5,0.75");
    folder.done(&format!("map data.fits -o other.fits {others} --max-masked 0.1 --mask-threshold 0.8"));
    folder.refused(
        &format!("compare other.fits {sims} -o no.fits"),
        &["other.fits has thresholds 0.75 uK", "maps/1.fits has thresholds 0.5 uK"],
    );
}

#[test]
fn other_masks_are_warned_of() {
    let folder = with_skies();
    folder.done(&format!("map data.fits {SIMS} -o maps/ --window 20 --nside-out 4 --mask mask.fits"));
    for (options, parts) in [
        ("--mask data.fits --mask-threshold 0", &["the mask mask.fits", "the mask data.fits", "threshold 0.9"][..]),
        ("--mask mask.fits --max-masked 0.5", &["masked share 0.0625", "masked share 0.5"]),
        ("", &["the mask mask.fits", "the mask none"]),
    ] {
        folder.done(&format!("map data.fits -o other.fits --overwrite --window 20 --nside-out 4 {options}"));
        warned(&folder, "compare other.fits maps/1.fits maps/2.fits -o out.fits --overwrite", parts);
    }
    folder.done("map data.fits -o other.fits --overwrite --window 20 --nside-out 4 --mask ./mask.fits");
    folder.done("compare other.fits maps/1.fits maps/2.fits -o out.fits --overwrite");
}

#[test]
fn a_scatter_plot_of_a_masked_place_is_refused() {
    let folder = with_skies();
    let options = "--window 20 --nside-out 4 --measure evq,w1";
    folder.done(&format!("map data.fits -o data_map.fits {options} --mask mask.fits"));
    folder.done(&format!("map {SIMS} -o maps/ {options} --mask mask.fits"));
    let sims = "maps/1.fits maps/2.fits maps/3.fits";
    let parts = ["EVQ is masked or undefined at 10,80 (pixel ", "of Nside 4", "--scatter"];
    folder.refused(&format!("compare data_map.fits {sims} -o out.fits --scatter 10,80 evq,w1"), &parts);
    folder.done(&format!("compare data_map.fits {sims} -o out.fits --scatter 10,-60 evq,w1"));
    // Nor where all simulations are.
    folder.done(&format!("map data.fits -o whole.fits {options}"));
    let ran = folder.run(&format!("compare whole.fits {sims} -o no.fits --scatter 10,80 evq,w1"));
    assert!(ran.code == Some(1) && ran.err.contains("every simulation is masked or undefined at 10,80"), "{ran:?}");
    // Before the simulations are measured.
    let work = format!("compare data.fits {SIMS} -o no.fits --work work {options} --mask mask.fits");
    std::fs::create_dir(folder.path("work")).unwrap();
    folder.refused(&format!("{work} --scatter 10,80 evq,w1"), &parts);
    assert!(folder.path("work/data.fits").exists() && !folder.path("work/1.fits").exists());
    folder.done(&format!("{work} --scatter 10,-60 evq,w1"));
}

#[test]
fn maps_of_several_times_are_refused_with_a_remedy() {
    let folder = Folder::new();
    Layout { steps: 3, ..Layout::of(15.0) }.write(&folder.path("series.nc"), |step, latitude, longitude| {
        (latitude / 20.0 + step as f64).sin() + (longitude / 30.0).cos()
    });
    for end in ["fits", "nc"] {
        let names = ["maps", "one", "two"].map(|name| format!("{name}.{end}"));
        folder.done(&format!("map series.nc -o {} --window 30 --nside-out 2", names[0]));
        for copy in &names[1..] {
            std::fs::copy(folder.path(&names[0]), folder.path(copy)).unwrap();
        }
        let words = format!("compare {} -o out.fits", names.join(" "));
        folder.refused(&words, &[&format!("maps.{end}: there are maps for 3 "), "--select time="]);
    }
    folder.refused("compare maps.fits one.fits two.fits -o out.fits", &["--hdu (1 to 3)"]);
    folder.done("compare maps.fits one.fits two.fits -o out.fits --hdu 2");
    assert!(folder.path("out.fits").exists());
}

#[test]
fn names_are_found_whatever_their_case_and_hyphens() {
    let folder = Folder::new();
    let columns =
        [column("T_MAP", &wave(1.0, 0.0)), column("Deep-Map", &wave(2.0, 0.0)), column("deep_MAP", &wave(3.0, 0.0))];
    folder.write("sky.fits", &file(768, &columns, &[]));
    folder
        .done("map sky.fits -o out.fits --field t-map --measure EVQ,Psi2-Direction,RANK4_mid,Longan:W1 --nside-out 4");
    let expected = folder.read("out.fits", "PSI2_DIRECTION");
    for name in ["psi2-direction", "Psi2_Direction", "PSI2-DIRECTION"] {
        assert_same(&folder.read("out.fits", name), &expected);
    }
    folder.misused("map sky.fits -o no.fits --measure evq,EVQ", &["'evq' is given twice"]);
    folder.done("graph sky.fits -o out.csv --field T_map --measure W1,Euler,EVQ");
    folder.done("plot out.fits -o out.png --column evq --rods psi2-direction");
    assert!(folder.done("info out.fits --variable rank4-mid").contains("RANK4_MID"));
    // The same name is meant, and of those alike none.
    assert!(
        folder.done("totals sky.fits --field Deep-Map --format csv")
            != folder.done("totals sky.fits --field deep_MAP --format csv")
    );
    folder.refused("totals sky.fits --field deep-map", &["'deep-map'", "1 'Deep-Map', 2 'deep_MAP'", "by its number"]);
    folder.done("regrid sky.fits -o sky.nc --field T_MAP");
    folder.done("totals sky.nc --variable t-map");
    folder.write("points.csv", b"lon,lat,Rain_Rate [mm]\n0,0,1\n90,0,2\n180,0,3\n270,0,1\n0,90,2\n0,-90,4\n");
    folder.done("totals points.csv --variable rain-rate --nside 2 --reach 180 --gather nearest --thresholds 2");
}
