//! Files exchanged with healpy, by the interpreter that `LONGAN_PYTHON` names, else `python3`.

use std::path::Path;
use std::process::Command;
use std::sync::OnceLock;

use longan::smoothing::Smoothing;
use longan_formats::{Card, CardValue, Column, Extension, HealpixFile, write_healpix};
use longan_grid::{CoordinateSystem, Healpix, Ordering};

use super::cli::Folder;
use longan_support::{difference, masked, noise};

/// The interpreter, if it has healpy and astropy.
fn interpreter() -> Option<&'static str> {
    static PYTHON: OnceLock<Option<String>> = OnceLock::new();
    PYTHON.get_or_init(|| longan_support::python_with("healpy")).as_deref()
}

/// Runs a script in a folder.
#[track_caller]
fn run(python: &str, folder: &Folder, script: &str) {
    let script = format!("import numpy as np, healpy as hp\nfrom astropy.io import fits\n{script}");
    let output =
        Command::new(python).args(["-W", "ignore", "-c", &script]).current_dir(folder.path("")).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// A file of one column for healpy to read.
fn write(path: &Path, name: &str, map: &longan::Map, ordering: Ordering) {
    let column = Column { name: name.to_owned(), unit: "mK".to_owned(), values: map.values().to_vec() };
    let card = Card { key: "ORIGIN".to_owned(), value: CardValue::Text("test".to_owned()), comment: String::new() };
    let extension = Extension { name: "MAP".to_owned(), cards: vec![card], history: vec![], columns: vec![column] };
    let file = HealpixFile {
        grid: map.grid(),
        ordering,
        coordinates: Some(CoordinateSystem::Galactic),
        float32: false,
        extensions: vec![extension],
    };
    write_healpix(path, &file, false).unwrap();
}

/// What longan reads in its own file, for Python: little-endian doubles, NaN where masked.
fn dump(folder: &Folder, name: &str, fields: &[&str]) {
    let values = fields.iter().flat_map(|field| folder.read(name, field).values().to_vec());
    std::fs::write(folder.path(format!("{name}.raw")), values.flat_map(f64::to_le_bytes).collect::<Vec<_>>()).unwrap();
}

#[test]
fn healpy_opens_outputs_as_they_stand() {
    let Some(python) = interpreter() else { return };
    let folder = Folder::new();
    // Without the southern cap, for masked windows, and with a coordinate system.
    let sky = masked(&noise(16, 1000, 1), |pixel| pixel > 2800);
    write(&folder.path("sky.fits"), "T", &sky, Ordering::Ring);
    let measures = "--measure evq,psi2-direction,rank4-mid --window 12";
    folder.done(&format!("map sky.fits -o ring.fits {measures}"));
    folder.done(&format!("map sky.fits -o nested.fits {measures} --ordering nested"));
    folder.done(&format!("map sky.fits -o single.fits {measures} --float32"));
    folder.done(&format!("map sky.fits -o zipped.fits.gz {measures}"));
    folder.done(
        "map sky.fits -o small.fits --measure evq,psi2-direction,rank4-mid --window 60 --nside-out 3 --max-masked 0.5",
    );
    folder.done("map sky.fits -o each.fits --measure evq --window 12 --thresholds 300,500,700 --sequence");
    let fields = ["EVQ", "PSI2_DIRECTION", "RANK4_MID"];
    for name in ["ring.fits", "nested.fits", "single.fits", "zipped.fits.gz", "small.fits"] {
        dump(&folder, name, &fields);
    }
    let each = |hdu| folder.read_hdu("each.fits", "EVQ", Some(hdu)).values().to_vec();
    let each: Vec<u8> = (1..=3).flat_map(each).flat_map(f64::to_le_bytes).collect();
    std::fs::write(folder.path("each.fits.raw"), each).unwrap();
    folder.done("simulate waves -o waves.fits --nside 32 --correlation 10");
    dump(&folder, "waves.fits", &["WAVES"]);
    run(
        python,
        &folder,
        r#"
def same(maps, name):
    raw = np.fromfile(name + '.raw')
    maps = np.concatenate([np.atleast_1d(m) for m in maps])
    assert maps.shape == raw.shape, (name, maps.shape, raw.shape)
    bad = np.isnan(raw)
    assert (maps[bad] == hp.UNSEEN if maps.dtype == np.float64 else np.isclose(maps[bad], hp.UNSEEN, rtol=1e-6)).all(), name
    assert (hp.mask_bad(maps) == bad).all() and (maps[~bad] == raw[~bad]).all(), name
    return bad

for name, nside, ordering in [('ring.fits', 16, 'RING'), ('nested.fits', 16, 'NESTED'), ('single.fits', 16, 'RING'),
                              ('zipped.fits.gz', 16, 'RING'), ('small.fits', 3, 'RING')]:
    maps, header = hp.read_map(name, field=None, dtype=None, h=True)
    assert maps.shape == (3, 12 * nside**2), maps.shape
    bad = same(maps, name)
    assert bad.any() == (name != 'small.fits') and not bad.all(), name
    assert (hp.read_map(name, field=1, dtype=None) == maps[1]).all()
    raw = hp.read_map(name, dtype=None, nest=None)
    assert (raw == (hp.reorder(maps[0], r2n=True) if ordering == 'NESTED' else maps[0])).all(), name
    table = fits.open(name)
    table.verify('exception')
    header, data = table[1].header, table[1].data
    expected = dict(PIXTYPE='HEALPIX', NSIDE=nside, ORDERING=ordering, INDXSCHM='IMPLICIT', OBJECT='FULLSKY',
                    COORDSYS='G', FIRSTPIX=0, LASTPIX=12 * nside**2 - 1, TTYPE1='EVQ', TTYPE2='PSI2_DIRECTION',
                    TUNIT2='deg', TTYPE3='RANK4_MID', TUNIT3='rad', INFILE='sky.fits', INFIELD='T', INUNIT='mK',
                    INNSIDE=16, WINDOW=60 if name == 'small.fits' else 12, BODY='above', NTHRESH=13)
    for key, value in expected.items():
        assert header[key] == value, (name, key, header[key])
    assert data['EVQ'].dtype.itemsize == (4 if name == 'single.fits' else 8)

same([hp.read_map('each.fits', hdu=hdu, dtype=None) for hdu in (1, 2, 3)], 'each.fits')
table = fits.open('each.fits')
assert [h.header['THR1'] for h in table[1:]] == [300, 500, 700] and len(table) == 4
assert [h.header['EXTNAME'] for h in table[1:]] == ['THRESHOLD 1', 'THRESHOLD 2', 'THRESHOLD 3']
same([hp.read_map('waves.fits', dtype=None)], 'waves.fits')
"#,
    );
}

#[test]
fn maps_that_healpy_writes_give_the_same_minkowski_map() {
    let Some(python) = interpreter() else { return };
    let folder = Folder::new();
    // Whole numbers that all types of number hold: of one field and, to be masked, of another.
    let levels = [("bytes", 200), ("truths", 2)];
    for (name, levels) in levels {
        for nside in [1, 3, 4, 64] {
            let map = noise(nside, levels, 7 + nside as u64);
            write(&folder.path(format!("{name}{nside}.fits")), "T", &map, Ordering::Ring);
        }
    }
    write(&folder.path("holes64.fits"), "T", &masked(&noise(64, 200, 5), |pixel| pixel % 5000 < 700), Ordering::Ring);
    std::fs::create_dir(folder.path("healpy")).unwrap();
    run(
        python,
        &folder,
        r#"
import glob, os
count = 0
def write(group, what, *args, **kwargs):
    global count
    count += 1
    hp.write_map(f'healpy/{group}-{what}', *args, overwrite=True, **kwargs)

for name in sorted(glob.glob('*.fits')):
    group = name[:-5]
    m = hp.read_map(name, dtype=np.float64)
    other = m[::-1].copy()
    nside = hp.get_nside(m)
    types = [np.float64, np.float32]
    if group.startswith('bytes'):
        types += [np.int16, np.int32, np.int64, np.uint8]
    if group.startswith('truths'):
        types += [np.uint8, np.int32, bool]
    for dtype in types:
        write(group, f'{np.dtype(dtype).name}.fits', m.astype(dtype), dtype=dtype)
    write(group, 'rows.fits', m, dtype=np.float64, fits_IDL=False)
    write(group, 'zipped.fits.gz', m, dtype=np.float64)
    write(group, 'columns.fits', [m, other, other], dtype=[np.float32, np.float64, np.float64], column_names=['T', 'Q', 'U'])
    write(group, 'coordinates.fits', m, dtype=np.float64, coord='E', column_units='K', extra_header=[('ORIGIN', 'x')])
    if nside != 3:
        nest = hp.reorder(m, r2n=True)
        write(group, 'nest.fits', nest, nest=True, dtype=np.float64)
        write(group, 'nest32.fits.gz', nest, nest=True, dtype=np.float32, fits_IDL=False)
        write(group, 'nestcolumns.fits', [nest, nest[::-1]], nest=True, dtype=np.float64, column_names=['T', 'Q'])
    # healpy has no type for the pixel numbers of the smallest maps.
    if nside > 3:
        write(group, 'partial.fits', m, partial=True, dtype=np.float64)
        write(group, 'partial32.fits', [m, m], partial=True, dtype=np.float32, column_names=['T', 'Q'])
        write(group, 'partialnest.fits', nest, nest=True, partial=True, dtype=np.float64)
assert count > 80, count
"#,
    );
    let mut outputs = 0;
    for group in ["bytes1", "bytes3", "bytes4", "bytes64", "truths1", "truths3", "truths4", "truths64", "holes64"] {
        let options = format!(
            "--thresholds {} --window 20 --max-masked 0.5 --nside-out 2 --ordering ring --measure evq,w0,masked-fraction",
            if group.starts_with("truths") { "0.5" } else { "-1:1:5 --threshold-unit sigma" }
        );
        folder.done(&format!("map {group}.fits -o expected/ {options}"));
        let read =
            |name: &str| ["EVQ", "W0", "MASKED_FRACTION"].map(|field| folder.read(name, field).values().to_vec());
        let expected = read(&format!("expected/{group}.fits")).concat();
        assert!(expected.iter().any(|v| v.is_finite()), "{group}");
        let files =
            std::fs::read_dir(folder.path("healpy")).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap());
        let files: Vec<String> = files.filter(|name| name.starts_with(&format!("{group}-"))).collect();
        folder.done(&format!("map healpy/{} -o {group} {options}", files.join(" healpy/")));
        for file in files {
            let found = read(&format!("{group}/{file}")).concat();
            assert_eq!(difference(&found, &expected), 0.0, "{file}");
            outputs += 1;
        }
    }
    assert!(outputs > 80, "{outputs}");
}

#[test]
fn healpy_opens_deviations() {
    let Some(python) = interpreter() else { return };
    let folder = Folder::new();
    for seed in 0..4 {
        folder.done(&format!("simulate waves -o {seed}.fits --nside 16 --correlation 15 --seed {seed}"));
    }
    folder.done("map 0.fits 1.fits 2.fits 3.fits -o maps --measure evq,rank4-mid --window 12");
    let words = "compare maps/0.fits maps/1.fits maps/2.fits maps/3.fits";
    folder.done(&format!("{words} -o deviation.fits --smooth 10 --ordering nested"));
    run(
        python,
        &folder,
        r#"
names = ['MEAN', 'STD', 'SIGMA', 'LOCAL_PERCENTILE', 'GLOBAL_PERCENTILE', 'COUNT']
maps, header = hp.read_map('deviation.fits', field=None, dtype=None, h=True)
header = dict(header)
assert maps.shape == (12, 3072), maps.shape
columns = [header[f'TTYPE{i}'] for i in range(1, 13)]
assert columns == [f'{measure}_{name}' for measure in ('EVQ', 'RANK4_MID') for name in names], columns
assert header['NSIMS'] == 3 and header['SMOOTH'] == 10 and header['TUNIT8'] == 'rad', header
mean, std, sigma, local, world, count = maps[:6]
assert (count == 3).all() and set(np.round(local)) <= {0, 33, 67, 100}
assert (0 <= world).all() and (world <= 100).all() and abs(world.mean() - 50) < 10, world.mean()
data = [hp.read_map(f'maps/{i}.fits', dtype=None) for i in range(4)]
smooth = [hp.smoothing(m, fwhm=np.radians(10), iter=10) for m in data]
for found, expected in [(mean, np.mean(smooth[1:], axis=0)), (std, np.std(smooth[1:], axis=0, ddof=1))]:
    assert abs(found - expected).max() < 1e-2 * expected.max(), abs(found - expected).max()
"#,
    );
}

#[test]
fn smoothing_agrees_with_healpy() {
    let Some(python) = interpreter() else { return };
    let folder = Folder::new();
    run(
        python,
        &folder,
        r#"
rng = np.random.default_rng(1)
nside, lmax = 64, 24
alm = rng.normal(size=hp.Alm.getsize(lmax)) + 1j * rng.normal(size=hp.Alm.getsize(lmax))
alm[:lmax + 1] = alm[:lmax + 1].real
smooth = lambda fwhm: hp.alm2map(hp.smoothalm(alm, fwhm=np.radians(fwhm), inplace=False), nside, lmax=lmax)
np.array([hp.alm2map(alm, nside, lmax=lmax), smooth(5), smooth(12), smooth(40)]).tofile('maps.raw')
# The harmonics of the map are those it was made of, so that this is healpy's smoothing.
again = hp.smoothing(hp.alm2map(alm, nside, lmax=lmax), fwhm=np.radians(12), lmax=lmax, iter=20)
assert abs(again - smooth(12)).max() < 1e-6 * abs(smooth(12)).max(), abs(again - smooth(12)).max()
"#,
    );
    let bytes = std::fs::read(folder.path("maps.raw")).unwrap();
    let values: Vec<f64> = bytes.chunks(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect();
    let maps: Vec<&[f64]> = values.chunks(12 * 64 * 64).collect();
    let scale = maps[0].iter().fold(0.0, |a: f64, b| a.max(b.abs()));
    for (fwhm, expected) in [(5.0, maps[1]), (12.0, maps[2]), (40.0, maps[3])] {
        let smoothing = Smoothing::new(Healpix::new(64).unwrap(), fwhm).unwrap();
        let found = smoothing.apply(&[maps[0]]).unwrap().remove(0);
        let off = difference(&found, expected) / scale;
        assert!(off < 5e-6, "{fwhm} degrees: off by {off:e} of the largest value");
    }
}
