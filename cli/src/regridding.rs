//! The way in which a field came to HEALPix, as people and headers are told of it.
//!
//! The choice of the way is left to [`longan_grid`].

use std::collections::HashSet;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use longan_formats::Card;
use longan_grid::{Gather, Map, Method, Regridded, Way};

use super::cards::{real, text};
use super::options::{Running, shown};

/// The header entry that names the way.
pub(crate) const WAY: &str = "REGRID";

/// The header entry that says how many sides of a pixel make the spacing.
pub(crate) const RATIO: &str = "REGRATIO";

/// The header entries about it; none for a map that was HEALPix.
pub(crate) fn cards(map: &Map) -> Vec<Card> {
    let Some(regridded) = &map.regridded else { return Vec::new() };
    let mut cards = vec![text(WAY, regridded.way.to_string(), "how the input came to HEALPix")];
    cards.extend(regridded.ratio().map(|ratio| real(RATIO, ratio, "spacing of the input, in sides of a pixel")));
    cards
}

/// What the line about a map says of the way: another one than the usual, that was taken since pixels are fine, or what
/// the usual one does to contours.
pub(crate) fn note(map: &Map) -> Option<String> {
    let few = map.regridded.filter(|regridded| regridded.by_default).and_then(|regridded| regridded.smoother());
    unusual(map).or_else(|| {
        let smoother = Way::Points(few?);
        let percent = 100.0 * map.regridded?.empty;
        Some(format!(
            "means of the points in each pixel: {percent:.0} % of the pixels hold none, so contours come out too long; \
             --gather {smoother} or a smaller --nside avoids that"
        ))
    })
}

/// Another way than the usual one that was taken since pixels are fine.
fn unusual(map: &Map) -> Option<String> {
    let regridded = map.regridded.filter(|regridded| regridded.by_default && regridded.is_finer())?;
    let [pixel, spacing] = [regridded.pixel(), regridded.spacing?].map(degrees);
    let Regridded { way, without_rim, .. } = regridded;
    match way {
        Way::Grid(Method::Bilinear) => {
            let rim = if without_rim { ", without the outer halves of the outermost cells" } else { "" };
            Some(format!("interpolated ({way}{rim}): pixels of {pixel} are finer than the grid of {spacing}"))
        }
        Way::Points(Gather::Gaussian { .. }) => {
            Some(format!("smoothed ({way}): pixels of {pixel} are finer than the distance of {spacing} between points"))
        }
        _ => None,
    }
}

/// Why contours of a map come out wrong, and what to do about it.
pub(crate) fn warning(path: &Path, map: &Map) -> Option<String> {
    let regridded = map.regridded.filter(Regridded::has_steps)?;
    let [pixel, spacing] = [regridded.pixel(), regridded.spacing?].map(degrees);
    let (times, nside) = (digits(regridded.ratio()?, 2), regridded.suitable_nside()?);
    let (than, so, option) = match regridded.way {
        Way::Grid(_) => {
            (format!("the grid's cells of {spacing}"), "conservative regridding draws their outlines", "--method")
        }
        Way::Points(_) => (
            format!("the distance of {spacing} between points"),
            "most of them take the value of the nearest point, which draws outlines about points",
            "--gather",
        ),
    };
    let otherwise = if regridded.by_default { String::new() } else { format!("leave out {option}, or ") };
    Some(format!(
        "{}: pixels of {pixel} are {times} times finer than {than}, so {so}, and contours come out too long; \
         {otherwise}choose --nside {nside}",
        shown(path)
    ))
}

/// The notes and warnings of a run, so that many files do not repeat the same.
#[derive(Default)]
pub(crate) struct Notices(Mutex<HashSet<String>>);

impl Notices {
    /// Prints note and warning about a file's maps on standard error, unless they were printed for another file.
    pub(crate) fn say(&self, running: &Running, path: &Path, map: &Map) {
        self.say_note(running, path, note(map));
        if let Some(warning) = warning(path, map).filter(|warning| self.is_new(path, warning)) {
            running.warn(warning);
        }
    }

    /// Prints a note on standard error, unless it was printed for another file.
    pub(crate) fn say_note(&self, running: &Running, path: &Path, note: Option<String>) {
        if let Some(note) = note.filter(|note| self.is_new(path, note)) {
            running.note(format_args!("{}: {note}", shown(path)));
        }
    }

    /// Whether a sentence, but for the file's name, was not printed before.
    fn is_new(&self, path: &Path, sentence: &str) -> bool {
        let of_any = sentence.strip_prefix(&shown(path)).unwrap_or(sentence);
        self.0.lock().unwrap_or_else(PoisonError::into_inner).insert(of_any.to_owned())
    }
}

/// An angle for people.
fn degrees(angle: f64) -> String {
    format!("{}°", digits(angle, 3))
}

/// A number rounded to so many digits.
fn digits(x: f64, count: usize) -> f64 {
    format!("{x:.*e}", count - 1).parse().unwrap_or(x)
}
