use super::*;

/// What the program prints of a picture that it writes.
#[track_caller]
fn drawn(folder: &Folder, words: &str) -> (String, Vec<u8>) {
    let name = words.split(" -o ").nth(1).unwrap().split(' ').next().unwrap().to_owned();
    let out = folder.done(&format!("plot {words} --width 300 --overwrite"));
    assert!(out.starts_with(&name) && out.lines().count() == 1, "{out}");
    (out, std::fs::read(folder.path(name)).unwrap())
}

#[track_caller]
fn svg(folder: &Folder, words: &str) -> String {
    String::from_utf8(drawn(folder, &format!("{words} -o picture.svg")).1).unwrap()
}

#[test]
fn a_picture_of_every_projection_in_both_formats() {
    let folder = Folder::with_sky();
    for projection in ["mollweide", "hammer", "orthographic", "equirectangular", "gnomonic"] {
        let (out, png) = drawn(&folder, &format!("sky.fits -o a.png --projection {projection} --centre -100,30"));
        assert!(png.starts_with(b"\x89PNG") && out.contains("WAVES of Nside 16"), "{out}");
        let svg = svg(&folder, &format!("sky.fits --projection {projection} --centre -100,30"));
        assert!(svg.starts_with("<svg ") && svg.trim_end().ends_with("</svg>") && svg.contains("data:image/png"));
    }
    // Twice the same.
    assert_eq!(drawn(&folder, "sky.fits -o a.png").1, drawn(&folder, "sky.fits -o b.PNG --threads 2").1);
}

#[test]
fn titles_and_labels_say_what_is_drawn() {
    let folder = Folder::new();
    let map = |name, unit: &str| file(12, &[column(name, &[1.0; 12])], &[("NSIDE", "1"), ("TUNIT1", unit)]);
    folder.write("t.fits", &map("TEMPERATURE", "'uK'"));
    folder.write("w.fits", &map("W1", "'kg m-2'"));
    let texts = |words: &str| {
        let svg = svg(&folder, &format!("{words} --no-graticule"));
        let text = |part: &str| part.split_once('>').map(|(_, text)| text.trim().to_owned());
        svg.split("<text").skip(1).filter_map(|part| text(part.split("</text>").next()?)).collect::<Vec<_>>()
    };
    let of = |words: &str| {
        let texts = texts(words);
        (texts[0].clone(), texts.last().unwrap().clone())
    };
    assert_eq!(of("t.fits"), ("TEMPERATURE".to_owned(), "µK".to_owned()));
    assert_eq!(of("w.fits --title 'A &lt; <b>'"), ("A &amp;lt; &lt;b&gt;".to_owned(), "W1 [kg m⁻²]".to_owned()));
    assert_eq!(of("t.fits --label 'as I like'").1, "as I like");
    assert!(!texts("t.fits --title '' --label ''").iter().any(|text| text.contains("TEMP") || text.contains('K')));
}

#[test]
fn the_coordinate_system_decides_where_east_is() {
    let folder = Folder::new();
    let map = |keys: &[(&str, &str)]| map_file(&[1.0; 12], &[&[("NSIDE", "1")], keys].concat());
    folder.write("unknown.fits", &map(&[]));
    folder.write("galactic.fits", &map(&[("COORDSYS", "'G'")]));
    folder.write("rain.csv", b"lon,lat,rain\n0,0,1\n90,10,2\n180,-20,3\n270,5,4\n0,80,2\n");
    folder.write("stars.csv", b"glon,glat,rain\n0,0,1\n90,10,2\n180,-20,3\n270,5,4\n0,80,2\n");
    folder.write("body.csv", b"x,y,z,rain\n1,0,0,1\n0,1,0,2\n-1,0,0,3\n0,-1,0,4\n0,0,1,2\n");
    folder.done("regrid galactic.fits -o galactic.nc -q");
    folder.done("regrid unknown.fits -o unknown.nc -q");
    let is_earth = |words: &str| svg(&folder, words).contains("°E");
    let has_coasts = |words: &str| svg(&folder, words).matches("<polyline").count() > 300;
    for (name, earth, coasts) in [
        ("unknown.fits", false, false),
        ("galactic.fits", false, false),
        ("galactic.nc", false, false),
        ("unknown.nc", true, true),
        ("rain.csv", true, true),
        ("stars.csv", false, false),
        ("body.csv", true, false),
    ] {
        assert_eq!((is_earth(name), has_coasts(name)), (earth, coasts), "{name}");
        assert!(is_earth(&format!("{name} --orientation earth")), "{name}");
        assert!(!is_earth(&format!("{name} --orientation sky")), "{name}");
        assert!(!has_coasts(&format!("{name} --orientation sky")), "{name}");
        assert!(has_coasts(&format!("{name} --coastlines")), "{name}");
        assert!(!has_coasts(&format!("{name} --no-coastlines")), "{name}");
    }
}

#[test]
fn columns_and_times_are_chosen() {
    let folder = Folder::with_sky();
    folder.done("map sky.fits -o maps.fits --measure evq,psi4-direction --window 20 --nside-out 4 -q");
    assert!(drawn(&folder, "maps.fits -o a.png").0.contains(": EVQ of Nside 4"));
    for option in ["--column", "--variable", "--field"] {
        assert!(drawn(&folder, &format!("maps.fits -o a.png {option} psi4_direction")).0.contains("PSI4_DIRECTION"));
        assert!(drawn(&folder, &format!("maps.fits -o a.png {option} 1")).0.contains("PSI4_DIRECTION"));
    }
    // A direction of rank 4 goes from −45° to 45°.
    let directions = svg(&folder, "maps.fits --column psi4_direction");
    assert!(["−45.0", "45.0", "degrees"].iter().all(|text| directions.contains(text)));
    folder.refused("plot maps.fits -o a2.png --column none", &["'none'", "EVQ", "PSI4_DIRECTION"]);
    folder.refused("plot maps.fits -o a2.png --rods evq", &["'EVQ' is not a column of directions", "--rods"]);

    Layout { steps: 3, ..Layout::of(30.0) }.write(&folder.path("days.nc"), |step, latitude, _| latitude + step as f64);
    let ran = folder.run("plot days.nc -o days.png --width 300");
    assert!(ran.code == Some(0) && ran.err.contains("the first of 3 times") && ran.err.contains("--select"), "{ran:?}");
    let ran = folder.run("plot days.nc -o one.png --width 300 --select time=#1");
    assert!(ran.code == Some(0) && ran.err.is_empty(), "{ran:?}");
}

#[test]
fn deviations_and_percentiles_need_no_options() {
    let folder = Folder::new();
    let values: Vec<f64> = (0..192).map(|i| f64::from(i) / 50.0 + 0.3).collect();
    let columns = [column("EVQ_SIGMA", &values), column("EVQ_LOCAL_PERCENTILE", &values)];
    folder.write("compared.fits", &file(192, &columns, &[("NSIDE", "4")]));
    let has = |svg: &str, texts: &[&str]| texts.iter().all(|text| svg.contains(&format!(">\n{text}\n")));
    let (sigma, percentile) =
        (svg(&folder, "compared.fits --no-graticule"), svg(&folder, "compared.fits --column 1 --no-graticule"));
    assert!(has(&sigma, &["−4", "−2", "0", "2", "4"]), "{sigma}");
    assert!(has(&percentile, &["0", "20", "40", "60", "80", "100"]), "{percentile}");
}

#[test]
fn maps_without_anything_to_see() {
    let folder = Folder::new();
    folder.write("masked.fits", &map_file(&[f64::NAN; 12], &[("NSIDE", "1")]));
    folder.write("constant.fits", &map_file(&[3.0; 12], &[("NSIDE", "1")]));
    folder.write("tiny.fits", &map_file(&[1e-5, 2e-5, -3e-5].repeat(4), &[("NSIDE", "1")]));
    for log in ["", "--log"] {
        let ran = folder.run(&format!("plot masked.fits -o masked{log}.svg {log}"));
        assert!(ran.code == Some(0) && ran.err.contains("every pixel is masked"), "{ran:?}");
        assert!(std::fs::read_to_string(folder.path(format!("masked{log}.svg"))).unwrap().contains("masked"));
        drawn(&folder, &format!("constant.fits -o a.png {log}"));
        drawn(&folder, &format!("tiny.fits -o a.png {log}"));
    }
    assert!(svg(&folder, "tiny.fits").contains("× 10⁻⁵"));
    folder.write("negative.fits", &map_file(&[-1.0, 0.0, -2.0].repeat(4), &[("NSIDE", "1")]));
    folder.refused("plot negative.fits -o b.png --log", &["negative.fits", "above 0"]);
    folder.refused("plot tiny.fits -o b.png --log --range 0,1", &["begins at 0e0", "above 0"]);
    folder.refused("plot constant.fits -o b.png --range 9,", &["colour range", "upwards"]);
}

#[test]
fn contours_are_of_this_map_or_of_another() {
    let folder = Folder::with_sky();
    folder.done("simulate shapes -o bodies.fits --nside 128 -q");
    let lines = |words: &str| svg(&folder, words).matches("<polyline").count();
    let none = lines("sky.fits");
    assert!(lines("sky.fits --contour-threshold 0") > none);
    // Of eight bodies each a line and its seam.
    assert!(folder.done("totals bodies.fits --thresholds 0.5").trim_end().ends_with(" 8"));
    let bodies = lines("sky.fits --contour bodies.fits --contour-threshold 0.5");
    assert_eq!(bodies, none + 16);
    // Where nothing is there, there is no line.
    assert_eq!(lines("sky.fits --contour-threshold 1e6"), none);
    folder.misused("plot sky.fits -o a.png --contour bodies.fits", &["--contour-threshold"]);
    folder.refused("plot sky.fits -o a.png --contour none.fits --contour-threshold 1", &["none.fits"]);
    folder.misused("plot sky.fits -o a.png --contour-threshold 1,x", &["--contour-threshold"]);
}

#[test]
fn arguments_that_make_no_sense() {
    let folder = Folder::with_sky();
    for (options, parts) in [
        ("--range 3,2", ["--range", "3 is not below 2"]),
        ("--range 3", ["--range", "two numbers"]),
        ("--range nan,2", ["--range", "two numbers"]),
        ("--colours jet", ["jet", "viridis"]),
        ("--centre 0,95", ["--centre", "latitude"]),
        ("--centre 5", ["--centre", "120,-30"]),
        ("--size 10", ["--size", "--projection gnomonic"]),
        ("--projection gnomonic --size 150", ["--size", "between 0.01 and 120"]),
        ("--projection gnomonic --size 0", ["--size", "between 0.01 and 120"]),
        ("--projection peters", ["peters", "mollweide"]),
        ("--width 100", ["--width", "200 to 5000"]),
        ("--circle 1,2", ["--circle", "radius"]),
        ("--circle 1,2,200", ["--circle", "below 180"]),
        ("--mark here", ["--mark", "NAME"]),
        ("--contour-variable x", ["--contour-variable", "--contour"]),
    ] {
        folder.misused(&format!("plot sky.fits -o a.png {options}"), &parts);
    }
    folder.refused("plot sky.fits -o a.pdf", &["a.pdf", ".png or .svg"]);
    folder.refused("plot sky.fits -o a", &[".png or .svg"]);
    folder.refused("plot none.fits -o a.png", &["none.fits"]);
    folder.refused("plot sky.fits -o none/a.png", &["none/a.png"]);
    folder.done("plot sky.fits -o a.png -q");
    folder.refused("plot sky.fits -o a.png", &["a.png", "--overwrite"]);
    folder.done("plot sky.fits -o a.png -q --overwrite");
    // Maps may have any name, and no picture takes their place.
    std::fs::copy(folder.path("sky.fits"), folder.path("map.png")).unwrap();
    for inputs in ["map.png", "sky.fits --mask map.png", "sky.fits --contour map.png --contour-threshold 1"] {
        let words = format!("plot {inputs} -o map.png --overwrite");
        folder.refused(&words, &["map.png: the output would replace this input"]);
    }
}
