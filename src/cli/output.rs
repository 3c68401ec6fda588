//! Minkowski maps as FITS files: columns, and in the header what was done.

use std::path::Path;

use longan::formats::{Card, CardValue, Column, CoordinateSystem, Extension, HealpixFile, Map, Ordering};
use longan::measures::{Measure, Origin};
use longan::{Analysis, Body, MinkowskiMaps, ThresholdUnit, Weight};

use super::options::Input;

/// What is said in the header about a map and its analysis.
pub(crate) struct Provenance<'a> {
    /// The input file.
    pub(crate) path: &'a Path,
    /// The field analysed.
    pub(crate) map: &'a Map,
    /// Where it came from.
    pub(crate) input: &'a Input,
    /// What was done with it.
    pub(crate) analysis: &'a Analysis,
    /// The command that did it.
    pub(crate) command: String,
}

/// A header entry.
pub(crate) fn card(key: &str, value: CardValue, comment: &str) -> Card {
    Card { key: key.to_owned(), value, comment: comment.to_owned() }
}

/// A text entry.
pub(crate) fn text(key: &str, value: impl Into<String>, comment: &str) -> Card {
    card(key, CardValue::Text(value.into()), comment)
}

/// A real entry.
pub(crate) fn real(key: &str, value: f64, comment: &str) -> Card {
    card(key, CardValue::Real(value), comment)
}

/// An integer entry.
pub(crate) fn integer(key: &str, value: usize, comment: &str) -> Card {
    card(key, CardValue::Integer(value as i64), comment)
}

/// Name and version of this program.
pub(crate) fn creator() -> Card {
    text("CREATOR", concat!("longan ", env!("CARGO_PKG_VERSION")), "program that wrote this file")
}

/// Formulas and plugins that measures come from.
fn origins(measures: &[impl AsRef<dyn Measure>]) -> Vec<Card> {
    let (mut formulas, mut plugins) = (Vec::new(), Vec::new());
    for measure in measures {
        match measure.as_ref().origin() {
            Origin::Formula(formula) => formulas.push(formula),
            Origin::Plugin(plugin) if !plugins.contains(&plugin) => plugins.push(plugin),
            Origin::Plugin(_) | Origin::Program => (),
        }
    }
    let formulas =
        (1..).zip(formulas).map(|(n, text)| self::text(&numbered("FORMULA", n), text, "formula of a column"));
    let plugins = (1..).zip(plugins).map(|(n, text)| self::text(&numbered("PLUGIN", n), text, "plugin of measures"));
    formulas.chain(plugins).collect()
}

/// A keyword with a number, within the eight characters of FITS: FORMULA1 to FORMULA9, FORMUL10 and so on.
fn numbered(keyword: &str, number: usize) -> String {
    let number = number.to_string();
    let room = 8usize.saturating_sub(number.len()).min(keyword.len());
    format!("{}{number}", &keyword[..room])
}

impl Provenance<'_> {
    /// A file of these maps, one extension each.
    pub(crate) fn file(
        &self,
        maps: Vec<MinkowskiMaps>,
        measures: &[impl AsRef<dyn Measure>],
        ordering: Ordering,
        float32: bool,
    ) -> HealpixFile {
        let windows = self.analysis.windows.len();
        let thresholds = maps.len() / windows;
        let name = |i: usize, window: f64| match (windows, thresholds) {
            (1, 1) => "MINKOWSKI MAP".to_owned(),
            (1, _) => format!("THRESHOLD {}", i + 1),
            (_, 1) => format!("WINDOW {window}"),
            (_, _) => format!("WINDOW {window} THRESHOLD {}", i % thresholds + 1),
        };
        let grid = maps[0].grid;
        let extensions = maps.into_iter().enumerate().map(|(i, maps)| {
            let name = name(i, maps.window);
            let cards = [self.cards(&maps), origins(measures)].concat();
            let columns = measures.iter().map(AsRef::as_ref).zip(maps.values);
            Extension {
                name,
                cards,
                history: Vec::new(),
                columns: columns
                    .map(|(measure, values)| Column { name: measure.column(), unit: measure.unit().to_owned(), values })
                    .collect(),
            }
        });
        HealpixFile { grid, ordering, coordinates: self.coordinates(), float32, extensions: extensions.collect() }
    }

    fn coordinates(&self) -> Option<CoordinateSystem> {
        self.map.coordinates
    }

    fn cards(&self, maps: &MinkowskiMaps) -> Vec<Card> {
        let (map, analysis, thresholds) = (self.map, self.analysis, maps.thresholds.values());
        let mut cards = vec![
            creator(),
            text("INFILE", self.path.to_string_lossy(), "file analysed"),
            text("INFIELD", map.name.clone(), "field analysed"),
            text("INUNIT", map.unit.clone().unwrap_or_default(), "its unit"),
            integer("INNSIDE", map.grid().nside(), "its Nside"),
        ];
        if let Some(mask) = &self.input.mask {
            cards.push(text("MASKFILE", mask.to_string_lossy(), "mask"));
            if let Some(field) = &self.input.mask_field {
                cards.push(text("MASKFLD", field.to_string().trim_matches('\''), "field of the mask"));
            }
            cards.push(real("MASKTHR", self.input.mask_threshold, "masked below this mask value"));
        }
        cards.extend([
            real("INMEAN", maps.of_map.mean, "mean of the unmasked pixels"),
            real("INSIGMA", maps.of_map.sigma, "their standard deviation"),
            real("WINDOW", maps.window, "[deg] radius of the window, 0: the pixel itself"),
            real("PSIERROR", maps.ways.error, "error of psi_s over sum of |weights|, 0: direct sum"),
            real("MAXMASK", analysis.max_masked, "largest share of masked cells in a window"),
            text("BODY", if analysis.body == Body::Above { "above" } else { "below" }, "side of the threshold"),
            text(
                "WEIGHT",
                if analysis.weight == Weight::Length { "length" } else { "curvature" },
                "W_1 or W_2 tensors",
            ),
            text(
                "THRUNIT",
                if analysis.threshold_unit == ThresholdUnit::Sigma { "sigma" } else { "value" },
                "unit in which thresholds were given",
            ),
            integer("NTHRESH", thresholds.len(), "number of thresholds averaged over"),
        ]);
        for (i, threshold) in thresholds.iter().enumerate() {
            cards.push(real(&format!("THR{}", i + 1), *threshold, "threshold, in the unit of the field"));
        }
        cards.push(text("COMMAND", self.command.clone(), "command that made this file"));
        cards
    }
}
