//! Zarr stores of both versions: compressors, chunks, groups, metadata.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use longan_formats::{At, ErrorKind, Place, Selection, open, read};
use serde_json::{Value, json};

use crate::file::{File, Format, Storage, Values, variable};
use crate::{assert_same, is, problem, ring_values};

/// Steps of [`cube`].
const STEPS: usize = 5;

/// A field of 5 steps of Nside 8, which makes 4 chunks of 192 pixels for each step.
fn cube() -> (File, Vec<Vec<f64>>) {
    let pixels = 768;
    let steps: Vec<Vec<f64>> = (0..STEPS)
        .map(|step| {
            (0..pixels).map(|p| if (p * 7 + step) % 31 == 0 { f64::NAN } else { (p * STEPS + step) as f64 }).collect()
        })
        .collect();
    let grid = json!({"grid_mapping_name": "healpix", "refinement_level": 3, "indexing_scheme": "ring"});
    let values = steps.concat().iter().map(|&v| v as f32).collect();
    let file = File::of([
        variable("t", &[("time", STEPS), ("cell", pixels)], Values::F32(values), json!({"grid_mapping": "crs"})),
        variable("crs", &[], Values::I32(vec![0]), grid),
        variable(
            "time",
            &[("time", STEPS)],
            Values::I64((0..STEPS as i64).collect()),
            json!({"units": "days since 2000-1-1"}),
        ),
    ]);
    (file, steps)
}

/// Writes [`cube`] with this storage.
fn write(folder: &Path, format: Format, storage: &Storage) -> (PathBuf, Vec<Vec<f64>>) {
    let (file, steps) = cube();
    let path = folder.join("cube.zarr");
    file.zarr(&path, format, storage);
    (path, steps)
}

#[track_caller]
fn check(path: &Path, steps: &[Vec<f64>], of: &str) {
    let mut maps = open(path, &Selection::default()).unwrap_or_else(|e| panic!("{of}: {e}"));
    assert_eq!(maps.times().len(), steps.len(), "{of}");
    for (step, expected) in steps.iter().enumerate() {
        let map = maps.read(step).unwrap_or_else(|e| panic!("{of}: {e}"));
        assert_same(map.values(), expected, &format!("{of}, step {step}"));
    }
}

fn storage(format: Format, chunk: usize) -> Storage {
    Storage { chunk, ..Storage::plain(format) }
}

#[test]
fn compressors_of_version_2() {
    let compressors = [
        Value::Null,
        json!({"id": "gzip", "level": 1}),
        json!({"id": "zlib", "level": 9}),
        json!({"id": "bz2", "level": 1}),
        json!({"id": "blosc", "cname": "lz4", "clevel": 5, "shuffle": 1, "blocksize": 0}),
        json!({"id": "blosc", "cname": "zstd", "clevel": 3, "shuffle": 2, "blocksize": 0}),
        json!({"id": "blosc", "cname": "blosclz", "clevel": 5, "shuffle": 0, "blocksize": 0}),
        json!({"id": "blosc", "cname": "zlib", "clevel": 5, "shuffle": -1, "blocksize": 0}),
        json!({"id": "blosc", "cname": "lz4hc", "clevel": 5, "shuffle": 1, "blocksize": 0}),
    ];
    for compressor in compressors {
        for (filters, order, big_endian) in [
            (Value::Null, "C", false),
            (Value::Null, "F", true),
            (json!([{"id": "shuffle", "elementsize": 4}]), "C", false),
        ] {
            let folder = tempfile::tempdir().unwrap();
            let storage =
                Storage { codecs: compressor.clone(), filters, order, big_endian, ..storage(Format::Zarr2, 192) };
            let (path, steps) = write(folder.path(), Format::Zarr2, &storage);
            check(&path, &steps, &format!("{compressor} {order}"));
        }
    }
}

#[test]
fn levels_that_are_not_named() {
    let (file, steps) = cube();
    for name in ["numcodecs.zlib", "numcodecs.bz2"] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cube.zarr");
        let codecs = chain(&Value::Null, "little", &json!([{"name": name, "configuration": {"level": 1}}]));
        file.zarr(&path, Format::Zarr3, &Storage { codecs, ..storage(Format::Zarr3, 192) });
        let metadata = path.join("t/zarr.json");
        let mut array: Value = serde_json::from_slice(&fs::read(&metadata).unwrap()).unwrap();
        array["codecs"][1]["configuration"] = json!({});
        fs::write(&metadata, array.to_string()).unwrap();
        check(&path, &steps, name);
    }
}

#[test]
fn chunks_of_several_steps_are_decoded_once() {
    let folder = tempfile::tempdir().unwrap();
    let (path, steps) = write(folder.path(), Format::Zarr2, &storage(Format::Zarr2, 192));
    let mut maps = open(&path, &Selection::default()).unwrap();
    maps.read(0).unwrap();
    for chunk in chunks(&path) {
        fs::write(chunk, "xx").unwrap();
    }
    for (step, expected) in steps.iter().enumerate() {
        assert_same(maps.read(step).unwrap().values(), expected, "a chunk that is kept");
    }
    assert!(open(&path, &Selection::default()).unwrap().read(0).is_err());
}

/// Codecs of version 3, after that to bytes.
fn codecs_3() -> Vec<Value> {
    vec![
        json!([]),
        json!([{"name": "gzip", "configuration": {"level": 1}}]),
        json!([{"name": "blosc", "configuration":
            {"cname": "lz4", "clevel": 5, "shuffle": "shuffle", "typesize": 4, "blocksize": 0}}]),
        json!([{"name": "blosc", "configuration":
            {"cname": "zstd", "clevel": 5, "shuffle": "bitshuffle", "typesize": 4, "blocksize": 0}}]),
        json!([{"name": "crc32c"}]),
        json!([{"name": "gzip", "configuration": {"level": 5}}, {"name": "crc32c"}]),
        json!([{"name": "numcodecs.zlib", "configuration": {"level": 5}}]),
        json!([{"name": "numcodecs.bz2", "configuration": {"level": 5}}]),
        json!([{"name": "numcodecs.shuffle", "configuration": {"elementsize": 4}}, {"name": "gzip", "configuration": {"level": 5}}]),
    ]
}

fn chain(before: &Value, bytes: &str, after: &Value) -> Value {
    let mut chain = before.as_array().cloned().unwrap_or_default();
    chain.push(json!({"name": "bytes", "configuration": {"endian": bytes}}));
    chain.extend(after.as_array().cloned().unwrap_or_default());
    Value::Array(chain)
}

#[test]
fn codecs_of_version_3() {
    let (file, steps) = cube();
    let file = File { variables: file.variables[..2].to_vec(), ..file };
    for after in codecs_3() {
        for (endian, transposed) in [("little", false), ("big", false), ("little", true)] {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("cube.zarr");
            // A scalar cannot be transposed in two dimensions.
            let codecs = chain(&Value::Null, endian, &after);
            File::of([file.variables[1].clone()]).zarr(
                &path,
                Format::Zarr3,
                &Storage { codecs, ..storage(Format::Zarr3, 192) },
            );
            let before = if transposed {
                json!([{"name": "transpose", "configuration": {"order": [1, 0]}}])
            } else {
                Value::Null
            };
            let codecs = chain(&before, endian, &after);
            File::of([file.variables[0].clone()]).zarr(
                &path,
                Format::Zarr3,
                &Storage { codecs, ..storage(Format::Zarr3, 192) },
            );
            check(&path, &steps, &format!("{after} {endian} {transposed}"));
        }
    }
}

#[test]
fn shards() {
    let (file, steps) = cube();
    for after in codecs_3() {
        for location in ["start", "end"] {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("cube.zarr");
            File::of(file.variables[1..].to_vec()).zarr(&path, Format::Zarr3, &Storage::plain(Format::Zarr3));
            let codecs = json!([{"name": "sharding_indexed", "configuration": {
                "chunk_shape": [1, 64],
                "codecs": chain(&Value::Null, "little", &after),
                "index_codecs": chain(&Value::Null, "little", &json!([{"name": "crc32c"}])),
                "index_location": location,
            }}]);
            let t = File::of([file.variables[0].clone()]);
            t.zarr(&path, Format::Zarr3, &Storage { codecs, ..storage(Format::Zarr3, 768) });
            check(&path, &steps, &format!("{after} {location}"));
        }
    }
}

/// Writes the chunks of `t` in [`cube`] anew, with a function from plain bytes.
fn rewrite(path: &Path, compressor: Value, pack: impl Fn(&[u8]) -> Vec<u8>) {
    let metadata = path.join("t/.zarray");
    let mut array: Value = serde_json::from_slice(&fs::read(&metadata).unwrap()).unwrap();
    array["compressor"] = compressor;
    fs::write(&metadata, array.to_string()).unwrap();
    for chunk in chunks(path) {
        let plain = fs::read(&chunk).unwrap();
        fs::write(&chunk, pack(&plain)).unwrap();
    }
}

/// The files of chunks of `t`, in version 2.
fn chunks(path: &Path) -> Vec<PathBuf> {
    let files = fs::read_dir(path.join("t")).unwrap().map(|entry| entry.unwrap().path());
    let mut chunks: Vec<_> =
        files.filter(|path| !path.file_name().unwrap().to_str().unwrap().starts_with(".z")).collect();
    chunks.sort();
    chunks
}

#[test]
fn zstd_without_and_with_its_size() {
    let folder = tempfile::tempdir().unwrap();
    let compressor = || json!({"id": "zstd", "level": 3, "checksum": true});
    let (path, steps) = write(folder.path(), Format::Zarr2, &storage(Format::Zarr2, 192));
    rewrite(&path, compressor(), |bytes| zstd::bulk::compress(bytes, 3).unwrap());
    check(&path, &steps, "with its size");

    let folder = tempfile::tempdir().unwrap();
    let (path, steps) = write(folder.path(), Format::Zarr2, &storage(Format::Zarr2, 192));
    rewrite(&path, compressor(), |bytes| {
        let mut encoder = zstd::Encoder::new(Vec::new(), 3).unwrap();
        encoder.include_checksum(true).unwrap();
        encoder.include_contentsize(false).unwrap();
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    });
    check(&path, &steps, "without its size");

    // One that says it holds far more than a chunk, and one that does hold more.
    for bytes in [
        vec![0x28, 0xb5, 0x2f, 0xfd, 0xe0, 0, 0, 0, 0, 0, 1, 0, 0, 1, 0, 0],
        zstd::bulk::compress(&[0; 1 << 20], 3).unwrap(),
    ] {
        fs::write(&chunks(&path)[0], bytes).unwrap();
        let (error, told) =
            problem(open(&path, &Selection::default()).unwrap().read(0).map_err(|e| e.with_path(&path)));
        assert!(is(&error, ErrorKind::Unreadable, "the Zarr library says"), "{told}");
    }
}

fn step(step: usize) -> Selection {
    Selection { at: vec![At { dimension: "time".into(), place: Place::Index(step) }], ..Selection::default() }
}

#[test]
fn only_the_chunks_that_are_needed_are_read() {
    for format in [Format::Zarr2, Format::Zarr3] {
        let folder = tempfile::tempdir().unwrap();
        let (file, steps) = cube();
        let path = folder.path().join("cube.zarr");
        file.zarr(&path, format, &Storage { steps: 1, ..storage(format, 192) });
        let of_step = |step: usize| match format {
            Format::Zarr2 => path.join(format!("t/{step}.2")),
            _ => path.join(format!("t/c/{step}/2")),
        };
        for damaged in [0, 1, 3, 4] {
            fs::write(of_step(damaged), b"xx").unwrap();
        }
        let map = read(&path, &step(2)).unwrap();
        assert_same(map.values(), &steps[2], "the step that is whole");
        let (error, told) = problem(read(&path, &step(3)));
        assert!(is(&error, ErrorKind::Unreadable, "cannot read the array 't': the Zarr library says"), "{told}");
    }
}

#[test]
fn chunks_that_were_never_written_are_missing() {
    for format in [Format::Zarr2, Format::Zarr3] {
        let folder = tempfile::tempdir().unwrap();
        let (path, mut steps) = write(folder.path(), format, &storage(format, 192));
        let chunk = if format == Format::Zarr2 { "t/0.2" } else { "t/c/0/2" };
        fs::remove_file(path.join(chunk)).unwrap();
        for step in &mut steps {
            step[384..576].fill(f64::NAN);
        }
        check(&path, &steps, "a chunk less");
    }
    // Whole numbers: what was never written has the fill value, which means missing only if it is CF's.
    let grid = json!({"grid_mapping_name": "healpix", "refinement_level": 1, "indexing_scheme": "ring"});
    for (format, fill, expected) in [
        (Format::Zarr2, json!({"grid_mapping": "crs", "_FillValue": 0}), f64::NAN),
        (Format::Zarr2, json!({"grid_mapping": "crs"}), 0.0),
        (Format::Zarr3, json!({"grid_mapping": "crs", "_FillValue": 0}), f64::NAN),
        (Format::Zarr3, json!({"grid_mapping": "crs"}), 0.0),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("whole.zarr");
        File::of([
            variable("n", &[("cell", 48)], Values::I32((1..49).collect()), fill),
            variable("crs", &[], Values::I32(vec![1]), grid.clone()),
        ])
        .zarr(&path, format, &storage(format, 16));
        fs::remove_file(path.join(if format == Format::Zarr2 { "n/1" } else { "n/c/1" })).unwrap();
        let map = crate::read(&path).unwrap();
        let expected: Vec<_> = (0..48).map(|p| if (16..32).contains(&p) { expected } else { p as f64 + 1.0 }).collect();
        assert_same(map.values(), &expected, &format!("{format:?}"));
    }
}

#[test]
fn groups() {
    for format in [Format::Zarr2, Format::Zarr3] {
        let folder = tempfile::tempdir().unwrap();
        let grid = json!({"grid_mapping_name": "healpix", "refinement_level": 1, "indexing_scheme": "ring"});
        let t = variable("t", &[("cell", 48)], Values::F64(ring_values()), json!({"grid_mapping": "crs"}));
        let path = folder.path().join("nested.zarr");
        // The grid is described in the group around that of the field.
        File::of([variable("crs", &[], Values::I32(vec![0]), grid)]).zarr(&path, format, &Storage::plain(format));
        File::of([]).zarr(&path.join("a"), format, &Storage::plain(format));
        File::of([t]).zarr(&path.join("a/b"), format, &Storage::plain(format));
        let map = read(&path, &crate::field("a/b/t")).unwrap();
        assert_same(map.values(), &ring_values(), "by its path");
        assert_same(crate::read(&path).unwrap().values(), &ring_values(), "alone");
        // Folders that are no part of the store, and links that lead back.
        fs::create_dir(path.join("other")).unwrap();
        fs::write(path.join("other/file"), "").unwrap();
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink("..", path.join("a/loop")).unwrap();
            let (error, _) = problem(crate::read(&path));
            assert!(is(&error, ErrorKind::Ambiguous, "there are several variables"));
        }
    }
}

#[test]
fn consolidated_metadata() {
    // Version 2: all in one file, and none beside the chunks.
    let folder = tempfile::tempdir().unwrap();
    let (path, steps) = write(folder.path(), Format::Zarr2, &storage(Format::Zarr2, 192));
    let mut all = serde_json::Map::new();
    let mut take = |key: &str| {
        if let Ok(bytes) = fs::read(path.join(key)) {
            all.insert(key.to_owned(), serde_json::from_slice(&bytes).unwrap());
            fs::remove_file(path.join(key)).unwrap();
        }
    };
    [".zgroup", ".zattrs"].into_iter().for_each(&mut take);
    for array in ["t", "crs", "time"] {
        [".zarray", ".zattrs"].into_iter().for_each(|file| take(&format!("{array}/{file}")));
    }
    let consolidated = json!({"zarr_consolidated_format": 1, "metadata": all});
    fs::write(path.join(".zmetadata"), consolidated.to_string()).unwrap();
    check(&path, &steps, "version 2");

    let folder = tempfile::tempdir().unwrap();
    let (path, steps) = write(folder.path(), Format::Zarr3, &storage(Format::Zarr3, 192));
    let mut all = serde_json::Map::new();
    for array in ["t", "crs", "time"] {
        let file = path.join(array).join("zarr.json");
        all.insert(array.to_owned(), serde_json::from_slice(&fs::read(&file).unwrap()).unwrap());
        fs::remove_file(file).unwrap();
    }
    let mut root: Value = serde_json::from_slice(&fs::read(path.join("zarr.json")).unwrap()).unwrap();
    root["consolidated_metadata"] = json!({"kind": "inline", "must_understand": false, "metadata": all});
    fs::write(path.join("zarr.json"), root.to_string()).unwrap();
    check(&path, &steps, "version 3");
}
