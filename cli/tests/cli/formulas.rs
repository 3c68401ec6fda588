use super::*;

#[test]
fn a_formula_is_what_its_parts_are() {
    let folder = Folder::with_sky();
    folder.write("mask.fits", &map_file(&[&[1.0; 2304][..], &[0.0; 768]].concat(), &[]));
    let formulas = "--measure 'beta = (w1 - psi2)/(w1 + psi2), x-2 = max(w0, psi3.re^2)' --measure='Phase=psi2.im'";
    let parts = "--measure w1,psi2,w0,psi3,psi3-direction,psi2-direction";
    for options in ["", "--mask mask.fits", "--weight curvature", "--window 0"] {
        folder.done(&format!("map sky.fits -o out.fits --overwrite --exact {options} {formulas} {parts}"));
        let column = |name: &str| folder.read("out.fits", name).values().to_vec();
        let [beta, x, phase] = ["BETA", "X_2", "PHASE"].map(column);
        let [w1, psi2, w0, psi3] = ["W1", "PSI2", "W0", "PSI3"].map(column);
        let [angle2, angle3] = ["PSI2_DIRECTION", "PSI3_DIRECTION"].map(column);
        let mut defined = 0;
        for p in 0..beta.len() {
            let quotient = (w1[p] - psi2[p]) / (w1[p] + psi2[p]);
            let quotient = if quotient.is_finite() { quotient } else { f64::NAN };
            assert!(difference(&[beta[p]], &[quotient]) == 0.0, "{options}: {} {quotient}", beta[p]);
            if angle2[p].is_nan() || angle3[p].is_nan() {
                continue;
            }
            defined += 1;
            let im = psi2[p] * (2.0 * angle2[p]).to_radians().sin();
            let re = psi3[p] * (3.0 * angle3[p]).to_radians().cos();
            assert!((phase[p] - im).abs() < 1e-12 && (x[p] - w0[p].max(re * re)).abs() < 1e-12, "{options}: {p}");
        }
        assert!(defined > 500, "{options}: {defined}");
    }
}

#[test]
fn the_header_keeps_formulas() {
    let folder = Folder::with_sky();
    let many: Vec<String> = (1..=11).map(|i| format!("f{i} = {i}*w1")).collect();
    folder.done(&format!(
        "map sky.fits -o out.fits --measure 'evq, b  =  hypot(w0,\tw1)' --measure '{}'",
        many.join(",")
    ));
    let header = &folder.headers("out.fits")[0];
    assert_eq!([&header["TTYPE2"], &header["FORMULA1"]], ["B", "b  =  hypot(w0, w1)"]);
    assert_eq!(
        [&header["FORMULA9"], &header["FORMUL10"], &header["FORMUL12"]],
        ["f8 = 8*w1", "f9 = 9*w1", "f11 = 11*w1"]
    );
    assert!(!header.contains_key("TUNIT2") && !header.contains_key("FORMUL13"));
    folder.done("map sky.fits -o plain.fits");
    assert!(!folder.headers("plain.fits")[0].contains_key("FORMULA1"));
    // Long ones too.
    let long = format!("long = {}w1", "1*".repeat(200));
    folder.done(&format!("map sky.fits -o long.fits --measure '{long}'"));
    assert_eq!(folder.headers("long.fits")[0]["FORMULA1"], long);
}

#[test]
fn formulas_work_in_runs_of_all_sorts() {
    let folder = Folder::with_sky();
    std::fs::copy(folder.path("sky.fits"), folder.path("other.fits")).unwrap();
    let options = "--measure 'd = w1*2' --thresholds -1,0.5 --exact";
    folder.done(&format!("map sky.fits other.fits -o maps {options} --sequence --threads 3"));
    for (i, threshold) in [(1, "-1"), (2, "0.5")] {
        folder.done(&format!("map sky.fits -o one.fits --overwrite --exact --measure w1 --thresholds={threshold}"));
        let twice: Vec<f64> = folder.read("one.fits", "W1").values().iter().map(|v| 2.0 * v).collect();
        for name in ["maps/sky.fits", "maps/other.fits"] {
            assert_eq!(difference(folder.read_hdu(name, "D", Some(i)).values(), &twice), 0.0);
        }
    }
}

#[test]
fn a_formula_in_several_windows_is_that_of_each_alone() {
    let folder = Folder::with_sky();
    let formula = "beta = (w1 - psi2)/(w1 + psi2)";
    let map = |output: &str, window: &str| format!("map sky.fits -o {output} --measure '{formula}' --window {window}");
    folder.done(&map("both.fits", "4,6"));
    folder.done(&map("both.nc", "4,6"));
    let headers = folder.headers("both.fits");
    assert_eq!(headers.len(), 2);
    let cube = netcdf::open(folder.path("both.nc")).unwrap();
    let text = |value: netcdf::AttributeValue| String::try_from(value).unwrap();
    assert_eq!(text(cube.attribute("formula1").unwrap().value().unwrap()), formula);
    for (hdu, window) in [(1, "4"), (2, "6")] {
        let header = &headers[hdu - 1];
        assert_eq!([&*header["EXTNAME"], &*header["FORMULA1"]], [&*format!("WINDOW {window}"), formula]);
        folder.done(&map(&format!("alone{window}.fits"), window));
        let alone = folder.read(format!("alone{window}.fits"), "BETA");
        assert!(alone.values().iter().any(|v| !v.is_nan()));
        assert_same(&folder.read_hdu("both.fits", "BETA", Some(hdu)), &alone);
        let variable = format!("BETA_WINDOW_{window}");
        assert_same(&folder.read("both.nc", &variable), &alone);
        let long_name = cube.variable(&variable).unwrap().attribute_value("long_name").unwrap().unwrap();
        assert_eq!(text(long_name), formula);
    }
    folder.refused(&map("none.fits", "4,4"), &["sky.fits: the window of 4 degrees is asked for twice"]);
}

#[test]
fn wrong_formulas_are_marked_at_their_place() {
    let folder = Folder::with_sky();
    for (formula, parts) in [
        (
            "beta = (w1 - psy2)/w1",
            &["no measure or moment 'psy2'", "did you mean 'psi2'", "character 14", "\n             ^^^^\n"][..],
        ),
        ("b = rank4-mid", &["'rank4_mid'", "character 5", "\n    ^^^^^^^^^\n"]),
        ("b = sqr(2)", &["no function 'sqr'", "'sqrt'"]),
        ("b = (w1, evq", &["','", "character 8"]),
        ("b = (w1", &["no ')' for the '('", "character 5"]),
        ("b = w1 +", &["character 9"]),
        ("= 2", &["a name is missing"]),
        ("evq = 2", &["'evq' is a measure already"]),
        ("w1 + w2", &["a formula needs a name", "x = w1 + w2"]),
        ("a = 1, A = 2", &["'A' has the column of 'a'"]),
        ("a-b = 1, a_b = 2", &["'a_b' has the column of 'a-b'"]),
        ("a = 1, a = 1", &["'a' is given twice"]),
    ] {
        folder.misused(&format!("map sky.fits -o out.fits --measure '{formula}'"), &[parts, &["--measure"]].concat());
    }
    let help = folder.done("measures --help");
    assert!(["psi2_direction", "psiN.re", "atan2", "undefined"].iter().all(|part| help.contains(part)), "{help}");
}
