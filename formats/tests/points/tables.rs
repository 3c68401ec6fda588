//! Tables in every dialect give the same map.

use longan_formats::{Ask, ErrorKind, GridDescription};

use crate::*;

/// Longitude, latitude and value as text.
fn rows() -> Vec<[String; 3]> {
    let mut next = noise(3);
    let row = |p| {
        let (lon, lat) = degrees(p);
        [format!("{lon:.4}"), format!("{lat:.4}"), format!("{:.3e}", next() * 100.0 - 50.0)]
    };
    fibonacci(200).into_iter().map(row).collect()
}

/// The rows in these columns, joined.
fn lines(order: [usize; 3], delimiter: &str, end: &str) -> String {
    rows().iter().map(|row| order.map(|i| row[i].clone()).join(delimiter) + end).collect()
}

fn plain() -> Map {
    read_with(("lon,lat,depth\n".to_owned() + &lines([0, 1, 2], ",", "\n")).as_bytes(), &Selection::default()).unwrap()
}

#[track_caller]
fn assert_plain(text: &str) {
    let map = read_with(text.as_bytes(), &Selection::default()).unwrap();
    assert_same(&map, &plain());
    assert_eq!(map.name, "depth");
}

#[test]
fn the_map_is_that_of_the_values() {
    let map = plain();
    assert_eq!(map.grid().nside(), 4);
    let expected: Vec<f64> = rows().iter().map(|row| row[2].parse().unwrap()).collect();
    let nearest = read_with(
        ("lon,lat,depth\n".to_owned() + &lines([0, 1, 2], ",", "\n")).as_bytes(),
        &nside(64, gather(Gather::Nearest)),
    )
    .unwrap();
    for (row, value) in rows().iter().zip(expected) {
        let (lon, lat): (f64, f64) = (row[0].parse().unwrap(), row[1].parse().unwrap());
        let pixel = nearest.grid().pixel_at((90.0 - lat).to_radians(), lon.to_radians());
        assert_eq!(nearest.values()[pixel], value);
    }
}

#[test]
fn delimiters_ends_of_lines_marks_and_comments() {
    for (delimiter, other) in [(",", ";"), (";", ","), ("\t", ",")] {
        for end in ["\n", "\r\n"] {
            let body = lines([0, 1, 2], delimiter, end);
            let header = ["lon", "lat", "depth"].join(delimiter) + end;
            assert_plain(&format!("{header}{body}"));
            assert_plain(&format!("\u{feff}{header}{body}"));
            assert_plain(&format!("{header}{}", body.trim_end()));
            assert_plain(&format!(
                "{end}# stations{other} lon{other}lat{end}#{end}{header}# more{end}{end}{body}{end}#{end}"
            ));
            // As numpy writes it.
            assert_plain(&format!("# stations{end}# {header}{body}"));
            let quoted = ["\"lon\"", "'lat'", "\"depth\""].join(delimiter).replace('\'', "\"") + end;
            assert_plain(&format!("{quoted}{body}"));
            let spaced = format!(" lon {delimiter}  lat {delimiter} depth {end}")
                + &lines([0, 1, 2], &format!("  {delimiter} "), end);
            assert_plain(&spaced);
            // As some programs end lines.
            assert_plain(
                &(format!("{}{delimiter}{end}", header.trim_end())
                    + &lines([0, 1, 2], delimiter, &format!("{delimiter}{end}"))),
            );
        }
    }
}

#[test]
fn names_of_columns() {
    for (lon, lat) in [
        ("LON", "Lat"),
        ("lon_deg", "lat_deg"),
        ("long", "lat"),
        ("lng", "lat"),
        ("Longitude", "Latitude"),
        ("longitude_deg", "latitude_deg"),
        ("lon [deg]", "lat [deg]"),
        ("lon (degrees)", "lat (°)"),
        ("longitude [degrees_east]", "latitude [degrees_north]"),
        ("lon deg", "lat deg"),
        ("ra", "dec"),
        ("RA_deg", "Dec (deg)"),
        ("RAJ2000", "DEJ2000"),
        ("GLON", "GLAT"),
    ] {
        assert_plain(&(format!("{lon},{lat},depth\n") + &lines([0, 1, 2], ",", "\n")));
        assert_plain(&(format!("depth,{lat},{lon}\n") + &lines([2, 1, 0], ",", "\n")));
    }
}

#[test]
fn coordinate_systems_are_those_of_the_names() {
    let system = |names: &str| {
        let text = format!("{names},v\n10,20,1\n30,40,2\n");
        read_with(text.as_bytes(), &Selection::default()).unwrap().coordinates
    };
    assert_eq!(system("lon,lat"), None);
    assert_eq!(system("ra,dec"), Some(longan_grid::CoordinateSystem::Celestial));
    assert_eq!(system("glon,glat"), Some(longan_grid::CoordinateSystem::Galactic));
    // Where there are several, the first kind counts and the others are no values.
    let both = "glon,glat,ra,dec,v\n1,2,10,20,1\n1,2,30,40,2\n";
    let map = read_with(both.as_bytes(), &Selection::default()).unwrap();
    assert_eq!((map.coordinates, map.name.as_str()), (Some(longan_grid::CoordinateSystem::Celestial), "v"));
}

#[test]
fn units_of_values() {
    let text = "lon [deg],lat [deg],sulcal depth [mm]\n0,0,1\n90,0,2\n";
    for selection in [Selection::default(), field("Sulcal Depth"), field("sulcal depth [mm]"), field("0")] {
        let map = read_with(text.as_bytes(), &selection).unwrap();
        assert_eq!((map.name.as_str(), map.unit.as_deref()), ("sulcal depth", Some("mm")));
    }
}

#[test]
fn other_columns() {
    let other = |extra: &dyn Fn(usize) -> String, header: &str| {
        let rows = rows().into_iter().enumerate().map(|(i, [lon, lat, v])| format!("{},{lon},{lat},{v}\n", extra(i)));
        format!("{header},lon,lat,depth\n") + &rows.collect::<String>()
    };
    // Text, nothing, numbers of rows as pandas writes them, and names with commas.
    assert_plain(&other(&|i| format!("Station {i}"), "name"));
    assert_plain(&other(&|_| String::new(), "remark"));
    assert_plain(&other(&|i| i.to_string(), ""));
    assert_plain(&other(&|i| format!("\"North, {i} \"\"old\"\"\""), "\"name, first\""));
    // Text that begins with an empty cell.
    assert_plain(&other(&|i| if i < 5 { String::new() } else { "x".to_owned() }, "flag"));
    // Numbers must be told apart.
    let two = other(&|i| i.to_string(), "id");
    let (error, told) = problem_with(two.as_bytes(), &Selection::default());
    assert!(is(&error, ErrorKind::Ambiguous, "several columns could be the map"), "{told}");
    assert!(told.contains("0 'id', 1 'depth'") && error.ask() == Some(&Ask::Variable), "{told}");
    for name in ["depth", "DEPTH", "1"] {
        assert_same(&read_with(two.as_bytes(), &field(name)).unwrap(), &plain());
    }
    // Coordinates can be asked for.
    let latitude = read_with(two.as_bytes(), &field("lat")).unwrap();
    assert!(largest_error(&latitude, |d| degrees(d).1) < 20.0);
}

#[test]
fn missing_values_are_left_out() {
    let all = rows();
    let kept: String = all.iter().enumerate().filter(|(i, _)| i % 3 != 0).map(|(_, r)| r.join(",") + "\n").collect();
    let expected = read_with(format!("lon,lat,depth\n{kept}").as_bytes(), &Selection::default()).unwrap();
    for missing in ["", " ", "NA", "n/a", "NaN", "nan", "null", "NULL", "inf", "-1.6375e30", "\"\""] {
        let with = |(i, r): (usize, &[String; 3])| {
            let value = if i % 3 == 0 { missing } else { &r[2] };
            format!("{},{},{value}\n", r[0], r[1])
        };
        let text: String = all.iter().enumerate().map(with).collect();
        let map = read_with(format!("lon,lat,depth\n{text},,\nNA,NA,\n").as_bytes(), &Selection::default()).unwrap();
        assert_same(&map, &expected);
    }
}

#[test]
fn positions_in_space() {
    // A sphere about anywhere, of any size, in any unit.
    let points = fibonacci(3000);
    let value = |d: [f64; 3]| d[0] + d[1] * d[2];
    let expected = read_with(table(&points, value).as_bytes(), &Selection::default()).unwrap();
    let at = |centre: [f64; 3], radius: f64, names: [&str; 3]| {
        let row = |&d: &[f64; 3]| {
            let [x, y, z] = std::array::from_fn(|i| centre[i] + radius * d[i]);
            format!("{},{z},{y},{x}\n", value(d))
        };
        format!("v,{},{},{}\n", names[2], names[1], names[0]) + &points.iter().map(row).collect::<String>()
    };
    for (centre, radius, names) in [
        ([0.0; 3], 1.0, ["x", "y", "z"]),
        ([0.0; 3], 1e-30, ["X", "Y", "Z"]),
        ([120.0, -40.0, 7.0], 50.0, ["x [mm]", "y [mm]", "z [mm]"]),
        ([1.0, 2.0, 3.0], 1e60, ["x_um", "y_um", "z_um"]),
    ] {
        let text = at(centre, radius, names);
        let given = Regrid { centre: Some(centre), ..Regrid::default() };
        // The mean of these points is not quite their centre.
        for (regrid, tolerance) in [(given, 1e-9), (Regrid::default(), 0.02)] {
            let map = read_with(text.as_bytes(), &Selection { regrid, ..Selection::default() }).unwrap();
            assert_eq!(map.grid(), expected.grid());
            for (found, expected) in map.values().iter().zip(expected.values()) {
                assert!((found - expected).abs() < tolerance, "{found} {expected}");
            }
        }
    }
    // Points without a value count for the centre.
    let half = at([5.0; 3], 1.0, ["x", "y", "z"]).replace("v,z", "w,z");
    let rows: Vec<String> = half
        .lines()
        .enumerate()
        .map(|(i, r)| {
            format!(
                "{r},{}\n",
                if i == 0 {
                    "v".into()
                } else if i < 1500 {
                    i.to_string()
                } else {
                    String::new()
                }
            )
        })
        .collect();
    let map = read_with(rows.concat().as_bytes(), &field("v")).unwrap();
    let covered = map.values().iter().filter(|v| v.is_finite()).count() as f64 / map.grid().pixels() as f64;
    assert!((0.45..0.56).contains(&covered), "{covered}");
}

#[test]
fn height_is_a_value_where_there_are_angles() {
    let text = "lon,lat,z\n0,0,1\n90,0,2\n0,90,3\n";
    assert_eq!(read_with(text.as_bytes(), &Selection::default()).unwrap().name, "z");
}

#[test]
fn descriptions_say_what_there_is() {
    let points: Vec<[f64; 3]> = fibonacci(12 * 32 * 32).into_iter().filter(|d| d[0] > 0.0).collect();
    let rows = points.iter().map(|&p| {
        let (lon, lat) = degrees(p);
        format!("{lon};;{lat};st, a;1\n")
    });
    let text = "ra;depth [mm];dec;name;flux\n".to_owned() + &rows.collect::<String>() + "10;2.5;20;;\n;;;;\n";
    let description = longan_formats::describe(&scratch(text.as_bytes()).path).unwrap();
    let [table] = &description.tables[..] else { panic!() };
    let fields: Vec<_> = table.fields.iter().map(|f| (f.name.as_str(), f.unit.as_deref())).collect();
    assert_eq!(fields, [("depth", Some("mm")), ("flux", None)]);
    let GridDescription::Points { points: count, coordinates, spacing, nside, covered } = table.grid else { panic!() };
    assert_eq!(count, points.len() + 1);
    assert_eq!((coordinates, nside), (Some(longan_grid::CoordinateSystem::Celestial), Some(32)));
    assert!((spacing.unwrap() - 1.83).abs() < 0.2, "{spacing:?}");
    assert!((0.5..0.54).contains(&covered.unwrap()), "{covered:?}");
    // One place has no distances.
    let description = longan_formats::describe(&scratch(b"lon,lat,v\n1,2,3\n").path).unwrap();
    let GridDescription::Points { points: 1, spacing: None, nside: None, covered: None, .. } =
        description.tables[0].grid
    else {
        panic!("{description:?}")
    };
    let json = serde_json::to_value(&description).unwrap();
    assert_eq!(json["tables"][0]["points"], 1);
    assert_eq!(json["tables"][0]["fields"][0]["name"], "v");
}

#[test]
fn values_are_those_of_the_file() {
    let file = scratch(b"lon,lat,v\n1,2,3\n4,5,\n7,8,-9\n");
    let mut maps = longan_formats::open(&file.path, &Selection::default()).unwrap();
    let values = maps.values(0).unwrap();
    assert!(values.len() == 3 && values[0] == 3.0 && values[1].is_nan() && values[2] == -9.0, "{values:?}");
    assert!(maps.times().is_empty());
}
