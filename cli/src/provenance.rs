//! Minkowski maps as they are written: columns, and in headers and attributes what was done.

use std::path::Path;

use longan::measures::{Measure, Origin};
use longan::statistics::Statistics;
use longan::{Analysis, Block, MinkowskiMaps, ThresholdUnit};
use longan_formats::{Card, NetcdfColumn};
use longan_grid::Map;

use super::cards::{creator, integer, numbered, real, text};
use super::identity::Identity;
use super::input::Input;
use super::map_writer::{MapColumn, Step, Table};
use super::quantity::stated;
use super::regridding;

/// The facts that headers state about a map and its analysis.
pub(crate) struct Provenance<'a> {
    /// The input file.
    pub(crate) path: &'a Path,
    /// The field analysed.
    pub(crate) map: &'a Map,
    /// Where it came from.
    pub(crate) input: Option<&'a Input>,
    /// The analysis.
    pub(crate) analysis: &'a Analysis,
    /// The same, and the files, as one value.
    pub(crate) identity: &'a Identity,
    /// The command that did it.
    pub(crate) command: String,
}

/// Formulas and plugins that measures come from.
fn origins(measures: &[impl AsRef<dyn Measure>]) -> Vec<Card> {
    let (mut formulas, mut plugins) = (Vec::new(), Vec::new());
    for measure in measures {
        match measure.as_ref().origin() {
            Origin::Formula(formula) => formulas.push(formula),
            Origin::Plugin(plugin) if !plugins.contains(&plugin.to_string()) => plugins.push(plugin.to_string()),
            Origin::Plugin(_) | Origin::Program => (),
        }
    }
    let formulas =
        (1..).zip(formulas).map(|(n, text)| self::text(&numbered("FORMULA", n), text, "formula of a column"));
    let plugins = (1..).zip(plugins).map(|(n, text)| self::text(&numbered("PLUGIN", n), text, "plugin of measures"));
    formulas.chain(plugins).collect()
}

impl Provenance<'_> {
    /// The Minkowski maps of one step, with their headers.
    pub(crate) fn step(&self, maps: &MinkowskiMaps, measures: &[impl AsRef<dyn Measure>]) -> Step {
        let windows = self.analysis.windows.len();
        let thresholds = maps.blocks.len() / windows;
        let name = |i: usize, window: f64| match (windows, thresholds) {
            (1, 1) => "MINKOWSKI MAP".to_owned(),
            (1, _) => format!("THRESHOLD {}", i + 1),
            (_, 1) => format!("WINDOW {window}"),
            (_, _) => format!("WINDOW {window} THRESHOLD {}", i % thresholds + 1),
        };
        let origins = origins(measures);
        let attributes = [self.attributes(maps, thresholds > 1), origins.clone()].concat();
        let numbers = self.numbers(maps.of_map);
        let tables = maps.blocks.iter().enumerate().map(|(i, block)| {
            let of = self.words(block, (thresholds > 1).then_some(i % thresholds));
            Table {
                name: name(i, block.window),
                cards: [self.cards(maps.of_map, block), origins.clone()].concat(),
                columns: std::iter::zip(measures.iter().map(AsRef::as_ref), block.values.rows())
                    .map(|(measure, values)| MapColumn {
                        name: measure.column(),
                        unit: measure.unit().to_owned(),
                        long_name: match measure.origin() {
                            Origin::Formula(formula) => formula,
                            Origin::Program | Origin::Plugin(_) => format!("{} {of}", measure.definition()),
                        },
                        quantity: Some(stated(measure.quantity().weighted(self.analysis.weight))),
                        values: values.to_vec(),
                    })
                    .collect(),
            }
        });
        Step { time: self.map.time.clone(), tables: tables.collect(), attributes, numbers }
    }

    /// The window of a map, and its threshold if it is of one, in words.
    fn words(&self, block: &Block, threshold: Option<usize>) -> String {
        let window = match block.window {
            0.0 => "of each pixel".to_owned(),
            window => format!("in windows of {window} degrees"),
        };
        match threshold {
            Some(i) => format!("{window}, at {}", self.thresholds(&self.analysis.thresholds.values()[i..=i])),
            None => window,
        }
    }

    /// Thresholds as they were asked for.
    fn thresholds(&self, values: &[f64]) -> String {
        let unit = match (self.analysis.threshold_unit, &self.map.unit) {
            (ThresholdUnit::Sigma, _) => " sigma",
            (_, Some(unit)) => &format!(" {unit}"),
            (_, None) => "",
        };
        let values: Vec<_> = values.iter().map(f64::to_string).collect();
        format!("{}{unit}", values.join(", "))
    }

    /// Whether thresholds depend on the map's mean and scatter.
    fn of_the_step(&self) -> bool {
        self.map.time.is_some() && self.analysis.threshold_unit == ThresholdUnit::Sigma
    }

    /// The attributes of a file as a whole: the entries of the first table, without those that differ between tables or steps.
    fn attributes(&self, maps: &MinkowskiMaps, sequence: bool) -> Vec<Card> {
        let windows: Vec<_> = self.analysis.windows.iter().map(f64::to_string).collect();
        let mut cards = vec![text("TITLE", format!("Minkowski map of {}", self.map.name), "")];
        for card in self.cards(maps.of_map, &maps.blocks[0]) {
            let of_input = ["INMEAN", "INSIGMA"].contains(&&*card.key);
            let of_thresholds =
                card.key == "NTHRESH" || card.key.strip_prefix("THR").is_some_and(|n| n.parse::<u32>().is_ok());
            cards.push(match card.key.as_str() {
                _ if of_input && self.map.time.is_some() => continue,
                _ if of_thresholds && (sequence || self.of_the_step()) => continue,
                "WINDOW" if windows.len() > 1 => text("WINDOW", windows.join(", "), ""),
                "PSIERROR" => {
                    real("PSIERROR", maps.blocks.iter().map(|block| block.counts.error).fold(0.0, f64::max), "")
                }
                "COMMAND" => text("HISTORY", self.command.clone(), ""),
                _ => card,
            });
        }
        cards.push(text("THRESHOLDS", self.thresholds(self.analysis.thresholds.values()), ""));
        cards
    }

    /// The numbers that each step has by itself.
    fn numbers(&self, of_map: Statistics) -> Vec<(NetcdfColumn, f64)> {
        if self.map.time.is_none() {
            return Vec::new();
        }
        let number = |name: &str, what: &str, value: f64| {
            let (name, long_name) = (name.to_owned(), format!("{what} of the unmasked pixels of {}", self.map.name));
            let unit = self.map.unit.clone().unwrap_or_default();
            (NetcdfColumn { name, unit, long_name, quantity: None }, value)
        };
        vec![number("input_mean", "mean", of_map.mean), number("input_sigma", "standard deviation", of_map.sigma)]
    }

    fn cards(&self, of_map: Statistics, block: &Block) -> Vec<Card> {
        let (map, analysis, thresholds) = (self.map, self.analysis, block.thresholds.values());
        let mut cards = input_cards(self.path, map);
        if let Some(input) = self.input {
            cards.extend(mask_cards(input));
        }
        cards.extend([
            real("INMEAN", of_map.mean, "mean of the unmasked pixels"),
            real("INSIGMA", of_map.sigma, "their standard deviation"),
            real("WINDOW", block.window, "[deg] radius of the window, 0: the pixel itself"),
            real("PSIERROR", block.counts.error, "error of psi_s over sum of |weights|, 0: direct sum"),
            real("MAXMASK", analysis.max_masked, "largest share of masked cells in a window"),
            real("MINCONT", analysis.min_contour, "[window radii] least contour for ratios"),
            text("BODY", analysis.body.name(), "side of the threshold"),
            text("WEIGHT", analysis.weight.name(), "W_1 or W_2 tensors"),
            text("THRUNIT", analysis.threshold_unit.name(), "unit in which thresholds were given"),
            integer("NTHRESH", thresholds.len(), "number of thresholds averaged over"),
        ]);
        // Without scatter there are no multiples of it.
        let known = analysis.threshold_unit == ThresholdUnit::Value || of_map.sigma > 0.0;
        for (i, threshold) in thresholds.iter().enumerate().filter(|_| known) {
            cards.push(real(&format!("THR{}", i + 1), *threshold, "threshold, in the unit of the field"));
        }
        cards.extend(self.identity.cards());
        cards.push(text("COMMAND", self.command.clone(), "command that made this file"));
        cards
    }
}

/// The header entries about the map that a file is made of.
pub(crate) fn input_cards(path: &Path, map: &Map) -> Vec<Card> {
    let mut cards = vec![creator()];
    // Maps in memory have no file.
    if !path.as_os_str().is_empty() {
        cards.push(text("INFILE", path.to_string_lossy(), "file analysed"));
    }
    cards.extend([
        text("INFIELD", map.name.clone(), "field analysed"),
        text("INUNIT", map.unit.clone().unwrap_or_default(), "its unit"),
        integer("INNSIDE", map.grid().nside(), "its Nside"),
    ]);
    cards.extend(regridding::cards(map));
    cards
}

/// The header entries about the mask, if there is one.
pub(crate) fn mask_cards(input: &Input) -> Vec<Card> {
    let Some(mask) = &input.mask else { return Vec::new() };
    let mut cards = vec![text("MASKFILE", mask.to_string_lossy(), "mask")];
    if let Some(field) = &input.mask_field {
        cards.push(text("MASKFLD", field.to_string().trim_matches('\''), "field of the mask"));
    }
    cards.push(real("MASKTHR", input.mask_threshold, "masked below this mask value"));
    cards
}
