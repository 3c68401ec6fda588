//! Files broken on purpose: each gives the one sentence that says what is wrong, and where.

use longan_formats::{Ask, ErrorKind, describe};

use crate::surfaces::sphere;
use crate::*;

#[test]
fn tables_with_wrong_rows() {
    for (text, expected) in [
        ("lon,lat,v\n1,2,3\n4,5,abc\n", "line 3 has 'abc' as 'v', which is not a number such as -1.5"),
        ("lon,lat,v\n1,2,3\nx,5,6\n", "line 3 has 'x' as 'lon', which is not a number"),
        ("lon,lat,v\r\n1,2,3\r\n\r\n# 9\r\n\"4,5\" ,5,6\r\n", "line 5 has '4,5' as 'lon'"),
        ("# a\n\n#b\nlon;lat;v\n#c\n1;2;3\n\n\n10,5;5;6\n", "line 9 has '10,5' as 'lon'"),
        ("lon,lat,v,w\n1,2,3,\"a\nb\"\n1,2,?,b\n", "line 4 has '?' as 'v'"),
        ("# lon,lat,v\n1,2,3\n,2,3\n", "line 3 has '' as 'lon'"),
        ("lon,lat,v\n1,2,3\n1,nan,3\n", "line 3 has 'nan' as 'lat'"),
        ("lon,lat,v\n1,90.5,3\n", "line 2 has '90.5' as 'lat', which is not between -90 and 90 degrees"),
        ("lon,lat,v\n1,-inf,3\n", "line 2 has '-inf' as 'lat', which is not between -90 and 90 degrees"),
        ("lat,lon,v\n1,361,3\n", "line 2 has '361' as 'lon', which is not between -360 and 360 degrees"),
        ("lon,lat,v\n500000,4649776,3\n", "line 2 has '500000' as 'lon', which is not between -360 and 360 degrees"),
        ("lon,lat,v\n1,2,3\n1,2\n", "line 3 has 2 values but there are 3 columns"),
        ("lon,lat,v\n1,2,3\n1,2,3,4\n", "line 3 has 4 values but there are 3 columns"),
        ("lon,lat,v\n1,2,3\n1 2 3\n", "line 3 has 1 values but there are 3 columns"),
        ("x,y,z,v\n1,2,3,4\n1,inf,3,4\n", "line 3 has 'inf' as 'y', which is not a number from -1e100 to 1e100"),
        ("x,y,z,v\n1,0,0,4\n0,1,0,\n-1,-1,0,1\n\n0,0,0,2\n", "line 6 lies at the centre"),
        ("lon,lat,v\n1,2,\n3,4,NA\n", "besides 'lon', 'lat', 'v'"),
        ("lon,lat\n1,2\n", "there is no column of numbers besides 'lon', 'lat'; name the column of values"),
        ("lon,lat,v\n", "there is no column of numbers besides 'lon', 'lat', 'v'"),
        ("lon [rad],lat [rad],v\n0,0,1\n", "the angles in column 'lon [rad]' are in radians; convert them to degrees"),
        ("lon,lat_rad,v\n0,0,1\n", "the angles in column 'lat_rad' are in radians"),
        ("lon,longitude,lat,v\n0,0,0,1\n", "columns 'lon' and 'longitude' could both be the longitude; rename one"),
        ("x,y,z,X,v\n0,0,0,1,1\n", "columns 'x' and 'X' could both be the x"),
        ("lon,lat,a,b\n1,2,3,4\n", "several columns could be the map: 0 'a', 1 'b'; choose one"),
        ("lon,lat,v,v\n1,2,3,4\n", "several columns could be the map: 0 'v', 1 'v'; choose one"),
    ] {
        let (_, told) = problem_with(text.as_bytes(), &Selection::default());
        assert!(told.contains(expected), "{text:?}: {told}");
    }
}

#[test]
fn selections_that_are_not_there() {
    let text = b"lon,lat,a,name\n1,2,3,x\n4,5,6,y\n";
    let (error, told) = problem_with(text, &field("height"));
    assert!(is(&error, ErrorKind::Unknown, "there is no column"), "{told}");
    assert_eq!(told, "there is no column 'height'; the columns of values are 0 'a'");
    assert!(is(&problem_with(text, &field("1")).0, ErrorKind::Unknown, "there is no column"));
    assert!(problem_with(text, &field("name")).1.contains("line 2 has 'x' as 'name'"));
    let at = vec![longan_formats::At { dimension: "time".to_owned(), place: longan_formats::Place::Index(0) }];
    let selection = Selection { at, ..Selection::default() };
    for bytes in [text.to_vec(), sphere(1).ply()] {
        let (error, told) = problem_with(&bytes, &selection);
        assert!(
            is(&error, ErrorKind::NotApplicable, "the points have no dimension") && told.contains("'time'"),
            "{told}"
        );
        let hdu = Selection { hdu: Some(1), ..Selection::default() };
        assert!(is(&problem_with(&bytes, &hdu).0, ErrorKind::NotApplicable, "there is no HDU 1"));
    }
    assert!(is(
        &problem_with(b"lon,lat,v,w\n1,2,,1\n", &field("v")).0,
        ErrorKind::NoValues,
        "has no value at any point"
    ));
}

#[test]
fn centres_that_cannot_be() {
    for bad in [f64::NAN, f64::INFINITY, -1e300] {
        let regrid = Regrid { centre: Some([0.0, bad, 0.0]), ..Regrid::default() };
        for bytes in [b"x,y,z,v\n1,0,0,1\n0,1,0,2\n".to_vec(), sphere(1).ply()] {
            let error = problem_with(&bytes, &nside(4, regrid.clone())).0;
            assert!(matches!(grid(&error), longan_grid::Error::Setting { .. }));
            assert_eq!(error.kind(), ErrorKind::OutOfRange);
        }
    }
    let vertex = Regrid { centre: Some([0.0, 1.0, 0.0]), ..Regrid::default() };
    let (error, told) = problem_with(&sphere(1).ply(), &nside(4, vertex));
    assert!(
        matches!(grid(&error), longan_grid::Error::AtCentre { .. })
            && error.ask() == Some(&Ask::Centre)
            && told.starts_with("vertex 1 (from 0) lies at the centre"),
        "{told}"
    );
}

#[test]
fn text_of_other_kinds_is_not_recognised() {
    for text in [
        "theta,phi,value\n1,2,3\n",
        "a,b,c\n1,2,3\n",
        "lon only\n",
        "lon,value\n1,2\n",
        "x,y,value\n1,2,3\n",
        "lon_error,lat_error,v\n1,2,3\n",
        "x_speed,y_speed,z_speed,v\n1,2,3,4\n",
        "1,2,3\n",
        "# lon and lat follow\n1,2,3\n",
        "lon,lat\0,v\n",
        "ply",
        "plyx\n",
        "#",
        "\u{feff}",
        "\n\n\n",
    ] {
        let (error, told) = problem_with(text.as_bytes(), &Selection::default());
        assert!(is(&error, ErrorKind::Unrecognised, "longan reads"), "{text:?}: {told}");
        assert!(told.contains("CSV files with columns such as lon, lat"), "{told}");
        assert!(describe(&scratch(text.as_bytes()).path).is_err());
    }
}

#[test]
fn surfaces_with_wrong_headers() {
    let vertex = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty float w\n";
    let face = "element face 1\nproperty list uchar int vertex_indices\n";
    for (header, expected) in [
        ("format utf8 1.0\n".to_owned(), "line 2 of the header is 'format utf8 1.0', which is not 'ascii'"),
        ("format ascii 1.0\nelement vertex many\n".to_owned(), "line 3 of the header is 'element vertex many'"),
        ("format ascii 1.0\nelement vertex -3\n".to_owned(), "not 'element', a name and a number of entries"),
        ("format ascii 1.0\nelement vertex 99999999999999999999\n".to_owned(), "not 'element', a name and"),
        (
            "format ascii 1.0\nproperty float x\n".to_owned(),
            "line 3 of the header is 'property float x', which is not after an element",
        ),
        (
            "format ascii 1.0\nelement vertex 3\nproperty real x\n".to_owned(),
            "line 4 of the header is 'property real x'",
        ),
        (
            "format ascii 1.0\nelement vertex 3\nproperty float x\nproperty int x\n".to_owned(),
            "a property that its element has not yet",
        ),
        (format!("format ascii 1.0\n{vertex}element vertex 3\n"), "an element that the file has not yet"),
        (
            "format ascii 1.0\nhello\n".to_owned(),
            "line 3 of the header is 'hello', which is not a line of a PLY header",
        ),
        (format!("{vertex}{face}end_header\n"), "this PLY file has no line that says its format"),
        (format!("format ascii 1.0\n{face}end_header\n"), "this PLY file has no vertices"),
        (format!("format ascii 1.0\n{vertex}end_header\n"), "this PLY file has no faces"),
        (
            format!("format ascii 1.0\n{}{face}end_header\n", vertex.replace("float y", "float t")),
            "no positions x, y and z",
        ),
        (
            format!("format ascii 1.0\n{}{face}end_header\n", vertex.replace("float w", "float nx")),
            "no column of numbers besides 'x', 'y', 'z', 'nx'",
        ),
        (format!("format ascii 1.0\n{vertex}{face}"), "cannot find the end of the header: the file ends before it"),
        ("a".repeat(1 << 20), "cannot find the end of the header"),
    ] {
        let (_, told) = problem_with(format!("ply\n{header}").as_bytes(), &Selection::default());
        assert!(told.contains(expected), "{header:?}: {told}");
    }
}

#[test]
fn surfaces_with_wrong_bodies() {
    let file = |vertices: &str, faces: &str, body: &str| {
        let properties = "property float x\nproperty float y\nproperty float z\nproperty float w\n";
        format!(
            "ply\nformat ascii 1.0\nelement vertex {vertices}\n{properties}element face {faces}\nproperty list char int vertex_indices\nend_header\n{body}"
        )
    };
    let corners = "1 0 0 1\n0 1 0 1\n0 0 1 1\n";
    for (text, expected) in [
        (file("3", "1", &format!("{corners}3 0 1 3\n")), "face 0 (from 0) has vertex 3, but the file has 3 vertices"),
        (file("3", "2", &format!("{corners}3 0 1 2\n3 0 1 -1\n")), "face 1 (from 0) has vertex -1"),
        (file("3", "1", &format!("{corners}3 0 1 1.5\n")), "face 0 (from 0) has vertex 1.5"),
        (
            file("3", "1", &format!("{corners}-3 0 1 2\n")),
            "entry 0 (from 0) has '-3' as 'vertex_indices', which is not the length of a list",
        ),
        (file("3", "1", "1 0 0 1\n0 1 y 1\n0 0 1 1\n3 0 1 2\n"), "line 12 has 'y' as 'z', which is not a number"),
        (
            file("3", "1", "1 0 0 1\n0 nan 0 1\n0 0 1 1\n3 0 1 2\n"),
            "vertex 1 (from 0) has 'NaN' as 'y', which is not a number from -1e100",
        ),
        (file("3", "1", "1 0 0 nan\n0 1 0 nan\n0 0 1 nan\n3 0 1 2\n"), "column 'w' has no value at any point"),
        (file("3", "0", corners), "this PLY file has no faces"),
        (file("3", "1", &format!("{corners}2 0 1\n")), "this PLY file has no faces"),
        (file("99999999999", "1", corners), "the file ends after 3 of 99999999999 entries of 'vertex'"),
        (
            file("18446744073709551615", "1", corners),
            "the file ends after 3 of 18446744073709551615 entries of 'vertex'",
        ),
        (file("3", "2", &format!("{corners}3 0 1 2\n")), "the file ends after 1 of 2 entries of 'face'"),
        (file("3", "1", &format!("{corners}99999999999 0 1 2\n")), "the file ends after 0 of 1 entries of 'face'"),
        (file("3", "1", &format!("{corners}3 0 1 2\n")), "seen from the centre, "),
        (file("3", "1", &format!("{corners}{}", "9".repeat(1 << 20))), "is not"),
    ] {
        let (_, told) = problem_with(text.as_bytes(), &Selection::default());
        assert!(told.contains(expected), "{text:.300}: {told}");
    }
}

#[test]
fn binary_surfaces_that_promise_too_much() {
    for format in ["binary_little_endian", "binary_big_endian"] {
        for vertices in ["99999999999", "18446744073709551615"] {
            let text = format!(
                "ply\nformat {format} 1.0\nelement vertex {vertices}\nproperty list uint double rings\nproperty float x\nproperty float y\nproperty float z\nproperty float w\nelement face 1\nproperty list uint int vertex_indices\nend_header\n"
            );
            for body in [vec![0; 100], vec![0xff; 100], vec![]] {
                let (error, told) = problem_with(&[text.as_bytes(), &body].concat(), &Selection::default());
                assert!(is(&error, ErrorKind::Truncated, "the file ends after"), "{told}");
            }
        }
    }
}

#[test]
fn files_cut_or_changed_anywhere() {
    let text = table(&fibonacci(6), |[x, ..]| x);
    let ascii = sphere(0).ply();
    let binary = crate::surfaces::binary(&sphere(0));
    for bytes in [text.as_bytes(), &ascii, &binary] {
        for length in 0..bytes.len() {
            // What is left of a table may be one.
            let read = read_with(&bytes[..length], &nside(2, Regrid::default()));
            assert!(
                read.is_err() || bytes == text.as_bytes() || bytes.len() - length < 4,
                "{length} of {}",
                bytes.len()
            );
        }
        let mut next = noise(5);
        for at in 0..bytes.len().min(600) {
            let mut changed = bytes.to_vec();
            changed[at] = (next() * 256.0) as u8;
            if let Err(error) = read_with(&changed, &nside(2, Regrid::default())) {
                assert!(error.path().is_some() && !error.problem().to_string().contains('\n'));
            }
        }
    }
}
