use super::*;
use longan_support::bytes::{gzip, picture, primary};
use longan_support::skip;

/// Values of Nside 4 that differ from each other.
fn values() -> Vec<f64> {
    (0..192).map(|i| f64::from(i * 7 % 192)).collect()
}

#[test]
fn files_that_are_no_maps() {
    let folder = Folder::with_sky();
    let whole = map_file(&values(), &[("NSIDE", "4")]);
    std::fs::create_dir(folder.path("folder.fits")).unwrap();
    let text =
        |rows: usize| file(rows, &[col("NAMES", "2A", vec![b'x'; 2 * rows])], &[("NAXIS1", "2"), ("NSIDE", "4")]);
    let key = |key: &'static str, value: &'static str| map_file(&values(), &[("NSIDE", "4"), (key, value)]);
    let files: [(&str, Vec<u8>, &[&str]); 27] = [
        ("empty.fits", vec![], &["an empty file"]),
        ("text.fits", b"longitude latitude value\n".to_vec(), &["a text file", "convert it first"]),
        ("table.fits", b"longitude,latitude,value\n".to_vec(), &["column", "--variable"]),
        ("png.fits", b"\x89PNG\r\n\x1a\n\0\0".to_vec(), &["a PNG picture"]),
        ("hdf5.fits", b"\x89HDF\r\n\x1a\n\0\0".to_vec(), &["the NetCDF library says"]),
        ("netcdf.fits", b"CDF\x01\0\0\0".to_vec(), &["the NetCDF header is damaged"]),
        ("zip.fits", b"PK\x03\x04aaaa".to_vec(), &["a ZIP archive"]),
        ("bits.fits", vec![0, 1, 2, 254], &["unknown kind"]),
        ("picture.fits", picture(20, 10), &["a picture of 20 × 10 pixels", "choose a file"]),
        ("header.fits", primary(), &["no HEALPix table"]),
        ("zipped.fits.gz", gzip(&whole)[..200].to_vec(), &["gzip stream is damaged or cut short", "fetch"]),
        ("zipped text.fits.gz", gzip(b"text"), &["gzip-compressed file that holds no FITS"]),
        ("rows.fits", map_file(&values()[1..], &[("NSIDE", "4")]), &["Nside 4, so 192 pixels", "holds 191 values"]),
        ("odd.fits", map_file(&values()[1..], &[("ORDERING", "'RING'")]), &["191 values are not 12 Nside²", "NSIDE"]),
        ("wrong.fits", map_file(&values(), &[("NSIDE", "8")]), &["Nside 8, so 768 pixels", "192"]),
        ("negative.fits", map_file(&values(), &[("NSIDE", "-4")]), &["NSIDE = -4", "between 1 and 2^29"]),
        ("zero.fits", map_file(&values(), &[("NSIDE", "0")]), &["NSIDE = 0"]),
        ("huge.fits", map_file(&values(), &[("NSIDE", "999999999999")]), &["NSIDE = 999999999999"]),
        ("large.fits", map_file(&values(), &[("NSIDE", "536870912")]), &["3458764513820540928 pixels", "192 values"]),
        ("word.fits", map_file(&values(), &[("NSIDE", "'four'")]), &["NSIDE = four", "whole number"]),
        ("three.fits", map_file(&[1.0; 108], &[("NSIDE", "3"), ("ORDERING", "'NESTED'")]), &["Nside 3", "use RING"]),
        ("ordering.fits", key("ORDERING", "'SPIRAL'"), &["ORDERING = SPIRAL", "RING, NESTED"]),
        ("indexing.fits", key("INDXSCHM", "'SPIRAL'"), &["INDXSCHM = SPIRAL", "IMPLICIT, EXPLICIT or SPARSE"]),
        ("unindexed.fits", key("INDXSCHM", "'EXPLICIT'"), &["no column of integers"]),
        ("names.fits", text(192), &["column 'NAMES'", "is text", "choose another field"]),
        ("rowless.fits", text(0), &["holds no data"]),
        ("promises.fits", key("NAXIS2", "99999999999"), &["promises 800000005752 bytes", "cut short"]),
    ];
    for (name, bytes, parts) in &files {
        folder.write(name, bytes);
        for command in ["map -o out.fits", "map -o out.fits sky.fits --mask", "totals", "info"] {
            // It is no error for a file to hold texts, as long as nobody wants a map of them.
            if command != "info" || *name != "names.fits" {
                // A mask has options of its own.
                let option = |part: &&'static str| match *part {
                    "--variable" if command.ends_with("--mask") => "--mask-field",
                    part => part,
                };
                let parts: Vec<&str> = parts.iter().map(option).collect();
                folder.refused(&format!("{command} '{name}'"), &[&[&format!("{name}: ")[..]], &parts[..]].concat());
            }
        }
    }
    for (name, part) in
        [("missing.fits", "no such file"), ("no/such.fits", "no such file"), ("folder.fits", "is a folder")]
    {
        for command in ["map -o out.fits", "map -o out.fits sky.fits --mask", "totals", "info"] {
            folder.refused(&format!("{command} {name}"), &[name, part]);
        }
    }
}

#[test]
fn files_cut_anywhere() {
    let folder = Folder::new();
    let whole = map_file(&values(), &[("NSIDE", "4")]);
    let zipped = gzip(&whole);
    let end_of_data = 2 * 2880 + 192 * 8;
    for (bytes, cuts) in [(&whole, (0..end_of_data).step_by(487)), (&zipped, (0..zipped.len()).step_by(61))] {
        assert!(cuts.len() > 10);
        for cut in cuts.chain([bytes.len().min(end_of_data) - 1]) {
            folder.write("cut.fits", &bytes[..cut]);
            folder.refused("map cut.fits -o out.fits", &["cut.fits: "]);
        }
        folder.write("cut.fits", bytes);
        folder.done("map cut.fits -o out.fits");
        std::fs::remove_file(folder.path("out.fits")).unwrap();
    }
}

#[test]
fn fields_tables_and_masks_that_are_not_there() {
    let folder = Folder::with_sky();
    folder.write("none.fits", &map_file(&[0.0; 3072], &[]));
    for (options, parts) in [
        ("--field nope", &["sky.fits", "no field 'nope'", "0 'WAVES'"][..]),
        ("--field 1", &["sky.fits", "no field 1", "0 'WAVES'"]),
        ("--field ''", &["sky.fits", "no field ''"]),
        ("--field 99999999999999999999999", &["no field '99999999999999999999999'"]),
        ("--hdu 0", &["HDU 0 is empty", "HDU 1 ('SIMULATION'"]),
        ("--hdu 7", &["no HDU 7", "HDU 1 ('SIMULATION'"]),
        ("--hdu 18446744073709551615", &["no HDU 18446744073709551615"]),
        ("--nside 4", &["not a multi-order map", "--nside"]),
        ("--mask none.fits", &["sky.fits", "every pixel of the map is masked"]),
        ("--mask sky.fits --mask-threshold 1e9", &["every pixel of the map is masked"]),
        ("--mask sky.fits --mask-field Q", &["sky.fits", "no field 'Q'"]),
    ] {
        folder.refused(&format!("map sky.fits -o out.fits {options}"), parts);
        folder.refused(&format!("totals sky.fits {options}"), parts);
    }
    folder.misused("map sky.fits -o out.fits --mask-field Q", &["--mask <FILE>"]);
    folder.misused("totals sky.fits --hdu -1", &["'-1'", "--hdu", "whole number"]);
    folder.misused("totals sky.fits --hdu one", &["'one'", "--hdu", "whole number"]);
    folder.misused("totals sky.fits --nside 0", &["--nside", "between 1 and 2^29"]);
    folder.misused("totals sky.fits --mask-threshold nan", &["--mask-threshold", "finite"]);
}

#[test]
fn values_without_a_meaning() {
    let folder = Folder::new();
    let write = |name: &str, value: fn(usize) -> f64| {
        folder.write(name, &map_file(&(0..192).map(value).collect::<Vec<_>>(), &[]));
    };
    write("nan.fits", |_| f64::NAN);
    write("unseen.fits", |i| [longan_grid::UNSEEN, f64::NEG_INFINITY, -1.63750001e30][i % 3]);
    write("constant.fits", |_| -2.5);
    write("large.fits", |i| [1e300, -1e300][i % 2]);
    for command in ["map -o out.fits", "totals"] {
        for name in ["nan.fits", "unseen.fits"] {
            folder.refused(&format!("{command} {name}"), &[name, "every pixel of the map is masked"]);
            folder.refused(&format!("{command} {name} --thresholds 0"), &[name, "every pixel of the map is masked"]);
        }
        folder.refused(&format!("{command} constant.fits"), &["constant.fits", "-2.5", "in the map's unit"]);
        folder.refused(&format!("{command} large.fits"), &["large.fits", "not finite", "in the map's unit"]);
    }
    // With thresholds of their own they are maps like others.
    let printed = folder.done("map constant.fits -o out.fits --thresholds -3 --measure w0,evq");
    assert!(folder.read("out.fits", "EVQ").values().iter().all(|v| v.is_nan()), "{printed}");
    assert!(folder.read("out.fits", "W0").values().iter().all(|v| *v > 0.0));
    folder.done("totals large.fits --thresholds -1e200,0,1e200");
}

#[test]
fn arguments_that_make_no_sense() {
    let folder = Folder::with_sky();
    for (options, parts) in [
        ("--measure evk", &["--measure", "no measure 'evk'", "did you mean 'evq'", "`longan measures`"][..]),
        ("--measure evq,temperature", &["no measure 'temperature'"]),
        ("--measure psi3-directon", &["did you mean 'psi3-direction'"]),
        ("--measure EVK", &["no measure 'EVK'", "did you mean 'evq'"]),
        ("--measure psi0", &["no measure 'psi0'"]),
        ("--measure psi99999999999", &["no measure 'psi99999999999'"]),
        ("--measure psi-1", &["no measure 'psi-1'"]),
        ("--measure ''", &["--measure"]),
        ("--measure evq,,w1", &["no measure ''"]),
        ("--measure evq,w1,evq", &["'evq' is given twice"]),
        ("--thresholds ''", &["--thresholds", "lo:hi:n"]),
        ("--thresholds one", &["'one'", "lo:hi:n, log:lo:hi:n or a,b,c"]),
        ("--thresholds 1,,2", &["'1,,2'", "finite numbers"]),
        ("--thresholds nan", &["finite numbers"]),
        ("--thresholds -inf,0", &["finite numbers"]),
        ("--thresholds 1e999", &["finite numbers"]),
        ("--thresholds 1,2,1", &["threshold 1 is given twice"]),
        ("--thresholds 1:2", &["lo:hi:n"]),
        ("--thresholds 1:2:3:4", &["lo:hi:n"]),
        ("--thresholds 1:2:2.5", &["lo:hi:n"]),
        ("--thresholds 1:2:-3", &["lo:hi:n"]),
        ("--thresholds 1:2:1", &["lo < hi and at least 2 steps"]),
        ("--thresholds 2:1:5", &["lo < hi"]),
        ("--thresholds log:0:1:5", &["lo must be above 0"]),
        ("--thresholds log:-1:1:5", &["lo must be above 0"]),
        ("--thresholds 0:1:999999999999", &["999999999999 thresholds are more than the 65534"]),
        ("--thresholds", &["--thresholds"]),
        ("--threshold-unit kelvin", &["'kelvin'", "sigma, value"]),
        ("--body beside", &["'beside'", "above, below"]),
        ("--threads 0", &["--threads"]),
        ("--threads -1", &["--threads", "1..=1024"]),
        ("--threads 99999999", &["--threads"]),
    ] {
        folder.misused(&format!("map sky.fits -o out.fits {options}"), parts);
        if !options.starts_with("--measure") {
            folder.misused(&format!("totals sky.fits {options}"), parts);
        }
    }
    for (options, parts) in [
        ("--window -1", &["'-1'", "--window", "not between 0 and 180"][..]),
        ("--window 180.001", &["not between 0 and 180"]),
        ("--window nan", &["'nan'", "not a finite number"]),
        ("--window wide", &["'wide'", "not a finite number"]),
        ("--nside-out 0", &["--nside-out", "not between 1 and 2^29"]),
        ("--nside-out -4", &["'-4'", "whole number"]),
        ("--nside-out 2.5", &["'2.5'", "whole number"]),
        ("--nside-out 1000000000", &["1000000000 is not between 1 and 2^29"]),
        ("--max-masked -0.1", &["--max-masked", "not between 0 and 1"]),
        ("--max-masked 1.1", &["not between 0 and 1"]),
        ("--max-masked nan", &["not a finite number"]),
        ("--weight area", &["'area'", "length, curvature"]),
        ("--ordering spiral", &["'spiral'", "ring, nested"]),
        ("--overwrite --resume", &["--overwrite", "--resume"]),
        ("--unknown", &["--unknown"]),
        ("-1", &["-1"]),
    ] {
        folder.misused(&format!("map sky.fits -o out.fits {options}"), parts);
    }
    for (words, part) in [
        ("frobnicate", "frobnicate"),
        ("map -o out.fits", "<INPUT>"),
        ("map sky.fits", "--output <OUT>"),
        ("map '' -o out.fits", "<INPUT>"),
        ("totals", "<INPUT>"),
        ("totals sky.fits --format xml", "table, csv, json"),
        ("info", "<FILE>"),
        ("info sky.fits --format csv", "text, json"),
        ("measures --format csv", "text, json"),
        ("simulate shapes", "--output <OUT>"),
        ("simulate shapes -o out.fits --nside 0", "not between 1 and 2^29"),
        ("simulate shapes -o out.fits --shape star", "square, rectangle-2-1"),
        ("simulate shapes -o out.fits --size 3", "--shape"),
        ("simulate shapes -o out.fits --centre 1,2", "--shape"),
        ("simulate shapes -o out.fits --angle 10", "--shape"),
        ("simulate shapes -o out.fits --shape cap --size 0", "above 0"),
        ("simulate shapes -o out.fits --shape cap --size 91", "at most 90"),
        ("simulate shapes -o out.fits --shape cap --centre 3", "LON,LAT"),
        ("simulate shapes -o out.fits --shape cap --centre -10,91", "not between -90 and 90"),
        ("simulate shapes -o out.fits --shape cap --angle nan", "finite"),
        ("simulate waves -o out.fits --correlation 0", "above 0"),
        ("simulate waves -o out.fits --correlation nan", "above 0"),
        ("simulate waves -o out.fits --seed -1", "whole number"),
    ] {
        folder.misused(words, &[part]);
    }
    let ran = folder.run("");
    assert!(ran.code == Some(2) && ran.err.contains("Usage: longan <COMMAND>"), "{ran:?}");
}

#[test]
fn outputs_that_cannot_be() {
    let folder = Folder::with_sky();
    folder.refused(
        "map sky.fits -o out.fits --nside-out 3 --ordering nested",
        &["sky.fits", "3 is not a power of two", "--ordering ring"],
    );
    folder.refused("map sky.fits -o out.fits --window 0 --nside-out 8", &["sky.fits", "must be the map's, 16, not 8"]);
    // More memory than any machine has, none of which is touched.
    folder.refused(
        "map sky.fits -o out.fits --nside-out 500000000",
        &["sky.fits", "Nside 500000000 needs more memory", "smaller"],
    );
    folder.refused("map sky.fits -o out.fits --nside-out 300000 --sequence", &["Nside 300000 needs more memory"]);
    folder.refused("simulate shapes -o out.fits --nside 500000000", &["out.fits", "needs more memory"]);
    folder.refused("simulate waves -o out.fits --nside 536870912", &["out.fits", "needs more memory"]);
}

#[test]
fn outputs_that_may_not_be_written() {
    let folder = Folder::with_sky();
    folder.write("old.fits", b"old");
    std::fs::create_dir(folder.path("folder")).unwrap();
    std::fs::create_dir(folder.path("folder/sky.fits")).unwrap();
    std::fs::copy(folder.path("sky.fits"), folder.path("same.fits")).unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink("sky.fits", folder.path("link.fits")).unwrap();
    for make in ["map sky.fits", "simulate waves --nside 4", "simulate shapes --nside 4"] {
        folder.refused(&format!("{make} -o old.fits"), &["old.fits: ", "exists"]);
        folder.refused(
            &format!("{make} -o none/out.fits"),
            &["none/out.fits: ", "folder none does not exist", "create it"],
        );
        #[cfg(unix)]
        folder.refused(&format!("{make} -o /dev/full --overwrite"), &["/dev/full: ", "not a regular file"]);
    }
    assert_eq!(std::fs::read(folder.path("old.fits")).unwrap(), b"old");
    folder.refused("map sky.fits -o folder", &["folder/sky.fits: ", "is a folder"]);
    folder.refused("simulate waves -o folder", &["folder: ", "is a folder"]);
    folder.refused("map sky.fits -o old.fits/", &["old.fits"]);
    folder.refused("map sky.fits same.fits -o old.fits", &["old.fits", "is a file where a folder is needed"]);
    folder.refused("map sky.fits ./sky.fits -o new", &["sky.fits", "./sky.fits", "both", "new/sky.fits"]);
    folder.refused("map .. -o folder", &["..: ", "not a file"]);
    folder.refused("demo old.fits", &["old.fits: ", "folder"]);
    for output in ["sky.fits", "./sky.fits", "link.fits", "."] {
        folder.refused(&format!("map sky.fits -o {output} --overwrite"), &["would replace this input"]);
    }
    folder.refused("map same.fits -o sky.fits --mask sky.fits --overwrite", &["sky.fits", "would replace this input"]);
    // All this is said before the input is read or anything computed.
    folder.refused("map missing.fits -o old.fits", &["old.fits: ", "exists"]);
    folder.refused("map sky.fits same.fits -o folder --mask missing.fits --overwrite", &["folder/sky.fits: "]);
}

#[cfg(unix)]
#[test]
fn a_folder_that_may_not_be_written_to() {
    use std::os::unix::fs::PermissionsExt;
    let folder = Folder::with_sky();
    let locked = folder.path("locked");
    std::fs::create_dir(&locked).unwrap();
    std::fs::set_permissions(&locked, PermissionsExt::from_mode(0o555)).unwrap();
    if std::fs::write(locked.join("probe"), "").is_ok() {
        return skip("permissions", "this user may write everywhere, so a locked folder is not tested");
    }
    folder.refused("map sky.fits -o locked/out.fits", &["locked/out.fits: ", "cannot write"]);
    folder.refused("map sky.fits -o locked", &["locked/sky.fits: ", "cannot write"]);
}
