//! Mismatches that would pass in silence: what cannot be meant is refused with both sides named, what may be meant is
//! warned of.
//!
//! Here they are only judged and put into words. What maps are is left to [`input`](super::input), how a line is printed
//! to [`Running`].

use std::path::{Path, PathBuf};

use anyhow::bail;
use longan::thresholds::Doubt;
use longan::{Analysis, ThresholdUnit};
use longan_formats::{About, units_differ};
use longan_grid::{CoordinateSystem, Map, Sphere};

use super::options::{Running, Topic, decimals, shown};

/// Names of Stokes parameters whose values depend on the coordinate system, in small letters.
const STOKES: [&str; 2] = ["q", "u"];

/// Words that may stand beside them in a map's name.
const BESIDE_STOKES: [&str; 5] = ["stokes", "pol", "polarisation", "polarization", "map"];

/// Why two maps do not share a sphere, where both name their coordinate system.
pub(crate) fn of_coordinates(
    (what, one): (&str, Option<CoordinateSystem>),
    (other_what, other): (&str, Option<CoordinateSystem>),
) -> Option<String> {
    let (one, other) = one.zip(other).filter(|(one, other)| one != other)?;
    let [one, other] = [one, other].map(CoordinateSystem::name);
    Some(format!(
        "{what} is in {one} coordinates, but {other_what} is in {other} ones; rotate one of them into the coordinates of \
         the other, or insist with --ignore-coordsys"
    ))
}

/// Maps of one run, which have to go together.
pub(crate) struct Together {
    /// Whether coordinate systems matter.
    coordinates: bool,
    /// Whether units matter, as they do to thresholds in the map's unit.
    units: bool,
    /// The first map that names its coordinate system.
    in_system: Option<(PathBuf, CoordinateSystem)>,
    /// The first map that names its unit.
    in_unit: Option<(PathBuf, String)>,
}

impl Together {
    /// No map yet.
    pub(crate) fn new(coordinates: bool, units: bool) -> Self {
        Together { coordinates, units, in_system: None, in_unit: None }
    }

    /// One more map.
    ///
    /// # Errors
    /// Where it is in other coordinates, or in another unit, than one before.
    pub(crate) fn add(&mut self, path: &Path, about: &About) -> anyhow::Result<()> {
        if let Some(system) = about.coordinates.filter(|_| self.coordinates) {
            let (first, first_system) = self.in_system.get_or_insert_with(|| (path.to_owned(), system));
            let (one, other) = ((&*shown(first), Some(*first_system)), (&*shown(path), Some(system)));
            if let Some(mismatch) = of_coordinates(one, other) {
                bail!(mismatch);
            }
        }
        if let Some(unit) = about.unit.as_ref().filter(|_| self.units) {
            let (first, first_unit) = self.in_unit.get_or_insert_with(|| (path.to_owned(), unit.clone()));
            if units_differ(first_unit, unit) {
                bail!(
                    "the thresholds are in the map's unit, which is {first_unit} in {} but {unit} in {}; convert one of \
                     them, or count thresholds in standard deviations with --threshold-unit sigma",
                    shown(first),
                    shown(path)
                );
            }
        }
        Ok(())
    }
}

/// Warns of what may be meant but seldom is, before a map is measured; of each kind once in a run. `several` is whether
/// the run measures other maps too.
pub(crate) fn warn(running: &Running, path: &Path, map: &Map, analysis: &Analysis, several: bool) {
    if running.quiet {
        return;
    }
    let once = if several { " (only the first such map is named)" } else { "" };
    if map.sphere == Sphere::Sky && is_stokes(&map.name) {
        running.warn_once(
            Topic::Stokes,
            format_args!(
                "{}: '{}' is a Stokes parameter, whose values and so shapes depend on the coordinate system; measure maps \
                 of E and B instead{once}",
                shown(path),
                map.name.escape_debug()
            ),
        );
    }
    if let Some(doubt) = analysis.doubt(map) {
        let doubt = of_thresholds(doubt, analysis, map.unit.as_deref());
        running.warn_once(Topic::Thresholds, format_args!("{}: {doubt}{once}", shown(path)));
    }
}

/// Whether a name is that of a map of Stokes Q or U.
fn is_stokes(name: &str) -> bool {
    let name = name.to_lowercase();
    let words: Vec<&str> = name.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty()).collect();
    let (parameters, others): (Vec<&str>, Vec<&str>) = words.into_iter().partition(|word| STOKES.contains(word));
    parameters.len() == 1 && others.iter().all(|word| BESIDE_STOKES.contains(word))
}

/// The doubt about thresholds, in words.
fn of_thresholds(doubt: Doubt, analysis: &Analysis, unit: Option<&str>) -> String {
    let values = analysis.thresholds.values();
    let (first, last) = (values[0], values[values.len() - 1]);
    let range = if values.len() > 1 { format!("thresholds {first} to {last}") } else { format!("threshold {first}") };
    let in_sigma = analysis.threshold_unit == ThresholdUnit::Sigma;
    let unit = unit.map(|unit| format!(", {}", unit.escape_debug())).unwrap_or_default();
    let counted = if in_sigma { "in standard deviations".to_owned() } else { format!("in the map's unit{unit}") };
    let remedy = match in_sigma {
        true => "choose thresholds within that range",
        false => "to count thresholds in standard deviations, add --threshold-unit sigma",
    };
    let (of_map, problem) = match doubt {
        Doubt::Missed { of_map } => (of_map, "none lies within the map's values, so there is no contour".to_owned()),
        Doubt::Narrow { of_map, span } => {
            (of_map, format!("together they cover only {} of the map's standard deviations", decimals(span, 3)))
        }
    };
    let [sigma, min, max] = [of_map.sigma, of_map.min, of_map.max].map(|x| decimals(x, 4));
    let verb = if values.len() > 1 { "are" } else { "is" };
    format!("the {range} {verb} {counted}, and {problem} (sigma {sigma}, values from {min} to {max}); {remedy}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stokes_parameters_are_known_by_their_names() {
        for name in ["Q", "u", "Q_POLARISATION", "U-Polarization", "STOKES Q", "Q_STOKES", "Stokes_U", "Q_POL", "U_MAP"]
        {
            assert!(is_stokes(name), "{name}");
        }
        for name in ["T", "TEMPERATURE", "QU", "q2", "U10", "I_STOKES", "u wind", "E_POLARISATION", "", "Q U"] {
            assert!(!is_stokes(name), "{name}");
        }
    }
}
