//! Files broken on purpose: each gives its one sentence, and none makes the program stop.

use std::fs;
use std::path::Path;

use longan_formats::{ErrorKind, Selection};
use serde_json::{Value, json};

use crate::file::{FORMATS, File, Format, Values, Variable, variable};
use crate::{is, problem, read, ring_values};

fn grid(attributes: Value) -> Variable {
    variable("crs", &[], Values::I32(vec![0]), attributes)
}

fn data(len: usize) -> Variable {
    let values = ring_values().into_iter().cycle().take(len).collect();
    variable("t", &[("cell", len)], Values::F64(values), json!({"grid_mapping": "crs"}))
}

fn index(numbers: Vec<i32>) -> Variable {
    variable("cell", &[("cell", numbers.len())], Values::I32(numbers), json!({"standard_name": "healpix_index"}))
}

/// The sentence about this file, which is the same in every format.
#[track_caller]
fn told(file: &File, selection: &Selection) -> String {
    let folder = tempfile::tempdir().unwrap();
    let told = FORMATS.map(|format| problem(longan_formats::read(&file.write(folder.path(), format), selection)).1);
    assert!(told.iter().all(|t| *t == told[0]), "{told:?}");
    told[0].clone()
}

#[track_caller]
fn check(variables: impl Into<Vec<Variable>>, expected: &str) {
    assert_eq!(told(&File::of(variables), &Selection::default()), expected);
}

#[test]
fn grids_that_cannot_be() {
    let healpix = |more: Value| {
        let mut all = json!({"grid_mapping_name": "healpix"});
        all.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        grid(all)
    };
    let ring = || healpix(json!({"indexing_scheme": "ring", "refinement_level": 1}));
    check(
        [data(48), healpix(json!({"refinement_level": 1}))],
        "variable 't' is on a HEALPix grid, but nothing says how pixels are numbered (indexing_scheme); add it to its grid mapping",
    );
    check(
        [data(47), healpix(json!({"indexing_scheme": "ring"}))],
        "variable 't' is on a HEALPix grid, but nothing says its resolution (refinement_level); add it to its grid mapping",
    );
    for (level, shown) in [(json!(30), "[30]"), (json!(-1), "[-1]"), (json!(1.5), "[1.5]"), (json!("fine"), "'fine'")] {
        check(
            [data(48), healpix(json!({"indexing_scheme": "ring", "refinement_level": level}))],
            &format!(
                "variable 'crs' has refinement_level = {shown}, which is not a whole number from 0 to 29; correct it, such as with ncatted"
            ),
        );
    }
    check(
        [data(48), healpix(json!({"indexing_scheme": "xy", "refinement_level": 1}))],
        "variable 'crs' has indexing_scheme = 'xy', which is not one of nested, ring, nuniq and zuniq; correct it, such as with ncatted",
    );
    check(
        [data(48), healpix(json!({"healpix_order": "ring", "healpix_nside": 0}))],
        "variable 'crs' has healpix_nside = [0], which is not a whole number from 1 to 2^29; correct it, such as with ncatted",
    );
    check(
        [data(108), healpix(json!({"healpix_order": "nest", "healpix_nside": 3}))],
        "Nside 3 is not a power of two, which NESTED ordering needs; use RING",
    );
    check(
        [data(50), ring()],
        "variable 't' has 50 values along 'cell', but Nside 2 has 48 pixels; add the coordinate healpix_index, which says which ones they are, or correct the grid mapping",
    );
    check(
        [data(2), index(vec![3, 48]), ring()],
        "'cell' has 48 at place 1 (from 0), which is not a pixel of Nside 2, 0 to 47; correct it",
    );
    check(
        [data(2), index(vec![-1, 3]), ring()],
        "'cell' has -1 at place 0 (from 0), which is not a pixel of Nside 2, 0 to 47; correct it",
    );
    check([data(3), index(vec![7, 8, 7]), ring()], "'cell' names pixel 7 more than once; remove the duplicates");
    check(
        [
            data(2),
            variable("cell", &[("cell", 2)], Values::F64(vec![1.0, 1.5]), json!({"standard_name": "healpix_index"})),
            ring(),
        ],
        "'cell' should number pixels but holds numbers with fractions; store whole numbers",
    );
    let sizes = |scheme: &str| healpix(json!({"indexing_scheme": scheme}));
    check(
        [data(48), sizes("nuniq")],
        "variable 't' is on a HEALPix grid, but nothing says which cells they are (a coordinate with standard_name healpix_index); add it to its grid mapping",
    );
    check(
        [data(2), index(vec![4, 3]), sizes("nuniq")],
        "'cell' has 3 at place 1 (from 0), which is not 4^(level + 1) + pixel for any level up to 29; correct it",
    );
    check(
        [data(1), index(vec![2]), sizes("zuniq")],
        "'cell' has 2 at place 0 (from 0), which is not (2 pixel + 1) 4^(29 - level) for any level up to 29; correct it",
    );
    check(
        [data(2), index(vec![4, 16]), sizes("nuniq")],
        "'cell' has the cells 16 and 4 (UNIQ numbers), which overlap; remove one of them",
    );
    check(
        [data(1), index(vec![1]), sizes("zuniq")],
        "the cells of 'cell' reach Nside 536870912, beyond 8192; choose the resolution to bring them to",
    );
    let other = Selection { nside: Some(4), ..Selection::default() };
    assert_eq!(
        told(&File::of([data(48), ring()]), &other),
        "variable 't' has Nside 2, so it cannot be read at Nside 4; leave the Nside out, or degrade the field first (for example with healpy.ud_grade)"
    );
    let fine = || healpix(json!({"indexing_scheme": "nested", "refinement_level": 29}));
    let told = told(&File::of([data(1), index(vec![3]), fine()]), &Selection::default());
    assert!(told.starts_with("a map of Nside 536870912 needs ") && told.ends_with("use a coarser map"), "{told}");
}

/// A store with a field, to be damaged.
fn store(folder: &Path, format: Format) -> std::path::PathBuf {
    let grid = grid(json!({"grid_mapping_name": "healpix", "refinement_level": 1, "indexing_scheme": "ring"}));
    File::of([data(48), grid]).write(folder, format)
}

/// Changes the metadata of the field.
fn change(store: &Path, change: impl FnOnce(&mut Value)) {
    let file =
        ["t/.zarray", "t/zarr.json"].map(|name| store.join(name)).into_iter().find(|file| file.exists()).unwrap();
    let mut metadata: Value = serde_json::from_slice(&fs::read(&file).unwrap()).unwrap();
    change(&mut metadata);
    fs::write(&file, metadata.to_string()).unwrap();
}

const ZARR: [Format; 2] = [Format::Zarr2, Format::Zarr3];

#[test]
fn stores_that_cannot_be() {
    for format in ZARR {
        let folder = tempfile::tempdir().unwrap();
        let path = store(folder.path(), format);
        let root = path.join(if format == Format::Zarr2 { ".zgroup" } else { "zarr.json" });
        let array = path.join(if format == Format::Zarr2 { "t/.zarray" } else { "t/zarr.json" });
        let whole = fs::read(&array).unwrap();
        for cut in [0, 1, whole.len() / 2, whole.len() - 1] {
            fs::write(&array, &whole[..cut]).unwrap();
            let (error, told) = problem(read(&path));
            assert!(is(&error, ErrorKind::Corrupt, "the metadata of") && told.contains("it is no JSON"), "{told}");
        }
        for metadata in ["null", "[]", "{}", "3", r#"{"zarr_format":2}"#, r#"{"node_type":"array","zarr_format":3}"#] {
            fs::write(&array, metadata).unwrap();
            assert!(is(&problem(read(&path)).0, ErrorKind::Corrupt, "the metadata of"), "{metadata}");
        }
        fs::write(&array, &whole).unwrap();
        read(&path).unwrap();
        // A folder that is none any more.
        fs::remove_file(root).unwrap();
        assert!(is(&problem(read(&path)).0, ErrorKind::NotAFile, "this is a folder"));
    }
}

#[test]
fn metadata_that_promise_too_much() {
    let huge = 1u64 << 40;
    for format in ZARR {
        for (what, value) in [
            ("shape", json!([huge])),
            ("shape", json!([u64::MAX])),
            ("shape", json!([u64::MAX, u64::MAX])),
            ("shape", json!([-1])),
            ("shape", json!([1.5])),
            ("shape", json!("many")),
            ("shape", json!([])),
            ("shape", json!([48, 1])),
            ("chunks", json!([huge])),
            ("chunks", json!([1u64 << 50])),
            ("chunks", json!([u64::MAX])),
            ("chunks", json!([0])),
            ("chunks", json!([])),
            ("chunks", json!([7, 7])),
            ("dtype", json!("<f4")),
            ("dtype", json!("<i8")),
            ("dtype", json!("<f3")),
            ("dtype", json!("<c16")),
            ("dtype", json!("|O")),
            ("dtype", json!([["a", "<f8"]])),
            ("codec", json!({"id": "lzma", "name": "lzma"})),
            ("codec", json!({"id": "gzip", "level": 77, "name": "gzip", "configuration": {"level": 77}})),
            (
                "codec",
                json!({"id": "zstd", "level": 1, "name": "zstd", "configuration": {"level": 1, "checksum": false}}),
            ),
            (
                "codec",
                json!({"id": "blosc", "cname": "lz4", "clevel": 5, "shuffle": 1, "blocksize": 0, "name": "blosc",
                "configuration": {"cname": "lz4", "clevel": 5, "shuffle": "shuffle", "typesize": 8, "blocksize": 0}}),
            ),
            ("codec", json!(7)),
            ("fill_value", json!({})),
            ("fill_value", json!("many")),
            ("dimension_separator", json!("!")),
            ("order", json!("X")),
        ] {
            let folder = tempfile::tempdir().unwrap();
            let path = store(folder.path(), format);
            change(&path, |metadata| match (format, what) {
                (Format::Zarr3, "chunks") => metadata["chunk_grid"]["configuration"]["chunk_shape"] = value.clone(),
                (Format::Zarr3, "dtype") => {
                    metadata["data_type"] = match value.as_str() {
                        Some("<f4") => json!("float32"),
                        Some("<i8") => json!("int64"),
                        Some("|O") => json!("string"),
                        Some("<c16") => json!("complex128"),
                        _ => value.clone(),
                    }
                }
                (Format::Zarr3, "codec") => metadata["codecs"].as_array_mut().unwrap().push(value.clone()),
                (Format::Zarr3, "dimension_separator") => {
                    metadata["chunk_key_encoding"]["configuration"]["separator"] = value.clone()
                }
                (Format::Zarr2, "codec") => metadata["compressor"] = value.clone(),
                _ => metadata[what] = value.clone(),
            });
            // In some of these only what was changed is ignored; but there is a result, or a sentence.
            match read(&path) {
                Ok(map) => assert!(
                    ["dtype", "fill_value", "order", "shape", "chunks"].contains(&what),
                    "{format:?} {what} {value}: {:?}",
                    map.values()
                ),
                Err(error) => assert!(!error.to_string().contains('\n')),
            }
        }
    }
}

#[test]
fn chunks_of_other_bytes() {
    let compressors = [
        json!({"id": "gzip", "level": 1}),
        json!({"id": "zlib", "level": 1}),
        json!({"id": "bz2", "level": 1}),
        json!({"id": "blosc", "cname": "lz4", "clevel": 5, "shuffle": 1, "blocksize": 0}),
        json!({"id": "blosc", "cname": "zstd", "clevel": 5, "shuffle": 2, "blocksize": 0}),
    ];
    for compressor in compressors {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("store.zarr");
        let grid = grid(json!({"grid_mapping_name": "healpix", "refinement_level": 1, "indexing_scheme": "ring"}));
        let storage = crate::file::Storage {
            codecs: compressor.clone(),
            chunk: 48,
            ..crate::file::Storage::plain(Format::Zarr2)
        };
        File::of([data(48), grid]).zarr(&path, Format::Zarr2, &storage);
        let chunk = path.join("t/0");
        let whole = fs::read(&chunk).unwrap();
        for cut in 0..whole.len() {
            fs::write(&chunk, &whole[..cut]).unwrap();
            if let Ok(map) = read(&path) {
                // What is missing is no more than a checksum.
                assert_eq!(map.values()[47], 64.0, "{compressor} cut at {cut}");
            }
        }
        for at in 0..whole.len() {
            for bits in [0xff, 0x80, 0x01] {
                let mut changed = whole.clone();
                changed[at] ^= bits;
                fs::write(&chunk, &changed).unwrap();
                if let Err(error) = read(&path) {
                    assert!(error.path().is_some() && is(&error, ErrorKind::Unreadable, "the Zarr library says"));
                }
            }
        }
        for other in [vec![], vec![0; 1000], b"{}".to_vec()] {
            fs::write(&chunk, &other).unwrap();
            assert!(is(&problem(read(&path)).0, ErrorKind::Unreadable, "the Zarr library says"));
        }
    }
}
