//! Every family of files, from end to end.

use std::f64::consts::FRAC_PI_2;

use longan::Healpix;
use serde_json::json;

use super::gridded::{Layout, zarr};
use super::*;

/// A smooth field of latitude and longitude in degrees, between −2 and 2, without symmetry.
fn smooth(latitude: f64, longitude: f64) -> f64 {
    let (lat, lon) = (latitude.to_radians(), longitude.to_radians());
    let [x, y, z] = [lat.cos() * lon.cos(), lat.cos() * lon.sin(), lat.sin()];
    0.4 * z + 0.9 * x * y + 0.8 * (x * z - 0.3 * y) + 0.5 * (y * y - z * x * x)
}

/// The field at the centres of pixels.
fn sampled(nside: usize, field: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    let grid = Healpix::new(nside).unwrap();
    let value = |p| {
        let (theta, phi) = grid.centre(p);
        field((FRAC_PI_2 - theta).to_degrees(), phi.to_degrees())
    };
    (0..grid.pixels()).map(value).collect()
}

/// What a Minkowski map of the field is asked for.
const OPTIONS: &str = "--window 25 --nside-out 4 --measure w0,w1,w2,psi2 --thresholds -0.4,0.1,0.5";

/// Asserts that two Minkowski maps differ by no more than this.
#[track_caller]
fn assert_near(folder: &Folder, a: &str, b: &str, most: f64) {
    for measure in ["W0", "W1", "W2", "PSI2"] {
        let difference = difference(folder.read(a, measure).values(), folder.read(b, measure).values());
        assert!(difference <= most, "{a} and {b}: {measure} differs by {difference}");
    }
}

#[test]
fn one_healpix_map_in_every_layout() {
    let folder = Folder::new();
    folder.done("simulate waves -o sky.fits --nside 16 --correlation 15");
    let values = folder.read("sky.fits", "0").values().to_vec();
    for output in ["nested.fits --ordering nested", "small.fits.gz", "ring.nc", "nested.nc4 --ordering nested"] {
        folder.done(&format!("regrid sky.fits -o {output}"));
    }
    let mapping = json!({"grid_mapping_name": "healpix", "refinement_level": 4, "indexing_scheme": "ring"});
    let old = json!({"grid_mapping_name": "healpix", "healpix_nside": 16, "healpix_order": "ring"});
    for (version, mapping) in [(2, &mapping), (3, &old)] {
        let path = folder.path(format!("store{version}.zarr"));
        let attributes = json!({"grid_mapping": "crs", "units": "K"});
        let field = ("sky", &[3072][..], &values[..], attributes, &["cell"][..]);
        zarr(&path, version, &[field, ("crs", &[1], &[0.0], mapping.clone(), &["one"])]);
    }
    let centres = Healpix::new(16).unwrap();
    let row = |p: usize| {
        let (theta, phi) = centres.centre(p);
        format!("{},{},{}\n", phi.to_degrees(), 90.0 - theta.to_degrees(), values[p])
    };
    folder.write("sky.csv", ("lon_deg,lat_deg,sky\n".to_owned() + &(0..3072).map(row).collect::<String>()).as_bytes());

    folder.done(&format!("map sky.fits -o expected.fits {OPTIONS}"));
    let totals = folder.done("totals sky.fits --format csv");
    for (i, input) in
        ["nested.fits", "small.fits.gz", "ring.nc", "nested.nc4", "store2.zarr", "store3.zarr/", "sky.csv --nside 16"]
            .into_iter()
            .enumerate()
    {
        for output in [format!("{i}.fits"), format!("{i}.nc")] {
            folder.done(&format!("map {input} -o {output} {OPTIONS}"));
            assert_near(&folder, "expected.fits", &output, 0.0);
        }
        assert_eq!(folder.done(&format!("totals {input} --format csv")), totals, "{input}");
        let file = input.split(' ').next().unwrap();
        let format = ["HEALPix FITS", "HEALPix FITS", "NetCDF", "NetCDF", "Zarr", "Zarr", "CSV"][i];
        let info = folder.done(&format!("info {file}"));
        assert!(info.lines().next().unwrap().contains(format), "{info}");
    }
    // What was written is described.
    let info = folder.done("info 2.nc --variable W1");
    let parts = ["Variable 'W1'", "ordering     RING", "Nside        4", "in windows of 25 degrees", "rad"];
    assert!(parts.iter().all(|part| info.contains(part)) && !info.contains("'W0'"), "{info}");
    folder.refused("info 2.nc --variable W9", &["2.nc: there is no 'W9'", "'W0', 'W1', 'W2', 'PSI2'"]);
    let totals = folder.done("totals 2.nc --variable w1 --thresholds 1 --format csv");
    assert_eq!(totals, folder.done("totals 0.fits --field W1 --thresholds 1 --format csv"));
}

#[test]
fn one_field_in_every_layout_of_latitudes_and_longitudes() {
    // Multiples of the unit in which they are packed, some of them missing.
    const UNIT: f64 = 1.0 / 8192.0;
    let field = |_: usize, latitude: f64, longitude: f64| {
        let longitude = longitude.rem_euclid(360.0);
        let missing = (latitude - 37.5).abs() < 6.0 && (longitude - 197.5).abs() < 11.0;
        if missing { f64::NAN } else { (smooth(latitude, longitude) / UNIT).round() * UNIT }
    };
    let folder = Folder::new();
    let plain = Layout::of(5.0);
    plain.write(&folder.path("plain.nc"), field);
    // Thresholds that no value is near to.
    let options =
        "--nside 16 --window 25 --nside-out 4 --measure w0,w1,w2,psi2 --thresholds -0.40003,0.10001 --max-masked 1";
    folder.done(&format!("map plain.nc -o plain.fits {options}"));
    assert!(folder.read("plain.fits", "W1").values().iter().all(|v| v.is_finite()));
    let layouts = [
        ("down.nc", Layout { down: true, ..plain }),
        ("west.nc", Layout { from: -180.0, ..plain }),
        ("wrapped.nc", Layout { from: 125.0, down: true, ..plain }),
        ("turned.nc", Layout { turned: true, ..plain }),
        ("grouped.nc", Layout { grouped: true, turned: true, ..plain }),
        ("packed.nc", Layout { packed: Some(UNIT), ..plain }),
        ("classic.nc", Layout { classic: true, packed: Some(UNIT), from: -90.0, ..plain }),
        ("one_time.nc", Layout { steps: 1, ..plain }),
        ("chunked.nc", Layout { steps: 1, chunk: Some(1), ..plain }),
    ];
    for (name, layout) in layouts {
        layout.write(&folder.path(name), field);
        folder.done(&format!("map {name} -o {name}.fits {options}"));
        // Weights are rounded.
        assert_near(&folder, "plain.fits", &format!("{name}.fits"), 1e-10);
    }
    let latitudes: Vec<f64> = (0..36).map(|i| -87.5 + 5.0 * f64::from(i)).collect();
    let longitudes: Vec<f64> = (0..72).map(|i| 2.5 + 5.0 * f64::from(i)).collect();
    let values: Vec<f64> = latitudes.iter().flat_map(|&a| longitudes.iter().map(move |&b| field(0, a, b))).collect();
    for version in [2, 3] {
        let name = format!("store{version}.zarr");
        zarr(
            &folder.path(&name),
            version,
            &[
                ("t", &[36, 72], &values, json!({"units": "K"}), &["lat", "lon"]),
                ("lat", &[36], &latitudes, json!({"units": "degrees_north"}), &["lat"]),
                ("lon", &[72], &longitudes, json!({"units": "degrees_east"}), &["lon"]),
            ],
        );
        folder.done(&format!("map {name} -o {name}.fits {options}"));
        assert_near(&folder, "plain.fits", &format!("{name}.fits"), 0.0);
        assert!(folder.done(&format!("info {name}")).contains("36 latitudes x 72 longitudes, global"));
    }
}

/// The mean difference of W1 and |ψ2| between the field's Minkowski maps from a grid of latitudes and longitudes and from
/// HEALPix directly, relative to the mean W1.
fn error(spacing: f64, nside: usize, method: &str) -> f64 {
    let folder = Folder::new();
    Layout::of(spacing).write(&folder.path("grid.nc"), |_, latitude, longitude| smooth(latitude, longitude));
    folder.write("direct.fits", &map_file(&sampled(nside, smooth), &[]));
    folder.done(&format!("map direct.fits -o a.fits {OPTIONS}"));
    folder.done(&format!("map grid.nc -o b.fits --nside {nside} --method {method} {OPTIONS}"));
    let [a, b] = ["a.fits", "b.fits"].map(|name| ["W1", "PSI2"].map(|field| folder.read(name, field)));
    let apart = |i: usize| a[i].values().iter().zip(b[i].values()).map(|(a, b)| (a - b).abs()).sum::<f64>();
    apart(0).max(apart(1)) / a[0].values().iter().sum::<f64>()
}

#[test]
fn a_field_of_latitude_and_longitude_against_its_samples_on_healpix() {
    // Interpolation is of second order in the spacing of the grid. Cells are taken as constant for overlaps, which is of
    // first order, where pixels are not much larger than cells. Contours that move into other windows with their pixels
    // leave some noise. At a spacing of 2 degrees, 1/30 of the field's scale of a radian, orders two and one are 1e-3
    // and, as errors of cells cancel within a window of hundreds, less than a tenth of 3e-2.
    for (method, sizes, ratio, most) in [
        ("bilinear", [(8.0, 32), (4.0, 32), (2.0, 32)], 0.4, 1e-3),
        ("conservative", [(8.0, 8), (4.0, 16), (2.0, 32)], 0.7, 3e-3),
    ] {
        let errors = sizes.map(|(spacing, nside)| error(spacing, nside, method));
        assert!(errors[1] < ratio * errors[0] && errors[2] < ratio * errors[1], "{method}: {errors:?}");
        assert!(errors[2] < most, "{method}: {errors:?}");
    }
}

#[test]
fn a_surface_seen_from_within() {
    // An octahedron about (3, -1, 2) with the value x of its vertices less the centre's: linear on each face.
    let folder = Folder::new();
    let mut ply = "ply\nformat ascii 1.0\nelement vertex 6\nproperty double x\nproperty double y\nproperty double z\n\
                   property double signal\nelement face 8\nproperty list uchar int vertex_indices\nend_header\n"
        .to_owned();
    for [x, y, z] in [[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]] {
        ply += &format!("{} {} {} {x}\n", x + 3, y - 1, z + 2);
    }
    for i in 0..4 {
        ply += &format!("3 {i} {} 4\n3 {} {i} 5\n", (i + 1) % 4, (i + 1) % 4);
    }
    folder.write("cell.ply", ply.as_bytes());
    let expected = |grid: Healpix| -> Vec<f64> {
        let value = |p| {
            let (theta, phi): (f64, f64) = grid.centre(p);
            let direction = [theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()];
            direction[0] / direction.iter().map(|x| x.abs()).sum::<f64>()
        };
        (0..grid.pixels()).map(value).collect()
    };
    for centre in ["", "--centre 3,-1,2"] {
        folder.done(&format!("regrid cell.ply -o cell.fits --nside 8 {centre} --overwrite"));
        let map = folder.read("cell.fits", "signal");
        assert!(difference(map.values(), &expected(map.grid())) < 1e-12);
    }
    folder.done("map cell.ply -o evq.nc --nside 16 --window 30");
    assert!(folder.done("totals cell.ply --nside 16 --thresholds 0.3").contains(" 1\n"));
    assert!(folder.done("info cell.ply").contains("6 vertices, 8 triangles"));
    folder.refused("map cell.ply -o out.fits --centre 9,9,9", &["of the sphere", "--allow-folds"]);
    folder.done("regrid cell.ply -o out.fits --centre 4.5,-1,2 --allow-folds --nside 4");
}

#[test]
fn masks_of_any_format() {
    let folder = Folder::new();
    folder.done("simulate waves -o sky.fits --nside 16 --correlation 15");
    // Pixels north of 10 degrees, well within cells of 5 degrees or without.
    let north = |latitude: f64, _: f64| f64::from(u8::from(latitude > 10.0));
    folder.write("mask.fits", &map_file(&sampled(16, north), &[]));
    Layout::of(5.0).write(&folder.path("mask.nc"), |_, latitude, longitude| north(latitude, longitude));
    Layout { steps: 2, ..Layout::of(5.0) }.write(&folder.path("masks.nc"), |step, latitude, longitude| {
        north(if step == 1 { latitude } else { -latitude }, longitude)
    });
    folder.done("regrid sky.fits -o expected.fits --mask mask.fits");
    let expected = folder.read("expected.fits", "0");
    assert!(expected.values().iter().any(|v| v.is_nan()));
    // At a threshold of 0.5 the mean over a pixel does as well as its centre, unless cells cut it in the middle.
    let straddles = |p: usize| (90.0 - expected.grid().centre(p).0.to_degrees() - 10.0).abs() < 3.0;
    for mask in ["mask.nc", "masks.nc --mask-select time=1997-12-02"] {
        folder.done(&format!("regrid sky.fits -o masked.fits --overwrite --mask {mask} --mask-threshold 0.5"));
        let found = folder.read("masked.fits", "0");
        let [a, b] = [&found, &expected].map(|map| longan_support::masked(map, straddles));
        assert_same(&a, &b);
        folder.done(&format!("map sky.fits -o out.nc --overwrite --mask {mask}"));
        assert!(!folder.done(&format!("totals sky.fits --mask {mask}")).contains("masked: 0"));
    }
    folder.refused("map sky.fits -o none.fits --mask masks.nc", &["masks.nc: ", "2 times"]);
}

#[test]
fn regional_grids_are_masked_elsewhere() {
    let folder = Folder::new();
    let inside = |latitude: f64, longitude: f64| latitude.abs() < 38.0 && (longitude - 180.0).abs() < 80.0;
    // Global, with missing values; and a file of the region alone.
    let field = |_: usize, a: f64, b: f64| if inside(a, b) { smooth(a, b) } else { f64::NAN };
    Layout::of(4.0).write(&folder.path("global.nc"), field);
    let latitudes: Vec<f64> = (0..19).map(|i| -36.0 + 4.0 * f64::from(i)).collect();
    let longitudes: Vec<f64> = (0..40).map(|i| 102.0 + 4.0 * f64::from(i)).collect();
    let values: Vec<f64> = latitudes.iter().flat_map(|&a| longitudes.iter().map(move |&b| smooth(a, b))).collect();
    zarr(
        &folder.path("region.zarr"),
        2,
        &[
            ("t", &[19, 40], &values, json!({}), &["y", "x"]),
            ("y", &[19], &latitudes, json!({"standard_name": "latitude", "units": "degrees_north"}), &["y"]),
            ("x", &[40], &longitudes, json!({"axis": "X", "units": "degrees_east"}), &["x"]),
        ],
    );
    // A pixel is valid where most of it is; a regional grid's own is the one nearest to its spacing.
    let mut maps = Vec::new();
    for input in ["global.nc", "region.zarr"] {
        folder.done(&format!("regrid {input} -o regridded.fits --overwrite"));
        maps.push(folder.read("regridded.fits", "t"));
        // Thresholds in sigma are those of the pixels that are valid.
        let s = longan::statistics::statistics(maps[maps.len() - 1].values()).unwrap();
        folder.done(&format!("map {input} -o map.fits --overwrite --window 15"));
        let header = &folder.headers("map.fits")[0];
        let number = |key: &str| header[key].parse::<f64>().unwrap();
        assert!((number("INMEAN") - s.mean).abs() < 1e-12 && (number("INSIGMA") - s.sigma).abs() < 1e-12);
        assert!((number("THR1") - (s.mean - 3.0 * s.sigma)).abs() < 1e-12);
        let map = folder.read("map.fits", "EVQ");
        for (p, value) in map.values().iter().enumerate() {
            let (theta, phi) = map.grid().centre(p);
            let (latitude, longitude) = (90.0 - theta.to_degrees(), phi.to_degrees());
            let (north, east) = (38.0 - latitude.abs(), 80.0 - (longitude - 180.0).abs());
            // Windows wholly inside have values, those wholly outside have none.
            if north > 20.0 && east * latitude.to_radians().cos() > 20.0 {
                assert!(value.is_finite(), "{latitude} {longitude}");
            } else if north < -16.0 {
                assert!(value.is_nan(), "{latitude} {longitude}");
            }
        }
        assert!(folder.done(&format!("totals {input}")).contains("masked: "));
    }
    let apart = difference(maps[0].values(), maps[1].values());
    assert!(apart < 1e-12, "{apart}");
}

#[test]
fn files_that_are_broken() {
    let folder = Folder::with_sky();
    let plain = Layout::of(10.0);
    let field = |_: usize, latitude: f64, longitude: f64| smooth(latitude, longitude);
    plain.write(&folder.path("plain.nc"), field);
    Layout { classic: true, ..plain }.write(&folder.path("classic.nc"), field);
    Layout { steps: 2, ..plain }.write(&folder.path("steps.nc"), field);
    for name in ["plain.nc", "classic.nc", "steps.nc"] {
        let bytes = std::fs::read(folder.path(name)).unwrap();
        for share in [0.02, 0.3, 0.9] {
            let cut = (bytes.len() as f64 * share) as usize;
            folder.write("cut.nc", &bytes[..cut]);
            for command in ["map -o out.fits", "totals", "info", "regrid -o out.nc"] {
                folder.refused(&format!("{command} cut.nc"), &["cut.nc: "]);
            }
        }
    }
    let axis = |name: &str, unit: &str| json!({"standard_name": name, "units": unit});
    let values = [1.0; 18];
    let store = |name: &str, latitudes: [f64; 3], latitude: serde_json::Value, fields: &[&str]| {
        let mut arrays: Vec<super::gridded::Array<'_>> =
            fields.iter().map(|name| (*name, &[3, 6][..], &values[..], json!({}), &["j", "i"][..])).collect();
        arrays.push(("j", &[3], &latitudes, latitude, &["j"]));
        arrays.push(("i", &[6], &[0.0, 60.0, 120.0, 180.0, 240.0, 300.0], axis("longitude", "degrees_east"), &["i"]));
        zarr(&folder.path(name), 2, &arrays);
    };
    let [up, mixed] = [[-60.0, 0.0, 60.0], [-60.0, 60.0, 0.0]];
    store("none.zarr", up, json!({}), &["t"]);
    store("radians.zarr", up, axis("latitude", "radians"), &["t"]);
    store("metres.zarr", up, axis("latitude", "m"), &["t"]);
    store("mixed.zarr", mixed, axis("latitude", "degrees_north"), &["t"]);
    store("two.zarr", up, axis("latitude", "degrees_north"), &["t", "u"]);
    store("json.zarr", up, axis("latitude", "degrees_north"), &["t"]);
    folder.write("json.zarr/t/.zarray", b"{");
    folder.write("rows.csv", b"lon,lat,t\n1,2,3\n4,5\n");
    folder.write("words.csv", b"lon,lat,t\n1,2,3\n4,north,6\n");
    folder.write("columns.csv", b"name,size\na,1\n");
    folder.write("face.ply", b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\n");
    std::fs::create_dir(folder.path("folder")).unwrap();
    let files: [(&str, &[&str]); 11] = [
        ("none.zarr", &["latitude", "'t'"]),
        ("radians.zarr", &["'radians'", "degrees"]),
        ("metres.zarr", &["'m'", "degrees"]),
        ("mixed.zarr", &["order"]),
        ("two.zarr", &["--variable", "'t'", "'u'"]),
        ("json.zarr", &["Zarr store"]),
        ("rows.csv", &["line 3", "2 values", "3 columns"]),
        ("words.csv", &["line 3", "'north'"]),
        ("columns.csv", &["lon, lat"]),
        ("face.ply", &["header"]),
        ("folder", &["neither a file nor a Zarr store"]),
    ];
    for (name, parts) in files {
        for command in ["map -o out.fits", "map -o out.fits sky.fits --mask", "totals", "regrid -o out.nc"] {
            // A mask has options of its own.
            let option = |part: &&'static str| match *part {
                "--variable" if command.ends_with("--mask") => "--mask-field",
                part => part,
            };
            let parts: Vec<&str> = parts.iter().map(option).collect();
            folder.refused(&format!("{command} {name}"), &[&[&format!("{name}: ")[..]], &parts[..]].concat());
        }
    }
    // And what is said of all formats names them all.
    folder.write("notes.txt", b"hello\n");
    folder.refused("map notes.txt -o out.fits", &["FITS", "NetCDF", "Zarr", "CSV", "PLY"]);
    folder.refused("map steps.nc -o out.fits --select level=1", &["steps.nc: ", "no dimension 'level'", "time (2)"]);
    folder.refused("map steps.nc -o out.fits --select time=1999", &["no time = 1999", "1997-12-01, 1997-12-02"]);
    folder.refused("map plain.nc -o out.fits --variable u", &["there is no variable 'u'", "'t' in K"]);
    folder.misused("map plain.nc -o out.fits --select level", &["DIM=VALUE", "level=500"]);
    folder.misused("map plain.nc -o out.fits --select time=#x", &["'x' is not a whole number"]);
    folder.misused("map plain.nc -o out.fits --gather gaussian:0", &["above 0"]);
    folder.misused("map plain.nc -o out.fits --centre 1,2", &["three numbers"]);
}

#[test]
fn names_say_the_format_to_write() {
    let folder = Folder::with_sky();
    for name in ["out.png", "out.zarr", "out.csv", "out.h5"] {
        for command in ["map sky.fits", "regrid sky.fits", "simulate waves --nside 8"] {
            folder.refused(&format!("{command} -o {name}"), &[name, ".fits", ".nc"]);
        }
    }
    folder.done("simulate waves -o waves.nc --nside 8 --correlation 20");
    folder.done("regrid waves.nc -o waves.fits");
    folder.done("simulate waves -o same.fits --nside 8 --correlation 20");
    assert_same(&folder.read("waves.fits", "0"), &folder.read("same.fits", "0"));
    folder.refused("regrid waves.nc -o waves.nc --overwrite", &["would replace this input"]);

    // Outputs in a folder are named like the inputs, as far as such files are written.
    zarr(
        &folder.path("store.zarr"),
        3,
        &[
            ("sky", &[768], &sampled(8, smooth), json!({"grid_mapping": "crs"}), &["cell"]),
            (
                "crs",
                &[],
                &[0.0],
                json!({"grid_mapping_name": "healpix", "refinement_level": 3, "indexing_scheme": "ring"}),
                &[],
            ),
        ],
    );
    let row = |i: usize| format!("{},{},{}\n", i % 36 * 10, i as f64 / 4.0 - 80.0, i % 7);
    folder.write("points.csv", ("lon,lat,t\n".to_owned() + &(0..640).map(row).collect::<String>()).as_bytes());
    folder.done("map sky.fits waves.nc store.zarr points.csv -o maps --thresholds 0.2");
    let mut names: Vec<_> = std::fs::read_dir(folder.path("maps")).unwrap().map(|e| e.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(names, ["points.fits", "sky.fits", "store.nc", "waves.nc"]);
    for name in ["sky.fits", "waves.nc", "store.nc", "points.fits"] {
        folder.done(&format!("info maps/{name}"));
    }
    // A store is a file here, and nothing is written into it.
    folder.refused("map sky.fits -o store.zarr", &["store.zarr: this is a Zarr store"]);
    folder.refused("map sky.fits waves.nc -o store.zarr", &["store.zarr: this is a Zarr store"]);
    folder.refused("map store.zarr points.csv points.csv -o maps2", &["would both be written to maps2/points.fits"]);
}
