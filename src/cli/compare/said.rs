//! What files of Minkowski maps say of themselves, and whether it goes together.
//!
//! Only headers are read here.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};
use longan::formats::{self, CardValue, Field, GridDescription, Map, Selection, TableDescription, TablePlace};

use super::super::options::shown;
use super::super::regridding;

/// Thresholds in standard deviations, counted back from the map's unit, are the same within this.
const SAME_THRESHOLD: f64 = 1e-6;

/// Entries that the comparison's header repeats.
const REPEATED: [&str; 11] = [
    "INFILE",
    "INFIELD",
    "INUNIT",
    "INNSIDE",
    regridding::WAY,
    regridding::RATIO,
    "WINDOW",
    "BODY",
    "WEIGHT",
    "THRUNIT",
    "NTHRESH",
];

/// A file of Minkowski maps.
pub(super) struct Said {
    /// The file.
    pub(super) path: PathBuf,
    /// The FITS extension that the maps are in.
    hdu: Option<usize>,
    /// Their Nside.
    pub(super) nside: usize,
    /// Their columns.
    pub(super) columns: Vec<Column>,
    /// Radii of the windows in degrees.
    windows: Vec<f64>,
    /// What has to be the same in all files: what it is, and its value.
    facts: Vec<(&'static str, String)>,
    /// The thresholds in the unit in which they were given, and that unit.
    thresholds: (Vec<f64>, String),
    /// The number of other extensions that hold Minkowski maps, where none was asked for.
    pub(super) others: usize,
    /// Nside of the map that was measured.
    pub(super) input_nside: String,
    /// The way in which that map came to HEALPix; empty where the file does not say it.
    pub(super) way: String,
    /// The spacing of what it was made of, in sides of a pixel, where the file says it.
    pub(super) ratio: Option<f64>,
    /// Entries that the comparison's header repeats.
    pub(super) repeated: Vec<(&'static str, CardValue)>,
}

/// A map of a file.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Column {
    pub(super) name: String,
    pub(super) unit: String,
}

impl Column {
    /// Whether it holds angles, which have neither a mean nor an order.
    pub(super) fn is_direction(&self) -> bool {
        self.unit == "deg" || self.name.to_ascii_uppercase().contains("DIRECTION")
    }

    /// Refuses what cannot be compared.
    pub(super) fn check(&self) -> anyhow::Result<()> {
        ensure!(
            !self.is_direction(),
            "{} is an angle, of which there is no mean or order; compare other measures",
            self.name
        );
        Ok(())
    }

    /// Whether a name is its, in any case and with hyphens as in names of measures.
    pub(super) fn is_called(&self, name: &str) -> bool {
        self.name.eq_ignore_ascii_case(&name.trim().replace('-', "_"))
    }
}

impl Said {
    /// What a file says of itself; nothing where it holds no Minkowski map of longan.
    ///
    /// # Errors
    /// Where it cannot be read, or its maps have several times.
    pub(super) fn of(path: &Path, hdu: Option<usize>) -> anyhow::Result<Option<Self>> {
        let tables = formats::describe(path)?.tables;
        let is_asked_for = |table: &&TableDescription| match table.place {
            TablePlace::Hdu { hdu: this, .. } => hdu.is_none_or(|hdu| hdu == this),
            _ => true,
        };
        let Some(first) = tables.iter().filter(is_asked_for).find(|table| is_minkowski(table)) else { return Ok(None) };
        let all: Vec<&TableDescription> = tables.iter().filter(|table| is_minkowski(table)).collect();
        let (others, hdu, tables) = match first.place {
            TablePlace::Hdu { hdu: this, .. } => {
                (if hdu.is_none() { all.len() - 1 } else { 0 }, Some(this), vec![first])
            }
            _ => (0, None, all),
        };
        let (mut columns, mut nsides) = (Vec::new(), Vec::new());
        for table in tables {
            let GridDescription::Healpix { nside, .. } = table.grid else { continue };
            nsides.push(nside);
            if let Some(time) = table.dimensions.first() {
                bail!(
                    "{}: there are maps for {} places along '{}', and a comparison takes one; write each to a file of \
                     its own with --select",
                    shown(path),
                    time.len,
                    time.name
                );
            }
            columns.extend(table.fields.iter().map(|field| Column {
                name: match &table.place {
                    TablePlace::Variable { variable } => variable.clone(),
                    _ => field.name.clone(),
                },
                unit: field.unit.clone().unwrap_or_default(),
            }));
        }
        let nside = *nsides.first().context("a Minkowski map on a grid")?;
        Ok(Some(Said { others, hdu, ..Self::of_table(path, first, nside, columns) }))
    }

    fn of_table(path: &Path, table: &TableDescription, nside: usize, columns: Vec<Column>) -> Self {
        let word = |key: &str| table.card(key).map(words).unwrap_or_default();
        let window = word("WINDOW");
        let formulas: Vec<String> =
            table.cards.iter().filter(|card| card.key.starts_with("FORMUL")).map(|card| words(&card.value)).collect();
        let mut facts = vec![
            ("Nside", nside.to_string()),
            ("a window of", format!("{window} degrees")),
            ("the body's side", word("BODY")),
            ("the weight", word("WEIGHT")),
            ("the unit of thresholds", word("THRUNIT")),
            ("the number of thresholds", word("NTHRESH")),
            ("the formulas", formulas.join("; ")),
        ];
        let sigma = word("THRUNIT") == "sigma";
        if !sigma {
            facts.push(("the unit of the field", word("INUNIT")));
        }
        let real = |key: &str| table.card(key).and_then(number);
        let raw: Vec<f64> = (1..).map_while(|i| real(&format!("THR{i}"))).collect();
        let thresholds = match (sigma, real("INMEAN"), real("INSIGMA")) {
            (true, Some(mean), Some(sigma)) => raw.iter().map(|threshold| (threshold - mean) / sigma).collect(),
            _ => raw,
        };
        if thresholds.is_empty() {
            facts.push(("the thresholds", word("THRESHOLDS")));
        }
        let repeat = |key: &'static str| Some((key, table.card(key)?.clone()));
        Said {
            path: path.to_owned(),
            hdu: None,
            others: 0,
            nside,
            columns,
            windows: window.split(',').filter_map(|window| window.trim().parse().ok()).collect(),
            facts,
            thresholds: (thresholds, if sigma { "sigma".to_owned() } else { word("INUNIT") }),
            input_nside: word("INNSIDE"),
            way: word(regridding::WAY),
            ratio: real(regridding::RATIO),
            repeated: REPEATED.into_iter().filter_map(repeat).collect(),
        }
    }

    /// Whether another file was made in the same way.
    ///
    /// # Errors
    /// What differs, with both files and both values.
    pub(super) fn check(&self, other: &Said) -> anyhow::Result<()> {
        let differ = |what: &str, mine: &str, others: &str| {
            let or_none = |value: &str| if value.is_empty() { "none".to_owned() } else { value.to_owned() };
            format!(
                "{} has {what} {}, but {} has {what} {}; compare maps that were made in the same way",
                shown(&self.path),
                or_none(mine),
                shown(&other.path),
                or_none(others)
            )
        };
        for (what, mine) in &self.facts {
            let others = other.facts.iter().find(|(same, _)| same == what).map_or("", |(_, value)| value);
            ensure!(mine == others, differ(what, mine, others));
        }
        if let (false, false) = (self.way.is_empty(), other.way.is_empty()) {
            ensure!(self.way == other.way, differ("the way to HEALPix", &self.way, &other.way));
        }
        let near = |(a, b): (&f64, &f64)| (a - b).abs() <= SAME_THRESHOLD * (1.0 + a.abs());
        let (mine, others) = (&self.thresholds.0, &other.thresholds.0);
        let same = mine.len() == others.len() && mine.iter().zip(others).all(near);
        ensure!(same, differ("thresholds", &listed(&self.thresholds), &listed(&other.thresholds)));
        for column in &self.columns {
            let others = other.columns.iter().find(|other| other.is_called(&column.name));
            if let Some(others) = others.filter(|others| others.unit != column.unit) {
                bail!(differ(&format!("{} in the unit", column.name), &column.unit, &others.unit));
            }
        }
        Ok(())
    }

    /// Radius in degrees of the window that a column is of; the largest where the file does not tell.
    pub(super) fn window(&self, column: &str) -> f64 {
        let suffix = |window: &f64| format!("_WINDOW_{window}").replace('.', "_");
        let named = self.windows.iter().copied().find(|window| column.contains(&suffix(window)));
        named.unwrap_or_else(|| self.windows.iter().copied().fold(0.0, f64::max))
    }

    /// Its columns, for people.
    pub(super) fn listed(&self) -> String {
        self.columns.iter().map(|column| column.name.as_str()).collect::<Vec<_>>().join(", ")
    }

    /// Reads a column.
    ///
    /// # Errors
    /// Where it cannot be read.
    pub(super) fn read(&self, column: &Column) -> Result<Map, formats::Error> {
        let name = self.columns.iter().find(|other| other.is_called(&column.name)).unwrap_or(column).name.clone();
        formats::read(&self.path, &Selection { field: Some(Field::Name(name)), hdu: self.hdu, ..Selection::default() })
    }
}

/// The file that a file's maps were made of, as their header names it.
pub(super) fn made_of(path: &Path) -> anyhow::Result<Option<String>> {
    Ok(formats::describe(path)?.tables.first().and_then(|table| table.card("INFILE")).map(words))
}

/// Whether these are Minkowski maps of longan.
fn is_minkowski(table: &TableDescription) -> bool {
    let longan = matches!(table.card("CREATOR"), Some(CardValue::Text(creator)) if creator.starts_with("longan "));
    longan && table.card("WINDOW").is_some() && matches!(table.grid, GridDescription::Healpix { .. })
}

/// A value as text.
fn words(value: &CardValue) -> String {
    match value {
        CardValue::Text(text) => text.clone(),
        CardValue::Real(number) => number.to_string(),
        CardValue::Integer(number) => number.to_string(),
        CardValue::Logical(truth) => truth.to_string(),
    }
}

/// A value as a number, if it is one.
fn number(value: &CardValue) -> Option<f64> {
    match value {
        CardValue::Real(number) => Some(*number),
        CardValue::Integer(number) => Some(*number as f64),
        CardValue::Text(_) | CardValue::Logical(_) => None,
    }
}

/// Thresholds, for people.
fn listed((thresholds, unit): &(Vec<f64>, String)) -> String {
    let round = |x: &f64| ((x / SAME_THRESHOLD).round() * SAME_THRESHOLD * 1e6).round() / 1e6;
    let thresholds: Vec<String> =
        thresholds.iter().map(|x| if x.abs() < 1e6 { round(x) } else { *x }.to_string()).collect();
    format!("{} {unit}", thresholds.join(", ")).trim_end().to_owned()
}
