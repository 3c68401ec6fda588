//! Pictures compared with those in `tests/pictures`: by eye these were found right, and no test may change them.
//!
//! Small differences, as of rounding or of an edge by a fraction of a pixel, do not count; a colour map, a line or a
//! letter that is another does. A picture that has no reference fails; `LONGAN_ADD_PICTURES=1` writes what is missing,
//! to be looked at and committed, and never replaces what is there.

use std::path::{Path, PathBuf};

use crate::cli::Folder;

/// Pixels are averaged over squares of this side before they are compared.
const BLUR: usize = 4;

/// The largest difference of such an average in a channel, in 255ths: an edge that is off by a tenth of a pixel makes
/// some 6, a thin line that is missing 20 and more.
const TOLERANCE: f64 = 12.0;

/// Red, green and blue of a picture, row by row.
struct Pixels {
    width: usize,
    height: usize,
    rgb: Vec<u8>,
}

fn pixels(path: &Path) -> Pixels {
    let file = std::io::BufReader::new(std::fs::File::open(path).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut rgb).unwrap();
    assert_eq!(info.color_type, png::ColorType::Rgb);
    Pixels { width: info.width as usize, height: info.height as usize, rgb }
}

/// The largest difference of two pictures of one size, after a blur, and where it is.
fn difference(a: &Pixels, b: &Pixels) -> (f64, (usize, usize)) {
    assert_eq!((a.width, a.height), (b.width, b.height), "the pictures have different sizes");
    let mut largest = (0.0, (0, 0));
    for y in (0..=a.height - BLUR).step_by(BLUR / 2) {
        for x in (0..=a.width - BLUR).step_by(BLUR / 2) {
            for channel in 0..3 {
                let mean = |of: &Pixels| {
                    let at = |k: usize| 3 * ((y + k / BLUR) * of.width + x + k % BLUR) + channel;
                    (0..BLUR * BLUR).map(|k| f64::from(of.rgb[at(k)])).sum::<f64>() / (BLUR * BLUR) as f64
                };
                let off = (mean(a) - mean(b)).abs();
                if off > largest.0 {
                    largest = (off, (x, y));
                }
            }
        }
    }
    largest
}

/// Where the reference of this name is.
fn reference(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/pictures").join(format!("{name}.png"))
}

/// Compares a picture with its reference.
#[track_caller]
fn compare(name: &str, path: &Path) {
    let reference = reference(name);
    if !reference.exists() {
        assert!(
            std::env::var_os("LONGAN_ADD_PICTURES").is_some(),
            "tests/pictures/{name}.png is missing: run the tests with LONGAN_ADD_PICTURES=1, look at it, and commit it"
        );
        std::fs::create_dir_all(reference.parent().unwrap()).unwrap();
        std::fs::copy(path, &reference).unwrap();
        return;
    }
    let (largest, (x, y)) = difference(&pixels(&reference), &pixels(path));
    assert!(largest <= TOLERANCE, "{name}: differs from its reference by {largest:.1} of 255 near ({x}, {y})");
}

/// A sky and its Minkowski map, bodies, and a field on the Earth.
fn folder() -> Folder {
    let folder = Folder::new();
    folder.done("simulate waves -o sky.fits --nside 32 --correlation 12 --seed 5 -q");
    folder.done("map sky.fits -o maps.fits --measure evq,evq-direction,psi3-direction --window 15 --nside-out 8 -q");
    folder.done("simulate shapes -o bodies.fits --nside 64 -q");
    folder
}

/// The words of each picture, by its name.
const PICTURES: [(&str, &str); 11] = [
    ("mollweide", "sky.fits"),
    ("hammer", "maps.fits --projection hammer --orientation earth --coastlines --centre 150,0"),
    ("orthographic", "sky.fits --projection orthographic --centre 30,40 --colours magma --title Both"),
    ("equirectangular", "maps.fits --projection equirectangular --log --label 'EVQ, logarithmic'"),
    ("gnomonic", "sky.fits --projection gnomonic --centre 10,80 --size 50 --orientation earth"),
    ("circles", "bodies.fits --circle -135,0,12 --circle 175,10,25 --circle 0,85,20 --mark -45,0,'3:1' --mark 100,40"),
    ("contours", "bodies.fits --contour-threshold 0.5 --projection gnomonic --centre 45,0 --size 25 --no-graticule"),
    ("contours-of-another", "maps.fits --contour sky.fits --contour-threshold -1,1 --colours greys"),
    ("rods", "maps.fits --column evq_direction --rods EVQ_DIRECTION"),
    ("stars", "maps.fits --rods psi3_direction --colours cividis --projection gnomonic --size 60"),
    ("range", "sky.fits --range -1,2 --colours purple-orange --title 'A range' --label 'value [σ]' --no-graticule"),
];

#[test]
fn pictures_look_as_they_did() {
    let folder = folder();
    for (name, words) in PICTURES {
        folder.done(&format!("plot {words} -o {name}.png --width 400 -q"));
        compare(name, &folder.path(format!("{name}.png")));
    }
}

#[test]
fn every_reference_is_of_a_picture() {
    let found = std::fs::read_dir(reference("x").parent().unwrap()).unwrap();
    for file in found {
        let name = file.unwrap().file_name().into_string().unwrap();
        assert!(PICTURES.iter().any(|(picture, _)| name == format!("{picture}.png")), "{name} is of no picture");
    }
}

#[test]
fn other_pictures_are_refused() {
    let folder = folder();
    let words = |name: &str| PICTURES.iter().find(|(picture, _)| *picture == name).unwrap().1;
    for (name, from, to) in [
        // Another colour map, a circle a little aside, another threshold, rods of another column, a letter.
        ("range", "purple-orange", "blue-red"),
        ("circles", "-135,0,12", "-133,0,12"),
        ("contours", "--contour-threshold 0.5", "--contour-threshold 0.02"),
        ("stars", "psi3_direction", "evq_direction"),
        ("range", "A range", "B range"),
        ("mollweide", "sky.fits", "sky.fits --orientation earth"),
        ("hammer", "--coastlines", ""),
        ("gnomonic", "10,80", "11,80"),
    ] {
        let changed = words(name).replace(from, to);
        assert_ne!(changed, words(name));
        folder.done(&format!("plot {changed} -o other.png --width 400 -q --overwrite"));
        let (largest, _) = difference(&pixels(&reference(name)), &pixels(&folder.path("other.png")));
        assert!(largest > 1.5 * TOLERANCE, "{name}, {changed}: only {largest}");
    }
}
